//! Sparse Cholesky factor: ordered, factorised once, used for many right-hand sides.
//!
//! Start at [`Cholesky::new`]. Factor and substitution are supernodal ones of faer.
//!
//! Not here: nested dissection (`dissection`), which unknowns there are ([`crate::reduction`]).

use std::fmt;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::Perm;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, Par, Side, Spec};
use nalgebra::DMatrix;

use super::block::{Block, Row, WIDTH};
use super::ordering::{Ordering, nested_dissection};
use super::registers::clear_upper_halves;
use super::symmetric::{Pattern, SparseSymmetric};

/// Memory alignment for faer, bytes.
const ALIGNED: usize = 64;

/// Size and cost of a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorFigures {
    /// Number of unknowns.
    pub size: usize,
    /// Number of stored entries of the lower triangle of the matrix.
    pub matrix_entries: usize,
    /// Number of stored entries of the factor, including zeros in its dense blocks.
    pub factor_entries: usize,
    /// Ordering used.
    pub ordering: Ordering,
}

/// Errors of a factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum NotPositiveDefinite {
    /// A pivot is not positive.
    #[error("the matrix is not positive definite (pivot of unknown {unknown})")]
    Pivot {
        /// Number of the unknown in the matrix.
        unknown: usize,
    },
    /// There is not enough memory for the factor.
    #[error("no memory for a factor of {entries} entries")]
    OutOfMemory {
        /// Number of entries required; 0 if they cannot be counted.
        entries: usize,
    },
}

/// Factor `P K Pᵀ = L Lᵀ` of a sparse symmetric positive definite matrix.
pub(crate) struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    /// Entries of the factor, from `start` on.
    values: Vec<f64>,
    start: usize,
    figures: FactorFigures,
    smallest_pivot: (f64, usize),
}

impl fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cholesky").field("figures", &self.figures).finish_non_exhaustive()
    }
}

impl Cholesky {
    /// Factorises `K`.
    ///
    /// Single-threaded: two threads gained nothing (80 s instead of 83 for 10⁶ unknowns), and
    /// parallel products of faer 0.24 are reported to be wrong for some matrices
    /// (sarah-quinones/faer-rs#273, luiswirth/formoniq#122).
    ///
    /// # Errors
    /// [`NotPositiveDefinite`], with the unknown of the failing pivot.
    pub(crate) fn new(K: &SparseSymmetric, ordering: Ordering) -> Result<Self, NotPositiveDefinite> {
        let (n, pattern) = (K.size(), K.pattern());
        let places = SymbolicSparseColMatRef::new_checked(n, n, &pattern.starts, None, &pattern.rows);
        let (symbolic, ordering) = analyse(places, pattern, ordering)?;
        let entries = symbolic.len_val();
        let out_of_memory = NotPositiveDefinite::OutOfMemory { entries };
        let mut values = Vec::new();
        values.try_reserve_exact(entries + ALIGNED / size_of::<f64>()).map_err(|_| out_of_memory)?;
        values.resize(values.capacity(), 0.0);
        // The summation order in faer depends on the memory address, so the start is aligned.
        let start = values.as_ptr().align_offset(ALIGNED);
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| out_of_memory)?;
        let factor = symbolic.factorize_numeric_llt(
            &mut values[start..start + entries],
            SparseColMatRef::new(places, &K.values),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        );
        clear_upper_halves();
        if let Err(LltError::NonPositivePivot { index }) = factor {
            // faer counts from 0 in some of its kernels and from 1 in others.
            return Err(NotPositiveDefinite::Pivot { unknown: unknown_at(&symbolic, index.min(n - 1)) });
        }
        let smallest_pivot = smallest_pivot(&symbolic, &values[start..], &K.diagonal());
        let figures = FactorFigures { size: n, matrix_entries: K.stored(), factor_entries: entries, ordering };
        Ok(Self { symbolic, values, start, figures, smallest_pivot })
    }

    /// Size and cost of the factor.
    pub(crate) fn figures(&self) -> FactorFigures {
        self.figures
    }

    /// Minimum pivot `L_jj²` relative to the diagonal entry of the matrix, and its unknown.
    ///
    /// Near rounding (1e-16 to 1e-12) if the matrix is singular and only passed because of the sign
    /// of a rounding error.
    pub(crate) fn smallest_pivot(&self) -> (f64, usize) {
        self.smallest_pivot
    }

    /// Replaces `B` by `K⁻¹ B`.
    ///
    /// # Panics
    /// If the number of rows of `B` is wrong.
    pub(crate) fn solve_in_place(&self, B: &mut DMatrix<f64>) {
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
    pub(crate) fn solve_block(&self, B: &mut Block) {
        assert_eq!(B.rows.len(), self.figures.size, "right-hand side of another size");
        self.solve_rows(&mut B.rows, None);
    }

    /// As [`Self::solve_block`] for rows; the unknowns are the rows `at`, or all rows.
    pub(crate) fn solve_rows(&self, B: &mut [Row], at: Option<&[u32]>) {
        let place = |unknown: usize| at.map_or(unknown, |at| at[unknown] as usize);
        let mut X = Mat::from_fn(self.figures.size, WIDTH, |i, j| B[place(i)].0[j]);
        let factor = LltRef::new(&self.symbolic, &self.values[self.start..][..self.figures.factor_entries]);
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(WIDTH, Par::Seq));
        factor.solve_in_place_with_conj(Conj::No, X.as_mut(), Par::Seq, MemStack::new(&mut memory));
        clear_upper_halves();
        for i in 0..self.figures.size {
            B[place(i)] = Row(std::array::from_fn(|j| X[(i, j)]));
        }
    }
}

