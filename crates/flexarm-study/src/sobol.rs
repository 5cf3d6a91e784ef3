//! Sobol's sequence: points that fill a cube evenly, in any number.
//!
//! ```text
//! v_k = m_k 2^(52-k),   m_k = 2 a_1 m_(k-1) ^ 4 a_2 m_(k-2) ^ ... ^ 2^s m_(k-s) ^ m_(k-s)        (1)
//! x_i = xor of v_k over the ones of gray(i) = i ^ (i >> 1)                                       (2)
//! ```
//! Source: [Bratley and Fox 1988] for the method, [Joe and Kuo 2008] for the numbers.

use crate::joe_kuo::{DIMENSIONS, POLYNOMIALS};
use crate::random::bits;

/// Digits of a coordinate, in base 2.
const DIGITS: usize = 52;

/// The sequence in some dimensions, its digits shifted at random so that no coordinate is 0.
#[derive(Clone, Debug)]
pub struct SobolSequence {
    /// Direction numbers of each dimension.
    directions: Vec<[u64; DIGITS]>,
    /// What each dimension's digits are exclusively or-ed with.
    shifts: Vec<u64>,
}

impl SobolSequence {
    /// Most dimensions of the sequence.
    pub const MOST_DIMENSIONS: usize = DIMENSIONS;

    /// The sequence with its digits shifted; none for more dimensions than [`SobolSequence::MOST_DIMENSIONS`].
    ///
    /// A shift keeps how even the points are: every interval of length 2^-k has as many of 2^m points as before.
    pub fn shifted(dimensions: usize, seed: u64) -> Option<Self> {
        let plain = Self::plain(dimensions)?;
        let shift = |dimension: usize| bits(seed, dimension as u64, 0) >> (64 - DIGITS);
        Some(Self { shifts: (0..dimensions).map(shift).collect(), ..plain })
    }

    /// The sequence as it is in books, which begins at the origin.
    pub fn plain(dimensions: usize) -> Option<Self> {
        if dimensions > DIMENSIONS {
            return None;
        }
        let directions = (0..dimensions).map(directions).collect();
        Some(Self { directions, shifts: vec![0; dimensions] })
    }

    /// Coordinate of a point in [0, 1).
    pub fn coordinate(&self, point: u64, dimension: usize) -> f64 {
        let gray = point ^ (point >> 1);
        let mut x = self.shifts[dimension];
        for (k, v) in self.directions[dimension].iter().enumerate() {
            if gray >> k & 1 == 1 {
                x ^= v;
            }
        }
        x as f64 * (0.5f64).powi(DIGITS as i32)
    }
}

/// Direction numbers of a dimension, equation (1).
fn directions(dimension: usize) -> [u64; DIGITS] {
    let mut v = [0u64; DIGITS];
    let Some((polynomial, first)) = dimension.checked_sub(1).map(|k| POLYNOMIALS[k]) else {
        // The first dimension is van der Corput's sequence.
        return std::array::from_fn(|k| 1 << (DIGITS - 1 - k));
    };
    let s = first.len();
    for k in 0..DIGITS {
        v[k] = match first.get(k) {
            Some(m) => u64::from(*m) << (DIGITS - 1 - k),
            None => {
                let mut x = v[k - s] ^ (v[k - s] >> s);
                for j in 1..s {
                    if polynomial >> (s - j) & 1 == 1 {
                        x ^= v[k - j];
                    }
                }
                x
            }
        };
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the first points as scipy 1.17.1's `qmc.Sobol(scramble=False)` prints them, with the same direction numbers.
    #[test]
    fn the_first_points_are_those_of_joe_and_kuo() {
        let expected = [
            [0.0, 0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25, 0.25],
            [0.25, 0.75, 0.75, 0.75],
            [0.375, 0.375, 0.625, 0.875],
            [0.875, 0.875, 0.125, 0.375],
            [0.625, 0.125, 0.875, 0.625],
            [0.125, 0.625, 0.375, 0.125],
        ];
        let sequence = SobolSequence::plain(4).unwrap();
        for (i, point) in expected.iter().enumerate() {
            let found: [f64; 4] = std::array::from_fn(|d| sequence.coordinate(i as u64, d));
            assert_eq!(found, *point, "point {i}");
        }
    }

    /// Truth: the same program, far out in the sequence and in its last dimensions.
    #[test]
    fn points_far_out_and_in_high_dimensions_are_those_of_joe_and_kuo() {
        let sequence = SobolSequence::plain(128).unwrap();
        for (point, dimension, expected) in FAR {
            assert_eq!(sequence.coordinate(point, dimension), expected, "point {point}, dimension {dimension}");
        }
        assert!(SobolSequence::plain(129).is_none());
    }

    const FAR: [(u64, usize, f64); 9] = [
        (1000, 1, 0.0966796875),
        (1000, 2, 0.5185546875),
        (4999, 7, 0.9783935546875),
        (4999, 20, 0.1090087890625),
        (3333, 63, 0.939208984375),
        (4096, 100, 0.2669677734375),
        (4999, 126, 0.6051025390625),
        (4999, 127, 0.1827392578125),
        (17, 127, 0.84375),
    ];

    /// Truth: the definition of a (0, m, 1)-net: each of 2^m intervals holds one of 2^m points, shifted or not, in every dimension.
    #[test]
    fn every_interval_holds_one_point() {
        for seed in 0..4 {
            let sequence = SobolSequence::shifted(128, seed).unwrap();
            for dimension in 0..128 {
                let mut seen = [false; 256];
                (0..256).for_each(|i| seen[(256.0 * sequence.coordinate(i, dimension)) as usize] = true);
                assert!(seen.iter().all(|s| *s), "dimension {dimension}");
            }
        }
    }
}
