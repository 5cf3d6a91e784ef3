//! Output files of `flexarm lobes`: table, diagram, page, figures.
//!
//! Start at [`save`]. Depths are shown rounded down, so that a printed limit is stable.
//!
//! Not here: the limits, and texts of the terminal.

use std::fmt::Write as _;
use std::path::PathBuf;

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve, PlotError};
use flexarm_files::write_all;

use super::tool_file::CuttingTool;
use super::{LobePoint, Lobes, LobesFiles};
use flexarm_run::Error;
use flexarm_run::html_page::{ENDING, opening, warnings};

/// File names in the output folder.
pub(super) const NAMES: [&str; 4] = ["lobes.csv", "lobes.svg", "lobes.html", "lobes.json"];
/// Ratio of maximum to minimum above which limits and frequencies have a logarithmic axis.
const WIDE: f64 = 40.0;
/// Maximum number of poses with a curve each.
const DRAWN: usize = 8;

/// Writes table, diagram, page and figures, and their names into the result.
pub(super) fn save(answer: &mut Lobes, tool: &CuttingTool, paths: [PathBuf; 4]) -> Result<(), Error> {
    let text = |k: usize| Some(paths[k].display().to_string());
    let picture = plot(answer, tool).ok();
    answer.files = LobesFiles { csv: text(0), plot: picture.as_ref().and(text(1)), page: text(2), json: text(3) };
    answer.file = text(0);
    let json = serde_json::to_string_pretty(answer).expect("plain numbers and strings") + "\n";
    let page = html(answer, picture.as_deref());
    let contents = [Some(csv(answer)), picture, Some(page), Some(json)];
    let files = paths.into_iter().zip(contents).filter_map(|(path, content)| Some((path, content?)));
    Ok(write_all(&files.collect::<Vec<_>>())?)
}

/// Formats a positive number with the given number of decimals, or as many as show two significant
/// digits. Rounds down, so that a depth below a stability limit remains below it.
pub fn rounded_down(x: f64, digits: usize) -> String {
    let needed = if x > 0.0 { (1.0 - x.log10().floor()).clamp(0.0, 12.0) as usize } else { 0 };
    let digits = digits.max(needed);
    let text = format!("{x:.digits$}");
    match text.parse::<f64>() {
        Ok(rounded) if rounded > x => format!("{:.digits$}", rounded - 0.1_f64.powi(digits as i32)),
        _ => text,
    }
}

/// Formats a cell, empty without a value.
fn cell(x: Option<f64>) -> String {
    x.map_or_else(String::new, |x| x.to_string())
}

/// Returns the table of the limits.
fn csv(answer: &Lobes) -> String {
    let mut text = String::from("spindle_rpm,depth_m,chatter_hz,kind,pose\n");
    for p in &answer.points {
        let kind = p.kind.unwrap_or("");
        let (depth, hz) = (cell(p.depth_m), cell(p.chatter_hz));
        let _ = writeln!(text, "{},{depth},{hz},{kind},{}", p.spindle_rpm, p.pose);
    }
    text
}

/// Plots depth and chatter frequency over the spindle speed.
fn plot(answer: &Lobes, tool: &CuttingTool) -> Result<String, PlotError> {
    // Limits of the poses, and the lowest of them.
    let x: Vec<f64> = answer.points.iter().map(|p| p.spindle_rpm).collect();
    let limit: Vec<f64> = answer.points.iter().map(|p| p.depth_m.map_or(f64::NAN, |d| 1e3 * d)).collect();
    let mut curves = Vec::new();
    if answer.poses.len() > 1 && answer.poses.len() <= DRAWN {
        for (k, pose) in answer.poses.iter().enumerate() {
            let y: Vec<f64> = pose.depth_m.iter().map(|d| d.map_or(f64::NAN, |d| 1e3 * d)).collect();
            let name = pose.time_s.map_or_else(|| format!("pose {k}"), |t| format!("at {t:.2} s"));
            curves.extend(stretches(&name, CurveLook::Plain, &x, &y));
        }
    }
    curves.extend(stretches("stability limit", CurveLook::Total, &x, &limit));
    let finite = || limit.iter().copied().filter(|d| d.is_finite());
    let logarithmic = finite().fold(0.0, f64::max) > WIDE * finite().fold(f64::INFINITY, f64::min);
    // Chatter frequencies by kind.
    let chatter = |kind: &str, name: &str| {
        let points: Vec<&LobePoint> = answer.points.iter().filter(|p| p.kind == Some(kind)).collect();
        PlotCurve {
            name: name.to_owned(),
            look: CurveLook::Dots,
            x: points.iter().map(|p| p.spindle_rpm).collect(),
            y: points.iter().map(|p| p.chatter_hz.unwrap_or(f64::NAN)).collect(),
        }
    };
    let chatter = [chatter("hopf", "chatter"), chatter("flip", "chatter (period doubling)")];
    let hz = || chatter.iter().flat_map(|c| c.y.iter().copied());
    let far_apart = hz().fold(0.0, f64::max) > WIDE * hz().fold(f64::INFINITY, f64::min);
    let panels = [
        Panel { label: "depth of cut [mm]".into(), logarithmic, legend: true, curves },
        Panel {
            label: "chatter frequency [Hz]".into(),
            logarithmic: far_apart,
            legend: true,
            curves: chatter.into_iter().filter(|c| !c.x.is_empty()).collect(),
        },
    ];
    let title = format!("{}: stability lobes of {}", answer.robot, answer.tool);
    LinePlot {
        title: &title,
        notes: &notes(answer, tool),
        x_label: "spindle speed [1/min]",
        panels: &panels,
        ..LinePlot::default()
    }
    .svg()
}

