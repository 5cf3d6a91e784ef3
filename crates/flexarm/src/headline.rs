//! The first line of every result: how far the tool is off, what of it is sag, and what bends.

use serde::{Deserialize, Serialize};

use crate::monitor::tool_path::PathFigures;
use crate::summary::{Summary, TcpFigures};

/// Errors below this are rounding (m).
const NOTHING_M: f64 = 1e-12;

/// What bends in a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Bending {
    /// Names of the flexible links.
    pub links: Vec<String>,
    /// Names of the joints whose gearboxes yield.
    pub gearboxes: Vec<String>,
    /// What the base stands on, if it yields.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting: Option<String>,
}

impl Bending {
    /// Whether nothing does.
    pub fn is_nothing(&self) -> bool {
        self.links.is_empty() && self.gearboxes.is_empty() && self.mounting.is_none()
    }
}

/// What one link, one gearbox or the servos have in the largest TCP error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ShareFigures {
    /// Name of the link or joint.
    pub name: String,
    /// link, gearbox, servo or mounting.
    pub kind: String,
    /// Part of the error along its direction, first order (m): all shares together make the error.
    pub along_m: f64,
}

/// Kind of a flexible link among the shares.
pub(crate) const LINK: &str = "link";
/// Kind of an elastic gearbox.
pub(crate) const GEARBOX: &str = "gearbox";
/// Kind of what the base stands on.
pub(crate) const MOUNTING: &str = "mounting";
/// Kind of what servos leave of the way to go.
pub(crate) const SERVO: &str = "servo";

/// The line for a run; `by_choice`: the robot has something that bends, and this run has it rigid.
pub(crate) fn headline(summary: &Summary, by_choice: bool) -> String {
    let why_nothing = why_nothing(by_choice);
    let nothing = summary.bends.is_nothing();
    match (&summary.tcp, nothing) {
        (None, true) => format!("nothing bends: {why_nothing}"),
        (None, false) => format!("{}; not compared with the rigid robot", what_bends(&summary.bends)),
        (Some(tcp), true) if tcp.peak_m < NOTHING_M => {
            format!("nothing bends, so the tool is where the rigid robot has it: {why_nothing}")
        }
        (Some(tcp), _) => {
            let nothing = if nothing { format!("; nothing bends: {why_nothing}") } else { String::new() };
            let path = summary.path.as_ref().map_or_else(String::new, across);
            format!("{path}{}; {}{nothing}", parts(tcp), shares(tcp))
        }
    }
}

/// Why nothing bends, and what to do about it.
fn why_nothing(by_choice: bool) -> &'static str {
    match by_choice {
        true => "links and drives are rigid as chosen for this run",
        false => {
            "the robot has no flexible link and no gearbox that yields. Give it a robot file with urdf = \"...\" and a \
             [[flexible_link]] (reduced = \"...\" or beam = { ... }), or a [[drive]] with gearbox = { stiffness = ... }"
        }
    }
}

fn what_bends(bends: &Bending) -> String {
    let list = |one: &str, several: &str, names: &[String]| match names {
        [] => None,
        [name] => Some(format!("{one} {name}")),
        _ => Some(format!("{several} {}", names.join(", "))),
    };
    let kinds = [
        list("link", "links", &bends.links),
        list("the gearbox of", "the gearboxes of", &bends.gearboxes),
        list("what it stands on,", "", bends.mounting.as_slice()),
    ];
    let kinds: Vec<String> = kinds.into_iter().flatten().collect();
    format!("what bends: {}", kinds.join("; "))
}

/// Digits behind the point with which a length shows three figures.
fn digits(size_mm: f64) -> usize {
    if size_mm > 0.0 { (2.0 - size_mm.log10().floor()).clamp(1.0, 9.0) as usize } else { 2 }
}

fn parts(tcp: &TcpFigures) -> String {
    let digits = digits(1e3 * tcp.peak_m);
    let mm = |x: f64| format!("{:.digits$}", 1e3 * x);
    let peak = format!("{} mm", mm(tcp.peak_m));
    match (tcp.static_at_peak_m, tcp.dynamic_at_peak_m, tcp.dynamic_peak_m) {
        (Some(at_rest), Some(moving), Some(most)) => {
            let sign = if moving < 0.0 { '-' } else { '+' };
            format!("{peak} = {} static {sign} {} in motion (up to {})", mm(at_rest), mm(moving.abs()), mm(most))
        }
        _ => format!("{peak} (static part not known: the arm has no equilibrium somewhere on its way)"),
    }
}

/// What counts on a path of the tool, before everything else.
fn across(path: &PathFigures) -> String {
    let digits = digits(1e3 * path.across_peak_m);
    let mm = |x: f64| format!("{:.digits$}", 1e3 * x);
    let (peak, left) = (mm(path.across_peak_m), mm(path.left_m));
    format!("{peak} mm across the path, {left} with the workpiece set where the tool is; ")
}

fn shares(tcp: &TcpFigures) -> String {
    let digits = digits(1e3 * tcp.peak_m);
    let most = tcp.shares_at_peak.iter().max_by(|a, b| a.along_m.abs().total_cmp(&b.along_m.abs()));
    let group = |kind: &str, word: &str| {
        let of_kind: Vec<&ShareFigures> = tcp.shares_at_peak.iter().filter(|share| share.kind == kind).collect();
        let sum: f64 = of_kind.iter().map(|share| share.along_m).sum();
        let most = match (of_kind.len(), most.filter(|most| most.kind == kind && kind != SERVO && kind != MOUNTING)) {
            (0, _) => return None,
            (1, Some(most)) => format!(" ({})", most.name),
            (_, Some(most)) => format!(" ({} most)", most.name),
            _ => String::new(),
        };
        // Nothing is gained by -0.
        let sum = format!("{:.digits$}", 1e3 * sum + 0.0);
        Some(format!("{word} {sum}{most}"))
    };
    let groups = [
        group(LINK, "links"),
        group(GEARBOX, "gearboxes"),
        group(MOUNTING, "mounting"),
        group(SERVO, "following error of the servos"),
    ];
    groups.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
