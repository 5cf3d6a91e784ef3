//! Products of tall matrices, through faer's kernels.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::DMatrix;

use super::registers::clear_upper_halves;

pub(super) fn view(A: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(A.as_slice(), A.nrows(), A.ncols())
}

pub(super) fn view_mut(A: &mut DMatrix<f64>) -> MatMut<'_, f64> {
    let (rows, columns) = A.shape();
    MatMut::from_column_major_slice_mut(A.as_mut_slice(), rows, columns)
}

/// `Aᵀ B`.
pub(crate) fn gram(A: &DMatrix<f64>, B: &DMatrix<f64>) -> DMatrix<f64> {
    let mut result = DMatrix::zeros(A.ncols(), B.ncols());
    matmul(view_mut(&mut result), Accum::Replace, view(A).transpose(), view(B), 1.0, Par::Seq);
    clear_upper_halves();
    result
}

/// `C += factor A B`.
pub(crate) fn add_product(C: &mut DMatrix<f64>, factor: f64, A: &DMatrix<f64>, B: &DMatrix<f64>) {
    matmul(view_mut(C), Accum::Add, view(A), view(B), factor, Par::Seq);
    clear_upper_halves();
}

/// Eigenvalues, ascending, and eigenvectors of a symmetric matrix; `None` if it is not finite.
pub(super) fn symmetric_eigen(A: &DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let eigen = view(A).self_adjoint_eigen(faer::Side::Lower);
    clear_upper_halves();
    let eigen = eigen.ok()?;
    let (S, U) = (eigen.S(), eigen.U());
    let values: Vec<f64> = (0..A.nrows()).map(|k| S[k]).collect();
    let vectors = DMatrix::from_fn(A.nrows(), A.nrows(), |i, j| U[(i, j)]);
    values.iter().all(|x| x.is_finite()).then_some((values, vectors))
}
