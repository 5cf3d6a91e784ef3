//! Long files that do not fill the memory of the machine.
//!
//! What is written to a file stays in the system's cache until other files need the room. When 15
//! GB of recordings had filled it, each further page took the system five times as long as one
//! before (1.5 instead of 0.3 s a GB, Linux 6, 24 GB), and what others had cached was gone.
//! [`WrittenBehind`] sends what is far behind to the disk and lets go of it.

use std::fs::File;
use std::ops::Range;

/// The beginning of a file stays cached: most files are no longer, and are looked at next.
const CACHED: u64 = 1 << 30;
/// So often advice is given, and so far back: the disk has time until the second to the last one
/// reaches a page.
const STEP: u64 = 16 << 20;
const REACH: u64 = 8 * STEP;

/// See the module. Nothing in a file depends on it.
#[derive(Debug, Default)]
pub(crate) struct WrittenBehind {
    /// Bytes that were in the file when advice was given last.
    advised: u64,
}

impl WrittenBehind {
    /// To be called when so many bytes are in a file for good.
    pub(crate) fn advance(&mut self, file: &File, written: u64) {
        if let Some(range) = self.next(written) {
            let_go(file, &range);
        }
    }

    /// Bytes that need not stay in memory, where there are enough of them.
    fn next(&mut self, written: u64) -> Option<Range<u64>> {
        let reach = written.saturating_sub(REACH).max(CACHED);
        if written < reach + STEP || written < self.advised + STEP {
            return None;
        }
        self.advised = written;
        Some(reach..written)
    }
}

/// What of these bytes the disk does not have is sent to it, what it has leaves the cache. It is
/// advice: an error means that all stays as it is.
#[cfg(target_os = "linux")]
fn let_go(file: &File, range: &Range<u64>) {
    let length = std::num::NonZeroU64::new(range.end - range.start);
    let _ = rustix::fs::fadvise(file, range.start, length, rustix::fs::Advice::DontNeed);
}

#[cfg(not(target_os = "linux"))]
fn let_go(_file: &File, _range: &Range<u64>) {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: counted piece by piece. The first advice about a page sends it to the disk, a later
    /// one lets go of it.
    #[test]
    fn what_is_far_behind_is_let_go_of_and_the_beginning_is_not() {
        let (mut behind, mut given) = (WrittenBehind::default(), Vec::new());
        let end = CACHED + 20 * REACH;
        for written in (0..=end).step_by(300_000) {
            given.extend(behind.next(written));
        }
        assert!(given.iter().all(|range| range.start >= CACHED && range.end <= end));
        for piece in (CACHED..end - REACH).step_by(1 << 20) {
            let times = given.iter().filter(|range| range.contains(&piece)).count();
            assert!((6..=8).contains(&times), "{times} times about {piece}");
        }
        assert!((100..=160).contains(&given.len()), "{} times in all", given.len());
        // Short files are left alone.
        let mut short = WrittenBehind::default();
        assert!((0..CACHED).step_by(1 << 20).all(|written| short.next(written).is_none()));
    }
}
