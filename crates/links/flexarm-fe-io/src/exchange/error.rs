//! What can be wrong with a file of matrices, and where.

/// The sort of mistake, for programs; the message is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExchangeErrorKind {
    /// The file could not be opened or unpacked.
    Unreadable,
    /// None of the formats that this program reads.
    NotRecognised,
    /// A known format, but a variant that cannot be a stiffness or a mass, such as complex numbers.
    Unsupported,
    /// Text that does not follow the format.
    Syntax,
    /// Fewer or more entries than the file itself says.
    WrongSize,
    /// A NaN, an infinity, or a number too large to hold.
    NotFinite,
    /// The same entry twice with different values, or mirrored entries that differ.
    Unequal,
    /// More than one answer is possible: the user must choose.
    Ambiguous,
    /// Something that is needed is not in the file.
    Missing,
    /// The map of interfaces does not fit the rows of the matrix.
    Interface,
    /// A matrix that is well formed but known to be wrong.
    Defective,
}

/// A mistake in a file of matrices.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{origin}{}: {element}: found {found}; expected {expected}{}", at(.line), mend(.help))]
pub struct ExchangeError {
    /// The sort of mistake.
    pub kind: ExchangeErrorKind,
    /// File, or the name that was given to the bytes.
    pub origin: Box<str>,
    /// Line, from 1; `None` where the file as a whole or a binary file is meant.
    pub line: Option<usize>,
    /// The element, such as `entry (3, 4)` (row and column from 1, as in the files).
    pub element: Box<str>,
    /// What stands there.
    pub found: Box<str>,
    /// What may stand there.
    pub expected: Box<str>,
    /// How to mend it; may be empty.
    pub help: Box<str>,
}

fn at(line: &Option<usize>) -> String {
    line.map(|line| format!(":{line}")).unwrap_or_default()
}

fn mend(help: &str) -> String {
    if help.is_empty() { String::new() } else { format!(" ({help})") }
}

/// A file and, in text, a line of it: where an error happens.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) origin: &'a str,
    pub(super) line: Option<usize>,
}

impl<'a> Place<'a> {
    /// The file as a whole.
    pub(super) fn file(origin: &'a str) -> Self {
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
