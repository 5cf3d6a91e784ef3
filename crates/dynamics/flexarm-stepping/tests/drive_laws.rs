//! Torque curves and friction of drives.

use flexarm_stepping::*;

/// Truth: areas of triangles and trapezia.
#[test]
fn a_spring_with_play_stores_energy_only_beyond_it() {
    let curve = TorqueCurve::backlash(1000.0, 0.01);
    assert_eq!((curve.torque(0.005), curve.slope(0.0), curve.energy(-0.01)), (0.0, 0.0, 0.0));
    assert!((curve.torque(-0.03) + 20.0).abs() < 1e-12);
    assert!((curve.energy(0.03) - 0.5 * 1000.0 * 0.02 * 0.02).abs() < 1e-12);
    assert!((curve.energy(-0.03) - curve.energy(0.03)).abs() < 1e-12);
}

#[test]
fn curves_that_fall_or_let_go_are_refused() {
    assert!(TorqueCurve::new(&[[0.0, 0.0]]).is_err());
    assert!(TorqueCurve::new(&[[-1.0, -1.0], [0.0, 0.0], [1.0, -0.5]]).is_err());
    assert!(TorqueCurve::new(&[[-1.0, -1.0], [0.0, 0.0], [1.0, 0.0]]).is_err());
    let soft = TorqueCurve::new(&[[-0.01, -100.0], [-0.001, -2.0], [0.001, 2.0], [0.01, 100.0]]).unwrap();
    assert!((soft.torque(0.0005) - 1.0).abs() < 1e-12 && (soft.stiffest() - 98.0 / 0.009).abs() < 1e-9);
}

/// The slope is the derivative of the torque, by central differences; measured 1e-9.
#[test]
fn friction_slope_is_the_derivative_of_its_torque() {
    let f = Friction { viscous: 3.0, coulomb: 20.0, stribeck: 8.0, stribeck_velocity: 0.2, regularisation: 0.05 };
    for rate in [-0.3, -0.02, 0.0, 0.01, 0.5] {
        let numeric = (f.torque(rate + 1e-6) - f.torque(rate - 1e-6)) / 2e-6;
        assert!((numeric - f.slope(rate)).abs() < 1e-6 * (1.0 + f.slope(rate).abs()), "{rate}");
    }
}
