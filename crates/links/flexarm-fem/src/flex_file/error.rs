//! What can be wrong in the text of a reduced-link file, and where.

use crate::error::FemError;

/// The sort of mistake, for programs; the message is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlexErrorKind {
    /// The file could not be opened or is not UTF-8 text.
    Unreadable,
    /// Not TOML.
    Syntax,
    /// Another format, or a version this program does not know.
    Format,
    /// A required key or table is not there.
    MissingKey,
    /// A key that the format does not have.
    UnknownKey,
    /// A value of the wrong type, such as text for a number.
    WrongType,
    /// An array of the wrong length.
    WrongSize,
    /// A NaN, an infinity, or a number too large to hold.
    NotFinite,
    /// A unit that is not one of the accepted ones.
    Unit,
    /// Text that is not one of the accepted words.
    Word,
    /// A rotation matrix that is none.
    Rotation,
    /// A part that is there twice, or not at all.
    Part,
    /// Well-formed numbers that cannot be a link; see the source of the error.
    Link,
}

/// A mistake in a reduced-link file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{origin}:{line}:{column}: {element}: found {found}; expected {expected}{}", mend(.help))]
pub struct FlexFileError {
    /// The sort of mistake.
    pub kind: FlexErrorKind,
    /// File, or the name that was given to the text.
    pub origin: Box<str>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The element, such as `stiffness.matrix[2][3]` (row and column from 0).
    pub element: Box<str>,
    /// What stands there.
    pub found: Box<str>,
    /// What may stand there.
    pub expected: Box<str>,
    /// How to mend it; may be empty.
    pub help: Box<str>,
    /// Why the link was refused, for [`FlexErrorKind::Link`].
    #[source]
    pub source: Option<Box<FemError>>,
}

fn mend(help: &str) -> String {
    if help.is_empty() { String::new() } else { format!(" ({help})") }
}
