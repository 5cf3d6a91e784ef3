//! Surfaces of links: creases, simplification, parts.

use flexarm_sample::LinkMesh;
use nalgebra::Vector3;

fn soup(corners: &[[f32; 3]]) -> LinkMesh {
    LinkMesh {
        link: 0,
        name: "soup".into(),
        positions: corners.to_vec(),
        normals: Vec::new(),
        triangles: (0..corners.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
        color: [1.0; 4],
        file: None,
    }
}

#[test]
fn flat_neighbours_share_corners_and_edges_keep_their_own() {
    let (o, x, y, z, xy) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
    // A square of two triangles, and a perpendicular wall on its edge o-y.
    let mesh = soup(&[o, x, xy, o, xy, y, o, y, z]).with_creases();
    assert_eq!(mesh.positions.len(), 4 + 3);
    assert_eq!(mesh.triangles.len(), 3);
    assert!(mesh.normals[..4].iter().all(|n| *n == [0.0, 0.0, 1.0]));
    assert!(mesh.normals[4..].iter().all(|n| *n == [1.0, 0.0, 0.0]));
}

#[test]
fn a_simplified_surface_has_few_corners_and_the_same_extent() {
    // A wavy sheet of 2 * 60 * 60 triangles.
    let at = |i: usize, j: usize| [i as f32 / 60.0, j as f32 / 60.0, 0.05 * (i as f32 * 0.3).sin()];
    let mut corners = Vec::new();
    for (i, j) in (0..60).flat_map(|i| (0..60).map(move |j| (i, j))) {
        corners.extend([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    let mesh = soup(&corners).with_creases();
    assert_eq!(mesh.positions.len(), 61 * 61);
    let simple = mesh.clone().simplified(1000);
    assert!((300..=1000).contains(&simple.positions.len()), "{}", simple.positions.len());
    assert_eq!(simple.normals.len(), simple.positions.len());
    let area = |mesh: &LinkMesh| -> f32 {
        let p = |k: u32| Vector3::from(mesh.positions[k as usize]);
        mesh.triangles.iter().map(|[a, b, c]| 0.5 * (p(*b) - p(*a)).cross(&(p(*c) - p(*a))).norm()).sum()
    };
    assert!((area(&simple) / area(&mesh) - 1.0).abs() < 0.1, "{} beside {}", area(&simple), area(&mesh));
    assert_eq!(mesh.clone().simplified(61 * 61), mesh, "nothing is done where nothing is needed");
}

#[test]
fn a_part_has_only_its_own_corners() {
    let mesh = soup(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0; 3], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0]]);
    let part = mesh.part(|t| t[0] == 3);
    assert_eq!((part.positions.len(), part.triangles.clone()), (3, vec![[0, 1, 2]]));
    assert_eq!(part.positions[0], [5.0; 3]);
}
