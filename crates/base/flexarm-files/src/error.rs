//! What keeps a file from being read or written.

use std::path::{Path, PathBuf};

use flexarm_settings::{Fault, Setting};

/// What keeps a file from being read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// A file or folder that cannot be used as asked for.
    #[error("{}: {what}", path.display())]
    Unusable {
        /// The path.
        path: PathBuf,
        /// What is wrong and how to mend it.
        what: String,
    },
    /// A place of a result that is taken.
    #[error("{}", taken(path, place, *movable))]
    Taken {
        /// What is there.
        path: PathBuf,
        /// What another one of is to be chosen: `place` or `folder`.
        place: &'static str,
        /// Whether [`Setting::Output`] chooses it.
        movable: bool,
    },
    /// A result could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl FileError {
    /// Whether the input or the run is to blame.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Unusable { .. } | Self::Taken { .. } => Fault::Input,
            Self::Write { .. } => Fault::Run,
        }
    }
}

/// The sentence about a place that is taken; see [`FileError::Taken`].
pub fn taken(path: &Path, place: &str, movable: bool) -> String {
    let other = if movable { format!(" with {} or", Setting::Output) } else { ", or".into() };
    let path = path.display();
    format!("{path}: exists already and is not overwritten: choose another {place}{other} give {}", Setting::Overwrite)
}
