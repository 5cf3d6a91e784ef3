//! Nonlinear least squares with priors, bounds and errors of the model: one maximum-a-posteriori
//! fit.
//!
//! ```text
//! minimise Σ ρ(r_i / s_i) + Σ ((x_k - μ_k) / σ_k)²,   x_k >= b_k,   s_i² = (φ_κ std_i)² + (τ_κ size_i)²
//! ```
//! τ_κ is the error of the model in residuals of kind κ: that at which they scatter as their `s_i`
//! say, over the degrees of freedom that the fit leaves them (Huber's proposal 2, so that a few
//! outliers do not count). φ_κ is 1, or below 1 if they scatter less than chance explains. The
//! Levenberg-Marquardt method alternates with their estimation until both settle; the last
//! iterations keep them. Not here: the measurements and the meaning of the unknowns.

use nalgebra::{DMatrix, DVector};

use crate::estimation::bounded::bounded_minimum;

/// A model of measurements.
pub trait Residuals {
    /// Error of the model.
    type Error;

    /// Returns the predicted minus the measured numbers, given all unknowns. Writes their
    /// derivatives into `J` if given (resized as needed).
    ///
    /// # Errors
    /// If the model has no solution at these unknowns.
    fn evaluate(&self, unknowns: &DVector<f64>, J: Option<&mut DMatrix<f64>>) -> Result<DVector<f64>, Self::Error>;
}

/// Error of a measured number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Known standard deviation; 0 if the scatter of its kind alone gives it.
    pub std: f64,
    /// Kind, whose numbers have one error of the model; `None` for prior knowledge, which has none.
    pub kind: Option<usize>,
    /// Error of the number per unit error of the model.
    pub size: f64,
    /// Distance to the next number of the same curve; 0 for numbers of their own. Errors of the model
    /// along a curve are correlated.
    pub along: usize,
}

/// Unknown with its start, prior and bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknown {
    /// Value at which the search starts.
    pub start: f64,
    /// Mean and standard deviation of the prior, if there is one.
    pub prior: Option<(f64, f64)>,
    /// Lower bound.
    pub lower: f64,
}

impl Unknown {
    /// Returns an unknown of the measurement: without prior and bound, from 0.
    pub fn free() -> Self {
        Self { start: 0.0, prior: None, lower: f64::NEG_INFINITY }
    }
}

/// Loss function of a residual.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// Square of the residual.
    #[default]
    Square,
    /// Huber's loss: linear above this number of standard deviations.
    Huber(f64),
    /// Cauchy's loss: the influence of outliers vanishes; more than one minimum is possible.
    Cauchy(f64),
}

impl Loss {
    /// Returns the weight of a residual in the equivalent weighted problem.
    fn weight(self, r: f64) -> f64 {
        match self {
            Self::Square => 1.0,
            Self::Huber(k) if r.abs() <= k => 1.0,
            Self::Huber(k) => k / r.abs(),
            Self::Cauchy(c) => 1.0 / (1.0 + (r / c).powi(2)),
        }
    }

    /// Returns twice the cost; the square for small residuals.
    fn cost(self, r: f64) -> f64 {
        match self {
            Self::Square => r * r,
            Self::Huber(k) if r.abs() <= k => r * r,
            Self::Huber(k) => 2.0 * k * r.abs() - k * k,
            Self::Cauchy(c) => c * c * (r / c).powi(2).ln_1p(),
        }
    }

    /// Returns the magnitude at which a residual is clipped for the scatter, and the mean of the
    /// clipped squares of standard normal numbers.
    fn clip(self) -> (f64, f64) {
        if self == Self::Square { (f64::INFINITY, 1.0) } else { (2.5, 0.977_56) }
    }
}

/// Options of a search.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Loss function.
    pub loss: Loss,
    /// Maximum number of iterations.
    pub most_iterations: usize,
    /// Length of the last step in standard deviations, of any combination of the unknowns, at
    /// convergence.
    pub tolerance: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self { loss: Loss::Huber(2.5), most_iterations: 100, tolerance: 1e-5 }
    }
}

