//! Errors of compensating a motion.

use flexarm_analysis::{InversionError, LinearError, ShaperError};
use flexarm_run::ExternalError;
use flexarm_stepping::TargetError;

/// An error of compensating a motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// A robot without flexible links and elastic drives.
    #[error("the robot has no flexible link and no elastic drive: there is no deflection to compensate")]
    NothingYields,
    /// A velocity jump in the motion.
    #[error(
        "the velocity jumps at {t_s} s, which the dynamic method cannot correct: start and end the motion at rest \
         and blend its corners, or use the static method"
    )]
    Corner {
        /// Time of the jump (s).
        t_s: f64,
    },
    /// No TCP component is selected.
    #[error("no TCP component is selected: select at least one of x, y, z, rx, ry, rz")]
    NoComponent,
    /// An invalid number.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Name of the value.
        what: &'static str,
        /// Value found.
        found: f64,
        /// Values expected.
        expected: &'static str,
    },
    /// The run has no sample at a sampling time of the rigid arm.
    #[error("the run has no sample at {t_s} s (off by {off_s:.1e} s): choose a step that divides 0.001 s")]
    Logged {
        /// Sampling time (s).
        t_s: f64,
        /// Difference to the nearest sample (s).
        off_s: f64,
    },
    /// A plant with other joints than the robot.
    #[error("the plant has the joints {found:?}, the robot {expected:?}: they must be the same")]
    OtherJoints {
        /// Joints of the plant.
        found: Vec<String>,
        /// Joints of the robot.
        expected: Vec<String>,
    },
    /// Commands violate limits that the motion itself keeps.
    #[error(
        "the new commands exceed limits that the original motion satisfies: {}; {}",
        limits.join("; "),
        if *slower {
            "a slower motion does not help, or loads fix its timing: change the motion there, or accept the violation \
             (`limits` = tell)"
        } else {
            "slow the motion down (`limits` = slow), or accept the violation (tell)"
        }
    )]
    Limits {
        /// Violated limits, a sentence each.
        limits: Vec<String>,
        /// Whether a slower motion was tried.
        slower: bool,
    },
    /// A wrong number of acceleration limits.
    #[error("{found} acceleration limits for a robot of {expected} joints: expected one per joint")]
    Accelerations {
        /// Number found.
        found: usize,
        /// Number expected.
        expected: usize,
    },
    /// A payload change, with the static method.
    #[error(
        "the payload changes at {at_s} s, but the static method supports only one payload: use the dynamic method, \
         or compensate each part of the motion separately"
    )]
    StaticPayload {
        /// Time of the change (s).
        at_s: f64,
    },
    /// A servo that does not hold its position.
    #[error(
        "the servo of joint {joint:?} does not control position, so that no targets can be computed for it: set \
         its position_gain and velocity_gain, or use motors that follow their commands exactly (drives = elastic)"
    )]
    NothingHolds {
        /// The joint.
        joint: String,
    },
    /// An invalid shaper.
    #[error(transparent)]
    Shaper(#[from] ShaperError),
    /// The modes at the end of the motion cannot be computed.
    #[error("cannot compute the modes at the end of the motion for the shaper: {0}")]
    Modes(#[from] LinearError),
    /// The linearised arm cannot be inverted.
    #[error(transparent)]
    Inversion(#[from] InversionError),
    /// A pose without a target.
    #[error("at {t_s:.3} s: {source}")]
    Target {
        /// Time of the pose (s).
        t_s: f64,
        /// Cause.
        source: TargetError,
    },
}

impl From<CompensateError> for flexarm_run::Error {
    fn from(error: CompensateError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for CompensateError {}
