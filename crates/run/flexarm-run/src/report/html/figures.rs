//! Figures of a single run as tiles, and of several runs as a table. Not here: further tables
//! (`tables`).

use std::fmt::Write as _;

use flexarm_draw::palette;

use super::number::{fixed, number};
use super::run::{ReportRun, method};
use crate::run::comparison::of_one_robot;
use crate::run::summary::{EnergyFigures, Summary, TcpFigures};
use flexarm_settings::written::markup;

/// Name of the settling time in the standard.
pub(super) const STABILISATION: &str = "Position stabilisation time";
/// Errors below this are round-off (m).
const NOTHING_M: f64 = 1e-12;

/// Describes the settling band of a run, such as "within 0.1 mm".
pub(super) fn within(run: &ReportRun<'_>) -> Option<String> {
    run.summary.tcp.as_ref()?.settling_band_m.map(crate::run::settling::within)
}

/// Whether the TCP coincides with that of the rigid twin throughout.
pub(super) fn lies_on_twin(run: &ReportRun<'_>) -> bool {
    run.summary.tcp.as_ref().is_some_and(|tcp| tcp.peak_m < NOTHING_M)
}

/// Returns the main figures of a run as tiles; the first tile is larger.
pub(super) fn tiles(run: &ReportRun<'_>) -> String {
    let s = run.summary;
    let band = within(run).unwrap_or_default();
    let mut out = "<section id=\"summary\" class=\"tiles\">\n".to_owned();
    let mut tile = |name: &str, value: String, unit: &str, note: String| {
        let class = if out.contains("<div") { "tile" } else { "tile main" };
        let _ = writeln!(
            out,
            "<div class=\"{class}\"><h2>{name}</h2><p class=\"value\">{value}<small>{unit}</small></p><p>{}</p></div>",
            markup(&note)
        );
    };
    // Without the rigid twin there is no TCP error: the run itself is described.
    if let Some(tcp) = &s.tcp {
        let mm = |x: f64| fixed(1e3 * x);
        let when = if lies_on_twin(run) { "nothing is flexible".into() } else { format!("at {:.3} s", tcp.t_peak_s) };
        tile("Peak TCP error", mm(tcp.peak_m), "mm", when);
        tile("RMS TCP error", mm(tcp.rms_m), "mm", "over the whole run".into());
        if let (Some(at_rest), Some(moving), Some(most)) =
            (tcp.static_at_peak_m, tcp.dynamic_at_peak_m, tcp.dynamic_peak_m)
        {
            tile("Static part", mm(at_rest), "mm", "of the peak: static deflection there".into());
            tile("Dynamic part", mm(moving), "mm", format!("of the peak; maximum {} mm", mm(most)));
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
            tile("Maximum drive force", fixed(*peak), "N m", format!("{joint} (N if it slides)"));
        }
        if !s.computed {
            let open = format!("imbalance {:.1e}", s.energy.imbalance);
            let gross = format!("{} by the drives, {open}", gross(&s.energy));
            tile("Net work of the drives", fixed(s.energy.drives_j), "J", gross);
        }
    }
    out + "</section>\n"
}

/// Work supplied and absorbed by the drives.
fn gross(e: &EnergyFigures) -> String {
    format!("+{} −{} J", number(e.drives_positive_j, 4), number(e.drives_negative_j, 4))
}

/// Row of the comparison: name, unit, and value for a run.
type Compared = (&'static str, &'static str, fn(&Summary) -> Option<f64>);

/// TCP figures, if the moves on which they depend are known.
pub(super) fn moving(s: &Summary) -> Option<&TcpFigures> {
    s.tcp.as_ref().filter(|_| s.knows_moves())
}

/// Units for which a relative change is shown; times and energies have no natural zero.
const RELATIVE: [&str; 3] = ["mm", "mrad", "Hz"];

