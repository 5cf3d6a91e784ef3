//! Mechanism as defined by the user: named links and joints, including fixed joints.
//!
//! This is the editable form. Readers (URDF) produce it, the flexible-link substitution modifies
//! it, and [`crate::Model::new`] checks it once and converts it to the immutable tree used by the
//! recursions. Start at [`Mechanism`]. Not here: any computation.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use flexarm_spatial::{ElasticAngles, Pose, SpatialInertia};
use nalgebra::{Matrix3, Unit, Vector3};

use crate::axis_motion::AxisMotion;
use crate::balancer::Balancer;
use crate::closure::LoopClosure;
use crate::modal::ModalBody;

/// Tree of links connected by joints. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// Name of the robot.
    pub name: String,
    /// All links, in source order; the link that is no joint's child is the base.
    pub links: Vec<Link>,
    /// All joints, in source order.
    pub joints: Vec<Joint>,
    /// Modal links, by name. The mass of the modal body is in addition to the link's own inertia.
    pub modal: Vec<(String, Arc<ModalBody>)>,
    /// Springs, gas springs and counterbalances between points of the arm or about joints.
    pub balancers: Vec<Balancer>,
    /// Inertia couplings of rotors driven by several joints.
    pub rotor_couplings: Vec<RotorCoupling>,
    /// Pins that close planar chains of links.
    pub loops: Vec<LoopClosure>,
    /// Gravitational acceleration in world (= base link) axes (m/s²).
    pub gravity: Vector3<f64>,
    /// Joints in the order of the actuated coordinates; joints not listed follow in tree order,
    /// depth first. See [`Mechanism::keep_coordinate_order`].
    pub coordinate_order: Vec<String>,
}

/// Inertia coupling of two joints by rotors that rotate with both: it multiplies `q̇_1 q̇_2` in the
/// kinetic energy.
#[derive(Clone, Debug, PartialEq)]
pub struct RotorCoupling {
    /// The two joints, each with one coordinate.
    pub joints: [String; 2],
    /// Off-diagonal entry of the mass matrix (kg m², kg m or kg).
    pub inertia: f64,
}

/// Rigid body with its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Unique name.
    pub name: String,
    /// Mass properties; `None` for a frame without mass.
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
    /// Converts to spatial inertia about the link origin.
    pub fn spatial(&self) -> SpatialInertia {
        SpatialInertia::from_com(self.mass, &self.com, &self.inertia_com)
    }
}

/// Joint between two links.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique name.
    pub name: String,
    /// Type of the joint.
    pub kind: JointKind,
    /// Name of the parent link P.
    pub parent: String,
    /// Name of the child link; its frame is the joint frame.
    pub child: String,
    /// Pose of the joint frame in the parent link at zero coordinate.
    pub X_PJ: Pose,
    /// Position, velocity and effort limits.
    pub limits: Limits,
    /// Set if this joint follows another one.
    pub mimic: Option<Mimic>,
    /// Rotor inertia reflected to the joint, ratio² times its own (kg m² or kg); only for
    /// single-DoF joints.
    pub armature: f64,
}

/// Type of a joint. Axes are unit vectors in the joint frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// One rotation with position limits.
    Revolute(Unit<Vector3<f64>>),
    /// One rotation without position limits.
    Continuous(Unit<Vector3<f64>>),
    /// One translation.
    Prismatic(Unit<Vector3<f64>>),
    /// One rotation with a proportional translation along its axis, like a nut on a spindle.
    Helical {
        /// Screw axis.
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
    /// One small elastic rotation with a proportional translation (spring of a helical joint).
    ElasticHelical {
        /// Screw axis.
        axis: Unit<Vector3<f64>>,
        /// Translation per rad (m).
        pitch: f64,
    },
    /// Interface of this index of the parent link, which must have a [`ModalBody`]; moves with the
    /// modal coordinates.
    Interface(usize),
}

