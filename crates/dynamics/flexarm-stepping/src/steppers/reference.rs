//! Integration with error control by the solvers of `diffsol`: the reference for the steppers of
//! fixed step size.
//!
//! The second-order system is written as `y = [x; v]`, `ẏ = [v; a(t, x, v)]`. The solver chooses
//! order and step size such that its estimate of the local error stays below the tolerance, and
//! steps past the points `t0 + k h`, at which its continuous output is evaluated
//! ([`Integrator::step`]) with the same accuracy as at the ends of its steps. The error of a whole
//! run is larger than the tolerance: over 4 s of the reference arm 100 to 200 times (BDF, 1e-6 to
//! 1e-9).
//!
//! **Choice of the method.** The highest modes decide (measured in `tests/reference_arm.rs`,
//! `tests/reference_stepper.rs`). BDF of variable order, the default, is nine times cheaper than
//! the explicit pair if they are well damped, and costs about as much if not: its orders 3 to 5 are
//! unstable near the imaginary axis, so that the error control keeps the step near `1/ω` of a
//! lightly damped mode, however small its amplitude. Only the A-stable ESDIRK can take larger
//! steps; it is of third order, so it is preferable for modes in the kHz range or loose tolerances.
//!
//! **Restarts.** A jump of the load inside a step causes rejected steps: with
//! [`Reference::restart_at`] the solver ends a step there and restarts. [`Integrator::restart`] is
//! for a system that was changed from outside.
//!
//! **Ownership.** A solver of `diffsol` borrows its problem, and the problem owns the equations, so
//! neither can be stored beside a system that the caller lends for one call. Each call that needs
//! more of the solution builds problem and solver around the system, runs the solver and takes its
//! state back. That state contains the history (for BDF the differences and the order), so the
//! method loses nothing except the Jacobian. An implicit solver therefore takes 50 steps at a time,
//! as many as it would keep its Jacobian anyway, and the points that it passes are queued.
//!
//! Sources: BDF of variable order [Shampine & Reichelt 1997], ESDIRK3(4) [Jørgensen, Kristensen &
//! Thomsen 2018], explicit 5(4) pair [Tsitouras 2011].
//!
//! Not here: evaluation of ẍ (`reduced`), the steppers of fixed step size.

use std::sync::Arc;

use std::cell::RefCell;
use std::collections::VecDeque;

use diffsol::{
    BdfState, DiffsolError, NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations, OdeSolverMethod,
    OdeSolverState, OdeSolverStopReason, RkState, Tableau, VectorCommon,
};
use flexarm_settings::Words;
use nalgebra::DVector;

use crate::error::StepError;
use crate::integrator::{Current, Integrator, ReducedStepper};
use crate::plant::Plant;
use crate::stepper::{Counts, Stepper};
use crate::steppers::{Method, StepRule, StepperEntry, StepperKind, StepperSetting};
use crate::system::SecondOrderSystem;

pub(super) static ENTRY: StepperEntry = StepperEntry {
    name: "reference",
    aliases: &[],
    help: "Error control instead of a fixed step, for converged results",
    steps: StepRule::ByErrorControl,
    default_step_s: 1e-3,
    order: 0,
    maximal: false,
    allocates: true,
    with: |options| StepperKind::Reference(options.reference),
};

/// Position scale below which the absolute tolerance applies: absolute over relative tolerance (m,
/// rad).
const SMALL: f64 = 1e-3;
/// Ratio of the scale of velocities to that of positions (1/s): that of a mode of 16 Hz.
const RATE: f64 = 100.0;
/// Number of steps of an implicit solver per call: its own interval between two Jacobians.
const RUN: u64 = 50;
/// Maximum step of the solver (s): at rest the step would otherwise grow until it misses a motion
/// that starts later.
const LONGEST: f64 = 0.02;
/// Restarts are merged if they are closer to each other than this fraction of h,
const TOGETHER: f64 = 1e-9;
/// or than this fraction of the time, which the solver cannot resolve (2e-14 of it).
const ROUNDING: f64 = 1e-13;
/// Increment of the finite differences for the Jacobian, relative to the scales.
const INCREMENT: f64 = 1e-4;

