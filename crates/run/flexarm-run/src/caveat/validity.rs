//! Validity of the models: deflections, strains, drive torques, sampling. Used by runs, statics and
//! `check`.
//!
//! Each function judges one number and returns its caveat. Not here: the numbers (`run/monitor`),
//! probable errors in the input (the other files of this folder).

use std::f64::consts::TAU;

use flexarm_kinematics::Coordinate;
use flexarm_stepping::{StepperKind, error_of_a_period};

use super::slip::{self, slip};
use super::{Finding, FindingKind, kinds};
use crate::run::summary::LinkStressFigures;

/// Maximum elastic rotation for which the linear elastic model is assumed valid (rad).
const ROTATION_LIMIT: f64 = 0.05;
/// Maximum engineering strain of a flexible link.
const STRAIN_LIMIT: f64 = 1e-3;
/// Maximum relative change of stiffness by centrifugal forces that a model may leave out.
const STIFFENING: f64 = 0.05;
/// Maximum relative gap in the energy balance.
const IMBALANCE_LIMIT: f64 = 0.02;
/// Minimum number of samples per period of the first mode.
const SAMPLES_PER_PERIOD: f64 = 10.0;
/// Maximum error of the first mode within a period, relative to its amplitude.
const PERIOD_ERROR: f64 = 0.05;
/// Maximum share of joint drift in the TCP error.
const DRIFT: f64 = 0.01;
/// Range of the settling band (m): what instruments see, and what robots are specified for.
const NARROW_BAND: f64 = 1e-7;
const WIDE_BAND: f64 = 0.01;
/// Minimum number of steps in the longest move.
const STEPS_PER_MOVE: f64 = 50.0;

/// Checks the rotation of a flexible link's far end (rad) and its engineering strain.
pub(crate) fn link(name: &str, rotation: f64, strain: f64) -> impl Iterator<Item = Finding> {
    let link = format!("link {name:?}");
    let bent = (rotation > ROTATION_LIMIT).then(|| kinds::LARGE_DEFORMATION.found(&link, rotation, ROTATION_LIMIT));
    let strained = (strain > STRAIN_LIMIT).then(|| kinds::LARGE_STRAIN.found(&link, strain, STRAIN_LIMIT));
    bent.into_iter().chain(strained)
}

/// Checks the angular speed (rad/s) of a modal link without geometric stiffening against the first
/// natural frequency of the arm (Hz).
///
/// ```text
/// ω² = ω_1² + φ Ω²
/// ```
/// φ is 1.2 for a slender cantilever with a mass at its end: its tension m l Ω² adds 6/5 of itself
/// over the length to the stiffness across.
pub(crate) fn spin(name: &str, speed: f64, first_hz: f64) -> Option<Finding> {
    let change = 1.2 * (speed / (TAU * first_hz)).powi(2);
    let found = || kinds::FAST_SPIN.found(format!("link {name:?}"), 100.0 * change, 100.0 * STIFFENING);
    (change > STIFFENING).then(found)
}

/// Checks for stress beyond the strength of the material: [`kinds::STRESS`].
pub(crate) fn stress(links: &[LinkStressFigures]) -> impl Iterator<Item = Finding> {
    links.iter().filter_map(|link| {
        let place = link.worst.first()?;
        let strength = place.von_mises_pa / place.of_yield.filter(|share| *share > 1.0)?;
        let at = format!("link {:?}, node {}", link.name, place.node);
        Some(kinds::STRESS.found(at, 1e-6 * place.von_mises_pa, 1e-6 * strength))
    })
}

/// Checks for drives that exceed their effort limits, in coordinate order: [`kinds::EFFORT`] or
/// [`kinds::HOLDING`].
pub(crate) fn efforts<'a>(
    kind: &'a FindingKind,
    coordinates: &'a [Coordinate],
    needed: &'a [f64],
) -> impl Iterator<Item = Finding> + 'a {
    let over = |(c, torque): &(&Coordinate, &f64)| torque.abs() > c.limits.effort;
    let caveat = |(c, torque): (&Coordinate, &f64)| {
        kind.with_unit(c.effort_unit()).found(format!("joint {:?}", c.joint), torque.abs(), c.limits.effort)
    };
    coordinates.iter().zip(needed).filter(over).map(caveat)
}

/// Excess of a joint value over its limit beyond which it may be in degrees: multiple of the limit,
/// and minimum (rad).
const LIKE_DEGREES: (f64, f64) = (1.25, std::f64::consts::PI);
/// Value of a joint without limits beyond which it may be in degrees (rad): two turns.
const MANY_TURNS: f64 = 4.0 * std::f64::consts::PI;

