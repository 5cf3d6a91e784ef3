//! Conversion of joints as written to joints of the mechanism: unit axes, limits, mimic joints.

use std::collections::HashMap;

use flexarm_kinematics::{Joint, JointKind, Limits, Mimic, Pose};
use nalgebra::{Rotation3, Translation3, Unit, Vector3};

use crate::place::TextPosition;
use crate::raw::{RawJoint, RawRobot};
use crate::report::{Report, did_you_mean, quoted};
use flexarm_settings::closest;

/// Tolerance of the axis length; axes written with four digits of 1/√2 pass without a warning.
const UNIT_TOLERANCE: f64 = 1e-4;

/// Removes `<mimic>` from fixed joints, and fixes joints that follow a fixed one, since their value
/// is constant.
pub(crate) fn fix_still_followers(robot: &mut RawRobot, report: &mut Report) {
    let mut still: HashMap<String, f64> =
        robot.joints.iter().filter(|j| j.is_fixed()).map(|j| (j.name.clone(), 0.0)).collect();
    for joint in robot.joints.iter_mut().filter(|j| j.is_fixed()) {
        if joint.mimic.take().is_some() {
            let message = format!("joint {:?} is fixed: its <mimic> is ignored", joint.name);
            report.warning(&joint.mimic_place, "mimic-fixed", message, "remove <mimic>, or let the joint move");
        }
    }
    // Each round fixes followers of joints fixed in an earlier round.
    loop {
        let follows = |j: &&mut RawJoint| j.mimic.as_ref().is_some_and(|m| still.contains_key(&m.joint));
        let Some(joint) = robot.joints.iter_mut().find(follows) else { return };
        let Some(mimic) = joint.mimic.take() else { return };
        let value = mimic.ratio * still.get(&mimic.joint).copied().unwrap_or(0.0) + mimic.offset;
        if let Some(axis) = Unit::try_new(joint.axis, 1e-12) {
            joint.X_PJ *= match joint.kind {
                "prismatic" => Pose::from_parts(Translation3::from(axis.into_inner() * value), Rotation3::identity()),
                _ => Pose::from_parts(Translation3::identity(), Rotation3::from_axis_angle(&axis, value)),
            };
        }
        let message =
            format!("joint {:?} follows {:?}, which is fixed: it is fixed at {value}", joint.name, mimic.joint);
        report.warning(&joint.mimic_place, "mimic-fixed", message, "remove <mimic>, or let the leader move");
        joint.kind = "fixed";
        still.insert(joint.name.clone(), value);
    }
}

/// Converts all joints in the order of the file; faults go to the report.
pub(crate) fn convert_joints(robot: &RawRobot, report: &mut Report) -> Vec<Joint> {
    let faults = report.issues.len();
    check_mimics(robot, report);
    let sound_mimics = report.issues.len() == faults;
    let mut joints: Vec<Joint> = robot.joints.iter().map(|joint| convert(joint, report)).collect();
    if sound_mimics {
        join_mimic_chains(&mut joints);
    }
    joints
}

fn convert(raw: &RawJoint, report: &mut Report) -> Joint {
    let mut joint = Joint::new(&raw.name, JointKind::Fixed, &raw.parent, &raw.child, raw.X_PJ);
    joint.kind = match raw.kind {
        "revolute" => JointKind::Revolute(axis(raw, report)),
        "prismatic" => JointKind::Prismatic(axis(raw, report)),
        "continuous" => JointKind::Continuous(axis(raw, report)),
        // The lint reports the other types.
        _ => return joint,
    };
    match &raw.limit {
        Some((place, values)) => joint.limits = limits(raw, place, *values, report),
        None if raw.kind == "continuous" => {}
        None => {
            let message = format!("{} joint {:?} has no <limit>", raw.kind, raw.name);
            let or = if raw.kind == "revolute" { " or make the joint continuous" } else { "" };
            let help = format!("add <limit lower=\"..\" upper=\"..\" effort=\"..\" velocity=\"..\"/>{or}");
            report.error(&raw.place, "missing-limit", message, help);
        }
    }
    joint.mimic = raw.mimic.clone();
    joint
}

fn axis(raw: &RawJoint, report: &mut Report) -> Unit<Vector3<f64>> {
    let name = &raw.name;
    let Some(place) = &raw.axis_place else {
        let message = format!("joint {name:?} has no <axis>; by URDF's rule that is x");
        report.note(&raw.place, "default-axis", message, "write the axis");
        return Vector3::x_axis();
    };
    let Some((unit, norm)) = Unit::try_new_and_get(raw.axis, 1e-12) else {
        if !raw.faulty {
            let message = format!("joint {name:?}: the axis is the zero vector");
            report.error(place, "zero-axis", message, "write the axis as a unit vector, such as xyz=\"0 0 1\"");
        }
        return Vector3::x_axis();
    };
    if (norm - 1.0).abs() > UNIT_TOLERANCE {
        let message = format!("joint {name:?}: the axis has the length {norm:.6}; it was normalised");
        report.warning(place, "axis-not-unit", message, "write a unit vector");
    }
    unit
}

