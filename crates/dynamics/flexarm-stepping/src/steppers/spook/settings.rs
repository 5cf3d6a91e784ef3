//! Settings of SPOOK and its entry in the registry of steppers; Σ, Υ and τ are those of the module.
//!
//! Start at [`SpookSettings`]. Not here: the equations (the parent module), the step (`solve.rs`).

use std::sync::Arc;

use flexarm_settings::Words;
use nalgebra::DVector;

use crate::error::StepError;
use crate::plant::Plant;
use crate::stepper::Stepper;
use crate::steppers::spook::Spook;
use crate::steppers::{Method, StepRule, StepperEntry, StepperKind, StepperSetting};

pub(in crate::steppers) static ENTRY: StepperEntry = StepperEntry {
    name: "spook",
    aliases: &[],
    help: "Bodies with compliant constraints, first order; lumped links without motors",
    steps: StepRule::AnyLength,
    default_step_s: 1e-4,
    order: 1,
    maximal: true,
    allocates: false,
    with: |options| StepperKind::Spook(options.spook),
};

/// Axes in which the relative motion of an elastic joint is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ConstraintForm {
    /// In the proximal frame, with the exact Jacobian; the stiffness is constant.
    #[default]
    Local,
    /// In world axes, with the stiffness rotated along; equal to the local form to first order in
    /// the deflection.
    Global,
}

impl Words for ConstraintForm {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("local", Self::Local, "Relative motion in the proximal frame"),
        ("global", Self::Global, "Relative motion in world axes"),
    ];
}

/// Relation of Σ and Υ to the damping time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SpookPreset {
    /// `Υ = 1/(1 + 4 τ/h)` with the physical damping time of each elastic joint; τ = 2h for rigid
    /// joints.
    #[default]
    Exact,
    /// Choice of the thesis: τ = 2h everywhere and `1 + 4 τ/h ≈ 4 τ/h`, so Υ = 1/8 and Σ = K^-1/(2
    /// h²).
    Source,
}

impl Words for SpookPreset {
    const WORDS: &'static [(&'static str, Self, &'static str)] =
        &[("exact", Self::Exact, "Physical damping time"), ("source", Self::Source, "Damping time of two steps")];
}

/// Settings of SPOOK.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SpookSettings {
    /// Local or global constraint form.
    pub form: ConstraintForm,
    /// Exact or source preset.
    pub preset: SpookPreset,
}

impl Method for SpookSettings {
    fn entry(&self) -> &'static StepperEntry {
        &ENTRY
    }

    fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        vec![("form", StepperSetting::of_word(self.form)), ("preset", StepperSetting::of_word(self.preset))]
    }

    fn start(&self, plant: Arc<Plant>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError> {
        Ok(Box::new(Spook::new(Arc::unwrap_or_clone(plant), h, *self, e)?))
    }
}
