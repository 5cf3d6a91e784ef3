//! Reads the tree of a URDF, and finds errors and doubtful places in it.
//!
//! Start at [`lint`]. All faults are reported together, with their places: missing or wrong values
//! are replaced by defaults or zeros, and reading continues. Only the elements and attributes that a
//! mechanism needs are read, without prefixes, and only the first of each element that may occur once.
//! A `<collision>` with a fault is omitted. Depth and size of the file do not matter: nothing recurses,
//! and there are at most [`MAX_ELEMENTS`] links and joints.
//!
//! Not here: conclusions from the values ([`crate::joints`] and others).

mod element;

use std::collections::HashMap;

use flexarm_kinematics::{Mimic, Pose};
use flexarm_settings::closest;
use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use crate::geometry::Geometry;
use crate::mesh::UpAxis;
use crate::place::TextPosition;
use crate::raw::{RawInertial, RawJoint, RawLink, RawMaterial, RawRobot, RawVisual};
use crate::report::{Report, did_you_mean};
use crate::transmission::transmission;
use crate::xml::{Lines, elements, named};
use element::Part;

/// Maximum number of links and joints of a robot; some checks compare every pair.
const MAX_ELEMENTS: usize = 4000;

const JOINT_TYPES: [&str; 7] = ["fixed", "revolute", "continuous", "prismatic", "floating", "planar", "spherical"];
/// Children of `<robot>`, `<link>` and `<joint>` that are URDF or a well-known extension.
const ROBOT_CHILDREN: &str =
    "link joint material transmission gazebo ros2_control sensor gripper mujoco plugin loop_joint verbose";
const LINK_CHILDREN: &str = "inertial visual collision contact self_collision_checking sensor gazebo material";
const JOINT_CHILDREN: &str =
    "origin parent child axis limit mimic dynamics calibration safety_controller physics hardwareInterface";

/// Attributes of `<limit>`; the last three are bounds since URDF 1.2.
const LIMITS: [&str; 7] = ["lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"];

/// Reads everything below `<robot>` and reports its faults. Returns `None` if the root is another element,
/// or there are too many links and joints.
pub(crate) fn lint(root: Node<'_, '_>, lines: &Lines<'_>, report: &mut Report) -> Option<RawRobot> {
    let place = lines.of(root);
    if root.tag_name().name() != "robot" {
        let root = root.tag_name().name();
        let help = match root {
            "sdf" => "this is an SDF file; export the robot as URDF",
            "mujoco" => "this is an MJCF file; export the robot as URDF",
            "COLLADA" => "this is a mesh; give the URDF that refers to it",
            _ => "give a URDF file",
        };
        report.error(&place, "not-urdf", format!("the root element is <{root}>, expected <robot>"), help);
        return None;
    }
    let found = elements(root).filter(|n| matches!(n.tag_name().name(), "link" | "joint")).count();
    if found > MAX_ELEMENTS {
        let message = format!("the robot has {found} links and joints, at most {MAX_ELEMENTS} are read");
        let help = "is this one robot? Arms have some dozens of links: leave out what does not move with it";
        report.error(&place, "too-many-elements", message, help);
        return None;
    }
    let version = version(root);
    let (quaternions, open_limits) = (version >= (1, 1), version >= (1, 2));
    let lint = Lint { lines, report, quaternions, open_limits, owner: "the robot".to_owned() };
    Some(lint.robot(root, place))
}

/// Value of the `version` attribute; 1.0 if it is missing.
fn version(root: Node<'_, '_>) -> (u32, u32) {
    root.attribute("version")
        .and_then(|v| v.trim().split_once('.'))
        .and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)))
        .unwrap_or((1, 0))
}

struct Lint<'a, 't> {
    lines: &'a Lines<'t>,
    report: &'a mut Report,
    /// Whether `quat_xyzw` is used (URDF 1.1 and later).
    quaternions: bool,
    /// Whether missing limits are infinite (URDF 1.2 and later) instead of zero.
    open_limits: bool,
    /// Name of the current robot, link or joint in messages.
    owner: String,
}

