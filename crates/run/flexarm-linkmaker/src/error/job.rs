//! Numbers and names of a job that make no sense, each with what was found and what is expected.

use flexarm_settings::Setting;

/// A number or a name of a reduction or an export that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// Modes of a reduction by number and by frequency.
    #[error("modes and modes_up_to_hz exclude each other: give one of them")]
    ModesTwice,
    /// More modes than a reduction keeps.
    #[error("{} {found}: at most {most} can be kept", Setting::Modes)]
    TooManyModes {
        /// Modes asked for.
        found: usize,
        /// Most.
        most: usize,
    },
    /// The frequency up to which modes are kept, which must be positive.
    #[error("{setting} {0}: a positive frequency in Hz is expected", setting = Setting::ModesUpTo)]
    ModesUpTo(f64),
    /// Parts of a chain.
    #[error("{setting} {0}: a chain has 2 to 100 parts", setting = Setting::Chains)]
    ChainParts(usize),
    /// Distance within which nodes are merged, in the unit of the mesh.
    #[error("merge = {0}: a distance of zero or more, in the unit of the mesh")]
    MergeDistance(f64),
    /// A name that cannot be part of a file name.
    #[error("{0:?} is no name for a link: give one that can be part of a file name ({setting})", setting = Setting::Name)]
    LinkName(String),
    /// Numbers of the nodes of an export.
    #[error(
        "{} has {found:?}; {interfaces} different numbers between 1 and 99999999 are needed, one per interface, proximal \
         first",
        Setting::Nodes
    )]
    NodeNumbers {
        /// The numbers.
        found: Vec<i64>,
        /// How many interfaces there are.
        interfaces: usize,
    },
}
