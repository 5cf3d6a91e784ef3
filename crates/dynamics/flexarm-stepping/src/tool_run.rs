//! Runs of which only the deflection of the tool is wanted. Not here: recordings, settling figures,
//! drives.

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, Pose, forward_kinematics};
use nalgebra::{DVector, Vector3};

use crate::error::StepError;
use crate::observation::Observation;
use crate::plant::Plant;
use crate::stepper::Start;
use crate::steppers::{StepperKind, new_stepper};

/// Settings of a run.
#[derive(Clone, Debug)]
pub struct ToolRun {
    /// Step size (s).
    pub step_s: f64,
    /// Duration (s); the last step may end after it.
    pub duration_s: f64,
    /// Stepper.
    pub stepper: StepperKind,
    /// Initial state.
    pub start: Start,
    /// Frame whose deflection is computed.
    pub tool: Frame,
    /// Whether to keep the deflection after every step.
    pub keep_samples: bool,
}

/// Deflection of the tool in a run relative to the rigid arm on the same motion, at the start and
/// after every step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToolDeflection {
    /// Steps taken.
    pub steps: u64,
    /// Maximum distance (m).
    pub peak_m: f64,
    /// Time of the first maximum (s).
    pub t_peak_s: f64,
    /// Root mean square distance (m).
    pub rms_m: f64,
    /// Flexible minus rigid position at the end, world axes (m).
    pub end_m: [f64; 3],
    /// Deflection at the start and after every step, if samples are kept.
    pub samples_m: Vec<[f64; 3]>,
}

impl ToolDeflection {
    /// Adds the deflection of the tool (m, world axes) at t (s).
    fn include(&mut self, t: f64, deflection: Vector3<f64>, keep: bool) {
        let square = deflection.norm_squared();
        // Sum of squares until the end of the run.
        self.rms_m += square;
        if square.sqrt() > self.peak_m {
            (self.peak_m, self.t_peak_s) = (square.sqrt(), t);
        }
        self.end_m = deflection.into();
        if keep {
            self.samples_m.push(self.end_m);
        }
    }
}

impl ToolRun {
    /// Runs an arm.
    ///
    /// # Errors
    /// [`StepError`] as returned by a stepper.
    pub fn deflection(&self, plant: &Arc<Plant>) -> Result<ToolDeflection, StepError> {
        let mut stepper = new_stepper(self.stepper, plant.clone(), self.step_s, self.start)?;
        let (mut observed, mut poses) = (Observation::new(plant), ToolPoses::new(plant, &self.tool));
        let mut result = ToolDeflection { steps: steps(self.duration_s, self.step_s), ..ToolDeflection::default() };
        for step in 0..=result.steps {
            if step > 0 {
                stepper.step()?;
            }
            stepper.observe(&mut observed);
            let [rigid, flexible] = poses.at(&observed);
            result.include(observed.t, flexible.translation.vector - rigid.translation.vector, self.keep_samples);
        }
        result.rms_m = (result.rms_m / (result.steps + 1) as f64).sqrt();
        Ok(result)
    }
}

/// Returns the number of steps of a run; the last one may end after the duration.
pub(crate) fn steps(duration_s: f64, step_s: f64) -> u64 {
    (duration_s / step_s - 1e-9).ceil().max(0.0) as u64
}

/// Poses of the tool on the flexible arm and on the rigid arm, whose joints follow the motion.
pub(crate) struct ToolPoses<'a> {
    plant: &'a Plant,
    tool: &'a Frame,
    rigid: Data,
    q: DVector<f64>,
    /// Rates and accelerations of the motion, not used.
    rates: [Vec<f64>; 2],
}

impl<'a> ToolPoses<'a> {
    pub(crate) fn new(plant: &'a Plant, tool: &'a Frame) -> Self {
        let (model, m) = (&plant.model, plant.model.n_actuated());
        let rates = [vec![0.0; m], vec![0.0; m]];
        Self { plant, tool, rigid: Data::new(model), q: DVector::zeros(model.nv()), rates }
    }

    /// Returns the poses on the rigid and on the flexible arm at the time of an observation.
    pub(crate) fn at(&mut self, observed: &Observation) -> [Pose; 2] {
        let Self { plant, tool, rigid, q, rates: [rates, accelerations] } = self;
        plant.motion.sample(observed.t, &mut q.as_mut_slice()[..rates.len()], rates, accelerations);
        forward_kinematics(&plant.model, rigid, q);
        [rigid.X_WF(tool), observed.X_WB[tool.body] * tool.X_BF]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The square of a rounded root may be less than the number.
    #[test]
    fn a_peak_that_lasts_has_the_time_of_its_first_sample() {
        for k in 1..200 {
            let deflection = Vector3::new(1e-3 * f64::from(k), 0.3e-3, -0.7e-3);
            let mut result = ToolDeflection::default();
            (0..3).for_each(|step| result.include(f64::from(step), deflection, false));
            assert_eq!(result.t_peak_s, 0.0, "{k}");
        }
    }
}
