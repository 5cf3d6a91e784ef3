//! Corners in sampled positions.

use flexarm_trajectory::internals::corners;

fn found(n: usize, h: f64, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let t: Vec<f64> = (0..=n).map(|k| h * k as f64).collect();
    let q: Vec<f64> = t.iter().map(|t| f(*t)).collect();
    corners(&t, &q).iter().map(|c| (h * (c.sample as f64 + c.fraction), c.position)).collect()
}

/// Truth: two parabolas that meet in a corner, at a sample or between two samples.
#[test]
fn a_corner_is_found_where_it_is() {
    for corner in [0.5, 0.5002, 0.5007, 0.50049] {
        let f = |t: f64| {
            let s = t - corner;
            if s < 0.0 { 2.0 * s + 3.0 * s * s } else { -s - 2.0 * s * s }
        };
        let found = found(1000, 1e-3, f);
        assert_eq!(found.len(), 1, "{corner}: {found:?}");
        // measured 1.3e-7 s, 2.5e-7
        assert!((found[0].0 - corner).abs() < 2e-6 && found[0].1.abs() < 2e-6, "{corner}: {found:?}");
    }
}

/// Truth: a path back and forth, in a table whose last digit is as large as the motion per
/// sample.
#[test]
fn corners_of_rounded_data_are_found() {
    for step in [1e-3, 1e-4, 1e-6] {
        let f = |t: f64| ((0.3 - (t - 0.3).abs()) / step).round() * step;
        let found = found(600, 1e-3, f);
        assert!(found.len() == 1 && (found[0].0 - 0.3).abs() < 1e-3, "{step:e}: {found:?}");
        // From rest to one step per sample.
        let f = |t: f64| ((t - 0.3).max(0.0) / step).round() * step;
        let found = self::found(600, 1e-3, f);
        assert!(found.len() == 1 && (found[0].0 - 0.3).abs() < 1e-3, "{step:e}: {found:?}");
    }
}

/// No corner is found in jumps of the acceleration, fast curvature, coarse data, rounding to
/// five digits or noise.
#[test]
fn smooth_and_rough_data_have_no_corners() {
    let trapezoid = |t: f64| if t < 0.3 { 5.0 * t * t } else { 0.45 + 3.0 * (t - 0.3) };
    let mut noise = 12345u64;
    let mut random = || {
        noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (noise >> 33) as f64 / 2f64.powi(31) - 0.5
    };
    let rough: Vec<f64> = (0..20_000).map(|_| 1e-4 * random()).collect();
    assert_eq!(found(1000, 1e-3, trapezoid), []);
    assert_eq!(found(1000, 1e-3, |t| (200.0 * t).sin()), []);
    assert_eq!(found(20, 0.05, |t| (20.0 * t).sin()), []);
    assert_eq!(found(1000, 1e-3, |t| (1e5 * (2.0 * t).sin()).round() * 1e-5), []);
    assert_eq!(found(1000, 1e-3, |t| (1e5 * 0.123 * t).round() * 1e-5), []);
    for step in [1e-3, 2e-4, 1e-5, 3e-6, 1e-7, 2.0 * std::f64::consts::PI / 2f64.powi(19)] {
        for speed in [0.1, 0.5, 2.0, 5.0] {
            let rounded = |t: f64| ((speed * t).sin() / step).round() * step;
            assert_eq!(found(3000, 1e-3, rounded), [], "{speed} rad/s in steps of {step:e} rad");
        }
    }
    assert_eq!(found(19_999, 1e-3, |t| t + rough[(t * 1e3).round() as usize]), []);
    assert_eq!(found(8, 1.0, |t| [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, 0.0][t as usize]), []);
    assert_eq!(found(500, 2e-3, |_| 1.7), []);
}
