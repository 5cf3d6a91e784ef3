//! Whom an error is to blame on.

/// Whom an error is to blame on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// What was given: files, values, places of results. The same call would end in the same way.
    Input,
    /// The run: it stopped on its way, was stopped, or its results could not be written.
    Run,
}
