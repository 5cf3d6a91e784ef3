//! The figures of a whole record.
//!
//! Start at [`tcp_metrics`]. Figures after each move are in `hold`, the spectrum in `spectrum`.

use nalgebra::Vector3;

use crate::hold::{Hold, HoldMetrics, is_seen};
use crate::path_frame::{path_frames, tangential_at};
use crate::record::{ErrorRecord, RecordError};
use crate::repeated_pose::{RepeatedPose, repeated_poses};
use crate::spectrum::{Taper, strongest_line_from};

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

    let translation = |e: &[f64; 6]| Vector3::new(e[0], e[1], e[2]).norm();
    let rotation = |e: &[f64; 6]| Vector3::new(e[3], e[4], e[5]).norm();
    let distances: Vec<f64> = record.errors.iter().map(translation).collect();
    let angles: Vec<f64> = record.errors.iter().map(rotation).collect();
    let (t_peak_s, peak_m) = peak(record.times, &distances);
    let (_, peak_rad) = peak(record.times, &angles);

    let from_positions = || -> Vec<[f64; 3]> {
        let frames = path_frames(record.times, record.rigid_positions);
        let pairs = record.errors.iter().zip(&frames);
        pairs.map(|(e, frame)| frame.components(&Vector3::new(e[0], e[1], e[2]))).collect()
    };
    let computed = if path_errors.is_none() { from_positions() } else { Vec::new() };
    let path_errors = path_errors.unwrap_or(&computed);
    let [tangential_peak_m, normal_peak_m, binormal_peak_m, lateral_peak_m] = path_peaks(path_errors);
    let [path_accuracy_m, path_rms_m] = path_accuracy(record, path_errors);
    let holds = holds(record, band);
    // The worst stop counts; one stop that does not settle is enough.
    let settling = holds.iter().map(|hold| hold.settling_s).reduce(|a, b| Some(a?.max(b?)));
    Ok(TcpMetrics {
        peak_m,
        t_peak_s,
        rms_m: rms(record.times, &distances),
        end_m: distances[distances.len() - 1],
        static_sag_m: distances[0],
        peak_rad,
        rms_rad: rms(record.times, &angles),
        settling_s: settling.flatten(),
        overshoot_m: holds.iter().map(|hold| hold.overshoot_m).fold(0.0, f64::max),
        dominant_hz: dominant_hz(record, &holds, settings),
        tangential_peak_m,
        normal_peak_m,
        binormal_peak_m,
        lateral_peak_m,
        path_accuracy_m,
        path_rms_m,
        repeated: repeated_poses(&holds),
        holds,
    })
}

/// Time and value of the maximum, the first one if there are several.
fn peak(times: &[f64], values: &[f64]) -> (f64, f64) {
    let first = (times[0], values[0]);
    times.iter().copied().zip(values.iter().copied()).fold(first, |best, e| if e.1 > best.1 { e } else { best })
}

/// Root mean square over time.
fn rms(times: &[f64], values: &[f64]) -> f64 {
    let last = times.len() - 1;
    if last == 0 {
        return values[0];
    }
    let area = |i: usize| 0.5 * (values[i].powi(2) + values[i + 1].powi(2)) * (times[i + 1] - times[i]);
    ((0..last).map(area).sum::<f64>() / (times[last] - times[0])).sqrt()
}

/// Peaks along the tangential, normal and binormal axis, and of the distance from the path.
fn path_peaks(path_errors: &[[f64; 3]]) -> [f64; 4] {
    let mut peaks: [f64; 4] = [0.0; 4];
    for &[t, n, b] in path_errors {
        for (peak, value) in peaks.iter_mut().zip([t, n, b, n.hypot(b)]) {
            *peak = peak.max(value.abs());
        }
    }
    peaks
}

/// Maximum and root mean square distance from the path in the samples of the moves.
fn path_accuracy(record: &ErrorRecord<'_>, path_errors: &[[f64; 3]]) -> [f64; 2] {
    let (mut largest, mut squares, mut count) = (0.0_f64, 0.0, 0_usize);
    for (t, [_, n, b]) in record.times.iter().zip(path_errors) {
        if !record.moves.iter().any(|(start, end)| (*start..=*end).contains(t)) {
            continue;
        }
        largest = largest.max(n.hypot(*b));
        squares += n * n + b * b;
        count += 1;
    }
    [largest, (squares / count.max(1) as f64).sqrt()]
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

fn dominant_hz(record: &ErrorRecord<'_>, holds: &[HoldMetrics], settings: &MetricSettings) -> Option<f64> {
    let lines = holds.iter().filter_map(|hold| hold.line);
    if let Some(line) = lines.max_by(|a, b| a.amplitude.total_cmp(&b.amplitude)) {
        return Some(line.hz);
    }
    let trend = |i: usize, c: usize| record.quasi_static.map_or(0.0, |values| values[i][c]);
    let rest = record.errors.iter().enumerate();
    let rest: Vec<[f64; 3]> = rest.map(|(i, e)| std::array::from_fn(|c| e[c] - trend(i, c))).collect();
    let line = strongest_line_from(record.times, &rest, Taper::Both, settings.lowest_hz);
    // An arm at rest oscillates by rounding.
    line.filter(|line| is_seen(line, settings.settling_band_m)).map(|line| line.hz)
}
