//! Converts a first-order mesh to second order by adding a node in the middle of every edge.
//!
//! Start at [`promoted`]. Not here: how much stiffer the first order is ([`crate::order_check`]).

use std::collections::{HashMap, HashSet};

use super::faces::{corner_count, edges, is_second_order};
use super::{ElementBlock, ElementKind, Mesh};

/// Second-order mesh, and the edges of its new nodes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Promoted {
    /// Mesh with the original nodes in their order, then the new ones; edges are straight.
    pub mesh: Mesh,
    /// End nodes of the edge of each new node.
    pub ends: Vec<[u32; 2]>,
}

/// Returns the second-order counterpart of a first-order solid.
pub fn second_order(kind: ElementKind) -> Option<ElementKind> {
    match kind {
        ElementKind::Tet4 => Some(ElementKind::Tet10),
        ElementKind::Hex8 => Some(ElementKind::Hex20),
        ElementKind::Wedge6 => Some(ElementKind::Wedge15),
        _ => None,
    }
}

/// Number of nodes that [`promoted`] would add.
pub(crate) fn added_nodes(mesh: &Mesh) -> usize {
    let first = |block: &&ElementBlock| second_order(block.kind).is_some();
    let mut known = HashSet::new();
    for block in mesh.blocks.iter().filter(first) {
        for nodes in block.elements() {
            known.extend(edges(block.kind).iter().map(|edge| key(nodes, *edge)));
        }
    }
    known.len()
}

/// Adds a node in the middle of every edge of the first-order solids; second-order elements and
/// beams are unchanged.
pub(crate) fn promoted(mesh: &Mesh) -> Promoted {
    let mut this = Promoted { mesh: mesh.clone(), ends: Vec::new() };
    // Edges of second-order elements already have their node.
    let mut middle: HashMap<[u32; 2], u32> = HashMap::new();
    for block in mesh.blocks.iter().filter(|block| is_second_order(block.kind)) {
        for nodes in block.elements() {
            let middles = &nodes[corner_count(block.kind)..];
            middle.extend(edges(block.kind).iter().zip(middles).map(|(edge, node)| (key(nodes, *edge), *node)));
        }
    }
    let last = mesh.node_ids.iter().max().copied().unwrap_or(0);
    for (block, new) in mesh.blocks.iter().zip(0..) {
        let Some(kind) = second_order(block.kind) else { continue };
        let mut connectivity = Vec::with_capacity(block.len() * kind.nodes());
        for nodes in block.elements() {
            connectivity.extend(nodes);
            for edge in edges(block.kind) {
                let ends = key(nodes, *edge);
                let node = *middle.entry(ends).or_insert_with(|| {
                    let [a, b] = ends.map(|end| mesh.nodes[end as usize]);
                    this.mesh.nodes.push((a + b) * 0.5);
                    this.ends.push(ends);
                    this.mesh.node_ids.push(last.saturating_add(this.ends.len() as u64));
                    this.mesh.nodes.len() as u32 - 1
                });
                connectivity.push(node);
            }
        }
        let own: &mut ElementBlock = &mut this.mesh.blocks[new];
        (own.kind, own.connectivity) = (kind, connectivity);
    }
    this
}

fn key(nodes: &[u32], [a, b]: [u8; 2]) -> [u32; 2] {
    let (a, b) = (nodes[usize::from(a)], nodes[usize::from(b)]);
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh::cube;

    /// Truth: the mesh generated in second order.
    #[test]
    fn a_promoted_mesh_has_the_elements_of_one_made_in_second_order() {
        for kind in [ElementKind::Tet4, ElementKind::Hex8, ElementKind::Wedge6] {
            let first = cube(kind, [2, 1, 3], false, |u| u);
            let truth = cube(second_order(kind).unwrap(), [2, 1, 3], false, |u| u);
            let found = promoted(&first).mesh;
            assert_eq!((found.nodes.len(), found.blocks[0].kind), (truth.nodes.len(), truth.blocks[0].kind));
            assert_eq!(added_nodes(&first), found.nodes.len() - first.nodes.len());
            for (a, b) in found.blocks[0].elements().zip(truth.blocks[0].elements()) {
                for (a, b) in a.iter().zip(b) {
                    assert!((found.nodes[*a as usize] - truth.nodes[*b as usize]).norm() < 1e-15);
                }
            }
        }
    }
}
