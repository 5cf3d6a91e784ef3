//! The little spatial algebra that a reduced link needs: poses, `Ad` and turned blocks.
//!
//! Twists, displacements and wrenches are linear first, angular second. The full algebra of moving
//! bodies belongs to the kinematics; this crate stands beside it and shares only nalgebra with it.

use nalgebra::{IsometryMatrix3, Matrix3, Matrix6, SMatrix, Vector3};

/// Pose `X_AB` of a frame B in a frame A: `p_A = X_AB * p_B`, translation in m.
pub type Pose = IsometryMatrix3<f64>;

/// Matrix over two interfaces: the six components of A, then the six of B.
pub type Matrix12 = SMatrix<f64, 12, 12>;

/// `[r]x` with `[r]x b = r × b`.
pub fn skew(r: &Vector3<f64>) -> Matrix3<f64> {
    r.cross_matrix()
}

/// `Ad_BA`, which carries a small rigid displacement (or a twist) from Ao in A to Bo in B.
///
/// ```text
/// u_B = Ad_BA u_A,   F_A = Ad_BAᵀ F_B,   Ad_BA = [[R_BA, [p]x R_BA], [0, R_BA]],   p = p_BoAo_B
/// ```
pub fn adjoint(X_BA: &Pose) -> Matrix6<f64> {
    let R_BA = X_BA.rotation.matrix();
    blocks(R_BA, &(skew(&X_BA.translation.vector) * R_BA), R_BA)
}

/// `blkdiag(R, R)`: turns both halves of a displacement into other axes at the same point.
pub fn turn6(R: &Matrix3<f64>) -> Matrix6<f64> {
    blocks(R, &Matrix3::zeros(), R)
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

fn blocks(linear: &Matrix3<f64>, coupling: &Matrix3<f64>, angular: &Matrix3<f64>) -> Matrix6<f64> {
    let mut result = Matrix6::zeros();
    result.fixed_view_mut::<3, 3>(0, 0).copy_from(linear);
    result.fixed_view_mut::<3, 3>(0, 3).copy_from(coupling);
    result.fixed_view_mut::<3, 3>(3, 3).copy_from(angular);
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Translation3, Vector6};

    /// Truth: the velocity of a point of a rigid body, `v_B = v_A + w × p_AB`, in turned axes.
    #[test]
    fn adjoint_carries_a_rigid_displacement() {
        let R_BA = Rotation3::from_euler_angles(0.3, -0.8, 1.9);
        let p_BA = Vector3::new(0.2, -0.5, 0.7);
        let u_A = Vector6::new(0.1, -0.2, 0.3, 0.4, 0.5, -0.6);
        let (v_A, w_A) = (u_A.fixed_rows::<3>(0), u_A.fixed_rows::<3>(3));

        let u_B = adjoint(&Pose::from_parts(Translation3::from(p_BA), R_BA)) * u_A;

        let v_B = R_BA * v_A + (R_BA * w_A).cross(&-p_BA);
        assert!((u_B.fixed_rows::<3>(0) - v_B).norm() < 1e-14); // measured 1e-16
        assert!((u_B.fixed_rows::<3>(3) - R_BA * w_A).norm() < 1e-15);
    }
}
