//! Placement of the balancers of a mechanism on the bodies of the tree: names become bodies, points
//! and coordinates.
//!
//! Points are `p_BoP_B`, of a point P in the axes of its body B (m); over a joint x is
//! `Σ c_i q_i + x_0`. Not here: force and energy of the law (`law.rs`, `forces.rs`).

use std::collections::HashSet;

use crate::balancer::placed::{BalancerPlace, PlacedBalancer};
use crate::balancer::{Balancer, BalancerSpan};
use crate::mechanism::Mechanism;
use crate::model::{Body, Frame, JointMotion, ModelError};

/// Places the balancers of a mechanism on its bodies.
///
/// # Errors
/// [`ModelError`] with the name of the balancer.
pub(crate) fn place_balancers(
    mechanism: &Mechanism,
    frames: &[Frame],
    bodies: &[Body],
    nv: usize,
) -> Result<Vec<PlacedBalancer>, ModelError> {
    let mut names = HashSet::new();
    let mut placed = Vec::new();
    for Balancer { name, span, law } in &mechanism.balancers {
        if !names.insert(name) {
            return Err(ModelError::duplicate("balancer", name));
        }
        if !law.is_finite() {
            return Err(ModelError::not_finite("law of balancer", name));
        }
        // Ends of the balancer: two points on bodies, or the sum of the coordinates over its joint.
        let fail = |what: &str| ModelError::Structure(format!("balancer {name:?}: {what} is not in the robot"));
        let frame =
            |link: &String, what: &'static str| frames.iter().find(|f| f.name == *link).ok_or_else(|| fail(what));
        let place = match span {
            BalancerSpan::Points { from, to } => {
                let ends = [frame(from, "the link at its first end")?, frame(to, "the link at its second end")?];
                BalancerPlace::Points(ends.map(|f| (f.body, f.X_BF.translation.vector)))
            }
            BalancerSpan::Joint { joint, child } => {
                let last = frame(child, "the link behind its joint")?.body;
                let place = over_joint(bodies, joint, last).ok_or_else(|| fail("its joint"))?;
                if matches!(&place, BalancerPlace::Joint { terms, .. } if terms.iter().any(|(k, _)| *k >= nv)) {
                    return Err(ModelError::BadLoop {
                        name: name.clone(),
                        what: format!(
                            "balancer {name:?} acts over joint {joint:?}, which follows from a loop: give its two ends (from, to) instead"
                        ),
                    });
                }
                place
            }
        };
        placed.push(PlacedBalancer { name: name.clone(), law: law.clone(), place });
    }
    Ok(placed)
}

/// Sums over the bodies from `child` inward to that of the joint: each contributes its rotation (or
/// translation) projected on the joint axis.
fn over_joint(bodies: &[Body], joint: &str, child: usize) -> Option<BalancerPlace> {
    let first = bodies.iter().skip(1).position(|b| b.joint == joint)? + 1;
    let JointMotion::Axis(motion) = bodies[first].motion else { return None };
    let (axis, slides) = (motion.axis(), motion.slides());
    let (mut terms, mut offset) = (Vec::new(), 0.0);
    let mut i = child;
    loop {
        let body = &bodies[i];
        // A joint contributes the share of its axis along that of the balancer's joint.
        match body.motion {
            JointMotion::Axis(motion) => {
                let share = motion.axis().dot(&axis);
                terms.push((body.coordinate, share * body.ratio));
                offset += share * body.offset;
            }
            JointMotion::Elastic(_) => {
                let k = body.coordinate + if slides { 0 } else { 3 };
                terms.extend(axis.iter().enumerate().map(|(c, share)| (k + c, *share)));
            }
            JointMotion::Welded | JointMotion::Interface { .. } => return None,
        }
        if i == first {
            break;
        }
        i = body.parent;
        if i < first {
            return None;
        }
    }
    terms.retain(|(_, c)| *c != 0.0);
    Some(BalancerPlace::Joint {
        terms,
        offset,
        parent: bodies[first].parent,
        body: first,
        child,
        axis: motion.twist(1.0),
    })
}
