//! Spectra of sinusoids, compared with sums and amplitudes in closed form.

use std::f64::consts::{PI, TAU};

use flexarm_analysis::*;

fn times(n: u32, rate: f64) -> Vec<f64> {
    (0..n).map(|k| f64::from(k) / rate).collect()
}

/// Second algorithm: the sum in the definition.
#[test]
fn fast_transform_equals_the_plain_sum() {
    let (n, t) = (50, times(50, 100.0));
    let samples: Vec<[f64; 3]> = (0..50).map(|k| [f64::from(k * k % 17), f64::from(k % 5), 0.0]).collect();
    let window: Vec<f64> = (0..n).map(|k| (PI * (f64::from(k) + 0.5) / f64::from(n)).sin().powi(2)).collect();
    let weight: f64 = window.iter().sum();
    let spectrum = amplitude_spectrum(&t, &samples).unwrap();
    assert_eq!(spectrum.hz.len(), 128);
    for c in 0..3 {
        let mean = samples.iter().zip(&window).map(|(x, w)| w * x[c]).sum::<f64>() / weight;
        for (hz, amplitude) in spectrum.hz.iter().zip(&spectrum.amplitude) {
            let [mut re, mut im] = [0.0; 2];
            for ((t, x), w) in t.iter().zip(&samples).zip(&window) {
                let (sin, cos) = (TAU * hz * t).sin_cos();
                re += w * (x[c] - mean) * cos;
                im += w * (x[c] - mean) * sin;
            }
            let plain = 2.0 * re.hypot(im) / weight;
            assert!((amplitude[c] - plain).abs() < 1e-9 * (1.0 + plain));
        }
    }
}

#[test]
fn a_sinusoid_between_two_bins_is_found() {
    let t = times(2000, 1000.0);
    for hz in [3.3, 12.34, 87.6, 312.1] {
        let signal: Vec<_> =
            t.iter().map(|t| [0.3, 4e-4 * (TAU * hz * t).sin(), 3e-4 * (TAU * hz * t).cos()]).collect();
        for (taper, bound) in [(Taper::Both, 1e-4), (Taper::FadeOut, 0.2 / (2.0 * hz).powi(2))] {
            let line = strongest_line(&t, &signal, taper).unwrap();
            assert!((line.hz / hz - 1.0).abs() < bound, "{hz} Hz, {taper:?}: {}", line.hz / hz - 1.0);
            assert!((line.amplitude / 5e-4 - 1.0).abs() < 0.05); // measured 2.8e-3
        }
    }
}

/// Truth: the amplitudes in the signal.
#[test]
fn a_spectrum_has_lines_as_high_as_the_sinusoids_in_the_signal() {
    let t = times(4000, 1000.0);
    let signal: Vec<_> =
        t.iter().map(|t| [7.0 + 3e-3 * (TAU * 20.0 * t).sin(), 0.0, 1e-3 * (TAU * 55.0 * t).cos()]).collect();
    let spectrum = amplitude_spectrum(&t, &signal).unwrap();
    let step = spectrum.hz[1];
    let largest = |component: usize, hz: f64| {
        let near = spectrum.hz.iter().zip(&spectrum.amplitude).filter(|(f, _)| (*f - hz).abs() < 2.0 * step);
        near.map(|(_, a)| a[component]).fold(0.0, f64::max)
    };
    for (component, hz, truth) in [(0, 20.0, 3e-3), (2, 55.0, 1e-3)] {
        let error = largest(component, hz) / truth - 1.0;
        assert!(error.abs() < 0.012, "{hz} Hz: {error:e}");
    }
    assert!(largest(0, 55.0) < 1e-9 && spectrum.amplitude.iter().all(|a| a[1] == 0.0));
    assert_eq!(amplitude_spectrum(&t[..15], &signal[..15]), None);
}

#[test]
fn creep_without_a_vibration_has_no_line() {
    let t = times(3000, 1000.0);
    for rate in [0.5, 2.0, 10.0, 50.0] {
        let creep: Vec<_> = t.iter().map(|t| [1e-3 * (-rate * t).exp(), 0.0, 1e-4]).collect();
        assert_eq!(strongest_line(&t, &creep, Taper::FadeOut), None, "rate {rate} 1/s");
    }
    assert_eq!(strongest_line(&t, &vec![[1e-3, 0.0, 0.0]; 3000], Taper::FadeOut), None);
}

#[test]
fn a_long_record_is_averaged_and_keeps_its_low_line() {
    let t = times(200_000, 10_000.0);
    let signal: Vec<_> = t.iter().map(|t| [(TAU * 14.2 * t).sin(), 0.0, 0.0]).collect();
    let line = strongest_line(&t, &signal, Taper::Both).unwrap();
    assert!((line.hz / 14.2 - 1.0).abs() < 1e-5); // measured 1.6e-9
}
