//! HTML page of a compensation: error before and after over time, on other plants, changes of the
//! joints; a single file without scripts.

use std::fmt::Write as _;
use std::path::Path;

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};

use super::{Compensation, ErrorFigures};
use flexarm_run::html_page::{ENDING, opening, warnings};
use flexarm_settings::written::markup;

/// Returns the page.
pub(super) fn html(answer: &Compensation) -> String {
    let motion = Path::new(&answer.motion).file_stem().unwrap_or_default().to_string_lossy();
    let mut page = opening(&format!("Compensation of {motion} on {}", answer.robot));
    let _ = writeln!(
        page,
        "<p>Maximum TCP error (distance from the TCP of the rigid arm): {:.4} mm before, <b>{:.4} mm</b> after \
         ({} method, {} iterations{}).</p>",
        1e3 * answer.before.peak_m,
        1e3 * answer.after.peak_m,
        answer.method,
        answer.iterations,
        answer.cutoff_hz.map(|hz| format!(", corrected up to {hz:.1} Hz")).unwrap_or_default()
    );
    page += &warnings("", &answer.caveats.iter().map(|caveat| caveat.message.clone()).collect::<Vec<_>>());
    // Errors over time, and on plants that differ from the model.
    page += &curves(answer);
    page += "<h2>Other plants</h2>\n<table><tr><th>plant</th><th>peak before (mm)</th><th>peak after (mm)</th>\
             <th>RMS before (mm)</th><th>RMS after (mm)</th><th>RMS reduction</th></tr>\n";
    page += &row("as given", &answer.before, &answer.after);
    for plant in &answer.plants {
        page += &row(&markup(&plant.plant), &plant.before, &plant.after);
    }
    page += "</table>\n";
    if answer.plants.iter().any(|plant| plant.after.rms_m > plant.before.rms_m) {
        page += "<p>If the error increases, the commands correct a deflection that this plant does not have.</p>\n";
    }
    // Maximum change of the command of each joint.
    page += "<h2>Maximum change of each joint</h2>\n<table><tr><th>joint</th><th>rad or m</th><th>deg</th></tr>\n";
    for change in &answer.changes {
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td>{:.3e}</td><td>{:.4}</td></tr>",
            markup(&change.joint),
            change.largest,
            change.largest.to_degrees()
        );
    }
    page += "</table>\n";
    page += &shaper(answer);
    page += &limits(answer);
    page += "<p>Not corrected: noise, backlash and hysteresis of gearboxes, errors above the cutoff frequency, and \
             effects that are not in the model.</p>\n";
    page + ENDING
}

/// Describes the predicted residual vibration without and with the shaper.
fn shaper(answer: &Compensation) -> String {
    let Some(shaper) = &answer.shaper else { return String::new() };
    let mut text = format!(
        "<h2>Shaper</h2>\n<p>{}, {} copies, {:.4} s longer. Predicted residual vibration after the motion:</p>\n\
         <table><tr><th>mode (Hz)</th><th>damping ratio</th><th>unshaped (mm)</th><th>shaped (mm)</th></tr>\n",
        shaper.kind,
        shaper.copies.len(),
        answer.shaper_delay_s
    );
    for mode in &shaper.modes {
        let _ = writeln!(
            text,
            "<tr><td>{:.3}</td><td>{:.4}</td><td>{:.4}</td><td>{:.4}</td></tr>",
            mode.frequency_hz,
            mode.damping_ratio,
            1e3 * mode.before_m,
            1e3 * mode.after_m
        );
    }
    text + "</table>\n"
}

/// Lists the violated limits, and the factor by which the motion was slowed.
fn limits(answer: &Compensation) -> String {
    let mut text = String::from("<h2>Joint limits</h2>\n");
    if answer.slowed > 1.0 {
        let _ = writeln!(
            text,
            "<p>The motion is slowed down by a factor of {:.4} to satisfy the limits.</p>",
            answer.slowed
        );
    }
    if answer.limits.is_empty() {
        return text + "<p>All limits are satisfied.</p>\n";
    }
    text += "<table><tr><th>joint</th><th>quantity</th><th>value</th><th>limit</th><th>time (s)</th></tr>\n";
    for limit in &answer.limits {
        let _ = writeln!(
            text,
            "<tr><td>{}</td><td>{}</td><td>{:.4}</td><td>{:.4}</td><td>{:.3}</td></tr>",
            markup(&limit.joint),
            limit.kind,
            limit.value,
            limit.limit,
            limit.time_s
        );
    }
    text + "</table>\n"
}

/// Returns a row of the table of plants; `name` is HTML.
fn row(name: &str, before: &ErrorFigures, after: &ErrorFigures) -> String {
    format!(
        "<tr><td>{name}</td><td>{:.4}</td><td>{:.4}</td><td>{:.4}</td><td>{:.4}</td><td>{}</td></tr>\n",
        1e3 * before.peak_m,
        1e3 * after.peak_m,
        1e3 * before.rms_m,
        1e3 * after.rms_m,
        before.reduction_to(after)
    )
}

/// Plots the error over time, linear and logarithmic.
fn curves(answer: &Compensation) -> String {
    // Limit the number of points to what the plot can show.
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
    let panels = [panel("TCP error (mm)", false), panel("TCP error, logarithmic (mm)", true)];
    let plot = LinePlot {
        title: "Distance of the TCP from that of the rigid arm",
        x_label: "time (s)",
        panels: &panels,
        ..LinePlot::default()
    };
    plot.svg().unwrap_or_default()
}
