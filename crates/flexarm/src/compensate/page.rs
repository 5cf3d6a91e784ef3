//! The page of a compensation: error before and after over time, on other plants, changes of the joints; one file without scripts.

use std::fmt::Write as _;

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};

use super::{Compensation, ErrorFigures};

const STYLE: &str = "\
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #1c2530; background: #fff }
table { border-collapse: collapse; margin: 1rem 0 } td, th { padding: .25rem .7rem; text-align: right; border-bottom: 1px solid #d8dee6 }
td:first-child, th:first-child { text-align: left } .no { color: #9a5b00 } svg { max-width: 100%; height: auto }
";

/// The page.
pub(super) fn html(answer: &Compensation) -> String {
    let title = format!("Compensation of {} on {}", escaped(&answer.motion), escaped(&answer.robot));
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"generator\" content=\"flexarm {}\">\n<title>{title}</title>\n<style>{STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n",
        env!("CARGO_PKG_VERSION")
    );
    let _ = writeln!(
        page,
        "<p>Largest distance of the tool from the rigid arm's: {:.4} mm before, <b>{:.4} mm</b> after ({}, {} iterations).</p>",
        1e3 * answer.before.peak_m,
        1e3 * answer.after.peak_m,
        answer.method,
        answer.iterations
    );
    for caveat in &answer.caveats {
        let _ = writeln!(page, "<p class=\"no\">{}</p>", escaped(&caveat.message));
    }
    page += &curves(answer);
    page += "<h2>On other plants</h2>\n<table><tr><th>plant</th><th>peak before (mm)</th><th>after</th><th>RMS before</th><th>after</th><th>taken away</th></tr>\n";
    page += &row("as given", &answer.before, &answer.after);
    for plant in &answer.plants {
        page += &row(&escaped(&plant.plant), &plant.before, &plant.after);
    }
    page += "</table>\n<h2>Largest change of each joint</h2>\n<table><tr><th>joint</th><th>rad or m</th><th>deg</th></tr>\n";
    for change in &answer.changes {
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td>{:.3e}</td><td>{:.4}</td></tr>",
            escaped(&change.joint),
            change.largest,
            change.largest.to_degrees()
        );
    }
    page += "</table>\n";
    page += "<p>Not taken away: noise, play and hysteresis of gears, what is quicker than the cutoff, and what the model does not know.</p>\n";
    page + "</body></html>\n"
}

fn row(name: &str, before: &ErrorFigures, after: &ErrorFigures) -> String {
    format!(
        "<tr><td>{name}</td><td>{:.4}</td><td>{:.4}</td><td>{:.4}</td><td>{:.4}</td><td>{:.1} %</td></tr>\n",
        1e3 * before.peak_m,
        1e3 * after.peak_m,
        1e3 * before.rms_m,
        1e3 * after.rms_m,
        100.0 * (1.0 - after.rms_m / before.rms_m.max(f64::MIN_POSITIVE))
    )
}

fn curves(answer: &Compensation) -> String {
    // As many points as the picture can show.
    let every = (answer.curves.len() / 1500).max(1);
    let column = |k: usize, factor: f64| -> Vec<f64> {
        answer
            .curves
            .chunks(every)
            .map(|c| factor * if k == 0 { c[0][0] } else { c.iter().map(|row| row[k]).fold(0.0, f64::max) })
            .collect()
    };
    let curve =
        |name: &str, look, k: usize| PlotCurve { name: name.into(), look, x: column(0, 1.0), y: column(k, 1e3) };
    let panel = |label: &str, logarithmic| Panel {
        label: label.into(),
        logarithmic,
        legend: true,
        curves: vec![curve("before", CurveLook::Plain, 1), curve("after", CurveLook::Plain, 2)],
    };
    let panels = [panel("distance of the tool (mm)", false), panel("the same, logarithmic (mm)", true)];
    let plot = LinePlot {
        title: "The tool from where the rigid arm has it",
        x_label: "time (s)",
        panels: &panels,
        ..LinePlot::default()
    };
    plot.svg().unwrap_or_default()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
