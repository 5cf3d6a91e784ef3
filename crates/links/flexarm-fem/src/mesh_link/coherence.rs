//! Whether a mesh holds together: parts, misfits, hinges, cracks, and free interfaces.
//!
//! Turns what [`crate::mesh`] finds into errors and warnings with a remedy. Not here: the search
//! itself.

use crate::mesh::{Bodies, Mesh, Misfit, Part, coincident, connected_parts, misfits};
use crate::mesh_link::LinkPlan;
use crate::mesh_link::error::MeshLinkError;
use crate::reduction::{Interface, ReductionError};
use flexarm_settings::Finding;

/// Hint for removing a hinge.
const JOIN: &str = "connect bodies by whole faces (fragment or Coherence in Gmsh, a tie or merge elsewhere)";

/// Replaces a mechanism error by one with the interface name and the hinge that causes it.
pub(super) fn with_cause(error: ReductionError, plan: &LinkPlan, bodies: &Bodies) -> MeshLinkError {
    let hinges = |with: Option<[usize; 2]>| -> Vec<String> {
        let between = |bodies: [usize; 2]| with.is_none_or(|with| bodies == with);
        bodies.hinges.iter().filter(|hinge| between(hinge.bodies)).take(4).map(ToString::to_string).collect()
    };
    match error {
        ReductionError::FreeInterface { interface, direction } if interface < plan.interfaces.len() => {
            let [first, free] = [0, interface].map(|k| body_of(&plan.interfaces[k], bodies));
            let direct = hinges(Some([first.min(free), first.max(free)]));
            let list = if direct.is_empty() { hinges(None) } else { direct };
            let cause = match list.is_empty() {
                true => {
                    "its nodes are connected to nothing that resists; are they on the part that is meant?".to_owned()
                }
                false => format!("{}; this is a hinge, which carries no moment: {JOIN}", list.join("; ")),
            };
            let name = |k: usize| plan.interfaces[k].name.clone();
            MeshLinkError::FreeInterface { interface: name(interface), first: name(0), direction, cause }
        }
        ReductionError::Loose { .. } if !bodies.hinges.is_empty() => {
            MeshLinkError::Hinge { source: error, cause: format!("{}: {JOIN}", hinges(None).join("; ")) }
        }
        other => other.into(),
    }
}

/// Body with the most nodes of an interface.
fn body_of(interface: &Interface, bodies: &Bodies) -> usize {
    let mut count = vec![0_usize; bodies.elements.len()];
    for node in &interface.nodes {
        if let Some(count) = count.get_mut(bodies.of_node[*node as usize]) {
            *count += 1;
        }
    }
    (0..count.len()).rev().max_by_key(|body| count[*body]).unwrap_or(0)
}

/// Warnings about cracks and hinges in a mesh that is connected.
pub(super) fn suspicious(mesh: &Mesh, bodies: &Bodies) -> Vec<Finding> {
    let mut findings: Vec<Finding> = bodies
        .hinges
        .iter()
        .take(3)
        .map(|hinge| format!("{hinge}: they turn against each other there; {JOIN} if they are one part"))
        .map(|said| Finding::warning("hinge", "", said, ""))
        .collect();
    let found = coincident(mesh, mesh.coincidence());
    if let Some([first, _]) = found.pairs.first() {
        let p = mesh.nodes[*first as usize];
        let faces = if found.faces > 0 { format!(", {} faces lie on each other", found.faces) } else { String::new() };
        let said = format!(
            "{} pair(s) of nodes lie in one place without being one node{faces} (first: node {} at {:.6}, {:.6}, {:.6} m): a crack, which transmits no force; merge coincident nodes (Coherence in Gmsh, or merge in the reduction) if \
             the body is whole",
            found.pairs.len(),
            mesh.node_ids[*first as usize],
            p.x,
            p.y,
            p.z
        );
        findings.push(Finding::warning("coincident-nodes", "", said, "").measured(found.pairs.len() as f64, 0.0));
    }
    findings
}

/// Rejects meshes whose neighbouring elements do not fit together, with the first five pairs.
pub(super) fn check_fit(mesh: &Mesh) -> Result<(), MeshLinkError> {
    let misfits = misfits(mesh);
    if misfits.is_empty() {
        return Ok(());
    }
    let one = |m: &Misfit| format!("{} and {} ({})", m.first, m.second, m.why);
    let mut list: Vec<String> = misfits.iter().take(5).map(one).collect();
    if misfits.len() > 5 {
        list.push("...".into());
    }
    Err(MeshLinkError::Misfit { count: misfits.len(), list: list.join(", ") })
}

/// Rejects meshes of several unconnected parts, with the first six of them.
pub(super) fn check_connected(mesh: &Mesh) -> Result<(), MeshLinkError> {
    let parts = connected_parts(mesh);
    if parts.len() < 2 {
        return Ok(());
    }
    let one = |part: &Part| {
        let id = mesh.node_ids[part.node as usize];
        format!("{} elements with node {id}", part.elements)
    };
    let mut list: Vec<String> = parts.iter().take(6).map(one).collect();
    if parts.len() > 6 {
        list.push("...".into());
    }
    let coincident = coincident(mesh, mesh.coincidence()).pairs.len();
    Err(MeshLinkError::Unconnected { parts: parts.len(), list: list.join(", "), coincident })
}
