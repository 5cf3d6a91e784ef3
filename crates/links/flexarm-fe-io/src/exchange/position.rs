//! Position of an error in a matrix file.

use crate::error::{FeFileError, FilePosition};

/// A file and, for text, a line of it.
#[derive(Debug, Clone, Copy)]
pub struct ErrorPosition<'a> {
    pub(super) origin: &'a str,
    pub(super) line: Option<usize>,
}

impl<'a> ErrorPosition<'a> {
    /// Refers to the file as a whole.
    pub fn file(origin: &'a str) -> Self {
        Self { origin, line: None }
    }

    pub(super) fn line(origin: &'a str, line: usize) -> Self {
        Self { origin, line: Some(line) }
    }

    /// Place, as in errors.
    pub(super) fn place(&self) -> String {
        format!("{}{}", self.origin, self.line.map_or(FilePosition::File, FilePosition::Line))
    }

    pub(super) fn fail(
        &self,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
        help: impl Into<Box<str>>,
    ) -> FeFileError {
        let place = self.line.map_or(FilePosition::File, FilePosition::Line);
        FeFileError::new(self.origin, place, element, found, expected).help(help)
    }
}
