//! Noise of sampled positions: its share in the acceleration of the spline through them, and
//! smoothing.
//!
//! White noise of the RMS σ in samples at steps h appears in the acceleration of an interpolating
//! cubic spline with the RMS 6 σ/h². A smoothing spline s minimises
//!
//! ```text
//! Σ (q_i - s(t_i))² + λ ∫ s''² dt      λ = 1/(h (2π f_c)⁴)
//! ```
//!
//! and passes the frequency f with the factor 1/(1 + (f/f_c)⁴) [Reinsch 1967; Unser 1999].
//!
//! Not here: corners, and velocities or accelerations given beside the positions.

use std::f64::consts::TAU;

use crate::corner::{corners, resolution};

/// Minimum number of moving samples for an estimate.
const MIN_SAMPLES: usize = 20;
/// Maximum relative deviation of a step from the mean step of even samples.
const UNEVEN: f64 = 0.2;
/// Share of noise in the acceleration above which it is reported or removed.
pub(crate) const MAX_SHARE: f64 = 0.1;
/// RMS acceleration of the spline through white noise, over σ/h².
const SPLINE: f64 = 6.0;
/// Maximum distance of smoothed positions from rounded ones, over the step of the rounding.
const WITHIN_ROUNDING: f64 = 0.75;
/// Maximum noise that rounding to a step explains, over the step: 1/√12 for white noise; for a slow
/// motion the median fourth difference is three steps, which counts as 3/5.64.
const OF_ROUNDING: f64 = 0.6;
/// Number and duration (s) of equal samples that count as a hold, which smoothing keeps; slow motions
/// of rounded positions have shorter ones.
const HOLD: (usize, f64) = (10, 0.05);

/// Noise of the positions of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// RMS in the positions (rad or m).
    pub rms: f64,
    /// RMS acceleration of the noise over that of the motion with it.
    pub share: f64,
    /// Cut-off of a smoothing that leaves a twentieth of the motion's acceleration (Hz).
    pub cutoff_hz: f64,
}

/// Estimates the noise of positions `q` (rad or m), sampled evenly at `t` (s), from their fourth
/// differences; `None` if the samples are uneven, few or smooth.
pub fn noise(t: &[f64], q: &[f64]) -> Option<Noise> {
    let n = q.len();
    if n < MIN_SAMPLES + 4 {
        return None;
    }
    let h = (t[n - 1] - t[0]) / (n - 1) as f64;
    if t.windows(2).any(|pair| ((pair[1] - pair[0]) / h - 1.0).abs() > UNEVEN) {
        return None;
    }
    let fourth = |i: usize| q[i - 2] - 4.0 * q[i - 1] + 6.0 * q[i] - 4.0 * q[i + 1] + q[i + 2];
    let second = |i: usize| (q[i - 1] - 2.0 * q[i] + q[i + 1]) / (h * h);
    let moving: Vec<usize> = (2..n - 3).filter(|&i| q[i - 2..=i + 2].iter().any(|x| *x != q[i])).collect();
    if moving.len() < MIN_SAMPLES {
        return None;
    }
    // Neighbouring fourth differences of white noise have the correlation -0.8, of smooth data 1.
    let (mut square, mut product, mut acceleration) = (0.0, 0.0, 0.0);
    for &i in &moving {
        square += fourth(i).powi(2);
        product += fourth(i) * fourth(i + 1);
        acceleration += second(i).powi(2) / moving.len() as f64;
    }
    if square == 0.0 || product > -0.4 * square {
        return None;
    }
    let mut sizes: Vec<f64> = moving.iter().map(|i| fourth(*i).abs()).collect();
    let (_, median, _) = sizes.select_nth_unstable_by(moving.len() / 2, f64::total_cmp);
    // The variance of fourth differences is 70 σ², the median of a normal variable 0.6745 σ.
    let rms = *median / (0.6745 * 70f64.sqrt());
    let own = (acceleration - 6.0 * (rms / (h * h)).powi(2)).max(0.0);
    let of_noise = SPLINE * rms / (h * h);
    let share = of_noise / (own + of_noise * of_noise).sqrt();
    // Variance of the acceleration of smoothed noise: 2 σ² h (2π)⁴ f_c⁵ π √2/16.
    let left = 0.05 * 0.05 * own / (2.0 * rms * rms * h * TAU.powi(4) * 0.2777);
    let cutoff_hz = left.powf(0.2).clamp(0.5 / (t[n - 1] - t[0]), 0.25 / h);
    (rms > 0.0).then_some(Noise { rms, share, cutoff_hz })
}

