//! Report of a run: an HTML page, its figures as Markdown and JSON, and figures for papers.
//!
//! Start at [`html`]. [`figure_groups`] selects the figures for the reader; page, Markdown and
//! terminal share them. `curves` provides the data of the plots, `picture` renders the arm,
//! `figures` writes the folder for papers.

pub(crate) mod convert;
pub mod html_page;

mod again;
mod curves;
mod figures;
mod html;
mod path_plan;
mod picture;
mod shares;

use std::fmt::Write as _;

use flexarm_files::write_all;
use flexarm_log::Trace;
use flexarm_settings::gathered;
use flexarm_settings::written::{markdown as markdown_text, markdown_row};

use crate::arm::options::Outputs;
use crate::error::Error;
use crate::run::headline::{self, rounded};
use crate::run::monitor::tool_path::PathFigures;
use crate::run::record::FIGURES_FOLDER;
use crate::run::settling::within;
use crate::run::summary::{LinkStressFigures, StrainGaugeFigures, StressPointFigures, Summary};

use self::shares::{Part, part_shares, share_numbers};

pub use again::{ReportFiles, ReportOptions, report};
pub use curves::thinned;
pub use html::{ReportRun, html, short};

/// Title of a report of a single run.
fn title(summary: &Summary) -> String {
    match summary.trajectory.as_str() {
        "" => summary.robot.clone(),
        trajectory => format!("{} on {trajectory}", summary.robot),
    }
}

/// Returns the report of a run.
pub(crate) fn page(summary: &Summary, trace: &Trace) -> String {
    html(&[ReportRun { label: &title(summary), summary, trace }])
}

/// Writes the report, the figures and `summary.json` into the output folder.
pub(crate) fn write(outputs: &Outputs, summary: &Summary, trace: &Trace, page: &str) -> Result<(), Error> {
    write_page(outputs, summary, page)?;
    match outputs.figures {
        true => figures::write(&outputs.folder.join(FIGURES_FOLDER), summary, trace),
        false => Ok(()),
    }
}

/// Writes the report and `summary.json` of several runs into the output folder; `summary` is that
/// of the first run and contains the others.
pub(crate) fn write_study(outputs: &Outputs, summary: &Summary, traces: &[(String, Trace)]) -> Result<(), Error> {
    let summaries = std::iter::once(summary).chain(&summary.with);
    let runs: Vec<ReportRun<'_>> =
        summaries.zip(traces).map(|(summary, (label, trace))| ReportRun { label, summary, trace }).collect();
    write_page(outputs, summary, &html(&runs))
}

/// Writes report and `summary.json`.
fn write_page(outputs: &Outputs, summary: &Summary, page: &str) -> Result<(), Error> {
    let json = serde_json::to_string_pretty(summary).expect("plain numbers and strings") + "\n";
    let files = [("report.md", markdown(summary)), ("report.html", page.to_owned()), ("summary.json", json)];
    Ok(write_all(&files.map(|(name, text)| (outputs.folder.join(name), text)))?)
}

/// Returns the figures for the reader without those that depend on the machine and its load.
pub(crate) fn timeless_rows(summary: &Summary) -> Vec<(String, String)> {
    let of_run: Vec<String> = run_figures(summary).into_iter().map(|figure| figure.name).collect();
    rows(summary).into_iter().filter(|(name, _)| !of_run.contains(name)).collect()
}

/// Returns the summary as a Markdown page: headline, table of figures, runs of the study, warnings.
pub fn markdown(summary: &Summary) -> String {
    let mut page = format!("# {} on {}\n\n", markdown_text(&summary.robot), markdown_text(&summary.trajectory));
    if !summary.headline.is_empty() {
        let _ = writeln!(page, "{}\n", markdown_text(&summary.headline));
    }
    page += "| figure | value |\n| --- | --- |\n";
    for (name, value) in rows(summary) {
        page += &markdown_row(&[name, value]);
    }
    if !summary.with.is_empty() {
        page += "\n## Runs of the study\n\n";
        page += &crate::run::comparison::table(summary);
    }
    if !summary.warnings.is_empty() {
        page += "\n## Warnings\n\n";
        for warning in gathered(&summary.warnings) {
            let _ = writeln!(page, "- {}", markdown_text(&warning));
        }
    }
    page
}

