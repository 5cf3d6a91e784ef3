//! The report as one page that loads nothing: style, behaviour, data and pictures are written into it.
//!
//! The same runs give the same bytes, but for the paragraph with the id `timings`. Start at [`html`].
//! Not here: what is plotted (`curves`), how the arm is drawn (`picture`), how plots behave (`assets/report.js`).

use std::fmt::Write as _;

use base64::Engine as _;
use flexarm_draw::palette::{self, Ground, hex};
use flexarm_log::{EventKind, RunHeader, Trace};

use super::curves::{Kind, Plot, overlays, plots};
use super::path_plan::path_plan;
use super::picture::{pictures, scale_colors};
use crate::html_page::escaped;
use crate::monitor::tool_path::PathMoveFigures;
use crate::stepper_settings::SettingValue;
use crate::summary::{EnergyFigures, Summary, TcpFigures};

const STYLE: &str = include_str!("../../assets/report.css");
const BEHAVIOUR: &str = include_str!("../../assets/report.js");
const UPLOT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../../assets/uplot/LICENSE");
const UPLOT_VERSION: &str = "1.6.32";

/// Errors below this are rounding (m).
const NOTHING_M: f64 = 1e-12;

/// Most moves of the tool in the table of the page.
const MOST_MOVES: usize = 200;
/// Width of the pictures of the arm (pixels): sharp at the width at which the page shows them.
const PICTURE_WIDTH: usize = 1080;

/// A run in a report.
#[derive(Clone, Copy, Debug)]
pub struct ReportRun<'a> {
    /// Name of the run, where there are several.
    pub label: &'a str,
    /// Its figures.
    pub summary: &'a Summary,
    /// Its curves.
    pub trace: &'a Trace,
}

/// The report of one run, or of several beside each other: the first is the main one.
#[must_use]
pub fn html(runs: &[ReportRun<'_>]) -> String {
    let Some(main) = runs.first() else {
        return "<!DOCTYPE html>\n<title>flexarm report</title>\n<p>No runs.\n".to_owned();
    };
    let title = match runs {
        [run] => super::title(run.summary),
        _ => format!("{} runs: {}", runs.len(), runs.iter().map(|run| run.label).collect::<Vec<_>>().join(", ")),
    };
    // The banner of the minified file names an address; licence and origin stand in a comment of this page.
    let uplot = UPLOT.split_once("*/").map_or(UPLOT, |(_, code)| code);
    let mut page = String::new();
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"generator\" content=\"flexarm {}\">\n<title>{}</title>\n\
         <style>\n{UPLOT_STYLE}\n{}{STYLE}</style>\n</head>\n<body>\n",
        env!("CARGO_PKG_VERSION"),
        escaped(&title),
        colors()
    );
    let drawn: Vec<Vec<Plot>> = runs.iter().map(|run| plots(run.summary, run.trace)).collect();
    let body = body(main, runs, &thinning(runs, &drawn));
    page += &heading(&title, runs, &body);
    let _ = write!(page, "<main>\n{body}</main>\n");
    let _ = write!(
        page,
        "<script type=\"application/json\" id=\"data\">{}</script>\n\
         <script>\n/* uPlot {UPLOT_VERSION}\n\n{}\n*/\n{}</script>\n<script>\n{BEHAVIOUR}</script>\n</body>\n</html>\n",
        data(runs, &drawn),
        UPLOT_LICENSE.trim(),
        uplot.trim_start()
    );
    page
}

/// The colours of curves as variables of the style: `--c0` and so on, `--x`, `--y`, `--z`, `--rigid`, dark where the reader
/// wants it dark; and under `--paper-...` for print.
fn colors() -> String {
    let list = |prefix: &str, ground: Ground| {
        let series = (0..palette::SERIES_LENGTH).map(|k| (format!("c{k}"), palette::series(k, ground)));
        let axes = ["x", "y", "z"].into_iter().enumerate().map(|(k, name)| (name.to_owned(), palette::axis(k, ground)));
        let all = series.chain(axes).chain([("rigid".to_owned(), palette::rigid(ground))]);
        all.map(|(name, color)| format!(" --{prefix}{name}: {};", hex(color))).collect::<String>()
    };
    format!(
        ":root {{{}{} }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{{} }} }}\n",
        list("", Ground::Paper),
        list("paper-", Ground::Paper),
        list("", Ground::Dark)
    )
}

