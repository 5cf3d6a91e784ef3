//! Modes of the condensed model under three kinds of support, with their residuals on the mesh.
//!
//! Not here: the eigensolver ([`crate::sparse`]).

use nalgebra::{DMatrix, DVector};

use super::Condensation;
use crate::sparse::{
    Block, Modes, ModesError, ModesWanted, Pencil, Released, WIDTH, add_product, gram, modes_of_two_supports,
    smallest_modes,
};

/// Residual of a mode above which it is refined by one more solve.
const ROUGH: f64 = 1e-6;

impl Condensation<'_> {
    /// Modes with every interface clamped.
    ///
    /// ```text
    /// K_ii φ = ω² M_ii φ,   G φ = 0
    /// ```
    /// Returns ω² ascending and mass-normalised shapes over all DoF, mesh axes; one sparse solve
    /// per Lanczos vector.
    ///
    /// # Errors
    /// [`ModesError`].
    ///
    /// # Source
    /// [Craig & Bampton 1968].
    pub fn fixed_modes(&self, wanted: ModesWanted) -> Result<Modes, ModesError> {
        let solve = &mut |F: &mut Block| {
            self.solve_constrained(F, None);
        };
        let mass = &mut self.mass_product();
        smallest_modes(&mut self.pencil(0, solve, mass), wanted)
    }

    /// Modes with the first interface clamped and the others free, as in [`Self::fixed_modes`].
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn held_modes(&self, wanted: ModesWanted) -> Result<Modes, ModesError> {
        let solve = &mut |F: &mut Block| self.solve_held_block(F);
        let freed = self.boundary.columns() - 6;
        let mass = &mut self.mass_product();
        smallest_modes(&mut self.pencil(freed, solve, mass), wanted)
    }

    /// Computes [`Self::fixed_modes`] and `held` of [`Self::held_modes`]; with two interfaces, with
    /// no more solves than for the former.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn fixed_and_held_modes(&self, wanted: ModesWanted, held: usize) -> Result<(Modes, Modes), ModesError> {
        let [T_B] = self.T_B.as_slice() else { return self.each_by_itself(wanted, held) };
        if self.dimension() == 0 {
            // All DoF follow the interfaces, so there is no basis of fixed modes.
            return self.each_by_itself(wanted, held);
        }
        let solve = &mut |F: &mut Block| {
            self.solve_constrained(F, None);
        };
        let mass = &mut self.mass_product();
        let mut pencil = self.pencil(0, solve, mass);
        let (fixed, held) = modes_of_two_supports(&mut pencil, wanted, &Released { T: T_B, C: &self.tip }, held)?;
        let fixed = self.smoothed(fixed, |F| {
            self.solve_constrained(F, None);
        });
        Ok((fixed, self.smoothed(held, |F| self.solve_held_block(F))))
    }

    fn each_by_itself(&self, wanted: ModesWanted, held: usize) -> Result<(Modes, Modes), ModesError> {
        Ok((self.fixed_modes(wanted)?, self.held_modes(ModesWanted::Count(held))?))
    }

    /// Returns the modes unchanged, or refined to `ω² K⁻¹ M φ` if their residuals on the mesh are
    /// too large. This happens in thin plates, where a combination of a hundred vectors has ten
    /// times the rounding error of one solve.
    fn smoothed(&self, mut modes: Modes, solve: impl Fn(&mut Block)) -> Modes {
        if self.mode_residuals(&modes).iter().all(|residual| *residual <= ROUGH) {
            return modes;
        }
        for first in (0..modes.len()).step_by(WIDTH) {
            let shapes = Block::of_columns(&modes.shapes, first, WIDTH.min(modes.len() - first));
            let mut F = Block::zeros(shapes.rows.len(), shapes.width);
            self.model.M.block_product(&shapes, &mut F);
            solve(&mut F);
            F.put_columns(&mut modes.shapes, first);
            modes.solves += F.width;
        }
        for (mut shape, omega2) in modes.shapes.column_iter_mut().zip(&modes.omega2) {
            shape *= *omega2;
        }
        modes
    }

    fn mass_product(&self) -> impl FnMut(&Block, &mut Block) {
        |X, Y| self.model.M.block_product(X, Y)
    }

    /// Pencil of a solver that leaves `freed` boundary coordinates free.
    fn pencil<'a>(
        &self,
        freed: usize,
        solve: &'a mut dyn FnMut(&mut Block),
        mass: &'a mut dyn FnMut(&Block, &mut Block),
    ) -> Pencil<'a> {
        Pencil { rows: self.model.size(), dimension: self.dimension() + freed, solve, mass }
    }

    /// Number of degrees of freedom with every interface clamped.
    fn dimension(&self) -> usize {
        self.boundary.free().len() - self.boundary.means().len()
    }

    /// Elastic modes of the free link, without the six rigid motions; as in [`Self::fixed_modes`].
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn free_modes(&self, wanted: ModesWanted) -> Result<Modes, ModesError> {
        // R: rigid motions of the mesh, from those of the boundary.
        let n = self.T.ncols();
        let R_b = DMatrix::from_fn(n, 6, |i, j| if i < 6 { f64::from(i == j) } else { self.rigid_at(i, j) });
        let mut R = DMatrix::zeros(self.T.nrows(), 6);
        add_product(&mut R, 1.0, &self.T, &R_b);
        let (R, MR) = (Block::of_columns(&R, 0, 6), Block::of_columns(&self.model.M.product(&R), 0, 6));
        let Some(inverse) = R.gram(&MR).try_inverse() else { return Err(ModesError::NotFinite) };
        // Loads without resultant, and displacements without momentum:
        // F <- F - M R (Rᵀ M R)⁻¹ Rᵀ F,   u <- u - R (Rᵀ M R)⁻¹ Rᵀ M u.
        let solve = &mut |F: &mut Block| {
            F.subtract_product(&MR, &(&inverse * R.gram(F)));
            self.solve_held_block(F);
            F.subtract_product(&R, &(&inverse * MR.gram(F)));
        };
        let mass = &mut self.mass_product();
        let mut pencil = self.pencil(self.boundary.columns() - 6, solve, mass);
        pencil.dimension -= 6;
        smallest_modes(&mut pencil, wanted)
    }

    /// Row `i` of the boundary under the rigid motion that moves the first interface by `j`, from
    /// the stiffness itself.
    fn rigid_at(&self, i: usize, j: usize) -> f64 {
        // K_BB u_B + K_BA u_A = 0 for a motion without forces.
        let n = self.K_g.nrows();
        let K_BA = self.K_g.view((6, j), (n - 6, 1));
        -(self.tip.row(i - 6) * K_BA)[(0, 0)]
    }

    /// Residual of each mode on the mesh, over the free DoF; for modes under any support.
    ///
    /// ```text
    /// ‖K φ - ω² M φ + Gᵀ λ‖ / ‖ω² M φ‖      λ: least squares
    /// ```
    /// * `modes`: shapes over all DoF, as the functions above return them.
    pub fn mode_residuals(&self, modes: &Modes) -> Vec<f64> {
        let K = self.model.K.product(&modes.shapes);
        let M = self.model.M.product(&modes.shapes);
        let one = |(k, omega2): (usize, &f64)| {
            let mut r = DVector::from_iterator(
                self.boundary.free().len(),
                self.boundary.free().iter().map(|dof| K[(*dof as usize, k)] - omega2 * M[(*dof as usize, k)]),
            );
            let size =
                self.boundary.free().iter().map(|dof| (omega2 * M[(*dof as usize, k)]).powi(2)).sum::<f64>().sqrt();
            self.remove_tie_forces(&mut r);
            r.norm() / size
        };
        modes.omega2.iter().enumerate().map(one).collect()
    }

    /// Removes the component along the rows of G from a residual over the free DoF.
    fn remove_tie_forces(&self, r: &mut DVector<f64>) {
        let means = self.boundary.means();
        if means.is_empty() {
            return;
        }
        let free = self.boundary.free();
        let mut G = DMatrix::zeros(free.len(), means.len());
        for (k, (_, row)) in means.iter().enumerate() {
            for (dof, weight) in row {
                if let Ok(at) = free.binary_search(dof) {
                    G[(at, k)] = *weight;
                }
            }
        }
        if let Some(lambda) = gram(&G, &G).lu().solve(&(G.transpose() * &*r)) {
            *r -= G * lambda;
        }
    }
}