impl Lint<'_, '_> {
    fn robot(mut self, root: Node<'_, '_>, place: TextPosition) -> RawRobot {
        let (mut links, mut joints, mut transmissions) = (Vec::new(), Vec::new(), Vec::new());
        let mut materials = HashMap::new();
        let name = root.attribute("name").unwrap_or("").to_owned();
        if name.is_empty() {
            let message = "the robot has no name".to_owned();
            self.report.warning(&place, "no-robot-name", message, "write <robot name=\"...\">");
        }
        for node in elements(root) {
            match node.tag_name().name() {
                "link" => links.extend(self.link(node)),
                "joint" => joints.extend(self.joint(node)),
                "transmission" => transmissions.push(transmission(node)),
                "material" => {
                    materials.extend(self.material(node).and_then(|(name, color)| Some((name, color?))));
                }
                _ => self.known_element(node, ROBOT_CHILDREN),
            }
            self.owner.replace_range(.., "the robot");
        }
        // A material may be defined inside a visual and used by name elsewhere.
        let visuals = links.iter().flat_map(|link: &RawLink| &link.visuals);
        for (name, color) in visuals.filter_map(|visual| visual.material.as_ref()) {
            if let Some(color) = color {
                materials.entry(name.clone()).or_insert(*color);
            }
        }
        RawRobot { name, place, idle_macros: Vec::new(), links, joints, transmissions, materials }
    }

    fn link(&mut self, node: Node<'_, '_>) -> Option<RawLink> {
        let name = self.name(node)?;
        let all = |name: &'static str| elements(node).filter(move |n| n.tag_name().name() == name);
        let inertial = all("inertial").next().map(|n| self.inertial(n));
        if let Some(second) = all("inertial").nth(1) {
            let message = format!("{} has a second <inertial>, which is ignored", self.owner);
            self.report.warning(&self.lines.of(second), "second-inertial", message, "remove one of them");
        }
        let visuals = all("visual").filter_map(|n| self.shape(n)).collect();
        let heard = std::mem::take(self.report);
        let collisions = all("collision")
            .filter_map(|n| {
                let faults = self.report.issues.len();
                self.shape(n).filter(|_| self.report.issues.len() == faults)
            })
            .collect();
        *self.report = heard;
        elements(node).for_each(|n| self.known_element(n, LINK_CHILDREN));
        Some(RawLink { name, place: self.lines.of(node), inertial, visuals, collisions })
    }

