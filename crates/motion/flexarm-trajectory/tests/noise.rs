//! Noise of recorded positions: its estimate, the rounding of digits, smoothing.

use std::f64::consts::PI;

use flexarm_trajectory::internals::{Noise, noise};
use flexarm_trajectory::{JointSamples, Samples, Trajectory};

/// A quintic of 1 rad in 2 s between rests of half a second.
fn quintic(t: f64) -> [f64; 2] {
    let u = ((t - 0.5) / 2.0).clamp(0.0, 1.0);
    [u * u * u * (10.0 + u * (6.0 * u - 15.0)), (60.0 * u - 180.0 * u * u + 120.0 * u * u * u) / 4.0]
}

/// Normal random numbers of a linear congruential generator, by twelve uniform ones.
fn normal(state: &mut u64) -> f64 {
    (0..12).fold(-6.0, |sum, _| {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        sum + (*state >> 11) as f64 / (1u64 << 53) as f64
    })
}

fn samples(rate_hz: f64, of: impl FnMut(f64) -> f64) -> Samples {
    let times: Vec<f64> = (0..=(3.0 * rate_hz) as u32).map(|k| f64::from(k) / rate_hz).collect();
    let position = times.iter().copied().map(of).collect();
    Samples { times, joints: vec![JointSamples { name: "q".into(), position, ..JointSamples::default() }] }
}

/// RMS error of the acceleration against the quintic, over its RMS.
fn acceleration_error(motion: &Trajectory) -> f64 {
    let (mut square, mut own) = (0.0, 0.0);
    for k in 0..3000 {
        let t = f64::from(k) * 1e-3;
        let (mut q, mut v, mut a) = ([0.0], [0.0], [0.0]);
        motion.sample(t, &mut q, &mut v, &mut a);
        square += (a[0] - quintic(t)[1]).powi(2);
        own += quintic(t)[1].powi(2);
    }
    (square / own).sqrt()
}

fn warns_of(code: &str, motion: &Trajectory) -> bool {
    motion.warnings().iter().any(|warning| warning.code == code)
}

/// Truth: the noise that was added, and its part of the acceleration by the known curve.
#[test]
fn the_noise_of_an_encoder_is_told_with_its_share_and_smoothed_away_by_a_cut_off() {
    for (rate, rms) in [(100.0, 2e-5), (250.0, 1e-5), (100.0, 2e-4)] {
        let mut state = 7;
        let noisy = samples(rate, |t| quintic(t)[0] + rms * normal(&mut state));
        let motion = noisy.interpolate().unwrap();
        assert!(warns_of("motion-noise", &motion));
        let found: Noise = noise(&noisy.times, &noisy.joints[0].position).unwrap();
        let error = acceleration_error(&motion);
        let truth = error / (1.0 + error * error).sqrt();
        println!("{rate} Hz, {rms:.0e} rad: {found:?}, share {truth:.3}");
        // measured 0.97 to 1.00 and 0.99 to 1.16
        assert!((found.rms / rms - 1.0).abs() < 0.2 && (found.share / truth - 1.0).abs() < 0.2, "{found:?} {truth}");
        let smooth = noisy.smoothed(found.cutoff_hz).unwrap().interpolate().unwrap();
        let left = acceleration_error(&smooth);
        println!("    smoothed at {:.1} Hz: {left:.3} of {error:.3}", found.cutoff_hz);
        assert!(left < 0.2 * error && left < 0.2, "{left} of {error}");
        assert!(!warns_of("motion-noise", &smooth));
    }
}

/// Truth: the quintic without rounding.
#[test]
fn angles_of_six_digits_at_a_high_rate_are_smoothed_within_their_rounding() {
    for (rate, step) in [(2000.0, 1e-6), (1000.0, 1e-5), (2000.0, 1e-4 * PI / 180.0)] {
        let motion = samples(rate, |t| (quintic(t)[0] / step).round() * step).interpolate().unwrap();
        let error = acceleration_error(&motion);
        println!("{rate} Hz in steps of {step:.1e}: {error:.4}");
        // measured 0.050, 0.16; without smoothing 2 and more
        assert!(error < 0.25, "{error}");
        assert!(!warns_of("motion-noise", &motion) && motion.velocity_jumps().is_empty(), "{:?}", motion.warnings());
        let mut worst = 0.0f64;
        for k in 0..6000 {
            let t = f64::from(k) * 5e-4;
            let (mut q, mut v, mut a) = ([0.0], [0.0], [0.0]);
            motion.sample(t, &mut q, &mut v, &mut a);
            worst = worst.max((q[0] - quintic(t)[0]).abs());
        }
        assert!(worst < 1.3 * step, "{worst} {step}");
        assert_eq!(motion.moves().len(), 1, "the holds are kept");
    }
}

