//! Errors of a structure, a cutter or the computation of limits.

/// Reason why a limit cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChatterError {
    /// An entry is not finite.
    #[error("{what} has a value that is not finite")]
    NotFinite {
        /// Description of the quantity.
        what: &'static str,
    },
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
    /// A value is invalid.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Name of the quantity.
        what: &'static str,
        /// Value found.
        found: f64,
        /// Values expected.
        expected: &'static str,
    },
    /// A matrix does not fit the others.
    #[error("the {what} is {} x {}, expected {} x {}", found.0, found.1, expected.0, expected.1)]
    Size {
        /// Name of the matrix.
        what: &'static str,
        /// Number of rows and columns.
        found: (usize, usize),
        /// Expected number of rows and columns.
        expected: (usize, usize),
    },
    /// A matrix is not positive definite.
    #[error("the {what} is not positive definite")]
    NotPositiveDefinite {
        /// Name of the matrix.
        what: &'static str,
    },
    /// An eigenvalue iteration does not converge.
    #[error("the eigenvalue iteration for {what} does not converge")]
    NotConverged {
        /// Description of the matrix.
        what: &'static str,
    },
    /// A tooth period contains too many oscillations.
    #[error(
        "at {rpm:.0} rpm a tooth period contains too many oscillations: {unknowns} unknowns, the maximum is {most}; \
         use a higher spindle speed, or remove modes with no influence"
    )]
    TooSlow {
        /// Spindle speed (1/min).
        rpm: f64,
        /// Size of the map.
        unknowns: usize,
        /// Maximum size.
        most: usize,
    },
    /// The poles do not reproduce the frequency response of the structure.
    #[error(
        "the modes reproduce the frequency response of the structure with a relative error of {found:.1e}, expected \
         at most {allowed:.0e}: are two modes equal?"
    )]
    NotModal {
        /// Relative difference.
        found: f64,
        /// Maximum relative difference.
        allowed: f64,
    },
}
