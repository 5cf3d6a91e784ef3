//! Rate limiter for messages sent less often than samples arrive.

/// Selects the first sample of every interval of simulated time; the average rate never exceeds
/// `hz`.
#[derive(Clone, Copy, Debug)]
pub struct Beat {
    hz: u32,
    last: Option<u64>,
}

impl Beat {
    /// At most `hz` messages a second.
    pub fn new(hz: u32) -> Self {
        Self { hz, last: None }
    }

    /// Whether to send the sample at this time since the start (ns).
    pub fn due(&mut self, since_start_ns: u64) -> bool {
        let interval = u128::from(since_start_ns) * u128::from(self.hz) / 1_000_000_000;
        let interval = u64::try_from(interval).unwrap_or(u64::MAX);
        let due = self.last.is_none_or(|last| interval > last);
        if due {
            self.last = Some(interval);
        }
        due
    }
}
