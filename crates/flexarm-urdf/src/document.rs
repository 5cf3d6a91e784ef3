//! The elements of a URDF with their places, read strictly and to the end, whatever is wrong on the way.
//!
//! Every fault goes to the [`Report`]; an element with a fault is kept as far as it could be read and marked
//! `faulty`, so that no second fault follows from the first. Start at [`read_document`].
//!
//! `urdf_rs` cannot stand here: it drops the words of a vector that are no numbers, takes a missing
//! `<inertial>` or `<limit>` for zeros, and has no positions. It is asked at the end, as a second reader ([`crate::second_reader`]).
//! Not here: the tree ([`crate::tree`]), physics ([`crate::inertia`]).

use std::collections::HashMap;

use flexarm_kinematics::Pose;
use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use crate::error::Problem;
use crate::finding::Place;
use crate::raw::{
    RawGeometry, RawInertial, RawJoint, RawKind, RawLimit, RawLink, RawMimic, RawRobot, RawTransmission, RawVisual,
};
use crate::report::Report;
use crate::spelling::closest;
use crate::xml::Lines;

/// Most links and joints of a robot: checks compare each with each.
const MOST_ELEMENTS: usize = 4000;

const JOINT_TYPES: [&str; 7] = ["fixed", "revolute", "continuous", "prismatic", "floating", "planar", "spherical"];
/// Children of `<robot>`, `<link>` and `<joint>` that are URDF or a well-known extension.
const ROBOT_CHILDREN: [&str; 12] = [
    "link",
    "joint",
    "material",
    "transmission",
    "gazebo",
    "ros2_control",
    "sensor",
    "gripper",
    "mujoco",
    "plugin",
    "loop_joint",
    "verbose",
];
const LINK_CHILDREN: [&str; 8] =
    ["inertial", "visual", "collision", "contact", "self_collision_checking", "sensor", "gazebo", "material"];
const JOINT_CHILDREN: [&str; 11] = [
    "origin",
    "parent",
    "child",
    "axis",
    "limit",
    "mimic",
    "dynamics",
    "calibration",
    "safety_controller",
    "physics",
    "hardwareInterface",
];

/// Reads everything below `<robot>`; `None` if the root is another element.
pub(crate) fn read_document(root: Node<'_, '_>, lines: &Lines<'_>, report: &mut Report) -> Option<RawRobot> {
    let mut reader = Reader { lines, report, quaternions: false };
    let place = lines.of(root);
    if root.tag_name().name() != "robot" {
        reader.report.error(&place, Problem::NotUrdf { root: root.tag_name().name().to_owned() });
        return None;
    }
    let found = elements(root).filter(|n| matches!(n.tag_name().name(), "link" | "joint")).count();
    if found > MOST_ELEMENTS {
        reader.report.error(&place, Problem::TooManyElements { found, most: MOST_ELEMENTS });
        return None;
    }
    reader.quaternions = version(root) >= (1, 1);
    Some(reader.robot(root, place))
}

/// The `version` attribute; URDF without one is 1.0.
fn version(root: Node<'_, '_>) -> (u32, u32) {
    root.attribute("version")
        .and_then(|v| v.trim().split_once('.'))
        .and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)))
        .unwrap_or((1, 0))
}

struct Reader<'a, 't> {
    lines: &'a Lines<'t>,
    report: &'a mut Report,
    /// `quat_xyzw` counts (URDF 1.1 and later).
    quaternions: bool,
}

impl Reader<'_, '_> {
    fn robot(&mut self, root: Node<'_, '_>, place: Place) -> RawRobot {
        let mut robot = RawRobot {
            name: root.attribute("name").unwrap_or("").to_owned(),
            place: place.clone(),
            open_limits: version(root) >= (1, 2),
            idle_macros: Vec::new(),
            links: Vec::new(),
            joints: Vec::new(),
            transmissions: Vec::new(),
            materials: HashMap::new(),
        };
        if robot.name.is_empty() {
            let message = "the robot has no name".to_owned();
            self.report.warning(&place, "no-robot-name", message, "write <robot name=\"...\">");
        }
        for node in elements(root) {
            match node.tag_name().name() {
                "link" => robot.links.extend(self.link(node)),
                "joint" => robot.joints.extend(self.joint(node)),
                "transmission" => robot.transmissions.push(self.transmission(node)),
                "material" => {
                    if let (Some(name), Some(color)) = (node.attribute("name"), self.color(node)) {
                        robot.materials.insert(name.to_owned(), color);
                    }
                }
                name => self.unknown_element(node, name, "the robot", &ROBOT_CHILDREN),
            }
        }
        // A material may also be defined once inside a visual and used by name elsewhere.
        for visual in robot.links.iter().flat_map(|l| &l.visuals) {
            if let (Some(name), Some(color)) = (&visual.material, visual.color) {
                robot.materials.entry(name.clone()).or_insert(color);
            }
        }
        robot
    }

