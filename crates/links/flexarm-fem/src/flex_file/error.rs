//! Errors in the text of a reduced-link file, with their position.
//!
//! Lines and columns count from 1. Start at [`FlexFileError`]. Not here: reading (`read.rs`).

use flexarm_settings::Place;

use crate::error::FemError;

/// Kind of error, for programs; the message is for users.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlexErrorKind {
    /// The file could not be opened or is not UTF-8 text.
    Unreadable,
    /// The text is not TOML.
    Syntax,
    /// The format is another one, or its version is unknown to this program.
    Format,
    /// A required key or table is missing.
    MissingKey,
    /// A key is not part of the format.
    UnknownKey,
    /// A value has the wrong type, such as text for a number.
    WrongType,
    /// An array has the wrong length.
    WrongSize,
    /// A number is NaN, infinite or too large.
    NotFinite,
    /// A unit is not an accepted one.
    Unit,
    /// A text is not one of the accepted words.
    Word,
    /// A matrix is not a rotation matrix.
    Rotation,
    /// A part is given twice, or not at all.
    Part,
    /// The numbers are well formed but impossible for a link; see the source of the error.
    Link,
}

/// Error in a reduced-link file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}: {element}: found {found}; expected {expected}{}", Place::of_file(origin).at(*line, *column), mend(.help))]
pub struct FlexFileError {
    /// Kind of error.
    pub kind: FlexErrorKind,
    /// File, or the name given to the text.
    pub origin: Box<str>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Element of the document, such as `stiffness.matrix[2][3]` (row and column from 0).
    pub element: Box<str>,
    /// Text or value found.
    pub found: Box<str>,
    /// Text or value expected.
    pub expected: Box<str>,
    /// Hint for a correction; may be empty.
    pub help: Box<str>,
    /// Reason why the link was rejected, for [`FlexErrorKind::Link`].
    #[source]
    pub source: Option<Box<FemError>>,
}

fn mend(help: &str) -> String {
    if help.is_empty() { String::new() } else { format!(" ({help})") }
}