/// Motions that end at rest, rounded: neither the start of the hold nor slow parts are corners or
/// noise.
#[test]
fn rounded_motions_into_a_hold_have_neither_corners_nor_noise() {
    let mut told = Vec::new();
    for (rate, digits, end) in [
        (2000.0, 6, 1.2),
        (2000.0, 5, 1.2),
        (1000.0, 6, 2.4),
        (4000.0, 6, 0.8),
        (500.0, 4, 1.6),
        (250.0, 6, 16.0),
        (100.0, 6, 48.0),
        (125.0, 3, 3.2),
    ] {
        for (from, to) in [(0.0, 0.5), (-1.05, -0.8), (1.05, 0.85), (0.0, 0.3), (0.7, 0.45)] {
            let scale = 10f64.powi(digits);
            let n = (1.25 * end * rate) as u32;
            let times: Vec<f64> = (0..=n).map(|k| f64::from(k) / rate).collect();
            let at = |t: &f64| {
                let u = (t / end).min(1.0);
                ((from + (to - from) * u * u * u * (10.0 + u * (6.0 * u - 15.0))) * scale).round() / scale
            };
            let position = times.iter().map(at).collect();
            let joint = JointSamples { name: "q".into(), position, ..JointSamples::default() };
            let motion = Samples { times, joints: vec![joint] }.interpolate().unwrap();
            let warnings = motion.warnings();
            told.extend(
                warnings.iter().map(|warning| format!("{rate} Hz, {digits} digits, {from} to {to}: {warning}")),
            );
        }
    }
    assert_eq!(told, [""; 0]);
}

#[test]
fn smooth_motions_are_not_noisy_and_keep_their_bits() {
    for rate in [20.0, 100.0, 1000.0] {
        let exact = samples(rate, |t| quintic(t)[0]);
        let motion = exact.interpolate().unwrap();
        assert!(!warns_of("motion-noise", &motion), "{rate}: {:?}", motion.warnings());
        let (mut q, mut v, mut a) = ([0.0], [0.0], [0.0]);
        motion.sample(exact.times[30], &mut q, &mut v, &mut a);
        assert_eq!(q[0], exact.joints[0].position[30]);
    }
}

/// Numbers of six significant digits: 0.999999, 1.00001.
#[test]
fn a_slow_path_of_six_significant_digits_has_no_corner() {
    let six = |x: f64| format!("{x:.5e}").parse::<f64>().unwrap();
    for (rate, speed) in [(100.0, 1e-3), (250.0, 3e-3), (100.0, 2e-2), (1000.0, 1e-2)] {
        for start in [0.9995, 0.0999, 1.5, 0.9] {
            let motion =
                samples(rate, |t| six(start + 0.5 * speed * (1.0 - (PI * t / 3.0).cos()))).interpolate().unwrap();
            let mut jumps = motion.velocity_jumps();
            jumps.retain(|jump| jump.time_s > 0.0 && jump.time_s < motion.duration());
            assert!(jumps.is_empty(), "{rate} {speed} {start}: {jumps:?}");
        }
    }
}

#[test]
fn a_cut_off_beyond_half_the_sampling_rate_is_refused_with_its_line() {
    let text = |cutoff: &str| format!("# unit: rad\n# cutoff: {cutoff}\ntime,q\n0,0\n0.1,0\n0.2,0.1\n0.3,0.1\n");
    for (cutoff, part) in
        [("7 Hz", "less than half the sampling rate, 5.0000 Hz"), ("0 Hz", "more than 0"), ("3", "20 Hz")]
    {
        let error = Trajectory::parse_csv(&text(cutoff), "f").unwrap_err().to_string();
        assert!(error.starts_with("f:2: ") && error.contains(part), "{error}");
    }
    assert!(Trajectory::parse_csv(&text("3 Hz"), "f").is_ok());
}

/// Truth: the motion of the positions without velocities.
#[test]
fn velocities_of_another_sign_or_unit_or_zeros_are_told_and_not_used() {
    let times: Vec<f64> = (0..=150).map(|k| 0.02 * f64::from(k)).collect();
    let position: Vec<f64> = times.iter().map(|t| quintic(*t)[0]).collect();
    let velocity = |factor: f64| {
        let rate = |t: &f64| {
            let u = ((t - 0.5) / 2.0).clamp(0.0, 1.0);
            factor * 15.0 * u * u * (1.0 - u) * (1.0 - u)
        };
        Some(times.iter().map(rate).collect())
    };
    let with = |velocity| {
        let joint = JointSamples { name: "q".into(), position: position.clone(), velocity, acceleration: None };
        Samples { times: times.clone(), joints: vec![joint] }.interpolate().unwrap()
    };
    let told = |motion: &Trajectory| warns_of("motion-velocities", motion);
    assert!(!told(&with(velocity(1.0))) && !told(&with(None)));
    for factor in [-1.0, 0.0, 180.0 / PI, 1e3] {
        let motion = with(velocity(factor));
        assert!(told(&motion), "{factor}");
        let (mut q, mut p, mut v, mut a) = ([0.0], [0.0], [0.0], [0.0]);
        motion.sample(1.234, &mut q, &mut v, &mut a);
        with(None).sample(1.234, &mut p, &mut v, &mut a);
        assert_eq!(q, p);
    }
}
