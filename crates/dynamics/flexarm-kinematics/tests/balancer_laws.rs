//! Force laws of balancers.

use flexarm_kinematics::*;

fn laws() -> Vec<(BalancerLaw, Vec<f64>)> {
    let gas = |pulls, exponent, slope| {
        BalancerLaw::Gas(GasLaw { force: 27e3, opposing: 170.0, at: 0.6, slope, exponent, pulls })
    };
    let points = [[-1.0, 30.0], [-0.2, 80.0], [0.1, 80.0], [0.5, -20.0], [1.5, -60.0]];
    vec![
        (BalancerLaw::Linear { rate: 4e4, free: 0.5, preload: 700.0 }, vec![0.2, 0.5, 0.9]),
        (gas(true, 1.0, 1.7), vec![0.5, 0.6, 0.9]),
        (gas(true, 1.4, 1.7), vec![0.5, 0.6, 0.9]),
        (gas(false, 1.3, 1.7), vec![0.3, 0.6, 0.9]),
        (gas(false, 1.0, 0.0), vec![0.3, 0.6, 0.9]),
        (BalancerLaw::Sine { amplitude: 9e3, zero: -1.4 }, vec![-2.0, -1.4, 0.3]),
        (BalancerLaw::Curve(BalancerCurve::new(&points).unwrap()), vec![-1.5, -0.6, 0.0, 0.3, 1.1, 2.0]),
    ]
}

/// T = dU/dx and k = dT/dx by central differences of every law; measured below 2e-9 relative.
#[test]
fn tension_and_rate_are_the_derivatives_of_the_energy() {
    let h = 1e-5;
    for (law, places) in laws() {
        for x in places {
            let T = (law.energy(x + h) - law.energy(x - h)) / (2.0 * h);
            let k = (law.tension(x + h) - law.tension(x - h)) / (2.0 * h);
            assert!((T - law.tension(x)).abs() < 1e-7 * (1.0 + T.abs()), "{law:?} at {x}: {T}");
            assert!((k - law.rate(x)).abs() < 1e-6 * (1.0 + k.abs()), "{law:?} at {x}: {k}");
        }
    }
}

/// Truth: Boyle's law, p V constant, and Poisson's, p V^n constant.
#[test]
fn a_gas_at_half_its_volume_presses_twice_as_hard_and_more_if_it_cannot_cool() {
    let at_half = |exponent| {
        let gas = GasLaw { force: 1000.0, opposing: 0.0, at: 0.5, slope: 2.0, exponent, pulls: false };
        BalancerLaw::Gas(gas).tension(0.25)
    };
    assert!((at_half(1.0) + 2000.0).abs() < 1e-9);
    assert!((at_half(1.4) + 1000.0 * 2f64.powf(1.4)).abs() < 1e-9);
    let gas = GasLaw { force: 1.0, opposing: 0.0, at: 0.5, slope: 2.0, exponent: 1.0, pulls: true };
    assert_eq!(gas.end(), 1.0);
    assert!(BalancerLaw::Gas(gas).tension(1.01).is_nan());
}

#[test]
fn a_curve_goes_through_its_points_and_does_not_overshoot_them() {
    let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 10.0], [3.0, 10.0]];
    let law = BalancerLaw::Curve(BalancerCurve::new(&points).unwrap());
    for [x, T] in points {
        assert!((law.tension(x) - T).abs() < 1e-12);
    }
    assert!((0..=300).all(|k| (-1e-12..=10.0 + 1e-12).contains(&law.tension(f64::from(k) * 0.01))));
    assert!(matches!(BalancerCurve::new(&points[..1]), Err(BalancerCurveError::TooFew { found: 1 })));
    assert!(matches!(BalancerCurve::new(&[[1.0, 0.0], [1.0, 2.0]]), Err(BalancerCurveError::Order { .. })));
    assert!(matches!(BalancerCurve::new(&[[1.0, f64::NAN], [2.0, 2.0]]), Err(BalancerCurveError::NotFinite { .. })));
}
