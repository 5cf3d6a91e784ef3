//! Errors about models that a robot cannot have, and about poses without a solution.

use std::path::PathBuf;

use flexarm_analysis::LinearError;
use flexarm_fem::FemError;
use flexarm_flexlink::{GearboxError, MountingError, SubstitutionError};
use flexarm_kinematics::MAX_COORDINATES;
use flexarm_settings::{OutOfRange, Setting, known_names};
use flexarm_stepping::StepError;

/// Model that a link cannot have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinkFormError {
    /// A modal link with stiffness factors of single directions.
    #[error(
        "link {link:?}: stiffness_factors are those of the springs of a lumped link; a modal link has one \
         stiffness_factor"
    )]
    ModalDirections {
        /// Name of the link.
        link: String,
    },
    /// A modal link with a stiffness of its own.
    #[error(
        "link {link:?} is a modal body: its stiffness is that of the one spring between two rigid parts; leave it out"
    )]
    ModalStiffness {
        /// Name of the link.
        link: String,
    },
    /// A chain with a stiffness of its own.
    #[error(
        "link {link:?} has {parts} parts: its stiffness is that of the one spring between two rigid parts; leave it out"
    )]
    ChainStiffness {
        /// Name of the link.
        link: String,
        /// Number of parts.
        parts: usize,
    },
    /// A chain with more coordinates than a robot can have.
    #[error(
        "link {link:?}: {segments} segments have {coordinates} elastic coordinates, a robot can have {} in all, for \
         the time of a step grows with their cube: ask for at most {} in one link, or for modes, which say more with \
         fewer",
        MAX_COORDINATES, MAX_COORDINATES / 6 + 1
    )]
    ManySegments {
        /// Name of the link.
        link: String,
        /// Requested number of segments.
        segments: usize,
        /// Number of elastic coordinates.
        coordinates: usize,
    },
    /// A beam that cannot be a chain.
    #[error("link {link:?}: {source}")]
    Chain {
        /// Name of the link.
        link: String,
        /// Cause.
        source: Box<FemError>,
    },
    /// A reduced link without a chain of this length.
    #[error(
        "link {link:?}: its .flex file has no chain of {segments} parts (it has {}): make it with flexarm reduce {} \
         {segments}, or choose another number of segments",
        numbers_of_parts(stored),
        Setting::Chains
    )]
    NoChain {
        /// Name of the link.
        link: String,
        /// Requested number of segments.
        segments: usize,
        /// Numbers of parts of the stored chains.
        stored: Vec<usize>,
    },
    /// A link whose modes cannot be computed.
    #[error("link {link:?} cannot be modal: {source}")]
    NotModal {
        /// Name of the link.
        link: String,
        /// Cause.
        source: Box<FemError>,
    },
    /// A reduced link without a mass matrix.
    #[error(
        "link {link:?} cannot be modal: its .flex file has no mass over interfaces and modes; reduce the mesh again \
         with this version, or use model = \"lumped\""
    )]
    NoModalMass {
        /// Name of the link.
        link: String,
    },
    /// More modes than a link may have.
    #[error(
        "link {link:?}: {modes} modes are requested, at most {most} are allowed: the work of a step grows with the \
         cube of their number, and those beyond the first dozen are far above what a drive or a tool excites"
    )]
    ManyModes {
        /// Name of the link.
        link: String,
        /// Requested number of modes.
        modes: usize,
        /// Maximum number of modes.
        most: usize,
    },
    /// More modes than the reduced link has.
    #[error("link {link:?}: {modes} modes are requested, its .flex file has {stored}")]
    FewModes {
        /// Name of the link.
        link: String,
        /// Requested number of modes.
        modes: usize,
        /// Number of modes of the file.
        stored: usize,
    },
    /// Geometric stiffening without its data.
    #[error(
        "link {link:?}: geometric_stiffening needs a beam, or a .flex file made with flexarm reduce {}",
        Setting::Geometric
    )]
    NoGeometric {
        /// Name of the link.
        link: String,
    },
}

fn numbers_of_parts(stored: &[usize]) -> String {
    let stored: Vec<String> = stored.iter().map(usize::to_string).collect();
    if stored.is_empty() { "only two parts".into() } else { format!("2, {} parts", stored.join(", ")) }
}

