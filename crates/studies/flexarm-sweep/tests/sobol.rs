//! Points of Sobol's sequence.

use flexarm_sweep::statistics::{Sample, SampleMethod};

/// Number of binary digits of the point number, after which the sequence repeats with another
/// shift.
const BLOCK: u32 = 16;

fn most_dimensions() -> usize {
    SampleMethod::Sobol.most_dimensions()
}

fn sample(seed: u64) -> Sample {
    Sample::new(SampleMethod::Sobol, most_dimensions(), 1 << (BLOCK + 2), seed).unwrap()
}

/// Returns a coordinate without its digital shift, which is that of point 0.
fn plain(point: u32, dimension: usize) -> f64 {
    let sample = sample(7);
    let digits = |point| (sample.coordinate(point, dimension) * 2f64.powi(32) - 0.5) as u32;
    f64::from(digits(point as usize) ^ digits(0)) / 2f64.powi(32)
}

/// Truth: the first points of `qmc.Sobol(scramble=False)` of scipy 1.17.1, with the same
/// direction numbers.
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
    for (i, point) in expected.iter().enumerate() {
        let found: [f64; 4] = std::array::from_fn(|d| plain(i as u32, d));
        assert_eq!(found, *point, "point {i}");
    }
}

/// Truth: the same program, for large point numbers and in high dimensions.
#[test]
fn points_far_out_and_in_high_dimensions_are_those_of_joe_and_kuo() {
    for (point, dimension, expected) in FAR {
        assert_eq!(plain(point, dimension), expected, "point {point}, dimension {dimension}");
    }
}

const FAR: [(u32, usize, f64); 9] = [
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

/// Truth: the definition of a (0, m, 1)-net: each of 2^m intervals contains one of 2^m points,
/// in every dimension and block.
#[test]
fn every_interval_holds_one_point() {
    for (seed, first) in [(0, 0), (1, 0), (0, 3 << BLOCK)] {
        for dimension in 0..most_dimensions() {
            let mut seen = [false; 256];
            (0..256).for_each(|i| seen[(256.0 * sample(seed).coordinate(first + i, dimension)) as usize] = true);
            assert!(seen.iter().all(|s| *s), "dimension {dimension}");
        }
    }
    // Blocks contain different points.
    assert_ne!(sample(0).coordinate(5, 2), sample(0).coordinate((1 << BLOCK) + 5, 2));
}
