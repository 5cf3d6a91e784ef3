//! Compliance and natural frequencies from the tangent at an equilibrium, for one pose or for
//! several in lanes, with the same operations in the same order.
//!
//! Not here: the equilibrium itself (`super`), frequencies with drives that move (`linear.rs`).

use flexarm_kinematics::Real;
use nalgebra::DMatrix;

use crate::dense::{Factor, dot, subtract_product, symmetric_part};
use crate::eigenvalues::symmetric_eigenvalues;

/// Passes of iterative refinement if a constant moment makes the tangent unsymmetric; each reduces
/// the error to a thousandth or less.
const REFINEMENTS: usize = 8;

/// `T = K + dp/de`, n × n, the factor of its symmetric part, and workspaces of derived quantities.
#[derive(Clone, Debug)]
pub(super) struct Tangent<T: Real> {
    n: usize,
    /// T itself, column-major.
    pub(super) T: Vec<T>,
    /// Factor of `(T + Tᵀ)/2`.
    pub(super) factor: Factor<T>,
    /// Whether T is treated as symmetric.
    pub(super) symmetric: bool,
    Jt: Vec<T>,
    /// `T^-1 Jᵀ`, n × 6.
    pub(super) Y: DMatrix<T>,
    R: Vec<T>,
    A: Vec<T>,
    /// `1/ω²`, unsorted.
    pub(super) d: Vec<T>,
    e: Vec<T>,
}

impl<T: Real> Tangent<T> {
    /// Allocates the tangent for n elastic coordinates.
    pub(super) fn new(n: usize) -> Self {
        let zeros = |size: usize| vec![T::zero(); size];
        Self {
            n,
            T: zeros(n * n),
            factor: Factor::new(n),
            symmetric: true,
            Jt: zeros(6 * n),
            Y: DMatrix::zeros(n, 6),
            R: zeros(n),
            A: zeros(n * n),
            d: zeros(n),
            e: zeros(n),
        }
    }

    /// Adds the springs to `dp/de` in T.
    #[inline(always)]
    pub(super) fn add_springs(&mut self, K: &DMatrix<f64>) {
        for (to, k) in self.T.iter_mut().zip(K.as_slice()) {
            *to += T::splat(*k);
        }
    }

    /// Factorises the symmetric part; returns 1 where it is positive definite, else 0.
    #[inline(always)]
    pub(super) fn factorise(&mut self) -> T {
        symmetric_part(&self.T, self.n, &mut self.A);
        self.factor.compute(&self.A)
    }

    /// Returns the displacement of the tool per wrench on it; `J`: 6 × n, of the elastic
    /// coordinates.
    #[inline(always)]
    pub(super) fn compliance(&mut self, J: &[T]) -> [[T; 6]; 6] {
        let mut C = [[T::zero(); 6]; 6];
        if self.n == 0 {
            return C;
        }
        if !self.symmetric {
            self.solve(J, false);
            for (i, row) in C.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry = dot(rows(&self.Jt, self.n, i), rows(self.Y.as_slice(), self.n, j));
                }
            }
            return C;
        }
        // Zᵀ Z with Z = L^-1 Jᵀ.
        self.transpose(J);
        for column in self.Jt.chunks_exact_mut(self.n) {
            self.factor.solve_lower(column);
        }
        for (i, j) in (0..6).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let entry = dot(rows(&self.Jt, self.n, i), rows(&self.Jt, self.n, j));
            (C[i][j], C[j][i]) = (entry, entry);
        }
        C
    }

    #[inline(always)]
    fn transpose(&mut self, J: &[T]) {
        for (k, column) in J.chunks_exact(6).enumerate() {
            for (c, entry) in column.iter().enumerate() {
                self.Jt[c * self.n + k] = *entry;
            }
        }
    }

    /// Computes `Y = T^-1 Jᵀ`, or with Tᵀ if `transposed`.
    #[inline(always)]
    pub(super) fn solve(&mut self, J: &[T], transposed: bool) {
        if self.n == 0 {
            return;
        }
        self.transpose(J);
        for (y, b) in self.Y.as_mut_slice().chunks_exact_mut(self.n).zip(self.Jt.chunks_exact(self.n)) {
            y.copy_from_slice(b);
            self.factor.solve(y);
            if self.symmetric {
                continue;
            }
            for _ in 0..REFINEMENTS {
                // y += S^-1 (b - T y)
                self.R.copy_from_slice(b);
                match transposed {
                    false => subtract_product(&self.T, y, &mut self.R),
                    true => {
                        for (r, column) in self.R.iter_mut().zip(self.T.chunks_exact(self.n)) {
                            *r -= dot(column, y);
                        }
                    }
                }
                self.factor.solve(&mut self.R);
                for (y, r) in y.iter_mut().zip(&self.R) {
                    *y += *r;
                }
            }
        }
    }

    /// Computes `1/ω²` of all natural frequencies in `d`, with the symmetric part; returns 1 on
    /// success, else 0.
    ///
    /// * `M`: mass matrix of all coordinates; those of the springs are the last n.
    #[inline(always)]
    pub(super) fn find_frequencies(&mut self, M: &[T]) -> T {
        let n = self.n;
        let all = M.len().isqrt();
        for (j, column) in self.A.chunks_exact_mut(n.max(1)).enumerate() {
            column.copy_from_slice(&M[(all - n + j) * all + all - n..][..n]);
        }
        // 1/ω² are the eigenvalues of L^-1 M L^-T: the low modes are the largest and most accurate.
        self.factor.reduce(&mut self.A);
        symmetric_eigenvalues(&mut self.A, &mut self.d, &mut self.e)
    }
}

/// Returns column c of a matrix with n rows.
#[inline(always)]
fn rows<T>(A: &[T], n: usize, c: usize) -> &[T] {
    &A[c * n..(c + 1) * n]
}

/// Converts `1/ω²` to frequencies (Hz), ascending; all NaN if not `found`.
pub(super) fn to_hertz(found: bool, d: &mut [f64]) {
    if !found {
        d.fill(f64::NAN);
    }
    d.sort_unstable_by(|a, b| b.total_cmp(a));
    d.iter_mut().for_each(|x| *x = 1.0 / (x.sqrt() * std::f64::consts::TAU));
}
