//! Choice of the tool link if the user does not give one.
//!
//! Start at [`default_tcp`]. Not here: a tool frame given by the user (`flexarm-run`).

use std::collections::{HashMap, HashSet};

use flexarm_kinematics::{JointKind, Mechanism};

/// Names of tool frames, best first (ROS-Industrial's REP-199 and common use).
const TOOL_NAMES: [&str; 3] = ["tool0", "tcp", "flange"];

/// Returns the link whose frame is the default tool centre point.
///
/// `tool0`, otherwise `tcp`, otherwise `flange`, each also with a prefix (`left_tool0`) if there is
/// only one such link; otherwise the last link of the chain with the most moving joints (then with
/// the most links, then the first in the file). `None` for a mechanism without links.
pub fn default_tcp(mechanism: &Mechanism) -> Option<&str> {
    tcp_candidates(mechanism).into_iter().next()
}

/// Returns all links that may be the tool, the default first: the tool frames by name, then the
/// ends of all chains.
pub fn tcp_candidates(mechanism: &Mechanism) -> Vec<&str> {
    let names = || mechanism.links.iter().map(|l| l.name.as_str());
    let mut candidates: Vec<&str> = Vec::new();
    let mut ambiguous: Vec<&str> = Vec::new();
    for tool in TOOL_NAMES {
        candidates.extend(names().find(|&n| n == tool));
        let prefixed: Vec<&str> = names().filter(|n| is_prefixed(n, tool)).collect();
        if let [only] = prefixed[..] { candidates.push(only) } else { ambiguous.extend(prefixed) }
    }

    let depth = depths(mechanism);
    let parents: HashSet<&str> = mechanism.joints.iter().map(|j| j.parent.as_str()).collect();
    let mut ends: Vec<&str> = names().filter(|n| !parents.contains(n)).collect();
    // A stable sort keeps the order of the file among equals.
    ends.sort_by_key(|n| std::cmp::Reverse(depth.get(n).copied()));

    let mut visited = HashSet::new();
    candidates.into_iter().chain(ends).chain(ambiguous).filter(|n| visited.insert(*n)).collect()
}

/// Whether the name is the tool name with a prefix: `left_tool0`, `left-tool0`, `left/tool0` for
/// `tool0`.
fn is_prefixed(name: &str, tool: &str) -> bool {
    name.strip_suffix(tool).is_some_and(|prefix| prefix.ends_with(['_', '-', '/', ':', '.']))
}

/// Number of moving joints and of all joints between the base and each link.
fn depths(mechanism: &Mechanism) -> HashMap<&str, (usize, usize)> {
    let parent_joint: HashMap<&str, _> = mechanism.joints.iter().map(|j| (j.child.as_str(), j)).collect();
    let depth = |link: &str| {
        let (mut moving, mut all, mut at) = (0, 0, link);
        // The bound stops at a mechanism that is not a tree.
        while let (Some(joint), true) = (parent_joint.get(at), all < mechanism.joints.len()) {
            moving += usize::from(joint.kind != JointKind::Fixed);
            all += 1;
            at = &joint.parent;
        }
        (moving, all)
    };
    mechanism.links.iter().map(|l| (l.name.as_str(), depth(&l.name))).collect()
}