/// Solution of a least-squares problem.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Unknowns.
    pub unknowns: DVector<f64>,
    /// Predicted minus measured numbers.
    pub residuals: DVector<f64>,
    /// Standard deviations of the residuals, with the error of the model.
    pub deviations: DVector<f64>,
    /// Error of the model per kind.
    pub model_errors: Vec<f64>,
    /// Leverages of the residuals, 0 to 1.
    pub leverages: DVector<f64>,
    /// Covariance of the unknowns, as if none were at its bound.
    pub covariance: DMatrix<f64>,
    /// Number of iterations.
    pub iterations: usize,
    /// Whether the last step was below the tolerance.
    pub converged: bool,
    /// Weighted derivatives and residuals, and the covariance of the unknowns that are not at their
    /// bounds, for [`Self::without`].
    rows: DMatrix<f64>,
    free: DMatrix<f64>,
    roots: DVector<f64>,
}

impl Solution {
    /// Returns the residuals of some rows, predicted from the other rows: to first order,
    /// `(1 - A C Aᵀ)^-1 r` with their weighted derivatives A. `None` if the others do not determine
    /// an unknown on which they depend.
    pub fn without(&self, some: &[usize]) -> Option<DVector<f64>> {
        let A = self.rows.select_rows(some);
        let left = DMatrix::identity(some.len(), some.len()) - &A * &self.free * A.transpose();
        let factor = left.cholesky().filter(|factor| factor.l_dirty().diagonal().min() > LEFT)?;
        let r = DVector::from_iterator(some.len(), some.iter().map(|k| self.residuals[*k] * self.roots[*k]));
        let found = factor.solve(&r);
        Some(DVector::from_iterator(some.len(), found.iter().zip(some).map(|(r, k)| r / self.roots[*k])))
    }
}

/// Reason why there is no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError<E> {
    /// The model has no solution at the start.
    #[error(transparent)]
    Model(E),
    /// The residuals do not determine an unknown without a prior.
    #[error("the measurements do not determine their own unknown {0}")]
    Nuisance(usize),
    /// There are as many unknowns as numbers, and no standard deviations.
    #[error("the scatter cannot be estimated: there are as many unknowns as numbers")]
    NoScatter,
    /// A residual or derivative is not finite.
    #[error("a residual or a derivative is not finite")]
    NotFinite,
}

/// Progress of a search, after each iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Number of the iteration, from 1.
    pub iteration: usize,
    /// Root mean square of the residuals over their present standard deviations.
    pub rms: f64,
    /// Length of the step in standard deviations of the unknowns, with their correlations.
    pub step: f64,
}

/// Maximum correlation of neighbours on a curve.
const MAX_CORRELATED: f64 = 0.98;
/// Minimum pivot of rows left out of the fit: their predictions are uncertain by its inverse.
const LEFT: f64 = 0.1;
/// Relative pivot below which an unknown without a prior depends on others.
const DEPENDENT: f64 = 1e-12;
/// Relative change of the errors of the model, and step over deviations, at which they are kept.
const SETTLED: (f64, f64) = (1e-2, 0.1);
/// Minimum error of the model relative to the scatter at the start.
const MIN_ERROR: f64 = 1e-8;
/// Minimum ratio of the scatter to given standard deviations for which these are reduced: numbers that
/// scatter less are computed ones.
const MIN_SHARE: f64 = 0.1;
/// One-sided normal quantile for a probability of one in a thousand.
const RARE_QUANTILE: f64 = 3.09;
/// Ratio of the decrease of the cost to the expected one above which the damping decreases, and
/// below which it increases.
const GAIN: (f64, f64) = (0.75, 0.5);

