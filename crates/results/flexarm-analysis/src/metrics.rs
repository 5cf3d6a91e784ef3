//! The figures of a whole record.
//!
//! Start at [`tcp_metrics`]. World axes; path axes are tangential, normal, binormal. Not here:
//! figures after each move (`hold`), sums over the samples (`totals`), the spectrum (`spectrum`).

use nalgebra::Vector3;

use crate::hold::{Hold, HoldMetrics, is_significant};
use crate::path_frame::{path_frames, tangential_at};
use crate::record::{ErrorRecord, ErrorSample, RecordError};
use crate::repeated_pose::RepeatedPose;
use crate::spectrum::{Taper, strongest_line_from};
use crate::totals::Totals;

/// Settings of the figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetricSettings {
    /// Half width of the band (radius of the sphere) around the final value for settling and
    /// overshoot, m.
    pub settling_band_m: f64,
    /// Frequency below which the arm does not ring, Hz; 0 if unknown. If no stop is long enough to
    /// show a line, slower lines in the whole record are attributed to the motion.
    pub lowest_hz: f64,
}

impl Default for MetricSettings {
    /// A band of 0.1 mm.
    fn default() -> Self {
        Self { settling_band_m: 1e-4, lowest_hz: 0.0 }
    }
}

/// Figures of the TCP error `e` (translation, m) and `θ` (rotation vector, rad) over a record from
/// `t_0` to `t_n`.
#[derive(Debug, Clone, PartialEq)]
pub struct TcpMetrics {
    /// `max |e|`, m.
    pub peak_m: f64,
    /// Time of `peak_m`, s.
    pub t_peak_s: f64,
    /// `sqrt(1/(t_n - t_0) ∫ |e|² dt)`, m, by the trapezoidal rule, so that uneven steps are
    /// weighted correctly.
    pub rms_m: f64,
    /// `|e(t_n)|`, m: the error at the end of the record.
    pub end_m: f64,
    /// `|e(t_0)|`, m: the static deflection if the run started in equilibrium; 0 if undeformed.
    pub static_sag_m: f64,
    /// `max |θ|`, rad.
    pub peak_rad: f64,
    /// `sqrt(1/(t_n - t_0) ∫ |θ|² dt)`, rad.
    pub rms_rad: f64,
    /// Settling time, s: the maximum [`HoldMetrics::settling_s`] of all holds. `None` if the error
    /// has not settled before the end of some hold, or if there is no hold after a move.
    pub settling_s: Option<f64>,
    /// Maximum [`HoldMetrics::overshoot_m`] of all holds, m (position overshoot OV); 0 without a
    /// hold.
    pub overshoot_m: f64,
    /// Frequency of the strongest line in any hold after a move, Hz. Without one: the strongest
    /// line, not slower than [`MetricSettings::lowest_hz`], of the whole record of `e` minus the
    /// quasi-static error (minus its mean if that is unknown). `None` if no line is significant.
    pub dominant_hz: Option<f64>,
    /// `max |e·t|`, m: ahead of or behind the rigid TCP, along its path.
    pub tangential_peak_m: f64,
    /// `max |e·n|`, m: across the path, in its plane.
    pub normal_peak_m: f64,
    /// `max |e·b|`, m: out of the plane of the path.
    pub binormal_peak_m: f64,
    /// `max sqrt((e·n)² + (e·b)²)`, m: distance from the path.
    pub lateral_peak_m: f64,
    /// Maximum distance from the path while the robot moves, m (path accuracy AT); 0 without a
    /// move.
    pub path_accuracy_m: f64,
    /// Root mean square distance from the path over the samples of the moves, m; 0 without a move.
    pub path_rms_m: f64,
    /// The hold after each move, if there is one (at least two samples), in order.
    pub holds: Vec<HoldMetrics>,
    /// Poses at which the TCP rests more than once.
    pub repeated: Vec<RepeatedPose>,
}

/// Condenses a record of the TCP error.
///
/// # Errors
/// [`RecordError`] if the record is empty, its slices differ in length, a value is not finite,
/// times or moves do not ascend, or the band is not positive.
pub fn tcp_metrics(record: &ErrorRecord<'_>, settings: &MetricSettings) -> Result<TcpMetrics, RecordError> {
    tcp_metrics_on_path(record, None, settings)
}

