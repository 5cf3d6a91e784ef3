//! Errors of a structure, a cutter or the computation of limits.

/// Reason why a limit cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChatterError {
    /// A mode does not decay: no depth is stable.
    #[error(
        "the mode at {:.3} Hz has the damping ratio {damping_ratio:.1e}: without damping no depth is stable",
        rad_per_s / std::f64::consts::TAU
    )]
    Undamped {
        /// Magnitude of the pole (rad/s).
        rad_per_s: f64,
        /// Damping ratio of the mode.
        damping_ratio: f64,
    },
    /// A matrix, a value or an option is invalid: what was found and what is expected.
    #[error("{0}")]
    Invalid(String),
    /// An eigenvalue iteration does not converge, or its modes do not reproduce the structure.
    #[error("{0}")]
    Unsolved(String),
}

impl ChatterError {
    pub(crate) fn not_finite(what: &str) -> Self {
        Self::Invalid(format!("{what} has a value that is not finite"))
    }

    pub(crate) fn value(what: &str, found: f64, expected: &str) -> Self {
        Self::Invalid(format!("{what} is {found}, expected {expected}"))
    }

    pub(crate) fn size(what: &str, found: (usize, usize), expected: (usize, usize)) -> Self {
        let [found, expected] = [found, expected].map(|(rows, columns)| format!("{rows} x {columns}"));
        Self::Invalid(format!("the {what} is {found}, expected {expected}"))
    }

    pub(crate) fn not_positive_definite(what: &str) -> Self {
        Self::Invalid(format!("the {what} is not positive definite"))
    }
}
