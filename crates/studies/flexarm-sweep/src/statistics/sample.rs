//! Sampling designs: points in a unit cube, each determined by its number.
//!
//! Start at [`Sample::coordinate`]. A point depends on seed and number only, so that runs may finish
//! in any order and a sweep may be continued. Not here: the sequence itself (`sobol.rs`), and the map
//! from the unit interval to values of a parameter (`distribution.rs`).

use rand::seq::SliceRandom;

use crate::statistics::random::{stream, uniform};
use crate::statistics::sobol;

/// Sampling method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleMethod {
    /// Independent random points.
    Random,
    /// Latin hypercube: each of the n intervals of every coordinate contains one point.
    LatinHypercube,
    /// Sobol's sequence with a random digital shift, a new one for each 65536 points.
    Sobol,
    /// Saltelli's design for [`crate::statistics::sobol_indices`]: two points of Sobol's sequence,
    /// and the first with one coordinate at a time replaced by that of the second.
    Saltelli,
}

impl SampleMethod {
    /// Words for the methods in files, and their meaning.
    pub const WORDS: [(&'static str, Self, &'static str); 4] = [
        ("random", Self::Random, "independent random points"),
        ("latin-hypercube", Self::LatinHypercube, "one point in every interval of each parameter"),
        ("sobol", Self::Sobol, "Sobol sequence with a random shift"),
        ("saltelli", Self::Saltelli, "count times (parameters + 2) points for Sobol indices"),
    ];

    /// Returns the maximum number of dimensions.
    pub fn most_dimensions(self) -> usize {
        match self {
            Self::Random | Self::LatinHypercube => usize::MAX,
            Self::Sobol => sobol::MAX_DIMENSIONS,
            Self::Saltelli => sobol::MAX_DIMENSIONS / 2,
        }
    }
}

/// Sample of points in a unit cube.
#[derive(Clone, Debug)]
pub struct Sample {
    method: SampleMethod,
    dimensions: usize,
    count: usize,
    seed: u64,
    /// Interval of each point, by dimension.
    order: Vec<Vec<usize>>,
}

impl Sample {
    /// Returns a sample of `count` points, or of `count` base points of Saltelli's design; `None`
    /// if the method does not support the number of dimensions.
    ///
    /// Cost: memory of `count` times `dimensions` for Latin hypercubes, otherwise negligible.
    pub fn new(method: SampleMethod, dimensions: usize, count: usize, seed: u64) -> Option<Self> {
        if dimensions > method.most_dimensions() {
            return None;
        }
        let shuffled = |d: usize| {
            let mut order: Vec<usize> = (0..count).collect();
            order.shuffle(&mut stream(seed, 2 * d as u64 + 1));
            order
        };
        let order = match method {
            SampleMethod::LatinHypercube => (0..dimensions).map(shuffled).collect(),
            _ => Vec::new(),
        };
        Some(Self { method, dimensions, count, seed, order })
    }

    /// Returns the number of points.
    pub fn points(&self) -> usize {
        match self.method {
            SampleMethod::Saltelli => self.count * (self.dimensions + 2),
            _ => self.count,
        }
    }

    /// Returns a coordinate of a point, in the open interval from 0 to 1.
    pub fn coordinate(&self, point: usize, dimension: usize) -> f64 {
        let own = || uniform(self.seed, 2 * dimension as u64, point as u64);
        match self.method {
            SampleMethod::Random => own(),
            SampleMethod::LatinHypercube => (self.order[dimension][point] as f64 + own()) / self.count.max(1) as f64,
            SampleMethod::Sobol => sobol::shifted(point, dimension, self.seed),
            SampleMethod::Saltelli => {
                let (base, place) = (point / (self.dimensions + 2), point % (self.dimensions + 2));
                // Order of the points: A, B, then A with one coordinate of B.
                let from_b = place == 1 || place == dimension + 2;
                let column = dimension + if from_b { self.dimensions } else { 0 };
                sobol::shifted(base, column, self.seed)
            }
        }
    }
}

/// Returns the levels of the `point`-th point of a full grid, in which the last parameter changes
/// fastest.
///
/// * `sizes`: number of levels of each parameter.
pub fn grid_levels(point: usize, sizes: &[usize]) -> Vec<usize> {
    let mut rest = point;
    let mut levels: Vec<usize> = sizes
        .iter()
        .rev()
        .map(|size| {
            let level = rest % size;
            rest /= size;
            level
        })
        .collect();
    levels.reverse();
    levels
}
