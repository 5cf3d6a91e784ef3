//! Tangent of the sampled controllers of joints driven by torque, sample by sample.
//!
//! ```text
//! error = q̇_ref + k_p (q_ref - q) - q̇,   τ = k_v error + I + τ_ff,   I += k_i T error
//! δτ = δk_v error + k_v δerror + δI + δτ_ff;   0 where τ is at its limit
//! δI += T (δk_i error + k_i δerror);           0 where the integral stops
//! ```
//! Torques are held between samples, so that torque and integral are the complete state of a
//! controller. A sufficiently small change of a parameter does not change which samples are
//! limited. Where one sample more or less is limited, the integral jumps by `k_i T error`: the
//! derivative is that of a fixed set of limited samples, and the number of these samples is
//! reported ([`crate::TorqueLimited`]).
//!
//! τ_ff is the inverse dynamics of the rigid robot on the reference; its tangent is that of
//! [`ForceTangent`].

use flexarm_kinematics::{Data, State, inverse_dynamics, mass_matrix_at_poses, world_poses};
use nalgebra::{DMatrix, DVector};

use crate::arm::FlexibleArm;
use crate::run_slopes::forces::ForceTangent;
use crate::run_slopes::{Direction, TorqueLimited};
use crate::servo::ServoState;

/// Derivatives of the controller states: one row per direction, one column per axis.
pub(super) struct ServoSlopes {
    /// Derivatives of the held torques.
    pub(super) torque: DMatrix<f64>,
    integral: DMatrix<f64>,
    ahead: DMatrix<f64>,
    /// Number of samples processed.
    samples: u64,
    /// Axes that reached their limits, with the time of the first limited sample.
    pub(super) limited: Vec<TorqueLimited>,
    /// Whether any direction changes the feed-forward other than through friction and factors.
    moves: bool,
    rigid: Rigid,
}

/// Rigid robot on its reference.
struct Rigid {
    tangent: ForceTangent,
    data: Data,
    by_q: DMatrix<f64>,
    by_rate: DMatrix<f64>,
    /// Joint forces due to one direction.
    room: Vec<f64>,
}

impl ServoSlopes {
    pub(super) fn new(servo: &ServoState, directions: &[Direction]) -> Self {
        let (model, d, p) = (&servo.servo.rigid, servo.servo.axes.len(), directions.len());
        let n = model.nv();
        let tangent = ForceTangent::new(model);
        let zeros = || DMatrix::zeros(p, d);
        Self {
            torque: zeros(),
            integral: zeros(),
            ahead: zeros(),
            samples: 0,
            limited: Vec::with_capacity(d),
            moves: directions.iter().any(|own| own.motion.is_some() || !own.fed_forward.is_empty()),
            rigid: Rigid {
                tangent,
                data: Data::new(model),
                by_q: DMatrix::zeros(n, n),
                by_rate: DMatrix::zeros(n, n),
                room: vec![0.0; n],
            },
        }
    }

    /// Differentiates the sample that a servo has just taken at `t`; returns whether there was one.
    ///
    /// * `x`, `v`: derivatives of the free coordinates and rates, directions × N, axes first;
    ///   `joints`: derivatives of reference, rates and accelerations.
    pub(super) fn sample(
        &mut self,
        t: f64,
        arm: &FlexibleArm,
        servo: &ServoState,
        directions: &[Direction],
        (x, v): (&DMatrix<f64>, &DMatrix<f64>),
        joints: &[DMatrix<f64>; 3],
    ) -> bool {
        if servo.samples == self.samples {
            return false;
        }
        self.samples = servo.samples;
        self.feed_forward(arm, servo, directions, joints);
        for (i, axis) in servo.servo.axes.iter().enumerate() {
            let (k, seen) = (axis.coordinate, servo.last[i]);
            if seen.limited {
                self.count_limited(t, k);
            }
            for (p, direction) in directions.iter().enumerate() {
                let mut by = direction.axis(i);
                by.velocity_gain *= seen.error;
                by.integral_gain *= seen.error;
                let lag = joints[0][(p, k)] - x[(p, i)];
                let error = joints[1][(p, k)] + axis.position_gain * lag + by.position_gain * seen.lag - v[(p, i)];
                let now = axis.velocity_gain * error + by.velocity_gain + self.ahead[(p, i)];
                if seen.filled {
                    self.integral[(p, i)] = self.torque[(p, i)] - now;
                }
                let unlimited = now + self.integral[(p, i)];
                self.torque[(p, i)] = if seen.limited { 0.0 } else { unlimited };
                if seen.integrated {
                    self.integral[(p, i)] += servo.servo.sample_s * (axis.integral_gain * error + by.integral_gain);
                }
            }
        }
        true
    }

