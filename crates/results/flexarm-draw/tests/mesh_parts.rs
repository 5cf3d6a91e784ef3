//! Parts of mesh pictures: views, numbers, visibility, rasterisation.

use flexarm_draw::internals::{
    LinkAxes, cover, displacement, displacements, is_visible, position, prism, rotations, round_below, side_of_worst,
};
use flexarm_draw::mesh_picture::{StressPicture, View, stress_sheet};
use nalgebra::Vector3;

#[test]
fn the_longest_extent_of_a_link_lies_across_the_picture_with_a_on_the_left() {
    let points: Vec<_> =
        (0..100).map(|k| Vector3::new(0.2 * f64::from(k % 3), 0.05 * f64::from(k % 2), 0.01 * f64::from(k))).collect();
    let axes = LinkAxes::new(&points, &Vector3::new(0.1, 0.0, -1.0));
    assert_eq!((axes.along, axes.across), (-Vector3::z(), Vector3::x()));
    let view = View::fit(axes.viewpoint(0.4, 0.5), axes.along, points.into_iter(), [0.0, 0.0, 400.0, 300.0]);
    let [a, b] = [Vector3::z(), Vector3::zeros()].map(|p| view.project(&p));
    assert!(a[0] < b[0] - 300.0, "{a:?} {b:?}");
    assert!((view.right.cross(&view.up) - view.toward).norm() < 1e-12);
}

#[test]
fn numbers_read_as_on_a_drawing() {
    assert_eq!(displacement(0.000359), "0.359 mm");
    assert_eq!(displacement(-4.2e-5), "-42.0 µm");
    assert_eq!(displacements(&Vector3::new(1e-5, -2.5e-3, -1e-9), 1e-9), "(0.01, -2.50, 0.00) mm");
    assert_eq!(rotations(&Vector3::new(0.0, 1e-16, 0.0), 1e-12), "0");
    assert_eq!(position(&Vector3::new(0.04, -0.11, 1.1)), "(40, -110, 1100) mm");
    assert_eq!([round_below(0.27), round_below(0.5), round_below(1.9)], [0.2, 0.5, 1.0]);
}

/// The worst node of a box is seen on the first panel, and the end of the scale is its stress.
#[test]
fn the_worst_place_is_on_the_first_side() {
    let corner = |k: u32| {
        let bit = |b: u32| f64::from(k >> b & 1);
        Vector3::new(bit(0), 0.2 * bit(1), 0.1 * bit(2))
    };
    let positions: Vec<Vector3<f64>> = (0..8).map(corner).collect();
    // z = 0.1 and z = 0 faces of the box.
    let triangles = [[4, 5, 7], [4, 7, 6], [0, 3, 1], [0, 2, 3]];
    let stress = [1e6, 2e6, 3e6, 4e6, 5e6, 6e6, 7e6, 8e6];
    let picture = StressPicture {
        link: "box",
        remark: "",
        note: "",
        positions: &positions,
        triangles: &triangles,
        stress: &stress,
        worst: &[7, 4],
        along: Vector3::x(),
    };
    let axes = LinkAxes::new(&positions, &Vector3::x());
    assert!(side_of_worst(&picture, &axes).z > 0.9);
    let seen = [7, 4, 0].map(|node| is_visible(&picture, node, &Vector3::new(0.3, 0.05, 1.0).normalize()));
    assert_eq!(seen, [true, true, false]);
    let image = stress_sheet(&picture);
    assert!(!image.to_png().unwrap().is_empty());
    assert_eq!(image.to_png().unwrap(), stress_sheet(&picture).to_png().unwrap());
}

/// Truth: n/2 r² sin(2π/n) l, against the sum of tetrahedra, which is right only if every side
/// faces outward.
#[test]
fn a_rod_encloses_the_area_of_its_polygon_times_its_length() {
    let (from, to, radius, n) = (Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.5, 0.4, 0.9), 0.07, 8);
    let (positions, triangles) = prism([&from, &to], radius, n, 0.0).unwrap();
    let tetrahedron = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
        a.dot(&b.cross(&c)) / 6.0
    };
    let volume: f64 = triangles.iter().map(tetrahedron).sum();
    let area = 0.5 * f64::from(n) * radius * radius * (std::f64::consts::TAU / f64::from(n)).sin();
    let error = volume / (area * (to - from).norm()) - 1.0;
    assert!(error.abs() < 1e-13, "{error:e}"); // measured 2e-16
    assert_eq!(prism([&from, &from], radius, n, 1e-6), None);
}

/// Truth: the weighted corners give the sample; by Pick's theorem a triangle of area 6 with 8
/// samples on its sides has 3 inside.
#[test]
fn a_triangle_covers_the_samples_inside_and_on_its_sides_wherever_it_lies() {
    let size = [8, 6];
    let triangles = [
        ([[1.5, 1.5, 0.0], [5.5, 1.5, 0.0], [1.5, 4.5, 0.0]], 11),
        ([[1.5, 4.5, 0.0], [5.5, 1.5, 0.0], [1.5, 1.5, 0.0]], 11),
        ([[-20.0, -20.0, 0.0], [40.0, -20.0, 0.0], [-20.0, 40.0, 0.0]], 48),
        ([[9.0, 1.0, 0.0], [12.0, 1.0, 0.0], [9.0, 5.0, 0.0]], 0),
        ([[-9.0, -1.0, 0.0], [-2.0, -1.0, 0.0], [-9.0, -5.0, 0.0]], 0),
        ([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [3.0, 3.0, 0.0]], 0),
    ];
    for (corners, expected) in triangles {
        let mut count = 0;
        cover(corners, size, |column, row, weights| {
            let mean = [0, 1].map(|k| corners.iter().zip(weights).map(|(p, weight)| weight * p[k]).sum::<f64>());
            assert!((mean[0] - (column as f64 + 0.5)).abs() < 1e-12 && (mean[1] - (row as f64 + 0.5)).abs() < 1e-12);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12 && column < size[0] && row < size[1]);
            count += 1;
        });
        assert_eq!(count, expected, "{corners:?}");
    }
}
