//! Matrices of an arm with many modes that are coupled only with the coordinates carrying them: the
//! modes are eliminated one by one, which leaves a matrix of the few other coordinates.
//!
//! Fixed-interface modes of a link do not move the attached bodies, are orthogonal in stiffness to
//! each other and to the interface motions of the link, and have constant mass. With b the other
//! coordinates, m such a mode and v its column of M,
//!
//! ```text
//! M = [ M_b  v ... ]     K = [ K_b     ]     C = [ C_b     ]
//!     [ vᵀ   μ     ]         [      k  ]         [      c  ]                                   (1)
//! ```
//! For `J = M + C (1 + s M^-1 K)`, the matrix of generalised-alpha with dispersion correction,
//! `u = s M^-1 K x` is added as a second unknown (as in [`crate::tree_matrix`], (8)), and each mode
//! is a two by two system:
//!
//! ```text
//! [ μ + c   c ] [ x_m ]   [ r_m - vᵀ x_b ]
//! [ -s k    μ ] [ u_m ] = [     - vᵀ u_b ]          a = 1/(μ (μ + c) + s k c)             (2)
//!
//! [ M_b + C_b - Σ a μ v vᵀ      C_b + Σ a c v vᵀ       ] [ x_b ]   [ r_b - Σ a μ v r_m  ]
//! [ -s K_b - Σ a s k v vᵀ       M_b - Σ a (μ + c) v vᵀ ] [ u_b ] = [     - Σ a s k v r_m ]  (3)
//! ```
//! Without a correction s and u are zero. A solution costs the number of modes times the number of
//! other coordinates, and the factorisation of (3) costs that again for each of the others; a dense
//! inverse costs the square and the cube of their sum.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::error::StepError;

/// The matrices (1) of a [`crate::SecondOrderSystem`].
#[derive(Clone, Debug, Default)]
pub struct ModeMatrices {
    /// Coordinates that are not eliminated, ascending.
    pub others: Vec<usize>,
    /// Coordinates of the modes.
    pub modes: Vec<usize>,
    /// `M_b`.
    pub mass: DMatrix<f64>,
    /// `C_b`: `c_D D + c_K K` of the others.
    pub C: DMatrix<f64>,
    /// `K_b`.
    pub K: DMatrix<f64>,
    /// Columns v, one per mode.
    pub coupling: DMatrix<f64>,
    /// μ, c and k of each mode.
    pub own: Vec<[f64; 3]>,
}

/// `J^-1` of matrices with modes; see the module documentation.
#[derive(Clone, Debug, Default)]
pub(crate) struct ModeInverse {
    pub(crate) matrices: ModeMatrices,
    s: f64,
    /// Inverse of (3), x and u of a coordinate adjacent: `2 n_b × 2 n_b`.
    inverse: DMatrix<f64>,
    block: DMatrix<f64>,
    /// a of each mode.
    determinants: Vec<f64>,
    /// Factor of the Schur complement of M, for the correction of an acceleration.
    mass_factor: Option<Cholesky<f64, Dyn>>,
    /// Right-hand side and solution of (3).
    right: DVector<f64>,
    solved: DVector<f64>,
    force: DVector<f64>,
    /// `s M^-1 K d` of the last solution d.
    shift: DVector<f64>,
}

/// Computes `A += x v vᵀ` on and below the diagonal, for all modes.
fn add_squares(A: &mut DMatrix<f64>, columns: &DMatrix<f64>, factor: impl Fn(usize) -> f64) {
    let n = A.nrows();
    for (m, v) in columns.as_slice().chunks_exact(n).enumerate() {
        let x = factor(m);
        for (j, column) in A.as_mut_slice().chunks_exact_mut(n).enumerate() {
            let scaled = x * v[j];
            for (entry, v) in column[j..].iter_mut().zip(&v[j..]) {
                *entry += scaled * v;
            }
        }
    }
}

