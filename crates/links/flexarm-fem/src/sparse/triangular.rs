//! Forward and backward substitution through a supernodal factor, eight right-hand sides at a time.
//!
//! ```text
//! L y = b:   y_J = L_JJ⁻¹ b_J,   b_I -= L_IJ y_J          J: columns of a supernode, I: the rows below its block
//! Lᵀ x = y:  x_J = L_JJ⁻ᵀ (y_J - L_IJᵀ x_I)               in reverse
//! ```
//! Each pass reads the factor once, four columns of a supernode at a time. This read dominates the
//! cost, because the factor does not fit into a cache. Libraries take the right-hand sides column
//! by column and lose most of the time to packing.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use flexarm_spatial::Real;

use super::block::Row;
use super::vectors::{Wide, Work, quickly};

/// Columns of a factor from the diagonal down, by supernode.
#[derive(Default)]
pub(super) struct Columns {
    pub(super) values: Vec<f64>,
    /// Start of each supernode in `values`.
    starts: Vec<usize>,
}

/// Columns of a supernode (the triangle, then the rows below), and the indices of these rows.
pub(super) struct Supernode<'a> {
    pub(super) first: usize,
    pub(super) width: usize,
    height: usize,
    pub(super) entries: &'a [f64],
    below: &'a [u32],
}

impl Columns {
    /// Removes the entries above the diagonal, an eighth of the total, from the blocks of a
    /// factorisation.
    pub(super) fn of_blocks(symbolic: &SymbolicSupernodalCholesky<u32>, mut values: Vec<f64>) -> Self {
        let mut starts = Vec::with_capacity(symbolic.n_supernodes());
        let mut to = 0;
        for s in 0..symbolic.n_supernodes() {
            starts.push(to);
            let width = (symbolic.supernode_end()[s] - symbolic.supernode_begin()[s]) as usize;
            let height = width + symbolic.supernode(s).pattern().len();
            for k in 0..width {
                let from = symbolic.col_ptr_for_val()[s] as usize + k * height + k;
                values.copy_within(from..from + height - k, to);
                to += height - k;
            }
        }
        values.truncate(to);
        values.shrink_to_fit();
        Self { values, starts }
    }

    #[inline(always)]
    pub(super) fn supernode<'a>(&'a self, symbolic: &'a SymbolicSupernodalCholesky<u32>, s: usize) -> Supernode<'a> {
        let node = symbolic.supernode(s);
        let (first, below) = (node.start(), node.pattern());
        let width = symbolic.supernode_end()[s] as usize - first;
        let height = width + below.len();
        let entries = &self.values[self.starts[s]..][..width * height - width * (width - 1) / 2];
        Supernode { first, width, height, entries, below }
    }
}

/// Replaces `x`, in elimination order, by `L⁻ᵀ L⁻¹ x`.
pub(super) fn solve(symbolic: &SymbolicSupernodalCholesky<u32>, columns: &Columns, x: &mut [Row]) {
    quickly(Solve { symbolic, columns, x });
}

struct Solve<'a> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    columns: &'a Columns,
    x: &'a mut [Row],
}

impl Work for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<T: Real, const P: usize>(mut self) {
        let count = self.symbolic.n_supernodes();
        let x = std::mem::take(&mut self.x);
        let mut rows = Vec::new();
        for s in 0..count {
            let node = self.columns.supernode(self.symbolic, s);
            node.rows_into(&mut rows);
            for k in (0..node.width).step_by(4) {
                match node.width - k {
                    1 => forward::<T, P, 1>(&node, k, &rows, x),
                    2 => forward::<T, P, 2>(&node, k, &rows, x),
                    3 => forward::<T, P, 3>(&node, k, &rows, x),
                    _ => forward::<T, P, 4>(&node, k, &rows, x),
                }
            }
        }
        for s in (0..count).rev() {
            let node = self.columns.supernode(self.symbolic, s);
            node.rows_into(&mut rows);
            for k in (0..node.width).step_by(4).rev() {
                match node.width - k {
                    1 => backward::<T, P, 1>(&node, k, &rows, x),
                    2 => backward::<T, P, 2>(&node, k, &rows, x),
                    3 => backward::<T, P, 3>(&node, k, &rows, x),
                    _ => backward::<T, P, 4>(&node, k, &rows, x),
                }
            }
        }
    }
}

