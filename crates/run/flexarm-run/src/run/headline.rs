//! Headline of every result: the TCP error, its static part, and the main contributors.
//!
//! Start at `headline`. Lengths in mm. Not here: the figures themselves (`figures`), settling in
//! words (`settling`).

use serde::{Deserialize, Serialize};

use crate::run::monitor::tool_path::PathFigures;
use crate::run::summary::{Summary, TcpFigures};

/// Errors below this are round-off (m).
const NOTHING_M: f64 = 1e-12;

/// Elastic parts of a robot in a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Bending {
    /// Names of the flexible links.
    pub links: Vec<String>,
    /// Names of the joints with elastic gearboxes.
    pub gearboxes: Vec<String>,
    /// Name of the elastic mounting, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting: Option<String>,
}

impl Bending {
    /// Returns whether nothing is elastic.
    pub fn is_nothing(&self) -> bool {
        self.links.is_empty() && self.gearboxes.is_empty() && self.mounting.is_none()
    }
}

/// Contribution of one link, gearbox, the servos or the stepper to the maximum TCP error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ShareFigures {
    /// Name of the link or joint.
    pub name: String,
    /// `link`, `gearbox`, `servo`, `mounting` or `stepper`.
    pub kind: String,
    /// Contribution along the direction of the error (m); all contributions add up to the error.
    pub along_m: f64,
}

/// Kind of a flexible link among the shares.
pub(crate) const LINK: &str = "link";
/// Kind of an elastic gearbox.
pub(crate) const GEARBOX: &str = "gearbox";
/// Kind of the elastic mounting.
pub(crate) const MOUNTING: &str = "mounting";
/// Kind of the following error of the servos.
pub(crate) const SERVO: &str = "servo";
/// Kind of the joint drift of a stepper in maximal coordinates.
pub(crate) const STEPPER: &str = "stepper";

/// Returns the headline of a run; `by_choice`: whether the robot has elastic parts that this run
/// treats as rigid.
pub(crate) fn headline(summary: &Summary, by_choice: bool) -> String {
    let why_nothing = why_nothing(by_choice);
    let nothing = summary.bends.is_nothing();
    match (&summary.tcp, nothing) {
        (None, true) => format!("nothing is flexible: {why_nothing}"),
        (None, false) => format!("{}; not compared with the rigid robot", what_bends(&summary.bends)),
        (Some(tcp), true) if tcp.peak_m < NOTHING_M => {
            format!("nothing is flexible, so the TCP is where the rigid model has it: {why_nothing}")
        }
        (Some(tcp), _) => {
            let nothing = if nothing { format!("; nothing is flexible: {why_nothing}") } else { String::new() };
            let path = summary.path.as_ref().map_or_else(String::new, across);
            format!("{path}{}; {}{nothing}", parts(tcp), shares(tcp))
        }
    }
}

/// Explains why nothing is elastic, and how to change it.
fn why_nothing(by_choice: bool) -> &'static str {
    match by_choice {
        true => "links and drives are rigid as chosen for this run",
        false => {
            "the robot has no flexible link and no elastic gearbox. Give it a robot file with urdf = \"...\" and a \
             [[flexible_link]] (reduced = \"...\" or beam = { ... }), or a [[drive]] with gearbox = { stiffness = ... }"
        }
    }
}

/// Lists the elastic parts.
fn what_bends(bends: &Bending) -> String {
    let list = |one: &str, several: &str, names: &[String]| match names {
        [] => None,
        [name] => Some(format!("{one} {name}")),
        _ => Some(format!("{several} {}", names.join(", "))),
    };
    let kinds = [
        list("link", "links", &bends.links),
        list("the gearbox of", "the gearboxes of", &bends.gearboxes),
        list("mounting", "", bends.mounting.as_slice()),
    ];
    let kinds: Vec<String> = kinds.into_iter().flatten().collect();
    format!("flexible: {}", kinds.join("; "))
}

/// Returns the number of decimals that shows a length (mm) to three significant figures.
pub(crate) fn digits(size_mm: f64) -> usize {
    if size_mm > 0.0 { (2.0 - size_mm.log10().floor()).clamp(1.0, 9.0) as usize } else { 2 }
}

