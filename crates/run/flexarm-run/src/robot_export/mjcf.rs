//! MJCF, the format of MuJoCo.
//!
//! Links are bodies, elastic coordinates slides and hinges. MuJoCo has no prescribed motion: motors
//! that follow the trajectory exactly get a rotor so heavy that the arm does not disturb it, and
//! three actuators, for acceleration, position and speed. Joints driven by torque get a motor.
//!
//! Not here: the split of coupled springs (`springs.rs`), bodies and joints (`parts.rs`).

use std::fmt::Write as _;

use flexarm_kinematics::Pose;
use flexarm_settings::written::markup;
use nalgebra::UnitQuaternion;

use super::numbers;
use super::parts::{Axis, MESHES, Part};
use super::springs::{JointSpring, Springs};
use crate::poses::posed::Posed;
use crate::robot::Robot;

/// Rotor inertia of a motor with prescribed motion (kg m² or kg).
const ROTOR: f64 = 1e8;
/// Rate at which it returns to its set point (1/s).
const RETURN: f64 = 200.0;

pub(super) fn text(robot: &Robot, posed: &Posed, parts: &[Part], springs: &Springs, step_s: f64) -> String {
    let model = &posed.plant.model;
    let mut out = String::new();
    // Springs over one joint are its own; those over several become tendons.
    let meshes = parts.iter().flat_map(|part| &part.shapes);
    let assets: String = meshes
        .map(|shape| format!("    <mesh name=\"{0}\" file=\"{0}.stl\" inertia=\"shell\"/>\n", shape.name))
        .collect();
    let axes: Vec<&Axis> = parts.iter().flat_map(|part| &part.joints).collect();
    let (single, several): (Vec<&JointSpring>, Vec<&JointSpring>) =
        springs.springs.iter().partition(|s| s.terms.len() == 1);
    let writer = Writer { posed, parts, single: &single };
    let _ = write!(
        out,
        "<mujoco model=\"{}\">\n  <compiler angle=\"radian\" autolimits=\"true\" balanceinertia=\"false\" meshdir=\"{MESHES}\"/>\n  \
         <option timestep=\"{step_s:?}\" integrator=\"implicitfast\" gravity=\"{}\"/>\n  <asset>\n{assets}  </asset>\n  <worldbody>\n",
        markup(&robot.name),
        numbers(model.gravity.as_slice())
    );
    writer.body(&mut out, 0, 2);
    // After the bodies: what couples their joints, what drives them, and the pose at rest.
    out += "  </worldbody>\n";
    out += &section("tendon", several.iter().map(|spring| tendon(spring, &axes, model.n_actuated())));
    let following = axes.iter().filter_map(|axis| {
        let (ratio, offset) = axis.follows?;
        let leader = axes.iter().find(|other| other.coordinate == axis.coordinate && other.follows.is_none())?;
        Some(format!(
            "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{offset:?} {ratio:?} 0 0 0\"/>\n",
            markup(&axis.name),
            markup(&leader.name)
        ))
    });
    out += &section("equality", following);
    let motors: Vec<&Axis> =
        axes.iter().copied().filter(|axis| axis.coordinate < model.n_actuated() && axis.follows.is_none()).collect();
    out += &section("actuator", motors.iter().map(|axis| actuators(axis, posed)));
    out += &rest(posed, &axes, &motors);
    out + "</mujoco>\n"
}

struct Writer<'a> {
    posed: &'a Posed,
    parts: &'a [Part],
    single: &'a [&'a JointSpring],
}

