//! Ring-down under gravity: error of the stepper and error of the model.
//!
//! Not here: steady ringing during rotation (`whirl.rs`).

use flexarm::{Robot, StepperKind};
use flexarm_stepping::{Damping, ReferenceSettings};
use nalgebra::Vector3;

use crate::Error;
use crate::bench::{ALPHA, LUMPED, Rig, Worst, farthest, in_modes, in_parts};

/// Number of modes of each modal link.
pub(super) const MODES: usize = 12;
/// Damping ratio of the first mode.
pub(super) const DAMPING: f64 = 0.03;
/// Tolerance of the stepper with error control.
pub(super) const TOLERANCE: f64 = 1e-9;
/// Step size of the picture and of the claims, and sampling interval of the tip (s).
pub(super) const STEP_S: f64 = 1e-3;
/// A finer step size (s).
const FINE_STEP_S: f64 = 1e-4;

/// Indices of the models in lists.
const STIFFENED: usize = 0;
pub(super) const LINEAR: usize = 1;
pub(super) const TWO_PARTS: usize = 2;
pub(super) const FIVE_PARTS: usize = 3;

/// A link model, released and integrated by the stepper with error control.
pub(super) struct Model {
    pub(super) name: String,
    rig: Rig,
    /// Displacement of the tip from its undeformed position, every [`STEP_S`] (m).
    pub(super) path: Vec<Vector3<f64>>,
}

/// A run by one stepper.
pub(super) struct Run {
    /// Index of its model in the list.
    pub(super) model: usize,
    pub(super) stepper: &'static str,
    /// Whether its joints are compliant constraints.
    pub(super) compliant: bool,
    pub(super) step_s: f64,
    /// Maximum distance of the tip from the truth, over the peak: in total, then along x, y, z.
    pub(super) method_error: f64,
    pub(super) axis_errors: [f64; 3],
    /// Maximum distance from its own model integrated by the stepper with error control.
    pub(super) stepper_error: f64,
    pub(super) path: Vec<Vector3<f64>>,
}

/// Findings on the ring-down.
pub(super) struct RingDown {
    pub(super) duration_s: f64,
    /// First frequency of the modal links (Hz).
    pub(super) first_hz: f64,
    /// Maximum deflection of the truth (m).
    pub(super) peak_m: f64,
    /// The truth comes first.
    pub(super) models: Vec<Model>,
    pub(super) runs: Vec<Run>,
}

impl RingDown {
    pub(super) fn new(robot: &Robot, quick: bool) -> Result<Self, Error> {
        let duration_s = if quick { 0.2 } else { 1.0 };
        let first_hz = Rig::new(robot, &in_modes(MODES).1, None)?.plant.modes.frequencies_hz()[0];
        let beta = 2.0 * DAMPING / (std::f64::consts::TAU * first_hz);
        let models = models(robot, beta, duration_s)?;
        let peak_m = models[STIFFENED].path.iter().map(|u| u.norm()).worst();
        let runs = runs(&models, duration_s, peak_m, quick)?;
        Ok(Self { duration_s, first_hz, peak_m, models, runs })
    }

    /// Returns the true path of the tip.
    pub(super) fn truth(&self) -> &[Vector3<f64>] {
        &self.models[STIFFENED].path
    }

    /// Maximum distance of a model from the truth, both by the stepper with error control, over the
    /// peak.
    pub(super) fn model_error(&self, model: usize) -> f64 {
        farthest(&self.models[model].path, self.truth()) / self.peak_m
    }
}

/// Builds the models, all with the same material damping, proportional to stiffness with factor
/// `beta` (s).
fn models(robot: &Robot, beta: f64, duration_s: f64) -> Result<Vec<Model>, Error> {
    let mut robot = robot.clone();
    for link in &mut robot.flexible_links {
        link.damping = Damping::StiffnessProportional(beta);
    }
    let mut stiffened = robot.clone();
    for link in &mut stiffened.flexible_links {
        link.choices.geometric = true;
    }
    let (modal, links) = in_modes(MODES);
    let [(two, two_links), (five, five_links)] = [in_parts(2), in_parts(5)];
    let list = [
        (format!("{modal}, stiffness by load"), &stiffened, links),
        (modal, &robot, links),
        (two, &robot, two_links),
        (five, &robot, five_links),
    ];
    let precise = StepperKind::Reference(ReferenceSettings::new(TOLERANCE));
    let made = list.into_iter().map(|(name, robot, links)| {
        let rig = Rig::new(robot, &links, None)?;
        let path = rig.path(precise, STEP_S, STEP_S, duration_s)?;
        Ok(Model { name, rig, path })
    });
    made.collect()
}

/// Runs every stepper.
fn runs(models: &[Model], duration_s: f64, peak_m: f64, quick: bool) -> Result<Vec<Run>, Error> {
    let mut list = Vec::new();
    for step_s in [STEP_S, FINE_STEP_S].into_iter().take(if quick { 1 } else { 2 }) {
        list.extend(LUMPED.map(|(stepper, kind)| (TWO_PARTS, stepper, kind, step_s)));
        if step_s == STEP_S {
            list.push((FIVE_PARTS, LUMPED[2].0, ALPHA, step_s));
            list.push((LINEAR, "generalised-alpha", ALPHA, step_s));
        }
    }
    let truth = &models[STIFFENED].path;
    let made = list.into_iter().map(|(model, stepper, kind, step_s)| {
        let path = models[model].rig.path(kind, step_s, STEP_S, duration_s)?;
        let axis = |i: usize| path.iter().zip(truth).map(|(a, b)| a[i] - b[i]).worst() / peak_m;
        Ok(Run {
            model,
            stepper,
            compliant: matches!(kind, StepperKind::Spook(_)),
            step_s,
            method_error: farthest(&path, truth) / peak_m,
            axis_errors: [axis(0), axis(1), axis(2)],
            stepper_error: farthest(&path, &models[model].path) / peak_m,
            path,
        })
    });
    made.collect()
}
