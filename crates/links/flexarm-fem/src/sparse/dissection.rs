//! Nested dissection of a graph: a separator is eliminated after the two sides that it separates.
//!
//! A separator is found on a coarse graph and refined while the graph is made fine again
//! (multilevel). Everything is in integers and without random numbers, so that the same graph has
//! the same ordering on every machine.
//!
//! Source: Karypis & Kumar (1998), sections 3 to 5, heavy-edge matching and refinement of vertex
//! separators after Fiduccia & Mattheyses (1982).

use std::collections::BinaryHeap;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Vertices below which a graph is ordered by approximate minimum degree.
const LEAF: usize = 200;
/// Vertices below which a graph is not made coarser.
const COARSEST: usize = 100;
/// Maximum number of passes over a separator.
const PASSES: usize = 6;

/// Label of a vertex of the separator; 0 and 1 are the sides.
const SEPARATOR: u8 = 2;

/// Pseudorandom number that decides between equal candidates. With the order of the nodes of a mesh
/// all pairs would have one direction, and separators would be oblique.
fn scattered(number: u32) -> u32 {
    number.wrapping_mul(2_654_435_761) >> 5
}

/// Undirected graph without loops: both directions of each edge.
#[derive(Debug, Clone)]
pub(super) struct Graph {
    /// Start of the neighbours of each vertex, and their number.
    pub(super) starts: Vec<u32>,
    pub(super) neighbours: Vec<u32>,
    /// Number of edges of the original graph that each edge stands for.
    pub(super) couplings: Vec<u32>,
    /// Number of unknowns of each vertex.
    pub(super) weights: Vec<u32>,
}

impl Graph {
    fn len(&self) -> usize {
        self.weights.len()
    }

    fn range(&self, vertex: u32) -> std::ops::Range<usize> {
        self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize
    }

    fn around(&self, vertex: u32) -> &[u32] {
        &self.neighbours[self.range(vertex)]
    }

    fn weight(&self, vertex: u32) -> i64 {
        i64::from(self.weights[vertex as usize])
    }

    /// Joins each vertex with the free neighbour of its strongest coupling; the number of the
    /// coarse vertex of each vertex.
    fn matching(&self) -> (Vec<u32>, usize) {
        let total: u64 = self.weights.iter().map(|w| u64::from(*w)).sum();
        let heaviest = (3 * total / (2 * COARSEST as u64)).max(2) as u32;
        let mut coarse_of = vec![u32::MAX; self.len()];
        // Vertices with few neighbours first: they have the least choice.
        let mut by_degree: Vec<u32> = (0..self.len() as u32).collect();
        by_degree.sort_by_key(|v| (self.range(*v).len(), scattered(*v)));
        let mut count = 0;
        for v in by_degree {
            if coarse_of[v as usize] != u32::MAX {
                continue;
            }
            let weight = |u: u32| self.weights[u as usize];
            let partner = self
                .range(v)
                .map(|e| (self.neighbours[e], self.couplings[e]))
                .filter(|(u, _)| coarse_of[*u as usize] == u32::MAX && weight(v) + weight(*u) <= heaviest)
                .max_by_key(|(u, coupling)| {
                    (*coupling, std::cmp::Reverse(weight(*u)), scattered(u ^ v.rotate_left(7)))
                });
            coarse_of[v as usize] = count;
            if let Some((u, _)) = partner {
                coarse_of[u as usize] = count;
            }
            count += 1;
        }
        (coarse_of, count as usize)
    }

    /// Graph of the groups of vertices with the same number in `group_of`; vertices with the number
    /// `u32::MAX` are left out.
    fn grouped(&self, group_of: &[u32], count: usize) -> Self {
        // One or two vertices per group; their weights add up.
        let mut members = vec![[u32::MAX; 2]; count];
        let mut weights = vec![0; count];
        for (v, group) in group_of.iter().enumerate().filter(|(_, group)| **group != u32::MAX) {
            let slot = &mut members[*group as usize];
            slot[usize::from(slot[0] != u32::MAX)] = v as u32;
            weights[*group as usize] += self.weights[v];
        }
        let mut graph = Self { starts: vec![0], neighbours: Vec::new(), couplings: Vec::new(), weights };
        // Edges between groups: couplings of parallel edges add up, edges inside a group vanish.
        let mut place = vec![u32::MAX; count];
        for (group, members) in members.iter().enumerate() {
            let first = graph.neighbours.len();
            for e in members.iter().filter(|v| **v != u32::MAX).flat_map(|v| self.range(*v)) {
                let other = group_of[self.neighbours[e] as usize];
                if other == u32::MAX || other as usize == group {
                    continue;
                }
                let at = place[other as usize] as usize;
                if at < graph.neighbours.len() && at >= first {
                    graph.couplings[at] += self.couplings[e];
                } else {
                    place[other as usize] = graph.neighbours.len() as u32;
                    graph.neighbours.push(other);
                    graph.couplings.push(self.couplings[e]);
                }
            }
            graph.starts.push(graph.neighbours.len() as u32);
        }
        graph
    }

