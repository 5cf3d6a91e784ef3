//! Caveats about the links that carry TCP and payload, and about rigid joints among elastic ones.
//!
//! Start at [`of_chain`]: a walk from a link to the base, and over all that it carries. Not here:
//! distances and masses of TCP and payload (`parts.rs`).

use flexarm_kinematics::{Joint, Mechanism};

use super::size::Size;
use super::{Finding, FindingKind, kinds};
use crate::robot::drive_entry::{Drive, DriveKind};
use crate::robot::entry_checks::carrier;
use crate::robot::{PAYLOAD_LINK, Robot};

/// Joint range that separates fingers (less) from arm joints (more) (rad).
const HALF_TURN: f64 = 3.0;
/// Fraction of the arm's reach or mass beyond a link above which that part is not a gripper.
const ARM_LIKE: f64 = 0.2;
/// Minimum number of joints for the check of rigid joints.
const FEWEST: usize = 3;

/// Returns all of these caveats about a loaded robot.
pub(crate) fn of_chain(robot: &Robot, size: &Size) -> Vec<Finding> {
    let mut caveats: Vec<Finding> =
        of_place(robot, size, "the TCP", &robot.tcp.0, [&kinds::TCP_FIXED, &kinds::TCP_INSIDE]).into_iter().collect();
    if let Some(joint) = robot.rigid.joints.iter().find(|joint| joint.child == PAYLOAD_LINK) {
        caveats.extend(of_payload(robot, size, "the payload", &joint.parent));
    }
    caveats.extend(stiff_joints(robot));
    caveats
}

/// Checks for a payload on a link beyond which the arm continues.
pub(crate) fn of_payload(robot: &Robot, size: &Size, what: &str, link: &str) -> Option<Finding> {
    of_place(robot, size, what, link, [&kinds::PAYLOAD_FIXED, &kinds::PAYLOAD_INSIDE])
}

/// Checks the link of a payload or tool, which belongs to the end of the arm. Kinds of caveats: no joint
/// moves the link; the arm continues beyond it.
fn of_place(robot: &Robot, size: &Size, what: &str, link: &str, [fixed, inside]: [&FindingKind; 2]) -> Option<Finding> {
    let mechanism = &robot.urdf.mechanism;
    let location = format!("{what} on link {link:?}");
    let body = carrier(mechanism, link);
    let moving = moving(robot);
    if !mechanism.joints.iter().any(|joint| joint.child == body) {
        return (!moving.is_empty()).then(|| fixed.found(location, 0.0, moving.len() as f64));
    }
    let behind = DistalPart::of(mechanism, &moving, size, body);
    behind.is_arm.then(|| inside.found(location, behind.reach, size.extent))
}

/// Returns the independent joints: not fixed, not held, not dependent.
fn moving(robot: &Robot) -> Vec<String> {
    let Ok(model) = robot.rigid_model() else { return Vec::new() };
    let held = |name: &str| robot.hold.iter().any(|(held, _)| held == name);
    let moves = model.coordinates().iter().filter(|c| c.limits.upper > c.limits.lower && !held(&c.joint));
    moves.map(|c| c.joint.clone()).collect()
}

/// Part of the robot beyond a body, seen from the base.
struct DistalPart {
    /// Its reach from there (m).
    reach: f64,
    /// Whether it is part of the arm rather than a gripper.
    is_arm: bool,
}

impl DistalPart {
    fn of(mechanism: &Mechanism, moving: &[String], size: &Size, body: &str) -> Self {
        // Links, and whether a moving joint is between each and the body.
        let mut open = vec![(body, false)];
        let (mut reach, mut mass, mut turns, mut branches) = (0.0f64, 0.0, false, 0);
        while let Some((link, moved)) = open.pop() {
            if moved {
                let inertia = mechanism.link(link).and_then(|link| link.inertia).filter(|inertia| inertia.mass > 0.0);
                reach = reach.max(size.at(link) - size.at(body) + inertia.map_or(0.0, |inertia| inertia.com.norm()));
                mass += inertia.map_or(0.0, |inertia| inertia.mass);
            }
            for joint in mechanism.child_joints(link) {
                let moves = moving.contains(&joint.name);
                let range = joint.limits.upper - joint.limits.lower;
                turns |= moves && joint.kind.turns() && range > HALF_TURN;
                branches += usize::from(moves && !moved);
                open.push((&joint.child, moved || moves));
            }
        }
        let large = reach > ARM_LIKE * size.extent || mass > ARM_LIKE * size.mass;
        // Hands have several fingers.
        Self { reach, is_arm: large || (turns && branches == 1) }
    }
}

/// Finds rigid joints where most others of the arm are elastic, or with elastic joints on both
/// sides.
fn stiff_joints(robot: &Robot) -> Vec<Finding> {
    let elastic = |drive: &Drive| drive.kind != DriveKind::Prescribed && drive.gearbox.is_some();
    let yields = |joint: &Joint| robot.drives.iter().any(|drive| drive.joint == joint.name && elastic(drive));
    let (mechanism, moving) = (&robot.urdf.mechanism, moving(robot));
    // From the TCP to the base.
    let mut chain: Vec<(&Joint, bool)> = Vec::new();
    let mut link = robot.tcp.0.as_str();
    while let Some(joint) = mechanism.joints.iter().find(|joint| joint.child == link) {
        if moving.contains(&joint.name) {
            chain.push((joint, yields(joint)));
        }
        link = &joint.parent;
    }
    // Rigid last joints, as of wrists and of the quill of a SCARA, are usual, unless there is only one.
    let outermost = chain.iter().position(|(_, yields)| *yields).unwrap_or(0);
    let last = chain.drain(..if outermost == 1 { 0 } else { outermost }).count();
    chain.retain(|(joint, _)| joint.kind.turns());
    let elastic = chain.iter().filter(|(_, yields)| *yields).count();
    let rigid: Vec<&Joint> = chain.iter().rev().filter(|(_, yields)| !yields).map(|(joint, _)| *joint).collect();
    let all = chain.len() + last;
    if all < FEWEST || rigid.len() >= elastic {
        return Vec::new();
    }
    let all = all as f64;
    let caveat = |joint: &Joint| kinds::STIFF_JOINT.found(format!("joint {:?}", joint.name), elastic as f64, all);
    rigid.into_iter().map(caveat).collect()
}
