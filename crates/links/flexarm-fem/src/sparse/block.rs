//! Blocks of up to eight tall columns, the format for right-hand sides, mass products and bases.
//!
//! A row is one cache line. An entry of a matrix that is read once serves all eight columns, and
//! their numbers go through the vector units together. Sums run over the rows in order, the same on
//! every machine. Not here: products of tall nalgebra matrices (`dense`).

use flexarm_spatial::Real;
use nalgebra::DMatrix;

use super::vectors::{Wide, Work, quickly};

/// Number of columns of a block.
pub(crate) const WIDTH: usize = 8;

/// Number of rows processed together so that they stay in the first-level cache.
const PANEL: usize = 256;

/// One row of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Row(pub [f64; WIDTH]);

impl Row {
    /// Row of zeros.
    pub(crate) const ZERO: Self = Self([0.0; WIDTH]);
}

/// Small matrix over the columns of two blocks, by rows.
pub(super) type Small = [Row; WIDTH];

/// Tall columns; those from `width` on are zero.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    /// Rows of all columns.
    pub rows: Vec<Row>,
    /// Number of columns in use.
    pub width: usize,
}

impl Block {
    /// Creates a block of zeros.
    ///
    /// # Panics
    /// If `width` exceeds [`WIDTH`].
    pub(crate) fn zeros(rows: usize, width: usize) -> Self {
        assert!(width <= WIDTH, "a block has at most {WIDTH} columns");
        Self { rows: vec![Row::ZERO; rows], width }
    }

    /// Copies the columns `first..first + width` of a tall matrix.
    pub(crate) fn of_columns(X: &DMatrix<f64>, first: usize, width: usize) -> Self {
        let mut block = Self::zeros(X.nrows(), width);
        block.set_columns(X, first);
        block
    }

    /// Copies columns of a tall matrix, from `first` on, into the columns in use.
    pub(crate) fn set_columns(&mut self, X: &DMatrix<f64>, first: usize) {
        for k in 0..self.width {
            let column = &X.as_slice()[(first + k) * X.nrows()..][..X.nrows()];
            self.rows.iter_mut().zip(column).for_each(|(row, x)| row.0[k] = *x);
        }
    }

    /// Copies the columns in use into a tall matrix, from column `first` on.
    pub(crate) fn put_columns(&self, X: &mut DMatrix<f64>, first: usize) {
        let n = X.nrows();
        for k in 0..self.width {
            let column = &mut X.as_mut_slice()[(first + k) * n..][..n];
            self.rows.iter().zip(column).for_each(|(row, x)| *x = row.0[k]);
        }
    }

    /// Computes `selfᵀ other`.
    pub(crate) fn gram(&self, other: &Self) -> DMatrix<f64> {
        grams(std::slice::from_ref(self), other)
    }

    /// Computes `self -= other C`.
    pub(crate) fn subtract_product(&mut self, other: &Self, C: &DMatrix<f64>) {
        subtract_products(self, std::slice::from_ref(other), C);
    }

    /// Computes `self <- self C`, with the number of columns of C.
    pub(crate) fn multiply(&mut self, C: &DMatrix<f64>) {
        let C_small = small(C, 0, self.width);
        quickly(Multiply { X: &mut self.rows, C: &C_small });
        self.width = C.ncols();
    }
}

/// Computes `[V_1 V_2 ...]ᵀ X`.
pub(crate) fn grams(basis: &[Block], X: &Block) -> DMatrix<f64> {
    let sums = quickly(Grams { basis, X: &X.rows });
    let rows: usize = basis.iter().map(|V| V.width).sum();
    let mut result = DMatrix::zeros(rows, X.width);
    let mut row = 0;
    for (V, sum) in basis.iter().zip(&sums) {
        for i in 0..V.width {
            for j in 0..X.width {
                result[(row + i, j)] = sum[i].0[j];
            }
        }
        row += V.width;
    }
    result
}

/// Computes `X -= [V_1 V_2 ...] C`.
pub(crate) fn subtract_products(X: &mut Block, basis: &[Block], C: &DMatrix<f64>) {
    quickly(SubtractProducts { X: &mut X.rows, first: 0, basis, factors: &basis_factors(basis, C) });
}

/// Rows of C for each block of a basis.
fn basis_factors(basis: &[Block], C: &DMatrix<f64>) -> Vec<Small> {
    let mut row = 0;
    let of = |V: &Block| {
        row += V.width;
        small(C, row - V.width, V.width)
    };
    basis.iter().map(of).collect()
}

/// Computes combinations `[V_1 V_2 ...] C` of a basis, each of at most eight columns. They
/// overwrite the basis, because both together would need much more memory.
pub(crate) fn combine(basis: &mut Vec<Block>, combinations: &[DMatrix<f64>]) {
    let rows = basis.first().map_or(0, |V| V.rows.len());
    let factors: Vec<_> = combinations.iter().map(|C| basis_factors(basis, &-C)).collect();
    let mut combined = vec![[Row::ZERO; PANEL]; factors.len()];
    while basis.len() < factors.len() {
        basis.push(Block::zeros(rows, 0));
    }
    for first in (0..rows).step_by(PANEL) {
        let count = PANEL.min(rows - first);
        for (X, factors) in combined.iter_mut().zip(&factors) {
            X.fill(Row::ZERO);
            quickly(SubtractProducts { X: &mut X[..count], first, basis, factors });
        }
        for (V, X) in basis.iter_mut().zip(&combined) {
            V.rows[first..][..count].copy_from_slice(&X[..count]);
        }
    }
    basis.truncate(factors.len());
    basis.iter_mut().zip(combinations).for_each(|(V, C)| V.width = C.ncols());
}

