//! Places and directions of a map.

use flexarm_map::internals::{best_box, iso_surface, largest_gain, round_number};
use flexarm_map::{Grid, ToolDirections};
use nalgebra::{Matrix3, Rotation3, Vector3, matrix};
use std::collections::HashMap;

#[test]
fn a_grid_of_a_box_of_whole_spacings_has_both_its_ends() {
    let grid = Grid::within([[-1.0, 0.0, 0.5], [1.0, 0.3, 0.5]], 0.1).unwrap();
    assert_eq!(grid.count, [21, 4, 1]);
    assert_eq!(grid.place(0), [-1.0, 0.0, 0.5]);
    let last = grid.place(grid.places() - 1);
    assert!((last[0] - 1.0).abs() < 1e-12 && (last[1] - 0.3).abs() < 1e-12 && last[2] == 0.5);
    assert_eq!(grid.index(21 * 4 - 1), [20, 3, 0]);
}

/// Truth: directions are uniform on a cap if the area within each is proportional to its
/// number, `1 - cos(angle) = part (1 - cos(cone))`.
#[test]
fn directions_of_a_cone_lie_evenly_within_it() {
    let cone = 0.6;
    let tool = ToolDirections { axis: [0.3, -0.2, -2.0], cone_rad: cone, tilts: 50, ..ToolDirections::default() };
    let rotations = tool.rotations().unwrap();
    let axis = Vector3::from(tool.axis).normalize();
    let mut mean = Vector3::zeros();
    for (k, R) in rotations.iter().enumerate() {
        assert!((R.matrix() * R.matrix().transpose() - Matrix3::identity()).amax() < 1e-14);
        assert!((R.matrix().determinant() - 1.0).abs() < 1e-14);
        let z = R * Vector3::z();
        let share = (1.0 - z.dot(&axis)) / (1.0 - cone.cos());
        assert!((share - k as f64 / 49.0).abs() < 1e-12, "{share}");
        mean += z / 50.0;
    }
    // The centroid of a cap is on its axis at (1 + cos)/2.
    let centre = axis * 0.5 * (1.0 + cone.cos());
    assert!((mean - centre).norm() < 0.02, "{}", (mean - centre).norm());
}

#[test]
fn a_tool_that_points_down_has_its_x_axis_along_world_x() {
    let R = ToolDirections::default().rotations().unwrap()[0];
    assert!((R * Vector3::z() + Vector3::z()).norm() < 1e-15);
    assert!((R * Vector3::x() - Vector3::x()).norm() < 1e-15);
    let R = ToolDirections { axis: [1.0, 0.0, 0.0], ..ToolDirections::default() }.rotations().unwrap()[0];
    assert!((R * Vector3::z() - Vector3::x()).norm() < 1e-15);
    assert!((R.matrix().determinant() - 1.0).abs() < 1e-15);
}

#[test]
fn numbers_are_rounded_to_one_two_and_five() {
    for (x, round) in [(0.093, 0.1), (0.17, 0.2), (0.04, 0.05), (3.4, 2.0), (8.0, 10.0)] {
        assert!((round_number(x) / round - 1.0).abs() < 1e-12, "{x}: {}", round_number(x));
    }
}

