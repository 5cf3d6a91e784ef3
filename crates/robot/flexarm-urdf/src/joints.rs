//! Conversion of joints as written to joints of the mechanism: unit axes, limits, mimic joints.
//!
//! Start at [`convert_joints`]. Frames: P parent link, J joint, with `X_PJ` at zero position; axes
//! are in J. Values in rad or m. Not here: missing or unreadable attributes ([`crate::lint`]), the
//! tree ([`crate::tree`]).

use std::collections::HashMap;

use flexarm_kinematics::{Joint, JointKind, Limits, Mimic, Pose};
use flexarm_settings::{Place, closest};
use nalgebra::{Rotation3, Translation3, Unit, Vector3};
use urdf_rs::JointType;

use crate::lint::RATES;
use crate::raw::{RawJoint, RawRobot};
use crate::report::{Report, did_you_mean, quoted};

/// Tolerance of the length of an axis; axes written with four digits of 1/√2 pass without a
/// warning.
const UNIT_TOLERANCE: f64 = 1e-4;

/// Removes `<mimic>` from fixed joints, and fixes joints that follow a fixed one, since their value
/// is constant.
pub(crate) fn fix_still_followers(robot: &mut RawRobot, report: &mut Report) {
    let mut still: HashMap<String, f64> =
        robot.joints.iter().filter(|j| j.is_fixed()).map(|j| (j.urdf.name.clone(), 0.0)).collect();
    for joint in robot.joints.iter_mut().filter(|j| j.is_fixed()) {
        if joint.urdf.mimic.take().is_some() {
            let message = format!("joint {:?} is fixed: its <mimic> is ignored", joint.urdf.name);
            report.warning(&joint.mimic, "mimic-fixed", message, "remove <mimic>, or let the joint move");
        }
    }
    // Each round fixes followers of joints fixed in an earlier round.
    loop {
        let follows = |j: &&mut RawJoint| j.urdf.mimic.as_ref().is_some_and(|m| still.contains_key(&m.joint));
        let Some(joint) = robot.joints.iter_mut().find(follows) else { return };
        let Some(mimic) = joint.urdf.mimic.take().map(follower) else { return };
        // The constant value moves J along or about the axis.
        let value = mimic.ratio * still.get(&mimic.joint).copied().unwrap_or(0.0) + mimic.offset;
        if let Some(axis) = Unit::try_new(Vector3::from(*joint.urdf.axis.xyz), 1e-12) {
            joint.X_PJ *= match joint.urdf.joint_type {
                JointType::Prismatic => {
                    Pose::from_parts(Translation3::from(axis.into_inner() * value), Rotation3::identity())
                }
                _ => Pose::from_parts(Translation3::identity(), Rotation3::from_axis_angle(&axis, value)),
            };
        }
        let message =
            format!("joint {:?} follows {:?}, which is fixed: it is fixed at {value}", joint.urdf.name, mimic.joint);
        report.warning(&joint.mimic, "mimic-fixed", message, "remove <mimic>, or let the leader move");
        joint.urdf.joint_type = JointType::Fixed;
        still.insert(joint.urdf.name.clone(), value);
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
    let urdf = &raw.urdf;
    let mut joint = Joint::new(&urdf.name, JointKind::Fixed, &urdf.parent.link, &urdf.child.link, raw.X_PJ);
    let kind = match urdf.joint_type {
        JointType::Revolute => {
            joint.kind = JointKind::Revolute(axis(raw, report));
            "revolute"
        }
        JointType::Prismatic => {
            joint.kind = JointKind::Prismatic(axis(raw, report));
            "prismatic"
        }
        JointType::Continuous => {
            joint.kind = JointKind::Continuous(axis(raw, report));
            "continuous"
        }
        // The lint reports the other types.
        _ => return joint,
    };
    match &raw.limit {
        Some(place) => joint.limits = limits(raw, place, report),
        None if kind == "continuous" => {}
        None => {
            let message = format!("{kind} joint {:?} has no <limit>", urdf.name);
            let or = if kind == "revolute" { " or make the joint continuous" } else { "" };
            let help = format!("add <limit lower=\"..\" upper=\"..\" effort=\"..\" velocity=\"..\"/>{or}");
            report.error(&raw.place, "missing-limit", message, help);
        }
    }
    joint.mimic = urdf.mimic.clone().map(follower);
    joint
}

fn follower(urdf: urdf_rs::Mimic) -> Mimic {
    Mimic { joint: urdf.joint, ratio: urdf.multiplier.unwrap_or(1.0), offset: urdf.offset.unwrap_or(0.0) }
}

fn axis(raw: &RawJoint, report: &mut Report) -> Unit<Vector3<f64>> {
    let name = &raw.urdf.name;
    let Some(place) = &raw.axis else {
        let message = format!("joint {name:?} has no <axis>; by URDF's rule that is x");
        report.note(&raw.place, "default-axis", message, "write the axis");
        return Vector3::x_axis();
    };
    let Some((unit, norm)) = Unit::try_new_and_get(Vector3::from(*raw.urdf.axis.xyz), 1e-12) else {
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

fn limits(raw: &RawJoint, place: &Place, report: &mut Report) -> Limits {
    let (name, limit) = (&raw.urdf.name, &raw.urdf.limit);
    let mut limits = Limits::NONE;
    // Range of positions; a continuous joint has none.
    if raw.urdf.joint_type != JointType::Continuous {
        limits.lower = limit.lower;
        limits.upper = limit.upper;
        if limits.lower > limits.upper {
            let Limits { lower, upper, .. } = limits;
            let message = format!("joint {name:?}: the lower limit {lower} is above the upper limit {upper}");
            report.error(place, "limits-reversed", message, "exchange lower and upper; angles are in radians");
        } else if limits.lower == limits.upper && !raw.faulty {
            let message = format!("joint {name:?} cannot move: both limits are {}", limits.lower);
            report.warning(place, "no-range", message, "give lower and upper, or make the joint fixed");
        }
    }
    // Bounds of rates and effort: zero means unknown, which does not limit.
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
    limits.effort = magnitude("effort", "unknown-effort", limit.effort);
    limits.velocity = magnitude("velocity", "unknown-velocity", limit.velocity);
    let codes = ["unknown-acceleration", "unknown-deceleration", "unknown-jerk"];
    let [acceleration, deceleration, jerk] = [0, 1, 2].map(|k| magnitude(RATES[k], codes[k], raw.rates[k]));
    // The motion has one bound for both directions.
    limits.acceleration = acceleration.min(deceleration);
    limits.jerk = jerk;
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
    let joints: HashMap<&str, &RawJoint> = robot.joints.iter().map(|j| (j.urdf.name.as_str(), j)).collect();
    let mut in_reported_circle: Vec<&str> = Vec::new();
    for joint in &robot.joints {
        // An empty name was already reported as a missing attribute.
        let Some(mimic) = joint.urdf.mimic.as_ref().filter(|m| !m.joint.is_empty()) else { continue };
        let Some(leader) = joints.get(mimic.joint.as_str()) else {
            let message = format!("joint {:?} mimics {:?}, which does not exist", joint.urdf.name, mimic.joint);
            let meant = closest(&mimic.joint, robot.joints.iter().map(|j| j.urdf.name.as_str()));
            let help = did_you_mean(meant, "correct the name or define it");
            report.error(&joint.mimic, "unknown-mimic", message, help);
            continue;
        };
        if in_reported_circle.contains(&joint.urdf.name.as_str()) {
            continue;
        }
        let mut circle = vec![joint.urdf.name.as_str()];
        let mut at = *leader;
        while let Some(next) = &at.urdf.mimic {
            if let Some(start) = circle.iter().position(|n| *n == at.urdf.name) {
                // A joint that follows the cycle without being in it is not another fault.
                if start == 0 {
                    let joints = quoted(circle.iter().copied());
                    let message = format!("the joints {joints} mimic each other in a circle");
                    report.error(&joint.mimic, "mimic-cycle", message, "let one of them go without <mimic>");
                    in_reported_circle.extend(&circle);
                }
                break;
            }
            circle.push(&at.urdf.name);
            let Some(leader) = joints.get(next.joint.as_str()) else { break };
            at = leader;
        }
    }
}
