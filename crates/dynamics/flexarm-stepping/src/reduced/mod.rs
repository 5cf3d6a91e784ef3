//! Flexible arm in reduced coordinates: elastic coordinates and joints driven by torque are free,
//! all other joints are prescribed.
//!
//! ```text
//! M_ff ẍ + h_f(q, q̇, [q̈_p, 0]) + K x + D ẋ + friction(ẋ) = τ
//! ```
//! The residual is one Newton-Euler pass, the acceleration one hybrid-dynamics pass. Mass matrix,
//! damping and stiffness are dense in the free coordinates. Torques of a sampled controller are
//! constant between its samples. Start at [`ReducedArm`]; `system` has residual and matrices, `forces`
//! springs, drives and gears, `events` what happens at discrete times. Not here: integration.

mod events;
mod forces;
mod system;

use std::sync::Arc;

use flexarm_kinematics::{
    Data, Pose, Roles, State, forward_kinematics, inverse_dynamics, kinetic_energy_of, potential_energy_of, world_poses,
};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::elastic_tree::ElasticTree;
use crate::error::StepError;
use crate::events::{ArmDamping, EventQueue, damping_after_changes};
use crate::gear::GearState;
use crate::plant::Plant;
use crate::servo::ServoState;
use events::StepStart;

/// A flexible arm as a second-order system; see the module documentation.
#[derive(Clone)]
pub struct ReducedArm {
    pub(crate) plant: Arc<Plant>,
    pub(crate) data: Data,
    pub(crate) state: State,
    pub(crate) qddot: DVector<f64>,
    pub(crate) tau: DVector<f64>,
    roles: Roles,
    /// Free coordinates in the model's order.
    pub(crate) free: Vec<usize>,
    pub(crate) servo: Option<ServoState>,
    pub(crate) events: EventQueue,
    /// Damping after each change of inertia.
    pub(crate) dampings: Vec<ArmDamping>,
    /// Work done by the drives at jumps of prescribed velocities (J).
    pub(crate) impulse_work: f64,
    geometric: bool,
    pub(crate) sampled_at: f64,
    pub(crate) step_start: StepStart,
    /// Storage of the factor of `M_ff` at velocity jumps.
    pub(crate) mass_factor: Option<Cholesky<f64, Dyn>>,
    pub(crate) shifted: DVector<f64>,
    /// Forces of the springs, or of load-dependent stiffness.
    pub(crate) forces: DVector<f64>,
    /// State of gear effects other than elasticity.
    pub(crate) gears: Option<Box<GearState>>,
    /// Tree of the elastic joints, if there are enough of them and they are damped by element.
    tree: Option<ElasticTree>,
    /// Whether `data` holds the poses of the last [`ReducedArm::set`].
    is_placed: bool,
}

impl ReducedArm {
    /// Creates the workspaces for the arm.
    pub fn new(plant: impl Into<Arc<Plant>>) -> Self {
        let plant = plant.into();
        let model = &plant.model;
        let n = plant.n_free();
        let driven = plant.torque_driven.clone();
        // Prescribed: actuated joints that no servo drives. All others are free.
        let roles = Roles::new(model, |k| k < model.n_actuated() && !driven.contains(&k));
        let geometric = plant.elements.iter().any(|e| e.geometric.is_some());
        Self {
            data: Data::new(&plant.model),
            state: State::zeros(model),
            qddot: DVector::zeros(model.nv()),
            tau: DVector::zeros(model.nv()),
            free: roles.free_coordinates().to_vec(),
            roles,
            servo: plant.servo.clone().map(|servo| ServoState::new(servo, &plant)),
            events: EventQueue::of(&plant),
            dampings: damping_after_changes(&plant),
            impulse_work: 0.0,
            geometric,
            sampled_at: f64::NAN,
            step_start: StepStart::new(model.n_actuated()),
            mass_factor: Cholesky::new(DMatrix::identity(n, n)),
            shifted: DVector::zeros(n),
            forces: DVector::zeros(n),
            gears: GearState::of(&plant),
            tree: ElasticTree::that_pays(&plant),
            is_placed: false,
            plant,
        }
    }

