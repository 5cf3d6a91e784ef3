//! Errors of stress fields and of their file.

/// Remedy for a file that does not fit its link or its format.
const REDUCE_AGAIN: &str = "reduce the mesh again, with its stress";

/// Error in a file of stress fields.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}; {REDUCE_AGAIN}")]
pub struct StressFileError(pub(super) String);

/// Error of stress fields that do not fit a point or a link.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StressError {
    /// The fields have no surface.
    #[error("the stress file has no surface")]
    NoSurface,
    /// A point is not on the surface.
    #[error(
        "the nearest node of the surface, at ({:.1}, {:.1}, {:.1}) mm, is {off_mm:.1} mm away, farther than the edges of the \
         mesh there: give a point on the surface, in the axes of the link (m)",
        nearest_mm[0], nearest_mm[1], nearest_mm[2]
    )]
    OffSurface {
        /// Nearest node of the surface, link axes, mm.
        nearest_mm: [f64; 3],
        /// Its distance, mm.
        off_mm: f64,
    },
    /// A direction is normal to the surface.
    #[error(
        "the direction has no part along the surface, whose normal there is [{}, {}, {}]",
        normal[0], normal[1], normal[2]
    )]
    NormalDirection {
        /// Outward normal, link axes, rounded to two decimals.
        normal: [f64; 3],
    },
    /// A modal link has other coordinates than the fields.
    #[error(
        "stress is stored for {interfaces} interfaces and {modes} fixed-interface modes, which are not the coordinates of the \
         modal link: leave out eigenmodes, or {REDUCE_AGAIN}"
    )]
    OtherCoordinates {
        /// Number of interfaces, without the first.
        interfaces: usize,
        /// Number of modes.
        modes: usize,
    },
    /// The stiffness of a link is not that of the fields.
    #[error(
        "the stress file belongs to another link: stiffness times its compliance differs from 1 by {off:.1e}; {REDUCE_AGAIN}"
    )]
    OtherLink {
        /// Maximum relative difference.
        off: f64,
    },
    /// A modal stiffness is not positive definite.
    #[error("the stiffness of the modal link is not positive definite")]
    SingularLink,
    /// The stiffness of an elastic joint is singular.
    #[error("the stiffness of a joint is singular")]
    SingularJoint,
}
