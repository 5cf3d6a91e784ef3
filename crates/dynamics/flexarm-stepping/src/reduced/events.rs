//! Events of a run in reduced coordinates: jumps of velocities, and steps short enough for the
//! motion. Start at [`ReducedArm::at_time`].
//!
//! A velocity jump Δv_p of a prescribed joint is an impulse on the arm: positions stay, and the
//! free velocities jump by Δv_f,
//!
//! ```text
//! M_ff Δv_f = -M_fp Δv_p
//! ```
//! because springs, dampers, friction and weight are finite and contribute no impulse.
//!
//! An integrator that evaluates accelerations at a few times within a step uses
//! `h Σ w_i a(t + c_i h)` as the velocity change of a prescribed joint
//! ([`crate::Integrator::MOTION_RULE`]; with the end points only, `h (a_n + a_n+1) / 2`). Where the
//! velocity changes within a few samples this is inaccurate, and the step is shortened
//! ([`ReducedArm::resolved`]).
//!
//! Not here: the integrators; [`Change`] states what they have to update.

use std::sync::Arc;

use flexarm_kinematics::mass_matrix;
use nalgebra::{Cholesky, DVector};

use crate::dense::larger;
use crate::error::StepError;
use crate::events::Change;
use crate::iteration_matrix::storage_of;
use crate::reduced::ReducedArm;

/// Maximum difference between the velocity change of a prescribed joint and the quadrature of its
/// accelerations over a step, relative to its speed.
const IMPULSE_DEFECT: f64 = 1e-3;
/// Lower bound of the speed in this ratio (rad/s or m/s).
const SLOW: f64 = 0.01;
/// Maximum number of halvings of a step.
const MAX_CUTS: u32 = 7;

/// Velocities and accelerations of the actuated joints at the start of a step.
#[derive(Clone)]
pub(crate) struct StepStart {
    /// Time (s); NaN if unknown.
    time: f64,
    qdot: Vec<f64>,
    qddot: Vec<f64>,
    /// Maximum speeds so far.
    top: Vec<f64>,
    /// Mean accelerations over the step by the quadrature rule of an integrator.
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

impl ReducedArm {
    /// Returns the time of the next event after `t`, if any; exactly `end` if it is the same time.
    pub fn next_event(&self, t: f64, end: f64) -> Option<f64> {
        self.events.next(t, end)
    }

    /// Applies the events at `t`; free velocities may jump.
    pub(crate) fn at_time(&mut self, t: f64, x: &DVector<f64>, v: &mut DVector<f64>) -> Result<Change, StepError> {
        let mut what = Change::Nothing;
        // Exchanged payloads: inertia, and the damping that was computed for it.
        while let Some((number, change)) = self.events.due_change(t) {
            let plant = Arc::make_mut(&mut self.plant);
            plant.model = Arc::new(plant.model.with_inertia(change.body, change.inertia));
            if let Some((D, tau, proportional)) = self.dampings.get_mut(number) {
                std::mem::swap(&mut plant.D, D);
                std::mem::swap(&mut plant.tau, tau);
                plant.proportional = *proportional;
            }
            what = Change::Matrices;
        }
        // Jumps of the velocity, with impulses.
        if let Some((before, after)) = self.events.pass_jumps(t) {
            (self.sampled_at, self.step_start.time) = (f64::NAN, f64::NAN);
            self.apply_impulses(t, before, after, x, v)?;
            what = what.max(Change::Motion);
        }
        // Sampling instant of the controllers.
        if let Some(servo) = &mut self.servo
            && self.events.sample_due(t)
        {
            servo.sample(t, &self.plant, x.as_slice(), v.as_slice());
            what = what.max(Change::Motion);
        }
        Ok(what)
    }

    /// Returns the end of a step from `t` to at most `stop` over which the quadrature rule of the
    /// integrator reproduces the velocity change of the prescribed joints; see the module
    /// documentation. Does not allocate.
    pub(crate) fn resolved(&mut self, t: f64, mut stop: f64, rule: &[(f64, f64)]) -> f64 {
        if rule.is_empty() {
            return stop;
        }
        if self.step_start.time != t {
            self.sample_joints(t);
            self.keep_start(t);
        }
        for _ in 0..MAX_CUTS {
            if self.meets_impulse(t, stop, rule) {
                break;
            }
            stop = t + 0.5 * (stop - t);
        }
        self.sample_joints(stop);
        self.keep_start(stop);
        stop
    }

