//! Bent links as slabs.

use flexarm_draw::BentMesh;
use flexarm_kinematics::Pose;
use flexarm_log::internals::{BentLink, INNER};
use flexarm_log::{BendInfo, LinkMesh, TwinSample};
use nalgebra::{Rotation3, Translation3, Vector3};

fn pose(at: [f64; 3], angle: [f64; 3]) -> Pose {
    Pose::from_parts(Translation3::from(Vector3::from(at)), Rotation3::from_scaled_axis(Vector3::from(angle)))
}

fn link() -> (BentLink, BendInfo) {
    let X_LS = vec![pose([0.1, 0.0, 0.2], [0.0; 3]), pose([0.1, 0.3, 1.0], [0.0; 3])];
    let bend = BendInfo { link: 0, X_LS, carries: Vec::new() };
    (BentLink::new(&bend, 0).unwrap(), bend)
}

/// Identity: without deflection, every slab frame is at the link frame.
#[test]
fn slabs_of_an_undeformed_link_are_at_the_link() {
    let (link, bend) = link();
    let twin = TwinSample { X_WL: vec![Pose::identity()], X_WS: bend.X_LS.clone(), ..TwinSample::default() };
    assert_eq!(link.poses(&twin).count(), INNER + 2);
    for X in link.poses(&twin) {
        assert!((X.to_homogeneous() - nalgebra::Matrix4::identity()).norm() < 1e-14); // measured 3e-16
    }
}

/// Truth: the bent surface evaluated point by point, at points of the middle sections.
#[test]
fn a_slab_moves_with_the_section_in_its_middle() {
    let (link, _) = link();
    let moved = vec![pose([0.11, 0.0, 0.2], [0.0, 0.02, 0.0]), pose([0.12, 0.33, 0.98], [0.1, -0.05, 0.2])];
    let twin = TwinSample { X_WL: vec![Pose::identity()], X_WS: moved.clone(), ..TwinSample::default() };
    for (X, middle) in link.poses(&twin).zip(&link.middles) {
        for point in [*middle, middle + 0.2 * link.across[0] - 0.1 * link.across[1]] {
            let drawn = X * nalgebra::Point3::from(point);
            assert!((drawn.coords - link.line.bent(&moved).deformed(&point)).norm() < 1e-14); // measured 2e-16
        }
    }
}

/// Truth: every triangle of the cut surface is in a slab, and none is far from its slab.
#[test]
fn slabs_together_hold_the_surface() {
    let (link, bend) = link();
    let mesh = LinkMesh {
        link: 0,
        name: "sheet".into(),
        positions: vec![[0.1, -0.2, 0.0], [0.1, 0.5, 1.4], [0.2, 0.5, 1.4], [0.2, -0.2, 0.0]],
        normals: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        color: [1.0; 4],
        file: None,
    };
    let slabs = link.slabs(&mesh);
    let cut = BentMesh::new(&mesh, &bend).unwrap().mesh;
    let drawn: std::collections::BTreeSet<_> = slabs.iter().flatten().map(|corner| corner.map(f32::to_bits)).collect();
    assert!(cut.positions.iter().all(|corner| drawn.contains(&corner.map(f32::to_bits))));
    let total = slabs.iter().map(Vec::len).sum::<usize>() / 3;
    assert!((cut.triangles.len()..3 * cut.triangles.len()).contains(&total), "{total}");
    for (k, slab) in slabs.iter().enumerate().skip(1).take(INNER) {
        for triangle in slab.chunks(3) {
            let place = |c: &[f32; 3]| link.line.place(&Vector3::from(c.map(f64::from))) * INNER as f64;
            let places = triangle.iter().map(|corner| place(corner) / link.line.length());
            let low = places.clone().fold(f64::INFINITY, f64::min);
            let high = places.fold(f64::NEG_INFINITY, f64::max);
            assert!(low < k as f64 && high > k as f64 - 1.0, "slab {k} has a triangle from {low} to {high}");
        }
    }
}