    fn count_limited(&mut self, t: f64, coordinate: usize) {
        match self.limited.iter_mut().find(|known| known.coordinate == coordinate) {
            Some(known) => known.samples += 1,
            None => self.limited.push(TorqueLimited { coordinate, samples: 1, first_s: t }),
        }
    }

    /// Computes the derivatives of the feed-forward torques.
    fn feed_forward(
        &mut self,
        arm: &FlexibleArm,
        servo: &ServoState,
        directions: &[Direction],
        joints: &[DMatrix<f64>; 3],
    ) {
        self.ahead.fill(0.0);
        if self.moves {
            self.rigid.look(servo);
        }
        let (model, rates) = (&servo.servo.rigid, &servo.reference.qdot);
        for (p, direction) in directions.iter().enumerate() {
            let moves = self.moves && (direction.motion.is_some() || !direction.fed_forward.is_empty());
            if moves {
                self.rigid.forces(servo, direction, p, joints);
            }
            for (i, axis) in servo.servo.axes.iter().enumerate() {
                let (k, ahead) = (axis.coordinate, &mut self.ahead[(p, i)]);
                *ahead = direction.axis(i).feed_forward * servo.last[i].ahead;
                if !axis.feed_forward {
                    continue;
                }
                if let Some(friction) = arm.friction.get(k) {
                    let own = direction.friction.iter().filter(|(coordinate, _)| *coordinate == k);
                    *ahead += own.map(|(_, by)| friction.change(rates[k], by)).sum::<f64>();
                    *ahead += friction.slope(rates[k]) * joints[1][(p, k)];
                }
                let forces = if moves { self.rigid.room[k] } else { 0.0 };
                *ahead += forces;
                let rotor = model.rotor_inertia(k);
                let tau = servo.rigid_torque(k) - rotor * servo.qddot[k];
                for law in arm.load_friction.iter().filter(|law| law.coordinate == k) {
                    *ahead += law.by_torque(tau, rates[k]) * (forces - rotor * joints[2][(p, k)]);
                    *ahead += law.slope(tau, rates[k]) * joints[1][(p, k)];
                }
            }
        }
    }
}

impl Rigid {
    /// Computes the tangent at the reference motion of the last sample.
    fn look(&mut self, servo: &ServoState) {
        let (model, state, qddot): (_, &State, &DVector<f64>) = (&servo.servo.rigid, &servo.reference, &servo.qddot);
        inverse_dynamics(model, &mut self.data, state, qddot);
        world_poses(model, &mut self.data);
        self.tangent.compute(model, (&self.data, state, qddot), None, &mut self.by_q, &mut self.by_rate);
        mass_matrix_at_poses(model, &mut self.data);
    }

    /// Computes the change of all joint torques in a direction, in `room`.
    fn forces(&mut self, servo: &ServoState, direction: &Direction, p: usize, joints: &[DMatrix<f64>; 3]) {
        let Self { tangent, data, by_q, by_rate, room } = self;
        room.fill(0.0);
        for (body, more) in &direction.fed_forward {
            tangent.add_inertia_forces(&servo.servo.rigid, data, *body, more, room);
        }
        if direction.motion.is_some() {
            for (matrix, joints) in [&*by_q, by_rate, &data.M].into_iter().zip(joints) {
                for (k, to) in room.iter_mut().enumerate() {
                    *to += (0..joints.ncols()).map(|j| matrix[(k, j)] * joints[(p, j)]).sum::<f64>();
                }
            }
        }
    }
}
