//! Converts a matrix of a file to stiffness and mass of the interfaces in SI; units are handled
//! only here.
//!
//! Every row has a displacement unit `d_i`: the unit of length for translations, 1 (rad) for
//! rotations, `sqrt(mass)·length` for modal coordinates. With the unit of energy `E`
//!
//! ```text
//! K_SI = K E / (d_i d_j)        M_SI = M E time² / (d_i d_j)
//! ```
//! so `K` is in force/length, force, force·length. Mass-normalised modes stay normalised
//! (`M_mm = 1`), `K_mm` is in `1/time²`, `M_bm` in `sqrt(mass)` or `sqrt(mass)·length`. For modes
//! normalised otherwise this only rescales their coordinates; the model is the same.

use nalgebra::DMatrix;

use super::diagnose::diagnose_substructure;
use super::interface::{InterfaceMap, propose_map};
use super::matrix::{Entries, LabelledMatrix};
use super::position::ErrorPosition;
use super::read::ImportedMatrices;
use crate::FeFileError;
use flexarm_fem::units::UnitSystem;

/// Stiffness and mass of the interfaces, SI, modal coordinates last.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceMatrices {
    /// Names of the interfaces, six rows each.
    pub names: Vec<String>,
    /// Stiffness, `6 n + modes` rows; N/m, N, N·m; modal 1/s².
    pub K: DMatrix<f64>,
    /// Mass in the same order; kg, kg·m, kg·m².
    pub M: Option<DMatrix<f64>>,
    /// Number of modal coordinates after the interfaces.
    pub modes: usize,
    /// Larger of the asymmetries of the matrices in the file.
    pub asymmetry: f64,
}

/// Extracts the rows of the interfaces and converts them to SI.
///
/// * `map`: rows of each interface; `None` uses the map of the sidecar, if there is one.
/// * `units`: units of the file; `None` uses those of the sidecar.
///
/// # Errors
/// Without a map (with a proposal) or units, for a map that does not fit or leaves rows that are
/// not modes, and as [`diagnose_substructure`].
pub fn assemble_interfaces(
    imported: &ImportedMatrices,
    map: Option<&InterfaceMap>,
    units: Option<&UnitSystem>,
) -> Result<InterfaceMatrices, FeFileError> {
    // Map and units: those given, otherwise those of the sidecar.
    let place = ErrorPosition::file(&imported.origin);
    let sidecar = imported.sidecar.as_ref();
    let map = map.cloned().or_else(|| Some(sidecar?.map())).filter(|map| !map.interfaces.is_empty());
    let map = map.ok_or_else(|| ask_for_map(imported))?;
    let Some(units) = units.copied().or_else(|| Some(sidecar?.units)) else {
        let help = "name them, such as m-kg-s or mm-t-s";
        return Err(place.fail("units", "nothing", "the units of the file", help));
    };
    let resolved = map.resolve(&imported.stiffness.rows, &imported.origin)?;
    let rows: Vec<usize> = resolved.interfaces.iter().flatten().chain(&resolved.modal).copied().collect();
    let boundary = 6 * resolved.interfaces.len();

    // Displacement units d_i of the rows, and the equation of the module.
    let d: Vec<f64> = (0..rows.len())
        .map(|i| match i {
            i if i >= boundary => units.mass.sqrt() * units.length,
            i if i % 6 < 3 => units.length,
            _ => 1.0,
        })
        .collect();
    let energy = units.force() * units.length;
    let inertia = units.mass * units.length * units.length;
    let pick = |matrix: &LabelledMatrix, unit: f64| -> Result<DMatrix<f64>, FeFileError> {
        let Entries::Dense(dense) = &matrix.entries else {
            let found = format!("a matrix of {} rows", matrix.size());
            let help = "a full model must first be reduced to its interfaces";
            return Err(place.fail("rows", found, "a reduced matrix", help));
        };
        Ok(DMatrix::from_fn(rows.len(), rows.len(), |i, j| dense[(rows[i], rows[j])] * (unit / (d[i] * d[j]))))
    };
    let K = pick(&imported.stiffness, energy)?;
    let M = imported.mass.as_ref().map(|mass| pick(mass, inertia)).transpose()?;
    // Rows that are not modes, or interfaces that are not coupled, mean another matrix.
    if map.modal.is_empty() {
        check_modes(imported, &K, &rows, boundary)?;
    }
    diagnose_substructure(imported, &K, resolved.interfaces.len())?;
    let asymmetry = imported.mass.iter().fold(imported.stiffness.asymmetry, |worst, mass| worst.max(mass.asymmetry));
    let names = map.interfaces.iter().map(|interface| interface.name.clone()).collect();
    Ok(InterfaceMatrices { names, K, M, modes: resolved.modal.len(), asymmetry })
}

/// Checks that rows not declared as modal look like modes: no stiffness coupling with any other
/// row.
///
/// Otherwise a full model without labels would be accepted as one with hundreds of modes. Scalar
/// points of Nastran are declared modal.
fn check_modes(
    imported: &ImportedMatrices,
    K: &DMatrix<f64>,
    rows: &[usize],
    boundary: usize,
) -> Result<(), FeFileError> {
    /// Maximum coupling relative to the diagonal that counts as rounding.
    const COUPLED: f64 = 1e-6;
    let is_said = |i: usize| imported.stiffness.rows[rows[i]].node.is_some_and(|node| node >= 0);
    let coupling = |i: usize, j: usize| K[(i, j)].abs() / (K[(i, i)] * K[(j, j)]).abs().sqrt();
    for i in (boundary..rows.len()).filter(|&i| !is_said(i)) {
        let Some(j) = (0..rows.len()).find(|&j| j != i && K[(i, j)] != 0.0 && !(coupling(i, j) <= COUPLED)) else {
            continue;
        };
        let found = format!("row {} coupled with row {} ({:.1e})", rows[i] + 1, rows[j] + 1, coupling(i, j));
        let help = "if these rows are modal coordinates, add modal=#13-22 to the map; a full model must first be \
                    reduced to its interfaces";
        let expected = "fixed-interface modes, which have no stiffness with other rows";
        return Err(ErrorPosition::file(&imported.origin).fail("rows", found, expected, help));
    }
    Ok(())
}

/// Error that asks for the rows of A and B, with a proposed map if the rows suggest one.
fn ask_for_map(imported: &ImportedMatrices) -> FeFileError {
    let rows = &imported.stiffness.rows;
    let help = match propose_map(rows) {
        Some(map) => format!("if the proximal interface comes first, give the map {map}"),
        None => "give a map, such as A=1001,B=1002 or A=947:1-3+948:1-3,B=949:1-3+950:1-3 or A=#1-6,B=#7-12".into(),
    };
    let nodes: std::collections::BTreeSet<i64> = rows.iter().filter_map(|label| label.node).collect();
    let found = format!("{} rows of {} nodes and nothing about interfaces", rows.len(), nodes.len());
    let expected = "which rows are interface A and which B";
    ErrorPosition::file(&imported.origin).fail("interfaces", found, expected, help)
}