/// Like [`tcp_metrics`], with given components of the errors along the path axes (tangential,
/// normal, binormal; m), one per sample, if they are known more accurately than from positions.
///
/// # Errors
/// Those of [`tcp_metrics`], also for the field `path_errors`.
pub fn tcp_metrics_on_path(
    record: &ErrorRecord<'_>,
    path_errors: Option<&[[f64; 3]]>,
    settings: &MetricSettings,
) -> Result<TcpMetrics, RecordError> {
    let band = settings.settling_band_m;
    if !(band > 0.0 && band.is_finite()) {
        return Err(RecordError::BadBand { found: band });
    }
    record.check()?;
    if let Some(path_errors) = path_errors {
        let (found, expected) = (path_errors.len(), record.times.len());
        if found != expected {
            return Err(RecordError::Length { what: "path_errors", found, expected });
        }
        if let Some(index) = path_errors.iter().position(|row| row.iter().any(|value| !value.is_finite())) {
            return Err(RecordError::NotFinite { what: "path_errors", index });
        }
    }

    // Components along the path, from the positions unless they are given.
    let from_positions = || -> Vec<[f64; 3]> {
        let frames = path_frames(record.times, record.rigid_positions);
        let pairs = record.errors.iter().zip(&frames);
        pairs.map(|(e, frame)| frame.components(&Vector3::new(e[0], e[1], e[2]))).collect()
    };
    let computed = if path_errors.is_none() { from_positions() } else { Vec::new() };
    let path_errors = path_errors.unwrap_or(&computed);

    let mut totals = Totals::default();
    for (i, &time_s) in record.times.iter().enumerate() {
        let (error, path_error, rigid_position) = (record.errors[i], path_errors[i], record.rigid_positions[i]);
        let sample = ErrorSample { time_s, error, path_error, rigid_position, static_m: [0.0; 3] };
        totals.add(&sample, is_in_move(record.moves, time_s));
    }
    Ok(totals.metrics(holds(record, band), || record_hz(record, settings)))
}

/// Returns whether a time is within one of the moves, which ascend.
pub(crate) fn is_in_move(moves: &[(f64, f64)], time_s: f64) -> bool {
    let begun = moves.partition_point(|(start, _)| *start <= time_s);
    begun > 0 && time_s <= moves[begun - 1].1
}

/// Returns the hold after each move that has one.
fn holds(record: &ErrorRecord<'_>, band: f64) -> Vec<HoldMetrics> {
    let mut holds = Vec::new();
    for (i, &(start, end)) in record.moves.iter().enumerate() {
        // Times of moves and of samples come from different sums; a billionth of the record counts
        // as equal.
        let slack = 1e-9 * (record.times[record.times.len() - 1] - record.times[0]);
        let until = record.moves.get(i + 1).map_or(f64::INFINITY, |next| next.0);
        let first = record.times.partition_point(|&t| t < end - slack);
        let after = record.times.partition_point(|&t| t <= until + slack);
        if after < first + 2 {
            continue;
        }

        // The axes are kept at rest, so those at the first sample of the hold still show the
        // direction of arrival.
        let before = record.times.partition_point(|&t| t < start);
        let has_moved = record.rigid_positions[before..=first].iter().any(|p| *p != record.rigid_positions[first]);
        let hold = Hold {
            times: &record.times[first..after],
            errors: record.errors[first..after].iter().map(|e| [e[0], e[1], e[2]]).collect(),
            place_m: record.rigid_positions[after - 1],
            final_static: record.quasi_static.map(|values| values[after - 1]),
            approach: has_moved.then(|| tangential_at(record.times, record.rigid_positions, first)),
        };
        holds.push(hold.metrics(end, band));
    }
    holds
}

/// Returns the frequency of the strongest line of the whole record without its trend (Hz).
fn record_hz(record: &ErrorRecord<'_>, settings: &MetricSettings) -> Option<f64> {
    let trend = |i: usize, c: usize| record.quasi_static.map_or(0.0, |values| values[i][c]);
    let rest = record.errors.iter().enumerate();
    let rest: Vec<[f64; 3]> = rest.map(|(i, e)| std::array::from_fn(|c| e[c] - trend(i, c))).collect();
    let line = strongest_line_from(record.times, &rest, Taper::Both, settings.lowest_hz);
    // An arm at rest oscillates by rounding.
    line.filter(|line| is_significant(line, settings.settling_band_m)).map(|line| line.hz)
}
