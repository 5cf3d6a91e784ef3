//! Free vibration of `M q̈ + D q̇ + K q = 0` with arbitrary damping: complex eigenvalues and
//! shapes.
//!
//! ```text
//! (λ² M + λ D + K) φ = 0        λ = -ζ ω + i ω sqrt(1 - ζ²)
//! ```
//! The problem is written in modal coordinates of the undamped system, `q = Φ η`, `Φᵀ M Φ = 1`,
//! `Φᵀ K Φ = diag μ`, with `z = (s η, η̇)` and `s = sqrt|μ|`. The norm of the first-order matrix is
//! then proportional to the highest frequency, not to its square, so that low modes stay accurate
//! next to stiff ones. Start at [`damped_modes`].
//!
//! Not here: response to an input (`linear_system.rs`), tracking of modes over poses.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Schur, SymmetricEigen};

use crate::linear_system::LinearError;

/// Undamped modes with `ω²` below this fraction of the highest are rigid motions.
const RIGID: f64 = 1e-13;

/// A mode of a damped structure: an oscillation (which represents a conjugate pair), a decay
/// without oscillation (each of the two separately), or a rigid motion (`λ = 0`).
#[derive(Debug, Clone, PartialEq)]
pub struct DampedMode {
    /// `λ`, 1/s; imaginary part not negative.
    pub eigenvalue: Complex<f64>,
    /// `φ`, with `φᴴ M φ = 1` and `φᵀ M φ` real and positive; real if the damping is proportional.
    pub shape: DVector<Complex<f64>>,
    /// Relative residual of the eigensolver: `|(λ² M + λ D + K) φ|` over the sum of the norms of
    /// its three terms.
    pub residual: f64,
}

impl DampedMode {
    /// Returns `|λ| / 2π`, Hz: the undamped frequency of the mode if the damping is proportional.
    pub fn frequency_hz(&self) -> f64 {
        self.eigenvalue.norm() / TAU
    }

    /// Returns the frequency of the decaying oscillation, Hz; 0 if there is no oscillation.
    pub fn damped_frequency_hz(&self) -> f64 {
        self.eigenvalue.im / TAU
    }

    /// Returns `-Re λ / |λ|`: 1 for a decay without oscillation, negative for a growing motion, 0
    /// for a rigid one.
    pub fn damping_ratio(&self) -> f64 {
        let size = self.eigenvalue.norm();
        if size > 0.0 { -self.eigenvalue.re / size } else { 0.0 }
    }
}

/// Computes all modes of `M q̈ + D q̇ + K q = 0`, by ascending `|λ|`.
///
/// * `M`: n×n, positive definite. `D`, `K`: n×n, symmetric; they may be singular, and `K`
///   indefinite (an inverted pendulum has a mode with a negative damping ratio).
///
/// # Errors
/// [`LinearError`] if sizes do not fit, `M` is not positive definite, or an iteration does not
/// converge.
pub fn damped_modes(M: &DMatrix<f64>, D: &DMatrix<f64>, K: &DMatrix<f64>) -> Result<Vec<DampedMode>, LinearError> {
    let n = M.nrows();
    for (what, matrix) in [("mass matrix", M), ("damping matrix", D), ("stiffness matrix", K)] {
        if matrix.shape() != (n, n) {
            return Err(LinearError::Size { what, found: matrix.shape(), expected: (n, n) });
        }
        if matrix.iter().any(|x| !x.is_finite()) {
            return Err(LinearError::NotFinite { what });
        }
    }
    if n == 0 {
        return Ok(Vec::new());
    }
    let (mu, Phi) = undamped(M, K)?;
    let largest = mu.iter().fold(0.0, |top: f64, x| top.max(x.abs()));
    let rigid: Vec<usize> = (0..n).filter(|&j| mu[j].abs() <= RIGID * largest).collect();
    let elastic: Vec<usize> = (0..n).filter(|j| !rigid.contains(j)).collect();

    // z = (s η of the elastic modes, η̇ of all modes): ż = A z.
    let D_eta = Phi.tr_mul(&(D * &Phi));
    let (p, size) = (elastic.len(), elastic.len() + n);
    let mut A = DMatrix::<f64>::zeros(size, size);
    A.view_mut((p, p), (n, n)).copy_from(&-&D_eta);
    for (row, &j) in elastic.iter().enumerate() {
        let s = mu[j].abs().sqrt();
        A[(row, p + j)] = s;
        A[(p + j, row)] = -s * mu[j].signum();
    }
    let scale = A.norm();
    let complex = A.map(|x| Complex::new(x, 0.0));
    let (Q, T) = Schur::try_new(complex, f64::EPSILON, 200 * size).ok_or(LinearError::NotConverged)?.unpack();

    let mut modes: Vec<DampedMode> = rigid
        .iter()
        .map(|&j| (Complex::new(0.0, 0.0), Phi.column(j).map(|x| Complex::new(x, 0.0))))
        .map(|(eigenvalue, shape)| finished(eigenvalue, shape, M, D, K))
        .collect();
    for k in 0..size {
        let mut eigenvalue = T[(k, k)];
        if eigenvalue.im.abs() <= 1e-11 * scale {
            eigenvalue.im = 0.0;
        }
        // Skip the conjugate of a pair, and the velocity of an undamped rigid motion: both are
        // covered.
        if eigenvalue.im < 0.0 || eigenvalue.norm() <= 1e-11 * scale {
            continue;
        }
        let z = &Q * triangular_eigenvector(&T, k, scale);
        let velocities = z.rows(p, n).into_owned();
        let shape = Phi.map(|x| Complex::new(x, 0.0)) * velocities / eigenvalue;
        modes.push(finished(eigenvalue, shape, M, D, K));
    }
    modes.sort_by(|a, b| a.eigenvalue.norm().total_cmp(&b.eigenvalue.norm()));
    Ok(modes)
}

