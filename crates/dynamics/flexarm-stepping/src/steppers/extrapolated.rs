//! Richardson extrapolation of generalised-alpha with step sizes h and h/2.
//!
//! ```text
//! y = y_{h/2} + (y_{h/2} - y_h) / 3      y: positions, velocities, accelerations        (1)
//! ```
//! The error of generalised-alpha starts with `h²`, which (1) eliminates: third order, and with ρ
//! near 1, where the scheme is nearly symmetric in time, close to fourth. It costs three steps
//! instead of one. The two runs are independent of each other (*passive* extrapolation), so that
//! stability and the damping of modes that are too fast for the step are those of each run. Both
//! apply jumps of loads or velocities at their exact times.
//!
//! If the error has no expansion in powers of h (friction that sticks, hysteresis, fewer than
//! twelve steps per period) the extrapolation gains nothing but is harmless: the error is at most
//! that of the finer run plus a third of the difference.
//!
//! Source: [Hairer & Wanner 1996], section IV.9.

use std::sync::Arc;

use nalgebra::DVector;

use crate::error::StepError;
use crate::integrator::ReducedStepper;
use crate::observation::{Observation, observe_reduced};
use crate::plant::Plant;
use crate::stepper::{Counts, Stepper};
use crate::steppers::generalized_alpha::{AlphaSettings, GeneralizedAlpha};
use crate::steppers::{Method, StepRule, StepperEntry, StepperKind, StepperSetting};

pub(super) static ENTRY: StepperEntry = StepperEntry {
    name: "extrapolated-alpha",
    aliases: &["extrapolated"],
    help: "Generalised-alpha with the step and its half, extrapolated: third order and more, for errors below 0.01 %",
    steps: StepRule::AnyLength,
    default_step_s: 1e-3,
    order: 3,
    maximal: false,
    allocates: false,
    with: |options| StepperKind::ExtrapolatedAlpha(ExtrapolatedAlpha(options.alpha)),
};

/// Extrapolated generalised-alpha, with the settings of both runs.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ExtrapolatedAlpha(pub AlphaSettings);

impl Method for ExtrapolatedAlpha {
    fn entry(&self) -> &'static StepperEntry {
        &ENTRY
    }

    fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        self.0.settings()
    }

    fn start(&self, plant: Arc<Plant>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError> {
        // Extrapolated matrices differ more between the two runs, by errors without an expansion in
        // h: three times the error.
        let coarse = self.0.stepper(plant.clone(), h, e)?;
        let fine = self.0.stepper(plant, 0.5 * h, e)?;
        // Both start in the same state.
        let now = fine.integrator.now.clone();
        Ok(Box::new(Extrapolated { x: now.x, v: now.v, a: now.acceleration, t: 0.0, coarse, fine }))
    }
}

/// The two runs and their extrapolated state.
#[derive(Clone)]
struct Extrapolated {
    coarse: ReducedStepper<GeneralizedAlpha>,
    fine: ReducedStepper<GeneralizedAlpha>,
    /// Result of (1) after the last complete step.
    x: DVector<f64>,
    v: DVector<f64>,
    a: DVector<f64>,
    t: f64,
}

impl Extrapolated {
    fn extrapolate(&mut self) {
        let (coarse, fine) = (&self.coarse.integrator.now, &self.fine.integrator.now);
        let extrapolated = |to: &mut DVector<f64>, fine: &DVector<f64>, coarse: &DVector<f64>| {
            to.copy_from(fine);
            to.axpy(-1.0 / 3.0, coarse, 4.0 / 3.0);
        };
        let Self { x, v, a, .. } = self;
        for (to, fine, coarse) in
            [(x, &fine.x, &coarse.x), (v, &fine.v, &coarse.v), (a, &fine.acceleration, &coarse.acceleration)]
        {
            extrapolated(to, fine, coarse);
        }
        self.t = self.coarse.time();
    }
}

impl Stepper for Extrapolated {
    fn time(&self) -> f64 {
        self.t
    }

    fn step(&mut self) -> Result<(), StepError> {
        self.coarse.step()?;
        self.fine.step()?;
        self.fine.step()?;
        self.extrapolate();
        Ok(())
    }

    fn observe(&mut self, out: &mut Observation) {
        // Controllers and gears are those of the finer run.
        observe_reduced(&mut self.fine.system, self.t, &self.x, &self.v, &self.a, out);
    }

    /// Counts the steps of h and the work of both runs.
    fn counts(&self) -> Counts {
        let (coarse, fine) = (self.coarse.counts(), self.fine.counts());
        Counts {
            steps: coarse.steps,
            evaluations: coarse.evaluations + fine.evaluations,
            factorisations: coarse.factorisations + fine.factorisations,
        }
    }

    fn last_iteration(&self) -> (usize, f64) {
        let (coarse, fine) = (self.coarse.last_iteration(), self.fine.last_iteration());
        (coarse.0.max(fine.0), coarse.1.max(fine.1))
    }

    fn restart(&mut self) -> Result<(), StepError> {
        self.coarse.restart()?;
        self.fine.restart()
    }

    fn change_masses(&mut self, plant: &Arc<Plant>) -> Result<(), StepError> {
        self.coarse.change_masses(plant)?;
        self.fine.change_masses(plant)
    }

    fn copy(&self) -> Option<Box<dyn Stepper>> {
        Some(Box::new(self.clone()))
    }
}
