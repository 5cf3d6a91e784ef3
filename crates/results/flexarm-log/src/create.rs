//! Creation of a recording's file, and the times of its flushes.
//!
//! Start at [`CreateOptions`]. The clock decides when bytes reach the disk, never which bytes.
//! Not here: files that are complete or absent ([`crate::whole_file`]).

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::LogError;

/// Options that every recorder takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CreateOptions {
    /// Whether to replace an existing file; otherwise `begin` returns [`LogError::Exists`]. Default
    /// `false`.
    pub overwrite: bool,
    /// Maximum wall time between two flushes while samples arrive, and so the span that a killed
    /// run may lose. Default 0.5 s. An MCAP file is written chunk by chunk instead, independent of
    /// wall time.
    pub flush_every: Duration,
}

impl Default for CreateOptions {
    fn default() -> Self {
        Self { overwrite: false, flush_every: Duration::from_millis(500) }
    }
}

impl CreateOptions {
    /// Returns the options with [`CreateOptions::overwrite`] set to `overwrite`.
    pub fn with_overwrite(self, overwrite: bool) -> Self {
        Self { overwrite, ..self }
    }

    /// Checks that `path` can be created: it does not exist, or it may be overwritten and is
    /// writable.
    ///
    /// # Errors
    /// [`LogError::Exists`] or [`LogError::Io`] if it cannot.
    pub fn check(self, path: &Path) -> Result<(), LogError> {
        let Ok(there) = path.metadata() else { return Ok(()) };
        if !self.overwrite {
            return Err(LogError::Exists { path: path.to_owned() });
        }
        if there.is_dir() {
            return Err(LogError::io(path, "replace a folder by a file")(io::ErrorKind::IsADirectory.into()));
        }
        if there.is_file() {
            // Open without truncating: an existing file stays intact until all files can be
            // replaced.
            OpenOptions::new().write(true).open(path).map_err(LogError::io(path, "replace the file"))?;
        }
        Ok(())
    }

    /// Creates the file. With two concurrent runs and one name, at most one succeeds.
    ///
    /// # Errors
    /// [`LogError::Exists`] if it exists and may not be overwritten; [`LogError::Io`] if it cannot
    /// be created.
    pub fn create(self, path: &Path) -> Result<File, LogError> {
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

    /// Returns a clock that decides when the next flush of a file is due.
    pub fn flush_clock(self, file: &Path) -> FlushClock {
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

/// Free disk space below which files are flushed every [`SCARCE_EVERY`] samples (bytes): all files
/// of a run then fill the disk at the same pace and end at about the same sample.
const SCARCE_BYTES: u64 = 64 << 20;
/// Number of samples between two flushes when disk space is scarce.
const SCARCE_EVERY: u32 = 64;
/// Upper bound of the flush interval: adding a larger `Duration` to an `Instant` may overflow.
const NEVER: Duration = Duration::from_secs(10 * 365 * 24 * 3600);
/// Reciprocal of the maximum share of wall time spent on flushes (1/20).
const LARGEST_SHARE: u32 = 20;

/// Decides when the next flush is due. It affects when bytes reach the disk, never which bytes.
#[derive(Debug)]
pub struct FlushClock {
    every: Duration,
    /// Time at which the last flush became due.
    begun: Instant,
    next: Instant,
    folder: PathBuf,
    scarce: bool,
    /// Samples since the last flush.
    waiting: u32,
}

impl FlushClock {
    /// Whether a flush is due; called once per sample. If so, the next interval starts now.
    pub fn due(&mut self) -> bool {
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

    /// Called after a flush whose cost grows with the file size: delays the next one so that
    /// flushes take at most a twentieth of the run time.
    pub fn done(&mut self) {
        // A zero interval asks for a flush at every sample.
        if !self.every.is_zero() {
            self.next = self.next.max(self.begun + LARGEST_SHARE * self.begun.elapsed());
        }
    }
}

/// Returns the folder that contains the file; `.` for a bare file name.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether the disk of a folder is nearly full; `false` where this is unknown.
pub(crate) fn is_scarce(folder: &Path) -> bool {
    #[cfg(unix)]
    let free = rustix::fs::statvfs(folder).ok().map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize));
    #[cfg(not(unix))]
    let free: Option<u64> = (!folder.as_os_str().is_empty()).then_some(u64::MAX);
    free.is_some_and(|free| free < SCARCE_BYTES)
}
