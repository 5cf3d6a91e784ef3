//! URDF with a joint for each elastic coordinate, between links without mass.
//!
//! SI units; inertias about centres of mass, in link axes. Not here: springs and dampers, which URDF
//! does not have (`springs.json`, see `springs.rs`).

use std::fmt::Write as _;

use flexarm_kinematics::{Limits, Pose};
use flexarm_settings::written::markup;

use super::numbers;
use super::parts::{Axis, MESHES, Part};
use crate::poses::posed::Posed;
use crate::robot::Robot;

pub(super) fn text(robot: &Robot, posed: &Posed, parts: &[Part]) -> String {
    let mut out = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\" version=\"1.2\">\n", markup(&robot.name));
    for part in parts {
        link(&mut out, part);
    }
    // Joints that follow another one name the first joint of its coordinate.
    let driver = |axis: &Axis| {
        let joints = parts.iter().flat_map(|part| &part.joints);
        joints.filter(|other| other.coordinate == axis.coordinate).find(|other| other.follows.is_none())
    };
    // A chain of joints per part; links without mass between them.
    for part in &parts[1..] {
        let mut parent = parts[part.parent].name.clone();
        for (k, axis) in part.joints.iter().enumerate() {
            let last = k + 1 == part.joints.len();
            let child = if last { part.name.clone() } else { format!("{}_body", axis.name) };
            if !last {
                let _ = writeln!(out, "  <link name=\"{}\"/>", markup(&child));
            }
            let kind = if axis.slides { "prismatic" } else { "revolute" };
            let _ = write!(out, "  <joint name=\"{}\" type=\"{kind}\">", markup(&axis.name));
            let _ = write!(out, "<parent link=\"{}\"/><child link=\"{}\"/>", markup(&parent), markup(&child));
            out += &origin(&if k == 0 { part.X_PB } else { Pose::identity() });
            let _ = write!(out, "<axis xyz=\"{}\"/>{}", numbers(axis.axis.as_slice()), limit(axis, posed));
            if let (Some((ratio, offset)), Some(leader)) = (axis.follows, driver(axis)) {
                let leader = markup(&leader.name);
                let _ = write!(out, "<mimic joint=\"{leader}\" multiplier=\"{ratio:?}\" offset=\"{offset:?}\"/>");
            }
            out += "</joint>\n";
            parent = child;
        }
    }
    let tool = &posed.tool;
    let carrier = markup(&posed.plant.model.bodies()[tool.body].name);
    let _ = write!(
        out,
        "  <link name=\"tcp\"/>\n  <joint name=\"tcp_joint\" type=\"fixed\"><parent link=\"{carrier}\"/><child link=\"tcp\"/>{}</joint>\n",
        origin(&tool.X_BF)
    );
    out + "</robot>\n"
}

/// Writes a link with its inertia and visual meshes.
fn link(out: &mut String, part: &Part) {
    let _ = writeln!(out, "  <link name=\"{}\">", markup(&part.name));
    if part.mass > 0.0 {
        let I = &part.inertia;
        let _ = writeln!(
            out,
            "    <inertial><origin xyz=\"{}\"/><mass value=\"{:?}\"/><inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyy=\"{:?}\" \
             iyz=\"{:?}\" izz=\"{:?}\"/></inertial>",
            numbers(part.com.as_slice()),
            part.mass,
            I[(0, 0)],
            I[(0, 1)],
            I[(0, 2)],
            I[(1, 1)],
            I[(1, 2)],
            I[(2, 2)]
        );
    }
    for shape in &part.shapes {
        let [r, g, b, a] = shape.color;
        let _ = writeln!(
            out,
            "    <visual>{}<geometry><mesh filename=\"{MESHES}/{}.stl\"/></geometry><material name=\"{}\"><color rgba=\"{r} {g} {b} \
             {a}\"/></material></visual>",
            origin(&shape.X_BV),
            shape.name,
            shape.name
        );
    }
    out.push_str("  </link>\n");
}

/// Limits of a motor; an elastic joint stays far within 1 m and 1 rad.
fn limit(axis: &Axis, posed: &Posed) -> String {
    let coordinates = posed.plant.model.coordinates();
    let limits = coordinates.get(axis.coordinate).filter(|_| axis.coordinate < posed.plant.model.n_actuated());
    let limits = limits.map_or(Limits { lower: -1.0, upper: 1.0, ..Limits::NONE }, |c| c.limits);
    let bounds = [
        ("lower", limits.lower),
        ("upper", limits.upper),
        ("effort", limits.effort),
        ("velocity", limits.velocity),
        ("acceleration", limits.acceleration),
        ("jerk", limits.jerk),
    ];
    // URDF 1.2 reads what is left out as no limit; readers of older versions need four of them.
    let number = |x: f64| if x.is_finite() { format!("{x:?}") } else { format!("{:?}", 1e9f64.copysign(x)) };
    let written = bounds.iter().enumerate().filter(|(k, (_, x))| *k < 4 || x.is_finite());
    let words: String = written.map(|(_, (name, x))| format!(" {name}=\"{}\"", number(*x))).collect();
    format!("<limit{words}/>")
}

fn origin(X: &Pose) -> String {
    let (roll, pitch, yaw) = X.rotation.euler_angles();
    format!("<origin xyz=\"{}\" rpy=\"{}\"/>", numbers(X.translation.vector.as_slice()), numbers(&[roll, pitch, yaw]))
}
