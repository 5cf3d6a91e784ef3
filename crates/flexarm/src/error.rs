//! One error type for the faces: what went wrong, and whether the input or the run is to blame.

use std::path::PathBuf;

use flexarm_fem::mesh_link::MeshLinkError;
use flexarm_fem::reduction::ReductionError;
use flexarm_fem::sparse::ModesError;

use crate::robot_file::RobotFileError;

/// Anything that ends a command.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder that was asked for is not there or not readable.
    #[error("{}: {what}", path.display())]
    File {
        /// The path.
        path: PathBuf,
        /// What is wrong and how to mend it.
        what: String,
    },
    /// A run of a study.
    #[error("run {label:?} of the study: {source}")]
    InStudy {
        /// Its label.
        label: String,
        /// Why.
        source: Box<Error>,
    },
    /// Something in the robot file or in a job file.
    #[error(transparent)]
    RobotFile(#[from] RobotFileError),
    /// Several faults of one robot file or job.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<Error>),
    /// Something in the URDF.
    #[error(transparent)]
    Urdf(#[from] flexarm_urdf::UrdfError),
    /// The links and joints make no tree.
    #[error("{}: {source}", path.display())]
    Model {
        /// The URDF.
        path: PathBuf,
        /// Why.
        source: flexarm_kinematics::ModelError,
    },
    /// A reduced-link file.
    #[error(transparent)]
    Flex(#[from] Box<flexarm_fem::FlexFileError>),
    /// A mesh file.
    #[error(transparent)]
    Mesh(#[from] Box<flexarm_fe_io::MeshError>),
    /// An interface of a link to be reduced.
    #[error("{place}: interface {interface:?}: {what}")]
    Interface {
        /// File, file with line, or flag that it comes from.
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
        source: Box<flexarm_fem::mesh_link::MeshLinkError>,
    },
    /// A result could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Something in the trajectory.
    #[error(transparent)]
    Trajectory(#[from] flexarm_trajectory::TrajectoryError),
    /// The trajectory asks for more than the joints can do.
    #[error(
        "{}: the trajectory passes {} joint limits:\n  {}\nslow it down, change it, or go on anyway with --ignore-limits",
        path.display(), violations.len(), violations.join("\n  ")
    )]
    Limits {
        /// The trajectory.
        path: PathBuf,
        /// One line each.
        violations: Vec<String>,
    },
    /// A value on the command line or in an option.
    #[error("{0}")]
    Usage(String),
    /// The simulation could not start or stopped.
    #[error("{source}{}", if *partial { "; the log up to there is complete and readable" } else { "" })]
    Step {
        /// Why.
        source: flexarm_stepping::StepError,
        /// Whether files were written up to the stop.
        partial: bool,
    },
    /// The user stopped it.
    #[error("stopped at t = {t:.3} s{}", if *partial { "; the log up to there is complete and readable" } else { "" })]
    Interrupted {
        /// Simulated time (s).
        t: f64,
        /// Whether files were written up to the stop.
        partial: bool,
    },
    /// A recording could not be written.
    #[error(transparent)]
    Log(#[from] flexarm_log::LogError),
    /// A file of matrices of another FE program.
    #[error(transparent)]
    Exchange(#[from] Box<flexarm_fe_io::exchange::ExchangeError>),
    /// Matrices that could not become a link.
    #[error("{}: {source}", path.display())]
    Import {
        /// The file of the stiffness.
        path: PathBuf,
        /// Why.
        source: Box<flexarm_fem::mesh_link::MeshLinkError>,
    },
}

impl Error {
    /// Exit code of a command that ends with this: 2 for bad input, 1 for a run that failed.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Step { source, partial } => match source {
                flexarm_stepping::StepError::Setup(_) | flexarm_stepping::StepError::UnstableStep { .. } => 2,
                // At the start it is the input, later the run.
                flexarm_stepping::StepError::Singular { t, .. } if !partial && *t == 0.0 => 2,
                _ => 1,
            },
            Self::InStudy { source, .. } => source.exit_code(),
            Self::Interrupted { .. } | Self::Write { .. } => 1,
            Self::Reduction { source, .. } | Self::Import { source, .. } => match source.as_ref() {
                MeshLinkError::Reduction(ReductionError::OutOfMemory { .. })
                | MeshLinkError::Modes(ModesError::NotConverged { .. } | ModesError::NotFinite)
                | MeshLinkError::Reduction(ReductionError::Modes(
                    ModesError::NotConverged { .. } | ModesError::NotFinite,
                )) => 1,
                _ => 2,
            },
            Self::Log(flexarm_log::LogError::Exists { .. } | flexarm_log::LogError::NotARecording { .. }) => 2,
            Self::Log(_) => 1,
            _ => 2,
        }
    }
}
