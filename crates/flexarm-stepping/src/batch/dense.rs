//! Small dense matrices, column after column in a slice; n is their number of rows.
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

/// Cholesky's factor in the lower triangle; false if the matrix is not positive definite.
#[inline(always)]
pub(super) fn cholesky(A: &mut [f64], n: usize) -> bool {
    let mut positive = true;
    for j in 0..n {
        let (before, rest) = A.split_at_mut(j * n);
        let column = &mut rest[j..n];
        for inward in before.chunks_exact(n) {
            let inward = &inward[j..];
            subtract(column, inward[0], inward);
        }
        positive &= column[0] > 0.0;
        let denominator = column[0].sqrt();
        column[0] = denominator;
        for entry in &mut column[1..] {
            *entry /= denominator;
        }
    }
    positive
}

/// Solves `A X = B` with the factor of A; takes `Bᵀ`, leaves `Xᵀ`.
#[inline(always)]
pub(super) fn solve_transposed(L: &[f64], Bt: &mut [f64], n: usize) {
    for k in 0..n {
        let (inward, outward) = Bt.split_at_mut((k + 1) * n);
        let column = &mut inward[k * n..];
        let factors = &L[k * n + k..(k + 1) * n];
        scale(column, 1.0 / factors[0]);
        for (to, factor) in outward.chunks_exact_mut(n).zip(&factors[1..]) {
            subtract(to, *factor, column);
        }
    }
    for k in (0..n).rev() {
        let (inward, outward) = Bt.split_at_mut((k + 1) * n);
        let column = &mut inward[k * n..];
        let factors = &L[k * n + k..(k + 1) * n];
        for (from, factor) in outward.chunks_exact(n).zip(&factors[1..]) {
            subtract(column, *factor, from);
        }
        scale(column, 1.0 / factors[0]);
    }
}

#[inline(always)]
fn scale(column: &mut [f64], by: f64) {
    for entry in column {
        *entry *= by;
    }
}

/// Takes a multiple of one column off another.
#[inline(always)]
fn subtract(to: &mut [f64], factor: f64, from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += -factor * *from;
    }
}

/// `A ← Aᵀ`.
#[inline(always)]
pub(super) fn transpose(A: &mut [f64], n: usize) {
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
            assert!(cholesky(&mut L, n));
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
        assert!(!cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2));
        assert!(!cholesky(&mut [f64::NAN], 1));
    }
}
