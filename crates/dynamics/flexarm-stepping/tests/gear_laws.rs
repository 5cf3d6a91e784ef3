//! Laws of hysteresis and of transmission errors.

use flexarm_stepping::internals::SliderState;
use flexarm_stepping::*;

/// Truth: Rayleigh's parabola at the corners, and the area of Masing's loop `8 ∫ f - 4 A f(A)`
/// for the first loading curve f, in closed form for piecewise linear curves.
#[test]
fn sliders_follow_rayleighs_law_and_lose_the_area_of_masings_loop() {
    let (friction, reach) = (30.0, 2e-4);
    let law = |count: usize| Hysteresis {
        elastic: TorqueCurve::straight(4e5),
        sliders: Hysteresis::even_sliders(friction, reach, count),
    };
    let eight = law(8);
    let curve = eight.first_loading();
    for k in 0..=8 {
        let x = f64::from(k) / 8.0;
        let truth = 4e5 * x * reach + friction * (2.0 * x - x * x);
        assert!((curve.torque(x * reach) - truth).abs() < 1e-11, "{k} {} {truth}", curve.torque(x * reach));
        assert!((curve.torque(-x * reach) + truth).abs() < 1e-11);
    }
    assert!((curve.stiffest() - (4e5 + 8.0 * 2.0 * friction / (reach * 8.0) * (7.5 / 8.0))).abs() < 1e-6);
    for amplitude in [0.3 * reach, 0.77 * reach, 2.5 * reach] {
        let masing = 8.0 * curve.energy(amplitude) - 4.0 * amplitude * curve.torque(amplitude);
        assert!((eight.loss(amplitude) - masing).abs() < 1e-12, "{amplitude} {masing}");
        // The slider state that follows a closed cycle loses the same energy, after a first
        // loading.
        let mut slipped = SliderState::at_rest(&eight);
        slipped.advance(&eight, amplitude);
        let lost: f64 = [-amplitude, amplitude].iter().map(|d| slipped.advance(&eight, *d)).sum();
        assert!((lost - masing).abs() < 1e-12, "{lost} {masing}");
    }
    // Many sliders: 2/3 κ A³ / reach with κ = 2 friction / reach, Rayleigh's loss for
    // amplitudes below the reach.
    let (many, A) = (law(2000), 0.5 * reach);
    let rayleigh = 2.0 / 3.0 * (2.0 * friction / reach) * A.powi(3) / reach;
    assert!((many.loss(A) / rayleigh - 1.0).abs() < 1e-5, "{}", many.loss(A) / rayleigh);
}

#[test]
fn the_slope_of_a_transmission_error_is_its_derivative() {
    let harmonics = vec![
        Harmonic { amplitude: 3e-5, cycles: 100.0, phase: 0.3 },
        Harmonic { amplitude: -1e-5, cycles: 200.0, phase: 1.1 },
    ];
    let error = TransmissionError { element: 0, motor: 0, harmonics };
    for q in [-1.0, 0.0, 0.37] {
        let slope = (error.at(q + 1e-6) - error.at(q - 1e-6)) / 2e-6;
        // measured 1.3e-11
        assert!((slope - error.slope(q)).abs() < 1e-9, "{slope} {}", error.slope(q));
    }
}
