//! Caveats about loads as written: times relative to the run, angles in degrees.

use std::f64::consts::TAU;

use super::slip::slip;
use super::{Finding, kinds, parts};

/// Duration of a load relative to that of the run: note, warning.
const LONG: [f64; 2] = [2.0, 10.0];
/// Angular rates of sines in degrees are multiples of this (a quarter of a turn).
const QUARTER: f64 = 90.0;

/// Checks the last time of a table or an impulse (s) against the end of the run.
pub(crate) fn of_end(last: f64, duration: f64) -> Option<Finding> {
    let caveat = || kinds::LOAD_TIME.found("a load", last, duration);
    let likely = || slip(last, &(0.01 * duration..=1.5 * duration), &[(1e3, "milliseconds")], 1.0);
    match last / duration {
        ratio if ratio > LONG[1] => Some(caveat().likely(likely())),
        ratio if ratio > LONG[0] => Some(caveat().as_note()),
        _ => None,
    }
}

/// Checks the phase of a sine (rad).
pub(crate) fn of_phase(phase: f64) -> Option<Finding> {
    parts::angles("the phase of a load", &[phase])
}

/// Checks the argument of a sine or cosine that is linear in time: `rate` (rad/s) and its value at
/// zero (rad).
pub(crate) fn of_sine(text: &str, rate: f64, phase: f64) -> Option<Finding> {
    let quarters = rate.abs() / QUARTER;
    let whole = quarters > 0.5 && (quarters - quarters.round()).abs() < 1e-9;
    if whole {
        let caveat = kinds::LOAD_DEGREES.found(format!("the load {text:?}"), rate.abs() / TAU, rate.abs() / 360.0);
        return Some(caveat.likely("about 57 times: degrees?"));
    }
    of_phase(phase)
}
