//! Errors of stress fields and of their file.

/// Remedy for a file that does not fit its link or its format.
pub(super) const REDUCE_AGAIN: &str = "reduce the mesh again, with its stress";

/// Error of stress fields: of their file, or of a point or a link that they do not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct StressError(pub(super) String);

impl StressError {
    /// An invalid file, or one that belongs to another link.
    pub(super) fn file(what: impl std::fmt::Display) -> Self {
        Self(format!("{what}; {REDUCE_AGAIN}"))
    }
}