impl Writer<'_> {
    /// Writes what is in a body: joints, inertia, shapes, the tool, and its children.
    fn body(&self, out: &mut String, index: usize, depth: usize) {
        let (part, pad) = (&self.parts[index], "  ".repeat(depth));
        // Joints to the parent, then the body's own mass; the world has none.
        for axis in &part.joints {
            *out += &format!("{pad}{}\n", self.joint(axis));
        }
        if index > 0 && part.mass > 0.0 {
            let I = &part.inertia;
            let full = [I[(0, 0)], I[(1, 1)], I[(2, 2)], I[(0, 1)], I[(0, 2)], I[(1, 2)]];
            let com = numbers(part.com.as_slice());
            *out += &format!(
                "{pad}<inertial pos=\"{com}\" mass=\"{:?}\" fullinertia=\"{}\"/>\n",
                part.mass,
                numbers(&full)
            );
        }
        // Shapes are seen only: no mass, no contact.
        for shape in &part.shapes {
            let color = shape.color.map(f64::from);
            *out += &format!(
                "{pad}<geom type=\"mesh\" mesh=\"{}\"{} rgba=\"{}\" contype=\"0\" conaffinity=\"0\" group=\"2\" mass=\"0\"/>\n",
                shape.name,
                placed(&shape.X_BV),
                numbers(&color)
            );
        }
        let tool = &self.posed.tool;
        if self.posed.plant.model.bodies()[tool.body].name == part.name {
            *out += &format!("{pad}<site name=\"tcp\"{}/>\n", placed(&tool.X_BF));
        }
        for child in (1..self.parts.len()).filter(|&k| self.parts[k].parent == index) {
            let part = &self.parts[child];
            *out += &format!("{pad}<body name=\"{}\"{}>\n", markup(&part.name), placed(&part.X_PB));
            self.body(out, child, depth + 1);
            *out += &format!("{pad}</body>\n");
        }
    }

    fn joint(&self, axis: &Axis) -> String {
        let model = &self.posed.plant.model;
        let (n, k) = (model.n_actuated(), axis.coordinate);
        let kind = if axis.slides { "slide" } else { "hinge" };
        let mut text = format!(
            "<joint name=\"{}\" type=\"{kind}\" axis=\"{}\"",
            markup(&axis.name),
            numbers(axis.axis.as_slice())
        );
        if axis.anchor.norm() > 0.0 {
            let _ = write!(text, " pos=\"{}\"", numbers(axis.anchor.as_slice()));
        }
        // A spring on factor × coordinate has factor² of its stiffness on the coordinate.
        for spring in self.single.iter().filter(|spring| n + spring.terms[0].0 == k) {
            let factor = spring.terms[0].1.powi(2);
            for (name, value) in [("stiffness", spring.stiffness * factor), ("damping", spring.damping * factor)] {
                if value > 0.0 {
                    let _ = write!(text, " {name}=\"{value:?}\"");
                }
            }
        }
        // Motors have limits and a rotor; elastic coordinates have neither.
        if k < n {
            let limits = &model.coordinates()[k].limits;
            if limits.lower.is_finite() && limits.upper.is_finite() && axis.follows.is_none() {
                let _ = write!(text, " range=\"{:?} {:?}\"", limits.lower, limits.upper);
            }
            let armature = if self.posed.plant.torque_driven.contains(&k) { model.rotor_inertia(k) } else { ROTOR };
            if armature > 0.0 && axis.follows.is_none() {
                let _ = write!(text, " armature=\"{armature:?}\"");
            }
        }
        text + "/>"
    }
}

fn section(name: &str, lines: impl Iterator<Item = String>) -> String {
    let lines: String = lines.collect();
    if lines.is_empty() { lines } else { format!("  <{name}>\n{lines}  </{name}>\n") }
}

fn tendon(spring: &JointSpring, axes: &[&Axis], first: usize) -> String {
    let joints = spring.terms.iter().filter_map(|&(k, factor)| {
        let axis = axes.iter().find(|axis| axis.coordinate == first + k)?;
        Some(format!("<joint joint=\"{}\" coef=\"{factor:?}\"/>", markup(&axis.name)))
    });
    let (stiffness, damping, joints) = (spring.stiffness, spring.damping, joints.collect::<String>());
    format!("    <fixed springlength=\"0 0\" stiffness=\"{stiffness:?}\" damping=\"{damping:?}\">{joints}</fixed>\n")
}

fn actuators(axis: &Axis, posed: &Posed) -> String {
    let name = markup(&axis.name);
    if posed.plant.torque_driven.contains(&axis.coordinate) {
        let effort = posed.plant.model.coordinates()[axis.coordinate].limits.effort;
        let range = if effort.is_finite() { format!(" ctrlrange=\"{:?} {effort:?}\"", -effort) } else { String::new() };
        return format!("    <motor name=\"{name}\" joint=\"{name}\"{range}/>\n");
    }
    let (kp, kv) = (ROTOR * RETURN * RETURN, 2.0 * ROTOR * RETURN);
    format!(
        "    <motor name=\"{name}_acceleration\" joint=\"{name}\" gear=\"{ROTOR:?}\"/>\n    \
         <position name=\"{name}_position\" joint=\"{name}\" kp=\"{kp:?}\"/>\n    \
         <velocity name=\"{name}_speed\" joint=\"{name}\" kv=\"{kv:?}\"/>\n"
    )
}

/// The arm at rest at its pose.
fn rest(posed: &Posed, axes: &[&Axis], motors: &[&Axis]) -> String {
    let value = |axis: &&Axis| {
        let independent = match axis.coordinate.checked_sub(posed.at.len()) {
            None => posed.at[axis.coordinate],
            Some(k) => posed.plant.modes.equilibrium[k],
        };
        axis.follows.map_or(independent, |(ratio, offset)| ratio * independent + offset)
    };
    let qpos: Vec<f64> = axes.iter().map(value).collect();
    let ctrl: Vec<f64> = motors
        .iter()
        .flat_map(|axis| match posed.plant.torque_driven.contains(&axis.coordinate) {
            true => vec![0.0],
            false => vec![0.0, value(axis), 0.0],
        })
        .collect();
    format!(
        "  <keyframe>\n    <key name=\"rest\" qpos=\"{}\" ctrl=\"{}\"/>\n  </keyframe>\n",
        numbers(&qpos),
        numbers(&ctrl)
    )
}

/// Attributes of a pose; none for the identity.
fn placed(X: &Pose) -> String {
    let mut text = String::new();
    if X.translation.vector.norm() > 0.0 {
        let _ = write!(text, " pos=\"{}\"", numbers(X.translation.vector.as_slice()));
    }
    let q = UnitQuaternion::from_rotation_matrix(&X.rotation);
    if q.imag().norm() > 0.0 {
        let _ = write!(text, " quat=\"{}\"", numbers(&[q.w, q.i, q.j, q.k]));
    }
    text
}
