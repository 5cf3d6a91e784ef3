//! Parts of a mesh that share no node: missing contacts, duplicated nodes, stray elements.
//!
//! Start at [`connected_parts`]. Not here: merging of coincident nodes (`coincident.rs`).

use super::Mesh;

/// Connected part of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of elements.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Index of one of its nodes.
    pub node: u32,
    /// Number of that node in the file.
    pub node_id: u64,
}

/// Finds the connected parts of a mesh, largest first; a mesh in one piece has one part.
///
/// Two elements are connected if they share a node. Nodes without an element are ignored.
pub fn connected_parts(mesh: &Mesh) -> Vec<Part> {
    // Union of the nodes of every element (union-find), then one part per root.
    let mut parent: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    for nodes in mesh.blocks.iter().flat_map(|block| block.elements()) {
        let mut root = find(&mut parent, nodes[0]);
        for node in &nodes[1..] {
            let other = find(&mut parent, *node);
            // Joins towards the smaller index, so that the result depends only on the mesh.
            parent[root.max(other) as usize] = root.min(other);
            root = root.min(other);
        }
    }

    let mut part_of = vec![usize::MAX; mesh.nodes.len()];
    let mut parts: Vec<Part> = Vec::new();
    let used = mesh.used_nodes();
    for (node, _) in (0_u32..).zip(&used).filter(|(_, used)| **used) {
        let root = find(&mut parent, node) as usize;
        if part_of[root] == usize::MAX {
            part_of[root] = parts.len();
            parts.push(Part { elements: 0, nodes: 0, node, node_id: mesh.node_ids[node as usize] });
        }
        parts[part_of[root]].nodes += 1;
    }
    for nodes in mesh.blocks.iter().flat_map(|block| block.elements()) {
        let root = find(&mut parent, nodes[0]) as usize;
        parts[part_of[root]].elements += 1;
    }
    parts.sort_by_key(|part| std::cmp::Reverse(part.elements));
    parts
}

/// Root of a node, with path halving.
fn find(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        let above = parent[parent[node as usize] as usize];
        parent[node as usize] = above;
        node = above;
    }
    node
}
