//! Bent links against beam theory.

use flexarm_draw::{BendLine, BentMesh};
use flexarm_sample::{BendInfo, LinkMesh};
use flexarm_spatial::Pose;
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Number of slabs into which the surface of a link is cut.
const SLABS: f64 = 12.0;

fn bend(places: &[[f64; 3]]) -> BendInfo {
    let X_LS = places.iter().map(|p| Pose::from(Translation3::from(Vector3::from(*p)))).collect();
    BendInfo { link: 0, X_LS, carries: Vec::new() }
}

fn plate() -> LinkMesh {
    LinkMesh {
        link: 0,
        name: "plate".into(),
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.0, 0.1, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        color: [1.0; 4],
        file: None,
    }
}

fn pose(u: [f64; 3], angle: [f64; 3]) -> Pose {
    let turn = Rotation3::from_scaled_axis(Vector3::from(angle));
    Pose::from_parts(Translation3::from(Vector3::from(u)), turn)
}

/// Truth: v(x) = F (3 L x^2 - x^3) / (6 E I) for a force at the end of a clamped beam.
#[test]
fn a_cantilever_with_a_force_at_its_end_is_drawn_as_its_deflection_line() {
    let L = 1.5;
    let line = BendLine::new(&bend(&[[0.2, 0.0, 0.0], [0.2 + L, 0.0, 0.0]])).unwrap();
    let v_end = 1e-4; // small, so that linear theory holds
    let slope_end = 1.5 * v_end / L;
    let moved = [pose([0.2, 0.0, 0.0], [0.0; 3]), pose([0.2 + L, v_end, 0.0], [0.0, 0.0, slope_end])];
    for k in 0..=10 {
        let x = 0.1 * f64::from(k);
        let truth = v_end * (3.0 * x * x - x * x * x) / 2.0;
        let p = line.bent(&moved).deformed(&Vector3::new(0.2 + L * x, 0.0, 0.0));
        assert!((p.y - truth).abs() < 1e-15, "at {x}: {} beside {truth}", p.y);
    }
}

/// Truth: the motion of the section, applied to the undeformed position.
#[test]
fn a_point_of_the_line_is_where_its_section_takes_it() {
    let bend = bend(&[[0.0, 0.1, 0.0], [0.5, 0.1, 0.2], [1.0, 0.0, 0.3]]);
    let line = BendLine::new(&bend).unwrap();
    let moved: Vec<Pose> = (0..3)
        .map(|k| {
            let [x, y, z] = bend.X_LS[k].translation.vector.into();
            let part = |c: usize| ((3 * k + c) as f64).sin();
            pose([x + 0.01 * part(1), y + 0.02 * part(2), z], [0.1 * part(3), 0.2 * part(4), 0.1 * part(5)])
        })
        .collect();
    let bent = line.bent(&moved);
    for s in [-0.1, 0.0, 0.1, 0.4, 0.7, line.length(), 1.5] {
        let error = (bent.point(s) - bent.section(s) * line.point(s)).norm();
        assert!(error < 1e-15, "{s}: {error:e}");
    }
}

/// Truth: the part beyond the far interface moves and rotates with it as a rigid body, exactly.
#[test]
fn the_surface_beyond_the_far_interface_is_rigid_with_it() {
    let line = BendLine::new(&bend(&[[0.0; 3], [0.5, 0.0, 0.1], [1.0, 0.0, 0.2]])).unwrap();
    let far = pose([1.01, 0.03, 0.25], [0.1, -0.2, 0.3]);
    let moved = [pose([0.0; 3], [0.0; 3]), pose([0.5, 0.01, 0.12], [0.05, -0.1, 0.1]), far];
    for p in [[1.0, 0.0, 0.2], [1.2, 0.1, 0.3], [1.1, -0.4, 0.9]].map(Vector3::from) {
        let truth = far * nalgebra::Point3::from(p - Vector3::new(1.0, 0.0, 0.2));
        assert!((line.bent(&moved).deformed(&p) - truth.coords).norm() < 1e-12);
    }
}