fn body(main: &ReportRun<'_>, runs: &[ReportRun<'_>], thinning: &str) -> String {
    let mut body: String = runs.iter().map(|run| troubles(run, runs.len() > 1)).collect();
    if let [run] = runs {
        body += &tiles(run);
    } else {
        body += &comparison(runs);
    }
    body += &arm_pictures(runs);
    body += &tool_path(main);
    body += "<section id=\"plots\"><noscript><p>The plots need JavaScript.</p></noscript></section>\n";
    body += thinning;
    body += &iso_table(runs);
    let of = if runs.len() > 1 { format!(" of {}", escaped(main.label)) } else { String::new() };
    body += &stops_table(main.summary, &of);
    body += &parts_tables(main.summary, &of);
    let inputs: String = runs.iter().map(|run| inputs(run, runs.len() > 1)).collect();
    if !inputs.is_empty() {
        let _ = write!(body, "<div id=\"inputs\">\n{inputs}</div>\n");
    }
    body + &timings(runs)
}

/// Parts of the page that can be gone to: name of the link, place.
const PLACES: [(&str, &str); 5] =
    [("Figures", "summary"), ("Arm", "arm"), ("Plots", "plots"), ("Tables", "tables"), ("Inputs", "inputs")];

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
        facts.push(format!("{} s", number(s.duration_s, 4)));
        facts.extend(method(s, "step "));
    }
    facts.push(format!("flexarm {}", env!("CARGO_PKG_VERSION")));
    let facts: Vec<String> = facts.iter().map(|fact| format!("<span>{}</span>", escaped(fact))).collect();
    // Names of runs are escaped: none can look like a place.
    let there = PLACES.iter().filter(|(_, id)| body.contains(&format!("id=\"{id}\"")));
    let links: String = there.map(|(name, id)| format!("<a href=\"#{id}\">{name}</a>")).collect();
    format!(
        "<header>\n<h1>{}</h1>\n{}<p class=\"facts\">{}</p>\n<nav>{links}</nav>\n</header>\n",
        escaped(title),
        headlines(runs),
        facts.join("")
    )
}

/// What bends and how far, a line for each run.
fn headlines(runs: &[ReportRun<'_>]) -> String {
    let line = |run: &ReportRun<'_>| {
        let who = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
        format!("<p class=\"headline\">{}</p>\n", escaped(&(who + &run.summary.headline)))
    };
    runs.iter().filter(|run| !run.summary.headline.is_empty()).map(line).collect()
}

/// Stepper and step, as far as they are known.
fn method(s: &Summary, before: &str) -> Option<String> {
    let step = (s.stepper.h_s > 0.0).then(|| format!("{before}{} ms", number(1e3 * s.stepper.h_s, 4)));
    let name = Some(s.stepper.name.clone()).filter(|name| !name.is_empty());
    let known: Vec<String> = name.into_iter().chain(step).collect();
    (!known.is_empty()).then(|| known.join(", "))
}

/// Why a run stopped, and its warnings.
fn troubles(run: &ReportRun<'_>, named: bool) -> String {
    let s = run.summary;
    let who = if named { format!("{}: ", escaped(run.label)) } else { String::new() };
    let mut out = String::new();
    if s.computed {
        let why =
            "The recording holds no result: the figures of the tool are computed from its curves, others are missing.";
        let _ = writeln!(out, "<p class=\"block note\"><strong>{who}End not known.</strong> {why}</p>");
    } else if s.end != "complete" {
        let _ = writeln!(out, "<p class=\"stopped\"><strong>{who}Stopped early.</strong> {}</p>", escaped(&s.end));
    }
    if !s.warnings.is_empty() {
        let plural = if s.warnings.len() == 1 { "warning" } else { "warnings" };
        let items: String = s.warnings.iter().map(|w| format!("<li>{}</li>", escaped(w))).collect();
        let count = s.warnings.len();
        let _ = writeln!(
            out,
            "<details class=\"warnings\" open><summary>{who}{count} {plural}</summary><ul>{items}</ul></details>"
        );
    }
    out
}

/// A number with so many significant digits, without needless zeros.
fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let x: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    // Nothing is gained by -0.
    let x = if x == 0.0 { 0.0 } else { x };
    let (plain, scientific) = (format!("{x}"), format!("{x:e}"));
    if x == 0.0 || (1e-3..1e7).contains(&x.abs()) { plain } else { scientific }
}