/// Solves the problem.
///
/// * `watch`: called after each iteration; the search ends where it returns false.
///
/// # Errors
/// [`SolveError`].
pub fn solve<P: Residuals>(
    problem: &P,
    noise: &[Noise],
    unknowns: &[Unknown],
    search: &Search,
    watch: &dyn Fn(&Progress) -> bool,
) -> Result<Solution, SolveError<P::Error>> {
    // First errors of the model from the residuals at the start.
    let start = DVector::from_iterator(unknowns.len(), unknowns.iter().map(|u| u.start.max(u.lower)));
    let mut J = DMatrix::zeros(0, 0);
    let r = evaluated(problem, &start, &mut J)?;
    let mut fit = Fit {
        problem,
        noise,
        unknowns,
        search,
        s: r.clone(),
        errors: Vec::new(),
        shares: Vec::new(),
        least: Vec::new(),
    };
    fit.first_errors(&r);
    let mut state = State { x: start, r, J, damping: 1e-4 };
    let (mut iterations, mut kept, mut converged) = (0, fit.errors.is_empty(), unknowns.is_empty());
    // Steps and errors in turn until the errors settle; then steps alone until they are short.
    while iterations < search.most_iterations && !converged {
        iterations += 1;
        let (moved, step) = fit.step(&mut state)?;
        match kept {
            true => converged = step <= search.tolerance,
            false => {
                let change = fit.update_errors(&state);
                kept = !moved || (change < SETTLED.0 && step < SETTLED.1) || 2 * iterations > search.most_iterations;
            }
        }
        let over = state.r.component_div(&fit.s);
        let progress = Progress { iteration: iterations, rms: over.norm() / (over.len() as f64).sqrt(), step };
        if !watch(&progress) || (kept && !moved) {
            break;
        }
    }
    fit.finish(state, iterations, converged)
}

/// Evaluates residuals and derivatives, which must be finite.
fn evaluated<P: Residuals>(
    problem: &P,
    x: &DVector<f64>,
    J: &mut DMatrix<f64>,
) -> Result<DVector<f64>, SolveError<P::Error>> {
    let r = problem.evaluate(x, Some(&mut *J)).map_err(SolveError::Model)?;
    match r.iter().chain(J.iter()).all(|x| x.is_finite()) {
        true => Ok(r),
        false => Err(SolveError::NotFinite),
    }
}

/// State of a search.
struct State {
    x: DVector<f64>,
    r: DVector<f64>,
    J: DMatrix<f64>,
    damping: f64,
}

/// Problem with the present errors of the model.
struct Fit<'a, P> {
    problem: &'a P,
    noise: &'a [Noise],
    unknowns: &'a [Unknown],
    search: &'a Search,
    /// Standard deviations with the present errors of the model.
    s: DVector<f64>,
    errors: Vec<f64>,
    /// Parts of the given standard deviations that count.
    shares: Vec<f64>,
    /// Minimum errors of the model.
    least: Vec<f64>,
}

