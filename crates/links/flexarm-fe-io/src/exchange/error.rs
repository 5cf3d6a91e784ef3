//! Errors in matrix files, with their position.

/// Kind of error, for programs; the message is for users.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExchangeErrorKind {
    /// The file could not be opened or unpacked.
    Unreadable,
    /// The format is not one that this program reads.
    NotRecognised,
    /// The format is known, but this variant is not a stiffness or mass, for example complex
    /// numbers.
    Unsupported,
    /// The text does not follow the format.
    Syntax,
    /// The file has fewer or more entries than it declares.
    WrongSize,
    /// A number is NaN, infinite or too large.
    NotFinite,
    /// An entry occurs twice with different values, or mirrored entries differ.
    Unequal,
    /// Several interpretations are possible, and the user must choose.
    Ambiguous,
    /// Required data is not in the file.
    Missing,
    /// The map of interfaces does not fit the rows of the matrix.
    Interface,
    /// The matrix is well formed but known to be wrong.
    Defective,
}

/// Error in a matrix file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{origin}{}: {element}: found {found}; expected {expected}{}", at(.line), mend(.help))]
pub struct ExchangeError {
    /// Kind of error.
    pub kind: ExchangeErrorKind,
    /// File, or the name given to the bytes.
    pub origin: Box<str>,
    /// Line, from 1; `None` for the file as a whole or a binary file.
    pub line: Option<usize>,
    /// Element, such as `entry (3, 4)` (row and column from 1, as in the files).
    pub element: Box<str>,
    /// Text or value found.
    pub found: Box<str>,
    /// Text or value expected.
    pub expected: Box<str>,
    /// Hint for a correction; may be empty.
    pub help: Box<str>,
}

fn at(line: &Option<usize>) -> String {
    line.map(|line| format!(":{line}")).unwrap_or_default()
}

fn mend(help: &str) -> String {
    if help.is_empty() { String::new() } else { format!(" ({help})") }
}

/// Position of an error: a file and, for text, a line of it.
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

    pub(super) fn fail(
        &self,
        kind: ExchangeErrorKind,
        element: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
        help: impl Into<Box<str>>,
    ) -> ExchangeError {
        ExchangeError {
            kind,
            origin: self.origin.into(),
            line: self.line,
            element: element.into(),
            found: found.into(),
            expected: expected.into(),
            help: help.into(),
        }
    }
}
