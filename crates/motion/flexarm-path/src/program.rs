//! What a robot program asks for, as values: moves one after the other, with every frame, speed and
//! blend resolved.
//!
//! A reader of some language fills a [`Program`]; nothing in it depends on the language but
//! [`Configuration`], by which each maker of robots names the branch of the inverse kinematics.
//!
//! Units: m, rad, s, m/s, rad/s, m/s², rad/s², m/s³.
//!
//! Frames: W world of the controller (where its robot stands, ROS's `base`), B base or work object
//! of a move, F flange of the controller (ROS's `tool0`), T tool.

use flexarm_spatial::Pose;
use nalgebra::Vector3;

/// Moves and dwells in the order in which they are run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Program {
    /// Name of the program in its language, else of its file.
    pub name: String,
    /// What is done, in order; loops are unrolled.
    pub items: Vec<Item>,
    /// What a user should know: defaults that were assumed, statements that have no effect on the
    /// motion.
    pub notes: Vec<Note>,
}

/// Something that the reader noticed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// Line in the file, counted from 1; `None` for the file as a whole.
    pub line: Option<usize>,
    /// One sentence.
    pub text: String,
}

/// One thing done.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "nearly every item is a move")]
pub enum Item {
    /// The tool moves.
    Move(Move),
    /// It stands still.
    Dwell {
        /// Line in the file.
        line: usize,
        /// s.
        seconds: f64,
    },
}

/// One move, from where the move before ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Move {
    /// Line in the file, counted from 1.
    pub line: usize,
    /// Statement as it stands in the file, trimmed, for messages and reports.
    pub statement: String,
    /// Along which way.
    pub kind: MoveKind,
    /// Where to.
    pub to: Target,
    /// Base or work object in the controller's world, `X_WB`; targets are told in it.
    pub X_WB: Pose,
    /// Tool on the controller's flange, `X_FT`; `None`: the robot's own tool centre point.
    pub X_FT: Option<Pose>,
    /// How fast.
    pub speed: Speed,
    /// What happens at its end.
    pub blend: Blend,
}

/// Along which way a move goes.
#[derive(Debug, Clone, PartialEq)]
pub enum MoveKind {
    /// All joints together, straight in joint space (PTP, `MoveJ`, `movej`, G0 of a robot).
    Joint,
    /// The tool centre point on a straight line, its orientation turned evenly about one axis (LIN,
    /// `MoveL`, `movel`, G1).
    Line,
    /// On a circle through three points (CIRC, `MoveC`, `movec`, G2, G3).
    Arc {
        /// A point of the circle between the ends, in base B, m.
        via: Vector3<f64>,
        /// Orientation at that point, which is passed through; `None`: the orientation turns evenly
        /// from end to end.
        via_rotation: Option<nalgebra::Rotation3<f64>>,
        /// Angle travelled, rad, positive in the sense start, via, end; `None`: up to the target.
        /// Where it is given, the target is a third point of the circle, and the orientation turns
        /// on evenly with the angle.
        angle: Option<f64>,
        /// Is the orientation told relative to the tangent of the circle (KUKA's `#PATH`, ABB's
        /// `\PathFrame`)? Then it goes evenly, relative to the tangent, from that of the start to
        /// that of the target.
        turns_with_path: bool,
    },
    /// Smoothly through the target without stopping, as a knot of a spline that neighbouring moves
    /// of this kind make together (SPL in a SPLINE block).
    Spline,
}

/// Where a move ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// Joint values, rad or m, in the controller's order (A1, A2, ...), further joints of the robot
    /// stay.
    Joints(Vec<f64>),
    /// Pose of the tool in base B, `X_BT`, and which of the inverse kinematics' solutions.
    Pose {
        /// `X_BT`.
        X_BT: Pose,
        /// Which branch.
        configuration: Configuration,
    },
}

/// Which solution of the inverse kinematics is meant.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Configuration {
    /// The one nearest to where the move starts (lines and arcs have no choice).
    #[default]
    Nearest,
    /// The one nearest to these joint values, rad or m.
    Near(Vec<f64>),
    /// KUKA's status and turn. Status: bit 0 wrist centre behind axis 1, bit 1 elbow (axis 3
    /// positive, less the angle of the forearm's offset), bit 2 axis 5 negative; bits 3 and 4 do
    /// not name a branch. Turn: bit k set if axis k+1 is negative.
    Kuka {
        /// Bits of S; `None`: not told.
        status: Option<u8>,
        /// Bits of T; `None`: not told.
        turn: Option<u8>,
    },
    /// ABB's confdata: quarter turns of axes 1, 4 and 6 (floor of the angle over 90 degrees), and
    /// the configuration number cfx (0 to 7).
    Abb {
        /// Quadrants of axes 1, 4, 6.
        quadrants: [i32; 3],
        /// `cfx`.
        cfx: i32,
    },
    /// Words: wrist centre before or behind axis 1, elbow up or down, wrist not flipped or flipped
    /// (axis 5 negative); what is not told is the nearest.
    Words {
        /// Wrist centre before axis 1.
        front: Option<bool>,
        /// Elbow above the line from shoulder to wrist.
        elbow_up: Option<bool>,
        /// Axis 5 negative.
        wrist_flipped: Option<bool>,
    },
}

/// How fast a move is run. What is `None` has no bound of its own: the robot's limits and the
/// options of the time law rule.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Speed {
    /// Tool centre point along its path, m/s; of joint moves as well.
    pub linear_m_s: Option<f64>,
    /// Tool centre point along its path, m/s².
    pub linear_m_s2: Option<f64>,
    /// Tool centre point along its path, m/s³.
    pub linear_m_s3: Option<f64>,
    /// Turning of the tool, rad/s.
    pub angular_rad_s: Option<f64>,
    /// Turning of the tool, rad/s².
    pub angular_rad_s2: Option<f64>,
    /// Joint moves: part of each joint's speed limit, 0 to 1.
    pub joint_fraction: Option<f64>,
    /// Part of each joint's acceleration limit, 0 to 1.
    pub joint_acceleration_fraction: Option<f64>,
    /// Joint moves: speed of the fastest joint, rad/s (`movej`'s v).
    pub joint_rad_s: Option<f64>,
    /// Joint moves: acceleration of the fastest joint, rad/s² (`movej`'s a).
    pub joint_rad_s2: Option<f64>,
    /// The whole move lasts so long, s; goes before all others.
    pub duration_s: Option<f64>,
}

/// What happens where a move ends and the next begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Blend {
    /// The tool stops exactly at the target.
    #[default]
    Stop,
    /// The corner is left out within this distance of the tool centre point from the target, m
    /// (C_DIS, zonedata, `r=`).
    Distance(f64),
    /// The corner is left out over this part of the shorter neighbour, 0 to 0.5 of its length
    /// (C_PTP, `APO_DIST` in percent).
    Fraction(f64),
    /// The corner is left from where the speed would fall below this part of the programmed one
    /// while braking, 0 to 1 (C_VEL).
    Velocity(f64),
    /// The corner is left out from where the orientation is within this angle of the target's, rad
    /// (C_ORI).
    Orientation(f64),
    /// The tool passes the target without stopping and without leaving the path (`fine` off with
    /// the tangents in line; G-code in exact path mode).
    Pass,
}
