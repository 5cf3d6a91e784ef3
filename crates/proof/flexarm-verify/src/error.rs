//! Errors of the case studies: those of the library, and truths that cannot be computed.

use flexarm::Fault;
use flexarm_fe_io::FeFileError;
use flexarm_fem::FemError;
use flexarm_files::FileError;

/// Reason why a case study cannot be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of the library.
    #[error(transparent)]
    Library(#[from] flexarm::Error),
    /// A case that is unknown or cannot be computed.
    #[error("{0}")]
    Case(String),
    /// An error in a closed-form beam or in the units of a mesh.
    #[error(transparent)]
    Fem(Box<FemError>),
}

impl From<FemError> for Error {
    fn from(error: FemError) -> Self {
        Self::Fem(Box::new(error))
    }
}

impl From<Box<FeFileError>> for Error {
    fn from(error: Box<FeFileError>) -> Self {
        Self::Library(flexarm::links::LinkError::from(error).into())
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        Self::Library(error.into())
    }
}

impl Error {
    /// Returns whether the input or the run is at fault.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Library(error) => error.fault(),
            _ => Fault::Input,
        }
    }
}
