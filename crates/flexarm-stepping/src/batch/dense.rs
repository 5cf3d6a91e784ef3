//! Small dense matrices over any scalar, column after column in a slice; n is their number of rows.
//!
//! Sums have the order of the same operations in nalgebra, which a single run uses: each lane has its bits.

use flexarm_kinematics::Real;

/// `y = A x`.
#[inline(always)]
pub(super) fn product<T: Real>(A: &[T], x: &[T], y: &mut [T]) {
    let n = y.len();
    for (y, a) in y.iter_mut().zip(&A[..n]) {
        *y = *a * x[0];
    }
    for (column, x) in A.chunks_exact(n).zip(x).skip(1) {
        for (y, a) in y.iter_mut().zip(column) {
            *y = *a * *x + *y;
        }
    }
}

/// `y += A x`.
#[inline(always)]
pub(super) fn add_product<T: Real>(A: &[T], x: &[T], y: &mut [T]) {
    for (column, x) in A.chunks_exact(y.len()).zip(x) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += *a * *x;
        }
    }
}

/// `aᵀ b`.
#[inline(always)]
pub(super) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
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

/// Cholesky's factor in the lower triangle; what is returned is zero in the lanes whose matrix is positive definite.
#[inline(always)]
pub(super) fn cholesky<T: Real>(A: &mut [T], n: usize) -> T {
    let (zero, one) = (T::zero(), T::one());
    let mut failed = zero;
    for j in 0..n {
        for k in 0..j {
            let factor = -A[k * n + j];
            for i in j..n {
                A[j * n + i] = factor * A[k * n + i] + A[j * n + i];
            }
        }
        let pivot = A[j * n + j];
        failed += zero.pick_below(pivot, zero, one);
        let denominator = pivot.sqrt();
        A[j * n + j] = denominator;
        for entry in &mut A[j * n + j + 1..(j + 1) * n] {
            *entry /= denominator;
        }
    }
    failed
}

/// Solves `A X = B` with the factor of A; takes `Bᵀ`, leaves `Xᵀ`.
#[inline(always)]
pub(super) fn solve_transposed<T: Real>(L: &[T], Bt: &mut [T], n: usize) {
    for k in 0..n {
        scale(&mut Bt[k * n..(k + 1) * n], T::one() / L[k * n + k]);
        for i in k + 1..n {
            subtract(Bt, n, k, i, L[k * n + i]);
        }
    }
    for k in (0..n).rev() {
        for i in k + 1..n {
            subtract(Bt, n, i, k, L[k * n + i]);
        }
        scale(&mut Bt[k * n..(k + 1) * n], T::one() / L[k * n + k]);
    }
}

#[inline(always)]
fn scale<T: Real>(column: &mut [T], by: T) {
    for entry in column {
        *entry *= by;
    }
}

/// Takes a multiple of column `from` off column `to`.
#[inline(always)]
fn subtract<T: Real>(A: &mut [T], n: usize, from: usize, to: usize, factor: T) {
    let factor = -factor;
    for r in 0..n {
        A[to * n + r] = factor * A[from * n + r] + A[to * n + r];
    }
}

/// `A ← Aᵀ`.
#[inline(always)]
pub(super) fn transpose<T: Real>(A: &mut [T], n: usize) {
    for j in 0..n {
        for i in j + 1..n {
            A.swap(j * n + i, i * n + j);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Cholesky, DMatrix, DVector};

    /// Truth: nalgebra; the same bits.
    #[test]
    fn every_operation_has_the_bits_of_the_library() {
        for n in [1, 3, 8, 13, 18] {
            let entry = |i: usize, j: usize| ((i * 7 + j * 11) as f64 * 0.731).sin();
            let B = DMatrix::from_fn(n, n, entry);
            let A = &B * B.transpose() + DMatrix::identity(n, n);
            let x = DVector::from_fn(n, |i, _| entry(i, 5));
            let mut y = vec![0.0; n];
            product(A.as_slice(), x.as_slice(), &mut y);
            let mut expected = DVector::zeros(n);
            expected.gemv(1.0, &A, &x, 0.0);
            assert_eq!(y, expected.as_slice());
            assert_eq!(dot(x.as_slice(), &y), x.dot(&expected));

            let mut L = A.as_slice().to_vec();
            assert_eq!(cholesky(&mut L, n), 0.0);
            let factor = Cholesky::new(A.clone()).unwrap();
            let lower = DMatrix::from_column_slice(n, n, &L).lower_triangle();
            assert_eq!(lower, factor.l());
            let (mut ours, mut theirs) = (B.clone(), B.clone());
            solve_transposed(&L, ours.as_mut_slice(), n);
            crate::iteration_matrix::solve_transposed(&factor, &mut theirs);
            assert_eq!(ours, theirs);
            transpose(ours.as_mut_slice(), n);
            assert_eq!(ours, theirs.transpose());
        }
        assert_eq!(cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2), 1.0);
        assert_eq!(cholesky(&mut [f64::NAN], 1), 1.0);
    }
}
