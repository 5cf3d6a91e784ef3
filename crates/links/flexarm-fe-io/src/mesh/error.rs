//! What can be wrong in a mesh file, and where.

use std::fmt;

/// The sort of mistake, for programs; the message is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshErrorKind {
    /// The file could not be opened or decompressed.
    Unreadable,
    /// Not a mesh format that is read here, or a version of one that is not.
    Format,
    /// Text or bytes that do not follow the format.
    Syntax,
    /// The file ends too early.
    Truncated,
    /// A NaN, an infinity, or a number too large to hold.
    NotFinite,
    /// An element type, a card or an option that exists but is not supported.
    Unsupported,
    /// A number or a name that is there twice.
    Duplicate,
    /// A reference to a node, element, set, material, ... that is not there.
    Missing,
    /// An element that cannot be: a repeated node, or a twin of another.
    Element,
    /// An element in two regions.
    Region,
    /// A material or a section with impossible numbers.
    Material,
    /// Larger than this program can hold.
    TooLarge,
}

/// Where in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, from 1.
    Line(usize),
    /// A byte of a binary file, from 0.
    Byte(usize),
}

/// A mistake in a mesh file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{origin}{place}: {element}: found {found}; expected {expected}{}", mend(.help))]
#[non_exhaustive]
pub struct MeshError {
    /// The sort of mistake.
    pub kind: MeshErrorKind,
    /// File, or the name that was given to the bytes.
    pub origin: Box<str>,
    /// Line or byte.
    pub place: Place,
    /// The thing at fault, such as `element 17` or `*NSET INTERFACE_A`.
    pub element: Box<str>,
    /// What stands there.
    pub found: Box<str>,
    /// What may stand there.
    pub expected: Box<str>,
    /// How to mend it; may be empty.
    pub help: Box<str>,
}

impl MeshError {
    /// The same with advice.
    #[must_use]
    pub(super) fn help(mut self, help: impl Into<Box<str>>) -> Self {
        self.help = help.into();
        self
    }
}

impl fmt::Display for Place {
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
