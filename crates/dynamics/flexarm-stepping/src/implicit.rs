//! Common parts of implicit integrators: reuse of the Newton matrix, convergence test, retry of
//! failed steps.
//!
//! ```text
//! r(ẍ) = 0        ẍ ← ẍ - J^-1 r        J: kept until an iteration slows down
//! ```
//! The first correction `d = J^-1 r` is the error of the extrapolation over the step. Each
//! iteration reduces the norm of the correction by a factor ρ; the permitted remaining error is a
//! fraction of the first correction ([`Newton::leaving`]). ρ is measured whenever two iterations
//! are made, at least in every eighth step (every 24th while it is small), and grows as the arm
//! moves away from the configuration at which J was computed. While ρ is known to be small enough,
//! a step needs one evaluation, unless its first correction points against the one before. This is
//! the sign of a mode with less than four steps per period: the extrapolation misses its
//! acceleration by several times its size, and what is left of that in every step feeds the mode if
//! its damping is smaller.
//!
//! A step whose iteration fails is repeated with a matrix computed at its start, then in halves,
//! down to `h/64`.
//!
//! Not here: the formulas of a method (`steppers`), the structure of the matrix
//! (`iteration_matrix.rs`).

use nalgebra::DVector;

use crate::error::StepError;
use crate::integrator::{Current, Integrator};
use crate::iteration_matrix::IterationMatrix;
use crate::stepper::Counts;
use crate::system::SecondOrderSystem;

/// Maximum number of Newton iterations for one set of accelerations.
const MAX_ITERATIONS: usize = 25;
/// Maximum number of halvings of a failed step.
const MAX_HALVINGS: u32 = 6;
/// Number of iterations above which a step renews the matrix for the next one; at twice this number
/// it renews the matrix for itself.
const RENEW_ABOVE: usize = 4;
/// Maximum ρ of a matrix that is kept.
const STALE: f64 = 0.03;
/// Accepted correction relative to the acceleration.
const TOLERANCE: f64 = 1e-9;
/// Default of the permitted remaining fraction of the first correction: errors that nothing damps
/// accumulate.
const TO_THE_END: f64 = 1e-6;
/// Maximum ρ of a new matrix relative to the permitted remaining fraction. A larger ρ is not due to
/// the age of the matrix but to terms missing from it (weight, loads, velocities), whose error has
/// the same sign in every step and may excite a mode.
const EXACT: f64 = 0.5;
/// ρ is measured in every step whose number is a multiple of this.
const MEASURED_EVERY: u64 = 8;
/// Interval while ρ is small (see [`WELL_BELOW`]) and cannot become too large within a few steps.
const MEASURED_RARELY: u64 = 24;
/// ρ relative to the permitted remaining fraction below which [`MEASURED_RARELY`] applies.
const WELL_BELOW: f64 = 0.3;
/// A first correction that exceeds the recent maximum by this factor has a new cause, for which ρ
/// is not known.
const SUDDEN: f64 = 1.2;
/// Decay factor of the recent maximum per search.
const FADING: f64 = 0.95;
/// Corrections below this, relative to the acceleration, are too close to round-off to measure ρ.
const MEASURABLE: f64 = 1e-9;
/// Corrections of x below this fraction of x are round-off.
const ROUNDING: f64 = 1e-14;

/// Newton matrix with its step size, and counters of the work done.
#[derive(Clone, Debug)]
pub(crate) struct Newton {
    pub(crate) matrix: IterationMatrix,
    /// Residual; after a solution the correction.
    pub(crate) r: DVector<f64>,
    /// Step size for which matrix and history are valid (s).
    pub(crate) dt: f64,
    /// Whether the matrix is still valid.
    pub(crate) factored: bool,
    /// Whether the history of previous steps has to be initialised again.
    pub(crate) fresh: bool,
    iterations: u64,
    factorisations: u64,
    last_iterations: usize,
    last_correction: f64,
    /// ρ as measured last (infinite with a new matrix), and as measured first with this matrix.
    contraction: f64,
    first_contraction: f64,
    /// Whether ρ is to be measured in this step.
    measuring: bool,
    /// Permitted remaining fraction of the first correction.
    left: f64,
    /// Whether the matrix was computed during the current search.
    new: bool,
    /// Decaying maximum of the first corrections.
    largest_first: f64,
    /// First correction of the last search.
    first: DVector<f64>,
}

