//! Errors of trajectories: place, value found, value expected and remedy.
//!
//! Each error displays as one line. An error in a file is a [`Finding`] at `file:line:column`; the
//! other errors have no place in a file.

use std::io;
use std::path::PathBuf;

use flexarm_settings::Finding;

use crate::curve::LONGEST;
use crate::polynomial::FARTHEST;
use crate::problem::{PlanError, SampleError, list};

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
    File(Box<Finding>),
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
        match error {
            TrajectoryError::File(finding) => finding,
            other => Self::new(Finding::error("trajectory", "", other.to_string(), "")),
        }
    }
}

impl TrajectoryError {
    /// Sampling rate that is not positive and finite, or that would give more than 100 million
    /// rows.
    pub fn rate(rate_hz: f64, duration_s: f64) -> Self {
        Self::Value(format!(
            "sampling rate {rate_hz} Hz is not possible for {duration_s} s of motion; give a positive rate that makes \
             at most 100 million rows"
        ))
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