/// Method of the solver; see the module documentation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ReferenceMethod {
    /// Implicit multistep formulas of orders 1 to 5 (BDF).
    #[default]
    Bdf,
    /// Implicit Runge-Kutta of third order, A-stable; for lightly damped modes in the kHz range.
    Esdirk34,
    /// Explicit Runge-Kutta of fifth order, as an independent check.
    Tsit45,
}

impl Words for ReferenceMethod {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("bdf", Self::Bdf, "Implicit, order 1 to 5: well damped high modes"),
        ("esdirk34", Self::Esdirk34, "Implicit, order 3: lightly damped modes in the kHz, loose tolerances"),
        ("tsit45", Self::Tsit45, "Explicit, order 5: no stiff modes"),
    ];
}

/// Tolerances on the local error: `atol + rtol |y|` per coordinate y, in the root mean square over
/// all coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSettings {
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerance of positions (m, rad); that of velocities is 100/s times larger.
    pub atol: f64,
    /// Method of the solver.
    pub method: ReferenceMethod,
}

impl ReferenceSettings {
    /// Creates settings with the default method and this relative tolerance; coordinates below 1 mm or 1 mrad count as small.
    pub fn new(rtol: f64) -> Self {
        Self { rtol, atol: SMALL * rtol, method: ReferenceMethod::default() }
    }

    fn check(&self) -> Result<(), StepError> {
        let Self { rtol, atol, .. } = *self;
        // Below 1e-13 the estimate of the local error is round-off.
        if !(1e-13..=1e-2).contains(&rtol) {
            return Err(StepError::Setup(format!(
                "the relative tolerance must lie between 1e-13 and 1e-2, found {rtol:e}"
            )));
        }
        if !(atol.is_finite() && atol > 0.0) {
            return Err(StepError::Setup(format!("the absolute tolerance must be positive, found {atol:e}")));
        }
        Ok(())
    }
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self::new(1e-9)
    }
}

impl Method for ReferenceSettings {
    fn entry(&self) -> &'static StepperEntry {
        &ENTRY
    }

    fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        vec![("rtol", StepperSetting::Number(self.rtol)), ("method", StepperSetting::of_word(self.method))]
    }

    fn start(&self, plant: Arc<Plant>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError> {
        if plant.has_hysteresis() {
            let text = "the reference stepper needs continuous equations and does not support hysteresis of gears: use \
                        sdirk3 or rk4 with a small step";
            return Err(StepError::Setup(text.into()));
        }
        let stepper = ReducedStepper::start(plant, e, |system, x, v| {
            let mut integrator = Reference::new(system, 0.0, h, *self, x, v)?;
            // Otherwise a solver with large steps may miss a short load.
            for t in system.plant.load_jumps().filter(|t| *t > 0.0) {
                integrator.restart_at(t);
            }
            // Not an integer fraction of the period, at which samples of a sine could all be zero.
            let period = system.plant.loads.iter().map(|load| load.wrench.period).fold(f64::INFINITY, f64::min);
            integrator.limit_steps(0.137 * period);
            Ok(integrator)
        })?;
        Ok(Box::new(stepper))
    }
}

type V = NalgebraVec<f64>;
type Lu = NalgebraLU<f64>;

/// State from which the next run of the solver continues.
enum SolverStart {
    /// Time and `[x; v]`, without history.
    Start(f64, Vec<f64>),
    Bdf(BdfState<V>),
    RungeKutta(RkState<V>),
}

impl SolverStart {
    /// Returns the time that the solver has reached (s).
    fn time(&self) -> f64 {
        match self {
            Self::Start(t, _) => *t,
            Self::Bdf(state) => state.as_ref().t,
            Self::RungeKutta(state) => state.as_ref().t,
        }
    }
}

