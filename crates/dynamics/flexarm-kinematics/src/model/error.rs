//! Reasons why a mechanism is not a valid tree.

use flexarm_settings::OutOfRange;

/// Maximum number of independent coordinates of a model.
pub const MAX_COORDINATES: usize = 600;

/// Reason why a mechanism is not a valid tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The mechanism is empty.
    #[error("mechanism {0:?} has no links: add at least a base link")]
    NoLinks(String),
    /// Two links or two joints have the same name.
    #[error("{what} {name:?} is defined twice: names must be unique")]
    Duplicate {
        /// "link" or "joint".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A joint refers to an unknown link.
    #[error("joint {joint:?} refers to link {link:?}, which does not exist")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The missing link.
        link: String,
    },
    /// A link is the child of two joints.
    #[error("link {link:?} is the child of both joint {first:?} and joint {second:?}: a tree has one parent each")]
    TwoParents {
        /// The link.
        link: String,
        /// First joint.
        first: String,
        /// Second joint.
        second: String,
    },
    /// More than one link without a parent.
    #[error("the links form {} separate parts with bases {roots:?}: connect them by joints", roots.len())]
    Disconnected {
        /// The links without parent.
        roots: Vec<String>,
    },
    /// The links form a cycle.
    #[error("links {links:?} form a loop: open it at one joint")]
    Cycle {
        /// The links that cannot be reached from a base.
        links: Vec<String>,
    },
    /// A body on a spring has no mass, so its motion is undetermined.
    #[error(
        "link {link:?} is elastic (joint {joint:?}) and has mass {mass} kg with all that it carries: give it a positive mass, or keep everything before it rigid"
    )]
    NoMass {
        /// The link.
        link: String,
        /// The joint that moves it.
        joint: String,
        /// Carried mass found (kg).
        mass: f64,
    },
    /// Mass properties are not physical.
    #[error("link {link:?}: {what} is {value}, which no body has")]
    BadInertia {
        /// The link.
        link: String,
        /// Name of the quantity.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A value is outside its allowed range.
    #[error("{part} {name:?}: {what}")]
    OutOfRange {
        /// Part of the mechanism: "mechanism", "link" or "joint".
        part: &'static str,
        /// Name of the part.
        name: String,
        /// Value and allowed range.
        what: OutOfRange,
    },
    /// A rotor coupling does not connect two joints of one coordinate each.
    #[error(
        "the rotor between joint {joint:?} and another one: it needs two joints of one coordinate each, and a finite inertia"
    )]
    BadRotor {
        /// The joint.
        joint: String,
    },
    /// A modal link is inconsistent with the tree.
    #[error("link {link:?} is modal, but {what} is wrong")]
    BadModal {
        /// The link.
        link: String,
        /// The inconsistent item.
        what: &'static str,
    },
    /// A balancer refers to a missing item.
    #[error("balancer {balancer:?}: {what} is not in the robot")]
    BadBalancer {
        /// The balancer.
        balancer: String,
        /// The missing item.
        what: &'static str,
    },
    /// A loop closure is invalid.
    #[error("loop {name:?}: {what}")]
    BadLoop {
        /// The loop.
        name: String,
        /// Description of the problem.
        what: String,
    },
    /// A quantity is NaN or infinite.
    #[error("{what} of {name:?} has a NaN or infinite entry")]
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
        /// Name of the link or joint.
        name: String,
    },
    /// The model has more than [`MAX_COORDINATES`] coordinates.
    #[error(
        "the model has {found} coordinates (joints, springs and modes together), at most {MAX_COORDINATES} are taken: memory grows with \
         their square and the time of a step with their cube"
    )]
    TooManyCoordinates {
        /// Number of coordinates of the model.
        found: usize,
    },
    /// A mimic joint has no valid leader.
    #[error("joint {joint:?} mimics {leader:?}, which is not a movable, independent joint")]
    BadMimic {
        /// The follower.
        joint: String,
        /// Name of the requested leader.
        leader: String,
    },
}