impl Newton {
    /// Creates the state for n coordinates and step size `h` (s).
    pub(crate) fn new(n: usize, h: f64) -> Self {
        Self {
            matrix: IterationMatrix::new(),
            r: DVector::zeros(n),
            dt: h,
            factored: false,
            fresh: true,
            iterations: 0,
            factorisations: 0,
            last_iterations: 0,
            last_correction: 0.0,
            contraction: f64::INFINITY,
            first_contraction: f64::INFINITY,
            measuring: false,
            left: TO_THE_END,
            new: false,
            largest_first: 0.0,
            first: DVector::zeros(n),
        }
    }

    /// Sets the permitted remaining fraction of the first correction.
    pub(crate) fn leaving(self, left: f64) -> Self {
        Self { left, ..self }
    }

    /// Begins the next step after `steps` complete ones.
    pub(crate) fn begin_step(&mut self, steps: u64) {
        let every = if self.contraction <= WELL_BELOW * self.left { MEASURED_RARELY } else { MEASURED_EVERY };
        self.measuring = steps.is_multiple_of(every);
    }

    /// Invalidates matrix and history.
    fn forget(&mut self) {
        (self.factored, self.fresh) = (false, true);
    }

    /// Records that `self.matrix` was inverted.
    pub(crate) fn renewed(&mut self) {
        (self.factored, self.new) = (true, true);
        (self.contraction, self.first_contraction) = (f64::INFINITY, f64::INFINITY);
        self.factorisations += 1;
    }

    /// Records that the matrix was computed between two steps, so that the next search may measure
    /// ρ.
    pub(crate) fn renewed_between(&mut self) {
        self.new = false;
    }

    /// Records a converged step with its number of iterations, at most `longest` of them for one
    /// set of accelerations.
    pub(crate) fn found(&mut self, iterations: usize, longest: usize) {
        self.iterations += iterations as u64;
        self.last_iterations += iterations;
        let stale = self.contraction.is_finite() && self.contraction > STALE;
        self.new = false;
        self.factored = longest <= RENEW_ABOVE && !stale;
    }

    /// Returns whether a search may end with its first correction `self.r`, of norm `norm`.
    fn ends_at_once(&mut self, norm: f64) -> bool {
        let calm = norm <= SUDDEN * self.largest_first;
        self.largest_first = norm.max(FADING * self.largest_first);
        let turned = self.r.dot(&self.first) < 0.0;
        self.first.copy_from(&self.r);
        let exact = self.first_contraction <= EXACT * self.left;
        calm && !turned && exact && !self.measuring && self.contraction <= self.left
    }

    /// Records the measured ρ. A matrix computed during the search is exact there, so that its ρ is
    /// not representative of later steps.
    fn measured(&mut self, contraction: f64) {
        if !self.new {
            if self.contraction.is_infinite() {
                self.first_contraction = contraction;
            }
            self.contraction = contraction;
        }
    }

    /// Returns the work after `steps` complete steps.
    pub(crate) fn counts(&self, steps: u64) -> Counts {
        Counts { steps, evaluations: self.iterations, factorisations: self.factorisations }
    }

    /// Returns the iterations of the last step and its final relative correction.
    pub(crate) fn last(&self) -> (usize, f64) {
        (self.last_iterations, self.last_correction)
    }
}

/// Sizes of one Newton correction, as maxima over all coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sizes {
    /// Norm of the correction.
    norm: f64,
    correction: f64,
    acceleration: f64,
    place: f64,
}

impl Sizes {
    /// Creates the sizes for a correction with this norm, before any coordinate is included.
    pub(crate) fn of(norm: f64) -> Self {
        Self { norm, ..Self::default() }
    }

    /// Includes one coordinate: correction and value of its acceleration, and its position.
    pub(crate) fn include(&mut self, correction: f64, acceleration: f64, place: f64) {
        // `max` ignores NaN.
        let finite = correction.is_finite();
        self.correction = if finite { self.correction.max(correction.abs()) } else { f64::INFINITY };
        self.acceleration = self.acceleration.max(acceleration.abs());
        self.place = self.place.max(place.abs());
    }
}

/// One run of Newton's method, for the accelerations at `t`.
pub(crate) struct Search {
    t: f64,
    h: f64,
    /// `dx/dẍ` of the method (s²).
    c_K: f64,
    pub(crate) iterations: usize,
    /// Norms of the first and of the last correction.
    first: f64,
    last: f64,
}

impl Search {
    pub(crate) fn new(t: f64, h: f64, c_K: f64) -> Self {
        Self { t, h, c_K, iterations: 0, first: 0.0, last: f64::INFINITY }
    }

    /// Returns whether the iteration stalls and needs a fresh matrix.
    pub(crate) fn stalls(&self) -> bool {
        self.iterations == 2 * RENEW_ABOVE
    }

