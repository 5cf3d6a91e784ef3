//! Forward and backward substitution through a supernodal factor, eight right-hand sides at a time.
//!
//! ```text
//! L y = b:   y_J = L_JJ⁻¹ b_J,   b_I -= L_IJ y_J          J: columns of a supernode, I: the rows below its block
//! Lᵀ x = y:  x_J = L_JJ⁻ᵀ (y_J - L_IJᵀ x_I)               in reverse
//! ```
//! Each pass reads the factor once, four columns of a supernode at a time, which is what it costs: the factor does not fit into
//! a cache. Libraries take the right-hand sides column by column and lose most of the time to packing.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use flexarm_spatial::Real;

use super::block::Row;
use super::vectors::{Wide, Work, quickly};

/// Replaces `x`, in the order of elimination, by `L⁻ᵀ L⁻¹ x`.
pub(super) fn solve(symbolic: &SymbolicSupernodalCholesky<u32>, values: &[f64], x: &mut [Row]) {
    quickly(Solve { symbolic, values, x });
}

struct Solve<'a> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [f64],
    x: &'a mut [Row],
}

/// Columns of a supernode, their entries by columns of `height` (the triangle, then the rows below), and those rows.
struct Supernode<'a> {
    first: usize,
    width: usize,
    height: usize,
    entries: &'a [f64],
    below: &'a [u32],
}

impl Solve<'_> {
    #[inline(always)]
    fn supernode(&self, s: usize) -> Supernode<'_> {
        let node = self.symbolic.supernode(s);
        let (first, below) = (node.start(), node.pattern());
        let width = self.symbolic.supernode_end()[s] as usize - first;
        let height = width + below.len();
        let start = self.symbolic.col_ptr_for_val()[s] as usize;
        Supernode { first, width, height, entries: &self.values[start..][..width * height], below }
    }
}

impl Work for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<T: Real, const P: usize>(mut self) {
        let count = self.symbolic.n_supernodes();
        let x = std::mem::take(&mut self.x);
        let mut rows = Vec::new();
        for s in 0..count {
            let node = self.supernode(s);
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
            let node = self.supernode(s);
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
    /// Row of the right-hand sides of each row of this supernode.
    #[inline(always)]
    fn rows_into(&self, rows: &mut Vec<u32>) {
        rows.clear();
        rows.extend(self.first as u32..(self.first + self.width) as u32);
        rows.extend_from_slice(self.below);
    }

    /// Entries of `N` columns from column `k` on, from row `from` on.
    #[inline(always)]
    fn columns<const N: usize>(&self, k: usize, from: usize) -> [&'a [f64]; N] {
        let mut columns = [&self.entries[..0]; N];
        for (c, column) in columns.iter_mut().enumerate() {
            *column = &self.entries[(k + c) * self.height + from..][..self.height - from];
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

/// Solves for `N` columns from column `k` on and takes them out of the rows below.
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

/// Takes the rows below out of `N` columns from column `k` on and solves for them.
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
