//! Caveats about a motion on the robot that follows it, and about loads on the robot that carries
//! them.
//!
//! Start at `of_motion` and `of_loads`. The rigid robot is followed at 201 times. Not here: joint
//! limits that a motion passes, which are errors (`motions/motion.rs`).

use flexarm_kinematics::{Data, Model, State, inverse_dynamics};
use flexarm_stepping::Load;
use flexarm_trajectory::{LimitKind, LimitViolation, Trajectory};
use nalgebra::DVector;

use super::size::Size;
use super::slip::{self, DEGREES, slip};
use super::{Finding, kinds};

/// Number of time intervals at which a motion and its loads are checked.
const TIMES: usize = 200;
/// Ratio of rigid-robot torque to effort limit above which the motion does not suit this robot.
const HASTE: f64 = 10.0;
/// Fraction of the speed limit below which a motion may be given in other time units.
const SLOW: f64 = 2e-3;
/// Minimum plausible travel of a motion (rad).
const SMALL: f64 = 0.02;
/// Speed (rad/s or m/s) below which a joint rests.
const STILL: f64 = 1e-6;
/// Maximum rest (s), and maximum rest over the time in which the robot moves.
const REST: (f64, f64) = (100.0, 10.0);
/// Force relative to the arm's weight, or moment relative to its weight at full length: note,
/// warning.
const HEAVY: [f64; 2] = [2.0, 10.0];
/// Gravity on earth (m/s²).
const EARTH: f64 = 9.81;

/// Checks the torques and speeds of the rigid robot along a motion.
pub(crate) fn of_motion(name: &str, trajectory: &Trajectory, model: &Model) -> Vec<Finding> {
    // Maximum torque and speed, and range of each joint.
    let n = model.nv();
    let (mut data, mut state, mut a) = (Data::new(model), State::zeros(model), DVector::zeros(n));
    let (mut torque, mut speed) = (vec![0.0f64; n], vec![0.0f64; n]);
    let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; n];
    for i in 0..=TIMES {
        let t = trajectory.duration() * i as f64 / TIMES as f64;
        trajectory.sample(t, state.q.as_mut_slice(), state.qdot.as_mut_slice(), a.as_mut_slice());
        inverse_dynamics(model, &mut data, &state, &a);
        for k in 0..n {
            torque[k] = torque[k].max(data.tau[k].abs());
            speed[k] = speed[k].max(state.qdot[k].abs());
            range[k] = [range[k][0].min(state.q[k]), range[k][1].max(state.q[k])];
        }
    }
    // Torques above the effort limits.
    let mut caveats = super::loops::of_motion(trajectory, model);
    for (c, torque) in model.coordinates().iter().zip(&torque) {
        if *torque > c.limits.effort {
            let caveat = kinds::MOTION_EFFORT.with_unit(c.effort_unit());
            let caveat = caveat.found(format!("joint {:?}", c.joint), *torque, c.limits.effort);
            caveats.push(if *torque > HASTE * c.limits.effort { caveat } else { caveat.as_note() });
        }
    }
    // A motion that is slow, rests or hardly moves, as in other units of time or angle.
    let used = model.coordinates().iter().zip(&speed).filter(|(c, _)| c.limits.velocity.is_finite());
    let used = used.map(|(c, v)| v / c.limits.velocity).fold(0.0, f64::max);
    let turns = model.coordinates().iter().zip(&range).filter(|(c, _)| !c.slides());
    let travel = turns.map(|(_, [low, high])| high - low).fold(0.0, f64::max);
    let still = range.iter().all(|[low, high]| high == low);
    if !still && used > 0.0 && used < SLOW {
        let likely = slip(SLOW / used, &(0.002..=1.0), &[(1e3, "milliseconds")], 1.0);
        caveats.push(kinds::SLOW_MOTION.found(name, used, SLOW).likely(likely));
    }
    caveats.extend(rests(name, trajectory).filter(|_| !still));
    if travel > 0.0 && travel < SMALL {
        let caveat = kinds::SMALL_MOTION.found(name, travel, SMALL);
        let likely = slip(travel, &(SMALL..=7.0), &[(1.0 / DEGREES, "radians in a file in degrees")], 1.0);
        caveats.push(caveat.likely(likely));
    }
    caveats
}

