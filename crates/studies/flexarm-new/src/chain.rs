//! Choice of the joints that form the arm: from base to tool, which of them move, and which are
//! held.
//!
//! Start at [`find`]. Without names from the user, the longest chain that is not a hand, a leg or a
//! wheel is the arm. Not here: what the arm weighs and how it moves ([`super::draft`]).

use std::collections::HashMap;

use flexarm_kinematics::{Joint, JointKind, Mechanism};
use flexarm_settings::{Setting, closest};

use super::{NewError, NewOptions};

/// Names of tool frames, best first, also with a prefix (`arm_tool0`).
const TOOLS: [&str; 12] = [
    "tool0",
    "tcp",
    "hand_tcp",
    "tool_frame",
    "flange",
    "ee_link",
    "link_ee",
    "end_effector",
    "end_effector_link",
    "tool_link",
    "ee",
    "gripper_frame_link",
];
/// Words in the names of joints of a hand.
const HAND: [&str; 8] = ["finger", "thumb", "gripper", "jaw", "knuckle", "claw", "grasp", "palm"];
/// Words in the names of finger links.
const FINGER: [&str; 5] = ["finger", "thumb", "jaw", "knuckle", "claw"];
/// Words in the names of chains that are not arms.
const NO_ARM: [&str; 12] =
    ["leg", "ankle", "foot", "toe", "wheel", "knee", "hip", "head", "neck", "camera", "caster", "sole"];

/// The arm in the mechanism; numbers are indices into its list of joints.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Base link.
    pub base: String,
    /// Tool link.
    pub tool: String,
    /// All joints from the base to the tool, including fixed ones.
    pub path: Vec<usize>,
    /// Joints moved by the motion.
    pub joints: Vec<usize>,
    /// Independently moving joints that are held, with the reason.
    pub held: Vec<(usize, &'static str)>,
    /// Choices made among several candidates, as text.
    pub choices: Vec<String>,
}

/// Whether a joint has its own coordinate and a range to move in.
fn is_free(joint: &Joint) -> bool {
    joint.kind.degrees_of_freedom() == 1 && joint.mimic.is_none() && joint.limits.lower < joint.limits.upper
}

/// Whether a joint moves, independently or as a mimic joint.
fn moves(joint: &Joint) -> bool {
    joint.kind != JointKind::Fixed
}

struct Tree<'a> {
    mechanism: &'a Mechanism,
    /// Parent joint of each link.
    above: HashMap<&'a str, usize>,
}

impl<'a> Tree<'a> {
    fn new(mechanism: &'a Mechanism) -> Self {
        let above = mechanism.joints.iter().enumerate().map(|(k, j)| (j.child.as_str(), k)).collect();
        Self { mechanism, above }
    }

