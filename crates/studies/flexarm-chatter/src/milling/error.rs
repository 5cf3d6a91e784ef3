//! What can be wrong with a structure, a cutter or a question.

/// Why there is no limit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChatterError {
    /// An entry that is no number.
    #[error("{what} has a value that is not finite")]
    NotFinite {
        /// Of what.
        what: &'static str,
    },
    /// A mode that does not decay: no depth is stable.
    #[error(
        "the mode at {:.3} Hz has the damping ratio {damping_ratio:.1e}: without damping no depth is stable",
        rad_per_s / std::f64::consts::TAU
    )]
    Undamped {
        /// Its size, rad/s.
        rad_per_s: f64,
        /// Its damping ratio.
        damping_ratio: f64,
    },
    /// A number outside of what makes sense.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Which one.
        what: &'static str,
        /// What it is.
        found: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// A matrix of another size than the others.
    #[error("the {what} is {} x {}, expected {} x {}", found.0, found.1, expected.0, expected.1)]
    Size {
        /// Which one.
        what: &'static str,
        /// Rows and columns.
        found: (usize, usize),
        /// What fits.
        expected: (usize, usize),
    },
    /// A matrix that must be positive definite and is not.
    #[error("the {what} is not positive definite")]
    NotPositiveDefinite {
        /// Which one.
        what: &'static str,
    },
    /// An eigenvalue iteration that does not end.
    #[error("the eigenvalues of {what} were not found: the iteration does not end")]
    NotConverged {
        /// Of what.
        what: &'static str,
    },
    /// A tooth period that holds too many oscillations.
    #[error(
        "at {rpm:.0} rpm a tooth period holds too many oscillations: {unknowns} unknowns, at most {most}; ask for a higher spindle speed, \
         or leave out modes that do not matter"
    )]
    TooSlow {
        /// Spindle speed, 1/min.
        rpm: f64,
        /// Size of the map.
        unknowns: usize,
        /// Largest size.
        most: usize,
    },
    /// Poles that do not give back the structure.
    #[error(
        "the modes give the frequency response of the structure to {found:.1e} only, expected {allowed:.0e}: are two modes the same?"
    )]
    NotModal {
        /// Relative difference.
        found: f64,
        /// Largest one allowed.
        allowed: f64,
    },
}
