//! Residual, acceleration and matrices of the arm as a second-order system.
//!
//! Matrices are over the free coordinates: joints driven by torque, then elastic ones. Not here:
//! forces of springs, drives and gears (`forces`), events (`events`).

use flexarm_kinematics::{hybrid_dynamics, inverse_dynamics, mass_matrix_at_poses};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::error::StepError;
use crate::reduced::ReducedArm;
use crate::system::SecondOrderSystem;
use crate::tree_matrix::TreeMatrices;

/// Maximum number of fixed-point passes for accelerations with load-dependent (geometric)
/// stiffness.
const GEOMETRIC_PASSES: usize = 12;

impl SecondOrderSystem for ReducedArm {
    fn dimension(&self) -> usize {
        self.plant.n_free()
    }

    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        self.set(t, x, v);
        self.set_accelerations(a);
        inverse_dynamics(&self.plant.model, &mut self.data, &self.state, &self.qddot);
        self.is_placed = true;
        for (r, &k) in r.iter_mut().zip(&self.free) {
            *r = self.data.tau[k];
        }
        self.add_forces(x, v, r);
        if self.geometric {
            self.add_geometric_forces(x, r);
        }
    }

    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        self.set(t, x, v);
        self.is_placed = true;
        let mut forces = std::mem::replace(&mut self.forces, DVector::zeros(0));
        // Springs, dampers and friction push the free coordinates; geometric stiffness depends on
        // the accelerations and is iterated.
        for pass in 0..GEOMETRIC_PASSES {
            forces.fill(0.0);
            if pass > 0 {
                self.add_geometric_forces(x, &mut forces);
            }
            self.add_forces(x, v, &mut forces);
            for (&k, f) in self.free.iter().zip(forces.iter()) {
                self.tau[k] = -f;
            }
            let Self { plant, data, state, roles, qddot, tau, .. } = self;
            hybrid_dynamics(&plant.model, data, state, roles, qddot, tau);
            let mut change = 0.0f64;
            for (a, &k) in a.iter_mut().zip(&self.free) {
                change = change.max((qddot[k] - *a).abs());
                *a = qddot[k];
            }
            if !self.geometric || (pass > 0 && change <= 1e-13 * a.amax()) {
                break;
            }
            // Update the loads for the accelerations just computed.
            inverse_dynamics(&self.plant.model, &mut self.data, &self.state, &self.qddot);
        }
        self.forces = forces;
        match a.iter().all(|a| a.is_finite()) {
            true => Ok(()),
            false => self.check_mass(t),
        }
    }

    fn mass(&mut self, M: &mut DMatrix<f64>) {
        self.place();
        mass_matrix_at_poses(&self.plant.model, &mut self.data);
        for (column, &l) in self.free.iter().enumerate() {
            for (row, &k) in self.free.iter().enumerate() {
                M[(row, column)] = self.data.M[(k, l)];
            }
        }
    }

    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, Z: &mut DMatrix<f64>) {
        let driven = self.plant.torque_driven.len();
        Z.as_mut_slice().fill(0.0);
        // Friction of the joints driven by torque.
        for (i, &k) in self.plant.torque_driven.iter().enumerate() {
            // A negative friction slope (Stribeck) is dropped to keep the matrix positive definite.
            Z[(i, i)] = c_D * self.plant.friction.get(k).map_or(0.0, |f| f.slope(self.state.qdot[k]).max(0.0));
        }
        if let Some(gears) = &self.gears {
            let rates = self.state.qdot.as_slice();
            for (i, &row) in self.plant.torque_driven.iter().enumerate() {
                for (j, &column) in self.plant.torque_driven.iter().enumerate() {
                    Z[(i, j)] = c_D * self.plant.friction_slope(row, column, rates, gears);
                }
            }
        }
        // Springs, including their dampers if these are proportional.
        for (k, element) in self.plant.elements.iter().enumerate() {
            let (first, size) = (driven + self.plant.offset(element), element.size);
            let damping = if self.plant.proportional { c_D * self.plant.tau[k] } else { 0.0 };
            if let Some(curve) = &element.curve {
                let slope = match &self.gears {
                    Some(gears) => gears.slope(&self.plant, k, element, curve),
                    None => curve.slope(self.state.q[element.coordinate], self.state.q.as_slice()),
                };
                Z[(first, first)] += c_K * slope + damping * element.K[(0, 0)];
            } else {
                let mut block = Z.view_mut((first, first), (size, size));
                block.zip_apply(&element.K, |z, k| *z += (c_K + damping) * k);
            }
        }
        for &(i, j, k) in &self.plant.cross_stiffness {
            Z[(driven + i, driven + j)] += c_K * k;
            Z[(driven + j, driven + i)] += c_K * k;
        }
        // Otherwise the damping couples the elements.
        if !self.plant.proportional {
            let ne = self.dimension() - driven;
            Z.view_mut((driven, driven), (ne, ne)).zip_apply(&self.plant.D, |z, d| *z += c_D * d);
        }
    }

    fn stiffness(&mut self, K: &mut DMatrix<f64>) {
        let driven = self.plant.torque_driven.len();
        K.as_mut_slice().fill(0.0);
        for element in &self.plant.elements {
            let (first, size) = (driven + self.plant.offset(element), element.size);
            K.view_mut((first, first), (size, size)).copy_from(&element.K);
        }
        for &(i, j, k) in &self.plant.cross_stiffness {
            (K[(driven + i, driven + j)], K[(driven + j, driven + i)]) = (k, k);
        }
    }

    fn settle(&mut self, t: f64, x: &DVector<f64>) {
        if !self.plant.has_hysteresis() {
            return;
        }
        self.sample_joints(t);
        for (i, &k) in self.plant.torque_driven.iter().enumerate() {
            self.state.q[k] = x[i];
        }
        if let Some(gears) = &mut self.gears {
            gears.settle(&self.plant, self.state.q.as_slice(), &x.as_slice()[self.plant.torque_driven.len()..]);
        }
    }

    fn along_tree(&mut self, c_D: f64, c_K: f64, to: &mut TreeMatrices) -> bool {
        if self.tree.is_some() {
            self.place();
        }
        let Some(tree) = &mut self.tree else { return false };
        let placed = tree.place(&self.plant.model, &self.data, &self.state, &mut to.nodes);
        if placed {
            self.plant.blocks(c_D, c_K, to);
        }
        placed
    }
}

impl ReducedArm {
    /// Checks that the mass matrix at the last coordinates is positive definite.
    #[cold]
    fn check_mass(&mut self, t: f64) -> Result<(), StepError> {
        let n = self.dimension();
        let mut M = DMatrix::zeros(n, n);
        self.mass(&mut M);
        let finite = M.iter().all(|m| m.is_finite());
        match finite && Cholesky::new(M).is_none() {
            true => Err(StepError::Singular { matrix: "mass matrix", t }),
            false => Ok(()),
        }
    }
}
