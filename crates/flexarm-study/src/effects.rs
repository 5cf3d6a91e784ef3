//! What a parameter does to a result on average, and how results spread.

use crate::indices::quantile;

/// Runs whose parameter is the same, or nearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectGroup {
    /// Mean of the parameter.
    pub x: f64,
    /// Runs.
    pub count: usize,
    /// Mean of the result.
    pub mean: f64,
    /// Standard error of that.
    pub std_error: f64,
}

/// Means of a result over groups of a parameter's values.
#[derive(Clone, Debug, PartialEq)]
pub struct MainEffect {
    /// By the parameter.
    pub groups: Vec<EffectGroup>,
    /// Part of the variance of the result that the means of the groups have (correlation ratio). On a full grid this is the part of
    /// the main effect in the analysis of variance; on a sample it is an estimate of the first Sobol index, from above.
    pub share: f64,
}

/// Groups of a parameter with so many values or fewer are its values.
const MOST_LEVELS: usize = 12;
/// Groups of other parameters.
const BINS: usize = 8;

/// The main effect of a parameter; none without two values of it or with a result that does not vary.
///
/// Runs whose `x` or `y` is NaN are left out.
pub fn main_effect(x: &[f64], y: &[f64]) -> Option<MainEffect> {
    let mut pairs: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut levels: Vec<&[(f64, f64)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
    if levels.len() > MOST_LEVELS {
        levels = pairs.chunks(pairs.len().div_ceil(BINS)).collect();
    }
    if levels.len() < 2 {
        return None;
    }
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|p| p.1).sum::<f64>() / n;
    let variance = pairs.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>() / n;
    if variance == 0.0 {
        return None;
    }
    let groups: Vec<EffectGroup> = levels.iter().map(|level| group(level)).collect();
    let between = groups.iter().map(|g| g.count as f64 * (g.mean - mean).powi(2)).sum::<f64>() / n;
    Some(MainEffect { groups, share: between / variance })
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

/// How a result spreads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Numbers that there are.
    pub count: usize,
    /// Least.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation; 0 of one number.
    pub std: f64,
    /// Quantiles 0.05, 0.5 and 0.95.
    pub quantiles: [f64; 3],
}

/// The spread of numbers; NaN are left out, none without any other.
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

/// Points of which no other is less in one of both numbers and not larger in the other, by the first number.
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
    use crate::random::uniform;

    /// Truth: on a full grid the sums of squares of an additive function add up to all of it, each that of its own part.
    #[test]
    fn shares_of_an_additive_function_on_a_grid_are_those_of_the_analysis_of_variance() {
        let (mut x, mut z, mut y) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..4 {
            for j in 0..5 {
                x.push(f64::from(i));
                z.push(f64::from(j));
                y.push(3.0 * f64::from(i) + f64::from(j * j));
            }
        }
        // variances 9 * 5/4 and of 0, 1, 4, 9, 16: mean 6, 34.8
        let (vx, vz) = (9.0 * 1.25, 34.8);
        let (ex, ez) = (main_effect(&x, &y).unwrap(), main_effect(&z, &y).unwrap());
        assert!((ex.share - vx / (vx + vz)).abs() < 1e-14, "{}", ex.share);
        assert!((ez.share - vz / (vx + vz)).abs() < 1e-14);
        assert_eq!((ex.groups.len(), ex.groups[1].count, ex.groups[1].mean), (4, 5, 3.0 + 6.0));
        assert_eq!(main_effect(&[1.0; 20], &y), None);
    }

    /// Truth: the mean over a bin of y = x^2 with x uniform.
    #[test]
    fn values_that_are_all_different_are_taken_in_groups_of_equal_size() {
        let x: Vec<f64> = (0..8000).map(|k| uniform(0, 0, k)).collect();
        let y: Vec<f64> = x.iter().map(|x| x * x).collect();
        let effect = main_effect(&x, &y).unwrap();
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
