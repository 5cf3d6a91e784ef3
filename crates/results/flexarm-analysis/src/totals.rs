//! Figures of the TCP error that need one sample at a time: peaks and root mean squares.
//!
//! Whole records and records with bounded memory share them. World axes, SI units. Not here: static
//! and dynamic parts (`error_parts`), stops (`hold`), frequencies (`spectrum`), checks (`record`).

use nalgebra::Vector3;

use crate::error_parts::StaticTotals;
use crate::hold::HoldMetrics;
use crate::metrics::TcpMetrics;
use crate::record::ErrorSample;
use crate::repeated_pose::repeated_poses;

/// Figures of the samples so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Totals {
    pub(crate) count: usize,
    pub(crate) start_s: f64,
    last_s: f64,
    /// Magnitudes of translation and rotation in the last sample.
    last: [f64; 2],
    /// Magnitude of the translation in the first sample.
    first_m: f64,
    /// Time and magnitude.
    peak: (f64, f64),
    peak_rad: f64,
    /// Integrals of the squares of both magnitudes.
    areas: [f64; 2],
    /// Tangential, normal, binormal, lateral.
    path_peaks: [f64; 4],
    /// During moves: maximum distance from the path, sum of its squares, number of samples.
    off_path_m: f64,
    squares: f64,
    moving: usize,
    pub(crate) statics: StaticTotals,
}

impl Totals {
    /// Adds a sample; `in_move`: whether the joints are commanded to move.
    pub(crate) fn add(&mut self, sample: &ErrorSample, in_move: bool) {
        let ErrorSample { time_s, error: [x, y, z, rx, ry, rz], path_error: [t, n, b], static_m, .. } = *sample;
        let e = Vector3::new(x, y, z);
        let sizes = [e.norm(), Vector3::new(rx, ry, rz).norm()];

        // Trapezoidal rule, so that uneven steps are weighted correctly.
        if self.count == 0 {
            (self.start_s, self.first_m) = (time_s, sizes[0]);
        } else {
            for ((area, before), size) in self.areas.iter_mut().zip(self.last).zip(sizes) {
                *area += 0.5 * (before.powi(2) + size.powi(2)) * (time_s - self.last_s);
            }
        }
        // The first of equal peaks counts.
        if self.count == 0 || sizes[0] > self.peak.1 {
            self.peak = (time_s, sizes[0]);
        }
        self.peak_rad = self.peak_rad.max(sizes[1]);
        self.statics.add(time_s, e, static_m.into());

        // Distances along and across the path.
        let lateral = n.hypot(b);
        for (peak, value) in self.path_peaks.iter_mut().zip([t, n, b, lateral]) {
            *peak = peak.max(value.abs());
        }
        if in_move {
            self.off_path_m = self.off_path_m.max(lateral);
            self.squares += n * n + b * b;
            self.moving += 1;
        }
        (self.last_s, self.last) = (time_s, sizes);
        self.count += 1;
    }

    /// Returns all figures, with the stops and the frequency of the record without them (Hz).
    pub(crate) fn metrics(&self, holds: Vec<HoldMetrics>, record_hz: impl FnOnce() -> Option<f64>) -> TcpMetrics {
        // The worst stop counts; one stop that does not settle is enough.
        let settling = holds.iter().map(|hold| hold.settling_s).reduce(|a, b| Some(a?.max(b?)));
        let strongest = holds.iter().filter_map(|hold| hold.line).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
        let [tangential_peak_m, normal_peak_m, binormal_peak_m, lateral_peak_m] = self.path_peaks;
        TcpMetrics {
            peak_m: self.peak.1,
            t_peak_s: self.peak.0,
            rms_m: self.rms(0),
            end_m: self.last[0],
            static_sag_m: self.first_m,
            peak_rad: self.peak_rad,
            rms_rad: self.rms(1),
            settling_s: settling.flatten(),
            overshoot_m: holds.iter().map(|hold| hold.overshoot_m).fold(0.0, f64::max),
            dominant_hz: strongest.map_or_else(record_hz, |line| Some(line.hz)),
            tangential_peak_m,
            normal_peak_m,
            binormal_peak_m,
            lateral_peak_m,
            path_accuracy_m: self.off_path_m,
            path_rms_m: (self.squares / self.moving.max(1) as f64).sqrt(),
            repeated: repeated_poses(&holds),
            holds,
        }
    }

    /// Root mean square over time of the translation (0) or rotation (1).
    fn rms(&self, which: usize) -> f64 {
        match self.count {
            0 | 1 => self.last[which],
            _ => (self.areas[which] / (self.last_s - self.start_s)).sqrt(),
        }
    }
}
