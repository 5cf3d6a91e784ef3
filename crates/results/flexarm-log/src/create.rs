//! How a recording's file comes to be, and when it is flushed.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::LogError;

/// Options that every recorder takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CreateOptions {
    /// Replace an existing file; otherwise `begin` returns [`LogError::Exists`]. Default `false`.
    pub overwrite: bool,
    /// Longest wall time between two flushes while samples arrive: what a killed run may lose.
    /// Default 0.5 s. An MCAP is written chunk by chunk instead, whatever the wall time.
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

    /// Whether `path` may be created: it does not exist, or may be overwritten and can be.
    pub(crate) fn check(self, path: &Path) -> Result<(), LogError> {
        let Ok(there) = path.metadata() else { return Ok(()) };
        if !self.overwrite {
            return Err(LogError::Exists { path: path.to_owned() });
        }
        if there.is_dir() {
            return Err(LogError::io(path, "replace a folder by a file")(io::ErrorKind::IsADirectory.into()));
        }
        if there.is_file() {
            // Opened without a change: nothing is replaced before everything can be.
            OpenOptions::new().write(true).open(path).map_err(LogError::io(path, "replace the file"))?;
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

    /// A clock that says when the next flush of a file is due.
    pub(crate) fn flush_clock(self, file: &Path) -> FlushClock {
        let folder = folder_of(file);
        let now = Instant::now();
        let scarce = is_scarce(folder);
        FlushClock {
            every: self.flush_every,
            begun: now,
            next: now + self.flush_every.min(NEVER),
            folder: folder.into(),
            scarce,
            waiting: 0,
        }
    }
}

/// Room on the disk below which files are flushed by the sample: all of a run's files together then
/// fill the disk at the same pace, and what one of them takes last is not missing in the others.
const SCARCE_BYTES: u64 = 64 << 20;
/// Samples between two flushes when room is scarce.
const SCARCE_EVERY: u32 = 64;
/// Longest time between two flushes: clocks do not hold all that a duration does.
const NEVER: Duration = Duration::from_secs(10 * 365 * 24 * 3600);
/// Part of its time that a run spends on flushes at most.
#[cfg(feature = "rerun")]
const LARGEST_SHARE: u32 = 20;

/// When the next flush is due. It decides when bytes reach the disk, never which bytes.
#[derive(Debug)]
pub(crate) struct FlushClock {
    every: Duration,
    /// When the last flush was found to be due.
    begun: Instant,
    next: Instant,
    folder: PathBuf,
    scarce: bool,
    /// Samples since the last flush.
    waiting: u32,
}

impl FlushClock {
    /// Whether a flush is due, asked once for each sample; if so, the next interval starts now.
    pub(crate) fn due(&mut self) -> bool {
        self.waiting += 1;
        let now = Instant::now();
        let in_time = now >= self.next;
        if in_time {
            self.next = now + self.every.min(NEVER);
            self.scarce = is_scarce(&self.folder);
        }
        let due = in_time || self.scarce && self.waiting >= SCARCE_EVERY;
        if due {
            (self.begun, self.waiting) = (now, 0);
        }
        due
    }

    /// To be told when a flush is over whose cost grows with the file: the next one waits so long
    /// that all of them take only a small part of the run.
    #[cfg(feature = "rerun")]
    pub(crate) fn done(&mut self) {
        // Who asks for no pause gets none.
        if !self.every.is_zero() {
            self.next = self.next.max(self.begun + LARGEST_SHARE * self.begun.elapsed());
        }
    }
}

/// The folder in which a file is.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether a folder's disk is nearly full; `false` where that cannot be told.
pub(crate) fn is_scarce(folder: &Path) -> bool {
    #[cfg(unix)]
    let free = rustix::fs::statvfs(folder).ok().map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize));
    #[cfg(not(unix))]
    let free: Option<u64> = (!folder.as_os_str().is_empty()).then_some(u64::MAX);
    free.is_some_and(|free| free < SCARCE_BYTES)
}
