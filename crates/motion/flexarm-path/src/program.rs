//! Contents of a robot program as values: consecutive moves with every frame, speed and blend
//! resolved.
//!
//! A parser of a robot language fills a [`Program`]; nothing in it depends on the language except
//! [`Configuration`], since robot makers specify the branch of the inverse kinematics differently.
//!
//! Units: m, rad, s, m/s, rad/s, m/s², rad/s², m/s³.
//!
//! Frames: W world of the controller (base of its robot, ROS's `base`), B base or work object of a
//! move, F flange of the controller (ROS's `tool0`), T tool.

pub use flexarm_kinematics::Selection;
use flexarm_settings::{Finding, Place};
use flexarm_spatial::Pose;
use nalgebra::Vector3;

/// Moves and dwells in order of execution.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Program {
    /// Name of the program in its language, otherwise of its file.
    pub name: String,
    /// Moves and dwells in order; loops are unrolled.
    pub items: Vec<Item>,
    /// Notes for the user: assumed defaults, statements without effect on the motion.
    pub notes: Vec<Finding>,
}

/// A move or a dwell.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "nearly every item is a move")]
pub enum Item {
    /// The tool moves.
    Move(Move),
    /// The tool does not move.
    Dwell {
        /// Line in the file.
        place: Place,
        /// Duration (s).
        seconds: f64,
    },
}

/// One move, from the end of the previous one.
#[derive(Debug, Clone, PartialEq)]
pub struct Move {
    /// Line in the file.
    pub place: Place,
    /// Statement as written in the file, trimmed, for messages and reports.
    pub statement: String,
    /// Kind of path.
    pub kind: MoveKind,
    /// Target.
    pub to: Target,
    /// Pose of the base or work object in the controller's world, `X_WB`; targets are given in B.
    pub X_WB: Pose,
    /// Pose of the tool on the controller's flange, `X_FT`; `None`: the robot's own tool centre
    /// point.
    pub X_FT: Option<Pose>,
    /// Programmed speeds and accelerations.
    pub speed: Speed,
    /// Transition to the next move.
    pub blend: Blend,
}

/// Kind of path of a move.
#[derive(Debug, Clone, PartialEq)]
pub enum MoveKind {
    /// All joints together, straight in joint space (PTP, `MoveJ`, `movej`, G0 of a robot).
    Joint,
    /// Tool centre point on a straight line, with uniform rotation about one axis (LIN, `MoveL`,
    /// `movel`, G1).
    Line,
    /// Tool centre point on a circle through three points (CIRC, `MoveC`, `movec`, G2, G3).
    Arc {
        /// A point of the circle between the ends, in base B, m.
        via: Vector3<f64>,
        /// Orientation to pass through at that point; `None`: the orientation changes uniformly
        /// from start to end.
        via_rotation: Option<nalgebra::Rotation3<f64>>,
        /// Angle travelled, rad, positive in the order start, via, end; `None`: up to the target.
        /// If it is given, the target is only a third point of the circle, and the orientation
        /// continues uniformly with the angle.
        angle: Option<f64>,
        /// Whether the orientation is relative to the tangent of the circle (KUKA's `#PATH`, ABB's
        /// `\PathFrame`); it then changes uniformly, relative to the tangent, from that of the
        /// start to that of the target.
        turns_with_path: bool,
    },
    /// Smooth path through the target without stopping, as a knot of a spline formed by consecutive
    /// moves of this kind (SPL in a SPLINE block).
    Spline,
}

/// Target of a move.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// Joint values, rad or m, in the controller's order (A1, A2, ...); further joints of the robot
    /// are held.
    Joints(Vec<f64>),
    /// Pose of the tool in base B, `X_BT`, and the inverse kinematics solution.
    Pose {
        /// `X_BT`.
        X_BT: Pose,
        /// Branch of the inverse kinematics.
        configuration: Configuration,
    },
}

/// Branch of the inverse kinematics.
#[derive(Debug, Clone, PartialEq)]
pub enum Configuration {
    /// Solution nearest to these joint values, rad or m.
    Near(Vec<f64>),
    /// Solution that the words of a controller select; if they leave several, the nearest to the
    /// start of the move.
    Selected(Selection),
}

impl Configuration {
    /// Solution nearest to the start of the move; lines and arcs have no choice.
    pub const NEAREST: Self = Self::Selected(Selection::Nearest);
}

/// Speeds and accelerations of a move. `None` means no bound of its own: the robot's limits and the
/// options of the time law apply.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Speed {
    /// Speed of the tool centre point along its path, m/s; also for joint moves.
    pub linear_m_s: Option<f64>,
    /// Acceleration of the tool centre point along its path, m/s².
    pub linear_m_s2: Option<f64>,
    /// Jerk of the tool centre point along its path, m/s³.
    pub linear_m_s3: Option<f64>,
    /// Angular speed of the tool, rad/s.
    pub angular_rad_s: Option<f64>,
    /// Angular acceleration of the tool, rad/s².
    pub angular_rad_s2: Option<f64>,
    /// Joint moves: fraction of each joint's speed limit, 0 to 1.
    pub joint_fraction: Option<f64>,
    /// Fraction of each joint's acceleration limit, 0 to 1.
    pub joint_acceleration_fraction: Option<f64>,
    /// Joint moves: speed of the fastest joint, rad/s (`movej`'s v).
    pub joint_rad_s: Option<f64>,
    /// Joint moves: acceleration of the fastest joint, rad/s² (`movej`'s a).
    pub joint_rad_s2: Option<f64>,
    /// Duration of the whole move (s); takes precedence over all others.
    pub duration_s: Option<f64>,
}

/// Transition from a move to the next one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Blend {
    /// The tool stops exactly at the target.
    #[default]
    Stop,
    /// The corner is blended within this distance of the tool centre point from the target, m
    /// (C_DIS, zonedata, `r=`).
    Distance(f64),
    /// The corner is blended over this fraction of the shorter of both paths, 0 to 0.5 of its
    /// length (C_PTP, `APO_DIST` in percent).
    Fraction(f64),
    /// The blend starts where the speed would fall below this fraction of the programmed one while
    /// braking, 0 to 1 (C_VEL).
    Velocity(f64),
    /// The blend starts where the orientation is within this angle of the target's, rad (C_ORI).
    Orientation(f64),
    /// The tool passes the target without stopping and without leaving the path (`fine` off with
    /// the tangents in line; G-code in exact path mode).
    Pass,
}
