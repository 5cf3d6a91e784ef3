//! Cross-sections of meshes against closed forms.

use flexarm_kinematics::Pose;
use flexarm_urdf::{CrossSection, Geometry, TriangleMesh, cross_section};
use nalgebra::{Rotation3, Translation3, Vector3};

fn section_of(meshes: &[TriangleMesh], at: f64, X_LM: &Pose) -> CrossSection {
    // Plane normal to x at that place, in the frame M of the meshes.
    let X_MS = Pose::from_parts(Translation3::new(at, 0.0, 0.0), Rotation3::identity());
    let placed: Vec<_> = meshes.iter().map(|mesh| mesh.clone().transformed(X_LM)).collect();
    cross_section(&placed, &(X_LM * X_MS)).unwrap()
}

fn tilted() -> Pose {
    Pose::from_parts(Translation3::new(0.3, -0.2, 0.5), Rotation3::from_euler_angles(0.4, -0.7, 1.1))
}

/// Truth: b h, b h³/12. Bounds: mesh positions have seven digits.
#[test]
fn the_section_of_a_box_has_the_area_and_the_moments_of_a_rectangle() {
    let (b, h) = (0.24, 0.1);
    let mesh = Geometry::Box { size: Vector3::new(0.8, b, h) }.triangles().unwrap();
    let section = section_of(&[mesh], 0.13, &tilted());
    let errors = [
        section.area / (b * h) - 1.0,
        section.second_moments[(0, 0)] / (h * b.powi(3) / 12.0) - 1.0,
        section.second_moments[(1, 1)] / (b * h.powi(3) / 12.0) - 1.0,
        section.second_moments[(0, 1)] / (b * h.powi(3) / 12.0),
        section.perimeter / (2.0 * (b + h)) - 1.0,
        section.centroid.norm(),
    ];
    assert!(errors.iter().all(|e| e.abs() < 3e-6), "{errors:?}");
    assert!(section.is_closed);
}

/// Truth: the outer polygon of 48 corners, closed form n/2 r² sin(2π/n).
#[test]
fn a_hole_does_not_count_and_an_open_mesh_counts_as_its_hull() {
    let turn = Pose::from_parts(
        Translation3::identity(),
        Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2),
    );
    let along_x = |radius: f64| Geometry::Cylinder { radius, length: 1.0 }.triangles().unwrap().transformed(&turn);
    let area = 24.0 * 0.1f64.powi(2) * (std::f64::consts::TAU / 48.0).sin();
    let hollow = section_of(&[along_x(0.1), along_x(0.08)], 0.2, &tilted());
    assert!((hollow.area / area - 1.0).abs() < 3e-6, "{} {area}", hollow.area);
    assert!(hollow.is_closed);
    let mut open = along_x(0.1);
    // A tenth of the mantle's triangles is missing.
    open.triangles.retain(|t| t.iter().all(|&i| open.positions[i as usize][1] < 0.09));
    let open = section_of(&[open], 0.2, &tilted());
    assert!(!open.is_closed);
    assert!(open.area < area && open.area > 0.9 * area, "{} {area}", open.area);
}

/// Truth: Steiner's rule by hand for two squares side by side.
#[test]
fn parts_beside_each_other_add_up_and_parts_in_each_other_count_once() {
    let cube = Geometry::Box { size: Vector3::new(1.0, 0.1, 0.1) }.triangles().unwrap();
    let moved =
        |y: f64| cube.clone().transformed(&Pose::from_parts(Translation3::new(0.0, y, 0.0), Rotation3::identity()));
    let apart = section_of(&[moved(-0.2), moved(0.2)], 0.0, &Pose::identity());
    let expected = 2.0 * (0.1f64.powi(4) / 12.0 + 0.01 * 0.04);
    assert!((apart.second_moments[(0, 0)] / expected - 1.0).abs() < 1e-6);
    assert!((apart.area / 0.02 - 1.0).abs() < 1e-6);
    let overlapping = section_of(&[moved(-0.03), moved(0.03)], 0.0, &Pose::identity());
    assert!((overlapping.area / 0.016 - 1.0).abs() < 1e-6, "{}", overlapping.area);
    let beyond = Pose::from_parts(Translation3::new(0.7, 0.0, 0.0), Rotation3::identity());
    assert_eq!(cross_section(std::slice::from_ref(&cube), &beyond), None);
}
