//! Minimum durations against TOPP-RA on its own kind of paths (`tools/golden_toppra.py`).

use std::path::Path;

use flexarm_trajectory::time_law::{Bound, Law, PathPoint, least_time};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// First and second derivatives of each joint at `s`.
fn rates(knots: &[f64], pieces: &[Vec<Vec<f64>>], s: f64) -> Vec<[f64; 2]> {
    let k = knots.partition_point(|knot| *knot <= s).clamp(1, knots.len() - 1) - 1;
    let t = s - knots[k];
    pieces[k].iter().map(|c| [c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]), 2.0 * c[2] + t * 6.0 * c[3]]).collect()
}

fn duration(case: &Value, intervals: usize) -> f64 {
    let (knots, speed, acceleration) =
        (numbers(&case["knots"]), numbers(&case["speed"]), numbers(&case["acceleration"]));
    let pieces: Vec<Vec<Vec<f64>>> = case["pieces"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p.as_array().unwrap().iter().map(numbers).collect())
        .collect();
    let point = |k: usize| {
        let s = k as f64 / intervals as f64;
        let rates = rates(&knots, &pieces, s);
        let x_max = rates.iter().zip(&speed).map(|(r, v)| (v / r[0]).powi(2)).fold(f64::INFINITY, f64::min);
        let bounds =
            rates.iter().zip(&acceleration).map(|(r, a)| Bound { a: r[0], b: r[1], low: -a, high: *a }).collect();
        PathPoint { s, x_max, bounds }
    };
    let points: Vec<PathPoint> = (0..=intervals).map(point).collect();
    let s: Vec<f64> = points.iter().map(|p| p.s).collect();
    Law::new(&s, &least_time(&points).unwrap()).duration()
}

#[test]
fn the_least_time_of_random_splines_is_that_of_toppra() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/golden/toppra.json");
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let mut worst: f64 = 0.0;
    for case in golden["cases"].as_array().unwrap() {
        let truth = case["duration_s"].as_f64().unwrap();
        let found = duration(case, 4000);
        worst = worst.max((found / truth - 1.0).abs());
    }
    assert!(worst < 2e-3, "{worst:.1e}"); // measured 1.3e-5
}

/// Truth: the same with 4000 intervals. Bounds at both ends of 400 undivided intervals cost 0.32 to
/// 0.68 %.
#[test]
fn a_coarse_grid_makes_the_least_time_no_longer() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/golden/toppra.json");
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    for case in golden["cases"].as_array().unwrap() {
        let off = duration(case, 400) / case["duration_s"].as_f64().unwrap() - 1.0;
        assert!(off.abs() < 2.5e-3, "{off:.1e}"); // measured -6.9e-4 to -2.2e-3
    }
}
