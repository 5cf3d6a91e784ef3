//! Products over whole columns.

use nalgebra::{DMatrix, Dim, Dyn, IsContiguous, Matrix, RawStorage};

/// Computes `toᵀ += A Xᵀ` for the block of A that starts at `corner`.
pub(super) fn add_product<R: Dim, S: RawStorage<f64, R, Dyn> + IsContiguous>(
    A: &Matrix<f64, R, Dyn, S>,
    (row, column): (usize, usize),
    X: &DMatrix<f64>,
    to: &mut DMatrix<f64>,
) {
    let (p, rows) = (X.nrows(), A.nrows());
    if p == 0 {
        return;
    }
    let (A, X) = (A.as_slice(), X.as_slice());
    for (i, to) in to.as_mut_slice().chunks_exact_mut(p).enumerate() {
        let entry = |k: usize| A[(column + k) * rows + row + i];
        let mut fours = X.chunks_exact(4 * p);
        let mut k = 0;
        // Four columns at a time, so that the sums are loaded and stored once for all four.
        for x in fours.by_ref() {
            let (a, x0) = ([entry(k), entry(k + 1), entry(k + 2), entry(k + 3)], &x[..p]);
            let (x1, x2, x3) = (&x[p..2 * p], &x[2 * p..3 * p], &x[3 * p..]);
            for ((((to, x0), x1), x2), x3) in to.iter_mut().zip(x0).zip(x1).zip(x2).zip(x3) {
                *to += (a[0] * x0 + a[1] * x1) + (a[2] * x2 + a[3] * x3);
            }
            k += 4;
        }
        for x in fours.remainder().chunks_exact(p) {
            let a = entry(k);
            to.iter_mut().zip(x).for_each(|(to, x)| *to += a * x);
            k += 1;
        }
    }
}
