//! Input shaper with the smallest residual vibration of several modes within a given delay, for
//! uncertain frequencies.
//!
//! ```text
//! min over a of  max over k of  w_k |r_k|,    r_k = Σ a_i exp(λ_k (Δ - t_i)),    a_i >= 0,  Σ a_i = 1,  0 <= t_i <= Δ
//! ```
//! with modes λ, each at several frequencies of its band. On a grid of times t_i this is a
//! second-order cone program, with one cone for each mode and frequency [Boyd & Vandenberghe 2004,
//! section 4.4.2]; Clarabel solves it. The grid is then refined around the copies found. Since the
//! weights are not negative, the shaped motion stays within the ranges and below the speeds of the
//! original motion. Start at [`Shaper::optimal`]. Not here: ZV and ZVD shapers (`shaping`), the
//! vibration of a motion (`vibration`).

use std::f64::consts::TAU;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::Complex;

use crate::shaping::Shaper;

/// A mode to be suppressed by a shaper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapedMode {
    /// Natural frequency, undamped (Hz).
    pub hz: f64,
    /// Damping ratio, below 1.
    pub ratio: f64,
    /// Vibration without the shaper, in the unit of the result.
    pub vibration: f64,
}

/// A shaper and its residual vibration.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimalShaper {
    /// Copies of the shaper.
    pub shaper: Shaper,
    /// Maximum residual vibration of any mode within its band, in the unit of the modes'
    /// vibrations.
    pub left: f64,
}

/// Reason why there is no such shaper.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShaperError {
    /// An invalid number.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Name of the number.
        what: &'static str,
        /// Found value.
        found: f64,
        /// Expected values.
        expected: &'static str,
    },
    /// A delay of too many periods of the fastest mode.
    #[error(
        "a delay of {delay_s} s is {periods:.0} periods of the quickest mode, at most {most} are searched: choose a shorter delay or fewer modes"
    )]
    Long {
        /// Requested delay (s).
        delay_s: f64,
        /// Delay in periods of the fastest mode.
        periods: f64,
        /// Maximum number of periods.
        most: f64,
    },
    /// The solver found no minimum.
    #[error("no shaper is found for a delay of {delay_s} s: choose another delay or fewer modes")]
    Unsolved {
        /// Requested delay (s).
        delay_s: f64,
    },
}

/// Number of grid points per period of the fastest mode.
const PER_PERIOD: f64 = 24.0;
/// Maximum delay in periods of the fastest mode.
const MAX_PERIODS: f64 = 25.0;
/// Number of frequencies at which the band of a mode is evaluated.
const BAND_POINTS: usize = 21;
/// Maximum relative width of the band to either side.
const MAX_BAND: f64 = 0.5;
/// Weights below this are not copies.
const MIN_WEIGHT: f64 = 1e-6;
/// Number of refinements of the grid.
const REFINEMENTS: usize = 3;
/// Factor of a refinement, and number of new steps to either side of a copy.
const REFINEMENT: i32 = 8;
/// Residual vibration that counts as zero, relative to the vibration without a shaper.
const NO_VIBRATION: f64 = 1e-7;
/// Tolerance of the solver on the minimum, relative to the vibration without a shaper.
const GAP: f64 = 1e-10;

impl Shaper {
    /// Computes the shaper with the smallest residual vibration of several modes.
    ///
    /// * `delay_s`: maximum delay of the last copy, at most 25 periods of the fastest mode.
    /// * `band`: relative uncertainty of each frequency to either side, from 0 to 0.5, such as 0.1.
    ///
    /// The vibrations are evaluated at `delay_s` after the end of the original motion.
    ///
    /// # Errors
    /// [`ShaperError`].
    pub fn optimal(modes: &[ShapedMode], delay_s: f64, band: f64) -> Result<OptimalShaper, ShaperError> {
        check(modes, delay_s, band)?;
        let fastest_hz = modes.iter().map(|mode| mode.hz).fold(0.0, f64::max);
        // Even number of steps, so that half the delay is on the grid.
        let half = (0.5 * PER_PERIOD * delay_s * fastest_hz).ceil().max(4.0) as usize;
        let mut step = 0.5 * delay_s / half as f64;
        let mut times: Vec<f64> = (0..=2 * half).map(|k| step * k as f64).collect();
        let size = modes.iter().map(|mode| mode.vibration).fold(0.0, f64::max);
        let left = |shaper: &Shaper| {
            let residual =
                |mode: &ShapedMode, f: f64| mode.vibration * shaper.residual_at(f * mode.hz, mode.ratio, delay_s);
            modes.iter().flat_map(|mode| within(band).into_iter().map(move |f| residual(mode, f))).fold(0.0, f64::max)
        };
        let mut best: Option<OptimalShaper> = None;
        for _ in 0..=REFINEMENTS {
            let Some(copies) = minimised(modes, band, delay_s, size, &times) else { break };
            let whole = Shaper { copies };
            // If many shapers leave zero vibration, keep the central one unchanged.
            let many = left(&whole) < NO_VIBRATION * size;
            let shaper = if many { whole } else { merged(&whole.copies, step) }.normalised();
            let around: Vec<f64> = shaper.copies.iter().map(|(t, _)| *t).collect();
            let found = OptimalShaper { left: left(&shaper), shaper };
            if best.as_ref().is_none_or(|best| found.left < best.left) {
                best = Some(found);
            }
            if many {
                break;
            }
            // New times around each copy, and both ends.
            step /= f64::from(REFINEMENT);
            times =
                around.iter().flat_map(|t| (-REFINEMENT..=REFINEMENT).map(move |k| t + step * f64::from(k))).collect();
            times.retain(|t| *t >= 0.0 && *t <= delay_s);
            times.extend([0.0, delay_s]);
            times.sort_by(f64::total_cmp);
            times.dedup_by(|a, b| (*a - *b).abs() < 0.01 * step);
        }
        best.ok_or(ShaperError::Unsolved { delay_s })
    }
}

