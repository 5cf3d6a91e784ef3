//! What happens at discrete times: payloads, samples of the controller, jumps of loads and of prescribed velocities.
//!
//! Between two events everything is smooth. A step ends at each of them, wherever it lies, and what is asked for at that
//! time belongs to the side from which it is asked ([`Breaks::side`]). Start at [`ReducedArm::at_time`].
//!
//! A joint whose prescribed velocity jumps by Δv_p strikes the arm: positions stay, the free velocities take the impulse,
//!
//! ```text
//! M_ff Δv_f = -M_fp Δv_p                                   springs, dampers, friction and weight are finite: no impulse
//! ```
//!
//! An integrator that asks for accelerations at few times of its steps takes the impulse of a prescribed joint for
//! `h Σ w_i a(t + c_i h)` ([`crate::Integrator::MOTION_RULE`]; at the ends alone `h (a_n + a_n+1) / 2`). Where that is not how the
//! velocity changes, because it rises within a few samples, the step is cut ([`ReducedArm::resolved`]).
//!
//! Not here: the integrators, which are told by [`Change`] what to renew.

use std::sync::Arc;

use flexarm_kinematics::mass_matrix;
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::iteration_matrix::storage_of;
use crate::load::Load;
use crate::reduced::ReducedArm;

/// Times closer than this are the same (s).
pub(crate) const SAME_TIME: f64 = 1e-9;

/// By which part of the speed a velocity may change otherwise than accelerations at the ends of a step say.
const IMPULSE_DEFECT: f64 = 1e-3;
/// Speeds below this are no measure (rad/s or m/s).
const SLOW: f64 = 0.01;
/// Most halvings of a step.
const MOST_CUTS: u32 = 7;

/// Velocities and accelerations of the actuated joints at the start of a step.
pub(crate) struct StepStart {
    /// When (s); NaN when it is not known.
    time: f64,
    qdot: Vec<f64>,
    qddot: Vec<f64>,
    /// Largest speeds so far.
    top: Vec<f64>,
    /// Mean accelerations over the step as an integrator takes them.
    mean: Vec<f64>,
}

impl StepStart {
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            time: f64::NAN,
            qdot: vec![0.0; joints],
            qddot: vec![0.0; joints],
            top: vec![SLOW; joints],
            mean: vec![0.0; joints],
        }
    }
}

/// What an event leaves behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Change {
    /// Nothing happened.
    Nothing,
    /// Accelerations, perhaps velocities, have jumped.
    Motion,
    /// So did masses or damping: matrices are out of date.
    Matrices,
}

/// Times at which loads or prescribed velocities jump, and which of them are over.
pub(crate) struct Breaks {
    times: Vec<f64>,
    passed: usize,
}

impl Breaks {
    pub(crate) fn of(arm: &FlexibleArm) -> Self {
        let loads = arm.loads.iter().flat_map(|load| load.jumps.iter().copied().filter(|t| jumps_at(load, *t)));
        let mut times: Vec<f64> = loads.chain(arm.motion.velocity_jumps()).collect();
        times.sort_by(f64::total_cmp);
        Self { times, passed: 0 }
    }

    /// The first that is not over.
    pub(crate) fn next(&self) -> Option<f64> {
        self.times.get(self.passed).copied()
    }

    /// The time nearest to t between the last event and the next one.
    pub(crate) fn side(&self, t: f64) -> f64 {
        let after = self.passed.checked_sub(1).map_or(t, |k| t.max(self.times[k].next_up()));
        self.next().map_or(after, |next| after.min(next.next_down()))
    }

    /// Leaves those at t behind; the times just before the first and just after the last of them.
    pub(crate) fn pass(&mut self, t: f64) -> Option<(f64, f64)> {
        let first = self.next().filter(|first| *first <= t + SAME_TIME)?;
        self.passed = self.times.partition_point(|time| *time <= t + SAME_TIME);
        Some((first.next_down(), self.times[self.passed - 1].next_up()))
    }
}

