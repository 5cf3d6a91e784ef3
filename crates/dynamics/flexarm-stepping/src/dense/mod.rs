//! Small dense matrices, column-major in a slice; n is the number of rows.
//!
//! For numbers or SIMD lanes of numbers. Sums are in the order of the same operations in nalgebra,
//! which single runs use, so that each lane is bitwise the same. [`Factor`] has its own order, used
//! for single poses and lanes alike.
//!
//! Not here: sparse or large matrices; eigenvectors, which nalgebra computes.

use flexarm_kinematics::Real;

/// Computes `y = A x`.
#[inline(always)]
pub fn product<T: Real>(A: &[T], x: &[T], y: &mut [T]) {
    let Some((x_0, x)) = x.split_first() else { return };
    let (first, columns) = A.split_at(y.len());
    for (y, a) in y.iter_mut().zip(first) {
        *y = *a * *x_0;
    }
    add_columns(columns, x.iter().copied(), y);
}

/// Computes `y += A x`.
#[inline(always)]
pub(crate) fn add_product<T: Real>(A: &[T], x: &[T], y: &mut [T]) {
    add_columns(A, x.iter().copied(), y);
}

/// Computes `y -= A x`.
#[inline(always)]
pub(crate) fn subtract_product<T: Real>(A: &[T], x: &[T], y: &mut [T]) {
    add_columns(
        A,
        x.iter().map(
            #[inline(always)]
            |x| -*x,
        ),
        y,
    );
}

/// Numbers of rows whose sums are kept in registers: blocks of the first size, then of the second.
const ROWS: [usize; 2] = [12, 6];

/// Adds multiples of the columns of A to `y`, in order for each row.
#[inline(always)]
fn add_columns<T: Real>(A: &[T], factors: impl Iterator<Item = T> + Clone, y: &mut [T]) {
    let n = y.len();
    let mut first = 0;
    while first + ROWS[0] <= n {
        add_to_rows::<T, { ROWS[0] }>(A, factors.clone(), first, y);
        first += ROWS[0];
    }
    while first + ROWS[1] <= n {
        add_to_rows::<T, { ROWS[1] }>(A, factors.clone(), first, y);
        first += ROWS[1];
    }
    while first + 2 <= n {
        add_to_rows::<T, 2>(A, factors.clone(), first, y);
        first += 2;
    }
    if first < n {
        add_to_rows::<T, 1>(A, factors, first, y);
    }
}

/// Performs [`add_columns`] for N rows.
#[inline(always)]
fn add_to_rows<T: Real, const N: usize>(A: &[T], factors: impl Iterator<Item = T>, first: usize, y: &mut [T]) {
    let n = y.len();
    let rows = &mut y[first..first + N];
    let mut sums = [T::zero(); N];
    sums.copy_from_slice(rows);
    // `chunks_exact(n).zip(...)` would first divide by n.
    let mut rest = A;
    for factor in factors {
        let Some((column, next)) = rest.split_at_checked(n) else { break };
        rest = next;
        for (sum, a) in sums.iter_mut().zip(&column[first..first + N]) {
            *sum = *a * factor + *sum;
        }
    }
    rows.copy_from_slice(&sums);
}

/// Returns `aᵀ b`.
#[inline(always)]
pub fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let mut sums = [T::zero(); 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let (a_rest, b_rest) = (a8.remainder(), b8.remainder());
    for (a, b) in a8.zip(b8) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += a[k] * b[k];
        }
    }
    let mut total = T::zero();
    for k in 0..4 {
        total += sums[k] + sums[k + 4];
    }
    for (a, b) in a_rest.iter().zip(b_rest) {
        total += *a * *b;
    }
    total
}

/// Computes the Cholesky factor in the lower triangle; returns 1 where the matrix is positive
/// definite, else 0.
#[inline(always)]
pub fn cholesky<T: Real>(A: &mut [T], n: usize) -> T {
    let mut positive = T::one();
    for j in 0..n {
        let (before, rest) = A.split_at_mut(j * n);
        let column = &mut rest[j..n];
        for inward in before.chunks_exact(n) {
            let inward = &inward[j..];
            subtract(column, inward[0], inward);
        }
        positive = T::zero().pick_below(column[0], positive, T::zero());
        let denominator = column[0].sqrt();
        column[0] = denominator;
        for entry in &mut column[1..] {
            *entry /= denominator;
        }
    }
    positive
}

