//! The sampled controller of the joints that are driven by torque: what it remembers between samples. Not here: when it
//! takes them (`events`).

use std::sync::Arc;

use flexarm_kinematics::{Data, State, inverse_dynamics};
use nalgebra::DVector;

use crate::arm::{FlexibleArm, Servo};
use crate::drive::Friction;
use crate::gear::LoadFriction;

/// State of a [`Servo`] in a run.
pub(crate) struct ServoState {
    servo: Arc<Servo>,
    friction: Vec<Friction>,
    load_friction: Vec<LoadFriction>,
    /// Torque held until the next sample, one per axis.
    pub(crate) torque: Vec<f64>,
    /// Integral part of the torque.
    integral: Vec<f64>,
    /// The first sample sets the integrals so that the torques stay what they are.
    fresh: bool,
    data: Data,
    reference: State,
    qddot: DVector<f64>,
}

impl ServoState {
    pub(crate) fn new(servo: Arc<Servo>, arm: &FlexibleArm) -> Self {
        let n = servo.axes.len();
        Self {
            friction: arm.friction.clone(),
            load_friction: arm.load_friction.clone(),
            torque: vec![0.0; n],
            integral: vec![0.0; n],
            fresh: false,
            data: Data::new(&servo.rigid),
            reference: State::zeros(&servo.rigid),
            qddot: DVector::zeros(servo.rigid.nv()),
            servo,
        }
    }

    /// Reference motion and the rigid robot's torques at t.
    fn update_reference(&mut self, t: f64, arm: &FlexibleArm) {
        let n = self.qddot.len();
        let (q, qdot) = (self.reference.q.as_mut_slice(), self.reference.qdot.as_mut_slice());
        arm.motion.sample(t, &mut q[..n], &mut qdot[..n], self.qddot.as_mut_slice());
        inverse_dynamics(&self.servo.rigid, &mut self.data, &self.reference, &self.qddot);
    }

    fn feed_forward(&self, axis: usize) -> f64 {
        let k = self.servo.axes[axis].coordinate;
        let friction = self.friction.get(k).map_or(0.0, |f| f.torque(self.reference.qdot[k]));
        let rotor = self.servo.rigid.rotor_inertia(k) * self.qddot[k];
        let laws = self.load_friction.iter().filter(|law| law.coordinate == k);
        let loaded = laws.map(|law| law.torque(self.data.tau[k] - rotor, self.reference.qdot[k]));
        let friction = loaded.fold(friction, |sum, torque| sum + torque);
        if self.servo.axes[axis].feed_forward { self.data.tau[k] + friction } else { 0.0 }
    }

    /// Fills the integrators so that the first sample gives the torques `needed`, if it finds the joints on their reference.
    pub(crate) fn hold(&mut self, needed: &DVector<f64>) {
        for (torque, axis) in self.torque.iter_mut().zip(&self.servo.axes) {
            *torque = needed[axis.coordinate];
        }
        self.fresh = true;
    }

    /// Takes the sample of time t.
    pub(crate) fn sample(&mut self, t: f64, arm: &FlexibleArm, x: &[f64], v: &[f64]) {
        self.update_reference(t, arm);
        for axis in 0..self.servo.axes.len() {
            let a = self.servo.axes[axis];
            let k = a.coordinate;
            let wanted = self.reference.qdot[k] + a.position_gain * (self.reference.q[k] - x[axis]);
            let error = wanted - v[axis];
            let ahead = self.feed_forward(axis);
            // Without an integrator nothing remembers the load: the joint sags into its gains.
            if self.fresh && a.integral_gain > 0.0 {
                self.integral[axis] = self.torque[axis] - ahead - a.velocity_gain * error;
            }
            let unlimited = a.velocity_gain * error + self.integral[axis] + ahead;
            self.torque[axis] = unlimited.clamp(-a.limit, a.limit);
            // At the limit the integral only runs back.
            if unlimited == self.torque[axis] || (unlimited > 0.0) != (error > 0.0) {
                self.integral[axis] += a.integral_gain * self.servo.sample_s * error;
            }
        }
        self.fresh = false;
    }
}