    fn link(&mut self, node: Node<'_, '_>) -> Option<RawLink> {
        let place = self.lines.of(node);
        let name = self.required(node, "<link>", "name")?.to_owned();
        let owner = format!("link {name:?}");
        let mut inertial = None;
        let (mut visuals, mut collisions) = (Vec::new(), Vec::new());
        for child in elements(node) {
            match child.tag_name().name() {
                "inertial" if inertial.is_some() => {
                    let place = self.lines.of(child);
                    let message = format!("{owner} has a second <inertial>, which is ignored");
                    self.report.warning(&place, "second-inertial", message, "remove one of them");
                }
                "inertial" => inertial = Some(self.inertial(child, &owner)),
                "visual" => visuals.extend(self.visual(child, &owner)),
                "collision" => {
                    let mut unheard = Report::default();
                    let mut reader = Reader { lines: self.lines, report: &mut unheard, quaternions: self.quaternions };
                    let shape = reader.visual(child, &owner);
                    collisions.extend(shape.filter(|_| unheard.issues.is_empty()));
                }
                name => self.unknown_element(child, name, &owner, &LINK_CHILDREN),
            }
        }
        Some(RawLink { name, place, inertial, visuals, collisions })
    }

    fn inertial(&mut self, node: Node<'_, '_>, link: &str) -> RawInertial {
        let faults = self.report.issues.len();
        let owner = format!("{link}, <inertial>");
        let X_LI = self.origin(node, &owner);
        let mass = self.child(node, &owner, "mass").and_then(|m| self.number(m, &format!("{link}, <mass>"), "value"));
        let mut inertia_I = Matrix3::zeros();
        if let Some(inertia) = self.child(node, &owner, "inertia") {
            let owner = format!("{link}, <inertia>");
            let entries = [("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2)];
            for (name, i, j) in entries {
                let value = self.number(inertia, &owner, name).unwrap_or(0.0);
                inertia_I[(i, j)] = value;
                inertia_I[(j, i)] = value;
            }
        }
        RawInertial {
            place: self.lines.of(node),
            X_LI,
            mass: mass.unwrap_or(0.0),
            inertia_I,
            faulty: self.report.issues.len() > faults,
        }
    }

    fn visual(&mut self, node: Node<'_, '_>, link: &str) -> Option<RawVisual> {
        let owner = format!("{link}, <visual>");
        let X_LV = self.origin(node, &owner);
        let geometry = self.child(node, &owner, "geometry").and_then(|g| self.geometry(g, link));
        let material = named(node, "material");
        let color = material.and_then(|m| self.color(m));
        Some(RawVisual {
            place: self.lines.of(node),
            name: node.attribute("name").map(str::to_owned),
            X_LV,
            geometry: geometry?,
            material: material.and_then(|m| m.attribute("name")).map(str::to_owned),
            color,
        })
    }

    fn geometry(&mut self, node: Node<'_, '_>, link: &str) -> Option<RawGeometry> {
        let Some(shape) = elements(node).next() else {
            let owner = format!("{link}, <geometry>");
            self.report.error(&self.lines.of(node), Problem::MissingElement { owner, element: "mesh" });
            return None;
        };
        let kind = shape.tag_name().name();
        let owner = format!("{link}, <{kind}>");
        let geometry = match kind {
            "mesh" => {
                let uri = self.required(shape, &owner, "filename")?.trim().to_owned();
                let scale = self.vector(shape, &owner, "scale", Vector3::repeat(1.0));
                RawGeometry::Mesh { uri, scale }
            }
            "box" => {
                self.required(shape, &owner, "size")?;
                RawGeometry::Box { size: self.vector(shape, &owner, "size", Vector3::zeros()) }
            }
            "cylinder" => RawGeometry::Cylinder {
                radius: self.number(shape, &owner, "radius")?,
                length: self.number(shape, &owner, "length")?,
            },
            "sphere" => RawGeometry::Sphere { radius: self.number(shape, &owner, "radius")? },
            _ => {
                let message = format!("{owner}: this shape is not drawn");
                let help = "shapes are mesh, box, cylinder and sphere";
                self.report.warning(&self.lines.of(shape), "unknown-shape", message, help);
                return None;
            }
        };
        let extent = match &geometry {
            RawGeometry::Mesh { scale, .. } => scale.abs().min(),
            RawGeometry::Box { size } => size.min(),
            RawGeometry::Cylinder { radius, length } => radius.min(*length),
            RawGeometry::Sphere { radius } => *radius,
        };
        if extent <= 0.0 {
            let message = format!("{owner} has no extent and is not drawn");
            self.report.warning(&self.lines.of(shape), "empty-shape", message, "give positive dimensions in metres");
            return None;
        }
        Some(geometry)
    }

    fn color(&mut self, material: Node<'_, '_>) -> Option<[f32; 4]> {
        let color = named(material, "color")?;
        let numbers = self.numbers::<4>(color, "<color>", "rgba", "four numbers from 0 to 1")?;
        Some(numbers.map(|v| v.clamp(0.0, 1.0) as f32))
    }

    fn joint(&mut self, node: Node<'_, '_>) -> Option<RawJoint> {
        let place = self.lines.of(node);
        let faults = self.report.issues.len();
        let name = self.required(node, "<joint>", "name")?.to_owned();
        let owner = format!("joint {name:?}");
        for child in elements(node) {
            let child_name = child.tag_name().name();
            if !JOINT_CHILDREN.contains(&child_name) {
                self.unknown_element(child, child_name, &owner, &JOINT_CHILDREN);
            }
        }

        let kind = self.joint_kind(node, &owner, &name);
        let parent = self.child(node, &owner, "parent").and_then(|p| self.required(p, &owner, "link"));
        let child = self.child(node, &owner, "child").and_then(|c| self.required(c, &owner, "link"));
        let X_PJ = self.origin(node, &owner);
        let axis = named(node, "axis").map(|a| {
            let axis_owner = format!("{owner}, <axis>");
            (self.vector(a, &axis_owner, "xyz", Vector3::x()), self.lines.of(a))
        });
        let limit = named(node, "limit").map(|l| self.limit(l, &owner));
        let mimic = named(node, "mimic").and_then(|m| self.mimic(m, &owner));
        let dynamics = named(node, "dynamics");
        let mut coefficient = |attribute| {
            let node = dynamics.filter(|d| d.has_attribute(attribute))?;
            self.number(node, &format!("{owner}, <dynamics>"), attribute)
        };
        let damping = coefficient("damping").unwrap_or(0.0);
        let friction = coefficient("friction").unwrap_or(0.0);
        Some(RawJoint {
            name,
            place,
            kind,
            parent: parent.unwrap_or("").to_owned(),
            child: child.unwrap_or("").to_owned(),
            X_PJ,
            axis,
            limit,
            mimic,
            damping,
            friction,
            faulty: self.report.issues.len() > faults,
        })
    }

    fn joint_kind(&mut self, node: Node<'_, '_>, owner: &str, name: &str) -> RawKind {
        let Some(found) = self.required(node, owner, "type") else { return RawKind::Other };
        let joint = name.to_owned();
        let problem = match found {
            "fixed" => return RawKind::Fixed,
            "revolute" => return RawKind::Revolute,
            "continuous" => return RawKind::Continuous,
            "prismatic" => return RawKind::Prismatic,
            kind if JOINT_TYPES.contains(&kind) => Problem::UnsupportedJoint { joint, kind: kind.to_owned() },
            _ => Problem::UnknownJointType { joint, found: found.to_owned(), closest: closest(found, JOINT_TYPES) },
        };
        self.report.error(&self.lines.of(node), problem);
        RawKind::Other
    }

    fn limit(&mut self, node: Node<'_, '_>, joint: &str) -> RawLimit {
        let owner = format!("{joint}, <limit>");
        let mut bound = |attribute| {
            let text = node.attribute(attribute)?;
            match text.trim().parse::<f64>() {
                // "inf" is how newer URDF says: no limit
                Ok(value) if !value.is_nan() => Some(value),
                _ => {
                    let (owner, found) = (owner.clone(), text.to_owned());
                    let problem = Problem::NotANumber { owner, attribute, found, expected: "a number" };
                    self.report.error(&self.lines.of(node), problem);
                    None
                }
            }
        };
        RawLimit {
            lower: bound("lower"),
            upper: bound("upper"),
            effort: bound("effort"),
            velocity: bound("velocity"),
            place: self.lines.of(node),
        }
    }

    fn mimic(&mut self, node: Node<'_, '_>, joint: &str) -> Option<RawMimic> {
        let owner = format!("{joint}, <mimic>");
        let leader = self.required(node, &owner, "joint")?.to_owned();
        let mut factor = |attribute, default| {
            if node.has_attribute(attribute) { self.number(node, &owner, attribute) } else { Some(default) }
        };
        let (ratio, offset) = (factor("multiplier", 1.0), factor("offset", 0.0));
        Some(RawMimic { place: self.lines.of(node), joint: leader, ratio: ratio?, offset: offset? })
    }

    fn transmission(&mut self, node: Node<'_, '_>) -> RawTransmission {
        let joints = elements(node).filter(|n| n.tag_name().name() == "joint");
        let reduction = node.descendants().find(|n| n.tag_name().name() == "mechanicalReduction");
        RawTransmission {
            name: node.attribute("name").unwrap_or("").to_owned(),
            joints: joints.filter_map(|j| j.attribute("name")).map(str::to_owned).collect(),
            reduction: reduction.and_then(|r| r.text()).and_then(|t| t.trim().parse().ok()),
        }
    }

    /// `<origin xyz rpy>`: R = Rz(yaw) Ry(pitch) Rx(roll).
    fn origin(&mut self, node: Node<'_, '_>, owner: &str) -> Pose {
        let Some(origin) = named(node, "origin") else { return Pose::identity() };
        let owner = format!("{owner}, <origin>");
        let xyz = self.vector(origin, &owner, "xyz", Vector3::zeros());
        let rotation = if self.quaternions && origin.has_attribute("quat_xyzw") {
            let q = self.numbers::<4>(origin, &owner, "quat_xyzw", "four numbers").unwrap_or([0.0, 0.0, 0.0, 1.0]);
            let q = UnitQuaternion::try_new(Quaternion::new(q[3], q[0], q[1], q[2]), 1e-12).unwrap_or_default();
            q.to_rotation_matrix()
        } else {
            let rpy = self.vector(origin, &owner, "rpy", Vector3::zeros());
            let largest = rpy.amax();
            if largest > std::f64::consts::TAU + 1e-6 {
                let message =
                    format!("{owner}: an angle of {largest} rad is more than a turn (about 57 times: degrees?)");
                self.report.warning(&self.lines.of(origin), "angle", message, "angles of a URDF are in rad");
            }
            Rotation3::from_euler_angles(rpy.x, rpy.y, rpy.z)
        };
        Pose::from_parts(Translation3::from(xyz), rotation)
    }

    /// A child element that must be there.
    fn child<'n, 'i>(&mut self, node: Node<'n, 'i>, owner: &str, element: &'static str) -> Option<Node<'n, 'i>> {
        let child = named(node, element);
        if child.is_none() {
            let owner = owner.to_owned();
            self.report.error(&self.lines.of(node), Problem::MissingElement { owner, element });
        }
        child
    }

    /// An attribute that must be there.
    fn required<'n>(&mut self, node: Node<'n, '_>, owner: &str, attribute: &'static str) -> Option<&'n str> {
        // An empty name is none.
        let value = node.attribute(attribute).filter(|value| attribute != "name" || !value.trim().is_empty());
        if value.is_none() {
            let owner = if owner.starts_with('<') || owner.contains(", <") {
                owner.to_owned()
            } else {
                format!("{owner}, <{}>", node.tag_name().name())
            };
            self.report.error(&self.lines.of(node), Problem::MissingAttribute { owner, attribute });
        }
        value
    }

