//! The seam between integrators and whoever steps them: a grid of times, a state, events.
//!
//! [`ReducedStepper`] puts any of them behind a flexible arm, once for all: its steps end at events
//! too.

use std::sync::Arc;

use nalgebra::DVector;

use crate::arm::FlexibleArm;
use crate::dense::largest_quickly;
use crate::error::StepError;
use crate::events::Change;
use crate::observation::{Observation, observe_reduced};
use crate::reduced::ReducedArm;
use crate::stepper::{Counts, LARGEST_DEFLECTION, Stepper};
use crate::system::SecondOrderSystem;

/// The multiples of a step, and how far an integrator has come along them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeGrid {
    t0: f64,
    h: f64,
    t: f64,
    steps: u64,
}

impl TimeGrid {
    /// Times `t0 + k h` (s), at `t0`.
    pub fn new(t0: f64, h: f64) -> Self {
        Self { t0, h, t: t0, steps: 0 }
    }

    /// First time (s).
    pub fn start(&self) -> f64 {
        self.t0
    }

    /// Current time (s); between two events it may lie off the grid.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// Step (s).
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// Whole steps behind the current time.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The multiple of the step so many steps after the current one (s).
    pub fn after(&self, steps: u64) -> f64 {
        self.t0 + (self.steps + steps) as f64 * self.h
    }

    /// Next multiple of the step (s).
    pub fn next_time(&self) -> f64 {
        self.after(1)
    }

    /// Whether the current time is a multiple of the step.
    pub fn is_on_step(&self) -> bool {
        self.t == self.after(0)
    }

    /// Time has come to t (s), at most to the next multiple of the step.
    pub fn reach(&mut self, t: f64) {
        self.steps += u64::from(t == self.next_time());
        self.t = t;
    }
}

/// Where an integrator is: on its grid, and what moves how.
#[derive(Clone, Debug)]
pub struct Current {
    /// The times.
    pub grid: TimeGrid,
    /// Positions.
    pub x: DVector<f64>,
    /// Velocities.
    pub v: DVector<f64>,
    /// Accelerations that fulfil the equations of motion.
    pub acceleration: DVector<f64>,
}

impl Current {
    /// At `t0` (s), on a grid of step `h` (s).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the acceleration cannot be found.
    ///
    /// # Panics
    /// If `h` is not positive.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        assert!(h > 0.0, "the step is positive");
        let acceleration = DVector::zeros(system.dimension());
        let mut current = Self { grid: TimeGrid::new(t0, h), x, v, acceleration };
        current.accelerate(system)?;
        Ok(current)
    }

    /// Takes the acceleration from the equations of motion.
    ///
    /// # Errors
    /// [`StepError::Singular`] if it cannot be found.
    pub fn accelerate(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        system.acceleration(self.grid.time(), &self.x, &self.v, &mut self.acceleration)
    }
}

/// An integrator of second-order systems; it steps along a grid and stops between its times where
/// it is told to.
///
/// After an error the state is that of the last good time.
pub trait Integrator: Send {
    /// Where in a step it asks for prescribed accelerations, as parts of the step, and with which
    /// weights they make the impulse. Steps are cut where this misses the change of a velocity that
    /// rises within them; empty: they are short anyway.
    const MOTION_RULE: &'static [(f64, f64)] = &[];

    /// Where it is.
    fn current(&self) -> &Current;

    /// The same; of what an event may change, the velocities, [`Integrator::restart`] must follow.
    fn current_mut(&mut self) -> &mut Current;

    /// Advances to t (s), which lies after the current time and not beyond the next multiple of the
    /// step.
    ///
    /// # Errors
    /// [`StepError::NotConverged`] or [`StepError::SolverGaveUp`] if the step has no solution that
    /// is found, [`StepError::Diverged`] if it is out of all range, [`StepError::Singular`] if a
    /// matrix cannot be solved.
    fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError>;

