//! Random numbers that depend on nothing but their place: seed, stream and index. Any of them can be had alone, on any machine,
//! in any order.

/// Steps of Weyl's sequence in SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// The output function of SplitMix64.
fn mixed(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// 64 random bits: the `index`-th of a stream.
pub(crate) fn bits(seed: u64, stream: u64, index: u64) -> u64 {
    let start = mixed(mixed(seed.wrapping_add(GOLDEN)) ^ stream.wrapping_mul(GOLDEN).wrapping_add(1));
    mixed(start.wrapping_add(index.wrapping_add(1).wrapping_mul(GOLDEN)))
}

/// A number between 0 and 1, neither of them.
///
/// * `stream`: numbers of different streams have nothing to do with each other; a dimension of a sample, for instance.
pub fn uniform(seed: u64, stream: u64, index: u64) -> f64 {
    ((bits(seed, stream, index) >> 11) as f64 + 0.5) * (0.5f64).powi(53)
}

/// A whole number below `n`, each as likely as the others to 1 in 2^53 / n.
pub(crate) fn below(n: usize, seed: u64, stream: u64, index: u64) -> usize {
    ((uniform(seed, stream, index) * n as f64) as usize).min(n.saturating_sub(1))
}

/// The numbers from 0 to n - 1 in a random order (Fisher and Yates).
pub(crate) fn permutation(n: usize, seed: u64, stream: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for k in (1..n).rev() {
        order.swap(k, below(k + 1, seed, stream, k as u64));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the moments of the uniform distribution, 1/2 and 1/12; their scatter over n numbers is 0.29/sqrt(n) and 0.075/sqrt(n).
    #[test]
    fn numbers_of_a_stream_are_spread_evenly_and_streams_have_nothing_to_do_with_each_other() {
        let n = 100_000;
        let a: Vec<f64> = (0..n).map(|k| uniform(1, 0, k)).collect();
        let b: Vec<f64> = (0..n).map(|k| uniform(1, 1, k)).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..n as usize).map(f).sum::<f64>() / n as f64;
        assert!((mean(&|k| a[k]) - 0.5).abs() < 4.0 * 0.29 / (n as f64).sqrt());
        assert!((mean(&|k| (a[k] - 0.5).powi(2)) - 1.0 / 12.0).abs() < 4.0 * 0.075 / (n as f64).sqrt());
        // Covariance of two streams, and of a stream with itself one place on: 1/12 / sqrt(n).
        let bound = 4.0 / 12.0 / (n as f64).sqrt();
        assert!(mean(&|k| (a[k] - 0.5) * (b[k] - 0.5)).abs() < bound);
        assert!(mean(&|k| (a[k] - 0.5) * (a[(k + 1) % n as usize] - 0.5)).abs() < bound);
        assert!(a.iter().all(|x| *x > 0.0 && *x < 1.0));
        assert_eq!(uniform(1, 0, 77), a[77]);
        assert_ne!(uniform(2, 0, 77), a[77]);
    }

    #[test]
    fn a_permutation_has_every_number_once_and_each_place_is_as_likely() {
        let mut places = [0usize; 5];
        for seed in 0..5000 {
            let order = permutation(5, seed, 3);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4]);
            places[order.iter().position(|k| *k == 0).unwrap()] += 1;
        }
        // 1000 expected in each place, scatter 28.
        assert!(places.iter().all(|count| count.abs_diff(1000) < 120), "{places:?}");
    }
}
