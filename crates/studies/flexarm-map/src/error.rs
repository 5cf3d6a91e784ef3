//! Why a map cannot be taken.

use flexarm_run::ExternalError;
use flexarm_settings::{Fault, Setting};

use super::MOST_PLACES;

/// Why a map cannot be taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// A tool axis without a direction.
    #[error("the axis of the tool ({}) must have a direction, found {found:?}", Setting::ToolAxis)]
    ToolAxis {
        /// What was given.
        found: [f64; 3],
    },
    /// A cone of directions that is none.
    #[error(
        "the tool's cone must have a half angle from 0 to 180 degrees, at least one tilt and one roll, and at most 10000 \
         directions, found {:.4} degrees, {tilts} tilts, {rolls} rolls", half_angle_rad.to_degrees()
    )]
    Cone {
        /// Half angle (rad).
        half_angle_rad: f64,
        /// Directions.
        tilts: usize,
        /// Rotations about each.
        rolls: usize,
    },
    /// A box whose corners are no numbers or in the wrong order.
    #[error("the box ({}) must have its lowest corner first, found {lower:?} to {upper:?} m", Setting::Bounds)]
    Bounds {
        /// Lowest corner (m).
        lower: [f64; 3],
        /// Highest corner (m).
        upper: [f64; 3],
    },
    /// A distance of places that is not positive.
    #[error("the distance of the places ({}) must be positive, found {found} m", Setting::GridSpacing)]
    Spacing {
        /// What was given (m).
        found: f64,
    },
    /// A radius around the arm's foot that is none.
    #[error("the radius that is kept free around the first joint must be zero or positive, found {found} m")]
    KeepOut {
        /// What was given (m).
        found: f64,
    },
    /// More places than can be held.
    #[error(
        "the map would have {places:.3e} places, at most {most:.0e} are held in memory: raise {} or take less",
        Setting::GridSpacing
    )]
    TooMany {
        /// Places.
        places: f64,
        /// Most places.
        most: usize,
    },
    /// More rows than can be held.
    #[error(
        "the map has more than {most:.0e} poses, which is what is held in memory: keep the best of each place, or raise {}",
        Setting::GridSpacing
    )]
    TooManyRows {
        /// Most rows.
        most: usize,
    },
    /// More places and directions than anybody waits for.
    #[error(
        "the map would look for {found:.1e} poses of the tool, at most {most:.0e}: take fewer directions, or raise {}",
        Setting::GridSpacing
    )]
    TooManyDirections {
        /// Places times directions.
        found: f64,
        /// Most of them.
        most: f64,
    },
    /// A joint that the robot does not have.
    #[error("there is no joint {found:?} to be mapped; the joints are {known:?}")]
    Joint {
        /// What was asked for.
        found: String,
        /// The joints.
        known: Vec<String>,
    },
    /// A joint that is named twice.
    #[error("joint {0:?} is named twice")]
    JointTwice(String),
    /// Values of a joint that are none.
    #[error("joint {joint:?} is to go from {} to {} in {points} values: expected finite numbers and at least one value", range[0], range[1])]
    JointRange {
        /// The joint.
        joint: String,
        /// First and last value (rad or m).
        range: [f64; 2],
        /// Number of values.
        points: usize,
    },
    /// A list of no or too many poses.
    #[error("the list has {found} poses, expected one to {MOST_PLACES}")]
    Poses {
        /// How many it has.
        found: usize,
    },
    /// No joint to go through.
    #[error("no joint is named that the map is to go through")]
    NoJoints,
    /// Instants of a motion.
    #[error("a map along a motion needs from one to {MOST_PLACES} instants")]
    Instants,
    /// A quantity that a map does not have.
    #[error("a map has no quantity {found:?} to compare by; it has {}", known.join(", "))]
    Quantity {
        /// What was asked for.
        found: String,
        /// What there is.
        known: Vec<String>,
    },
    /// A workpiece whose edges are no lengths.
    #[error("the edges of the workpiece must be zero or positive lengths, found {found:?} m")]
    Workpiece {
        /// Edges (m).
        found: [f64; 3],
    },
    /// A workpiece without a grid of places.
    #[error("a workpiece is placed on a grid of places: it goes with neither joint values nor a motion")]
    WorkpieceWithoutGrid,
    /// A tool that cannot be brought to poses.
    #[error(
        "the arm has {joints} joints, and to bring the tool to a pose takes six: map it over joint values ({})",
        Setting::MapJoints
    )]
    TooFewJoints {
        /// Joints that move the tool.
        joints: usize,
    },
    /// Nothing in the box is within reach.
    #[error(
        "none of the {places} places is within reach with the tool pointing along {axis:?} (world) and all joints within \
         their limits: try other values for {} or {}",
        Setting::Bounds,
        Setting::ToolAxis
    )]
    OutOfReach {
        /// Places that were tried.
        places: usize,
        /// Where the tool was to point.
        axis: [f64; 3],
    },
    /// The arm stays nowhere.
    #[error("none of the {poses} poses has an equilibrium; at the first: {first}")]
    NoEquilibrium {
        /// Poses that were tried.
        poses: usize,
        /// Why not.
        first: String,
    },
    /// All poses lack the quantity.
    #[error(
        "none of the poses has a {by}{}: compare by another quantity",
        if by == "depth_m" { ", for the feed of the tool is along its axis (feed = [...] in [tool])" } else { "" }
    )]
    NothingToCompare {
        /// The quantity.
        by: String,
    },
    /// The user stopped it.
    #[error("stopped after {done} of {places} places; nothing is written")]
    Interrupted {
        /// Places that are done.
        done: usize,
        /// All places.
        places: usize,
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
