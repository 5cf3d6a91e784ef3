//! Writing of long files without filling the page cache.
//!
//! Written data stay in the page cache until other files need the memory. When 15 GB of recordings
//! had filled it, each further page took the system five times as long as before (1.5 instead of
//! 0.3 s per GB, Linux 6, 24 GB), and cached data of other programs were evicted. [`WrittenBehind`]
//! writes data far behind the end of the file to the disk and drops them from the cache.

use std::fs::File;
use std::ops::Range;

/// Number of bytes at the start of a file that stay cached: most files are no longer, and are often
/// read next.
pub const CACHED: u64 = 1 << 30;
/// Number of bytes between two calls of `fadvise`, and the number of bytes that each call covers:
/// the disk has time to write a page until one of the last calls covers it again.
const STEP: u64 = 16 << 20;
/// Number of bytes that each call covers.
pub const REACH: u64 = 8 * STEP;

/// Frees the page cache behind the end of a file. It does not affect the contents of the file.
#[derive(Debug, Default)]
pub struct WrittenBehind {
    /// Length of the file at the last call of `fadvise` (bytes).
    advised: u64,
}

impl WrittenBehind {
    /// Called with the number of bytes that are in the file for good.
    pub(crate) fn advance(&mut self, file: &File, written: u64) {
        if let Some(range) = self.next(written) {
            let_go(file, &range);
        }
    }

    /// Returns the range of bytes to drop from the cache, if it is large enough.
    pub fn next(&mut self, written: u64) -> Option<Range<u64>> {
        let reach = written.saturating_sub(REACH).max(CACHED);
        if written < reach + STEP || written < self.advised + STEP {
            return None;
        }
        self.advised = written;
        Some(reach..written)
    }
}

/// Starts writing the dirty pages of a range to the disk and drops the clean ones from the cache.
/// This is advice: an error has no effect.
#[cfg(target_os = "linux")]
fn let_go(file: &File, range: &Range<u64>) {
    let length = std::num::NonZeroU64::new(range.end - range.start);
    let _ = rustix::fs::fadvise(file, range.start, length, rustix::fs::Advice::DontNeed);
}

#[cfg(not(target_os = "linux"))]
fn let_go(_file: &File, _range: &Range<u64>) {}
