//! Differences of two poses.

use flexarm_analysis::*;
use nalgebra::{Rotation3, Translation3, Vector3};
use proptest::prelude::*;

/// Truth: a rotation by 1e-9 rad is the identity plus a skew-symmetric matrix, up to 5e-19.
#[test]
fn a_nanoradian_is_resolved_to_seven_digits() {
    let R_rigid = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
    let theta = Vector3::new(3e-10, -9e-10, 2e-10);
    let R_flexible = Rotation3::new(theta) * R_rigid;
    let rigid = Pose::from_parts(Translation3::new(1.0, 2.0, 3.0), R_rigid);
    let flexible = Pose::from_parts(Translation3::new(1.0, 2.0 + 1e-6, 3.0), R_flexible);
    let error = tcp_error(&rigid, &flexible);
    for i in 0..3 {
        assert!((error[3 + i] - theta[i]).abs() < 1e-15); // measured 3.9e-17
    }
    assert!((error[1] - 1e-6).abs() < 1e-15); // measured 1.4e-16
    assert_eq!((error[0], error[2]), (0.0, 0.0));
}

proptest! {
    #[test]
    fn the_rotation_vector_gives_the_rotation_back_up_to_half_a_turn(
        axis in prop::array::uniform3(-1.0..1.0_f64).prop_filter("an axis", |a| Vector3::from(*a).norm() > 0.1),
        angle in prop_oneof![
            0.0..std::f64::consts::PI,
            0.0..1e-6_f64,
            (0.0..1e-6_f64).prop_map(|d| std::f64::consts::PI - d),
        ],
    ) {
        let theta = Vector3::from(axis).normalize() * angle;
        let found = rotation_vector(Rotation3::new(theta).matrix());
        // Within 1e-8 of half a turn, rounding may flip the sign of the axis.
        let distance = (found - theta).norm().min(if angle > 3.14159264 { (found + theta).norm() } else { f64::MAX });
        prop_assert!(distance < 1e-14); // measured 9.4e-16
    }
}
