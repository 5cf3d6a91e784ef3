//! A URDF as written: elements with their places, nothing concluded yet.

use std::collections::HashMap;

use flexarm_kinematics::Pose;
use nalgebra::{Matrix3, Vector3};

use crate::finding::Place;

/// A URDF as written.
pub(crate) struct RawRobot {
    pub(crate) name: String,
    pub(crate) place: Place,
    /// Limits that are not written are infinite (URDF 1.2 and later), not zero.
    pub(crate) open_limits: bool,
    /// Macros of a file that calls none of them.
    pub(crate) idle_macros: Vec<String>,
    pub(crate) links: Vec<RawLink>,
    pub(crate) joints: Vec<RawJoint>,
    pub(crate) transmissions: Vec<RawTransmission>,
    /// Colours by material name.
    pub(crate) materials: HashMap<String, [f32; 4]>,
}

pub(crate) struct RawLink {
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) inertial: Option<RawInertial>,
    pub(crate) visuals: Vec<RawVisual>,
    /// Shapes of `<collision>` that can be read; what is wrong with others is not looked at.
    pub(crate) collisions: Vec<RawVisual>,
}

/// Mass and inertia about the centre of mass, in axes I; `X_LI` as written.
pub(crate) struct RawInertial {
    pub(crate) place: Place,
    pub(crate) X_LI: Pose,
    pub(crate) mass: f64,
    pub(crate) inertia_I: Matrix3<f64>,
    /// Some number could not be read: no further checks.
    pub(crate) faulty: bool,
}

pub(crate) struct RawVisual {
    pub(crate) place: Place,
    pub(crate) name: Option<String>,
    pub(crate) X_LV: Pose,
    pub(crate) geometry: RawGeometry,
    pub(crate) material: Option<String>,
    pub(crate) color: Option<[f32; 4]>,
}

pub(crate) enum RawGeometry {
    Mesh { uri: String, scale: Vector3<f64> },
    Box { size: Vector3<f64> },
    Cylinder { radius: f64, length: f64 },
    Sphere { radius: f64 },
}

pub(crate) struct RawJoint {
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) kind: RawKind,
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) X_PJ: Pose,
    pub(crate) axis: Option<(Vector3<f64>, Place)>,
    pub(crate) limit: Option<RawLimit>,
    pub(crate) mimic: Option<RawMimic>,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
    /// Some part could not be read: no further checks.
    pub(crate) faulty: bool,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum RawKind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    /// Not known or not supported, and reported.
    Other,
}

impl RawKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute => "revolute",
            Self::Continuous => "continuous",
            Self::Prismatic => "prismatic",
            Self::Other => "unsupported",
        }
    }
}

/// `None` where the attribute is missing.
pub(crate) struct RawLimit {
    pub(crate) place: Place,
    pub(crate) lower: Option<f64>,
    pub(crate) upper: Option<f64>,
    pub(crate) effort: Option<f64>,
    pub(crate) velocity: Option<f64>,
}

pub(crate) struct RawMimic {
    pub(crate) place: Place,
    pub(crate) joint: String,
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
}

pub(crate) struct RawTransmission {
    pub(crate) name: String,
    pub(crate) joints: Vec<String>,
    pub(crate) reduction: Option<f64>,
}
