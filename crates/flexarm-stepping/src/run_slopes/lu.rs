//! A square system that is factored and solved in place, again and again. Not here: systems that are symmetric.

use nalgebra::{DMatrix, DMatrixViewMut};

use crate::error::StepError;

/// `P A = L U`.
#[derive(Clone, Debug)]
pub(super) struct Lu {
    /// Both factors in one.
    pub(super) A: DMatrix<f64>,
    rows: Vec<usize>,
}

impl Lu {
    /// Room for n unknowns.
    pub(super) fn new(n: usize) -> Self {
        Self { A: DMatrix::zeros(n, n), rows: vec![0; n] }
    }

    /// Factors what stands in `A`.
    ///
    /// # Errors
    /// [`StepError::Singular`] of the matrix of this name.
    pub(super) fn factor(&mut self, matrix: &'static str, t: f64) -> Result<(), StepError> {
        let n = self.A.nrows();
        for k in 0..n {
            let column = self.A.column(k);
            let pivot = (k..n).fold(k, |best, i| if column[i].abs() > column[best].abs() { i } else { best });
            let head = self.A[(pivot, k)];
            if !(head.is_finite() && head != 0.0) {
                return Err(StepError::Singular { matrix, t });
            }
            self.rows[k] = pivot;
            self.A.swap_rows(k, pivot);
            self.A.column_mut(k).rows_range_mut(k + 1..).scale_mut(1.0 / head);
            for j in k + 1..n {
                let (from, mut to) = self.A.columns_range_pair_mut(k, j);
                let factor = -to[k];
                to.rows_range_mut(k + 1..).axpy(factor, &from.rows_range(k + 1..), 1.0);
            }
        }
        Ok(())
    }

    /// Replaces the columns of `B` by `A^-1 B`.
    pub(super) fn solve(&self, mut B: DMatrixViewMut<'_, f64>) {
        let n = self.A.nrows();
        for mut b in B.column_iter_mut() {
            for (k, row) in self.rows.iter().enumerate() {
                b.swap_rows(k, *row);
            }
            for k in 0..n {
                let factor = -b[k];
                b.rows_range_mut(k + 1..).axpy(factor, &self.A.column(k).rows_range(k + 1..), 1.0);
            }
            for k in (0..n).rev() {
                b[k] /= self.A[(k, k)];
                let factor = -b[k];
                b.rows_range_mut(..k).axpy(factor, &self.A.column(k).rows_range(..k), 1.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the product with the solution. 2e-14.
    #[test]
    fn a_system_without_a_leading_pivot_is_solved() {
        let n = 7;
        let A = DMatrix::from_fn(n, n, |i, j| if i == j { 0.0 } else { ((3 * i + 5 * j) % 7) as f64 - 2.5 });
        let B = DMatrix::from_fn(n, 3, |i, j| (i as f64 - 2.0) * (j as f64 + 0.5));
        let mut lu = Lu::new(n);
        lu.A.copy_from(&A);
        lu.factor("test", 0.0).unwrap();
        let mut X = B.clone();
        lu.solve(X.as_view_mut());
        assert!((A * X - B).amax() < 1e-12);
    }
}
