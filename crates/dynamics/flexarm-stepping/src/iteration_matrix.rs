//! Matrix of Newton's method in an implicit step, `J = M + c_D D + c_K K`, in one of two forms:
//!
//! - dense inverse: it is used dozens of times before it is renewed, and a product costs a third of
//!   two triangular solves;
//! - elimination along the tree, if the coordinates form a tree and are many
//!   ([`crate::tree_matrix`]).
//!
//! Between [`IterationMatrix::read`] and [`IterationMatrix::invert`] a method may change a dense J
//! (fields of [`DenseInverse`]). Nothing here allocates after the first use.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::dense::{dot, product, solve_in_place};
use crate::error::StepError;
use crate::system::SecondOrderSystem;
use crate::tree_matrix::TreeInverse;

/// `J^-1`, or the inverse of `J = M + (c_D D + c_K K) (1 + s M^-1 K)`.
#[derive(Clone, Debug)]
pub(crate) struct IterationMatrix {
    pub(crate) form: MatrixForm,
    /// Factor s, if any.
    s: Option<f64>,
}

/// Form of the matrix.
#[derive(Clone, Debug)]
pub(crate) enum MatrixForm {
    /// Dense inverse; the caller applies s.
    Dense(DenseInverse),
    /// Elimination along the tree, including s.
    Tree(TreeInverse),
}

/// `(M + Z)^-1 B`; after reading, `Z = c_D D + c_K K` and `B = 1`. All are n × n; M and Z are
/// symmetric.
#[derive(Clone, Debug)]
pub(crate) struct DenseInverse {
    /// M; after the inversion the factor.
    pub(crate) M: DMatrix<f64>,
    pub(crate) Z: DMatrix<f64>,
    /// Bᵀ; after the inversion the inverse.
    pub(crate) inverse: DMatrix<f64>,
    product: DVector<f64>,
}

impl DenseInverse {
    /// Allocates matrices for n coordinates.
    fn new(n: usize) -> Self {
        let square = || DMatrix::zeros(n, n);
        Self { M: square(), Z: square(), inverse: square(), product: DVector::zeros(n) }
    }

    fn read(&mut self, system: &mut impl SecondOrderSystem, c_D: f64, c_K: f64) {
        system.mass(&mut self.M);
        system.damping_and_stiffness(c_D, c_K, &mut self.Z);
        self.inverse.fill_with_identity();
    }

    fn invert(&mut self, t: f64) -> Result<(), StepError> {
        self.M += &self.Z;
        let n = self.M.nrows();
        match solve_in_place(self.M.as_mut_slice(), self.inverse.as_mut_slice(), n) {
            true => Ok(()),
            false => Err(StepError::Singular { matrix: "iteration matrix", t }),
        }
    }

    fn solve(&mut self, r: &mut DVector<f64>) {
        product(self.inverse.as_slice(), r.as_slice(), self.product.as_mut_slice());
        r.copy_from(&self.product);
    }
}

impl IterationMatrix {
    /// Creates the matrix; the number of coordinates is that of the system read first.
    pub(crate) fn new() -> Self {
        Self { form: MatrixForm::Tree(TreeInverse::default()), s: None }
    }

    /// Reads M and `c_D D + c_K K` at the configuration of the last residual of the system; `s` as
    /// above.
    pub(crate) fn read(&mut self, system: &mut impl SecondOrderSystem, c_D: f64, c_K: f64, s: Option<f64>) {
        self.s = s;
        // A system whose matrices were dense once keeps dense matrices.
        if let MatrixForm::Tree(tree) = &mut self.form {
            if system.along_tree(c_D, c_K, &mut tree.matrices) {
                return;
            }
            self.form = MatrixForm::Dense(DenseInverse::new(system.dimension()));
        }
        if let MatrixForm::Dense(dense) = &mut self.form {
            dense.read(system, c_D, c_K);
        }
    }

    /// Factorises the matrix read, for [`IterationMatrix::solve`].
    ///
    /// # Errors
    /// [`StepError::Singular`] if J, or along a tree M, is not positive definite.
    pub(crate) fn invert(&mut self, t: f64) -> Result<(), StepError> {
        match &mut self.form {
            MatrixForm::Dense(dense) => dense.invert(t),
            MatrixForm::Tree(tree) => tree.factor(self.s, t),
        }
    }

    /// Replaces `r` by `d = J^-1 r`; returns `|d|`.
    pub(crate) fn solve(&mut self, r: &mut DVector<f64>) -> f64 {
        match &mut self.form {
            MatrixForm::Dense(dense) => dense.solve(r),
            MatrixForm::Tree(tree) => tree.solve(r),
        }
        dot(r.as_slice(), r.as_slice()).sqrt()
    }
}

/// Returns the storage of a factor that is no longer needed, for reuse.
pub(crate) fn storage_of(factor: &mut Option<Cholesky<f64, Dyn>>, n: usize) -> DMatrix<f64> {
    match factor.take() {
        Some(old) => old.unpack_dirty(),
        None => DMatrix::zeros(n, n),
    }
}
