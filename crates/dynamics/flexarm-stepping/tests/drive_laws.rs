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

/// The torque of a curve is the derivative of its work, and its slope that of the torque, by central
/// differences.
#[test]
fn torque_and_slope_of_a_curve_are_derivatives_of_its_work() {
    let curve = TorqueCurve::new(&[[-0.02, -90.0], [-0.005, -6.0], [0.004, 6.0], [0.03, 150.0]]).unwrap();
    let mut worst = [0.0_f64; 2];
    for e in [-0.05, -0.011, -0.001, 0.002, 0.013, 0.04] {
        let h = 1e-7;
        let torque = (curve.energy(e + h) - curve.energy(e - h)) / (2.0 * h);
        let slope = (curve.torque(e + h) - curve.torque(e - h)) / (2.0 * h);
        worst[0] = worst[0].max((torque / curve.torque(e) - 1.0).abs());
        worst[1] = worst[1].max((slope / curve.slope(e) - 1.0).abs());
        // Scaled by two, all of them double.
        let twice = curve.scaled(2.0);
        assert_eq!([twice.torque(e), twice.slope(e)], [2.0 * curve.torque(e), 2.0 * curve.slope(e)]);
    }
    eprintln!("{worst:?}");
    assert!(worst.iter().all(|worst| *worst < 1e-9), "{worst:?}"); // measured 2.8e-11 and 3.1e-11
}

/// Truth: stiffness, damping and inertia of motors on joints keep the energy, `qᵀ K q = θᵀ K_m θ` with
/// `q = C θ`, and torques the power, `τᵀ q̇ = τ_mᵀ θ̇`.
#[test]
fn coupled_gears_keep_energy_and_power() {
    use nalgebra::{DMatrix, DVector};
    let C = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, -0.5, 1.0, 0.0, 0.25, 0.3, -1.0]);
    let C_inverse = C.clone().try_inverse().unwrap();
    let k = [2e4, 3e4, 5e3];
    let K = GearCoupling::on_joints(&C_inverse, &k);
    let coupling = GearCoupling { elements: vec![], coordinates: vec![0, 1, 2], C, C_inverse };
    let theta = DVector::from_vec(vec![0.3, -0.7, 1.1]);
    let (q, tau) = (&coupling.C * &theta, DVector::from_vec(vec![12.0, -30.0, 7.0]));
    let energy: f64 = k.iter().zip(theta.iter()).map(|(k, t)| k * t * t).sum();
    let of_energy = (q.dot(&(&K * &q)) / energy - 1.0).abs();
    let motors = DVector::from_vec(coupling.motor_torques(tau.as_slice()));
    let of_power = (motors.dot(&theta) - tau.dot(&q)).abs();
    eprintln!("{of_energy:.1e} {of_power:.1e}");
    assert!(of_energy < 1e-13 && of_power < 1e-12, "{of_energy:e} {of_power:e}"); // measured 0 and 0
}
