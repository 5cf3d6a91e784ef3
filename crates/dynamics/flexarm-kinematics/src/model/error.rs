//! Reasons why a mechanism is not a valid tree.

/// Maximum number of independent coordinates of a model: memory grows with their square and the
/// time of a step with their cube.
pub const MAX_COORDINATES: usize = 600;

/// Reason why a mechanism is not a valid tree. Messages name the links and joints.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The parts do not form a tree, have equal names, or refer to parts that do not exist.
    #[error("{0}")]
    Structure(String),
    /// A quantity of a part is not finite, out of range or impossible.
    #[error("{0}")]
    Value(String),
    /// A loop closure is invalid.
    #[error("loop {name:?}: {what}")]
    BadLoop {
        /// The loop.
        name: String,
        /// Description of the problem.
        what: String,
    },
}

impl ModelError {
    /// Two parts, such as links, have the same name.
    pub(crate) fn duplicate(part: &str, name: &str) -> Self {
        Self::Structure(format!("{part} {name:?} is defined twice: names must be unique"))
    }

    /// A quantity of a part is NaN or infinite.
    pub(crate) fn not_finite(what: &str, name: &str) -> Self {
        Self::Value(format!("{what} of {name:?} has a NaN or infinite entry"))
    }

    /// A modal link does not fit the tree.
    pub(crate) fn modal(link: &str, what: &str) -> Self {
        Self::Structure(format!("link {link:?} is modal, but {what} is wrong"))
    }
}