/// The integrator with its state; see the module documentation.
pub struct Reference {
    settings: ReferenceSettings,
    /// Time, positions, velocities and accelerations.
    pub now: Current,
    kept: SolverStart,
    /// `[x; v]` at the points after the current time that the solver has passed.
    ahead: VecDeque<Vec<f64>>,
    /// Times of restarts, ascending.
    restarts: Vec<f64>,
    /// Maximum step of the solver (s).
    longest: f64,
    /// Steps of the solver so far; the solver may be ahead of the current time.
    pub solver_steps: u64,
    /// Evaluations of the equations of motion so far, including those for Jacobians.
    pub evaluations: u64,
    /// Factorisations so far.
    pub factorisations: u64,
}

impl Reference {
    /// Starts at `t0`; [`Integrator::step`] advances from one multiple of `h` (s) to the next.
    ///
    /// # Errors
    /// [`StepError::Setup`] for invalid tolerances, [`StepError::Singular`] if the initial
    /// acceleration cannot be computed.
    ///
    /// # Panics
    /// If `h` is not positive.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        settings: ReferenceSettings,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        settings.check()?;
        let now = Current::new(system, t0, h, x, v)?;
        let kept = SolverStart::Start(t0, together(&now.x, &now.v));
        Ok(Self {
            settings,
            now,
            kept,
            ahead: VecDeque::new(),
            restarts: Vec::new(),
            longest: LONGEST,
            solver_steps: 0,
            evaluations: 1,
            factorisations: 0,
        })
    }

    /// Returns the first point that is neither reached nor queued.
    fn next_point(&self) -> f64 {
        self.now.grid.after(1 + self.ahead.len() as u64)
    }

    /// Makes the solver end a step at `t` (s) and restart, because the load jumps there: before `t`
    /// the system is evaluated only at times before it, afterwards only at times after it. A time
    /// in the past causes an immediate restart.
    ///
    /// # Panics
    /// If `t` is not finite.
    pub fn restart_at(&mut self, t: f64) {
        assert!(t.is_finite(), "a restart has a time");
        let near = self.near(t);
        // Points are reached exactly: a restart that is a rounding error beyond a point would be
        // met twice.
        let (t0, h) = (self.now.grid.start(), self.now.grid.step_size());
        let point = t0 + ((t - t0) / h).round() * h;
        let t = if (t - point).abs() <= near { point } else { t };
        if self.restarts.iter().any(|other| (other - t).abs() <= near) {
            return;
        }
        if t <= self.kept.time() + near {
            self.start_again();
        }
        self.restarts.insert(self.restarts.partition_point(|other| *other < t), t);
    }

    /// Limits the solver's steps to `longest` (s).
    fn limit_steps(&mut self, longest: f64) {
        self.longest = self.longest.min(longest);
    }

    /// Discards the solution of the solver beyond the current time.
    fn start_again(&mut self) {
        self.ahead.clear();
        self.kept = SolverStart::Start(self.now.grid.time(), together(&self.now.x, &self.now.v));
    }

    /// Returns the distance from `t` below which times are equal (s).
    fn near(&self, t: f64) -> f64 {
        TOGETHER * self.now.grid.step_size() + ROUNDING * t.abs()
    }

    /// Advances to the next multiple of h.
    fn step_to_point(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        while self.ahead.is_empty() && !self.now.x.is_empty() {
            if let Err(error) = self.advance(system) {
                // Points passed before the failure are valid; the solver retries from the last one.
                let Some(last) = self.ahead.back().cloned() else {
                    self.start_again();
                    return Err(error);
                };
                self.kept = SolverStart::Start(self.next_point() - self.now.grid.step_size(), last);
            }
        }
        let y = self.ahead.pop_front().unwrap_or_default();
        self.arrive(system, self.next_time(), &y)
    }

    /// Advances to a restart before the next multiple of h ([`Reference::restart_at`]); the rest of
    /// the step starts anew there.
    fn step_to_restart(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError> {
        while self.kept.time() < t - self.near(t) && !self.now.x.is_empty() {
            if let Err(error) = self.advance(system) {
                self.start_again();
                return Err(error);
            }
        }
        let y = match &self.kept {
            SolverStart::Start(_, y) => y.clone(),
            _ => together(&self.now.x, &self.now.v),
        };
        self.arrive(system, t, &y)?;
        self.start_again();
        Ok(())
    }

    /// Sets position and velocity at `t`, and evaluates the acceleration.
    fn arrive(&mut self, system: &mut impl SecondOrderSystem, t: f64, y: &[f64]) -> Result<(), StepError> {
        let n = self.now.x.len();
        let (x, v) = (DVector::from_column_slice(&y[..n]), DVector::from_column_slice(&y[n..]));
        let mut acceleration = DVector::zeros(n);
        self.evaluations += 1;
        system.acceleration(t, &x, &v, &mut acceleration)?;
        (self.now.x, self.now.v, self.now.acceleration) = (x, v, acceleration);
        self.now.grid.reach(t);
        Ok(())
    }

    /// Runs a solver on the system, continuing from the kept state.
    fn advance(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        let start = self.kept.time();
        let kept = std::mem::replace(&mut self.kept, SolverStart::Start(start, Vec::new()));
        // The system is evaluated strictly between two restarts.
        let passed = self.restarts.partition_point(|t| *t <= start);
        let from = if passed > 0 { self.restarts[passed - 1].next_up() } else { f64::NEG_INFINITY };
        let stop = self.restarts.get(passed).copied().unwrap_or(f64::INFINITY);
        let equations = RefCell::new(FirstOrder::new(system, from, stop.next_down(), &self.settings));
        let result = self.solve(kept, stop, &equations);
        let FirstOrder { evaluations, error, .. } = equations.into_inner();
        self.evaluations += evaluations;
        // An error of the system is the cause of the solver's error.
        self.kept = error.map_or(result, Err)?;
        Ok(())
    }

    /// Builds problem and solver around the equations and runs it.
    fn solve<S: SecondOrderSystem>(
        &mut self,
        kept: SolverStart,
        stop: f64,
        equations: &RefCell<FirstOrder<'_, S>>,
    ) -> Result<SolverStart, StepError> {
        let n = self.now.x.len();
        let (start, h) = (kept.time(), self.now.grid.step_size());
        let fault = |error: DiffsolError| gave_up(start, h, &error);
        let (y0, bdf, runge_kutta) = match kept {
            SolverStart::Start(_, y) => (y, None, None),
            // The problem requires an initial value, but the kept state has its own.
            SolverStart::Bdf(state) => (vec![0.0; 2 * n], Some(state), None),
            SolverStart::RungeKutta(state) => (vec![0.0; 2 * n], None, Some(state)),
        };
        let ReferenceSettings { rtol, atol, method } = self.settings;
        let problem = OdeBuilder::<NalgebraMat<f64>>::new()
            .t0(start)
            .rtol(rtol)
            .atol((0..2 * n).map(|k| if k < n { atol } else { RATE * atol }))
            .rhs_implicit(
                |y: &[f64], _: &[f64], t: f64, dy: &mut [f64]| equations.borrow_mut().derivative(t, y, dy),
                |y: &[f64], _: &[f64], t: f64, w: &[f64], Jw: &mut [f64]| {
                    equations.borrow_mut().times_jacobian(t, y, w, Jw);
                },
            )
            .init(|_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&y0), 2 * n)
            .build()
            .map_err(fault)?;
        match method {
            ReferenceMethod::Bdf => {
                let state = bdf.map_or_else(|| problem.bdf_state::<Lu>(), Ok);
                let solver = state.and_then(|state| problem.bdf_solver::<Lu>(state)).map_err(fault)?;
                self.run(solver, stop, RUN, SolverStart::Bdf)
            }
            ReferenceMethod::Esdirk34 => {
                let state = runge_kutta.map_or_else(|| problem.rk_state(&Tableau::esdirk34()), Ok);
                let solver = state.and_then(|state| problem.esdirk34_solver::<Lu>(state)).map_err(fault)?;
                self.run(solver, stop, RUN, SolverStart::RungeKutta)
            }
            ReferenceMethod::Tsit45 => {
                let state = runge_kutta.map_or_else(|| problem.rk_state(&Tableau::tsit45()), Ok);
                let solver = state.and_then(|state| problem.tsit45_solver(state)).map_err(fault)?;
                self.run(solver, stop, 1, SolverStart::RungeKutta)
            }
        }
    }

    /// Steps until a point was passed and at least `least` steps were taken, or to the restart at
    /// `stop`; queues the points.
    fn run<'p, E, S>(
        &mut self,
        mut solver: S,
        stop: f64,
        least: u64,
        keep: fn(S::State) -> SolverStart,
    ) -> Result<SolverStart, StepError>
    where
        E: OdeEquations<T = f64, V = V> + 'p,
        S: OdeSolverMethod<'p, E>,
    {
        let mut steps = 0;
        let result = loop {
            if steps >= least && !self.ahead.is_empty() {
                break Ok(None);
            }
            match self.solver_step(&mut solver, stop) {
                Ok(None) => steps += 1,
                end => break end,
            }
        };
        let work = solver.get_statistics();
        self.solver_steps += work.number_of_steps as u64;
        self.factorisations += work.number_of_linear_solver_setups as u64;
        Ok(result?.unwrap_or_else(|| keep(solver.into_state())))
    }

    /// Takes one step of the solver and queues the points in it. At a restart it returns the state
    /// from which the next run starts.
    fn solver_step<'p, E, S>(&mut self, solver: &mut S, stop: f64) -> Result<Option<SolverStart>, StepError>
    where
        E: OdeEquations<T = f64, V = V> + 'p,
        S: OdeSolverMethod<'p, E>,
    {
        let (t, h) = (solver.state().t, solver.state().h);
        let fault = |error: DiffsolError| gave_up(t, h, &error);
        // The solver has no maximum step, but a stop time.
        let mut target = if h > self.longest { t + self.longest } else { f64::INFINITY };
        if target > stop - self.near(stop) {
            target = stop;
        }
        if target.is_finite() {
            solver.set_stop_time(target).map_err(fault)?;
        }
        let reason = solver.step().map_err(fault)?;
        // A rejected step of maximum length leaves its end as stop time: this is not a restart.
        let restart = reason == OdeSolverStopReason::TstopReached && target == stop && stop.is_finite();

        let state = solver.state();
        let t = if restart { stop } else { state.t };
        let x = &state.y.inner().as_slice()[..self.now.x.len()];
        let largest = x.iter().fold(0.0f64, |m, x| if x.is_finite() { m.max(x.abs()) } else { f64::INFINITY });
        if largest > 1e6 {
            let what = format!("a coordinate reached {largest:.1e}");
            return Err(StepError::Diverged { t, h, what });
        }
        let mut y = state.y.clone();
        while self.next_point() <= t {
            solver.interpolate_inplace(self.next_point().min(solver.state().t), &mut y).map_err(fault)?;
            self.ahead.push_back(y.inner().as_slice().to_vec());
        }
        Ok(restart.then(|| SolverStart::Start(stop, solver.state().y.inner().as_slice().to_vec())))
    }
}

