//! Signals with uniform samples: zero-phase low-pass, derivatives, delays, linear least squares.
//!
//! A signal is a slice of values in any unit, a fixed time apart. Not here: spectra
//! ([`crate::amplitude_spectrum`]), signals with uneven steps.

use nalgebra::{DMatrix, DVector};

/// A second-order section, `b` over `a`, with leading `a` of 1.
#[derive(Clone, Copy, Debug)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// Butterworth low-pass of fourth order, run forwards and backwards: zero phase, squared gain of
/// one pass.
#[derive(Clone, Copy, Debug)]
pub struct LowPass {
    sections: [Section; 2],
    /// Number of samples by which a signal is extended at both ends, by point reflection at its end
    /// value.
    reach: usize,
}

impl LowPass {
    /// Creates the filter for a sampling rate.
    ///
    /// ```text
    /// H(s) = Π 1/(s² + s/Q_i + 1),   1/Q_i = 2 cos(π/8), 2 cos(3π/8),   s = (1/k) (z - 1)/(z + 1)
    /// ```
    ///
    /// * `cut_hz`: frequency of 3 dB attenuation in one pass, above 0 and below half of `rate_hz`.
    /// * `rate_hz`: samples per second.
    pub fn new(cut_hz: f64, rate_hz: f64) -> Self {
        // Bilinear transformation, exact at the cut-off frequency.
        let k = (std::f64::consts::PI * cut_hz / rate_hz).tan();
        let section = |angle: f64| {
            let inverse_q = 2.0 * angle.cos();
            let norm = 1.0 / (1.0 + inverse_q * k + k * k);
            let b0 = k * k * norm;
            Section { b: [b0, 2.0 * b0, b0], a: [2.0 * (k * k - 1.0) * norm, (1.0 - inverse_q * k + k * k) * norm] }
        };
        let sections = [1.0, 3.0].map(|n| section(n * std::f64::consts::PI / 8.0));
        Self { sections, reach: (3.0 * rate_hz / cut_hz) as usize }
    }

    /// Filters a signal; returns as many values, without delay.
    pub fn of(&self, x: &[f64]) -> Vec<f64> {
        let (n, reach) = (x.len(), self.reach.min(x.len().saturating_sub(1)));
        if n == 0 {
            return Vec::new();
        }
        // Point reflection at both ends keeps value and slope there.
        let before = (1..=reach).rev().map(|k| 2.0 * x[0] - x[k]);
        let after = (1..=reach).map(|k| 2.0 * x[n - 1] - x[n - 1 - k]);
        let mut y: Vec<f64> = before.chain(x.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            self.sections.iter().for_each(|section| section.pass(&mut y));
            y.reverse();
        }
        y[reach..reach + n].to_vec()
    }
}

impl Section {
    /// Forward pass, from the steady state of the first value.
    fn pass(&self, x: &mut [f64]) {
        let Self { b, a } = self;
        let (mut s, first) = ([0.0; 2], x.first().copied().unwrap_or(0.0));
        s[0] = first * (1.0 - b[0]);
        s[1] = first * (b[2] - a[1]);
        for x in x {
            let y = b[0] * *x + s[0];
            s = [b[1] * *x - a[0] * y + s[1], b[2] * *x - a[1] * y];
            *x = y;
        }
    }
}

/// Computes the derivative of values `step_s` (s) apart by central differences, one-sided at the
/// ends; NaN for a single value.
///
/// Returns as many values, per second.
pub fn derivative(x: &[f64], step_s: f64) -> Vec<f64> {
    let n = x.len();
    let at = |i: usize| {
        let (low, high) = (i.saturating_sub(1), (i + 1).min(n - 1));
        (x[high] - x[low]) / (step_s * (high - low) as f64)
    };
    (0..n).map(at).collect()
}

/// Delays a signal by `by_s` (s), linear between samples and constant before the first.
pub fn delayed(x: &[f64], by_s: f64, step_s: f64) -> Vec<f64> {
    let at = |i: usize| {
        let place = (i as f64 - by_s / step_s).clamp(0.0, (x.len() - 1) as f64);
        let (k, part) = (place.floor() as usize, place.fract());
        x[k] + part * (x[(k + 1).min(x.len() - 1)] - x[k])
    };
    (0..x.len()).map(at).collect()
}

/// Computes the root mean square; NaN if there are no values.
pub fn rms(x: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0usize);
    for x in x {
        sum += x * x;
        n += 1;
    }
    (sum / n as f64).sqrt()
}

/// Computes the factors of columns whose sum best approximates `y` in the least-squares sense.
///
/// Columns are normalised first; directions below 1e-10 of the largest singular value get no part.
///
/// Returns one factor per column; `None` if a column has a value that is not finite.
///
/// # Panics
/// If the columns and `y` differ in length.
pub fn least_squares(columns: &[Vec<f64>], y: &[f64]) -> Option<Vec<f64>> {
    assert!(columns.iter().all(|column| column.len() == y.len()), "columns and y have the same length");
    let size = |column: &Vec<f64>| column.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    let sizes: Vec<f64> = columns.iter().map(size).collect();
    let X = DMatrix::from_fn(y.len(), columns.len(), |i, j| columns[j][i] / sizes[j]);
    if !X.norm_squared().is_finite() {
        return None;
    }
    let solved = X.svd(true, true).solve(&DVector::from_column_slice(y), 1e-10).ok()?;
    Some(solved.iter().zip(&sizes).map(|(x, size)| x / size).collect())
}

/// Computes the residual of [`least_squares`]: `y` minus the sum of the columns times their
/// factors.
pub fn rest(columns: &[Vec<f64>], factors: &[f64], y: &[f64]) -> Vec<f64> {
    let sum = |i: usize| columns.iter().zip(factors).map(|(column, factor)| factor * column[i]).sum::<f64>();
    y.iter().enumerate().map(|(i, y)| y - sum(i)).collect()
}
