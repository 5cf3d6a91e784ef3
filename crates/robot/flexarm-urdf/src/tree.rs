//! Checks of names and tree: every joint connects two known links, every link has one parent, and
//! all links have a common base.
//!
//! Start at [`check_names`] and [`check_tree`]; [`moving_bodies`] groups links that are fixed to
//! each other, for the mass checks.

use std::collections::{HashMap, HashSet};

use flexarm_kinematics::Pose;
use flexarm_settings::{Place, closest};

use crate::raw::{RawJoint, RawRobot};
use crate::report::{Report, did_you_mean, quoted};

/// Reports duplicate names of links and joints; later checks use only the first.
pub(crate) fn check_names(robot: &RawRobot, report: &mut Report) {
    if robot.links.is_empty() && report.issues.is_empty() {
        let calls: Vec<_> = robot.idle_macros.iter().take(3).map(|name| format!("<xacro:{name} .../>")).collect();
        let (macros, help) = match calls.is_empty() {
            true => ("", "is the file complete? A robot needs at least one <link>".to_owned()),
            false => (
                ": the file defines macros and calls none",
                format!("give the file that calls them, or one that includes this one and calls {}", calls.join(", ")),
            ),
        };
        report.error(&robot.place, "no-link", format!("the robot {:?} has no <link>{macros}", robot.name), help);
    }
    let links = robot.links.iter().map(|link| ("link", "duplicate-link", &link.name, &link.place));
    let joints = robot.joints.iter().map(|joint| ("joint", "duplicate-joint", &joint.urdf.name, &joint.place));
    let mut first: HashMap<(&str, &str), &Place> = HashMap::new();
    for (kind, code, name, place) in links.chain(joints) {
        if let Some(first) = first.get(&(kind, name.as_str())) {
            let message = format!("{kind} {name:?} is defined twice, first at {first}");
            report.error(place, code, message, "rename or remove one of them");
        }
        first.entry((kind, name)).or_insert(place);
    }
}

/// Reports unknown links, second parents, cycles and unconnected parts.
pub(crate) fn check_tree(robot: &RawRobot, report: &mut Report) {
    let faults = report.issues.len();
    let names: HashSet<&str> = robot.links.iter().map(|l| l.name.as_str()).collect();
    let mut parent_joint: HashMap<&str, &RawJoint> = HashMap::new();
    for joint in &robot.joints {
        for (role, link) in [("parent", &joint.urdf.parent.link), ("child", &joint.urdf.child.link)] {
            // An empty name was already reported as a missing element.
            if !link.is_empty() && !names.contains(link.as_str()) {
                let message = format!("joint {:?}: its {role} link {link:?} does not exist", joint.urdf.name);
                let meant = closest(link, robot.links.iter().map(|l| l.name.as_str()));
                let help = did_you_mean(meant, "correct the name or define it");
                report.error(&joint.place, "unknown-link", message, help);
            }
        }
        let child = &joint.urdf.child.link;
        if child.is_empty() {
            continue;
        }
        if let Some(first) = parent_joint.get(child.as_str()) {
            let (first, place, second) = (&first.urdf.name, &first.place, &joint.urdf.name);
            let message = format!("link {child:?} is the child of two joints, {first:?} ({place}) and {second:?}");
            let help = "URDF describes trees: remove one of the joints; a closed loop is described with <mimic>";
            report.error(&joint.place, "two-parents", message, help);
        } else {
            parent_joint.insert(child, joint);
        }
    }
    report_cycles(robot, &parent_joint, report);

    // A broken joint leaves unconnected parts, which are not another fault.
    if report.issues.len() > faults
        || robot.joints.iter().any(|j| j.urdf.parent.link.is_empty() || j.urdf.child.link.is_empty())
    {
        return;
    }
    let roots: Vec<_> = robot.links.iter().filter(|l| !parent_joint.contains_key(l.name.as_str())).collect();
    if let [_, second, ..] = roots[..] {
        let roots = quoted(roots.iter().map(|link| link.name.as_str()));
        let message = format!("the links are not connected: {roots} have no parent joint, expected one base link");
        let help = "add a (fixed) joint between the parts or remove the part not needed";
        report.error(&second.place, "disconnected", message, help);
    }
}

fn report_cycles(robot: &RawRobot, parent_joint: &HashMap<&str, &RawJoint>, report: &mut Report) {
    let mut reported: Vec<&str> = Vec::new();
    // Links already followed up to a base or to a reported cycle.
    let mut settled: HashSet<&str> = HashSet::new();
    for link in &robot.links {
        let mut path: Vec<&RawJoint> = Vec::new();
        let mut on_path: HashMap<&str, usize> = HashMap::new();
        let mut at = link.name.as_str();
        while let Some(&joint) = parent_joint.get(at) {
            if settled.contains(at) {
                break;
            }
            if let Some(&start) = on_path.get(at) {
                if !reported.contains(&at) {
                    let joints = quoted(path[start..].iter().rev().map(|joint| joint.urdf.name.as_str()));
                    let message = format!("the joints {joints} form a cycle without a base link");
                    report.error(&joint.place, "cycle", message, "remove one of these joints or correct its parent");
                }
                reported.extend(path[start..].iter().map(|j| j.urdf.child.link.as_str()));
                break;
            }
            on_path.insert(at, path.len());
            path.push(joint);
            at = &joint.urdf.parent.link;
        }
        settled.extend(on_path.into_keys());
    }
}

/// Links that are fixed to each other.
pub(crate) struct Body {
    /// Index of the link nearest to the base.
    pub(crate) root: usize,
    /// All links, the root first, each with its pose `X_RL` in the root link.
    pub(crate) members: Vec<(usize, Pose)>,
    /// Index of the joint that moves the body; `None` for the base.
    pub(crate) moved_by: Option<usize>,
}

/// Returns all bodies of a sound tree, the base first. The order is depth first.
pub(crate) fn moving_bodies(robot: &RawRobot) -> Vec<Body> {
    // Joints below each link.
    let index: HashMap<&str, usize> = robot.links.iter().enumerate().map(|(i, l)| (l.name.as_str(), i)).collect();
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); robot.links.len()];
    let mut has_parent = vec![false; robot.links.len()];
    for (j, joint) in robot.joints.iter().enumerate() {
        if let (Some(&p), Some(&c)) =
            (index.get(joint.urdf.parent.link.as_str()), index.get(joint.urdf.child.link.as_str()))
        {
            children[p].push(j);
            has_parent[c] = true;
        }
    }
    // A body starts at the base or at a link with a moving joint. It grows by the fixed joints
    // below it; each moving one starts another body.
    let mut pending: Vec<(usize, Option<usize>)> =
        has_parent.iter().enumerate().filter(|(_, has)| !**has).map(|(i, _)| (i, None)).collect();
    let mut bodies = Vec::new();
    while let Some((root, moved_by)) = pending.pop() {
        let mut members = vec![(root, Pose::identity())];
        let mut at = 0;
        while at < members.len() {
            let (link, X_RL) = members[at];
            for &j in &children[link] {
                let joint = &robot.joints[j];
                let child = index[joint.urdf.child.link.as_str()];
                if joint.is_fixed() {
                    members.push((child, X_RL * joint.X_PJ));
                } else {
                    pending.push((child, Some(j)));
                }
            }
            at += 1;
        }
        bodies.push(Body { root, members, moved_by });
    }
    bodies
}
