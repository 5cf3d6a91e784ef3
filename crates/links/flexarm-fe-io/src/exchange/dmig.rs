//! Nastran DMIG entries in large, small and free field: bulk data, `.pch` of EXTSEOUT and others.
//!
//! A file may contain several matrices (KAAX, MAAX, BAAX, ...). GRID entries give positions.
//! Entries may be from either triangle, mixed; zero columns are absent. Matrices are in the
//! *displacement* frame of each grid (field CD of GRID); a warning is given if it is not the basic
//! frame.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use nalgebra::Vector3;

use super::cards::{Card, cards};
use super::matrix::{DofLabel, LabelledEntry, LabelledMatrix, Triplets};
use super::position::ErrorPosition;
use super::text::Text;
use crate::FeFileError;
use crate::number::shown;

/// Contents of a file with DMIG entries.
#[derive(Debug, Default)]
pub struct Dmig {
    pub matrices: Vec<LabelledMatrix>,
    pub positions: BTreeMap<i64, Vector3<f64>>,
    pub warnings: Vec<String>,
}

struct RawMatrix<'a> {
    name: String,
    /// IFO 2 or 9: rows and columns have different meanings even if their numbers are the same.
    is_rectangular: bool,
    header: ErrorPosition<'a>,
    entries: Vec<LabelledEntry<'a>>,
}

/// Reads all matrices that can be a stiffness or a mass; others are named in the warnings.
pub fn parse(text: Text<'_>) -> Result<Dmig, FeFileError> {
    let mut result = Dmig::default();
    let mut matrices: Vec<RawMatrix<'_>> = Vec::new();
    let mut index: HashMap<String, usize> = HashMap::new();
    for card in cards(text, &["DMIG", "GRID"])? {
        match card.keyword.as_str() {
            "GRID" => parse_grid(&card, &mut result)?,
            "DMIG" => {
                let name = card.field(0).to_ascii_uppercase();
                // The first card of a name is the header of the matrix, later ones are columns.
                match index.get(&name) {
                    None => {
                        check_header(&card, &name)?;
                        index.insert(name.clone(), matrices.len());
                        let is_rectangular = matches!(card.field(2), "2" | "9");
                        matrices.push(RawMatrix { name, is_rectangular, header: card.place, entries: Vec::new() });
                    }
                    Some(i) => parse_column(&card, &mut matrices[*i])?,
                }
            }
            _ => {}
        }
    }
    for raw in matrices {
        result.matrices.extend(assemble(raw, text, &mut result.warnings)?);
    }
    Ok(result)
}

/// Checks the header `DMIG NAME 0 IFO TIN TOUT POLAR _ NCOL`.
fn check_header(card: &Card<'_>, name: &str) -> Result<(), FeFileError> {
    let place = card.place;
    let is_header = card.field(1) == "0" && !card.field(2).is_empty();
    if name.is_empty() || !is_header {
        let element = format!("DMIG {name}");
        let expected = "its header first: DMIG, NAME, 0, IFO, TIN";
        return Err(place.fail(element, "a column", expected, "is the file cut off?"));
    }
    let refuse = |what, field: &str, expected, help| {
        let element = format!("DMIG {name}, {what}");
        Err(place.fail(element, shown(field), expected, help))
    };
    match card.field(2) {
        "1" | "2" | "6" | "9" => {}
        form => return refuse("IFO", form, "1 (square), 6 (symmetric), 2 or 9 (rectangular)", ""),
    }
    match card.field(3) {
        "1" | "2" | "" => Ok(()),
        kind @ ("3" | "4") => refuse("TIN", kind, "1 or 2 (real)", "complex: give structural damping as damping"),
        kind => refuse("TIN", kind, "1 or 2 (real)", ""),
    }
}

/// Reads a column `DMIG NAME GJ CJ _ (Gi Ci Ai Bi)...`.
fn parse_column<'a>(card: &Card<'a>, matrix: &mut RawMatrix<'a>) -> Result<(), FeFileError> {
    let column = label(&card.place, "column", card.field(1), card.field(2))?;
    for first in (4..card.fields.len()).step_by(4) {
        let [node, dof, value, imaginary] = std::array::from_fn(|i| card.field(first + i));
        if node.is_empty() && dof.is_empty() && value.is_empty() {
            continue;
        }
        let place = card.place_of(first);
        let row = label(&place, "row", node, dof)?;
        let element = format!("DMIG {}, row {row}, column {column}", matrix.name);
        if !imaginary.is_empty() && place.number(&element, imaginary)? != 0.0 {
            let found = shown(imaginary);
            return Err(place.fail(element, found, "no imaginary part", ""));
        }
        matrix.entries.push((row, column, place.number(&element, value)?, place));
    }
    Ok(())
}

fn label(place: &ErrorPosition<'_>, what: &str, node: &str, dof: &str) -> Result<DofLabel, FeFileError> {
    let node = place.integer(what, node)?;
    let component = match dof {
        "" => Some(0),
        dof => dof.parse::<u8>().ok().filter(|dof| *dof <= 6),
    };
    let wrong = || {
        let element = format!("component of the {what}");
        place.fail(element, shown(dof), "1 to 6, or 0 for a scalar point", "")
    };
    component.map(|dof| DofLabel::new(node, dof)).ok_or_else(wrong)
}

/// Reads a grid point `GRID ID CP X1 X2 X3 CD`.
fn parse_grid(card: &Card<'_>, result: &mut Dmig) -> Result<(), FeFileError> {
    let place = card.place;
    let id = place.integer("GRID number", card.field(0))?;
    let mut p = Vector3::zeros();
    for i in 0..3 {
        let text = card.field(2 + i);
        p[i] = if text.is_empty() { 0.0 } else { place.number("GRID position", text)? };
    }
    let other = |field: &str| !matches!(field, "" | "0");
    if other(card.field(1)) {
        let system = card.field(1);
        result.warnings.push(format!("GRID {id} is given in coordinate system {system}: its position is not used"));
    } else {
        result.positions.insert(id, p);
    }
    if other(card.field(5)) {
        result.warnings.push(format!(
            "the displacements of GRID {id} are in coordinate system {}: give the axes of the interface frame so",
            card.field(5)
        ));
    }
    Ok(())
}

/// Assembles a symmetric matrix; warns of another one and returns `None`.
fn assemble(
    raw: RawMatrix<'_>,
    text: Text<'_>,
    warnings: &mut Vec<String>,
) -> Result<Option<LabelledMatrix>, FeFileError> {
    let RawMatrix { name, is_rectangular, header, entries } = raw;
    let rows: BTreeSet<DofLabel> = entries.iter().map(|(row, ..)| *row).collect();
    let columns: BTreeSet<DofLabel> = entries.iter().map(|(_, column, ..)| *column).collect();
    if entries.is_empty() {
        warnings.push(format!("{}: DMIG {name} has no entries", header.place()));
        return Ok(None);
    }
    // Columns without grids in common with the rows: loads and other rectangular matrices.
    if is_rectangular || rows.is_disjoint(&columns) {
        warnings.push(format!("DMIG {name} is rectangular and was left out"));
        return Ok(None);
    }
    // Grids first, then scalar points (modal coordinates), each in ascending order.
    let mut labels: Vec<DofLabel> = rows.union(&columns).copied().collect();
    labels.sort_by_key(|label| (label.dof == 0, *label));
    Triplets::labelled(&name, text.origin, labels, &entries).map(Some)
}
