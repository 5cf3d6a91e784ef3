//! Sobol indices of a Saltelli design: the share of a result's variance due to each parameter, with
//! confidence intervals.
//!
//! ```text
//! first  S_i  = mean of f(B) (f(AB_i) - f(A)) / V                   (1)   without interactions
//! total  ST_i = mean of (f(A) - f(AB_i))^2 / (2 V)                  (2)   with all interactions
//! ```
//! A and B are the two points of a base, AB_i is A with coordinate i of B, and V is the variance of
//! f over all A and B. Source: [Saltelli 2010], table 2, (b) and (f).

use rand::RngExt;

use crate::statistics::random::stream;

/// Sobol indices of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SobolIndex {
    /// First-order index, equation (1).
    pub first: f64,
    /// 95 % confidence interval of `first`.
    pub first_interval: [f64; 2],
    /// Total index, equation (2).
    pub total: f64,
    /// 95 % confidence interval of `total`.
    pub total_interval: [f64; 2],
}

/// Number of bootstrap samples for the intervals.
const DRAWS: usize = 400;
/// Minimum number of base points.
const FEWEST: usize = 8;

/// Returns the Sobol indices of all parameters; `None` with fewer than eight valid base points, or
/// if the result does not vary.
///
/// * `y`: the result at each point of the design, in its order; base points with a NaN in one of
///   their points are ignored.
/// * `dimensions`: number of parameters.
/// * `seed`: seed for the intervals (bootstrap over base points, percentiles).
pub fn sobol_indices(y: &[f64], dimensions: usize, seed: u64) -> Option<Vec<SobolIndex>> {
    let size = dimensions + 2;
    let sound: Vec<&[f64]> = y.chunks_exact(size).filter(|base| base.iter().all(|y| y.is_finite())).collect();
    if sound.len() < FEWEST || dimensions == 0 {
        return None;
    }
    // Estimates from all base points, and from resamples of them for the intervals.
    let all: Vec<usize> = (0..sound.len()).collect();
    let found = estimate(&sound, &all, dimensions)?;
    let mut drawn: Vec<Vec<[f64; 2]>> = vec![Vec::with_capacity(DRAWS); dimensions];
    let mut numbers = stream(seed, 0);
    for _ in 0..DRAWS {
        let rows: Vec<usize> = all.iter().map(|_| numbers.random_range(0..sound.len())).collect();
        // Resamples without variance are ignored.
        let Some(again) = estimate(&sound, &rows, dimensions) else { continue };
        drawn.iter_mut().zip(again).for_each(|(list, pair)| list.push(pair));
    }
    let interval = |of: &[[f64; 2]], which: usize| {
        let mut values: Vec<f64> = of.iter().map(|pair| pair[which]).collect();
        values.sort_by(f64::total_cmp);
        [quantile(&values, 0.025), quantile(&values, 0.975)]
    };
    let index = |(found, of): (&[f64; 2], &Vec<[f64; 2]>)| SobolIndex {
        first: found[0],
        first_interval: interval(of, 0),
        total: found[1],
        total_interval: interval(of, 1),
    };
    Some(found.iter().zip(&drawn).map(index).collect())
}

/// Returns the first-order and total index of each parameter over some base points.
fn estimate(bases: &[&[f64]], rows: &[usize], dimensions: usize) -> Option<Vec<[f64; 2]>> {
    let n = rows.len() as f64;
    let sum: f64 = rows.iter().map(|k| bases[*k][0] + bases[*k][1]).sum();
    let mean = sum / (2.0 * n);
    let square = |y: f64| (y - mean) * (y - mean);
    let variance = rows.iter().map(|k| square(bases[*k][0]) + square(bases[*k][1])).sum::<f64>() / (2.0 * n);
    // A variance due to rounding counts as zero.
    if variance <= 1e-24 * mean * mean || variance == 0.0 {
        return None;
    }
    let indices_of = |i: usize| {
        let (mut first, mut total) = (0.0, 0.0);
        for k in rows {
            let base = bases[*k];
            let (a, b, mixed) = (base[0], base[1], base[2 + i]);
            first += (b - mean) * (mixed - a);
            total += (a - mixed) * (a - mixed);
        }
        [first / n / variance, total / (2.0 * n) / variance]
    };
    Some((0..dimensions).map(indices_of).collect())
}

/// Returns a quantile of sorted values by linear interpolation; NaN without values.
pub(crate) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = part * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}