/// Compares the time in which a long motion rests with that in which it moves.
fn rests(name: &str, trajectory: &Trajectory) -> Option<Finding> {
    const INSTANTS: usize = 20 * TIMES;
    let duration = trajectory.duration();
    if duration < REST.0 {
        return None;
    }
    let [mut q, mut v, mut a] = [(); 3].map(|()| vec![0.0; trajectory.joints().len()]);
    let moves = |k: &usize| {
        trajectory.sample(duration * *k as f64 / INSTANTS as f64, &mut q, &mut v, &mut a);
        v.iter().any(|speed| speed.abs() > STILL)
    };
    let moves_s = duration * (0..INSTANTS).filter(moves).count() as f64 / INSTANTS as f64;
    let rest_s = duration - moves_s;
    let likely = || slip(rest_s, &(0.0..=REST.0), &[(1e3, "milliseconds")], 1.0);
    let caveat = || kinds::LONG_REST.found(name, rest_s, moves_s).likely(likely());
    (rest_s > REST.0.max(REST.1 * moves_s)).then(caveat)
}

/// Checks whether positions beyond their limits would be within them if they were in degrees.
pub(crate) fn degrees(violations: &[LimitViolation], model: &Model) -> &'static str {
    let beyond = violations.iter().filter(|v| matches!(v.kind, LimitKind::Lower | LimitKind::Upper));
    let mends = |v: &LimitViolation| {
        let joint = model.coordinates().iter().find(|c| c.joint == v.joint);
        let value = v.value / DEGREES;
        v.value.abs() > std::f64::consts::TAU
            && joint.is_some_and(|c| !c.slides() && (c.limits.lower..=c.limits.upper).contains(&value))
    };
    let (mut any, mut all) = (false, true);
    beyond.for_each(|v| (any, all) = (true, all && mends(v)));
    if any && all { "about 57 times: degrees?" } else { "" }
}

/// Checks the maximum force and moment of a run's loads against weight and size of the arm with its
/// payload.
pub(crate) fn of_loads(loads: &[Load], duration: f64, size: &Size) -> Vec<Finding> {
    let mut caveats = Vec::new();
    for load in loads {
        let even = (0..=TIMES).map(|i| duration * i as f64 / TIMES as f64);
        let (mut force, mut moment) = (0.0f64, 0.0f64);
        for t in even.chain(load.wrench.jumps.iter().copied()) {
            let wrench = load.wrench.at(t);
            force = force.max(wrench.force.norm());
            moment = moment.max(wrench.torque.norm());
        }
        caveats.extend(heavy(force, moment, size));
    }
    caveats
}

/// Checks a constant wrench on the TCP against weight and size of the arm with its payload.
///
/// * `wrench`: force, then moment (N, N m), in any axes.
pub fn of_wrench(wrench: &[f64; 6], size: &Size) -> Vec<Finding> {
    let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    heavy(norm(&wrench[..3]), norm(&wrench[3..]), size)
}

/// Checks a force (N) and a moment (N m) against the weight of the arm.
fn heavy(force: f64, moment: f64, size: &Size) -> Vec<Finding> {
    let judged = |kind: &super::FindingKind, what: &str, value: f64, yardstick: f64| {
        let caveat = kind.found(what, value, yardstick);
        let likely = slip(value, &(0.0..=HEAVY[0] * yardstick), slip::EFFORT, 1.0);
        let caveat = if value > HEAVY[1] * yardstick { caveat.likely(likely) } else { caveat.as_note() };
        (yardstick > 0.0 && value > HEAVY[0] * yardstick).then_some(caveat)
    };
    let weight = EARTH * size.mass;
    let force = judged(&kinds::LOAD, "a force on the arm", force, weight);
    force.into_iter().chain(judged(&kinds::MOMENT, "a moment on the arm", moment, weight * size.extent)).collect()
}
