//! Splits bytes into lines, words and numbers, as written by Fortran and C programs.
//!
//! Start at [`Text::lines`]; every line comes with its [`ErrorPosition`], whose methods read the
//! words of the line and name them in errors.
//! Not here: entries of Nastran ([`super::cards`]), fields of fixed width ([`super::fortran`]).

use std::borrow::Cow;
use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::position::ErrorPosition;
use crate::FeFileError;
use crate::number::{real, shown};
use crate::unpack::is_gzip;

/// Maximum unpacked size, bytes; a full model of 300 000 unknowns takes half of it.
pub(super) const LARGEST_UNPACKED: u64 = 2 << 30;

/// Returns the first bytes, unpacked; an unpacking error ends the result silently.
pub(super) fn unpack_head(bytes: &[u8], length: usize) -> Cow<'_, [u8]> {
    if !is_gzip(bytes) {
        return Cow::Borrowed(&bytes[..bytes.len().min(length)]);
    }
    let mut head = Vec::new();
    // Bytes unpacked before an error are kept; they are enough for recognition.
    let _ = MultiGzDecoder::new(bytes).take(length as u64).read_to_end(&mut head);
    Cow::Owned(head)
}

/// Text file with its name in messages.
#[derive(Debug, Clone, Copy)]
pub struct Text<'a> {
    pub(super) origin: &'a str,
    pub(super) text: &'a str,
}

impl<'a> Text<'a> {
    /// Text with the name `origin` in messages.
    pub fn new(text: &'a str, origin: &'a str) -> Self {
        Self { origin, text }
    }

    pub(super) fn file(&self) -> ErrorPosition<'a> {
        ErrorPosition::file(self.origin)
    }

    /// Iterates over all lines with their places, without line ends.
    pub(super) fn lines(&self) -> impl Iterator<Item = (ErrorPosition<'a>, &'a str)> + use<'a> {
        let origin = self.origin;
        self.text.lines().enumerate().map(move |(i, line)| (ErrorPosition::line(origin, i + 1), line))
    }
}

/// Splits a line into words at blanks and commas.
pub(super) fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split([',', ' ', '\t', '\r']).filter(|word| !word.is_empty())
}

impl ErrorPosition<'_> {
    /// Parses a finite number.
    pub(super) fn number(&self, element: &str, text: &str) -> Result<f64, FeFileError> {
        match real(text) {
            Some(number) if number.is_finite() => Ok(number),
            Some(_) => {
                let help = "NaN and infinity in a matrix mean that the program that wrote it failed";
                Err(self.fail(element, shown(text), "a finite number", help))
            }
            None => Err(self.fail(element, shown(text), "a number", "")),
        }
    }

    /// Parses an integer of either sign.
    pub(super) fn integer(&self, element: &str, text: &str) -> Result<i64, FeFileError> {
        text.trim().parse().ok().ok_or_else(|| self.fail(element, shown(text), "a whole number", ""))
    }

    /// Parses a row or column number from 1; returns it from 0.
    pub(super) fn index(&self, element: &str, text: &str) -> Result<usize, FeFileError> {
        match text.trim().parse::<u32>() {
            Ok(index) if index > 0 => Ok(index as usize - 1),
            _ => Err(self.fail(element, shown(text), "a row or column number from 1 to 4294967295", "")),
        }
    }

    /// Returns the next word of a line.
    pub(super) fn word<'w>(
        &self,
        element: &str,
        words: &mut dyn Iterator<Item = &'w str>,
    ) -> Result<&'w str, FeFileError> {
        words.next().ok_or_else(|| self.fail(element, "the end of the line", "one more value", "is the file cut off?"))
    }

    /// Reads the next word as an integer.
    pub(super) fn next_integer(
        &self,
        element: &str,
        words: &mut dyn Iterator<Item = &str>,
    ) -> Result<i64, FeFileError> {
        self.integer(element, self.word(element, words)?)
    }

    /// Reads the next word as a row or column number from 1; returns it from 0.
    pub(super) fn next_index(
        &self,
        element: &str,
        words: &mut dyn Iterator<Item = &str>,
    ) -> Result<usize, FeFileError> {
        self.index(element, self.word(element, words)?)
    }

    /// Reads the next word as a finite number.
    pub(super) fn next_number(&self, element: &str, words: &mut dyn Iterator<Item = &str>) -> Result<f64, FeFileError> {
        self.number(element, self.word(element, words)?)
    }

    /// Reads the numbers of rows and columns, which must be equal.
    pub(super) fn square_size(&self, words: &mut dyn Iterator<Item = &str>) -> Result<usize, FeFileError> {
        let rows = self.next_index("number of rows", words)? + 1;
        let columns = self.next_index("number of columns", words)? + 1;
        if rows == columns {
            return Ok(rows);
        }
        Err(self.fail("size", format!("{rows} rows and {columns} columns"), "a square matrix", ""))
    }

    /// Rejects anything after the last value of a line.
    pub(super) fn end(&self, words: &mut dyn Iterator<Item = &str>) -> Result<(), FeFileError> {
        let Some(word) = words.next() else { return Ok(()) };
        Err(self.fail("line", shown(word), "the end of the line", ""))
    }
}
