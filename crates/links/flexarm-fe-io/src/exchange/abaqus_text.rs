//! Matrices without a header: `node,dof,node,dof,value`, `row column value`, and lists of rows.
//!
//! Abaqus `*MATRIX OUTPUT` and newer CalculiX write the first format, Abaqus `COORDINATE` and
//! CalculiX `.sti`/`.mas` the second. The file may contain either triangle or both.

use std::collections::BTreeSet;

use super::matrix::{DofLabel, LabelledMatrix, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, words};
use crate::FeFileError;
use crate::number::shown;

/// Lines with data, without comments and empty lines.
fn data<'a>(text: &Text<'a>) -> impl Iterator<Item = (ErrorPosition<'a>, &'a str)> + use<'a> {
    text.lines().filter(|(_, line)| !line.starts_with("**") && !line.trim().is_empty())
}

/// Reads `node,dof,node,dof,value` (commas or blanks); rows are sorted by node and component.
///
/// Also returns a warning about internal unknowns (negative labels), if there are any.
pub fn parse_labelled(text: Text<'_>) -> Result<(LabelledMatrix, Option<String>), FeFileError> {
    let mut entries = Vec::new();
    for (place, line) in data(&text) {
        let mut values = words(line);
        let mut label = |what| -> Result<DofLabel, FeFileError> {
            let node = place.next_integer(what, &mut values)?;
            let dof = place.word("degree of freedom", &mut values)?;
            let range = || place.fail("degree of freedom", shown(dof), "0 to 255", "");
            Ok(DofLabel::new(node, dof.parse().ok().ok_or_else(range)?))
        };
        let (row, column) = (label("node of the row")?, label("node of the column")?);
        let value = place.next_number("entry", &mut values)?;
        place.end(&mut values)?;
        entries.push((row, column, value, place));
    }

    let labels: BTreeSet<DofLabel> = entries.iter().flat_map(|(row, column, ..)| [*row, *column]).collect();
    // Nodes of the mesh first, internal ones (negative) last.
    let (internal, mesh): (Vec<DofLabel>, Vec<_>) = labels.into_iter().partition(|label| label.node < Some(0));
    let warning = internal.last().map(|last| {
        format!(
            "{} rows have negative node numbers ({last}, ...): internal unknowns of Abaqus (Lagrange multipliers of \
             ties, hybrid elements, or modal coordinates of a substructure); they come last",
            internal.len()
        )
    });
    let rows: Vec<_> = mesh.into_iter().chain(internal.into_iter().rev()).collect();
    if rows.is_empty() {
        return Err(text.file().fail("matrix", "no entries", "at least one", ""));
    }
    Ok((Triplets::labelled("the matrix", text.origin, rows, &entries)?, warning))
}

/// Reads `row column value`, rows from 1; they have no labels.
pub(super) fn parse_coordinate(text: Text<'_>, storage: Storage) -> Result<LabelledMatrix, FeFileError> {
    let mut triplets = Triplets::default();
    for (place, line) in data(&text) {
        let mut values = words(line);
        let row = place.next_index("row", &mut values)?;
        let column = place.next_index("column", &mut values)?;
        let value = place.next_number("entry", &mut values)?;
        place.end(&mut values)?;
        triplets.push(row, column, value, &place);
    }
    let n = triplets.extent();
    triplets.unlabelled("the matrix", n, &text.file(), storage)
}

/// Reads a CalculiX `.dof`: one `node.dof` per row, as text, because `10.1` and `10.10` differ.
pub fn parse_dof_list(text: Text<'_>) -> Result<Vec<DofLabel>, FeFileError> {
    let mut rows = Vec::new();
    for (place, line) in data(&text) {
        let label = line
            .trim()
            .split_once('.')
            .and_then(|(node, dof)| Some(DofLabel::new(node.parse().ok()?, dof.parse().ok()?)));
        let wrong = || place.fail("row", shown(line), "node.dof, such as 948.3", "");
        rows.push(label.ok_or_else(wrong)?);
    }
    Ok(rows)
}

/// Reads an ANSYS `.mapping`: `equation node label`, with labels such as `UX` and `ROTX`.
pub(super) fn parse_equation_mapping(text: Text<'_>) -> Result<Vec<DofLabel>, FeFileError> {
    const COMPONENTS: [&str; 6] = ["UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"];
    let mut rows = Vec::new();
    for (place, line) in data(&text).skip(1) {
        let mut values = words(line);
        let equation = place.next_index("equation", &mut values)?;
        if equation != rows.len() {
            let (found, expected) = (format!("{}", equation + 1), format!("{}", rows.len() + 1));
            return Err(place.fail("equation", found, expected, "equations in order"));
        }
        let node = place.next_integer("node", &mut values)?;
        let name = place.word("DOF", &mut values)?;
        let dof = COMPONENTS.iter().position(|known| name.eq_ignore_ascii_case(known));
        let wrong = || {
            let help = "only displacements and rotations can be taken over";
            place.fail("DOF", shown(name), COMPONENTS.join(", "), help)
        };
        rows.push(DofLabel::new(node, dof.ok_or_else(wrong)? as u8 + 1));
    }
    Ok(rows)
}