impl<P: Residuals> Fit<'_, P> {
    /// Estimates the errors of the model from the residuals at the start.
    fn first_errors(&mut self, r: &DVector<f64>) {
        let kinds = self.noise.iter().filter_map(|noise| noise.kind).max().map_or(0, |most| most + 1);
        for kind in 0..kinds {
            let rows = self.rows_of(r, kind);
            let rms =
                (rows.iter().map(|(r, noise)| (r / noise.size).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt();
            let needed = rows.iter().any(|(_, noise)| noise.std == 0.0);
            self.least.push(if needed { (MIN_ERROR * rms).max(f64::MIN_POSITIVE.sqrt()) } else { 0.0 });
            let error = scatter(&rows, rows.len() as f64, self.search.loss);
            self.errors.push(error.max(self.least[kind]));
            self.shares.push(1.0);
        }
        self.set_deviations();
    }

    /// Returns the residuals of a kind with their noise.
    fn rows_of(&self, r: &DVector<f64>, kind: usize) -> Vec<(f64, Noise)> {
        let all = r.iter().zip(self.noise).filter(|(_, noise)| noise.kind == Some(kind));
        all.map(|(r, noise)| (*r, *noise)).collect()
    }

    /// Sets the standard deviations `s` to the present errors and shares.
    fn set_deviations(&mut self) {
        let deviation = |noise: &Noise| match noise.kind {
            Some(kind) => (self.shares[kind] * noise.std).hypot(self.errors[kind] * noise.size),
            None => noise.std,
        };
        self.s = DVector::from_iterator(self.noise.len(), self.noise.iter().map(deviation));
    }

    /// Estimates the errors of the model anew; returns their largest relative change.
    fn update_errors(&mut self, state: &State) -> f64 {
        let (rows, normal) = self.normal(state);
        let free = inverse(&normal, |k| state.x[k] > self.unknowns[k].lower);
        let leverages = free.map_or_else(|| DVector::zeros(self.s.len()), |free| leverages(&rows, &free));
        let mut change = 0.0_f64;
        for kind in 0..self.errors.len() {
            let some = self.rows_of(&state.r, kind);
            let taken: f64 =
                leverages.iter().zip(self.noise).filter(|(_, n)| n.kind == Some(kind)).map(|(h, _)| h).sum();
            // An error far below the deviations of the readings does not matter.
            let std = some.iter().map(|(_, noise)| noise.std / noise.size).fold(0.0, f64::max);
            let total = |fit: &Self| fit.errors[kind].hypot(std * fit.shares[kind]);
            let (old, freedom) = (total(self), some.len() as f64 - taken);
            let error = scatter(&some, freedom, self.search.loss) * correlated(&some);
            self.errors[kind] = error.max(self.least[kind]);
            self.shares[kind] = misfit(&some, freedom, self.search.loss).map_or(1.0, |factor| factor.min(1.0));
            change = change.max((total(self) / old).ln().abs());
        }
        self.set_deviations();
        if change.is_nan() { 0.0 } else { change }
    }

    /// Returns the derivatives over deviations with the weights of the loss, and the normal matrix
    /// with the priors.
    fn normal(&self, state: &State) -> (DMatrix<f64>, DMatrix<f64>) {
        let roots = self.roots(&state.r);
        let mut rows = state.J.clone();
        rows.column_iter_mut().for_each(|mut column| column.component_mul_assign(&roots));
        let mut normal = rows.tr_mul(&rows);
        for (k, unknown) in self.unknowns.iter().enumerate() {
            normal[(k, k)] += unknown.prior.map_or(0.0, |(_, std)| 1.0 / (std * std));
        }
        (rows, normal)
    }

    /// Returns the root of the weight of each residual: of the loss, over its deviation.
    fn roots(&self, r: &DVector<f64>) -> DVector<f64> {
        r.zip_map(&self.s, |r, s| self.search.loss.weight(r / s).sqrt() / s)
    }

    /// Returns twice the cost of the residuals and of the distance from the priors.
    fn cost(&self, r: &DVector<f64>, x: &DVector<f64>) -> f64 {
        let prior =
            |(unknown, x): (&Unknown, &f64)| unknown.prior.map_or(0.0, |(mean, std)| ((x - mean) / std).powi(2));
        let priors: f64 = self.unknowns.iter().zip(x.iter()).map(prior).sum();
        r.iter().zip(self.s.iter()).map(|(r, s)| self.search.loss.cost(r / s)).sum::<f64>() + priors
    }

    /// Increases the damping until a step does not increase the cost. Returns whether there is one,
    /// and its length in deviations of the unknowns.
    fn step(&self, state: &mut State) -> Result<(bool, f64), SolveError<P::Error>> {
        let cost = self.cost(&state.r, &state.x);
        if !cost.is_finite() {
            return Err(SolveError::NotFinite);
        }
        // Half the gradient of the cost, and the bounds on the step.
        let (rows, normal) = self.normal(state);
        let mut gradient = rows.tr_mul(&state.r.component_mul(&self.roots(&state.r)));
        for ((g, unknown), x) in gradient.iter_mut().zip(self.unknowns).zip(state.x.iter()) {
            *g += unknown.prior.map_or(0.0, |(mean, std)| (x - mean) / (std * std));
        }
        let lower = DVector::from_iterator(
            self.unknowns.len(),
            self.unknowns.iter().zip(state.x.iter()).map(|(u, x)| u.lower - x),
        );
        // Levenberg-Marquardt: the damping grows until a step does not increase the cost.
        let diagonal = normal.diagonal();
        let mut size = 0.0;
        for _ in 0..12 {
            let mut damped = normal.clone();
            for (k, d) in diagonal.iter().enumerate() {
                damped[(k, k)] += state.damping * d.max(f64::MIN_POSITIVE);
            }
            let Some(step) = bounded_minimum(&damped, &gradient, &lower) else {
                state.damping = (state.damping * 10.0).max(1e-10);
                continue;
            };
            let square = step.dot(&(&normal * &step));
            let expected = -(2.0 * gradient.dot(&step) + square);
            size = square.sqrt();
            let mut moved = &state.x + &step;
            moved.iter_mut().zip(self.unknowns).for_each(|(x, unknown)| *x = x.max(unknown.lower));
            let mut J = DMatrix::zeros(0, 0);
            match evaluated(self.problem, &moved, &mut J) {
                Ok(r) if self.cost(&r, &moved) <= cost * (1.0 + 1e-14) => {
                    // Steps without damping pass the minimum again and again if the residuals curve.
                    let factor = match (cost - self.cost(&r, &moved)) / expected {
                        gain if gain > GAIN.0 => 0.1,
                        gain if gain < GAIN.1 => 10.0,
                        _ => 1.0,
                    };
                    *state = State { x: moved, r, J, damping: (state.damping * factor).max(1e-10) };
                    return Ok((true, size));
                }
                // Converged to rounding.
                _ if size <= self.search.tolerance => break,
                _ => state.damping = (state.damping * 10.0).max(1e-10),
            }
        }
        Ok((false, size))
    }

    /// Returns the solution, after checking that the rows determine what has no prior.
    fn finish(self, state: State, iterations: usize, converged: bool) -> Result<Solution, SolveError<P::Error>> {
        // Unknowns without a prior must be determined by the rows.
        let (rows, normal) = self.normal(&state);
        let own: Vec<usize> = (0..self.unknowns.len()).filter(|k| self.unknowns[*k].prior.is_none()).collect();
        if let Some(k) = dependent(&normal.select_rows(&own).select_columns(&own)) {
            return Err(SolveError::Nuisance(own[k]));
        }
        // Covariance of all unknowns, and with those at their bounds held.
        let covariance = inverse(&normal, |_| true).ok_or(SolveError::NotFinite)?;
        let free = inverse(&normal, |k| state.x[k] > self.unknowns[k].lower).ok_or(SolveError::NotFinite)?;
        let leverages = leverages(&rows, &free);
        // A model error needs readings that the fit does not reproduce: Σ (1 - h) counts them.
        for kind in (0..self.errors.len()).filter(|kind| self.least[*kind] > 0.0) {
            let own = self.noise.iter().zip(leverages.iter()).filter(|(noise, _)| noise.kind == Some(kind));
            if own.map(|(_, h)| 1.0 - h).sum::<f64>() < 0.5 {
                return Err(SolveError::NoScatter);
            }
        }
        Ok(Solution {
            roots: self.roots(&state.r),
            unknowns: state.x,
            residuals: state.r,
            deviations: self.s,
            model_errors: self.errors,
            leverages,
            covariance,
            iterations,
            converged,
            rows,
            free,
        })
    }
}

/// Returns the diagonal of `A C Aᵀ`.
fn leverages(A: &DMatrix<f64>, C: &DMatrix<f64>) -> DVector<f64> {
    let AC = A * C;
    DVector::from_fn(A.nrows(), |i, _| AC.row(i).dot(&A.row(i)).clamp(0.0, 1.0))
}

/// Returns the inverse of a normal matrix over some of its unknowns, 0 for the others.
fn inverse(normal: &DMatrix<f64>, of: impl Fn(usize) -> bool) -> Option<DMatrix<f64>> {
    let some: Vec<usize> = (0..normal.nrows()).filter(|k| of(*k)).collect();
    // Scaled to a unit diagonal, so that units do not matter.
    let scale: Vec<f64> = some.iter().map(|k| 1.0 / normal[(*k, *k)].sqrt()).collect();
    let n = some.len();
    if n == 0 {
        return Some(DMatrix::zeros(normal.nrows(), normal.nrows()));
    }
    let scaled = DMatrix::from_fn(n, n, |i, j| scale[i] * normal[(some[i], some[j])] * scale[j]);
    let small = scaled.cholesky()?.inverse();
    let mut whole = DMatrix::zeros(normal.nrows(), normal.nrows());
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        whole[(some[i], some[j])] = scale[i] * small[(i, j)] * scale[j];
    }
    whole.iter().all(|x| x.is_finite()).then_some(whole)
}

