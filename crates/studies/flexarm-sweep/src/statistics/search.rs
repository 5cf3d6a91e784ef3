//! Derivative-free constrained minimisation of a function within a box: covariance matrix
//! adaptation (CMA-ES).
//!
//! The search has an ask-and-tell interface: the caller evaluates the points of a generation, in
//! any order and on any number of machines. Of the existing crates, `argmin` does not have this
//! method; `cmaes` (unchanged since 2023, with its own version of the linear algebra crate) calls
//! the function itself and does not support constraints.
//!
//! Source: [Hansen 2016], with its default constants. Constraints are a penalty proportional to
//! their violation. Its weight grows while most points violate constraints and falls while none
//! does.

use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand::distr::Open01;

use crate::statistics::distribution::normal_quantile;
use crate::statistics::random::stream;

/// Evaluation of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchResult {
    /// Value to minimise; NaN if the evaluation failed.
    pub value: f64,
    /// Sum of the relative constraint violations; 0 if all constraints hold.
    pub violation: f64,
}

impl SearchResult {
    /// Whether the constraints hold.
    pub fn keeps(&self) -> bool {
        self.value.is_finite() && self.violation <= 0.0
    }

    /// Whether the point is better: first by feasibility, then by violation, then by value.
    pub fn beats(&self, other: &Self) -> bool {
        let key = |j: &Self| match j.value.is_finite() && j.violation.is_finite() {
            false => (2, 0.0, 0.0),
            true if j.keeps() => (0, 0.0, j.value),
            true => (1, j.violation, j.value),
        };
        let (a, b) = (key(self), key(other));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)).is_lt()
    }
}

/// Search in the unit cube.
#[derive(Clone, Debug)]
pub struct LeastSearch {
    seed: u64,
    generation: u64,
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    path_sigma: DVector<f64>,
    path_covariance: DVector<f64>,
    /// Penalty weight of violations; `None` before the results of the first generation.
    penalty: Option<f64>,
    /// Points of the present generation.
    points: Vec<DVector<f64>>,
}

/// Initial step size, relative to the side of the cube.
const FIRST_STEP: f64 = 0.3;
/// Step size at which a search has converged, relative to the side of the cube.
const NOTHING: f64 = 1e-7;

impl LeastSearch {
    /// Returns a search from a start point.
    pub fn new(start: &[f64], seed: u64) -> Self {
        let n = start.len();
        Self {
            seed,
            generation: 0,
            mean: DVector::from_row_slice(start),
            sigma: FIRST_STEP,
            covariance: DMatrix::identity(n, n),
            path_sigma: DVector::zeros(n),
            path_covariance: DVector::zeros(n),
            penalty: None,
            points: Vec::new(),
        }
    }

    /// Returns the number of points in a generation: a multiple of four.
    pub fn size(dimensions: usize) -> usize {
        let usual = 4 + (3.0 * (dimensions.max(1) as f64).ln()) as usize;
        usual.max(8).next_multiple_of(4)
    }

    /// Returns the next generation of points in the cube. The very first point is the start.
    pub fn ask(&mut self) -> Vec<Vec<f64>> {
        let n = self.mean.len();
        let root = self.root();
        let size = Self::size(n);
        let point = |k: usize| {
            let mut numbers = stream(self.seed, self.generation * size as u64 + k as u64);
            let normal = DVector::from_fn(n, |_, _| normal_quantile(numbers.sample(Open01)));
            let step = if self.generation == 0 && k == 0 { DVector::zeros(n) } else { &root * normal * self.sigma };
            (&self.mean + step).map(|x| x.clamp(0.0, 1.0))
        };
        self.points = (0..size).map(point).collect();
        self.points.iter().map(|p| p.as_slice().to_vec()).collect()
    }

