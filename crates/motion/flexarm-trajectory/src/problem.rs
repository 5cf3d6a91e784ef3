//! Problems of files, samples and plans: value found, value expected and remedy.
//!
//! [`Problem::at`] adds the place of a problem.

use std::fmt::Display;

use flexarm_settings::{Finding, Place};

use crate::curve::LONGEST;
use crate::error::TrajectoryError;
use crate::polynomial::FARTHEST;

/// A problem in a file, before its place is known; the message includes the remedy.
pub(crate) struct Problem {
    /// Stable short name.
    pub(crate) code: &'static str,
    pub(crate) message: String,
}

impl Problem {
    pub(crate) fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }

    /// The text of a file in another encoding.
    pub(crate) fn not_utf8() -> Self {
        Self::new("not-utf8", "the file is not UTF-8 text; save it as UTF-8")
    }

    /// A version of the format that is not read.
    pub(crate) fn format(found: i64) -> Self {
        Self::new("format", format!("format {found} is not known; this program reads `format = 1`"))
    }

    /// Values or times beyond any real motion, or too extreme for polynomials in f64.
    pub(crate) fn out_of_range(joint: &str) -> Self {
        let message = format!(
            "joint {joint:?}: values or times are too extreme (a motion has {FARTHEST:e} rad or m and {LONGEST:e} s \
             at most); check the units of the file"
        );
        Self::new("out-of-range", message)
    }

    pub(crate) fn unknown_unit(key: &str, found: &str, accepted: &str) -> Self {
        Self::new("unknown-unit", format!("unit {found:?} of `{key}` is not known; accepted: {accepted}"))
    }

    /// Two statements of different units of angles.
    pub(crate) fn contradicting_units(first: &str, second: &str) -> Self {
        let message = format!("`unit` is stated twice, as {first:?} and as {second:?}; keep one line");
        Self::new("contradicting-units", message)
    }

    /// A name that is not a joint of the file.
    pub(crate) fn unknown_joint(key: &str, name: &str, joints: &[String]) -> Self {
        let message = format!("{name:?} in `{key}` is not a joint of this file; it has {}", list(joints));
        Self::new("unknown-joint", message)
    }

    pub(crate) fn repeated_column(name: &str, first: usize) -> Self {
        let message = format!("the column is called {name:?}, as column {first} is; remove or rename one of them");
        Self::new("repeated-column", message)
    }

    pub(crate) fn value(key: &str, found: impl Display, expected: &str) -> Self {
        Self::new("value", format!("`{key}` is {found}; expected {expected}"))
    }

    /// The error of a file, at a line and a column if they are known.
    pub(crate) fn at(self, origin: &str, line: Option<usize>, column: Option<usize>) -> TrajectoryError {
        let place = Place { line, column, ..Place::of_file(origin) };
        TrajectoryError::File(Box::new(Finding::error(self.code, place.to_string(), self.message, "")))
    }
}

impl From<SampleError> for Problem {
    fn from(error: SampleError) -> Self {
        Self::new("samples", error.to_string())
    }
}

impl From<PlanError> for Problem {
    fn from(error: PlanError) -> Self {
        let code = if matches!(error, PlanError::MissingLimit { .. }) { MISSING_LIMIT } else { "plan" };
        Self::new(code, error.to_string())
    }
}

/// Code of the finding about a move whose duration depends on a limit that is not known.
pub const MISSING_LIMIT: &str = "missing-limit";

/// A problem with sampled values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// Times that do not increase.
    #[error(
        "time {this} s does not follow {previous} s; times must increase from row to row: sort the rows and remove repeated ones"
    )]
    TimeNotIncreasing {
        /// Index of the row concerned, from 0.
        row: usize,
        /// Time of the previous row, s.
        previous: f64,
        /// Time of the row, s.
        this: f64,
    },
    /// Accelerations without velocities.
    #[error(
        "joint {joint:?} has accelerations but no velocities; add the column \"{joint}.vel\" or drop \"{joint}.acc\""
    )]
    AccelerationWithoutVelocity {
        /// Joint name.
        joint: String,
    },
    /// Cut-off of a smoothing that the samples do not resolve.
    #[error(
        "a smoothing with a cut-off of {found} Hz; expected more than 0 and less than half the sampling rate, {most_hz:.4} Hz"
    )]
    Cutoff {
        /// Cut-off given (Hz).
        found: f64,
        /// Half the sampling rate (Hz).
        most_hz: f64,
    },
    /// Joints, rows or values are missing, repeated or not finite.
    #[error("{0}")]
    Invalid(String),
}

impl SampleError {
    /// Fewer than two rows.
    pub fn too_few(found: usize) -> Self {
        Self::Invalid(format!("{found} rows of samples; expected at least 2, a start and an end"))
    }

    pub(crate) fn no_joint() -> Self {
        Self::Invalid("no joint columns; expected at least one joint beside the time".into())
    }

    pub(crate) fn repeated_joint(joint: &str) -> Self {
        Self::Invalid(format!("joint {joint:?} appears twice; rename or remove one of them"))
    }

    pub(crate) fn not_finite(what: &str, value: f64) -> Self {
        Self::Invalid(format!("{what} is {value}; expected a finite number: remove or repair the row"))
    }
}

/// A problem with a plan. Moves are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A limit that the profile needs is missing.
    #[error(
        "move {number} has no duration, and the {quantity} limit of joint {joint:?} is not known; \
         give `duration`, or the limit (for example `[limits]` `{joint} = {{ {quantity} = 2.0 }}`)"
    )]
    MissingLimit {
        /// Number of the move.
        number: usize,
        /// Joint name.
        joint: String,
        /// `"velocity"`, `"acceleration"` or `"jerk"`.
        quantity: &'static str,
    },
    /// A move, the start or the plan as a whole is invalid.
    #[error("{message}")]
    Invalid {
        /// Number of the move.
        number: Option<usize>,
        /// Value found, value expected, and the remedy.
        message: String,
    },
}

impl PlanError {
    /// Error about a move; 0 is the start, and the plan as a whole.
    pub(crate) fn of_move(number: usize, what: impl Display) -> Self {
        match number {
            0 => Self::Invalid { number: None, message: what.to_string() },
            number => Self::Invalid { number: Some(number), message: format!("move {number}: {what}") },
        }
    }

    /// Points on the way that coincide; the goal counts as the last.
    pub(crate) fn repeated_point(number: usize, via: usize) -> Self {
        Self::of_move(
            number,
            format!(
                "point {via} on the way (the goal counts as the last) lies where the one before it is; remove it, or \
                 make two moves with a hold"
            ),
        )
    }

    /// Number of the move concerned, from 1.
    pub fn move_number(&self) -> Option<usize> {
        match *self {
            Self::Invalid { number, .. } => number,
            Self::MissingLimit { number, .. } => Some(number),
        }
    }
}

/// `"a", "b"`, or `none`.
pub(crate) fn list(names: &[String]) -> String {
    match names.is_empty() {
        true => "none".to_owned(),
        false => names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "),
    }
}
