//! Symmetric sparse matrix: lower triangle by columns, pattern shared between stiffness and mass.
//!
//! Start at [`SparseSymmetric::from_triplets`] or [`SparseSymmetric::zeros`], then
//! [`SparseSymmetric::product`]. Indices are 32 bit.
//!
//! Not here: mass of solids, which is one number per pair of nodes ([`crate::model::MassMatrix`]).

use std::sync::Arc;

use flexarm_spatial::Real;
use nalgebra::DMatrix;

use super::block::{Block, Row, WIDTH};
use super::vectors::{Wide, Work, quickly};

/// Positions of the entries of a lower triangle, by columns; rows ascend within a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Start of each column in `rows`; one more entry than columns.
    pub starts: Vec<u32>,
    /// Row of each entry, at least its column.
    pub rows: Vec<u32>,
}

impl Pattern {
    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// Range of the entries of column `j`.
    pub fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.starts[j] as usize..self.starts[j + 1] as usize
    }

    /// Index of the entry (`i`, `j`), `i >= j`, if it is in the pattern.
    pub fn find(&self, i: usize, j: usize) -> Option<usize> {
        let column = self.column(j);
        let found = self.rows[column.clone()].binary_search(&(i as u32)).ok()?;
        Some(column.start + found)
    }
}

/// Symmetric matrix stored as its lower triangle.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseSymmetric {
    pattern: Arc<Pattern>,
    /// Value of each entry of the pattern.
    pub values: Vec<f64>,
}

impl SparseSymmetric {
    /// Zero matrix with room for the entries of `pattern`.
    pub fn zeros(pattern: Arc<Pattern>) -> Self {
        let values = vec![0.0; pattern.rows.len()];
        Self { pattern, values }
    }

    /// Creates a matrix from entries of the lower triangle in any order; duplicates are summed.
    ///
    /// # Panics
    /// If an entry is out of range or above the diagonal, which is an error of the caller.
    pub fn from_triplets(size: usize, triplets: &[(u32, u32, f64)]) -> Self {
        // Counting sort by column, then each short column by row.
        let mut starts = vec![0_u32; size + 1];
        for (row, column, _) in triplets {
            assert!(
                column <= row && (*row as usize) < size,
                "entry ({row}, {column}) is not in a lower triangle of {size}"
            );
            starts[*column as usize + 1] += 1;
        }
        for j in 0..size {
            starts[j + 1] += starts[j];
        }
        let mut next = starts.clone();
        let mut sorted = vec![(0_u32, 0.0); triplets.len()];
        for (row, column, value) in triplets {
            let place = &mut next[*column as usize];
            sorted[*place as usize] = (*row, *value);
            *place += 1;
        }
        let (mut rows, mut values, mut compact) = (Vec::new(), Vec::new(), vec![0_u32; size + 1]);
        for j in 0..size {
            let column = &mut sorted[starts[j] as usize..starts[j + 1] as usize];
            column.sort_by_key(|(row, _)| *row);
            for (row, value) in column.iter() {
                if rows.len() > compact[j] as usize && rows.last() == Some(row) {
                    let last = values.len() - 1;
                    values[last] += value;
                } else {
                    rows.push(*row);
                    values.push(*value);
                }
            }
            compact[j + 1] = rows.len() as u32;
        }
        Self { pattern: Arc::new(Pattern { starts: compact, rows }), values }
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.pattern.size()
    }

    /// Pattern of the entries.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Number of stored entries: the lower triangle with the diagonal.
    pub fn stored(&self) -> usize {
        self.values.len()
    }

