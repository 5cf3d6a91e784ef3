//! Finds errors and doubtful places in the tree of a URDF, and writes the text that `urdf_rs`
//! reads.
//!
//! Start at [`lint`]. The values of a robot come from `urdf_rs`. It drops words of a vector that
//! are not numbers, treats a missing `<inertial>` as zeros, stops at the first fault and has no
//! line numbers. The lint reports such faults with their places. It then writes a [`PlainUrdf`]
//! text with the elements and attributes that a mechanism needs, as they are in the file, without
//! prefixes and with only the first of each element that may occur once. This has three reasons:
//!
//! * The parsers of `urdf_rs` recurse, and overflow the stack in a file of 100,000 nested elements.
//!   The plain text is five elements deep and has at most [`MAX_ELEMENTS`] links and joints,
//!   regardless of the file.
//! * All faults are reported together: missing or wrong values are replaced by zeros, and `urdf_rs`
//!   continues.
//! * `urdf_rs` rejects robots that are in use: a `<limit>` without velocity, an `<axis>` without
//!   `xyz`, a `<material>` without name, a `<color>` without `rgba`, an unknown shape, a second
//!   `<origin>`, an `<inertial>` between visuals, a `<safety_controller>` without `k_velocity`. The
//!   plain text has the default or omits the element. A `<collision>` with a fault is omitted.
//!
//! The model takes five things from the tree that `urdf_rs::Robot` does not contain: the places of
//! elements and whether they exist ([`OriginMark`]), the transmissions, the version (a bound that
//! URDF 1.2 leaves open is written as infinite, as `urdf_rs` does itself), `acceleration`,
//! `deceleration` and `jerk` of `<limit>`, which `urdf_rs` drops before version 1.2, and
//! `quat_xyzw`, which it converts to angles that are wrong by up to 0.3 degrees near a pitch of 90.
//!
//! Not here: conclusions from the values ([`crate::raw`] and beyond).

mod attribute;
mod element;
mod marks;

use flexarm_settings::{Place, closest};
use nalgebra::{Quaternion, UnitQuaternion};
use roxmltree::Node;

use crate::report::{Report, did_you_mean};
use crate::transmission::transmission;
use crate::xml::{Lines, elements, named};
use attribute::Attribute;
use attribute::Kind::{Bound, Name, Numbers, Text};
use attribute::Missing::{As, Fault, LeftOut};

pub(crate) use marks::{JointMarks, LinkMarks, OriginMark, PlainUrdf};

/// Maximum number of links and joints of a robot; some checks compare every pair.
const MAX_ELEMENTS: usize = 4000;

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

/// Bounds of `<limit>` since URDF 1.2.
pub(crate) const RATES: [&str; 3] = ["acceleration", "deceleration", "jerk"];

/// Reports the faults of everything below `<robot>`. Returns `None` if the root is another element,
/// or there are too many links and joints.
pub fn lint(root: Node<'_, '_>, lines: &Lines<'_>, report: &mut Report) -> Option<PlainUrdf> {
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
    // Newer versions of URDF have quaternions and joints without limits.
    let version = version(root);
    let (quaternions, open_limits) = (version >= (1, 1), version >= (1, 2));
    let lint = Lint { lines, report, quaternions, open_limits, owner: "the robot".to_owned(), text: String::new() };
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
    /// The plain text.
    text: String,
}

impl Lint<'_, '_> {
    fn robot(mut self, root: Node<'_, '_>, place: Place) -> PlainUrdf {
        let (mut links, mut joints, mut transmissions) = (Vec::new(), Vec::new(), Vec::new());
        let name = root.attribute("name").unwrap_or("");
        if name.is_empty() {
            let message = "the robot has no name".to_owned();
            self.report.warning(&place, "no-robot-name", message, "write <robot name=\"...\">");
        }
        self.start("robot", &[("name", name)]);
        for node in elements(root) {
            match node.tag_name().name() {
                "link" => links.extend(self.link(node)),
                "joint" => joints.extend(self.joint(node)),
                "transmission" => transmissions.push(transmission(node)),
                "material" => self.material(node),
                _ => self.known_element(node, &ROBOT_CHILDREN),
            }
            self.owner.replace_range(.., "the robot");
        }
        self.end("robot");
        PlainUrdf { text: self.text, place, links, joints, transmissions }
    }

    fn link(&mut self, node: Node<'_, '_>) -> Option<LinkMarks> {
        let name = self.name(node)?;
        self.start("link", &[("name", name)]);
        let all = |name: &'static str| elements(node).filter(move |n| n.tag_name().name() == name);
        // An element between visuals would split their list in two, which `urdf_rs` rejects.
        let inertial = all("inertial").next().map(|n| self.inertial(n));
        if let Some(second) = all("inertial").nth(1) {
            let message = format!("{} has a second <inertial>, which is ignored", self.owner);
            self.report.warning(&self.lines.of(second), "second-inertial", message, "remove one of them");
        }
        let visuals = all("visual").filter_map(|n| self.shape(n)).collect();
        // Faults of collisions are not reported.
        let kept = std::mem::take(self.report);
        let collisions = all("collision").filter_map(|n| self.shape(n)).collect();
        *self.report = kept;
        elements(node).for_each(|n| self.known_element(n, &LINK_CHILDREN));
        self.end("link");
        Some(LinkMarks { place: self.lines.of(node), inertial, visuals, collisions })
    }

