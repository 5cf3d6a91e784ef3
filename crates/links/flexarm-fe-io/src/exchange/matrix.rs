//! Symmetric matrices with labelled rows as they are in a file.
//!
//! Start at [`LabelledMatrix`]; readers collect [`Triplets`] and finish with one of its
//! constructors. Units are those of the file. Not here: units and interfaces ([`super::assemble`]),
//! parsing.

use std::collections::HashMap;
use std::fmt;

use nalgebra::DMatrix;

use super::position::ErrorPosition;
use crate::FeFileError;

/// Maximum number of rows of a matrix that is stored dense (32 MB).
pub(super) const LARGEST_DENSE: usize = 2000;

/// Allowed difference of mirrored entries relative to `sqrt(|k_ii k_jj|)`: the last of nine printed
/// decimals.
pub(super) const LARGEST_ASYMMETRY: f64 = 1e-8;

/// Role of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixRole {
    /// Stiffness.
    Stiffness,
    /// Mass.
    Mass,
}

impl MatrixRole {
    /// Name: "stiffness" or "mass".
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass",
        }
    }
}

/// Node and component of a matrix row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DofLabel {
    /// Number of the node; `None` if the file does not give it.
    pub node: Option<i64>,
    /// 1 to 3 translations, 4 to 6 rotations; 0 for a scalar (modal) coordinate or if unknown.
    ///
    /// In CalculiX the rotations of a rigid body are components 1 to 3 of a second node.
    pub dof: u8,
}

impl DofLabel {
    /// Label of a row without information in the file.
    pub const UNKNOWN: Self = Self { node: None, dof: 0 };

    /// Label of a component of a node.
    pub fn new(node: i64, dof: u8) -> Self {
        Self { node: Some(node), dof }
    }
}

impl fmt::Display for DofLabel {
    /// Writes `1001:3`, or `?:3` if the node is unknown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.node {
            Some(node) => write!(f, "{node}:{}", self.dof),
            None => write!(f, "?:{}", self.dof),
        }
    }
}

/// Lower triangle of a symmetric matrix, each position once, sorted by column and then row, from 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SparseSymmetric {
    /// Number of rows.
    pub n: usize,
    /// Row of each entry, at least its column.
    pub rows: Vec<u32>,
    /// Column of each entry.
    pub columns: Vec<u32>,
    /// Value of each entry; zeros are omitted.
    pub values: Vec<f64>,
}

impl SparseSymmetric {
    /// Number of stored entries.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether the matrix is zero.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Iterates over `(row, column, value)` of the lower triangle.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let places = self.rows.iter().zip(&self.columns).zip(&self.values);
        places.map(|((row, column), value)| (*row as usize, *column as usize, *value))
    }
}

/// Entries of a matrix.
#[derive(Debug, Clone, PartialEq)]
pub enum Entries {
    /// Dense, up to 2000 rows; both triangles, exactly symmetric.
    Dense(DMatrix<f64>),
    /// Sparse, for full models.
    Sparse(SparseSymmetric),
}

/// Symmetric matrix with labelled rows, in the units of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledMatrix {
    /// Name of the matrix in the file, or of the file.
    pub name: String,
    /// Label of each row.
    pub rows: Vec<DofLabel>,
    /// Entries.
    pub entries: Entries,
    /// Maximum `|k_ij - k_ji| / sqrt(|k_ii k_jj|)` in the file; the entries are symmetrised.
    pub asymmetry: f64,
}

impl LabelledMatrix {
    /// Number of rows.
    pub fn size(&self) -> usize {
        self.rows.len()
    }

    /// Dense matrix, or `None` if it is stored sparse.
    pub fn dense(&self) -> Option<&DMatrix<f64>> {
        match &self.entries {
            Entries::Dense(matrix) => Some(matrix),
            Entries::Sparse(_) => None,
        }
    }

