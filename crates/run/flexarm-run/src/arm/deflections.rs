//! TCP deflections in many runs of one arm, on all cores.
//!
//! For studies in which payload, motion, stiffness and damping vary and only the deflection is
//! needed. For recordings, drives or settling use [`Arm::simulate_batch`]. Start at
//! [`Arm::deflections`].

use std::sync::Arc;

use flexarm_stepping::{Plant, Spring, ToolDeflection, ToolRun};
use rayon::prelude::*;

use crate::arm::Arm;
use crate::arm::options::RunOptions;
use crate::error::Error;
use crate::motions::scenario::Scenario;
use crate::run::prepare::{loaded, runnable};

/// One run of [`Arm::deflections`]: scenario and changes to the arm.
#[derive(Clone, Debug)]
pub struct Variation {
    /// Motion, loads, payloads, start. A payload attached at 0 is carried from the start.
    pub scenario: Scenario,
    /// Factor on all stiffnesses.
    pub stiffness: f64,
    /// Factor on all damping: ratios, coefficients, dampers. Stiffness-proportional damping also
    /// follows the stiffness factor.
    pub damping: f64,
}

impl Variation {
    /// Returns a variation of the unchanged arm.
    pub fn new(scenario: impl Into<Scenario>) -> Self {
        Self { scenario: scenario.into(), stiffness: 1.0, damping: 1.0 }
    }

    /// Sets the factor on all stiffnesses.
    #[must_use]
    pub fn with_stiffness(self, factor: f64) -> Self {
        Self { stiffness: factor, ..self }
    }

    /// Sets the factor on all damping.
    #[must_use]
    pub fn with_damping(self, factor: f64) -> Self {
        Self { damping: factor, ..self }
    }
}

impl Arm {
    /// Computes peak, RMS and final TCP deflection of each run; with `keep_samples` also the
    /// deflection after every step.
    ///
    /// Figures are evaluated at the start and at the end of every step, not at the log rate. Results
    /// do not depend on the number of threads of the pool of `rayon`. A failed run does not stop the
    /// others. Once `stop` returns true, runs that have not started end with
    /// [`Error::Interrupted`].
    ///
    /// # Errors
    /// Per run: as [`Arm::simulate`]; [`Error::Value`] unless both factors are positive.
    pub fn deflections(
        &self,
        runs: &[Variation],
        options: &RunOptions,
        keep_samples: bool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Result<ToolDeflection, Error>> {
        let one = |run: &Variation| {
            if stop() {
                return Err(Error::Interrupted { t: 0.0, partial: false });
            }
            let plant = Arc::new(self.varied(run, options)?);
            let run = ToolRun {
                step_s: options.step_s,
                duration_s: run.scenario.duration_s(),
                stepper: options.stepper,
                start: run.scenario.start,
                tool: self.tcp.clone(),
                keep_samples,
            };
            run.deflection(&plant).map_err(|error| self.explained(error))
        };
        runs.par_iter().map(one).collect()
    }

    /// Returns the arm of a run, with its factors and loads.
    fn varied(&self, run: &Variation, options: &RunOptions) -> Result<Plant, Error> {
        let scenario = &run.scenario;
        let springs = self.scaled_springs(run.stiffness, run.damping)?;
        runnable(&scenario.motion, options)?;
        crate::robot::loops::along_motion(&self.rigid, &scenario.motion.trajectory)?;
        let plant = self.plant_with(springs, scenario.motion.prescribed()).map_err(|error| self.explained(error))?;
        Ok(loaded(self.robot(), scenario, options, plant)?.0)
    }
}

impl Arm {
    /// Returns the springs with scaled stiffness and damping.
    pub(crate) fn scaled_springs(&self, stiffness: f64, damping: f64) -> Result<Vec<Spring>, Error> {
        for (what, found) in [("stiffness", stiffness), ("damping", damping)] {
            if !(found > 0.0 && found.is_finite()) {
                return Err(Error::Value(format!("the factor of the {what} must be positive, found {found}")));
            }
        }
        let scaled = |spring: &Spring| {
            let scaled = spring.clone().stiffened(stiffness);
            Spring { damping: scaled.damping.scaled(damping), ..scaled }
        };
        Ok(self.springs.iter().map(scaled).collect())
    }
}
