//! Checks of a mechanism: names, parents, connectivity, and inertias.
//!
//! [`check_tree`] and [`check_inertia`] return the first fault as a [`ModelError`] with the names of
//! the parts. Not here: loops (`closure`), balancers (`balancer`), modal bodies (`builder`).

use std::collections::{HashMap, HashSet};

use flexarm_settings::{OutOfRange, Quantity};

use crate::mechanism::{Joint, LinkInertia, Mechanism};
use crate::model::error::ModelError;

/// Checks names, parents and connectivity; returns the index of the base link.
pub(super) fn check_tree(mechanism: &Mechanism) -> Result<usize, ModelError> {
    if mechanism.links.is_empty() {
        return Err(ModelError::Structure(format!(
            "mechanism {:?} has no links: add at least a base link",
            mechanism.name
        )));
    }
    let mut parent_of: HashMap<&str, Option<&str>> = HashMap::new();
    for link in &mechanism.links {
        if parent_of.insert(&link.name, None).is_some() {
            return Err(ModelError::duplicate("link", &link.name));
        }
    }
    let mut names = HashSet::new();
    for joint in &mechanism.joints {
        if !names.insert(joint.name.as_str()) {
            return Err(ModelError::duplicate("joint", &joint.name));
        }
        for link in [&joint.parent, &joint.child] {
            if !parent_of.contains_key(link.as_str()) {
                let message = format!("joint {:?} refers to link {link:?}, which does not exist", joint.name);
                return Err(ModelError::Structure(message));
            }
        }
        if let Some(first) = parent_of.insert(&joint.child, Some(&joint.name)).flatten() {
            let (link, second) = (&joint.child, &joint.name);
            return Err(ModelError::Structure(format!(
                "link {link:?} is the child of both joint {first:?} and joint {second:?}: a tree has one parent each"
            )));
        }
    }

    // Links that cannot be reached from a link without parent are on a cycle.
    let roots: Vec<usize> =
        (0..mechanism.links.len()).filter(|&i| parent_of[mechanism.links[i].name.as_str()].is_none()).collect();
    let children = children_of_links(mechanism);
    let mut reached: HashSet<&str> = HashSet::new();
    let mut open: Vec<&str> = roots.iter().map(|&i| mechanism.links[i].name.as_str()).collect();
    while let Some(link) = open.pop() {
        reached.insert(link);
        open.extend(children.get(link).into_iter().flatten().map(|j| j.child.as_str()));
    }
    let names = mechanism.links.iter().map(|link| link.name.as_str());
    let looped: Vec<&str> = names.filter(|name| !reached.contains(name)).collect();
    if !looped.is_empty() {
        return Err(ModelError::Structure(format!("links {looped:?} form a loop: open it at one joint")));
    }
    if roots.len() > 1 {
        let bases: Vec<&String> = roots.iter().map(|&i| &mechanism.links[i].name).collect();
        return Err(ModelError::Structure(format!(
            "the links form {} separate parts with bases {bases:?}: connect them by joints",
            bases.len()
        )));
    }
    Ok(roots[0])
}

/// Child joints of each link, in source order.
pub(super) fn children_of_links(mechanism: &Mechanism) -> HashMap<&str, Vec<&Joint>> {
    let mut children: HashMap<&str, Vec<&Joint>> = HashMap::new();
    for joint in &mechanism.joints {
        children.entry(&joint.parent).or_default().push(joint);
    }
    children
}

/// Relative tolerance for negative principal moments of inertia. Files have six significant digits;
/// anything below is an error, not rounding.
const MOMENT_TOLERANCE: f64 = 1e-6;

/// Magnitude of a negative principal moment of inertia that is accepted as rounding (kg m²).
///
/// ```text
/// floor = 1e-6 |I| + m (1 um)^2 + 1e-20 kg m^2
/// ```
/// * `mass`: mass (kg); `largest`: principal moment of largest magnitude (kg m²).
pub fn moment_floor(mass: f64, largest: f64) -> f64 {
    MOMENT_TOLERANCE * largest.abs() + 1e-12 * mass.abs() + 1e-20
}

pub(super) fn out_of_range(part: &'static str, name: &str, what: OutOfRange) -> ModelError {
    ModelError::Value(format!("{part} {name:?}: {what}"))
}

/// Checks that the inertia is finite and physically possible. The inertia of fixed links has no
/// effect, so only finiteness is checked for them.
pub(super) fn check_inertia(link: &str, inertia: &LinkInertia, moves: bool) -> Result<(), ModelError> {
    let finite =
        inertia.mass.is_finite() && inertia.com.iter().chain(inertia.inertia_com.iter()).all(|x| x.is_finite());
    if !finite {
        return Err(ModelError::not_finite("inertia", link));
    }
    if !moves {
        return Ok(());
    }
    let impossible =
        |what: &str, value: f64| Err(ModelError::Value(format!("link {link:?}: {what} is {value}, which no body has")));
    if inertia.mass < 0.0 {
        return impossible("mass [kg]", inertia.mass);
    }
    Quantity::MASS.check("mass", inertia.mass).map_err(|what| out_of_range("link", link, what))?;
    Quantity::LENGTH.check_all("centre of mass", &inertia.com).map_err(|what| out_of_range("link", link, what))?;
    Quantity::INERTIA.check_all("inertia", &inertia.inertia_com).map_err(|what| out_of_range("link", link, what))?;
    // Principal moments may be negative by rounding only.
    let moments = inertia.inertia_com.symmetric_eigenvalues();
    let smallest = moments.min();
    if smallest < -moment_floor(inertia.mass, moments.amax()) {
        return impossible("smallest principal moment of inertia [kg m²]", smallest);
    }
    Ok(())
}
