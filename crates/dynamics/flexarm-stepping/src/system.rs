//! Interface between integrators and the systems they integrate: a second-order system with
//! stiffness.
//!
//! ```text
//! r(t, x, v, a) = M(x) a + D v + K x + b(t, x, v) = 0
//! ```
//! The integrators ([`crate::GeneralizedAlpha`], [`crate::Rk4`]) depend on this trait and know
//! nothing of robots. The trait provides residual, acceleration and matrices and knows nothing of
//! any integrator. n-vectors x, v, a: positions, velocities (1/s) and accelerations (1/s²) in m or
//! rad; forces in N or N m. [`crate::ReducedArm`] implements it for the flexible arm; the tests implement it
//! for a pendulum and an oscillator.

use nalgebra::{DMatrix, DVector};

use crate::error::StepError;
use crate::tree_matrix::TreeMatrices;

/// A mechanical system with n coordinates x in a vector space.
pub trait SecondOrderSystem {
    /// Returns the number of coordinates.
    fn dimension(&self) -> usize;

    /// Writes `r(t, x, v, a)`, n forces at time t (s), into `r`.
    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>);

    /// Writes the acceleration a for which the residual vanishes into `a` (n).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the mass matrix cannot be factorised.
    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError>;

    /// Writes the n × n mass matrix M at the configuration of the last `residual` call into `M`.
    fn mass(&mut self, M: &mut DMatrix<f64>);

    /// Writes `Z = c_D D + c_K K` (n × n) into `Z`: tangent damping and stiffness at the configuration
    /// of the last `residual` call. Used by Newton's method only: omitted terms cost iterations,
    /// not accuracy.
    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, Z: &mut DMatrix<f64>);

    /// Writes the stiffness matrix K of the springs about their relaxed positions (constant,
    /// symmetric, n × n) into `K`.
    fn stiffness(&mut self, K: &mut DMatrix<f64>);

    /// Accepts `x` at time `t` (s) as the end of a step: history variables of the system are
    /// updated to that state.
    fn settle(&mut self, _t: f64, _x: &DVector<f64>) {}

    /// Writes the same three matrices in tree structure into `to`, which solves them in O(n)
    /// instead of O(n²). Returns `false`, with the contents of `to` unspecified, if they have no
    /// tree structure or if n is so small that dense matrices are faster.
    fn along_tree(&mut self, _c_D: f64, _c_K: f64, _to: &mut TreeMatrices) -> bool {
        false
    }
}
