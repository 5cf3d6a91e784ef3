//! Sobol's low-discrepancy sequence of points in a unit cube.
//!
//! Source: [Joe and Kuo 2008].

use rand::Rng;
use sobol_burley::parts::sobol_rev;

use crate::statistics::random::stream;

/// Maximum number of dimensions.
pub(crate) const MAX_DIMENSIONS: usize = sobol_burley::NUM_DIMENSIONS as usize;
/// Number of binary digits of the point number, after which the sequence repeats with another
/// shift.
const BLOCK: u32 = 16;

/// Returns a coordinate of the sequence without a shift, as its 32 binary fraction digits.
fn digits(point: u32, dimension: usize) -> u32 {
    let gray = point ^ (point >> 1);
    sobol_rev(gray.reverse_bits(), dimension as u32).reverse_bits()
}

/// Returns a coordinate with a random digital shift, in the open interval from 0 to 1.
///
/// A digital shift preserves uniformity: every interval of length 2^-k contains as many of 2^m
/// points as before.
pub(crate) fn shifted(point: usize, dimension: usize, seed: u64) -> f64 {
    let mut shifts = stream(seed, dimension as u64);
    shifts.set_word_pos((point >> BLOCK) as u128);
    let point = point & ((1 << BLOCK) - 1);
    (f64::from(digits(point as u32, dimension) ^ shifts.next_u32()) + 0.5) / 2f64.powi(32)
}
