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
//! Start at [`LongRecord::push`].

use nalgebra::Vector3;

use crate::error_parts::{ErrorParts, error_parts};
use crate::hold::HoldMetrics;
use crate::metrics::{MetricSettings, TcpMetrics, tcp_metrics_on_path};
use crate::record::{ErrorRecord, RecordError};
use crate::repeated_pose::repeated_poses;

/// Number of first samples of a stop and of last samples of a move that are never dropped; they
/// determine the ringing and the direction of arrival.
const RINGING: usize = 1 << 15;
const ARRIVAL: usize = 64;
/// Maximum number of blocks of the curve of maximum errors; beyond it pairs are merged.
const MAX_BLOCKS: usize = 1 << 13;

/// One sample: see the fields of [`ErrorRecord`].
#[derive(Debug, Clone, Copy)]
pub struct ErrorSample {
    /// Time, s.
    pub time_s: f64,
    /// Translation (m) and rotation vector (rad), world axes.
    pub error: [f64; 6],
    /// Translation along the path axes, m.
    pub path_error: [f64; 3],
    /// Position of the rigid TCP, m.
    pub rigid_position: [f64; 3],
    /// Static part of the translation, m; NaN if unknown.
    pub static_m: [f64; 3],
}

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
    /// Accumulated over all samples once the first are dropped; unused before.
    totals: Totals,
    curve: Curve,
    /// Number of moves whose samples are no longer kept; `holds` are the stops after them.
    past: usize,
    holds: Vec<HoldMetrics>,
    condensed: bool,
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
            condensed: false,
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
        if self.condensed {
            self.gather(sample);
        }
        if self.times.len() > self.most {
            self.condense();
        }
    }

    /// Adds a sample to the figures of the whole record.
    fn gather(&mut self, sample: &ErrorSample) {
        let begun = self.moves.partition_point(|(start, _)| *start <= sample.time_s);
        let moves = begun > 0 && sample.time_s <= self.moves[begun - 1].1;
        self.totals.add(sample, moves);
        self.curve.add(norm3(&sample.error));
    }

    /// Returns a sample that is kept.
    fn sample(&self, k: usize) -> ErrorSample {
        ErrorSample {
            time_s: self.times[k],
            error: self.errors[k],
            path_error: self.path_errors[k],
            rigid_position: self.positions[k],
            static_m: self.statics[k],
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
        if self.condensed { self.totals.count } else { self.times.len() }
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
        let rest = self.part(self.times.len(), self.past..self.moves.len())?;
        if !self.condensed {
            return Ok(rest);
        }
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        let holds: Vec<HoldMetrics> = self.holds.iter().chain(&rest.holds).cloned().collect();
        let settling = holds.iter().map(|hold| hold.settling_s).reduce(|a, b| Some(a?.max(b?)));
        let strongest = holds.iter().filter_map(|hold| hold.line).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
        let totals = &self.totals;
        let [tangential_peak_m, normal_peak_m, binormal_peak_m, lateral_peak_m] = totals.path_peaks;
        Ok(TcpMetrics {
            peak_m: totals.peak.1,
            t_peak_s: totals.peak.0,
            rms_m: totals.rms(0),
            static_sag_m: totals.first_m,
            peak_rad: totals.peak_rad,
            rms_rad: totals.rms(1),
            settling_s: settling.flatten(),
            overshoot_m: holds.iter().map(|hold| hold.overshoot_m).fold(0.0, f64::max),
            dominant_hz: strongest.map_or(rest.dominant_hz, |line| Some(line.hz)),
            tangential_peak_m,
            normal_peak_m,
            binormal_peak_m,
            lateral_peak_m,
            path_accuracy_m: totals.off_path_m,
            path_rms_m: (totals.squares / totals.moving.max(1) as f64).sqrt(),
            repeated: repeated_poses(&holds),
            holds,
            ..rest
        })
    }

    /// Splits the translation into its static and its dynamic part.
    ///
    /// # Errors
    /// Those of [`error_parts`].
    pub fn parts(&self) -> Result<ErrorParts, RecordError> {
        if !self.condensed {
            return error_parts(&self.times, &self.errors, &self.statics);
        }
        let (totals, statics) = (&self.totals, &self.totals.statics);
        if !self.statics_known {
            return Err(RecordError::NotFinite { what: "statics", index: 0 });
        }
        let size = totals.peak.1;
        let static_at_peak_m = if size > 0.0 { statics.along_peak / size } else { 0.0 };
        Ok(ErrorParts {
            static_at_peak_m,
            dynamic_at_peak_m: size - static_at_peak_m,
            static_peak_m: statics.peak_m,
            dynamic_peak_m: statics.dynamic_peak.1,
            t_dynamic_peak_s: statics.dynamic_peak.0,
            dynamic_rms_m: (statics.area / (totals.last_s - totals.start_s)).sqrt(),
        })
    }

    /// Returns the maximum magnitude of the translation in each of `pieces` equal pieces of the
    /// record, fewer if it has fewer samples.
    #[must_use]
    pub fn largest_errors(&self, pieces: usize) -> Vec<f64> {
        if self.condensed {
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
        if !std::mem::replace(&mut self.condensed, true) {
            (0..self.times.len()).for_each(|k| self.gather(&self.sample(k)));
        }
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

/// Figures of the whole record, in the order and by the sums of [`tcp_metrics_on_path`].
#[derive(Debug, Clone, Default)]
struct Totals {
    count: usize,
    start_s: f64,
    last_s: f64,
    /// Magnitudes of translation and rotation in the last sample.
    last: [f64; 2],
    first_m: f64,
    /// Time and magnitude.
    peak: (f64, f64),
    peak_rad: f64,
    /// Integrals of the squares of both magnitudes.
    areas: [f64; 2],
    path_peaks: [f64; 4],
    /// During moves: maximum distance from the path, sum of its squares, number of samples.
    off_path_m: f64,
    squares: f64,
    moving: usize,
    statics: StaticTotals,
}

/// Figures of the static and the dynamic part, in the order and by the sums of [`error_parts`].
#[derive(Debug, Clone, Default)]
struct StaticTotals {
    peak_m: f64,
    /// Static part times error at the maximum error (m²).
    along_peak: f64,
    /// Time and magnitude.
    dynamic_peak: (f64, f64),
    /// Square of the dynamic part in the last sample, and its integral.
    last: f64,
    area: f64,
}

impl StaticTotals {
    /// `since` is the time since the previous sample (s), `None` for the first one.
    fn add(&mut self, time_s: f64, since: Option<f64>, error: Vector3<f64>, resting: Vector3<f64>, is_peak: bool) {
        let rest = error - resting;
        self.peak_m = if since.is_none() { resting.norm() } else { self.peak_m.max(resting.norm()) };
        if since.is_none() || rest.norm() > self.dynamic_peak.1 {
            self.dynamic_peak = (time_s, rest.norm());
        }
        if is_peak {
            self.along_peak = resting.dot(&error);
        }
        let squares = rest.norm_squared();
        self.area += since.map_or(0.0, |since| 0.5 * (self.last + squares) * since);
        self.last = squares;
    }
}

impl Totals {
    fn add(&mut self, sample: &ErrorSample, moves: bool) {
        let ErrorSample { time_s, error: e, path_error: [t, n, b], static_m, .. } = *sample;
        let since = (self.count > 0).then_some(time_s - self.last_s);
        let sizes = [Vector3::new(e[0], e[1], e[2]).norm(), Vector3::new(e[3], e[4], e[5]).norm()];
        if self.count == 0 {
            (self.start_s, self.first_m) = (time_s, sizes[0]);
            self.peak_rad = sizes[1];
        } else {
            for ((area, before), size) in self.areas.iter_mut().zip(self.last).zip(sizes) {
                *area += 0.5 * (before.powi(2) + size.powi(2)) * (time_s - self.last_s);
            }
        }
        let is_peak = self.count == 0 || sizes[0] > self.peak.1;
        if is_peak {
            self.peak = (time_s, sizes[0]);
        }
        self.statics.add(time_s, since, Vector3::new(e[0], e[1], e[2]), static_m.into(), is_peak);
        self.peak_rad = if sizes[1] > self.peak_rad { sizes[1] } else { self.peak_rad };
        for (peak, value) in self.path_peaks.iter_mut().zip([t, n, b, n.hypot(b)]) {
            *peak = peak.max(value.abs());
        }
        if moves {
            self.off_path_m = self.off_path_m.max(n.hypot(b));
            self.squares += n * n + b * b;
            self.moving += 1;
        }
        (self.last_s, self.last) = (time_s, sizes);
        self.count += 1;
    }

    /// Root mean square over time of the translation (0) or rotation (1).
    fn rms(&self, which: usize) -> f64 {
        match self.count {
            0 | 1 => self.last[which],
            _ => (self.areas[which] / (self.last_s - self.start_s)).sqrt(),
        }
    }
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
