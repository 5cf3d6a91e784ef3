//! Errors about closed loops.

use flexarm_settings::known_names;

/// Closed loop that does not fit the robot, or pose in which it does not close.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopError {
    /// Two loops have the same name.
    #[error("loop {name:?} is defined twice: names must be unique")]
    Twice {
        /// Name of the loops.
        name: String,
    },
    /// The link does not exist.
    #[error("loop {name:?}: {link:?} is not a link of the robot; its links are {}", known_names(link, known))]
    UnknownLink {
        /// Name of the loop.
        name: String,
        /// Requested link.
        link: String,
        /// Links of the robot.
        known: Vec<String>,
    },
    /// A value is not finite.
    #[error("loop {name:?}: {what} has the entry {value}, expected finite numbers")]
    NotFinite {
        /// Name of the loop.
        name: String,
        /// Name of the quantity.
        what: String,
        /// Invalid value.
        value: f64,
    },
    /// The axis has no direction.
    #[error("loop {name:?}: axis is {axis:?}, expected the direction of the pin in axes of its link")]
    BadAxis {
        /// Name of the loop.
        name: String,
        /// Given axis.
        axis: [f64; 3],
    },
    /// No axis is given, and no dependent joint turns from which it could be taken.
    #[error(
        "loop {name:?}: none of its dependent joints turns, so that its pin needs an axis: give axis = [x, y, z] in axes of the pin's link"
    )]
    NoAxis {
        /// Name of the loop.
        name: String,
    },
    /// The kinematic tree rejects the loop.
    #[error("loop {name:?}: {what}")]
    Unfit {
        /// Name of the loop.
        name: String,
        /// Cause.
        what: String,
    },
    /// A dependent joint has a drive.
    #[error("loop {name:?}: joint {joint:?} has a drive and follows from the loop: only one of both moves it")]
    Driven {
        /// Name of the loop.
        name: String,
        /// Name of the joint.
        joint: String,
    },
    /// The loop cannot be closed: its links do not reach each other.
    #[error(
        "loop {name:?} does not close there: its links do not reach each other; keep the driving joints within the range of its bars, or check their lengths"
    )]
    Open {
        /// Name of the loop.
        name: String,
    },
    /// The loop passes a dead point: its links are in line.
    #[error(
        "loop {name:?} passes its dead point there: its links are collinear and could continue in two ways; keep the motion away from it"
    )]
    DeadPoint {
        /// Name of the loop.
        name: String,
    },
    /// One of these errors occurs during a motion.
    #[error("at t = {t:.3} s: {source}")]
    AlongMotion {
        /// Time (s).
        t: f64,
        /// Cause.
        #[source]
        source: Box<LoopError>,
    },
}

impl LoopError {
    /// Returns the name of the loop.
    pub fn name(&self) -> &str {
        match self {
            Self::Twice { name }
            | Self::UnknownLink { name, .. }
            | Self::NotFinite { name, .. }
            | Self::BadAxis { name, .. }
            | Self::NoAxis { name }
            | Self::Unfit { name, .. }
            | Self::Driven { name, .. }
            | Self::Open { name }
            | Self::DeadPoint { name } => name,
            Self::AlongMotion { source, .. } => source.name(),
        }
    }
}