impl JointKind {
    /// Number of coordinates of the joint itself.
    pub fn degrees_of_freedom(&self) -> usize {
        match self {
            Self::Fixed | Self::Interface(_) => 0,
            Self::Revolute(_) | Self::Continuous(_) | Self::Prismatic(_) => 1,
            Self::ElasticRevolute(_) | Self::ElasticPrismatic(_) => 1,
            Self::Helical { .. } | Self::ElasticHelical { .. } => 1,
            Self::Elastic(_) => 6,
        }
    }

    /// Axis motion of single-DoF joints.
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

    /// Whether the coordinates are small elastic displacements.
    pub fn is_elastic(&self) -> bool {
        matches!(
            self,
            Self::Elastic(_) | Self::ElasticRevolute(_) | Self::ElasticPrismatic(_) | Self::ElasticHelical { .. }
        )
    }

    /// Elastic joint with the motion of this single-DoF joint.
    pub fn spring(&self) -> Option<JointKind> {
        match *self {
            Self::Revolute(axis) | Self::Continuous(axis) => Some(Self::ElasticRevolute(axis)),
            Self::Prismatic(axis) => Some(Self::ElasticPrismatic(axis)),
            Self::Helical { axis, pitch } => Some(Self::ElasticHelical { axis, pitch }),
            _ => None,
        }
    }

    /// Whether the coordinate is a joint angle (rad).
    pub fn turns(&self) -> bool {
        !self.is_elastic() && self.axis_motion().is_some_and(|motion| !motion.slides())
    }

    /// Whether the coordinate is a joint translation (m).
    pub fn slides(&self) -> bool {
        !self.is_elastic() && self.axis_motion().is_some_and(AxisMotion::slides)
    }

    /// Translation per unit of the coordinate: 1 for sliding joints (m/m).
    pub fn travel(&self) -> f64 {
        self.axis_motion().map_or(0.0, AxisMotion::travel)
    }

    /// Name of the type in URDF files; also `helical`, `elastic` and `interface`, which URDF does
    /// not have.
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

/// Joint limits; infinite where there is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Minimum position (rad or m).
    pub lower: f64,
    /// Maximum position (rad or m).
    pub upper: f64,
    /// Maximum speed (rad/s or m/s).
    pub velocity: f64,
    /// Maximum torque or force (N m or N).
    pub effort: f64,
    /// Maximum rate of change of the speed (rad/s² or m/s²).
    pub acceleration: f64,
    /// Maximum rate of change of the acceleration (rad/s³ or m/s³).
    pub jerk: f64,
}

impl Limits {
    /// No limits.
    pub const NONE: Limits = Limits {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        effort: f64::INFINITY,
        acceleration: f64::INFINITY,
        jerk: f64::INFINITY,
    };
}

/// Mimic relation `q = ratio * q_of(joint) + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// Name of the leading joint.
    pub joint: String,
    /// Factor.
    pub ratio: f64,
    /// Offset (rad or m).
    pub offset: f64,
}

impl Mechanism {
    /// Creates a mechanism without links, under standard gravity along -z.
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

    /// Keeps the current order of the actuated coordinates through later changes of the tree.
    /// Joints that move to another link get another position in the tree, while joint values are
    /// identified by their order.
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

    /// Returns the link with this name.
    pub fn link(&self, name: &str) -> Option<&Link> {
        self.links.iter().find(|l| l.name == name)
    }

    /// Returns the joint with this name.
    pub fn joint(&self, name: &str) -> Option<&Joint> {
        self.joints.iter().find(|j| j.name == name)
    }

    /// Child joints of a link, in source order.
    pub fn child_joints<'a>(&'a self, link: &'a str) -> impl Iterator<Item = &'a Joint> + 'a {
        self.joints.iter().filter(move |j| j.parent == link)
    }
}

impl Joint {
    /// Creates a joint without limits or mimic relation.
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
