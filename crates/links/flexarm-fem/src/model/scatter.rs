//! Node adjacency of a mesh, and position of element matrix blocks in the sparse matrix.
//!
//! The pattern over nodes is expanded to DoF; blocks of an element are then added without a search
//! per entry. Not here: the values, which the parent module adds.

use std::sync::Arc;

use super::DofMap;
use crate::mesh::Mesh;
use crate::sparse::Pattern;

/// Lower triangle of the node adjacency: for each node its neighbours of equal or higher index.
#[derive(Debug)]
pub(super) struct NodeGraph {
    starts: Vec<u32>,
    /// Ascending for each node; the first is the node itself if it is used.
    rows: Vec<u32>,
    /// Number of DoF of the preceding neighbours, without the node itself.
    before: Vec<u32>,
    /// Start of each DoF column.
    dof_starts: Vec<u32>,
}

impl NodeGraph {
    /// Builds the graph; cost and memory are linear in the number of elements.
    pub(super) fn new(mesh: &Mesh, dofs: &DofMap) -> Self {
        let n = mesh.nodes.len();
        // Elements of each node: counts, starts, then the lists.
        let elements: Vec<&[u32]> = mesh.blocks.iter().flat_map(|block| block.elements()).collect();
        let mut element_starts = vec![0_u32; n + 1];
        for nodes in &elements {
            for node in *nodes {
                element_starts[*node as usize + 1] += 1;
            }
        }
        for node in 0..n {
            element_starts[node + 1] += element_starts[node];
        }
        let mut next = element_starts.clone();
        let mut of_node = vec![0_u32; element_starts[n] as usize];
        for (e, nodes) in elements.iter().enumerate() {
            for node in *nodes {
                of_node[next[*node as usize] as usize] = e as u32;
                next[*node as usize] += 1;
            }
        }

        // Neighbours of each node on or below the diagonal: nodes of its elements, each once.
        let (mut starts, mut rows, mut before) = (vec![0_u32], Vec::new(), Vec::new());
        let mut marked = vec![u32::MAX; n];
        for node in 0..n {
            let first = rows.len();
            for e in &of_node[element_starts[node] as usize..element_starts[node + 1] as usize] {
                for other in elements[*e as usize] {
                    if *other as usize >= node && marked[*other as usize] != node as u32 {
                        marked[*other as usize] = node as u32;
                        rows.push(*other);
                    }
                }
            }
            rows[first..].sort_unstable();
            let mut sum = 0;
            for other in &rows[first..] {
                before.push(sum);
                if *other as usize != node {
                    sum += dofs.of(*other as usize).len() as u32;
                }
            }
            starts.push(rows.len() as u32);
        }

        // A column of the DoF matrix has the later DoF of its own node and all of the neighbours.
        let mut dof_starts = Vec::with_capacity(dofs.size() + 1);
        dof_starts.push(0_u32);
        for node in 0..n {
            let own = dofs.of(node).len() as u32;
            let others: u32 =
                Self::column(&starts, &rows, node).iter().skip(1).map(|o| dofs.of(*o as usize).len() as u32).sum();
            for c in 0..own {
                let last = dof_starts[dof_starts.len() - 1];
                dof_starts.push(last + own - c + others);
            }
        }
        Self { starts, rows, before, dof_starts }
    }

    fn column<'r>(starts: &[u32], rows: &'r [u32], node: usize) -> &'r [u32] {
        &rows[starts[node] as usize..starts[node + 1] as usize]
    }

    /// Pattern over nodes.
    pub(super) fn node_pattern(&self) -> Arc<Pattern> {
        Arc::new(Pattern { starts: self.starts.clone(), rows: self.rows.clone() })
    }

    /// Pattern over DoF.
    pub(super) fn dof_pattern(&self, dofs: &DofMap) -> Arc<Pattern> {
        let mut rows = Vec::with_capacity(self.dof_starts[dofs.size()] as usize);
        for node in 0..dofs.nodes() {
            let own = dofs.of(node);
            for dof in own.clone() {
                rows.extend(dof as u32..own.end as u32);
                for other in Self::column(&self.starts, &self.rows, node).iter().skip(1) {
                    let others = dofs.of(*other as usize);
                    rows.extend(others.start as u32..others.end as u32);
                }
            }
        }
        Arc::new(Pattern { starts: self.dof_starts.clone(), rows })
    }

    /// Position of node pair (`a`, `b`), `a >= b`, in the node pattern.
    pub(super) fn find(&self, a: u32, b: u32) -> usize {
        let column = Self::column(&self.starts, &self.rows, b as usize);
        let place = column.binary_search(&a);
        assert!(place.is_ok(), "nodes {a} and {b} share an element but not an entry");
        self.starts[b as usize] as usize + place.unwrap_or(0)
    }

    /// Adds a dense symmetric element matrix with `per_node` rows for each of `nodes`.
    pub(super) fn add_blocks(&self, dofs: &DofMap, nodes: &[u32], per_node: usize, local: &[f64], values: &mut [f64]) {
        let size = per_node * nodes.len();
        for (q, b) in nodes.iter().enumerate() {
            let own = dofs.of(*b as usize);
            for (p, a) in nodes.iter().enumerate() {
                if a < b {
                    continue;
                }
                let before = if a == b { 0 } else { self.before[self.find(*a, *b)] as usize };
                for c in 0..per_node {
                    let column = self.dof_starts[own.start + c] as usize;
                    let entries = &local[(per_node * q + c) * size + per_node * p..][..per_node];
                    if a == b {
                        // Diagonal block: entries on and below the diagonal.
                        for i in c..per_node {
                            values[column + i - c] += entries[i];
                        }
                    } else {
                        let at = column + own.len() - c + before;
                        for (value, entry) in values[at..at + per_node].iter_mut().zip(entries) {
                            *value += entry;
                        }
                    }
                }
            }
        }
    }
}
