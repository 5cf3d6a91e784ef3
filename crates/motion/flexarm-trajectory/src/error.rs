//! Errors of trajectories: place, value found, value expected and remedy.
//!
//! Each error displays as one line. An error in a file is a [`Finding`] at `file:line:column`; the
//! other errors have no place in a file.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;

use flexarm_settings::Finding;

use crate::curve::LONGEST;
use crate::findings::fault;
use crate::polynomial::FARTHEST;

/// Error of reading, planning or writing a trajectory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// The file cannot be opened or read.
    #[error("cannot read trajectory {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file extension is unknown.
    #[error("trajectory {}: the ending is {found:?}, expected .csv (samples) or .toml (waypoints); rename or convert the file", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
        /// Its extension, without the dot.
        found: String,
    },
    /// The content of a file is wrong.
    #[error(transparent)]
    File(#[from] Box<Finding>),
    /// Sampled values are invalid.
    #[error(transparent)]
    Samples(#[from] SampleError),
    /// A plan is invalid.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The joints of the trajectory are not those of the robot.
    #[error(
        "the trajectory's joints do not match: {}it has {}, wanted are {}; rename the joints in the trajectory",
        mismatch(missing, unknown),
        list(have),
        list(want)
    )]
    JointOrder {
        /// Expected joints that the trajectory lacks.
        missing: Vec<String>,
        /// Joints of the trajectory that are not expected.
        unknown: Vec<String>,
        /// Joints of the trajectory.
        have: Vec<String>,
        /// Expected joints.
        want: Vec<String>,
    },
    /// Values or times are beyond any real motion, or too extreme for polynomials in f64.
    #[error(
        "joint {joint:?}, t = {time_s:e} s: values or times are too extreme (a motion has {FARTHEST:e} rad or m and {LONGEST:e} s at \
         most); check the units of the file"
    )]
    OutOfRange {
        /// Joint name.
        joint: String,
        /// Start of the polynomial piece concerned, s.
        time_s: f64,
    },
    /// A time scale, blend time or sampling rate is out of its range.
    #[error("{0}")]
    Value(String),
    /// Motion that does not consist of quintic moves from rest to rest.
    #[error(
        "the motion is not made of quintic moves from rest to rest: as waypoints, joint {joint:?} would be off by {difference:.2e} \
         rad (or m) at t = {time_s:.3} s; write it as samples (.csv)"
    )]
    NotWaypoints {
        /// Joint with the largest difference.
        joint: String,
        /// Time of the largest difference, s.
        time_s: f64,
        /// Maximum difference, rad or m.
        difference: f64,
    },
    /// The output cannot be written.
    #[error("cannot write the trajectory: {source}")]
    Write {
        /// Error of the operating system.
        #[from]
        source: io::Error,
    },
}

impl From<TrajectoryError> for Box<Finding> {
    fn from(error: TrajectoryError) -> Self {
        let code = match &error {
            TrajectoryError::Samples(_) => "samples",
            TrajectoryError::Plan(PlanError::MissingLimit { .. }) => MISSING_LIMIT,
            TrajectoryError::Plan(_) => "plan",
            TrajectoryError::OutOfRange { .. } => "out-of-range",
            _ => "trajectory",
        };
        match error {
            TrajectoryError::File(finding) => finding,
            other => fault(code, other.to_string()),
        }
    }
}

fn mismatch(missing: &[String], unknown: &[String]) -> String {
    let mut text = String::new();
    if !missing.is_empty() {
        text += &format!("missing {}; ", list(missing));
    }
    if !unknown.is_empty() {
        text += &format!("unknown {}; ", list(unknown));
    }
    if text.is_empty() {
        text += "a joint is requested twice; ";
    }
    text
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
    pub(crate) fn move_number(&self) -> Option<usize> {
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
