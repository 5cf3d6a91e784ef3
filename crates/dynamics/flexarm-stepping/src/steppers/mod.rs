//! The registry of steppers: what a program, a command line or a test can choose from, and how each
//! is made.
//!
//! **A new stepper** is a file in this folder and its lines here: `mod` and `use`, a variant of
//! [`StepperKind`], its line in `method` and in [`STEPPERS`]. The file has the integrator (an
//! [`crate::Integrator`] over [`crate::SecondOrderSystem`], or a [`Stepper`] of its own), settings
//! that implement `Method`, and a [`StepperEntry`]. Words and help of the command line, summaries
//! and the tests that go over all steppers read [`STEPPERS`]; settings that users choose are fields
//! of [`StepperOptions`] besides.

mod accuracy;
mod extrapolated;
mod generalized_alpha;
mod reference;
mod rk4;
mod sdirk3;
mod spook;

use std::sync::Arc;

use nalgebra::DVector;

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::statics::static_equilibrium;
use crate::stepper::{Start, Stepper};

pub use accuracy::error_of_a_period;
pub use extrapolated::ExtrapolatedAlpha;
pub use generalized_alpha::{AlphaSettings, GeneralizedAlpha};
pub(crate) use generalized_alpha::{Coefficients, Course, FOLLOWED_TO, follows, leave_of};
pub use reference::{Reference, ReferenceMethod, ReferenceSettings};
pub use rk4::{Rk4, STABILITY_LIMIT};
pub use sdirk3::Sdirk3;
pub use spook::{ConstraintForm, Spook, SpookPreset, SpookSettings};

/// Which time stepper, with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepperKind {
    /// Implicit, reduced coordinates.
    GeneralizedAlpha(AlphaSettings),
    /// Compliant constraints in maximal coordinates.
    Spook(SpookSettings),
    /// Explicit, reduced coordinates.
    Rk4,
    /// Steps of its own choice under error control, reduced coordinates.
    Reference(ReferenceSettings),
    /// Implicit, third order, L-stable, reduced coordinates.
    Sdirk3,
    /// Generalised-alpha with the step and its half, extrapolated.
    ExtrapolatedAlpha(ExtrapolatedAlpha),
}

/// All steppers, the default first.
pub static STEPPERS: [&StepperEntry; 6] =
    [&generalized_alpha::ENTRY, &spook::ENTRY, &rk4::ENTRY, &reference::ENTRY, &sdirk3::ENTRY, &extrapolated::ENTRY];

impl StepperKind {
    fn method(&self) -> &dyn Method {
        match self {
            Self::GeneralizedAlpha(settings) => settings,
            Self::Spook(settings) => settings,
            Self::Rk4 => &rk4::Rk4Settings,
            Self::Reference(settings) => settings,
            Self::Sdirk3 => &sdirk3::Sdirk3Settings,
            Self::ExtrapolatedAlpha(settings) => settings,
        }
    }

    /// What is known of the stepper whatever its settings.
    pub fn entry(&self) -> &'static StepperEntry {
        self.method().entry()
    }

    /// Word of the command line.
    pub fn name(&self) -> &'static str {
        self.entry().name
    }

    /// The settings under their keys in summaries, in their order.
    pub fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        self.method().settings()
    }
}

impl Default for StepperKind {
    fn default() -> Self {
        Self::GeneralizedAlpha(AlphaSettings::default())
    }
}

/// What is known of a stepper whatever its settings.
#[derive(Debug)]
pub struct StepperEntry {
    /// Word of the command line, of summaries and messages.
    pub name: &'static str,
    /// Other spellings of it that are understood.
    pub aliases: &'static [&'static str],
    /// One line of help.
    pub help: &'static str,
    /// Where its steps come from and how long they may be.
    pub steps: StepRule,
    /// Step where none is given (s): what the shipped robots are computed with to about a per cent.
    pub default_step_s: f64,
    /// Power of the step with which its error falls at least; of solvers with error control 0.
    pub order: u32,
    /// Whether it works in maximal coordinates: no modal links, torques, payloads that change,
    /// curved springs, mimic joints.
    pub maximal: bool,
    /// Whether its steps allocate, because its solver is another library's.
    pub allocates: bool,
    /// The stepper with its part of the options.
    pub with: fn(&StepperOptions) -> StepperKind,
}

/// Where the steps of a stepper come from and how long they may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepRule {
    /// As given, and stable whatever their length.
    AnyLength,
    /// As given, and refused beyond the limit of stability.
    UpToTheStabilityLimit,
    /// Chosen by error control; what is given is the distance of the points.
    ByErrorControl,
}

/// Settings of all steppers, of which each takes its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepperOptions {
    /// Generalised-alpha.
    pub alpha: AlphaSettings,
    /// SPOOK.
    pub spook: SpookSettings,
    /// Reference.
    pub reference: ReferenceSettings,
}

/// A setting of a stepper as summaries tell it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepperSetting {
    /// A number.
    Number(f64),
    /// On or off.
    Flag(bool),
    /// One of several words.
    Word(&'static str),
}

/// What the registry asks of the settings of a stepper.
trait Method {
    fn entry(&self) -> &'static StepperEntry;

    /// Under their keys in summaries, in their order.
    fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        Vec::new()
    }

    /// The stepper at `t = 0` with elastic coordinates `e`; `h` (s) is positive.
    fn start(&self, arm: Arc<FlexibleArm>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError>;
}

/// Makes a stepper of the kind, started at `t = 0`.
///
/// # Errors
/// [`StepError::Setup`] if the step is no positive time, settings make no sense or the stepper does
/// not know something of the arm, [`StepError::NoEquilibrium`] if the start cannot be found,
/// [`StepError::UnstableStep`] if the step is too long for an explicit stepper,
/// [`StepError::Singular`] if the first accelerations cannot be solved.
pub fn new_stepper(
    kind: StepperKind,
    arm: impl Into<Arc<FlexibleArm>>,
    h: f64,
    start: Start,
) -> Result<Box<dyn Stepper>, StepError> {
    if !(h.is_finite() && h > 0.0) {
        return Err(StepError::Setup(format!("the step must be a positive time in seconds, found {h}")));
    }
    let mut arm = arm.into();
    if !arm.inertia_changes.is_empty() {
        Arc::make_mut(&mut arm).carry_from_start()?;
    }
    let e = match start {
        Start::Equilibrium => static_equilibrium(&arm, 0.0)?,
        Start::Undeformed => DVector::zeros(arm.n_elastic_coordinates()),
    };
    kind.method().start(arm, h, &e)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table and the kinds say the same, and no word means two steppers.
    #[test]
    fn every_entry_makes_a_stepper_of_its_own_name() {
        let mut words: Vec<&str> = Vec::new();
        for entry in STEPPERS {
            let kind = (entry.with)(&StepperOptions::default());
            assert!(std::ptr::eq(kind.entry(), entry), "{}", entry.name);
            words.push(entry.name);
            words.extend(entry.aliases);
        }
        assert_eq!(StepperKind::default().name(), STEPPERS[0].name);
        let count = words.len();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), count, "{words:?}");
    }
}
