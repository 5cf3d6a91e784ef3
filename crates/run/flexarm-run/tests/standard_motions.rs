//! Standard motions as TCP moves.

use flexarm_run::internals::{Standard, Step};
use nalgebra::{Rotation3, Vector3};

/// Truth: plane and distances of the standard, by hand for a cube of 1 m around the origin.
#[test]
fn poses_lie_in_the_test_plane_at_four_fifths_of_the_way_to_its_corners() {
    let steps = Standard::Iso9283Poses.steps(Vector3::zeros(), 1.0, Rotation3::identity(), 2);
    let points: Vec<Vector3<f64>> = steps
        .iter()
        .filter_map(|step| match step {
            Step::To(_, X) => Some(X.translation.vector),
            Step::Rest(_) => None,
        })
        .collect();
    assert_eq!(points.len(), 11);
    for p in &points {
        assert!((p.x + p.z).abs() < 1e-15);
        assert!(p.norm() < 1e-15 || (p.norm() - 0.4 * 3f64.sqrt()).abs() < 1e-15);
    }
    assert!((points[1] - Vector3::new(-0.4, 0.4, 0.4)).norm() < 1e-15);
}