    /// Approximate minimum degree ordering.
    fn minimum_degree(&self) -> Vec<u32> {
        let n = self.len();
        let pattern = SymbolicSparseColMatRef::new_unsorted_checked(n, n, &self.starts, None, &self.neighbours);
        let mut memory = MemBuffer::new(amd::order_maybe_unsorted_scratch::<u32>(n, self.neighbours.len()));
        let (mut order, mut position) = (vec![0; n], vec![0; n]);
        let stack = MemStack::new(&mut memory);
        match amd::order_maybe_unsorted(&mut order, &mut position, pattern, amd::Control::default(), stack) {
            Ok(_) => order,
            Err(_) => (0..n as u32).collect(),
        }
    }

    /// Nested dissection ordering: entry `k` is eliminated as number `k`.
    pub(super) fn dissect(&self) -> Vec<u32> {
        if self.len() <= LEAF {
            return self.minimum_degree();
        }
        let side = self.separators((self.len() / 500).clamp(2, 16)).swap_remove(0);
        let mut order = Vec::with_capacity(self.len());
        for wanted in [0, 1] {
            let inside: Vec<u32> = (0..self.len() as u32).filter(|v| side[*v as usize] == wanted).collect();
            if inside.len() == self.len() {
                return self.minimum_degree();
            }
            let mut number = vec![u32::MAX; self.len()];
            inside.iter().zip(0..).for_each(|(v, k)| number[*v as usize] = k);
            let part = self.grouped(&number, inside.len()).dissect();
            order.extend(part.into_iter().map(|k| inside[k as usize]));
        }
        order.extend((0..self.len() as u32).filter(|v| side[*v as usize] == SEPARATOR));
        order
    }

    /// Separators, best first, as the label of each vertex. `starts` of them are refined on the
    /// coarsest graph, and the best half on each finer one.
    fn separators(&self, starts: usize) -> Vec<Vec<u8>> {
        let coarser = (self.len() > COARSEST).then(|| self.matching());
        // A graph of stars has few pairs.
        let (candidates, keep) = match coarser.filter(|(_, count)| count * 20 < self.len() * 19) {
            Some((coarse_of, count)) => {
                let coarse = self.grouped(&coarse_of, count).separators(starts);
                let fine = |side: Vec<u8>| coarse_of.iter().map(|c| side[*c as usize]).collect();
                let keep = coarse.len().div_ceil(2);
                (coarse.into_iter().map(fine).collect::<Vec<_>>(), keep)
            }
            None => ((0..starts).map(|k| self.grow((k * self.len() / starts) as u32)).collect(), starts),
        };
        let refined = candidates.into_iter().map(|side| Sides::new(self, side).refined());
        let mut refined: Vec<Sides> = refined.collect();
        refined.sort_by_key(Sides::cost);
        refined.into_iter().take(keep).map(|sides| sides.side).collect()
    }

    /// Labels after a side has grown from `start` to half of the weight.
    fn grow(&self, start: u32) -> Vec<u8> {
        let half = self.weights.iter().map(|w| i64::from(*w)).sum::<i64>() / 2;
        let (mut side, mut grown) = (vec![1; self.len()], 0);
        let mut queue = std::collections::VecDeque::new();
        let mut visited = vec![false; self.len()];
        // The parts of a graph that is not connected follow one after the other.
        for first in (start..self.len() as u32).chain(0..start) {
            if !std::mem::replace(&mut visited[first as usize], true) {
                queue.push_back(first);
            }
            while let Some(v) = queue.pop_front().filter(|_| grown < half) {
                side[v as usize] = 0;
                grown += self.weight(v);
                let around = self.around(v).iter();
                queue.extend(around.filter(|u| !std::mem::replace(&mut visited[**u as usize], true)));
            }
        }
        for v in 0..self.len() as u32 {
            if side[v as usize] == 1 && self.around(v).iter().any(|u| side[*u as usize] == 0) {
                side[v as usize] = SEPARATOR;
            }
        }
        side
    }
}