/// Returns the figures for the reader in readable units, without groups: name, and value with unit
/// and note.
pub fn rows(summary: &Summary) -> Vec<(String, String)> {
    let text = |row: Figure| {
        let parts = [row.value.as_str(), row.unit].into_iter().filter(|part| !part.is_empty());
        let value = parts.collect::<Vec<_>>().join(" ");
        let text = match (value.is_empty(), row.note.is_empty()) {
            (false, false) => format!("{value}, {}", row.note),
            (false, true) => value,
            (true, _) => row.note,
        };
        (row.name, text)
    };
    figure_groups(summary).into_iter().flat_map(|group| group.rows).map(text).collect()
}

/// Group of figures.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureGroup {
    /// Heading.
    pub title: &'static str,
    /// Figures in display order.
    pub rows: Vec<Figure>,
}

/// A figure in readable units.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name.
    pub name: String,
    /// Formatted value; empty if there is none.
    pub value: String,
    /// Unit.
    pub unit: &'static str,
    /// Additional text.
    pub note: String,
    /// Importance.
    pub weight: Weight,
}

/// Importance of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Ordinary figure.
    Plain,
    /// Main result.
    Headline,
    /// Sign of a problem.
    Alert,
}

impl Figure {
    fn new(name: impl Into<String>, value: impl Into<String>, unit: &'static str, note: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into(), unit, note: note.into(), weight: Weight::Plain }
    }
}

/// Returns the figures of a run in groups: TCP, contributions of links and drives, and the run
/// itself.
pub fn figure_groups(summary: &Summary) -> Vec<FigureGroup> {
    let groups = [
        FigureGroup { title: "TCP", rows: tool_figures(summary) },
        FigureGroup { title: "links and drives", rows: part_figures(summary) },
        FigureGroup { title: "stress", rows: stress_figures(&summary.stress, true) },
        FigureGroup { title: "run", rows: run_figures(summary) },
    ];
    groups.into_iter().filter(|group| !group.rows.is_empty()).collect()
}

/// Number of decimals of lengths in mm.
const MM_DIGITS: usize = 4;

/// Formats a length in m as mm, or an angle in rad as mrad.
fn mm(x: f64) -> String {
    format!("{:.MM_DIGITS$}", 1e3 * x)
}

/// Number of motions beyond which a life is not given as a number.
const ENDLESS: f64 = 1e12;

/// Returns the figures of the stress of links; `is_run`: with the time of the maximum and the life.
pub fn stress_figures(links: &[LinkStressFigures], is_run: bool) -> Vec<Figure> {
    // Worst place of a link: stress, share of the strength, life, position.
    let row = |link: &LinkStressFigures| {
        let place = link.worst.first()?;
        let [x, y, z] = place.position_m.map(|x| format!("{:.0}", 1e3 * x));
        let time = if is_run { format!(", {:.3} s", place.t_s) } else { String::new() };
        let at = format!("von Mises, node {} at ({x}, {y}, {z}) mm of the link{time}", place.node);
        let weakest = link.most_damaged.as_ref().unwrap_or(place);
        let node = if weakest.node == place.node { String::new() } else { format!(" at node {}", weakest.node) };
        let life = match weakest.damage {
            None => String::new(),
            Some(damage) if damage > 1.0 / ENDLESS => format!(", life {:.1e} motions{node}", 1.0 / damage),
            Some(_) => ", life beyond 1e12 motions".to_owned(),
        };
        let note = match (place.of_yield, &place.material) {
            (Some(share), Some(material)) => {
                format!("{:.1} % of the yield strength of {material}{life}; {at}", 100.0 * share)
            }
            _ => at,
        };
        let figure = Figure::new(link.name.clone(), format!("{:.2}", 1e-6 * place.von_mises_pa), "MPa", note);
        let beyond = place.of_yield.is_some_and(|share| share > 1.0);
        Some(Figure { weight: if beyond { Weight::Alert } else { Weight::Plain }, ..figure })
    };
    // A stress point is a link with one place.
    let point = |point: &StressPointFigures| {
        let worst = vec![point.place.clone()];
        row(&LinkStressFigures { name: point.name.clone(), worst, ..LinkStressFigures::default() })
    };
    let gauge = |gauge: &StrainGaugeFigures| {
        let value = match is_run {
            true => format!("{:.1} to {:.1}", 1e6 * gauge.lowest, 1e6 * gauge.highest),
            false => format!("{:.1}", 1e6 * gauge.highest),
        };
        let [x, y, z] = gauge.position_m.map(|x| format!("{:.0}", 1e3 * x));
        let note = format!("strain, node {} at ({x}, {y}, {z}) mm of the link", gauge.node);
        Figure::new(gauge.name.clone(), value, "µm/m", note)
    };
    let figures = links.iter().flat_map(|link| {
        let gauges = link.gauges.iter().map(gauge);
        row(link).into_iter().chain(link.points.iter().filter_map(point)).chain(gauges)
    });
    figures.collect()
}

