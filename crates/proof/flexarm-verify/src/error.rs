//! Errors of the case studies: those of the library, and truths that cannot be computed.

use flexarm::Fault;
use flexarm_fe_io::FeFileError;
use flexarm_fem::FemError;
use flexarm_fem::sparse::ModesError;
use flexarm_files::FileError;

/// Reason why a case study cannot be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of the library.
    #[error(transparent)]
    Library(#[from] flexarm::Error),
    /// An unknown case.
    #[error("there is no case {name:?}; the cases are {known}")]
    UnknownCase {
        /// Requested name.
        name: String,
        /// Names of the cases, separated by commas.
        known: String,
    },
    /// A frame that the robot does not have.
    #[error("there is no frame {name:?}")]
    NoFrame {
        /// Requested frame.
        name: String,
    },
    /// A robot without a tool.
    #[error("the robot has no tool")]
    NoTool,
    /// An arm that does not come to rest.
    #[error("the arm does not come to rest within {steps} steps of {step_s} s ({stepper})")]
    NotAtRest {
        /// Number of steps taken.
        steps: usize,
        /// Step size (s).
        step_s: f64,
        /// Name of the stepper.
        stepper: &'static str,
    },
    /// A mesh whose interface B is not constrained by interface A.
    #[error("interface B can move without force")]
    FreeInterface,
    /// A mesh that is a mechanism although its interfaces are held.
    #[error("{mesh}: the held mesh is a mechanism")]
    Mechanism {
        /// Mesh file.
        mesh: &'static str,
    },
    /// A failed eigenvalue analysis of a mesh.
    #[error("{mesh}: {source}")]
    Modes {
        /// Mesh file.
        mesh: &'static str,
        /// Cause.
        source: ModesError,
    },
    /// An error in a closed-form beam or in the units of a mesh.
    #[error(transparent)]
    Fem(Box<FemError>),
    /// A link file without the condensed mass of its interfaces and modes.
    #[error("the link file has no condensed mass")]
    NoCondensedMass,
    /// A link file whose stiffness has no inverse.
    #[error("K_BB of the link file is singular")]
    SingularLink,
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