/// Unknown that is eliminated as number `k`.
fn unknown_at(symbolic: &SymbolicCholesky<u32>, k: usize) -> usize {
    symbolic.perm().map_or(k, |perm| perm.arrays().0[k] as usize)
}

/// Minimum of `L_jj² / K_jj` over the unknowns, with its unknown.
fn smallest_pivot(symbolic: &SymbolicCholesky<u32>, values: &[f64], diagonal: &[f64]) -> (f64, usize) {
    let mut smallest = (f64::INFINITY, 0);
    // A matrix without unknowns has no supernodes.
    let SymbolicCholeskyRaw::Supernodal(supernodes) = symbolic.raw() else { return smallest };
    for s in 0..supernodes.n_supernodes() {
        let node = supernodes.supernode(s);
        let width = supernodes.supernode_end()[s] as usize - node.start();
        let height = width + node.pattern().len();
        for k in 0..width {
            let unknown = unknown_at(symbolic, node.start() + k);
            let L_jj = values[supernodes.col_ptr_for_val()[s] as usize + k * (height + 1)];
            let ratio = L_jj * L_jj / diagonal[unknown];
            // NaN counts as the minimum.
            if !(ratio >= smallest.0) {
                smallest = (ratio, unknown);
            }
        }
    }
    smallest
}

/// Symbolic factor in the requested order; minimum degree where nested dissection finds no
/// separator.
fn analyse(
    places: SymbolicSparseColMatRef<'_, u32>,
    pattern: &Pattern,
    ordering: Ordering,
) -> Result<(SymbolicCholesky<u32>, Ordering), NotPositiveDefinite> {
    let n = pattern.size();
    let dissected = match ordering.resolve(n) {
        Ordering::NestedDissection => nested_dissection(pattern),
        _ => None,
    };
    let parameters = CholeskySymbolicParams {
        // Below every ratio: `FORCE_SUPERNODAL` is zero, which a diagonal matrix does not exceed.
        supernodal_flop_ratio_threshold: SupernodalThreshold(f64::NEG_INFINITY),
        ..CholeskySymbolicParams::default()
    };
    let (perm, used) = match dissected {
        Some(order) => {
            let mut position = vec![0_u32; n];
            for (k, unknown) in order.iter().enumerate() {
                position[*unknown as usize] = k as u32;
            }
            let perm = Perm::new_checked(order.into_boxed_slice(), position.into_boxed_slice(), n);
            (Some(perm), Ordering::NestedDissection)
        }
        None => (None, Ordering::MinimumDegree),
    };
    let by = perm.as_ref().map_or(SymmetricOrdering::Amd, |perm| SymmetricOrdering::Custom(perm.as_ref()));
    let symbolic = factorize_symbolic_cholesky(places, Side::Lower, by, parameters);
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
                    let factor = Cholesky::new(&K, ordering).unwrap();
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
                let factor = Cholesky::new(&K, ordering).unwrap();
                let B = DMatrix::from_fn(K.size(), 3, |i, j| ((i * 5 + j * 3) % 13) as f64 - 6.0);
                let mut X = B.clone();
                factor.solve_in_place(&mut X);
                let residual = (K.product(&X) - &B).amax();
                assert!(residual < 1e-12, "{} unknowns: {residual:e}", K.size()); // measured 3.2e-14
                let again = Cholesky::new(&K, ordering).unwrap();
                let entries = |of: &Cholesky| of.values[of.start..][..of.figures.factor_entries].to_vec();
                assert!(entries(&factor) == entries(&again), "{} unknowns", K.size());
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
                    let refused = Cholesky::new(&K, ordering).err();
                    assert_eq!(refused, Some(NotPositiveDefinite::Pivot { unknown: bad }), "{n} unknowns, {value}");
                }
            }
        }
    }
}
