//! Pieces of degree five: ends, ranges and roots.

use flexarm_trajectory::internals::{Piece, roots_in_unit_interval};
use proptest::prelude::*;

/// Truth: (u - 0.2)(u - 0.5)(u - 0.9).
#[test]
fn all_roots_of_a_cubic_are_found() {
    let roots = roots_in_unit_interval(&[-0.09, 0.73, -1.6, 1.0]);
    assert_eq!(roots.len(), 3);
    for (found, truth) in roots.iter().zip([0.2, 0.5, 0.9]) {
        assert!((found - truth).abs() < 1e-14); // measured 1.1e-16
    }
}

proptest! {
    /// Second algorithm: no sample on a fine grid lies outside the range found from the roots.
    #[test]
    fn no_sample_leaves_the_exact_range(
        ends in prop::array::uniform6(-3.0..3.0_f64),
        width in 0.01..5.0_f64,
        order in 0..4_usize,
    ) {
        let [q0, v0, a0, q1, v1, a1] = ends;
        let piece = Piece::hermite(width, [q0, v0, a0], [q1, v1, a1]);
        let [(t_low, low), (t_high, high)] = piece.range(order);
        let slack = 1e-12 * (low.abs() + high.abs() + 1.0);
        for k in 0..=200 {
            let value = piece.at(width * f64::from(k) / 200.0)[order];
            prop_assert!(value >= low - slack && value <= high + slack);
        }
        prop_assert!((piece.at(t_low)[order] - low).abs() <= slack);
        prop_assert!((piece.at(t_high)[order] - high).abs() <= slack);
    }

    #[test]
    fn hermite_piece_meets_its_end_values(ends in prop::array::uniform6(-3.0..3.0_f64), width in 0.01..5.0_f64) {
        let [q0, v0, a0, q1, v1, a1] = ends;
        let [q, v, a, _] = Piece::hermite(width, [q0, v0, a0], [q1, v1, a1]).at(width);
        // The rounding error scales with the terms, not with the result; measured 8e-17 of it.
        let scale = 50.0 * (q0.abs() + q1.abs() + (v0.abs() + v1.abs()) * width + (a0.abs() + a1.abs()) * width * width);
        prop_assert!((q - q1).abs() <= 1e-14 * scale);
        prop_assert!((v - v1).abs() * width <= 1e-14 * scale);
        prop_assert!((a - a1).abs() * width * width <= 1e-14 * scale);
    }
}