/// A number that keeps its digits, so that a row of tiles looks even.
fn fixed(x: f64) -> String {
    let digits = match x.abs() {
        a if a >= 100.0 => 1,
        a if a >= 10.0 => 2,
        a if a >= 0.0995 || a == 0.0 => 3,
        _ => 4,
    };
    format!("{x:.digits$}")
}

/// The settling band of a run in words, such as "within 0.1 mm".
fn within(run: &ReportRun<'_>) -> Option<String> {
    run.summary.tcp.as_ref()?.settling_band_m.map(crate::settling::within)
}

/// Whether the tool never leaves its rigid twin.
fn lies_on_twin(run: &ReportRun<'_>) -> bool {
    run.summary.tcp.as_ref().is_some_and(|tcp| tcp.peak_m < NOTHING_M)
}

fn tiles(run: &ReportRun<'_>) -> String {
    let s = run.summary;
    let band = within(run).unwrap_or_default();
    let mut out = "<section id=\"summary\" class=\"tiles\">\n".to_owned();
    let mut tile = |name: &str, value: String, unit: &str, note: String| {
        let class = if out.contains("<div") { "tile" } else { "tile main" };
        let _ = writeln!(
            out,
            "<div class=\"{class}\"><h2>{name}</h2><p class=\"value\">{value}<small>{unit}</small></p><p>{}</p></div>",
            escaped(&note)
        );
    };
    if let Some(tcp) = &s.tcp {
        let mm = |x: f64| fixed(1e3 * x);
        let when = if lies_on_twin(run) { "nothing gives way".into() } else { format!("at {:.3} s", tcp.t_peak_s) };
        tile("Peak TCP error", mm(tcp.peak_m), "mm", when);
        tile("RMS TCP error", mm(tcp.rms_m), "mm", "over the whole run".into());
        if let (Some(at_rest), Some(moving), Some(most)) =
            (tcp.static_at_peak_m, tcp.dynamic_at_peak_m, tcp.dynamic_peak_m)
        {
            tile("Static part", mm(at_rest), "mm", "of the peak: standing still there".into());
            tile("Part in motion", mm(moving), "mm", format!("of the peak; up to {} mm", mm(most)));
        }
        tile("Static sag", mm(tcp.static_sag_m), "mm", "at rest at the start".into());
        if s.knows_moves() {
            let settling = tcp.settling_state();
            let value = settling.time_s().map_or_else(|| settling.short().to_owned(), fixed);
            let unit = if settling.time_s().is_some() { "s" } else { "" };
            tile("Settling time", value, unit, settling.note(&band));
        }
        tile("Error at the end", mm(tcp.end_m), "mm", format!("at {:.3} s", s.duration_s));
        match tcp.dominant_hz {
            _ if !s.knows_moves() => {}
            Some(hz) => tile("Dominant frequency", fixed(hz), "Hz", "strongest line of the ringing".into()),
            None => tile("Dominant frequency", "–".into(), "", tcp.no_line().into()),
        }
    } else {
        tile("Simulated time", fixed(s.duration_s), "s", s.stepper.name.clone());
        if let Some(hz) = s.frequencies_hz.first() {
            tile("First natural frequency", fixed(*hz), "Hz", "at the start pose, motors held".into());
        }
        if let Some((joint, peak)) = s.drives.iter().max_by(|a, b| a.1.total_cmp(b.1)) {
            tile("Largest force of a drive", fixed(*peak), "N m", format!("{joint} (N if it slides)"));
        }
        if !s.computed {
            let open = format!("balance open by {:.1e}", s.energy.imbalance);
            let gross = format!("{} by the drives, {open}", gross(&s.energy));
            tile("Net work of the drives", fixed(s.energy.drives_j), "J", gross);
        }
    }
    out + "</section>\n"
}

/// What the drives put in and took out.
fn gross(e: &EnergyFigures) -> String {
    format!("+{} −{} J", number(e.drives_positive_j, 4), number(e.drives_negative_j, 4))
}

/// A figure of the comparison: name, unit, and its value of a run.
type Compared = (&'static str, &'static str, fn(&Summary) -> Option<f64>);

/// The figures of the tool that mean nothing unless the moves are known.
fn moving(s: &Summary) -> Option<&TcpFigures> {
    s.tcp.as_ref().filter(|_| s.knows_moves())
}

/// Units of figures of which a change in per cent says something; a time or an energy has no natural zero.
const RELATIVE: [&str; 3] = ["mm", "mrad", "Hz"];

