//! Residual vibration of a motion in each mode of the structure at its end.
//!
//! ```text
//! x(t) = 2 Re Σ φ (φᵀ f) / (2 λ φᵀMφ + φᵀDφ) e^(λ (t-T)),     f = -(λ² M_a + λ D_a + K_a) / λ² ∫ q̈ e^(λ (T-τ)) dτ
//! ```
//! about the equilibrium at the end T, where the commands q are at rest. The structure at the end
//! is used throughout: earlier excitation has decayed. Not here: shapers that reduce it
//! (`shaping`).

use nalgebra::{Complex, DMatrix, DVector};

use crate::damped_modes::DampedMode;
use crate::inversion::Node;

/// Computes the amplitude of the TCP oscillation that commands leave in a mode when they come to
/// rest.
///
/// * `node`: the structure at the end, with the controllers in its matrices; the first three TCP
///   components are the position.
/// * `accelerations`: of the commands, m×N, `step_s` apart, the last at the end.
/// * `detuned`: factor on the eigenvalue in the spectrum of the motion, 1 for the nominal mode.
///
/// Returns metres; the trapezoidal rule needs some ten samples per period of the mode.
pub fn vibration_left(node: &Node, mode: &DampedMode, accelerations: &DMatrix<f64>, step_s: f64, detuned: f64) -> f64 {
    let (lambda, phi) = (mode.eigenvalue, &mode.shape);
    let last = accelerations.ncols().saturating_sub(1);
    // ∫ q̈ e^(λ (T-τ)) dτ by the trapezoidal rule.
    let mut spectrum = DVector::from_element(accelerations.nrows(), Complex::new(0.0, 0.0));
    for (k, column) in accelerations.column_iter().enumerate() {
        let weight = if k == 0 || k == last { 0.5 * step_s } else { step_s };
        let turn = (lambda * (detuned * step_s * (last - k) as f64)).exp() * weight;
        spectrum.iter_mut().zip(column.iter()).for_each(|(sum, a)| *sum += turn * *a);
    }
    // Force per acceleration, and what the mode opposes to it.
    let complex = |A: &DMatrix<f64>| A.map(|x| Complex::new(x, 0.0));
    let per_acceleration = complex(&node.M_a) + complex(&node.D_a) / lambda + complex(&node.K_a) / (lambda * lambda);
    let force = phi.dot(&(per_acceleration * spectrum));
    let own = phi.dot(&(complex(&node.M) * phi)) * lambda * 2.0 + phi.dot(&(complex(&node.D) * phi));
    let tool = complex(&node.J.rows(0, 3).into_owned()) * phi;
    2.0 * tool.norm() * (force / own).norm()
}
