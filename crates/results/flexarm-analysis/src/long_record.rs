//! A record that grows during a run with bounded memory.
//!
//! Up to [`LongRecord::MAX`] samples all are kept, and the figures are those of
//! [`tcp_metrics_on_path`]. Beyond that, finished stops are evaluated and their samples dropped,
//! and figures of the whole record are accumulated sample by sample, by the same sums. Exceptions
//! to exactness:
//!
//! * a move or a stop longer than that is thinned: its older half, except for the beginning of the
//!   stop, loses every second sample, repeatedly, so that recent samples are complete. Only the end
//!   of a stop depends on it (final value, settling), to within one sampling interval;
//! * if no stop has a frequency, that of the record is computed from the remaining samples, its
//!   end.
//!
//! Start at [`LongRecord::push`]. World axes, SI units. Not here: the sums (`totals`), the stops
//! (`hold`).

use crate::error_parts::ErrorParts;
use crate::hold::HoldMetrics;
use crate::metrics::{MetricSettings, TcpMetrics, is_in_move, tcp_metrics_on_path};
use crate::record::{ErrorRecord, ErrorSample, RecordError};
use crate::totals::Totals;

/// Number of first samples of a stop and of last samples of a move that are never dropped; they
/// determine the ringing and the direction of arrival.
const RINGING: usize = 1 << 15;
const ARRIVAL: usize = 64;
/// Maximum number of blocks of the curve of maximum errors; beyond it pairs are merged.
const MAX_BLOCKS: usize = 1 << 13;

/// A record of the TCP error with bounded memory; see the module.
#[derive(Debug, Clone)]
pub struct LongRecord {
    settings: MetricSettings,
    /// Start and end of each move, s.
    moves: Vec<(f64, f64)>,
    /// Whether the TCP comes to rest at the static part of its error.
    rests_there: bool,
    most: usize,
    times: Vec<f64>,
    errors: Vec<[f64; 6]>,
    path_errors: Vec<[f64; 3]>,
    positions: Vec<[f64; 3]>,
    statics: Vec<[f64; 3]>,
    /// Whether the static part of every sample is known.
    statics_known: bool,
    /// Accumulated over all samples.
    totals: Totals,
    curve: Curve,
    /// Number of moves whose samples are no longer kept; `holds` are the stops after them.
    past: usize,
    holds: Vec<HoldMetrics>,
    /// First error in a part that is no longer kept.
    fault: Option<RecordError>,
}

impl LongRecord {
    /// Maximum number of samples kept individually: 65,536, which is 2 minutes and 11 seconds at
    /// 500 samples per second and takes 8 MB.
    pub const MAX: usize = 1 << 16;

    /// Creates an empty record of a motion with these moves (start and end, s, ascending). If
    /// `rests_there`, the TCP comes to rest at the static part of its error, which is then the
    /// final value of stops ([`ErrorRecord::quasi_static`]).
    #[must_use]
    pub fn new(moves: Vec<(f64, f64)>, rests_there: bool, settings: MetricSettings) -> Self {
        Self { rests_there, ..Self::keeping(Self::MAX, moves, settings) }
    }

