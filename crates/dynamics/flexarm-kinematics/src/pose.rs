//! Poses of any scalar type from their parts.

use flexarm_spatial::{Pose, Real};
use nalgebra::{Isometry, Matrix3, Rotation3, Translation3, Vector3};

/// Identity pose.
#[inline(always)]
pub(crate) fn identity<T: Real>() -> Pose<T> {
    pose(Matrix3::identity(), Vector3::zeros())
}

/// Pose `X_AB` from rotation matrix `R_AB` and translation `p_AoBo_A`.
#[inline(always)]
pub(crate) fn pose<T: Real>(R: Matrix3<T>, p: Vector3<T>) -> Pose<T> {
    Isometry { rotation: Rotation3::from_matrix_unchecked(R), translation: Translation3 { vector: p } }
}