/// Returns positions with noise smoothed within their rounding, if rounding explains the noise and
/// they have no corner.
pub(crate) fn without_rounding(t: &[f64], q: &[f64], found: &Noise) -> Option<Vec<f64>> {
    let step = resolution(q);
    if found.rms > OF_ROUNDING * step || !corners(t, q).is_empty() {
        return None;
    }
    let mut cutoff_hz = 0.25 * (q.len() - 1) as f64 / (t[t.len() - 1] - t[0]);
    let mut best = None;
    loop {
        let smooth = smoothed(t, q, cutoff_hz);
        let off = smooth.iter().zip(q).fold(0.0, |most: f64, (s, q)| most.max((s - q).abs()));
        if off > WITHIN_ROUNDING * step || cutoff_hz < found.cutoff_hz {
            return best;
        }
        best = Some(smooth);
        cutoff_hz /= 1.5;
    }
}

/// Returns smoothed positions. Long holds are kept: each section between them is smoothed with
/// fixed ends.
pub(crate) fn smoothed(t: &[f64], q: &[f64], cutoff_hz: f64) -> Vec<f64> {
    let (n, mut smooth) = (q.len(), q.to_vec());
    let end_of_hold = |from: usize| from + q[from..].iter().take_while(|x| **x == q[from]).count() - 1;
    let is_hold = |from: usize, to: usize| to + 1 - from >= HOLD.0 && t[to] - t[from] >= HOLD.1;
    let mut first = 0;
    let mut after_hold = false;
    while first + 1 < n {
        let end = end_of_hold(first);
        if is_hold(first, end) {
            (first, after_hold) = (end, true);
            continue;
        }
        let mut last = end;
        while last + 1 < n && !is_hold(last, end_of_hold(last)) {
            last = end_of_hold(last).max(last + 1);
        }
        let ends = [after_hold, last + 1 < n];
        smooth[first..=last].copy_from_slice(&smoothing_spline(&t[first..=last], &q[first..=last], ends, cutoff_hz));
        (first, after_hold) = (last, false);
    }
    smooth
}

/// Values of the smoothing spline at its knots; `fixed`: whether it passes through the ends.
///
/// With γ the second derivatives at the inner knots: `(R + λ Qᵀ W Q) γ = Qᵀ q`, `s = q - λ W Q γ`,
/// where Q takes second differences, R is the Gram matrix of the hat functions, and W is the
/// identity except at fixed ends.
fn smoothing_spline(t: &[f64], q: &[f64], fixed: [bool; 2], cutoff_hz: f64) -> Vec<f64> {
    let n = q.len();
    if n < 3 {
        return q.to_vec();
    }
    let h: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let lambda = (n - 1) as f64 / ((t[n - 1] - t[0]) * (TAU * cutoff_hz).powi(4));
    let weight = |i: usize| if (i == 0 && fixed[0]) || (i + 1 == n && fixed[1]) { 0.0 } else { 1.0 };
    // Column j of Q belongs to knot j + 1 and has entries at the knots j, j + 1 and j + 2.
    let column = |j: usize| [1.0 / h[j], -1.0 / h[j] - 1.0 / h[j + 1], 1.0 / h[j + 1]];
    let gram = |j: usize, k: usize| {
        let (a, b) = (column(j), column(k));
        (0..3 - (k - j)).map(|i| weight(k + i) * a[i + k - j] * b[i]).sum::<f64>()
    };
    // L D Lᵀ of the matrix of five diagonals.
    let m = n - 2;
    let (mut d, mut lower, mut second, mut x) = (vec![0.0; m], vec![0.0; m], vec![0.0; m], vec![0.0; m]);
    for j in 0..m {
        let [one, two] = [1, 2].map(|back| j.checked_sub(back));
        let entry = |at: Option<usize>, values: &[f64]| at.map_or(0.0, |k| values[k]);
        let (l1, l2) = (entry(one, &lower), entry(two, &second));
        let (d1, d2) = (entry(one, &d), entry(two, &d));
        d[j] = (h[j] + h[j + 1]) / 3.0 + lambda * gram(j, j) - l1 * l1 * d1 - l2 * l2 * d2;
        if j + 1 < m {
            lower[j] = (h[j + 1] / 6.0 + lambda * gram(j, j + 1) - l1 * entry(one, &second) * d1) / d[j];
        }
        if j + 2 < m {
            second[j] = lambda * gram(j, j + 2) / d[j];
        }
        let slope = |i: usize| (q[i + 1] - q[i]) / h[i];
        x[j] = slope(j + 1) - slope(j) - l1 * entry(one, &x) - l2 * entry(two, &x);
    }
    for j in (0..m).rev() {
        let solved = |k: usize| x.get(k).copied().unwrap_or(0.0);
        x[j] = x[j] / d[j] - lower[j] * solved(j + 1) - second[j] * solved(j + 2);
    }
    let mut smooth = q.to_vec();
    for (j, second) in x.iter().enumerate() {
        for (i, entry) in column(j).into_iter().enumerate() {
            smooth[j + i] -= lambda * weight(j + i) * entry * second;
        }
    }
    smooth
}
