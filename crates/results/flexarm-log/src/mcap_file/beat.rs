//! Rate limiter for messages sent less often than samples arrive.

/// Selects the first sample of every interval of simulated time; the average rate never exceeds
/// `hz`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beat {
    hz: u32,
    last: Option<u64>,
}

impl Beat {
    pub(crate) fn new(hz: u32) -> Self {
        Self { hz, last: None }
    }

    /// Whether to send the sample at this time since the start (ns).
    pub(crate) fn due(&mut self, since_start_ns: u64) -> bool {
        let interval = u128::from(since_start_ns) * u128::from(self.hz) / 1_000_000_000;
        let interval = u64::try_from(interval).unwrap_or(u64::MAX);
        let due = self.last.is_none_or(|last| interval > last);
        if due {
            self.last = Some(interval);
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_samples_are_thinned_to_the_rate_and_slow_ones_all_pass() {
        let count = |every_ns: u64, samples: u64| {
            let mut beat = Beat::new(60);
            (0..=samples).filter(|k| beat.due(k * every_ns)).count()
        };
        assert_eq!(count(2_000_000, 500), 61); // one second at 500 Hz, both ends
        assert_eq!(count(20_000_000, 50), 51); // 50 Hz
    }
}
