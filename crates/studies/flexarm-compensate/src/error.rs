//! Why a motion cannot be compensated.

use flexarm_analysis::{InversionError, LinearError, ShaperError};
use flexarm_run::ExternalError;
use flexarm_stepping::TargetError;

/// Why a motion cannot be compensated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// A rigid robot.
    #[error("the robot has no flexible link and no elastic drive: its tool is where the rigid arm has it")]
    NothingYields,
    /// Corners.
    #[error(
        "the velocity jumps at {t_s} s, which the dynamic method cannot correct: let the motion begin and end at rest and round its corners, or take the static method"
    )]
    Corner {
        /// When (s).
        t_s: f64,
    },
    /// Nothing is to be kept.
    #[error("no component of the tool is chosen: choose some of x, y, z, rx, ry, rz")]
    NoComponent,
    /// A number that makes no sense.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Which.
        what: &'static str,
        /// Found.
        found: f64,
        /// Expected.
        expected: &'static str,
    },
    /// The run is not logged at the times at which the rigid arm is looked at.
    #[error("the run has no sample at {t_s} s (off by {off_s:.1e} s): choose a step that divides 0.001 s")]
    Logged {
        /// When (s).
        t_s: f64,
        /// By how much (s).
        off_s: f64,
    },
    /// The other robot does not have the same joints.
    #[error("the plant has the joints {found:?}, the robot {expected:?}: they must be the same")]
    OtherJoints {
        /// Of the plant.
        found: Vec<String>,
        /// Of the robot.
        expected: Vec<String>,
    },
    /// Commands pass limits that the motion keeps.
    #[error(
        "the new commands pass limits that the motion itself keeps: {}; {}",
        limits.join("; "),
        if *slower { "a slower motion does not mend that, or loads hold its times: change it there, or take it all the same (`limits` = tell)" } else { "let the motion be slower (`limits` = slow), or take it all the same (tell)" }
    )]
    Limits {
        /// Each in a sentence.
        limits: Vec<String>,
        /// A slower motion was tried.
        slower: bool,
    },
    /// Limits of the acceleration for another number of joints.
    #[error("{found} limits of the acceleration for a robot of {expected} joints: one for each is expected")]
    Accelerations {
        /// Found.
        found: usize,
        /// Expected.
        expected: usize,
    },
    /// A payload that changes.
    #[error(
        "the payload changes at {at_s} s, and the static method knows one payload: use the dynamic method, or compensate each part of the motion by itself"
    )]
    StaticPayload {
        /// When (s).
        at_s: f64,
    },
    /// A servo that does not hold its joint.
    #[error(
        "the servo of joint {joint:?} holds no position, so that there are no targets for it: give it a position_gain and a velocity_gain, or take motors that are where they are commanded (drives = elastic)"
    )]
    NothingHolds {
        /// The joint.
        joint: String,
    },
    /// There is no such shaper.
    #[error(transparent)]
    Shaper(#[from] ShaperError),
    /// The modes at the end of the motion are not found.
    #[error("the modes at the end of the motion, for the shaper: {0}")]
    Modes(#[from] LinearError),
    /// The linearised arm cannot be inverted.
    #[error(transparent)]
    Inversion(#[from] InversionError),
    /// A pose without targets.
    #[error("at {t_s:.3} s: {source}")]
    Target {
        /// When (s).
        t_s: f64,
        /// Why.
        source: TargetError,
    },
}

impl From<CompensateError> for flexarm_run::Error {
    fn from(error: CompensateError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for CompensateError {}
