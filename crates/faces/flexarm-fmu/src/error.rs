//! Errors of plants and FMUs.

use std::path::PathBuf;

use crate::variables::Kind;

/// Why a plant refuses.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FmuError {
    /// The robot cannot be loaded, started or stepped.
    #[error(transparent)]
    Robot(#[from] flexarm::Error),
    /// Files exist or cannot be written.
    #[error(transparent)]
    Written(#[from] flexarm::errors::FileError),
    /// There is no variable with this reference.
    #[error("there is no variable with the reference {0}")]
    Reference(usize),
    /// A variable has another type.
    #[error("{name} is a {}", match kind { Kind::Real => "number", Kind::Boolean => "truth value" })]
    Kind {
        /// Name of the variable.
        name: String,
        /// Its type.
        kind: Kind,
    },
    /// A variable is computed.
    #[error("{0} is computed and cannot be set; parameters and inputs can")]
    NotSettable(String),
    /// A parameter is set after the start.
    #[error("{0}: the arm has started; set parameters before, or reset the arm")]
    Started(String),
    /// The arm is no differential equation in its coordinates.
    #[error(
        "this arm has no equations for model exchange: it is rigid, has hysteresis, or its stepper is spook; use co-simulation"
    )]
    NoEquations,
    /// The plant is not started.
    #[error("the arm has not started: exit the initialisation first")]
    NotStarted,
    /// A value is not finite.
    #[error("{name} = {found}: expected a finite number")]
    NotFinite {
        /// Name of the variable.
        name: String,
        /// Value.
        found: f64,
    },
    /// A truth value is another number.
    #[error("{name} = {found}: expected 0 or 1")]
    TruthValue {
        /// Name of the variable.
        name: String,
        /// Value.
        found: f64,
    },
    /// The first step, which sets the step of the solver, is far shorter than the parameter `step`.
    #[error(
        "the first communication step is {length_s} s, less than a thousandth of the solver's step of {step_s} s: set the parameter step to what such steps need"
    )]
    Short {
        /// Communication step (s).
        length_s: f64,
        /// Parameter `step` (s).
        step_s: f64,
    },
    /// A step has no positive length.
    #[error("the communication step is {0} s: expected a positive length")]
    Length(f64),
    /// The caller is at another time.
    #[error("the communication step starts at {given_s} s, the arm is at {own_s} s")]
    Time {
        /// Time of the caller (s).
        given_s: f64,
        /// Time of the plant (s).
        own_s: f64,
    },
    /// A file cannot be read or written.
    #[error("{}: {what}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Cause.
        what: String,
    },
    /// A function is called out of order.
    #[error("{function} cannot be called {phase}")]
    Order {
        /// Name of the function.
        function: &'static str,
        /// When it was called.
        phase: &'static str,
    },
    /// The token of the importer is not that of the FMU.
    #[error(
        "the token {given:?} is not that of this FMU, {own:?}: its description and its resources do not belong together"
    )]
    Token {
        /// Given token.
        given: String,
        /// Token in the resources.
        own: String,
    },
}
