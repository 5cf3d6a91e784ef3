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
