//! Eigenvalues of small symmetric matrices in storage that the caller keeps: no allocation.
//!
//! Householder's reduction to a tridiagonal matrix, then QL with implicit shifts ([Golub and Van Loan 2013], 8.3). Eigenvalues
//! alone; absolute errors are some units in the last place of the largest. Where eigenvectors are wanted, nalgebra has them.

use nalgebra::DMatrix;

/// Most QL steps per eigenvalue; two are usual.
const MOST_STEPS: usize = 60;

/// Eigenvalues of the symmetric matrix `A` (n×n, lower triangle read, destroyed), unsorted, into `d` (n).
///
/// * `e`: n numbers of workspace.
///
/// Returns false where the iteration does not end, as with entries that are no numbers.
pub(crate) fn symmetric_eigenvalues(A: &mut DMatrix<f64>, d: &mut [f64], e: &mut [f64]) -> bool {
    tridiagonalise(A, d, e);
    // About one, so that squares neither overflow nor vanish.
    let largest = d.iter().chain(e.iter()).fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest > 0.0 && largest.is_finite() {
        d.iter_mut().chain(e.iter_mut()).for_each(|x| *x /= largest);
    }
    let ends = ql(d, e);
    if largest > 0.0 && largest.is_finite() {
        d.iter_mut().for_each(|x| *x *= largest);
    }
    ends
}

/// Diagonal into `d`, subdiagonal into `e[..n-1]`, `e[n-1] = 0`.
fn tridiagonalise(A: &mut DMatrix<f64>, d: &mut [f64], e: &mut [f64]) {
    let n = A.nrows();
    let w = &mut *e;
    for k in 0..n.saturating_sub(2) {
        // v = x - α e_1 below the diagonal of column k; H = 1 - 2 v vᵀ / vᵀv makes it (α, 0, 0, ...).
        let norm = A.view((k + 1, k), (n - k - 1, 1)).norm();
        if norm == 0.0 {
            continue;
        }
        let alpha = -norm.copysign(A[(k + 1, k)]);
        A[(k + 1, k)] -= alpha;
        let square = 2.0 * norm * (norm + (A[(k + 1, k)] + alpha).abs());
        let half = 0.5 * square;
        // p = A v / (vᵀv / 2);  w = p - v (pᵀv) / vᵀv;  A -= v wᵀ + w vᵀ
        let mut pv = 0.0;
        for i in k + 1..n {
            let row: f64 = (k + 1..=i).map(|j| A[(i, j)] * A[(j, k)]).sum();
            let column: f64 = (i + 1..n).map(|j| A[(j, i)] * A[(j, k)]).sum();
            w[i] = (row + column) / half;
            pv += w[i] * A[(i, k)];
        }
        for i in k + 1..n {
            w[i] -= A[(i, k)] * pv / square;
        }
        for j in k + 1..n {
            let (v_j, w_j) = (A[(j, k)], w[j]);
            for i in j..n {
                let v_i = A[(i, k)];
                A[(i, j)] -= v_i * w_j + w[i] * v_j;
            }
        }
        A[(k + 1, k)] = alpha;
    }
    for i in 0..n {
        d[i] = A[(i, i)];
        e[i] = if i + 1 < n { A[(i + 1, i)] } else { 0.0 };
    }
}

/// Eigenvalues of a tridiagonal matrix, in place of its diagonal.
fn ql(d: &mut [f64], e: &mut [f64]) -> bool {
    let n = d.len();
    for l in 0..n {
        for step in 0.. {
            // The block l..=m that has not fallen apart.
            let small = |m: usize| e[m].abs() <= f64::EPSILON * (d[m].abs() + d[m + 1].abs());
            let m = (l..n - 1).find(|m| small(*m)).unwrap_or(n - 1);
            if m == l {
                break;
            }
            if step == MOST_STEPS {
                return false;
            }
            // Wilkinson's shift, then rotations that chase the bulge from the bottom up.
            let mut g = (d[l + 1] - d[l]) / (2.0 * e[l]);
            g = d[m] - d[l] + e[l] / (g + (g * g + 1.0).sqrt().copysign(g));
            let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
            let mut whole = true;
            for i in (l..m).rev() {
                let (f, b) = (s * e[i], c * e[i]);
                let r = (f * f + g * g).sqrt();
                e[i + 1] = r;
                if r == 0.0 {
                    d[i + 1] -= p;
                    whole = false;
                    break;
                }
                (s, c) = (f / r, g / r);
                g = d[i + 1] - p;
                let t = (d[i] - g) * s + 2.0 * c * b;
                p = s * t;
                d[i + 1] = g + p;
                g = c * t - b;
            }
            if whole {
                d[l] -= p;
                e[l] = g;
            }
            e[m] = 0.0;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn eigenvalues(A: &DMatrix<f64>) -> Vec<f64> {
        let n = A.nrows();
        let (mut d, mut e) = (vec![0.0; n], vec![0.0; n]);
        assert!(symmetric_eigenvalues(&mut A.clone(), &mut d, &mut e));
        d.sort_by(f64::total_cmp);
        d
    }

    /// Truth: nalgebra's eigenvalues. Measured: 6e-15 of the largest.
    #[test]
    fn eigenvalues_are_those_of_nalgebra() {
        proptest!(|(n in 1_usize..24, seed in proptest::collection::vec(-1.0_f64..1.0, 600), rank in 1_usize..24)| {
            // Full and defective rank, equal eigenvalues.
            let B = DMatrix::from_fn(n, n, |i, j| if j < rank { seed[i * 24 + j] } else { 0.0 });
            let A = &B * B.transpose();
            let mut truth: Vec<f64> = A.clone().symmetric_eigenvalues().iter().copied().collect();
            truth.sort_by(f64::total_cmp);
            let largest = truth[n - 1].abs().max(f64::MIN_POSITIVE);
            for (found, truth) in eigenvalues(&A).iter().zip(&truth) {
                prop_assert!((found - truth).abs() < 1e-13 * largest, "{found:e} {truth:e}");
            }
        });
    }

    #[test]
    fn diagonal_and_empty_matrices_have_theirs() {
        assert_eq!(eigenvalues(&DMatrix::from_diagonal(&vec![3.0, -1.0, 2.0].into())), [-1.0, 2.0, 3.0]);
        assert_eq!(eigenvalues(&DMatrix::zeros(0, 0)), [0.0; 0]);
        let mut wrong = DMatrix::from_element(3, 3, f64::NAN);
        assert!(!symmetric_eigenvalues(&mut wrong, &mut [0.0; 3], &mut [0.0; 3]));
    }
}