/// Link or drive that cannot be modelled as requested.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModellingError {
    /// A link does not have the requested model.
    #[error(transparent)]
    NoSuchModel(#[from] LinkFormError),
    /// A link with load on a third interface cannot be modelled with modes either.
    #[error("link {link:?}: {why}; {instead}")]
    Branch {
        /// Name of the link.
        link: String,
        /// Joint on the third interface.
        why: String,
        /// Reason why the link cannot be modal.
        instead: Box<LinkFormError>,
    },
    /// A number of segments is requested, but no link is lumped.
    #[error("{segments} segments are requested, but no link of the robot is lumped: {}", lumped_remedy(modal_instead))]
    NoLumpedLink {
        /// Requested number of segments.
        segments: usize,
        /// Links that are modal although lumped was requested, each with the reason.
        modal_instead: Vec<String>,
    },
    /// A number of modes is requested, but no link is modal.
    #[error("{modes} modes are requested, but no link of the robot is modal: add {} modal", Setting::Links)]
    NoModalLink {
        /// Requested number of modes.
        modes: usize,
    },
    /// Substitution of the links failed.
    #[error(transparent)]
    Substitution(#[from] SubstitutionError),
    /// Insertion of the gearbox springs failed.
    #[error(transparent)]
    Gearbox(#[from] GearboxError),
    /// Insertion of the springs under the base failed.
    #[error(transparent)]
    Mounting(#[from] MountingError),
    /// An elastic joint of the substituted model belongs to no link.
    #[error("elastic joint {joint:?} has no stiffness")]
    NoStiffness {
        /// Name of the joint.
        joint: String,
    },
}

fn lumped_remedy(modal_instead: &[String]) -> String {
    if modal_instead.is_empty() { format!("add {} lumped", Setting::Links) } else { modal_instead.join("; ") }
}

/// Balancer that does not fit the robot, or pose outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BalancerError {
    /// Two balancers have the same name.
    #[error("balancer {name:?} is defined twice: names must be unique")]
    Twice {
        /// Name of the balancers.
        name: String,
    },
    /// The link does not exist.
    #[error("balancer {name:?}: {link:?} is not a link of the robot; its links are {}", known_names(link, known))]
    UnknownLink {
        /// Name of the balancer.
        name: String,
        /// Requested link.
        link: String,
        /// Links of the robot.
        known: Vec<String>,
    },
    /// A point is not finite.
    #[error("balancer {name:?}: its point on link {link:?} has the entry {value}, expected finite numbers in m")]
    NotFinite {
        /// Name of the balancer.
        name: String,
        /// Link of the point.
        link: String,
        /// Invalid coordinate.
        value: f64,
    },
    /// Both ends are on one rigid body.
    #[error(
        "balancer {name:?}: no joint moves link {second:?} against link {first:?}, so it does nothing: put its ends on links with a joint \
         between them"
    )]
    SameBody {
        /// Name of the balancer.
        name: String,
        /// Link of the first end.
        first: String,
        /// Link of the second end.
        second: String,
    },
    /// The joint does not exist.
    #[error("balancer {name:?}: the robot has no movable joint {joint:?}; it has {}", known_names(joint, known))]
    UnknownJoint {
        /// Name of the balancer.
        name: String,
        /// Requested joint.
        joint: String,
        /// Movable joints of the robot.
        known: Vec<String>,
    },
    /// The joint depends on a closed loop.
    #[error("balancer {name:?}: joint {joint:?} follows from a loop, {own:?}: give its two ends, from and to, instead")]
    Dependent {
        /// Name of the balancer.
        name: String,
        /// Name of the joint.
        joint: String,
        /// Name of the loop.
        own: String,
    },
    /// A sine is given for a prismatic joint.
    #[error("balancer {name:?}: a sine is a torque over an angle, but joint {joint:?} slides: use spring or curve")]
    Slides {
        /// Name of the balancer.
        name: String,
        /// Name of the joint.
        joint: String,
    },
    /// The piston is beyond the end of its cylinder.
    #[error(
        "balancer {name:?} is {length:.4} m long there, its gas has no room left {beyond} {end:.4} m: check its ends (m), volume (m³), area (m²) \
         and the length to which these belong"
    )]
    NoRoom {
        /// Name of the balancer.
        name: String,
        /// Length of the balancer (m).
        length: f64,
        /// `above` or `below`.
        beyond: &'static str,
        /// Limit of the length (m).
        end: f64,
    },
    /// Both ends are at the same position.
    #[error(
        "both ends of balancer {name:?} are at the same place there, so that its force has no direction: move an end"
    )]
    NoLength {
        /// Name of the balancer.
        name: String,
    },
    /// One of these errors occurs during a motion.
    #[error("at t = {t:.3} s: {source}")]
    AlongMotion {
        /// Time (s).
        t: f64,
        /// Cause.
        #[source]
        source: Box<BalancerError>,
    },
}

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

