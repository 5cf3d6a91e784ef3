//! What keeps a case study from being done: the library's errors, and truths that cannot be
//! computed.

use flexarm::Fault;
use flexarm_fe_io::MeshError;
use flexarm_fem::FemError;
use flexarm_fem::sparse::ModesError;
use flexarm_files::FileError;

/// What keeps a case study from being done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// What the library says.
    #[error(transparent)]
    Library(#[from] flexarm::Error),
    /// A case that is not there.
    #[error("there is no case {name:?}; the cases are {known}")]
    UnknownCase {
        /// The name.
        name: String,
        /// The names that there are, with commas between them.
        known: String,
    },
    /// A frame that the robot does not have.
    #[error("there is no frame {name:?}")]
    NoFrame {
        /// The frame.
        name: String,
    },
    /// A robot without a tool.
    #[error("the robot has no tool")]
    NoTool,
    /// An arm that goes on swinging.
    #[error("the arm does not come to rest within {steps} steps of {step_s} s ({stepper})")]
    NotAtRest {
        /// Steps taken.
        steps: usize,
        /// Their length (s).
        step_s: f64,
        /// Who took them.
        stepper: &'static str,
    },
    /// A mesh whose interface B is not held by A.
    #[error("interface B can move without force")]
    FreeInterface,
    /// A mesh that can move although its interfaces are held.
    #[error("{mesh}: the held mesh is a mechanism")]
    Mechanism {
        /// Its file.
        mesh: &'static str,
    },
    /// Frequencies of a mesh.
    #[error("{mesh}: {source}")]
    Modes {
        /// Its file.
        mesh: &'static str,
        /// Why.
        source: ModesError,
    },
    /// A beam in closed form, or units of a mesh.
    #[error(transparent)]
    Fem(Box<FemError>),
    /// A link file without the mass over its interfaces and modes.
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

impl From<Box<MeshError>> for Error {
    fn from(error: Box<MeshError>) -> Self {
        Self::Library(flexarm::LinkError::from(error).into())
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        Self::Library(error.into())
    }
}

impl Error {
    /// Whether the input or the run is to blame.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Library(error) => error.fault(),
            _ => Fault::Input,
        }
    }
}
