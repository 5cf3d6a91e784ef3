//! The 6×6 stiffness of one spring as a user writes it: symmetric and positive definite, or the
//! entry that is wrong.
//!
//! Entries are compared with the root of their two diagonal entries, because forces and moments
//! have different units. Not here: a stiffness computed from a beam or a mesh, whose errors have
//! other causes (`flexarm_fem::gate`).

use nalgebra::Matrix6;

/// Maximum difference of mirrored entries, relative to the geometric mean of their diagonal entries.
const ASYMMETRY: f64 = 1e-9;
/// Minimum eigenvalue of the stiffness scaled to a unit diagonal; below it round-off decides.
const DEFINITE: f64 = 1e-12;

/// Reason why a 6×6 matrix is not the stiffness of a spring; rows and columns are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StiffnessError {
    /// An entry is NaN or infinite.
    #[error("[{row}][{column}] is {found}, expected a finite number")]
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The entry.
        found: f64,
    },
    /// An entry of the diagonal is zero or negative.
    #[error("[{row}][{row}] is {found}, expected a positive number: make rigid directions very stiff")]
    NotPositive {
        /// Row of the entry.
        row: usize,
        /// The entry.
        found: f64,
    },
    /// Two mirrored entries differ.
    #[error("[{row}][{column}] is {upper} and [{column}][{row}] is {lower}: it must be symmetric")]
    NotSymmetric {
        /// Row of the upper entry.
        row: usize,
        /// Column of the upper entry.
        column: usize,
        /// Entry above the diagonal.
        upper: f64,
        /// Entry below the diagonal.
        lower: f64,
    },
    /// A displacement meets no resistance.
    #[error(
        "it is not positive definite: with its diagonal scaled to one its smallest eigenvalue is {min_eigenvalue:.3e}, \
         expected above {DEFINITE:e}; the largest coupling is [{row}][{column}] = {coupling}, {relative:.4} of the root \
         of [{row}][{row}] [{column}][{column}]"
    )]
    NotDefinite {
        /// Minimum eigenvalue of the matrix scaled to a unit diagonal.
        min_eigenvalue: f64,
        /// Row of the entry with the maximum coupling.
        row: usize,
        /// Column of that entry.
        column: usize,
        /// Entry with the maximum coupling, as written.
        coupling: f64,
        /// Its magnitude relative to the geometric mean of its diagonal entries.
        relative: f64,
    },
}

/// Returns the symmetric part of the stiffness `K` of a spring, after checking `K`.
///
/// * `K`: 6×6, linear first (N/m, N/rad; N m/m, N m/rad), at any point and in any axes.
///
/// # Errors
/// [`StiffnessError`] for an entry that is not finite, a diagonal entry that is not positive,
/// mirrored entries that differ by more than 1e-9 of the root of their diagonal entries, and a
/// minimum eigenvalue of at most 1e-12 once the diagonal is scaled to one.
pub fn spring_stiffness(K: &Matrix6<f64>) -> Result<Matrix6<f64>, StiffnessError> {
    let pairs = || (0..6).flat_map(|i| (i + 1..6).map(move |j| (i, j)));
    if let Some((row, column)) = (0..6).flat_map(|i| (0..6).map(move |j| (i, j))).find(|at| !K[*at].is_finite()) {
        return Err(StiffnessError::NotFinite { row, column, found: K[(row, column)] });
    }
    if let Some(row) = (0..6).find(|i| K[(*i, *i)] <= 0.0) {
        return Err(StiffnessError::NotPositive { row, found: K[(row, row)] });
    }
    let size = |i: usize, j: usize| (K[(i, i)] * K[(j, j)]).sqrt();
    if let Some((row, column)) = pairs().find(|&(i, j)| (K[(i, j)] - K[(j, i)]).abs() > ASYMMETRY * size(i, j)) {
        return Err(StiffnessError::NotSymmetric { row, column, upper: K[(row, column)], lower: K[(column, row)] });
    }
    let scaled = Matrix6::from_fn(|i, j| 0.5 * (K[(i, j)] + K[(j, i)]) / size(i, j));
    let min_eigenvalue = scaled.symmetric_eigenvalues().min();
    if min_eigenvalue > DEFINITE {
        return Ok((K + K.transpose()) * 0.5);
    }
    let largest = pairs().max_by(|a, b| scaled[*a].abs().total_cmp(&scaled[*b].abs()));
    let (row, column) = largest.unwrap_or((0, 0));
    let (coupling, relative) = (K[(row, column)], scaled[(row, column)].abs());
    Err(StiffnessError::NotDefinite { min_eigenvalue, row, column, coupling, relative })
}
