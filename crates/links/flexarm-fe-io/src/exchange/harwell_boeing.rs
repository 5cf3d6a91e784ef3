//! Harwell-Boeing as written by ANSYS `HBMAT`: `RSA` (lower triangle by columns) and `RUA`.
//!
//! Start at [`parse`]; indices count from 1 in the file. Not here: labels of the rows in a `.mapping`
//! file (`abaqus_text.rs`), other formats (`recognise.rs`).

use super::fortran::{Format, parse_format};
use super::matrix::{LabelledMatrix, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, words};
use crate::FeFileError;
use crate::number::shown;

/// Reads a matrix; a `.mapping` file gives the labels of its rows.
pub(super) fn parse(text: Text<'_>) -> Result<LabelledMatrix, FeFileError> {
    // Header: title, numbers of lines, kind and sizes, formats of the lists.
    let mut lines = text.lines();
    let cut_off = || text.file().fail("header", "the end of the file", "a header of four lines", "");
    let mut next = || lines.next().ok_or_else(cut_off);
    let (_title, (place, counts)) = (next()?, next()?);
    let right_hand_sides = words(counts).nth(4).map_or(Ok(0), |count| place.integer("right-hand sides", count))?;
    let (place, kind) = next()?;
    let (n, promised) = parse_kind(&place, kind)?;
    let (place, formats) = next()?;
    let format = |first: usize, last: usize| {
        let last = last.min(formats.len());
        parse_format(formats.get(first.min(last)..last).unwrap_or(""), &place)
    };
    let (pointers, indices, values) = (format(0, 16)?, format(16, 32)?, format(32, 52)?);
    if right_hand_sides > 0 {
        next()?;
    }

    // Lists: first entry of each column, row of each entry, value of each entry.
    let pointers = list(text, &mut lines, "column pointers", pointers, n.saturating_add(1))?;
    let indices = list(text, &mut lines, "row numbers", indices, promised)?;
    let values = list(text, &mut lines, "values", values, promised)?;

    // Entries by columns; the pointer after a column ends it.
    let mut triplets = Triplets::default();
    let mut start = 0;
    for (column, (place, pointer)) in pointers.iter().enumerate() {
        let end = place.index("column pointer", pointer)?;
        if end < start || end > promised || (column == 0 && end != 0) || (column == n && end != promised) {
            let expected = format!("rising numbers from 1 to {}", promised + 1);
            return Err(place.fail("column pointer", shown(pointer), expected, ""));
        }
        for ((place, row), (value_place, value)) in indices[start..end].iter().zip(&values[start..end]) {
            let row = place.index("row number", row)?;
            if row >= n {
                let found = format!("{}", row + 1);
                return Err(place.fail("row number", found, format!("1 to {n}"), ""));
            }
            triplets.push(row, column - 1, value_place.number("entry", value)?, value_place);
        }
        start = end;
    }
    triplets.unlabelled("the matrix", n, &text.file(), Storage::BySize)
}

/// Reads the fields of a list, which starts on a new line.
fn list<'a>(
    text: Text<'a>,
    lines: &mut impl Iterator<Item = (ErrorPosition<'a>, &'a str)>,
    what: &str,
    format: Format,
    count: usize,
) -> Result<Vec<(ErrorPosition<'a>, &'a str)>, FeFileError> {
    let mut fields = Vec::new();
    while fields.len() < count {
        let Some((place, line)) = lines.next() else {
            let found = format!("{} {what}", fields.len());
            return Err(text.file().fail("matrix", found, count.to_string(), "is the file cut off?"));
        };
        fields.extend(format.fields(line).map(|field| (place, field)));
    }
    fields.truncate(count);
    Ok(fields)
}

/// Numbers of rows and entries of a real, symmetric or unsymmetric, assembled matrix.
fn parse_kind(place: &ErrorPosition<'_>, line: &str) -> Result<(usize, usize), FeFileError> {
    let mut words = words(line);
    let kind = place.word("type", &mut words)?;
    if !matches!(kind.to_ascii_uppercase().as_str(), "RSA" | "RUA") {
        let expected = "RSA or RUA: real, symmetric or unsymmetric, assembled";
        return Err(place.fail("type", shown(kind), expected, ""));
    }
    Ok((place.square_size(&mut words)?, place.next_index("number of entries", &mut words)? + 1))
}
