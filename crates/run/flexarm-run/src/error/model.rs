//! Models that a robot cannot have, and poses that cannot be answered.

use std::path::PathBuf;

use flexarm_analysis::LinearError;
use flexarm_flexlink::{GearboxError, MountingError, SubstitutionError};
use flexarm_settings::{OutOfRange, Setting};
use flexarm_stepping::StepError;

/// Links and drives that cannot be modelled as asked for.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModellingError {
    /// A link that does not have the model asked for; the sentence names the link and what is
    /// missing.
    #[error("{0}")]
    NoSuchModel(String),
    /// A link with load on a third interface that cannot bend in modes either.
    #[error("link {link:?}: {why}; {instead}")]
    Branch {
        /// The link.
        link: String,
        /// Attached bodies and their interfaces.
        why: String,
        /// Why it cannot bend in modes.
        instead: String,
    },
    /// A number of segments, and no lumped link that takes it.
    #[error("{segments} segments are requested, but no link of the robot is lumped: {}", lumped_remedy(modal_instead))]
    NoLumpedLink {
        /// Segments asked for.
        segments: usize,
        /// Links that are modal although lumped was asked for, each with the reason.
        modal_instead: Vec<String>,
    },
    /// A number of modes, and no modal link that takes it.
    #[error("{modes} modes are requested, but no link of the robot is modal: add {} modal", Setting::Links)]
    NoModalLink {
        /// Modes asked for.
        modes: usize,
    },
    /// The substitution of the links.
    #[error(transparent)]
    Substitution(#[from] SubstitutionError),
    /// The springs of the gearboxes.
    #[error(transparent)]
    Gearbox(#[from] GearboxError),
    /// The springs under the base.
    #[error(transparent)]
    Mounting(#[from] MountingError),
    /// An elastic joint that the substitution made and that no link owns.
    #[error("elastic joint {joint:?} has no stiffness")]
    NoStiffness {
        /// The joint.
        joint: String,
    },
}

fn lumped_remedy(modal_instead: &[String]) -> String {
    if modal_instead.is_empty() { format!("add {} lumped", Setting::Links) } else { modal_instead.join("; ") }
}

/// Balancers that do not fit the robot, and poses in which they cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BalancerError {
    /// Two of one name.
    #[error("balancer {name:?} is there twice: give each a name of its own")]
    Twice {
        /// The name.
        name: String,
    },
    /// No such link.
    #[error("balancer {name:?}: {link:?} is not a link of the robot; its links are {known:?}")]
    UnknownLink {
        /// The balancer.
        name: String,
        /// The link asked for.
        link: String,
        /// The links there are.
        known: Vec<String>,
    },
    /// A point that is no place.
    #[error("balancer {name:?}: its point on link {link:?} has the entry {value}, expected finite numbers in m")]
    NotFinite {
        /// The balancer.
        name: String,
        /// The link.
        link: String,
        /// The entry.
        value: f64,
    },
    /// Both ends on one rigid body.
    #[error(
        "balancer {name:?}: no joint moves link {second:?} against link {first:?}, so it does nothing: put its ends on links with a joint \
         between them"
    )]
    SameBody {
        /// The balancer.
        name: String,
        /// One link.
        first: String,
        /// The other one.
        second: String,
    },
    /// No such joint.
    #[error("balancer {name:?}: the robot has no movable joint {joint:?}; it has {known:?}")]
    UnknownJoint {
        /// The balancer.
        name: String,
        /// The joint asked for.
        joint: String,
        /// The joints that move.
        known: Vec<String>,
    },
    /// A joint that a closed loop moves.
    #[error("balancer {name:?}: joint {joint:?} follows from a loop, {own:?}: give its two ends, from and to, instead")]
    Dependent {
        /// The balancer.
        name: String,
        /// The joint.
        joint: String,
        /// The loop.
        own: String,
    },
    /// A sine over a slide.
    #[error("balancer {name:?}: a sine is a torque over an angle, but joint {joint:?} slides: use spring or curve")]
    Slides {
        /// The balancer.
        name: String,
        /// The joint.
        joint: String,
    },
    /// The piston is beyond the end of its cylinder.
    #[error(
        "balancer {name:?} is {length:.4} m long there, its gas has no room left {beyond} {end:.4} m: check its ends (m), volume (m³), area (m²) \
         and the length to which these belong"
    )]
    NoRoom {
        /// The balancer.
        name: String,
        /// Its length (m).
        length: f64,
        /// `above` or `below`.
        beyond: &'static str,
        /// End of the room (m).
        end: f64,
    },
    /// Both ends at one place.
    #[error(
        "both ends of balancer {name:?} are at the same place there, so that its force has no direction: move an end"
    )]
    NoLength {
        /// The balancer.
        name: String,
    },
    /// One of these during a motion.
    #[error("at t = {t:.3} s: {source}")]
    AlongMotion {
        /// When (s).
        t: f64,
        /// Why.
        #[source]
        source: Box<BalancerError>,
    },
}

