//! The seam between integrators and what they integrate: a second-order system with stiffness.
//!
//! ```text
//! r(t, x, v, a) = M(x) a + D v + K x + b(t, x, v) = 0
//! ```
//! The integrators ([`crate::GeneralizedAlpha`], [`crate::Rk4`]) know this trait and nothing of robots.
//! [`crate::ReducedArm`] is the flexible arm behind it; the tests put a pendulum and an oscillator there.

use nalgebra::DVector;

use crate::error::StepError;

/// A mechanical system in coordinates x of a vector space.
pub trait SecondOrderSystem {
    /// Number of coordinates.
    fn dimension(&self) -> usize;

    /// `r(t, x, v, a)` (N or N m), written into `r`.
    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>);

    /// Acceleration for which the residual vanishes, written into `a`.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the mass matrix cannot be solved.
    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError>;

    /// Factors `M + (c_D D + c_K K)(1 + c_h2 M^-1 K)` at the configuration of the last `residual` call.
    ///
    /// # Errors
    /// [`StepError::Singular`] if it is not positive definite.
    fn factor_iteration_matrix(&mut self, t: f64, c_D: f64, c_K: f64, c_h2: f64) -> Result<(), StepError>;

    /// Replaces `r` by the solution with the last factorised matrix.
    fn solve_iteration(&mut self, r: &mut DVector<f64>);

    /// `M^-1 K a` with the mass matrix of the last factorisation with `c_h2 > 0`, written into `out`.
    fn inverse_mass_times_stiffness(&mut self, a: &DVector<f64>, out: &mut DVector<f64>);
}