/// Does the load jump there, or only begin, end or bend?
fn jumps_at(load: &Load, t: f64) -> bool {
    let (before, after) = ((load.wrench)(t.next_down()).to_vector(), (load.wrench)(t.next_up()).to_vector());
    (after - before).amax() > 1e-9 * before.amax().max(after.amax())
}

/// Damping of an arm: matrix, factors, whether they say the same.
pub(crate) type ArmDamping = (DMatrix<f64>, Vec<f64>, bool);

/// What the arm damps with after each change of inertia: a ratio of modal damping is one of the modes that the arm then
/// has. An arm that cannot stand with its new payload keeps the damping it had.
pub(crate) fn damping_after_changes(arm: &FlexibleArm) -> Vec<ArmDamping> {
    let mut changed = arm.clone();
    let damping = |change: &crate::arm::InertiaChange| {
        changed.model = Arc::new(changed.model.with_inertia(change.body, change.inertia));
        let mut renewed = changed.clone();
        if renewed.update_modes_and_damping().is_ok() {
            changed = renewed;
        }
        (changed.D.clone(), changed.tau.clone(), changed.proportional)
    };
    arm.inertia_changes.iter().map(damping).collect()
}

impl ReducedArm {
    /// The next time after `t` at which something happens, if any.
    pub fn next_event(&self, t: f64) -> Option<f64> {
        let change = self.arm.inertia_changes.get(self.changes).map(|c| c.t);
        let sample = self.servo.as_ref().map(|s| s.next_sample(t));
        [change, sample, self.breaks.next()].into_iter().flatten().reduce(f64::min)
    }

    /// Carries out what happens at t; free velocities may jump.
    pub(crate) fn at_time(&mut self, t: f64, x: &DVector<f64>, v: &mut DVector<f64>) -> Result<Change, StepError> {
        let mut what = Change::Nothing;
        while let Some(change) = self.arm.inertia_changes.get(self.changes)
            && change.t <= t + SAME_TIME
        {
            self.arm.model = Arc::new(self.arm.model.with_inertia(change.body, change.inertia));
            if let Some((D, tau, proportional)) = self.dampings.get_mut(self.changes) {
                std::mem::swap(&mut self.arm.D, D);
                std::mem::swap(&mut self.arm.tau, tau);
                self.arm.proportional = *proportional;
            }
            self.changes += 1;
            what = Change::Matrices;
        }
        if let Some((before, after)) = self.breaks.pass(t) {
            (self.sampled_at, self.step_start.time) = (f64::NAN, f64::NAN);
            self.strike(t, before, after, x, v)?;
            what = what.max(Change::Motion);
        }
        if let Some(servo) = &mut self.servo
            && servo.sample(t, &self.arm, x.as_slice(), v.as_slice())
        {
            what = what.max(Change::Motion);
        }
        Ok(what)
    }

    /// Where a step from t to `stop` has to end so that the rule of the integrator meets the impulse of the prescribed joints:
    /// there, or before it; see the module page. No allocation.
    pub(crate) fn resolved(&mut self, t: f64, mut stop: f64, rule: &[(f64, f64)]) -> f64 {
        if rule.is_empty() {
            return stop;
        }
        if self.step_start.time != t {
            self.sample_joints(t);
            self.keep_start(t);
        }
        for _ in 0..MOST_CUTS {
            if self.meets_impulse(t, stop, rule) {
                break;
            }
            stop = t + 0.5 * (stop - t);
        }
        self.sample_joints(stop);
        self.keep_start(stop);
        stop
    }

