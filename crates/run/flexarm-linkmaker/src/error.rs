//! Errors of making or exporting a link, with cause and numbers, and whether the input or the run
//! is at fault.

mod word;

use std::path::{Path, PathBuf};

use flexarm_fem::mesh_link::MeshLinkError;
use flexarm_fem::reduction::ReductionError;
use flexarm_fem::sparse::ModesError;
use flexarm_files::{FileError, TextFileError};
use flexarm_settings::Fault;

pub use word::WordError;

/// An error of making or exporting a link.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// A file is missing or unusable, or the path of a result is taken.
    #[error(transparent)]
    Files(#[from] FileError),
    /// An invalid job file.
    #[error(transparent)]
    JobFile(#[from] TextFileError),
    /// Several errors of one job.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<LinkError>),
    /// A number or name of a job is invalid or missing, or a file does not hold the data that a job
    /// needs: what was found and what is expected.
    #[error("{0}")]
    Job(String),
    /// An invalid reduced-link file.
    #[error(transparent)]
    Flex(#[from] Box<flexarm_fem::FlexFileError>),
    /// An invalid mesh or matrix file of another FE program.
    #[error(transparent)]
    FeFile(#[from] Box<flexarm_fe_io::FeFileError>),
    /// An invalid interface of a link to be reduced.
    #[error("{place}: interface {interface:?}: {what}")]
    Interface {
        /// File, file with line, or setting that defines the interface.
        place: String,
        /// Name of the interface.
        interface: String,
        /// Description of the error and its remedy.
        what: String,
    },
    /// A mesh could not be reduced to a link.
    #[error("{}: {source}{note}", path.display())]
    Reduction {
        /// The mesh file.
        path: PathBuf,
        /// A note from the file: numbers of nodes.
        note: String,
        /// Cause.
        source: Box<MeshLinkError>,
    },
    /// A link could not be built from matrices.
    #[error("{}: {source}", path.display())]
    Import {
        /// The stiffness file.
        path: PathBuf,
        /// Cause.
        source: Box<MeshLinkError>,
    },
    /// The pictures of a reduction could not be drawn.
    #[error("drawing the pictures failed: {0}")]
    Pictures(Box<dyn std::error::Error + Send + Sync>),
}

impl LinkError {
    /// Error for a file that does not hold the required data.
    pub(crate) fn content(path: impl AsRef<Path>, what: impl std::fmt::Display) -> Self {
        Self::Job(format!("{}: {what}", path.as_ref().display()))
    }

    /// Returns a single error as it is, several as [`LinkError::Several`].
    pub(crate) fn of_all(mut faults: Vec<Self>) -> Self {
        if faults.len() == 1 { faults.remove(0) } else { Self::Several(faults) }
    }

    /// Whether the input or the run is at fault: the run if memory ran out, a solver did not
    /// converge or a result could not be written.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Files(error) => error.fault(),
            Self::Reduction { source, .. } | Self::Import { source, .. } => match source.as_ref() {
                MeshLinkError::Reduction(ReductionError::OutOfMemory { .. })
                | MeshLinkError::Modes(ModesError::NotConverged { .. } | ModesError::NotFinite)
                | MeshLinkError::Reduction(ReductionError::Modes(
                    ModesError::NotConverged { .. } | ModesError::NotFinite,
                )) => Fault::Run,
                _ => Fault::Input,
            },
            _ => Fault::Input,
        }
    }
}
