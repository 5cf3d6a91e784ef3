//! LU factorisation of a square system in reusable storage. Not here: symmetric systems.

use nalgebra::DMatrix;

use crate::error::StepError;

/// `P A = L U`.
#[derive(Clone, Debug)]
pub struct Lu {
    /// Both factors in one matrix.
    pub A: DMatrix<f64>,
    rows: Vec<usize>,
}

impl Lu {
    /// Allocates storage for n unknowns.
    pub fn new(n: usize) -> Self {
        Self { A: DMatrix::zeros(n, n), rows: vec![0; n] }
    }

    /// Factorises `A` in place.
    ///
    /// # Errors
    /// [`StepError::Singular`] with the name `matrix`.
    pub fn factor(&mut self, matrix: &'static str, t: f64) -> Result<(), StepError> {
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

    /// Replaces the rows of `B` (p × n) by the solutions: `Bᵀ` by `A^-1 Bᵀ`.
    pub fn solve_transposed(&self, B: &mut DMatrix<f64>) {
        let p = B.nrows();
        if p == 0 {
            return;
        }
        for (k, row) in self.rows.iter().enumerate() {
            B.swap_columns(k, *row);
        }
        let (A, B, n) = (&self.A, B.as_mut_slice(), self.A.nrows());
        for (k, factors) in A.as_slice().chunks_exact(n).enumerate() {
            let (inner, outer) = B.split_at_mut((k + 1) * p);
            subtract(&inner[k * p..], &factors[k + 1..], outer);
        }
        for (k, factors) in A.as_slice().chunks_exact(n).enumerate().rev() {
            let (outer, inner) = B.split_at_mut(k * p);
            let (scale, own) = (1.0 / factors[k], &mut inner[..p]);
            own.iter_mut().for_each(|x| *x *= scale);
            subtract(own, &factors[..k], outer);
        }
    }
}

/// Subtracts multiples of one column from others.
#[inline]
fn subtract(from: &[f64], factors: &[f64], others: &mut [f64]) {
    for (to, factor) in others.chunks_exact_mut(from.len()).zip(factors) {
        to.iter_mut().zip(from).for_each(|(to, x)| *to -= factor * x);
    }
}
