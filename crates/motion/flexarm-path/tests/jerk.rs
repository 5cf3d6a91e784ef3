//! Minimum durations within joint velocity, acceleration and jerk limits against a nonlinear
//! program over time (`tools/golden_jerk.py`), and without jerks against TOPP-RA
//! (`tools/golden_toppra.py`).

use std::path::Path;

use flexarm_trajectory::jerk_law::{JerkBound, PathBounds, QuinticLaw, least_time_with_jerks};
use flexarm_trajectory::time_law::{Bound, Law, PathPoint, least_time};
use serde_json::Value;

fn golden(name: &str) -> Vec<Value> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/golden").join(name);
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    golden["cases"].as_array().unwrap().clone()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Velocity, acceleration and jerk limits of a joint.
type Joint = [f64; 3];

/// Bounds at a place, from three derivatives of each joint.
fn place(rates: &[[f64; 3]], joints: &[Joint]) -> PathBounds {
    let each = || rates.iter().zip(joints);
    let x_max = each().map(|(r, most)| (most[0] / r[0]).powi(2)).fold(f64::INFINITY, f64::min);
    let bounds = each().map(|(r, most)| Bound { a: r[0], b: r[1], low: -most[1], high: most[1] }).collect();
    let jerks = each().map(|(r, most)| JerkBound { a: r[0], b: 3.0 * r[1], c: r[2], most: most[2] }).collect();
    PathBounds { x_max, bounds, jerks }
}

/// Time-optimal law of a path over 0 to 1, from derivatives at a parameter of an interval between
/// stations.
fn fastest(stations: &[f64], joints: &[Joint], rates: &dyn Fn(usize, f64) -> Vec<[f64; 3]>) -> QuinticLaw {
    let last = stations.len() - 2;
    let point = |(k, s): (usize, &f64)| {
        let PathBounds { x_max, bounds, .. } = place(&rates(k.min(last), *s), joints);
        PathPoint { s: *s, x_max, bounds }
    };
    let points: Vec<PathPoint> = stations.iter().enumerate().map(point).collect();
    let law = Law::new(stations, &least_time(&points).unwrap());
    let rises: Vec<f64> = joints.iter().map(|most| most[1] / most[2]).collect();
    let (short, long) = rises.iter().fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    let window = long.min(law.duration());
    let mut here = |k: usize, s: f64| place(&rates(k, s), joints);
    let found = least_time_with_jerks(&law.smoothed(window), stations, short, &mut here);
    // No bound is violated, even between nodes.
    let mut of_node = |k: usize, s: f64| {
        let middle = 0.5 * (found.s[k] + found.s[k + 1]);
        here(stations.partition_point(|s| *s <= middle) - 1, s)
    };
    let passed = found.slowing(&mut of_node).into_iter().flatten().fold(0.0, f64::max);
    assert!(passed < 1.0 + 1e-4, "{passed}");
    found
}

#[test]
fn the_least_time_within_jerks_is_that_of_a_nonlinear_program() {
    for case in golden("jerk.json") {
        let of = |key: &str| numbers(&case[key]);
        let (a, b, w, p) = (of("a"), of("b"), of("w"), of("p"));
        let (speed, acceleration, jerk) = (of("speed"), of("acceleration"), of("jerk"));
        let joints: Vec<Joint> = (0..a.len()).map(|i| [speed[i], acceleration[i], jerk[i]]).collect();
        let rates = |_: usize, s: f64| {
            let of = |i: usize| {
                let (sin, cos) = (w[i] * s + p[i]).sin_cos();
                [b[i] + a[i] * w[i] * cos, -a[i] * w[i].powi(2) * sin, -a[i] * w[i].powi(3) * cos]
            };
            (0..a.len()).map(of).collect()
        };
        let stations: Vec<f64> = (0..=200).map(|k| f64::from(k) / 200.0).collect();
        let found = fastest(&stations, &joints, &rates).duration();
        let truth = case["duration_s"].as_f64().unwrap();
        // measured 2.7e-4, the discretisation error of 600 intervals of the nonlinear program
        assert!((found / truth - 1.0).abs() < 1e-3, "{} {found} {truth}", case["seed"]);
    }
}

/// Truth: TOPP-RA's durations, which are not lengthened by jerk limits.
#[test]
fn the_least_time_within_jerks_tends_to_that_of_toppra_as_they_grow() {
    for case in golden("toppra.json").iter().step_by(4) {
        let of = |key: &str| numbers(&case[key]);
        let (knots, speed, acceleration) = (of("knots"), of("speed"), of("acceleration"));
        let pieces: Vec<Vec<Vec<f64>>> = case["pieces"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| p.as_array().unwrap().iter().map(numbers).collect())
            .collect();
        // Each piece of the spline is divided: its third derivative jumps only at the knots.
        let parts = 1 + 400 / pieces.len();
        let stations: Vec<f64> = (0..=pieces.len() * parts)
            .map(|k| match k / parts {
                piece if piece == pieces.len() => knots[piece],
                piece => knots[piece] + (knots[piece + 1] - knots[piece]) * (k % parts) as f64 / parts as f64,
            })
            .collect();
        let rates = |k: usize, s: f64| {
            let piece = k / parts;
            let t = s - knots[piece];
            let of = |c: &Vec<f64>| [c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]), 2.0 * c[2] + t * 6.0 * c[3], 6.0 * c[3]];
            pieces[piece].iter().map(of).collect()
        };
        let truth = case["duration_s"].as_f64().unwrap();
        let mut last = f64::INFINITY;
        let mut late = Vec::new();
        for rise in [0.1, 0.03, 0.01] {
            let joints: Vec<Joint> = speed.iter().zip(&acceleration).map(|(v, a)| [*v, *a, a / rise]).collect();
            let found = fastest(&stations, &joints, &rates).duration();
            late.push(found / truth - 1.0);
            assert!(found < last && found > truth * (1.0 - 1e-3));
            last = found;
        }
        assert!(late[2] < 5e-3, "{late:?}");
    }
}