    /// Works as [`LongRecord::new`] with another maximum number of samples, for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn keeping(most: usize, moves: Vec<(f64, f64)>, settings: MetricSettings) -> Self {
        Self {
            settings,
            moves,
            rests_there: false,
            most,
            times: Vec::new(),
            errors: Vec::new(),
            path_errors: Vec::new(),
            positions: Vec::new(),
            statics: Vec::new(),
            statics_known: true,
            totals: Totals::default(),
            curve: Curve::default(),
            past: 0,
            holds: Vec::new(),
            fault: None,
        }
    }

    /// Reserves memory for a number of samples, up to the number that is kept.
    #[must_use]
    pub fn with_capacity(mut self, samples: usize) -> Self {
        let samples = samples.min(self.most + 1);
        self.times.reserve_exact(samples);
        self.errors.reserve_exact(samples);
        self.path_errors.reserve_exact(samples);
        self.positions.reserve_exact(samples);
        self.statics.reserve_exact(samples);
        self
    }

    /// Adds a sample.
    pub fn push(&mut self, sample: &ErrorSample) {
        self.times.push(sample.time_s);
        self.errors.push(sample.error);
        self.path_errors.push(sample.path_error);
        self.positions.push(sample.rigid_position);
        self.statics.push(sample.static_m);
        self.statics_known &= sample.static_m.iter().all(|x| x.is_finite());
        self.totals.add(sample, is_in_move(&self.moves, sample.time_s));
        self.curve.add(norm3(&sample.error));
        if self.times.len() > self.most {
            self.condense();
        }
    }

    /// Returns the number of samples that are kept and of moves whose samples are not, for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn kept(&self) -> [usize; 2] {
        [self.times.len(), self.past]
    }

    /// Returns the number of samples added.
    #[must_use]
    pub fn len(&self) -> usize {
        self.totals.count
    }

    /// Returns whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the time of the last sample, s.
    #[must_use]
    pub fn last_time_s(&self) -> Option<f64> {
        self.times.last().copied()
    }

    /// Computes the figures of all samples so far.
    ///
    /// # Errors
    /// Those of [`tcp_metrics_on_path`].
    pub fn metrics(&self) -> Result<TcpMetrics, RecordError> {
        let kept = self.part(self.times.len(), self.past..self.moves.len())?;
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        let holds = self.holds.iter().chain(&kept.holds).cloned().collect();
        Ok(self.totals.metrics(holds, || kept.dominant_hz))
    }

    /// Splits the translation into its static and its dynamic part.
    ///
    /// # Errors
    /// Those of [`crate::error_parts`]; the index of an unknown static part is 0.
    pub fn parts(&self) -> Result<ErrorParts, RecordError> {
        match (self.is_empty(), self.statics_known) {
            (true, _) => Err(RecordError::Empty),
            (_, false) => Err(RecordError::NotFinite { what: "statics", index: 0 }),
            _ => Ok(self.totals.statics.parts()),
        }
    }

    /// Returns the maximum magnitude of the translation (m) in each of `pieces` equal pieces of the
    /// record, fewer if it has fewer samples.
    #[must_use]
    pub fn largest_errors(&self, pieces: usize) -> Vec<f64> {
        if self.times.len() < self.len() {
            return largest_of(&self.curve.blocks, pieces);
        }
        largest_of(&self.errors.iter().map(norm3).collect::<Vec<f64>>(), pieces)
    }

    /// Computes the figures of the first `length` kept samples, with some of the moves.
    fn part(&self, length: usize, moves: std::ops::Range<usize>) -> Result<TcpMetrics, RecordError> {
        let record = ErrorRecord {
            times: &self.times[..length],
            errors: &self.errors[..length],
            rigid_positions: &self.positions[..length],
            quasi_static: (self.rests_there && self.statics_known).then_some(&self.statics[..length]),
            moves: &self.moves[moves],
        };
        tcp_metrics_on_path(&record, Some(&self.path_errors[..length]), &self.settings)
    }

    /// Evaluates finished stops and drops their samples; thins the rest if it is still large.
    fn condense(&mut self) {
        let now = self.times[self.times.len() - 1];
        // Times of moves and of samples come from different sums and differ by rounding.
        let slack = 1e-9 * (now - self.totals.start_s);
        let done = self.moves.partition_point(|(start, _)| *start + slack < now).saturating_sub(1);
        if done > self.past {
            // The sample at the start of the next move, or before it, is the last of this part and
            // the first of the next.
            let start = self.moves[done].0;
            let end = self.times.partition_point(|t| *t <= start + slack);
            match self.part(end, self.past..done) {
                Ok(metrics) => self.holds.extend(metrics.holds),
                Err(fault) => self.fault = self.fault.take().or(Some(fault)),
            }
            self.keep(|k, _| k + 1 >= end);
            self.past = done;
        }
        if self.times.len() > self.most / 2 {
            let stop = self.moves.get(self.past).map_or(0.0, |(_, end)| *end);
            let (old, stop) = (self.times.len() / 2, self.times.partition_point(|t| *t < stop));
            let (arrival, ringing) = (ARRIVAL.min(self.most / 8), RINGING.min(self.most / 8));
            self.keep(|k, _| k >= old || k % 2 == 0 || k + arrival >= stop && k < stop + ringing);
        }
    }

    /// Keeps only the samples selected by index and time.
    fn keep(&mut self, keep: impl Fn(usize, f64) -> bool) {
        let kept: Vec<bool> = self.times.iter().enumerate().map(|(k, t)| keep(k, *t)).collect();
        fn retain<T>(values: &mut Vec<T>, kept: &[bool]) {
            let mut kept = kept.iter();
            values.retain(|_| kept.next().copied().unwrap_or(true));
        }
        retain(&mut self.times, &kept);
        retain(&mut self.errors, &kept);
        retain(&mut self.path_errors, &kept);
        retain(&mut self.positions, &kept);
        retain(&mut self.statics, &kept);
    }
}

/// Maximum value in each of equal pieces.
fn largest_of(values: &[f64], pieces: usize) -> Vec<f64> {
    let pieces = pieces.min(values.len());
    let range = |k: usize| {
        let start = k * values.len() / pieces;
        start..((k + 1) * values.len() / pieces).max(start + 1)
    };
    (0..pieces).map(|k| values[range(k)].iter().copied().fold(0.0, f64::max)).collect()
}

fn norm3(error: &[f64; 6]) -> f64 {
    (error[0] * error[0] + error[1] * error[1] + error[2] * error[2]).sqrt()
}

/// Maximum errors in blocks with equal numbers of samples; the block size doubles when there are
/// too many.
#[derive(Debug, Clone)]
struct Curve {
    blocks: Vec<f64>,
    size: usize,
    /// Samples in the last block.
    filled: usize,
}

impl Default for Curve {
    fn default() -> Self {
        Self { blocks: Vec::new(), size: 1, filled: 1 }
    }
}

impl Curve {
    fn add(&mut self, value: f64) {
        if self.filled < self.size {
            self.filled += 1;
            if let Some(last) = self.blocks.last_mut() {
                *last = last.max(value);
            }
            return;
        }
        if self.blocks.len() == MAX_BLOCKS {
            self.blocks = self.blocks.chunks(2).map(|pair| pair.iter().copied().fold(0.0, f64::max)).collect();
            self.size *= 2;
        }
        self.blocks.push(value);
        self.filled = 1;
    }
}