    /// One finite number that must be there.
    fn number(&mut self, node: Node<'_, '_>, owner: &str, attribute: &'static str) -> Option<f64> {
        self.required(node, owner, attribute)?;
        self.numbers::<1>(node, owner, attribute, "a finite number").map(|[value]| value)
    }

    /// Three finite numbers, or the default where the attribute is missing.
    fn vector(
        &mut self,
        node: Node<'_, '_>,
        owner: &str,
        attribute: &'static str,
        default: Vector3<f64>,
    ) -> Vector3<f64> {
        if !node.has_attribute(attribute) {
            return default;
        }
        self.numbers::<3>(node, owner, attribute, "three finite numbers").map_or(default, Vector3::from)
    }

    fn numbers<const N: usize>(
        &mut self,
        node: Node<'_, '_>,
        owner: &str,
        attribute: &'static str,
        expected: &'static str,
    ) -> Option<[f64; N]> {
        let text = node.attribute(attribute)?;
        let values: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        let values = values.ok().filter(|v| v.iter().all(|x| x.is_finite()));
        let values = values.and_then(|v| <[f64; N]>::try_from(v).ok());
        if values.is_none() {
            let (owner, found) = (owner.to_owned(), text.to_owned());
            self.report.error(&self.lines.of(node), Problem::NotANumber { owner, attribute, found, expected });
        }
        values
    }

    /// An element that is neither URDF nor a known extension is probably misspelt.
    fn unknown_element(&mut self, node: Node<'_, '_>, name: &str, owner: &str, known: &[&'static str]) {
        if node.tag_name().namespace().is_some() || known.contains(&name) {
            return;
        }
        let help = match closest(name, known.iter().copied()) {
            Some(meant) => format!("did you mean <{meant}>?"),
            None => format!("remove it, or use one of {}", known.join(", ")),
        };
        let message = format!("{owner}: the element <{name}> is not URDF and is ignored");
        self.report.warning(&self.lines.of(node), "unknown-element", message, help);
    }
}

fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

fn named<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    elements(node).find(|n| n.tag_name().name() == name)
}
