//! Values of a URDF as they are written, with their places. [`crate::lint`] reads them.
//!
//! Not here: conclusions from the values ([`crate::joints`], [`crate::inertia`],
//! [`crate::shapes`]).

use std::collections::HashMap;

use flexarm_kinematics::{Mimic, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::geometry::Geometry;
use crate::place::TextPosition;
use crate::transmission::Transmission;

pub(crate) struct RawRobot {
    pub(crate) name: String,
    pub(crate) place: TextPosition,
    /// Macros defined in a file that calls none of them.
    pub(crate) idle_macros: Vec<String>,
    pub(crate) links: Vec<RawLink>,
    pub(crate) joints: Vec<RawJoint>,
    pub(crate) transmissions: Vec<Transmission>,
    /// Colours by material name.
    pub(crate) materials: HashMap<String, [f32; 4]>,
}

pub(crate) struct RawLink {
    pub(crate) name: String,
    pub(crate) place: TextPosition,
    pub(crate) inertial: Option<RawInertial>,
    pub(crate) visuals: Vec<RawVisual>,
    /// Shapes of readable `<collision>` elements; faults of others are not reported.
    pub(crate) collisions: Vec<RawVisual>,
}

/// Mass and inertia about the centre of mass, in axes I; `X_LI` as written.
pub(crate) struct RawInertial {
    pub(crate) place: TextPosition,
    pub(crate) X_LI: Pose,
    pub(crate) mass: f64,
    pub(crate) inertia_I: Matrix3<f64>,
    /// Whether some number could not be read; disables further checks.
    pub(crate) faulty: bool,
}

/// A `<visual>` or `<collision>`.
pub(crate) struct RawVisual {
    pub(crate) place: TextPosition,
    pub(crate) X_LV: Pose,
    pub(crate) name: Option<String>,
    /// A mesh has no path yet.
    pub(crate) geometry: Geometry,
    pub(crate) material: Option<RawMaterial>,
}

/// Name of a material, empty if it has none, and its colour, each part from 0 to 1.
pub(crate) type RawMaterial = (String, Option<[f32; 4]>);

pub(crate) struct RawJoint {
    pub(crate) name: String,
    pub(crate) place: TextPosition,
    /// "fixed", "revolute", "continuous", "prismatic" or, for all other types, "floating".
    pub(crate) kind: &'static str,
    /// Name of the parent link; empty if it is missing.
    pub(crate) parent: String,
    /// Name of the child link; empty if it is missing.
    pub(crate) child: String,
    pub(crate) X_PJ: Pose,
    pub(crate) axis: Vector3<f64>,
    /// Place of `<axis>`; `None` if it is missing and the axis is x.
    pub(crate) axis_place: Option<TextPosition>,
    /// `<limit>` and its place: lower, upper, effort, velocity, acceleration, deceleration, jerk.
    pub(crate) limit: Option<(TextPosition, [f64; 7])>,
    pub(crate) mimic: Option<Mimic>,
    /// Place of `<mimic>`, or of the joint if there is none.
    pub(crate) mimic_place: TextPosition,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
    /// Whether some part could not be read; disables further checks.
    pub(crate) faulty: bool,
}

impl RawJoint {
    pub(crate) fn is_fixed(&self) -> bool {
        self.kind == "fixed"
    }
}
