//! Sparse Cholesky factor: ordered, factorised once, used for many right-hand sides.

use std::fmt;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::Perm;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::{
    SymbolicSupernodalCholesky, factorize_supernodal_numeric_llt, factorize_supernodal_numeric_llt_scratch,
};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Par, Side, Spec};
use nalgebra::DMatrix;

use super::block::{Block, Row, WIDTH};
use super::ordering::{Ordering, nested_dissection};
use super::registers::clear_upper_halves;
use super::symmetric::SparseSymmetric;
use super::triangular::{self, Columns};

/// Memory alignment for faer, bytes.
const ALIGNED: usize = 64;

/// Size and cost of a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorFigures {
    /// Number of unknowns.
    pub size: usize,
    /// Number of stored entries of the lower triangle of the matrix.
    pub matrix_entries: usize,
    /// Number of stored entries of the factor, including zeros below the diagonal in its dense
    /// blocks.
    pub factor_entries: usize,
    /// Ordering used.
    pub ordering: Ordering,
}

/// Errors of a factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NotPositiveDefinite {
    /// A pivot is not positive.
    Pivot {
        /// Number of the unknown in the matrix.
        unknown: usize,
    },
    /// There is not enough memory for the factor.
    OutOfMemory {
        /// Number of entries required, if known.
        entries: usize,
    },
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pivot { unknown } => write!(f, "the matrix is not positive definite (pivot of unknown {unknown})"),
            Self::OutOfMemory { entries: 0 } => write!(f, "the factor is too large to be counted"),
            Self::OutOfMemory { entries } => write!(f, "no memory for a factor of {entries} entries"),
        }
    }
}

/// Factor `P K Pᵀ = L Lᵀ` of a sparse symmetric positive definite matrix.
pub struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    columns: Columns,
    figures: FactorFigures,
    smallest_pivot: (f64, usize),
}

impl fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cholesky").field("figures", &self.figures).finish_non_exhaustive()
    }
}

impl Cholesky {
    /// Factorises `K`. Takes `K` by value to free it early: it is a tenth of the memory of a
    /// factorisation.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`], with the unknown of the failing pivot.
    pub fn new(K: SparseSymmetric, ordering: Ordering) -> Result<Self, NotPositiveDefinite> {
        let (n, matrix_entries, diagonal) = (K.size(), K.stored(), K.diagonal());
        let (symbolic, ordering) = analyse(&K, ordering)?;
        let columns = match supernodes(&symbolic) {
            Some(supernodes) => {
                let ordered = in_order(&K, symbolic.perm().map(|perm| perm.arrays().1));
                drop(K);
                factorise(supernodes, &ordered)
            }
            None => Ok(Columns::default()),
        };
        let columns = columns.map_err(|error| match error {
            NotPositiveDefinite::Pivot { unknown } => {
                NotPositiveDefinite::Pivot { unknown: unknown_at(&symbolic, unknown) }
            }
            other => other,
        })?;
        let figures = FactorFigures { size: n, matrix_entries, factor_entries: columns.values.len(), ordering };
        let smallest_pivot = smallest_pivot(&symbolic, &columns, &diagonal);
        Ok(Self { symbolic, columns, figures, smallest_pivot })
    }

    /// Size and cost of the factor.
    pub fn figures(&self) -> FactorFigures {
        self.figures
    }

    /// Minimum pivot `L_jj²` relative to the diagonal entry of the matrix, and its unknown.
    ///
    /// Near rounding (1e-16 to 1e-12) if the matrix is singular and only passed because of the sign
    /// of a rounding error.
    pub fn smallest_pivot(&self) -> (f64, usize) {
        self.smallest_pivot
    }

