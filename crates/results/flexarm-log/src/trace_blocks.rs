//! Curves of a long run: minimum and maximum of each block of samples.
//!
//! Start at [`Blocks::push`]. Memory does not grow with the run: when there are too many blocks,
//! pairs are merged. Not here: short runs, whose samples are all kept ([`crate::trace`]).

use crate::{ElasticSample, TraceRow};

/// Maximum number of blocks, more than a page has points for.
const MAX_BLOCKS: usize = 4096;

/// A scalar of a run over time, as shown in curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveQuantity {
    /// Component of [`TraceRow::error_world`], 0 to 5 (m, rad).
    Error(usize),
    /// Norm of its translation (m).
    ErrorSize,
    /// Norm of its rotation (rad).
    TurnSize,
    /// Component of [`TraceRow::error_path`], 0 to 2 (m).
    AlongPath(usize),
    /// Norm of its component across the path (m).
    AcrossPath,
    /// Norm of [`TraceRow::static_m`] (m).
    StaticSize,
    /// Norm of the error without its static part (m).
    MovingSize,
    /// Component, 0 to 2, of a contributor's share of the TCP displacement (m).
    Contribution(usize, usize),
    /// Its norm (m).
    ContributionSize(usize),
    /// Channel of a strain gauge or stress point (m/m or Pa).
    Gauge(usize),
    /// Joint position (rad or m).
    Joint(usize),
    /// Joint velocity (rad/s or m/s).
    JointRate(usize),
    /// Effort of a drive (N m or N).
    Effort(usize),
    /// Effort of a drive of the rigid twin (N m or N).
    RigidEffort(usize),
    /// Component, 0 to 5, of the deflection of an element (m, rad).
    Deflection(usize, usize),
    /// Component, 0 to 5, of the load of an element (N, N m).
    Load(usize, usize),
    /// Norms of an element's displacement (0) and rotation (1) (m, rad).
    DeflectionSize(usize, usize),
    /// Norms of an element's force (0) and moment (1) (N, N m).
    LoadSize(usize, usize),
    /// Kinetic (0), gravitational (1), elastic (2) energy (J).
    Energy(usize),
}

impl CurveQuantity {
    const SIZES: [Self; 5] = [Self::ErrorSize, Self::TurnSize, Self::AcrossPath, Self::StaticSize, Self::MovingSize];

    /// Returns its value in a row; NaN if the run has no such joint, contributor or element.
    pub fn of(self, row: &TraceRow) -> f64 {
        let element = |k: usize| row.elastic.get(k);
        let number = |values: &[f64], k: usize| values.get(k).copied().unwrap_or(f64::NAN);
        match self {
            Self::Error(c) => row.error_world[c],
            Self::ErrorSize => row.error_m(),
            Self::TurnSize => norm(&row.error_world[3..]),
            Self::AlongPath(c) => row.error_path[c],
            Self::AcrossPath => row.error_path[1].hypot(row.error_path[2]),
            Self::StaticSize => norm(&row.static_m),
            Self::MovingSize => norm(&[0, 1, 2].map(|c| row.error_world[c] - row.static_m[c])),
            Self::Contribution(k, c) => row.contributions.get(k).map_or(f64::NAN, |moved| moved[c]),
            Self::ContributionSize(k) => row.contributions.get(k).map_or(f64::NAN, |moved| norm(moved)),
            Self::Gauge(k) => number(&row.gauges, k),
            Self::Joint(k) => number(&row.q, k),
            Self::JointRate(k) => number(&row.qdot, k),
            Self::Effort(k) => number(&row.effort, k),
            Self::RigidEffort(k) => number(&row.rigid_effort, k),
            Self::Deflection(k, c) => element(k).map_or(f64::NAN, |element| element.deflection[c]),
            Self::Load(k, c) => element(k).map_or(f64::NAN, |element| element.load[c]),
            Self::DeflectionSize(k, half) => element(k).map_or(f64::NAN, |e| norm(&e.deflection[3 * half..][..3])),
            Self::LoadSize(k, half) => element(k).map_or(f64::NAN, |e| norm(&e.load[3 * half..][..3])),
            Self::Energy(kind) => [row.energy.kinetic, row.energy.potential, row.energy.elastic][kind],
        }
    }

    /// Computes the values of [`CurveQuantity::all`], in the same order.
    fn all_values(row: &TraceRow, values: &mut Vec<f64>) {
        let TraceRow { error_world, error_path, energy, .. } = row;
        values.clear();
        values.extend_from_slice(error_world);
        for quantity in Self::SIZES {
            values.push(quantity.of(row));
        }
        let energies = [energy.kinetic, energy.potential, energy.elastic];
        values.extend(error_path.iter().zip(energies).flat_map(|(path, energy)| [*path, energy]));
        values.extend(row.contributions.iter().flat_map(|moved| [moved[0], moved[1], moved[2], norm(moved)]));
        for list in [&row.gauges, &row.q, &row.qdot, &row.effort, &row.rigid_effort] {
            values.extend_from_slice(list);
        }
        for ElasticSample { deflection, load } in &row.elastic {
            for (deflection, load) in deflection.iter().zip(load) {
                values.extend_from_slice(&[*deflection, *load]);
            }
            for half in [0..3, 3..6] {
                values.extend_from_slice(&[norm(&deflection[half.clone()]), norm(&load[half])]);
            }
        }
    }

