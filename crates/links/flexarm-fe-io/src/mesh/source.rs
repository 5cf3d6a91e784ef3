//! The bytes of a mesh file, and errors that know their place in them.
//!
//! Readers keep byte offsets only; a line number is counted when a message needs it.

use super::error::{MeshError, MeshErrorKind, Place};

/// The whole file.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// Its bytes, decompressed.
    pub(super) bytes: &'a [u8],
    /// Its name.
    pub(super) origin: &'a str,
    /// Whether places are bytes rather than lines.
    pub(super) binary: bool,
}

impl Source<'_> {
    /// A mistake at a byte offset.
    pub(super) fn error(
        &self,
        kind: MeshErrorKind,
        offset: usize,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> MeshError {
        let offset = offset.min(self.bytes.len());
        let place = if self.binary {
            Place::Byte(offset)
        } else {
            Place::Line(1 + self.bytes[..offset].iter().filter(|byte| **byte == b'\n').count())
        };
        self.error_in(kind, place, element, found, expected)
    }

    /// A mistake of the file as a whole.
    pub(super) fn error_in(
        &self,
        kind: MeshErrorKind,
        place: Place,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> MeshError {
        MeshError {
            kind,
            origin: self.origin.into(),
            place,
            element: element.into(),
            found: found.into(),
            expected: expected.into(),
            help: "".into(),
        }
    }
}

/// A piece of the file for a message: short, on one line, readable whatever the bytes are.
pub(super) fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let cut = &bytes[..bytes.len().min(LONGEST)];
    let dots = if bytes.len() > LONGEST { "..." } else { "" };
    format!("{:?}{dots}", String::from_utf8_lossy(cut))
}

/// An unsigned integer, digits only.
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

/// A real number; accepts Fortran's `1.5D+03`. May be infinite or NaN.
pub(super) fn parse_f64(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    text.contains(['d', 'D']).then(|| text.replace(['d', 'D'], "e").parse().ok()).flatten()
}