impl ModeInverse {
    /// Factorises `matrices`, with the correction by s or without.
    ///
    /// # Errors
    /// [`StepError::Singular`] if M or J is not positive definite.
    pub(crate) fn factor(&mut self, s: Option<f64>, t: f64) -> Result<(), StepError> {
        self.s = s.unwrap_or(0.0);
        let (s, nb) = (self.s, self.matrices.others.len());
        let n = nb + self.matrices.modes.len();
        if self.inverse.nrows() != 2 * nb || self.shift.len() != n {
            (self.inverse, self.block) = (DMatrix::zeros(2 * nb, 2 * nb), DMatrix::zeros(nb, nb));
            self.mass_factor = Cholesky::new(DMatrix::identity(nb, nb));
            (self.right, self.solved) = (DVector::zeros(2 * nb), DVector::zeros(2 * nb));
            (self.force, self.shift) = (DVector::zeros(nb), DVector::zeros(n));
        }
        let ModeMatrices { mass, C, K, coupling, own, .. } = &self.matrices;
        self.determinants.clear();
        self.determinants.extend(own.iter().map(|[mu, c, k]| 1.0 / (mu * (mu + c) + s * k * c)));
        // Schur complement of M.
        let mut left = crate::iteration_matrix::storage_of(&mut self.mass_factor, nb);
        left.copy_from(mass);
        add_squares(&mut left, coupling, |m| -1.0 / own[m][0]);
        let light = own.iter().all(|[mu, ..]| *mu > 0.0);
        let factor = Cholesky::new(left).filter(|_| light);
        self.mass_factor = Some(factor.ok_or(StepError::Singular { matrix: "mass matrix", t })?);
        // Assemble (3) block by block.
        let a = &self.determinants;
        let block = &mut self.block;
        let parts: [(usize, usize, [f64; 3]); 4] =
            [(0, 0, [1.0, 1.0, 0.0]), (0, 1, [0.0, 1.0, 0.0]), (1, 0, [0.0, 0.0, -s]), (1, 1, [1.0, 0.0, 0.0])];
        for (row, column, [of_M, of_C, of_K]) in parts {
            for (to, ((m, c), k)) in block.iter_mut().zip(mass.iter().zip(C).zip(K)) {
                *to = of_M * m + of_C * c + of_K * k;
            }
            add_squares(block, coupling, |m| {
                let [mu, c, k] = own[m];
                a[m] * match (row, column) {
                    (0, 0) => -mu,
                    (0, _) => c,
                    (_, 0) => -s * k,
                    _ => -(mu + c),
                }
            });
            for j in 0..nb {
                for i in 0..nb {
                    self.inverse[(2 * i + row, 2 * j + column)] = block[(i.max(j), i.min(j))];
                }
            }
        }
        match invert_in_pairs(&mut self.inverse) {
            true => Ok(()),
            false => Err(StepError::Singular { matrix: "iteration matrix", t }),
        }
    }

    /// Replaces `r` by `d = J^-1 r`; also computes [`ModeInverse::shift`].
    pub(crate) fn solve(&mut self, r: &mut DVector<f64>) {
        let Self { matrices, s, inverse, determinants, right, solved, shift, .. } = self;
        let ModeMatrices { others, modes, coupling, own, .. } = &*matrices;
        let nb = others.len();
        // Right-hand side of (3).
        for (i, &k) in others.iter().enumerate() {
            (right[2 * i], right[2 * i + 1]) = (r[k], 0.0);
        }
        let columns = || coupling.as_slice().chunks_exact(nb.max(1));
        for (((&coordinate, v), [mu, _, k]), a) in modes.iter().zip(columns()).zip(own).zip(&*determinants) {
            let r = a * r[coordinate];
            let (x, u) = (mu * r, *s * k * r);
            for (pair, v) in right.as_mut_slice().chunks_exact_mut(2).zip(v) {
                pair[0] -= v * x;
                pair[1] -= v * u;
            }
        }
        // Other coordinates by (3), then the modes by (2).
        solved.gemv(1.0, inverse, right, 0.0);
        for (((&coordinate, v), [mu, c, k]), a) in modes.iter().zip(columns()).zip(own).zip(&*determinants) {
            let (mut x, mut u) = (r[coordinate], 0.0);
            for (pair, v) in solved.as_slice().chunks_exact(2).zip(v) {
                x -= v * pair[0];
                u -= v * pair[1];
            }
            r[coordinate] = a * (mu * x - c * u);
            shift[coordinate] = a * (*s * k * x + (mu + c) * u);
        }
        for (i, &k) in others.iter().enumerate() {
            (r[k], shift[k]) = (solved[2 * i], solved[2 * i + 1]);
        }
    }

