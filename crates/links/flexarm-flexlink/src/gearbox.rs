//! Elastic gearboxes: a joint becomes the motor's joint and a spring between motor and link.
//!
//! ```text
//! parent --joint (prescribed or torque)--> <joint>__motor --spring--> child
//! ```
//! The intermediate link has no mass; the rotor is an armature of the motor's joint, `ratio² J`.
//! With one stiffness the spring acts about the joint's axis; with three also the bearings tilt
//! (extended flexible joint), as three springs about x, y, z of the joint frame; with a full 6x6
//! stiffness, it deflects in all directions. With three or six, a fixed joint becomes an elastic
//! connection. Six springs with play act one after another: translations along x, y, z, then
//! rotations about x, y, z. At zero deflection all frames are unchanged.
//!
//! A seat deflects before the joint, so that its two springs do not turn with it:
//! ```text
//! parent --spring--> --spring--> <joint>__seated --joint--> <joint>__motor --spring--> child
//! ```
//!
//! The guide of a telescopic joint tilts in the middle of the overlap of its tubes, which moves
//! half as fast as the joint. Two joints that mimic it move there and back:
//! ```text
//! parent --joint--> <joint>__motor --back--> <joint>__middle --springs--> <joint>__tilted --forth--> child
//! ```
//! Start at [`insert_gearboxes`]. Not here: damping, play, curves and friction of the springs, which
//! the tree does not know (`flexarm-stepping`).

use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, Mechanism, Mimic, Pose};
use nalgebra::{DMatrix, Matrix6, Vector3};

use crate::stiffness::{StiffnessError, spring_stiffness};

/// Stiffness of a gearbox on the joint side.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a handful per robot, made once")]
pub enum GearStiffness {
    /// About (or along) the joint's axis (N m/rad or N/m).
    Axis(f64),
    /// About x, y and z of the joint frame (N m/rad).
    Tilting([f64; 3]),
    /// Translations (N/m) and rotations (N m/rad) in the joint frame, coupled.
    Full(Matrix6<f64>),
    /// Translations along x, y and z (N/m), then rotations about them (N m/rad), one after another,
    /// so that each can have its own law.
    Separate([f64; 6]),
    /// Tilt of a sliding joint in the middle of the overlap of its tubes.
    Guide(GuideTubes),
}

/// Overlap of the tubes of a telescopic joint, and the axes about which they tilt.
#[derive(Clone, Debug, PartialEq)]
pub struct GuideTubes {
    /// End of the outer tube, along the axis from the joint frame at zero joint position (m).
    pub outer_end: f64,
    /// End of the inner tube, along the axis from the child frame (m).
    pub inner_end: f64,
    /// Whether the guide tilts about x, y and z of the joint frame.
    pub tilts: [bool; 3],
}

impl GearStiffness {
    /// Returns the stiffness of each spring, if they are not coupled.
    pub fn each(&self) -> Option<&[f64]> {
        match self {
            Self::Axis(k) => Some(std::slice::from_ref(k)),
            Self::Tilting(k) => Some(k),
            Self::Separate(k) => Some(k),
            Self::Full(_) | Self::Guide(_) => None,
        }
    }
}

impl GuideTubes {
    /// Returns the overlap (m) at a joint position (m).
    pub fn overlap(&self, position: f64) -> f64 {
        self.outer_end - self.inner_end - position
    }

    /// Returns the middle of the overlap, along the axis from the joint frame at zero joint
    /// position, as an offset (m) and a factor on the joint position.
    fn middle(&self) -> [f64; 2] {
        [0.5 * (self.outer_end + self.inner_end), 0.5]
    }
}

/// Joint with an elastic gearbox.
#[derive(Clone, Debug, PartialEq)]
pub struct Gearbox {
    /// Name of the joint.
    pub joint: String,
    /// Stiffness of the spring.
    pub stiffness: GearStiffness,
    /// Stiffness of the housing before the joint (N m/rad), about the two axes of the joint frame that
    /// are across the joint's axis: x and y if it is z.
    pub seat: Option<[f64; 2]>,
}

/// Spring inserted for a gearbox or a mounting.
#[derive(Clone, Debug, PartialEq)]
pub struct GearSpring {
    /// Name in messages: the joint, with the axis if there are several.
    pub name: String,
    /// Name of the joint with the gearbox, or of the mounting.
    pub gearbox: String,
    /// Name of the elastic joint.
    pub joint: String,
    /// Index of the spring within its gearbox.
    pub component: usize,
    /// Stiffness for its coordinates; 1 for a guide, whose law depends on the joint and is the
    /// caller's.
    pub K: DMatrix<f64>,
}

/// Reason why a gearbox is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("gearbox of joint {joint:?}: {fault}")]
pub struct GearboxError {
    /// Name of the joint.
    pub joint: String,
    /// Cause.
    #[source]
    pub fault: GearboxFault,
}

