//! Findings about motions: errors that readers of files share, and warnings about curves.
//!
//! An error is made without a place; the reader that knows the file adds it ([`at`]). The message
//! of a finding is a sentence with what is found, what is expected, and the remedy.
//!
//! Not here: warnings about gaps (`gap`), noise (`spline`) and limits (`plan`, `leg`), which are
//! made where they are found; errors of plans and samples (`error`).

use std::fmt::Display;

use flexarm_settings::finding::FindingKind;
use flexarm_settings::{Finding, Place, Setting};

use crate::curve::{Curve, QUIET_SPEED};
use crate::error::list;

/// Acceleration jumps below this fraction of the peak acceleration are rounding errors.
const QUIET_JUMP: f64 = 1e-6;

/// Unit of a velocity of a joint of either kind.
pub(crate) const RATE: &str = "rad/s or m/s";

/// Code of the warning about a given duration that takes a joint over an acceleration or jerk
/// limit.
pub(crate) const SHORT_DURATION: &str = "short-duration";

const START_SPEED: FindingKind = FindingKind::warning(
    "motion-start-speed",
    "joint \"{where}\" starts with a velocity of {value} {unit} instead of {yardstick}, a jump that excites every mode: \
     put a row with the same positions before the first one, or give its velocity as 0",
    RATE,
    "",
);
const END_SPEED: FindingKind = FindingKind::warning(
    "motion-end-speed",
    "joint \"{where}\" ends with a velocity of {value} {unit} instead of {yardstick} and is stopped at once: put a row \
     with the same positions after the last one, or give its velocity as 0",
    RATE,
    "",
);

/// An error without a place.
pub(crate) fn fault(code: &str, message: impl Into<String>) -> Box<Finding> {
    Box::new(Finding::error(code, "", message, ""))
}

/// Adds the place to an error.
pub(crate) fn at(place: &Place, mut fault: Box<Finding>) -> Box<Finding> {
    fault.location = place.to_string();
    fault
}

/// The text of a file in another encoding.
pub(crate) fn not_utf8() -> Box<Finding> {
    fault("not-utf8", "the file is not UTF-8 text; save it as UTF-8")
}

/// A version of the format that is not read.
pub(crate) fn unknown_format(found: i64) -> Box<Finding> {
    fault("format", format!("format {found} is not known; this program reads `format = 1`"))
}

pub(crate) fn unknown_unit(key: &str, found: &str, accepted: &str) -> Box<Finding> {
    fault("unknown-unit", format!("unit {found:?} of `{key}` is not known; accepted: {accepted}"))
}

/// Two statements of different units of angles.
pub(crate) fn contradicting_units(first: &str, second: &str) -> Box<Finding> {
    let message = format!("`unit` is stated twice, as {first:?} and as {second:?}; keep one line");
    fault("contradicting-units", message)
}

/// A name that is not a joint of the file.
pub(crate) fn unknown_joint(key: &str, name: &str, joints: &[String]) -> Box<Finding> {
    fault("unknown-joint", format!("{name:?} in `{key}` is not a joint of this file; it has {}", list(joints)))
}

pub(crate) fn repeated_column(name: &str, first: usize) -> Box<Finding> {
    let message = format!("the column is called {name:?}, as column {first} is; remove or rename one of them");
    fault("repeated-column", message)
}

pub(crate) fn bad_value(key: &str, found: impl Display, expected: &str) -> Box<Finding> {
    fault("value", format!("`{key}` is {found}; expected {expected}"))
}

/// Returns the first eight names as `"a", "b"`, and the number of all if there are more.
pub(crate) fn first_names(names: &[String]) -> String {
    const MAX: usize = 8;
    match names.len() {
        0..=MAX => list(names),
        count => format!("{}, ... ({count} in all)", list(&names[..MAX])),
    }
}

/// Returns the warnings about the curve of one joint: velocities at its ends, and jumps of velocity
/// and acceleration.
pub(crate) fn of_curve(joint: &str, curve: &Curve) -> Vec<Finding> {
    let ends = [(START_SPEED, curve.start()[1]), (END_SPEED, curve.end()[1])];
    let moving = ends.iter().filter(|(_, speed)| speed.abs() > QUIET_SPEED);
    let mut warnings: Vec<Finding> = moving.map(|(kind, speed)| kind.found(joint, *speed, 0.0)).collect();

    // Corners: velocity jumps between the ends. The largest one is named.
    let [begin, end] = [curve.knots[0], curve.knots[curve.knots.len() - 1]];
    let inside = |t: f64| t > begin && t < end;
    let corners: Vec<_> = curve.jumps().filter(|jump| inside(jump.time_s) && jump.exceeds(1, QUIET_SPEED)).collect();
    if let Some(most) = corners.iter().max_by(|a, b| a.size[1].abs().total_cmp(&b.size[1].abs())) {
        let (count, times) = (corners.len(), if corners.len() == 1 { "time" } else { "times" });
        let message = format!(
            "the velocity of joint {joint:?} jumps at {count} {times}, most at t = {:.4} s by {:.3e} {RATE}: no drive \
             can do that, and the impulse acts on the whole arm; round the corners ({}), or give samples of a motion \
             without them",
            most.time_s,
            most.size[1],
            Setting::RoundCorners
        );
        let warning = Finding::warning("motion-corner", joint, message, "").measured(most.size[1], 0.0);
        warnings.push(Finding { unit: RATE.into(), ..warning }.mended_by(&[Setting::RoundCorners]));
    }

    // Acceleration jumps at velocity jumps are not reported separately.
    let level = QUIET_JUMP * curve.largest(2);
    let jumps: Vec<_> = curve.jumps().filter(|jump| !jump.exceeds(1, QUIET_SPEED) && jump.exceeds(2, level)).collect();
    if let Some(most) = jumps.iter().max_by(|a, b| a.size[2].abs().total_cmp(&b.size[2].abs())) {
        let unit = "rad/s² or m/s²";
        let message = format!(
            "the acceleration of joint {joint:?} jumps at {} times, most at t = {:.4} s by {:.3e} {unit}, which \
             excites every mode: use `rounding`, another profile, or data with continuous accelerations",
            jumps.len(),
            most.time_s,
            most.size[2]
        );
        let warning = Finding::warning("motion-acceleration-jump", joint, message, "").measured(most.size[2], 0.0);
        warnings.push(Finding { unit: unit.into(), ..warning });
    }
    warnings
}
