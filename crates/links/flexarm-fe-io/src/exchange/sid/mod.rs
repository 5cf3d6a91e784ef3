//! Standard Input Data of a flexible body (Wallrapp 1994): reads `.SID_FEM` files.
//!
//! A body with `nq` shape coordinates: mass integrals as Taylor series in these, and frames of
//! nodes. Matrices are stored as the entries of the file; [`SidMatrix::m0`] and [`SidMatrix::m1`]
//! return them dense. Indices of the first-order part are (row, mode, column).
//!
//! Writers of this format differ in three places, which the file does not declare:
//!
//! ```text
//! J        6x1 (xx yy zz xy xz yz) or 3x3; products with their negative sign, as in the tensor
//! Gr, Ge   column (axis-1) nq + mode, or 3 (mode-1) + axis
//! Oe       columns xx yy zz xy yz xz, or xx yy zz xy xz yz
//! ```
//! The first is visible in the size. The others follow from identities of every body:
//! `(Gr_j + Gr_jᵀ)/2 = J1_j`, and the products in `Oe` are those of `-J1_j`; see
//! [`Sid::conventions`].
//!
//! Units: those of the file; [`Sid::in_units`] converts to others.
//! Not here: writing SID, the modal link itself (`flexarm_fem`).

mod conventions;
mod modal;
mod parse;
mod units;

use std::collections::BTreeMap;

use nalgebra::DMatrix;

pub use conventions::{GyroLayout, OeOrder, SidConventions};
pub use modal::{modal_link_from_sid, modal_link_held_at};
pub use parse::{parse_sid, read_sid};

/// Names of the matrices of a body, in file order.
pub(super) const BODY_BLOCKS: [&str; 11] = ["mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De"];
/// Names of the matrices of a node.
pub(super) const NODE_BLOCKS: [&str; 5] = ["origin", "phi", "psi", "AP", "sigma"];

/// Allowed numbers of rows and columns of a block with `nq` shape coordinates; empty if any are.
fn sizes_of(name: &str, nq: usize) -> Vec<(usize, usize)> {
    match name {
        "origin" | "mdCM" => vec![(3, 1)],
        "phi" | "psi" => vec![(3, nq)],
        "AP" => vec![(3, 3)],
        "J" => vec![(6, 1), (3, 3)],
        "Ct" | "Cr" => vec![(nq, 3)],
        "Me" | "Ke" | "De" => vec![(nq, nq)],
        "Gr" => vec![(3, 3 * nq)],
        "Ge" => vec![(nq, 3 * nq)],
        "Oe" => vec![(nq, 6)],
        _ => Vec::new(),
    }
}

/// Taylor series of a matrix in the shape coordinates, as stored in the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SidMatrix {
    /// Order: 0 constant, 1 linear in the shape coordinates.
    pub order: u8,
    /// Number of rows.
    pub nrow: usize,
    /// Number of columns.
    pub ncol: usize,
    /// Number of shape coordinates.
    pub nq: usize,
    /// Number of quadratic terms; always 0 so far.
    pub nqn: usize,
    /// Structure: 0 zero, 1 diagonal, 2 symmetric, 3 full, 4 unit matrix.
    pub structure: u8,
    /// Entries of the constant part by (row, column), from 0.
    pub entries0: BTreeMap<(usize, usize), f64>,
    /// Entries of the linear part by (row, mode, column), from 0.
    pub entries1: BTreeMap<(usize, usize, usize), f64>,
}

/// Node with its frame; all matrices are Taylor series.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SidNode {
    /// Number of the node.
    pub id: i64,
    /// Reference frame, usually `body ref`.
    pub rframe: String,
    /// Position, 3×1; the linear part equals `phi`.
    pub origin: SidMatrix,
    /// Displacement shapes, 3×nq.
    pub phi: SidMatrix,
    /// Rotation shapes, 3×nq.
    pub psi: SidMatrix,
    /// Rotation matrix, 3×3; its linear part is the skew matrix of `psi`.
    pub AP: SidMatrix,
    /// Stress shapes, 6×nq.
    pub sigma: Option<SidMatrix>,
}