    /// Whether accelerations by the rule say how the prescribed velocities change from t to `stop`.
    fn meets_impulse(&mut self, t: f64, stop: f64, rule: &[(f64, f64)]) -> bool {
        let (n, h) = (self.arm.model.n_actuated(), stop - t);
        // Σ w_i a(t + c_i h)
        self.step_start.mean.fill(0.0);
        for &(node, weight) in rule {
            if node > 0.0 {
                self.sample_joints(if node == 1.0 { stop } else { t + node * h });
            }
            let StepStart { qddot, mean, .. } = &mut self.step_start;
            let accelerations = if node > 0.0 { self.qddot.as_slice() } else { qddot };
            mean.iter_mut().zip(accelerations).for_each(|(mean, a)| *mean += weight * a);
        }
        self.sample_joints(stop);
        let start = &self.step_start;
        (0..n).filter(|k| !self.arm.torque_driven.contains(k)).all(|k| {
            let (before, after) = (start.qdot[k], self.state.qdot[k]);
            let defect = after - before - h * start.mean[k];
            defect.abs() <= IMPULSE_DEFECT * start.top[k].max(after.abs())
        })
    }

    /// Joint motion at t into the state, as [`ReducedArm::set`] keeps it.
    pub(crate) fn sample_joints(&mut self, t: f64) {
        let t = self.breaks.side(t);
        if t != self.sampled_at {
            self.arm.prescribed_state(t, &mut self.state, &mut self.qddot);
            self.sampled_at = t;
        }
    }

    fn keep_start(&mut self, t: f64) {
        let n = self.arm.model.n_actuated();
        let start = &mut self.step_start;
        start.time = t;
        start.qdot.copy_from_slice(&self.state.qdot.as_slice()[..n]);
        start.qddot.copy_from_slice(&self.qddot.as_slice()[..n]);
        start.top.iter_mut().zip(&start.qdot).for_each(|(top, speed)| *top = top.max(speed.abs()));
    }

    /// The impulse of prescribed velocities that jump between two times; see the module page.
    fn strike(
        &mut self,
        t: f64,
        before: f64,
        after: f64,
        x: &DVector<f64>,
        v: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        let n = self.arm.model.n_actuated();
        // Jump of each velocity; those of free coordinates are unknown.
        let jump = &mut self.tau;
        jump.fill(0.0);
        self.arm.prescribed_state(before, &mut self.state, &mut self.qddot);
        jump.rows_mut(0, n).copy_from(&self.state.qdot.rows(0, n));
        self.arm.prescribed_state(after, &mut self.state, &mut self.qddot);
        for k in 0..n {
            let driven = self.arm.torque_driven.contains(&k);
            jump[k] = if driven { 0.0 } else { self.state.qdot[k] - jump[k] };
        }
        if jump.iter().all(|jump| *jump == 0.0) {
            return Ok(());
        }
        self.set(t, x, v);
        let M = mass_matrix(&self.arm.model, &mut self.data, &self.state.q);
        let size = self.free.len();
        let mut M_ff = storage_of(&mut self.mass_factor, size);
        for (i, &k) in self.free.iter().enumerate() {
            self.shifted[i] = -(0..n).map(|p| M[(k, p)] * self.tau[p]).sum::<f64>();
            self.free.iter().enumerate().for_each(|(j, &l)| M_ff[(i, j)] = M[(k, l)]);
        }
        let factor = Cholesky::new(M_ff).ok_or(StepError::Singular { matrix: "mass matrix", t })?;
        factor.solve_mut(&mut self.shifted);
        self.mass_factor = Some(factor);
        for (i, &k) in self.free.iter().enumerate() {
            self.tau[k] = self.shifted[i];
        }
        // Work: impulse times mean velocity, 1/2 (v⁺ M v⁺ - v⁻ M v⁻) = Δvᵀ M (v⁺ - Δv/2) with the velocities now in `state`.
        let M = &self.data.M;
        let new = |k: usize| {
            let free = self.free.iter().position(|&l| l == k);
            free.map_or(self.state.qdot[k], |i| v[i] + self.shifted[i])
        };
        let row = |k: usize| (0..M.ncols()).map(|l| M[(k, l)] * self.tau[l]).sum::<f64>();
        self.struck += (0..M.nrows()).map(|k| (new(k) - 0.5 * self.tau[k]) * row(k)).sum::<f64>();
        *v += &self.shifted;
        Ok(())
    }
}