/// Replaces A by its factor and `Bᵀ` by `A^-1 B`; returns false if A is not positive definite.
pub(crate) fn solve_in_place(A: &mut [f64], Bt: &mut [f64], n: usize) -> bool {
    let positive = cholesky(A, n) == 1.0;
    solve_transposed(A, Bt, n);
    transpose(Bt, n);
    positive
}

/// Solves `A X = B` with the factor of A, from `Bᵀ` to `Xᵀ`: in transposed form, elimination works
/// on whole columns.
pub fn solve_transposed(L: &[f64], Bt: &mut [f64], n: usize) {
    for k in 0..n {
        let (inward, outward) = Bt.split_at_mut(k * n);
        let column = &mut outward[..n];
        add_columns(inward, L[k..].iter().step_by(n).map(|factor| -factor), column);
        scale(column, 1.0 / L[k * n + k]);
    }
    for k in (0..n).rev() {
        let (inward, outward) = Bt.split_at_mut((k + 1) * n);
        let column = &mut inward[k * n..];
        subtract_product(outward, &L[k * n + k + 1..(k + 1) * n], column);
        scale(column, 1.0 / L[k * n + k]);
    }
}

#[inline(always)]
fn scale<T: Real>(column: &mut [T], by: T) {
    for entry in column {
        *entry *= by;
    }
}

/// Subtracts a multiple of one column from another.
#[inline(always)]
fn subtract<T: Real>(to: &mut [T], factor: T, from: &[T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += -factor * *from;
    }
}

/// Computes `Eᵀ Z E` with `E = 1 + c X` for a symmetric Z, into `product`; all are n × n.
pub fn congruence(c: f64, X: &[f64], Z: &[f64], n: usize, workspaces: [&mut [f64]; 2], product: &mut [f64]) {
    let [ZE, Xt] = workspaces;
    if n == 0 {
        return;
    }
    // Z E = Z + c Z X
    ZE.copy_from_slice(Z);
    for (column, x) in ZE.chunks_exact_mut(n).zip(X.chunks_exact(n)) {
        add_columns(Z, x.iter().map(|x| c * x), column);
    }
    // Eᵀ Z E = Z E + c Xᵀ Z E
    Xt.copy_from_slice(X);
    transpose(Xt, n);
    product.copy_from_slice(ZE);
    for (column, z) in product.chunks_exact_mut(n).zip(ZE.chunks_exact(n)) {
        add_columns(Xt, z.iter().map(|z| c * z), column);
    }
}

/// Writes the symmetric part of A (n × n) into the lower triangle of S.
#[inline(always)]
pub(crate) fn symmetric_part<T: Real>(A: &[T], n: usize, S: &mut [T]) {
    for (j, column) in S.chunks_exact_mut(n.max(1)).enumerate() {
        for (i, entry) in column.iter_mut().enumerate().skip(j) {
            *entry = T::splat(0.5) * (A[j * n + i] + A[i * n + j]);
        }
    }
}

/// Returns the larger number; `a` if b is NaN.
#[inline(always)]
pub(crate) fn larger<T: Real>(a: T, b: T) -> T {
    a.pick_below(b, b, a)
}

/// Returns the maximum absolute value; NaN if an entry is NaN or infinite.
#[inline(always)]
pub fn largest<T: Real>(x: &[T]) -> T {
    let (mut largest, mut broken) = (T::zero(), T::zero());
    for x in x {
        largest = larger(largest, x.abs());
        broken += *x * T::zero();
    }
    largest + broken
}

/// Returns the maximum absolute value; infinite if an entry is not finite.
pub fn largest_of_numbers(x: &[f64]) -> f64 {
    let (mut most, mut broken) = ([0.0; 4], [0.0; 4]);
    let fours = x.chunks_exact(4);
    for (k, x) in fours.remainder().iter().enumerate() {
        (most[k], broken[k]) = (x.abs(), x * 0.0);
    }
    for x in fours {
        for k in 0..4 {
            most[k] = larger(most[k], x[k].abs());
            broken[k] += x[k] * 0.0;
        }
    }
    let all = larger(larger(most[0], most[1]), larger(most[2], most[3]));
    let finite = (broken[0] + broken[1]) + (broken[2] + broken[3]) == 0.0;
    if finite { all } else { f64::INFINITY }
}

