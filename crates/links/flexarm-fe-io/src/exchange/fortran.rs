//! Fortran edit descriptors: `(8I10)`, `(1P,3E25.16)`, `1P5D16.9`, fields of such formats, and
//! numbers as Fortran writes them.

use super::position::ErrorPosition;
use crate::FeFileError;
use crate::number::shown;

/// Repeated fields of equal width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format {
    /// Number of columns of each field.
    pub width: usize,
}

/// Parses the last descriptor of a format.
pub fn parse_format(text: &str, place: &ErrorPosition<'_>) -> Result<Format, FeFileError> {
    let upper = text.to_ascii_uppercase();
    let width = upper.rfind(['I', 'E', 'D', 'F', 'G']).and_then(|letter| {
        let digits: String = upper[letter + 1..].chars().take_while(char::is_ascii_digit).collect();
        digits.parse().ok().filter(|width| (1..=80).contains(width))
    });
    let expected = "a Fortran format such as (3E25.16)";
    let wrong = || place.fail("format", shown(text), expected, "");
    width.map(|width| Format { width }).ok_or_else(wrong)
}

impl Format {
    /// Splits a line into fields; blank ones at its end are omitted.
    pub fn fields<'l>(&self, line: &'l str) -> impl Iterator<Item = &'l str> + use<'l> {
        // Columns are bytes; a line with non-ASCII characters has no valid numbers and is treated
        // as empty.
        let line = if line.is_ascii() { line.trim_end() } else { "" };
        let width = self.width;
        (0..line.len().div_ceil(width)).map(move |i| line[i * width..line.len().min((i + 1) * width)].trim())
    }
}

/// Formats as `1.2345E+08` with `decimals` digits after the point, right-aligned in `width`.
pub(super) fn fortran(value: f64, decimals: usize, width: usize) -> String {
    let printed = format!("{value:.decimals$E}");
    let (mantissa, exponent) = printed.split_once('E').unwrap_or((&printed, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let sign = if exponent < 0 { '-' } else { '+' };
    // A three-digit exponent replaces the letter, as in Fortran.
    let letter = if exponent.abs() < 100 { "E" } else { "" };
    format!("{:>width$}", format!("{mantissa}{letter}{sign}{:02}", exponent.abs()))
}