    /// Diagonal entries.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.size()).map(|j| self.pattern.find(j, j).map_or(0.0, |at| self.values[at])).collect()
    }

    /// Computes the product `A X`.
    ///
    /// # Panics
    /// If `X` does not have [`Self::size`] rows.
    pub fn product(&self, X: &DMatrix<f64>) -> DMatrix<f64> {
        let mut Y = DMatrix::zeros(X.nrows(), X.ncols());
        self.product_into(X, &mut Y);
        Y
    }

    /// Computes `Y = A X`.
    ///
    /// # Panics
    /// If the shapes do not match.
    pub(crate) fn product_into(&self, X: &DMatrix<f64>, Y: &mut DMatrix<f64>) {
        let n = self.size();
        assert!(
            X.nrows() == n && Y.shape() == X.shape(),
            "product of {n} rows with {:?} and {:?}",
            X.shape(),
            Y.shape()
        );
        if X.ncols() == 1 {
            Y.fill(0.0);
            return self.add_vector_product(X.as_slice(), Y.as_mut_slice());
        }
        for first in (0..X.ncols()).step_by(WIDTH) {
            let x = Block::of_columns(X, first, WIDTH.min(X.ncols() - first));
            let mut y = Block::zeros(n, x.width);
            self.add_block_product(&x, &mut y);
            y.put_columns(Y, first);
        }
    }

    /// Computes `y += A x`.
    fn add_vector_product(&self, x: &[f64], y: &mut [f64]) {
        for j in 0..self.size() {
            let entries = self.pattern.column(j);
            let (mut sum, x_j) = (0.0, x[j]);
            for (row, value) in self.pattern.rows[entries.clone()].iter().zip(&self.values[entries]) {
                let i = *row as usize;
                // The diagonal entry is only added through `sum`, otherwise it would count twice.
                if i != j {
                    y[i] += value * x_j;
                }
                sum += value * x[i];
            }
            y[j] += sum;
        }
    }

    /// Computes `Y += A X`; each column is bitwise equal to the product of that column alone.
    ///
    /// # Panics
    /// If the shapes do not match.
    pub(crate) fn add_block_product(&self, X: &Block, Y: &mut Block) {
        assert!(X.rows.len() == self.size() && Y.rows.len() == self.size(), "blocks of another size");
        quickly(BlockProduct { A: self, X: &X.rows, Y: &mut Y.rows });
    }

    /// Extracts the rows and columns in `keep` (ascending), in that order.
    pub(crate) fn submatrix(&self, keep: &[u32]) -> Self {
        let mut position = vec![u32::MAX; self.size()];
        for (new, old) in keep.iter().enumerate() {
            position[*old as usize] = new as u32;
        }
        let mut starts = Vec::with_capacity(keep.len() + 1);
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        starts.push(0);
        for old in keep {
            for entry in self.pattern.column(*old as usize) {
                let row = position[self.pattern.rows[entry] as usize];
                if row != u32::MAX {
                    rows.push(row);
                    values.push(self.values[entry]);
                }
            }
            starts.push(rows.len() as u32);
        }
        Self { pattern: Arc::new(Pattern { starts, rows }), values }
    }
}

struct BlockProduct<'a> {
    A: &'a SparseSymmetric,
    X: &'a [Row],
    Y: &'a mut [Row],
}

impl Work for BlockProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<T: Real, const P: usize>(self) {
        // Entry (i, j) of the lower triangle serves rows i and j.
        for j in 0..self.A.size() {
            let entries = self.A.pattern.column(j);
            let (mut sum, x_j) = (Wide::<T, P>::zero(), Wide::<T, P>::load(&self.X[j]));
            for (row, value) in self.A.pattern.rows[entries.clone()].iter().zip(&self.A.values[entries]) {
                let i = *row as usize;
                if i != j {
                    let mut y = Wide::<T, P>::load(&self.Y[i]);
                    y.add(*value, x_j);
                    y.store(&mut self.Y[i]);
                }
                sum.add(*value, Wide::<T, P>::load(&self.X[i]));
            }
            let mut y = Wide::<T, P>::load(&self.Y[j]);
            y.add(1.0, sum);
            y.store(&mut self.Y[j]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (SparseSymmetric, DMatrix<f64>) {
        let triplets = [(0, 0, 4.0), (2, 0, -1.0), (1, 1, 3.0), (2, 1, 0.5), (2, 2, 4.0), (2, 2, 1.0), (3, 3, 2.0)];
        let dense = DMatrix::from_row_slice(
            4,
            4,
            &[4.0, 0.0, -1.0, 0.0, 0.0, 3.0, 0.5, 0.0, -1.0, 0.5, 5.0, 0.0, 0.0, 0.0, 0.0, 2.0],
        );
        (SparseSymmetric::from_triplets(4, &triplets), dense)
    }

    #[test]
    fn the_product_is_that_of_the_full_matrix() {
        let (A, dense) = sample();
        let X = DMatrix::from_fn(4, 3, |i, j| (i as f64 + 1.0) * (j as f64 - 0.7));
        assert!((A.product(&X) - dense * X).amax() < 1e-14);
    }

    #[test]
    fn a_submatrix_keeps_rows_and_columns() {
        let (A, dense) = sample();
        let part = A.submatrix(&[0, 2, 3]);
        let identity = DMatrix::identity(3, 3);
        let expected = dense.select_rows(&[0, 2, 3]).select_columns(&[0, 2, 3]);
        assert_eq!(part.product(&identity), expected);
        assert_eq!(part.diagonal(), [4.0, 5.0, 2.0]);
    }
}
