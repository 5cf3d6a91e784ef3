//! Bodies of a mesh that are connected only in a point or along an edge: hinges, which carry no
//! moment.

use std::collections::{BTreeMap, HashMap};

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::surface::{FaceRef, for_each_face};
use super::{ElementBlock, Mesh};

/// Two bodies that share nodes but no face.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hinge {
    /// Number of elements of the larger body, and the number in the file of one of them.
    pub first: (usize, u64),
    /// The same for the smaller body.
    pub second: (usize, u64),
    /// Numbers in the file of the shared nodes, ascending.
    pub node_ids: Vec<u64>,
    /// Arrangement of these nodes: `"one point"`, `"on a line"`, or `"in several places"`.
    pub shape: &'static str,
    /// The two bodies, as indices from the largest.
    pub bodies: [usize; 2],
}

/// Bodies connected through faces, and the hinges between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bodies {
    /// Body of each node, as an index from the largest; the larger body for a shared node,
    /// `usize::MAX` for a node without element.
    pub of_node: Vec<usize>,
    /// Number of elements of each body.
    pub elements: Vec<usize>,
    /// Pairs of bodies that share nodes but no face.
    pub hinges: Vec<Hinge>,
}

/// Finds bodies of solids connected through faces, and the hinges between them.
///
/// A beam joins everything that it touches; whether its ends are restrained there is checked by the
/// stiffness.
pub fn bodies(mesh: &Mesh) -> Bodies {
    let offsets: Vec<usize> =
        mesh.blocks.iter().scan(0, |sum, b| Some(std::mem::replace(sum, *sum + b.len()))).collect();
    let roots = first_elements(mesh, &offsets);

    // Bodies by size; of equal ones the one with the smaller element index first.
    let mut sizes: BTreeMap<usize, usize> = BTreeMap::new();
    roots.iter().for_each(|root| *sizes.entry(*root).or_insert(0) += 1);
    let mut order: Vec<(usize, usize)> = sizes.into_iter().collect();
    order.sort_by_key(|(root, size)| (std::cmp::Reverse(*size), *root));
    let rank: HashMap<usize, usize> = order.iter().enumerate().map(|(rank, (root, _))| (*root, rank)).collect();

    let mut of_node = vec![usize::MAX; mesh.nodes.len()];
    let mut shared: BTreeMap<[usize; 2], Vec<u32>> = BTreeMap::new();
    for (element, _, nodes) in elements(mesh, &offsets) {
        let body = rank[&roots[element]];
        for node in nodes {
            let before = of_node[*node as usize];
            of_node[*node as usize] = before.min(body);
            if before != usize::MAX && before != body {
                shared.entry([before.min(body), before.max(body)]).or_default().push(*node);
            }
        }
    }
    let name = |body: usize| {
        let (root, size) = order[body];
        let block = offsets.partition_point(|start| *start <= root) - 1;
        (size, mesh.blocks[block].ids[root - offsets[block]])
    };
    let hinge = |(bodies, mut nodes): ([usize; 2], Vec<u32>)| {
        nodes.sort_unstable();
        nodes.dedup();
        let shape = shape(&nodes.iter().map(|node| mesh.nodes[*node as usize]).collect::<Vec<_>>());
        let node_ids = nodes.iter().map(|node| mesh.node_ids[*node as usize]).collect();
        Hinge { first: name(bodies[0]), second: name(bodies[1]), node_ids, shape, bodies }
    };
    let hinges = shared.into_iter().map(hinge).collect();
    Bodies { of_node, elements: order.iter().map(|(_, size)| *size).collect(), hinges }
}

/// Elements with their index in the mesh, their block and their nodes.
fn elements<'a>(mesh: &'a Mesh, offsets: &'a [usize]) -> impl Iterator<Item = (usize, &'a ElementBlock, &'a [u32])> {
    let blocks = mesh.blocks.iter().zip(offsets);
    blocks.flat_map(|(block, start)| (*start..).zip(block.elements()).map(move |(e, nodes)| (e, block, nodes)))
}