/// Closed loops that do not fit the robot, and poses in which they do not close.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopError {
    /// Two of one name.
    #[error("loop {name:?} is there twice: give each a name of its own")]
    Twice {
        /// The name.
        name: String,
    },
    /// No such link.
    #[error("loop {name:?}: {link:?} is not a link of the robot; its links are {known:?}")]
    UnknownLink {
        /// The loop.
        name: String,
        /// The link asked for.
        link: String,
        /// The links there are.
        known: Vec<String>,
    },
    /// A number that is none.
    #[error("loop {name:?}: {what} has the entry {value}, expected finite numbers")]
    NotFinite {
        /// The loop.
        name: String,
        /// Quantity.
        what: String,
        /// The entry.
        value: f64,
    },
    /// An axis without direction.
    #[error("loop {name:?}: axis is {axis:?}, expected the direction of the pin in axes of its link")]
    BadAxis {
        /// The loop.
        name: String,
        /// Given value.
        axis: [f64; 3],
    },
    /// None to take the axis from.
    #[error(
        "loop {name:?}: none of its dependent joints turns, so that its pin needs an axis: give axis = [x, y, z] in axes of the pin's link"
    )]
    NoAxis {
        /// The loop.
        name: String,
    },
    /// Error of the tree.
    #[error("loop {name:?}: {what}")]
    Unfit {
        /// The loop.
        name: String,
        /// Fault.
        what: String,
    },
    /// A joint with a motor.
    #[error("loop {name:?}: joint {joint:?} has a drive and follows from the loop: only one of both moves it")]
    Driven {
        /// The loop.
        name: String,
        /// The joint.
        joint: String,
    },
    /// The bars do not reach each other.
    #[error(
        "loop {name:?} does not close there: its links do not reach each other; keep the driving joints within the range of its bars, or check their lengths"
    )]
    Open {
        /// The loop.
        name: String,
    },
    /// Bars in a line.
    #[error(
        "loop {name:?} passes its dead point there: its links lie in a line, and they could go on in two ways; keep the motion away from it"
    )]
    DeadPoint {
        /// The loop.
        name: String,
    },
    /// One of these during a motion.
    #[error("at t = {t:.3} s: {source}")]
    AlongMotion {
        /// When (s).
        t: f64,
        /// Why.
        #[source]
        source: Box<LoopError>,
    },
}

