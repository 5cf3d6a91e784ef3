//! Split of the TCP error into its static part and the part due to motion.
//!
//! World axes, SI units. Not here: the static part itself (`flexarm-run`).

use nalgebra::Vector3;

use crate::record::RecordError;

/// Static and dynamic part of a record of the TCP error `e` (translation, m).
///
/// ```text
/// e = s + d
/// ```
/// `s`: static TCP displacement of the arm at the pose of the instant, under gravity and the loads
/// that act then; `d`: the rest, from inertia forces and ringing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorParts {
    /// `s·u` at the maximum of `|e|`, m, along its direction `u = e/|e|`; together with
    /// [`Self::dynamic_at_peak_m`] it gives `|e|`.
    pub static_at_peak_m: f64,
    /// `d·u` at the same instant, m; negative if the motion reduces the error.
    pub dynamic_at_peak_m: f64,
    /// `max |s|`, m.
    pub static_peak_m: f64,
    /// `max |d|`, m.
    pub dynamic_peak_m: f64,
    /// Time of `dynamic_peak_m`, s.
    pub t_dynamic_peak_s: f64,
    /// `sqrt(1/(t_n - t_0) ∫ |d|² dt)`, m, by the trapezoidal rule.
    pub dynamic_rms_m: f64,
}

/// Splits a record into its static and dynamic part.
///
/// * `times`: s, strictly increasing. `errors`: TCP errors, of which the translation is used (m).
///   `statics`: `s` at the same times (m).
///
/// # Errors
/// [`RecordError::Empty`], [`RecordError::Length`], or [`RecordError::NotFinite`] if a static part
/// is unknown.
pub fn error_parts(times: &[f64], errors: &[[f64; 6]], statics: &[[f64; 3]]) -> Result<ErrorParts, RecordError> {
    let n = times.len();
    if n == 0 {
        return Err(RecordError::Empty);
    }
    for (what, found) in [("errors", errors.len()), ("statics", statics.len())] {
        if found != n {
            return Err(RecordError::Length { what, found, expected: n });
        }
    }
    if let Some(index) = statics.iter().position(|s| s.iter().any(|x| !x.is_finite())) {
        return Err(RecordError::NotFinite { what: "statics", index });
    }
    let mut totals = StaticTotals::default();
    for ((t, e), s) in times.iter().zip(errors).zip(statics) {
        totals.add(*t, Vector3::new(e[0], e[1], e[2]), (*s).into());
    }
    Ok(totals.parts())
}

/// Figures of the static part `s` and of the dynamic part `d = e - s` of the samples so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct StaticTotals {
    count: usize,
    start_s: f64,
    last_s: f64,
    /// `|e|` and `s·e` at the maximum error.
    peak: (f64, f64),
    static_peak_m: f64,
    /// Time and magnitude.
    dynamic_peak: (f64, f64),
    /// Square of `d` in the last sample, and its integral.
    last: f64,
    area: f64,
}

impl StaticTotals {
    /// Adds a sample of the error `e` and its static part `s`.
    pub(crate) fn add(&mut self, time_s: f64, e: Vector3<f64>, s: Vector3<f64>) {
        let (is_first, d) = (self.count == 0, e - s);
        if is_first || e.norm() > self.peak.0 {
            self.peak = (e.norm(), s.dot(&e));
        }
        self.static_peak_m = if is_first { s.norm() } else { self.static_peak_m.max(s.norm()) };
        if is_first || d.norm() > self.dynamic_peak.1 {
            self.dynamic_peak = (time_s, d.norm());
        }
        let square = d.norm_squared();
        if is_first {
            self.start_s = time_s;
        } else {
            self.area += 0.5 * (self.last + square) * (time_s - self.last_s);
        }
        (self.last_s, self.last) = (time_s, square);
        self.count += 1;
    }

    /// Returns the figures.
    pub(crate) fn parts(&self) -> ErrorParts {
        let (size, along) = self.peak;
        let static_at_peak_m = if size > 0.0 { along / size } else { 0.0 };
        let mean_square = if self.count > 1 { self.area / (self.last_s - self.start_s) } else { self.last };
        ErrorParts {
            static_at_peak_m,
            dynamic_at_peak_m: size - static_at_peak_m,
            static_peak_m: self.static_peak_m,
            dynamic_peak_m: self.dynamic_peak.1,
            t_dynamic_peak_s: self.dynamic_peak.0,
            dynamic_rms_m: mean_square.sqrt(),
        }
    }
}
