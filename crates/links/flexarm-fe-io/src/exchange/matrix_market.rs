//! Matrix Market: `%%MatrixMarket matrix coordinate|array real|integer symmetric|general`.
//!
//! The file does not contain units, frames and the meaning of the rows; they come from the
//! [`Sidecar`] written together with [`write_matrix_market`] files, or from the user.
//!
//! [`Sidecar`]: super::Sidecar

use nalgebra::DMatrix;

use super::matrix::{LabelledMatrix, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, words};
use crate::FeFileError;
use crate::number::shown;

/// Symmetry: one triangle (the lower one by the standard), or all entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Symmetry {
    Symmetric,
    General,
}

/// Reads a matrix; its rows have no labels.
pub fn parse(text: Text<'_>) -> Result<LabelledMatrix, FeFileError> {
    let mut lines = text.lines();
    let (place, banner) = lines.next().ok_or_else(|| cut_off(&text.file()))?;
    let (is_array, symmetry) = parse_banner(&place, banner)?;

    // Size line, then the entries; comments and empty lines are allowed anywhere.
    let mut lines = lines.filter(|(_, line)| !line.starts_with('%') && !line.trim().is_empty());
    let (place, size) = lines.next().ok_or_else(|| cut_off(&text.file()))?;
    let mut size = words(size);
    let rows = place.square_size(&mut size)?;
    let header = place;
    let mut triplets = Triplets::default();
    let promised = if is_array {
        size_of_array(rows, symmetry)
    } else {
        usize::try_from(place.next_integer("number of entries", &mut size)?).unwrap_or(usize::MAX)
    };
    place.end(&mut size)?;

    let (mut row, mut column) = (0, 0);
    for (place, line) in lines {
        let mut values = words(line);
        if triplets.len() == promised {
            let found = format!("more than {promised} entries");
            return Err(place.fail("matrix", found, format!("{promised}"), ""));
        }
        if is_array {
            // An array has the values by columns, of a symmetric matrix from the diagonal down.
            triplets.push(row, column, place.next_number("entry", &mut values)?, &place);
            row += 1;
            if row == rows {
                column += 1;
                row = if symmetry == Symmetry::Symmetric { column } else { 0 };
            }
        } else {
            let row = place.next_index("row", &mut values)?;
            let column = place.next_index("column", &mut values)?;
            if row.max(column) >= rows {
                let found = format!("row {}, column {}", row + 1, column + 1);
                return Err(place.fail("entry", found, format!("1 to {rows}"), ""));
            }
            triplets.push(row, column, place.next_number("entry", &mut values)?, &place);
        }
        place.end(&mut values)?;
    }
    if triplets.len() < promised {
        let (found, expected) = (format!("{} entries", triplets.len()), format!("{promised}, as in its header"));
        let help = "is the file cut off?";
        return Err(header.fail("matrix", found, expected, help));
    }
    triplets.unlabelled("the matrix", rows, &header, Storage::BySize)
}

fn size_of_array(rows: usize, symmetry: Symmetry) -> usize {
    match symmetry {
        Symmetry::General => rows.saturating_mul(rows),
        Symmetry::Symmetric => rows.saturating_mul(rows + 1) / 2,
    }
}

fn cut_off(place: &ErrorPosition<'_>) -> FeFileError {
    place.fail("header", "the end of the file", "a header and a line with the size", "")
}

/// Parses whether the layout is an array, and the symmetry.
fn parse_banner(place: &ErrorPosition<'_>, banner: &str) -> Result<(bool, Symmetry), FeFileError> {
    let lower = banner.to_ascii_lowercase();
    let words: Vec<_> = words(lower.trim_start_matches('\u{feff}')).collect();
    let [_, "matrix", layout, field, symmetry] = words[..] else {
        let expected = "%%MatrixMarket matrix coordinate|array real|integer symmetric|general";
        return Err(place.fail("header", shown(banner), expected, ""));
    };
    let refuse = |element, found: &str, expected, help| Err(place.fail(element, shown(found), expected, help));
    let is_array = match layout {
        "array" => true,
        "coordinate" => false,
        _ => return refuse("layout", layout, "coordinate or array", ""),
    };
    match field {
        "real" | "integer" | "double" => {}
        "pattern" => return refuse("field", field, "real or integer", "a pattern has no values"),
        _ => return refuse("field", field, "real or integer", "structural damping is to be given as damping"),
    }
    match symmetry {
        "symmetric" => Ok((is_array, Symmetry::Symmetric)),
        "general" => Ok((is_array, Symmetry::General)),
        _ => refuse("symmetry", symmetry, "symmetric or general", "a stiffness is symmetric"),
    }
}

/// Writes a symmetric matrix as Matrix Market text, `coordinate real symmetric`; it reads back bit
/// for bit.
///
/// Only the lower triangle is written. `comments` become lines that start with `%`.
pub fn write_matrix_market(matrix: &DMatrix<f64>, comments: &[&str]) -> String {
    let n = matrix.nrows().min(matrix.ncols());
    let mut text = String::from("%%MatrixMarket matrix coordinate real symmetric\n");
    for line in comments.iter().flat_map(|comment| comment.lines()) {
        text += &format!("% {line}\n");
    }
    let places = (0..n).flat_map(|column| (column..n).map(move |row| (row, column)));
    let places: Vec<_> = places.filter(|place| matrix[*place] != 0.0).collect();
    text += &format!("{n} {n} {}\n", places.len());
    for (row, column) in places {
        text += &format!("{} {} {:e}\n", row + 1, column + 1, matrix[(row, column)]);
    }
    text
}
