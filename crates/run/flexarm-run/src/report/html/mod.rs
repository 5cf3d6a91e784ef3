//! The report as one self-contained HTML page: style, scripts, data and pictures are embedded.
//!
//! The same runs give identical bytes except for the paragraph with the id `timings`. Start at
//! [`html`]. Modules: main figures and comparison of runs (`figures`), the arm (`arm`), tables
//! (`tables`), data of the plots (`data`). Not here: the selection of curves (`curves`), the
//! rendering of the arm (`picture`), the behaviour of plots (`assets/report.js`).

mod arm;
mod data;
mod figures;
mod number;
mod run;
mod tables;

use std::fmt::Write as _;

use self::arm::arm_pictures;
use self::data::{data, thinning};
use self::figures::{comparison, tiles};
use self::number::number;
pub use self::number::short;
use self::run::method;
use self::tables::{iso_table, parts_tables, stops_table, stress_picture, tool_path};
use super::again::metadata_value;
use super::curves::{Plot, plots};
use crate::report::html_page::{head, warnings};
use crate::run::stepper_settings::SettingValue;
use flexarm_settings::written::markup;

pub use self::run::ReportRun;

const STYLE: &str = include_str!("../../../assets/report.css");

const BEHAVIOUR: &str = include_str!("../../../assets/report.js");

const UPLOT: &str = include_str!("../../../assets/uplot/uPlot.iife.min.js");

const UPLOT_STYLE: &str = include_str!("../../../assets/uplot/uPlot.min.css");

const UPLOT_LICENSE: &str = include_str!("../../../assets/uplot/LICENSE");

const UPLOT_VERSION: &str = "1.6.32";

/// Returns the report of one run, or of several side by side with the first as the main one.
#[must_use]
pub fn html(runs: &[ReportRun<'_>]) -> String {
    let Some(main) = runs.first() else {
        return "<!DOCTYPE html>\n<title>flexarm report</title>\n<p>No runs.\n".to_owned();
    };
    let title = match runs {
        [run] => super::title(run.summary),
        _ => format!("{} runs: {}", runs.len(), runs.iter().map(|run| run.label).collect::<Vec<_>>().join(", ")),
    };
    // The banner of the minified file contains a URL; licence and origin are given in a comment of
    // this page instead.
    let uplot = UPLOT.split_once("*/").map_or(UPLOT, |(_, code)| code);
    let mut page = head(&title, &format!("{UPLOT_STYLE}\n{STYLE}"));
    // The arm is rendered while the plots are written.
    let write_plots = || {
        let drawn: Vec<Vec<Plot>> = runs.iter().map(|run| plots(run.summary, run.trace)).collect();
        let data = data(runs, &drawn);
        (drawn, data)
    };
    let (arm, (drawn, data)) = rayon::join(|| arm_pictures(runs), write_plots);
    let body = body(main, runs, &arm, &thinning(runs, &drawn));
    page += &heading(&title, runs, &body);
    let _ = write!(page, "<main>\n{body}</main>\n");
    let _ = write!(
        page,
        "<script type=\"application/json\" id=\"data\">{}</script>\n\
         <script>\n/* uPlot {UPLOT_VERSION}\n\n{}\n*/\n{}</script>\n<script>\n{BEHAVIOUR}</script>\n</body>\n</html>\n",
        data,
        UPLOT_LICENSE.trim(),
        uplot.trim_start()
    );
    page
}

/// Returns everything between heading and data.
fn body(main: &ReportRun<'_>, runs: &[ReportRun<'_>], arm: &str, thinning: &str) -> String {
    let mut body: String = runs.iter().map(|run| troubles(run, runs.len() > 1)).collect();
    if let [run] = runs {
        body += &tiles(run);
    } else {
        body += &comparison(runs);
    }
    body += arm;
    body += &stress_picture(main);
    body += &tool_path(main);
    body += "<section id=\"plots\"><noscript><p>The plots need JavaScript.</p></noscript></section>\n";
    body += thinning;
    body += &iso_table(runs);
    let suffix = if runs.len() > 1 { format!(" of {}", markup(main.label)) } else { String::new() };
    body += &stops_table(main.summary, &suffix);
    body += &parts_tables(main.summary, &suffix);
    let inputs: String = runs.iter().map(|run| inputs(run, runs.len() > 1)).collect();
    if !inputs.is_empty() {
        let _ = write!(body, "<div id=\"inputs\">\n{inputs}</div>\n");
    }
    body + &timings(runs)
}

/// Navigation targets of the page: text of the link, id.
const PLACES: [(&str, &str); 6] = [
    ("Figures", "summary"),
    ("Arm", "arm"),
    ("Stress", "stress"),
    ("Plots", "plots"),
    ("Tables", "tables"),
    ("Inputs", "inputs"),
];

