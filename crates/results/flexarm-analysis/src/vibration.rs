//! Residual vibration of a motion in each mode of the structure at its end.
//!
//! ```text
//! x(t) = 2 Re Σ φ (φᵀ f) / (2 λ φᵀMφ + φᵀDφ) e^(λ (t-T)),     f = -(λ² M_a + λ D_a + K_a) / λ² ∫ q̈ e^(λ (T-τ)) dτ
//! ```
//! about the equilibrium at the end T, where the commands q are at rest. The structure at the end
//! is used throughout: earlier excitation has decayed.

use nalgebra::{Complex, DMatrix, DVector};

use crate::damped_modes::DampedMode;
use crate::inversion::Node;

/// Computes the amplitude of the TCP oscillation (m) that commands leave in a mode when they come
/// to rest.
///
/// * `node`: the structure at the end, with the controllers in its matrices; the first three TCP
///   components are the position.
/// * `accelerations`: of the commands, m×N, `step_s` apart, the last at the end.
/// * `detuned`: factor on the eigenvalue in the spectrum of the motion, 1 for the nominal mode.
pub fn vibration_left(node: &Node, mode: &DampedMode, accelerations: &DMatrix<f64>, step_s: f64, detuned: f64) -> f64 {
    let (lambda, phi) = (mode.eigenvalue, &mode.shape);
    let last = accelerations.ncols().saturating_sub(1);
    let mut spectrum = DVector::from_element(accelerations.nrows(), Complex::new(0.0, 0.0));
    for (k, column) in accelerations.column_iter().enumerate() {
        let weight = if k == 0 || k == last { 0.5 * step_s } else { step_s };
        let turn = (lambda * (detuned * step_s * (last - k) as f64)).exp() * weight;
        spectrum.iter_mut().zip(column.iter()).for_each(|(sum, a)| *sum += turn * *a);
    }
    let complex = |A: &DMatrix<f64>| A.map(|x| Complex::new(x, 0.0));
    let per_acceleration = complex(&node.M_a) + complex(&node.D_a) / lambda + complex(&node.K_a) / (lambda * lambda);
    let force = phi.dot(&(per_acceleration * spectrum));
    let own = phi.dot(&(complex(&node.M) * phi)) * lambda * 2.0 + phi.dot(&(complex(&node.D) * phi));
    let tool = complex(&node.J.rows(0, 3).into_owned()) * phi;
    2.0 * tool.norm() * (force / own).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damped_modes::damped_modes;
    use nalgebra::dmatrix;

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
}