impl Integrator for Reference {
    fn current(&self) -> &Current {
        &self.now
    }

    fn current_mut(&mut self) -> &mut Current {
        &mut self.now
    }

    /// Advances to a multiple of the step, or to a restart before it ([`Reference::restart_at`]).
    /// Allocates.
    fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError> {
        if t == self.next_time() { self.step_to_point(system) } else { self.step_to_restart(system, t) }
    }

    /// Keeps position and velocity, evaluates the acceleration again and lets the solver choose its
    /// step again.
    fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.start_again();
        self.evaluations += 1;
        self.now.accelerate(system)
    }

    /// The solver must not step past an event.
    fn expect_event(&mut self, t: f64) {
        self.restart_at(t);
    }

    fn counts(&self) -> Counts {
        Counts { steps: self.solver_steps, evaluations: self.evaluations, factorisations: self.factorisations }
    }
}

/// The system in first-order form, `y = [x; v]`, with workspace for an evaluation.
struct FirstOrder<'s, S> {
    system: &'s mut S,
    /// Times are clamped to this range.
    from: f64,
    to: f64,
    x: DVector<f64>,
    v: DVector<f64>,
    a: DVector<f64>,
    /// Point at which the Jacobian is evaluated, and the acceleration there.
    base: Option<(f64, Vec<f64>, DVector<f64>)>,
    /// Increments of positions and velocities for the Jacobian.
    increments: [f64; 2],
    evaluations: u64,
    error: Option<StepError>,
}