    /// Updates the search with the evaluations of the requested points, in their order.
    pub fn tell(&mut self, judged: &[SearchResult]) {
        let n = self.mean.len() as f64;
        let order = self.ranked(judged);
        // Weighted recombination of the better half of the points.
        let mu = self.points.len() / 2;
        let weights: Vec<f64> = (0..mu).map(|k| (mu as f64 + 0.5).ln() - (k as f64 + 1.0).ln()).collect();
        let sum: f64 = weights.iter().sum();
        let weights: Vec<f64> = weights.iter().map(|w| w / sum).collect();
        let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();

        let old = self.mean.clone();
        let steps: Vec<DVector<f64>> = order[..mu].iter().map(|k| (&self.points[*k] - &old) / self.sigma).collect();
        let step = steps.iter().zip(&weights).fold(DVector::zeros(old.len()), |sum, (y, w)| sum + y * *w);
        self.mean = &old + &step * self.sigma;

        // Learning rates; the updates below are those of [Hansen 2016], figure 6.
        let c_sigma = (effective + 2.0) / (n + effective + 5.0);
        let d_sigma = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_c = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + effective);
        let c_mu = (1.0 - c_1).min(2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective));
        let expected = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

        // Evolution paths of step size and covariance.
        let whitened = self.inverse_root() * &step;
        self.path_sigma =
            &self.path_sigma * (1.0 - c_sigma) + whitened * (c_sigma * (2.0 - c_sigma) * effective).sqrt();
        self.generation += 1;
        let settled = (1.0 - (1.0 - c_sigma).powi(2 * self.generation.min(1 << 20) as i32)).sqrt();
        let goes_on = self.path_sigma.norm() / settled < (1.4 + 2.0 / (n + 1.0)) * expected;
        let on = if goes_on { 1.0 } else { 0.0 };
        self.path_covariance =
            &self.path_covariance * (1.0 - c_c) + step * (on * (c_c * (2.0 - c_c) * effective).sqrt());
        // Rank-one and rank-mu update of the covariance, then the step size.
        let rank_mu = steps
            .iter()
            .zip(&weights)
            .fold(DMatrix::zeros(old.len(), old.len()), |sum, (y, w)| sum + y * y.transpose() * *w);
        let kept = 1.0 - c_1 - c_mu + (1.0 - on) * c_1 * c_c * (2.0 - c_c);
        self.covariance =
            &self.covariance * kept + &self.path_covariance * self.path_covariance.transpose() * c_1 + rank_mu * c_mu;
        self.sigma *= (c_sigma / d_sigma * (self.path_sigma.norm() / expected - 1.0)).min(1.0).exp();
        self.sigma = self.sigma.min(FIRST_STEP);
    }

    /// Whether the search has converged.
    pub fn is_settled(&self) -> bool {
        let widest = self.covariance.diagonal().iter().fold(0.0f64, |most, c| most.max(*c));
        self.sigma * widest.sqrt() < NOTHING
    }

    /// Sorts the points from best to worst by value plus penalty; points whose evaluation failed
    /// are last.
    fn ranked(&mut self, judged: &[SearchResult]) -> Vec<usize> {
        let tried: Vec<&SearchResult> =
            judged.iter().filter(|j| j.value.is_finite() && j.violation.is_finite()).collect();
        let violating = tried.iter().filter(|j| !j.keeps()).count();
        let penalty = match self.penalty {
            None => {
                let range = |f: fn(&SearchResult) -> f64| {
                    let all = || tried.iter().map(|j| f(j));
                    all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min)
                };
                let (value, violation) = (range(|j| j.value), range(|j| j.violation));
                if violation > 0.0 && value > 0.0 { 2.0 * value / violation } else { 0.0 }
            }
            // The first violation sets the weight by the sizes of value and violation.
            Some(0.0) if violating > 0 => {
                tried.iter().map(|j| j.value.abs()).fold(0.0, f64::max)
                    / tried.iter().map(|j| j.violation).fold(f64::MIN_POSITIVE, f64::max)
            }
            Some(weight) if 2 * violating > tried.len() => weight * 1.5,
            Some(weight) if violating == 0 => weight / 1.2,
            Some(weight) => weight,
        };
        self.penalty = Some(penalty);
        let cost = |k: usize| match judged[k].value.is_finite() && judged[k].violation.is_finite() {
            true => judged[k].value + penalty * judged[k].violation,
            false => f64::INFINITY,
        };
        let mut order: Vec<usize> = (0..judged.len().min(self.points.len())).collect();
        order.sort_by(|a, b| cost(*a).total_cmp(&cost(*b)).then(a.cmp(b)));
        order
    }

    /// Returns the symmetric square root of the covariance.
    fn root(&self) -> DMatrix<f64> {
        self.spectral(f64::sqrt)
    }

    fn inverse_root(&self) -> DMatrix<f64> {
        self.spectral(|x| 1.0 / x.sqrt())
    }

    fn spectral(&self, f: fn(f64) -> f64) -> DMatrix<f64> {
        let eigen = self.covariance.clone().symmetric_eigen();
        let diagonal = eigen.eigenvalues.map(|x| f(x.max(1e-20)));
        &eigen.eigenvectors * DMatrix::from_diagonal(&diagonal) * eigen.eigenvectors.transpose()
    }
}