    /// Counts a correction; returns whether the iteration has converged.
    ///
    /// # Errors
    /// [`StepError::Diverged`] if values are out of range, [`StepError::NotConverged`] after too
    /// many iterations.
    pub(crate) fn ends(&mut self, sizes: Sizes, newton: &mut Newton) -> Result<bool, StepError> {
        let Sizes { norm, correction, acceleration: size, place } = sizes;
        let Self { t, h, c_K, .. } = *self;
        self.iterations += 1;
        if !correction.is_finite() || place > 1e6 {
            let place = if correction.is_finite() { place } else { f64::INFINITY };
            let what = format!("a coordinate reached {place:.1e}");
            return Err(StepError::Diverged { t, h, what });
        }
        newton.last_correction = if size > 0.0 { correction / size } else { 0.0 };
        let (first, contraction) = (self.iterations == 1, norm / self.last);
        if first {
            self.first = norm;
        } else if correction > MEASURABLE * size {
            newton.measured(contraction);
        }
        let enough = first && newton.ends_at_once(norm);
        if enough || correction <= TOLERANCE * size || c_K * correction <= ROUNDING * place {
            return Ok(true);
        }
        if self.iterations == MAX_ITERATIONS {
            return Err(StepError::NotConverged { t, h, iterations: self.iterations, correction: correction / size });
        }
        // Otherwise estimate from the contraction whether the next correction would be small
        // enough.
        self.last = norm;
        Ok(!first && contraction < 0.1 && norm * contraction <= newton.left * self.first)
    }
}

/// Method-specific part of an implicit [`Integrator`]; the rest is common.
pub(crate) trait ImplicitStep: Clone + Send {
    /// [`Integrator::MOTION_RULE`].
    const MOTION_RULE: &'static [(f64, f64)];

    fn current(&self) -> &Current;

    fn current_mut(&mut self) -> &mut Current;

    fn newton(&self) -> &Newton;

    fn newton_mut(&mut self) -> &mut Newton;

    /// Updates quantities other than Newton's matrix that depend on the step size.
    fn set_length(&mut self, _dt: f64) {}

    /// Takes one step of size `newton().dt` to `t`; on error only the matrix has changed.
    ///
    /// It computes the matrix if `newton().factored` is false and the history if `newton().fresh` is
    /// true, iterates with a [`Search`], reports the iterations to [`Newton::found`], and moves the
    /// grid of `current` to `t`.
    fn attempt(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError>;
}

impl<M: ImplicitStep> Integrator for M {
    const MOTION_RULE: &'static [(f64, f64)] = M::MOTION_RULE;

    fn current(&self) -> &Current {
        ImplicitStep::current(self)
    }

    fn current_mut(&mut self) -> &mut Current {
        ImplicitStep::current_mut(self)
    }

    fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError> {
        let grid = &ImplicitStep::current(self).grid;
        // Complete steps use exactly the same step size, so that their matrix can be kept.
        let dt = if t == grid.next_time() && grid.is_on_step() { grid.step_size() } else { t - grid.time() };
        let steps = grid.steps();
        self.newton_mut().last_iterations = 0;
        self.newton_mut().begin_step(steps);
        cross(self, system, t, dt, MAX_HALVINGS)
    }

    fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        ImplicitStep::current_mut(self).accelerate(system)?;
        self.newton_mut().fresh = true;
        Ok(())
    }

    fn renew(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.newton_mut().factored = false;
        self.restart(system)
    }

    fn counts(&self) -> Counts {
        self.newton().counts(ImplicitStep::current(self).grid.steps())
    }

    fn copy(&self) -> Option<Self> {
        Some(self.clone())
    }

    fn last_iteration(&self) -> (usize, f64) {
        self.newton().last()
    }
}

/// Advances from the current time to `t`: in one step, or if that fails in two halves.
fn cross(
    method: &mut impl ImplicitStep,
    system: &mut impl SecondOrderSystem,
    t: f64,
    dt: f64,
    halvings: u32,
) -> Result<(), StepError> {
    if dt != method.newton().dt {
        method.newton_mut().dt = dt;
        method.set_length(dt);
        method.newton_mut().forget();
    }
    // First with the existing matrix, then with one computed at the start of the step.
    let kept = method.newton().factored;
    let mut result = method.attempt(system, t);
    if result.is_err() && kept {
        method.newton_mut().forget();
        result = method.attempt(system, t);
    }
    let Err(error) = result else { return Ok(()) };
    method.newton_mut().forget();
    if halvings == 0 {
        return Err(error);
    }
    cross(method, system, t - 0.5 * dt, 0.5 * dt, halvings - 1)?;
    cross(method, system, t, 0.5 * dt, halvings - 1)
}
