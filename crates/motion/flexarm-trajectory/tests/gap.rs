//! Samples that are missing.

use flexarm_trajectory::{Gap, JointSamples, Samples};

fn found(times: &[f64], position: impl Fn(f64) -> f64) -> Option<Gap> {
    let position = times.iter().map(|t| position(*t)).collect();
    let joints = vec![JointSamples { name: "j".into(), position, ..JointSamples::default() }];
    Samples { times: times.to_vec(), joints }.interpolate().unwrap().gaps().first().cloned()
}

fn sampled(n: usize, step: f64) -> Vec<f64> {
    (0..n).map(|k| k as f64 * step).collect()
}

/// Truth: the samples that were taken out.
#[test]
fn missing_samples_are_found_with_their_place_also_where_clocks_jitter() {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / 2f64.powi(31) - 0.5
    };
    for jitter in [0.0, 0.3, 0.9] {
        let mut times: Vec<f64> = sampled(500, 0.02).iter().map(|t| t + 0.02 * jitter * random()).collect();
        assert_eq!(found(&times, f64::sin), None, "{jitter}");
        times.drain(201..221);
        let Some(Gap { count: 1, sample: 201, from_s, to_s, usual_s, .. }) = found(&times, f64::sin) else {
            panic!("{jitter}: {:?}", found(&times, f64::sin))
        };
        assert_eq!([from_s, to_s], [times[200] - times[0], times[201] - times[0]]);
        assert!((usual_s - 0.02).abs() < 2e-3, "{usual_s}");
    }
}

#[test]
fn holds_late_samples_waypoints_and_uneven_rows_are_no_gaps() {
    // A table that leaves out the rows of a hold.
    let mut times = sampled(300, 0.01);
    times.iter_mut().skip(150).for_each(|t| *t += 2.0);
    let hold = |t: f64| if t < 1.49 { t } else { 1.49 + (t - 3.5).max(0.0) };
    assert_eq!(found(&times, hold), None);
    // Five messages received late, all at once.
    let mut times = sampled(300, 0.01);
    for (k, late) in [(100, 0.045), (101, 0.036), (102, 0.027), (103, 0.018), (104, 0.009)] {
        times[k] += late;
    }
    assert_eq!(found(&times, f64::sin), None);
    // Waypoints at even times with one long move, and waypoints at uneven times.
    let mut times = sampled(30, 0.5);
    times.iter_mut().skip(12).for_each(|t| *t += 4.0);
    assert_eq!(found(&times, f64::sin), None);
    let uneven: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k * k)).collect();
    assert_eq!(found(&uneven, f64::sin), None);
    assert_eq!(found(&[0.0, 0.1, 0.2, 1.0], f64::sin), None);
}
