//! Parts of a mesh that share no node: forgotten contacts, doubled nodes, stray elements.

use super::Mesh;

/// A connected part of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of its elements.
    pub elements: usize,
    /// Number of its nodes.
    pub nodes: usize,
    /// One of its nodes, as an index.
    pub node: u32,
    /// The number of that node in the file.
    pub node_id: u64,
}

/// The connected parts of a mesh, largest first; one part in a mesh that holds together.
///
/// Two elements are connected when they share a node. Nodes in no element do not count.
pub fn connected_parts(mesh: &Mesh) -> Vec<Part> {
    // Union of the nodes of every element, then one part per root.
    let mut parent: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    for nodes in mesh.blocks.iter().flat_map(|block| block.elements()) {
        let mut root = find(&mut parent, nodes[0]);
        for node in &nodes[1..] {
            let other = find(&mut parent, *node);
            // Towards the smaller index, so that the answer depends on the mesh alone.
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

/// Root of a node; halves the way to it.
fn find(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        let above = parent[parent[node as usize] as usize];
        parent[node as usize] = above;
        node = above;
    }
    node
}