const COMPARED: [Compared; 18] = [
    ("peak TCP error", "mm", |s| s.tcp.as_ref().map(|t| 1e3 * t.peak_m)),
    ("static part of the peak", "mm", |s| Some(1e3 * s.tcp.as_ref()?.static_at_peak_m?)),
    ("part of the peak in motion", "mm", |s| Some(1e3 * s.tcp.as_ref()?.dynamic_at_peak_m?)),
    ("largest part in motion", "mm", |s| Some(1e3 * s.tcp.as_ref()?.dynamic_peak_m?)),
    ("time of the peak", "s", |s| s.tcp.as_ref().map(|t| t.t_peak_s)),
    ("RMS TCP error", "mm", |s| s.tcp.as_ref().map(|t| 1e3 * t.rms_m)),
    (APART, "mm", |s| s.difference.as_ref().map(|d| 1e3 * d.peak_m)),
    ("apart, of the first run's peak", "%", |s| s.difference.as_ref()?.of_peak_error.map(|x| 100.0 * x)),
    ("path accuracy", "mm", |s| moving(s).map(|t| 1e3 * t.path_accuracy_m)),
    ("static sag", "mm", |s| s.tcp.as_ref().map(|t| 1e3 * t.static_sag_m)),
    ("error at the end", "mm", |s| s.tcp.as_ref().map(|t| 1e3 * t.end_m)),
    ("overshoot", "mm", |s| moving(s).map(|t| 1e3 * t.overshoot_m)),
    (SETTLING, "s", |s| moving(s).and_then(|t| t.settling_state().time_s())),
    ("peak rotation", "mrad", |s| s.tcp.as_ref().map(|t| 1e3 * t.peak_rad)),
    ("dominant frequency", "Hz", |s| moving(s).and_then(|t| t.dominant_hz)),
    ("first natural frequency", "Hz", |s| s.frequencies_hz.first().copied()),
    ("work of the drives, net", "J", |s| (!s.computed).then_some(s.energy.drives_j)),
    ("work put in by the drives", "J", |s| (!s.computed).then_some(s.energy.drives_positive_j)),
];

/// The figure that is a word where there is no number.
const SETTLING: &str = "settling time";

/// What stands in the place of a figure that a run does not have.
fn without_number(s: &Summary, figure: &str) -> String {
    match moving(s).filter(|_| [SETTLING, STABILISATION].contains(&figure)) {
        Some(tcp) => tcp.settling_state().short().to_owned(),
        None => "–".to_owned(),
    }
}

/// The name of a figure that is a difference already.
const APART: &str = "apart from the first run";

fn comparison(runs: &[ReportRun<'_>]) -> String {
    let mut out =
        "<section id=\"summary\" class=\"block\"><h2>Figures side by side</h2><div class=\"scroll\"><table><thead><tr>\
                   <th>figure</th><th>unit</th>"
            .to_owned();
    for (k, run) in runs.iter().enumerate() {
        let color = k % palette::SERIES_LENGTH;
        let label = escaped(run.label);
        let _ =
            write!(out, "<th class=\"number\"><i class=\"key\" style=\"background:var(--c{color})\"></i>{label}</th>");
    }
    out += "</tr></thead><tbody>";
    let row = |name: &str, unit: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("<td class=\"number\">{}</td>", escaped(cell))).collect();
        format!("<tr><th>{name}</th><td>{unit}</td>{cells}</tr>")
    };
    for (name, unit, value) in COMPARED {
        let values: Vec<Option<f64>> = runs.iter().map(|run| value(run.summary)).collect();
        let base = values[0];
        let relative = RELATIVE.contains(&unit) && name != APART;
        let cell = |(k, v): (usize, &Option<f64>)| match (v, base) {
            (None, _) => without_number(runs[k].summary, name),
            (Some(v), Some(base)) if k > 0 && relative && base.abs() > 1e3 * NOTHING_M => {
                let change = format!("{:+.1}", 100.0 * (v / base - 1.0));
                format!("{} ({} %)", number(*v, 5), if change == "-0.0" { "+0.0" } else { &change })
            }
            (Some(v), _) => number(*v, 5),
        };
        let words = name == SETTLING && runs.iter().any(|run| moving(run.summary).is_some());
        if words || values.iter().any(Option::is_some) {
            out += &row(name, unit, values.iter().enumerate().map(cell).collect());
        }
    }
    let or_none = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
    out += &row("robot", "", runs.iter().map(|run| run.summary.robot.clone()).collect());
    out += &row("trajectory", "", runs.iter().map(|run| or_none(&run.summary.trajectory)).collect());
    out += &row("links", "", runs.iter().map(|run| or_none(&run.summary.links_model)).collect());
    out += &row("stepper", "", runs.iter().map(|run| or_none(&method(run.summary, "").unwrap_or_default())).collect());
    let apart = match runs.iter().any(|run| run.summary.difference.is_some()) {
        true => " Apart: largest distance of the flexible TCP from that of the first run at the same time.",
        false => "",
    };
    out += "</tbody></table></div><p class=\"note\">In brackets: against the first run.";
    out + apart + "</p></section>\n"
}