    /// Returns `s M^-1 K d` of the last solution d.
    pub(crate) fn shift(&self) -> &DVector<f64> {
        &self.shift
    }

    /// Computes `y = x + s M^-1 K x`.
    pub(crate) fn correct(&mut self, x: &DVector<f64>, y: &mut DVector<f64>) {
        let Self { matrices, s, mass_factor, force, .. } = self;
        let ModeMatrices { others, modes, coupling, own, K, .. } = &*matrices;
        let nb = others.len();
        // Force s K x on the other coordinates, with the modes eliminated from M.
        force.fill(0.0);
        for (column, &k) in K.as_slice().chunks_exact(nb.max(1)).zip(others) {
            let x = *s * x[k];
            force.iter_mut().zip(column).for_each(|(f, k)| *f += k * x);
        }
        let columns = || coupling.as_slice().chunks_exact(nb.max(1));
        for ((&coordinate, v), [mu, _, k]) in modes.iter().zip(columns()).zip(own) {
            let alone = *s * k * x[coordinate] / mu;
            force.iter_mut().zip(v).for_each(|(f, v)| *f -= v * alone);
        }
        if let Some(factor) = mass_factor {
            factor.solve_mut(force);
        }
        for (i, &k) in others.iter().enumerate() {
            y[k] = x[k] + force[i];
        }
        for ((&coordinate, v), [mu, _, k]) in modes.iter().zip(columns()).zip(own) {
            let carried: f64 = v.iter().zip(force.iter()).map(|(v, u)| v * u).sum();
            y[coordinate] = x[coordinate] + (*s * k * x[coordinate] - carried) / mu;
        }
    }
}

/// Inverts a matrix in place by Gauss-Jordan elimination, two rows and columns at a time; returns
/// false if the determinant of a pivot is not positive.
fn invert_in_pairs(A: &mut DMatrix<f64>) -> bool {
    let n = A.nrows();
    for k in (0..n).step_by(2) {
        let [a, b, c, d] = [A[(k, k)], A[(k, k + 1)], A[(k + 1, k)], A[(k + 1, k + 1)]];
        let determinant = a * d - b * c;
        if !(determinant > 0.0 && determinant.is_finite()) {
            return false;
        }
        let pivot = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]];
        // Both columns without the pivot.
        for j in k..k + 2 {
            (A[(k, j)], A[(k + 1, j)]) = (0.0, 0.0);
        }
        for j in (0..n).filter(|j| j / 2 != k / 2) {
            let (x, y) = (A[(k, j)], A[(k + 1, j)]);
            let factors = pivot.map(|[p, q]| p * x + q * y);
            (A[(k, j)], A[(k + 1, j)]) = (factors[0], factors[1]);
            for (own, factor) in (k..k + 2).zip(factors) {
                let (mut to, from) = A.columns_range_pair_mut(j, own);
                to.axpy(-factor, &from, 1.0);
            }
        }
        for i in 0..n {
            let (x, y) = (A[(i, k)], A[(i, k + 1)]);
            A[(i, k)] = -(x * pivot[0][0] + y * pivot[1][0]);
            A[(i, k + 1)] = -(x * pivot[0][1] + y * pivot[1][1]);
        }
        for (i, row) in pivot.iter().enumerate() {
            (A[(k + i, k)], A[(k + i, k + 1)]) = (row[0], row[1]);
        }
    }
    true
}
