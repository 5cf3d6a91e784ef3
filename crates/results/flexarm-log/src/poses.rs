//! Which samples of a run show poses of links: recordings have every sample's numbers, but pictures
//! need fewer.

use crate::Sample;

/// Shortest time between two poses (ns): every sample of a run logged at up to 200 Hz, fewer of
/// faster ones.
const EVERY_NS: u64 = 5_000_000;

/// What a sample is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shown {
    /// It is time for a pose.
    pub(crate) due: bool,
    /// No sample before has had so large an error.
    pub(crate) new_peak: bool,
}

/// Chooses the samples. The `.rrd` and the MCAP have one each, so that one can be made of the
/// other.
#[derive(Debug, Default)]
pub(crate) struct PoseClock {
    last_ns: Option<u64>,
    /// Largest error so far (m).
    largest_m: Option<f64>,
}

impl PoseClock {
    /// Takes a sample, so many ns after the start of the run. `has_rigid`: without a twin there is
    /// no error.
    pub(crate) fn take(&mut self, since_start_ns: u64, sample: &Sample, has_rigid: bool) -> Shown {
        let due = self.last_ns.is_none_or(|last| since_start_ns.saturating_sub(last) >= EVERY_NS);
        if due {
            self.last_ns = Some(since_start_ns);
        }
        let error_m = size(&sample.error_world[..3]);
        let new_peak = has_rigid && self.largest_m.is_none_or(|largest| error_m > largest);
        if new_peak {
            self.largest_m = Some(error_m);
        }
        Shown { due, new_peak }
    }
}

pub(crate) fn size(parts: &[f64]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_fast_samples_two_hundred_a_second_are_shown_and_those_with_a_larger_error_than_before() {
        let mut clock = PoseClock::default();
        let shown: Vec<Shown> = (0..=20_u64)
            .map(|ms| {
                let error = if ms < 8 { 1e-3 * ms as f64 } else { 0.0 };
                let sample = Sample { error_world: [error, 0.0, 0.0, 1.0, 1.0, 1.0], ..Sample::default() };
                clock.take(1_000_000 * ms, &sample, true)
            })
            .collect();
        let which =
            |of: &dyn Fn(&Shown) -> bool| -> Vec<usize> { (0..shown.len()).filter(|k| of(&shown[*k])).collect() };
        assert_eq!(which(&|shown| shown.due), [0, 5, 10, 15, 20]);
        assert_eq!(which(&|shown| shown.new_peak), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}
