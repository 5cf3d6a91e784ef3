//! Accuracy and repeatability of poses that are visited again.

use flexarm_analysis::internals::repeated_poses;
use flexarm_analysis::*;

fn rest(place_m: [f64; 3], end_error_m: [f64; 3]) -> HoldMetrics {
    HoldMetrics {
        start_s: 0.0,
        end_s: 1.0,
        place_m,
        end_error_m,
        final_error_m: end_error_m,
        settling_s: Some(0.0),
        overshoot_m: 0.0,
        line: None,
    }
}

/// Truth: errors (1, 0, 0), (-1, 0, 0), (0, 2, 0), (0, -2, 0) about (3, 4, 0): the mean has a
/// distance of 5, the distances 1, 1, 2, 2 have the mean 1.5 and the standard deviation
/// 1/sqrt(3).
#[test]
fn accuracy_and_repeatability_are_those_of_the_formulas_of_the_standard() {
    let (a, b) = ([1.0, 0.0, 0.5], [0.0, 1.0, 0.5]);
    let about = |x: f64, y: f64| rest(a, [3.0 + x, 4.0 + y, 0.0]);
    let holds = [about(1.0, 0.0), rest(b, [9.0; 3]), about(-1.0, 0.0), about(0.0, 2.0), about(0.0, -2.0)];
    let poses = repeated_poses(&holds);
    assert_eq!(poses.len(), 1, "a pose with a single visit has no repeatability");
    assert_eq!((poses[0].place_m, poses[0].visits), (a, 4));
    assert!((poses[0].accuracy_m - 5.0).abs() < 1e-14);
    assert!((poses[0].repeatability_m - (1.5 + 3.0_f64.sqrt())).abs() < 1e-14);
}

#[test]
fn a_robot_that_comes_to_the_same_place_every_time_repeats_exactly() {
    let holds = vec![rest([1.0, 2.0, 3.0], [1e-3, 0.0, -2e-3]); 30];
    let poses = repeated_poses(&holds);
    assert!((poses[0].accuracy_m - 5.0_f64.sqrt() * 1e-3).abs() < 1e-17);
    assert!(poses[0].repeatability_m < 1e-17); // measured 0 or rounding of the mean
}
