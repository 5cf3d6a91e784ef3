//! Tables of the page: TCP path, ISO 9283 figures, stops, links, drives and energies.
//!
//! Not here: main figures and comparison of runs (`figures`), formatting of numbers (`number`).

use std::fmt::Write as _;

use base64::Engine as _;

use super::figures::{STABILISATION, moving, within, without_number};
use super::number::number;
use super::run::ReportRun;
use crate::report::path_plan::path_plan;
use crate::report::shares::{Part, part_shares, share_numbers};
use crate::run::headline;
use crate::run::monitor::tool_path::PathMoveFigures;
use crate::run::record::STRESS_PICTURE;
use crate::run::summary::Summary;
use flexarm_settings::written::markup;

/// Maximum number of moves in the table of the page.
const MAX_MOVES: usize = 200;

/// Returns the plan of the TCP path and its moves, if the motion is given as one.
pub(super) fn tool_path(run: &ReportRun<'_>) -> String {
    let Some(path) = &run.summary.path else { return String::new() };
    let mut out = "<section class=\"block\"><h2>Across the path of the tool</h2>\n".to_owned();
    if let Some(plan) = path_plan(path) {
        let data = base64::engine::general_purpose::STANDARD.encode(&plan.svg);
        let caption = format!(
            "The path of the tool and the tool with its error enlarged {} times, less the offset by which the workpiece would be moved.",
            plan.factor
        );
        let _ = writeln!(
            out,
            "<figure><img alt=\"{caption}\" style=\"width:100%;background:#fff\" src=\"data:image/svg+xml;base64,{data}\">\
             <figcaption>{caption}</figcaption></figure>"
        );
    }
    // One row per move, up to a limit.
    let optional = |x: Option<f64>| x.map_or_else(|| "–".into(), |x| number(1e3 * x, 4));
    let row = |of: &PathMoveFigures| {
        vec![
            of.line.to_string(),
            of.statement.clone(),
            number(of.span_s[0], 5),
            number(of.span_s[1], 5),
            number(1e3 * of.across_peak_m, 4),
            number(1e3 * of.across_rms_m, 4),
            number(1e3 * of.corner_overshoot_m, 3),
            optional(of.programmed_m_s),
            optional(of.top_m_s),
        ]
    };
    let rows: Vec<Vec<String>> = path.moves.iter().take(MAX_MOVES).map(row).collect();
    let head = [
        "line",
        "move",
        "from (s)",
        "to (s)",
        "across, peak (mm)",
        "across, RMS (mm)",
        "corner overshoot (mm)",
        "programmed (mm/s)",
        "reached (mm/s)",
    ];
    out += &table("Moves of the tool", &head, &rows);
    if path.moves.len() > MAX_MOVES {
        let _ = writeln!(out, "<p class=\"note\">{} more moves are in the summary.</p>", path.moves.len() - MAX_MOVES);
    }
    out + "</section>\n"
}

/// Returns the picture of the stress of the links, if the run has one.
pub(super) fn stress_picture(run: &ReportRun<'_>) -> String {
    let files = &run.trace.result.attachments;
    let Some(picture) = files.iter().find(|file| file.name == STRESS_PICTURE) else { return String::new() };
    let data = base64::engine::general_purpose::STANDARD.encode(&picture.bytes);
    let caption = "Largest von Mises stress of every node during the run, from two sides.";
    format!(
        "<section class=\"block\" id=\"stress\"><h2>Stress of the links</h2>\n\
         <figure><img alt=\"{caption}\" style=\"width:100%;background:#fff\" src=\"data:image/png;base64,{data}\">\
         <figcaption>{caption}</figcaption></figure></section>\n"
    )
}

/// Maximum number of poses with several stops in the table of the page.
const MAX_POSES: usize = 50;

