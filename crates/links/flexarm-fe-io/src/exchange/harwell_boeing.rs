//! Harwell-Boeing as written by ANSYS `HBMAT`: `RSA` (lower triangle by columns) and `RUA`.

use super::fortran::{Format, parse_format};
use super::matrix::{LabelledMatrix, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, shown, words};
use crate::FeFileError;

/// Reads a matrix; a `.mapping` file gives the labels of its rows.
pub(super) fn parse(text: Text<'_>) -> Result<LabelledMatrix, FeFileError> {
    let mut lines = text.lines();
    let mut next = || {
        lines.next().ok_or_else(|| {
            let expected = "a header of four lines";
            text.file().fail("header", "the end of the file", expected, "")
        })
    };
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

    let pointers = list(text, &mut lines, "column pointers", pointers, n.saturating_add(1))?;
    let indices = list(text, &mut lines, "row numbers", indices, promised)?;
    let values = list(text, &mut lines, "values", values, promised)?;

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
    let rows = triplets.unlabelled(n, &text.file())?;
    triplets.symmetric("the matrix", text.origin, rows, Storage::BySize)
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
            let (found, expected) = (format!("{} {what}", fields.len()), format!("{count}"));
            let help = "is the file cut off?";
            return Err(text.file().fail("matrix", found, expected, help));
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
    let rows = place.index("number of rows", place.word("number of rows", &mut words)?)? + 1;
    let columns = place.index("number of columns", place.word("number of columns", &mut words)?)? + 1;
    let entries = place.index("number of entries", place.word("number of entries", &mut words)?)? + 1;
    if rows != columns {
        let found = format!("{rows} rows and {columns} columns");
        return Err(place.fail("size", found, "a square matrix", ""));
    }
    Ok((rows, entries))
}
