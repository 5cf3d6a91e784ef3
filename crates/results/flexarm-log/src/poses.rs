//! Choice of the samples with poses of links: recordings have the numbers of every sample, but
//! animations need fewer poses.

use crate::Sample;
use crate::trace_blocks::norm;

/// Minimum time between two poses (ns): every sample of a run logged at up to 200 Hz, fewer of
/// faster ones.
const EVERY_NS: u64 = 5_000_000;

/// Reasons to write the poses of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseReasons {
    /// Whether a pose is due.
    pub due: bool,
    /// Whether the error exceeds that of all previous samples.
    pub new_peak: bool,
}

/// Chooses the samples. The `.rrd` and the MCAP recorder have one each, with the same choice, so
/// that an `.rrd` file can be made from an MCAP file.
#[derive(Debug, Default)]
pub struct PoseClock {
    last_ns: Option<u64>,
    /// Maximum error so far (m).
    largest_m: Option<f64>,
}

impl PoseClock {
    /// Takes a sample at a time since the start of the run (ns). Without a rigid twin (`has_rigid`)
    /// there is no error.
    pub fn take(&mut self, since_start_ns: u64, sample: &Sample, has_rigid: bool) -> PoseReasons {
        let due = self.last_ns.is_none_or(|last| since_start_ns.saturating_sub(last) >= EVERY_NS);
        if due {
            self.last_ns = Some(since_start_ns);
        }
        let error_m = norm(&sample.error_world[..3]);
        let new_peak = has_rigid && self.largest_m.is_none_or(|largest| error_m > largest);
        if new_peak {
            self.largest_m = Some(error_m);
        }
        PoseReasons { due, new_peak }
    }
}
