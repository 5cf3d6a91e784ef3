//! Errors that end a command: of the library or of the command line; their messages, and the
//! exit code of the process.

use std::process::ExitCode;

use flexarm::Fault;
use flexarm::recordings::RecordingFormat;

use crate::print::{complaint, say};

/// An error that ends a command.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Inconsistent command-line arguments.
    Usage(String),
    /// An error of one run of a study, or of a robot with changed entries.
    In { context: String, source: Box<Failure> },
    /// An error of the library.
    Library(flexarm::Error),
    /// An error of a plant for other programs.
    Fmu(flexarm_fmu::FmuError),
}

impl From<flexarm::Error> for Failure {
    fn from(error: flexarm::Error) -> Self {
        Self::Library(error)
    }
}

impl From<flexarm::links::LinkError> for Failure {
    fn from(error: flexarm::links::LinkError) -> Self {
        Self::Library(error.into())
    }
}

impl From<flexarm_fmu::FmuError> for Failure {
    fn from(error: flexarm_fmu::FmuError) -> Self {
        match error {
            flexarm_fmu::FmuError::Robot(error) => Self::Library(error),
            other => Self::Fmu(other),
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Usage(text) => f.write_str(text),
            Self::In { context, source } => write!(f, "{context}: {source}"),
            Self::Library(error) => error.fmt(f),
            Self::Fmu(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Failure {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Usage(_) => None,
            Self::In { source, .. } => Some(source),
            Self::Library(error) => error.source(),
            Self::Fmu(error) => error.source(),
        }
    }
}

impl Failure {
    /// Returns the exit code: 2 for bad input, 1 for a failed run.
    pub(crate) fn exit_code(&self) -> ExitCode {
        let fault = match self {
            Self::Usage(_) => Fault::Input,
            Self::In { source, .. } => return source.exit_code(),
            Self::Library(error) => error.fault(),
            Self::Fmu(flexarm_fmu::FmuError::Written(error)) => error.fault(),
            Self::Fmu(_) => Fault::Input,
        };
        ExitCode::from(match fault {
            Fault::Input => 2,
            Fault::Run => 1,
        })
    }

    /// Prints the message with its causes, and where to find help.
    pub(crate) fn print(&self) {
        let text = self.to_string();
        complaint("error", &text);
        let mut source = std::error::Error::source(self);
        while let Some(cause) = source {
            // Skip causes that the message already contains.
            if !text.contains(&cause.to_string()) {
                complaint("  because", &cause.to_string());
            }
            source = cause.source();
        }
        if let Some(page) = self.page() {
            say(&format!("  help: `flexarm format {page}` prints the keys with their units, and examples"));
        }
        if let Some(format) = self.lacks() {
            say(&format!("  help: {} has it", build_with(format)));
        }
    }

    /// Returns the format of recordings that this program was built without.
    fn lacks(&self) -> Option<RecordingFormat> {
        use flexarm::errors::RecordingError::{NotBuiltIn, WithoutFormat};
        match self {
            Self::In { source, .. } => source.lacks(),
            Self::Library(flexarm::Error::Recording(NotBuiltIn { format, .. } | WithoutFormat { format })) => {
                Some(*format)
            }
            _ => None,
        }
    }

    /// Returns the format page for a file that is malformed.
    fn page(&self) -> Option<&'static str> {
        match self {
            Self::In { source, .. } => source.page(),
            Self::Library(error) => page_of(error),
            Self::Usage(_) | Self::Fmu(_) => None,
        }
    }
}

/// Command that runs the program with a format that it was built without.
pub(crate) fn build_with(format: RecordingFormat) -> String {
    format!("`cargo run --release --features {} -- ...`", format.info().feature.unwrap_or_default())
}

fn page_of(error: &flexarm::Error) -> Option<&'static str> {
    match error {
        flexarm::Error::InStudy { source, .. } => page_of(source),
        flexarm::Error::Motion(_) => Some("motion"),
        flexarm::Error::RobotFile(fault)
            if fault.message.contains("unknown field") || matches!(fault.page, "measurements" | "tool") =>
        {
            Some(fault.page)
        }
        _ => None,
    }
}
