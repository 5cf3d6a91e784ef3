//! Nastran OUTPUT4 binary: Fortran records, little or big endian, dense or sparse, BIGMAT or not.
//!
//! Start at [`parse`]. A record has its length before and after it; the first one of a matrix is
//! its header, each further one a column, and a column after the last one ends the matrix. Not
//! here: text, and checks of the header ([`super::op4_text`]).

use super::matrix::{LabelledMatrix, Triplets};
use super::op4_text::Header;
use super::position::ErrorPosition;
use crate::FeFileError;

/// Bytes with their byte order.
struct Records<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
    origin: &'a str,
}

/// Reads all square matrices.
pub(super) fn parse(bytes: &[u8], origin: &str) -> Result<Vec<LabelledMatrix>, FeFileError> {
    let is_big_endian = bytes.starts_with(&24_u32.to_be_bytes());
    let mut records = Records { bytes, at: 0, is_big_endian, origin };
    let mut matrices = Vec::new();
    while records.at < bytes.len() {
        let head = records.next("header")?;
        if head.len() != 24 {
            return Err(records.fail("header", format!("a record of {} bytes", head.len()), "24 bytes"));
        }
        let numbers = [0, 1, 2, 3].map(|i| i64::from(records.integer(head, i)));
        let name = String::from_utf8_lossy(&head[16..24]).trim().to_owned();
        let header = Header::new(&name, numbers, &ErrorPosition::file(origin))?;
        let mut triplets = Triplets::default();
        while records.column(&header, &mut triplets)? {}
        matrices.extend(header.finish(triplets, origin)?);
    }
    Ok(matrices)
}

impl<'a> Records<'a> {
    fn fail(&self, what: &str, found: impl Into<Box<str>>, expected: &str) -> FeFileError {
        let element = format!("{what} before byte {}", self.at);
        let help = "is the file cut off, or was it copied as text?";
        ErrorPosition::file(self.origin).fail(element, found, expected, help)
    }

    /// Copies the first `N` bytes, the least significant one first.
    fn little<const N: usize>(&self, bytes: &[u8]) -> [u8; N] {
        let mut number = [0; N];
        number.copy_from_slice(&bytes[..N]);
        if self.is_big_endian {
            number.reverse();
        }
        number
    }

    /// Reads the 32-bit integer at word `i`, which must be in range.
    fn integer(&self, bytes: &[u8], i: usize) -> i32 {
        i32::from_le_bytes(self.little(&bytes[4 * i..]))
    }

    fn number(&self, bytes: &[u8], is_double: bool) -> f64 {
        if is_double { f64::from_le_bytes(self.little(bytes)) } else { f32::from_le_bytes(self.little(bytes)).into() }
    }

    /// Reads the payload of the next record.
    fn next(&mut self, what: &str) -> Result<&'a [u8], FeFileError> {
        let rest = &self.bytes[self.at..];
        let length = |at: usize| Some(self.integer(rest.get(at..at.checked_add(4)?)?, 0));
        let payload = length(0).and_then(|size| {
            let size = usize::try_from(size).ok()?;
            let payload = rest.get(4..size.checked_add(4)?)?;
            (length(size + 4)? as usize == size).then_some(payload)
        });
        let Some(payload) = payload else {
            return Err(self.fail(what, "no whole record", "its length before and after it"));
        };
        self.at += payload.len() + 8;
        Ok(payload)
    }

    /// Reads one column; `false` after the last.
    fn column(&mut self, header: &Header, triplets: &mut Triplets) -> Result<bool, FeFileError> {
        let what = format!("column of {}", header.name);
        let record = self.next(&what)?;
        if record.len() < 12 || !record.len().is_multiple_of(4) {
            return Err(self.fail(&what, format!("a record of {} bytes", record.len()), "12 or more, full words"));
        }
        let [column, row, words] = [0, 1, 2].map(|i| self.integer(record, i));
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else {
            return Err(self.fail(&what, format!("column {column}, row {row}"), "positive numbers"));
        };
        if column == header.columns + 1 {
            return Ok(false);
        }
        if column == 0 || column > header.columns {
            return Err(self.fail(&what, format!("column {column}"), "a column of the matrix"));
        }
        let data = usize::try_from(words).ok().and_then(|words| record[12..].get(..words.checked_mul(4)?));
        let Some(mut data) = data else {
            let found = format!("{words} words in {} bytes", record.len());
            return Err(self.fail(&what, found, "as many words as it says"));
        };
        if row > 0 {
            self.values(header, data, row, column, triplets)?;
            return Ok(true);
        }
        // Sparse column: strings, each preceded by its length and first row.
        while !data.is_empty() {
            let lead = if header.big { 2 } else { 1 };
            if data.len() < 4 * lead {
                return Err(self.fail(&what, "the end of the column", "a string"));
            }
            let first = i64::from(self.integer(data, 0));
            let (length, row) =
                if header.big { (first - 1, i64::from(self.integer(data, 1))) } else { Header::string(first) };
            let string = usize::try_from(length).ok().and_then(|length| data[4 * lead..].get(..length.checked_mul(4)?));
            let (Some(string), Ok(row)) = (string, usize::try_from(row)) else {
                return Err(self.fail(&what, format!("a string of {length} words at row {row}"), "one that fits"));
            };
            self.values(header, string, row, column, triplets)?;
            data = &data[4 * lead + string.len()..];
        }
        Ok(true)
    }

    /// Adds values from `row` (from 1) downwards.
    fn values(
        &self,
        header: &Header,
        data: &[u8],
        row: usize,
        column: usize,
        triplets: &mut Triplets,
    ) -> Result<(), FeFileError> {
        let size = if header.is_double { 8 } else { 4 };
        let count = data.len() / size;
        let fits = row > 0 && row.checked_add(count).is_some_and(|end| end <= header.rows + 1);
        if !data.len().is_multiple_of(size) || !fits {
            let found = format!("{} bytes at row {row}", data.len());
            return Err(self.fail("values", found, "whole numbers of rows of the matrix"));
        }
        let place = ErrorPosition::file(self.origin);
        for (i, bytes) in data.chunks_exact(size).enumerate() {
            let value = self.number(bytes, header.is_double);
            if !value.is_finite() {
                let element = format!("entry ({}, {column}) of {}", row + i, header.name);
                return Err(place.fail(element, value.to_string(), "a finite number", ""));
            }
            triplets.push(row + i - 1, column - 1, value, &place);
        }
        Ok(())
    }
}
