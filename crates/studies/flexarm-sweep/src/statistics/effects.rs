//! Main effect of a parameter on a result, and the distribution of results.
//!
//! Start at [`main_effect`]. Not here: whether an effect exceeds chance ([`super::chance`]),
//! interactions ([`super::indices`]).

use crate::statistics::indices::quantile;

/// Group of runs with equal or similar values of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectGroup {
    /// Mean of the parameter.
    pub x: f64,
    /// Number of runs.
    pub count: usize,
    /// Mean of the result.
    pub mean: f64,
    /// Standard error of the mean result.
    pub std_error: f64,
}

/// Means of a result over groups of a parameter's values.
#[derive(Clone, Debug, PartialEq)]
pub struct MainEffect {
    /// Groups, sorted by the parameter.
    pub groups: Vec<EffectGroup>,
    /// Share of the result's variance that is between the groups (correlation ratio). On a full
    /// grid it is the share of the main effect in the analysis of variance; on a sample it is an
    /// estimate of the first-order Sobol index with positive bias.
    pub share: f64,
}

/// Grouping of runs by a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grouping {
    /// One group for each value: for parameters with listed values.
    Levels,
    /// Groups of about equal size if there are many values: for random parameters. Runs with the
    /// same value are in one group.
    Bins,
}

/// Maximum number of values of a random parameter for one group per value.
const MAX_LEVELS: usize = 12;
/// Maximum number of groups of other random parameters.
const BINS: usize = 8;
/// Minimum size of a group, if there are enough runs for three groups.
const MIN_IN_BIN: usize = 6;

/// Returns the main effect of a parameter; `None` with fewer than two groups, or if the result does
/// not vary.
///
/// Ignores runs whose `x` or `y` is NaN.
pub fn main_effect(x: &[f64], y: &[f64], grouping: Grouping) -> Option<MainEffect> {
    let mut pairs: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<&[(f64, f64)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
    if groups.len() > MAX_LEVELS && grouping == Grouping::Bins {
        groups = bins(&pairs);
    }
    if groups.len() < 2 {
        return None;
    }
    // Correlation ratio: variance of the group means over that of all results.
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|p| p.1).sum::<f64>() / n;
    let variance = pairs.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>() / n;
    if variance == 0.0 {
        return None;
    }
    let groups: Vec<EffectGroup> = groups.iter().map(|pairs| group(pairs)).collect();
    let between = groups.iter().map(|g| g.count as f64 * (g.mean - mean).powi(2)).sum::<f64>() / n;
    Some(MainEffect { groups, share: between / variance })
}

/// Divides sorted pairs into groups of about equal size; pairs with the same value are in one
/// group.
fn bins(pairs: &[(f64, f64)]) -> Vec<&[(f64, f64)]> {
    let n = pairs.len();
    let wanted = (n / MIN_IN_BIN).clamp(3, BINS);
    let mut groups = Vec::with_capacity(wanted);
    let (mut start, mut end) = (0, 0);
    for level in pairs.chunk_by(|a, b| a.0 == b.0) {
        end += level.len();
        if end * wanted >= (groups.len() + 1) * n {
            groups.push(&pairs[start..end]);
            start = end;
        }
    }
    groups
}

/// Returns means and standard error `√(Σ (y - ȳ)² / (n (n - 1)))` of a group.
fn group(pairs: &[(f64, f64)]) -> EffectGroup {
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|p| p.1).sum::<f64>() / n;
    let square = pairs.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>();
    EffectGroup {
        x: pairs.iter().map(|p| p.0).sum::<f64>() / n,
        count: pairs.len(),
        mean,
        std_error: if pairs.len() > 1 { (square / (n - 1.0) / n).sqrt() } else { 0.0 },
    }
}

/// Statistics of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Number of finite values.
    pub count: usize,
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation; 0 for a single value.
    pub std: f64,
    /// Quantiles 0.05, 0.5 and 0.95.
    pub quantiles: [f64; 3],
}

/// Returns the statistics of the finite values; `None` if there are none.
pub fn spread(values: &[f64]) -> Option<Spread> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let (min, max) = (*sorted.first()?, *sorted.last()?);
    let n = sorted.len() as f64;
    let mean = sorted.iter().sum::<f64>() / n;
    let square = sorted.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    let std = (square / (n - 1.0).max(1.0)).sqrt();
    let quantiles = [0.05, 0.5, 0.95].map(|part| quantile(&sorted, part));
    Some(Spread { count: sorted.len(), min, max, mean, std, quantiles })
}

/// Returns the Pareto-optimal points of two minimised quantities, sorted by the first; of equal
/// points only the first one.
pub fn pareto_front(a: &[f64], b: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..a.len().min(b.len())).filter(|k| a[*k].is_finite() && b[*k].is_finite()).collect();
    order.sort_by(|i, j| a[*i].total_cmp(&a[*j]).then(b[*i].total_cmp(&b[*j])).then(i.cmp(j)));
    let mut least = f64::INFINITY;
    order.retain(|k| {
        let better = b[*k] < least;
        least = least.min(b[*k]);
        better
    });
    order
}