    /// Returns whether the quadrature rule reproduces the change of the prescribed velocities from
    /// `t` to `stop`.
    fn meets_impulse(&mut self, t: f64, stop: f64, rule: &[(f64, f64)]) -> bool {
        let h = stop - t;
        // Mean acceleration Σ w_i a(t + c_i h), with the term at the end added last.
        let start = &mut self.step_start;
        start.mean.fill(0.0);
        let mut at_end = 0.0;
        for &(node, weight) in rule {
            if node == 1.0 {
                at_end += weight;
                continue;
            }
            if node > 0.0 {
                self.sample_joints(t + node * h);
            }
            let StepStart { qddot, mean, .. } = &mut self.step_start;
            let accelerations = if node > 0.0 { self.qddot.as_slice() } else { qddot };
            mean.iter_mut().zip(accelerations).for_each(|(mean, a)| *mean += weight * a);
        }
        self.sample_joints(stop);
        let StepStart { qdot, mean, top, .. } = &self.step_start;
        let (after, acceleration) = (self.state.qdot.as_slice(), self.qddot.as_slice());
        let joints = qdot.iter().zip(after).zip(mean.iter().zip(acceleration)).zip(top);
        let mut all = true;
        for (k, (((before, after), (mean, acceleration)), top)) in joints.enumerate() {
            let defect = after - before - h * (mean + at_end * acceleration);
            let meets = defect.abs() <= IMPULSE_DEFECT * larger(*top, after.abs());
            all &= meets || self.plant.torque_driven.contains(&k);
        }
        all
    }

    /// Samples the joint motion at `t` into the state, as [`ReducedArm::set`] does.
    pub(crate) fn sample_joints(&mut self, t: f64) {
        let t = self.events.side(t);
        if t != self.sampled_at {
            self.plant.prescribed_state(t, &mut self.state, &mut self.qddot);
            self.sampled_at = t;
        }
    }

    fn keep_start(&mut self, t: f64) {
        let n = self.plant.model.n_actuated();
        let start = &mut self.step_start;
        start.time = t;
        start.qdot.copy_from_slice(&self.state.qdot.as_slice()[..n]);
        start.qddot.copy_from_slice(&self.qddot.as_slice()[..n]);
        start.top.iter_mut().zip(&start.qdot).for_each(|(top, speed)| *top = larger(*top, speed.abs()));
    }

    /// Applies the impulse of prescribed velocities that jump between `before` and `after`; see the
    /// module documentation.
    fn apply_impulses(
        &mut self,
        t: f64,
        before: f64,
        after: f64,
        x: &DVector<f64>,
        v: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        let n = self.plant.model.n_actuated();
        // Velocity jump of each coordinate; those of the free coordinates are unknown yet.
        let jump = &mut self.tau;
        jump.fill(0.0);
        self.plant.prescribed_state(before, &mut self.state, &mut self.qddot);
        jump.rows_mut(0, n).copy_from(&self.state.qdot.rows(0, n));
        self.plant.prescribed_state(after, &mut self.state, &mut self.qddot);
        for k in 0..n {
            let driven = self.plant.torque_driven.contains(&k);
            jump[k] = if driven { 0.0 } else { self.state.qdot[k] - jump[k] };
        }
        if jump.iter().all(|jump| *jump == 0.0) {
            return Ok(());
        }
        // M_ff Δv_f = -M_fp Δv_p
        self.set(t, x, v);
        let M = mass_matrix(&self.plant.model, &mut self.data, &self.state.q);
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
        // Work: impulse times mean velocity, 1/2 (v⁺ M v⁺ - v⁻ M v⁻) = Δvᵀ M (v⁺ - Δv/2); `state`
        // holds the velocities after the jump.
        let M = &self.data.M;
        let new = |k: usize| {
            let free = self.free.iter().position(|&l| l == k);
            free.map_or(self.state.qdot[k], |i| v[i] + self.shifted[i])
        };
        let row = |k: usize| (0..M.ncols()).map(|l| M[(k, l)] * self.tau[l]).sum::<f64>();
        self.impulse_work += (0..M.nrows()).map(|k| (new(k) - 0.5 * self.tau[k]) * row(k)).sum::<f64>();
        *v += &self.shifted;
        Ok(())
    }
}
