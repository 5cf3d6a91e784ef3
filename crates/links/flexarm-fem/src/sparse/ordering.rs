//! Fill-reducing ordering of the unknowns.
//!
//! Approximate minimum degree (from faer) is good for thin-walled castings up to about 10⁵
//! unknowns; nested dissection (METIS) produces less fill for large and solid ones. METIS works on
//! groups of unknowns with equal neighbours, which for a mesh are its nodes.
//!
//! Source: Amestoy, Davis & Duff (1996); Karypis & Kumar (1998), METIS 5.2.

#[cfg(not(target_family = "wasm"))]
use std::sync::{Mutex, PoisonError};

use super::symmetric::Pattern;

/// Ordering of the unknowns before factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// Approximate minimum degree up to 20,000 unknowns, nested dissection above.
    #[default]
    Auto,
    /// Approximate minimum degree.
    MinimumDegree,
    /// Nested dissection by METIS, with a fixed seed: the same ordering on every run and thread.
    NestedDissection,
}

/// Number of unknowns from which [`Ordering::Auto`] selects nested dissection.
const NESTED_FROM: usize = 20_000;

impl Ordering {
    /// Resolves [`Ordering::Auto`] for `size` unknowns.
    pub fn resolve(self, size: usize) -> Self {
        match self {
            Self::Auto if size >= NESTED_FROM => Self::NestedDissection,
            Self::Auto => Self::MinimumDegree,
            other => other,
        }
    }
}

/// Computes a nested dissection ordering: `order[k]` is eliminated as number `k`.
///
/// `None` if METIS fails (out of memory, or more than 2³¹ neighbours), if no unknowns are coupled,
/// because METIS then divides by zero, and in WebAssembly, which is built without C.
pub(super) fn nested_dissection(pattern: &Pattern) -> Option<Vec<u32>> {
    let (group_of, groups) = group_equal_columns(pattern);
    let graph = Graph::of_groups(pattern, &group_of, groups.len()).filter(Graph::has_edges)?;
    let order = metis_node_nd(graph, &groups.iter().map(|g| g.len() as i32).collect::<Vec<_>>())?;
    Some(order.into_iter().flat_map(|group| groups[group as usize].clone()).collect())
}

/// Groups consecutive unknowns with the same rows below them: the DoF of one mesh node.
fn group_equal_columns(pattern: &Pattern) -> (Vec<u32>, Vec<std::ops::Range<u32>>) {
    let n = pattern.size();
    let (mut group_of, mut groups): (Vec<u32>, Vec<std::ops::Range<u32>>) = (Vec::with_capacity(n), Vec::new());
    for j in 0..n {
        let rows = &pattern.rows[pattern.column(j)];
        let same = j > 0 && {
            let before = &pattern.rows[pattern.column(j - 1)];
            before.len() == rows.len() + 1 && before[1..] == *rows
        };
        match groups.last_mut() {
            Some(last) if same && last.len() < 6 => last.end += 1,
            _ => groups.push(j as u32..j as u32 + 1),
        }
        group_of.push(groups.len() as u32 - 1);
    }
    (group_of, groups)
}

/// Adjacency of the groups in both directions, without self-loops, as METIS expects it.
struct Graph {
    #[cfg_attr(target_family = "wasm", allow(dead_code, reason = "METIS reads it"))]
    starts: Vec<i32>,
    neighbours: Vec<i32>,
}