/// The plan of the tool's path and its moves, of a motion that is told by it.
fn tool_path(run: &ReportRun<'_>) -> String {
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
    let rows: Vec<Vec<String>> = path.moves.iter().take(MOST_MOVES).map(row).collect();
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
    if path.moves.len() > MOST_MOVES {
        let _ = writeln!(out, "<p class=\"note\">{} more moves are in the summary.</p>", path.moves.len() - MOST_MOVES);
    }
    out + "</section>\n"
}

fn arm_pictures(runs: &[ReportRun<'_>]) -> String {
    let mut out = "<section id=\"arm\" class=\"block\"><h2>The arm at its largest error</h2>\n".to_owned();
    let with_twin: Vec<_> = runs.iter().filter(|run| run.trace.header.has_rigid).collect();
    if with_twin.is_empty() {
        return String::new();
    }
    for run in &with_twin {
        let header = &run.trace.header;
        let who = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
        let none = if run.trace.peak.flexible.X_WL.is_empty() {
            Some("the recording has no poses of links, so there is no picture of the arm")
        } else if lies_on_twin(run) {
            Some("nothing gives way: the arm lies on its rigid twin, so there is no picture of it")
        } else {
            None
        };
        if let Some(why) = none {
            let _ = writeln!(out, "<p class=\"note\">{}{why}</p>", escaped(&who));
            continue;
        }
        out += "<div class=\"pictures\">\n";
        let error_m = run.trace.peak.error_world[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        let beyond = if header.color_scale_m > 0.0 && error_m > 1.001 * header.color_scale_m {
            format!(" The tool is {} mm off, beyond the scale.", number(1e3 * error_m, 3))
        } else {
            String::new()
        };
        for picture in pictures(run.trace, PICTURE_WIDTH) {
            let caption = format!("{who}{}, at {:.3} s.{beyond}", picture.title, run.trace.peak.time_s);
            match picture.drawn {
                Ok((png, axes)) => {
                    let data = base64::engine::general_purpose::STANDARD.encode(png);
                    let caption = escaped(&caption);
                    let _ = writeln!(
                        out,
                        "<figure><div class=\"arm\"><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">{}</div>\
                         <figcaption>{caption}</figcaption></figure>",
                        triad(&axes)
                    );
                }
                Err(why) => {
                    let _ = writeln!(out, "<p class=\"note\">{}</p>", escaped(&why));
                }
            }
        }
        out += "</div>\n";
        out += &picture_key(header);
    }
    out + "</section>\n"
}

/// The axes of the world as they lie in a picture; those that point at the viewer are left out.
fn triad(axes: &[[f64; 2]; 3]) -> String {
    const LENGTH: f64 = 24.0;
    let mut out = "<svg class=\"triad\" viewBox=\"-40 -40 80 80\" aria-hidden=\"true\">".to_owned();
    for (name, [right, up]) in ["x", "y", "z"].into_iter().zip(axes) {
        if right.hypot(*up) < 0.15 {
            continue;
        }
        let at = |length: f64| (short(length * right, 3), short(-length * up, 3));
        let ((x, y), (s, t)) = (at(LENGTH), at(LENGTH + 9.0));
        let _ = write!(
            out,
            "<g style=\"stroke:var(--{name});fill:var(--{name})\"><line x1=\"0\" y1=\"0\" x2=\"{x}\" y2=\"{y}\"/>\
             <text x=\"{s}\" y=\"{t}\">{name}</text></g>"
        );
    }
    out + "</svg>"
}

/// What the pictures of a run mean: colours, magnification, ghost and arrow.
fn picture_key(header: &RunHeader) -> String {
    let factor = if header.magnification > 0.0 { header.magnification } else { 1.0 };
    let how = match factor {
        1.0 => "Deflections as they are".to_owned(),
        _ => format!("Deflections magnified {} times", number(factor, 3)),
    };
    let mut out = format!(
        "<div class=\"key-of-arm\"><p>{how}. <i class=\"ghost\"></i>rigid arm, <i class=\"way\"></i>path of the tool.</p>"
    );
    let colors: Vec<String> = scale_colors().into_iter().map(hex).collect();
    if header.color_scale_m > 0.0 && !colors.is_empty() {
        let at = |share: f64| number(1e3 * share * header.color_scale_m, 3);
        let _ = write!(
            out,
            "<div class=\"scale\"><p>True deviation from the rigid arm</p>\
             <div style=\"background:linear-gradient(to right,{})\"></div>\
             <p><span>0</span><span>{}</span><span>{} mm</span></p></div>",
            colors.join(","),
            at(0.5),
            at(1.0)
        );
    }
    out + "</div>\n"
}

/// Most poses with several stops that a page lists.
const MOST_POSES: usize = 50;

/// A row of the ISO table: name, meaning, unit, value.
type Iso = (&'static str, &'static str, &'static str, fn(&Summary) -> Option<f64>);

/// The name of the settling time in the standard.
const STABILISATION: &str = "Position stabilisation time";

const ISO: [Iso; 8] = [
    (
        "Path accuracy (AT)",
        "largest distance of the flexible tool from the rigid tool across the path, while moving",
        "mm",
        |s| moving(s).map(|t| 1e3 * t.path_accuracy_m),
    ),
    ("RMS distance from the path", "of the same, over the samples of the moves", "mm", |s| {
        moving(s).map(|t| 1e3 * t.path_rms_m)
    }),
    ("Lag along the path", "largest deviation along the path, whole run", "mm", |s| {
        s.tcp.as_ref().map(|t| 1e3 * t.path_peak_m[0])
    }),
    (
        "Position overshoot (OV)",
        "largest excursion past the place of rest, in the direction of approach, over all stops",
        "mm",
        |s| moving(s).map(|t| 1e3 * t.overshoot_m),
    ),
    (
        STABILISATION,
        "from the end of a commanded move until the tool stays BAND of its place of rest, at the stop that takes longest",
        "s",
        |s| moving(s).and_then(|t| t.settling_state().time_s()),
    ),
    ("Pose accuracy (AP)", "largest distance from the rigid tool at rest, over all stops", "mm", |s| {
        let rests = moving(s)?.holds.iter().map(|hold| 1e3 * hold.final_m);
        rests.reduce(f64::max)
    }),
    ("Pose repeatability (RP)", "scatter of the places at the end of repeated stops, at the worst pose", "mm", |s| {
        moving(s)?.poses.iter().map(|pose| 1e3 * pose.repeatability_m).reduce(f64::max)
    }),
    ("Static sag", "distance from the rigid tool at rest at the start", "mm", |s| {
        s.tcp.as_ref().map(|t| 1e3 * t.static_sag_m)
    }),
];

fn iso_table(runs: &[ReportRun<'_>]) -> String {
    if runs.iter().all(|run| run.summary.tcp.is_none()) {
        return "<h2 id=\"tables\">Tables</h2>\n".to_owned();
    }
    let mut out = "<section id=\"tables\" class=\"block\"><h2>ISO 9283-style figures</h2>\n\
                   <p class=\"note\">ISO 9283-style, not a conformity test: one deterministic cycle against the rigid twin as the command, \
                   not thirty measured cycles.</p>\n<div class=\"scroll\"><table><thead><tr><th>figure</th><th>meaning</th>"
        .to_owned();
    for run in runs {
        let name = if runs.len() > 1 { escaped(run.label) } else { "value".into() };
        let _ = write!(out, "<th class=\"number\">{name}</th>");
    }
    out += "<th>unit</th></tr></thead><tbody>";
    let mut bands = runs.iter().filter(|run| run.summary.tcp.is_some()).map(within);
    let first = bands.next().flatten();
    let band = first.filter(|first| bands.all(|band| band.as_ref() == Some(first)));
    let band = band.unwrap_or_else(|| "within the settling band".into());
    for (name, meaning, unit, value) in ISO {
        // What is not known is no row; what there is not, such as the end of a ringing, is.
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

/// A table with a heading (as HTML); cells that are numbers are set to the right.
fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let is_number = |column: usize| {
        column > 0 && rows.iter().all(|row| row[column].starts_with(|c: char| "-–0123456789".contains(c)))
    };
    let class = |column: usize| if is_number(column) { " class=\"number\"" } else { "" };
    let heads: String =
        head.iter().enumerate().map(|(k, name)| format!("<th{}>{}</th>", class(k), escaped(name))).collect();
    let mut out = format!(
        "<section class=\"block\"><h2>{title}</h2><div class=\"scroll\"><table><thead><tr>{heads}</tr></thead><tbody>"
    );
    for row in rows {
        let cells: String = (row.iter().enumerate().skip(1))
            .map(|(k, cell)| format!("<td{}>{}</td>", class(k), escaped(cell)))
            .collect();
        let _ = write!(out, "<tr><th>{}</th>{cells}</tr>", escaped(&row[0]));
    }
    out + "</tbody></table></div></section>\n"
}

fn stops_table(s: &Summary, of: &str) -> String {
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
    let poses: Vec<Vec<String>> = (tcp.poses.iter().take(MOST_POSES))
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

fn parts_tables(s: &Summary, of: &str) -> String {
    let row = |kind: &str, name: &str, share: f64, turn: f64, strain: Option<f64>| {
        let strain = strain.map_or_else(|| "–".into(), |x| number(x, 3));
        vec![name.to_owned(), kind.to_owned(), number(1e3 * share, 4), number(1e3 * turn, 4), strain]
    };
    let links = s
        .links
        .iter()
        .map(|l| row("link", &l.name, l.peak_contribution_m, l.peak_rotation_rad, Some(l.engineering_strain)));
    let drives =
        s.elastic_drives.iter().map(|d| row("drive", &d.joint, d.peak_contribution_m, d.peak_deflection_rad, None));
    let rows: Vec<_> = links.chain(drives).collect();
    let head =
        ["name", "kind", "largest share of TCP error (mm)", "largest rotation (mrad)", "change of length (relative)"];
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
    out += &table(&format!("Largest forces of the drives{of}"), &["joint", "N m, or N if it slides"], &forces);
    out += &table(&format!("Natural frequencies at the start{of}"), &["mode", "Hz"], &frequencies);
    out += &table(&format!("Energy over the run{of}"), &["what", "value", "unit"], &energies);
    out + "</div>\n"
}

fn inputs(run: &ReportRun<'_>, named: bool) -> String {
    let (s, header) = (run.summary, &run.trace.header);
    let who = if named { format!(" of {}", escaped(run.label)) } else { String::new() };
    let mut out = String::new();
    let mut group = |title: &str, rows: &[(String, String)]| {
        let rows: String = (rows.iter().filter(|(_, value)| !value.is_empty()))
            .map(|(key, value)| format!("<dt>{}</dt><dd>{}</dd>", escaped(key), escaped(value)))
            .collect();
        if !rows.is_empty() {
            let _ = writeln!(out, "<div><h3>{}</h3><dl>{rows}</dl></div>", escaped(title));
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
    // File names alone: the same run in another folder is the same page.
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

/// What depends on the machine and the day, in one place.
fn timings(runs: &[ReportRun<'_>]) -> String {
    let text = |run: &ReportRun<'_>| {
        let s = run.summary;
        let who = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
        escaped(&format!(
            "{who}{:.2} s simulated in {:.2} s ({:.0} times real time), {:.1} ms processor time per simulated second.",
            s.duration_s,
            s.wall_s,
            s.real_time_factor,
            1e3 * s.cpu_s_per_simulated_s
        ))
    };
    // Recordings hold no times of the machine.
    let lines: Vec<String> = runs.iter().filter(|run| run.summary.wall_s > 0.0).map(text).collect();
    if lines.is_empty() {
        return String::new();
    }
    format!("<p id=\"timings\" class=\"note\">{}</p>\n", lines.join("<br>"))
}

/// What of the samples the plots do not show, if there is something.
fn thinning(runs: &[ReportRun<'_>], drawn: &[Vec<Plot>]) -> String {
    let mut sentences = Vec::new();
    let mut tables = drawn.iter().flatten().flat_map(|plot| &plot.views).flat_map(|view| &view.tables);
    if tables.any(|table| table.is_thinned) {
        sentences.push(
            "Plots of many samples are thinned: of equal pieces of a curve the smallest and the largest value are kept, so \
             that peaks stay. Recordings have every sample."
                .to_owned(),
        );
    }
    for run in runs.iter().filter(|run| run.trace.samples_per_block() > 1) {
        let (size, all) = (run.trace.samples_per_block(), run.trace.samples());
        let label = escaped(run.label);
        sentences.push(format!(
            "{label}: curves are the smallest and the largest value of each {size} of the run's {all} samples."
        ));
    }
    match sentences.is_empty() {
        true => String::new(),
        false => format!("<p id=\"thinning\" class=\"note\">{}</p>\n", sentences.join("<br>")),
    }
}

/// What the plots are made of, as JSON that may stand in a script element.
fn data(runs: &[ReportRun<'_>], drawn: &[Vec<Plot>]) -> String {
    let list = |items: Vec<String>| format!("[{}]", items.join(","));
    let run = |(run, drawn): (&ReportRun<'_>, &Vec<Plot>)| {
        let still = lies_on_twin(run);
        let events = run.trace.result.events.iter().filter(|event| !(still && event.kind == EventKind::Peak));
        let events = events.map(|event| {
            let (kind, text) = (json_text(event.kind.word()), json_text(&event.text));
            format!("{{\"t\":{},\"kind\":{kind},\"text\":{text}}}", short(event.time_s, 7))
        });
        let plots = drawn.iter().map(json_plot).collect();
        format!(
            "{{\"label\":{},\"events\":{},\"plots\":{}}}",
            json_text(run.label),
            list(events.collect()),
            list(plots)
        )
    };
    let several: Vec<_> = runs.iter().map(|run| (run.label, run.summary, run.trace)).collect();
    let overlays = if runs.len() > 1 { overlays(&several) } else { Vec::new() };
    let overlays = list(overlays.iter().map(json_plot).collect());
    let json = format!("{{\"runs\":{},\"overlays\":{overlays}}}", list(runs.iter().zip(drawn).map(run).collect()));
    // No text in it can end the script element or begin a comment.
    json.replace('<', "\\u003c")
}

fn json_text(text: &str) -> String {
    serde_json::to_string(text).expect("text is JSON")
}

/// The shorter form of a number with so many significant digits; null if it is none.
fn short(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "null".into();
    }
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    let rounded = if rounded == 0.0 { 0.0 } else { rounded };
    let (plain, scientific) = (format!("{rounded}"), format!("{rounded:e}"));
    if scientific.len() < plain.len() { scientific } else { plain }
}

fn json_plot(plot: &Plot) -> String {
    let numbers = |values: &[f64], digits| values.iter().map(|x| short(*x, digits)).collect::<Vec<_>>().join(",");
    let views = plot.views.iter().map(|view| {
        let tables = view.tables.iter().map(|table| {
            let curves = table.curves.iter().map(|curve| {
                let kind = match curve.kind {
                    Kind::Plain => "",
                    Kind::Total => "total",
                    Kind::Dashed => "dashed",
                    Kind::Axis(k) => ["x", "y", "z"][k % 3],
                };
                let name = json_text(&curve.name);
                format!("{{\"name\":{name},\"kind\":\"{kind}\",\"y\":[{}]}}", numbers(&curve.y, 5))
            });
            let curves = curves.collect::<Vec<_>>().join(",");
            format!("{{\"x\":[{}],\"curves\":[{curves}]}}", numbers(&table.x, 7))
        });
        let (name, unit) = (json_text(&view.name), json_text(view.y_unit));
        format!("{{\"name\":{name},\"unit\":{unit},\"tables\":[{}]}}", tables.collect::<Vec<_>>().join(","))
    });
    let marks = plot.marks.iter().map(|(x, text)| format!("{{\"x\":{},\"text\":{}}}", short(*x, 6), json_text(text)));
    let texts = [
        ("id", plot.id),
        ("section", plot.section),
        ("title", plot.title),
        ("note", &plot.note),
        ("xLabel", plot.x_label),
        ("xUnit", plot.x_unit),
        ("yLabel", plot.y_label),
        ("yUnit", plot.y_unit),
    ];
    let texts: String = texts.iter().map(|(key, text)| format!("\"{key}\":{},", json_text(text))).collect();
    format!(
        "{{{texts}\"time\":{},\"log\":{},\"wide\":{},\"marks\":[{}],\"views\":[{}]}}",
        plot.over_time,
        plot.logarithmic,
        plot.wide,
        marks.collect::<Vec<_>>().join(","),
        views.collect::<Vec<_>>().join(",")
    )
}