/// Joint values that do not fit the robot, or pose without a solution.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// The number of joint values differs from the number of movable joints.
    #[error("{found} joint values given, the robot has {} movable joints: {joints:?}", joints.len())]
    Count {
        /// Number of values given.
        found: usize,
        /// Movable joints in coordinate order.
        joints: Vec<String>,
    },
    /// A joint value is not finite.
    #[error("joint {joint:?} at {value} is at no finite number")]
    NotFinite {
        /// Name of the joint.
        joint: String,
        /// Its value (rad or m).
        value: f64,
    },
    /// The number of samples of a motion does not match times and joints.
    #[error(
        "{found} joint values are given for {times} times; the robot has {joints} joints, so {} are expected",
        joints * times
    )]
    Samples {
        /// Number of values given.
        found: usize,
        /// Number of times given.
        times: usize,
        /// Number of movable joints of the robot.
        joints: usize,
    },
    /// A moving body has no inertia about some axis.
    #[error(
        "{}: {source}: {} lacks inertia about some axis, with all that it carries; give the links <inertial> with mass \
         and inertia, have them estimated (inertia_from_density in the robot file), or keep everything before them rigid",
        path.display(),
        links.join(", ")
    )]
    WithoutInertia {
        /// Path of the URDF.
        path: PathBuf,
        /// Error that reports the singular matrix.
        source: StepError,
        /// Elastic bodies and joints without inertia.
        links: Vec<String>,
    },
    /// The linearised model at the pose is invalid.
    #[error("the linear model at this pose: {0}")]
    Linear(#[source] LinearError),
    /// Results overflow, for example with masses, lengths or joint values of 1e200.
    #[error(
        "{what} are not finite: a mass, a length, a stiffness, a force or a joint value is far too large or too small"
    )]
    Overflow {
        /// Names of the results.
        what: String,
    },
    /// Modes cannot be recorded because the robot has none.
    #[error("the robot has no flexible link, so there are no modes to record")]
    NoModes,
}

/// Invalid inputs or outputs of a frequency response.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChannelError {
    /// The input is neither a force at the TCP nor a joint.
    #[error("input {word:?} is not known; inputs are {forces:?} and the joints {joints:?}")]
    UnknownInput {
        /// Given name.
        word: String,
        /// Forces and moments at the TCP.
        forces: &'static [&'static str],
        /// Joints of the robot.
        joints: Vec<String>,
    },
    /// The output is not an axis of the TCP.
    #[error("output {word:?} is not known; outputs are {axes:?} (the folder is {})", Setting::Output)]
    UnknownOutput {
        /// Given name.
        word: String,
        /// Axes of the TCP.
        axes: &'static [&'static str],
    },
    /// No input or no output is given.
    #[error("no {side} is given")]
    Missing {
        /// `input` or `output`.
        side: &'static str,
    },
    /// An input or output is given twice.
    #[error("{side} {word:?} is given twice")]
    Twice {
        /// `input` or `output`.
        side: &'static str,
        /// Given name.
        word: String,
    },
}

/// Load with invalid values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The samples are not a function of time.
    #[error(
        "a load needs at least two samples, one wrench for each time, and times that increase; found {times} times and \
         {wrenches} wrenches"
    )]
    Samples {
        /// Number of times given.
        times: usize,
        /// Number of wrenches given.
        wrenches: usize,
    },
    /// The frame is neither the TCP nor a moving link.
    #[error("load on frame {frame:?}: expected \"tcp\" or a link that moves, of {}", known_names(frame, known))]
    UnknownFrame {
        /// Given frame.
        frame: String,
        /// Moving links.
        known: Vec<String>,
    },
    /// A value is outside the range of plausible loads.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A change of payload is invalid.
    #[error(transparent)]
    Payload(#[from] PayloadError),
}

/// Invalid change of payload.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PayloadError {
    /// A time, mass or other number is negative or not finite.
    #[error("a payload needs a time and a mass of at least 0, and finite numbers")]
    Numbers,
    /// The inertia is not physical.
    #[error("payload inertia has a negative principal moment; the order is ixx iyy izz ixy ixz iyz")]
    NegativeMoment,
    /// The link is not that of the robot's own payload, which would stay where it is.
    #[error("the robot's own payload does not ride on link {link:?}: give that link")]
    OtherLink {
        /// Given link.
        link: String,
    },
    /// Two bodies carry payloads in one run.
    #[error("payloads on two bodies ({first:?} and {second:?}): one changes in a run")]
    TwoBodies {
        /// Body of an earlier change.
        first: String,
        /// Link of this change.
        second: String,
    },
    /// The link does not exist or does not move.
    #[error("payload link {link:?}: expected a link that moves, of {}", known_names(link, known))]
    UnknownLink {
        /// Given link.
        link: String,
        /// Moving links.
        known: Vec<String>,
    },
    /// The link is flexible.
    #[error(
        "payload link {link:?} is flexible, so that the position of the payload on it is not defined: name a link beyond it, of {beyond:?}"
    )]
    Bends {
        /// Given link.
        link: String,
        /// Links attached to it.
        beyond: Vec<String>,
    },
}