/// Reason why a gearbox does not fit its joint, or is no spring.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GearboxFault {
    /// There is no joint of this name, or it is fixed and has a single spring.
    #[error("the robot has no such movable joint")]
    NoJoint,
    /// The joint is a dependent one of the loop of this name.
    #[error("the joint follows from loop {0:?}, so nothing drives it")]
    Dependent(String),
    /// Springs about three axes at a joint that slides.
    #[error("three stiffnesses are about the axes of a turning joint; this one slides")]
    Slides,
    /// A guide at a joint without tubes, or one that tilts about no axis.
    #[error("only a prismatic joint has tubes that slide, and a guide tilts about one axis at least")]
    NoTubes,
    /// A single stiffness is zero, negative or not finite.
    #[error("its stiffness must be positive and finite, found {0:e}")]
    NotPositive(f64),
    /// The 6×6 stiffness is that of no spring.
    #[error("its stiffness: {0}")]
    Stiffness(#[from] StiffnessError),
}

/// Checks that a gearbox fits its joint and that its springs are stiff in all directions.
fn check(mechanism: &Mechanism, gearbox: &Gearbox) -> Result<(), GearboxFault> {
    let name = &gearbox.joint;
    if let Some(closure) = mechanism.loops.iter().find(|closure| closure.dependent.contains(name)) {
        return Err(GearboxFault::Dependent(closure.name.clone()));
    }
    // A fixed joint with several springs is an elastic connection.
    let several = !matches!(gearbox.stiffness, GearStiffness::Axis(_));
    let kind = mechanism.joint(name).ok_or(GearboxFault::NoJoint)?.kind;
    if kind.spring().is_none() && !(several && kind == JointKind::Fixed) {
        return Err(GearboxFault::NoJoint);
    }
    match &gearbox.stiffness {
        GearStiffness::Tilting(_) if kind.slides() => return Err(GearboxFault::Slides),
        GearStiffness::Guide(tubes) if !matches!(kind, JointKind::Prismatic(_)) || !tubes.tilts.contains(&true) => {
            return Err(GearboxFault::NoTubes);
        }
        GearStiffness::Full(K) => drop(spring_stiffness(K)?),
        _ => {}
    }
    let single = gearbox.stiffness.each().unwrap_or_default().iter().chain(gearbox.seat.iter().flatten());
    match single.copied().find(|k| !(*k > 0.0 && k.is_finite())) {
        Some(found) => Err(GearboxFault::NotPositive(found)),
        None => Ok(()),
    }
}

/// Inserts the joints from the moving end of a sliding joint to the middle of the overlap of its
/// tubes, and back; returns the links between which the springs act.
fn there_and_back(
    mechanism: &mut Mechanism,
    slide: &Joint,
    tubes: &GuideTubes,
    motor: String,
    child: String,
) -> (String, String) {
    let name = &slide.name;
    let [middle, tilted] = ["middle", "tilted"].map(|end| format!("{name}__{end}"));
    // The middle of the overlap from the moving end: offset + (factor - 1) position.
    let [offset, factor] = tubes.middle();
    // A mimic joint has no followers of its own.
    let leader = slide.mimic.clone().unwrap_or(Mimic { joint: name.clone(), ratio: 1.0, offset: 0.0 });
    let along = |sign: f64| Mimic {
        joint: leader.joint.clone(),
        ratio: sign * (factor - 1.0) * leader.ratio,
        offset: sign * (offset + (factor - 1.0) * leader.offset),
    };
    for (joint, parent, end, sign) in [("back", &motor, &middle, 1.0), ("forth", &tilted, &child, -1.0)] {
        let moved = Joint::new(format!("{name}__{joint}"), slide.kind, parent, end, Pose::identity());
        mechanism.joints.push(Joint { mimic: Some(along(sign)), ..moved });
    }
    for link in [&middle, &tilted] {
        mechanism.links.push(Link { name: link.clone(), inertia: None });
    }
    (middle, tilted)
}

/// Suffixes of the names of the springs of a seat, by axis of the joint frame.
pub const SEAT: [&str; 3] = [".seat_x", ".seat_y", ".seat_z"];
/// `GearSpring::component` of the first spring of a seat.
const SEATED: usize = 6;