/// Truth: a rigid motion of all stations moves every point rigidly, also between the stations,
/// for small angles.
#[test]
fn a_rigid_motion_of_the_stations_bends_nothing() {
    let places = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [1.0, 0.0, 0.0]];
    let line = BendLine::new(&bend(&places)).unwrap();
    let angle = Vector3::new(2e-4, -1e-4, 3e-4);
    let X = Isometry3::from_parts(Translation3::new(0.01, 0.02, -0.03), UnitQuaternion::new(angle));
    let moved = places.map(|p| {
        let at = X * nalgebra::Point3::from(Vector3::from(p));
        pose(at.coords.into(), angle.into())
    });
    for p in [[0.1, 0.2, 0.0], [0.5, -0.1, 0.2], [0.9, 0.0, -0.1]].map(Vector3::from) {
        let truth = X * nalgebra::Point3::from(p);
        let error = (line.bent(&moved).deformed(&p) - truth.coords).norm();
        assert!(error < 1e-7, "{error:e}"); // second order in the angle
    }
}

/// Truth: the deflection line at every corner; interpolated between sections 1/48 of the link
/// apart.
#[test]
fn the_corners_of_a_bent_surface_follow_the_line_closely_and_its_ends_exactly() {
    let bend = bend(&[[0.0; 3], [1.0, 0.0, 0.0]]);
    let positions: Vec<[f32; 3]> = (0..=37).map(|k| [-0.1 + k as f32 * 1.2 / 37.0, 0.05, 0.02]).collect();
    let triangles = (0..36).map(|k| [k, k + 1, k + 1]).collect();
    let mesh = LinkMesh { positions, triangles, ..plate() };
    let bent = BentMesh::new(&mesh, &bend).unwrap();
    let moved = [pose([0.0; 3], [0.0; 3]), pose([1.0, 0.1, -0.05], [0.2, 0.1, 0.15])];
    for (p, found) in bent.mesh.positions.iter().zip(bent.positions(&moved)) {
        let truth = bent.line().bent(&moved).deformed(&Vector3::from(p.map(f64::from)));
        let error = (Vector3::from(found.map(f64::from)) - truth).norm();
        let bound = if p[0] >= 1.0 || p[0] <= 0.0 { 2e-7 } else { 5e-5 };
        assert!(error < bound, "at {}: {error:e}", p[0]); // single precision; 1e-4 of the deflection between
    }
}

#[test]
fn a_box_is_cut_without_cracks_until_it_can_bend() {
    // Two triangles, one metre long: after cutting, every inner edge belongs to two triangles.
    let bent = BentMesh::new(&plate(), &bend(&[[0.0; 3], [1.0, 0.0, 0.0]])).unwrap();
    let area = |mesh: &LinkMesh| -> f32 {
        let p = |k: u32| Vector3::from(mesh.positions[k as usize]);
        mesh.triangles.iter().map(|[a, b, c]| 0.5 * (p(*b) - p(*a)).cross(&(p(*c) - p(*a))).norm()).sum()
    };
    assert!((area(&bent.mesh) - 0.1).abs() < 1e-6, "the area is kept");
    assert_eq!(bent.mesh.normals.len(), bent.mesh.positions.len());
    let mut edges = std::collections::HashMap::new();
    for t in &bent.mesh.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
            let [p, q] = [a, b].map(|k| bent.mesh.positions[k as usize][0]);
            assert!((p - q).abs() <= 1.0 / SLABS as f32 + 1e-6, "an edge spans {}", (p - q).abs());
        }
    }
    let rim = |(a, b): &(u32, u32)| {
        let [p, q] = [*a, *b].map(|k| bent.mesh.positions[k as usize]);
        (0..2).any(|c| p[c] == q[c] && [0.0, [1.0, 0.1][c]].contains(&p[c]))
    };
    assert!(edges.iter().all(|(edge, count)| *count == if rim(edge) { 1 } else { 2 }));
}