    /// Replaces `B` by `K⁻¹ B`.
    ///
    /// # Panics
    /// If the number of rows of `B` is wrong.
    pub fn solve_in_place(&self, B: &mut DMatrix<f64>) {
        assert_eq!(B.nrows(), self.figures.size, "right-hand side of another size");
        for first in (0..B.ncols()).step_by(WIDTH) {
            let mut block = Block::of_columns(B, first, WIDTH.min(B.ncols() - first));
            self.solve_block(&mut block);
            block.put_columns(B, first);
        }
    }

    /// Replaces `B` by `K⁻¹ B`.
    ///
    /// # Panics
    /// If the number of rows of `B` is wrong.
    pub fn solve_block(&self, B: &mut Block) {
        assert_eq!(B.rows.len(), self.figures.size, "right-hand side of another size");
        self.solve_rows(&mut B.rows, None);
    }

    /// As [`Self::solve_block`] for rows; the unknowns are the rows `at`, or all rows.
    pub(crate) fn solve_rows(&self, B: &mut [Row], at: Option<&[u32]>) {
        let order = self.symbolic.perm().map(|perm| perm.arrays().0);
        let place = |k: usize| {
            let unknown = order.map_or(k, |order| order[k] as usize);
            at.map_or(unknown, |at| at[unknown] as usize)
        };
        let mut x: Vec<Row> = (0..self.figures.size).map(|k| B[place(k)]).collect();
        if let Some(supernodes) = supernodes(&self.symbolic) {
            triangular::solve(supernodes, &self.columns, &mut x);
        }
        x.iter().enumerate().for_each(|(k, x)| B[place(k)] = *x);
    }
}

/// Supernodes of the factor; `None` for a matrix without unknowns.
fn supernodes(symbolic: &SymbolicCholesky<u32>) -> Option<&SymbolicSupernodalCholesky<u32>> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(raw) => Some(raw),
        SymbolicCholeskyRaw::Simplicial(_) if symbolic.nrows() == 0 => None,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("a supernodal factor was requested"),
    }
}

/// Unknown that is eliminated as number `k`.
fn unknown_at(symbolic: &SymbolicCholesky<u32>, k: usize) -> usize {
    symbolic.perm().map_or(k, |perm| perm.arrays().0[k] as usize)
}

/// Lower triangle of `P K Pᵀ`; the rows of a column are in any order.
///
/// * `position`: elimination number of each unknown.
fn in_order(K: &SparseSymmetric, position: Option<&[u32]>) -> SparseColMat<u32, f64> {
    let (n, pattern) = (K.size(), K.pattern());
    let place = |unknown: usize| position.map_or(unknown as u32, |position| position[unknown]);
    let entries = || {
        let column = move |j: usize| pattern.column(j).map(move |entry| (entry, j));
        let lower = move |(entry, j): (usize, usize)| {
            let (a, b) = (place(pattern.rows[entry] as usize), place(j));
            (entry, a.max(b), a.min(b))
        };
        (0..n).flat_map(column).map(lower)
    };
    let mut starts = vec![0_u32; n + 1];
    entries().for_each(|(_, _, column)| starts[column as usize + 1] += 1);
    (0..n).for_each(|j| starts[j + 1] += starts[j]);
    let mut next = starts.clone();
    let (mut rows, mut values) = (vec![0_u32; K.stored()], vec![0.0; K.stored()]);
    for (entry, row, column) in entries() {
        let to = &mut next[column as usize];
        (rows[*to as usize], values[*to as usize]) = (row, K.values[entry]);
        *to += 1;
    }
    SparseColMat::new(SymbolicSparseColMat::new_unsorted_checked(n, n, starts, None, rows), values)
}

