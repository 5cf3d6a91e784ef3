//! Filters, derivatives and least squares of signals.

use std::f64::consts::TAU;

use flexarm_analysis::signal::*;

const RATE_HZ: f64 = 250.0;

/// Truth: the Butterworth gain of both passes, `1/(1 + (tan(π f/f_s)/tan(π f_c/f_s))^8)`, at
/// three frequencies, and zero phase; measured 1.1e-14.
#[test]
fn a_wave_keeps_its_phase_and_loses_what_butterworth_says() {
    let low = LowPass::new(10.0, RATE_HZ);
    for hz in [1.0, 8.0, 25.0f64] {
        let wave = |i: usize| (TAU * hz * i as f64 / RATE_HZ).sin();
        let found = low.of(&(0..4000).map(wave).collect::<Vec<f64>>());
        let warped = |f: f64| (std::f64::consts::PI * f / RATE_HZ).tan();
        let gain = 1.0 / (1.0 + (warped(hz) / warped(10.0)).powi(8));
        for (i, y) in found.iter().enumerate().take(2500).skip(1500) {
            assert!((y - gain * wave(i)).abs() < 1e-11, "{hz} Hz at {i}: {y} {}", gain * wave(i));
        }
    }
    let steady = low.of(&[3.0; 50]);
    assert!(steady.iter().all(|y| (y - 3.0).abs() < 1e-12));
}

#[test]
fn slopes_and_delays_of_a_straight_line_are_its_own() {
    let line: Vec<f64> = (0..10).map(|i| 2.0 + 0.5 * f64::from(i)).collect();
    assert!(derivative(&line, 0.1).iter().all(|v| (v - 5.0).abs() < 1e-12));
    let late = delayed(&line, 0.25, 0.1);
    assert_eq!(late[0], 2.0);
    assert!((late[9] - (line[9] - 1.25)).abs() < 1e-12);
}

#[test]
fn least_squares_find_what_a_sum_was_made_of() {
    let columns = vec![vec![1.0; 5], vec![0.0, 1e6, 2e6, 3e6, 4e6]];
    let y: Vec<f64> = (0..5).map(|i| 3.0 - 2.0 * f64::from(i)).collect();
    let found = least_squares(&columns, &y).unwrap();
    assert!((found[0] - 3.0).abs() < 1e-9 && (found[1] + 2e-6).abs() < 1e-14, "{found:?}");
    assert!(rms(rest(&columns, &found, &y).into_iter()) < 1e-9);
}
