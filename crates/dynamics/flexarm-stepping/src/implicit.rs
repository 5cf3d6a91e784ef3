//! What implicit integrators share: a matrix that is kept, when Newton's method ends, what becomes
//! of a step that fails.
//!
//! ```text
//! r(ẍ) = 0        ẍ ← ẍ - J^-1 r        J: kept until an iteration slows down
//! ```
//! The first correction `d = J^-1 r` is the error of an extrapolation over the step. Each iteration
//! leaves a part ρ of the one before, as lengths of vectors; what a search may leave of the first
//! one is a part of it ([`Newton::leaving`]). ρ is measured where two iterations are made, in every
//! eighth step for certain (every 24th while it is small), and grows as the arm moves away from
//! where J was taken: while it is known to be small enough, a step needs one evaluation.
//!
//! A step whose iteration fails is tried again with a matrix of its start, then in halves, down to
//! `h/64`.

use nalgebra::DVector;

use crate::error::StepError;
use crate::integrator::{Current, Integrator};
use crate::iteration_matrix::IterationMatrix;
use crate::stepper::Counts;
use crate::system::SecondOrderSystem;

/// Most Newton iterations for one set of accelerations before they count as not found.
const MAX_ITERATIONS: usize = 25;
/// A step that fails is halved so many times before the run is given up.
const MOST_HALVINGS: u32 = 6;
/// A step that needed more iterations than this renews the matrix for the next one; twice as many,
/// for itself.
const RENEW_ABOVE: usize = 4;
/// Largest ρ of a matrix that is kept, unless told otherwise.
const STALE: f64 = 0.03;
/// Accepted correction over the size of the acceleration.
const TOLERANCE: f64 = 1e-9;
/// Part of the first correction that a search may leave unless it is told otherwise: errors that
/// nothing damps add up.
const TO_THE_END: f64 = 1e-6;
/// Part of what may be left that ρ may be with a matrix just taken: more is no age of the matrix
/// but something that it does not know (weight, loads, speeds), whose error has the same sign in
/// every step and may feed a mode.
const EXACT: f64 = 0.5;
/// In every step whose number is a multiple of this ρ is measured anew: in all runs that go side by
/// side at once.
const MEASURED_EVERY: u64 = 8;
/// The same while ρ is below this part of what may be left: until it has grown to that the arm
/// moves on for a while.
const MEASURED_RARELY: u64 = 24;
/// See [`MEASURED_RARELY`].
const WELL_BELOW: f64 = 0.3;
/// A first correction so many times as large as the largest of late comes from something new, of
/// which ρ says nothing.
const SUDDEN: f64 = 1.2;
/// What is left of the largest of late after each search.
const FADING: f64 = 0.95;
/// Corrections below this, over the size of the acceleration, are too near to rounding to measure
/// ρ.
const MEASURABLE: f64 = 1e-9;
/// Corrections of x below this fraction of x are rounding.
const ROUNDING: f64 = 1e-14;

/// Newton's matrix with the step that it belongs to, and the work done with it.
#[derive(Clone, Debug)]
pub(crate) struct Newton {
    pub(crate) matrix: IterationMatrix,
    /// Residual, after a solution the correction.
    pub(crate) r: DVector<f64>,
    /// Step to which matrix and memory belong (s).
    pub(crate) dt: f64,
    /// Whether the matrix is still good.
    pub(crate) factored: bool,
    /// Whether what is remembered of the steps before is to be taken anew.
    pub(crate) fresh: bool,
    /// Whether the next matrix continues the last one: same length of the step, same masses but for
    /// the motion.
    pub(crate) same_course: bool,
    iterations: u64,
    factorisations: u64,
    last_iterations: usize,
    last_correction: f64,
    /// ρ as measured last, infinite with a new matrix, and as measured first with this one.
    contraction: f64,
    first_contraction: f64,
    /// Whether it is to be measured in this step.
    measuring: bool,
    /// Part of the first correction that a search may leave.
    left: f64,
    /// Largest ρ of a matrix that is kept.
    stale: f64,
    /// Whether the matrix was taken in the search under way.
    new: bool,
    /// Largest first correction of late.
    largest_first: f64,
}

impl Newton {
    /// For n coordinates and steps of length h (s).
    pub(crate) fn new(n: usize, h: f64) -> Self {
        Self {
            matrix: IterationMatrix::new(),
            r: DVector::zeros(n),
            dt: h,
            factored: false,
            fresh: true,
            same_course: false,
            iterations: 0,
            factorisations: 0,
            last_iterations: 0,
            last_correction: 0.0,
            contraction: f64::INFINITY,
            first_contraction: f64::INFINITY,
            measuring: false,
            left: TO_THE_END,
            stale: STALE,
            new: false,
            largest_first: 0.0,
        }
    }

    /// The same, with searches that may leave this part of their first correction.
    pub(crate) fn leaving(self, left: f64) -> Self {
        Self { left, ..self }
    }

    /// The same, with a matrix that is kept up to this ρ.
    pub(crate) fn keeping(self, stale: f64) -> Self {
        Self { stale, ..self }
    }

    /// After so many whole steps the next one begins.
    pub(crate) fn begin_step(&mut self, steps: u64) {
        let every = if self.contraction <= WELL_BELOW * self.left { MEASURED_RARELY } else { MEASURED_EVERY };
        self.measuring = steps.is_multiple_of(every);
    }

    /// Matrix and memory are out of date.
    fn forget(&mut self) {
        (self.factored, self.fresh, self.same_course) = (false, true, false);
    }