/// Returns the first element of the body of each element.
fn first_elements(mesh: &Mesh, offsets: &[usize]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..mesh.element_count()).collect();
    let index = |face: &FaceRef| offsets[face.block as usize] + face.element as usize;
    let mut first: HashMap<[u32; 4], usize> = HashMap::new();
    for_each_face(&mesh.blocks, |face, key| {
        let element = index(&face);
        let other = *first.entry(key).or_insert(element);
        join(&mut parent, element, other);
    });
    drop(first);
    let mut at_beam = vec![usize::MAX; mesh.nodes.len()];
    for (element, _, nodes) in elements(mesh, offsets).filter(|(_, block, _)| block.kind.is_beam()) {
        for node in nodes {
            let other = &mut at_beam[*node as usize];
            *other = (*other).min(element);
            join(&mut parent, element, *other);
        }
    }
    for (element, _, nodes) in elements(mesh, offsets) {
        for node in nodes.iter().filter(|node| at_beam[**node as usize] != usize::MAX) {
            join(&mut parent, element, at_beam[*node as usize]);
        }
    }
    (0..parent.len()).map(|element| root(&mut parent, element)).collect()
}

impl std::fmt::Display for Hinge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ((large, a), (small, b)) = (self.first, self.second);
        let nodes = flexarm_settings::listed(&self.node_ids);
        write!(
            f,
            "the body of {large} elements with element {a} and that of {small} with element {b} share {} node(s) ({nodes}), \
             which are {}, and no face",
            self.node_ids.len(),
            self.shape
        )
    }
}

/// Arrangement of points, from their principal second moments.
fn shape(points: &[Vector3<f64>]) -> &'static str {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let spread: Matrix3<f64> = points.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
    let mut principal: Vec<f64> = SymmetricEigen::new(spread).eigenvalues.iter().copied().collect();
    principal.sort_by(f64::total_cmp);
    if points.len() < 2 || !(principal[2] > 0.0) {
        "one point"
    } else if !(principal[1] > 1e-9 * principal[2]) {
        "on a line"
    } else {
        "in several places"
    }
}

fn root(parent: &mut [usize], mut element: usize) -> usize {
    while parent[element] != element {
        parent[element] = parent[parent[element]];
        element = parent[element];
    }
    element
}

/// Joins towards the smaller index, so that the result depends only on the mesh.
fn join(parent: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b)] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementKind;
    use crate::test_mesh::cube;

    #[test]
    fn a_sound_mesh_is_one_body_of_every_kind() {
        for kind in crate::test_mesh::SOLIDS {
            let found = bodies(&cube(kind, [3, 2, 2], false, |u| u));
            assert_eq!((found.elements.len(), found.hinges.len()), (1, 0), "{kind:?}");
        }
    }

    #[test]
    fn bodies_that_touch_along_an_edge_or_in_a_point_are_named_with_their_nodes() {
        // Keep two diagonal cells of 2 x 2 x 1: they share an edge of two nodes.
        let mut mesh = cube(ElementKind::Hex8, [2, 2, 1], false, |u| u);
        let keep = |mesh: &mut Mesh, wanted: &[usize]| {
            let block = &mut mesh.blocks[0];
            block.ids = wanted.iter().map(|k| block.ids[*k]).collect();
            block.connectivity = wanted.iter().flat_map(|k| block.connectivity[8 * k..8 * k + 8].to_vec()).collect();
        };
        keep(&mut mesh, &[0, 3]);
        let found = bodies(&mesh);
        assert_eq!(found.elements, [1, 1]);
        assert_eq!((found.hinges[0].node_ids.len(), found.hinges[0].shape), (2, "on a line"));
        let mut mesh = cube(ElementKind::Hex8, [2, 2, 2], false, |u| u);
        keep(&mut mesh, &[0, 7]);
        let hinge = &bodies(&mesh).hinges[0];
        assert_eq!((hinge.node_ids.len(), hinge.shape), (1, "one point"));
        assert!(hinge.to_string().contains("no face"), "{hinge}");
    }
}
