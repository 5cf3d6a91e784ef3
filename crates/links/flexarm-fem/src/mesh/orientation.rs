//! Reverses elements with inverted node order, as after a mirrored import, if all of a kind are.
//!
//! Start at [`turn_reversed`]. Not here: single inverted elements, which the assembly refuses
//! ([`crate::model::AssemblyError`]).

use nalgebra::Vector3;

use super::faces::{corner_count, edges, is_second_order};
use super::{ElementBlock, ElementKind, Mesh};
use crate::element::jacobian_range;

/// Reverses the elements of every kind of which all are inverted; returns a message for each such
/// kind.
///
/// Single inverted elements among valid ones are left: they are folded, not reversed.
pub fn turn_reversed(mesh: &mut Mesh) -> Vec<String> {
    let mut said = Vec::new();
    let mut kinds: Vec<ElementKind> =
        mesh.blocks.iter().filter(|block| !block.kind.is_beam()).map(|block| block.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    for kind in kinds {
        let of_kind = |block: &&ElementBlock| block.kind == kind;
        let mut x = vec![Vector3::zeros(); kind.nodes()];
        let mut is_reversed = |nodes: &[u32]| {
            x.iter_mut().zip(nodes).for_each(|(x, node)| *x = mesh.nodes[*node as usize]);
            jacobian_range(kind, &x).mean < 0.0
        };
        // The first valid element ends the search.
        if !mesh.blocks.iter().filter(of_kind).all(|block| block.elements().all(&mut is_reversed)) {
            continue;
        }
        let order = reversed(kind);
        let mut count = 0;
        for block in mesh.blocks.iter_mut().filter(|block| block.kind == kind) {
            count += block.len();
            for nodes in block.connectivity.chunks_exact_mut(kind.nodes()) {
                let old = nodes.to_vec();
                nodes.iter_mut().zip(&order).for_each(|(node, from)| *node = old[*from]);
            }
        }
        if count > 0 {
            said.push(format!(
                "all {count} {} elements were inside out (negative volume): their node order was reversed and has been \
                 turned; was the mesh mirrored, or written in another order of nodes?",
                kind.name()
            ));
        }
    }
    said
}

/// Old node index at each position of the mirrored element.
fn reversed(kind: ElementKind) -> Vec<usize> {
    let corners: Vec<usize> = match kind {
        ElementKind::Tet4 | ElementKind::Tet10 => vec![1, 0, 2, 3],
        ElementKind::Wedge6 | ElementKind::Wedge15 => vec![3, 4, 5, 0, 1, 2],
        ElementKind::Hex8 | ElementKind::Hex20 => vec![4, 5, 6, 7, 0, 1, 2, 3],
        ElementKind::Beam2 => vec![0, 1],
    };
    let mut order = corners.clone();
    if is_second_order(kind) {
        for [a, b] in edges(kind) {
            let (a, b) = (corners[usize::from(*a)] as u8, corners[usize::from(*b)] as u8);
            let old = edges(kind).iter().position(|edge| *edge == [a, b] || *edge == [b, a]);
            order.push(corner_count(kind) + old.unwrap_or(0));
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh::{SOLIDS, cube, positions};

    /// Truth: the volume of the cube; nothing is reversed a second time.
    #[test]
    fn a_mirrored_mesh_has_positive_volume_again_after_turning() {
        for kind in SOLIDS {
            let sound = cube(kind, [2, 1, 1], false, |u| u);
            let mut mirrored = sound.clone();
            mirrored.nodes.iter_mut().for_each(|p| p.x = -p.x);
            let said = turn_reversed(&mut mirrored);
            assert_eq!(said.len(), 1, "{kind:?}");
            let volume = |mesh: &Mesh| -> f64 {
                let det = |nodes: &[u32]| jacobian_range(kind, &positions(mesh, nodes)).mean;
                mesh.blocks[0].elements().map(det).sum()
            };
            assert!((volume(&mirrored) / volume(&sound) - 1.0).abs() < 1e-12, "{kind:?}"); // measured 2e-16
            // Mid-side nodes are still in the middle of their edges.
            for nodes in mirrored.blocks[0].elements() {
                let x = positions(&mirrored, nodes);
                assert!(jacobian_range(kind, &x).min_node > 1.0 - 1e-12, "{kind:?}");
            }
            assert!(turn_reversed(&mut mirrored).is_empty() && turn_reversed(&mut sound.clone()).is_empty());
        }
    }

    #[test]
    fn one_folded_element_among_sound_ones_is_left_for_the_assembly_to_refuse() {
        let mut mesh = cube(ElementKind::Tet4, [1, 1, 1], false, |u| u);
        mesh.blocks[0].connectivity.swap(0, 1);
        assert!(turn_reversed(&mut mesh).is_empty());
    }
}
