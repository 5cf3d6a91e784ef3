//! Nonlinear least squares with uncertainties. Directions that the data do not determine stay at
//! their prior.
//!
//! ```text
//! minimise Σ ρ(r_i(x, b))
//! x: parameters with priors N(0, σ_p²); b: unknowns of the measurement without priors
//! ```
//! The Levenberg-Marquardt method first solves the problem with the prior as additional rows. Then
//! the singular values of the Jacobian (columns scaled by σ_p, nuisance unknowns projected out)
//! show which directions of x the data determine better than the prior. A second solution drops the
//! prior in these directions, so that the estimates are free of it; in the others x stays at the
//! prior. Residuals are in units of their standard deviations. Not here: the measurements and the
//! meaning of the parameters.

use nalgebra::{DMatrix, DVector};

/// A model of measurements.
pub trait Residuals {
    /// Error of the model.
    type Error;

    /// Returns the residuals over their standard deviations, given all unknowns, parameters first.
    /// Writes their derivatives into `J` if given (resized as needed).
    ///
    /// # Errors
    /// If the model has no solution at these unknowns.
    fn evaluate(&self, unknowns: &DVector<f64>, J: Option<&mut DMatrix<f64>>) -> Result<DVector<f64>, Self::Error>;
}

/// Loss function of a residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Square of the residual.
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
}

/// Options of a search.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Loss function.
    pub loss: Loss,
    /// Maximum number of iterations of each phase.
    pub most_iterations: usize,
    /// Maximum step of any unknown over its standard deviation at convergence.
    pub tolerance: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self { loss: Loss::Huber(2.5), most_iterations: 100, tolerance: 1e-6 }
    }
}

/// Solution of a least-squares problem.
#[derive(Clone, Debug)]
pub struct Solution {
    /// All unknowns, parameters first.
    pub unknowns: DVector<f64>,
    /// Residuals over their standard deviations.
    pub residuals: DVector<f64>,
    /// Weights of the residuals under the loss; 1 for the square.
    pub weights: DVector<f64>,
    /// Leverages of the residuals, 0 to 1.
    pub leverages: DVector<f64>,
    /// Covariance of the parameters; that of the prior in directions that are not identified.
    pub covariance: DMatrix<f64>,
    /// Directions in the parameters over their prior deviations, as unit columns, best determined
    /// first.
    pub directions: DMatrix<f64>,
    /// Ratio of the prior deviation to the deviation due to the data, per direction.
    pub gains: Vec<f64>,
    /// Number of identified directions.
    pub identified: usize,
    /// Square of the scale of the residuals: `Σ r² / (m - n)` with the square loss, otherwise a
    /// robust estimate that a few outliers do not change.
    pub scale: f64,
    /// Twice the cost of the residuals under the loss.
    pub cost: f64,
    /// Degrees of freedom, m - n.
    pub freedom: usize,
    /// Iterations of both phases.
    pub iterations: usize,
    /// Whether the last step was below the tolerance and, for an identification, whether the model
    /// fits the readings.
    pub converged: bool,
}

/// Reason why there is no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError<E> {
    /// The model has no solution at the start.
    #[error(transparent)]
    Model(E),
    /// The residuals do not determine an unknown of the measurement.
    #[error("the measurements do not determine their own unknown {0}")]
    Nuisance(usize),
    /// A residual or derivative is not finite.
    #[error("a residual or a derivative is not finite")]
    NotFinite,
}

/// Gain above which a direction counts as identified. At 1 the data determine it as well as the
/// prior does.
const IDENTIFIED: f64 = 1.0;
/// Relative size below which a column counts as linearly dependent.
const DEPENDENT: f64 = 1e-10;