/// Factorises a matrix whose unknowns are in elimination order. The pivot of an error is numbered
/// in that order.
///
/// Single-threaded: two threads gained nothing (80 s instead of 83 for 10⁶ unknowns), and parallel
/// products of faer 0.24 are reported to be wrong for some matrices (sarah-quinones/faer-rs#273,
/// luiswirth/formoniq#122).
fn factorise(
    supernodes: &SymbolicSupernodalCholesky<u32>,
    K: &SparseColMat<u32, f64>,
) -> Result<Columns, NotPositiveDefinite> {
    let entries = supernodes.len_val();
    let out_of_memory = NotPositiveDefinite::OutOfMemory { entries };
    let mut values = Vec::new();
    values.try_reserve_exact(entries + ALIGNED / size_of::<f64>()).map_err(|_| out_of_memory)?;
    values.resize(values.capacity(), 0.0);
    // The summation order in faer depends on the memory address, so the start is aligned.
    let start = values.as_ptr().align_offset(ALIGNED);
    let scratch = factorize_supernodal_numeric_llt_scratch::<u32, f64>(supernodes, Par::Seq, Spec::default());
    let mut memory = MemBuffer::try_new(scratch).map_err(|_| out_of_memory)?;
    let factor = factorize_supernodal_numeric_llt(
        &mut values[start..start + entries],
        K.as_ref(),
        LltRegularization::default(),
        supernodes,
        Par::Seq,
        MemStack::new(&mut memory),
        Spec::default(),
    );
    clear_upper_halves();
    let factor = factor.map(drop);
    values.copy_within(start..start + entries, 0);
    values.truncate(entries);
    match factor {
        Ok(()) => Ok(Columns::of_blocks(supernodes, values)),
        // faer counts from 0 in some of its kernels and from 1 in others.
        Err(LltError::NonPositivePivot { index }) => {
            Err(NotPositiveDefinite::Pivot { unknown: index.min(K.ncols() - 1) })
        }
    }
}

/// Minimum of `L_jj² / K_jj` over the unknowns, with its unknown.
fn smallest_pivot(symbolic: &SymbolicCholesky<u32>, columns: &Columns, diagonal: &[f64]) -> (f64, usize) {
    let mut smallest = (f64::INFINITY, 0);
    let Some(supernodes) = supernodes(symbolic) else { return smallest };
    for s in 0..supernodes.n_supernodes() {
        let node = columns.supernode(supernodes, s);
        for k in 0..node.width {
            let unknown = unknown_at(symbolic, node.first + k);
            let L_jj = node.entries[node.start_of(k)];
            let ratio = L_jj * L_jj / diagonal[unknown];
            // NaN counts as the minimum.
            if !(ratio >= smallest.0) {
                smallest = (ratio, unknown);
            }
        }
    }
    smallest
}

