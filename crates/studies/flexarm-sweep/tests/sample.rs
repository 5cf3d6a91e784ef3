//! Designs of samples.

use flexarm_sweep::statistics::{Sample, SampleMethod, grid_levels};

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
