//! Dense Cholesky solve that reuses its memory.

/// Workspace of a Cholesky solve; the solution is NaN if the matrix is not positive definite.
#[derive(Clone, Debug, Default)]
pub(super) struct CholeskyWorkspace {
    L: Vec<f64>,
    pub(super) right: Vec<f64>,
}

impl CholeskyWorkspace {
    pub(super) fn fit(&mut self, n: usize) {
        self.L.resize(n * n, 0.0);
        self.right.resize(n, 0.0);
    }

    /// Solves in place in `right`; `entry` returns the entries of a symmetric matrix.
    pub(super) fn solve(&mut self, entry: impl Fn(usize, usize) -> f64) {
        let n = self.right.len();
        let (L, x) = (&mut self.L, &mut self.right);
        for i in 0..n {
            for j in 0..=i {
                let inner: f64 = (0..j).map(|k| L[i * n + k] * L[j * n + k]).sum();
                let rest = entry(i, j) - inner;
                L[i * n + j] = if i == j { rest.sqrt() } else { rest / L[j * n + j] };
            }
            let inner: f64 = (0..i).map(|k| L[i * n + k] * x[k]).sum();
            x[i] = (x[i] - inner) / L[i * n + i];
        }
        for i in (0..n).rev() {
            let inner: f64 = (i + 1..n).map(|k| L[k * n + i] * x[k]).sum();
            x[i] = (x[i] - inner) / L[i * n + i];
        }
    }
}
