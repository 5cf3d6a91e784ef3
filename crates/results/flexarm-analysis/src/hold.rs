//! Figures of the TCP error after a move, while the joints hold: final value, settling, overshoot,
//! ringing.
//!
//! Start at `Hold::metrics`. World axes, SI units. Not here: the search for holds (`metrics`),
//! spectral lines (`spectrum`).

use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::spectrum::{SpectralLine, Taper, strongest_line};

/// Final fraction of a hold over which the final value is averaged if there is no oscillation.
const QUIET_PART: f64 = 0.25;

/// Figures of one hold: the interval from the end of a move to the start of the next one or to the
/// end of the record.
#[derive(Debug, Clone, PartialEq)]
pub struct HoldMetrics {
    /// Start, which is the end of the preceding move, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// Position of the rigid TCP, m, world axes.
    pub place_m: [f64; 3],
    /// Translation error at the end, m, in world axes.
    pub end_error_m: [f64; 3],
    /// Translation error at which the arm comes to rest, m, in world axes: the given quasi-static
    /// value at the end of the hold. If it is unknown, a weighted mean (`sin²`) over the largest
    /// number of whole periods of the oscillation in the second half of the hold (at least two);
    /// without an oscillation, over the last quarter.
    pub final_error_m: [f64; 3],
    /// Time from the start of the hold until the error stays within the band around its final
    /// value, s. 0 if it never leaves the band. `None` if it is outside at the last sample, or has
    /// not been inside for a whole period of its oscillation when the hold ends.
    pub settling_s: Option<f64>,
    /// Maximum excursion of the error beyond its final value in the direction of approach, m; 0 if
    /// it stays within the band, or if the tool did not move. As the rigid TCP is at rest, this is
    /// the distance by which the TCP passes its final position.
    pub overshoot_m: f64,
    /// Strongest line of the error during the hold.
    pub line: Option<SpectralLine>,
}

/// Returns whether a line is significant: far below the settling band (m) it neither delays
/// settling nor counts as vibration.
pub(crate) fn is_significant(line: &SpectralLine, band_m: f64) -> bool {
    line.amplitude > 1e-6 * band_m
}

/// The samples of one hold.
pub(crate) struct Hold<'a> {
    /// Times of the samples, at least two, s.
    pub(crate) times: &'a [f64],
    /// Translation errors, m.
    pub(crate) errors: Vec<[f64; 3]>,
    /// Position of the rigid TCP, m.
    pub(crate) place_m: [f64; 3],
    /// Quasi-static error at the end of the hold, m, if known.
    pub(crate) final_static: Option<[f64; 3]>,
    /// Direction in which the rigid TCP arrived; `None` if it did not move.
    pub(crate) approach: Option<Vector3<f64>>,
}

impl Hold<'_> {
    /// Computes the figures; `start_s` may be before the first sample.
    pub(crate) fn metrics(&self, start_s: f64, band_m: f64) -> HoldMetrics {
        let line = strongest_line(self.times, &self.errors, Taper::FadeOut);
        let line = line.filter(|line| is_significant(line, band_m));
        let final_error = self.final_static.unwrap_or_else(|| self.resting_value(line));
        HoldMetrics {
            start_s,
            end_s: self.end(),
            place_m: self.place_m,
            end_error_m: self.errors[self.errors.len() - 1],
            final_error_m: final_error,
            settling_s: self.settling(start_s, &final_error, band_m, line),
            overshoot_m: self.overshoot(&final_error, band_m),
            line,
        }
    }

    fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Weighted mean over whole periods, or over the last quarter.
    fn resting_value(&self, line: Option<SpectralLine>) -> [f64; 3] {
        let length = self.end() - self.times[0];
        let span = match line {
            Some(SpectralLine { hz, .. }) => (0.5 * length * hz).floor().max(2.0) / hz,
            None => QUIET_PART * length,
        };
        self.mean_since(self.end() - span.min(length))
    }

    /// Averages from `start` to the end with weight `sin²`: an oscillation with two or more whole
    /// periods in that time cancels, and a decaying one nearly cancels.
    fn mean_since(&self, start: f64) -> [f64; 3] {
        let n = self.times.len();
        let (mut sum, mut sum_of_weights) = (Vector3::zeros(), 0.0);
        for i in (0..n).filter(|&i| self.times[i] > start) {
            // Half the time to either neighbour: the trapezoidal rule, since the weight vanishes at
            // both ends.
            let share = self.times[(i + 1).min(n - 1)] - self.times[i.saturating_sub(1)];
            let part = (self.times[i] - start) / (self.end() - start);
            let weight = share * (PI * part).sin().powi(2);
            sum += Vector3::from(self.errors[i]) * weight;
            sum_of_weights += weight;
        }
        // A span shorter than a few steps contains only its end.
        if sum_of_weights > 1e-6 * (self.end() - start) { (sum / sum_of_weights).into() } else { self.errors[n - 1] }
    }

    fn settling(&self, start_s: f64, final_error: &[f64; 3], band: f64, line: Option<SpectralLine>) -> Option<f64> {
        let distance = |i: usize| (Vector3::from(self.errors[i]) - Vector3::from(*final_error)).norm();
        let n = self.times.len();
        let Some(outside) = (0..n).rev().find(|&i| distance(i) > band) else {
            return Some(0.0);
        };
        if outside + 1 == n {
            return None;
        }
        // Intersection of the band with the straight line between the last sample outside and the
        // first one inside.
        let (out, inside) = (distance(outside), distance(outside + 1));
        let part = (out - band) / (out - inside);
        let entry = self.times[outside] + part * (self.times[outside + 1] - self.times[outside]);
        let period = line.map_or(0.0, |line| 1.0 / line.hz);
        (self.end() - entry >= period).then_some(entry - start_s)
    }

    fn overshoot(&self, final_error: &[f64; 3], band: f64) -> f64 {
        let Some(approach) = self.approach else {
            return 0.0;
        };
        let beyond = |error: &[f64; 3]| approach.dot(&(Vector3::from(*error) - Vector3::from(*final_error)));
        let most = self.errors.iter().map(beyond).fold(0.0, f64::max);
        if most > band { most } else { 0.0 }
    }
}
