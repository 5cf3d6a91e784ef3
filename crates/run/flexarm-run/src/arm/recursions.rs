//! Recursive algorithms of a tree on plain arrays: one state, or many states, row by row on all
//! cores.
//!
//! For programs with arrays of their own. The tree is that of the rigid robot
//! ([`Robot::recursions`]) or of an arm with its elastic coordinates after the actuated ones
//! ([`Arm::recursions`]). Springs, dampers and friction are not included.

use std::sync::{Arc, Mutex, PoisonError};

use flexarm_kinematics::{
    Data, Frame, Model, Roles, State, center_of_mass, forward_dynamics, forward_kinematics, frame_jacobian,
    gravity_forces, inverse_dynamics, mass_matrix, nonlinear_effects,
};
use nalgebra::{DVector, Matrix6xX};
use rayon::prelude::*;

use crate::arm::Arm;
use crate::error::Error;
use crate::motions::applied_load::frame_of;
use crate::motions::applied_load::unknown_frame;
use crate::robot::Robot;
use crate::robot::loops;

/// Number of rows from which on threads share the work; below, waking them costs more.
const MANY: usize = 256;
/// Number of rows per task of a thread.
const CHUNK: usize = 64;

/// A tree with workspaces for its recursions, shared by threads.
pub struct Recursions {
    model: Arc<Model>,
    spaces: Mutex<Vec<Space>>,
}

/// Workspace of one thread.
struct Space {
    data: Data,
    state: State,
    given: DVector<f64>,
    roles: Roles,
    J: Matrix6xX<f64>,
}

impl Space {
    fn new(model: &Model) -> Self {
        let n = model.nv();
        Self {
            data: Data::new(model),
            state: State::zeros(model),
            given: DVector::zeros(n),
            roles: Roles::all_free(model),
            J: Matrix6xX::zeros(n),
        }
    }
}

impl Robot {
    /// Returns the recursions of the rigid robot with its payload.
    ///
    /// # Errors
    /// [`Error::Model`].
    pub fn recursions(&self) -> Result<Recursions, Error> {
        Ok(Recursions::new(self.rigid_model()?))
    }
}

impl Arm {
    /// Returns the recursions of the tree with its elastic coordinates.
    pub fn recursions(&self) -> Recursions {
        Recursions::new(self.model.clone())
    }
}

impl Recursions {
    /// Creates the recursions of a tree.
    pub fn new(model: Arc<Model>) -> Self {
        Self { model, spaces: Mutex::default() }
    }

    /// Returns the tree.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the frame with this name: a link or `tcp`.
    ///
    /// # Errors
    /// [`Error::Load`] with the available links.
    pub fn frame(&self, name: &str) -> Result<Frame, Error> {
        let frames = || self.model.frames().iter().filter(|frame| !frame.name.starts_with("__"));
        let known = || frames().map(|frame| frame.name.clone()).collect::<Vec<_>>();
        frame_of(name, &self.model).cloned().ok_or_else(|| Error::Load(unknown_frame(name, &known())))
    }

    /// Computes generalised forces `τ = M q̈ + bias` of m motions, m×n (N m or N).
    ///
    /// * `q`, `qdot`, `qddot`: m×n, all coordinates of the tree.
    ///
    /// # Errors
    /// [`Error::Pose`] if the arrays do not have m rows of n values, [`Error::Loop`] if a loop does
    /// not close.
    pub fn inverse_dynamics(&self, q: &[f64], qdot: &[f64], qddot: &[f64], tau: &mut [f64]) -> Result<(), Error> {
        let n = self.model.nv();
        self.rows([q, qdot, qddot], tau, n, |space, [q, qdot, qddot], tau| {
            space.state.q.copy_from_slice(q);
            space.state.qdot.copy_from_slice(qdot);
            space.given.copy_from_slice(qddot);
            tau.copy_from_slice(inverse_dynamics(&self.model, &mut space.data, &space.state, &space.given).as_slice());
        })
    }

    /// Computes forces at zero acceleration: gravity, balancers, centrifugal and Coriolis forces,
    /// m×n.
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn nonlinear_effects(&self, q: &[f64], qdot: &[f64], tau: &mut [f64]) -> Result<(), Error> {
        let n = self.model.nv();
        self.rows([q, qdot], tau, n, |space, [q, qdot], tau| {
            space.state.q.copy_from_slice(q);
            space.state.qdot.copy_from_slice(qdot);
            tau.copy_from_slice(nonlinear_effects(&self.model, &mut space.data, &space.state).as_slice());
        })
    }

    /// Computes forces that hold m poses against gravity and balancers, m×n.
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn gravity_forces(&self, q: &[f64], tau: &mut [f64]) -> Result<(), Error> {
        let n = self.model.nv();
        self.rows([q], tau, n, |space, [q], tau| {
            space.state.q.copy_from_slice(q);
            tau.copy_from_slice(gravity_forces(&self.model, &mut space.data, &space.state.q).as_slice());
        })
    }