/// Returns the figures of the error across a path.
fn across_figures(path: &PathFigures) -> [Figure; 3] {
    let peak = format!("maximum, at {:.3} s; RMS {} mm", path.t_across_peak_s, mm(path.across_rms_m));
    let [x, y, z] = path.offset_m.map(mm);
    let shifted = format!("maximum, with the workpiece shifted by ({x}, {y}, {z}) mm");
    [
        Figure::new("error across the path", mm(path.across_peak_m), "mm", peak),
        Figure::new("across, work shifted", mm(path.left_m), "mm", shifted),
        Figure::new("corner overshoot", mm(path.corner_overshoot_m), "mm", "beyond the static deflection"),
    ]
}

/// Returns the figures of the TCP.
fn tool_figures(summary: &Summary) -> Vec<Figure> {
    let mut rows = Vec::new();
    if summary.end != "complete" {
        let stopped = Figure::new("STOPPED EARLY", "", "", summary.end.clone());
        rows.push(Figure { weight: Weight::Alert, ..stopped });
    }
    let Some(tcp) = &summary.tcp else { return rows };
    // Peak with its parts, and the whole run.
    let peak = Figure::new("peak TCP error", mm(tcp.peak_m), "mm", format!("at {:.3} s", tcp.t_peak_s));
    rows.push(Figure { weight: Weight::Headline, ..peak });
    if let (Some(at_rest), Some(moving), Some(most), Some(t)) =
        (tcp.static_at_peak_m, tcp.dynamic_at_peak_m, tcp.dynamic_peak_m, tcp.t_dynamic_peak_s)
    {
        let parts = rounded(&[1e3 * at_rest, 1e3 * moving], 1e3 * tcp.peak_m, MM_DIGITS);
        let note = "static deflection at the same pose";
        rows.push(Figure::new("static part of the peak", parts[0].clone(), "mm", note));
        let note = format!("maximum {} mm at {t:.3} s", mm(most));
        rows.push(Figure::new("dynamic part of the peak", parts[1].clone(), "mm", note));
    }
    rows.push(Figure::new("RMS TCP error", mm(tcp.rms_m), "mm", ""));
    // Along and across the path.
    let [along, normal, binormal] = tcp.path_peak_m;
    rows.push(Figure::new("peak along the path", mm(along), "mm", ""));
    let across = format!("binormal {} mm", mm(binormal));
    rows.push(Figure::new("peak normal to the path", mm(normal), "mm", across));
    rows.push(Figure::new(
        "path accuracy",
        mm(tcp.path_accuracy_m),
        "mm",
        "maximum distance from the path while moving",
    ));
    rows.extend(summary.path.iter().flat_map(across_figures));
    // At rest, and after moves.
    rows.push(Figure::new("static sag at the start", mm(tcp.static_sag_m), "mm", ""));
    rows.push(Figure::new("error at the end", mm(tcp.end_m), "mm", ""));
    let rms = format!("RMS {} mrad", mm(tcp.rms_rad));
    rows.push(Figure::new("peak rotation", mm(tcp.peak_rad), "mrad", rms));
    if let Some(worst) = tcp.poses.iter().max_by(|a, b| a.repeatability_m.total_cmp(&b.repeatability_m)) {
        let note = format!("ISO 9283, worst of {} poses with several stops", tcp.poses.len());
        rows.push(Figure::new("pose repeatability", mm(worst.repeatability_m), "mm", note));
    }
    rows.push(Figure::new("overshoot after a move", mm(tcp.overshoot_m), "mm", ""));
    let settling = tcp.settling_state();
    let note = settling.note(&tcp.settling_band_m.map_or_else(String::new, within));
    rows.push(match settling.time_s() {
        Some(s) => Figure::new("settling time", format!("{s:.3}"), "s", note),
        None => Figure::new("settling time", "", "", note),
    });
    rows.push(match tcp.dominant_hz {
        Some(hz) => Figure::new("dominant frequency", format!("{hz:.2}"), "Hz", ""),
        None => Figure::new("dominant frequency", "", "", tcp.no_line()),
    });
    rows
}