/// Splits a curve with gaps into one curve of the same name per stretch.
fn stretches(name: &str, look: CurveLook, x: &[f64], y: &[f64]) -> Vec<PlotCurve> {
    let mut curves: Vec<PlotCurve> = Vec::new();
    let mut open = false;
    for (x, y) in x.iter().zip(y) {
        if y.is_finite() && !open {
            curves.push(PlotCurve { name: name.to_owned(), look, ..PlotCurve::default() });
        }
        open = y.is_finite();
        if let Some(curve) = curves.last_mut().filter(|_| open) {
            curve.x.push(*x);
            curve.y.push(*y);
        }
    }
    curves
}

/// Returns the lines under the title of the diagram.
fn notes(answer: &Lobes, tool: &CuttingTool) -> Vec<String> {
    let e = tool.cutter.engagement;
    let cut = format!(
        "{} teeth, {:.1} mm, cutting from {:.0}° to {:.0}°",
        tool.cutter.teeth,
        1e3 * tool.cutter.diameter,
        e.entry.to_degrees(),
        e.exit.to_degrees()
    );
    let stable = answer.stable_below_m.map_or_else(
        || format!("stable at every speed up to {} mm", rounded_down(1e3 * answer.deepest_m, 2)),
        |depth| format!("stable at every speed below {} mm", rounded_down(1e3 * depth, 3)),
    );
    let n = answer.poses.len();
    let place = if n > 1 {
        format!("minimum limit over {n} poses of the motion")
    } else {
        format!("at {}", answer.pose_in_words)
    };
    vec![cut, place, stable]
}

/// Returns the page, with the diagram if there is one.
fn html(answer: &Lobes, picture: Option<&str>) -> String {
    // The answer in a sentence: depths are rounded down, since a limit is never to be exceeded.
    let mut page = opening(&format!("Chatter of {} on {}", answer.tool, answer.robot));
    let _ = match (answer.stable_below_m, answer.stable_below_at_rpm) {
        (Some(depth), Some(rpm)) => writeln!(
            page,
            "<p>Stable at every speed below <b>{} mm</b> (limit at {rpm:.0} 1/min); \
             maximum limit at <b>{:.0} 1/min</b>: {} mm.</p>",
            rounded_down(1e3 * depth, 3),
            answer.best_rpm,
            rounded_down(1e3 * answer.best_depth_m, 3)
        ),
        _ => writeln!(page, "<p>No chatter up to {} mm at any speed.</p>", rounded_down(1e3 * answer.deepest_m, 2)),
    };
    page += &warnings("", &answer.caveats.iter().map(|caveat| caveat.message.clone()).collect::<Vec<_>>());
    page += picture.unwrap_or_default();
    page += "<h2>Poses</h2>\n<table><tr><th>time [s]</th><th>minimum limit [mm]</th>\
             <th>spindle speed [1/min]</th><th>compliance along the feed [&micro;m/N]</th>\
             <th>across the feed [&micro;m/N]</th><th>along the tool axis [&micro;m/N]</th>\
             <th>first natural frequencies [Hz]</th></tr>\n";
    // Table of the poses along the motion.
    let number = |x: Option<f64>, digits: usize| x.map_or_else(|| "-".into(), |x| format!("{x:.digits$}"));
    for pose in &answer.poses {
        let hz: Vec<String> = pose.frequencies_hz.iter().take(3).map(|f| format!("{f:.1}")).collect();
        let [x, y, z] = pose.compliance.map(|c| format!("{:.3}", 1e6 * c));
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{x}</td><td>{y}</td><td>{z}</td><td>{}</td></tr>",
            number(pose.time_s, 2),
            pose.stable_below_m.map_or_else(|| "-".into(), |depth| rounded_down(1e3 * depth, 3)),
            number(pose.stable_below_at_rpm, 0),
            hz.join(", ")
        );
    }
    page += "</table>\n<p>Linearised about the pose with the drives locked. Not modelled: backlash and friction of \
             the gears, process damping at low speed, flexibility of the workpiece.</p>\n";
    page + ENDING
}