/// Truth: brute force over all boxes.
#[test]
fn the_best_box_is_the_one_that_trying_all_of_them_finds() {
    let grid = Grid { lower: [-1.0, 2.0, 0.5], spacing_m: 0.1, count: [9, 7, 5] };
    let cost: Vec<f64> = (0..grid.places())
        .map(|k| if k % 41 == 7 { f64::INFINITY } else { ((k as f64 * 0.618).fract() * 997.0).sin().abs() + 0.1 })
        .collect();
    for (size, window) in [([0.2, 0.1, 0.2], [3, 2, 3]), ([0.0, 0.35, 0.1], [1, 5, 2]), ([0.11, 0.0, 0.0], [3, 1, 1])] {
        let found = best_box(&grid, &cost, size).unwrap();
        let mut best = f64::INFINITY;
        for z in 0..=grid.count[2] - window[2] {
            for y in 0..=grid.count[1] - window[1] {
                for x in 0..=grid.count[0] - window[0] {
                    let mut worst = 0.0_f64;
                    for k in 0..window.iter().product::<usize>() {
                        let (i, j, l) = (k % window[0], k / window[0] % window[1], k / (window[0] * window[1]));
                        worst = worst.max(cost[(x + i) + 9 * ((y + j) + 7 * (z + l))]);
                    }
                    best = best.min(worst);
                }
            }
        }
        assert_eq!(found.worst, best);
        assert_eq!(found.points, window.iter().product::<usize>());
    }
    assert_eq!(best_box(&grid, &cost, [2.0, 0.1, 0.1]), None, "larger than the grid");
    assert_eq!(best_box(&grid, &vec![f64::INFINITY; grid.places()], [0.0; 3]), None, "nothing is reached");
}

/// Truth: `C = R diag(3, 1, 2) Rᵀ` has the largest gain 3 along the first column of R; that of
/// `u vᵀ` is `|u| |v|` along v.
#[test]
fn the_worst_direction_is_that_of_the_largest_singular_value() {
    let R = Rotation3::from_euler_angles(0.3, -1.1, 2.0).into_inner();
    let (gain, v) = largest_gain(&(R * Matrix3::from_diagonal(&Vector3::new(3e-7, 1e-7, 2e-7)) * R.transpose()));
    assert!((gain / 3e-7 - 1.0).abs() < 1e-14, "{gain}");
    assert!(v.cross(&R.column(0)).norm() < 1e-13);
    let (u, w) = (matrix![1.0; -2.0; 0.5], matrix![0.2; 0.1; -0.7]);
    let (gain, v) = largest_gain(&(u * w.transpose()));
    assert!((gain / (u.norm() * w.norm()) - 1.0).abs() < 1e-14);
    assert!(v.cross(&w.normalize()).norm() < 1e-13 && v[v.iamax()] > 0.0);
    assert_eq!(largest_gain(&Matrix3::zeros()).0, 0.0);
}

/// Truth: a sphere of radius r has the area 4 π r²; each edge of a closed surface belongs to
/// two triangles, and vertices minus edges plus triangles are two (Euler).
#[test]
fn the_surface_of_equal_distance_is_a_closed_sphere_of_the_right_area() {
    let grid = Grid { lower: [-1.0; 3], spacing_m: 0.05, count: [41; 3] };
    let radius = |k: usize| grid.place(k).iter().map(|x| x * x).sum::<f64>().sqrt();
    let values: Vec<f64> = (0..grid.places()).map(radius).collect();
    let surface = iso_surface(&grid, &values, 0.8003);
    let p = |k: u32| nalgebra::Vector3::from(surface.places[k as usize].map(f64::from));
    let area: f64 = surface.triangles.iter().map(|&[a, b, c]| 0.5 * (p(b) - p(a)).cross(&(p(c) - p(a))).norm()).sum();
    let whole = 4.0 * std::f64::consts::PI * 0.8003_f64.powi(2);
    assert!((area / whole - 1.0).abs() < 2e-3, "{}", area / whole);
    let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
    for [a, b, c] in &surface.triangles {
        for (i, j) in [(a, b), (b, c), (c, a)] {
            *edges.entry((*i.min(j), *i.max(j))).or_default() += 1;
        }
    }
    assert!(edges.values().all(|n| *n == 2));
    assert_eq!(surface.places.len() + surface.triangles.len() - edges.len(), 2);
}

#[test]
fn places_that_are_not_reached_have_no_surface() {
    let grid = Grid { lower: [0.0; 3], spacing_m: 1.0, count: [2; 3] };
    let mut values = vec![0.0; 8];
    values[7] = 1.0;
    assert_eq!(iso_surface(&grid, &values, 0.5).triangles.len(), 6);
    values[0] = f64::NAN;
    assert!(iso_surface(&grid, &values, 0.5).triangles.is_empty());
}
