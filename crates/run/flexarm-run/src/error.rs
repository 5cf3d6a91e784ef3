//! One error type for the faces: what went wrong, by cause and with the numbers, and whether the
//! input or the run is to blame.
//!
//! Settings in the messages are values ([`Setting`]) that each face names in its own words
//! ([`flexarm_settings::name_settings`]). What a face makes of an error, such as the number that
//! its process ends with, is its own.

mod model;
mod recording;
mod value;

use std::path::PathBuf;

use flexarm_files::FileError;
use flexarm_linkmaker::LinkError;
use flexarm_settings::Setting;

use crate::robot_file::RobotFileError;

pub use flexarm_settings::Fault;
pub use model::{BalancerError, ChannelError, LoadError, LoopError, ModellingError, PayloadError, PoseError};
pub use recording::{RecordingError, StudyError};
pub use value::ValueError;

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
    /// Something in the robot file, a file of loads or a job file.
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
        source: Box<flexarm_kinematics::ModelError>,
    },
    /// A reduced-link file.
    #[error(transparent)]
    Flex(#[from] Box<flexarm_fem::FlexFileError>),
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
    /// A robot program that cannot be read.
    #[error(transparent)]
    Program(#[from] Box<flexarm_programs::ProgramError>),
    /// A path of the tool that the arm cannot follow.
    #[error("{}: {source}{}", path.display(), assumed(notes))]
    Path {
        /// The motion.
        path: PathBuf,
        /// Where and why.
        source: Box<flexarm_path::PathError>,
        /// What was assumed before.
        notes: Vec<String>,
    },
    /// Something in a motion of another program.
    #[error(transparent)]
    Motion(#[from] flexarm_motion_io::MotionError),
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
    #[error("{}", flexarm_files::taken(path, place, *movable))]
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
    /// A balancer that does not fit the robot, or a pose of it.
    #[error(transparent)]
    Balancer(#[from] BalancerError),
    /// A closed loop that does not fit the robot, or a pose in which it does not close.
    #[error(transparent)]
    Loop(#[from] LoopError),
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
    /// A link that could not be made of a mesh or of matrices, or not exported. Files, jobs and
    /// `.flex` files have the variants above, whoever finds what is wrong with them.
    #[error(transparent)]
    Link(LinkError),
    /// An error of a study, or of another crate that builds on this one.
    #[error(transparent)]
    External(Box<dyn ExternalError>),
}

/// An error of a crate that builds on this one; its `From` for [`Error`] wraps it in
/// [`Error::External`].
pub trait ExternalError: std::error::Error + Send + Sync + 'static {
    /// Returns whether the input or the run is to blame.
    fn fault(&self) -> Fault {
        Fault::Input
    }
}

impl std::error::Error for Box<dyn ExternalError> {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        (**self).source()
    }
}

impl Error {
    /// Returns the error of type `E` inside [`Error::External`], if there is one.
    pub fn external<E: ExternalError>(&self) -> Option<&E> {
        match self {
            Self::External(error) => {
                let error: &(dyn std::error::Error + 'static) = &**error;
                error.downcast_ref()
            }
            _ => None,
        }
    }

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
            Self::Link(error) => error.fault(),
            Self::External(error) => error.fault(),
            Self::Log(LogError::Exists { .. } | LogError::NotARecording { .. }) => Fault::Input,
            Self::Log(_) => Fault::Run,
            _ => Fault::Input,
        }
    }
}

/// Assumptions that may be the reason, below the reason itself.
fn assumed(notes: &[String]) -> String {
    let lines: String = notes.iter().map(|note| format!("\n  {note}")).collect();
    if lines.is_empty() {
        lines
    } else {
        format!("\nassumptions about the program (a path file with [program] can state them):{lines}")
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        match error {
            FileError::Unusable { path, what } => Self::File { path, what },
            FileError::Taken { path, place, movable } => Self::Taken { path, place, movable },
            FileError::Write { path, source } => Self::Write { path, source },
        }
    }
}

impl From<LinkError> for Error {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Files(error) => error.into(),
            LinkError::JobFile(error) => Self::RobotFile(error),
            LinkError::Several(faults) => Self::Several(faults.into_iter().map(Self::from).collect()),
            LinkError::Flex(error) => Self::Flex(error),
            other => Self::Link(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error as _;

    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("no depth")]
    struct OfAStudy(#[source] std::fmt::Error);

    impl ExternalError for OfAStudy {
        fn fault(&self) -> Fault {
            Fault::Run
        }
    }

    #[test]
    fn an_error_of_a_study_keeps_its_text_its_cause_and_its_fault() {
        let error = Error::External(Box::new(OfAStudy(std::fmt::Error)));
        assert_eq!((error.to_string(), error.fault()), ("no depth".into(), Fault::Run));
        assert_eq!(error.source().map(ToString::to_string), Some(std::fmt::Error.to_string()));
        assert!(error.external::<OfAStudy>().is_some());
        assert!(Error::from(ValueError::NothingYields).external::<OfAStudy>().is_none());
    }
}
