//! One face for all steppers: step, observe, count. Which there are is in [`crate::steppers`].

use crate::error::StepError;
use crate::observation::Observation;

/// Where a run starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Start {
    /// Springs carry the weight: no ringing.
    #[default]
    Equilibrium,
    /// Springs relaxed.
    Undeformed,
}

/// Work done by a stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps taken; those of the solver where it chooses them.
    pub steps: u64,
    /// Newton iterations or evaluations of the equations of motion.
    pub evaluations: u64,
    /// Matrix factorisations.
    pub factorisations: u64,
}

/// A running simulation.
pub trait Stepper: Send {
    /// Current time (s).
    fn time(&self) -> f64;

    /// Advances by one step; on error the state stays at the last good time. No stepper allocates
    /// here but those that say so ([`crate::StepperEntry::allocates`]).
    ///
    /// # Errors
    /// [`StepError`] with time, step and cause.
    fn step(&mut self) -> Result<(), StepError>;

    /// Writes the current state into `out`.
    fn observe(&mut self, out: &mut Observation);

    /// Work so far.
    fn counts(&self) -> Counts;

    /// Iterations of the last step and the relative correction it ended with (0 where there are
    /// none).
    fn last_iteration(&self) -> (usize, f64) {
        (0, 0.0)
    }
}

/// Elastic coordinates beyond this are no deflection of a link any more (m, rad).
pub(crate) const LARGEST_DEFLECTION: f64 = 3.0;
