//! Party responsible for an error.

/// Party responsible for an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The input: files, values, output locations. The same call would fail in the same way.
    Input,
    /// The run: it stopped, was stopped, or its results could not be written.
    Run,
}
