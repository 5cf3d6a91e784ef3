//! Vibration that a motion leaves behind.

use flexarm_analysis::*;
use nalgebra::{DMatrix, dmatrix};

/// Truth: `4 a sin²(ω τ/2) / ω²` after an acceleration a over τ and -a over τ, for a mass
/// excited by inertia and one pulled by its spring; with two per cent of damping the reduction
/// is that of the exact integral.
#[test]
fn a_mass_on_a_spring_swings_behind_a_motion_as_its_closed_form_says() {
    let (omega, a, tau, h) = (40.0, 2.0, 0.05, 1e-5);
    let half = (tau / h) as usize;
    let pulse = DMatrix::from_fn(1, 2 * half, |_, k| if k < half { a } else { -a });
    // Beside it, a mass that the motion does not excite.
    let J = dmatrix![1.0, 0.0; 0.0, 0.0; 0.0, 0.0];
    let (zero, one) = (DMatrix::zeros(2, 2), DMatrix::identity(2, 2));
    let stiffness = omega * omega;
    let K = dmatrix![stiffness, 0.0; 0.0, 9.0 * stiffness];
    let node = |M_a: f64, K_a: f64| Node {
        M: one.clone(),
        D: zero.clone(),
        K: K.clone(),
        M_a: dmatrix![M_a; 0.0],
        D_a: dmatrix![0.0; 0.0],
        K_a: dmatrix![K_a; 0.0],
        J: J.clone(),
        J_a: DMatrix::zeros(3, 1),
        servo: None,
    };
    let mode = damped_modes(&one, &zero, &K).unwrap().remove(0);
    let wanted = 4.0 * a * (0.5 * omega * tau).sin().powi(2) / stiffness;
    for node in [node(1.0, 0.0), node(0.0, -stiffness)] {
        let found = vibration_left(&node, &mode, &pulse, h, 1.0);
        assert!((found / wanted - 1.0).abs() < 1e-3, "{found:e} {wanted:e}"); // 2e-4
    }
    let damping = &one * (2.0 * 0.02 * omega);
    let damped = Node { D: damping.clone(), ..node(1.0, 0.0) };
    let mode = damped_modes(&one, &damping, &K).unwrap().remove(0);
    let lambda = mode.eigenvalue;
    let part = (lambda * tau).exp() - 1.0;
    let wanted = (part * part * a / lambda).norm() / lambda.im;
    let found = vibration_left(&damped, &mode, &pulse, h, 1.0);
    assert!((found / wanted - 1.0).abs() < 1e-3, "{found:e} {wanted:e}");
}