/// Returns the number of the first unknown that depends on those before it in a normal matrix.
fn dependent(normal: &DMatrix<f64>) -> Option<usize> {
    let mut left = normal.clone();
    for k in 0..left.nrows() {
        let pivot = left[(k, k)];
        if pivot.is_nan() || pivot <= DEPENDENT * normal[(k, k)] {
            return Some(k);
        }
        let column = left.column(k).into_owned();
        left.ger(-1.0 / pivot, &column, &column, 1.0);
    }
    None
}

/// Returns the error of the model at which residuals scatter as their deviations predict; 0 if they
/// scatter less without it.
///
/// * `freedom`: number of the residuals minus what the fit takes.
fn scatter(rows: &[(f64, Noise)], freedom: f64, loss: Loss) -> f64 {
    let (clip, mean) = loss.clip();
    let excess = |t: f64| {
        let square =
            |(r, noise): &(f64, Noise)| (r * r / (noise.std.powi(2) + (t * noise.size).powi(2))).min(clip * clip);
        rows.iter().map(square).sum::<f64>() - mean * freedom
    };
    let most =
        (rows.iter().map(|(r, noise)| (r / noise.size).powi(2)).sum::<f64>() / (mean * freedom).max(1e-9)).sqrt();
    let known = rows.iter().all(|(_, noise)| noise.std > 0.0);
    if rows.is_empty() || most == 0.0 || (known && excess(0.0) <= 0.0) {
        return 0.0;
    }
    let (mut low, mut high) = ((1e-10 * most).ln(), most.ln());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if excess(middle.exp()) > 0.0 { &mut low } else { &mut high }) = middle;
    }
    high.exp()
}