impl LoopError {
    /// The loop.
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

/// Joint values that do not fit the robot, and poses without an answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// Another number of joint values than there are movable joints.
    #[error("{found} joint values given, the robot has {} movable joints: {joints:?}", joints.len())]
    Count {
        /// Values given.
        found: usize,
        /// The movable joints in coordinate order.
        joints: Vec<String>,
    },
    /// A joint value that is no number.
    #[error("joint {joint:?} at {value} is at no finite number")]
    NotFinite {
        /// The joint.
        joint: String,
        /// Its value (rad or m).
        value: f64,
    },
    /// Samples of a motion that do not fill all times and joints.
    #[error(
        "{found} joint values are given for {times} times; the robot has {joints} joints, so {} are expected",
        joints * times
    )]
    Samples {
        /// Values given.
        found: usize,
        /// Times given.
        times: usize,
        /// Movable joints of the robot.
        joints: usize,
    },
    /// Body without inertia about some axis.
    #[error(
        "{}: {source}: {} lacks inertia about some axis, with all that it carries; give the links <inertial> with mass \
         and inertia, have them estimated (inertia_from_density in the robot file), or keep everything before them rigid",
        path.display(),
        links.join(", ")
    )]
    WithoutInertia {
        /// The URDF.
        path: PathBuf,
        /// The matrix that is singular.
        source: StepError,
        /// Elastic coordinate that carries no inertia.
        links: Vec<String>,
    },
    /// The linear structure at the pose.
    #[error("the linear model at this pose: {0}")]
    Linear(#[source] LinearError),
    /// Figures that overflowed: masses, lengths or joint values of 1e200.
    #[error(
        "{what} are not finite: a mass, a length, a stiffness, a force or a joint value is far too large or too small"
    )]
    Overflow {
        /// The figures.
        what: String,
    },
    /// Modes are to be recorded of a robot that has none.
    #[error("the robot has no flexible link, so there are no modes to record")]
    NoModes,
}

/// Inputs and outputs of a frequency response that make no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChannelError {
    /// An input that is neither a force at the tool nor a joint.
    #[error("input {word:?} is not known; inputs are {forces:?} and the joints {joints:?}")]
    UnknownInput {
        /// The word.
        word: String,
        /// Forces and moments at the tool.
        forces: &'static [&'static str],
        /// Joints of the robot.
        joints: Vec<String>,
    },
    /// An output that is no axis of the tool.
    #[error("output {word:?} is not known; outputs are {axes:?} (the folder is {})", Setting::Output)]
    UnknownOutput {
        /// The word.
        word: String,
        /// The axes.
        axes: &'static [&'static str],
    },
    /// No input, or no output.
    #[error("no {side} is given")]
    Missing {
        /// `input` or `output`.
        side: &'static str,
    },
    /// The same one twice.
    #[error("{side} {word:?} is given twice")]
    Twice {
        /// `input` or `output`.
        side: &'static str,
        /// The word.
        word: String,
    },
}

/// A load as values that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// Samples that are no function of time.
    #[error(
        "a load needs at least two samples, one wrench for each time, and times that increase; found {times} times and \
         {wrenches} wrenches"
    )]
    Samples {
        /// Times given.
        times: usize,
        /// Wrenches given.
        wrenches: usize,
    },
    /// A frame that is neither the tool nor a link that moves.
    #[error("load on frame {frame:?}: expected \"tcp\" or a link that moves, of {known:?}")]
    UnknownFrame {
        /// The frame.
        frame: String,
        /// Links that move.
        known: Vec<String>,
    },
    /// A number of a size that no load has.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A change of what a link carries.
    #[error(transparent)]
    Payload(#[from] PayloadError),
}

/// Changes of payload that a robot cannot have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PayloadError {
    /// A time, mass or other number that is negative or not finite.
    #[error("a payload needs a time and a mass of at least 0, and finite numbers")]
    Numbers,
    /// An inertia that no body has.
    #[error("payload inertia has a negative principal moment; the order is ixx iyy izz ixy ixz iyz")]
    NegativeMoment,
    /// A link that is not the one of the robot's own payload, which would stay where it is.
    #[error("the robot's own payload does not ride on link {link:?}: give that link")]
    OtherLink {
        /// The link.
        link: String,
    },
    /// Two links that carry in one run.
    #[error("payloads on two bodies ({first:?} and {second:?}): one changes in a run")]
    TwoBodies {
        /// The body of an earlier change.
        first: String,
        /// The link of this one.
        second: String,
    },
    /// A link that does not move or is not there.
    #[error("payload link {link:?}: expected a link that moves, of {known:?}")]
    UnknownLink {
        /// The link.
        link: String,
        /// Links that move.
        known: Vec<String>,
    },
    /// A flexible link.
    #[error(
        "payload link {link:?} is flexible, so that the position of the payload on it is not defined: name a link beyond it, of {beyond:?}"
    )]
    Bends {
        /// The link.
        link: String,
        /// Links that hang on it.
        beyond: Vec<String>,
    },
}
