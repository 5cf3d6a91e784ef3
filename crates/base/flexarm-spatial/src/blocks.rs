//! Matrices of one or two interfaces in 6×6 blocks: what a stiffness between two frames is turned
//! and carried with.

use nalgebra::{Matrix3, Matrix6, SMatrix};

/// Matrix over two interfaces: the six components of A, then the six of B.
pub type Matrix12 = SMatrix<f64, 12, 12>;

/// `blkdiag(R, R)`: turns both halves of a displacement into other axes at the same point.
pub fn turn6(R: &Matrix3<f64>) -> Matrix6<f64> {
    let mut result = Matrix6::zeros();
    result.fixed_view_mut::<3, 3>(0, 0).copy_from(R);
    result.fixed_view_mut::<3, 3>(3, 3).copy_from(R);
    result
}

/// `blkdiag(Q, Q)` for two interfaces.
pub fn twice(Q: &Matrix6<f64>) -> Matrix12 {
    let mut result = Matrix12::zeros();
    result.fixed_view_mut::<6, 6>(0, 0).copy_from(Q);
    result.fixed_view_mut::<6, 6>(6, 6).copy_from(Q);
    result
}

/// `(K + Kᵀ)/2`; exact where K is symmetric already.
pub fn symmetric_part(K: &Matrix6<f64>) -> Matrix6<f64> {
    (K + K.transpose()) * 0.5
}
