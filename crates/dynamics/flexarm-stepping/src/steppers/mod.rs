//! Registry of steppers: the choices of programs, command line and tests, and their construction.
//!
//! **A new stepper** is a file in this folder plus its lines here: `mod` and `use`, a variant of
//! [`StepperKind`], its line in `method` and in [`STEPPERS`]. The file contains the integrator,
//! settings that implement `Method`, and a [`StepperEntry`]. The integrator is an `ImplicitStep`
//! (`implicit.rs`; see `sdirk3.rs`), a [`crate::Integrator`] over [`crate::SecondOrderSystem`] (see
//! `rk4.rs`), or a [`Stepper`] of its own. Names and help of the command line, summaries,
//! and the tests over all steppers read [`STEPPERS`]; settings chosen by the user are also fields
//! of [`StepperOptions`].

mod accuracy;
mod extrapolated;
mod generalized_alpha;
mod reference;
mod rk4;
pub(crate) mod sdirk3;
pub(crate) mod spook;

use std::sync::Arc;

use flexarm_settings::Words;
use nalgebra::DVector;

use crate::error::StepError;
use crate::plant::Plant;
use crate::statics::static_equilibrium;
use crate::stepper::{Start, Stepper};

pub use accuracy::error_of_a_period;
pub use extrapolated::ExtrapolatedAlpha;
pub use generalized_alpha::{AlphaSettings, GeneralizedAlpha};
pub use reference::{Reference, ReferenceMethod, ReferenceSettings};
pub use rk4::Rk4;
pub use sdirk3::Sdirk3;
pub use spook::{ConstraintForm, Spook, SpookPreset, SpookSettings};

/// Time stepper with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepperKind {
    /// Implicit, reduced coordinates.
    GeneralizedAlpha(AlphaSettings),
    /// Compliant constraints in maximal coordinates.
    Spook(SpookSettings),
    /// Explicit, reduced coordinates.
    Rk4,
    /// Variable step size with error control, reduced coordinates.
    Reference(ReferenceSettings),
    /// Implicit, third order, L-stable, reduced coordinates.
    Sdirk3,
    /// Generalised-alpha with full and half step, extrapolated.
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

    /// Returns the properties of the stepper that do not depend on its settings.
    pub fn entry(&self) -> &'static StepperEntry {
        self.method().entry()
    }

    /// Returns the name on the command line.
    pub fn name(&self) -> &'static str {
        self.entry().name
    }

    /// Returns the settings with their keys in summaries, in order.
    pub fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        self.method().settings()
    }
}

impl Default for StepperKind {
    fn default() -> Self {
        Self::GeneralizedAlpha(AlphaSettings::default())
    }
}

/// Properties of a stepper that do not depend on its settings.
#[derive(Debug)]
pub struct StepperEntry {
    /// Name on the command line, in summaries and in messages.
    pub name: &'static str,
    /// Accepted alternative spellings of the name.
    pub aliases: &'static [&'static str],
    /// One line of help.
    pub help: &'static str,
    /// Rule for its step size.
    pub steps: StepRule,
    /// Default step size (s); accurate to about one per cent for the shipped robots.
    pub default_step_s: f64,
    /// Minimum order of convergence; 0 for solvers with error control.
    pub order: u32,
    /// Whether it works in maximal coordinates, without support for modal links, torque drives,
    /// payload changes, nonlinear springs and mimic joints.
    pub maximal: bool,
    /// Whether its steps allocate, because the solver is from another library.
    pub allocates: bool,
    /// Returns the stepper with its part of the options.
    pub with: fn(&StepperOptions) -> StepperKind,
}

impl StepperEntry {
    /// Returns the stepper with this name or alias.
    pub fn named(word: &str) -> Option<&'static Self> {
        STEPPERS.into_iter().find(|entry| entry.name == word || entry.aliases.contains(&word))
    }
}

/// Rule for the step size of a stepper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepRule {
    /// As given; stable for any step size.
    AnyLength,
    /// As given; refused above the stability limit.
    UpToTheStabilityLimit,
    /// Chosen by error control; the given step is the output interval.
    ByErrorControl,
}

/// Settings of all steppers; each uses its own part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepperOptions {
    /// Settings of generalised-alpha.
    pub alpha: AlphaSettings,
    /// Settings of SPOOK.
    pub spook: SpookSettings,
    /// Settings of the reference stepper.
    pub reference: ReferenceSettings,
}

/// Value of a stepper setting in summaries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepperSetting {
    /// A number.
    Number(f64),
    /// On or off.
    Flag(bool),
    /// One of several words.
    Word(&'static str),
}

impl StepperSetting {
    /// Returns the setting of a choice.
    fn of_word(choice: impl Words) -> Self {
        Self::Word(choice.word().unwrap_or_default())
    }
}

/// Interface between the registry and the settings of a stepper.
trait Method {
    fn entry(&self) -> &'static StepperEntry;

    /// Returns the settings with their keys in summaries, in order.
    fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        Vec::new()
    }

    /// Creates the stepper at `t = 0` with elastic coordinates `e`; `h` (s) is positive.
    fn start(&self, plant: Arc<Plant>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError>;
}

/// Creates a stepper of the given kind, started at `t = 0`.
///
/// # Errors
/// [`StepError::Setup`] if the step is not a positive time, settings are invalid or the stepper
/// does not support a feature of the arm, [`StepError::NoEquilibrium`] if the initial equilibrium
/// is not found, [`StepError::UnstableStep`] if the step is too large for an explicit stepper,
/// [`StepError::Singular`] if the initial accelerations cannot be computed.
pub fn new_stepper(
    kind: StepperKind,
    plant: impl Into<Arc<Plant>>,
    h: f64,
    start: Start,
) -> Result<Box<dyn Stepper>, StepError> {
    let (plant, e) = at_start(plant.into(), h, start)?;
    kind.method().start(plant, h, &e)
}

/// Checks the step size and returns the arm at `t = 0`, with the inertias that are due there, and its
/// elastic coordinates.
pub(crate) fn at_start(mut plant: Arc<Plant>, h: f64, start: Start) -> Result<(Arc<Plant>, DVector<f64>), StepError> {
    if !(h.is_finite() && h > 0.0) {
        return Err(StepError::Setup(format!("the step must be a positive time in seconds, found {h}")));
    }
    if !plant.inertia_changes.is_empty() {
        Arc::make_mut(&mut plant).carry_from_start()?;
    }
    let e = match start {
        Start::Equilibrium => static_equilibrium(&plant, 0.0)?,
        Start::Undeformed => DVector::zeros(plant.model.n_elastic()),
    };
    Ok((plant, e))
}
