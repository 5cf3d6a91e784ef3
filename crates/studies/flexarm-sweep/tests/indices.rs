//! Sensitivity indices of functions in closed form.

use flexarm_sweep::statistics::{Sample, SampleMethod, sobol_indices};

use crate::random::uniform;

fn results(dimensions: usize, count: usize, seed: u64, f: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let sample = Sample::new(SampleMethod::Saltelli, dimensions, count, seed).unwrap();
    let point = |k: usize| (0..dimensions).map(|d| sample.coordinate(k, d)).collect::<Vec<_>>();
    (0..sample.points()).map(|k| f(&point(k))).collect()
}

/// Truth: [Ishigami and Homma 1990], variances in closed form.
#[test]
fn indices_of_the_ishigami_function_are_those_of_its_formulas() {
    use std::f64::consts::PI;
    let (a, b) = (7.0, 0.1);
    let y = results(3, 4096, 1, |u| {
        let x: Vec<f64> = u.iter().map(|u| PI * (2.0 * u - 1.0)).collect();
        x[0].sin() + a * x[1].sin().powi(2) + b * x[2].powi(4) * x[0].sin()
    });
    let v1 = 0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2);
    let v2 = a * a / 8.0;
    let v13 = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
    let v = v1 + v2 + v13;
    let expected = [(v1 / v, (v1 + v13) / v), (v2 / v, v2 / v), (0.0, v13 / v)];
    let found = sobol_indices(&y, 3, 0).unwrap();
    for (index, (first, total)) in found.iter().zip(expected) {
        // measured: 2e-3
        assert!((index.first - first).abs() < 0.01, "{index:?} {first}");
        assert!((index.total - total).abs() < 0.01, "{index:?} {total}");
    }
}

/// Truth: the g-function of Sobol, V_i = 1 / (3 (1 + a_i)^2), V = prod (1 + V_i) - 1, ST_i =
/// V_i prod_(j != i) (1 + V_j) / V.
#[test]
fn indices_of_the_g_function_are_those_of_its_formulas() {
    let a = [0.0, 1.0, 4.5, 9.0, 99.0];
    let g = |u: &[f64]| u.iter().zip(a).map(|(u, a)| ((4.0 * u - 2.0).abs() + a) / (1.0 + a)).product();
    let part: Vec<f64> = a.iter().map(|a| 1.0 / (3.0 * (1.0 + a) * (1.0 + a))).collect();
    let all: f64 = part.iter().map(|v| 1.0 + v).product::<f64>();
    let found = sobol_indices(&results(5, 8192, 2, g), 5, 0).unwrap();
    for (index, v) in found.iter().zip(&part) {
        let (first, total) = (v / (all - 1.0), v * all / (1.0 + v) / (all - 1.0));
        assert!((index.first - first).abs() < 0.01, "{index:?} {first}");
        assert!((index.total - total).abs() < 0.01, "{index:?} {total}");
    }
}

/// Truth: in about 95 of 100 studies with different seeds the interval contains the index of a
/// linear function, a_i^2 / sum a^2.
#[test]
fn intervals_hold_the_index_as_often_as_they_say() {
    let expected = 4.0 / 5.25;
    let mut held = [0, 0];
    for seed in 0..100 {
        let mut y = results(3, 64, seed, |u| 2.0 * u[0] + u[1] - 0.5 * u[2]);
        // Random points in place of the low-discrepancy ones, as the bootstrap assumes.
        let point = |k: u64, c: u64| uniform(seed + 1000, c, k);
        for (base, values) in y.chunks_exact_mut(5).enumerate() {
            let at = |mixed: &dyn Fn(u64) -> bool| {
                let c = |c: u64| point(base as u64, c + if mixed(c) { 3 } else { 0 });
                2.0 * c(0) + c(1) - 0.5 * c(2)
            };
            values[0] = at(&|_| false);
            values[1] = at(&|_| true);
            (0..3).for_each(|i| values[2 + i] = at(&|c| c == i as u64));
        }
        let index = sobol_indices(&y, 3, 5).unwrap()[0];
        held[0] += usize::from((index.first_interval[0]..=index.first_interval[1]).contains(&expected));
        held[1] += usize::from((index.total_interval[0]..=index.total_interval[1]).contains(&expected));
    }
    assert!(held.iter().all(|n| (87..=100).contains(n)), "{held:?}");
}

#[test]
fn base_points_with_a_run_that_failed_are_left_out_and_no_variance_has_no_indices() {
    let mut y = results(2, 64, 0, |u| u[0]);
    let whole = sobol_indices(&y, 2, 0).unwrap();
    y[4 * 10 + 2] = f64::NAN;
    let less = sobol_indices(&y, 2, 0).unwrap();
    assert!((whole[0].first - less[0].first).abs() < 0.1 && whole[0].first != less[0].first);
    assert!(less[1].total.abs() < 1e-12);
    assert_eq!(sobol_indices(&[1.0; 256], 2, 0), None);
    assert_eq!(sobol_indices(&y[..8], 2, 0), None);
}