/// Checks that the numbers are positive and in range, and the delay not too long for the search.
fn check(modes: &[ShapedMode], delay_s: f64, band: f64) -> Result<(), ShaperError> {
    let wrong = |what, found, expected| Err(ShaperError::Value { what, found, expected });
    if modes.is_empty() {
        return wrong("the number of modes", 0.0, "at least one");
    }
    if !(delay_s > 0.0 && delay_s.is_finite()) {
        return wrong("the delay of the shaper", delay_s, "a positive time (s)");
    }
    if !(0.0..=MAX_BAND).contains(&band) {
        return wrong("the band of the shaper", band, "a part of the frequency from 0 to 0.5");
    }
    for mode in modes {
        if !(mode.hz > 0.0 && mode.hz.is_finite()) {
            return wrong("a frequency", mode.hz, "a positive one (Hz)");
        }
        if !(0.0..1.0).contains(&mode.ratio) {
            return wrong("a damping ratio", mode.ratio, "from 0 to below 1");
        }
        if !(mode.vibration > 0.0 && mode.vibration.is_finite()) {
            return wrong("the vibration of a mode", mode.vibration, "a positive one");
        }
    }
    let periods = delay_s * modes.iter().map(|mode| mode.hz).fold(0.0, f64::max);
    if periods > MAX_PERIODS {
        return Err(ShaperError::Long { delay_s, periods, most: MAX_PERIODS });
    }
    Ok(())
}

/// Factors on a frequency at which its band is evaluated.
pub(crate) fn within(band: f64) -> Vec<f64> {
    if band == 0.0 {
        return vec![1.0];
    }
    (0..BAND_POINTS).map(|k| 1.0 + band * (2.0 * k as f64 / (BAND_POINTS - 1) as f64 - 1.0)).collect()
}

/// Merges the weights into one copy for each local maximum: neighbours on the grid represent one
/// copy between them.
fn merged(grid: &[(f64, f64)], step: f64) -> Shaper {
    let mut copies: Vec<(f64, f64)> = Vec::new();
    let mut falls = false;
    for (k, &(time, part)) in grid.iter().enumerate() {
        let apart = k == 0 || time - grid[k - 1].0 > 1.5 * step;
        let rises = k > 0 && part > grid[k - 1].1;
        match copies.last_mut() {
            Some((t, sum)) if !(apart || falls && rises) => {
                falls |= !rises;
                *sum += part;
                *t += (time - *t) * part / *sum;
            }
            _ => {
                copies.push((time, part));
                falls = false;
            }
        }
    }
    Shaper { copies }
}

impl Shaper {
    /// Removes negligible copies; their weight is distributed to the others in proportion.
    fn normalised(self) -> Self {
        let kept: Vec<(f64, f64)> = self.copies.into_iter().filter(|(_, part)| *part > MIN_WEIGHT).collect();
        let sum: f64 = kept.iter().map(|(_, part)| part).sum();
        Self { copies: kept.into_iter().map(|(t, part)| (t, part / sum)).collect() }
    }
}

/// Returns the optimal copies on a grid of times; `None` if the solver finds no minimum.
///
/// ```text
/// min t    Σ a_i = 1,   a_i >= 0,   t >= w_k |r_k| / size
/// ```
fn minimised(modes: &[ShapedMode], band: f64, delay_s: f64, size: f64, times: &[f64]) -> Option<Vec<(f64, f64)>> {
    // Clarabel's form: b - A x is in the cones, with x = (weights, t).
    let n = times.len();
    let mut cones = vec![SupportedConeT::ZeroConeT(1), SupportedConeT::NonnegativeConeT(n)];
    let mut A: Vec<(usize, usize, f64)> = (0..n).flat_map(|i| [(0, i, 1.0), (1 + i, i, -1.0)]).collect();
    let mut rows = 1 + n;
    // |r_k| w_k / size <= t: rows t, Re, Im.
    for (mode, f) in modes.iter().flat_map(|mode| within(band).into_iter().map(move |f| (mode, f))) {
        let omega = TAU * f * mode.hz;
        let lambda = Complex::new(-mode.ratio * omega, omega * (1.0 - mode.ratio * mode.ratio).sqrt());
        A.push((rows, n, -1.0));
        for (i, t) in times.iter().enumerate() {
            let left = (lambda * (delay_s - t)).exp() * (mode.vibration / size);
            A.extend([(rows + 1, i, -left.re), (rows + 2, i, -left.im)]);
        }
        cones.push(SupportedConeT::SecondOrderConeT(3));
        rows += 3;
    }
    let (I, (J, V)) = A.into_iter().map(|(i, j, x)| (i, (j, x))).unzip();
    let A = CscMatrix::new_from_triplets(rows, n + 1, I, J, V);
    let (mut b, mut q) = (vec![0.0; rows], vec![0.0; n + 1]);
    (b[0], q[n]) = (1.0, 1.0);
    let settings = DefaultSettings { verbose: false, tol_gap_abs: GAP, tol_gap_rel: GAP, ..DefaultSettings::default() };
    let mut solver = DefaultSolver::new(&CscMatrix::zeros((n + 1, n + 1)), &q, &A, &b, &cones, settings).ok()?;
    solver.solve();
    let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
    // The slacks of the weights equal the weights, and are never negative.
    solved.then(|| times.iter().copied().zip(solver.solution.s[1..].iter().copied()).collect())
}