    /// Starts anew from the current state: to be called when a force or a velocity has jumped.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the acceleration cannot be found.
    fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.current_mut().accelerate(system)
    }

    /// As [`Integrator::restart`], when masses, stiffness or damping have changed: matrices too are
    /// out of date.
    ///
    /// # Errors
    /// As [`Integrator::restart`].
    fn renew(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.restart(system)
    }

    /// Beyond this time (s), to which the next steps lead, nothing is known yet.
    fn expect_event(&mut self, _t: f64) {}

    /// Work so far.
    fn counts(&self) -> Counts;

    /// Iterations of the last step and the relative correction with which it ended (0 where there
    /// are none).
    fn last_iteration(&self) -> (usize, f64) {
        (0, 0.0)
    }

    /// Advances to the next multiple of the step.
    ///
    /// # Errors
    /// As [`Integrator::advance_to`].
    fn step(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.advance_to(system, self.next_time())
    }

    /// Current time (s).
    fn time(&self) -> f64 {
        self.current().grid.time()
    }

    /// Next multiple of the step (s).
    fn next_time(&self) -> f64 {
        self.current().grid.next_time()
    }

    /// Step (s).
    fn step_size(&self) -> f64 {
        self.current().grid.step_size()
    }

    /// Whole steps taken.
    fn steps(&self) -> u64 {
        self.current().grid.steps()
    }
}

/// A stepper of reduced coordinates; its steps end at events too.
pub(crate) struct ReducedStepper<I> {
    pub(crate) system: ReducedArm,
    pub(crate) integrator: I,
}

impl<I: Integrator> ReducedStepper<I> {
    /// An arm at `t = 0` with elastic coordinates `e`, and the integrator that is made for it from
    /// positions and velocities.
    pub(crate) fn start(
        arm: impl Into<Arc<FlexibleArm>>,
        e: &DVector<f64>,
        make: impl FnOnce(&mut ReducedArm, DVector<f64>, DVector<f64>) -> Result<I, StepError>,
    ) -> Result<Self, StepError> {
        let mut system = ReducedArm::new(arm);
        let (x, v) = system.start(e)?;
        system.check_loops(&x, &v)?;
        let integrator = make(&mut system, x, v)?;
        Ok(Self { system, integrator })
    }
}

impl<I: Integrator> Stepper for ReducedStepper<I> {
    fn time(&self) -> f64 {
        self.integrator.time()
    }

    fn step(&mut self) -> Result<(), StepError> {
        let Self { system, integrator } = self;
        let end = integrator.next_time();
        loop {
            // To the next event, to the end of the step, or not so far where a prescribed velocity
            // rises in between.
            let event = system.next_event(integrator.time(), end);
            let stop = event.filter(|t| *t < end).unwrap_or(end);
            let stop = system.resolved(integrator.time(), stop, I::MOTION_RULE);
            if let Some(event) = event {
                integrator.expect_event(event);
            }
            if let Err(error) = integrator.advance_to(system, stop) {
                // Where a loop does not close nothing is a number, and that is the cause.
                return Err(StepError::dead_point(&system.arm.model, &system.data, stop).unwrap_or(error));
            }
            // What happens there.
            let h = integrator.step_size();
            let now = integrator.current_mut();
            check_deflection(&system.arm, &now.x, stop, h)?;
            match system.at_time(stop, &now.x, &mut now.v)? {
                Change::Nothing => {}
                Change::Motion => integrator.restart(system)?,
                Change::Matrices => integrator.renew(system)?,
            }
            if stop == end {
                return Ok(());
            }
        }
    }

    fn observe(&mut self, out: &mut Observation) {
        let now = self.integrator.current();
        observe_reduced(&mut self.system, now.grid.time(), &now.x, &now.v, &now.acceleration, out);
    }

    fn counts(&self) -> Counts {
        self.integrator.counts()
    }

    fn last_iteration(&self) -> (usize, f64) {
        self.integrator.last_iteration()
    }
}

/// Stops a run whose links have come apart.
pub(crate) fn check_deflection(arm: &FlexibleArm, x: &DVector<f64>, t: f64, h: f64) -> Result<(), StepError> {
    if largest_quickly(x.as_slice()) <= LARGEST_DEFLECTION {
        return Ok(());
    }
    for element in arm.elements.iter().filter(|e| !e.modal || e.size >= 6) {
        let first = arm.torque_driven.len() + arm.offset(element);
        let largest = x.as_slice()[first..first + element.size.min(6)].iter().fold(0.0f64, |m, e| m.max(e.abs()));
        if largest > LARGEST_DEFLECTION {
            let what = format!("the deflection of link {:?} reached {largest:.1e} m or rad", element.name);
            return Err(StepError::Diverged { t, h, what });
        }
    }
    Ok(())
}
