//! Errors in a mesh file, with their position.

use std::fmt;

/// Kind of error, for programs; the message is for users.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshErrorKind {
    /// The file could not be opened or decompressed.
    Unreadable,
    /// The format, or its version, is not supported.
    Format,
    /// Text or bytes do not follow the format.
    Syntax,
    /// The file ends too early.
    Truncated,
    /// A number is NaN, infinite or too large.
    NotFinite,
    /// An element type, card or option is not supported.
    Unsupported,
    /// A number or a name occurs twice.
    Duplicate,
    /// A referenced node, element, set, material or similar is missing.
    Missing,
    /// An element is invalid: a repeated node, or a duplicate of another element.
    Element,
    /// An element is in two regions.
    Region,
    /// A material or section has impossible values.
    Material,
    /// The data is larger than this program can handle.
    TooLarge,
}

/// Position in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilePosition {
    /// The file as a whole.
    File,
    /// Line of a text file, from 1.
    Line(usize),
    /// Byte of a binary file, from 0.
    Byte(usize),
}

/// Error in a mesh file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{origin}{place}: {element}: found {found}; expected {expected}{}", mend(.help))]
#[non_exhaustive]
pub struct MeshError {
    /// Kind of error.
    pub kind: MeshErrorKind,
    /// File, or the name given to the bytes.
    pub origin: Box<str>,
    /// Line or byte.
    pub place: FilePosition,
    /// Element of the file, such as `element 17` or `*NSET INTERFACE_A`.
    pub element: Box<str>,
    /// Text or value found.
    pub found: Box<str>,
    /// Text or value expected.
    pub expected: Box<str>,
    /// Hint for a correction; may be empty.
    pub help: Box<str>,
}

impl MeshError {
    /// Adds a hint for a correction.
    #[must_use]
    pub(super) fn help(mut self, help: impl Into<Box<str>>) -> Self {
        self.help = help.into();
        self
    }
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

fn mend(help: &str) -> String {
    if help.is_empty() { String::new() } else { format!(" ({help})") }
}
