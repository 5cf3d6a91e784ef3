//! Tables of numbers with a header: one row of names, then a number in every cell.
//!
//! The separator is a semicolon, tab or comma, as found in the header; with semicolons and tabs a
//! number may have a decimal comma. Empty lines and lines that begin with # are skipped. Not here:
//! the meaning of the columns.

use std::path::{Path, PathBuf};

use flexarm_settings::written::{csv_column, csv_fields};

use crate::{FileError, TextFileError, read_text};

/// Table of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberTable {
    /// Column names, without surrounding spaces and quotes.
    pub names: Vec<String>,
    /// Rows; NaN for an empty cell.
    pub rows: Vec<Vec<f64>>,
    /// Line of each row in the file, from 1.
    pub lines: Vec<usize>,
    path: PathBuf,
    header_line: usize,
}

impl NumberTable {
    /// Reads a file.
    ///
    /// # Errors
    /// [`FileError::Unusable`] if the file cannot be read; [`FileError::Text`] if it has no header,
    /// names a column twice, or has a row with a different number of cells or a cell that is not a
    /// number.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of_text(path, &read_text(path)?)
    }

    /// Reads the text of a file, whose path is used in messages.
    ///
    /// # Errors
    /// As [`NumberTable::read`].
    pub fn of_text(path: &Path, text: &str) -> Result<Self, FileError> {
        let text = text.trim_start_matches('\u{feff}');
        let fault = |line: usize, column: Option<usize>, message: String| {
            let (path, column) = (path.to_owned(), column.unwrap_or(1));
            TextFileError { path, line, column, message, page: "" }
        };
        // The header is the first line that counts; it decides the separator.
        let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
        let counts = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
        let Some((header_line, header)) = lines.by_ref().find(|(_, line)| counts(line)) else {
            return Err(fault(1, None, "the table is empty: expected a header".into()).into());
        };
        let separator = [';', '\t'].into_iter().find(|c| header.contains(*c)).unwrap_or(',');
        let cells = |line: &str| -> Vec<String> {
            csv_fields(line, |c| c == separator, false).iter().map(|cell| cell.trim().to_owned()).collect()
        };
        let column = |line: &str, field: usize| csv_column(line, |c| c == separator, false, field);
        // Names are there, different, and not numbers.
        let names = cells(header);
        for (k, name) in names.iter().enumerate() {
            let message = match name {
                name if name.is_empty() => format!("column {} of the header has no name", k + 1),
                name if names[..k].contains(name) => {
                    let first = names[..k].iter().position(|other| other == name).unwrap_or(k) + 1;
                    format!("the header names {name:?} twice, in columns {first} and {}: rename or remove one", k + 1)
                }
                name if name.parse::<f64>().is_ok() => {
                    format!("the first row has the number {name} where a name was expected: add a header")
                }
                _ => continue,
            };
            return Err(fault(header_line, column(header, k), message).into());
        }
        // One number per name in each row.
        let mut table = Self { names, rows: Vec::new(), lines: Vec::new(), path: path.to_owned(), header_line };
        for (line, text) in lines.filter(|(_, line)| counts(line)) {
            let cells = cells(text);
            let (found, expected) = (cells.len(), table.names.len());
            if found != expected {
                let message = format!("expected {expected} cells as in the header, found {found}");
                return Err(fault(line, None, message).into());
            }
            let value = |(k, cell): (usize, &String)| {
                number_of(cell, separator != ',').ok_or_else(|| {
                    let message = format!("column {:?}: expected a number, found {cell:?}", table.names[k]);
                    fault(line, column(text, k), message)
                })
            };
            let row = cells.iter().enumerate().map(value).collect::<Result<Vec<f64>, _>>()?;
            table.rows.push(row);
            table.lines.push(line);
        }
        Ok(table)
    }

    /// Creates an error about a row, counted from 0; `None` for the header.
    pub fn error(&self, row: Option<usize>, message: impl Into<String>) -> FileError {
        let line = row.map_or(self.header_line, |row| self.lines[row]);
        TextFileError { path: self.path.clone(), line, column: 1, message: message.into(), page: "" }.into()
    }

    /// Index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }
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
