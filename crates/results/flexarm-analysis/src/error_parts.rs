//! Split of the TCP error into its static part and the part due to motion.

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
    let error = |i: usize| Vector3::new(errors[i][0], errors[i][1], errors[i][2]);
    let resting = |i: usize| Vector3::from(statics[i]);
    let largest =
        |of: &dyn Fn(usize) -> f64| (1..n).fold((0, of(0)), |best, i| if of(i) > best.1 { (i, of(i)) } else { best });
    let (peak, size) = largest(&|i| error(i).norm());
    let (_, static_peak_m) = largest(&|i| resting(i).norm());
    let (moving, dynamic_peak_m) = largest(&|i| (error(i) - resting(i)).norm());
    let static_at_peak_m = if size > 0.0 { resting(peak).dot(&error(peak)) / size } else { 0.0 };
    let squares = |i: usize| (error(i) - resting(i)).norm_squared();
    let area: f64 = (1..n).map(|i| 0.5 * (squares(i - 1) + squares(i)) * (times[i] - times[i - 1])).sum();
    Ok(ErrorParts {
        static_at_peak_m,
        dynamic_at_peak_m: size - static_at_peak_m,
        static_peak_m,
        dynamic_peak_m,
        t_dynamic_peak_s: times[moving],
        dynamic_rms_m: if n > 1 { (area / (times[n - 1] - times[0])).sqrt() } else { squares(0).sqrt() },
    })
}
