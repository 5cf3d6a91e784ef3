//! Tables of numbers with a header: one row of names, then a number in every cell.
//!
//! The separator is a semicolon, tab or comma, as found in the header; with semicolons and tabs a
//! number may have a decimal comma. Empty lines and lines that begin with # are skipped. Not here:
//! the meaning of the columns.

use std::path::Path;

use flexarm_settings::written::csv_fields;

use crate::{FileError, read_text};

/// Table of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberTable {
    /// Column names, without surrounding spaces and quotes.
    pub names: Vec<String>,
    /// Rows; NaN for an empty cell.
    pub rows: Vec<Vec<f64>>,
    /// Line of each row in the file, from 1.
    pub lines: Vec<usize>,
}

impl NumberTable {
    /// Reads a file.
    ///
    /// # Errors
    /// [`FileError::Unusable`] if the file cannot be read, has no header, names a column twice, or
    /// has a row with a different number of cells or a cell that is not a number. The message gives
    /// the line, the column and what was found.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of_text(path, &read_text(path)?)
    }

    /// Reads the text of a file, whose path is used in messages.
    ///
    /// # Errors
    /// As [`NumberTable::read`].
    pub fn of_text(path: &Path, text: &str) -> Result<Self, FileError> {
        let unusable = |fault: TableFault| FileError::Unusable { path: path.to_owned(), what: fault.to_string() };
        Self::parse(text).map_err(unusable)
    }

    fn parse(text: &str) -> Result<Self, TableFault> {
        let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
        let counts = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
        let (_, header) = lines.by_ref().find(|(_, line)| counts(line)).ok_or(TableFault::Empty)?;
        let separator = [';', '\t'].into_iter().find(|c| header.contains(*c)).unwrap_or(',');
        let cells = |line: &str| -> Vec<String> {
            csv_fields(line, |c| c == separator, false).iter().map(|cell| cell.trim().to_owned()).collect()
        };
        let names = cells(header);
        for (k, name) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(TableFault::Unnamed { column: k + 1 });
            }
            if names[..k].contains(name) {
                return Err(TableFault::NamedTwice { name: name.clone() });
            }
            if name.parse::<f64>().is_ok() {
                return Err(TableFault::NoHeader { number: name.clone() });
            }
        }
        let mut table = Self { names, rows: Vec::new(), lines: Vec::new() };
        for (line, cells) in lines.filter(|(_, line)| counts(line)).map(|(k, line)| (k + 1, cells(line))) {
            let (found, expected) = (cells.len(), table.names.len());
            if found != expected {
                return Err(TableFault::Cells { line, found, expected });
            }
            let value = |(name, cell): (&String, &String)| {
                let not_a_number = || TableFault::NotANumber { line, column: name.clone(), found: cell.clone() };
                number_of(cell, separator != ',').ok_or_else(not_a_number)
            };
            let row = table.names.iter().zip(&cells).map(value).collect::<Result<Vec<f64>, _>>()?;
            table.rows.push(row);
            table.lines.push(line);
        }
        Ok(table)
    }

    /// Index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }
}

/// Reason why a text is not a table of numbers.
#[derive(Debug, thiserror::Error)]
enum TableFault {
    #[error("the table is empty: expected a header")]
    Empty,
    #[error("column {column} of the header has no name")]
    Unnamed { column: usize },
    #[error("the header names {name:?} twice: rename or remove one of the columns")]
    NamedTwice { name: String },
    #[error("the first row has the number {number} where a name was expected: add a header")]
    NoHeader { number: String },
    #[error("line {line}: expected {expected} cells as in the header, found {found}")]
    Cells { line: usize, found: usize, expected: usize },
    #[error("line {line}, column {column:?}: expected a number, found {found:?}")]
    NotANumber { line: usize, column: String, found: String },
}

/// A finite number; NaN for an empty cell.
fn number_of(cell: &str, decimal_comma: bool) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    let plain = cell.parse::<f64>().ok();
    let value = plain.or_else(|| decimal_comma.then(|| cell.replacen(',', ".", 1).parse().ok()).flatten())?;
    value.is_finite().then_some(value)
}
