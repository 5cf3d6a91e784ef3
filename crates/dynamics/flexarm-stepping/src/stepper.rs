//! Common interface of all steppers: step, observe, count. The steppers are listed in
//! [`crate::steppers`].

use std::sync::Arc;

use flexarm_settings::Words;

use crate::error::StepError;
use crate::observation::Observation;
use crate::plant::Plant;

/// Initial state of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Start {
    /// Static equilibrium: the springs carry the weight, so the arm does not ring.
    #[default]
    Equilibrium,
    /// Undeformed: the springs are relaxed.
    Undeformed,
}

impl Words for Start {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("equilibrium", Self::Equilibrium, "Static equilibrium under gravity"),
        ("undeformed", Self::Undeformed, "Undeformed: the arm falls into its static deflection and rings"),
    ];
}

/// Work done by a stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps taken; internal steps for a solver with step size control.
    pub steps: u64,
    /// Newton iterations, or evaluations of the equations of motion.
    pub evaluations: u64,
    /// Matrix factorisations.
    pub factorisations: u64,
}

/// A running simulation.
pub trait Stepper: Send {
    /// Returns the current time (s).
    fn time(&self) -> f64;

    /// Advances by one step. After an error the state is that of the last good time. Does not
    /// allocate unless the stepper declares it ([`crate::StepperEntry::allocates`]).
    ///
    /// # Errors
    /// [`StepError`] with time, step and cause.
    fn step(&mut self) -> Result<(), StepError>;

    /// Writes the current state into `out`.
    fn observe(&mut self, out: &mut Observation);

    /// Returns the work done so far.
    fn counts(&self) -> Counts;

    /// Returns the iterations of the last step and its final relative correction (zeros without
    /// iterations).
    fn last_iteration(&self) -> (usize, f64) {
        (0, 0.0)
    }

    /// Continues from the current state after a jump of loads or of the torques that the motion
    /// adds ([`PrescribedMotion::added_torque`](crate::PrescribedMotion::added_torque)).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the acceleration cannot be computed.
    fn restart(&mut self) -> Result<(), StepError> {
        Ok(())
    }

    /// Continues with masses and damping of an arm that is the same otherwise, as after a payload is
    /// picked up or put down: positions and velocities stay.
    ///
    /// # Errors
    /// [`StepError::NotInMaximal`]; as [`Stepper::restart`].
    fn change_masses(&mut self, plant: &Arc<Plant>) -> Result<(), StepError>;

    /// Returns a copy that goes on from the current state with the same bits; `None` if the solver
    /// cannot be copied.
    fn copy(&self) -> Option<Box<dyn Stepper>> {
        None
    }
}

/// Bound on elastic coordinates (m, rad): larger values are not a deflection of a link.
pub(crate) const LARGEST_DEFLECTION: f64 = 3.0;
