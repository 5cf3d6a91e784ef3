//! Joints as written to joints as simulated: unit axes, limits, followers.

use std::collections::HashMap;

use flexarm_kinematics::{Joint, JointKind, Limits, Mimic, Pose};
use nalgebra::{Rotation3, Translation3, Unit, Vector3};

use crate::error::Problem;
use crate::raw::{RawJoint, RawKind, RawLimit, RawRobot};
use crate::report::Report;
use crate::spelling::closest;

/// Axes written with four digits of 1/√2 pass without a warning.
const UNIT_TOLERANCE: f64 = 1e-4;

/// Takes `<mimic>` from joints that cannot move, and fixes joints that follow one which cannot: their value is constant.
pub(crate) fn fix_still_followers(robot: &mut RawRobot, report: &mut Report) {
    let mut still: HashMap<String, f64> =
        robot.joints.iter().filter(|j| j.kind == RawKind::Fixed).map(|j| (j.name.clone(), 0.0)).collect();
    for joint in robot.joints.iter_mut().filter(|j| j.kind == RawKind::Fixed) {
        if let Some(mimic) = joint.mimic.take() {
            let message = format!("joint {:?} is fixed: its <mimic> is ignored", joint.name);
            report.warning(&mimic.place, "mimic-fixed", message, "remove <mimic>, or let the joint move");
        }
    }
    // each round fixes the followers of what the round before has fixed
    loop {
        let follows = |j: &&mut RawJoint| j.mimic.as_ref().is_some_and(|m| still.contains_key(&m.joint));
        let Some(joint) = robot.joints.iter_mut().find(follows) else { return };
        let Some(mimic) = joint.mimic.take() else { return };
        let value = mimic.ratio * still.get(&mimic.joint).copied().unwrap_or(0.0) + mimic.offset;
        let axis = joint.axis.as_ref().map_or(Vector3::x(), |(axis, _)| *axis);
        if let Some(axis) = Unit::try_new(axis, 1e-12) {
            joint.X_PJ *= match joint.kind {
                RawKind::Prismatic => {
                    Pose::from_parts(Translation3::from(axis.into_inner() * value), Rotation3::identity())
                }
                _ => Pose::from_parts(Translation3::identity(), Rotation3::from_axis_angle(&axis, value)),
            };
        }
        let message =
            format!("joint {:?} follows {:?}, which is fixed: it is fixed at {value}", joint.name, mimic.joint);
        report.warning(&mimic.place, "mimic-fixed", message, "remove <mimic>, or let the leader move");
        joint.kind = RawKind::Fixed;
        still.insert(joint.name.clone(), value);
    }
}

/// All joints in the order of the file; faults go to the report.
pub(crate) fn convert_joints(robot: &RawRobot, report: &mut Report) -> Vec<Joint> {
    let faults = report.issues.len();
    check_mimics(robot, report);
    let sound_mimics = report.issues.len() == faults;
    let mut joints: Vec<Joint> = robot.joints.iter().map(|joint| convert(joint, robot.open_limits, report)).collect();
    if sound_mimics {
        join_mimic_chains(&mut joints);
    }
    joints
}

fn convert(raw: &RawJoint, open_limits: bool, report: &mut Report) -> Joint {
    let mut joint = Joint::new(&raw.name, JointKind::Fixed, &raw.parent, &raw.child, raw.X_PJ);
    match raw.kind {
        RawKind::Fixed | RawKind::Other => return joint,
        RawKind::Revolute => joint.kind = JointKind::Revolute(axis(raw, report)),
        RawKind::Continuous => joint.kind = JointKind::Continuous(axis(raw, report)),
        RawKind::Prismatic => joint.kind = JointKind::Prismatic(axis(raw, report)),
    }
    joint.limits = match &raw.limit {
        Some(limit) => limits(raw, limit, open_limits, report),
        None if raw.kind == RawKind::Continuous => Limits::NONE,
        None => {
            let problem = Problem::MissingLimit { joint: raw.name.clone(), kind: raw.kind.name() };
            report.error(&raw.place, problem);
            Limits::NONE
        }
    };
    joint.mimic = raw.mimic.as_ref().map(|m| Mimic { joint: m.joint.clone(), ratio: m.ratio, offset: m.offset });
    joint
}

