//! Results of planning: the motion and its moves.
//!
//! Plain data; rad or m, s. Not here: planning (`plan.rs`).

use flexarm_settings::Place;
use flexarm_trajectory::Trajectory;

/// Result of one move.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMove {
    /// Line in the program.
    pub place: Place,
    /// Statement.
    pub statement: String,
    /// Start and end time (s); with a blend, the time at its middle.
    pub span_s: [f64; 2],
    /// Maximum speed of the tool centre point on its path, m/s (`None` for joint moves).
    pub top_m_s: Option<f64>,
    /// Programmed speed, m/s.
    pub programmed_m_s: Option<f64>,
    /// Place where a limit makes it slowest relative to the programmed speed.
    pub slowed: Option<Slowed>,
    /// Minimum singular value of the Jacobian on the path, m/rad, with its time, s; tool paths
    /// only.
    pub least_sigma: Option<(f64, f64)>,
    /// Distance from the target at which the path enters the blend, m; 0 at a stop.
    pub blend_m: f64,
}

/// A place where a limit of the robot slows a move.
#[derive(Debug, Clone, PartialEq)]
pub struct Slowed {
    /// Time from the start of the motion (s).
    pub time_s: f64,
    /// Fraction of the programmed speed, or of the joints' own limits.
    pub part: f64,
    /// The limit.
    pub by: SlowedBy,
}

/// Limit that slows a move.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SlowedBy {
    /// Speed of a joint.
    JointSpeed(String),
    /// Acceleration of a joint where the path is curved.
    JointAcceleration(String),
    /// Torque of a joint.
    JointTorque(String),
    /// Jerk of a joint.
    JointJerk(String),
    /// Rotation of the tool.
    Turning,
    /// Acceleration of the tool normal to its path.
    PathAcceleration,
}

/// A program planned as a motion.
#[derive(Debug, Clone)]
pub struct Planned {
    /// All actuated joints over time.
    pub trajectory: Trajectory,
    /// Results by move.
    pub moves: Vec<PlannedMove>,
    /// Corners at which the tool stops although a blend was requested: place and reason.
    pub stops: Vec<(Place, String)>,
    /// Joints held although they could move the tool (redundant arms).
    pub fixed: Vec<String>,
}
