//! Rigid motions fitted to points.

use flexarm_identify::internals::rigid_fit;
use flexarm_kinematics::Pose;
use nalgebra::{Rotation3, Translation3, Vector3};

#[test]
fn a_rigid_fit_finds_a_placement_again_and_refuses_points_on_a_line() {
    let X = Pose::from_parts(Translation3::new(3.0, -1.0, 0.4), Rotation3::from_euler_angles(0.3, -1.1, 2.0));
    let from: Vec<Vector3<f64>> =
        (0..6).map(|k| Vector3::new(f64::from(k).sin(), f64::from(k * k).cos(), 0.3 * f64::from(k))).collect();
    let to: Vec<Vector3<f64>> = from.iter().map(|p| X.rotation * p + X.translation.vector).collect();
    let found = rigid_fit(&from, &to).unwrap();
    let error = (found.rotation.matrix() - X.rotation.matrix()).amax();
    assert!(error < 1e-14, "{error:e}");
    let line: Vec<Vector3<f64>> = (0..6).map(|k| Vector3::new(f64::from(k), 2.0 * f64::from(k), 1.0)).collect();
    assert!(rigid_fit(&line, &line).is_none());
}
