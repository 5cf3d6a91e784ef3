//! Finds elements of different kinds that do not fit together at their common faces.
//!
//! A mesh with several kinds can share corner nodes and still be incompatible: a first-order face
//! on a second-order one leaves the mid-side nodes hanging, a quadrilateral on two triangles its
//! diagonal. Both make the link softer without any other symptom.

use std::collections::HashMap;

use super::Mesh;
use super::faces::is_second_order;
use super::surface::{FaceRef, for_each_face, skin};

/// Two elements with a common face that do not fit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misfit {
    /// Kind and number in the file of the first element.
    pub first: String,
    /// Kind and number in the file of the second element.
    pub second: String,
    /// Reason why they do not fit.
    pub why: &'static str,
}

/// Finds pairs of elements that share corners of a face but not the face; none if all are of one
/// kind.
pub fn misfits(mesh: &Mesh) -> Vec<Misfit> {
    let solids: Vec<_> = mesh.blocks.iter().filter(|block| !block.kind.is_beam() && !block.is_empty()).collect();
    if solids.windows(2).all(|pair| pair[0].kind == pair[1].kind) {
        return Vec::new();
    }
    let name = |block: usize, element: usize| {
        let block = &mesh.blocks[block];
        format!("{} {}", block.kind.name(), block.ids[element])
    };
    let mut found = Vec::new();

    // Same corners, different order.
    let mut first: HashMap<[u32; 4], FaceRef> = HashMap::new();
    for_each_face(&mesh.blocks, |face, key| match first.entry(key) {
        std::collections::hash_map::Entry::Vacant(place) => {
            place.insert(face);
        }
        std::collections::hash_map::Entry::Occupied(other) => {
            let other = other.get();
            let order = |face: &FaceRef| is_second_order(mesh.blocks[face.block as usize].kind);
            if order(&face) != order(other) {
                found.push(Misfit {
                    first: name(other.block as usize, other.element as usize),
                    second: name(face.block as usize, face.element as usize),
                    why: "one has mid-side nodes on the face that they share, the other has not",
                });
            }
        }
    });
    drop(first);

    // A triangle on half of a quadrilateral.
    let skin = skin(mesh);
    let mut halves: HashMap<[u32; 3], (usize, usize)> = HashMap::new();
    for face in skin.faces().filter(|face| face.corners.len() == 4) {
        for left_out in 0..4 {
            let mut corners: Vec<u32> = (0..4).filter(|k| *k != left_out).map(|k| face.corners[k]).collect();
            corners.sort_unstable();
            halves.insert([corners[0], corners[1], corners[2]], (face.block, face.element));
        }
    }
    for face in skin.faces().filter(|face| face.corners.len() == 3) {
        let mut corners = [face.corners[0], face.corners[1], face.corners[2]];
        corners.sort_unstable();
        if let Some((block, element)) = halves.get(&corners) {
            found.push(Misfit {
                first: name(*block, *element),
                second: name(face.block, face.element),
                why: "a triangle covers half of a quadrilateral",
            });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ElementBlock, ElementKind};
    use crate::test_mesh::cube;

    fn beside(kind: ElementKind, other: ElementKind) -> Mesh {
        // Two unit cubes with a common face, nodes merged by position.
        let left = cube(kind, [1, 1, 1], false, |u| u);
        let right = cube(other, [1, 1, 1], false, |u| u + nalgebra::Vector3::x());
        let mut mesh = left.clone();
        let place: Vec<u32> = right
            .nodes
            .iter()
            .map(|p| {
                let known = mesh.nodes.iter().position(|q| (p - q).norm() < 1e-9);
                known.unwrap_or_else(|| {
                    mesh.nodes.push(*p);
                    mesh.node_ids.push(mesh.nodes.len() as u64);
                    mesh.nodes.len() - 1
                }) as u32
            })
            .collect();
        let block = &right.blocks[0];
        let connectivity = block.connectivity.iter().map(|n| place[*n as usize]).collect();
        let ids = block.ids.iter().map(|id| id + 100).collect();
        mesh.blocks.push(ElementBlock { ids, connectivity, ..block.clone() });
        mesh
    }

    #[test]
    fn elements_that_do_not_fit_are_named() {
        let orders = misfits(&beside(ElementKind::Hex8, ElementKind::Hex20));
        assert_eq!(orders.len(), 1);
        assert!(orders[0].first == "HEX8 1" && orders[0].second == "HEX20 101", "{orders:?}");
        let halves = misfits(&beside(ElementKind::Hex8, ElementKind::Tet4));
        assert_eq!(halves.len(), 2, "{halves:?}");
    }

    #[test]
    fn elements_that_fit_are_let_through() {
        assert!(misfits(&beside(ElementKind::Hex8, ElementKind::Hex8)).is_empty());
        // The wedges have their quadrilaterals on the left.
        assert!(misfits(&beside(ElementKind::Hex20, ElementKind::Wedge15)).is_empty());
    }
}
