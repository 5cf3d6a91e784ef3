//! Errors of stress fields and of their file.

/// Remedy for a file that does not fit its link or its format.
const REDUCE_AGAIN: &str = "reduce the mesh again, with its stress";

/// Error in a file of stress fields.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StressFileError {
    /// The bytes are not in the safetensors format.
    #[error("not a stress file: {cause}; {REDUCE_AGAIN}")]
    NotTensors {
        /// Message of the format's library.
        cause: String,
    },
    /// The metadata do not describe stress fields.
    #[error("its metadata have no key {key:?} with format, link and interfaces; {REDUCE_AGAIN}")]
    NoDescription {
        /// Key of the description.
        key: &'static str,
    },
    /// The format or its version is not the one of this program.
    #[error("format {found:?}, expected {expected:?}; {REDUCE_AGAIN}")]
    Format {
        /// Format of the file.
        found: String,
        /// Format that is read.
        expected: &'static str,
    },
    /// The tensors are not within the file.
    #[error("damaged: {cause}; {REDUCE_AGAIN}")]
    Damaged {
        /// Message of the format's library.
        cause: String,
    },
    /// A tensor is missing.
    #[error("tensor {name:?} is missing; {REDUCE_AGAIN}")]
    Missing {
        /// Its name.
        name: &'static str,
    },
    /// A tensor has numbers of another type.
    #[error("tensor {name:?} has numbers of the type {found}, expected {expected}; {REDUCE_AGAIN}")]
    NumberType {
        /// Its name.
        name: &'static str,
        /// Type found.
        found: String,
        /// Type expected.
        expected: String,
    },
    /// A tensor is not a matrix of the right width.
    #[error("tensor {name:?} has the shape {found:?}, expected rows of {width}; {REDUCE_AGAIN}")]
    Rows {
        /// Its name.
        name: &'static str,
        /// Shape found.
        found: Vec<usize>,
        /// Numbers in a row.
        width: usize,
    },
    /// The tensor of the stress does not fit the others.
    #[error("tensor \"stress\" has the shape {found:?}, expected {expected:?}; {REDUCE_AGAIN}")]
    StressShape {
        /// Shape found.
        found: Vec<usize>,
        /// Fields, sites, components.
        expected: [usize; 3],
    },
    /// Tensors about the sites have other lengths than their positions.
    #[error("its tensors \"node\", \"material\", \"from_tie\" do not have {sites} entries; {REDUCE_AGAIN}")]
    SeatCounts {
        /// Number of positions.
        sites: usize,
    },
    /// A material or a site is not there.
    #[error("an index is out of range; {REDUCE_AGAIN}")]
    IndexOutOfRange,
    /// The compliance does not have one row and column per unit wrench.
    #[error("tensor \"compliance\" has {found} entries, expected {expected}; {REDUCE_AGAIN}")]
    ComplianceSize {
        /// Number of entries found.
        found: usize,
        /// Number of entries expected.
        expected: usize,
    },
    /// A number is impossible.
    #[error("a number is not finite, or a stress beyond {largest:e} Pa per unit; {REDUCE_AGAIN}")]
    ImpossibleNumber {
        /// Bound of the stress, Pa per unit.
        largest: f32,
    },
    /// The number of poses is not that of the interfaces.
    #[error("{interfaces} interfaces have {poses} poses; {REDUCE_AGAIN}")]
    PoseCount {
        /// Number of interfaces.
        interfaces: usize,
        /// Number of poses.
        poses: usize,
    },
}

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