    fn inertial(&mut self, node: Node<'_, '_>) -> RawInertial {
        let faults = self.report.issues.len();
        let X_LI = self.origin(node);
        let mass = self.needed(node, "mass");
        let mass = self.number(&mass, "value", None);
        let inertia = self.needed(node, "inertia");
        let [xx, xy, xz, yy, yz, zz] =
            ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|name| self.number(&inertia, name, None));
        let inertia_I = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        RawInertial { place: self.lines.of(node), X_LI, mass, inertia_I, faulty: self.report.issues.len() > faults }
    }

    /// Reads a `<visual>` or `<collision>`; `None` if it cannot be drawn.
    fn shape(&mut self, node: Node<'_, '_>) -> Option<RawVisual> {
        let X_LV = self.origin(node);
        let geometry = self.geometry(node);
        let material = named(node, "material").and_then(|material| self.material(material));
        let name = node.attribute("name").map(str::to_owned);
        Some(RawVisual { place: self.lines.of(node), X_LV, name, geometry: geometry?, material })
    }

    /// Reads `<geometry>`; `None` if it cannot be drawn.
    fn geometry(&mut self, node: Node<'_, '_>) -> Option<Geometry> {
        let geometry = self.needed(node, "geometry").node?;
        let Some(shape) = elements(geometry).next() else {
            let message = format!("{}, <geometry> has no <mesh>", self.owner);
            self.report.error(&self.lines.of(geometry), "missing-element", message, "add <mesh .../>");
            return None;
        };
        let faults = self.report.issues.len();
        let kind = shape.tag_name().name();
        let part = Part { node: Some(shape), owner: format!("{}, <{kind}>", self.owner) };
        let mut number = |attribute| self.number(&part, attribute, None);
        let (geometry, extent) = match kind {
            "mesh" => {
                let uri = self.required(&part, "filename").unwrap_or("").trim().to_owned();
                let scale = Vector3::from(self.numbers(&part, "scale", Some([1.0; 3])));
                // A negative scale mirrors.
                (Geometry::Mesh { uri, path: None, scale, up_axis: UpAxis::Declared }, scale.abs().min())
            }
            "box" => {
                let size = Vector3::from(self.numbers(&part, "size", None));
                (Geometry::Box { size }, size.min())
            }
            "cylinder" | "capsule" => {
                let (radius, length) = (number("radius"), number("length"));
                let geometry = match kind {
                    "cylinder" => Geometry::Cylinder { radius, length },
                    _ => Geometry::Capsule { radius, length },
                };
                (geometry, radius.min(length))
            }
            "sphere" => {
                let radius = number("radius");
                (Geometry::Sphere { radius }, radius)
            }
            _ => {
                let message = format!("{}, <{kind}>: this shape is not drawn", self.owner);
                let help = "shapes are mesh, box, cylinder, capsule and sphere";
                self.report.warning(&self.lines.of(shape), "unknown-shape", message, help);
                return None;
            }
        };
        if self.report.issues.len() > faults {
            return None;
        }
        if extent <= 0.0 {
            let message = format!("{}, <{kind}> has no extent and is not drawn", self.owner);
            self.report.warning(&self.lines.of(shape), "empty-shape", message, "give positive dimensions in metres");
            return None;
        }
        Some(geometry)
    }

    fn material(&mut self, node: Node<'_, '_>) -> Option<RawMaterial> {
        let name = node.attribute("name");
        let color = self.part(node, "color");
        let given = color.node.is_some_and(|color| color.has_attribute("rgba"));
        let color = given.then(|| self.numbers(&color, "rgba", Some([0.0; 4])).map(|v| v.clamp(0.0, 1.0) as f32));
        (name.is_some() || given).then(|| (name.unwrap_or("").to_owned(), color))
    }

    fn joint(&mut self, node: Node<'_, '_>) -> Option<RawJoint> {
        let faults = self.report.issues.len();
        let (name, place) = (self.name(node)?, self.lines.of(node));
        elements(node).for_each(|n| self.known_element(n, JOINT_CHILDREN));
        let kind = self.joint_type(node, &name);
        let [parent, child] = ["parent", "child"].map(|role| {
            let part = self.needed(node, role);
            self.name_in(&part, "link")
        });
        let X_PJ = self.origin(node);
        let axis = self.part(node, "axis");
        let axis_place = axis.node.map(|axis| self.lines.of(axis));
        let axis = self.numbers(&axis, "xyz", Some([1.0, 0.0, 0.0])).into();
        let limit = self.part(node, "limit");
        let limit = limit.node.map(|node| (self.lines.of(node), self.limits(&limit, node)));
        let mimic = self.part(node, "mimic");
        let mimic_place = mimic.node.map_or_else(|| place.clone(), |mimic| self.lines.of(mimic));
        let mimic = mimic.node.is_some().then(|| Mimic {
            joint: self.name_in(&mimic, "joint"),
            ratio: self.number(&mimic, "multiplier", Some(1.0)),
            offset: self.number(&mimic, "offset", Some(0.0)),
        });
        let second = elements(node).filter(|n| n.has_tag_name("mimic")).nth(1);
        if let Some(second) = second {
            let count = elements(node).filter(|n| n.has_tag_name("mimic")).count();
            let message = format!("joint {name:?} has {count} <mimic>; a joint follows one other joint");
            let help =
                "keep one; a joint that depends on several is driven by a motion of its own or belongs to a [[loop]]";
            self.report.error(&self.lines.of(second), "several-mimics", message, help);
        }
        let dynamics = self.part(node, "dynamics");
        let [damping, friction] = ["damping", "friction"].map(|name| self.number(&dynamics, name, Some(0.0)));
        let faulty = self.report.issues.len() > faults;
        Some(RawJoint {
            name,
            place,
            kind,
            parent,
            child,
            X_PJ,
            axis,
            axis_place,
            limit,
            mimic,
            mimic_place,
            damping,
            friction,
            faulty,
        })
    }

    /// Returns the values of `<limit>`, without a deceleration that of the acceleration. Warns about
    /// attributes of other names.
    fn limits(&mut self, limit: &Part<'_, '_>, node: Node<'_, '_>) -> [f64; 7] {
        for name in node.attributes().map(|attribute| attribute.name()).filter(|name| !LIMITS.contains(name)) {
            let message = format!("{}: the attribute {name:?} is not URDF and is ignored", limit.owner);
            let help = match closest(name, LIMITS) {
                Some(meant) => format!("did you mean {meant:?}?"),
                None => format!("remove it, or use one of {}", LIMITS.join(", ")),
            };
            self.report.warning(&self.lines.of(node), "unknown-attribute", message, help);
        }
        let given = LIMITS.map(|name| self.bound(limit, name));
        let (open, bound) = (f64::INFINITY, if self.open_limits { f64::INFINITY } else { 0.0 });
        let mut values = [-bound, bound, 0.0, 0.0, open, given[4].unwrap_or(open), open];
        for (value, given) in values.iter_mut().zip(given) {
            *value = given.unwrap_or(*value);
        }
        values
    }

    /// Returns the type; "floating" replaces all unsupported types.
    fn joint_type(&mut self, node: Node<'_, '_>, name: &str) -> &'static str {
        let part = Part { node: Some(node), owner: format!("{}, <joint>", self.owner) };
        let Some(found) = self.required(&part, "type") else { return "floating" };
        let place = self.lines.of(node);
        match JOINT_TYPES.into_iter().position(|kind| kind == found) {
            Some(k) if k < 4 => return JOINT_TYPES[k],
            Some(_) => {
                let message = format!("joint {name:?} is of type {found:?}, which is not supported");
                self.report.error(&place, "unsupported-joint", message, instead_of_joint(found));
            }
            None => {
                let message = format!("joint {name:?}: unknown type {found:?}");
                let types = "types are fixed, revolute, continuous and prismatic";
                let help = did_you_mean(closest(found, JOINT_TYPES), types);
                self.report.error(&place, "unknown-joint-type", message, help);
            }
        }
        "floating"
    }

    /// Reads `<origin>`: R = Rz(yaw) Ry(pitch) Rx(roll), or that of the quaternion.
    fn origin(&mut self, node: Node<'_, '_>) -> Pose {
        // Three zero angles would give a matrix with a negative zero; this is the exact identity.
        let Some(origin) = named(node, "origin") else { return Pose::identity() };
        let place = self.lines.of(origin);
        let part = Part { node: Some(origin), owner: format!("{}, <origin>", self.outer(node)) };
        let translation = Translation3::from(self.numbers(&part, "xyz", Some([0.0; 3])));
        let with_quaternion = origin.has_attribute("quat_xyzw");
        if with_quaternion && self.quaternions {
            let q = Quaternion::from(self.numbers(&part, "quat_xyzw", Some([0.0, 0.0, 0.0, 1.0])));
            let q = UnitQuaternion::try_new(q, 1e-12).unwrap_or_default();
            return Pose::from_parts(translation, q.to_rotation_matrix());
        }
        if with_quaternion {
            let message = format!("{}: quat_xyzw is ignored in a URDF before version 1.1", part.owner);
            self.report.warning(&place, "ignored-quaternion", message, "write <robot version=\"1.1\"> or rpy");
        }
        let [roll, pitch, yaw] = self.numbers(&part, "rpy", Some([0.0; 3]));
        let largest = roll.abs().max(pitch.abs()).max(yaw.abs());
        if largest > std::f64::consts::TAU + 1e-6 {
            let message =
                format!("{}: an angle of {largest} rad is more than a turn (about 57 times: degrees?)", part.owner);
            self.report.warning(&place, "angle", message, "angles of a URDF are in rad");
        }
        Pose::from_parts(translation, Rotation3::from_euler_angles(roll, pitch, yaw))
    }
}

/// Replacement for a joint type that is not supported.
fn instead_of_joint(kind: &str) -> &'static str {
    match kind {
        "floating" => {
            "the base is fixed here: make the joint fixed, or replace it by three prismatic and three revolute \
             joints in series"
        }
        "planar" => "replace it by two prismatic and one continuous joint in series",
        _ => "replace it by three revolute joints in series with links of small mass between",
    }
}
