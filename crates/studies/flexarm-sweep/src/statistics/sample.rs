//! Sampling designs: points in a unit cube, each determined by its number.

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
            Self::Sobol => sobol::MOST_DIMENSIONS,
            Self::Saltelli => sobol::MOST_DIMENSIONS / 2,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the definition of a Latin hypercube.
    #[test]
    fn a_latin_hypercube_meets_every_interval_once_in_each_dimension() {
        for count in [1, 7, 100] {
            let sample = Sample::new(SampleMethod::LatinHypercube, 5, count, 3).unwrap();
            for d in 0..5 {
                let mut seen = vec![0; count];
                (0..count).for_each(|k| seen[(count as f64 * sample.coordinate(k, d)) as usize] += 1);
                assert!(seen.iter().all(|n| *n == 1), "{count} {d} {seen:?}");
            }
        }
    }

    /// Truth: for a sum of the coordinates the error of a Latin hypercube is of order n^-3/2, that
    /// of random points of order n^-1/2.
    #[test]
    fn a_latin_hypercube_and_sobols_sequence_meet_the_mean_of_a_sum_closer_than_random_points() {
        let (n, d) = (256, 4);
        let error = |method| {
            let rms: f64 = (0..50)
                .map(|seed| {
                    let sample = Sample::new(method, d, n, seed).unwrap();
                    let sum: f64 = (0..n).map(|k| (0..d).map(|c| sample.coordinate(k, c)).sum::<f64>()).sum();
                    (sum / n as f64 - 0.5 * d as f64).powi(2)
                })
                .sum();
            (rms / 50.0).sqrt()
        };
        let (random, latin, sobol) =
            (error(SampleMethod::Random), error(SampleMethod::LatinHypercube), error(SampleMethod::Sobol));
        // expected: sqrt(4/12/256) = 3.6e-2 for random points, 256 times less for Latin hypercubes
        assert!((random / 0.0361 - 1.0).abs() < 0.3, "{random}");
        assert!((latin / (0.0361 / 256.0) - 1.0).abs() < 0.3, "{latin}");
        assert!(sobol < random / 10.0, "{sobol}");
    }

    /// Truth: the definition of the design.
    #[test]
    fn saltellis_design_takes_one_coordinate_after_the_other_from_the_second_point() {
        let d = 3;
        let sample = Sample::new(SampleMethod::Saltelli, d, 8, 1).unwrap();
        assert_eq!(sample.points(), 40);
        for base in 0..8 {
            let at = |place, c| sample.coordinate(base * (d + 2) + place, c);
            for i in 0..d {
                for c in 0..d {
                    assert_eq!(at(2 + i, c), at(usize::from(c == i), c));
                }
                assert_ne!(at(0, i), at(1, i));
            }
        }
    }

    #[test]
    fn a_grid_has_every_combination_once_with_the_last_parameter_fastest() {
        let all: Vec<Vec<usize>> = (0..6).map(|k| grid_levels(k, &[2, 3])).collect();
        assert_eq!(all, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
        assert_eq!(grid_levels(0, &[]), [0usize; 0]);
    }
}
