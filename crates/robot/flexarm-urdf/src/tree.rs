//! Checks of names and tree: every joint connects two known links, every link has one parent, and
//! all links have a common base.
//!
//! Start at [`check_names`] and [`check_tree`]; [`moving_bodies`] groups links that are fixed to
//! each other, for the mass checks.

use std::collections::{HashMap, HashSet};

use flexarm_kinematics::Pose;

use crate::error::Problem;
use crate::raw::{RawJoint, RawRobot};
use crate::report::Report;
use flexarm_settings::closest;

/// Reports duplicate names of links and joints; later checks use only the first.
pub(crate) fn check_names(robot: &RawRobot, report: &mut Report) {
    if robot.links.is_empty() && report.issues.is_empty() {
        report
            .error(&robot.place, Problem::NoLink { robot: robot.name.clone(), idle_macros: robot.idle_macros.clone() });
    }
    let mut first: HashMap<&str, u32> = HashMap::new();
    for link in &robot.links {
        if let Some(&first_line) = first.get(link.name.as_str()) {
            report.error(&link.place, Problem::DuplicateLink { link: link.name.clone(), first_line });
        }
        first.entry(&link.name).or_insert(link.place.line);
    }
    let mut first: HashMap<&str, u32> = HashMap::new();
    for joint in &robot.joints {
        if let Some(&first_line) = first.get(joint.urdf.name.as_str()) {
            report.error(&joint.place, Problem::DuplicateJoint { joint: joint.urdf.name.clone(), first_line });
        }
        first.entry(&joint.urdf.name).or_insert(joint.place.line);
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
                let (joint_name, link) = (joint.urdf.name.clone(), link.clone());
                let closest = closest(&link, robot.links.iter().map(|l| l.name.as_str()));
                report.error(&joint.place, Problem::UnknownLink { joint: joint_name, role, link, closest });
            }
        }
        let child = &joint.urdf.child.link;
        if child.is_empty() {
            continue;
        }
        if let Some(first) = parent_joint.get(child.as_str()) {
            let problem = Problem::TwoParents {
                link: child.clone(),
                first: first.urdf.name.clone(),
                first_line: first.place.line,
                second: joint.urdf.name.clone(),
            };
            report.error(&joint.place, problem);
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
        let roots = roots.iter().map(|l| l.name.clone()).collect();
        report.error(&second.place, Problem::Disconnected { roots });
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
                let mut joints: Vec<String> = path[start..].iter().map(|j| j.urdf.name.clone()).collect();
                joints.reverse();
                if !reported.contains(&at) {
                    report.error(&joint.place, Problem::Cycle { joints });
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

/// Returns all bodies of a sound tree, the base first.
pub(crate) fn moving_bodies(robot: &RawRobot) -> Vec<Body> {
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
