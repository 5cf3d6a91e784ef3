//! Interface between integrators and their callers: a time grid, a state, events.
//!
//! [`ReducedStepper`] combines any integrator with a flexible arm; its steps also end at events. Start
//! at [`Integrator`]. Not here: robots (only in [`ReducedStepper`]), Newton's method (`implicit`).

use std::sync::Arc;

use nalgebra::DVector;

use crate::dense::largest_of_numbers;
use crate::error::StepError;
use crate::events::Change;
use crate::observation::{Observation, observe_reduced};
use crate::plant::Plant;
use crate::reduced::ReducedArm;
use crate::stepper::{Counts, LARGEST_DEFLECTION, Stepper};
use crate::system::SecondOrderSystem;

/// Time grid with constant step size, and the current time on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeGrid {
    t0: f64,
    h: f64,
    t: f64,
    steps: u64,
}

impl TimeGrid {
    /// Creates the grid `t0 + k h` (s) with current time `t0`.
    pub fn new(t0: f64, h: f64) -> Self {
        Self { t0, h, t: t0, steps: 0 }
    }

    /// Returns the first time (s).
    pub fn start(&self) -> f64 {
        self.t0
    }

    /// Returns the current time (s); between two events it may be off the grid.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// Returns the step size (s).
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// Returns the number of complete steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns the grid time (s) `steps` steps after the current one.
    pub fn after(&self, steps: u64) -> f64 {
        self.t0 + (self.steps + steps) as f64 * self.h
    }

    /// Returns the next grid time (s).
    pub fn next_time(&self) -> f64 {
        self.after(1)
    }

    /// Returns whether the current time is on the grid.
    pub(crate) fn is_on_step(&self) -> bool {
        self.t == self.after(0)
    }

    /// Sets the current time to `t` (s), at most the next grid time, and counts a step if it is that.
    pub fn reach(&mut self, t: f64) {
        self.steps += u64::from(t == self.next_time());
        self.t = t;
    }
}

/// Current state of an integrator: time grid, positions, velocities, accelerations.
#[derive(Clone, Debug)]
pub struct Current {
    /// Time grid and current time.
    pub grid: TimeGrid,
    /// Positions.
    pub x: DVector<f64>,
    /// Velocities.
    pub v: DVector<f64>,
    /// Accelerations, consistent with the equations of motion.
    pub acceleration: DVector<f64>,
}

impl Current {
    /// Creates the state at `t0` (s), on a grid of step size `h` (s).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the acceleration cannot be computed.
    ///
    /// # Panics
    /// If `h` is not positive, or x or v does not have one entry per coordinate of the system.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        assert!(h > 0.0, "the step must be positive, found {h} s");
        for (what, found) in [("x", x.len()), ("v", v.len())] {
            let expected = system.dimension();
            assert!(found == expected, "{what} has {found} entries, the system has {expected} coordinates");
        }
        let acceleration = DVector::zeros(system.dimension());
        let mut current = Self { grid: TimeGrid::new(t0, h), x, v, acceleration };
        current.accelerate(system)?;
        Ok(current)
    }

    /// Updates the acceleration from the equations of motion.
    ///
    /// # Errors
    /// [`StepError::Singular`] if it cannot be computed.
    pub fn accelerate(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        system.acceleration(self.grid.time(), &self.x, &self.v, &mut self.acceleration)
    }
}

/// An integrator of second-order systems; it steps along a time grid and can stop between grid
/// times.
///
/// After an error the state is that of the last good time.
pub trait Integrator: Send {
    /// Quadrature rule with which a step integrates prescribed accelerations: (fraction of the
    /// step, weight). Steps are subdivided where the rule misses the change of a prescribed
    /// velocity within them. Empty: no subdivision, because the steps are short anyway.
    const MOTION_RULE: &'static [(f64, f64)] = &[];

    /// Returns the current state.
    fn current(&self) -> &Current;

    /// Returns the current state for modification; after a change of velocities at an event the
    /// caller must call [`Integrator::restart`].
    fn current_mut(&mut self) -> &mut Current;

    /// Advances to `t` (s), which is after the current time and not beyond the next grid time.
    ///
    /// # Errors
    /// [`StepError::NotConverged`] or [`StepError::SolverGaveUp`] if no solution of the step is
    /// found, [`StepError::Diverged`] if the state is out of range, [`StepError::Singular`] if a
    /// matrix cannot be factorised.
    fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError>;