    /// The matrix in `self.matrix` was inverted.
    pub(crate) fn renewed(&mut self) {
        (self.factored, self.new, self.same_course) = (true, true, true);
        (self.contraction, self.first_contraction) = (f64::INFINITY, f64::INFINITY);
        self.factorisations += 1;
    }

    /// The matrix was taken between two steps: what the next search measures counts.
    pub(crate) fn renewed_between(&mut self) {
        self.new = false;
    }

    /// A step was found in so many iterations, at most `longest` of them for one set of
    /// accelerations.
    pub(crate) fn found(&mut self, iterations: usize, longest: usize) {
        self.iterations += iterations as u64;
        self.last_iterations += iterations;
        let stale = self.contraction.is_finite() && self.contraction > self.stale;
        self.new = false;
        self.factored = longest <= RENEW_ABOVE && !stale;
    }

    /// Whether a search may end with its first correction, of that norm.
    fn ends_at_once(&mut self, norm: f64) -> bool {
        let calm = norm <= SUDDEN * self.largest_first;
        self.largest_first = norm.max(FADING * self.largest_first);
        let exact = self.first_contraction <= EXACT * self.left;
        calm && exact && !self.measuring && self.contraction <= self.left
    }

    /// An iteration left this part of the one before. With the matrix of the search itself it says
    /// nothing of those to come.
    fn measured(&mut self, contraction: f64) {
        if !self.new {
            if self.contraction.is_infinite() {
                self.first_contraction = contraction;
            }
            self.contraction = contraction;
        }
    }

    /// Work after so many steps.
    pub(crate) fn counts(&self, steps: u64) -> Counts {
        Counts { steps, evaluations: self.iterations, factorisations: self.factorisations }
    }

    /// Iterations of the last step and the relative correction with which it ended.
    pub(crate) fn last(&self) -> (usize, f64) {
        (self.last_iterations, self.last_correction)
    }
}

/// Sizes of one Newton correction, the largest over all coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sizes {
    /// Length of the correction.
    norm: f64,
    correction: f64,
    acceleration: f64,
    place: f64,
}

impl Sizes {
    /// Of a correction with this norm, before any coordinate.
    pub(crate) fn of(norm: f64) -> Self {
        Self { norm, ..Self::default() }
    }

    /// Takes in one coordinate: correction and value of its acceleration, and its place.
    pub(crate) fn include(&mut self, correction: f64, acceleration: f64, place: f64) {
        // `max` passes over NaN.
        let finite = correction.is_finite();
        self.correction = if finite { self.correction.max(correction.abs()) } else { f64::INFINITY };
        self.acceleration = self.acceleration.max(acceleration.abs());
        self.place = self.place.max(place.abs());
    }
}

/// One use of Newton's method, for accelerations at `t`.
pub(crate) struct Search {
    t: f64,
    h: f64,
    /// `dx/dẍ` of the method (s²).
    c_K: f64,
    pub(crate) iterations: usize,
    /// Whether it got a fresh matrix; for those who do not compute one at once.
    pub(crate) renewed: bool,
    /// Norms of the first correction and of the last one.
    first: f64,
    last: f64,
}

impl Search {
    pub(crate) fn new(t: f64, h: f64, c_K: f64) -> Self {
        Self { t, h, c_K, iterations: 0, renewed: false, first: 0.0, last: f64::INFINITY }
    }

    /// Whether the iteration stalls: it gets a fresh matrix.
    pub(crate) fn stalls(&self) -> bool {
        self.iterations == 2 * RENEW_ABOVE
    }

    /// Counts a correction; whether it was the last one that is needed.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where values are out of all range, [`StepError::NotConverged`] after
    /// too many iterations.
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
        // Else the contraction seen so far tells whether the next correction would be small enough.
        self.last = norm;
        Ok(!first && contraction < 0.1 && norm * contraction <= newton.left * self.first)
    }
}

/// What an implicit integrator does of its own; the rest of an [`Integrator`] is the same for all.
pub(crate) trait ImplicitStep: Send {
    /// [`Integrator::MOTION_RULE`].
    const MOTION_RULE: &'static [(f64, f64)];

    fn current(&self) -> &Current;

    fn current_mut(&mut self) -> &mut Current;

    fn newton(&self) -> &Newton;

    fn newton_mut(&mut self) -> &mut Newton;

    /// What depends on the length of the step, other than Newton's matrix.
    fn set_length(&mut self, _dt: f64) {}

    /// One step of length `newton().dt` to t; on error nothing but the matrix has changed.
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
        // Whole steps are all the same, so that their matrix lasts.
        let dt = if t == grid.next_time() && grid.is_on_step() { grid.step_size() } else { t - grid.time() };
        let steps = grid.steps();
        self.newton_mut().last_iterations = 0;
        self.newton_mut().begin_step(steps);
        cross(self, system, t, dt, MOST_HALVINGS)
    }

    fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        ImplicitStep::current_mut(self).accelerate(system)?;
        self.newton_mut().fresh = true;
        Ok(())
    }

    fn renew(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        (self.newton_mut().factored, self.newton_mut().same_course) = (false, false);
        self.restart(system)
    }

    fn counts(&self) -> Counts {
        self.newton().counts(ImplicitStep::current(self).grid.steps())
    }

    fn last_iteration(&self) -> (usize, f64) {
        self.newton().last()
    }
}

/// From the current time to t: in one step, else in two halves.
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
    // With the matrix that is there, then with one of the step's start.
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
