//! What can go wrong while a run is written. Every message starts with the file.

use std::io;
use std::path::{Path, PathBuf};

use flexarm_settings::Setting;

/// A recording could not be started, continued or closed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file is there already and overwriting was not asked for.
    #[error("{}: the file exists already; choose another output folder or overwrite it with {}", path.display(), Setting::Overwrite)]
    Exists {
        /// The existing file.
        path: PathBuf,
    },

    /// The operating system refused: missing folder, no permission, full disk.
    #[error("{}: cannot {action}{}", path.display(), remedy(source))]
    Io {
        /// The file concerned.
        path: PathBuf,
        /// What was attempted.
        action: &'static str,
        /// Why it failed.
        #[source]
        source: io::Error,
    },

    /// The format cannot hold what was given to it.
    #[error("{}: cannot {action}: {cause}", path.display())]
    Format {
        /// The file being written.
        path: PathBuf,
        /// What was attempted.
        action: &'static str,
        /// What the format's library said.
        cause: String,
    },

    /// A sample does not fit the header of its run.
    #[error("{}: sample at t = {time_s} s has {found} entries in {what}, the header says {expected}", path.display())]
    Shape {
        /// The file being written.
        path: PathBuf,
        /// Time of the sample.
        time_s: f64,
        /// The part of the sample that is wrong.
        what: &'static str,
        /// Entries it has.
        found: usize,
        /// Entries the header asks for.
        expected: usize,
    },

    /// A time that the file's time stamps cannot hold.
    #[error("{}: sample time {time_s} s is not in the range 0 to {limit_s:.0} s of the file's time stamps", path.display())]
    Time {
        /// The file being written.
        path: PathBuf,
        /// Time of the sample.
        time_s: f64,
        /// Largest time this file can hold.
        limit_s: f64,
    },

    /// A file that is to be read is no recording, or not one that can be read.
    #[error("{}: found {found}; expected {expected}{}", path.display(), if mend.is_empty() { String::new() } else { format!(": {mend}") })]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
        /// What to do.
        mend: String,
    },

    /// Files that a run wrote are no longer where they were made.
    #[error(
        "{}: no longer there: removed, moved or replaced while the run wrote it; what it held is lost from this place{}",
        paths.first().map(|path| path.display().to_string()).unwrap_or_default(),
        others(paths)
    )]
    Gone {
        /// All such files.
        paths: Vec<PathBuf>,
    },

    /// The calls came in the wrong order: `begin`, any number of `record`, `finish`.
    #[error("{}: {call} was called {problem}", path.display())]
    Order {
        /// The file concerned.
        path: PathBuf,
        /// Name of the call.
        call: &'static str,
        /// Why it cannot be made now.
        problem: &'static str,
    },
}

/// What to do when a file may not grow any more; nothing for other troubles, which name themselves.
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

/// The paths after the first one, in words.
fn others(paths: &[PathBuf]) -> String {
    let others: Vec<String> = paths.iter().skip(1).map(|path| path.display().to_string()).collect();
    if others.is_empty() { String::new() } else { format!(", and so is {}", others.join(", ")) }
}

impl LogError {
    /// The same error with the name `shown` for every path in the folder `hidden`: files that come
    /// into being under a provisional name are called what the user called them.
    #[must_use]
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

    /// A closure for `map_err` that turns an [`io::Error`] into [`LogError::Io`].
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), action, source }
    }

    /// `begin` on a recorder that has begun before.
    pub(crate) fn begun_twice(path: &Path) -> Self {
        Self::Order { path: path.to_owned(), call: "begin", problem: "a second time" }
    }

    /// `record` or `finish` on a recorder that is not between `begin` and `finish`.
    pub(crate) fn not_open(path: &Path, call: &'static str) -> Self {
        Self::Order { path: path.to_owned(), call, problem: "before begin or after finish" }
    }
}