const COMPARED: [Compared; 18] = [
    ("peak TCP error", "mm", |s| s.tcp.as_ref().map(|t| 1e3 * t.peak_m)),
    ("static part of the peak", "mm", |s| Some(1e3 * s.tcp.as_ref()?.static_at_peak_m?)),
    ("dynamic part of the peak", "mm", |s| Some(1e3 * s.tcp.as_ref()?.dynamic_at_peak_m?)),
    ("maximum dynamic part", "mm", |s| Some(1e3 * s.tcp.as_ref()?.dynamic_peak_m?)),
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

/// Figure that is shown as text if it has no value.
const SETTLING: &str = "settling time";

/// Text for a figure that a run does not have.
pub(super) fn without_number(s: &Summary, figure: &str) -> String {
    match moving(s).filter(|_| [SETTLING, STABILISATION].contains(&figure)) {
        Some(tcp) => tcp.settling_state().short().to_owned(),
        None => "–".to_owned(),
    }
}

/// Figure that is itself a difference.
const APART: &str = "apart from the first run";

/// Returns the table that compares runs with the first one.
pub(super) fn comparison(runs: &[ReportRun<'_>]) -> String {
    let mut out =
        "<section id=\"summary\" class=\"block\"><h2>Figures side by side</h2><div class=\"scroll\"><table><thead><tr>\
                   <th>figure</th><th>unit</th>"
            .to_owned();
    // Head: a column per run, in the colour of its curves.
    for (k, run) in runs.iter().enumerate() {
        let color = k % palette::SERIES_LENGTH;
        let label = markup(run.label);
        let _ =
            write!(out, "<th class=\"number\"><i class=\"key\" style=\"background:var(--c{color})\"></i>{label}</th>");
    }
    out += "</tr></thead><tbody>";
    let row = |name: &str, unit: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("<td class=\"number\">{}</td>", markup(cell))).collect();
        format!("<tr><th>{name}</th><td>{unit}</td>{cells}</tr>")
    };
    // Figures with the change from the first run; rows that no run has are left out.
    let one_robot: Vec<bool> = runs.iter().map(|run| of_one_robot(runs[0].trace, run.trace)).collect();
    for (name, unit, value) in COMPARED {
        let values: Vec<Option<f64>> = runs.iter().map(|run| value(run.summary)).collect();
        let base = values[0];
        let relative = RELATIVE.contains(&unit) && name != APART;
        let cell = |(k, v): (usize, &Option<f64>)| match (v, base) {
            (None, _) => without_number(runs[k].summary, name),
            (Some(v), Some(base)) if k > 0 && relative && one_robot[k] && base.abs() > 1e3 * NOTHING_M => {
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
    // Robot, motion and method of each run.
    let or_none = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
    out += &row("robot", "", runs.iter().map(|run| run.summary.robot.clone()).collect());
    out += &row("trajectory", "", runs.iter().map(|run| or_none(&run.summary.trajectory)).collect());
    out += &row("links", "", runs.iter().map(|run| or_none(&run.summary.links_model)).collect());
    out += &row("stepper", "", runs.iter().map(|run| or_none(&method(run.summary, "").unwrap_or_default())).collect());
    // Explanation below the table.
    let apart = match runs.iter().any(|run| run.summary.difference.is_some()) {
        true => " Apart: maximum distance of the flexible TCP from that of the first run at the same time.",
        false => "",
    };
    out += "</tbody></table></div><p class=\"note\">";
    if one_robot.iter().skip(1).any(|one| *one) {
        out += "In brackets: against the first run.";
    }
    let others = runs.iter().zip(&one_robot).filter(|(_, one)| !**one).map(|(run, _)| markup(run.label));
    let others: Vec<String> = others.collect();
    if !others.is_empty() {
        let (first, others) = (markup(runs[0].label), others.join(", "));
        let _ = write!(out, " Another robot than that of {first}, so that there are no differences: {others}.");
    }
    out + apart + "</p></section>\n"
}
