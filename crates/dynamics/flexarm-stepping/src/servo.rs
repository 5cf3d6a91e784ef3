//! Sampled controller of the joints driven by torque: its state between samples. Not here: the
//! sample times (`events`).

use std::sync::Arc;

use flexarm_kinematics::{Data, State, inverse_dynamics};
use nalgebra::DVector;

use crate::drive::Friction;
use crate::gear::LoadFriction;
use crate::plant::{Plant, Servo};

/// A servo that reached its torque limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimited {
    /// Coordinate of the joint.
    pub coordinate: usize,
    /// Number of limited samples.
    pub samples: u64,
    /// Time of the first one (s).
    pub first_s: f64,
}

/// State of a [`Servo`] in a run.
#[derive(Clone)]
pub(crate) struct ServoState {
    pub(crate) servo: Arc<Servo>,
    friction: Vec<Friction>,
    load_friction: Vec<LoadFriction>,
    /// Torque held until the next sample, one per axis.
    pub(crate) torque: Vec<f64>,
    /// The same before the limit, without the torque that the motion adds.
    own: Vec<f64>,
    /// Integral part of the torque.
    integral: Vec<f64>,
    /// Whether the next sample initialises the integrals such that the torques stay unchanged.
    fresh: bool,
    data: Data,
    pub(crate) reference: State,
    pub(crate) qddot: DVector<f64>,
    /// Axes that reached their limits, in order of the time of the first limited sample.
    pub(crate) limited: Vec<TorqueLimited>,
}

impl ServoState {
    pub(crate) fn new(servo: Arc<Servo>, plant: &Plant) -> Self {
        let n = servo.axes.len();
        Self {
            friction: plant.friction.clone(),
            load_friction: plant.load_friction.clone(),
            torque: vec![0.0; n],
            own: vec![0.0; n],
            integral: vec![0.0; n],
            fresh: false,
            data: Data::new(&servo.rigid),
            reference: State::zeros(&servo.rigid),
            qddot: DVector::zeros(servo.rigid.nv()),
            limited: Vec::with_capacity(n),
            servo,
        }
    }

    /// Computes the reference motion and the torques of the rigid robot at `t`.
    fn update_reference(&mut self, t: f64, plant: &Plant) {
        let n = self.qddot.len();
        let (q, qdot) = (self.reference.q.as_mut_slice(), self.reference.qdot.as_mut_slice());
        plant.motion.sample(t, &mut q[..n], &mut qdot[..n], self.qddot.as_mut_slice());
        inverse_dynamics(&self.servo.rigid, &mut self.data, &self.reference, &self.qddot);
    }

    fn feed_forward(&self, axis: usize) -> f64 {
        let k = self.servo.axes[axis].coordinate;
        let friction = self.friction.get(k).map_or(0.0, |f| f.torque(self.reference.qdot[k]));
        let rotor = self.servo.rigid.rotor_inertia(k) * self.qddot[k];
        let laws = self.load_friction.iter().filter(|law| law.coordinate == k);
        let loaded = laws.map(|law| law.torque(self.data.tau[k] - rotor, self.reference.qdot[k]));
        let friction = loaded.fold(friction, |sum, torque| sum + torque);
        self.servo.axes[axis].feed_forward * (self.data.tau[k] + friction)
    }

    /// Initialises the controller such that the first sample returns the torques `needed` if the
    /// joints are on their reference.
    pub(crate) fn start_at(&mut self, needed: &DVector<f64>) {
        for (torque, axis) in self.torque.iter_mut().zip(&self.servo.axes) {
            *torque = needed[axis.coordinate];
        }
        self.fresh = true;
    }

    /// Updates the torques after a change of those that the motion adds, at time `t`.
    pub(crate) fn add(&mut self, t: f64, plant: &Plant) {
        for ((torque, own), axis) in self.torque.iter_mut().zip(&self.own).zip(&self.servo.axes) {
            *torque = (own + plant.motion.added_torque(t, axis.coordinate)).clamp(-axis.limit, axis.limit);
        }
    }

    /// Computes the sample at time `t`.
    pub(crate) fn sample(&mut self, t: f64, plant: &Plant, x: &[f64], v: &[f64]) {
        self.update_reference(t, plant);
        for axis in 0..self.servo.axes.len() {
            let a = self.servo.axes[axis];
            let k = a.coordinate;
            let lag = self.reference.q[k] - x[axis];
            let wanted = self.reference.qdot[k] + a.position_gain * lag;
            let error = wanted - v[axis];
            let (ahead, added) = (self.feed_forward(axis), plant.motion.added_torque(t, k));
            // Without integral action the load is not compensated: the joint sags until the gains
            // balance it.
            let filled = self.fresh && a.integral_gain > 0.0;
            if filled {
                self.integral[axis] = self.torque[axis] - ahead - added - a.velocity_gain * error;
            }
            self.own[axis] = a.velocity_gain * error + self.integral[axis] + ahead;
            let unlimited = self.own[axis] + added;
            self.torque[axis] = unlimited.clamp(-a.limit, a.limit);
            // Anti-windup: at the limit the integral changes only away from it.
            let limited = unlimited != self.torque[axis];
            let integrated = !limited || (unlimited > 0.0) != (error > 0.0);
            if limited {
                self.count_limited(t, k);
            }
            if integrated {
                self.integral[axis] += a.integral_gain * self.servo.sample_s * error;
            }
        }
        self.fresh = false;
    }

    fn count_limited(&mut self, t: f64, coordinate: usize) {
        match self.limited.iter_mut().find(|known| known.coordinate == coordinate) {
            Some(known) => known.samples += 1,
            None => self.limited.push(TorqueLimited { coordinate, samples: 1, first_s: t }),
        }
    }
}
