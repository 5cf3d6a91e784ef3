//! Common error type of the user interfaces: causes with their values, and whether the input or the
//! run is at fault.
//!
//! Settings in the messages are values ([`Setting`]) that each interface names in its own terms
//! ([`flexarm_settings::name_settings`]). The treatment of an error, such as the exit code of a
//! process, is up to the interface.

mod picture;
mod recording;

use std::path::{Path, PathBuf};

use flexarm_files::{FileError, TextFileError as RobotFileError};
use flexarm_linkmaker::LinkError;
use flexarm_motion_io::MotionError;
use flexarm_settings::{Finding, OutOfRange, Setting, known_names};
use flexarm_trajectory::TrajectoryError;

pub use flexarm_settings::Fault;
pub(crate) use picture::NoPicture;
pub use recording::RecordingError;

/// Any error that prevents a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A requested file or folder does not exist, is not readable, or cannot be used in this place.
    #[error("{}: {what}", path.display())]
    File {
        /// Path.
        path: PathBuf,
        /// Description of the problem and how to fix it.
        what: String,
    },
    /// A run of a study failed.
    #[error("run {label:?} of the study: {source}")]
    InStudy {
        /// Label of the run.
        label: String,
        /// Cause.
        source: Box<Error>,
    },
    /// The robot file, a loads file or a job file has an error.
    #[error(transparent)]
    RobotFile(#[from] RobotFileError),
    /// A robot file or job has several errors.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<Error>),
    /// The URDF has an error.
    #[error(transparent)]
    Urdf(#[from] flexarm_urdf::UrdfError),
    /// Links and joints do not form a valid tree.
    #[error("{}: {source}", path.display())]
    Model {
        /// Path of the URDF.
        path: PathBuf,
        /// Cause.
        source: Box<flexarm_kinematics::ModelError>,
    },
    /// A reduced-link file has an error.
    #[error(transparent)]
    Flex(#[from] Box<flexarm_fem::FlexFileError>),
    /// A result cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A motion cannot be made, changed or written as requested.
    #[error(transparent)]
    Trajectory(TrajectoryError),
    /// A robot program cannot be read.
    #[error(transparent)]
    Program(#[from] Box<flexarm_programs::ProgramError>),
    /// The arm cannot follow a TCP path.
    #[error("{finding}{}", assumed(notes))]
    Path {
        /// Place and cause.
        finding: Box<Finding>,
        /// Assumptions made before.
        notes: Vec<String>,
    },
    /// The content of a motion file is wrong, or does not fit the robot.
    #[error(transparent)]
    Motion(Box<Finding>),
    /// The trajectory exceeds joint limits.
    #[error(
        "{}: the trajectory passes {} joint limits:\n  {}\nslow it down, change it, or run it anyway with {}",
        path.display(), violations.len(), violations.join("\n  "), Setting::IgnoreLimits
    )]
    Limits {
        /// Path of the trajectory.
        path: PathBuf,
        /// Violations, one line each.
        violations: Vec<String>,
    },
    /// The path of a result already exists.
    #[error("{}", flexarm_files::taken(path, place, *movable))]
    Taken {
        /// Existing path.
        path: PathBuf,
        /// Kind of path to choose instead: `place` or `folder`.
        place: &'static str,
        /// Whether [`Setting::Output`] selects it.
        movable: bool,
    },
    /// An option, a channel of a response or the runs of a study are invalid: what was found, what was
    /// expected and the remedy.
    #[error("{0}")]
    Value(String),
    /// Links or drives cannot be modelled as requested, or a balancer does not fit: what was found,
    /// what was expected and the remedy.
    #[error("{0}")]
    Modelling(String),
    /// Joint values do not fit the robot, or a pose has no solution: what was found, what was expected
    /// and the remedy.
    #[error("{0}")]
    Pose(String),
    /// A closed loop does not fit the robot, or does not close at a pose.
    #[error("loop {name:?}: {what}")]
    Loop {
        /// Name of the loop.
        name: String,
        /// Cause and remedy, with the time of a motion.
        what: String,
    },
    /// A load or a change of payload is invalid: what was found, what was expected and the remedy.
    #[error("{0}")]
    Load(String),
    /// A recording cannot be read, written or reported as requested.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// No link of the robot can be the TCP.
    #[error(
        "the robot has no link that could be the TCP: {}",
        if *in_file { "add tcp = { link = ... }".to_owned() } else { format!("use {}", Setting::Tcp) }
    )]
    NoTcp {
        /// Whether the robot comes from a robot file, which can name a TCP.
        in_file: bool,
    },
    /// The requested TCP link does not exist.
    #[error("TCP frame {link:?} is not a link of the robot; its links are {}", known_names(link, known))]
    UnknownTcp {
        /// Requested link.
        link: String,
        /// Links of the robot.
        known: Vec<String>,
    },
    /// The simulation could not start, or it stopped.
    #[error("{source}{}", if *partial { "; the log up to there is complete and readable" } else { "" })]
    Step {
        /// Cause.
        source: flexarm_stepping::StepError,
        /// Whether files were written up to the stop.
        partial: bool,
    },
    /// The user stopped the run.
    #[error("stopped at t = {t:.3} s{}", if *partial { "; the log up to there is complete and readable" } else { "" })]
    Interrupted {
        /// Simulated time (s).
        t: f64,
        /// Whether files were written up to the stop.
        partial: bool,
    },
    /// A recording cannot be written.
    #[error(transparent)]
    Log(#[from] flexarm_log::LogError),
    /// A link cannot be built from a mesh or matrices, or cannot be exported. Errors in files, jobs
    /// and `.flex` files are the variants above, whichever crate finds them.
    #[error(transparent)]
    Link(LinkError),
    /// An error of a study, or of another crate that builds on this one.
    #[error(transparent)]
    External(Box<dyn ExternalError>),
}

