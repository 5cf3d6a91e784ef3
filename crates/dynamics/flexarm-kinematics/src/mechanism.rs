//! A mechanism as a user describes it: links and joints by name, fixed joints included.
//!
//! This is the editable form. Readers (URDF) produce it, the flexible-link substitution changes it,
//! and [`crate::Model::new`] checks it once and turns it into the immutable tree that the
//! recursions read. Start at [`Mechanism`]. Not here: any computation.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use flexarm_spatial::{ElasticAngles, Pose, SpatialInertia};
use nalgebra::{Matrix3, Unit, Vector3};

use crate::axis_motion::AxisMotion;
use crate::balancer::Balancer;
use crate::closure::LoopClosure;
use crate::modal::ModalBody;

/// Links joined by joints into one tree. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// Name of the robot.
    pub name: String,
    /// All links, in the order of the source; the one that is no joint's child is the base.
    pub links: Vec<Link>,
    /// All joints, in the order of the source.
    pub joints: Vec<Joint>,
    /// Links that bend in modes, by name; their mass is in the modal body, beside the link's own
    /// inertia.
    pub modal: Vec<(String, Arc<ModalBody>)>,
    /// Springs, gas springs and counterbalances between points of the arm or over joints.
    pub balancers: Vec<Balancer>,
    /// Rotors that turn with several joints: what their inertias couple.
    pub rotor_couplings: Vec<RotorCoupling>,
    /// Pins that close chains of links in a plane.
    pub loops: Vec<LoopClosure>,
    /// Acceleration of gravity in world (= base link) axes (m/s²).
    pub gravity: Vector3<f64>,
    /// Joints in the order of the actuated coordinates; those that are not named follow in the
    /// order of the tree, depth first. See [`Mechanism::keep_coordinate_order`].
    pub coordinate_order: Vec<String>,
}

/// Inertia between two joints, of rotors that turn with both: `q̇_1 q̇_2` times this in the kinetic
/// energy.
#[derive(Clone, Debug, PartialEq)]
pub struct RotorCoupling {
    /// Two joints of one coordinate each.
    pub joints: [String; 2],
    /// Entry of the mass matrix in the row of one and the column of the other (kg m², kg m or kg).
    pub inertia: f64,
}

/// A rigid body with its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Unique name.
    pub name: String,
    /// Mass properties; `None` for a mere frame.
    pub inertia: Option<LinkInertia>,
}

/// Mass properties of a link, in link axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkInertia {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass `p_LoLcm_L` (m).
    pub com: Vector3<f64>,
    /// Rotational inertia about the centre of mass (kg m²).
    pub inertia_com: Matrix3<f64>,
}

impl LinkInertia {
    /// As spatial inertia about the link's origin.
    pub fn spatial(&self) -> SpatialInertia {
        SpatialInertia::from_com(self.mass, &self.com, &self.inertia_com)
    }
}

/// A joint between two links.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique name.
    pub name: String,
    /// What it lets move.
    pub kind: JointKind,
    /// Name of the parent link P.
    pub parent: String,
    /// Name of the child link; its frame is the joint frame.
    pub child: String,
    /// Pose of the joint frame in the parent link at zero coordinate.
    pub X_PJ: Pose,
    /// Position, velocity and effort limits.
    pub limits: Limits,
    /// Set when this joint follows another one.
    pub mimic: Option<Mimic>,
    /// Inertia of the rotor seen from the joint, ratio² times its own (kg m² or kg); only on
    /// one-DoF joints.
    pub armature: f64,
}

/// What a joint lets move. Axes are unit vectors in the joint frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// Nothing.
    Fixed,
    /// One rotation within limits.
    Revolute(Unit<Vector3<f64>>),
    /// One rotation without position limits.
    Continuous(Unit<Vector3<f64>>),
    /// One translation.
    Prismatic(Unit<Vector3<f64>>),
    /// One rotation that slides along its axis as a nut on a spindle does.
    Helical {
        /// The axis.
        axis: Unit<Vector3<f64>>,
        /// Translation per rad (m).
        pitch: f64,
    },
    /// Six small elastic coordinates: translation in P axes, then three angles.
    Elastic(ElasticAngles),
    /// One small elastic rotation (the spring of a gearbox).
    ElasticRevolute(Unit<Vector3<f64>>),
    /// One small elastic translation.
    ElasticPrismatic(Unit<Vector3<f64>>),
    /// One small elastic rotation that slides along its axis (the spring behind a helical joint).
    ElasticHelical {
        /// The axis.
        axis: Unit<Vector3<f64>>,
        /// Translation per rad (m).
        pitch: f64,
    },
    /// Interface of that number of the parent link, which must have a [`ModalBody`]: moves with its
    /// coordinates.
    Interface(usize),
}

impl JointKind {
    /// Number of coordinates of its own.
    pub fn degrees_of_freedom(&self) -> usize {
        match self {
            Self::Fixed | Self::Interface(_) => 0,
            Self::Revolute(_) | Self::Continuous(_) | Self::Prismatic(_) => 1,
            Self::ElasticRevolute(_) | Self::ElasticPrismatic(_) => 1,
            Self::Helical { .. } | Self::ElasticHelical { .. } => 1,
            Self::Elastic(_) => 6,
        }
    }