    /// Restarts from the current state; to be called after a jump of a force or a velocity.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the acceleration cannot be computed.
    fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.current_mut().accelerate(system)
    }

    /// Restarts as [`Integrator::restart`] does after a change of masses, stiffness or damping,
    /// which also makes stored matrices out of date.
    ///
    /// # Errors
    /// As [`Integrator::restart`].
    fn renew(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.restart(system)
    }

    /// Announces the next event at time `_t` (s): the solution must not be extrapolated beyond it.
    fn expect_event(&mut self, _t: f64) {}

    /// Returns the work done so far.
    fn counts(&self) -> Counts;

    /// Returns the iterations of the last step and its final relative correction (zeros without
    /// iterations).
    fn last_iteration(&self) -> (usize, f64) {
        (0, 0.0)
    }

    /// Returns a copy with the same state; `None` if the integrator cannot be copied.
    fn copy(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Advances to the next grid time.
    ///
    /// # Errors
    /// As [`Integrator::advance_to`].
    fn step(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.advance_to(system, self.next_time())
    }

    /// Returns the current time (s).
    fn time(&self) -> f64 {
        self.current().grid.time()
    }

    /// Returns the next grid time (s).
    fn next_time(&self) -> f64 {
        self.current().grid.next_time()
    }

    /// Returns the step size (s).
    fn step_size(&self) -> f64 {
        self.current().grid.step_size()
    }

    /// Returns the number of complete steps taken.
    fn steps(&self) -> u64 {
        self.current().grid.steps()
    }
}

/// Stepper of an arm in reduced coordinates; its steps also end at events.
#[derive(Clone)]
pub(crate) struct ReducedStepper<I> {
    pub(crate) system: ReducedArm,
    pub(crate) integrator: I,
}

impl<I: Integrator> ReducedStepper<I> {
    /// Starts an arm at `t = 0` with elastic coordinates `e`; `make` builds the integrator from
    /// positions and velocities.
    pub(crate) fn start(
        plant: impl Into<Arc<Plant>>,
        e: &DVector<f64>,
        make: impl FnOnce(&mut ReducedArm, DVector<f64>, DVector<f64>) -> Result<I, StepError>,
    ) -> Result<Self, StepError> {
        let mut system = ReducedArm::new(plant);
        let (x, v) = system.start(e)?;
        system.check_loops(&x, &v)?;
        let integrator = make(&mut system, x, v)?;
        Ok(Self { system, integrator })
    }
}

impl<I: Integrator + 'static> Stepper for ReducedStepper<I> {
    fn time(&self) -> f64 {
        self.integrator.time()
    }

    fn step(&mut self) -> Result<(), StepError> {
        let Self { system, integrator } = self;
        let end = integrator.next_time();
        loop {
            // Advance to the next event, to the end of the step, or less far where a prescribed
            // velocity changes fast in between.
            let event = system.next_event(integrator.time(), end);
            let stop = event.filter(|t| *t < end).unwrap_or(end);
            let stop = system.resolved(integrator.time(), stop, I::MOTION_RULE);
            if let Some(event) = event {
                integrator.expect_event(event);
            }
            if let Err(error) = integrator.advance_to(system, stop) {
                // An open loop makes the state NaN; report the loop as the cause of the failure.
                return Err(StepError::dead_point(&system.plant.model, &system.data, stop).unwrap_or(error));
            }
            // Apply the events at this time.
            let h = integrator.step_size();
            let now = integrator.current_mut();
            check_deflection(&system.plant, &now.x, stop, h)?;
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

    fn restart(&mut self) -> Result<(), StepError> {
        let t = self.integrator.time();
        if let Some(servo) = &mut self.system.servo {
            servo.add(t, &self.system.plant);
        }
        self.integrator.restart(&mut self.system)
    }

    fn change_masses(&mut self, plant: &Arc<Plant>) -> Result<(), StepError> {
        self.system.plant = plant.clone();
        self.integrator.renew(&mut self.system)
    }

    fn copy(&self) -> Option<Box<dyn Stepper>> {
        Some(Box::new(Self { system: self.system.clone(), integrator: self.integrator.copy()? }))
    }
}

/// Returns an error if an elastic coordinate exceeds [`LARGEST_DEFLECTION`].
pub(crate) fn check_deflection(plant: &Plant, x: &DVector<f64>, t: f64, h: f64) -> Result<(), StepError> {
    if largest_of_numbers(x.as_slice()) <= LARGEST_DEFLECTION {
        return Ok(());
    }
    for element in plant.elements.iter().filter(|e| !e.modal || e.size >= 6) {
        let first = plant.torque_driven.len() + plant.offset(element);
        let largest = x.as_slice()[first..first + element.size.min(6)].iter().fold(0.0f64, |m, e| m.max(e.abs()));
        if largest > LARGEST_DEFLECTION {
            let what = format!("the deflection of link {:?} reached {largest:.1e} m or rad", element.name);
            return Err(StepError::Diverged { t, h, what });
        }
    }
    Ok(())
}
