//! Corners, edges and faces of the element kinds, by local node index from 0.
//!
//! Not here: shape functions (`element`), the surface of a mesh (`surface.rs`).

use super::ElementKind;

/// Number of corner nodes, which come first.
pub fn corner_count(kind: ElementKind) -> usize {
    match kind {
        ElementKind::Beam2 => 2,
        ElementKind::Tet4 | ElementKind::Tet10 => 4,
        ElementKind::Wedge6 | ElementKind::Wedge15 => 6,
        ElementKind::Hex8 | ElementKind::Hex20 => 8,
    }
}

/// Edges in the order of the mid-side nodes of the second-order kind.
pub(super) const fn edges(kind: ElementKind) -> &'static [[u8; 2]] {
    match kind {
        ElementKind::Beam2 => &[],
        ElementKind::Tet4 | ElementKind::Tet10 => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
        ElementKind::Wedge6 | ElementKind::Wedge15 => {
            &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]]
        }
        ElementKind::Hex8 | ElementKind::Hex20 => {
            &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
        }
    }
}

/// Corners of the faces S1, S2, ... of Abaqus and CalculiX, counter-clockwise seen from outside.
pub(super) const fn face_corners(kind: ElementKind) -> &'static [&'static [u8]] {
    match kind {
        ElementKind::Beam2 => &[],
        ElementKind::Tet4 | ElementKind::Tet10 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]],
        ElementKind::Wedge6 | ElementKind::Wedge15 => {
            &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]]
        }
        ElementKind::Hex8 | ElementKind::Hex20 => {
            &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]
        }
    }
}

/// Whether the kind has mid-side nodes.
pub(crate) const fn is_second_order(kind: ElementKind) -> bool {
    matches!(kind, ElementKind::Tet10 | ElementKind::Hex20 | ElementKind::Wedge15)
}

/// All nodes of each face: its corners, then the mid-side nodes of its edges in order.
pub fn face_nodes(kind: ElementKind) -> Vec<Vec<u8>> {
    let middle = |a: u8, b: u8| {
        let edge = edges(kind).iter().position(|edge| *edge == [a, b] || *edge == [b, a]);
        edge.map(|edge| (corner_count(kind) + edge) as u8)
    };
    let whole = |corners: &&[u8]| {
        let mut nodes = corners.to_vec();
        if is_second_order(kind) {
            let next = corners.iter().cycle().skip(1);
            nodes.extend(corners.iter().zip(next).filter_map(|(a, b)| middle(*a, *b)));
        }
        nodes
    };
    face_corners(kind).iter().map(whole).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh::SOLIDS;

    #[test]
    fn every_edge_lies_between_two_faces_that_run_along_it_in_opposite_directions() {
        for kind in SOLIDS {
            for [a, b] in edges(kind) {
                let runs = |from: &u8, to: &u8| {
                    let along =
                        |face: &&&[u8]| (0..face.len()).any(|k| face[k] == *from && face[(k + 1) % face.len()] == *to);
                    face_corners(kind).iter().filter(along).count()
                };
                assert_eq!((runs(a, b), runs(b, a)), (1, 1), "{kind:?} {a} {b}");
            }
        }
    }

    #[test]
    fn a_second_order_face_has_as_many_mid_side_nodes_as_corners() {
        for kind in SOLIDS {
            let factor = if is_second_order(kind) { 2 } else { 1 };
            for (corners, nodes) in face_corners(kind).iter().zip(face_nodes(kind)) {
                assert_eq!(nodes.len(), factor * corners.len(), "{kind:?}");
            }
            let total = corner_count(kind) + (factor - 1) * edges(kind).len();
            assert_eq!(total, kind.nodes());
        }
    }
}
