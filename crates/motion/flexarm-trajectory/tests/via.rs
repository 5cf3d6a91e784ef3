//! Splines through points on the way.

use flexarm_trajectory::internals::{Piece, passing_times, rest_to_rest_spline};
use proptest::prelude::*;

/// Truth: the single quintic passes through these points, and the curve of least squared jerk
/// is unique.
#[test]
fn points_on_the_straight_line_do_not_change_the_quintic() {
    let points = [[0.0, 0.0], [0.1, -0.2], [0.55, -1.1], [1.0, -2.0]];
    let rows: Vec<&[f64]> = points.iter().map(|p| p.as_slice()).collect();
    let u = passing_times(&rows, &[1.0, 1.0]).unwrap();
    let q: Vec<f64> = points.iter().map(|p| p[0]).collect();
    for (piece, u0) in rest_to_rest_spline(&u, &q).iter().zip(&u) {
        for tau in [0.0, 0.3 * piece.width, piece.width] {
            let t = u0 + tau;
            let truth = t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t);
            assert!((piece.at(tau)[0] - truth).abs() < 1e-13); // measured 1.1e-15
        }
    }
}

proptest! {
    #[test]
    fn jerk_and_snap_are_continuous_at_the_points(
        steps in prop::collection::vec(0.05..1.0_f64, 2..8),
        values in prop::collection::vec(-3.0..3.0_f64, 9),
    ) {
        let mut u = vec![0.0];
        for step in steps {
            u.push(u[u.len() - 1] + step);
        }
        let pieces = rest_to_rest_spline(&u, &values[..u.len()]);
        let snap = |p: &Piece, tau: f64| 24.0 * p.c[4] + 120.0 * p.c[5] * tau;
        let scale = pieces.iter().map(|p| 60.0 * 6.0 / p.width.powi(4)).fold(1.0, f64::max) * 10.0;
        for pair in pieces.windows(2) {
            let [left, right] = [pair[0], pair[1]];
            for order in 0..4 {
                prop_assert!((left.at(left.width)[order] - right.at(0.0)[order]).abs() <= 1e-11 * scale);
            }
            prop_assert!((snap(&left, left.width) - snap(&right, 0.0)).abs() <= 1e-11 * scale); // measured 2e-16 of the scale
        }
    }
}
