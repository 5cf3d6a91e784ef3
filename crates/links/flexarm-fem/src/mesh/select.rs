//! Selection of the nodes of an interface: by set, by position, or both.
//!
//! Start at [`select`]. Positions in m, mesh axes; lengths of the selector in the unit of the mesh
//! file.
//!
//! Not here: text and tables of a selector (`selector`), ties ([`crate::reduction::Boundary`]).

use std::cmp::Reverse;

use nalgebra::Vector3;

use super::selector::NodeSelector;
use super::surface::skin;
use super::{ElementKind, Mesh};

/// Default tolerance of positions, relative to the diagonal of the mesh.
const TOLERANCE: f64 = 1e-6;

/// Errors of node selection. Lengths in the unit of the mesh file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SelectError {
    /// There is no node set of that name.
    #[error("there is no node set {name:?}; {known}")]
    UnknownSet {
        /// Requested name.
        name: String,
        /// Existing sets with their sizes, closest spelling first.
        known: String,
    },
    /// Several sets match the name except for upper and lower case.
    #[error("{name:?} may be any of {candidates:?}: give the exact spelling")]
    Ambiguous {
        /// Requested name.
        name: String,
        /// Matching sets.
        candidates: Vec<String>,
    },
    /// A direction is zero, a radius negative, a box inverted, or a number not finite.
    #[error("{selector}: {what} is {found}, allowed is {allowed}")]
    Geometry {
        /// Term with the error.
        selector: String,
        /// Part of the term.
        what: &'static str,
        /// Value of that part.
        found: String,
        /// Allowed values.
        allowed: &'static str,
    },
    /// No node of the skin is close enough.
    #[error(
        "{selector} chooses no node: the nearest node of the surface is {nearest_id} at {distance:.3e}, allowed are \
         {tolerance:.3e} (units of the mesh file); are place and unit right, or is a larger tolerance needed?"
    )]
    NothingNear {
        /// Term without nodes.
        selector: String,
        /// Number of the nearest node.
        nearest_id: u64,
        /// Distance of the nearest node.
        distance: f64,
        /// Maximum allowed distance.
        tolerance: f64,
    },
    /// Every term selects nodes, but no node is in all of them, or none belongs to an element.
    #[error("{selector} chooses no node: {reason}")]
    Nothing {
        /// The selector.
        selector: String,
        /// Reason.
        reason: String,
    },
}

/// Selects nodes; returns their indices, sorted, at least one.
///
/// Only nodes of elements are selected; by position only nodes of the skin and of beams.
///
/// * `length_unit`: unit of the lengths in `selector`, m: that of the mesh file.
///
/// # Errors
/// [`SelectError`], also if the selection is empty.
pub fn select(mesh: &Mesh, selector: &NodeSelector, length_unit: f64) -> Result<Vec<u32>, SelectError> {
    let used = mesh.used_nodes();
    let diagonal = mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).norm());
    let mut chooser = Chooser { mesh, used, unit: length_unit, tolerance: TOLERANCE * diagonal, outside: None };
    chooser.choose(selector)
}

/// Evaluation of selectors on one mesh.
struct Chooser<'a> {
    mesh: &'a Mesh,
    used: Vec<bool>,
    /// Unit of lengths, m.
    unit: f64,
    /// Default tolerance, m.
    tolerance: f64,
    /// Nodes of skin and beams, computed on first use.
    outside: Option<Vec<u32>>,
}

