//! Structure from its mass, damping and stiffness matrices, with any damping.
//!
//! ```text
//! M x'' + D x' + K x = Jᵀ F      u = J x
//! ```
//! In the coordinates of the undamped modes, `x = Φ η`, with `z = (Ω η, η')`, the norm of the
//! first-order matrix is proportional to the highest frequency, not to its square. Its right and
//! left eigenvectors give the poles; the frequency response of the poles is then checked against
//! that of the matrices. Not here: structures from given modes ([`Structure::from_modes`]).

use nalgebra::{Cholesky, Complex, DMatrix, Matrix3, Matrix3xX, Schur, SymmetricEigen, Vector3};

use crate::milling::error::ChatterError;
use crate::milling::structure::{Pole, Structure};

/// Maximum relative error of the frequency response.
const ALLOWED: f64 = 1e-6;
/// Ratio to the largest eigenvalue below which an imaginary part counts as rounding.
const REAL: f64 = 1e-11;

impl Structure {
    /// Builds a structure from mass, damping and stiffness matrix and the tip's Jacobian.
    ///
    /// * `M`, `D`, `K`: n×n; `M` and the symmetric part of `K` positive definite; `D` dissipative.
    ///   SI units.
    /// * `J`: 3×n, velocity of the tip per rate of the coordinates, in the axes of the cut.
    ///
    /// # Errors
    /// [`ChatterError::Invalid`] for matrices that do not fit or are not positive definite,
    /// [`ChatterError::Undamped`] for a mode that does not decay,
    /// [`ChatterError::Unsolved`] for two coinciding modes or an iteration that does not converge.
    pub fn from_matrices(
        M: &DMatrix<f64>,
        D: &DMatrix<f64>,
        K: &DMatrix<f64>,
        J: &Matrix3xX<f64>,
    ) -> Result<Self, ChatterError> {
        let n = M.nrows();
        check(M, D, K, J)?;
        if n == 0 {
            return Self::from_poles(Vec::new());
        }
        // Modal coordinates of the undamped structure.
        let (omega, Phi) = undamped(M, K)?;
        let (D_eta, K_eta, J_eta) = (Phi.tr_mul(&(D * &Phi)), Phi.tr_mul(&(K * &Phi)), J * &Phi);
        // z' = A z + (0, Φᵀ Jᵀ F).
        let A = DMatrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => 0.0,
            (true, false) => {
                if i == j - n {
                    omega[i]
                } else {
                    0.0
                }
            }
            (false, true) => -K_eta[(i - n, j)] / omega[j],
            (false, false) => -D_eta[(i - n, j - n)],
        });
        let (values, right) = eigenvectors(&A)?;
        let left = right.clone().try_inverse().ok_or_else(|| not_modal(f64::INFINITY))?;

        // One pole per conjugate pair: output from the right, input from the left eigenvector.
        let scale = values.iter().map(|x| x.norm()).fold(0.0, f64::max);
        let mut poles = Vec::new();
        for (k, value) in values.iter().enumerate() {
            let value = if value.im.abs() <= REAL * scale { Complex::new(value.re, 0.0) } else { *value };
            if value.im < 0.0 {
                continue;
            }
            let mut pole = Pole { value, input: Vector3::zeros(), output: Vector3::zeros() };
            for j in 0..n {
                pole.output += J_eta.column(j).map(|x| right[(j, k)] * (x / omega[j]));
                pole.input += J_eta.column(j).map(|x| left[(k, n + j)] * x);
            }
            if value.im == 0.0 {
                real_residue(&mut pole);
            }
            poles.push(pole);
        }
        let structure = Self::from_poles(poles)?;
        structure.check_response(&omega, |w| response(M, D, K, J, w))?;
        Ok(structure)
    }

    /// Compares the frequency response of the poles with that of the matrices, at and between the
    /// modes.
    fn check_response(
        &self,
        omega: &[f64],
        truth: impl Fn(f64) -> Option<Matrix3<Complex<f64>>>,
    ) -> Result<(), ChatterError> {
        let at = omega.iter().flat_map(|w| [0.7 * w, *w]);
        for w in at {
            let Some(G) = truth(w) else { continue };
            let found = (self.frequency_response(w) - G).norm() / G.norm().max(f64::MIN_POSITIVE);
            if found > ALLOWED && G.norm() > 0.0 {
                return Err(not_modal(found));
            }
        }
        Ok(())
    }
}

/// Checks sizes and finite values.
fn check(M: &DMatrix<f64>, D: &DMatrix<f64>, K: &DMatrix<f64>, J: &Matrix3xX<f64>) -> Result<(), ChatterError> {
    let n = M.nrows();
    for (what, matrix) in [("mass matrix", M), ("damping matrix", D), ("stiffness matrix", K)] {
        if matrix.shape() != (n, n) {
            return Err(ChatterError::size(what, matrix.shape(), (n, n)));
        }
        if matrix.iter().any(|x| !x.is_finite()) {
            return Err(ChatterError::not_finite(what));
        }
    }
    if J.ncols() != n {
        return Err(ChatterError::size("Jacobian of the tip", J.shape(), (3, n)));
    }
    if J.iter().any(|x| !x.is_finite()) {
        return Err(ChatterError::not_finite("Jacobian of the tip"));
    }
    Ok(())
}