/// Sides and separator of a graph while the separator is refined.
struct Sides<'a> {
    graph: &'a Graph,
    side: Vec<u8>,
    /// Weights of the two sides and of the separator.
    weights: [i64; 3],
    /// Vertices that have left the separator in this pass.
    moved: Vec<bool>,
    /// Decrease of the separator if a vertex of it goes to side 0 or 1.
    gains: [Vec<i64>; 2],
    queues: [BinaryHeap<(i64, u32)>; 2],
}

impl<'a> Sides<'a> {
    fn new(graph: &'a Graph, side: Vec<u8>) -> Self {
        let mut weights = [0; 3];
        side.iter().zip(&graph.weights).for_each(|(s, w)| weights[usize::from(*s)] += i64::from(*w));
        let gains = [vec![0; side.len()], vec![0; side.len()]];
        let moved = vec![false; side.len()];
        Self { graph, side, weights, moved, gains, queues: Default::default() }
    }

    /// Weight of the separator, then of the heavier side; sides apart by more than 11:9 are last.
    fn cost(&self) -> (bool, i64, i64) {
        let heavier = self.weights[0].max(self.weights[1]);
        (heavier > self.most(), self.weights[2], heavier)
    }

    /// Maximum weight of a side.
    fn most(&self) -> i64 {
        self.weights.iter().sum::<i64>() * 11 / 20
    }

    /// Passes over the separator until one gains nothing.
    fn refined(mut self) -> Self {
        let mut passes = 0;
        while passes < PASSES && self.pass() {
            passes += 1;
        }
        self
    }

    fn relabel(&mut self, v: u32, label: u8) {
        let old = std::mem::replace(&mut self.side[v as usize], label);
        self.weights[usize::from(old)] -= self.graph.weight(v);
        self.weights[usize::from(label)] += self.graph.weight(v);
    }

    /// Computes the gains of a vertex of the separator and puts it into the queues.
    fn enqueue(&mut self, v: u32) {
        if self.moved[v as usize] {
            return;
        }
        let mut opposite = [0; 2];
        for u in self.graph.around(v) {
            match self.side[*u as usize] {
                0 => opposite[1] += self.graph.weight(*u),
                1 => opposite[0] += self.graph.weight(*u),
                _ => {}
            }
        }
        for (to, opposite) in opposite.into_iter().enumerate() {
            self.gains[to][v as usize] = self.graph.weight(v) - opposite;
            self.queues[to].push((self.gains[to][v as usize], v));
        }
    }

    /// An increase goes into the queue; a decrease is seen when the vertex leaves it.
    fn change_gain(&mut self, v: u32, to: usize, change: i64) {
        self.gains[to][v as usize] += change;
        if change > 0 && !self.moved[v as usize] {
            self.queues[to].push((self.gains[to][v as usize], v));
        }
    }

    /// The move of greatest gain that keeps the balance; among equals the one to the lighter side.
    fn best_move(&mut self) -> Option<(u32, usize)> {
        let most = self.most();
        let mut found = None;
        for to in 0..2 {
            while let Some((gain, v)) = self.queues[to].peek().copied() {
                let current = self.gains[to][v as usize];
                let free = self.side[v as usize] == SEPARATOR && !self.moved[v as usize];
                if !free || gain != current || self.weights[to] + self.graph.weight(v) > most {
                    self.queues[to].pop();
                    if free && gain > current {
                        self.queues[to].push((current, v));
                    }
                    continue;
                }
                found = found.max(Some((gain, self.weights[1 - to], to, v)));
                break;
            }
        }
        found.map(|(_, _, to, v)| (v, to))
    }

