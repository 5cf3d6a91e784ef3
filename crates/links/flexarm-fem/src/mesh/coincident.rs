//! Distinct nodes at the same position: parts that were never joined, and cracks inside a body.
//!
//! Start at [`coincident`]; [`Mesh::merge_coincident`] joins them. Distances in m.
//!
//! Not here: faces that touch without matching (`fit`), bodies joined at a point or an edge
//! (`hinges`).

use std::collections::HashMap;

use nalgebra::Vector3;

use super::Mesh;
use super::surface::skin;

/// Default distance below which nodes coincide, relative to the diagonal of the mesh.
const COINCIDENT: f64 = 1e-6;

/// Distinct nodes at the same position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Coincident {
    /// Pairs of node indices, the smaller first, ascending.
    pub pairs: Vec<[u32; 2]>,
    /// Number of surface faces that coincide with another one at all corners; both sides of a crack
    /// count.
    pub faces: usize,
}

/// Finds nodes of the surface and of beams that are at the same position but are distinct.
///
/// * `tolerance`: m; nodes of the same element are never reported, however small it is.
pub fn coincident(mesh: &Mesh, tolerance: f64) -> Coincident {
    let skin = skin(mesh);
    let mut nodes = skin.nodes();
    let beams = mesh.blocks.iter().filter(|block| block.kind.is_beam());
    nodes.extend(beams.flat_map(|block| block.connectivity.iter().copied()));
    nodes.sort_unstable();
    nodes.dedup();
    let mut pairs = near_pairs(mesh, &nodes, tolerance);
    if pairs.is_empty() {
        return Coincident::default();
    }
    drop_neighbours(mesh, &mut pairs);

    // The node with the smallest index represents each position.
    let mut place: HashMap<u32, u32> = HashMap::new();
    for [a, b] in &pairs {
        let root = place.get(a).copied().unwrap_or(*a);
        place.insert(*b, root);
        place.entry(*a).or_insert(root);
    }
    let mut count: HashMap<Vec<u32>, usize> = HashMap::new();
    for face in skin.faces() {
        let Some(mut key) = face.corners.iter().map(|c| place.get(c).copied()).collect::<Option<Vec<u32>>>() else {
            continue;
        };
        key.sort_unstable();
        *count.entry(key).or_insert(0) += 1;
    }
    Coincident { pairs, faces: count.values().filter(|faces| **faces > 1).sum() }
}

/// Pairs of `nodes` closer than `tolerance`, found with a grid of larger cells.
fn near_pairs(mesh: &Mesh, nodes: &[u32], tolerance: f64) -> Vec<[u32; 2]> {
    let size = 8.0 * tolerance.max(f64::MIN_POSITIVE);
    let cell = |p: &Vector3<f64>| [p.x, p.y, p.z].map(|x| (x / size).floor() as i64);
    let mut grid: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut pairs = Vec::new();
    for node in nodes {
        let p = mesh.nodes[*node as usize];
        let (low, high) = (cell(&p.add_scalar(-tolerance)), cell(&p.add_scalar(tolerance)));
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for k in low[2]..=high[2] {
                    let inside = grid.get(&[i, j, k]).into_iter().flatten();
                    let near = inside.filter(|other| (mesh.nodes[**other as usize] - p).norm() <= tolerance);
                    pairs.extend(near.map(|other| [*other, *node]));
                }
            }
        }
        grid.entry(cell(&p)).or_default().push(*node);
    }
    pairs.sort_unstable();
    pairs
}

/// Removes pairs within one element: a small element, not a crack.
fn drop_neighbours(mesh: &Mesh, pairs: &mut Vec<[u32; 2]>) {
    let mut is_paired = vec![false; mesh.nodes.len()];
    pairs.iter().flatten().for_each(|node| is_paired[*node as usize] = true);
    let mut neighbours = Vec::new();
    for nodes in mesh.blocks.iter().flat_map(|block| block.elements()) {
        let here: Vec<u32> = nodes.iter().copied().filter(|node| is_paired[*node as usize]).collect();
        neighbours.extend(here.iter().flat_map(|a| here.iter().filter(move |b| a < *b).map(move |b| [*a, *b])));
    }
    neighbours.sort_unstable();
    pairs.retain(|pair| neighbours.binary_search(pair).is_err());
}