    fn joint(&self, k: usize) -> &'a Joint {
        &self.mechanism.joints[k]
    }

    fn root(&self) -> Option<&'a str> {
        self.mechanism.links.iter().map(|l| l.name.as_str()).find(|link| !self.above.contains_key(link))
    }

    /// Returns the joints from the root to a link.
    fn path(&self, link: &str) -> Vec<usize> {
        let mut path = Vec::new();
        let mut at = link;
        while let (Some(&k), true) = (self.above.get(at), path.len() <= self.mechanism.joints.len()) {
            path.push(k);
            at = &self.joint(k).parent;
        }
        path.reverse();
        path
    }

    fn below(&self, link: &'a str) -> impl Iterator<Item = usize> + 'a {
        let joints = &self.mechanism.joints;
        (0..joints.len()).filter(move |&k| joints[k].parent == link)
    }

    /// Returns the links fixed to this one, itself first, in order of distance.
    fn body(&self, link: &'a str) -> Vec<&'a str> {
        let mut body = vec![link];
        let mut at = 0;
        while at < body.len() {
            body.extend(self.below(body[at]).filter(|&k| !moves(self.joint(k))).map(|k| self.joint(k).child.as_str()));
            at += 1;
        }
        body
    }

    /// Returns the moving joints that start at a link or at one fixed to it.
    fn branches(&self, link: &'a str) -> Vec<usize> {
        let body = self.body(link);
        body.into_iter().flat_map(|link| self.below(link)).filter(|&k| moves(self.joint(k))).collect()
    }
}

/// Error about a robot without a joint that has its own coordinate and a range to move in.
fn no_movable_joint(mechanism: &Mechanism) -> NewError {
    let robot = &mechanism.name;
    let why = match mechanism.joints.len() {
        0 => "it has no joints at all".to_owned(),
        1 => "its only joint is fixed, a mimic joint or without range".to_owned(),
        n => format!("all of its {n} joints are fixed, mimic joints or without range"),
    };
    NewError(format!(
        "robot {robot:?} has no joint that moves: {why}; an arm needs at least one joint of type revolute, \
         continuous or prismatic whose lower limit is below its upper one"
    ))
}

/// Returns the requested chain, or else the longest one that is an arm.
pub fn find(mechanism: &Mechanism, options: &NewOptions) -> Result<Chain, NewError> {
    let tree = Tree::new(mechanism);
    if !mechanism.joints.iter().any(is_free) {
        return Err(no_movable_joint(mechanism));
    }
    // Base and tool: requested, or the root and the end of the best chain.
    let root = tree.root().unwrap_or_default().to_owned();
    let known = |link: &String| {
        let links = || mechanism.links.iter().map(|l| l.name.as_str());
        match mechanism.link(link) {
            Some(_) => Ok(link.clone()),
            None => Err(NewError(format!("the robot has no link {link:?}; {}", did_you_mean(link, "links", links())))),
        }
    };
    let base = options.base.as_ref().map(known).transpose()?.unwrap_or(root);
    let mut choices = Vec::new();
    let tool = match &options.tool {
        Some(tool) => known(tool)?,
        None => choose_tool(&tree, &base, &mut choices)?,
    };
    // The path between them, and the joints on it that move.
    let whole = tree.path(&tool);
    let path: Vec<usize> = match whole.iter().position(|&k| tree.joint(k).parent == base) {
        Some(first) => whole[first..].to_vec(),
        None if tool == base => Vec::new(),
        None => {
            return Err(NewError(format!(
                "the tool {tool:?} is not connected to the base {base:?} by a chain of joints"
            )));
        }
    };
    let on_path: Vec<usize> = path.iter().copied().filter(|&k| is_free(tree.joint(k))).collect();
    let joints = match &options.joints {
        Some(names) => named_joints(mechanism, names)?,
        None => on_path,
    };
    if joints.is_empty() {
        let message = format!(
            "no joint moves between base {base:?} and tool {tool:?}; choose others with {} and {}",
            Setting::Base,
            Setting::Tool
        );
        return Err(NewError(message));
    }
    // All other joints that could move are held, with the reason.
    let reason = |k: usize| {
        if path.contains(&k) {
            "not requested"
        } else if whole.contains(&k) {
            "before the base of the arm"
        } else if is_of_hand(tree.joint(k)) {
            "part of a gripper or hand"
        } else {
            "not on the path from base to tool"
        }
    };
    let others = (0..mechanism.joints.len()).filter(|k| is_free(tree.joint(*k)) && !joints.contains(k));
    Ok(Chain { held: others.map(|k| (k, reason(k))).collect(), base, tool, path, joints, choices })
}

/// Returns the closest name as a question, or all names.
fn did_you_mean<'n>(found: &str, what: &str, known: impl Iterator<Item = &'n str> + Clone) -> String {
    match closest(found, known.clone()) {
        Some(name) => format!("did you mean {name:?}?"),
        None => format!("its {what} are {:?}", known.collect::<Vec<_>>()),
    }
}

/// Returns the joints with these names, in the order of the description.
fn named_joints(mechanism: &Mechanism, names: &[String]) -> Result<Vec<usize>, NewError> {
    let free = || mechanism.joints.iter().filter(|j| is_free(j)).map(|j| j.name.as_str());
    let place = |name: &String| {
        let found = mechanism.joints.iter().position(|j| j.name == *name && is_free(j));
        found.ok_or_else(|| {
            let remedy = did_you_mean(name, "joints", free());
            NewError(format!("the robot has no joint {name:?} that moves independently; {remedy}"))
        })
    };
    let mut joints = names.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    joints.sort_unstable();
    joints.dedup();
    Ok(joints)
}

/// Whether a joint belongs to a hand: by its name, or because it moves a finger. The body of a
/// gripper may be part of the arm.
fn is_of_hand(joint: &Joint) -> bool {
    let (name, child) = (joint.name.to_lowercase(), joint.child.to_lowercase());
    HAND.iter().any(|word| name.contains(word)) || FINGER.iter().any(|word| child.contains(word))
}

/// A chain that may be the arm.
struct Candidate<'a> {
    /// Last moving link.
    end: &'a str,
    /// Number of independently moving joints.
    joints: usize,
    /// Total length of the joint offsets (m).
    length: f64,
    is_arm: bool,
    tool: &'a str,
    named: bool,
}

