//! Assignment of child joints to the interfaces of a link, by the nearest position (link axes, m).

use flexarm_kinematics::{Mechanism, Pose};
use nalgebra::Vector3;

use crate::substitute::FlexibleLink;

/// Joint at an interface of a link other than its proximal and distal ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BranchJoint {
    /// Name of the joint.
    pub joint: String,
    /// Name of the interface.
    pub interface: String,
}

/// Returns the child joints of the link whose nearest interface is neither of its two ends.
///
/// Rigid parts with springs represent the two ends only: a joint elsewhere would be rigidly
/// attached to one of the parts, with errors up to a factor of two. Empty for links without data on
/// other interfaces.
pub fn branch_joints(mechanism: &Mechanism, link: &FlexibleLink) -> Vec<BranchJoint> {
    let others = other_interfaces(link);
    let ends = [&link.reduced.X_LA, &link.reduced.X_LB].map(|X| X.translation.vector);
    let children = mechanism.child_joints(&link.link).filter(|joint| link.distal.as_ref() != Some(&joint.name));
    let branch = children.filter_map(|joint| {
        let p = joint.X_PJ.translation.vector;
        let places = ends.iter().chain(others.iter().map(|(_, place)| place));
        let interface = nearest(&p, places)?.checked_sub(ends.len())?;
        Some(BranchJoint { joint: joint.name.clone(), interface: others[interface].0.to_owned() })
    });
    branch.collect()
}

/// Names and positions of the interfaces beyond the first two.
fn other_interfaces(link: &FlexibleLink) -> Vec<(&str, Vector3<f64>)> {
    let place = |X: &Pose| X.translation.vector;
    let Some(details) = &link.reduced.details else { return Vec::new() };
    match (&details.modal, &details.superelement) {
        (Some(modal), _) => modal.interfaces.iter().skip(1).map(|i| (i.name.as_str(), place(&i.X_LI))).collect(),
        (None, Some(element)) => element.interfaces.iter().skip(2).map(|i| (i.name.as_str(), place(&i.X_LI))).collect(),
        (None, None) => Vec::new(),
    }
}

/// Index of the position nearest to `p`, the first one of several.
pub(crate) fn nearest<'a>(p: &Vector3<f64>, places: impl Iterator<Item = &'a Vector3<f64>>) -> Option<usize> {
    let distances = places.map(|place| (place - p).norm()).enumerate();
    distances.reduce(|best, next| if next.1 < best.1 { next } else { best }).map(|(k, _)| k)
}
