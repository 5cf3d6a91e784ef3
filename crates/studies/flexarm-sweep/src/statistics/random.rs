//! Random numbers that depend only on seed, stream and index. Each can be computed by itself, on
//! any machine, in any order.

use rand::distr::Open01;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Returns the generator of a stream at its start. Different streams are independent.
pub(crate) fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    generator.set_stream(stream);
    generator
}

/// Returns the `index`-th number of a stream, in the open interval from 0 to 1.
pub(crate) fn uniform(seed: u64, stream: u64, index: u64) -> f64 {
    let mut generator = self::stream(seed, stream);
    // A number consumes two words of 32 bits.
    generator.set_word_pos(2 * u128::from(index));
    generator.sample(Open01)
}
