//! Least time within bounds on speed and acceleration, against closed forms.

use flexarm_trajectory::time_law::*;

fn straight(n: usize, length: f64, speed: f64, acceleration: f64) -> Vec<PathPoint> {
    let bound = Bound { a: 1.0, b: 0.0, low: -acceleration, high: acceleration };
    (0..=n).map(|k| PathPoint { s: length * k as f64 / n as f64, x_max: speed * speed, bounds: vec![bound] }).collect()
}

fn timed(points: &[PathPoint]) -> Law {
    let s: Vec<f64> = points.iter().map(|p| p.s).collect();
    Law::new(&s, &least_time(points).unwrap())
}

/// Truth: trapezoid, L/v + v/a; triangle, 2 sqrt(L/a).
#[test]
fn a_straight_path_is_run_as_a_trapezoid_or_a_triangle() {
    let trapezoid = timed(&straight(400, 2.0, 0.5, 1.0));
    assert!((trapezoid.duration() - 4.5).abs() < 1e-12, "{}", trapezoid.duration()); // measured 8.9e-16
    // The peak of the triangle is at a grid point.
    let triangle = timed(&straight(400, 2.0, 100.0, 2.0));
    assert!((triangle.duration() - 2.0).abs() < 1e-10, "{}", triangle.duration()); // measured 2.0e-12
}

/// Truth: one joint with q = s² + s, from 0 to 2, with maximum acceleration 1: 2 sqrt(2),
/// independent of the parameter.
#[test]
fn a_curved_parameter_changes_nothing_of_the_least_time() {
    let point = |k: usize| {
        let s = k as f64 / 2000.0;
        PathPoint { s, x_max: f64::INFINITY, bounds: vec![Bound { a: 2.0 * s + 1.0, b: 2.0, low: -1.0, high: 1.0 }] }
    };
    let law = timed(&(0..=2000).map(point).collect::<Vec<_>>());
    let error = (law.duration() - 8f64.sqrt()).abs();
    assert!(error < 3e-3, "{error:.1e}"); // measured 1.1e-3, in the first and the last interval
}

/// Truth: the minimum time does not depend on the parameter or on the number of points.
#[test]
fn few_points_cost_little_time() {
    for n in [30, 100, 2000] {
        let point = |k: usize| {
            let s = k as f64 / n as f64;
            let bounds = vec![Bound { a: 2.0 * s + 1.0, b: 2.0, low: -1.0, high: 1.0 }];
            PathPoint { s, x_max: f64::INFINITY, bounds }
        };
        let law = timed(&(0..=n).map(point).collect::<Vec<_>>());
        let late = law.duration() / 8f64.sqrt() - 1.0;
        assert!(late.abs() < 3e-3, "{n}: {late:.1e}"); // measured 1.7e-3, 4.3e-4, 1.9e-4
    }
}

/// Truth: joints `s` and `s²/2` with maximum accelerations 1 and A. The first bound is active
/// up to `s = A/3`, then the second with `x = A - A³/(27 s²)`, and from its intersection with
/// `2 (1 - s)` the first again.
#[test]
fn two_joints_switch_from_one_bound_to_the_other_where_the_closed_form_does() {
    let A: f64 = 1.2;
    let along = |s: f64| A - A.powi(3) / (27.0 * s * s);
    let (mut low, mut high) = (A / 3.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if along(middle) < 2.0 * (1.0 - middle) { low = middle } else { high = middle }
    }
    let time = |s: f64| (A * s * s - A.powi(3) / 27.0).sqrt() / A;
    let truth = (2.0 * A / 3.0).sqrt() + time(low) - time(A / 3.0) + (2.0 * (1.0 - low)).sqrt();
    for n in [25, 100, 4000] {
        let point = |k: usize| {
            let s = k as f64 / n as f64;
            let joint = |a: f64, b: f64, most: f64| Bound { a, b, low: -most, high: most };
            PathPoint { s, x_max: f64::INFINITY, bounds: vec![joint(1.0, 0.0, 1.0), joint(s, 1.0, A)] }
        };
        let points: Vec<PathPoint> = (0..=n).map(point).collect();
        let late = timed(&points).duration() / truth - 1.0;
        assert!(late.abs() < 2e-4, "{n}: {late:.1e}"); // measured 6.4e-5, 8.8e-6, 2.3e-6
    }
}

/// Truth: the averaged law has the exact path length and ends T later; its acceleration is at
/// most that of the trapezoid and rises at a/T.
#[test]
fn a_smoothed_law_is_an_s_curve() {
    let law = timed(&straight(400, 2.0, 0.5, 1.0)).smoothed(0.1);
    assert!((law.duration() - 4.6).abs() < 1e-12);
    assert!((law.at(4.6).s - 2.0).abs() < 1e-12 && law.at(4.6).v.abs() < 1e-12);
    assert!((law.at(0.05).a - 0.5).abs() < 1e-9 && (law.at(0.05).j - 10.0).abs() < 1e-9);
    assert!((law.at(2.0).v - 0.5).abs() < 1e-12);
    // Second algorithm: finite differences.
    for k in 1..460 {
        let (t, h) = (0.01 * f64::from(k) + 0.0033, 1e-5);
        let (low, mid, high) = (law.at(t - h), law.at(t), law.at(t + h));
        assert!(((high.s - low.s) / (2.0 * h) - mid.v).abs() < 1e-8);
        assert!(((high.v - low.v) / (2.0 * h) - mid.a).abs() < 1e-4);
    }
}

#[test]
fn a_slow_place_in_the_middle_is_braked_for() {
    let mut points = straight(1000, 2.0, 1.0, 2.0);
    points[500].x_max = 0.01;
    let law = timed(&points);
    // Truth: two sections of 1 m between 0, 1 and 0.1 m/s: (1/2 + 1 + 1/2 ...) by hand.
    let run = 0.5 + (1.0 - 0.25 - (1.0 - 0.01) / 4.0) / 1.0 + (1.0 - 0.1) / 2.0;
    // The corner of the speed is between two points.
    assert!((law.duration() - 2.0 * run).abs() < 1e-5); // measured 1.5e-6
}

#[test]
fn a_bound_that_a_standstill_breaks_is_told_with_its_point() {
    let mut points = straight(10, 1.0, 1.0, 1.0);
    points[4].bounds.push(Bound { a: 1.0, b: 0.0, low: 2.0, high: 3.0 });
    assert!(matches!(least_time(&points), Err(LawError::Infeasible(3 | 4))));
}