    /// Motion of its coordinate, where it has one.
    pub fn axis_motion(&self) -> Option<AxisMotion> {
        match *self {
            Self::Revolute(axis) | Self::Continuous(axis) | Self::ElasticRevolute(axis) => {
                Some(AxisMotion::Revolute(axis.into_inner()))
            }
            Self::Prismatic(axis) | Self::ElasticPrismatic(axis) => Some(AxisMotion::Prismatic(axis.into_inner())),
            Self::Helical { axis, pitch } | Self::ElasticHelical { axis, pitch } => {
                Some(AxisMotion::Helical { axis: axis.into_inner(), pitch })
            }
            Self::Fixed | Self::Elastic(_) | Self::Interface(_) => None,
        }
    }

    /// Whether its coordinates are small elastic ones.
    pub fn is_elastic(&self) -> bool {
        matches!(
            self,
            Self::Elastic(_) | Self::ElasticRevolute(_) | Self::ElasticPrismatic(_) | Self::ElasticHelical { .. }
        )
    }

    /// The spring that moves as this joint of one coordinate does.
    pub fn spring(&self) -> Option<JointKind> {
        match *self {
            Self::Revolute(axis) | Self::Continuous(axis) => Some(Self::ElasticRevolute(axis)),
            Self::Prismatic(axis) => Some(Self::ElasticPrismatic(axis)),
            Self::Helical { axis, pitch } => Some(Self::ElasticHelical { axis, pitch }),
            _ => None,
        }
    }

    /// Whether its coordinate is a joint angle (rad).
    pub fn turns(&self) -> bool {
        !self.is_elastic() && self.axis_motion().is_some_and(|motion| !motion.slides())
    }

    /// Whether its coordinate is a joint translation (m).
    pub fn slides(&self) -> bool {
        !self.is_elastic() && self.axis_motion().is_some_and(AxisMotion::slides)
    }

    /// Translation per unit of its coordinate: 1 where it slides (m/m).
    pub fn travel(&self) -> f64 {
        self.axis_motion().map_or(0.0, AxisMotion::travel)
    }

    /// The word of URDF files, and `helical`, which these do not have.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute(_) => "revolute",
            Self::Continuous(_) => "continuous",
            Self::Prismatic(_) => "prismatic",
            Self::Helical { .. } => "helical",
            Self::Elastic(_) | Self::ElasticRevolute(_) | Self::ElasticPrismatic(_) | Self::ElasticHelical { .. } => {
                "elastic"
            }
            Self::Interface(_) => "interface",
        }
    }
}

/// Limits of a joint; infinite where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Lowest position (rad or m).
    pub lower: f64,
    /// Highest position (rad or m).
    pub upper: f64,
    /// Highest speed (rad/s or m/s).
    pub velocity: f64,
    /// Highest torque or force (N m or N).
    pub effort: f64,
}

impl Limits {
    /// No limit at all.
    pub const NONE: Limits =
        Limits { lower: f64::NEG_INFINITY, upper: f64::INFINITY, velocity: f64::INFINITY, effort: f64::INFINITY };
}

/// `q = ratio * q_of(joint) + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// Name of the joint that leads.
    pub joint: String,
    /// Factor.
    pub ratio: f64,
    /// Offset (rad or m).
    pub offset: f64,
}

impl Mechanism {
    /// A mechanism without links, under standard gravity along -z.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            links: Vec::new(),
            joints: Vec::new(),
            modal: Vec::new(),
            balancers: Vec::new(),
            rotor_couplings: Vec::new(),
            loops: Vec::new(),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            coordinate_order: Vec::new(),
        }
    }

    /// Keeps the order that the actuated coordinates have now, however the tree is changed
    /// afterwards: joints that move to another link come in another place of the tree, and joint
    /// values are told by their order.
    pub fn keep_coordinate_order(&mut self) {
        if !self.coordinate_order.is_empty() {
            return;
        }
        let children: HashSet<&str> = self.joints.iter().map(|joint| joint.child.as_str()).collect();
        let base = self.links.iter().map(|link| link.name.as_str()).find(|name| !children.contains(name));
        let mut from: HashMap<&str, Vec<&Joint>> = HashMap::new();
        self.joints.iter().rev().for_each(|joint| from.entry(&joint.parent).or_default().push(joint));
        let mut order = Vec::new();
        let mut open = base.and_then(|base| from.remove(base)).unwrap_or_default();
        while let Some(joint) = open.pop() {
            order.push(joint.name.clone());
            open.extend(from.remove(joint.child.as_str()).into_iter().flatten());
        }
        self.coordinate_order = order;
    }

    /// The link of that name.
    pub fn link(&self, name: &str) -> Option<&Link> {
        self.links.iter().find(|l| l.name == name)
    }

    /// The joint of that name.
    pub fn joint(&self, name: &str) -> Option<&Joint> {
        self.joints.iter().find(|j| j.name == name)
    }

    /// The joints that start at a link, in source order.
    pub fn child_joints<'a>(&'a self, link: &'a str) -> impl Iterator<Item = &'a Joint> + 'a {
        self.joints.iter().filter(move |j| j.parent == link)
    }
}

impl Joint {
    /// A joint without limits or mimic.
    pub fn new(
        name: impl Into<String>,
        kind: JointKind,
        parent: impl Into<String>,
        child: impl Into<String>,
        X_PJ: Pose,
    ) -> Self {
        Self {
            name: name.into(),
            kind,
            parent: parent.into(),
            child: child.into(),
            X_PJ,
            limits: Limits::NONE,
            mimic: None,
            armature: 0.0,
        }
    }
}
