//! Bytes of a mesh file, and errors with positions in them.
//!
//! Readers only keep byte offsets; a line number is computed when a message needs it.

use crate::error::{FeFileError, FilePosition};

/// Contents of the whole file.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// Decompressed bytes.
    pub bytes: &'a [u8],
    /// Name of the file.
    pub origin: &'a str,
    /// Whether positions are bytes rather than lines.
    pub binary: bool,
}

impl Source<'_> {
    /// Creates an error at a byte offset.
    pub(super) fn error(
        &self,
        offset: usize,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> FeFileError {
        let offset = offset.min(self.bytes.len());
        let place = if self.binary {
            FilePosition::Byte(offset)
        } else {
            FilePosition::Line(1 + self.bytes[..offset].iter().filter(|byte| **byte == b'\n').count())
        };
        FeFileError::new(self.origin, place, element, found, expected)
    }

    /// Creates an error of the file as a whole.
    pub(super) fn error_in_file(
        &self,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> FeFileError {
        FeFileError::new(self.origin, FilePosition::File, element, found, expected)
    }
}

/// Shows a piece of the file in a message: short, on one line, readable for any bytes.
pub(super) fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let cut = &bytes[..bytes.len().min(LONGEST)];
    let dots = if bytes.len() > LONGEST { "..." } else { "" };
    format!("{:?}{dots}", String::from_utf8_lossy(cut))
}

/// Parses an unsigned integer: digits with an optional `+`.
pub(super) fn parse_u64(token: &[u8]) -> Option<u64> {
    let token = token.strip_prefix(b"+").unwrap_or(token);
    if token.is_empty() {
        return None;
    }
    token.iter().try_fold(0_u64, |value, byte| match byte {
        b'0'..=b'9' => value.checked_mul(10)?.checked_add(u64::from(byte - b'0')),
        _ => None,
    })
}

/// Parses a real number, also in Fortran notation `1.5D+03`. The result may be infinite or NaN.
pub(super) fn parse_f64(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    text.contains(['d', 'D']).then(|| text.replace(['d', 'D'], "e").parse().ok()).flatten()
}
