//! Recursions of the tree on the independent coordinates, equation (4) of the module.
//!
//! Each function has the name of the recursion that it stands for. It solves the positions of the
//! dependent joints ([`with_loops`]), runs the recursion over the opened tree, and reduces the result.
//! Not here: the matrices of (4) and (5) (`reduce`).

use nalgebra::{DVector, Vector2, Vector3};

use crate::closure::reduce::reduce;
use crate::closure::workspace::LoopData;
use crate::crba::composite_bodies;
use crate::data::{Data, State};
use crate::kinematics::{move_bodies as move_tree, place_and_measure};
use crate::model::Model;
use crate::rnea::{self, balanced};

impl LoopData {
    /// Tree velocities from (2) and tree accelerations from (3); `None` stands for zero.
    fn follow(&mut self, model: &Model, data: &Data, qdot: Option<&[f64]>, qddot: Option<&[f64]>) {
        let nv = self.solved.nv;
        match qdot {
            None => self.qdot.fill(0.0),
            Some(qdot) => {
                self.qdot[..nv].copy_from_slice(qdot);
                self.solved.carry_over(&mut self.qdot);
            }
        }
        match qddot {
            None => self.qddot.fill(0.0),
            Some(qddot) => {
                self.qddot[..nv].copy_from_slice(qddot);
                self.solved.carry_over(&mut self.qddot);
            }
        }
        if qdot.is_some() {
            self.solved.rates(model, data, &self.q, &self.qdot, &mut self.rates, false);
            self.qddot[nv..].iter_mut().zip(&self.rates.gamma).for_each(|(a, gamma)| *a += gamma);
        }
    }

    /// Adds the pin forces to the joint wrenches of the opened tree; uses up the efforts `τ_d`.
    ///
    /// A force f on the eye, and -f on the pin, relieves the dependent joints: `J_dᵀ f = τ_d` (f in
    /// the axes of the pin). A pin also loads the dependent joints of earlier loops, so that the
    /// last loop comes first.
    fn add_pin_forces(&mut self, model: &Model, data: &mut Data) {
        let Self { solved, rates, tau, .. } = self;
        for (k, loop_) in model.loops.iter().enumerate().rev() {
            let tau_d = Vector2::new(tau[loop_.first], tau[loop_.first + 1]);
            let f = solved.inverse[k].transpose() * tau_d;
            for &j in loop_.moved_by.iter().filter(|j| **j >= solved.nv) {
                tau[j] -= solved.J[k][j].dot(&f);
            }
            loop_.place_chains(model, data, &mut rates.X_C);
            let (X_CA, p_CB) = loop_.ends_at(&rates.X_C);
            let force = X_CA.rotation * Vector3::new(f.x, f.y, 0.0);
            for (chain, sign) in loop_.chains.iter().zip([1.0, -1.0]) {
                for &i in chain {
                    let R = rates.X_C[i].rotation.inverse().matrix() * sign;
                    let moment = (p_CB - rates.X_C[i].translation.vector).cross(&force);
                    data.F[i].force += R * force;
                    data.F[i].torque += R * moment;
                }
            }
        }
    }
}

impl Data {
    /// Index of the first loop that cannot be closed at the last coordinates; quantities that
    /// depend on it are NaN.
    pub fn open_loop(&self) -> Option<usize> {
        self.loops.as_ref().and_then(|loops| loops.solved.open)
    }

    /// Values of the dependent joints at the last coordinates (rad or m), in the order of
    /// [`Model::dependent`].
    pub fn dependent_values(&self) -> &[f64] {
        self.loops.as_ref().map_or(&[], |loops| &loops.q[loops.solved.nv..])
    }

    /// Rates of the dependent joints at the last velocities (rad/s or m/s), in the same order.
    pub fn dependent_rates(&self) -> &[f64] {
        self.loops.as_ref().map_or(&[], |loops| &loops.qdot[loops.solved.nv..])
    }

    /// Transmission angle of each loop at the last coordinates (rad, at most π/2): zero at a dead
    /// point, π/2 at best.
    pub fn transmission_angles(&self) -> &[f64] {
        self.loops.as_ref().map_or(&[], |loops| &loops.solved.angle)
    }
}