/// Whether the value of a revolute joint was probably meant in degrees: as degrees it is within the
/// range, as radians far outside.
fn like_degrees(c: &Coordinate, q: f64) -> bool {
    let (lower, upper) = (c.limits.lower, c.limits.upper);
    let limit = if q < 0.0 { lower } else { upper };
    let far = if limit.is_finite() { (LIKE_DEGREES.0 * limit.abs()).max(LIKE_DEGREES.1) } else { MANY_TURNS };
    !c.slides() && q.abs() > far && (lower..=upper).contains(&q.to_radians())
}

/// Checks for joints outside their range at a pose, and for joints without a range at many turns.
///
/// * `q`: values of the coordinates, in their order (rad or m).
pub fn outside_limits<'a>(coordinates: &'a [Coordinate], q: &'a [f64]) -> impl Iterator<Item = Finding> + 'a {
    coordinates.iter().zip(q).filter_map(|(c, q)| {
        let (lower, upper) = (c.limits.lower, c.limits.upper);
        let joint = format!("joint {:?}", c.joint);
        let degrees =
            if like_degrees(c, *q) { format!("degrees? {q}deg is {:.4} rad", q.to_radians()) } else { String::new() };
        if *q < lower || *q > upper {
            let caveat = kinds::OUTSIDE_LIMITS.with_unit(c.unit());
            let mut caveat = caveat.found(joint, *q, if *q < lower { lower } else { upper });
            caveat.message += &format!(" {lower} to {upper}");
            Some(caveat.likely(degrees))
        } else if !degrees.is_empty() {
            Some(kinds::MANY_TURNS.found(joint, *q, MANY_TURNS).likely(degrees))
        } else {
            None
        }
    })
}

/// Checks the sample rate against the first mode (Hz).
pub(crate) fn sampling(first_hz: f64, logged_hz: f64) -> Option<Finding> {
    (logged_hz < SAMPLES_PER_PERIOD * first_hz).then(|| kinds::FEW_SAMPLES.found("run", logged_hz, first_hz))
}

/// Checks the step size (s) against the first mode (Hz, damping ratio), by the stepper's error on
/// such an oscillation.
pub(crate) fn step(kind: StepperKind, step_s: f64, first_hz: f64, ratio: f64) -> Option<Finding> {
    // A nearly overdamped mode has no period.
    let error = if ratio < 0.9 { error_of_a_period(kind, step_s * TAU * first_hz, ratio) } else { 0.0 };
    (error > PERIOD_ERROR).then(|| kinds::COARSE_STEP.found("run", 100.0 * error, 100.0 * PERIOD_ERROR))
}

/// Checks the joint drift of a stepper in maximal coordinates, as a fraction of the maximum TCP
/// error.
pub(crate) fn drift(stepper: &str, part: f64) -> Option<Finding> {
    (part > DRIFT).then(|| kinds::JOINT_DRIFT.found(format!("the steps of {stepper}"), 100.0 * part, 100.0 * DRIFT))
}

/// Checks a settling band (m) against usual robot specifications and against the maximum TCP error
/// (m). For the default band it gives only a note.
pub(crate) fn band(band_m: f64, peak_m: f64, usual_m: f64) -> Option<Finding> {
    let likely = || slip(band_m, &(1e-6..=WIDE_BAND), slip::LENGTH, 1.0);
    if band_m < NARROW_BAND {
        return Some(kinds::UNUSUAL.with_unit("m").found("the settling band", band_m, NARROW_BAND));
    }
    if band_m > WIDE_BAND {
        return Some(kinds::WIDE_BAND.found("run", band_m, WIDE_BAND).likely(likely()));
    }
    let beyond = kinds::BAND_BEYOND_ERROR.found("run", band_m, peak_m);
    (peak_m > 0.0 && band_m > peak_m).then(|| if band_m == usual_m { beyond.as_note() } else { beyond })
}

/// Checks for a step size that divides even the longest move into few steps.
pub(crate) fn long_step(step_s: f64, moves_s: impl Iterator<Item = f64>) -> Option<Finding> {
    let most = moves_s.fold(0.0, f64::max) / STEPS_PER_MOVE;
    let likely = || slip(step_s, &(1e-6..=most), &[(1e3, "milliseconds")], 1.0);
    (most > 0.0 && step_s > most * (1.0 + 1e-9)).then(|| kinds::LONG_STEP.found("run", step_s, most).likely(likely()))
}

/// Checks the gap of the energy balance, relative to the energy in it.
pub(crate) fn energy(imbalance: f64) -> Option<Finding> {
    let open = imbalance > IMBALANCE_LIMIT;
    open.then(|| kinds::ENERGY_OPEN.found("run", 100.0 * imbalance, 100.0 * IMBALANCE_LIMIT))
}