/// Solves the problem from a start.
///
/// * `start`: all unknowns; those of the measurements may be guesses.
/// * `prior`: standard deviation of each parameter about 0, positive; the unknowns of the
///   measurements have none.
///
/// # Errors
/// [`SolveError`].
pub fn solve<P: Residuals>(
    problem: &P,
    start: &DVector<f64>,
    prior: &[f64],
    search: &Search,
) -> Result<Solution, SolveError<P::Error>> {
    let prior = DVector::from_column_slice(prior);
    let n = start.len();
    // Phase 1: all parameters are regularised by the prior.
    let free = DMatrix::identity(n, n);
    let held = descend(&Slope { problem, basis: &free, prior: Some(&prior), search }, start.clone())?;
    // Phase 2: without the prior, along the identified directions.
    let known = Identifiability::of(&held, &prior)?;
    let begin = known.projected(&held.unknowns, &prior);
    let basis = known.basis(&prior, n);
    let mut found = descend(&Slope { problem, basis: &basis, prior: None, search }, begin)?;
    found.iterations += held.iterations;
    Ok(finish(found, known, &basis, &prior, search.loss))
}

/// End of a descent.
struct Descent {
    unknowns: DVector<f64>,
    residuals: DVector<f64>,
    weights: DVector<f64>,
    J: DMatrix<f64>,
    iterations: usize,
    converged: bool,
}

/// Search along the columns of a basis, with or without a prior.
struct Slope<'a, P> {
    problem: &'a P,
    basis: &'a DMatrix<f64>,
    prior: Option<&'a DVector<f64>>,
    search: &'a Search,
}

impl<P: Residuals> Slope<'_, P> {
    fn weights(&self, r: &DVector<f64>) -> DVector<f64> {
        r.map(|r| self.search.loss.weight(r))
    }

    /// Returns twice the cost of the residuals and of the distance from the prior.
    fn cost(&self, r: &DVector<f64>, x: &DVector<f64>) -> f64 {
        let held = self.prior.map_or(0.0, |p| p.iter().zip(x.iter()).map(|(p, x)| (x / p).powi(2)).sum());
        r.iter().map(|r| self.search.loss.cost(*r)).sum::<f64>() + held
    }

    /// Evaluates residuals, derivatives and cost.
    fn evaluate(&self, x: &DVector<f64>, J: &mut DMatrix<f64>) -> Result<(DVector<f64>, f64), SolveError<P::Error>> {
        let r = self.problem.evaluate(x, Some(&mut *J)).map_err(SolveError::Model)?;
        let cost = self.cost(&r, x);
        match J.iter().all(|x| x.is_finite()) {
            true => Ok((r, cost)),
            false => Err(SolveError::NotFinite),
        }
    }

    /// Returns matrix and right-hand side of the normal equations of the weighted problem in
    /// coordinates along the basis.
    fn normal_equations(&self, x: &DVector<f64>, r: &DVector<f64>, J: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let w = self.weights(r);
        let B = J * self.basis;
        let weighted = DMatrix::from_fn(B.nrows(), B.ncols(), |i, j| w[i] * B[(i, j)]);
        let mut normal = B.tr_mul(&weighted);
        let mut gradient = weighted.tr_mul(r);
        if let Some(prior) = self.prior {
            for (k, p) in prior.iter().enumerate() {
                normal[(k, k)] += 1.0 / (p * p);
                gradient[k] += x[k] / (p * p);
            }
        }
        (normal, gradient)
    }

    /// Increases the damping until a step does not increase the cost. Returns the new unknowns if
    /// there are any, and whether the last step was below the tolerance.
    fn damped_step(
        &self,
        x: &DVector<f64>,
        cost: f64,
        (normal, gradient): &(DMatrix<f64>, DVector<f64>),
        damping: &mut f64,
    ) -> (Option<DVector<f64>>, bool) {
        let diagonal = normal.diagonal();
        for _ in 0..12 {
            let mut damped = normal.clone();
            for (k, d) in diagonal.iter().enumerate() {
                damped[(k, k)] += *damping * d.max(f64::MIN_POSITIVE);
            }
            let Some(factor) = damped.cholesky() else {
                *damping = (*damping * 10.0).max(1e-10);
                continue;
            };
            let step = factor.solve(gradient);
            let moved = x - self.basis * &step;
            let tried = self.problem.evaluate(&moved, None);
            let size = step.iter().zip(diagonal.iter()).map(|(s, d)| s.abs() * d.sqrt()).fold(0.0, f64::max);
            let settled = size <= self.search.tolerance;
            match tried {
                Ok(found) if self.cost(&found, &moved) <= cost * (1.0 + 1e-14) => {
                    *damping = (*damping * 0.1).max(1e-12);
                    return (Some(moved), settled);
                }
                // Converged to rounding.
                _ if settled => return (None, true),
                _ => *damping = (*damping * 10.0).max(1e-10),
            }
        }
        (None, false)
    }
}