fn limits(raw: &RawJoint, place: &TextPosition, values: [f64; 7], report: &mut Report) -> Limits {
    let name = &raw.name;
    let [lower, upper, effort, velocity, acceleration, deceleration, jerk] = values;
    let mut limits = Limits::NONE;
    if raw.kind != "continuous" {
        (limits.lower, limits.upper) = (lower, upper);
        if lower > upper {
            let message = format!("joint {name:?}: the lower limit {lower} is above the upper limit {upper}");
            report.error(place, "limits-reversed", message, "exchange lower and upper; angles are in radians");
        } else if lower == upper && !raw.faulty {
            let message = format!("joint {name:?} cannot move: both limits are {lower}");
            report.warning(place, "no-range", message, "give lower and upper, or make the joint fixed");
        }
    }
    let mut magnitude = |attribute: &'static str, code: &'static str, value: f64| {
        if value < 0.0 {
            let message = format!("joint {name:?}: the {attribute} limit {value} is negative");
            let help = "limits of speed and effort are magnitudes; 0 means unknown";
            report.error(place, "negative-limit", message, help);
        } else if value == 0.0 {
            let message = format!("joint {name:?}: the {attribute} limit is 0, which is taken for unknown (no limit)");
            report.note(place, code, message, "write the limit if it is known");
        }
        if value > 0.0 { value } else { f64::INFINITY }
    };
    limits.effort = magnitude("effort", "unknown-effort", effort);
    limits.velocity = magnitude("velocity", "unknown-velocity", velocity);
    let acceleration = magnitude("acceleration", "unknown-acceleration", acceleration);
    let deceleration = magnitude("deceleration", "unknown-deceleration", deceleration);
    limits.jerk = magnitude("jerk", "unknown-jerk", jerk);
    limits.acceleration = acceleration.min(deceleration);
    if acceleration != deceleration {
        let message = format!(
            "joint {name:?}: acceleration {acceleration} and deceleration {deceleration} differ; both are bounded by the smaller"
        );
        report.note(place, "one-acceleration", message, "");
    }
    limits
}

/// Makes a follower of a follower follow the independent joint:
/// `r (r' q + o') + o = (r r') q + (r o' + o)`.
fn join_mimic_chains(joints: &mut [Joint]) {
    let written: HashMap<String, Mimic> =
        joints.iter().filter_map(|j| Some((j.name.clone(), j.mimic.clone()?))).collect();
    for mimic in joints.iter_mut().filter_map(|j| j.mimic.as_mut()) {
        // The bound only guards against duplicate joint names.
        for _ in 0..written.len() {
            let Some(next) = written.get(&mimic.joint) else { break };
            mimic.offset += mimic.ratio * next.offset;
            mimic.ratio *= next.ratio;
            mimic.joint.clone_from(&next.joint);
        }
    }
}

/// Checks that the leaders of mimic joints exist and do not form a cycle.
fn check_mimics(robot: &RawRobot, report: &mut Report) {
    let joints: HashMap<&str, &RawJoint> = robot.joints.iter().map(|j| (j.name.as_str(), j)).collect();
    let mut in_reported_circle: Vec<&str> = Vec::new();
    for joint in &robot.joints {
        // An empty name was already reported as a missing attribute.
        let Some(mimic) = joint.mimic.as_ref().filter(|m| !m.joint.is_empty()) else { continue };
        let Some(leader) = joints.get(mimic.joint.as_str()) else {
            let message = format!("joint {:?} mimics {:?}, which does not exist", joint.name, mimic.joint);
            let meant = closest(&mimic.joint, robot.joints.iter().map(|j| j.name.as_str()));
            let help = did_you_mean(meant, "correct the name or define it");
            report.error(&joint.mimic_place, "unknown-mimic", message, help);
            continue;
        };
        if in_reported_circle.contains(&joint.name.as_str()) {
            continue;
        }
        let mut circle = vec![joint.name.as_str()];
        let mut at = *leader;
        while let Some(next) = &at.mimic {
            if let Some(start) = circle.iter().position(|n| *n == at.name) {
                // A joint that follows the cycle without being in it is not another fault.
                if start == 0 {
                    let joints = quoted(circle.iter().copied());
                    let message = format!("the joints {joints} mimic each other in a circle");
                    report.error(&joint.mimic_place, "mimic-cycle", message, "let one of them go without <mimic>");
                    in_reported_circle.extend(&circle);
                }
                break;
            }
            circle.push(&at.name);
            let Some(leader) = joints.get(next.joint.as_str()) else { break };
            at = leader;
        }
    }
}
