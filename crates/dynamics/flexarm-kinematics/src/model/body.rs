//! Parts of the tree: bodies with their joints, modal bodies, named frames and coordinates.
//!
//! P is the parent of body B, J the frame of the joint between them, fixed to P; at zero coordinate B
//! and J coincide. Not here: their construction (`builder`), their numbers (`numbering`).

use std::ops::Range;
use std::slice::ChunksExact;

use flexarm_spatial::{ElasticAngles, Pose, Real, SpatialInertia};

use crate::axis_motion::{AxisMotion, RevoluteTable};
use crate::mechanism::Limits;
use crate::modal::ModalTables;
use crate::pose::identity;

/// Moving body B (or the world, index 0) with the joint to its parent P.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name of the link whose frame is the body frame.
    pub name: String,
    /// Name of the joint that moves the body.
    pub joint: String,
    /// Index of the parent body; 0 is the world. Meaningless for body 0.
    pub parent: usize,
    /// Pose of the joint frame in the parent body at zero coordinate.
    pub X_PJ: Pose,
    /// Inertia about Bo in B axes, including everything fixed to the body.
    pub inertia: SpatialInertia,
    /// Motion allowed by the joint.
    pub motion: JointMotion,
    /// Index of the (first) independent coordinate; indices from [`crate::Model::nv`] on are
    /// dependent coordinates of closed loops.
    pub coordinate: usize,
    /// Joint value = ratio × coordinate + offset; (1, 0) except for mimic joints.
    pub ratio: f64,
    /// Offset of the joint value, see `ratio`.
    pub offset: f64,
    /// Rotor inertia reflected to the coordinate (kg m² or kg).
    pub armature: f64,
    /// Whether the joint coordinates are elastic.
    pub elastic: bool,
    /// Index of its modal body, if it is one.
    pub(crate) modal: Option<usize>,
    pub(crate) turn: RevoluteTable,
    /// Index of its joint among the rotating ones.
    pub(crate) turning: usize,
    /// One past the last body of the subtree; depth-first order makes a subtree a contiguous range.
    pub(crate) subtree_end: usize,
    /// Whether the joint frame has the same axes as the parent frame.
    pub(crate) is_parallel: bool,
    pub(crate) columns: Outward,
}

/// Joints of a subtree, including the body's own joint, as ranges of the model's lists `single` and
/// `six`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outward {
    pub(crate) single: Range<usize>,
    pub(crate) six: Range<usize>,
}

/// Joint motion as used by the recursions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointMotion {
    /// One coordinate along a constant motion axis.
    Axis(AxisMotion),
    /// Translation in P axes, then rotation angles.
    Elastic(ElasticAngles),
    /// No motion: a modal link on a fixed joint is a separate body without a joint coordinate.
    Welded,
    /// Interface of the parent's modal body; it uses the coordinates of that body.
    Interface {
        /// Index of the modal body in the model.
        modal: usize,
        /// Index of the interface.
        interface: usize,
    },
}

/// Modal body in the tree.
#[derive(Clone, Debug)]
pub(crate) struct Modal {
    pub(crate) body: usize,
    pub(crate) coordinate: usize,
    pub(crate) n: usize,
    pub(crate) tables: ModalTables,
}

impl Body {
    /// Pose in the parent for the coordinate value (rad or m) of a single-DoF joint.
    ///
    /// # Panics
    /// If the joint does not have exactly one coordinate.
    #[inline]
    pub fn X_PB(&self, coordinate: f64) -> Pose {
        let JointMotion::Axis(motion) = self.motion else { panic!("joint {:?} has not one coordinate", self.joint) };
        self.along_axis(motion, coordinate)
    }

    /// `X_PB` of a single-DoF joint, for any scalar type.
    pub(crate) fn along_axis<T: Real>(&self, motion: AxisMotion, coordinate: T) -> Pose<T> {
        let value = T::splat(self.ratio) * coordinate + T::splat(self.offset);
        let mut X_PB = identity();
        motion.place(&self.X_PJ, &self.turn, value, Real::sin_cos(value), &mut X_PB);
        X_PB
    }
}

impl Modal {
    /// Mode shape columns of an interface, six components for each coordinate that moves it.
    #[inline(always)]
    pub(crate) fn columns_of(&self, interface: usize) -> ChunksExact<'_, f64> {
        let moving = 6 * self.tables.moving[interface];
        self.tables.shapes.interfaces[interface].Phi.as_slice()[..moving].chunks_exact(6)
    }
}

/// Contiguous elastic coordinates of one elastic joint or one modal body.
#[derive(Clone, Debug, PartialEq)]
pub struct ElasticGroup {
    /// Name of the elastic joint, or of the modal link.
    pub name: String,
    /// Child body of the joint, or the modal body.
    pub body: usize,
    /// First coordinate.
    pub coordinate: usize,
    /// Number of coordinates.
    pub size: usize,
    /// Whether these are modal coordinates.
    pub modal: bool,
}

/// Named frame fixed to a body; there is one per link of the mechanism.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Name of the link.
    pub name: String,
    /// Body that carries the frame.
    pub body: usize,
    /// Pose of the frame in the body.
    pub X_BF: Pose,
}

/// Independent coordinate.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// Joint that owns the coordinate.
    pub joint: String,
    /// Component within the joint: 0, or 0..6 for elastic joints.
    pub component: usize,
    /// Body moved by the joint.
    pub body: usize,
    /// Limits of the joint.
    pub limits: Limits,
    /// URDF name of the joint type.
    pub kind: &'static str,
}

impl Coordinate {
    /// Whether the joint is prismatic: its value is a length.
    pub fn slides(&self) -> bool {
        self.kind == "prismatic"
    }

    /// Unit of the value: m or rad.
    pub fn unit(&self) -> &'static str {
        if self.slides() { "m" } else { "rad" }
    }

    /// Unit of the effort: N or N m.
    pub fn effort_unit(&self) -> &'static str {
        if self.slides() { "N" } else { "N m" }
    }
}
