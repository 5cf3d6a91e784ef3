//! Fill-reducing ordering of the unknowns.
//!
//! Approximate minimum degree (from faer) is good for thin-walled castings up to about 10⁵
//! unknowns; nested dissection produces less fill for large and solid ones. It works on groups of
//! unknowns with equal neighbours, which for a mesh are its nodes.
//!
//! Source: Amestoy, Davis & Duff (1996).

use super::dissection::Graph;
use super::symmetric::Pattern;

/// Ordering of the unknowns before factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// Approximate minimum degree up to 20,000 unknowns, nested dissection above.
    #[default]
    Auto,
    /// Approximate minimum degree.
    MinimumDegree,
    /// Nested dissection.
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

/// Computes a nested dissection ordering: `order[k]` is eliminated as number `k`. `None` above 2³²
/// neighbours.
pub(super) fn nested_dissection(pattern: &Pattern) -> Option<Vec<u32>> {
    let (group_of, groups) = group_equal_columns(pattern);
    let order = graph_of_groups(pattern, &group_of, &groups)?.dissect();
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

/// Graph of the groups that `pattern` couples; `None` above 2³² neighbours.
fn graph_of_groups(pattern: &Pattern, group_of: &[u32], groups: &[std::ops::Range<u32>]) -> Option<Graph> {
    let mut edges: Vec<(u32, u32)> = Vec::new();
    for (group, members) in groups.iter().enumerate() {
        // The first column has the neighbours of all.
        let mut other_before = group as u32;
        for row in &pattern.rows[pattern.column(members.start as usize)] {
            let other = group_of[*row as usize];
            if other != other_before {
                edges.push((group as u32, other));
                other_before = other;
            }
        }
    }
    let count = u32::try_from(2 * edges.len()).ok()?;
    let mut starts = vec![0; groups.len() + 1];
    edges.iter().flat_map(|(a, b)| [a, b]).for_each(|v| starts[*v as usize + 1] += 1);
    (0..groups.len()).for_each(|k| starts[k + 1] += starts[k]);
    let (mut next, mut neighbours) = (starts.clone(), vec![0; count as usize]);
    for (from, to) in edges.into_iter().flat_map(|(a, b)| [(a, b), (b, a)]) {
        neighbours[next[from as usize] as usize] = to;
        next[from as usize] += 1;
    }
    let weights = groups.iter().map(|g| g.len() as u32).collect();
    Some(Graph { starts, couplings: vec![1; neighbours.len()], neighbours, weights })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Cholesky, SparseSymmetric};

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
    fn nested_dissection_fills_less_than_minimum_degree_in_a_solid_cube() {
        let side = 20_u32;
        let at = |k: u32| [k / side / side, k / side % side, k % side];
        let near = |a: u32, b: u32| (0..3).all(|i| at(a)[i].abs_diff(at(b)[i]) <= 1);
        let mut triplets = Vec::new();
        for i in 0..side.pow(3) {
            let before = i.saturating_sub(side * side + side + 1);
            let coupled = (before..=i).filter(|j| near(i, *j));
            triplets.extend(coupled.map(|j| (i, j, if i == j { 30.0 } else { -1.0 })));
        }
        let A = SparseSymmetric::from_triplets(side.pow(3) as usize, &triplets);
        let entries = |ordering| Cholesky::new(&A, ordering).unwrap().figures().factor_entries as f64;
        let ratio = entries(Ordering::NestedDissection) / entries(Ordering::MinimumDegree);
        assert!(ratio < 0.9, "{ratio:.3}");
    }
}
