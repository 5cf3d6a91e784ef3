//! What keeps a link from being made or exported, by cause and with the numbers, and whether the
//! input or the run is to blame.

mod import;
mod job;

use std::path::PathBuf;

use flexarm_fem::mesh_link::MeshLinkError;
use flexarm_fem::reduction::ReductionError;
use flexarm_fem::sparse::ModesError;
use flexarm_files::{FileError, TextFileError};
use flexarm_settings::Fault;

pub use import::ImportError;
pub use job::JobError;

/// What keeps a link from being made or exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// A file that is not there, or does not hold what is needed; a place of a result that is
    /// taken.
    #[error(transparent)]
    Files(#[from] FileError),
    /// Something in a job file.
    #[error(transparent)]
    JobFile(#[from] TextFileError),
    /// Several faults of one job.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<LinkError>),
    /// A number or a name of a job that makes no sense.
    #[error(transparent)]
    Job(#[from] JobError),
    /// Frames of interfaces in an import.
    #[error(transparent)]
    ImportJob(#[from] ImportError),
    /// A reduced-link file.
    #[error(transparent)]
    Flex(#[from] Box<flexarm_fem::FlexFileError>),
    /// A mesh file.
    #[error(transparent)]
    Mesh(#[from] Box<flexarm_fe_io::MeshError>),
    /// A file of matrices of another FE program.
    #[error(transparent)]
    Exchange(#[from] Box<flexarm_fe_io::ExchangeError>),
    /// An interface of a link to be reduced.
    #[error("{place}: interface {interface:?}: {what}")]
    Interface {
        /// File, file with line, or setting that it comes from.
        place: String,
        /// Its name.
        interface: String,
        /// What is wrong and how to mend it.
        what: String,
    },
    /// A mesh that could not be reduced to a link.
    #[error("{}: {source}{note}", path.display())]
    Reduction {
        /// The mesh.
        path: PathBuf,
        /// What the file can add: numbers of nodes.
        note: String,
        /// Why.
        source: Box<MeshLinkError>,
    },
    /// Matrices that could not become a link.
    #[error("{}: {source}", path.display())]
    Import {
        /// The file of the stiffness.
        path: PathBuf,
        /// Why.
        source: Box<MeshLinkError>,
    },
    /// Pictures of a reduction that could not be drawn.
    #[error("the pictures failed: {0}")]
    Pictures(Box<dyn std::error::Error + Send + Sync>),
}

impl LinkError {
    /// A file that does not hold what is needed.
    pub(crate) fn file(path: impl Into<PathBuf>, what: impl Into<String>) -> Self {
        Self::Files(FileError::Unusable { path: path.into(), what: what.into() })
    }

    /// One fault as it is, several together.
    pub(crate) fn of_all(mut faults: Vec<Self>) -> Self {
        if faults.len() == 1 { faults.remove(0) } else { Self::Several(faults) }
    }

    /// Whether the input or the run is to blame: the run where memory ran out, a solver did not
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