/// Solves `K Φ = M Φ diag μ` with `Φᵀ M Φ = 1`.
fn undamped(M: &DMatrix<f64>, K: &DMatrix<f64>) -> Result<(Vec<f64>, DMatrix<f64>), LinearError> {
    let mass = Cholesky::new(M.clone()).ok_or(LinearError::NotPositiveDefinite { what: "mass matrix" })?;
    // Without rigid motions K = L Lᵀ, and L^-1 M L^-T has the eigenvalues 1/μ: the low modes are
    // the largest. Rounding may let a singular K pass; its rigid motions would then spoil the other
    // modes.
    if let Some(stiffness) = Cholesky::new(K.clone()) {
        let eigen = congruent(&stiffness.l(), M);
        if let Some(eigen) = eigen.filter(|e| e.eigenvalues.min() > 1e3 * RIGID * e.eigenvalues.max()) {
            let mut Phi = eigen.eigenvectors;
            stiffness.l().tr_solve_lower_triangular_mut(&mut Phi);
            for (mut column, value) in Phi.column_iter_mut().zip(&eigen.eigenvalues) {
                column /= value.sqrt();
            }
            return Ok((eigen.eigenvalues.iter().map(|x| 1.0 / x).collect(), Phi));
        }
    }
    let eigen = congruent(&mass.l(), K).ok_or(LinearError::NotPositiveDefinite { what: "mass matrix" })?;
    let mut Phi = eigen.eigenvectors;
    mass.l().tr_solve_lower_triangular_mut(&mut Phi);
    Ok((eigen.eigenvalues.iter().copied().collect(), Phi))
}

/// Computes eigenvalues and eigenvectors of `L^-1 S L^-T`.
fn congruent(L: &DMatrix<f64>, S: &DMatrix<f64>) -> Option<SymmetricEigen<f64, nalgebra::Dyn>> {
    let half = L.solve_lower_triangular(S)?;
    let full = L.solve_lower_triangular(&half.transpose())?;
    Some(SymmetricEigen::new((&full + full.transpose()) * 0.5))
}

/// Computes the eigenvector of an upper triangular matrix for its k-th diagonal entry, by back
/// substitution.
fn triangular_eigenvector(T: &DMatrix<Complex<f64>>, k: usize, scale: f64) -> DVector<Complex<f64>> {
    let mut y = DVector::zeros(T.nrows());
    y[k] = Complex::new(1.0, 0.0);
    for i in (0..k).rev() {
        let sum: Complex<f64> = (i + 1..=k).map(|j| T[(i, j)] * y[j]).sum();
        let mut gap = T[(i, i)] - T[(k, k)];
        // Equal eigenvalues: any small gap gives a vector of their common eigenspace.
        if gap.norm() < f64::EPSILON * scale {
            gap = Complex::new(f64::EPSILON * scale, 0.0);
        }
        y[i] = -sum / gap;
    }
    y
}

/// Normalises the shape and evaluates its residual.
fn finished(
    eigenvalue: Complex<f64>,
    mut shape: DVector<Complex<f64>>,
    M: &DMatrix<f64>,
    D: &DMatrix<f64>,
    K: &DMatrix<f64>,
) -> DampedMode {
    let times = |A: &DMatrix<f64>, x: &DVector<Complex<f64>>| A.map(|a| Complex::new(a, 0.0)) * x;
    let Mphi = times(M, &shape);
    let square = shape.dot(&Mphi); // φᵀ M φ, without conjugation
    shape *= Complex::from_polar(1.0 / shape.dotc(&Mphi).re.sqrt(), -0.5 * square.arg());
    let largest = shape.iter().copied().max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr()));
    if largest.is_some_and(|x| x.re < 0.0) {
        shape = -shape;
    }

    let inertia = times(M, &shape) * (eigenvalue * eigenvalue);
    let damping = times(D, &shape) * eigenvalue;
    let spring = times(K, &shape);
    let terms = inertia.norm() + damping.norm() + spring.norm();
    let terms = if eigenvalue.norm() > 0.0 { terms } else { K.norm() * shape.norm() };
    let residual = (inertia + damping + spring).norm() / terms.max(f64::MIN_POSITIVE);
    DampedMode { eigenvalue, shape, residual }
}
