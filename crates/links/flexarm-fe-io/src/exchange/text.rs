//! Splits bytes into lines, words and numbers, as written by Fortran and C programs.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::position::ErrorPosition;
use crate::FeFileError;
use crate::unpack::{is_gzip, unpacked};

/// Maximum unpacked size, bytes; a full model of 300 000 unknowns takes half of it.
pub(super) const LARGEST_UNPACKED: u64 = 2 << 30;

/// Returns the bytes, unpacked if they are compressed with gzip.
pub(super) fn unpack<'b>(bytes: &'b [u8], origin: &str) -> Result<Cow<'b, [u8]>, FeFileError> {
    if !is_gzip(bytes) {
        return Ok(Cow::Borrowed(bytes));
    }
    let unpacked = unpacked(bytes, LARGEST_UNPACKED);
    unpacked.map(Cow::Owned).map_err(|e| ErrorPosition::file(origin).fail("gzip data", e.found, e.expected, e.help))
}

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
    /// `origin`: name in messages.
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

/// Parses a real number, also with the exponent letter D or without one, as in `1.5-3`.
///
/// NaN and infinity are returned; the caller rejects them.
pub fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    // The sign of an exponent without a letter is the last sign after a digit or a point.
    let bytes = text.as_bytes();
    let digit = |i: usize| bytes[i].is_ascii_digit() || bytes[i] == b'.';
    let exponent = (1..bytes.len()).rev().find(|&i| matches!(bytes[i], b'+' | b'-') && digit(i - 1));
    let letters = |c| if matches!(c, 'd' | 'D') { 'e' } else { c };
    let mended: String = match exponent {
        Some(i) => format!("{}e{}", &text[..i], &text[i..]),
        None => text.chars().map(letters).collect(),
    };
    mended.parse().ok()
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

    pub(super) fn integer(&self, element: &str, text: &str) -> Result<i64, FeFileError> {
        let wrong = || self.fail(element, shown(text), "a whole number", "");
        text.trim().parse().map_err(|_| wrong())
    }

    /// Parses a row or column number from 1; returns it from 0.
    pub(super) fn index(&self, element: &str, text: &str) -> Result<usize, FeFileError> {
        let wrong = || {
            let expected = "a row or column number from 1 to 4294967295";
            self.fail(element, shown(text), expected, "")
        };
        match text.trim().parse::<u32>() {
            Ok(index) if index > 0 => Ok(index as usize - 1),
            _ => Err(wrong()),
        }
    }

    /// Returns the next word of a line.
    pub(super) fn word<'w>(
        &self,
        element: &str,
        words: &mut impl Iterator<Item = &'w str>,
    ) -> Result<&'w str, FeFileError> {
        words.next().ok_or_else(|| self.fail(element, "the end of the line", "one more value", "is the file cut off?"))
    }

    /// Rejects anything after the last value of a line.
    pub(super) fn end<'w>(&self, words: &mut impl Iterator<Item = &'w str>) -> Result<(), FeFileError> {
        let Some(word) = words.next() else { return Ok(()) };
        Err(self.fail("line", shown(word), "the end of the line", ""))
    }
}

/// Quotes text of a file, shortened.
pub(super) fn shown(text: &str) -> String {
    const LONGEST: usize = 40;
    let text = text.trim();
    if text.is_empty() {
        return "nothing".into();
    }
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}