    fn inertial(&mut self, node: Node<'_, '_>) -> OriginMark {
        let faults = self.report.issues.len();
        self.start("inertial", &[]);
        let quaternion = self.origin(node);
        self.child(node, "mass", true, &[("value", Numbers(1), Fault)]);
        let moment = |name| (name, Numbers(1), Fault);
        self.child(node, "inertia", true, &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(moment));
        self.end("inertial");
        OriginMark { place: self.lines.of(node), quaternion, faulty: self.report.issues.len() > faults }
    }

    /// Writes a `<visual>` or `<collision>`. Omits one that cannot be drawn, and a collision with
    /// any fault.
    fn shape(&mut self, node: Node<'_, '_>) -> Option<OriginMark> {
        let (faults, start, tag) = (self.report.issues.len(), self.text.len(), node.tag_name().name());
        let name = node.attribute("name").map(|name| ("name", name));
        self.start(tag, name.as_slice());
        let quaternion = self.origin(node);
        let drawn = self.geometry(node);
        if let Some(material) = named(node, "material") {
            self.material(material);
        }
        self.end(tag);
        let mark = OriginMark { place: self.lines.of(node), quaternion, faulty: self.report.issues.len() > faults };
        if !drawn || (mark.faulty && tag == "collision") {
            self.text.truncate(start);
            return None;
        }
        Some(mark)
    }

    /// Writes `<geometry>`; returns whether it can be drawn.
    fn geometry(&mut self, node: Node<'_, '_>) -> bool {
        let Some(geometry) = self.needed(node, "geometry") else { return false };
        let Some(shape) = elements(geometry).next() else {
            let message = format!("{}, <geometry> has no <mesh>", self.owner);
            self.report.error(&self.lines.of(geometry), "missing-element", message, "add <mesh .../>");
            return false;
        };
        let kind = shape.tag_name().name();
        let attributes: &[Attribute] = match kind {
            "mesh" => &[("filename", Text, Fault), ("scale", Numbers(3), LeftOut)],
            "box" => &[("size", Numbers(3), Fault)],
            "cylinder" | "capsule" => &[("radius", Numbers(1), Fault), ("length", Numbers(1), Fault)],
            "sphere" => &[("radius", Numbers(1), Fault)],
            _ => {
                let message = format!("{}, <{kind}>: this shape is not drawn", self.owner);
                let help = "shapes are mesh, box, cylinder, capsule and sphere";
                self.report.warning(&self.lines.of(shape), "unknown-shape", message, help);
                return false;
            }
        };
        let faults = self.report.issues.len();
        self.start("geometry", &[]);
        let numbers = self.element(shape, &format!("{}, <{kind}>", self.owner), attributes);
        self.end("geometry");
        // A negative scale mirrors.
        let extent = |x: &f64| if kind == "mesh" { x.abs() } else { *x };
        if numbers.iter().any(|x| extent(x) <= 0.0) {
            let message = format!("{}, <{kind}> has no extent and is not drawn", self.owner);
            self.report.warning(&self.lines.of(shape), "empty-shape", message, "give positive dimensions in metres");
            return false;
        }
        self.report.issues.len() == faults
    }

    fn material(&mut self, node: Node<'_, '_>) {
        let (name, color) = (node.attribute("name"), named(node, "color").filter(|color| color.has_attribute("rgba")));
        if name.is_none() && color.is_none() {
            return;
        }
        self.start("material", &[("name", name.unwrap_or(""))]);
        if color.is_some() {
            self.child(node, "color", false, &[("rgba", Numbers(4), LeftOut)]);
        }
        self.end("material");
    }

    fn joint(&mut self, node: Node<'_, '_>) -> Option<JointMarks> {
        let faults = self.report.issues.len();
        let name = self.name(node)?;
        elements(node).for_each(|n| self.known_element(n, &JOINT_CHILDREN));
        // Links and frame.
        let kind = self.joint_type(node, name);
        self.start("joint", &[("name", name), ("type", kind)]);
        self.child(node, "parent", true, &[("link", Name, Fault)]);
        self.child(node, "child", true, &[("link", Name, Fault)]);
        let quaternion = self.origin(node);
        // Axis and limits; `urdf_rs` needs all four bounds.
        let axis = self.child(node, "axis", false, &[("xyz", Numbers(3), As("1 0 0"))]);
        let (lower, upper) = if self.open_limits { ("-inf", "inf") } else { ("0", "0") };
        let bound = |name, missing| (name, Bound, As(missing));
        let limits = [bound("lower", lower), bound("upper", upper), bound("effort", "0"), bound("velocity", "0")];
        let limit = self.child(node, "limit", false, &limits);
        let rates = named(node, "limit").map_or([f64::INFINITY; 3], |limit| self.rates(limit));
        // Leader of a follower.
        let factors = [("joint", Name, Fault), ("multiplier", Numbers(1), LeftOut), ("offset", Numbers(1), LeftOut)];
        let mimic = self.child(node, "mimic", false, &factors);
        let mimics: Vec<_> = elements(node).filter(|n| n.has_tag_name("mimic")).collect();
        if let [_, second, ..] = mimics[..] {
            let message = format!("joint {name:?} has {} <mimic>; a joint follows one other joint", mimics.len());
            let help =
                "keep one; a joint that depends on several is driven by a motion of its own or belongs to a [[loop]]";
            self.report.error(&self.lines.of(second), "several-mimics", message, help);
        }
        let dynamics = [("damping", Numbers(1), LeftOut), ("friction", Numbers(1), LeftOut)];
        self.child(node, "dynamics", false, &dynamics);
        self.end("joint");
        let faulty = self.report.issues.len() > faults;
        let joint = OriginMark { place: self.lines.of(node), quaternion, faulty };
        Some(JointMarks { joint, axis, limit, rates, mimic })
    }

