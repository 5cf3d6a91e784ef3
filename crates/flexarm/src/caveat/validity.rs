//! Whether the models hold: deflections, strains, forces of drives, sampling. For runs, statics and `check` alike.

use flexarm_kinematics::Coordinate;

use super::slip::slip;
use super::{Caveat, CaveatKind, kinds};

/// Largest elastic rotation for which the linear elastic model is taken to hold (rad).
const ROTATION_LIMIT: f64 = 0.05;
/// Largest engineering strain of a flexible link.
const STRAIN_LIMIT: f64 = 1e-3;
/// Largest gap in the energy balance.
const IMBALANCE_LIMIT: f64 = 0.02;
/// Fewest samples in a period of the first mode.
const SAMPLES_PER_PERIOD: f64 = 10.0;
/// Fewest steps in a period of the first mode.
const STEPS_PER_PERIOD: f64 = 20.0;
/// Steps in a period of the first mode below which it is not seen at all: a slip is likely.
const SKIPPED: f64 = 2.0;
/// Fewest steps in the longest move.
const STEPS_PER_MOVE: f64 = 50.0;

/// A flexible link whose far end turned by so much (rad), with so much engineering strain.
pub(crate) fn link(name: &str, rotation: f64, strain: f64) -> impl Iterator<Item = Caveat> {
    let link = format!("link {name:?}");
    let bent = (rotation > ROTATION_LIMIT).then(|| kinds::LARGE_DEFORMATION.found(&link, rotation, ROTATION_LIMIT));
    let strained = (strain > STRAIN_LIMIT).then(|| kinds::LARGE_STRAIN.found(&link, strain, STRAIN_LIMIT));
    bent.into_iter().chain(strained)
}

/// Drives that need more than they have, in coordinate order: [`kinds::EFFORT`] or [`kinds::HOLDING`].
pub(crate) fn efforts<'a>(
    kind: &'a CaveatKind,
    coordinates: &'a [Coordinate],
    needed: &'a [f64],
) -> impl Iterator<Item = Caveat> + 'a {
    let over = |(c, torque): &(&Coordinate, &f64)| torque.abs() > c.limits.effort;
    let told =
        |(c, torque): (&Coordinate, &f64)| kind.found(format!("joint {:?}", c.joint), torque.abs(), c.limits.effort);
    coordinates.iter().zip(needed).filter(over).map(told)
}

/// Joints outside their range at a pose.
pub(crate) fn outside_limits<'a>(coordinates: &'a [Coordinate], q: &'a [f64]) -> impl Iterator<Item = Caveat> + 'a {
    let outside = |(c, q): &(&Coordinate, &f64)| **q < c.limits.lower || **q > c.limits.upper;
    coordinates.iter().zip(q).filter(outside).map(|(c, q)| {
        let (lower, upper) = (c.limits.lower, c.limits.upper);
        let limit = if *q < lower { lower } else { upper };
        let mut caveat = kinds::OUTSIDE_LIMITS.found(format!("joint {:?}", c.joint), *q, limit);
        caveat.message += &format!(" {lower} to {upper}");
        caveat
    })
}

/// Steps and samples against the first mode (Hz).
pub(crate) fn sampling(first_hz: f64, step_s: f64, logged_hz: f64) -> impl Iterator<Item = Caveat> {
    let few = logged_hz < SAMPLES_PER_PERIOD * first_hz;
    let steps = 1.0 / (step_s * first_hz);
    let coarse = steps < STEPS_PER_PERIOD;
    let few = few.then(|| kinds::FEW_SAMPLES.found("run", logged_hz, first_hz));
    let likely =
        if steps < SKIPPED { milliseconds(step_s, 1.0 / (STEPS_PER_PERIOD * first_hz)) } else { String::new() };
    few.into_iter().chain(coarse.then(|| kinds::COARSE_STEP.found("run", steps, STEPS_PER_PERIOD).likely(likely)))
}

/// A step that cuts even the longest move of a motion into few parts.
pub(crate) fn step(step_s: f64, moves_s: impl Iterator<Item = f64>) -> Option<Caveat> {
    let most = moves_s.fold(0.0, f64::max) / STEPS_PER_MOVE;
    (most > 0.0 && step_s > most * (1.0 + 1e-9))
        .then(|| kinds::LONG_STEP.found("run", step_s, most).likely(milliseconds(step_s, most)))
}

/// Whether a step in s was meant in ms.
fn milliseconds(step_s: f64, most: f64) -> String {
    slip(step_s, &(1e-6..=most), &[(1e3, "milliseconds")], 1.0)
}

/// Gap of the energy balance, as a part of the energy in it.
pub(crate) fn energy(imbalance: f64) -> Option<Caveat> {
    let open = imbalance > IMBALANCE_LIMIT;
    open.then(|| kinds::ENERGY_OPEN.found("run", 100.0 * imbalance, 100.0 * IMBALANCE_LIMIT))
}
