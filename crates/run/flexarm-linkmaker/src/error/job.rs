//! Errors of numbers and names in a job, each with the value found and the one expected.

use flexarm_settings::Setting;

/// An invalid number or name of a reduction or an export.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// Modes chosen both by number and by frequency.
    #[error("modes and modes_up_to_hz exclude each other: give one of them")]
    ModesTwice,
    /// More modes than a reduction can keep.
    #[error("{} {found}: at most {most} modes can be kept", Setting::Modes)]
    TooManyModes {
        /// Number of modes requested.
        found: usize,
        /// Maximum number of modes.
        most: usize,
    },
    /// The frequency up to which modes are kept is not positive.
    #[error("{setting} {0}: a positive frequency in Hz is expected", setting = Setting::ModesUpTo)]
    ModesUpTo(f64),
    /// The number of parts of a chain is out of range.
    #[error("{setting} {0}: a chain has 2 to 100 parts", setting = Setting::Chains)]
    ChainParts(usize),
    /// The merge distance, in the unit of the mesh, is negative or not a number.
    #[error("merge = {0}: a distance of zero or more, in the unit of the mesh")]
    MergeDistance(f64),
    /// A link name that cannot be part of a file name.
    #[error(
        "{0:?} is not a valid link name: use one that can be part of a file name ({setting})", setting = Setting::Name)]
    LinkName(String),
    /// Invalid node numbers of an export.
    #[error(
        "{} has {found:?}; {interfaces} distinct numbers between 1 and 99999999 are required, one per interface, \
         proximal first",
        Setting::Nodes
    )]
    NodeNumbers {
        /// The numbers given.
        found: Vec<i64>,
        /// Number of interfaces.
        interfaces: usize,
    },
}