    /// Returns the bounds of `<limit>` that are new in URDF 1.2; without a deceleration that of the
    /// acceleration. Warns about attributes of other names.
    fn rates(&mut self, limit: Node<'_, '_>) -> [f64; 3] {
        const KNOWN: [&str; 7] = ["lower", "upper", "effort", "velocity", RATES[0], RATES[1], RATES[2]];
        let (place, owner) = (self.lines.of(limit), format!("{}, <limit>", self.owner));
        for name in limit.attributes().map(|attribute| attribute.name()).filter(|name| !KNOWN.contains(name)) {
            let message = format!("{owner}: the attribute {name:?} is not URDF and is ignored");
            let help = did_you_mean(closest(name, KNOWN), &format!("remove it, or use one of {}", KNOWN.join(", ")));
            self.report.warning(&place, "unknown-attribute", message, help);
        }
        let [acceleration, deceleration, jerk] = RATES.map(|attribute| {
            let found = limit.attribute(attribute)?;
            let bound = Bound.numbers(found);
            if bound.is_none() {
                self.not_a_number(&place, &owner, attribute, found, Bound.expected());
            }
            bound?.first().copied()
        });
        let open = f64::INFINITY;
        [acceleration.unwrap_or(open), deceleration.or(acceleration).unwrap_or(open), jerk.unwrap_or(open)]
    }

    /// Returns the type for `urdf_rs`; "floating" replaces all unsupported types.
    fn joint_type<'n>(&mut self, node: Node<'n, '_>, name: &str) -> &'n str {
        let owner = format!("{}, <joint>", self.owner);
        let Some(found) = self.required(node, &owner, "type", Text) else { return "floating" };
        let place = self.lines.of(node);
        if ["fixed", "revolute", "continuous", "prismatic"].contains(&found) {
            return found;
        }
        if JOINT_TYPES.contains(&found) {
            let message = format!("joint {name:?} is of type {found:?}, which is not supported");
            self.report.error(&place, "unsupported-joint", message, instead_of_joint(found));
        } else {
            let message = format!("joint {name:?}: unknown type {found:?}");
            let types = "types are fixed, revolute, continuous and prismatic";
            let help = did_you_mean(closest(found, JOINT_TYPES), types);
            self.report.error(&place, "unknown-joint-type", message, help);
        }
        "floating"
    }

    /// Writes `<origin>`; returns its rotation if it is not given by `rpy`.
    fn origin(&mut self, node: Node<'_, '_>) -> Option<UnitQuaternion<f64>> {
        // Three zero angles would give a matrix with a negative zero; this is the exact identity.
        let Some(origin) = named(node, "origin") else { return Some(UnitQuaternion::identity()) };
        let place = self.lines.of(origin);
        let owner = format!("{}, <origin>", self.outer(node));
        if let Some(found) = origin.attribute("quat_xyzw").filter(|_| self.quaternions) {
            self.element(origin, &owner, &[("xyz", Numbers(3), LeftOut)]);
            let Some(q) = Numbers(4).numbers(found) else {
                self.not_a_number(&place, &owner, "quat_xyzw", found, "four numbers");
                return None;
            };
            let q = UnitQuaternion::try_new(Quaternion::new(q[3], q[0], q[1], q[2]), 1e-12);
            return Some(q.unwrap_or_default());
        }
        if origin.has_attribute("quat_xyzw") {
            let message = format!("{owner}: quat_xyzw is ignored in a URDF before version 1.1");
            self.report.warning(&place, "ignored-quaternion", message, "write <robot version=\"1.1\"> or rpy");
        }
        self.element(origin, &owner, &[("xyz", Numbers(3), LeftOut), ("rpy", Numbers(3), LeftOut)]);
        let rpy = origin.attribute("rpy").and_then(|rpy| Numbers(3).numbers(rpy)).unwrap_or_default();
        let largest = rpy.iter().fold(0.0, |largest: f64, angle| largest.max(angle.abs()));
        if largest > std::f64::consts::TAU + 1e-6 {
            let message = format!("{owner}: an angle of {largest} rad is more than a turn (about 57 times: degrees?)");
            self.report.warning(&place, "angle", message, "angles of a URDF are in rad");
        }
        None
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