/// An error of a crate that builds on this one; its `From` for [`Error`] wraps it in
/// [`Error::External`].
pub trait ExternalError: std::error::Error + Send + Sync + 'static {
    /// Returns whether the input or the run is at fault.
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
    /// Error about a number that is not finite; `what` names the quantity.
    pub(crate) fn not_finite(what: &str, found: f64) -> Self {
        Self::Value(format!("{what} has the entry {found}, expected finite numbers"))
    }

    /// Error about the content of a motion file, or about a motion that does not fit the robot.
    pub(crate) fn motion(path: &Path, what: impl Into<String>) -> Self {
        Self::Motion(Box::new(Finding::error("motion", path.display().to_string(), what, "")))
    }

    /// Error about joint values of a motion that do not fit its times.
    pub(crate) fn samples(found: usize, times: usize, joints: usize) -> Self {
        Self::Pose(format!(
            "{found} joint values are given for {times} times; the robot has {joints} joints, so {} are expected",
            joints * times
        ))
    }

    /// Error of a study of a robot whose TCP has no error.
    pub fn nothing_yields() -> Self {
        Self::Value(
            "the robot has no flexible link and no elastic drive: its tool is where the rigid arm has it, and \
             nothing changes that; add [[flexible_link]] or [[drive]] entries"
                .into(),
        )
    }

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

    /// Returns whether the input or the run is at fault.
    pub fn fault(&self) -> Fault {
        use flexarm_log::LogError;
        use flexarm_stepping::StepError;
        match self {
            Self::Step { source, partial } => match source {
                StepError::Setup(_) | StepError::ModalLinks | StepError::UnstableStep { .. } => Fault::Input,
                // A singular matrix at the start is due to the input, later to the run.
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

/// Formats assumptions that may be the cause, to be printed below the error.
fn assumed(notes: &[String]) -> String {
    let lines: String = notes.iter().map(|note| format!("\n  {note}")).collect();
    if lines.is_empty() {
        lines
    } else {
        format!("\nassumptions about the program (a path file with [program] can state them):{lines}")
    }
}

impl From<TrajectoryError> for Error {
    fn from(error: TrajectoryError) -> Self {
        match error {
            TrajectoryError::Read { path, source } => Self::File { path, what: format!("cannot be read: {source}") },
            TrajectoryError::File(finding) => Self::Motion(finding),
            other => Self::Trajectory(other),
        }
    }
}

impl From<MotionError> for Error {
    fn from(error: MotionError) -> Self {
        match error {
            MotionError::Read { path, source } => Self::File { path, what: format!("cannot be read: {source}") },
            MotionError::Content(finding) => Self::Motion(finding),
            other => Self::Value(other.to_string()),
        }
    }
}

impl From<OutOfRange> for Error {
    fn from(error: OutOfRange) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        match error {
            FileError::Unusable { path, what } => Self::File { path, what },
            FileError::Text(error) => Self::RobotFile(error),
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
