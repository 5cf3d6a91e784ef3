//! Stability limit from the mean force of the teeth [Altintas & Budak 1995]: exact for constant
//! forces, accurate for slots and many teeth, but without the parametric excitation by entering and
//! leaving teeth (period doubling at low immersion).
//!
//! ```text
//! det(1 + b (1 - e^{-i ω T}) G(i ω) H) = 0        H: mean force matrix
//! ```
//! With an eigenvalue λ of `G H`: `b (1 - e^{-i ω T}) = -1/λ`; the phase of this equation gives ω,
//! its magnitude b. Only the frequency response is needed, which may be a measured one.

use std::f64::consts::TAU;

use nalgebra::{Complex, Matrix3, Schur};

use crate::milling::cutter::Cutter;
use crate::milling::error::ChatterError;
use crate::milling::structure::Structure;

/// Number of points per turn of `e^{i ω T}`.
const PER_TURN: f64 = 24.0;
/// Number of bisections for a crossing.
const BISECTIONS: usize = 50;
/// Maximum number of points of a search.
const MOST_POINTS: usize = 100_000;
/// Assumed maximum ratio of the response between two frequencies of the band to that at the larger
/// end.
const BETWEEN: f64 = 4.0;
/// Ratio to the product of norms below which an eigenvalue counts as zero.
const NOTHING: f64 = 1e-12;

/// Limit of the zero-order solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZeroOrderLimit {
    /// Depth (m).
    pub depth: f64,
    /// Chatter frequency (Hz).
    pub chatter_hz: f64,
}

/// Computes the minimum depth of the zero-order solution at a spindle speed (rad/s); `None` if no
/// frequency of the band chatters up to the maximum depth (m).
///
/// * `response`: frequency response of the tip (m/N) at an angular frequency in rad/s.
/// * `band`: angular frequencies (rad/s), ascending, with sufficient resolution of the resonances
///   ([`Structure::frequencies`]); points between them are added as the tooth period requires.
///
/// # Errors
/// [`ChatterError::Value`] for an invalid cutter or speed, [`ChatterError::TooSlow`] if a tooth
/// period contains too many oscillations.
pub fn zero_order_limit(
    response: &dyn Fn(f64) -> Matrix3<Complex<f64>>,
    cutter: &Cutter,
    spindle: f64,
    band: &[f64],
    deepest: f64,
) -> Result<Option<ZeroOrderLimit>, ChatterError> {
    cutter.check()?;
    if !(spindle.is_finite() && spindle > 0.0) {
        return Err(ChatterError::Value { what: "the spindle speed (rad/s)", found: spindle, expected: "above 0" });
    }
    let H = cutter.mean_force_matrix().map(|x| Complex::new(x, 0.0));
    let T = cutter.tooth_period(spindle);
    let size = |w: f64| (response(w) * H).norm();
    let eigenvalues = |w: f64| eigenvalues(&(response(w) * H));
    let mut best: Option<ZeroOrderLimit> = None;
    let mut points = 0.0;
    for pair in band.windows(2) {
        // |b (1 - e^{-i ω T})| = 1/|λ| with |1 - e^{-i ω T}| <= 2 and |λ| <= |G H|.
        let known = best.map_or(deepest, |best| best.depth.min(deepest));
        if 2.0 * known * BETWEEN * size(pair[0]).max(size(pair[1])) < 1.0 {
            continue;
        }
        let parts = ((pair[1] - pair[0]) * T / TAU * PER_TURN).ceil().max(1.0);
        points += parts;
        if points > MOST_POINTS as f64 {
            let rpm = spindle * 60.0 / TAU;
            return Err(ChatterError::TooSlow { rpm, unknowns: points as usize, most: MOST_POINTS });
        }
        let step = (pair[1] - pair[0]) / parts;
        let mut low = (pair[0], eigenvalues(pair[0]));
        for k in 1..=parts as usize {
            let w = pair[0] + k as f64 * step;
            let high = (w, matched(eigenvalues(w), &low.1));
            for i in 0..3 {
                let found = crossing((low.0, low.1[i]), (high.0, high.1[i]), T, &eigenvalues);
                best = [best, found].into_iter().flatten().min_by(|a, b| a.depth.total_cmp(&b.depth));
            }
            low = high;
        }
    }
    Ok(best.filter(|best| best.depth <= deepest))
}

