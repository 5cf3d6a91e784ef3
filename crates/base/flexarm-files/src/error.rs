//! Errors of reading and writing files.

use std::path::{Path, PathBuf};

use flexarm_settings::{Fault, Setting};

use crate::TextFileError;

/// Error of reading or writing a file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// A file or folder cannot be used as requested.
    #[error("{}: {what}", path.display())]
    Unusable {
        /// The path.
        path: PathBuf,
        /// Description of the problem and its remedy.
        what: String,
    },
    /// The content of a file is wrong.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// The location of a result is already in use.
    #[error("{}", taken(path, place, *movable))]
    Taken {
        /// Existing path.
        path: PathBuf,
        /// Kind of location to choose instead: `place` or `folder`.
        place: &'static str,
        /// Whether [`Setting::Output`] determines it.
        movable: bool,
    },
    /// A result could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
}

impl FileError {
    /// Whether the input or the run is responsible.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Unusable { .. } | Self::Text(_) | Self::Taken { .. } => Fault::Input,
            Self::Write { .. } => Fault::Run,
        }
    }
}

/// Message for a location that is already in use; see [`FileError::Taken`].
pub fn taken(path: &Path, place: &str, movable: bool) -> String {
    let other = if movable { format!(" with {} or", Setting::Output) } else { ", or".into() };
    let path = path.display();
    format!("{path}: exists already and is not overwritten: choose another {place}{other} give {}", Setting::Overwrite)
}
