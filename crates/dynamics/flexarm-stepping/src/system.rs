//! The seam between integrators and what they integrate: a second-order system with stiffness.
//!
//! ```text
//! r(t, x, v, a) = M(x) a + D v + K x + b(t, x, v) = 0
//! ```
//! The integrators ([`crate::GeneralizedAlpha`], [`crate::Rk4`]) know this trait and nothing of
//! robots; the trait knows nothing of any integrator: it gives residual, acceleration and matrices,
//! and what is made of these is theirs. [`crate::ReducedArm`] is the flexible arm behind it; the
//! tests put a pendulum and an oscillator there.

use nalgebra::{DMatrix, DVector};

use crate::error::StepError;
use crate::mode_matrix::ModeMatrices;
use crate::tree_matrix::TreeMatrices;

/// A mechanical system in n coordinates x of a vector space.
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

    /// Mass matrix M at the configuration of the last `residual` call, n × n, written over all of
    /// `M`.
    fn mass(&mut self, M: &mut DMatrix<f64>);

    /// `c_D D + c_K K`, damping and stiffness as they are tangent to the residual at the
    /// configuration of its last call, n × n, written over all of `C`. For Newton's method: what is
    /// left out costs iterations and no accuracy.
    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, C: &mut DMatrix<f64>);

    /// K of the springs about their relaxed places, constant and symmetric, n × n, written over all
    /// of `K`.
    fn stiffness(&mut self, K: &mut DMatrix<f64>);

    /// A step has ended at t (s) with x: what the system remembers of its way belongs to that time
    /// from here on.
    fn settle(&mut self, _t: f64, _x: &DVector<f64>) {}

    /// The same three matrices where they sit on a tree, into `to`, from which they are solved in
    /// O(n) instead of O(n²). False where they do not, or where n is so small that dense ones are
    /// faster: `to` then holds anything.
    fn along_tree(&mut self, _c_D: f64, _c_K: f64, _to: &mut TreeMatrices) -> bool {
        false
    }

    /// The same three matrices where many of the coordinates are modes that meet the others in mass
    /// alone, and each other not at all. False where they are not, as above.
    fn with_modes(&mut self, _c_D: f64, _c_K: f64, _to: &mut ModeMatrices) -> bool {
        false
    }
}