    /// Computes mass matrices, m×n×n.
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn mass_matrix(&self, q: &[f64], M: &mut [f64]) -> Result<(), Error> {
        let n = self.model.nv();
        self.rows([q], M, n * n, |space, [q], M| {
            space.state.q.copy_from_slice(q);
            // The matrix is symmetric, so row-major equals column-major.
            M.copy_from_slice(mass_matrix(&self.model, &mut space.data, &space.state.q).as_slice());
        })
    }

    /// Computes accelerations for given generalised forces with all coordinates free, m×n.
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn forward_dynamics(&self, q: &[f64], qdot: &[f64], tau: &[f64], qddot: &mut [f64]) -> Result<(), Error> {
        let n = self.model.nv();
        self.rows([q, qdot, tau], qddot, n, |space, [q, qdot, tau], qddot| {
            space.state.q.copy_from_slice(q);
            space.state.qdot.copy_from_slice(qdot);
            space.given.copy_from_slice(tau);
            let Space { data, state, roles, given, .. } = space;
            qddot.copy_from_slice(forward_dynamics(&self.model, data, state, roles, given).as_slice());
        })
    }

    /// Computes Jacobians of a frame, world axes at its origin, linear rows first, m×6×n.
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn jacobian(&self, q: &[f64], frame: &Frame, J: &mut [f64]) -> Result<(), Error> {
        let n = self.model.nv();
        self.rows([q], J, 6 * n, |space, [q], J| {
            space.state.q.copy_from_slice(q);
            forward_kinematics(&self.model, &mut space.data, &space.state.q);
            frame_jacobian(&self.model, &space.data, frame, &mut space.J);
            for (row, to) in J.chunks_exact_mut(n).enumerate() {
                to.iter_mut().enumerate().for_each(|(column, to)| *to = space.J[(row, column)]);
            }
        })
    }

    /// Computes poses of a frame in the world as homogeneous matrices, m×4×4.
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn pose(&self, q: &[f64], frame: &Frame, X: &mut [f64]) -> Result<(), Error> {
        self.rows([q], X, 16, |space, [q], X| {
            space.state.q.copy_from_slice(q);
            forward_kinematics(&self.model, &mut space.data, &space.state.q);
            X.copy_from_slice(space.data.X_WF(frame).to_homogeneous().transpose().as_slice());
        })
    }

    /// Computes centres of mass in the world, m×3 (m).
    ///
    /// # Errors
    /// As [`Recursions::inverse_dynamics`].
    pub fn center_of_mass(&self, q: &[f64], com: &mut [f64]) -> Result<(), Error> {
        self.rows([q], com, 3, |space, [q], com| {
            space.state.q.copy_from_slice(q);
            forward_kinematics(&self.model, &mut space.data, &space.state.q);
            com.copy_from_slice(center_of_mass(&self.model, &space.data).as_slice());
        })
    }

    /// Computes `width` values for each row of the inputs; the first input is the pose.
    fn rows<const K: usize>(
        &self,
        inputs: [&[f64]; K],
        out: &mut [f64],
        width: usize,
        one: impl Fn(&mut Space, [&[f64]; K], &mut [f64]) + Sync,
    ) -> Result<(), Error> {
        let n = self.model.nv();
        let m = out.len() / width.max(1);
        if let Some(wrong) = inputs.iter().find(|input| input.len() != m * n) {
            return Err(Error::samples(wrong.len(), m, n));
        }
        // Row by row in one workspace; a pose in which a loop does not close ends the work.
        let row = |k: usize| inputs.map(|input| &input[k * n..][..n]);
        let several = |space: &mut Space, first: usize, out: &mut [f64]| -> Result<(), Error> {
            for (k, out) in out.chunks_exact_mut(width).enumerate() {
                let inputs = row(first + k);
                if !self.model.loops().is_empty() {
                    space.state.q.copy_from_slice(inputs[0]);
                    loops::check_pose(&self.model, &mut space.data, &space.state.q)?;
                }
                one(space, inputs, out);
            }
            Ok(())
        };
        // Few rows in a workspace that is kept, many on all cores in workspaces of their own.
        if m < MANY {
            let mut space = self.take();
            let done = several(&mut space, 0, out);
            self.spaces.lock().unwrap_or_else(PoisonError::into_inner).push(space);
            return done;
        }
        let chunks = out.par_chunks_mut(width * CHUNK).enumerate();
        chunks.try_for_each_init(|| Space::new(&self.model), |space, (chunk, out)| several(space, chunk * CHUNK, out))
    }

    /// Takes an unused workspace, or creates one.
    fn take(&self) -> Space {
        let free = self.spaces.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| Space::new(&self.model))
    }
}