fn analyse(K: &SparseSymmetric, ordering: Ordering) -> Result<(SymbolicCholesky<u32>, Ordering), NotPositiveDefinite> {
    let (n, pattern) = (K.size(), K.pattern());
    let places = SymbolicSparseColMatRef::new_checked(n, n, &pattern.starts, None, &pattern.rows);
    let dissected = match ordering.resolve(n) {
        Ordering::NestedDissection => nested_dissection(K.pattern()),
        _ => None,
    };
    let parameters = CholeskySymbolicParams {
        // Below every ratio: `FORCE_SUPERNODAL` is zero, which a diagonal matrix does not exceed.
        supernodal_flop_ratio_threshold: SupernodalThreshold(f64::NEG_INFINITY),
        ..CholeskySymbolicParams::default()
    };
    let symbolic = match &dissected {
        Some(order) => {
            let mut position = vec![0_u32; n];
            for (k, unknown) in order.iter().enumerate() {
                position[*unknown as usize] = k as u32;
            }
            let perm = Perm::new_checked(order.clone().into_boxed_slice(), position.into_boxed_slice(), n);
            factorize_symbolic_cholesky(places, Side::Lower, SymmetricOrdering::Custom(perm.as_ref()), parameters)
        }
        None => factorize_symbolic_cholesky(places, Side::Lower, SymmetricOrdering::Amd, parameters),
    };
    let used = if dissected.is_some() { Ordering::NestedDissection } else { Ordering::MinimumDegree };
    symbolic.map(|symbolic| (symbolic, used)).map_err(|_| NotPositiveDefinite::OutOfMemory { entries: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups of `part` unknowns, each coupled to all others of its group and to none outside.
    fn parts(n: usize, part: usize) -> SparseSymmetric {
        let mut triplets = Vec::new();
        for i in 0..n {
            triplets.push((i as u32, i as u32, part as f64 + (i % 7) as f64));
            triplets.extend((i / part * part..i).map(|j| (i as u32, j as u32, 0.5 + ((i * 3 + j) % 5) as f64 / 10.0)));
        }
        SparseSymmetric::from_triplets(n, &triplets)
    }

    #[test]
    fn a_matrix_of_any_coupling_is_solved_also_a_diagonal_one_and_one_without_unknowns() {
        for ordering in [Ordering::Auto, Ordering::MinimumDegree, Ordering::NestedDissection] {
            for n in [0, 1, 2, 7, 60] {
                for part in [1, 2, 3, 30, 60] {
                    let K = parts(n, part);
                    let factor = Cholesky::new(K.clone(), ordering).unwrap();
                    let B = DMatrix::from_fn(n, 11, |i, j| ((i * 5 + j * 3) % 13) as f64 - 6.0);
                    let mut X = B.clone();
                    factor.solve_in_place(&mut X);
                    let residual = (K.product(&X) - &B).iter().fold(0.0_f64, |most, r| most.max(r.abs()));
                    assert!(residual < 1e-13, "{n} unknowns in parts of {part}: {residual:e}");
                    assert_eq!(factor.smallest_pivot().0.is_finite(), n > 0);
                }
            }
        }
    }

    /// Truth: the residual, for one large dense block, many small ones, and a grid, whose
    /// separators give both.
    #[test]
    fn a_factor_of_large_and_small_blocks_solves_its_matrix_and_has_the_same_bits_each_time() {
        let side = 16;
        let grid = |n: usize| {
            let place = |k: usize| [k % side, k / side % side, k / side / side];
            let near = |i: usize, j: usize| place(i).iter().zip(place(j)).all(|(a, b)| a.abs_diff(b) <= 1);
            let mut triplets = Vec::new();
            for i in 0..n {
                triplets.push((i as u32, i as u32, 30.0 + (i % 7) as f64));
                let coupled = (i.saturating_sub(2 * side * side)..i).filter(|j| near(i, *j));
                triplets.extend(coupled.map(|j| (i as u32, j as u32, -0.5 - ((i * 3 + j) % 5) as f64 / 10.0)));
            }
            SparseSymmetric::from_triplets(n, &triplets)
        };
        for K in [parts(900, 900), parts(400, 20), grid(side * side * side)] {
            for ordering in [Ordering::MinimumDegree, Ordering::NestedDissection] {
                let factor = Cholesky::new(K.clone(), ordering).unwrap();
                let B = DMatrix::from_fn(K.size(), 3, |i, j| ((i * 5 + j * 3) % 13) as f64 - 6.0);
                let mut X = B.clone();
                factor.solve_in_place(&mut X);
                let residual = (K.product(&X) - &B).amax();
                assert!(residual < 1e-12, "{} unknowns: {residual:e}", K.size()); // measured 3.2e-14
                let again = Cholesky::new(K.clone(), ordering).unwrap();
                assert_eq!(factor.columns.values, again.columns.values);
            }
        }
    }

    #[test]
    fn a_stiffness_of_zero_below_zero_or_of_no_number_is_refused_with_its_unknown() {
        for ordering in [Ordering::MinimumDegree, Ordering::NestedDissection] {
            for (n, bad) in [(1, 0), (2, 1), (60, 17)] {
                for value in [0.0, -1.0, f64::NAN] {
                    let mut K = parts(n, 1);
                    K.values[bad] = value;
                    let refused = Cholesky::new(K, ordering).err();
                    assert_eq!(refused, Some(NotPositiveDefinite::Pivot { unknown: bad }), "{n} unknowns, {value}");
                }
            }
        }
    }
}