    /// Lower triangle, from either storage.
    pub fn to_sparse(&self) -> SparseSymmetric {
        match &self.entries {
            Entries::Sparse(sparse) => sparse.clone(),
            Entries::Dense(matrix) => {
                let n = matrix.nrows();
                let mut sparse = SparseSymmetric { n, ..SparseSymmetric::default() };
                for column in 0..n {
                    for row in (column..n).filter(|&row| matrix[(row, column)] != 0.0) {
                        sparse.rows.push(row as u32);
                        sparse.columns.push(column as u32);
                        sparse.values.push(matrix[(row, column)]);
                    }
                }
                sparse
            }
        }
    }

    /// Whether the file labels the rows with nodes.
    pub fn is_labelled(&self) -> bool {
        self.rows.iter().any(|label| label.node.is_some())
    }
}

/// Labels of row and column, value, and place of an entry.
pub(super) type LabelledEntry<'a> = (DofLabel, DofLabel, f64, ErrorPosition<'a>);

/// Position of each label, from 0.
pub(super) fn index_of(rows: &[DofLabel]) -> HashMap<DofLabel, usize> {
    rows.iter().enumerate().map(|(i, label)| (*label, i)).collect()
}

/// Entries as read from a file, in any order and from either triangle.
#[derive(Debug, Default)]
pub(super) struct Triplets {
    entries: Vec<Triplet>,
}

#[derive(Debug, Clone, Copy)]
struct Triplet {
    row: u32,
    column: u32,
    line: u32,
    value: f64,
}

/// Storage of the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Storage {
    /// Dense up to [`LARGEST_DENSE`] rows.
    BySize,
    /// Always sparse: a full model.
    Sparse,
}