/// Rounds the parts of a whole to `digits` decimals such that they add up to the rounded whole.
///
/// Each part is rounded down or up, those with the largest remainders up. Parts that do not add up
/// to the whole, to within rounding, are rounded individually.
pub fn rounded(parts: &[f64], whole: f64, digits: usize) -> Vec<String> {
    let unit = 10f64.powi(-(digits as i32));
    let mut units: Vec<f64> = parts.iter().map(|part| (part / unit).floor()).collect();
    let missing = (whole / unit).round() - units.iter().sum::<f64>();
    if (0.0..=parts.len() as f64).contains(&missing) {
        let mut order: Vec<usize> = (0..parts.len()).collect();
        order.sort_by(|&a, &b| (parts[b] / unit - units[b]).total_cmp(&(parts[a] / unit - units[a])));
        order.into_iter().take(missing as usize).for_each(|k| units[k] += 1.0);
    } else {
        units = parts.iter().map(|part| (part / unit).round()).collect();
    }
    // Avoids -0.
    units.iter().map(|units| format!("{:.digits$}", units * unit + 0.0)).collect()
}

/// Describes the peak with its static and dynamic part.
fn parts(tcp: &TcpFigures) -> String {
    let digits = digits(1e3 * tcp.peak_m);
    let mm = |x: f64| format!("{:.digits$}", 1e3 * x);
    let peak = format!("{} mm", mm(tcp.peak_m));
    match (tcp.static_at_peak_m, tcp.dynamic_at_peak_m, tcp.dynamic_peak_m) {
        (Some(at_rest), Some(moving), Some(most)) => {
            let parts = rounded(&[1e3 * at_rest, 1e3 * moving], 1e3 * tcp.peak_m, digits);
            let (sign, moving) = parts[1].strip_prefix('-').map_or(('+', parts[1].as_str()), |size| ('-', size));
            format!("TCP error {peak} = {} static {sign} {moving} dynamic (maximum {})", parts[0], mm(most))
        }
        _ => format!("TCP error {peak} (static part unknown: the arm has no equilibrium at some pose of the motion)"),
    }
}

/// Describes the error across a TCP path, which comes first in the headline.
fn across(path: &PathFigures) -> String {
    let digits = digits(1e3 * path.across_peak_m);
    let mm = |x: f64| format!("{:.digits$}", 1e3 * x);
    let (peak, left) = (mm(path.across_peak_m), mm(path.left_m));
    format!("{peak} mm across the path, {left} with the workpiece shifted to fit; ")
}

/// Kinds of contributions with their names, in the order of the headline.
const GROUPS: [(&str, &str); 5] = [
    (LINK, "links"),
    (GEARBOX, "gearboxes"),
    (MOUNTING, "mounting"),
    (SERVO, "servo following error"),
    (STEPPER, "constraint drift of the step"),
];

/// Describes the contributions to the peak by kind, and the largest contributor.
fn shares(tcp: &TcpFigures) -> String {
    let digits = digits(1e3 * tcp.peak_m);
    let most = tcp.shares_at_peak.iter().max_by(|a, b| a.along_m.abs().total_cmp(&b.along_m.abs()));
    let of_kind = |kind: &str| tcp.shares_at_peak.iter().filter(move |share| share.kind == kind).collect::<Vec<_>>();
    let groups = GROUPS.map(|(kind, word)| (kind, word, of_kind(kind)));
    let groups: Vec<_> = groups.into_iter().filter(|(.., shares)| !shares.is_empty()).collect();
    // Rounded sums add up to the rounded peak; a drift that rounds to zero is left out.
    let sums: Vec<f64> =
        groups.iter().map(|(.., shares)| 1e3 * shares.iter().map(|share| share.along_m).sum::<f64>()).collect();
    let parts = groups.iter().zip(rounded(&sums, 1e3 * tcp.peak_m, digits));
    let parts =
        parts.filter(|((kind, ..), sum)| *kind != STEPPER || sum.contains(|c: char| c.is_ascii_digit() && c != '0'));
    let parts = parts.map(|((kind, word, shares), sum)| {
        let most = most.filter(|most| most.kind == *kind && [LINK, GEARBOX].contains(kind));
        let most = most.map_or_else(String::new, |most| match shares.len() {
            1 => format!(" ({})", most.name),
            _ => format!(" (largest: {})", most.name),
        });
        format!("{word} {sum}{most}")
    });
    parts.collect::<Vec<_>>().join(", ")
}