/// Flexible body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sid {
    /// Text after the numbers in the first line.
    pub comment: String,
    /// Mass.
    pub mass: f64,
    /// Description of each shape coordinate.
    pub modes: Vec<String>,
    /// Nodes with their frames.
    pub nodes: Vec<SidNode>,
    /// First moment of mass, 3×1.
    pub mdCM: SidMatrix,
    /// Moment of inertia, 6×1 or 3×3.
    pub J: SidMatrix,
    /// Coupling of translation and shape, nq×3.
    pub Ct: SidMatrix,
    /// Coupling of rotation and shape, nq×3.
    pub Cr: SidMatrix,
    /// Modal mass, nq×nq.
    pub Me: SidMatrix,
    /// Gyroscopic terms of rotation, 3×3nq.
    pub Gr: SidMatrix,
    /// Gyroscopic terms of shape, nq×3nq.
    pub Ge: SidMatrix,
    /// Centrifugal terms of shape, nq×6.
    pub Oe: SidMatrix,
    /// Forces due to initial stress, nq×1.
    pub ksigma: SidMatrix,
    /// Stiffness, nq×nq.
    pub Ke: SidMatrix,
    /// Damping, nq×nq.
    pub De: SidMatrix,
    /// Matrices not in the standard, such as geometric stiffness.
    pub others: Vec<(String, SidMatrix)>,
}

impl Sid {
    /// Number of shape coordinates.
    pub fn nq(&self) -> usize {
        self.modes.len()
    }

    /// Iterates over the matrices of the body with their names.
    pub fn blocks(&self) -> impl Iterator<Item = (&str, &SidMatrix)> {
        let all = [
            &self.mdCM,
            &self.J,
            &self.Ct,
            &self.Cr,
            &self.Me,
            &self.Gr,
            &self.Ge,
            &self.Oe,
            &self.ksigma,
            &self.Ke,
            &self.De,
        ];
        let others = self.others.iter().map(|(name, matrix)| (name.as_str(), matrix));
        BODY_BLOCKS.into_iter().zip(all).chain(others)
    }
}

impl SidMatrix {
    /// Creates a constant matrix of a body with `nq` shape coordinates.
    pub fn constant(nq: usize, m0: &DMatrix<f64>) -> Self {
        let mut matrix = Self { nrow: m0.nrows(), ncol: m0.ncols(), nq, ..Self::default() };
        for (place, value) in places(m0) {
            matrix.entries0.insert(place, value);
        }
        matrix.structure = if matrix.entries0.is_empty() { 0 } else { 3 };
        matrix
    }

    /// Creates a matrix that is linear in the shape coordinates; `m1` has one matrix per
    /// coordinate.
    pub fn linear(m0: &DMatrix<f64>, m1: &[DMatrix<f64>]) -> Self {
        let mut matrix = Self { order: 1, structure: 3, ..Self::constant(m1.len(), m0) };
        for (mode, part) in m1.iter().enumerate() {
            for ((row, column), value) in places(part) {
                matrix.entries1.insert((row, mode, column), value);
            }
        }
        matrix
    }

    /// Constant part; entries out of range are ignored here and rejected by [`parse_sid`].
    pub fn m0(&self) -> DMatrix<f64> {
        if self.structure == 4 && self.entries0.is_empty() {
            return DMatrix::identity(self.nrow, self.ncol);
        }
        let mut dense = DMatrix::zeros(self.nrow, self.ncol);
        for (&(row, column), &value) in &self.entries0 {
            put(&mut dense, row, column, value);
            // One triangle is enough for a symmetric matrix.
            if self.structure == 2 && !self.entries0.contains_key(&(column, row)) {
                put(&mut dense, column, row, value);
            }
        }
        dense
    }

    /// Derivative with respect to shape coordinate `mode`, from 0; zero if there is none.
    pub fn m1(&self, mode: usize) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.nrow, self.ncol);
        for (&(row, _, column), &value) in self.entries1.iter().filter(|((_, k, _), _)| *k == mode) {
            put(&mut dense, row, column, value);
        }
        dense
    }
}

/// Sets an entry if it is in range.
fn put(dense: &mut DMatrix<f64>, row: usize, column: usize, value: f64) {
    if let Some(entry) = dense.get_mut((row, column)) {
        *entry = value;
    }
}

/// Non-zero entries.
fn places(matrix: &DMatrix<f64>) -> impl Iterator<Item = ((usize, usize), f64)> + '_ {
    let all = (0..matrix.nrows()).flat_map(|row| (0..matrix.ncols()).map(move |column| (row, column)));
    all.map(|place| (place, matrix[place])).filter(|(_, value)| *value != 0.0)
}
