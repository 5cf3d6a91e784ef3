//! Test for random parameters whose effect on a result exceeds chance.
//!
//! With few samples every parameter is correlated with a result by chance. A parameter is
//! significant only if the share of the variance that it explains exceeds the one that the
//! strongest of all parameters without effect would reach in 1 of 100 studies.
//!
//! ```text
//! R^2 = |Q^T r|^2 / |r|^2        share of the residuals r that q orthonormal columns Q explain (1)
//! R^2 ~ Beta(q/2, (d - q)/2)     for random r with d degrees of freedom                        (2)
//! ```
//! The columns of a parameter are polynomials of its ranks. Parameters are selected one after the
//! other, strongest first (forward selection), so that the variance explained by strong parameters
//! does not hide weaker ones.

use statrs::function::beta::inv_beta_reg;

/// Parameters whose effect exceeds chance.
#[derive(Clone, Debug, PartialEq)]
pub struct BeyondChance {
    /// Indices of the parameters, strongest first.
    pub parameters: Vec<usize>,
    /// Share of the variance below which the strongest of all parameters stays in 99 of 100 studies
    /// without any effect; 1 if there are too few samples.
    pub chance: f64,
}

/// Significance level: probability of selecting any parameter if none has an effect.
const LEVEL: f64 = 0.01;
/// Minimum number of samples.
const FEWEST: usize = 8;
/// Number of samples for each polynomial of a parameter, and range of the number of polynomials.
const DRAWS_PER_TERM: usize = 16;
const TERMS: (usize, usize) = (2, 6);
/// Maximum number of samples used; more of them do not change the selection.
const MAX_DRAWS: usize = 4000;
/// Relative length below which a column counts as linearly dependent.
const TINY: f64 = 1e-9;

/// Returns the random parameters whose effect on a result exceeds chance.
///
/// * `columns`: values of each parameter, one for each sample. Samples must be independent of each
///   other.
/// * `y`: the result; samples with a NaN are ignored.
///
/// # Panics
/// Panics if a parameter has fewer values than `y`.
pub fn beyond_chance(columns: &[Vec<f64>], y: &[f64]) -> BeyondChance {
    assert!(columns.iter().all(|x| x.len() >= y.len()), "each parameter needs a value per result");
    // Residuals about the mean, over samples without a NaN.
    let sound = |k: &usize| y[*k].is_finite() && columns.iter().all(|x| x[*k].is_finite());
    let rows: Vec<usize> = (0..y.len()).filter(sound).collect();
    let rows: Vec<usize> = rows.iter().copied().step_by(rows.len().div_ceil(MAX_DRAWS).max(1)).collect();
    let mut found = BeyondChance { parameters: Vec::new(), chance: 1.0 };
    let mut residuals: Vec<f64> = rows.iter().map(|k| y[*k]).collect();
    let size = dot(&residuals, &residuals);
    centre(&mut residuals);
    if rows.len() < FEWEST || columns.is_empty() || dot(&residuals, &residuals) <= TINY * TINY * size {
        return found;
    }
    // Orthonormal columns of each parameter.
    let terms = (rows.len() / DRAWS_PER_TERM).clamp(TERMS.0, TERMS.1);
    let mut bases: Vec<Vec<Vec<f64>>> = columns
        .iter()
        .map(|x| orthonormal(polynomials(&rows.iter().map(|k| x[*k]).collect::<Vec<_>>(), terms), &[]))
        .collect();
    let mut freedom = rows.len() - 1;
    found.chance = threshold(terms, freedom, columns.len());
    loop {
        // Parameter with the largest share of the remaining variance, equation (1).
        let scatter = dot(&residuals, &residuals);
        let part = |k: usize| bases[k].iter().map(|q| dot(q, &residuals).powi(2)).sum::<f64>() / scatter;
        let open: Vec<usize> = (0..columns.len()).filter(|k| !bases[*k].is_empty()).collect();
        let Some(best) = open.iter().copied().max_by(|a, b| part(*a).total_cmp(&part(*b))) else { break };
        let q = bases[best].len();
        let explains_all = scatter <= TINY * TINY * size;
        if explains_all || freedom < 2 * q || part(best) <= threshold(q, freedom, open.len()) {
            break;
        }
        // Projects its columns out of the residuals and of the other parameters.
        found.parameters.push(best);
        freedom -= q;
        let taken = std::mem::take(&mut bases[best]);
        taken.iter().for_each(|q| remove(&mut residuals, q));
        bases.iter_mut().for_each(|basis| *basis = orthonormal(std::mem::take(basis), &taken));
    }
    found
}

/// Returns the share of the variance that the strongest of several parameters without effect
/// exceeds with probability `LEVEL`, by (2). This is the F test of a regression.
pub fn threshold(terms: usize, freedom: usize, parameters: usize) -> f64 {
    if freedom <= terms {
        return 1.0;
    }
    1.0 - inv_beta_reg(0.5 * (freedom - terms) as f64, 0.5 * terms as f64, LEVEL / parameters as f64)
}

/// Computes Legendre polynomials of the ranks, scaled to -1 to 1; equal values share their mean
/// rank.
fn polynomials(x: &[f64], terms: usize) -> Vec<Vec<f64>> {
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|i, j| x[*i].total_cmp(&x[*j]));
    let mut ranks = vec![0.0; x.len()];
    let mut first = 0;
    for equal in order.chunk_by(|i, j| x[*i] == x[*j]) {
        let middle = first as f64 + 0.5 * equal.len() as f64;
        equal.iter().for_each(|k| ranks[*k] = 2.0 * middle / x.len() as f64 - 1.0);
        first += equal.len();
    }
    let mut found = vec![vec![1.0; x.len()], ranks.clone()];
    for n in 1..terms {
        let (n, next) = (n as f64, |k: usize, n: f64| (2.0 * n + 1.0) * ranks[k]);
        let (last, before) = (&found[found.len() - 1], &found[found.len() - 2]);
        found.push((0..x.len()).map(|k| (next(k, n) * last[k] - n * before[k]) / (n + 1.0)).collect());
    }
    found.remove(0);
    found.iter_mut().for_each(|column| centre(column));
    found
}

/// Orthonormalises columns with respect to each other and to `others`; linearly dependent columns
/// are dropped.
fn orthonormal(columns: Vec<Vec<f64>>, others: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut found: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for mut column in columns {
        let before = dot(&column, &column).sqrt();
        // Two passes suffice (Kahan, Parlett).
        for _ in 0..2 {
            others.iter().chain(&found).for_each(|q| remove(&mut column, q));
        }
        let length = dot(&column, &column).sqrt();
        if length > TINY * before && length > 0.0 {
            column.iter_mut().for_each(|x| *x /= length);
            found.push(column);
        }
    }
    found
}

/// Returns the scalar product.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Subtracts the projection on a column of length 1.
fn remove(from: &mut [f64], q: &[f64]) {
    let part = dot(from, q);
    from.iter_mut().zip(q).for_each(|(x, q)| *x -= part * q);
}

/// Subtracts the mean.
fn centre(values: &mut [f64]) {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter_mut().for_each(|x| *x -= mean);
}