impl<'s, S: SecondOrderSystem> FirstOrder<'s, S> {
    /// Prepares evaluations between the times `from` and `to` (s). The increments of the Jacobian are
    /// relative to the size at which absolute and relative tolerance are equal.
    fn new(system: &'s mut S, from: f64, to: f64, settings: &ReferenceSettings) -> Self {
        let zeros = DVector::zeros(system.dimension());
        let increment = INCREMENT * settings.atol / settings.rtol;
        Self {
            system,
            from,
            to,
            x: zeros.clone(),
            v: zeros.clone(),
            a: zeros,
            base: None,
            increments: [increment, RATE * increment],
            evaluations: 0,
            error: None,
        }
    }

    /// Computes `ẏ = [v; a]`.
    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.evaluate(t, y.iter().copied());
        let n = self.x.len();
        dy[..n].copy_from_slice(&y[n..]);
        dy[n..].copy_from_slice(self.a.as_slice());
    }

    /// Computes the acceleration at `t` and `y` in `a`; a failure gives NaN, at which the solver
    /// gives up.
    fn evaluate(&mut self, t: f64, y: impl Iterator<Item = f64>) {
        self.x.iter_mut().chain(self.v.iter_mut()).zip(y).for_each(|(to, from)| *to = from);
        self.evaluations += 1;
        let t = t.clamp(self.from, self.to);
        if let Err(error) = self.system.acceleration(t, &self.x, &self.v, &mut self.a) {
            self.error.get_or_insert(error);
            self.a.fill(f64::NAN);
        }
    }

    /// Computes `J w` by a forward difference. The solver requests one column after the other at
    /// the same y and uses the matrix for Newton's method only.
    fn times_jacobian(&mut self, t: f64, y: &[f64], w: &[f64], Jw: &mut [f64]) {
        let n = self.x.len();
        let base = match self.base.take() {
            Some(base) if base.0 == t && base.1 == y => base,
            _ => {
                self.evaluate(t, y.iter().copied());
                (t, y.to_vec(), self.a.clone())
            }
        };
        let size = |w: &[f64], increment: f64| w.iter().fold(0.0f64, |m, w| m.max(w.abs())) / increment;
        let size = size(&w[..n], self.increments[0]).max(size(&w[n..], self.increments[1]));
        let d = if size > 0.0 { 1.0 / size } else { 1.0 };
        self.evaluate(t, y.iter().zip(w).map(|(y, w)| y + d * w));
        Jw[..n].copy_from_slice(&w[n..]);
        for k in 0..n {
            Jw[n + k] = (self.a[k] - base.2[k]) / d;
        }
        self.base = Some(base);
    }
}

fn together(x: &DVector<f64>, v: &DVector<f64>) -> Vec<f64> {
    x.iter().chain(v.iter()).copied().collect()
}

fn gave_up(t: f64, h: f64, error: &DiffsolError) -> StepError {
    StepError::SolverGaveUp { t, h, what: error.to_string() }
}
