//! HTML page of an identification: estimates, instruments and targets, residuals, curves of
//! responses and encoders against the model, correlation; a single file without scripts.

use std::fmt::Write as _;

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};

use super::{Compared, EncoderFigures, FoundFrame, FoundPoint, Identification, ResponseCurves};
use flexarm_run::html_page::{ENDING, opening, warnings};
use flexarm_settings::written::markup;

/// Maximum number of plotted samples of a recording.
const MAX_SAMPLES: usize = 1500;

/// Returns the HTML page.
pub(super) fn html(answer: &Identification) -> String {
    let mut page = opening(&format!("Identification of {}", answer.robot));
    let _ = writeln!(
        page,
        "<p>{} readings with {} numbers from {}.</p>",
        answer.readings,
        answer.numbers,
        markup(&answer.measurements)
    );
    page += &headline(answer);
    page += &warnings("", &answer.caveats.iter().map(|caveat| caveat.message.clone()).collect::<Vec<_>>());
    page += &parameters(answer);
    // Poses of the instruments and positions of the targets, if fitted.
    if !(answer.instruments.is_empty() && answer.targets.is_empty()) {
        page += "<h2>Instruments and targets</h2>\n";
    }
    let three = |v: [f64; 3], digits: usize| v.map(|x| format!("{x:.digits$}")).join(", ");
    for FoundFrame { name, xyz, rpy } in &answer.instruments {
        let (at, turn) = (three(xyz.map(|x| 1e3 * x), 3), three(rpy.map(f64::to_degrees), 4));
        let name = markup(name);
        let _ = writeln!(page, "<p>Instrument {name}: {at} mm in the world; roll, pitch, yaw {turn} degrees</p>");
    }
    for FoundPoint { name, link, xyz } in &answer.targets {
        let (name, at, link) = (markup(name), three(xyz.map(|x| 1e3 * x), 3), markup(link));
        let _ = writeln!(page, "<p>Target {name}: {at} mm in the axes of {link}</p>");
    }
    page += &suspicious(answer);
    // Residuals, one plot per kind and unit; then curves.
    let mut drawn: Vec<(&str, &str)> = Vec::new();
    for c in &answer.compared {
        if !drawn.contains(&(c.kind, c.unit)) {
            drawn.push((c.kind, c.unit));
            let alike: Vec<&Compared> =
                answer.compared.iter().filter(|other| (other.kind, other.unit) == (c.kind, c.unit)).collect();
            page += &residuals(c.kind, c.unit, &alike);
        }
    }
    answer.responses.iter().for_each(|response| page += &response_plot(response));
    answer.encoders.iter().for_each(|gear| page += &encoder_plot(gear));
    page += &correlation(answer);
    page + ENDING
}

/// Returns the display unit and its factor.
fn readable(unit: &str) -> (&'static str, f64) {
    match unit {
        "m" => ("mm", 1e3),
        "rad" => ("mrad", 1e3),
        "Hz" => ("Hz", 1.0),
        "ln" => ("log units", 1.0),
        "1" => ("relative to the shape", 1.0),
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
        let _ = write!(out, "; of held-out readings {:.4} {unit}", factor * held.rms);
    }
    out + ".</p>\n"
}

fn parameters(answer: &Identification) -> String {
    let mut out = String::from(
        "<h2>Parameters</h2>\n<table><tr><th>parameter</th><th>before</th><th>value</th><th>std</th><th>95 % interval</th><th>unit</th></tr>\n",
    );
    for p in &answer.parameters {
        let (class, value) = match (p.identifiable, p.rigid) {
            (true, _) => ("", number(p.value)),
            (false, true) => ("", format!("{} (rigid within the readings)", number(p.value))),
            (false, false) => (" class=\"no\"", format!("{} (not determined alone)", number(p.value))),
        };
        let _ = writeln!(
            out,
            "<tr{class}><td>{}</td><td>{}</td><td>{value}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            markup(&p.name),
            number(p.initial),
            number(p.std),
            interval(p.interval),
            markup(&p.unit)
        );
    }
    out += "</table>\n";
    for text in &answer.combinations {
        let _ = writeln!(out, "<p class=\"note\">{}</p>", markup(text));
    }
    out
}