/// Returns title, headlines, facts and navigation.
fn heading(title: &str, runs: &[ReportRun<'_>], body: &str) -> String {
    let s = runs[0].summary;
    let mut facts = Vec::new();
    if runs.len() == 1 {
        if runs[0].trace.header.has_rigid {
            facts.push("flexible arm against its rigid twin".to_owned());
        }
        if !s.links_model.is_empty() {
            facts.push(format!("{} links", s.links_model));
        }
        let payload = metadata_value(&runs[0].trace.header, "flexarm.model", "payload_kg");
        facts.extend(payload.map(|kg| format!("payload {kg} kg")));
        facts.push(format!("{} s", number(s.duration_s, 4)));
        facts.extend(method(s, "step "));
    }
    facts.push(format!("flexarm {}", env!("CARGO_PKG_VERSION")));
    let facts: Vec<String> = facts.iter().map(|fact| format!("<span>{}</span>", markup(fact))).collect();
    // Names of runs are escaped and cannot be mistaken for an id attribute.
    let there = PLACES.iter().filter(|(_, id)| body.contains(&format!("id=\"{id}\"")));
    let links: String = there.map(|(name, id)| format!("<a href=\"#{id}\">{name}</a>")).collect();
    format!(
        "<header>\n<h1>{}</h1>\n{}<p class=\"facts\">{}</p>\n<nav>{links}</nav>\n</header>\n",
        markup(title),
        headlines(runs),
        facts.join("")
    )
}

/// Returns the headlines, one line per run.
fn headlines(runs: &[ReportRun<'_>]) -> String {
    let line = |run: &ReportRun<'_>| {
        let who = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
        format!("<p class=\"headline\">{}</p>\n", markup(&(who + &run.summary.headline)))
    };
    runs.iter().filter(|run| !run.summary.headline.is_empty()).map(line).collect()
}

/// Returns the reason for an early stop, and the warnings.
fn troubles(run: &ReportRun<'_>, named: bool) -> String {
    let s = run.summary;
    let who = if named { format!("{}: ", markup(run.label)) } else { String::new() };
    let mut out = String::new();
    if s.computed {
        let why =
            "The recording holds no result: the figures of the tool are computed from its curves, others are missing.";
        let _ = writeln!(out, "<p class=\"block note\"><strong>{who}End not known.</strong> {why}</p>");
    } else if s.end != "complete" {
        let _ = writeln!(out, "<p class=\"stopped\"><strong>{who}Stopped early.</strong> {}</p>", markup(&s.end));
    }
    out + &warnings(&who, &s.warnings)
}

/// Returns inputs and settings of a run.
fn inputs(run: &ReportRun<'_>, named: bool) -> String {
    let (s, header) = (run.summary, &run.trace.header);
    let who = if named { format!(" of {}", markup(run.label)) } else { String::new() };
    let mut out = String::new();
    let mut group = |title: &str, rows: &[(String, String)]| {
        let rows: String = (rows.iter().filter(|(_, value)| !value.is_empty()))
            .map(|(key, value)| format!("<dt>{}</dt><dd>{}</dd>", markup(key), markup(value)))
            .collect();
        if !rows.is_empty() {
            let _ = writeln!(out, "<div><h3>{}</h3><dl>{rows}</dl></div>", markup(title));
        }
    };
    for (title, rows) in &header.metadata {
        group(title, rows);
    }
    let count = |n: u64| if s.computed { String::new() } else { n.to_string() };
    let step = &s.stepper;
    let row = |key: &str, value: String| (key.to_owned(), value);
    let mut rows = vec![
        row("name", step.name.clone()),
        row("step_s", if step.h_s > 0.0 { number(step.h_s, 6) } else { String::new() }),
    ];
    rows.extend(step.settings.0.iter().map(|(key, value)| match value {
        SettingValue::Number(x) => row(key, number(*x, 6)),
        SettingValue::Flag(_) | SettingValue::Word(_) => row(key, value.to_string()),
    }));
    rows.push(row("steps", count(step.steps)));
    rows.push(row("evaluations", count(step.evaluations)));
    rows.push(row("factorisations", count(step.factorisations)));
    group("stepper", &rows);
    // File names without folders, so that the page does not depend on the folder.
    let f = &s.files;
    let pages = [&f.report, &f.report_md].into_iter().flatten().map(String::as_str);
    let names: Vec<String> = pages
        .chain(f.recordings.iter().map(|(_, path)| path))
        .chain(f.figures.as_deref())
        .filter_map(|path| std::path::Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned()))
        .collect();
    group("files beside this page", &[("files".to_owned(), names.join(", "))]);
    if out.is_empty() {
        return out;
    }
    format!(
        "<section class=\"block\"><h2>Inputs and versions{who}</h2>\n<div class=\"groups\">\n{out}</div></section>\n"
    )
}

/// Collects everything that depends on the machine and the date.
fn timings(runs: &[ReportRun<'_>]) -> String {
    let text = |run: &ReportRun<'_>| {
        let s = run.summary;
        let who = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
        markup(&format!(
            "{who}{:.2} s simulated in {:.2} s ({:.0} times real time), {:.1} ms processor time per simulated second.",
            s.duration_s,
            s.wall_s,
            s.real_time_factor,
            1e3 * s.cpu_s_per_simulated_s
        ))
    };
    // Recordings contain no timings of the machine.
    let lines: Vec<String> = runs.iter().filter(|run| run.summary.wall_s > 0.0).map(text).collect();
    if lines.is_empty() {
        return String::new();
    }
    format!("<p id=\"timings\" class=\"note\">{}</p>\n", lines.join("<br>"))
}
