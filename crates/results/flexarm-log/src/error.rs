//! Errors of writing and reading a run. Every message starts with the file.
//!
//! Start at [`LogError`]. Not here: faults inside a format, which become [`LogError::Format`] or
//! [`LogError::NotARecording`] in its module.

use std::io;
use std::path::{Path, PathBuf};

use flexarm_settings::{Place, Setting};

/// An error of starting, continuing, closing or reading a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file exists and overwriting was not requested.
    #[error("{}: the file exists already; choose another output folder or overwrite it with {}", path.display(), Setting::Overwrite)]
    Exists {
        /// The existing file.
        path: PathBuf,
    },

    /// The operating system reported an error: missing folder, no permission, full disk.
    #[error("{}: cannot {action}{}", path.display(), remedy(source))]
    Io {
        /// The file concerned.
        path: PathBuf,
        /// Action attempted, as a verb phrase.
        action: &'static str,
        /// Cause of the failure.
        #[source]
        source: io::Error,
    },

    /// The data do not fit into the format.
    #[error("{}: cannot {action}: {cause}", path.display())]
    Format {
        /// The file being written.
        path: PathBuf,
        /// Action attempted, as a verb phrase.
        action: &'static str,
        /// Message of the format's library.
        cause: String,
    },

    /// A sample does not match the header of its run.
    #[error("{}: sample at t = {time_s} s has {found} entries in {what}, the header says {expected}", path.display())]
    Shape {
        /// The file being written.
        path: PathBuf,
        /// Time of the sample.
        time_s: f64,
        /// Part of the sample with the wrong size.
        what: &'static str,
        /// Number of entries found.
        found: usize,
        /// Number of entries that the header requires.
        expected: usize,
    },

    /// The time of a sample is out of the range of the file's time stamps.
    #[error("{}: sample time {time_s} s is not in the range 0 to {limit_s:.0} s of the file's time stamps", path.display())]
    Time {
        /// The file being written.
        path: PathBuf,
        /// Time of the sample.
        time_s: f64,
        /// Maximum time this file can hold (s).
        limit_s: f64,
    },

    /// The file to be read is not a recording, or not one that can be read.
    #[error("{}: found {found}; expected {expected}{}", Place { line: *line, ..Place::of_file(path.display()) }, if mend.is_empty() { String::new() } else { format!(": {mend}") })]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// Line of a text file, from 1.
        line: Option<usize>,
        /// Contents found.
        found: String,
        /// Contents expected.
        expected: String,
        /// Suggested remedy.
        mend: String,
    },

    /// Files written by a run are no longer at their paths.
    #[error(
        "{}: no longer there: removed, moved or replaced while the run wrote it; what it held is lost from this place{}",
        paths.first().map(|path| path.display().to_string()).unwrap_or_default(),
        others(paths)
    )]
    Gone {
        /// All such files.
        paths: Vec<PathBuf>,
    },

    /// Calls in the wrong order; the order is `begin`, any number of `record`, `finish`.
    #[error("{}: {call} was called {problem}", path.display())]
    Order {
        /// The file concerned.
        path: PathBuf,
        /// Name of the call.
        call: &'static str,
        /// Reason why the call is not allowed now.
        problem: &'static str,
    },
}

/// Returns a suggested remedy if the file cannot grow any further; empty for other I/O errors.
fn remedy(source: &io::Error) -> String {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    match source.kind() {
        StorageFull => format!(": the disk is full; free space or choose another folder with {}", Setting::Output),
        QuotaExceeded => {
            format!(": the disk quota is used up; free space or choose another folder with {}", Setting::Output)
        }
        FileTooLarge => {
            let what = "the file may not grow further (ulimit -f)";
            format!(": {what}; raise the limit or lower {}", Setting::LogRate)
        }
        _ => String::new(),
    }
}

/// Lists the paths after the first one as part of a sentence.
fn others(paths: &[PathBuf]) -> String {
    let others: Vec<String> = paths.iter().skip(1).map(|path| path.display().to_string()).collect();
    if others.is_empty() { String::new() } else { format!(", and so is {}", others.join(", ")) }
}

impl LogError {
    /// Returns the same error with every path in the folder `hidden` replaced by `shown`. Files
    /// created under a temporary name are thus reported under the name that the user gave.
    pub fn with_path_for(mut self, hidden: &Path, shown: &Path) -> Self {
        let rename = |path: &mut PathBuf| {
            if path.starts_with(hidden) {
                *path = shown.to_owned();
            }
        };
        match &mut self {
            Self::Exists { path }
            | Self::Io { path, .. }
            | Self::Format { path, .. }
            | Self::Shape { path, .. }
            | Self::Time { path, .. }
            | Self::NotARecording { path, .. }
            | Self::Order { path, .. } => rename(path),
            Self::Gone { paths } => paths.iter_mut().for_each(rename),
        }
        self
    }

    /// Returns a closure for `map_err` that turns an [`io::Error`] into [`LogError::Io`].
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), action, source }
    }

    /// Error for `begin` on a recorder that has begun before.
    pub fn begun_twice(path: &Path) -> Self {
        Self::Order { path: path.to_owned(), call: "begin", problem: "a second time" }
    }

    /// Error for `record` or `finish` on a recorder that is not between `begin` and `finish`.
    pub fn not_open(path: &Path, call: &'static str) -> Self {
        Self::Order { path: path.to_owned(), call, problem: "before begin or after finish" }
    }
}
