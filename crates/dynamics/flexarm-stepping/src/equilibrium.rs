//! Newton's method for the equilibrium of the elastic coordinates, `r(e) = 0`, for any [`Forces`]: under weight,
//! under a wrench at the tool, in steady rotation.

use nalgebra::DVector;

use crate::error::StepError;

/// Accepted unbalanced force relative to the largest force.
pub(crate) const TOLERANCE: f64 = 1e-13;
/// Maximum number of iterations, and that with hysteresis: the first loading curve may be soft,
/// then stiff, and full steps may oscillate between its pieces.
const MAX_ITERATIONS: [usize; 2] = [30, 200];
/// Maximum number of halvings of a step that leads away from the equilibrium of a gear with
/// hysteresis.
pub(crate) const MAX_HALVINGS: usize = 12;

/// Forces on the elastic coordinates.
pub(crate) trait Forces {
    /// Returns the unbalanced forces at `e`, and the largest of the forces that they consist of.
    fn unbalanced(&mut self, e: &DVector<f64>) -> Result<(DVector<f64>, f64), StepError>;

    /// Returns the step of Newton's method at `e`, to be subtracted, for the unbalanced forces `r`,
    /// and `scale`, the largest of the forces that they consist of.
    fn step(&mut self, e: &DVector<f64>, r: &DVector<f64>, scale: f64) -> Result<DVector<f64>, StepError>;

    /// Returns whether a gear has hysteresis.
    fn has_hysteresis(&self) -> bool;

    /// Returns the time (s), for messages.
    fn time(&self) -> f64;
}

/// An equilibrium.
pub(crate) struct Equilibrium {
    pub(crate) e: DVector<f64>,
    /// Unbalanced force relative to the largest force.
    pub(crate) residual: f64,
    pub(crate) iterations: usize,
}

/// Returns whether an iteration has converged, or is limited by round-off: the residual is small and no
/// longer falls.
pub(crate) fn settled(iteration: usize, residual: f64, previous: f64) -> bool {
    residual <= TOLERANCE || (iteration > 2 && residual < 1e-9 && residual >= 0.5 * previous)
}

/// Finds the equilibrium from near coordinates.
///
/// # Errors
/// [`StepError::NoEquilibrium`], and those of the forces.
pub(crate) fn equilibrium(forces: &mut impl Forces, mut e: DVector<f64>) -> Result<Equilibrium, StepError> {
    let searches = forces.has_hysteresis();
    let most = MAX_ITERATIONS[usize::from(searches)];
    let (mut residual, mut iterations) = (f64::INFINITY, 0);
    loop {
        let (r, scale) = forces.unbalanced(&e)?;
        let previous = residual;
        residual = if e.is_empty() { 0.0 } else { r.amax() / scale.max(f64::MIN_POSITIVE) };
        if settled(iterations, residual, previous) {
            return Ok(Equilibrium { e, residual, iterations });
        }
        if !residual.is_finite() || iterations == most {
            return Err(StepError::NoEquilibrium { t: forces.time(), iterations, residual });
        }
        let step = forces.step(&e, &r, scale)?;
        // Beyond a backlash, a small load may be below the round-off of the deflection.
        if step.amax() <= 2.0 * f64::EPSILON * e.amax() {
            return Ok(Equilibrium { e, residual, iterations });
        }
        // The full step may overshoot for large deflections: no coordinate moves by more than 0.5.
        let mut part = (0.5 / step.amax()).min(1.0);
        for _ in 0..if searches { MAX_HALVINGS } else { 0 } {
            if forces.unbalanced(&(&e - &step * part))?.0.norm() < r.norm() {
                break;
            }
            part *= 0.5;
        }
        e -= step * part;
        iterations += 1;
    }
}
