//! Tool error along a run whose iterations converge fully.
//!
//! An ordinary run is not exactly a smooth function of the numbers of its arm, because its
//! iterations end early and its matrices are renewed when they are outdated. This run iterates
//! until convergence, with a matrix computed at the start of each step
//! ([`GeneralizedAlpha::exactly`](crate::GeneralizedAlpha::exactly)), so that differences of two
//! runs show the effect of a small change and nothing else. It differs from an ordinary run by the
//! iteration error of the latter, which is far below the error of the step size.

use std::sync::Arc;

use flexarm_kinematics::{Frame, rotation_vector};

use crate::error::StepError;
use crate::observation::Observation;
use crate::plant::Plant;
use crate::servo::TorqueLimited;
use crate::stepper::{Start, Stepper};
use crate::steppers::{AlphaSettings, at_start};
use crate::tool_run::{ToolPoses, steps};

/// Settings of a run with fully converged iterations.
#[derive(Clone, Debug)]
pub struct ExactRun {
    /// Settings of generalised-alpha.
    pub settings: AlphaSettings,
    /// Step size (s).
    pub step_s: f64,
    /// Duration (s); the last step may end after it.
    pub duration_s: f64,
    /// Initial state.
    pub start: Start,
    /// Tool frame.
    pub tool: Frame,
}

/// Tool error along a run: flexible minus rigid arm, at the start and after every step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToolErrors {
    /// Times (s).
    pub times_s: Vec<f64>,
    /// Errors at these times: displacement (m) and rotation vector (rad), world axes.
    pub errors: Vec<[f64; 6]>,
    /// Servos that reached their torque limits, in order of the time of the first limited sample.
    pub limited: Vec<TorqueLimited>,
}

impl ExactRun {
    /// Runs an arm.
    ///
    /// # Errors
    /// As [`new_stepper`](crate::new_stepper) and [`Stepper::step`].
    pub fn errors(&self, plant: &Plant) -> Result<ToolErrors, StepError> {
        let Self { settings, step_s, .. } = *self;
        let (plant, e) = at_start(Arc::new(plant.clone()), step_s, self.start)?;
        let mut stepper = settings.stepper(plant.clone(), step_s, &e)?;
        stepper.integrator = stepper.integrator.exactly();
        let (mut observed, mut poses) = (Observation::new(&plant), ToolPoses::new(&plant, &self.tool));
        let mut found = ToolErrors::default();
        for step in 0..=steps(self.duration_s, step_s) {
            if step > 0 {
                stepper.step()?;
            }
            stepper.observe(&mut observed);
            let [X_rigid, X] = poses.at(&observed);
            let p = X.translation.vector - X_rigid.translation.vector;
            let theta = rotation_vector(&(X.rotation.matrix() * X_rigid.rotation.matrix().transpose()));
            found.times_s.push(observed.t);
            found.errors.push([p.x, p.y, p.z, theta.x, theta.y, theta.z]);
        }
        found.limited = stepper.system.servo.as_ref().map_or(Vec::new(), |servo| servo.limited.clone());
        Ok(found)
    }
}
