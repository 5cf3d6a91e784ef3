//! Nastran OUTPUT4 as text: dense columns, sparse strings, and sparse strings with BIGMAT.
//!
//! The number of integers in a line gives its meaning: four and a name start a matrix, three a
//! column, one or two a string of a sparse column; lines with a decimal point contain values.
//! Depending on the writer, the number of words in a column counts a double once or twice, so the
//! values are counted instead.

use super::fortran::{Format, parse_format};
use super::matrix::{LabelledMatrix, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, words};
use crate::FeFileError;
use crate::number::shown;

/// Header of a matrix, in text and in binary files.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) name: String,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Whether strings give their length and row in two integers instead of one (BIGMAT).
    pub(super) big: bool,
    pub(super) is_double: bool,
}

impl Header {
    /// Checks NCOL, NROW, FORM, TYPE.
    pub(super) fn new(
        name: &str,
        [columns, rows, _form, kind]: [i64; 4],
        place: &ErrorPosition<'_>,
    ) -> Result<Self, FeFileError> {
        let element = format!("OP4 matrix {name}");
        let refuse = |found: String, expected: &str| place.fail(element.as_str(), found, expected, "");
        if !matches!(kind, 1 | 2) {
            return Err(refuse(format!("TYPE {kind}"), "1 or 2 (real)"));
        }
        // A negative number of rows means BIGMAT.
        let big = rows < 0;
        let size = |n: i64| u32::try_from(n.unsigned_abs()).map(|n| n as usize);
        match (size(columns), size(rows)) {
            (Ok(columns @ 1..), Ok(rows @ 1..)) => {
                Ok(Self { name: name.to_ascii_uppercase(), columns, rows, big, is_double: kind == 2 })
            }
            _ => Err(refuse(format!("{columns} columns, {rows} rows"), "1 to 4294967295")),
        }
    }

    /// Builds the symmetric matrix, or `None` for a rectangular one.
    pub(super) fn finish(self, triplets: Triplets, origin: &str) -> Result<Option<LabelledMatrix>, FeFileError> {
        if self.rows != self.columns {
            return Ok(None);
        }
        triplets.unlabelled(&self.name, self.rows, &ErrorPosition::file(origin), Storage::BySize).map(Some)
    }

    /// Decodes the single integer of a string: length in words, and first row (from 1).
    pub(super) fn string(code: i64) -> (i64, i64) {
        (code / 65536 - 1, code % 65536)
    }
}

/// State of reading a matrix.
struct Reading {
    header: Header,
    format: Format,
    triplets: Triplets,
    column: usize,
    row: usize,
    /// Number of values read in the current column or string, and number of words declared for it.
    count: usize,
    promised: usize,
}

/// Reads all square matrices.
pub(super) fn parse(text: Text<'_>) -> Result<Vec<LabelledMatrix>, FeFileError> {
    let mut matrices = Vec::new();
    let mut reading: Option<Reading> = None;
    for (place, line) in text.lines().filter(|(_, line)| !line.trim().is_empty()) {
        if let Some(header) = line.get(..32).filter(|_| is_header(line)) {
            if let Some(done) = reading.take() {
                matrices.extend(done.finish(&place, text.origin)?);
            }
            reading = Some(begin(&place, header, line)?);
            continue;
        }
        let Some(current) = reading.as_mut() else {
            let expected = "NCOL, NROW, FORM, TYPE, a name and a format";
            return Err(place.fail("header", shown(line), expected, ""));
        };
        if line.contains('.') { current.values(&place, line)? } else { current.integers(&place, line)? }
    }
    if let Some(done) = reading {
        matrices.extend(done.finish(&text.file(), text.origin)?);
    }
    Ok(matrices)
}

/// Whether a line has four integers and a name that starts with a letter.
fn is_header(line: &str) -> bool {
    let (head, name) = (line.get(..32), line.get(32..33));
    head.is_some_and(|head| !head.contains('.'))
        && name.is_some_and(|c| c.starts_with(|c: char| c.is_ascii_alphabetic()))
}