impl Graph {
    fn of_groups(pattern: &Pattern, group_of: &[u32], count: usize) -> Option<Self> {
        let mut edges: Vec<(u32, u32)> = Vec::new();
        let mut last = u32::MAX;
        for j in 0..pattern.size() {
            // One column of each group is enough: the first one has the neighbours of all.
            let group = group_of[j];
            if group == last {
                continue;
            }
            last = group;
            let mut other_before = group;
            for row in &pattern.rows[pattern.column(j)] {
                let other = group_of[*row as usize];
                if other != other_before {
                    edges.push((group, other));
                    other_before = other;
                }
            }
        }
        let mut starts = vec![0_i32; count + 1];
        i32::try_from(2 * edges.len()).ok()?;
        for (a, b) in &edges {
            starts[*a as usize + 1] += 1;
            starts[*b as usize + 1] += 1;
        }
        for k in 0..count {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut neighbours = vec![0_i32; 2 * edges.len()];
        for (a, b) in edges {
            for (from, to) in [(a, b), (b, a)] {
                neighbours[next[from as usize] as usize] = to as i32;
                next[from as usize] += 1;
            }
        }
        Some(Self { starts, neighbours })
    }

    fn has_edges(&self) -> bool {
        !self.neighbours.is_empty()
    }
}

/// Without METIS there is no ordering; approximate minimum degree takes its place.
#[cfg(target_family = "wasm")]
fn metis_node_nd(_: Graph, _: &[i32]) -> Option<Vec<u32>> {
    None
}

/// Held during a call of METIS: its random numbers come from the C library's `rand`, whose state
/// all threads share, so that concurrent calls would return other orderings on every run.
#[cfg(not(target_family = "wasm"))]
static METIS: Mutex<()> = Mutex::new(());

/// Calls METIS; `result[k]` is the group eliminated as number `k`.
#[cfg(not(target_family = "wasm"))]
#[allow(
    unsafe_code,
    reason = "METIS is a C library; this is the only call, with arrays whose lengths are checked here"
)]
fn metis_node_nd(mut graph: Graph, weights: &[i32]) -> Option<Vec<u32>> {
    let mut count = i32::try_from(weights.len()).ok()?;
    assert!(graph.starts.len() == weights.len() + 1 && graph.starts[weights.len()] as usize == graph.neighbours.len());
    let mut weights = weights.to_vec();
    let mut options = [0_i32; metis_sys::METIS_NOPTIONS as usize];
    let (mut order, mut position) = (vec![0_i32; weights.len()], vec![0_i32; weights.len()]);
    let _alone = METIS.lock().unwrap_or_else(PoisonError::into_inner);
    // SAFETY: the graph is symmetric, in range and has the lengths that METIS_NodeND documents;
    // options has METIS_NOPTIONS entries; both results have one entry per vertex.
    let status = unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        options[metis_sys::moptions_et_METIS_OPTION_SEED as usize] = 1;
        metis_sys::METIS_NodeND(
            &mut count,
            graph.starts.as_mut_ptr(),
            graph.neighbours.as_mut_ptr(),
            weights.as_mut_ptr(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            position.as_mut_ptr(),
        )
    };
    // METIS calls them perm and iperm: A' = A(perm, perm), so perm[k] is eliminated as number k.
    (status == metis_sys::rstatus_et_METIS_OK).then(|| order.into_iter().map(|group| group as u32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::SparseSymmetric;

    #[test]
    fn nested_dissection_orders_every_unknown_once_and_keeps_nodes_together() {
        // A 6 x 6 grid of nodes with three unknowns each, coupled to their neighbours.
        let node = |x: u32, y: u32| 6 * y + x;
        let mut triplets = Vec::new();
        for y in 0..6 {
            for x in 0..6 {
                let mut couple = |a: u32, b: u32| {
                    for i in 0..3 {
                        for j in 0..3 {
                            if 3 * a + i >= 3 * b + j {
                                triplets.push((3 * a + i, 3 * b + j, 1.0));
                            }
                        }
                    }
                };
                couple(node(x, y), node(x, y));
                if x > 0 {
                    couple(node(x, y), node(x - 1, y));
                }
                if y > 0 {
                    couple(node(x, y), node(x, y - 1));
                }
            }
        }
        let A = SparseSymmetric::from_triplets(108, &triplets);
        let order = nested_dissection(A.pattern()).unwrap();
        let mut seen = order.clone();
        seen.sort_unstable();
        assert_eq!(seen, (0..108).collect::<Vec<u32>>());
        assert!(order.chunks_exact(3).all(|node| node[0] % 3 == 0 && node[2] == node[0] + 2));
    }

    #[test]
    fn a_matrix_has_the_same_nested_dissection_while_others_are_ordered() {
        let side = 24;
        let grid = |k: u32| (k % side, k / side);
        let mut triplets = Vec::new();
        for i in 0..side * side {
            let ((x, y), before) = (grid(i), i.saturating_sub(side + 1));
            let near = |j: &u32| grid(*j).0.abs_diff(x) <= 1 && grid(*j).1.abs_diff(y) <= 1;
            triplets.extend((before..=i).filter(near).map(|j| (i, j, 1.0)));
        }
        let A = SparseSymmetric::from_triplets((side * side) as usize, &triplets);
        let alone = nested_dissection(A.pattern()).unwrap();
        let differ = || (0..50).filter(|_| nested_dissection(A.pattern()).unwrap() != alone).count();
        let differ: usize = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4).map(|_| scope.spawn(differ)).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).sum()
        });
        assert_eq!(differ, 0, "of 200 orderings"); // 199 without the lock
    }
}