/// Runs the Levenberg-Marquardt method. The weights of the loss are updated in every iteration.
fn descend<P: Residuals>(slope: &Slope<'_, P>, start: DVector<f64>) -> Result<Descent, SolveError<P::Error>> {
    let mut J = DMatrix::zeros(0, 0);
    let mut x = start;
    let (mut r, mut cost) = slope.evaluate(&x, &mut J)?;
    if !cost.is_finite() {
        return Err(SolveError::NotFinite);
    }
    let (mut damping, mut iterations, mut converged) = (1e-4, 0, slope.basis.ncols() == 0);
    while iterations < slope.search.most_iterations && !converged {
        iterations += 1;
        let equations = slope.normal_equations(&x, &r, &J);
        let (better, settled) = slope.damped_step(&x, cost, &equations, &mut damping);
        converged = settled;
        match better {
            Some(better) => {
                x = better;
                (r, cost) = slope.evaluate(&x, &mut J)?;
            }
            None if !converged => break,
            None => {}
        }
    }
    let weights = slope.weights(&r);
    Ok(Descent { unknowns: x, residuals: r, weights, J, iterations, converged })
}

/// Directions of the parameters, sorted by how well the data determine them.
struct Identifiability {
    directions: DMatrix<f64>,
    gains: Vec<f64>,
    identified: usize,
}

impl Identifiability {
    fn of<E>(descent: &Descent, prior: &DVector<f64>) -> Result<Self, SolveError<E>> {
        let p = prior.len();
        if p == 0 {
            return Ok(Self { directions: DMatrix::zeros(0, 0), gains: Vec::new(), identified: 0 });
        }
        let root = descent.weights.map(f64::sqrt);
        let weighted = DMatrix::from_fn(descent.J.nrows(), descent.J.ncols(), |i, j| root[i] * descent.J[(i, j)]);
        let mut A = weighted.columns(0, p).into_owned();
        for (k, sigma) in prior.iter().enumerate() {
            A.column_mut(k).scale_mut(*sigma);
        }
        let b = weighted.ncols() - p;
        if b > 0 {
            let own = weighted.columns(p, b).into_owned();
            let Q = orthonormal(&own).map_err(SolveError::Nuisance)?;
            A -= &Q * Q.tr_mul(&A);
        }
        // Rows of zeros do not change the singular values and make the SVD return all directions.
        let rows = A.nrows().max(p);
        let A = A.resize(rows, p, 0.0);
        // A prior of 1e308 times a derivative overflows, here or in the squared norm of a column.
        if !A.norm_squared().is_finite() {
            return Err(SolveError::NotFinite);
        }
        let svd = A.svd(false, true);
        let gains = svd.singular_values.as_slice().to_vec();
        let directions = svd.v_t.map_or_else(|| DMatrix::identity(p, p), |rows| rows.transpose());
        let identified = gains.iter().take_while(|gain| **gain > IDENTIFIED).count();
        Ok(Self { directions, gains, identified })
    }

    /// Columns along which the unknowns may move: identified directions of the parameters, then the
    /// unknowns of the measurements.
    fn basis(&self, prior: &DVector<f64>, unknowns: usize) -> DMatrix<f64> {
        let (p, k) = (prior.len(), self.identified);
        let own = unknowns - p;
        let mut basis = DMatrix::zeros(unknowns, k + own);
        for (i, j) in (0..p).flat_map(|i| (0..k).map(move |j| (i, j))) {
            basis[(i, j)] = prior[i] * self.directions[(i, j)];
        }
        for j in 0..own {
            basis[(p + j, k + j)] = 1.0;
        }
        basis
    }

