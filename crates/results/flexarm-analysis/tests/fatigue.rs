//! Rainflow counting and damage, as in ASTM E1049.

use flexarm_analysis::*;

fn counted(cycles: &[FatigueCycle]) -> Vec<(f64, f64)> {
    let mut ranges: Vec<f64> = cycles.iter().map(|cycle| cycle.range).collect();
    ranges.sort_by(f64::total_cmp);
    ranges.dedup();
    let count = |range: f64| cycles.iter().filter(|cycle| cycle.range == range).map(|cycle| cycle.count).sum();
    ranges.into_iter().map(|range| (range, count(range))).collect()
}

/// Truth: the example of ASTM E1049-85, figure 6.
#[test]
fn the_example_of_the_standard_is_counted_as_in_the_standard() {
    let history = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0];
    assert_eq!(counted(&rainflow(&history)), [(3.0, 0.5), (4.0, 1.5), (6.0, 0.5), (8.0, 1.0), (9.0, 0.5)]);
    // Points on the way between reversals change nothing.
    let fine: Vec<f64> = history.windows(2).flat_map(|pair| [pair[0], 0.7 * pair[0] + 0.3 * pair[1]]).collect();
    let fine = [fine, vec![-2.0, -2.0]].concat();
    assert_eq!(counted(&rainflow(&fine)), counted(&rainflow(&history)));
}

/// Truth: the example of ASTM E1049-85, figure 7, a repeating history.
#[test]
fn a_repeating_history_has_whole_cycles_wherever_it_begins() {
    let history = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0];
    let truth = [(3.0, 1.0), (4.0, 1.0), (7.0, 1.0), (9.0, 1.0)];
    for begin in 0..history.len() {
        let mut history = history;
        history.rotate_left(begin);
        assert_eq!(counted(&rainflow_repeating(&history)), truth, "{begin}");
    }
}

/// Truth: closed forms for one amplitude.
#[test]
fn damage_of_one_amplitude_is_cycles_over_life() {
    let curve = SnCurve { amplitude_pa: 100e6, cycles: 1e6, slope: 5.0, tensile_pa: 400e6 };
    let one = |range: f64, mean: f64| curve.damage(&[FatigueCycle { range, mean, count: 1.0 }]);
    assert!((one(400e6, 0.0) * 1e6 / 32.0 - 1.0).abs() < 1e-14);
    assert!((one(100e6, 0.0) * 1e6 * 512.0 - 1.0).abs() < 1e-14); // slope 9 below the knee
    assert!((one(200e6, 200e6) * 1e6 / 32.0 - 1.0).abs() < 1e-14); // Goodman doubles the amplitude
    assert_eq!(one(200e6, -200e6), one(200e6, 0.0));
    assert_eq!(one(1.0, 400e6), f64::INFINITY);
    assert_eq!(curve.damage(&rainflow(&[1.0; 5])), 0.0);
}