    /// Returns all quantities of a run with the contributors, joints and elements of this row.
    fn all(row: &TraceRow) -> Vec<Self> {
        let mut all: Vec<Self> = (0..6).map(Self::Error).collect();
        all.extend(Self::SIZES);
        all.extend((0..3).flat_map(|c| [Self::AlongPath(c), Self::Energy(c)]));
        for k in 0..row.contributions.len() {
            all.extend((0..3).map(|c| Self::Contribution(k, c)).chain([Self::ContributionSize(k)]));
        }
        all.extend((0..row.gauges.len()).map(Self::Gauge));
        all.extend((0..row.q.len()).map(Self::Joint));
        all.extend((0..row.qdot.len()).map(Self::JointRate));
        all.extend((0..row.effort.len()).map(Self::Effort));
        all.extend((0..row.rigid_effort.len()).map(Self::RigidEffort));
        for k in 0..row.elastic.len() {
            all.extend((0..6).flat_map(|c| [Self::Deflection(k, c), Self::Load(k, c)]));
            all.extend((0..2).flat_map(|half| [Self::DeflectionSize(k, half), Self::LoadSize(k, half)]));
        }
        all
    }
}

/// Euclidean norm.
pub(crate) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Minimum and maximum of all quantities in blocks of equal numbers of samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blocks {
    quantities: Vec<CurveQuantity>,
    /// First and last time of each block (s).
    times: Vec<[f64; 2]>,
    /// Path length of the rigid TCP at the same times (m).
    ways: Vec<[f64; 2]>,
    /// Minimum and maximum of each quantity, for each block; NaN where there is none. Entries
    /// beyond the number of blocks are buffers to be reused. Each block is a small allocation of
    /// its own, so that together they fit into memory left free by the start of the program.
    ranges: Vec<Vec<[f64; 2]>>,
    /// Number of samples of a full block, and of the last one.
    size: u64,
    filled: u64,
    way: f64,
    last_m: [f64; 3],
    /// Values of the last sample; buffer reused.
    values: Vec<f64>,
}

impl Blocks {
    /// Whether no sample has been added.
    pub(crate) fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Adds a sample.
    pub(crate) fn push(&mut self, row: &TraceRow) {
        if self.is_empty() {
            (self.quantities, self.size, self.last_m) = (CurveQuantity::all(row), 1, row.rigid_m);
        }
        // Path length of the rigid TCP.
        self.way += norm(&[0, 1, 2].map(|c| row.rigid_m[c] - self.last_m[c]));
        self.last_m = row.rigid_m;
        // The first sample of a block.
        if self.is_empty() || self.filled == self.size {
            if self.times.len() == MAX_BLOCKS {
                self.halve();
            }
            self.times.push([row.time_s; 2]);
            self.ways.push([self.way; 2]);
            match self.ranges.get_mut(self.times.len() - 1) {
                Some(ranges) => ranges.fill([f64::NAN; 2]),
                None => self.ranges.push(vec![[f64::NAN; 2]; self.quantities.len()]),
            }
            self.filled = 0;
        }
        // Ranges of the block.
        self.filled += 1;
        let last = self.times.len() - 1;
        (self.times[last][1], self.ways[last][1]) = (row.time_s, self.way);
        CurveQuantity::all_values(row, &mut self.values);
        for (range, value) in self.ranges[last].iter_mut().zip(&self.values) {
            *range = wider(*range, [*value; 2]);
        }
    }

    /// Merges every two blocks into one.
    fn halve(&mut self) {
        for k in 0..MAX_BLOCKS / 2 {
            self.times[k] = [self.times[2 * k][0], self.times[2 * k + 1][1]];
            self.ways[k] = [self.ways[2 * k][0], self.ways[2 * k + 1][1]];
            let second = std::mem::take(&mut self.ranges[2 * k + 1]);
            for (range, other) in self.ranges[2 * k].iter_mut().zip(&second) {
                *range = wider(*range, *other);
            }
            self.ranges[2 * k + 1] = second;
            self.ranges.swap(k, 2 * k);
        }
        self.times.truncate(MAX_BLOCKS / 2);
        self.ways.truncate(MAX_BLOCKS / 2);
        self.size *= 2;
    }

    /// Returns two values for each block, minimum and maximum; NaN for quantities that the run
    /// lacks.
    pub(crate) fn values(&self, quantity: CurveQuantity) -> Vec<f64> {
        let Some(at) = self.quantities.iter().position(|known| *known == quantity) else {
            return vec![f64::NAN; 2 * self.times.len()];
        };
        self.ranges[..self.times.len()].iter().flat_map(|ranges| ranges[at]).collect()
    }

    /// Returns the times of [`Blocks::values`] (s).
    pub(crate) fn times(&self) -> Vec<f64> {
        self.times.as_flattened().to_vec()
    }

    /// Returns the path lengths of the rigid TCP at these times (m).
    pub(crate) fn ways(&self) -> Vec<f64> {
        self.ways.as_flattened().to_vec()
    }

    /// Number of samples of a block.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }
}

/// Union of two ranges; NaN is ignored.
fn wider(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}