fn begin(place: &ErrorPosition<'_>, head: &str, line: &str) -> Result<Reading, FeFileError> {
    let mut numbers = [0; 4];
    for (i, number) in numbers.iter_mut().enumerate() {
        *number = place.integer("header", head.get(8 * i..8 * i + 8).unwrap_or(""))?;
    }
    let name = line.get(32..).map(|rest| rest.get(..8).unwrap_or(rest)).unwrap_or("").trim();
    let format = line.get(40..).filter(|rest| !rest.trim().is_empty()).unwrap_or("5E16.9");
    Ok(Reading {
        header: Header::new(name, numbers, place)?,
        format: parse_format(format, place)?,
        triplets: Triplets::default(),
        column: 0,
        row: 0,
        count: 0,
        promised: 0,
    })
}

impl Reading {
    /// Reads the header of a column (three integers) or of a string of a sparse column (one or
    /// two).
    fn integers(&mut self, place: &ErrorPosition<'_>, line: &str) -> Result<(), FeFileError> {
        self.check_count(place)?;
        let numbers = words(line).map(|word| place.integer("column", word)).collect::<Result<Vec<_>, _>>()?;
        let (row, promised) = match numbers[..] {
            [column, row, length] => {
                let last = self.header.columns as i64 + 1;
                if !(1..=last).contains(&column) {
                    let found = format!("column {column}");
                    return Err(place.fail("column", found, format!("1 to {last}"), ""));
                }
                self.column = column as usize;
                // The words of a sparse column are counted per string.
                (row, if row == 0 { 0 } else { length })
            }
            [length, row] => (row, length.saturating_sub(1)),
            [code] => {
                let (length, row) = Header::string(code);
                (row, length)
            }
            _ => {
                let expected = "one, two or three whole numbers";
                return Err(place.fail("line", shown(line), expected, ""));
            }
        };
        let size = |n: i64| usize::try_from(n).ok().filter(|n| *n as u64 <= 2 * u64::from(u32::MAX));
        let (Some(row), Some(promised)) = (size(row), size(promised)) else {
            return Err(place.fail("row", shown(line), "positive numbers", ""));
        };
        (self.row, self.promised, self.count) = (row, promised, 0);
        Ok(())
    }

    fn values(&mut self, place: &ErrorPosition<'_>, line: &str) -> Result<(), FeFileError> {
        for field in self.format.fields(line) {
            let value = place.number("entry", field)?;
            let row = self.row + self.count;
            self.count += 1;
            // A column after the last one, with one dummy value, ends the matrix.
            if self.column == self.header.columns + 1 {
                continue;
            }
            if self.column == 0 || row == 0 || row > self.header.rows || self.count > self.promised {
                let element = format!("entry ({row}, {}) of {}", self.column, self.header.name);
                let expected = format!("{} values, rows 1 to {}", self.promised, self.header.rows);
                return Err(place.fail(element, "one value more", expected, ""));
            }
            self.triplets.push(row - 1, self.column - 1, value, place);
        }
        Ok(())
    }

    /// Checks the number of values; a double may count as one word or two.
    fn check_count(&self, place: &ErrorPosition<'_>) -> Result<(), FeFileError> {
        let halves = self.header.is_double && 2 * self.count == self.promised;
        if self.count == self.promised || halves || self.column == self.header.columns + 1 {
            return Ok(());
        }
        let element = format!("column {} of {}", self.column, self.header.name);
        let found = format!("{} values", self.count);
        let expected = format!("{} words", self.promised);
        Err(place.fail(element, found, expected, "is the file cut off?"))
    }

    fn finish(self, place: &ErrorPosition<'_>, origin: &str) -> Result<Option<LabelledMatrix>, FeFileError> {
        self.check_count(place)?;
        if self.column != self.header.columns + 1 {
            let found = format!("the end after column {}", self.column);
            let expected = format!("column {} as its end mark", self.header.columns + 1);
            let element = format!("OP4 matrix {}", self.header.name);
            let help = "is the file cut off?";
            return Err(place.fail(element, found, expected, help));
        }
        self.header.finish(self.triplets, origin)
    }
}