impl Mesh {
    /// Default distance below which its nodes coincide: `COINCIDENT` times the diagonal, m.
    pub fn coincidence(&self) -> f64 {
        COINCIDENT * self.bounding_box().map_or(0.0, |(low, high)| (high - low).norm())
    }

    /// Merges each group of coincident nodes into one; returns the number of removed nodes.
    ///
    /// * `tolerance`: m.
    pub fn merge_coincident(&mut self, tolerance: f64) -> usize {
        let pairs = coincident(self, tolerance).pairs;
        let mut target: Vec<u32> = (0..self.nodes.len() as u32).collect();
        // Ascending, so that a chain of close nodes is merged into its first.
        for [a, b] in &pairs {
            target[*b as usize] = target[*a as usize].min(target[*b as usize]);
        }
        let merge = |nodes: &mut Vec<u32>| nodes.iter_mut().for_each(|node| *node = target[*node as usize]);
        self.blocks.iter_mut().for_each(|block| merge(&mut block.connectivity));
        for set in self.node_sets.values_mut() {
            merge(set);
            set.sort_unstable();
            set.dedup();
        }
        target.iter().zip(0..).filter(|(to, from)| *to != from).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ElementKind, connected_parts};
    use crate::test_mesh::cube;

    /// Bar of two cells along x; the cells do not share the nodes between them where `split` is
    /// true.
    fn bar(split: impl Fn(&Vector3<f64>) -> bool) -> Mesh {
        let mut mesh = cube(ElementKind::Hex8, [2, 3, 3], false, |u| u);
        let twin: HashMap<u32, u32> = (0..mesh.nodes.len() as u32)
            .filter(|node| mesh.nodes[*node as usize].x == 0.5 && split(&mesh.nodes[*node as usize]))
            .zip(mesh.nodes.len() as u32..)
            .collect();
        let mut twins: Vec<(u32, u32)> = twin.iter().map(|(a, b)| (*a, *b)).collect();
        twins.sort_by_key(|(_, new)| *new);
        for (old, new) in twins {
            mesh.nodes.push(mesh.nodes[old as usize]);
            mesh.node_ids.push(u64::from(new) + 1);
        }
        let middle = |nodes: &[u32], mesh: &Mesh| nodes.iter().map(|n| mesh.nodes[*n as usize].x).sum::<f64>() / 8.0;
        let mut connectivity = mesh.blocks[0].connectivity.clone();
        for nodes in connectivity.chunks_exact_mut(8).filter(|nodes| middle(nodes, &mesh) > 0.5) {
            nodes.iter_mut().for_each(|node| *node = twin.get(node).copied().unwrap_or(*node));
        }
        mesh.blocks[0].connectivity = connectivity;
        mesh
    }

    #[test]
    fn a_crack_is_found_though_the_body_holds_together_and_closes_when_merged() {
        let mut cracked = bar(|p| p.y > 0.4);
        assert_eq!(connected_parts(&cracked).len(), 1);
        let found = coincident(&cracked, 1e-9);
        // Two rows of four nodes; three faces between them, counted from both sides.
        assert_eq!((found.pairs.len(), found.faces), (8, 6));
        assert_eq!(cracked.merge_coincident(1e-9), 8);
        assert_eq!(coincident(&cracked, 1e-9), Coincident::default());
        assert_eq!(cracked.blocks[0].connectivity, bar(|_| false).blocks[0].connectivity);
    }

    #[test]
    fn a_whole_mesh_has_no_coincident_nodes_however_large_the_tolerance() {
        assert_eq!(coincident(&bar(|_| false), 1e-9), Coincident::default());
        // Nodes of one element are neighbours, not duplicates.
        let one = cube(ElementKind::Hex8, [1, 1, 1], false, |u| u);
        assert_eq!(coincident(&one, 10.0), Coincident::default());
    }
}