    /// Returns the arm.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns free coordinates and rates at `t = 0`: driven joints at position and speed of their
    /// reference, springs at `e`. A motion whose velocities jump at 0 starts from rest.
    pub(crate) fn start(&mut self, e: &DVector<f64>) -> Result<(DVector<f64>, DVector<f64>), StepError> {
        let (n, driven) = (self.plant.n_free(), self.plant.torque_driven.len());
        let (mut x, mut v) = (DVector::zeros(n), DVector::zeros(n));
        self.plant.prescribed_state(0.0, &mut self.state, &mut self.qddot);
        for (i, &k) in self.plant.torque_driven.iter().enumerate() {
            x[i] = self.state.q[k];
            v[i] = self.state.qdot[k];
        }
        x.rows_mut(driven, e.len()).copy_from(e);
        if let Some(gears) = &mut self.gears {
            gears.begin(&self.plant, self.state.q.as_slice(), e.as_slice());
        }
        if self.servo.is_some() {
            // Initialise the controller with the torques that keep the arm on its motion with the
            // springs as they are.
            let mut at_rest = DVector::zeros(n);
            for (i, &k) in self.plant.torque_driven.iter().enumerate() {
                at_rest[i] = self.qddot[k];
            }
            self.evaluate(0.0, &x, &v, &at_rest);
            let tau = self.data.tau.clone();
            if let Some(servo) = &mut self.servo {
                servo.start_at(&tau);
            }
        }
        self.at_time(0.0, &x, &mut v)?;
        Ok((x, v))
    }

    /// Writes the joint motion at `t` (sampled once per time) and the free coordinates into the
    /// full state.
    pub(crate) fn set(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>) {
        let t = self.events.side(t);
        self.sample_joints(t);
        self.is_placed = false;
        let n = self.plant.model.n_actuated();
        let driven = self.plant.torque_driven.len();
        for (i, &k) in self.plant.torque_driven.iter().enumerate() {
            self.state.q[k] = x[i];
            self.state.qdot[k] = v[i];
        }
        self.state.q.as_mut_slice()[n..].copy_from_slice(&x.as_slice()[driven..]);
        self.state.qdot.as_mut_slice()[n..].copy_from_slice(&v.as_slice()[driven..]);
        if !self.plant.loads.is_empty() {
            self.place();
            self.plant.apply_loads(&mut self.data, t);
        }
    }

    /// Checks that the loops of the arm close at the start.
    ///
    /// # Errors
    /// [`StepError::OpenLoop`].
    pub(crate) fn check_loops(&mut self, x: &DVector<f64>, v: &DVector<f64>) -> Result<(), StepError> {
        if self.plant.model.loops().is_empty() {
            return Ok(());
        }
        self.set(0.0, x, v);
        self.place();
        StepError::open_loop(&self.plant.model, &self.data, 0.0).map_or(Ok(()), Err)
    }

    /// Computes the poses of the state in `data` unless they are there.
    fn place(&mut self) {
        if !self.is_placed {
            forward_kinematics(&self.plant.model, &mut self.data, &self.state.q);
            self.is_placed = true;
        }
    }

    fn set_accelerations(&mut self, a: &DVector<f64>) {
        let (n, driven) = (self.plant.model.n_actuated(), self.plant.torque_driven.len());
        for (i, &k) in self.plant.torque_driven.iter().enumerate() {
            self.qddot[k] = a[i];
        }
        self.qddot.as_mut_slice()[n..].copy_from_slice(&a.as_slice()[driven..]);
    }

    /// Computes poses, twists and all generalised forces at `t`; those of the actuated joints are
    /// the drive torques, friction included.
    pub(crate) fn evaluate(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>) {
        self.set(t, x, v);
        self.set_accelerations(a);
        self.is_placed = true;
        inverse_dynamics(&self.plant.model, &mut self.data, &self.state, &self.qddot);
        self.add_joint_torques(x, v);
        world_poses(&self.plant.model, &mut self.data);
    }

    /// Works as [`ReducedArm::evaluate`] with the poses in `X_WB` and without twists; returns
    /// kinetic energy and potential energy of gravity (J).
    pub(crate) fn observe(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &DVector<f64>,
        X_WB: &mut [Pose],
    ) -> [f64; 2] {
        self.evaluate(t, x, v, a);
        X_WB.copy_from_slice(&self.data.X_WB);
        [kinetic_energy_of(&self.plant.model, &self.data), potential_energy_of(&self.plant.model, &self.data)]
    }

    /// Returns the torques of the controller since its last sample, in the order of
    /// [`Plant::torque_driven`]; empty without a controller.
    pub(crate) fn servo_torques(&self) -> &[f64] {
        self.servo.as_ref().map_or(&[], |s| &s.torque)
    }
}
