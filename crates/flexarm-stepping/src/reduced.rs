//! The flexible arm in reduced coordinates: elastic ones free, actuated ones truly prescribed.
//!
//! ```text
//! M_ee ë + h_e(q, q̇, [q̈_a, 0]) + K e + D ė = 0
//! ```
//! The residual is one Newton-Euler pass, the acceleration one hybrid pass; the iteration matrix
//! `M_ee + c_D D + c_K K` is dense in the elastic coordinates. Not here: integration.

use flexarm_kinematics::{Data, Roles, State, hybrid_dynamics, inverse_dynamics, mass_matrix_at_poses, world_poses};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector6};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::system::SecondOrderSystem;

/// A flexible arm as a second-order system; see the module page.
pub struct ReducedArm {
    pub(crate) arm: FlexibleArm,
    pub(crate) data: Data,
    pub(crate) state: State,
    pub(crate) qddot: DVector<f64>,
    tau: DVector<f64>,
    roles: Roles,
    sampled_at: f64,
    factor: Option<Cholesky<f64, Dyn>>,
    matrix: DMatrix<f64>,
    /// Storage of the mass matrix's factor, `M^-1 K`, and a product.
    mass_factor: Option<Cholesky<f64, Dyn>>,
    M_inverse_K: DMatrix<f64>,
    product: DMatrix<f64>,
    shifted: DVector<f64>,
    c_h2: f64,
}

impl ReducedArm {
    /// Workspaces for the arm.
    pub fn new(arm: FlexibleArm) -> Self {
        let model = &arm.model;
        let n = arm.n_elastic_coordinates();
        Self {
            data: Data::new(model),
            state: State::zeros(model),
            qddot: DVector::zeros(model.nv()),
            tau: DVector::zeros(model.nv()),
            roles: Roles::actuated_prescribed(model),
            sampled_at: f64::NAN,
            factor: None,
            matrix: DMatrix::zeros(n, n),
            mass_factor: None,
            M_inverse_K: DMatrix::zeros(n, n),
            product: DMatrix::zeros(n, n),
            shifted: DVector::zeros(n),
            c_h2: 0.0,
            arm,
        }
    }

    /// The arm.
    pub fn arm(&self) -> &FlexibleArm {
        &self.arm
    }

    /// Joint motion at t (once per time) and elastic coordinates into the full state.
    fn set(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>) {
        if t != self.sampled_at {
            self.arm.prescribed_state(t, &mut self.state, &mut self.qddot);
            self.sampled_at = t;
        }
        let n = self.arm.model.n_actuated();
        self.state.q.as_mut_slice()[n..].copy_from_slice(x.as_slice());
        self.state.qdot.as_mut_slice()[n..].copy_from_slice(v.as_slice());
        if !self.arm.loads.is_empty() {
            flexarm_kinematics::forward_kinematics(&self.arm.model, &mut self.data, &self.state.q);
            self.arm.apply_loads(&mut self.data);
        }
    }

    /// `f += K x + D v`.
    fn add_elastic_forces(&self, x: &DVector<f64>, v: &DVector<f64>, f: &mut DVector<f64>) {
        for (k, element) in self.arm.elements.iter().enumerate() {
            let mut y: Vector6<f64> = x.fixed_rows::<6>(6 * k).into();
            if self.arm.proportional {
                y += v.fixed_rows::<6>(6 * k) * self.arm.tau[k];
            }
            let force = element.K_S * y;
            let mut part = f.fixed_rows_mut::<6>(6 * k);
            part += force;
        }
        if !self.arm.proportional {
            f.gemv(1.0, &self.arm.D, v, 1.0);
        }
    }

    /// Full motion at `t`: poses, twists and all generalised forces; those of the actuated joints are the
    /// torques that the drives must supply.
    pub(crate) fn evaluate(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>) {
        self.set(t, x, v);
        let n = self.arm.model.n_actuated();
        self.qddot.as_mut_slice()[n..].copy_from_slice(a.as_slice());
        inverse_dynamics(&self.arm.model, &mut self.data, &self.state, &self.qddot);
        world_poses(&self.arm.model, &mut self.data);
    }
}

