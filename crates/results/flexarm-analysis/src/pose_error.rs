//! The difference of two poses as a 6-vector, accurate from a picoradian to half a turn.

use flexarm_kinematics::{Pose, rotation_vector};

/// Computes the TCP error, flexible minus rigid pose, in world axes.
///
/// ```text
/// e = [ p_WT_flexible - p_WT_rigid ; rotation vector of R_flexible R_rigidᵀ ]
/// ```
///
/// * `rigid`, `flexible`: TCP poses in the world, m.
///
/// Returns three translations in m and three rotations in rad. The rotation has an absolute
/// accuracy of about 2e-16 rad, since it does not use an arc cosine.
pub fn tcp_error(rigid: &Pose, flexible: &Pose) -> [f64; 6] {
    let p = flexible.translation.vector - rigid.translation.vector;
    let R = flexible.rotation.matrix() * rigid.rotation.matrix().transpose();
    let theta = rotation_vector(&R);
    [p.x, p.y, p.z, theta.x, theta.y, theta.z]
}