/// Factor `A = L Lᵀ` of a symmetric matrix, in reusable storage.
#[derive(Clone, Debug)]
pub struct Factor<T> {
    n: usize,
    /// L in the lower triangle; the upper triangle keeps the entries of A.
    L: Vec<T>,
    /// `1 / L_kk`.
    inverse: Vec<T>,
}

impl<T: Real> Factor<T> {
    /// Allocates storage for n rows.
    pub fn new(n: usize) -> Self {
        Self { n, L: vec![T::zero(); n * n], inverse: vec![T::zero(); n] }
    }

    /// Copies another factor with the same number of rows.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.L.copy_from_slice(&other.L);
        self.inverse.copy_from_slice(&other.inverse);
    }

    /// Factorises A (n × n, lower triangle read); returns 1 where A is positive definite, else 0.
    #[inline(always)]
    pub fn compute(&mut self, A: &[T]) -> T {
        self.L.copy_from_slice(A);
        let positive = cholesky(&mut self.L, self.n);
        for (inverse, diagonal) in self.inverse.iter_mut().zip(self.L.iter().step_by(self.n + 1)) {
            *inverse = T::one() / *diagonal;
        }
        positive
    }

    /// Computes `x ← L^-1 x`.
    #[inline(always)]
    pub(crate) fn solve_lower(&self, x: &mut [T]) {
        self.solve_rows(0, x);
    }

    /// Computes `x ← A^-1 x`.
    #[inline(always)]
    pub fn solve(&self, x: &mut [T]) {
        self.solve_lower(x);
        for k in (0..x.len()).rev() {
            let (inward, outward) = x.split_at_mut(k + 1);
            let known = dot(&self.L[k * self.n + k + 1..(k + 1) * self.n], outward);
            inward[k] = (inward[k] - known) * self.inverse[k];
        }
    }

    /// Computes `B ← L^-1 B L^-T` for a symmetric matrix, of which only the lower triangle is read
    /// and written.
    ///
    /// # Source
    /// LAPACK's `dsygs2`.
    #[inline(always)]
    pub fn reduce(&self, B: &mut [T]) {
        let n = self.n;
        for k in 0..n {
            let (inward, outward) = B.split_at_mut((k + 1) * n);
            let (diagonal, b) = inward[k * n + k..].split_at_mut(1);
            let l = &self.L[k * n + k + 1..(k + 1) * n];
            let inverse = self.inverse[k];
            diagonal[0] *= inverse * inverse;
            // Half of the diagonal term before and half after the rank-two update keeps the update
            // symmetric.
            let half = T::splat(0.5) * diagonal[0];
            scale(b, inverse);
            subtract(b, half, l);
            for (j, column) in outward.chunks_exact_mut(n).enumerate() {
                let (b_j, l_j) = (b[j], l[j]);
                let column = &mut column[k + 1 + j..];
                for ((to, b), l) in column.iter_mut().zip(&b[j..]).zip(&l[j..]) {
                    *to -= *b * l_j + *l * b_j;
                }
            }
            subtract(b, half, l);
            self.solve_rows(k + 1, b);
        }
    }

    /// Computes `x ← L^-1 x` with rows and columns of L from `first` on.
    #[inline(always)]
    fn solve_rows(&self, first: usize, x: &mut [T]) {
        for k in 0..x.len() {
            let (inward, outward) = x.split_at_mut(k + 1);
            let row = first + k;
            inward[k] *= self.inverse[row];
            subtract(outward, inward[k], &self.L[row * self.n + row + 1..(row + 1) * self.n]);
        }
    }
}

/// Computes `A ← Aᵀ`.
pub fn transpose(A: &mut [f64], n: usize) {
    for j in 0..n {
        for i in j + 1..n {
            A.swap(j * n + i, i * n + j);
        }
    }
}
