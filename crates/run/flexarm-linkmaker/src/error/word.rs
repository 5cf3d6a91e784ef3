//! Errors of values in several notations, as users write them.

use flexarm_fem::FemError;

/// A text or number that is not the value of a setting: what was found and what is expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct WordError(pub(crate) String);

impl WordError {
    pub(crate) fn form(text: &str, expected: &str) -> Self {
        Self(format!("{text:?}: expected {expected}"))
    }
}

impl From<FemError> for WordError {
    fn from(error: FemError) -> Self {
        Self(error.to_string())
    }
}
