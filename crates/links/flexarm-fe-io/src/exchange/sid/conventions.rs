//! Detection of the index orders of a SID file by identities of its numbers.
//!
//! Start at [`Sid::conventions`]. All matrices are in the units of the file, about the origin of
//! the body frame and in its axes. Not here: parsing ([`super::parse`]), the link
//! ([`super::modal`]).

use nalgebra::{DMatrix, Matrix3};

use super::{Sid, SidMatrix};
use crate::FeFileError;
use crate::exchange::position::ErrorPosition;

/// Order of the columns of `Gr` and `Ge`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GyroLayout {
    /// Column `axis * nq + mode`, from 0: the files of FEMBS and EMBSlib.
    ComponentMajor,
    /// Column `3 * mode + axis`, from 0: welib.
    ModeMajor,
}

/// Order of the last three columns of `Oe`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OeOrder {
    /// xx yy zz xy yz xz: the files of FEMBS and EMBSlib.
    XyYzXz,
    /// xx yy zz xy xz yz: welib.
    XyXzYz,
}

/// Index orders of a file, with the residuals of their identities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SidConventions {
    /// Columns of `Gr` and `Ge`.
    pub gyro: GyroLayout,
    /// Columns of `Oe`.
    pub oe: OeOrder,
    /// `max |(Gr_j + Gr_jᵀ)/2 - J1_j| / max |J1|`.
    pub gyro_residual: f64,
    /// `max |Oe_j + J1_j| / max |J1|` over the products.
    pub oe_residual: f64,
}

/// Maximum residual of an identity for an order to fit: files have few digits.
const FITS: f64 = 1e-4;

/// Indices of xy, xz, yz in a 3×3.
const PRODUCTS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

impl OeOrder {
    /// Columns of xy, xz, yz.
    fn columns(self) -> [usize; 3] {
        match self {
            Self::XyYzXz => [3, 5, 4],
            Self::XyXzYz => [3, 4, 5],
        }
    }
}

impl GyroLayout {
    /// Column of an axis and a mode, both from 0.
    pub fn column(self, nq: usize, axis: usize, mode: usize) -> usize {
        match self {
            Self::ComponentMajor => axis * nq + mode,
            Self::ModeMajor => 3 * mode + axis,
        }
    }
}

impl Sid {
    /// Inertia about the origin of the body frame, in its axes, undeformed (mass times length²).
    pub fn J0(&self) -> Matrix3<f64> {
        tensor(&self.J.m0())
    }

    /// Derivative of [`Sid::J0`] with respect to shape coordinate `mode`, from 0; zero if there is
    /// none.
    pub fn J1(&self, mode: usize) -> Matrix3<f64> {
        tensor(&self.J.m1(mode))
    }

    /// `Gr_j = -2 ∫ [s]x [φ_j]x dm`, 3×3: rows and axes of shape coordinate `mode`, from 0.
    pub fn Gr(&self, layout: GyroLayout, mode: usize) -> Matrix3<f64> {
        let at = |row, axis| entry(&self.Gr, row, layout.column(self.nq(), axis, mode));
        Matrix3::from_fn(at)
    }

    /// `Ge_j`, nq×3, of shape coordinate `mode`, from 0: row k is `2 ∫ φ_j × φ_k dm`, columns are
    /// axes.
    pub fn Ge(&self, layout: GyroLayout, mode: usize) -> DMatrix<f64> {
        let nq = self.nq();
        DMatrix::from_fn(nq, 3, |row, axis| entry(&self.Ge, row, layout.column(nq, axis, mode)))
    }

    /// `Oe`, nq×6: row k is `∫ φ_kᵀ [ω]x² s dm` by the products xx yy zz xy xz yz of ω.
    pub fn Oe(&self, order: OeOrder) -> DMatrix<f64> {
        let columns = order.columns();
        DMatrix::from_fn(self.nq(), 6, |row, j| entry(&self.Oe, row, if j < 3 { j } else { columns[j - 3] }))
    }

    /// Detects the orders of `Gr`, `Ge` and `Oe`.
    ///
    /// With one shape coordinate both layouts of `Gr` are equal, and without products of inertia in
    /// `J1` both orders of `Oe` fit; then the first order is returned.
    ///
    /// # Errors
    /// If the numbers fit neither order; `origin` is used in the message.
    pub fn conventions(&self, origin: &str) -> Result<SidConventions, FeFileError> {
        let J1: Vec<_> = (0..self.nq()).map(|mode| self.J1(mode)).collect();
        let size = J1.iter().fold(f64::MIN_POSITIVE, |size, J| size.max(J.amax()));
        let of_gyro = |layout| {
            let difference = |(mode, J): (usize, &Matrix3<f64>)| {
                let Gr = self.Gr(layout, mode);
                ((Gr + Gr.transpose()) * 0.5 - J).amax()
            };
            J1.iter().enumerate().map(difference).fold(0.0, f64::max) / size
        };
        let of_oe = |order: OeOrder| {
            let columns = order.columns();
            let difference = |(mode, J): (usize, &Matrix3<f64>)| {
                let pairs = PRODUCTS.iter().zip(columns);
                pairs.map(|(product, column)| (entry(&self.Oe, mode, column) + J[*product]).abs()).fold(0.0, f64::max)
            };
            J1.iter().enumerate().map(difference).fold(0.0, f64::max) / size
        };
        // The first order is kept if both fit equally.
        let best = |first: f64, second: f64| if second < first { (false, second) } else { (true, first) };
        let (is_component, gyro_residual) = best(of_gyro(GyroLayout::ComponentMajor), of_gyro(GyroLayout::ModeMajor));
        let (is_sid, oe_residual) = best(of_oe(OeOrder::XyYzXz), of_oe(OeOrder::XyXzYz));
        for (name, residual) in [("Gr", gyro_residual), ("Oe", oe_residual)] {
            if !(residual <= FITS) {
                let found = format!("numbers that fit neither order: {residual:.1e} of J1");
                let expected = format!("an identity with J1 that holds to {FITS:.0e}");
                let help = "is J given without its first order, or with products of the other sign?";
                return Err(ErrorPosition::file(origin).fail(name, found, expected, help));
            }
        }
        Ok(SidConventions {
            gyro: if is_component { GyroLayout::ComponentMajor } else { GyroLayout::ModeMajor },
            oe: if is_sid { OeOrder::XyYzXz } else { OeOrder::XyXzYz },
            gyro_residual,
            oe_residual,
        })
    }
}

fn entry(matrix: &SidMatrix, row: usize, column: usize) -> f64 {
    matrix.entries0.get(&(row, column)).copied().unwrap_or(0.0)
}

/// Converts 6×1 (xx yy zz xy xz yz) or 3×3 to a tensor.
fn tensor(J: &DMatrix<f64>) -> Matrix3<f64> {
    if J.shape() != (6, 1) {
        return Matrix3::from_fn(|i, j| J.get((i, j)).copied().unwrap_or(0.0));
    }
    let mut tensor = Matrix3::from_diagonal(&nalgebra::Vector3::new(J[0], J[1], J[2]));
    for ((i, j), value) in PRODUCTS.into_iter().zip([J[3], J[4], J[5]]) {
        (tensor[(i, j)], tensor[(j, i)]) = (value, value);
    }
    tensor
}
