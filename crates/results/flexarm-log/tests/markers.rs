//! Markers of a recording: meshes and paths of limited size.

use std::borrow::Cow;

use flexarm_log::internals::{MAX_POINTS, Path, thinned};
use flexarm_log::{LinkMesh, TwinSample};

/// A square of `2 n²` triangles.
fn sheet(n: u32) -> LinkMesh {
    let at = |k: u32| k as f32 / n as f32;
    let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| [at(i), at(j), 0.0])).collect();
    let cell = |i: u32, j: u32| {
        let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| i * (n + 1) + j);
        [[a, b, c], [a, c, d]]
    };
    let triangles = (0..n).flat_map(|i| (0..n).flat_map(move |j| cell(i, j))).collect();
    LinkMesh { link: 0, name: "sheet".into(), positions, normals: Vec::new(), triangles, color: [1.0; 4], file: None }
}

#[test]
fn large_meshes_become_coarse_and_keep_their_extent_and_small_ones_stay() {
    let mesh = sheet(100);
    assert!(matches!(thinned(&mesh, 20_000), Cow::Borrowed(_)));
    let coarse = thinned(&mesh, 2_000);
    assert!((1_000..=2_000).contains(&coarse.triangles.len()), "{}", coarse.triangles.len());
    for c in 0..2 {
        let used = || coarse.triangles.iter().flatten().map(|k| coarse.positions[*k as usize][c]);
        assert!(used().fold(1.0, f32::min) == 0.0 && used().fold(0.0, f32::max) > 0.95);
    }
}

#[test]
fn a_path_keeps_its_first_and_last_point_however_long_it_is() {
    let mut path = Path::default();
    for k in 0..12_345_u32 {
        let X_WT = flexarm_kinematics::Pose::translation(f64::from(k), 0.0, 0.0);
        path.push(&TwinSample { X_WT, ..TwinSample::default() });
        let points = path.points();
        assert!(points.len() <= MAX_POINTS);
        assert_eq!((points[0][0], points[points.len() - 1][0]), (0.0, k as f32));
    }
    assert!(path.points().len() > MAX_POINTS / 2);
}