/// Inserts a spring outward of each of the joints, and those of its seat inward.
///
/// # Errors
/// [`GearboxError`] with the name of the joint; that gearbox is then not in the mechanism.
pub fn insert_gearboxes(mechanism: &mut Mechanism, gearboxes: &[Gearbox]) -> Result<Vec<GearSpring>, GearboxError> {
    let mut springs = Vec::new();
    for gearbox in gearboxes {
        let name = &gearbox.joint;
        check(mechanism, gearbox).map_err(|fault| GearboxError { joint: name.clone(), fault })?;
        let Some(joint) = mechanism.joints.iter_mut().find(|j| j.name == *name) else { continue };
        // The motor's joint ends at a new link; the springs lead on to the child.
        let slide = joint.clone();
        let motor = format!("{name}__motor");
        let child = std::mem::replace(&mut joint.child, motor.clone());
        mechanism.links.push(Link { name: motor.clone(), inertia: None });
        // The seat takes the joint's place in the parent: two springs across the axis, then the joint.
        let seat = gearbox.seat.map(|k| {
            let seated = format!("{name}__seated");
            let parent = std::mem::replace(&mut joint.parent, seated.clone());
            let X = std::mem::replace(&mut joint.X_PJ, Pose::identity());
            let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
            let own = joint.kind.axis_motion().map_or(2, |motion| motion.axis().iamax());
            let across = SEAT.into_iter().zip(axes).enumerate().filter(|(k, _)| *k != own).zip(k);
            let turn =
                |((_, (suffix, axis)), k)| (suffix, JointKind::ElasticRevolute(axis), DMatrix::from_element(1, 1, k));
            (across.map(turn).collect(), (parent, seated), X)
        });
        if let Some((parts, ends, X)) = seat {
            mechanism.links.push(Link { name: ends.1.clone(), inertia: None });
            let seated = insert_springs(mechanism, name, parts, ends, X);
            let behind = |spring: GearSpring| GearSpring { component: spring.component + SEATED, ..spring };
            springs.extend(seated.into_iter().map(behind));
        }
        let parts = spring_joints(&gearbox.stiffness, slide.kind.spring());
        let (parent, child) = match &gearbox.stiffness {
            GearStiffness::Guide(tubes) => there_and_back(mechanism, &slide, tubes, motor, child),
            _ => (motor, child),
        };
        springs.extend(insert_springs(mechanism, name, parts, (parent, child), Pose::identity()));
    }
    Ok(springs)
}

/// Inserts springs one after another between two links; `X`: pose of the first one in its parent.
pub(crate) fn insert_springs(
    mechanism: &mut Mechanism,
    name: &str,
    parts: Vec<SpringJoint>,
    (mut parent, child): (String, String),
    mut X: Pose,
) -> Vec<GearSpring> {
    let (last, mut springs) = (parts.len() - 1, Vec::new());
    for (component, (suffix, kind, K)) in parts.into_iter().enumerate() {
        let joint = format!("{name}__spring{suffix}");
        let to = if component == last { child.clone() } else { format!("{name}__gear{suffix}") };
        if component < last {
            mechanism.links.push(Link { name: to.clone(), inertia: None });
        }
        mechanism.joints.push(Joint::new(&joint, kind, &parent, &to, X));
        X = Pose::identity();
        springs.push(GearSpring { name: format!("{name}{suffix}"), gearbox: name.to_owned(), joint, component, K });
        parent = to;
    }
    springs
}

/// Suffix of the name, kind and stiffness of a joint with a spring.
type SpringJoint = (&'static str, JointKind, DMatrix<f64>);

/// Returns the joints with springs that replace a joint, from the motor outward. `along`: spring
/// along the axis of the joint, if it has one.
pub(crate) fn spring_joints(stiffness: &GearStiffness, along: Option<JointKind>) -> Vec<SpringJoint> {
    let axes = || [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let single = |k: f64| DMatrix::from_element(1, 1, k);
    match stiffness {
        GearStiffness::Axis(k) => along.map(|kind| ("", kind, single(*k))).into_iter().collect(),
        GearStiffness::Tilting(k) => {
            let turns = [".x", ".y", ".z"].into_iter().zip(axes()).zip(k);
            turns.map(|((suffix, axis), k)| (suffix, JointKind::ElasticRevolute(axis), single(*k))).collect()
        }
        GearStiffness::Separate(k) => {
            let slides = axes().map(JointKind::ElasticPrismatic);
            let turns = axes().map(JointKind::ElasticRevolute);
            let named = [".x", ".y", ".z", ".rx", ".ry", ".rz"].into_iter().zip(slides.into_iter().chain(turns));
            named.zip(k).map(|((suffix, kind), k)| (suffix, kind, single(*k))).collect()
        }
        GearStiffness::Full(K) => {
            let kind = JointKind::Elastic(ElasticAngles::RotationVector);
            vec![("", kind, DMatrix::from_column_slice(6, 6, K.as_slice()))]
        }
        GearStiffness::Guide(tubes) => {
            let turns = [".x", ".y", ".z"].into_iter().zip(axes()).zip(tubes.tilts).filter(|(_, tilts)| *tilts);
            turns.map(|((suffix, axis), _)| (suffix, JointKind::ElasticRevolute(axis), single(1.0))).collect()
        }
    }
}