/// Row of the ISO table: name, meaning, unit, value.
type Iso = (&'static str, &'static str, &'static str, fn(&Summary) -> Option<f64>);

const ISO: [Iso; 8] = [
    (
        "Path accuracy (AT)",
        "maximum distance of the flexible from the rigid TCP across the path while moving",
        "mm",
        |s| moving(s).map(|t| 1e3 * t.path_accuracy_m),
    ),
    ("RMS distance from the path", "of the same, over the samples of the moves", "mm", |s| {
        moving(s).map(|t| 1e3 * t.path_rms_m)
    }),
    ("Lag along the path", "maximum deviation along the path, whole run", "mm", |s| {
        s.tcp.as_ref().map(|t| 1e3 * t.path_peak_m[0])
    }),
    (
        "Position overshoot (OV)",
        "maximum excursion past the final value, in the direction of approach, over all stops",
        "mm",
        |s| moving(s).map(|t| 1e3 * t.overshoot_m),
    ),
    (
        STABILISATION,
        "from the end of a commanded move until the TCP stays BAND of its final value, at the stop that takes longest",
        "s",
        |s| moving(s).and_then(|t| t.settling_state().time_s()),
    ),
    ("Pose accuracy (AP)", "maximum distance from the rigid TCP at rest, over all stops", "mm", |s| {
        let rests = moving(s)?.holds.iter().map(|hold| 1e3 * hold.final_m);
        rests.reduce(f64::max)
    }),
    ("Pose repeatability (RP)", "scatter of the places at the end of repeated stops, at the worst pose", "mm", |s| {
        moving(s)?.poses.iter().map(|pose| 1e3 * pose.repeatability_m).reduce(f64::max)
    }),
    ("Static sag", "distance from the rigid TCP at rest at the start", "mm", |s| {
        s.tcp.as_ref().map(|t| 1e3 * t.static_sag_m)
    }),
];

/// Returns the table of the figures of ISO 9283, one column per run.
pub(super) fn iso_table(runs: &[ReportRun<'_>]) -> String {
    if runs.iter().all(|run| run.summary.tcp.is_none()) {
        return "<h2 id=\"tables\">Tables</h2>\n".to_owned();
    }
    let mut out = "<section id=\"tables\" class=\"block\"><h2>ISO 9283-style figures</h2>\n\
                   <p class=\"note\">ISO 9283-style, not a conformity test: one deterministic cycle against the rigid twin as the command, \
                   not thirty measured cycles.</p>\n<div class=\"scroll\"><table><thead><tr><th>figure</th><th>meaning</th>"
        .to_owned();
    for run in runs {
        let name = if runs.len() > 1 { markup(run.label) } else { "value".into() };
        let _ = write!(out, "<th class=\"number\">{name}</th>");
    }
    out += "<th>unit</th></tr></thead><tbody>";
    let mut bands = runs.iter().filter(|run| run.summary.tcp.is_some()).map(within);
    let first = bands.next().flatten();
    let band = first.filter(|first| bands.all(|band| band.as_ref() == Some(first)));
    let band = band.unwrap_or_else(|| "within the settling band".into());
    for (name, meaning, unit, value) in ISO {
        // Figures that are unknown give no row; figures that do not exist, such as a settling time
        // without settling, do.
        let known = |run: &ReportRun<'_>| run.summary.knows_moves() || value(run.summary).is_some();
        if !runs.iter().any(known) {
            continue;
        }
        let meaning = meaning.replace("BAND", &band);
        let _ = write!(out, "<tr><th>{name}</th><td class=\"text\">{meaning}</td>");
        for run in runs {
            let value = value(run.summary).map_or_else(|| without_number(run.summary, name), |v| number(v, 5));
            let _ = write!(out, "<td class=\"number\">{value}</td>");
        }
        let _ = write!(out, "<td>{unit}</td></tr>");
    }
    out + "</tbody></table></div></section>\n"
}

/// Returns a table with a heading (HTML); columns of numbers are right-aligned.
fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let is_number = |column: usize| {
        column > 0 && rows.iter().all(|row| row[column].starts_with(|c: char| "-–0123456789".contains(c)))
    };
    let class = |column: usize| if is_number(column) { " class=\"number\"" } else { "" };
    let heads: String =
        head.iter().enumerate().map(|(k, name)| format!("<th{}>{}</th>", class(k), markup(name))).collect();
    let mut out = format!(
        "<section class=\"block\"><h2>{title}</h2><div class=\"scroll\"><table><thead><tr>{heads}</tr></thead><tbody>"
    );
    for row in rows {
        let cells: String = (row.iter().enumerate().skip(1))
            .map(|(k, cell)| format!("<td{}>{}</td>", class(k), markup(cell)))
            .collect();
        let _ = write!(out, "<tr><th>{}</th>{cells}</tr>", markup(&row[0]));
    }
    out + "</tbody></table></div></section>\n"
}

/// Returns the tables of the stops and of the poses with several stops; `of`: end of their titles.
pub(super) fn stops_table(s: &Summary, of: &str) -> String {
    let Some(tcp) = &s.tcp else { return String::new() };
    let optional = |x: Option<f64>| x.map_or_else(|| "–".into(), |x| number(x, 4));
    let rows: Vec<Vec<String>> = (tcp.holds.iter().enumerate())
        .map(|(k, hold)| {
            vec![
                (k + 1).to_string(),
                number(hold.start_s, 5),
                number(hold.end_s, 5),
                number(1e3 * hold.final_m, 4),
                hold.settling_s.map_or_else(|| "not settled".into(), |x| number(x, 4)),
                number(1e3 * hold.overshoot_m, 4),
                optional(hold.ringing_hz),
            ]
        })
        .collect();
    let head =
        ["stop", "from (s)", "to (s)", "error at rest (mm)", "settled after (s)", "overshoot (mm)", "rings at (Hz)"];
    let stops = table(&format!("Stops{of}"), &head, &rows);
    // ISO 9283 figures need several stops at one pose.
    let poses: Vec<Vec<String>> = (tcp.poses.iter().take(MAX_POSES))
        .map(|pose| {
            let place = pose.place_m.map(|x| number(1e3 * x, 5)).join(", ");
            let visits = pose.visits.to_string();
            vec![place, visits, number(1e3 * pose.accuracy_m, 4), number(1e3 * pose.repeatability_m, 4)]
        })
        .collect();
    if poses.is_empty() {
        return stops;
    }
    let head = ["place (mm)", "stops", "pose accuracy AP (mm)", "pose repeatability RP (mm)"];
    stops + &table(&format!("Poses with several stops{of}"), &head, &poses)
}

/// Returns the tables of links and drives, drive forces, frequencies and energies; `of`: end of
/// their titles.
pub(super) fn parts_tables(s: &Summary, of: &str) -> String {
    let shares = part_shares(s);
    let peak_mm = s.tcp.as_ref().map_or(0.0, |tcp| 1e3 * tcp.peak_m);
    // One decimal more than in the headline.
    let digits = headline::digits(peak_mm) + 1;
    let none = || "–".to_owned();
    let rows = shares.iter().zip(share_numbers(s, &shares, digits)).map(|(share, at_peak)| {
        let (turn, strain) = match share.part {
            Part::Link(link) => (number(1e3 * link.peak_rotation_rad, 4), number(link.engineering_strain, 3)),
            Part::Drive(drive) => {
                let unit = if drive.slides { " mm" } else { "" };
                (number(1e3 * drive.peak_deflection_rad, 4) + unit, none())
            }
            Part::None => (none(), none()),
        };
        let largest = share.largest_m.map_or_else(none, |x| number(1e3 * x, 4));
        vec![share.name.to_owned(), share.kind.to_owned(), at_peak.unwrap_or_else(none), largest, turn, strain]
    });
    let mut rows: Vec<_> = rows.collect();
    if shares.iter().any(|share| share.at_peak_m.is_some()) {
        let peak = format!("{peak_mm:.digits$}");
        rows.push(vec!["together".to_owned(), "peak".to_owned(), peak, none(), none(), none()]);
    }
    let head = [
        "name",
        "kind",
        "share of the peak (mm)",
        "maximum (mm)",
        "maximum deflection (mrad)",
        "change of length (relative)",
    ];
    let mut out = table(&format!("Flexible links and drives{of}"), &head, &rows);

    let forces: Vec<_> = s.drives.iter().map(|(joint, peak)| vec![joint.clone(), number(*peak, 5)]).collect();
    let frequencies: Vec<_> = (s.frequencies_hz.iter().take(12).enumerate())
        .map(|(k, hz)| vec![format!("f{}", k + 1), number(*hz, 5)])
        .collect();
    let e = &s.energy;
    let energies = [
        ("work put in by the drives", e.drives_positive_j, "J"),
        ("taken out by the drives", e.drives_negative_j, "J"),
        ("net work of the drives", e.drives_j, "J"),
        ("work of external loads", e.loads_j, "J"),
        ("came with payloads", e.payload_j, "J"),
        ("dissipated", e.dissipated_j, "J"),
        ("stored", e.stored_j, "J"),
        ("balance open by", 100.0 * e.imbalance, "%"),
    ];
    let energies = if s.computed { &[][..] } else { &energies };
    let energies: Vec<_> =
        energies.iter().map(|(name, x, unit)| vec![(*name).to_owned(), number(*x, 4), (*unit).to_owned()]).collect();
    out += "<div class=\"columns\">\n";
    out += &table(&format!("Maximum forces of the drives{of}"), &["joint", "N m, or N if it slides"], &forces);
    out += &table(&format!("Natural frequencies at the start{of}"), &["mode", "Hz"], &frequencies);
    out += &table(&format!("Energy over the run{of}"), &["what", "value", "unit"], &energies);
    out + "</div>\n"
}
