//! Main effect of a parameter on a result, and the distribution of results.

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
const MOST_LEVELS: usize = 12;
/// Maximum number of groups of other random parameters.
const BINS: usize = 8;
/// Minimum size of a group, if there are enough runs for three groups.
const LEAST_IN_BIN: usize = 6;

/// Returns the main effect of a parameter; `None` with fewer than two groups, or if the result does
/// not vary.
///
/// Ignores runs whose `x` or `y` is NaN.
pub fn main_effect(x: &[f64], y: &[f64], grouping: Grouping) -> Option<MainEffect> {
    let mut pairs: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<&[(f64, f64)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
    if groups.len() > MOST_LEVELS && grouping == Grouping::Bins {
        groups = bins(&pairs);
    }
    if groups.len() < 2 {
        return None;
    }
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
    let wanted = (n / LEAST_IN_BIN).clamp(3, BINS);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::random::uniform;

    /// Truth: two-way analysis of variance by hand. With a = 0..n-1, b = 0, 1, 2 and y = 3 a + 2
    /// b^2 + c (a - m)(b - 1), where m is the mean of a, the last term has zero mean over a and
    /// over b, so that
    ///
    /// ```text
    /// V_a = 9 (n^2 - 1)/12     V_b = 4 Var(0, 1, 4) = 4 * 26/9     V_ab = c^2 (n^2 - 1)/12 * 2/3
    /// ```
    #[test]
    fn shares_of_a_full_factorial_are_those_of_the_analysis_of_variance_for_any_number_of_levels() {
        for n in [3u32, 13, 40, 1000] {
            let (mut a, mut b, mut y) = (Vec::new(), Vec::new(), Vec::new());
            let (m, c) = (0.5 * f64::from(n - 1), 0.7);
            for i in 0..n {
                for j in 0..3 {
                    let (x, z) = (f64::from(i), f64::from(j));
                    a.push(x);
                    b.push(z);
                    y.push(3.0 * x + 2.0 * z * z + c * (x - m) * (z - 1.0));
                }
            }
            let square = (f64::from(n).powi(2) - 1.0) / 12.0;
            let (va, vb, vab) = (9.0 * square, 4.0 * 26.0 / 9.0, c * c * square * 2.0 / 3.0);
            let all = va + vb + vab;
            let effects = [&a, &b].map(|x| main_effect(x, &y, Grouping::Levels).unwrap());
            for (effect, expected) in effects.iter().zip([va / all, vb / all]) {
                // measured: 3e-14
                assert!((effect.share - expected).abs() < 1e-12, "{n} levels: {} for {expected}", effect.share);
            }
            let groups = &effects[0].groups;
            assert_eq!(groups.len(), n as usize);
            for (i, group) in groups.iter().enumerate() {
                let mean = 3.0 * i as f64 + 2.0 * 5.0 / 3.0;
                assert!(
                    group.x == i as f64 && group.count == 3 && (group.mean - mean).abs() < 1e-12 * f64::from(n),
                    "{group:?}"
                );
            }
        }
        assert_eq!(main_effect(&[1.0; 20], &[2.0; 20], Grouping::Levels), None);
    }

    /// Truth: 50 values with 1 to 7 runs each; all runs of a value are in one group.
    #[test]
    fn groups_of_a_drawn_parameter_never_cut_a_value_in_two() {
        let x: Vec<f64> = (0..50).flat_map(|k| vec![f64::from(k); 1 + (k as usize * 3) % 7]).collect();
        let y: Vec<f64> = (0..x.len()).map(|k| k as f64).collect();
        let effect = main_effect(&x, &y, Grouping::Bins).unwrap();
        assert!((6..=8).contains(&effect.groups.len()), "{effect:?}");
        assert_eq!(effect.groups.iter().map(|group| group.count).sum::<usize>(), x.len());
        let ends = effect.groups.iter().scan(0, |end, group| {
            *end += group.count;
            Some(*end)
        });
        for end in ends.filter(|end| *end < x.len()) {
            assert_ne!(x[end - 1], x[end]);
        }
    }

    /// Truth: the mean of y = x^2 over a bin, with x uniform.
    #[test]
    fn values_that_are_all_different_are_taken_in_groups_of_equal_size() {
        let x: Vec<f64> = (0..8000).map(|k| uniform(0, 0, k)).collect();
        let y: Vec<f64> = x.iter().map(|x| x * x).collect();
        let effect = main_effect(&x, &y, Grouping::Bins).unwrap();
        assert_eq!(effect.groups.len(), 8);
        for (k, group) in effect.groups.iter().enumerate() {
            let (a, b) = (k as f64 / 8.0, (k + 1) as f64 / 8.0);
            let expected = (b.powi(3) - a.powi(3)) / 3.0 / (b - a);
            assert!((group.mean - expected).abs() < 0.02, "{group:?} {expected}");
            assert_eq!(group.count, 1000);
        }
    }

    #[test]
    fn the_front_has_the_points_that_no_other_beats() {
        let a = [1.0, 2.0, 3.0, 2.0, 4.0, f64::NAN, 1.0];
        let b = [5.0, 3.0, 3.0, 4.0, 1.0, 0.0, 6.0];
        assert_eq!(pareto_front(&a, &b), [0, 1, 4]);
        assert!(pareto_front(&[], &[]).is_empty());
    }

    #[test]
    fn spread_of_the_first_whole_numbers_is_that_of_the_formulas() {
        let values: Vec<f64> = (0..=100).map(f64::from).chain([f64::NAN]).collect();
        let found = spread(&values).unwrap();
        assert_eq!((found.count, found.min, found.max, found.mean), (101, 0.0, 100.0, 50.0));
        assert_eq!(found.quantiles, [5.0, 50.0, 95.0]);
        assert!((found.std - (101.0f64 * 102.0 / 12.0).sqrt()).abs() < 1e-12);
        assert_eq!(spread(&[f64::NAN]), None);
    }
}
