//! The rigid twin: the same robot on the same motion with all elastic coordinates held at zero.
//!
//! TCP quantities in world axes at the TCP, SI units. Not here: the distance from the flexible arm
//! (`monitor::tool`).

use std::sync::Arc;

use flexarm_kinematics::{
    Data, Frame, Model, State, forward_kinematics_velocity, frame_jacobian, frame_twist, inverse_dynamics, world_poses,
};
use flexarm_stepping::Plant;
use nalgebra::{DVector, Matrix6xX, Vector3};

/// Kinematics and required torques of the rigid twin at one time.
pub(crate) struct RigidTwin {
    pub(crate) data: Data,
    pub(crate) state: State,
    qddot: DVector<f64>,
    /// Jacobian of the TCP, world axes.
    pub(crate) J: Matrix6xX<f64>,
    /// Velocity of the TCP (m/s).
    pub(crate) velocity: Vector3<f64>,
    /// Acceleration of the TCP (m/s²).
    pub(crate) acceleration: Vector3<f64>,
    /// Model and state to which [`Self::data`] and [`Self::J`] belong; `None` if other functions
    /// used them last.
    placed: Option<(Arc<Model>, State)>,
}

impl RigidTwin {
    pub(crate) fn new(plant: &Plant) -> Self {
        let model = &plant.model;
        Self {
            data: Data::new(&plant.model),
            state: State::zeros(model),
            qddot: DVector::zeros(model.nv()),
            J: Matrix6xX::zeros(model.nv()),
            velocity: Vector3::zeros(),
            acceleration: Vector3::zeros(),
            placed: None,
        }
    }

    /// Velocity and acceleration of the TCP at time t; zero, without any computation, while all
    /// joints are at rest.
    pub(crate) fn rates(&mut self, plant: &Plant, tcp: &Frame, t: f64) -> [Vector3<f64>; 2] {
        plant.prescribed_state(t, &mut self.state, &mut self.qddot);
        if self.state.qdot.iter().all(|rate| *rate == 0.0) {
            return [Vector3::zeros(); 2];
        }
        self.update(plant, tcp, t);
        [self.velocity, self.acceleration]
    }

    /// Computes poses and velocities at time t with the same operations as [`RigidTwin::update`],
    /// but neither forces nor accelerations. Does nothing while the joints are at rest.
    pub(crate) fn place(&mut self, plant: &Plant, tcp: &Frame, t: f64) {
        plant.prescribed_state(t, &mut self.state, &mut self.qddot);
        if let Some((model, state)) = &mut self.placed {
            if Arc::ptr_eq(model, &plant.model) && *state == self.state {
                return;
            }
            model.clone_from(&plant.model);
            state.q.copy_from(&self.state.q);
            state.qdot.copy_from(&self.state.qdot);
        } else {
            self.placed = Some((plant.model.clone(), self.state.clone()));
        }
        forward_kinematics_velocity(&plant.model, &mut self.data, &self.state);
        frame_jacobian(&plant.model, &self.data, tcp, &mut self.J);
        self.velocity = frame_twist(&self.data, tcp).linear;
    }

    /// Computes everything at time t; `data.tau` holds the torques that the drives must supply.
    pub(crate) fn update(&mut self, plant: &Plant, tcp: &Frame, t: f64) {
        self.placed = None;
        let model = &plant.model;
        plant.prescribed_state(t, &mut self.state, &mut self.qddot);
        inverse_dynamics(model, &mut self.data, &self.state, &self.qddot);
        world_poses(model, &mut self.data);
        frame_jacobian(model, &self.data, tcp, &mut self.J);
        self.velocity = frame_twist(&self.data, tcp).linear;
        // Acceleration of the point: spatial acceleration plus ω × v, without the gravity term.
        let V = self.data.V[tcp.body].at_child(&tcp.X_BF);
        let A = self.data.A[tcp.body].at_child(&tcp.X_BF);
        let R = self.data.X_WB[tcp.body].rotation * tcp.X_BF.rotation;
        self.acceleration = R * (A.linear + V.angular.cross(&V.linear)) + model.gravity;
    }
}
