//! One error type for the faces: what went wrong, by cause and with the numbers, and whether the input or the run is to blame.
//!
//! Settings in the messages are values ([`Setting`]) that each face names in its own words
//! ([`crate::name_settings`]). What a face makes of an error, such as the number that its process ends with, is its own.

mod job;
mod model;
mod recording;
mod value;

use std::path::PathBuf;

use flexarm_fem::mesh_link::MeshLinkError;
use flexarm_fem::reduction::ReductionError;
use flexarm_fem::sparse::ModesError;
use flexarm_settings::Setting;

use crate::robot_file::RobotFileError;

pub use job::ImportError;
pub use model::{ChannelError, LoadError, ModellingError, PayloadError, PoseError};
pub use recording::{RecordingError, StudyError};
pub use value::ValueError;

/// Whom an error is to blame on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// What was given: files, values, places of results. The same call would end in the same way.
    Input,
    /// The run: it stopped on its way, was stopped, or its results could not be written.
    Run,
}

/// Anything that keeps an answer from being given.
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
        "{}: the trajectory passes {} joint limits:\n  {}\nslow it down, change it, or go on anyway with {}",
        path.display(), violations.len(), violations.join("\n  "), Setting::IgnoreLimits
    )]
    Limits {
        /// The trajectory.
        path: PathBuf,
        /// One line each.
        violations: Vec<String>,
    },
    /// A place of a result that is taken.
    #[error(
        "{}: exists already and is not overwritten: choose another {place}{} give {}",
        path.display(), if *movable { format!(" with {} or", Setting::Output) } else { ", or".into() }, Setting::Overwrite
    )]
    Taken {
        /// What is there.
        path: PathBuf,
        /// What another one of is to be chosen: `place` or `folder`.
        place: &'static str,
        /// Whether [`Setting::Output`] chooses it.
        movable: bool,
    },
    /// A number of an option that makes no sense.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// Links and drives that cannot be modelled as asked for.
    #[error(transparent)]
    Modelling(#[from] ModellingError),
    /// Joint values that do not fit the robot, and poses without an answer.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// Inputs and outputs of a frequency response.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// A load as values.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The runs of a study.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// A recording that cannot be read, written or reported as asked for.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Frames of interfaces in an import.
    #[error(transparent)]
    ImportJob(#[from] ImportError),
    /// A robot none of whose links could be the tool.
    #[error(
        "the robot has no link that could be the TCP: {}",
        if *in_file { "add tcp = { link = ... }".to_owned() } else { format!("use {}", Setting::Tcp) }
    )]
    NoTcp {
        /// Whether it comes from a robot file, which can name one.
        in_file: bool,
    },
    /// A tool on a link that is not there.
    #[error("TCP frame {link:?} is not a link of the robot; its links are {known:?}")]
    UnknownTcp {
        /// The link.
        link: String,
        /// The links of the robot.
        known: Vec<String>,
    },
    /// Pictures of a reduction that could not be drawn.
    #[error("the pictures failed: {0}")]
    Pictures(Box<dyn std::error::Error + Send + Sync>),
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
    /// Whether the input or the run is to blame.
    pub fn fault(&self) -> Fault {
        use flexarm_log::LogError;
        use flexarm_stepping::StepError;
        match self {
            Self::Step { source, partial } => match source {
                StepError::Setup(_) | StepError::ModalLinks | StepError::UnstableStep { .. } => Fault::Input,
                // At the start it is the input, later the run.
                StepError::Singular { t, .. } if !partial && *t == 0.0 => Fault::Input,
                _ => Fault::Run,
            },
            Self::InStudy { source, .. } => source.fault(),
            Self::Interrupted { .. } | Self::Write { .. } => Fault::Run,
            Self::Reduction { source, .. } | Self::Import { source, .. } => match source.as_ref() {
                MeshLinkError::Reduction(ReductionError::OutOfMemory { .. })
                | MeshLinkError::Modes(ModesError::NotConverged { .. } | ModesError::NotFinite)
                | MeshLinkError::Reduction(ReductionError::Modes(
                    ModesError::NotConverged { .. } | ModesError::NotFinite,
                )) => Fault::Run,
                _ => Fault::Input,
            },
            Self::Log(LogError::Exists { .. } | LogError::NotARecording { .. }) => Fault::Input,
            Self::Log(_) => Fault::Run,
            _ => Fault::Input,
        }
    }
}
