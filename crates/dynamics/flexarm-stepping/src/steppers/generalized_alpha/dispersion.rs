//! Dispersion correction of generalised-alpha, (5) of the parent module: its effect on
//! accelerations and on Newton's matrix.
//!
//! ```text
//! x̃ = E ẍ,   E = 1 + c h² M^-1 K                         (6)
//! J = M + Z E,   Z = h γ' D + h² β' K                    (7)  derivative of (1) by ẍ⁺
//! Eᵀ J = M + c h² K + Eᵀ Z E,   J^-1 = (Eᵀ J)^-1 Eᵀ      (8)  symmetric for every damping, unlike J
//! ```
//! Along a tree the matrix contains the complete correction: [`crate::tree_matrix`].

use nalgebra::{DMatrix, DVector};

use crate::dense::{congruence, product, solve_in_place};
use crate::error::StepError;
use crate::iteration_matrix::{IterationMatrix, MatrixForm};
use crate::system::SecondOrderSystem;

/// The correction for one step size. Allocates at its creation and for its first matrix only.
#[derive(Clone, Debug)]
pub(super) struct DispersionCorrection {
    /// c of (5).
    c: f64,
    /// `c h²`.
    c_h2: f64,
    /// K, n × n.
    K: DMatrix<f64>,
    /// `M^-1 K` at the configuration of the last matrix.
    M_inverse_K: DMatrix<f64>,
    /// Workspace for the factor of M and for products.
    workspace: [DMatrix<f64>; 3],
    /// Product of `M^-1 K` and a vector.
    shift: DVector<f64>,
}

impl DispersionCorrection {
    /// Creates the correction for n coordinates and step size `h` (s).
    pub(super) fn new(c: f64, h: f64, n: usize) -> Self {
        let none = DMatrix::zeros(0, 0);
        Self {
            c,
            c_h2: c * h * h,
            K: none.clone(),
            M_inverse_K: none.clone(),
            workspace: [none.clone(), none.clone(), none],
            shift: DVector::zeros(n),
        }
    }

    /// Returns `c h²`.
    pub(super) fn c_h2(&self) -> f64 {
        self.c_h2
    }

    /// Sets the step size of the next steps (s).
    pub(super) fn set_length(&mut self, dt: f64) {
        self.c_h2 = self.c * dt * dt;
    }

    /// Replaces M and Z of the matrix by the terms of (8); with `kept`, (6) is not updated and only
    /// the matrix changes.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the mass matrix is not positive definite.
    pub(super) fn correct(
        &mut self,
        system: &mut impl SecondOrderSystem,
        matrix: &mut IterationMatrix,
        t: f64,
        kept: bool,
    ) -> Result<(), StepError> {
        let MatrixForm::Dense(matrix) = &mut matrix.form else { return Ok(()) };
        let Self { c_h2, K, M_inverse_K, workspace: [factor, turned, product], shift, .. } = self;
        let (c_h2, n) = (*c_h2, shift.len());
        if K.nrows() != n {
            for matrix in [&mut *K, &mut *M_inverse_K, &mut *factor, &mut *turned, &mut *product] {
                *matrix = DMatrix::zeros(n, n);
            }
        }
        factor.copy_from(&matrix.M);
        system.stiffness(K);
        // M^-1 K; K is symmetric.
        if !kept {
            M_inverse_K.copy_from(K);
            if !solve_in_place(factor.as_mut_slice(), M_inverse_K.as_mut_slice(), n) {
                return Err(StepError::Singular { matrix: "mass matrix", t });
            }
        }

        // Product Eᵀ Z E.
        let (X, Z) = (M_inverse_K.as_slice(), matrix.Z.as_slice());
        congruence(c_h2, X, Z, n, [factor.as_mut_slice(), turned.as_mut_slice()], product.as_mut_slice());
        matrix.Z.copy_from(product);

        // M + c h² K, and Eᵀ as right-hand side, stored transposed.
        matrix.M.zip_apply(K, |s, k| *s += c_h2 * k);
        matrix.inverse.zip_apply(M_inverse_K, |i, s| *i += c_h2 * s);
        Ok(())
    }

    /// Computes x̃ of an acceleration by (6).
    pub(super) fn corrected(
        &mut self,
        matrix: &mut IterationMatrix,
        acceleration: &DVector<f64>,
        x_tilde: &mut DVector<f64>,
    ) {
        if let MatrixForm::Tree(tree) = &mut matrix.form {
            return tree.correct(acceleration, x_tilde);
        }
        self.shift_by(acceleration);
        for ((x_tilde, a), shift) in x_tilde.iter_mut().zip(acceleration).zip(&self.shift) {
            *x_tilde = self.c_h2 * shift + a;
        }
    }

    /// Returns the contribution of a change d of ẍ, the last solution with the matrix, to the
    /// change of x̃ beyond d itself: a factor and a vector, whose product is `c h² M^-1 K d`.
    pub(super) fn shift<'a>(&'a mut self, matrix: &'a IterationMatrix, d: &DVector<f64>) -> (f64, &'a DVector<f64>) {
        if let MatrixForm::Tree(tree) = &matrix.form {
            return (1.0, tree.shift());
        }
        self.shift_by(d);
        (self.c_h2, &self.shift)
    }

    /// Computes `M^-1 K d`.
    fn shift_by(&mut self, d: &DVector<f64>) {
        product(self.M_inverse_K.as_slice(), d.as_slice(), self.shift.as_mut_slice());
    }
}