impl SecondOrderSystem for ReducedArm {
    fn dimension(&self) -> usize {
        self.arm.n_elastic_coordinates()
    }

    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        self.set(t, x, v);
        let n = self.arm.model.n_actuated();
        self.qddot.as_mut_slice()[n..].copy_from_slice(a.as_slice());
        let tau = inverse_dynamics(&self.arm.model, &mut self.data, &self.state, &self.qddot);
        r.as_mut_slice().copy_from_slice(&tau.as_slice()[n..]);
        self.add_elastic_forces(x, v, r);
    }

    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        self.set(t, x, v);
        a.fill(0.0);
        self.add_elastic_forces(x, v, a);
        let n = self.arm.model.n_actuated();
        for (tau, f) in self.tau.as_mut_slice()[n..].iter_mut().zip(a.iter()) {
            *tau = -f;
        }
        let Self { arm, data, state, roles, qddot, tau, .. } = self;
        hybrid_dynamics(&arm.model, data, state, roles, qddot, tau);
        a.as_mut_slice().copy_from_slice(&qddot.as_slice()[n..]);
        Ok(())
    }

    fn factor_iteration_matrix(&mut self, t: f64, c_D: f64, c_K: f64, c_h2: f64) -> Result<(), StepError> {
        mass_matrix_at_poses(&self.arm.model, &mut self.data);
        let (n, ne) = (self.arm.model.n_actuated(), self.dimension());
        // The factor's storage is taken back and filled again: no allocation.
        let reuse = |factor: &mut Option<Cholesky<f64, Dyn>>| match factor.take() {
            Some(old) => old.unpack_dirty(),
            None => DMatrix::zeros(ne, ne),
        };
        // c_D D + c_K K
        let C = &mut self.matrix;
        C.as_mut_slice().fill(0.0);
        for (k, element) in self.arm.elements.iter().enumerate() {
            let weight = if self.arm.proportional { c_K + c_D * self.arm.tau[k] } else { c_K };
            let mut block = C.fixed_view_mut::<6, 6>(6 * k, 6 * k);
            block += element.K_S * weight;
        }
        if !self.arm.proportional {
            C.zip_apply(&self.arm.D, |s, d| *s += c_D * d);
        }

        let mut S = reuse(&mut self.factor);
        S.copy_from(&self.data.M.view((n, n), (ne, ne)));
        if c_h2 > 0.0 {
            let mut M = reuse(&mut self.mass_factor);
            M.copy_from(&S);
            let factor = Cholesky::new(M).ok_or(StepError::Singular { matrix: "mass matrix", t })?;
            self.M_inverse_K.as_mut_slice().fill(0.0);
            for (k, element) in self.arm.elements.iter().enumerate() {
                self.M_inverse_K.fixed_view_mut::<6, 6>(6 * k, 6 * k).copy_from(&element.K_S);
            }
            factor.solve_mut(&mut self.M_inverse_K);
            self.mass_factor = Some(factor);
            // J = M + C Sᵀ with Sᵀ = 1 + c M^-1 K is not symmetric in general; S J = M + c K + S C Sᵀ is, for every
            // damping, and is factorised in its place.
            self.product.copy_from(&self.matrix);
            self.product.gemm(c_h2, &self.matrix, &self.M_inverse_K, 1.0);
            self.matrix.copy_from(&self.product);
            self.matrix.gemm_tr(c_h2, &self.M_inverse_K, &self.product, 1.0);
            for (k, element) in self.arm.elements.iter().enumerate() {
                let mut block = S.fixed_view_mut::<6, 6>(6 * k, 6 * k);
                block += element.K_S * c_h2;
            }
        }
        self.c_h2 = c_h2;
        S += &self.matrix;
        self.factor = Cholesky::new(S);
        self.factor.as_ref().map(|_| ()).ok_or(StepError::Singular { matrix: "iteration matrix", t })
    }

    fn inverse_mass_times_stiffness(&mut self, a: &DVector<f64>, out: &mut DVector<f64>) {
        out.gemv(1.0, &self.M_inverse_K, a, 0.0);
    }

    fn solve_iteration(&mut self, r: &mut DVector<f64>) {
        if self.c_h2 > 0.0 {
            // S r
            self.shifted.gemv_tr(self.c_h2, &self.M_inverse_K, r, 0.0);
            *r += &self.shifted;
        }
        if let Some(factor) = &self.factor {
            factor.solve_mut(r);
        }
    }
}
