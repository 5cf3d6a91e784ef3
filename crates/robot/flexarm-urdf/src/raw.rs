//! Converts the values of `urdf_rs` to frames and matrices, and joins them with the marks of the
//! lint. Start at [`read_robot`].
//!
//! Not here: conclusions from the values ([`crate::joints`], [`crate::inertia`],
//! [`crate::shapes`]).

use std::collections::HashMap;

use flexarm_kinematics::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3};
use roxmltree::Node;
use urdf_rs::JointType;

use crate::lint::{JointMarks, OriginMark, PlainUrdf, lint};
use crate::report::Report;
use crate::transmission::Transmission;
use crate::xml::Lines;
use flexarm_settings::Place;

pub(crate) struct RawRobot {
    pub(crate) name: String,
    pub(crate) place: Place,
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
    pub(crate) place: Place,
    pub(crate) inertial: Option<RawInertial>,
    pub(crate) visuals: Vec<RawVisual>,
    /// Shapes of readable `<collision>` elements; faults of others are not reported.
    pub(crate) collisions: Vec<RawVisual>,
}

/// Mass and inertia about the centre of mass, in axes I; `X_LI` as written.
pub(crate) struct RawInertial {
    pub(crate) place: Place,
    pub(crate) X_LI: Pose,
    pub(crate) mass: f64,
    pub(crate) inertia_I: Matrix3<f64>,
    /// Whether some number could not be read; disables further checks.
    pub(crate) faulty: bool,
}

pub(crate) struct RawVisual {
    pub(crate) place: Place,
    pub(crate) X_LV: Pose,
    /// Visual, or a collision converted to a visual without material.
    pub(crate) urdf: urdf_rs::Visual,
}

pub(crate) struct RawJoint {
    pub(crate) urdf: urdf_rs::Joint,
    pub(crate) X_PJ: Pose,
    pub(crate) place: Place,
    /// Place of `<axis>`; `None` if it is missing and `urdf` has the default.
    pub(crate) axis: Option<Place>,
    /// Place of `<limit>`; `None` if it is missing and `urdf` has zeros.
    pub(crate) limit: Option<Place>,
    /// Acceleration, deceleration and jerk of `<limit>`; infinite if not given.
    pub(crate) rates: [f64; 3],
    /// Place of `<mimic>`, or of the joint if there is none.
    pub(crate) mimic: Place,
    /// Whether some part could not be read; disables further checks.
    pub(crate) faulty: bool,
}

impl RawJoint {
    pub(crate) fn is_fixed(&self) -> bool {
        self.urdf.joint_type == JointType::Fixed
    }
}

/// Reads everything below `<robot>`. Returns `None` if the lint or `urdf_rs` rejects the text.
pub(crate) fn read_robot(root: Node<'_, '_>, lines: &Lines<'_>, report: &mut Report) -> Option<RawRobot> {
    let plain = lint(root, lines, report)?;
    let fits = |urdf: &urdf_rs::Robot| urdf.links.len() == plain.links.len() && urdf.joints.len() == plain.joints.len();
    match urdf_rs::read_from_string(&plain.text) {
        Ok(urdf) if fits(&urdf) => return Some(RawRobot::new(urdf, plain)),
        Ok(_) => not_read(&plain.place, &"it sees other links and joints", report),
        Err(error) => not_read(&plain.place, &error, report),
    }
    None
}

/// Reports that `urdf_rs` rejects a robot without a fault.
fn not_read(place: &Place, reason: &dyn std::fmt::Display, report: &mut Report) {
    let help = "please report it with the file; do names hold unusual characters?";
    report.error(place, "not-read", format!("urdf-rs does not read this robot: {reason}"), help);
}

impl RawRobot {
    fn new(urdf: urdf_rs::Robot, plain: PlainUrdf) -> Self {
        // A material may be defined inside a visual and used by name elsewhere.
        let of_visuals = urdf.links.iter().flat_map(|l| &l.visual).filter_map(|v| v.material.as_ref()).rev();
        let all = of_visuals.chain(&urdf.materials);
        let materials = all.filter_map(|m| Some((m.name.clone(), color(m)?))).collect();
        let links = urdf.links.into_iter().zip(plain.links).map(|(urdf, marks)| {
            let collision = |c: urdf_rs::Collision| {
                let urdf_rs::Collision { name, origin, geometry } = c;
                urdf_rs::Visual { name, origin, geometry, material: None }
            };
            RawLink {
                name: urdf.name,
                place: marks.place,
                inertial: marks.inertial.map(|mark| RawInertial::new(&urdf.inertial, mark)),
                visuals: shapes(urdf.visual.into_iter(), marks.visuals),
                collisions: shapes(urdf.collision.into_iter().map(collision), marks.collisions),
            }
        });
        let joints = urdf.joints.into_iter().zip(plain.joints).map(|(urdf, marks)| {
            let JointMarks { joint, axis, limit, rates, mimic } = marks;
            let (X_PJ, mimic) = (pose(&urdf.origin, &joint), mimic.unwrap_or_else(|| joint.place.clone()));
            RawJoint { urdf, X_PJ, place: joint.place, axis, limit, rates, mimic, faulty: joint.faulty }
        });
        Self {
            name: urdf.name,
            place: plain.place,
            idle_macros: Vec::new(),
            links: links.collect(),
            joints: joints.collect(),
            transmissions: plain.transmissions,
            materials,
        }
    }
}

impl RawInertial {
    fn new(urdf: &urdf_rs::Inertial, mark: OriginMark) -> Self {
        let i = &urdf.inertia;
        let inertia_I = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
        let X_LI = pose(&urdf.origin, &mark);
        Self { X_LI, mass: urdf.mass.value, inertia_I, place: mark.place, faulty: mark.faulty }
    }
}

fn shapes(urdf: impl Iterator<Item = urdf_rs::Visual>, marks: Vec<OriginMark>) -> Vec<RawVisual> {
    urdf.zip(marks).map(|(urdf, mark)| RawVisual { X_LV: pose(&urdf.origin, &mark), place: mark.place, urdf }).collect()
}

/// Returns the pose of `<origin xyz rpy>`: R = Rz(yaw) Ry(pitch) Rx(roll).
fn pose(origin: &urdf_rs::Pose, mark: &OriginMark) -> Pose {
    let [roll, pitch, yaw] = *origin.rpy;
    let rotation = match mark.quaternion {
        Some(quaternion) => quaternion.to_rotation_matrix(),
        None => Rotation3::from_euler_angles(roll, pitch, yaw),
    };
    let [x, y, z] = *origin.xyz;
    Pose::from_parts(Translation3::new(x, y, z), rotation)
}

/// Returns the colour of a material, each part from 0 to 1.
pub(crate) fn color(material: &urdf_rs::Material) -> Option<[f32; 4]> {
    material.color.as_ref().map(|color| color.rgba.map(|v| v.clamp(0.0, 1.0) as f32))
}