/// Returns the tool of the longest chain that is an arm; equal ones are named in `choices`.
fn choose_tool(tree: &Tree<'_>, base: &str, choices: &mut Vec<String>) -> Result<String, NewError> {
    let mechanism = tree.mechanism;
    let is_leaf = |link: &&str| tree.below(link).next().is_none();
    let mut candidates: Vec<Candidate<'_>> = Vec::new();
    for leaf in mechanism.links.iter().map(|l| l.name.as_str()).filter(is_leaf) {
        let path = tree.path(leaf);
        let Some(first) = path.iter().position(|&k| tree.joint(k).parent == base) else { continue };
        let path = without_hand(tree, &path[first..]);
        let Some(last) = path.iter().rposition(|&k| is_free(tree.joint(k))) else { continue };
        let end = tree.joint(path[last]).child.as_str();
        if candidates.iter().any(|c| c.end == end) {
            continue;
        }
        // Rank of the chain up to its last moving joint.
        let path = &path[..=last];
        let free = path.iter().filter(|&&k| is_free(tree.joint(k)));
        let word = |joint: &Joint| {
            let names = [joint.name.to_lowercase(), joint.child.to_lowercase()];
            NO_ARM.iter().any(|word| names.iter().any(|n| n.split(['_', '-', '/']).any(|part| part.starts_with(word))))
        };
        let (tool, named) = tool_of(tree, end);
        candidates.push(Candidate {
            end,
            joints: free.count(),
            length: path.iter().map(|&k| tree.joint(k).X_PJ.translation.vector.norm()).sum(),
            is_arm: !path.iter().any(|&k| is_free(tree.joint(k)) && word(tree.joint(k))),
            tool,
            named,
        });
    }
    // Among equals, the first in the file.
    let best = candidates.iter().rev().max_by(|a, b| {
        let rank = |c: &Candidate<'_>| (c.is_arm, c.joints, c.named);
        rank(a).cmp(&rank(b)).then((1e3 * a.length).round().total_cmp(&(1e3 * b.length).round()))
    });
    let Some(best) = best else {
        return Err(NewError(format!(
            "there is no movable joint after the base {base:?}; choose another base with {}",
            Setting::Base
        )));
    };
    let equals: Vec<String> = candidates
        .iter()
        .filter(|c| c.end != best.end && c.is_arm && c.joints == best.joints && c.joints > 1)
        .map(|c| format!("{:?}", c.tool))
        .collect();
    if !equals.is_empty() {
        choices.push(format!(
            "the arm that ends at {:?} was chosen; {} others have the same number of joints, with the tools {}",
            best.tool,
            equals.len(),
            equals.join(", ")
        ));
    }
    Ok(best.tool.to_owned())
}

/// Returns the path up to the start of a hand: a finger by its name, or several short chains from
/// one body after at least three joints.
fn without_hand(tree: &Tree<'_>, path: &[usize]) -> Vec<usize> {
    let mut free = 0;
    let mut length = 0.0;
    for (place, &k) in path.iter().enumerate() {
        let joint = tree.joint(k);
        if moves(joint) {
            let fans_out = free >= 3 && {
                let body_root = path[..place].iter().rev().find(|&&k| moves(tree.joint(k)));
                let body = body_root.map_or(joint.parent.as_str(), |&k| tree.joint(k).child.as_str());
                let branches = tree.branches(body);
                branches.len() > 1 && branches.iter().all(|&k| reach(tree, k) < 0.35 * length)
            };
            if free >= 1 && (is_of_hand(joint) || fans_out) {
                return path[..place].to_vec();
            }
            free += usize::from(is_free(joint));
        }
        length += joint.X_PJ.translation.vector.norm();
    }
    path.to_vec()
}

/// Returns the maximum length of joint offsets below a joint, excluding its own (m).
fn reach(tree: &Tree<'_>, joint: usize) -> f64 {
    let mut longest = 0.0f64;
    let mut open = vec![(tree.joint(joint).child.as_str(), 0.0, 0usize)];
    while let Some((link, so_far, depth)) = open.pop() {
        longest = longest.max(so_far);
        if depth > tree.mechanism.joints.len() {
            break;
        }
        for k in tree.below(link) {
            let joint = tree.joint(k);
            open.push((&joint.child, so_far + joint.X_PJ.translation.vector.norm(), depth + 1));
        }
    }
    longest
}

/// Returns the tool frame on the body of a link, by name, or else the end of its chain of frames
/// without shape; also whether it was found by name.
fn tool_of<'a>(tree: &Tree<'a>, end: &'a str) -> (&'a str, bool) {
    let body = tree.body(end);
    let is_named = |link: &str, tool: &str| {
        let link = link.to_lowercase();
        link == tool || link.strip_suffix(tool).is_some_and(|prefix| prefix.ends_with(['_', '-', '/', ':', '.']))
    };
    for tool in TOOLS {
        if let Some(link) = body.iter().copied().find(|link| is_named(link, tool)) {
            return (link, true);
        }
    }
    // Cameras and sensors branch off; the chain without a fork after the last joint leads to the
    // tool.
    let mut at = end;
    loop {
        let mut children = tree.below(at).filter(|&k| !moves(tree.joint(k)));
        match (children.next(), children.next()) {
            (Some(k), None) => at = &tree.joint(k).child,
            _ => return (at, false),
        }
    }
}
