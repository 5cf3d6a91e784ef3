//! 6×6 block matrices for one or two interfaces, used to rotate and shift stiffness matrices.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, Matrix3, Matrix6, OMatrix, SMatrix};

/// Matrix for two interfaces: six components of A, then six of B.
pub type Matrix12 = SMatrix<f64, 12, 12>;

/// Rotates displacements, twists and wrenches to other axes at the same point.
///
/// ```text
/// Q = [ R_AB   0   ]      u_A = Q u_B,   F_A = Q F_B,   K_A = Q K_B Qᵀ
///     [  0    R_AB ]
/// ```
/// * `R`: `R_AB`, from B axes to A axes.
///
/// Returns Q, 6×6, dimensionless. A change of point as well takes [`adjoint`](crate::adjoint).
pub fn turn6(R: &Matrix3<f64>) -> Matrix6<f64> {
    let mut result = Matrix6::zeros();
    result.fixed_view_mut::<3, 3>(0, 0).copy_from(R);
    result.fixed_view_mut::<3, 3>(3, 3).copy_from(R);
    result
}

/// `blkdiag(Q, Q)`: applies the same change of axes to the displacements of two interfaces.
///
/// * `Q`: 6×6, usually of [`turn6`].
///
/// Returns a 12×12 matrix over six components of A, then six of B.
pub fn twice(Q: &Matrix6<f64>) -> Matrix12 {
    let mut result = Matrix12::zeros();
    result.fixed_view_mut::<6, 6>(0, 0).copy_from(Q);
    result.fixed_view_mut::<6, 6>(6, 6).copy_from(Q);
    result
}

/// Symmetric part `(K + Kᵀ)/2` of a square matrix, in the unit of K.
///
/// The result is symmetric bit for bit, and equal to K if K is already symmetric.
pub fn symmetric_part<D: Dim>(K: &OMatrix<f64, D, D>) -> OMatrix<f64, D, D>
where
    DefaultAllocator: Allocator<D, D>,
{
    (K + K.transpose()) * 0.5
}
