//! Errors of plants and FMUs. An importer gets their texts by its logger, a caller in C by
//! `flexarm_error`.

use std::path::PathBuf;

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
    /// A variable does not exist, has another type, or cannot be set now.
    #[error("{0}")]
    Variable(String),
    /// A number is not finite, or a truth value is another number.
    #[error("{name} = {found}: expected {expected}")]
    Value {
        /// Name of the variable.
        name: String,
        /// Value.
        found: f64,
        /// Values expected.
        expected: &'static str,
    },
    /// A list has another number of values than the plant has places for.
    #[error("{what}: {found} value(s) given, expected {expected}")]
    Length {
        /// Name of the list.
        what: &'static str,
        /// Number of values given.
        found: usize,
        /// Number of values expected.
        expected: usize,
    },
    /// The arm is no differential equation in its coordinates.
    #[error(
        "this arm has no equations for model exchange: it is rigid, has hysteresis, or its stepper is spook; use co-simulation"
    )]
    NoEquations,
    /// The plant is not started.
    #[error("the arm has not started: exit the initialisation first")]
    NotStarted,
    /// A communication step has no positive length, is far too short for the solver, or starts at
    /// another time than that of the plant, which is unchanged.
    #[error("{0}")]
    Step(String),
    /// A file cannot be read or written, or does not belong to the FMU.
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
}

impl FmuError {
    /// Checks the number of values of a list.
    pub(crate) fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self::Length { what, found, expected }) }
    }

    /// Error about a number that is not finite.
    pub(crate) fn not_finite(name: &str, found: f64) -> Self {
        Self::Value { name: name.to_owned(), found, expected: "a finite number" }
    }

    /// Error about a variable that is computed.
    pub(crate) fn not_settable(name: &str) -> Self {
        Self::Variable(format!("{name} is computed and cannot be set; parameters and inputs can"))
    }

    /// Error about a parameter that is set after the start.
    pub(crate) fn started(name: &str) -> Self {
        Self::Variable(format!("{name}: the arm has started; set parameters before, or reset the arm"))
    }
}
