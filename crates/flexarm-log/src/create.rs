//! How a recording's file comes to be, and when it is flushed.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::LogError;

/// Options that every recorder takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CreateOptions {
    /// Replace an existing file; otherwise `begin` returns [`LogError::Exists`]. Default `false`.
    pub overwrite: bool,
    /// Longest wall time between two flushes while samples arrive: what a killed run may lose. Default 0.5 s.
    pub flush_every: Duration,
}

impl Default for CreateOptions {
    fn default() -> Self {
        Self { overwrite: false, flush_every: Duration::from_millis(500) }
    }
}

impl CreateOptions {
    /// The same with [`CreateOptions::overwrite`] set to `overwrite`.
    #[must_use]
    pub fn with_overwrite(self, overwrite: bool) -> Self {
        Self { overwrite, ..self }
    }

    /// Whether `path` may be created: it does not exist, or may be overwritten.
    pub(crate) fn check(self, path: &Path) -> Result<(), LogError> {
        if !self.overwrite && path.exists() {
            return Err(LogError::Exists { path: path.to_owned() });
        }
        Ok(())
    }

    /// Creates the file. Two runs that race for one name cannot both win.
    pub(crate) fn create(self, path: &Path) -> Result<File, LogError> {
        let mut options = OpenOptions::new();
        options.write(true);
        match self.overwrite {
            true => options.create(true).truncate(true),
            false => options.create_new(true),
        };
        options.open(path).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => LogError::Exists { path: path.to_owned() },
            _ => LogError::io(path, "create the file")(error),
        })
    }

    /// A clock that says when the next flush is due.
    pub(crate) fn flush_clock(self) -> FlushClock {
        FlushClock { every: self.flush_every, last: Instant::now() }
    }
}

/// Wall time since the last flush. It decides when bytes reach the disk, never which bytes.
#[derive(Debug)]
pub(crate) struct FlushClock {
    every: Duration,
    last: Instant,
}

impl FlushClock {
    /// Whether a flush is due; if so, the next interval starts now.
    pub(crate) fn due(&mut self) -> bool {
        let due = self.last.elapsed() >= self.every;
        if due {
            self.last = Instant::now();
        }
        due
    }
}
