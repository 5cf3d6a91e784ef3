//! The page of an identification: what was found, residuals, correlation, expected against measured; one file without scripts.

use std::fmt::Write as _;

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};

use super::{Compared, Identification};
use crate::html_page::opening;
use flexarm_settings::written::markup;

/// The page.
pub(super) fn html(answer: &Identification) -> String {
    let correlation_style = ".correlation td { text-align: center; font-size: 12px; min-width: 2.6rem }\n";
    let mut page = opening(&format!("Identification of {}", answer.robot), correlation_style);
    let _ = writeln!(
        page,
        "<p>{} readings with {} numbers from {}.</p>",
        answer.readings,
        answer.numbers,
        markup(&answer.measurements)
    );
    page += &headline(answer);
    for caveat in &answer.caveats {
        let _ = writeln!(page, "<p class=\"no\">{}</p>", markup(&caveat.message));
    }
    page += &parameters(answer);
    page += &suspicious(answer);
    for unit in ["m", "rad", "Hz", "ln", "1", "m/N", "m/(s N)", "m/(s2 N)"] {
        let of: Vec<&Compared> = answer.compared.iter().filter(|c| c.unit == unit).collect();
        if !of.is_empty() {
            page += &plots(unit, &of);
        }
    }
    page += &correlation(answer);
    page + "</body></html>\n"
}

/// Unit for people, and its factor.
fn readable(unit: &str) -> (&'static str, f64) {
    match unit {
        "m" => ("mm", 1e3),
        "rad" => ("mrad", 1e3),
        "Hz" => ("Hz", 1.0),
        "ln" => ("of the logarithm", 1.0),
        "1" => ("parts of the shape", 1.0),
        "m/N" => ("mm/kN", 1e6),
        "m/(s N)" => ("m/(s N)", 1.0),
        "m/(s2 N)" => ("m/(s² N)", 1.0),
        _ => ("standard deviations", 1.0),
    }
}

fn headline(answer: &Identification) -> String {
    let (unit, factor) = readable(answer.residual.unit);
    let mut out = format!(
        "<p>Residual (RMS): {:.4} {unit} before, <b>{:.4} {unit}</b> after",
        factor * answer.residual.before,
        factor * answer.residual.after
    );
    if let Some(held) = &answer.held_out {
        let _ = write!(out, "; of readings that the fit had not seen {:.4} {unit}", factor * held.rms);
    }
    out + ".</p>\n"
}

fn parameters(answer: &Identification) -> String {
    let mut out = String::from(
        "<h2>Parameters</h2>\n<table><tr><th>parameter</th><th>before</th><th>value</th><th>std</th><th>95 % interval</th><th>unit</th></tr>\n",
    );
    for p in &answer.parameters {
        let (class, value) = match p.identifiable {
            true => ("", number(p.value)),
            false => (" class=\"no\"", "not told: as before".to_owned()),
        };
        let _ = writeln!(
            out,
            "<tr{class}><td>{}</td><td>{}</td><td>{value}</td><td>{}</td><td>{} to {}</td><td>{}</td></tr>",
            markup(&p.name),
            number(p.initial),
            number(p.std),
            number(p.interval[0]),
            number(p.interval[1]),
            markup(&p.unit)
        );
    }
    out += "</table>\n";
    for combination in &answer.untold {
        let parts: Vec<String> = combination.iter().map(|w| format!("{:+.2} {}", w.weight, markup(&w.name))).collect();
        let _ = writeln!(out, "<p class=\"note\">Not told by the readings: {}</p>", parts.join(" "));
    }
    out
}

fn suspicious(answer: &Identification) -> String {
    if answer.suspicious.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<h2>Readings that argue against the rest</h2>\n<table><tr><th>reading</th><th>measured</th><th>expected</th><th>in deviations</th></tr>\n",
    );
    for s in &answer.suspicious {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.1}</td></tr>",
            markup(&s.reading),
            number(s.measured),
            number(s.expected),
            s.normalised
        );
    }
    out + "</table>\n"
}

fn plots(unit: &'static str, of: &[&Compared]) -> String {
    let (name, factor) = readable(unit);
    let x: Vec<f64> = (1..=of.len()).map(|k| k as f64).collect();
    let curve = |label: &str, y: Vec<f64>| PlotCurve { name: label.into(), look: CurveLook::Dots, x: x.clone(), y };
    let residual =
        |value: fn(&Compared) -> f64| of.iter().map(|c| factor * (c.measured - value(c))).collect::<Vec<_>>();
    let panel = |label: String, curves| Panel { label, logarithmic: false, legend: true, curves };
    let panels = [
        panel(
            format!("residual ({name})"),
            vec![curve("before", residual(|c| c.before)), curve("after", residual(|c| c.after))],
        ),
        panel(
            format!("measured and expected ({name})"),
            vec![
                curve("measured", of.iter().map(|c| factor * c.measured).collect()),
                curve("expected", of.iter().map(|c| factor * c.after).collect()),
            ],
        ),
    ];
    let title = format!("Numbers in {name}");
    let plot = LinePlot { title: &title, x_label: "number of the reading", panels: &panels, ..LinePlot::default() };
    plot.svg().map(|svg| format!("<h2>{title}</h2>\n{svg}\n")).unwrap_or_default()
}

fn correlation(answer: &Identification) -> String {
    let mut out = String::from("<h2>Correlation</h2>\n<table class=\"correlation\"><tr><th></th>");
    for k in 0..answer.parameters.len() {
        let _ = write!(out, "<th>{}</th>", k + 1);
    }
    out += "</tr>\n";
    for (k, (p, row)) in answer.parameters.iter().zip(&answer.correlation).enumerate() {
        let _ = write!(out, "<tr><td>{} {}</td>", k + 1, markup(&p.name));
        for c in row {
            let color = if *c >= 0.0 { "47, 111, 179" } else { "194, 89, 34" };
            let _ = write!(out, "<td style=\"background: rgba({color}, {:.2})\">{c:.2}</td>", 0.75 * c.abs());
        }
        out += "</tr>\n";
    }
    out + "</table>\n"
}

/// A number with the digits that a person reads.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if (1e-3..1e5).contains(&a) => {
            let digits = (3 - a.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{x:.digits$}")
        }
        _ => format!("{x:.3e}"),
    }
}
