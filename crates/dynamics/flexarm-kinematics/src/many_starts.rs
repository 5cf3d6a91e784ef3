//! Numerical inverse kinematics from many starts, for arms without a closed form.
//!
//! The starts are the one of the caller and points spread evenly over the joint ranges (an additive
//! recurrence with the generalised golden ratio [Roberts 2018]), so the search is deterministic.
//! All results are solutions, but **finding all solutions is not guaranteed**. The number of hits
//! of each ([`FoundSolution::hits`]) is an indication: if each has several hits, a missed one has a
//! small region of attraction. Arms with more than six joints have families of solutions, of which
//! the results are samples.

use std::f64::consts::{PI, TAU};

use flexarm_spatial::Pose;
use nalgebra::DVector;

use crate::data::Data;
use crate::inverse_kinematics::{IkError, IkOptions, inverse_kinematics};
use crate::model::{Frame, JointMotion, Model};

/// Joint values that meet the pose, and the number of starts that reached them.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSolution {
    /// All coordinates, nv long; rotating joints without limits are within (-π, π].
    pub q: DVector<f64>,
    /// Number of starts that converged to this solution.
    pub hits: usize,
}

/// Finds all distinct joint values within the limits that are reached from `starts` starts, the
/// first of which is `q_start`.
///
/// Solutions that differ by whole turns of joints count as one. Coordinates that do not move the
/// frame stay as in `q_start` (nv long, rad or m); joints without limits start within half a turn
/// or 1 m of it.
///
/// # Errors
/// [`IkError`] of the start with the smallest residual, if none reaches the pose.
///
/// # Panics
/// If `q_start` is not nv long.
pub fn inverse_kinematics_from_many_starts(
    model: &Model,
    data: &mut Data,
    frame: &Frame,
    X_WT: &Pose,
    q_start: &DVector<f64>,
    options: &IkOptions,
    starts: usize,
) -> Result<Vec<FoundSolution>, IkError> {
    model.check_size("q_start", q_start.len());
    // Starts: the caller's, then `low + (high - low) frac(1/2 + k a_i)` in coordinate i.
    let chain = coordinates_of(model, frame);
    let steps = steps_of_recurrence(chain.len());
    let mut found: Vec<FoundSolution> = Vec::new();
    let mut nearest: Option<IkError> = None;
    for number in 0..starts.max(1) {
        let mut q = q_start.clone();
        if number > 0 {
            for (&(k, turns), step) in chain.iter().zip(&steps) {
                let (low, high) = range(model, k, turns, q_start[k]);
                q[k] = low + (high - low) * (0.5 + number as f64 * step).fract();
            }
        }
        // Keep each new solution, and the nearest failure for the message.
        match inverse_kinematics(model, data, frame, X_WT, &q, options) {
            Ok(q) => add(&mut found, q, model, &chain),
            Err(error) => {
                let size = |e: &IkError| e.position_m + options.characteristic_length_m * e.rotation_rad;
                if nearest.as_ref().is_none_or(|n| size(&error) < size(n)) {
                    nearest = Some(error);
                }
            }
        }
    }
    match nearest {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

/// Actuated coordinates that move the frame, from the base outward, and whether whole turns leave
/// the pose unchanged.
pub(crate) fn coordinates_of(model: &Model, frame: &Frame) -> Vec<(usize, bool)> {
    let mut chain: Vec<(usize, bool)> = Vec::new();
    let mut body = frame.body;
    while body > 0 {
        let b = &model.bodies[body];
        if b.coordinate != usize::MAX && b.coordinate >= model.nv() {
            // Moved by other coordinates through a closed loop; whole turns of these are not
            // identified.
            for k in model.leaders(b.coordinate).into_iter().rev() {
                if !chain.iter().any(|(known, _)| *known == k) {
                    chain.push((k, false));
                }
            }
            body = b.parent;
            continue;
        }
        if let JointMotion::Axis(motion) = b.motion
            && !b.elastic
            && !chain.iter().any(|(k, _)| *k == b.coordinate)
        {
            // A whole turn of a helical joint, or of the leader of mimic joints, changes the pose.
            let alone = model.bodies.iter().filter(|o| o.coordinate == b.coordinate && !o.elastic).count() == 1;
            chain.push((b.coordinate, matches!(motion, crate::AxisMotion::Revolute(_)) && alone));
        }
        body = b.parent;
    }
    chain.reverse();
    chain
}

/// Range of the starts of a coordinate.
fn range(model: &Model, k: usize, turns: bool, around: f64) -> (f64, f64) {
    let limits = model.coordinates()[k].limits;
    let half = if turns { PI } else { 1.0 };
    let low = if limits.lower.is_finite() { limits.lower } else { limits.upper.min(around + half) - 2.0 * half };
    let high = if limits.upper.is_finite() { limits.upper } else { low + 2.0 * half };
    (low, high)
}

/// Powers of the reciprocal of the root of `x^(n+1) = x + 1`.
fn steps_of_recurrence(n: usize) -> Vec<f64> {
    let mut x = 2.0_f64;
    for _ in 0..60 {
        x = (1.0 + x).powf(1.0 / (n as f64 + 1.0));
    }
    (1..=n).map(|k| x.powi(-(k as i32))).collect()
}

/// Counts a hit of a known solution, or appends a new one with its free turns in (-π, π].
fn add(found: &mut Vec<FoundSolution>, mut q: DVector<f64>, model: &Model, chain: &[(usize, bool)]) {
    const SAME: f64 = 1e-5;
    let apart = |a: f64, b: f64, turns: bool| {
        let d = a - b;
        if turns { d - TAU * (d / TAU).round() } else { d }
    };
    let same = |s: &FoundSolution| chain.iter().all(|&(k, turns)| apart(s.q[k], q[k], turns).abs() < SAME);
    if let Some(twin) = found.iter_mut().find(|s| same(s)) {
        twin.hits += 1;
        return;
    }
    for &(k, turns) in chain {
        let limits = model.coordinates()[k].limits;
        if turns && limits.lower == f64::NEG_INFINITY && limits.upper == f64::INFINITY {
            q[k] -= TAU * ((q[k] - PI) / TAU).ceil();
        }
    }
    found.push(FoundSolution { q, hits: 1 });
}
