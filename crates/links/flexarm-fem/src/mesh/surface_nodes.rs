//! Checks the nodes of an interface against the faces of the surface: missing nodes, nodes inside
//! the body, nodes on no face.

use std::collections::{BTreeSet, HashMap};

use super::Mesh;
use super::surface::{Skin, skin};

/// Relation of a node set to the surface of a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SurfaceNodes {
    /// Number of surface faces with all their corners in the set.
    pub faces: usize,
    /// Number of patches of these faces, each connected through its nodes.
    pub patches: usize,
    /// Number of mid-side nodes of these faces, in the set or not.
    pub middles: usize,
    /// Mid-side nodes of these faces that are not in the set, ascending.
    pub missing: Vec<u32>,
    /// Number of nodes of the set that are on the surface, but on none of these faces.
    pub stray: usize,
    /// Number of nodes of the set inside the body.
    pub inside: usize,
    /// Number of nodes of the set on beams.
    pub on_beams: usize,
}

/// Surface of a mesh, computed once for all interfaces.
#[derive(Debug)]
pub struct Surface {
    skin: Skin,
    is_outside: Vec<bool>,
    is_beam: Vec<bool>,
}

impl Surface {
    /// Computes the surface of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let skin = skin(mesh);
        let mark = |nodes: &[u32]| {
            let mut marked = vec![false; mesh.nodes.len()];
            nodes.iter().for_each(|node| marked[*node as usize] = true);
            marked
        };
        let beams = mesh.blocks.iter().filter(|block| block.kind.is_beam());
        let beams: Vec<u32> = beams.flat_map(|block| block.connectivity.iter().copied()).collect();
        Self { is_outside: mark(&skin.nodes()), is_beam: mark(&beams), skin }
    }

    /// Checks the nodes of an interface, which must be sorted.
    pub fn surface_nodes(&self, nodes: &[u32]) -> SurfaceNodes {
        let is_in = |node: &u32| nodes.binary_search(node).is_ok();
        let mut surface_nodes = SurfaceNodes::default();
        let (mut middles, mut on_faces): (BTreeSet<u32>, BTreeSet<u32>) = Default::default();
        let mut patches = Patches::default();
        for face in self.skin.faces().filter(|face| face.corners.iter().all(is_in)) {
            surface_nodes.faces += 1;
            middles.extend(face.midsides);
            on_faces.extend(face.corners);
            patches.join(face.corners);
        }
        surface_nodes.patches = patches.count();
        surface_nodes.middles = middles.len();
        surface_nodes.missing = middles.iter().copied().filter(|node| !is_in(node)).collect();
        for node in nodes {
            if self.is_beam[*node as usize] {
                surface_nodes.on_beams += 1;
            } else if !self.is_outside[*node as usize] {
                surface_nodes.inside += 1;
            } else if !on_faces.contains(node) && !middles.contains(node) {
                surface_nodes.stray += 1;
            }
        }
        surface_nodes
    }
}

/// Groups of nodes that are connected by faces.
#[derive(Default)]
struct Patches {
    parent: HashMap<u32, u32>,
}

impl Patches {
    fn root(&mut self, mut node: u32) -> u32 {
        self.parent.entry(node).or_insert(node);
        while self.parent[&node] != node {
            let above = self.parent[&self.parent[&node]];
            self.parent.insert(node, above);
            node = above;
        }
        node
    }

    fn join(&mut self, nodes: &[u32]) {
        let first = self.root(nodes[0]);
        for node in &nodes[1..] {
            let other = self.root(*node);
            self.parent.insert(other, first);
        }
    }

    fn count(&self) -> usize {
        self.parent.iter().filter(|(node, above)| node == above).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementKind;
    use crate::test_mesh::cube;

    fn nodes_at(mesh: &Mesh, keep: impl Fn(&nalgebra::Vector3<f64>) -> bool) -> Vec<u32> {
        (0..mesh.nodes.len() as u32).filter(|node| keep(&mesh.nodes[*node as usize])).collect()
    }

    #[test]
    fn corner_nodes_of_quadratic_faces_alone_lack_the_middles_of_all_their_edges() {
        for kind in [ElementKind::Tet10, ElementKind::Hex20, ElementKind::Wedge15] {
            let mesh = cube(kind, [2, 2, 2], false, |u| u);
            let face = nodes_at(&mesh, |p| p.x == 0.0);
            let corners: BTreeSet<u32> =
                mesh.blocks[0].elements().flat_map(|e| e[..super::super::faces::corner_count(kind)].to_vec()).collect();
            let only: Vec<u32> = face.iter().copied().filter(|node| corners.contains(node)).collect();
            let surface = Surface::new(&mesh);
            assert!(surface.surface_nodes(&face).missing.is_empty(), "{kind:?}");
            let surface_nodes = surface.surface_nodes(&only);
            let mut whole = [only.clone(), surface_nodes.missing.clone()].concat();
            whole.sort_unstable();
            assert_eq!(whole, face, "{kind:?}");
            assert_eq!(
                (surface_nodes.missing.len(), surface_nodes.patches, surface_nodes.stray, surface_nodes.inside),
                (surface_nodes.middles, 1, 0, 0)
            );
        }
    }

    #[test]
    fn an_edge_is_no_seat_two_ends_are_two_patches_and_inner_nodes_are_counted() {
        let mesh = cube(ElementKind::Hex8, [4, 2, 2], false, |u| u);
        let surface = Surface::new(&mesh);
        let edge = surface.surface_nodes(&nodes_at(&mesh, |p| p.x == 0.0 && p.y == 0.0));
        assert_eq!((edge.faces, edge.stray), (0, 3));
        let ends = surface.surface_nodes(&nodes_at(&mesh, |p| p.x == 0.0 || p.x == 1.0));
        assert_eq!((ends.faces, ends.patches), (8, 2));
        let inner = surface.surface_nodes(&nodes_at(&mesh, |p| p.x == 0.5));
        assert_eq!((inner.inside, inner.faces), (1, 0));
    }
}