impl<'a> Supernode<'a> {
    /// Writes the row of the right-hand sides of each row of this supernode to `rows`.
    #[inline(always)]
    fn rows_into(&self, rows: &mut Vec<u32>) {
        rows.clear();
        rows.extend(self.first as u32..(self.first + self.width) as u32);
        rows.extend_from_slice(self.below);
    }

    /// Start of column `k`, at its diagonal.
    #[inline(always)]
    pub(super) fn start_of(&self, k: usize) -> usize {
        k * (2 * self.height + 1 - k) / 2
    }

    /// Entries of `N` columns from column `k` on, from row `from` on; entries above the diagonal
    /// belong to other columns.
    #[inline(always)]
    fn columns<const N: usize>(&self, k: usize, from: usize) -> [&'a [f64]; N] {
        let mut columns = [&self.entries[..0]; N];
        for (c, column) in columns.iter_mut().enumerate() {
            *column = &self.entries[self.start_of(k + c) + from - (k + c)..][..self.height - from];
        }
        columns
    }
}

#[inline(always)]
fn load<T: Real, const P: usize, const N: usize>(x: &[Row]) -> [Wide<T, P>; N] {
    let mut wide = [Wide::<T, P>::zero(); N];
    for c in 0..N {
        wide[c] = Wide::<T, P>::load(&x[c]);
    }
    wide
}

#[inline(always)]
fn store<T: Real, const P: usize, const N: usize>(wide: [Wide<T, P>; N], x: &mut [Row]) {
    for c in 0..N {
        wide[c].store(&mut x[c]);
    }
}

/// Solves for `N` columns from column `k` on and subtracts them from the rows below.
#[inline(always)]
fn forward<T: Real, const P: usize, const N: usize>(node: &Supernode<'_>, k: usize, rows: &[u32], x: &mut [Row]) {
    let triangle: [&[f64]; N] = node.columns(k, k);
    let mut y: [Wide<T, P>; N] = load(&x[node.first + k..][..N]);
    for c in 0..N {
        y[c].scale(1.0 / triangle[c][c]);
        for i in c + 1..N {
            let solved = y[c];
            y[i].subtract(triangle[c][i], solved);
        }
    }
    store(y, &mut x[node.first + k..][..N]);
    let L: [&[f64]; N] = node.columns(k, k + N);
    for (i, row) in rows[k + N..node.height].iter().enumerate() {
        let row = &mut x[*row as usize];
        let mut sum = Wide::<T, P>::load(row);
        for c in 0..N {
            sum.subtract(L[c][i], y[c]);
        }
        sum.store(row);
    }
}

/// Subtracts the rows below from `N` columns from column `k` on and solves for the columns.
#[inline(always)]
fn backward<T: Real, const P: usize, const N: usize>(node: &Supernode<'_>, k: usize, rows: &[u32], x: &mut [Row]) {
    let mut y: [Wide<T, P>; N] = load(&x[node.first + k..][..N]);
    let L: [&[f64]; N] = node.columns(k, k + N);
    for (i, row) in rows[k + N..node.height].iter().enumerate() {
        let row = Wide::<T, P>::load(&x[*row as usize]);
        for c in 0..N {
            y[c].subtract(L[c][i], row);
        }
    }
    let triangle: [&[f64]; N] = node.columns(k, k);
    for c in (0..N).rev() {
        for i in c + 1..N {
            let solved = y[i];
            y[c].subtract(triangle[c][i], solved);
        }
        y[c].scale(1.0 / triangle[c][c]);
    }
    store(y, &mut x[node.first + k..][..N]);
}
