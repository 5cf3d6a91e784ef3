//! Frames of an import that contradict its matrices.

use flexarm_settings::Setting;

/// Frames of interfaces in an import that do not fit its matrices.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// An import of nothing.
    #[error("no file to import is given")]
    NoFile,
    /// A frame of an interface that the map does not have.
    #[error("{} names interface {interface:?}, the map has {known:?}", Setting::At)]
    UnknownInterface {
        /// The interface.
        interface: String,
        /// The interfaces of the map.
        known: Vec<String>,
    },
    /// Two frames of one interface.
    #[error("{} {interface}=... is given twice", Setting::At)]
    FrameTwice {
        /// The interface.
        interface: String,
    },
    /// A frame of an interface whose file has it.
    #[error("{at} {interface}=...: the positions are in the SID file; leave {at} out", at = Setting::At)]
    FrameOfSid {
        /// The interface.
        interface: String,
    },
    /// A link without length.
    #[error("interfaces {first:?} and {second:?} are at the same point; a link needs a length")]
    SamePoint {
        /// The proximal interface.
        first: String,
        /// The other one.
        second: String,
    },
}