/// Runs `run` with the loop data taken out of the workspace; solves the loop positions first if `q`
/// is given.
fn with_loops(model: &Model, data: &mut Data, q: Option<&[f64]>, run: impl FnOnce(&mut Data, &mut LoopData)) {
    let mut loops = data.loops.take().unwrap_or_else(|| Box::new(LoopData::new(model)));
    if let Some(q) = q {
        loops.q[..q.len()].copy_from_slice(q);
        let LoopData { solved, q, .. } = &mut *loops;
        solved.positions(model, data, q);
    }
    run(data, &mut loops);
    data.loops = Some(loops);
}

/// [`crate::forward_kinematics`] with closed loops.
#[inline(never)]
pub(crate) fn place(model: &Model, data: &mut Data, q: &[f64]) {
    with_loops(model, data, Some(q), |data, loops| place_and_measure(model, data, &loops.q));
}

/// [`crate::forward_kinematics_velocity`] with closed loops.
#[inline(never)]
pub(crate) fn move_bodies(model: &Model, data: &mut Data, state: &State) {
    with_loops(model, data, Some(state.q.as_slice()), |data, loops| {
        loops.follow(model, data, Some(state.qdot.as_slice()), None);
        let LoopData { solved, rates, q, qdot, .. } = loops;
        solved.rates(model, data, q, qdot, rates, true);
        move_tree(model, data, q, qdot);
    });
}

/// [`crate::inverse_dynamics`] by (4); `qdot` of `None` means zero velocities.
#[inline(never)]
pub(crate) fn inverse_dynamics(model: &Model, data: &mut Data, q: &[f64], qdot: Option<&[f64]>, qddot: Option<&[f64]>) {
    with_loops(model, data, Some(q), |data, loops| {
        loops.follow(model, data, qdot, qddot);
        std::mem::swap(&mut data.tau, &mut loops.tau);
        balanced(model, data, &loops.q, &loops.qdot, Some(&loops.qddot));
        std::mem::swap(&mut data.tau, &mut loops.tau);
        let nv = loops.solved.nv;
        data.tau.as_mut_slice().copy_from_slice(&loops.tau.as_slice()[..nv]);
        for (row, tau_d) in loops.solved.T.chunks_exact(nv.max(1)).zip(&loops.tau.as_slice()[nv..]) {
            data.tau.iter_mut().zip(row).for_each(|(tau, t)| *tau += t * tau_d);
        }
        loops.add_pin_forces(model, data);
    });
}

/// [`crate::mass_matrix_at_poses`] by (4).
#[inline(never)]
pub(crate) fn mass_matrix_at_poses(model: &Model, data: &mut Data) {
    with_loops(model, data, None, |data, loops| {
        std::mem::swap(&mut data.M, &mut loops.M);
        composite_bodies(model, data);
        std::mem::swap(&mut data.M, &mut loops.M);
        reduce(&loops.M, &loops.solved, 0, &mut data.M);
    });
}

/// [`crate::hybrid_dynamics`] with the reduced mass matrix: `M_ff q̈_f = τ_f - bias_f - M_fp q̈_p`.
/// Does not allocate after the first call.
#[inline(never)]
pub(crate) fn solve(model: &Model, data: &mut Data, state: &State, free: &[usize]) {
    let Some(loops) = &mut data.loops else { return };
    let mut workspace = std::mem::take(&mut loops.free);
    workspace.fit(free.len());
    workspace.right.iter_mut().zip(free).for_each(|(right, &k)| *right = data.tau[k]);
    free.iter().for_each(|&k| data.qddot[k] = 0.0);
    // Bias, including the accelerations of the prescribed coordinates.
    let mut qddot = std::mem::replace(&mut data.qddot, DVector::zeros(0));
    rnea::inverse_dynamics(model, data, state, &qddot);
    workspace.right.iter_mut().zip(free).for_each(|(right, &k)| *right -= data.tau[k]);
    mass_matrix_at_poses(model, data);
    workspace.solve(|i, j| data.M[(free[i], free[j])]);
    workspace.right.iter().zip(free).for_each(|(a, &k)| qddot[k] = *a);
    rnea::inverse_dynamics(model, data, state, &qddot);
    data.qddot = qddot;
    if let Some(loops) = &mut data.loops {
        loops.free = workspace;
    }
}