    /// Returns the unknowns with the directions that are not identified set to the prior.
    fn projected(&self, unknowns: &DVector<f64>, prior: &DVector<f64>) -> DVector<f64> {
        let p = prior.len();
        let over = DVector::from_fn(p, |i, _| unknowns[i] / prior[i]);
        let V = self.directions.columns(0, self.identified);
        let kept = V * V.tr_mul(&over);
        let mut projected = unknowns.clone();
        for i in 0..p {
            projected[i] = prior[i] * kept[i];
        }
        projected
    }
}

/// Returns orthonormal columns that span those of `A`. The error is the number of the first column
/// that depends on earlier ones.
pub fn orthonormal(A: &DMatrix<f64>) -> Result<DMatrix<f64>, usize> {
    let (Q, R) = A.clone().qr().unpack();
    let is_own = |k: usize| R.get((k, k)).is_some_and(|left| *left > DEPENDENT * A.column(k).norm());
    (0..A.ncols()).find(|k| !is_own(*k)).map_or(Ok(Q), Err)
}

fn finish(found: Descent, known: Identifiability, basis: &DMatrix<f64>, prior: &DVector<f64>, loss: Loss) -> Solution {
    let (m, p) = (found.residuals.len(), prior.len());
    let columns = basis.ncols();
    let root = found.weights.map(f64::sqrt);
    let B = &found.J * basis;
    let weighted = DMatrix::from_fn(m, columns, |i, j| root[i] * B[(i, j)]);
    // Normal matrix scaled to a unit diagonal, so that units do not matter.
    let normal = weighted.tr_mul(&weighted);
    let scales = normal.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
    let scaled = DMatrix::from_fn(columns, columns, |i, j| scales[i] * normal[(i, j)] * scales[j]);
    let inverse = scaled.cholesky().map_or_else(|| DMatrix::zeros(columns, columns), |factor| factor.inverse());
    let inverse = DMatrix::from_fn(columns, columns, |i, j| scales[i] * inverse[(i, j)] * scales[j]);
    let spread = basis * &inverse * basis.transpose();
    let mut covariance = spread.view((0, 0), (p, p)).into_owned();
    // Covariance of the prior in the directions that are not identified.
    let S = DMatrix::from_diagonal(prior);
    let kept = known.directions.columns(0, known.identified);
    let across = DMatrix::identity(p, p) - kept * kept.transpose();
    covariance += &S * across * &S;
    let leverages = DVector::from_fn(m, |i, _| {
        let row = weighted.row(i);
        (row * &inverse * row.transpose())[(0, 0)].clamp(0.0, 1.0)
    });
    let freedom = m.saturating_sub(columns);
    Solution {
        scale: scale(found.residuals.as_slice(), freedom, loss),
        cost: found.residuals.iter().map(|r| loss.cost(*r)).sum(),
        unknowns: found.unknowns,
        residuals: found.residuals,
        weights: found.weights,
        leverages,
        covariance,
        directions: known.directions,
        gains: known.gains,
        identified: known.identified,
        freedom,
        iterations: found.iterations,
        converged: found.converged,
    }
}

/// Multiple of the scale at which residuals are clipped.
const CLIPPED: f64 = 2.5;
/// Mean of `min(z², CLIPPED²)` for standard normal z.
const CLIPPED_MEAN: f64 = 0.977_56;

/// Returns the square of the scale s of the residuals; NaN without degrees of freedom. Robust
/// (Huber's proposal 2): `Σ min(r²/s², CLIPPED²) = CLIPPED_MEAN (m - n)`.
pub fn scale(residuals: &[f64], freedom: usize, loss: Loss) -> f64 {
    if freedom == 0 {
        return f64::NAN;
    }
    let mut square = residuals.iter().map(|r| r * r).sum::<f64>() / freedom as f64;
    if loss == Loss::Square {
        return square;
    }
    for _ in 0..100 {
        let sum: f64 = residuals.iter().map(|r| (r * r).min(CLIPPED * CLIPPED * square)).sum();
        square = sum / (CLIPPED_MEAN * freedom as f64);
    }
    square
}
