//! Tangent of gear effects other than elasticity: transmission errors, hysteresis, coupling,
//! load-dependent friction.
//!
//! ```text
//! δ = e - ε(q_m),  δ' = ė - ε' q̇_m
//! dF = K dδ + D dδ' + Σ k_i w_i,     dδ' = dė - ε' dq̇_m - ε'' q̇_m dq_m                    (1)
//! on q_m:  -ε' dF - ε'' F dq_m                                                            (2)
//! w_i = ds_i - dδ of a slider: constant while it sticks; -dδ of the last time it slipped  (3)
//! ```
//! A slipping slider stays at its reach, independent of any parameter. The times at which slipping
//! begins and ends depend on the parameter, but the torque does not jump there, so that the
//! derivative does not involve them.

use flexarm_kinematics::State;
use nalgebra::{DMatrix, DVector};

use crate::arm::FlexibleArm;
use crate::gear::GearState;
use crate::run_slopes::Direction;
use crate::run_slopes::tangent::{LinearisationPoint, add_columns, add_springs, place};

/// Tangent at the current state; n elastic coordinates.
pub(super) struct GearSlopes {
    /// Stiffness of all springs at their deflections, n × n.
    K: DMatrix<f64>,
    /// `∂F/∂q` and `∂F/∂q̇`, n × nv.
    by_q: DMatrix<f64>,
    by_rate: DMatrix<f64>,
    /// ε' and ε'' of each transmission error.
    ripple: Vec<[f64; 2]>,
    /// Derivative of each load-dependent friction with respect to the transmitted torque.
    loaded: Vec<f64>,
    /// w of (3): directions × sliders.
    w: DMatrix<f64>,
}

impl GearSlopes {
    pub(super) fn new(arm: &FlexibleArm, directions: usize) -> Self {
        let (n, nv) = (arm.n_elastic_coordinates(), arm.model.nv());
        let sliders = arm.hysteresis.iter().map(|law| law.sliders.len()).sum();
        Self {
            K: DMatrix::zeros(n, n),
            by_q: DMatrix::zeros(n, nv),
            by_rate: DMatrix::zeros(n, nv),
            ripple: vec![[0.0; 2]; arm.transmission.len()],
            loaded: vec![0.0; arm.load_friction.len()],
            w: DMatrix::zeros(directions, sliders),
        }
    }

    /// Adds springs, dampers and friction to `∂r/∂q` and `∂r/∂q̇`; `gears` must belong to the same
    /// state.
    pub(super) fn compute(
        &mut self,
        arm: &FlexibleArm,
        state: &State,
        gears: &GearState,
        to_q: &mut DMatrix<f64>,
        to_rate: &mut DMatrix<f64>,
    ) {
        self.forces(arm, state, gears);
        let Self { by_q, by_rate, ripple, loaded, .. } = self;
        let (m, n) = (arm.model.n_actuated(), by_q.nrows());
        let mut rows = to_q.rows_mut(m, n);
        rows += &*by_q;
        let mut rows = to_rate.rows_mut(m, n);
        rows += &*by_rate;
        // Motor rows, (2).
        for (error, [slope, bend]) in arm.transmission.iter().zip(ripple) {
            let (k, motor) = (arm.offset(&arm.elements[error.element]), error.motor);
            add_row(to_q, motor, -*slope, by_q, k);
            add_row(to_rate, motor, -*slope, by_rate, k);
            to_q[(motor, motor)] -= *bend * gears.F[k];
        }
        let rates = state.qdot.as_slice();
        for &row in &arm.torque_driven {
            for &column in &arm.torque_driven {
                to_rate[(row, column)] += arm.unloaded_friction_slope(row, column, rates, f64::NEG_INFINITY);
            }
        }
        for (law, by_torque) in arm.load_friction.iter().zip(loaded) {
            *by_torque = 0.0;
            let Some(element) = law.element.filter(|_| place(arm, law.coordinate).is_some()) else { continue };
            let (k, row) = (arm.offset(&arm.elements[element]), law.coordinate);
            *by_torque = law.by_torque(gears.F[k], rates[row]);
            add_row(to_q, row, *by_torque, by_q, k);
            add_row(to_rate, row, *by_torque, by_rate, k);
            to_rate[(row, row)] += law.slope(gears.F[k], rates[row]);
        }
    }

