//! The error of a file that cannot be read.
//!
//! [`FeFileError`] states file, line or byte, value found, value expected, remedy. Not here: faults of
//! a mesh that can be read (`flexarm-fem`).

use std::fmt;

/// Position in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilePosition {
    /// The file as a whole.
    File,
    /// Line of a text file, from 1.
    Line(usize),
    /// Byte of a binary file, from 0.
    Byte(usize),
}

impl fmt::Display for FilePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ": byte {byte}"),
        }
    }
}

/// Error in a file of another finite element program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{origin}{place}: {element}: found {found}; expected {expected}{}", remedy(.help))]
#[non_exhaustive]
pub struct FeFileError {
    /// File, or the name given to the bytes.
    pub origin: Box<str>,
    /// Line or byte.
    pub place: FilePosition,
    /// Element of the file, such as `entry (3, 4)` (row and column from 1) or `*NSET INTERFACE_A`.
    pub element: Box<str>,
    /// Text or value found.
    pub found: Box<str>,
    /// Text or value expected.
    pub expected: Box<str>,
    /// Hint for a correction; may be empty.
    pub help: Box<str>,
}

impl FeFileError {
    pub(crate) fn new(
        origin: &str,
        place: FilePosition,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> Self {
        Self {
            origin: origin.into(),
            place,
            element: element.into(),
            found: found.into(),
            expected: expected.into(),
            help: "".into(),
        }
    }

    /// Adds a hint for a correction.
    #[must_use]
    pub(crate) fn help(self, help: impl Into<Box<str>>) -> Self {
        Self { help: help.into(), ..self }
    }
}

fn remedy(help: &str) -> String {
    if help.is_empty() { String::new() } else { format!(" ({help})") }
}