/// Rows `first..first + count` of C, padded with zeros.
fn small(C: &DMatrix<f64>, first: usize, count: usize) -> Small {
    let entry = |i: usize, j: usize| if i < count && j < C.ncols() { C[(first + i, j)] } else { 0.0 };
    std::array::from_fn(|i| Row(std::array::from_fn(|j| entry(i, j))))
}

/// Products `V_kᵀ X` of several blocks with one.
struct Grams<'a> {
    basis: &'a [Block],
    X: &'a [Row],
}

impl Work for Grams<'_> {
    type Output = Vec<Small>;

    #[inline(always)]
    fn run<T: Real, const P: usize>(self) -> Vec<Small> {
        let mut sums = vec![[Row::ZERO; WIDTH]; self.basis.len()];
        for (panel, x) in self.X.chunks(PANEL).enumerate() {
            for (V, sum) in self.basis.iter().zip(&mut sums) {
                let v = &V.rows[panel * PANEL..][..x.len()];
                // Four rows of the result at a time stay in registers.
                add_gram::<T, P, 0>(v, x, sum);
                add_gram::<T, P, 4>(v, x, sum);
            }
        }
        sums
    }
}

/// Adds rows `FIRST` to `FIRST + 3` of `vᵀ x` to `sum`.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "indices keep the vectors in registers")]
fn add_gram<T: Real, const P: usize, const FIRST: usize>(v: &[Row], x: &[Row], sum: &mut Small) {
    let mut part = [Wide::<T, P>::zero(); 4];
    for (v, x) in v.iter().zip(x) {
        let x = Wide::<T, P>::load(x);
        for i in 0..4 {
            part[i].add(v.0[FIRST + i], x);
        }
    }
    for i in 0..4 {
        let sum = &mut sum[FIRST + i];
        let mut total = Wide::<T, P>::load(sum);
        total.add(1.0, part[i]);
        total.store(sum);
    }
}

struct SubtractProducts<'a> {
    X: &'a mut [Row],
    /// Row of the basis where X starts.
    first: usize,
    basis: &'a [Block],
    factors: &'a [Small],
}

impl Work for SubtractProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn run<T: Real, const P: usize>(self) {
        for (panel, x) in self.X.chunks_mut(PANEL).enumerate() {
            for (V, C) in self.basis.iter().zip(self.factors) {
                let v = &V.rows[self.first + panel * PANEL..][..x.len()];
                subtract::<T, P, 0>(x, v, C);
                subtract::<T, P, 4>(x, v, C);
            }
        }
    }
}

/// Computes `x -= v C` for the columns `FIRST` to `FIRST + 3` of v.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "indices keep the vectors in registers")]
fn subtract<T: Real, const P: usize, const FIRST: usize>(x: &mut [Row], v: &[Row], C: &Small) {
    let mut factors = [Wide::<T, P>::zero(); 4];
    for i in 0..4 {
        factors[i] = Wide::<T, P>::load(&C[FIRST + i]);
    }
    for (x, v) in x.iter_mut().zip(v) {
        let mut sum = Wide::<T, P>::load(x);
        for i in 0..4 {
            sum.subtract(v.0[FIRST + i], factors[i]);
        }
        sum.store(x);
    }
}

struct Multiply<'a> {
    X: &'a mut [Row],
    C: &'a Small,
}

impl Work for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn run<T: Real, const P: usize>(self) {
        for x in self.X {
            let mut sum = Wide::<T, P>::zero();
            for i in 0..WIDTH {
                sum.add(x.0[i], Wide::<T, P>::load(&self.C[i]));
            }
            sum.store(x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(X: &Block) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(X.rows.len(), X.width);
        X.put_columns(&mut columns, 0);
        columns
    }

    #[test]
    fn products_of_blocks_are_those_of_their_matrices() {
        let n = 2 * PANEL + 17;
        let matrix =
            |columns, seed: f64| DMatrix::from_fn(n, columns, |i, j| (seed * (i * 7 + j * 3 + 1) as f64).sin());
        let (A, B, X) = (matrix(8, 0.3), matrix(3, 0.7), matrix(6, 1.1));
        let basis = [Block::of_columns(&A, 0, 8), Block::of_columns(&B, 0, 3)];
        let mut x = Block::of_columns(&X, 0, 6);
        let AB = DMatrix::from_fn(n, 11, |i, j| if j < 8 { A[(i, j)] } else { B[(i, j - 8)] });
        let C = grams(&basis, &x);
        assert!((&C - AB.transpose() * &X).amax() < 1e-11); // measured 2e-13
        subtract_products(&mut x, &basis, &C);
        let expected = &X - &AB * &C;
        assert!((columns(&x) - &expected).amax() < 1e-12 * expected.amax().max(1e3));
        assert!(x.rows.iter().all(|row| row.0[6..] == [0.0; 2]));
        let mut blocks = basis.to_vec();
        combine(&mut blocks, &[C.clone(), C.columns(1, 3).into_owned(), C.columns(2, 1).into_owned()]);
        assert_eq!(blocks.iter().map(|V| V.width).collect::<Vec<_>>(), [6, 3, 1]);
        assert!((columns(&blocks[0]) - &AB * &C).amax() < 1e-12 * (&AB * &C).amax());
        assert!((columns(&blocks[2]) - &AB * C.columns(2, 1)).amax() < 1e-12 * (&AB * &C).amax());
        x.multiply(&C.transpose().columns(0, 5).into_owned());
        let expected = expected * C.transpose().columns(0, 5);
        assert!((columns(&x) - &expected).amax() < 1e-13 * expected.amax());
    }
}
