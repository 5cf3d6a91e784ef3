//! Random numbers by their index.

use flexarm_sweep::statistics::{Sample, SampleMethod};
use rand::distr::Open01;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
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

/// Truth: the numbers of the generator in sequence.
#[test]
fn a_number_by_its_index_is_the_one_that_the_stream_has_there() {
    let sample = |seed| Sample::new(SampleMethod::Random, 4, 100, seed).unwrap();
    let numbers: Vec<f64> = stream(1, 6).sample_iter(Open01).take(100).collect();
    let drawn = sample(1);
    assert!((0..100).rev().all(|k| drawn.coordinate(k, 3) == numbers[k] && uniform(1, 6, k as u64) == numbers[k]));
    assert_ne!(sample(2).coordinate(77, 3), numbers[77]);
    assert_ne!(drawn.coordinate(77, 2), numbers[77]);
}