/// Frequencies (rad/s) and mass-normalised mode shapes, with the symmetric part of the stiffness.
fn undamped(M: &DMatrix<f64>, K: &DMatrix<f64>) -> Result<(Vec<f64>, DMatrix<f64>), ChatterError> {
    let mass = Cholesky::new((M + M.transpose()) * 0.5);
    let mass = mass.ok_or_else(|| ChatterError::not_positive_definite("mass matrix"))?;
    let stiffness = Cholesky::new((K + K.transpose()) * 0.5);
    let stiffness = stiffness.ok_or_else(|| ChatterError::not_positive_definite("stiffness matrix"))?;
    // Eigenvalues 1/ω² of L^-1 M L^-T with K = L Lᵀ: the low modes, which move the tip most, have
    // the largest ones.
    let singular = || ChatterError::not_positive_definite("stiffness matrix");
    let (L, half) = (stiffness.l(), mass.l());
    let X = L.solve_lower_triangular(&half).ok_or_else(singular)?;
    let eigen = SymmetricEigen::new(&X * X.transpose());
    if eigen.eigenvalues.min() <= 0.0 {
        return Err(ChatterError::not_positive_definite("mass matrix"));
    }
    let mut Phi = eigen.eigenvectors;
    L.tr_solve_lower_triangular_mut(&mut Phi);
    for (mut column, value) in Phi.column_iter_mut().zip(&eigen.eigenvalues) {
        column /= value.sqrt();
    }
    Ok((eigen.eigenvalues.iter().map(|x| 1.0 / x.sqrt()).collect(), Phi))
}

/// Eigenvalues, and eigenvectors as columns.
type Eigenvectors = (Vec<Complex<f64>>, DMatrix<Complex<f64>>);

/// Computes all eigenvalues of a real matrix, and its eigenvectors as columns, from its complex
/// Schur form.
fn eigenvectors(A: &DMatrix<f64>) -> Result<Eigenvectors, ChatterError> {
    let n = A.nrows();
    let complex = A.map(|x| Complex::new(x, 0.0));
    let schur = Schur::try_new(complex, f64::EPSILON, 400 * n);
    let (Q, T) = schur.ok_or_else(not_converged)?.unpack();
    let least = f64::EPSILON * A.norm();
    let mut Y = DMatrix::<Complex<f64>>::zeros(n, n);
    for k in 0..n {
        Y[(k, k)] = Complex::new(1.0, 0.0);
        for i in (0..k).rev() {
            let sum: Complex<f64> = (i + 1..=k).map(|j| T[(i, j)] * Y[(j, k)]).sum();
            let gap = T[(i, i)] - T[(k, k)];
            // For equal uncoupled eigenvalues any vector of their eigenspace is valid.
            let gap = if gap.norm() < least { Complex::new(least, 0.0) } else { gap };
            Y[(i, k)] = -sum / gap;
        }
    }
    let mut right = Q * Y;
    for mut column in right.column_iter_mut() {
        let size = column.norm();
        column /= Complex::new(size, 0.0);
    }
    Ok(((0..n).map(|k| T[(k, k)]).collect(), right))
}

/// Makes the factors of a real pole real. Their product `o lᵀ` is real, so that they are real up to
/// opposite phases.
fn real_residue(pole: &mut Pole) {
    let largest = pole.input.iter().copied().max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr())).unwrap_or_default();
    if largest.norm() > 0.0 {
        let phase = largest / largest.norm();
        pole.input = pole.input.map(|x| Complex::new((x / phase).re, 0.0));
        pole.output = pole.output.map(|x| Complex::new((x * phase).re, 0.0));
    }
}

/// Computes the frequency response `J (K + i ω D - ω² M)^-1 Jᵀ`.
fn response(
    M: &DMatrix<f64>,
    D: &DMatrix<f64>,
    K: &DMatrix<f64>,
    J: &Matrix3xX<f64>,
    w: f64,
) -> Option<Matrix3<Complex<f64>>> {
    let complex = |x: f64| Complex::new(x, 0.0);
    let dynamic = (K - M * (w * w)).zip_map(D, |k, d| Complex::new(k, w * d));
    let X = dynamic.lu().solve(&J.transpose().map(complex))?;
    let G = J.map(complex) * X;
    Some(Matrix3::from_fn(|i, j| G[(i, j)]))
}

fn not_modal(found: f64) -> ChatterError {
    ChatterError::Unsolved(format!(
        "the modes reproduce the frequency response of the structure with a relative error of {found:.1e}, expected \
         at most {ALLOWED:.0e}: are two modes equal?"
    ))
}

fn not_converged() -> ChatterError {
    ChatterError::Unsolved("the eigenvalue iteration for the structure does not converge".into())
}