fn suspicious(answer: &Identification) -> String {
    if answer.suspicious.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<h2>Suspected outliers</h2>\n<table><tr><th>reading</th><th>measured</th><th>expected</th>\
         <th>residual [standard deviations]</th></tr>\n",
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

/// Plots the residuals of one kind of reading, before and after.
fn residuals(kind: &str, unit: &str, of: &[&Compared]) -> String {
    let (name, factor) = readable(unit);
    let x: Vec<f64> = (1..=of.len()).map(|k| k as f64).collect();
    let curve = |label: &str, value: fn(&Compared) -> f64| PlotCurve {
        name: label.into(),
        look: CurveLook::Dots,
        x: x.clone(),
        y: of.iter().map(|c| factor * (c.measured - value(c))).collect(),
    };
    let curves = vec![curve("before", |c| c.before), curve("after", |c| c.after)];
    let panel = Panel { label: format!("residual [{name}]"), logarithmic: false, legend: true, curves };
    picture(&format!("Residuals of {kind} [{name}]"), "number", &[panel])
}

/// Plots the magnitude of a frequency response: measured, and of the model before and after.
fn response_plot(response: &ResponseCurves) -> String {
    let styles = [CurveLook::Dots, CurveLook::Dashed, CurveLook::Plain];
    let curves = ["measured", "model before", "model after"].into_iter().zip(styles).zip(&response.magnitude);
    let curves =
        curves.map(|((name, look), y)| PlotCurve { name: name.into(), look, x: response.hz.clone(), y: y.clone() });
    let label = format!("magnitude [{}]", response.unit);
    let panel = Panel { label, logarithmic: true, legend: true, curves: curves.collect() };
    picture(&format!("Response: {}", response.name), "frequency [Hz]", &[panel])
}

/// Plots the deflection of a gear over time: measured, and predicted from its torque.
fn encoder_plot(gear: &EncoderFigures) -> String {
    let panel = |(number, ([measured, expected], step_s)): (usize, (&[Vec<f64>; 2], &f64))| {
        let every = measured.len().div_ceil(MAX_SAMPLES).max(1);
        let curve = |name: &str, look, y: &[f64]| PlotCurve {
            name: name.into(),
            look,
            x: (0..y.len()).step_by(every).map(|k| step_s * k as f64).collect(),
            y: y.iter().step_by(every).map(|y| 1e3 * y).collect(),
        };
        let curves =
            vec![curve("measured", CurveLook::Dots, measured), curve("torque / stiffness", CurveLook::Plain, expected)];
        Panel { label: format!("run {} [1e-3 rad, m]", number + 1), logarithmic: false, legend: number == 0, curves }
    };
    let panels: Vec<Panel> = gear.curves.iter().zip(&gear.steps_s).enumerate().map(panel).collect();
    picture(&format!("Deflection of the gear of {}", gear.joint), "time [s]", &panels)
}

/// Returns a heading with its plot; nothing if there are no finite values.
fn picture(title: &str, x_label: &str, panels: &[Panel]) -> String {
    let plot = LinePlot { title, x_label, panels, ..LinePlot::default() };
    plot.svg().map(|svg| format!("<h2>{}</h2>\n{svg}\n", markup(title))).unwrap_or_default()
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

fn interval([low, high]: [f64; 2]) -> String {
    if low.is_nan() { "-".into() } else { format!("{} to {}", number(low), number(high)) }
}

/// Formats a number with about four significant digits.
fn number(x: f64) -> String {
    match x.abs() {
        a if a.is_nan() => "-".into(),
        0.0 => "0".into(),
        a if (1e-3..1e5).contains(&a) => {
            let digits = (3 - a.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{x:.digits$}")
        }
        _ => format!("{x:.3e}"),
    }
}