impl Triplets {
    /// Adds an entry, rows and columns from 0; `place` is only for messages.
    pub(super) fn push(&mut self, row: usize, column: usize, value: f64, place: &ErrorPosition<'_>) {
        let line = place.line.unwrap_or(0) as u32;
        self.entries.push(Triplet { row: row as u32, column: column as u32, line, value });
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Number of rows required by the entries.
    pub(super) fn extent(&self) -> usize {
        self.entries.iter().map(|t| t.row.max(t.column) as usize + 1).max().unwrap_or(0)
    }

    /// Builds a symmetric matrix whose rows have no information in the file; an error if there are
    /// too few entries for `n` rows.
    pub(super) fn unlabelled(
        self,
        name: &str,
        n: usize,
        place: &ErrorPosition<'_>,
        storage: Storage,
    ) -> Result<LabelledMatrix, FeFileError> {
        if n == 0 || (n > LARGEST_DENSE && n > 8 * self.len()) {
            let found = format!("{n} rows, but {} entries", self.len());
            let help = "a stiffness has an entry in every row; is this another file?";
            return Err(place.fail("matrix", found, "entries in every row", help));
        }
        self.symmetric(name, place.origin, vec![DofLabel::UNKNOWN; n], storage)
    }

    /// Builds the symmetric matrix of `rows` from entries whose labels are all in it.
    pub(super) fn labelled(
        name: &str,
        origin: &str,
        rows: Vec<DofLabel>,
        entries: &[LabelledEntry<'_>],
    ) -> Result<LabelledMatrix, FeFileError> {
        let index = index_of(&rows);
        let mut triplets = Self::default();
        for (row, column, value, place) in entries {
            triplets.push(index[row], index[column], *value, place);
        }
        triplets.symmetric(name, origin, rows, Storage::BySize)
    }

    /// Builds the symmetric matrix: fills missing triangles and rejects contradictions.
    ///
    /// All row and column indices must be below `rows.len()`.
    pub(super) fn symmetric(
        mut self,
        name: &str,
        origin: &str,
        rows: Vec<DofLabel>,
        storage: Storage,
    ) -> Result<LabelledMatrix, FeFileError> {
        // Square roots of the diagonal, the scale of the asymmetry.
        let n = rows.len();
        let mut scale = vec![0.0_f64; n];
        for t in self.entries.iter().filter(|t| t.row == t.column) {
            scale[t.row as usize] = t.value.abs().sqrt();
        }

        // Entries of the same position are adjacent, lower triangle before upper.
        let place = |t: &Triplet| (t.row.min(t.column), t.row.max(t.column));
        self.entries.sort_by_key(|t| (place(t), t.row < t.column));
        let mut lower = SparseSymmetric { n, ..SparseSymmetric::default() };
        let mut asymmetry = 0.0_f64;
        for group in self.entries.chunk_by(|a, b| place(a) == place(b)) {
            let (column, row) = place(&group[0]);
            let size = scale[row as usize] * scale[column as usize];
            let (value, difference) = common_value(group, size, &rows, name, origin)?;
            asymmetry = asymmetry.max(difference);
            if value != 0.0 {
                lower.rows.push(row);
                lower.columns.push(column);
                lower.values.push(value);
            }
        }

        let entries = if storage == Storage::Sparse || n > LARGEST_DENSE {
            Entries::Sparse(lower)
        } else {
            let mut dense = DMatrix::zeros(n, n);
            for (row, column, value) in lower.triplets() {
                dense[(row, column)] = value;
                dense[(column, row)] = value;
            }
            Entries::Dense(dense)
        };
        Ok(LabelledMatrix { name: name.into(), rows, entries, asymmetry })
    }
}

/// Single value of an entry that the file may give several times, and the relative asymmetry.
fn common_value(
    group: &[Triplet],
    size: f64,
    rows: &[DofLabel],
    name: &str,
    origin: &str,
) -> Result<(f64, f64), FeFileError> {
    let first = group[0];
    let Some(last) = group.iter().find(|t| t.value != first.value) else { return Ok((first.value, 0.0)) };

    // Mirrored entries may differ by rounding, repeated entries must be equal.
    let upper = group.iter().find(|t| (t.row < t.column) != (first.row < first.column));
    let mirrored =
        upper.filter(|upper| group.iter().all(|t| t.value == if t.row < t.column { upper.value } else { first.value }));
    if let Some(upper) = mirrored {
        let size = size.max(first.value.abs()).max(upper.value.abs());
        let difference = (first.value - upper.value).abs() / size;
        if difference <= LARGEST_ASYMMETRY {
            return Ok((0.5 * (first.value + upper.value), difference));
        }
    }
    let (row, column) = (first.row as usize, first.column as usize);
    let element = format!("entry ({}, {}) of {name}, rows {} and {}", row + 1, column + 1, rows[row], rows[column]);
    let line = Some(last.line as usize).filter(|line| *line > 0);
    let what = if mirrored.is_some() { "mirrored entries" } else { "the entry twice" };
    let other = ErrorPosition::line(origin, first.line as usize).place();
    let found = format!("{what}: {:e} at {other} and {:e}", first.value, last.value);
    let expected = format!("equal values, mirrored ones to {LARGEST_ASYMMETRY:.0e} of sqrt(k_ii k_jj)");
    let help = "stiffness and mass are symmetric; do not add up matrices of several parts in one file";
    Err(ErrorPosition { origin, line }.fail(element, found, expected, help))
}

/// Reorders the rows of a matrix; rows that it lacks become zero.
///
/// Returns `None` if the matrix has a row that `rows` lacks.
pub(super) fn reordered(matrix: &LabelledMatrix, rows: &[DofLabel]) -> Option<LabelledMatrix> {
    if matrix.rows == rows {
        return Some(matrix.clone());
    }
    let places = index_of(rows);
    let target: Option<Vec<usize>> = matrix.rows.iter().map(|label| places.get(label).copied()).collect();
    let target = target?;
    let mut moved = Triplets::default();
    let nowhere = ErrorPosition::file("");
    for (row, column, value) in matrix.to_sparse().triplets() {
        moved.push(target[row], target[column], value, &nowhere);
    }
    let storage = if matrix.dense().is_some() { Storage::BySize } else { Storage::Sparse };
    let moved = moved.symmetric(&matrix.name, "", rows.to_vec(), storage).ok()?;
    Some(LabelledMatrix { asymmetry: matrix.asymmetry, ..moved })
}