/// Returns the depth `b` times `|1 - e^{-i ω T}|²` for an eigenvalue; real at a limit.
fn product(w: f64, lambda: Complex<f64>, T: f64) -> Complex<f64> {
    let delay = Complex::new(1.0, 0.0) - Complex::cis(-w * T);
    -lambda.inv() * delay.conj()
}

fn crossing(
    mut low: (f64, Complex<f64>),
    mut high: (f64, Complex<f64>),
    T: f64,
    eigenvalues: &dyn Fn(f64) -> [Complex<f64>; 3],
) -> Option<ZeroOrderLimit> {
    if low.1.norm() == 0.0 || high.1.norm() == 0.0 {
        return None;
    }
    let sign = |at: (f64, Complex<f64>)| product(at.0, at.1, T).im > 0.0;
    if sign(low) == sign(high) {
        return None;
    }
    for _ in 0..BISECTIONS {
        let w = 0.5 * (low.0 + high.0);
        let near = (low.1 + high.1) * 0.5;
        let all = eigenvalues(w);
        let lambda = all.into_iter().min_by(|a, b| (a - near).norm().total_cmp(&(b - near).norm()))?;
        if lambda.norm() == 0.0 {
            return None;
        }
        if sign((w, lambda)) == sign(low) { low = (w, lambda) } else { high = (w, lambda) }
    }
    let size = (Complex::new(1.0, 0.0) - Complex::cis(-low.0 * T)).norm_sqr();
    let depth = product(low.0, low.1, T).re / size;
    // A whole number of waves between teeth does not modulate the chip.
    (depth > 0.0 && size > 1e-9).then_some(ZeroOrderLimit { depth, chatter_hz: low.0 / TAU })
}

/// Eigenvalues of a 3×3 matrix; those below rounding are set to zero.
fn eigenvalues(A: &Matrix3<Complex<f64>>) -> [Complex<f64>; 3] {
    let size = A.norm();
    let zero = Complex::new(0.0, 0.0);
    if size == 0.0 || !size.is_finite() {
        return [zero; 3];
    }
    let Some(schur) = Schur::try_new(A / Complex::new(size, 0.0), f64::EPSILON, 1000) else { return [zero; 3] };
    let (_, T) = schur.unpack();
    std::array::from_fn(|k| if T[(k, k)].norm() < NOTHING { zero } else { T[(k, k)] * size })
}

/// Sorts eigenvalues to be closest to the previous ones.
fn matched(found: [Complex<f64>; 3], last: &[Complex<f64>; 3]) -> [Complex<f64>; 3] {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let distance = |order: &[usize; 3]| -> f64 { (0..3).map(|k| (found[order[k]] - last[k]).norm()).sum() };
    let best = ORDERS.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(&ORDERS[0]);
    best.map(|k| found[k])
}

impl Structure {
    /// Returns angular frequencies (rad/s) for evaluating the response: at equal ratios, and dense
    /// around each resonance.
    pub fn frequencies(&self) -> Vec<f64> {
        let sizes: Vec<f64> = self.poles().iter().map(|p| p.value.norm()).collect();
        let (Some(low), Some(high)) = (sizes.iter().copied().reduce(f64::min), sizes.iter().copied().reduce(f64::max))
        else {
            return Vec::new();
        };
        let (low, high) = (0.1 * low, 4.0 * high);
        let n = (40.0 * (high / low).log10()).ceil().max(2.0);
        let mut band: Vec<f64> = (0..=n as usize).map(|k| low * (high / low).powf(k as f64 / n)).collect();
        for pole in self.poles() {
            let (w, width) = (pole.value.im, pole.value.re.abs());
            for offset in [0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 8.0, 13.0] {
                band.extend([w - offset * width, w + offset * width]);
            }
        }
        band.retain(|w| *w >= low && *w <= high);
        band.sort_by(f64::total_cmp);
        band.dedup_by(|a, b| *a - *b < 1e-9 * *b);
        band
    }
}