    /// Computes (1) without the history terms of the sliders.
    fn forces(&mut self, arm: &FlexibleArm, state: &State, gears: &GearState) {
        let Self { K, by_q, by_rate, ripple, .. } = self;
        let (m, n) = (arm.model.n_actuated(), by_q.nrows());
        K.fill(0.0);
        for (number, element) in arm.elements.iter().enumerate() {
            let first = arm.offset(element);
            match &element.curve {
                Some(curve) => K[(first, first)] = gears.slope(arm, number, element, curve),
                None => K.view_mut((first, first), (element.size, element.size)).copy_from(&element.K),
            }
        }
        for &(i, j, k) in &arm.cross_stiffness {
            K[(i, j)] += k;
            K[(j, i)] += k;
        }
        by_q.fill(0.0);
        by_rate.fill(0.0);
        by_q.columns_mut(m, n).copy_from(K);
        by_rate.columns_mut(m, n).copy_from(&arm.D);
        for (error, ripple) in arm.transmission.iter().zip(ripple) {
            let (k, motor) = (arm.offset(&arm.elements[error.element]), error.motor);
            let (q, rate) = (state.q[motor], state.qdot[motor]);
            let [slope, bend] = [error.slope(q), error.bend(q)];
            *ripple = [slope, bend];
            by_q.column_mut(motor).axpy(-slope, &K.column(k), 1.0);
            by_q.column_mut(motor).axpy(-bend * rate, &arm.D.column(k), 1.0);
            by_rate.column_mut(motor).axpy(-slope, &arm.D.column(k), 1.0);
        }
    }

    /// Adds the forces due to direction `number` and the history terms of its sliders; free
    /// coordinates.
    pub(super) fn add_explicit(
        &self,
        at: &LinearisationPoint<'_>,
        gears: &GearState,
        (number, direction): (usize, &Direction),
        room: &mut DVector<f64>,
        to: &mut [f64],
    ) {
        let (arm, rates, driven) = (at.arm, at.rates, at.arm.torque_driven.len());
        let F = &mut room.as_mut_slice()[..self.K.nrows()];
        F.fill(0.0);
        add_springs(arm, direction, Some(gears), gears.delta.as_slice(), F);
        if let Some(dD) = direction.damping_after(at.changes) {
            add_columns(dD, gears.rate.as_slice(), F);
        }
        gears.stuck(arm, |slider, k, stiffness| F[k] += stiffness * self.w[(number, slider)]);
        to[driven..].iter_mut().zip(&*F).for_each(|(to, F)| *to += F);
        for (error, [slope, _]) in arm.transmission.iter().zip(&self.ripple) {
            if let Some(i) = place(arm, error.motor) {
                to[i] -= slope * F[arm.offset(&arm.elements[error.element])];
            }
        }
        for (law, by_torque) in arm.load_friction.iter().zip(&self.loaded) {
            if let (Some(i), Some(element)) = (place(arm, law.coordinate), law.element) {
                to[i] += by_torque * F[arm.offset(&arm.elements[element])];
            }
        }
        for (coordinate, by) in &direction.friction {
            let Some(law) = arm.friction.get(*coordinate) else { continue };
            // Friction of a motor that moves several joints.
            let coupled = arm.coupling.as_ref().and_then(|coupling| Some((coupling, coupling.place(*coordinate)?)));
            if let Some((coupling, motor)) = coupled {
                let change = law.change(coupling.motor_rate(motor, rates), by);
                for (j, joint) in coupling.coordinates.iter().enumerate() {
                    if let Some(i) = place(arm, *joint) {
                        to[i] += coupling.C_inverse[(motor, j)] * change;
                    }
                }
            } else if let Some(i) = place(arm, *coordinate) {
                to[i] += law.change(rates[*coordinate], by);
            }
        }
    }

    /// Updates w by (3) at the end of a step; `x`: derivatives of the free coordinates, directions
    /// × N; `joints`: of the joint motion.
    pub(super) fn settle(&mut self, arm: &FlexibleArm, gears: &GearState, x: &DMatrix<f64>, joints: &DMatrix<f64>) {
        let driven = arm.torque_driven.len();
        let Self { w, ripple, .. } = self;
        gears.stuck(arm, |slider, k, stiffness| {
            if stiffness > 0.0 {
                return;
            }
            for p in 0..w.nrows() {
                let mut deflection = x[(p, driven + k)];
                for (error, [slope, _]) in arm.transmission.iter().zip(&*ripple) {
                    if arm.offset(&arm.elements[error.element]) == k {
                        let motor = place(arm, error.motor).map_or(joints[(p, error.motor)], |i| x[(p, i)]);
                        deflection -= slope * motor;
                    }
                }
                w[(p, slider)] = -deflection;
            }
        });
    }
}

/// Adds a multiple of row `k` of `from` to a row of `to`.
fn add_row(to: &mut DMatrix<f64>, row: usize, factor: f64, from: &DMatrix<f64>, k: usize) {
    for column in 0..from.ncols() {
        to[(row, column)] += factor * from[(k, column)];
    }
}
