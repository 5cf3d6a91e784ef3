//! Errors of one period of an oscillator, of every stepper.

use std::f64::consts::TAU;

use flexarm_stepping::*;

fn kind(name: &str) -> StepperKind {
    let entry = STEPPERS.into_iter().find(|entry| entry.name == name).unwrap();
    (entry.with)(&StepperOptions::default())
}

/// Truth: SPOOK without damping has the frequency `(2/hω) atan(hω/2)` and, from rest, leads by
/// half a step: `x = 1 - cos(w' t + hω/2) / cos(hω/2)`; and the amplification of RK4,
/// `|R(iy)|² = 1 - y⁶/72 + y⁸/576`.
#[test]
fn the_error_of_a_period_is_that_of_the_closed_amplification() {
    for y in [0.1f64, 0.2, 0.3] {
        let frequency = 2.0 / y * (0.5 * y).atan();
        let off = |t: f64| t.cos() - (frequency * t + 0.5 * y).cos() / (0.5 * y).cos();
        let steps = (TAU / y).ceil() as u32;
        let truth = (1..=steps).map(|k| off(y * f64::from(k)).abs()).fold(0.0, f64::max);
        let found = error_of_a_period(kind("spook"), y, 0.0);
        // Measured 0.0008 to 0.008.
        assert!((found / truth - 1.0).abs() < 0.02, "{y}: {found:.3e}, {truth:.3e}");
    }
    let y = 1.0f64;
    let (loss, phase) =
        (1.0 - (1.0 - y.powi(6) / 72.0 + y.powi(8) / 576.0).sqrt().powf(TAU / y), TAU * y.powi(4) / 120.0);
    let found = error_of_a_period(kind("rk4"), y, 0.0);
    assert!((0.5..2.0).contains(&(found / loss.hypot(phase))), "{found:.3e}, {loss:.3e}, {phase:.3e}");
}

/// Truth: the orders stated in the registry.
#[test]
fn half_the_step_divides_the_error_of_a_period_by_the_power_of_the_order() {
    for entry in STEPPERS.into_iter().filter(|entry| entry.steps != StepRule::ByErrorControl) {
        let error = |h| error_of_a_period(kind(entry.name), h, 0.03);
        let order = (error(0.2) / error(0.1)).log2();
        assert!(order > f64::from(entry.order) - 0.2, "{}: {order}", entry.name);
    }
    assert_eq!(error_of_a_period(kind("reference"), 1.0, 0.03), 0.0);
}

/// The end of a step of many periods is close to rest, as is the damped oscillation at that time;
/// all of the oscillation is lost.
#[test]
fn steps_above_half_a_period_lose_the_whole_oscillation() {
    for entry in STEPPERS.into_iter().filter(|entry| entry.steps != StepRule::ByErrorControl) {
        for h_omega in [3.2, 10.0, 110.0] {
            let found = error_of_a_period(kind(entry.name), h_omega, 0.03);
            assert!(found >= 1.0, "{}, {h_omega}: {found}", entry.name);
        }
    }
}

/// The preset of the source damps with a time in proportion to the step: an oscillation without
/// physical damping decays at any step size.
#[test]
fn settings_count() {
    let source = StepperKind::Spook(SpookSettings { preset: SpookPreset::Source, ..SpookSettings::default() });
    let [exact, source] = [kind("spook"), source].map(|kind| error_of_a_period(kind, 0.05, 0.0));
    // Half a step of lead, and nearly a quarter of the amplitude.
    assert!(exact < 0.025 && source > 0.1, "{exact:e} {source:e}");
}
