//! Caveats about closed loops: transmission angles over the joint ranges and along a motion.
//!
//! Not here: loops that do not close or pass a dead point, which are errors ([`crate::robot::loops`]).

use flexarm_kinematics::Model;
use flexarm_trajectory::Trajectory;

use super::{Finding, FindingKind, kinds};
use crate::robot::loops::{along_motion, over_ranges};

/// Transmission angle: note below the first, warning below the second (rad). At 10 degrees a rod
/// carries six times the force.
const TRANSMISSION: [f64; 2] = [0.698_131_700_797_731_8, 0.174_532_925_199_432_95];
/// Maximum distance of the dependent joints from the given assembly values (rad or m).
const ASSEMBLED: f64 = 1e-6;
/// Maximum fraction of poses in the joint ranges in which a loop does not close.
const OPEN: f64 = 0.02;

fn name_of(name: &str) -> String {
    format!("loop {name:?}")
}

/// Checks all loops of the rigid robot over poses spread over the joint ranges.
pub(crate) fn of_loops(rigid: &Model) -> Vec<Finding> {
    if rigid.loops().is_empty() {
        return Vec::new();
    }
    let behaviour = over_ranges(rigid);
    let mut caveats = Vec::new();
    for (k, own) in rigid.loops().iter().enumerate() {
        let name = name_of(&own.name);
        let miss = own.start_miss[0].abs().max(own.start_miss[1].abs());
        if miss > ASSEMBLED {
            caveats.push(kinds::LOOP_ASSEMBLED.found(&name, miss, ASSEMBLED));
        }
        if behaviour.open[k] > OPEN {
            caveats.push(kinds::LOOP_RANGE.found(&name, 100.0 * behaviour.open[k], 100.0 * OPEN).as_note());
        }
        if behaviour.smallest[k] < TRANSMISSION[0] {
            let degrees = behaviour.smallest[k].to_degrees();
            caveats.push(kinds::LOOP_REACH.found(&name, degrees, TRANSMISSION[0].to_degrees()).as_note());
        }
    }
    caveats
}

/// Checks the loops along a motion on which they close.
pub(crate) fn of_motion(trajectory: &Trajectory, rigid: &Model) -> Vec<Finding> {
    if rigid.loops().is_empty() {
        return Vec::new();
    }
    let Ok(behaviour) = along_motion(rigid, trajectory) else { return Vec::new() };
    let mut caveats = Vec::new();
    for (own, (angle, t)) in rigid.loops().iter().zip(&behaviour.smallest) {
        if *angle < TRANSMISSION[0] {
            let place = format!("{} (at t = {t:.3} s)", name_of(&own.name));
            let caveat = kinds::LOOP_TRANSMISSION.found(place, angle.to_degrees(), TRANSMISSION[0].to_degrees());
            caveats.push(if *angle < TRANSMISSION[1] { caveat } else { caveat.as_note() });
        }
    }
    for (c, [low, high]) in rigid.dependent().iter().zip(&behaviour.range) {
        let passed =
            |kind: &FindingKind, value: f64, limit: f64| kind.found(format!("joint {:?}", c.joint), value, limit);
        if *high > c.limits.upper {
            caveats.push(passed(&kinds::LOOP_LIMIT, *high, c.limits.upper));
        }
        if *low < c.limits.lower {
            caveats.push(passed(&kinds::LOOP_LIMIT, *low, c.limits.lower));
        }
    }
    caveats
}
