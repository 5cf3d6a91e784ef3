//! Errors of a map.

use std::path::PathBuf;

use flexarm_run::ExternalError;
use flexarm_settings::{Fault, Setting};

use super::MAX_PLACES;

/// An error of a map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// A tool axis without a direction.
    #[error("the tool axis ({}) must be finite and non-zero, found {found:?}", Setting::ToolAxis)]
    ToolAxis {
        /// The axis given.
        found: [f64; 3],
    },
    /// An invalid cone of directions.
    #[error(
        "the cone of tool directions must have a half angle from 0 to 180 degrees, at least one tilt and one roll, \
         and at most 10000 directions, found {:.4} degrees, {tilts} tilts, {rolls} rolls", half_angle_rad.to_degrees()
    )]
    Cone {
        /// Half angle (rad).
        half_angle_rad: f64,
        /// Number of tilts.
        tilts: usize,
        /// Number of rotations about each direction.
        rolls: usize,
    },
    /// A box with corners that are not numbers or in the wrong order.
    #[error("the box ({}) must have its lower corner first, found {lower:?} to {upper:?} m", Setting::Bounds)]
    Bounds {
        /// Lower corner (m).
        lower: [f64; 3],
        /// Upper corner (m).
        upper: [f64; 3],
    },
    /// A grid spacing that is not positive.
    #[error("the grid spacing ({}) must be positive, found {found} m", Setting::GridSpacing)]
    Spacing {
        /// The spacing given (m).
        found: f64,
    },
    /// An invalid keep-out radius around the base.
    #[error("the keep-out radius around the first joint must be zero or positive, found {found} m")]
    KeepOut {
        /// The radius given (m).
        found: f64,
    },
    /// More places than fit in memory.
    #[error(
        "the map would have {places:.3e} places, at most {most:.0e} are held in memory: increase {} or map a \
         smaller region",
        Setting::GridSpacing
    )]
    TooMany {
        /// Number of places.
        places: f64,
        /// Maximum number of places.
        most: usize,
    },
    /// More rows than fit in memory.
    #[error(
        "the map has more than {most:.0e} poses, the maximum held in memory: keep only the best pose of each \
         place, or increase {}",
        Setting::GridSpacing
    )]
    TooManyRows {
        /// Maximum number of rows.
        most: usize,
    },
    /// Too many combinations of places and directions.
    #[error(
        "the map would search for {found:.1e} TCP poses, at most {most:.0e} are allowed: use fewer directions, or \
         increase {}",
        Setting::GridSpacing
    )]
    TooManyDirections {
        /// Number of places times directions.
        found: f64,
        /// Maximum of that product.
        most: f64,
    },
    /// An unknown joint.
    #[error("there is no joint {found:?} to vary; the joints are {}", flexarm_settings::known_names(found, known))]
    Joint {
        /// The joint requested.
        found: String,
        /// The joints of the robot.
        known: Vec<String>,
    },
    /// A joint named twice.
    #[error("joint {0:?} is named twice")]
    JointTwice(String),
    /// Invalid values of a joint.
    #[error(
        "joint {joint:?} has a range from {} to {} in {points} values: expected finite numbers and at least one \
         value",
        range[0],
        range[1]
    )]
    JointRange {
        /// The joint.
        joint: String,
        /// First and last value (rad or m).
        range: [f64; 2],
        /// Number of values.
        points: usize,
    },
    /// A list of poses that is empty or too long.
    #[error("the list has {found} poses, expected one to {MAX_PLACES}")]
    Poses {
        /// Number of poses.
        found: usize,
    },
    /// No joint to vary.
    #[error("no joint is given for the map to vary")]
    NoJoints,
    /// An invalid number of instants of a motion.
    #[error("a map along a motion needs from one to {MAX_PLACES} instants")]
    Instants,
    /// An unknown quantity.
    #[error("the map has no quantity {found:?} to compare poses by; it has {}", known.join(", "))]
    Quantity {
        /// The quantity requested.
        found: String,
        /// The quantities available.
        known: Vec<String>,
    },
    /// A workpiece with edges that are not lengths.
    #[error("the edges of the workpiece must be zero or positive lengths, found {found:?} m")]
    Workpiece {
        /// Edges (m).
        found: [f64; 3],
    },
    /// A workpiece without a grid of places.
    #[error("a workpiece requires a grid of places: it cannot be combined with joint values or a motion")]
    WorkpieceWithoutGrid,
    /// An arm with too few joints for inverse kinematics.
    #[error(
        "the arm has {joints} joints, but reaching a TCP pose requires six: map it over joint values ({})",
        Setting::MapJoints
    )]
    TooFewJoints {
        /// Number of joints that move the TCP.
        joints: usize,
    },
    /// No place in the box is within reach.
    #[error(
        "none of the {places} places is within reach with the tool pointing along {axis:?} (world) and all joints within \
         their limits: try other values for {} or {}",
        Setting::Bounds,
        Setting::ToolAxis
    )]
    OutOfReach {
        /// Number of places tried.
        places: usize,
        /// Direction of the tool axis.
        axis: [f64; 3],
    },
    /// No pose has an equilibrium.
    #[error("none of the {poses} poses has an equilibrium; at the first: {first}")]
    NoEquilibrium {
        /// Number of poses tried.
        poses: usize,
        /// Error at the first pose.
        first: String,
    },
    /// No pose has a value of the quantity.
    #[error(
        "none of the poses has a {by}{}: compare by another quantity",
        if by == "depth_m" { ", because the feed of the tool is along its axis (feed = [...] in [tool])" } else { "" }
    )]
    NothingToCompare {
        /// The quantity.
        by: String,
    },
    /// Interrupted by the user.
    #[error("stopped after {done} of {places} places; {}", match folder {
        Some(folder) => format!("their results are in {}", folder.display()),
        None => "nothing is written".to_owned(),
    })]
    Interrupted {
        /// Number of places done.
        done: usize,
        /// Total number of places.
        places: usize,
        /// Folder of the results of the places done.
        folder: Option<PathBuf>,
    },
}

impl From<MapError> for flexarm_run::Error {
    fn from(error: MapError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for MapError {
    fn fault(&self) -> Fault {
        match self {
            Self::Interrupted { .. } => Fault::Run,
            _ => Fault::Input,
        }
    }
}