/// Returns the figures of links and drives, frequencies and energies.
fn part_figures(summary: &Summary) -> Vec<Figure> {
    let mut rows = Vec::new();
    let shares = part_shares(summary);
    let numbers = share_numbers(summary, &shares, MM_DIGITS);
    for (share, number) in shares.iter().zip(numbers) {
        let (name, turns) = match share.part {
            Part::Link(link) => {
                let (strain, turn) = (link.engineering_strain, mm(link.peak_rotation_rad));
                (format!("link {}", share.name), format!("; strain {strain:.1e}, bending angle {turn} mrad"))
            }
            Part::Drive(drive) => {
                let turns = format!("; deflection {} {}", mm(drive.peak_deflection_rad), drive.shown_unit());
                (format!("drive {}", share.name), turns)
            }
            Part::None if share.kind == headline::STEPPER => ("constraint drift".to_owned(), String::new()),
            Part::None => (share.name.to_owned(), String::new()),
        };
        let largest = share.largest_m.map(mm).unwrap_or_default();
        rows.push(match number {
            Some(at_peak) if share.largest_m.is_some() => {
                Figure::new(name, at_peak, "mm", format!("at the peak; maximum {largest} mm{turns}"))
            }
            Some(at_peak) => Figure::new(name, at_peak, "mm", "at the peak"),
            None => Figure::new(name, largest, "mm", format!("maximum TCP motion{turns}")),
        });
    }
    if let Some(first) = summary.frequencies_hz.first() {
        let others: Vec<String> = summary.frequencies_hz.iter().skip(1).take(3).map(|f| format!("{f:.2}")).collect();
        let note = if others.is_empty() { String::new() } else { format!("next {} Hz", others.join(", ")) };
        rows.push(Figure::new("first frequency", format!("{first:.2}"), "Hz", note));
    }
    let e = &summary.energy;
    if e.drives_j != 0.0 || e.loads_j != 0.0 {
        let (put_in, taken_out) = (e.drives_positive_j, e.drives_negative_j);
        let mut note = format!("positive {put_in:.3} J, negative {taken_out:.3} J; ");
        if e.loads_j != 0.0 {
            let _ = write!(note, "work of loads {:.3} J, ", e.loads_j);
        }
        if e.payload_j != 0.0 {
            let _ = write!(note, "energy of payloads {:.3} J, ", e.payload_j);
        }
        // Adding 0 turns -0 into 0.
        let [dissipated, stored] = [e.dissipated_j, e.stored_j].map(|joules| (1e3 * joules).round() / 1e3 + 0.0);
        let _ = write!(note, "dissipated {dissipated:.3} J, stored {stored:.3} J; imbalance {:.1e}", e.imbalance);
        rows.push(Figure::new("net work of the drives", format!("{:.3}", e.drives_j), "J", note));
    }
    rows
}

/// Returns the figures of the computation; they depend on the machine.
fn run_figures(summary: &Summary) -> Vec<Figure> {
    let s = &summary.stepper;
    let evaluations = s.evaluations as f64 / s.steps.max(1) as f64;
    let work = format!("{}, {} ms, {evaluations:.1} evaluations per step", s.name, 1e3 * s.h_s);
    let (wall, factor) = (summary.wall_s, summary.real_time_factor);
    vec![
        Figure::new("steps", s.steps.to_string(), "", work),
        Figure::new("simulated", format!("{:.2}", summary.duration_s), "s", ""),
        Figure::new("wall time", format!("{wall:.2}"), "s", format!("{factor:.0} times real time")),
        Figure::new("CPU time", format!("{:.1}", 1e3 * summary.cpu_s_per_simulated_s), "ms", "per simulated second"),
    ]
}