/// Returns the factor on the error of the model for residuals that are correlated along a curve: the
/// root of the number of residuals over that of independent ones, `(1 + ρ)/(1 - ρ)` with the
/// correlation ρ of neighbours.
fn correlated(rows: &[(f64, Noise)]) -> f64 {
    let along = rows.first().map_or(0, |(_, noise)| noise.along);
    if along == 0 || rows.len() <= along {
        return 1.0;
    }
    let product: f64 = rows.iter().zip(&rows[along..]).map(|((a, _), (b, _))| a * b).sum();
    let square: f64 = rows.iter().map(|(r, _)| r * r).sum();
    let rho = (product / square.max(f64::MIN_POSITIVE)).clamp(0.0, MAX_CORRELATED);
    ((1.0 + rho) / (1.0 - rho)).sqrt()
}

/// Returns the ratio of the scatter of residuals to their given deviations if chance gives it less
/// than once in a thousand cases; `None` if a deviation is not given.
///
/// * `freedom`: number of the residuals minus what the fit takes.
pub(crate) fn misfit(rows: &[(f64, Noise)], freedom: f64, loss: Loss) -> Option<f64> {
    if freedom < 0.5 || rows.iter().any(|(_, noise)| noise.std == 0.0) {
        return None;
    }
    let over: Vec<f64> = rows.iter().map(|(r, noise)| r / noise.std).collect();
    let factor = scale(&over, freedom, loss);
    let [low, high] = chi_square_bounds(freedom);
    let square = factor * factor;
    (square > high || (square < low && factor > MIN_SHARE)).then_some(factor)
}

/// Returns the lower and upper 0.1 % quantiles of χ² over its degrees of freedom (Wilson and
/// Hilferty).
pub fn chi_square_bounds(freedom: f64) -> [f64; 2] {
    let nine = 2.0 / (9.0 * freedom);
    [-1.0, 1.0].map(|sign| (1.0 - nine + sign * RARE_QUANTILE * nine.sqrt()).max(0.0).powi(3))
}

/// Returns the ratio of the scatter of residuals to their deviations.
pub fn scale(residuals: &[f64], freedom: f64, loss: Loss) -> f64 {
    let unit = Noise { std: 0.0, kind: None, size: 1.0, along: 0 };
    scatter(&residuals.iter().map(|r| (*r, unit)).collect::<Vec<_>>(), freedom, loss)
}