impl Chooser<'_> {
    /// Nodes of a selector, sorted.
    fn choose(&mut self, selector: &NodeSelector) -> Result<Vec<u32>, SelectError> {
        match selector {
            NodeSelector::Set(name) => self.set(name),
            NodeSelector::Plane { point, normal, tolerance } => {
                let (p, n) = (self.position(selector, point)?, direction(selector, "the normal", normal)?);
                self.near(selector, *tolerance, |x| (x - p).dot(&n).abs())
            }
            NodeSelector::Cylinder { point, axis, radius, tolerance } => {
                let (p, a) = (self.position(selector, point)?, direction(selector, "the axis", axis)?);
                let radius = size(selector, "the radius", *radius)? * self.unit;
                self.near(selector, *tolerance, |x| ((x - p).cross(&a).norm() - radius).abs())
            }
            NodeSelector::Box { min, max, tolerance } => {
                let (low, high) = (self.position(selector, min)?, self.position(selector, max)?);
                if (0..3).any(|k| low[k] > high[k]) {
                    let found = format!("{min:?} to {max:?}");
                    return Err(geometry(selector, "the box", found, "min up to max along every axis"));
                }
                // Distance from the box, zero inside.
                self.near(selector, *tolerance, |x| (x - x.sup(&low).inf(&high)).norm())
            }
            NodeSelector::All(terms) => self.all(selector, terms),
        }
    }

    /// Nodes that are in every term.
    fn all(&mut self, selector: &NodeSelector, terms: &[NodeSelector]) -> Result<Vec<u32>, SelectError> {
        let mut common: Option<Vec<u32>> = None;
        let mut counts = Vec::new();
        for term in terms {
            let nodes = self.choose(term)?;
            counts.push(format!("{term}: {}", nodes.len()));
            common = Some(match common {
                None => nodes,
                Some(before) => before.into_iter().filter(|node| nodes.binary_search(node).is_ok()).collect(),
            });
        }
        common.filter(|nodes| !nodes.is_empty()).ok_or_else(|| SelectError::Nothing {
            selector: selector.to_string(),
            reason: match counts.as_slice() {
                [] => "it has no terms".into(),
                _ => format!("no node is in all of its terms; nodes in each: {}", counts.join(", ")),
            },
        })
    }

    /// Looks up a node set by exact name, or by the only name that differs in upper and lower case.
    fn set(&self, name: &str) -> Result<Vec<u32>, SelectError> {
        let sets = &self.mesh.node_sets;
        let nodes = match sets.get(name) {
            Some(nodes) => nodes,
            None => {
                let same = |known: &&String| known.to_lowercase() == name.to_lowercase();
                let candidates: Vec<&String> = sets.keys().filter(same).collect();
                match candidates.as_slice() {
                    [] => return Err(SelectError::UnknownSet { name: name.into(), known: self.known(name) }),
                    [one] => &sets[*one],
                    more => {
                        let candidates = more.iter().map(|known| (*known).clone()).collect();
                        return Err(SelectError::Ambiguous { name: name.into(), candidates });
                    }
                }
            }
        };
        let nodes: Vec<u32> = nodes.iter().copied().filter(|node| self.used[*node as usize]).collect();
        if nodes.is_empty() {
            let reason = "none of the nodes of the set belongs to an element".into();
            return Err(SelectError::Nothing { selector: name.into(), reason });
        }
        Ok(nodes)
    }

    /// Lists the existing sets for an error message.
    fn known(&self, name: &str) -> String {
        const MAX: usize = 12;
        let lower = name.to_lowercase();
        let is_region = self.mesh.regions.iter().any(|region| region.name.to_lowercase() == lower);
        let remark = if is_region {
            format!("{name:?} is a set of elements: name a set of nodes or a place such as plane(...); ")
        } else {
            String::new()
        };
        let mut sets: Vec<(&String, usize)> =
            self.mesh.node_sets.iter().map(|(set, nodes)| (set, nodes.len())).collect();
        if sets.is_empty() {
            return format!("{remark}the mesh has no node sets: choose by place, such as plane(0,0,0; 1,0,0)");
        }
        sets.sort_by_cached_key(|(set, size)| (strsim::levenshtein(&lower, &set.to_lowercase()), Reverse(*size)));
        let shown: Vec<String> = sets.iter().take(MAX).map(|(set, size)| format!("{set:?} ({size} nodes)")).collect();
        let more = sets.len().saturating_sub(MAX);
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{remark}known are {}{rest}", shown.join(", "))
    }

    /// Nodes of the skin and of beams within `tolerance` of a place.
    ///
    /// * `tolerance`: in the unit of lengths; `distance`: of a point from the place, both m.
    fn near(
        &mut self,
        selector: &NodeSelector,
        tolerance: Option<f64>,
        distance: impl Fn(&Vector3<f64>) -> f64,
    ) -> Result<Vec<u32>, SelectError> {
        let tolerance = match tolerance {
            Some(tolerance) => size(selector, "the tolerance", tolerance)? * self.unit,
            None => self.tolerance,
        };
        let mesh = self.mesh;
        let outside = self.outside.get_or_insert_with(|| outside(mesh));
        let with_distance = outside.iter().map(|node| (*node, distance(&mesh.nodes[*node as usize])));
        let (mut chosen, mut nearest) = (Vec::new(), (0, f64::INFINITY));
        for (node, d) in with_distance {
            if d <= tolerance {
                chosen.push(node);
            }
            nearest = if d < nearest.1 { (node, d) } else { nearest };
        }
        if chosen.is_empty() {
            return Err(SelectError::NothingNear {
                selector: selector.to_string(),
                nearest_id: mesh.node_ids.get(nearest.0 as usize).copied().unwrap_or(0),
                distance: nearest.1 / self.unit,
                tolerance: tolerance / self.unit,
            });
        }
        Ok(chosen)
    }

    fn position(&self, selector: &NodeSelector, p: &[f64; 3]) -> Result<Vector3<f64>, SelectError> {
        if p.iter().all(|x| x.is_finite()) {
            return Ok(Vector3::from(*p) * self.unit);
        }
        Err(geometry(selector, "a point", format!("{p:?}"), "three finite numbers"))
    }
}

/// Nodes of the skin and of beams, sorted.
fn outside(mesh: &Mesh) -> Vec<u32> {
    let mut nodes = skin(mesh).nodes();
    let beams = mesh.blocks.iter().filter(|block| block.kind == ElementKind::Beam2);
    nodes.extend(beams.flat_map(|block| &block.connectivity));
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

fn geometry(selector: &NodeSelector, what: &'static str, found: String, allowed: &'static str) -> SelectError {
    SelectError::Geometry { selector: selector.to_string(), what, found, allowed }
}

fn direction(selector: &NodeSelector, what: &'static str, v: &[f64; 3]) -> Result<Vector3<f64>, SelectError> {
    let length = Vector3::from(*v).norm();
    if length > 0.0 && length.is_finite() {
        return Ok(Vector3::from(*v) / length);
    }
    Err(geometry(selector, what, format!("{v:?}"), "a direction with a finite length above zero"))
}

fn size(selector: &NodeSelector, what: &'static str, value: f64) -> Result<f64, SelectError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(geometry(selector, what, value.to_string(), "zero or a positive finite number"))
}
