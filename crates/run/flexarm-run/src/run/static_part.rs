//! Static part of the TCP error: the deflection if the arm were at rest at each point of its
//! motion.
//!
//! The drives are at their commanded positions and the springs in equilibrium with gravity and the
//! current loads, without inertia forces. The curve is smooth between the times of jumps: it is
//! computed on a grid and interpolated by cubics. World axes, m, s. Not here: the equilibria
//! (`flexarm_stepping::StaticPath`).

use std::sync::Arc;

use flexarm_kinematics::Frame;
use flexarm_stepping::{Plant, StaticPath};
use nalgebra::Vector3;

/// Time between two equilibria along a motion (s); a cubic through four of them is accurate to a
/// thousandth of a millimetre.
const GRID_S: f64 = 0.02;
/// Number of equilibria per shortest period of a load.
const PER_PERIOD: f64 = 16.0;
/// Maximum number of grid intervals that are computed together.
const MAX_INTERVALS: usize = 64;

/// Evaluates the static part at ascending times.
pub struct StaticPart {
    path: StaticPath,
    tcp: Frame,
    /// Times between which the curve is smooth, ascending.
    breaks: Vec<f64>,
    /// Moves; between them, and without loads, the curve is constant.
    moves: Vec<(f64, f64)>,
    /// Sampling interval (s); a finer grid adds nothing.
    sample_s: f64,
    grid_s: f64,
    block: Block,
    failed: bool,
}

/// Section of the grid.
#[derive(Default)]
struct Block {
    start: f64,
    end: f64,
    /// Values at equal time intervals from start to end; a single value holds at all times.
    values: Vec<Vector3<f64>>,
}

impl StaticPart {
    pub(crate) fn new(plant: &Arc<Plant>, tcp: &Frame, moves: Vec<(f64, f64)>, duration: f64, sample_s: f64) -> Self {
        let changes = plant.inertia_changes.iter().map(|change| change.t);
        let ends = moves.iter().flat_map(|&(start, end)| [start, end]);
        let mut breaks: Vec<f64> =
            plant.load_jumps().chain(changes).chain(ends).chain([duration]).filter(|t| *t > 0.0).collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        let period = plant.loads.iter().map(|load| load.wrench.period).fold(f64::INFINITY, f64::min);
        Self {
            path: StaticPath::new(plant.clone()),
            tcp: tcp.clone(),
            breaks,
            moves,
            sample_s,
            grid_s: GRID_S.min(period / PER_PERIOD).max(sample_s),
            block: Block::default(),
            failed: false,
        }
    }

    /// Returns the TCP displacement at `t` (m, world axes); `t` must not decrease between calls.
    /// `None` if the arm has no equilibrium.
    pub(crate) fn at(&mut self, t: f64) -> Option<[f64; 3]> {
        while !self.failed && (self.block.values.is_empty() || t >= self.block.end) {
            let start = self.block.end;
            let next = self.breaks.partition_point(|at| *at <= start);
            let end = self.breaks.get(next).copied().unwrap_or(f64::INFINITY);
            match self.next_block(start, end) {
                Some(block) => self.block = block,
                None => self.failed = true,
            }
        }
        (!self.failed).then(|| self.block.at(t).into())
    }

    /// Computes the grid from `start`, at most to `end`.
    fn next_block(&mut self, start: f64, end: f64) -> Option<Block> {
        let moving = self.moves.iter().any(|&(from, to)| from < end && start < to);
        if end.is_infinite() || !(moving || self.is_loaded()) {
            return Some(Block { start, end, values: vec![self.displacement(start)?] });
        }
        let intervals = ((end - start) / self.grid_s).ceil().max(1.0);
        let (intervals, end) = match intervals > MAX_INTERVALS as f64 {
            true => (MAX_INTERVALS, start + MAX_INTERVALS as f64 * self.grid_s),
            // A cubic needs three intervals; fewer if the section is shorter than three samples.
            false => ((intervals as usize).max(if end - start > 3.0 * self.sample_s { 3 } else { 1 }), end),
        };
        let mut values = Vec::with_capacity(intervals + 1);
        for k in 0..intervals {
            values.push(self.displacement(start + (end - start) * k as f64 / intervals as f64)?);
        }
        // A jump at the end belongs to the next section.
        self.path.just_before(end).ok()?;
        values.push(self.path.displacement(&self.tcp));
        Some(Block { start, end, values })
    }

    fn is_loaded(&self) -> bool {
        !self.path.plant().loads.is_empty()
    }

    fn displacement(&mut self, t: f64) -> Option<Vector3<f64>> {
        self.path.at(t).ok()?;
        Some(self.path.displacement(&self.tcp))
    }
}

impl Block {
    /// Evaluates the polynomial through the four values around `t`, or fewer if there are fewer.
    fn at(&self, t: f64) -> Vector3<f64> {
        let intervals = self.values.len() - 1;
        if intervals == 0 {
            return self.values[0];
        }
        let x = (t - self.start) / (self.end - self.start) * intervals as f64;
        let nodes = self.values.len().min(4);
        let first = (x.floor().max(1.0) as usize - 1).min(self.values.len() - nodes);
        let mut sum = Vector3::zeros();
        for i in first..first + nodes {
            let others = (first..first + nodes).filter(|j| *j != i);
            let weight: f64 = others.map(|j| (x - j as f64) / (i as f64 - j as f64)).product();
            sum += self.values[i] * weight;
        }
        sum
    }
}
