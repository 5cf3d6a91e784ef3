//! Products of tall matrices with the kernels of faer.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, Spec};
use nalgebra::DMatrix;

use super::registers::clear_upper_halves;

pub(super) fn view(A: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(A.as_slice(), A.nrows(), A.ncols())
}

pub(super) fn view_mut(A: &mut DMatrix<f64>) -> MatMut<'_, f64> {
    let (rows, columns) = A.shape();
    MatMut::from_column_major_slice_mut(A.as_mut_slice(), rows, columns)
}

/// Computes `Aᵀ B`.
pub(crate) fn gram(A: &DMatrix<f64>, B: &DMatrix<f64>) -> DMatrix<f64> {
    let mut result = DMatrix::zeros(A.ncols(), B.ncols());
    matmul(view_mut(&mut result), Accum::Replace, view(A).transpose(), view(B), 1.0, Par::Seq);
    clear_upper_halves();
    result
}

/// Computes `C += factor A B`.
pub(crate) fn add_product(C: &mut DMatrix<f64>, factor: f64, A: &DMatrix<f64>, B: &DMatrix<f64>) {
    matmul(view_mut(C), Accum::Add, view(A), view(B), factor, Par::Seq);
    clear_upper_halves();
}

/// Ascending eigenvalues, and eigenvectors of a symmetric matrix; `None` if they are not finite.
///
/// The results are in memory allocated by faer, because its summation order depends on the address.
pub(super) fn symmetric_eigen(A: &DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let n = A.nrows();
    let (mut values, mut vectors) = (Diag::zeros(n), Mat::<f64>::zeros(n, n));
    let scratch = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, Spec::default());
    let mut memory = MemBuffer::try_new(scratch).ok()?;
    let stack = MemStack::new(&mut memory);
    let to = Some(vectors.as_mut());
    let found = self_adjoint_evd(view(A), values.as_mut(), to, Par::Seq, stack, Spec::default());
    clear_upper_halves();
    found.ok()?;
    let values: Vec<f64> = (0..n).map(|k| values[k]).collect();
    let vectors = DMatrix::from_fn(n, n, |i, j| vectors[(i, j)]);
    values.iter().all(|x| x.is_finite()).then_some((values, vectors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symmetric_matrix_is_made_diagonal_by_its_eigenvectors() {
        let n = 150;
        let A = DMatrix::from_fn(n, n, |i, j| ((i * j + 3 * (i + j)) % 31) as f64 / 31.0 - 0.5);
        let (values, vectors) = symmetric_eigen(&A).unwrap();
        assert!(values.is_sorted());
        let residual = (&A * &vectors - &vectors * DMatrix::from_diagonal(&values.into())).amax();
        assert!(residual < 1e-12, "{residual:e}"); // measured 7e-15
    }
}
