//! Errors of interface frames in an import.

use flexarm_settings::Setting;

/// Interface frames of an import do not match its matrices.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// No file to import.
    #[error("no file to import is given")]
    NoFile,
    /// A frame for an unknown interface.
    #[error("{} names interface {interface:?}, the map has {known:?}", Setting::At)]
    UnknownInterface {
        /// The interface.
        interface: String,
        /// The interfaces of the map.
        known: Vec<String>,
    },
    /// Two frames for one interface.
    #[error("{} {interface}=... is given twice", Setting::At)]
    FrameTwice {
        /// The interface.
        interface: String,
    },
    /// A frame for an interface that has one in its file.
    #[error("{at} {interface}=...: the positions are in the SID file; leave {at} out", at = Setting::At)]
    FrameOfSid {
        /// The interface.
        interface: String,
    },
    /// A link of zero length.
    #[error("interfaces {first:?} and {second:?} are at the same point; a link needs a length")]
    SamePoint {
        /// The proximal interface.
        first: String,
        /// The other interface.
        second: String,
    },
}