fn axis(raw: &RawJoint, report: &mut Report) -> Unit<Vector3<f64>> {
    let name = &raw.name;
    let Some((axis, place)) = &raw.axis else {
        let message = format!("joint {name:?} has no <axis>; by URDF's rule that is x");
        report.note(&raw.place, "default-axis", message, "write the axis");
        return Vector3::x_axis();
    };
    let Some((unit, norm)) = Unit::try_new_and_get(*axis, 1e-12) else {
        if !raw.faulty {
            report.error(place, Problem::ZeroAxis { joint: name.clone() });
        }
        return Vector3::x_axis();
    };
    if (norm - 1.0).abs() > UNIT_TOLERANCE {
        let message = format!("joint {name:?}: the axis has the length {norm:.6}; it was normalised");
        report.warning(place, "axis-not-unit", message, "write a unit vector");
    }
    unit
}

fn limits(raw: &RawJoint, limit: &RawLimit, open_limits: bool, report: &mut Report) -> Limits {
    let name = &raw.name;
    let mut limits = Limits::NONE;
    if raw.kind != RawKind::Continuous {
        let (low, high) = if open_limits { (f64::NEG_INFINITY, f64::INFINITY) } else { (0.0, 0.0) };
        limits.lower = limit.lower.unwrap_or(low);
        limits.upper = limit.upper.unwrap_or(high);
        if limits.lower > limits.upper {
            let (joint, lower, upper) = (name.clone(), limits.lower, limits.upper);
            report.error(&limit.place, Problem::LimitsReversed { joint, lower, upper });
        } else if limits.lower == limits.upper && !raw.faulty {
            let message = format!("joint {name:?} cannot move: both limits are {}", limits.lower);
            report.warning(&limit.place, "no-range", message, "give lower and upper, or make the joint fixed");
        }
    }
    let mut magnitude = |attribute: &'static str, code: &'static str, value: Option<f64>| {
        let value = value.unwrap_or(0.0);
        if value < 0.0 {
            let joint = name.clone();
            report.error(&limit.place, Problem::NegativeLimit { joint, attribute, value });
        } else if value == 0.0 {
            let message = format!("joint {name:?}: the {attribute} limit is 0, which is taken for unknown (no limit)");
            report.note(&limit.place, code, message, "write the limit if it is known");
        }
        if value > 0.0 { value } else { f64::INFINITY }
    };
    limits.effort = magnitude("effort", "unknown-effort", limit.effort);
    limits.velocity = magnitude("velocity", "unknown-velocity", limit.velocity);
    limits
}

/// A follower of a follower becomes one of the independent joint: `r (r' q + o') + o = (r r') q + (r o' + o)`.
fn join_mimic_chains(joints: &mut [Joint]) {
    let written: HashMap<String, Mimic> =
        joints.iter().filter_map(|j| Some((j.name.clone(), j.mimic.clone()?))).collect();
    for mimic in joints.iter_mut().filter_map(|j| j.mimic.as_mut()) {
        // the bound only guards against joints of one name
        for _ in 0..written.len() {
            let Some(next) = written.get(&mimic.joint) else { break };
            mimic.offset += mimic.ratio * next.offset;
            mimic.ratio *= next.ratio;
            mimic.joint.clone_from(&next.joint);
        }
    }
}

/// Followers need a leader that exists and moves; a circle of followers has none.
fn check_mimics(robot: &RawRobot, report: &mut Report) {
    let joints: HashMap<&str, &RawJoint> = robot.joints.iter().map(|j| (j.name.as_str(), j)).collect();
    let mut in_reported_circle: Vec<&str> = Vec::new();
    for joint in &robot.joints {
        let Some(mimic) = &joint.mimic else { continue };
        let Some(leader) = joints.get(mimic.joint.as_str()) else {
            let problem = Problem::UnknownMimic {
                joint: joint.name.clone(),
                leader: mimic.joint.clone(),
                closest: closest(&mimic.joint, robot.joints.iter().map(|j| j.name.as_str())),
            };
            report.error(&mimic.place, problem);
            continue;
        };
        if in_reported_circle.contains(&joint.name.as_str()) {
            continue;
        }
        let mut circle = vec![joint.name.as_str()];
        let mut at = *leader;
        while let Some(next) = &at.mimic {
            if let Some(start) = circle.iter().position(|n| *n == at.name) {
                // a follower of the circle that is not in it is no second fault
                if start == 0 {
                    let joints = circle.iter().map(|n| (*n).to_owned()).collect();
                    report.error(&mimic.place, Problem::MimicCycle { joints });
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