    /// Moves each vertex at most once, also where the separator grows, and returns to the best
    /// state.
    fn pass(&mut self) -> bool {
        let separator: Vec<u32> = (0..self.side.len() as u32).filter(|v| self.side[*v as usize] == SEPARATOR).collect();
        let patience = (5 * separator.len()).min(100);
        self.queues.iter_mut().for_each(BinaryHeap::clear);
        self.moved.fill(false);
        separator.into_iter().for_each(|v| self.enqueue(v));
        // Former labels, newest last.
        let mut history: Vec<(u32, u8)> = Vec::new();
        let first = self.cost();
        let (mut best, mut best_length, mut tries) = (first, 0, 0);
        while let Some((v, to)) = self.best_move().filter(|_| tries < patience) {
            self.moved[v as usize] = true;
            self.shift(v, to, &mut history);
            tries += 1;
            if self.cost() < best {
                (best, best_length, tries) = (self.cost(), history.len(), 0);
            }
        }
        for (v, label) in history.drain(best_length..).rev() {
            self.relabel(v, label);
        }
        best < first
    }

    /// Moves `v` from the separator to side `to`; its neighbours on the other side replace it.
    fn shift(&mut self, v: u32, to: usize, history: &mut Vec<(u32, u8)>) {
        let graph = self.graph;
        history.push((v, SEPARATOR));
        self.relabel(v, to as u8);
        for u in graph.around(v) {
            match self.side[*u as usize] {
                SEPARATOR => self.change_gain(*u, 1 - to, -graph.weight(v)),
                label if usize::from(label) != to => {
                    history.push((*u, label));
                    self.relabel(*u, SEPARATOR);
                    for x in graph.around(*u).iter().filter(|x| **x != v) {
                        if self.side[*x as usize] == SEPARATOR {
                            self.change_gain(*x, to, graph.weight(*u));
                        }
                    }
                    self.enqueue(*u);
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Graph of `vertices` vertices of one unknown with the given edges.
    fn graph(vertices: u32, edges: &[(u32, u32)]) -> Graph {
        let mut around = vec![Vec::new(); vertices as usize];
        for (a, b) in edges {
            around[*a as usize].push(*b);
            around[*b as usize].push(*a);
        }
        let starts = std::iter::once(0).chain(around.iter().scan(0, |end, next| {
            *end += next.len() as u32;
            Some(*end)
        }));
        let (starts, neighbours) = (starts.collect(), around.concat());
        Graph { starts, couplings: vec![1; neighbours.len()], neighbours, weights: vec![1; vertices as usize] }
    }

    /// Plate of square elements with four nodes.
    fn plate(length: u32, width: u32) -> Graph {
        let at = |k: u32| (k / width, k % width);
        let near = |a: u32, b: u32| at(a).0.abs_diff(at(b).0) <= 1 && at(a).1.abs_diff(at(b).1) <= 1;
        let before = |b: u32| (b.saturating_sub(width + 1)..b).filter(move |a| near(*a, b)).map(move |a| (a, b));
        graph(length * width, &(0..length * width).flat_map(before).collect::<Vec<_>>())
    }

    #[test]
    fn the_separator_of_a_strip_is_one_row_of_nodes_across_it() {
        for (length, width) in [(120, 15), (200, 10), (100, 30), (300, 40)] {
            let strip = plate(length, width);
            let side = strip.separators(2).swap_remove(0);
            assert_eq!(side.iter().filter(|s| **s == SEPARATOR).count() as u32, width);
            for v in 0..strip.len() as u32 {
                let apart = |u: &u32| side[v as usize] + side[*u as usize] != 1;
                assert!(strip.around(v).iter().all(apart), "an edge joins the sides");
            }
            let share = side.iter().filter(|s| **s == 0).count() as f64 / strip.len() as f64;
            assert!((0.4..0.6).contains(&share), "{share}");
        }
    }

    #[test]
    fn graphs_without_edges_in_parts_of_stars_and_of_one_clique_are_ordered() {
        let star: Vec<_> = (1..500).map(|v| (0, v)).collect();
        let clique: Vec<_> = (0..300).flat_map(|a| (0..a).map(move |b| (b, a))).collect();
        let pairs: Vec<_> = (0..250).map(|k| (2 * k, 2 * k + 1)).collect();
        for graph in [graph(0, &[]), graph(500, &[]), graph(500, &star), graph(300, &clique), graph(500, &pairs)] {
            let mut order = graph.dissect();
            order.sort_unstable();
            assert_eq!(order, (0..graph.len() as u32).collect::<Vec<_>>());
        }
    }
}
