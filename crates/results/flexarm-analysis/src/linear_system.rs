//! A linear structure with inputs and outputs, and its response to harmonic excitation.
//!
//! ```text
//! M q̈ + D q̇ + K q = B_0 u + B_1 u̇ + B_2 ü        y = C q + F u
//! H(ω) = C (K + iωD - ω²M)^-1 (B_0 + iωB_1 - ω²B_2) + F
//! ```
//! A force has only `B_0`. A prescribed motion has `B_2` (inertia), with gravity also `B_0`, and
//! the rigid part `F`. Start at [`LinearSystem::response`]; [`response_peaks`] finds resonances,
//! [`frequency_grid`] places frequencies. Not here: the matrices of an arm (`flexarm-stepping`),
//! modes (`damped_modes`).

use nalgebra::{Complex, DMatrix};

use crate::spectrum::golden_maximum;

/// Matrices of a linear structure; see the module page. n coordinates, m inputs, p outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSystem {
    /// Mass, n×n.
    pub M: DMatrix<f64>,
    /// Damping, n×n.
    pub D: DMatrix<f64>,
    /// Stiffness, n×n.
    pub K: DMatrix<f64>,
    /// Force per input, n×m.
    pub B_0: DMatrix<f64>,
    /// Force per rate of input, n×m.
    pub B_1: DMatrix<f64>,
    /// Force per second rate of input, n×m.
    pub B_2: DMatrix<f64>,
    /// Output per coordinate, p×n.
    pub C: DMatrix<f64>,
    /// Output per input directly, p×m.
    pub F: DMatrix<f64>,
}

/// Quantity of a response: the output itself or one of its rates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// The output y.
    #[default]
    Displacement,
    /// `ẏ`: the factor `iω`.
    Velocity,
    /// `ÿ`: the factor `-ω²`.
    Acceleration,
}

impl Quantity {
    /// Returns the factor on the response at `omega` (rad/s).
    pub fn factor(self, omega: f64) -> Complex<f64> {
        match self {
            Self::Displacement => Complex::new(1.0, 0.0),
            Self::Velocity => Complex::new(0.0, omega),
            Self::Acceleration => Complex::new(-omega * omega, 0.0),
        }
    }
}

impl LinearSystem {
    /// Checks that the sizes of all matrices fit each other and that their entries are finite.
    ///
    /// # Errors
    /// [`LinearError::Size`], [`LinearError::NotFinite`] for the first matrix that fails.
    pub fn check(&self) -> Result<(), LinearError> {
        let (n, m, p) = (self.M.nrows(), self.F.ncols(), self.F.nrows());
        let shapes = [
            ("mass matrix", &self.M, (n, n)),
            ("damping matrix", &self.D, (n, n)),
            ("stiffness matrix", &self.K, (n, n)),
            ("input matrix B_0", &self.B_0, (n, m)),
            ("input matrix B_1", &self.B_1, (n, m)),
            ("input matrix B_2", &self.B_2, (n, m)),
            ("output matrix C", &self.C, (p, n)),
            ("direct matrix F", &self.F, (p, m)),
        ];
        for (what, matrix, expected) in shapes {
            if matrix.shape() != expected {
                return Err(LinearError::Size { what, found: matrix.shape(), expected });
            }
            if matrix.iter().any(|x| !x.is_finite()) {
                return Err(LinearError::NotFinite { what });
            }
        }
        Ok(())
    }

    /// Computes `H(ω)`, p×m, at `omega` (rad/s): complex amplitude of each output per unit
    /// amplitude of each input.
    ///
    /// At `omega = 0` it is the static response, `C K^-1 B_0 + F`.
    ///
    /// # Errors
    /// [`LinearError::Resonance`] if the dynamic stiffness is singular (no damping, or a rigid
    /// motion at 0), and those of [`LinearSystem::check`].
    pub fn response(&self, omega: f64) -> Result<DMatrix<Complex<f64>>, LinearError> {
        self.check()?;
        let n = self.M.nrows();
        let direct = self.F.map(|x| Complex::new(x, 0.0));
        if n == 0 {
            return Ok(direct);
        }
        let square = omega * omega;
        let combined = |zero: &DMatrix<f64>, one: &DMatrix<f64>, two: &DMatrix<f64>| {
            DMatrix::from_fn(zero.nrows(), zero.ncols(), |i, j| {
                Complex::new(zero[(i, j)] - square * two[(i, j)], omega * one[(i, j)])
            })
        };
        let excitation = combined(&self.B_0, &self.B_1, &self.B_2);
        let amplitude = combined(&self.K, &self.D, &self.M).lu().solve(&excitation);
        let amplitude = amplitude.filter(|x| x.iter().all(|x| x.re.is_finite() && x.im.is_finite()));
        let amplitude = amplitude.ok_or(LinearError::Resonance { omega })?;
        Ok(self.C.map(|x| Complex::new(x, 0.0)) * amplitude + direct)
    }
}

/// Spacing of the frequencies of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spacing {
    /// Equal ratios.
    #[default]
    Logarithmic,
    /// Equal steps.
    Linear,
}

/// Returns frequencies from `from` to `to`, both included, ascending, in their unit; at least two.
///
/// With [`Spacing::Logarithmic`] `from` must be positive.
pub fn frequency_grid(from: f64, to: f64, points: usize, spacing: Spacing) -> Vec<f64> {
    let last = points.max(2) - 1;
    let at = |k: usize| {
        let part = k as f64 / last as f64;
        match spacing {
            Spacing::Logarithmic => from * (to / from).powf(part),
            Spacing::Linear => from + (to - from) * part,
        }
    };
    // The ends are exactly as given.
    let mut grid: Vec<f64> = (0..=last).map(at).collect();
    (grid[0], grid[last]) = (from, to);
    grid
}

/// Adds frequencies around each resonance to a grid, so that no peak falls between two points.
///
/// * `grid`: ascending. `modes`: frequency (in the unit of the grid) and damping ratio of each
///   mode; frequencies outside the grid are left out.
pub fn with_resonances(grid: &[f64], modes: &[(f64, f64)]) -> Vec<f64> {
    let (Some(&from), Some(&to)) = (grid.first(), grid.last()) else { return Vec::new() };
    let mut all = grid.to_vec();
    for &(frequency, ratio) in modes {
        // The half-power width is 2 ζ f; an undamped peak has none, and a nearby point is used.
        let width = ratio.abs().clamp(1e-6, 0.5);
        let steps = [-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0];
        all.extend(steps.map(|k: f64| frequency * (1.0 + k * width)).into_iter().filter(|f| *f > from && *f < to));
    }
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Maximum number of halvings of an interval of the grid.
const MAX_HALVINGS: u32 = 10;
/// Entries below this fraction of the largest are rounding.
const ROUNDING: f64 = 1e-9;

/// Refines a response over a grid until linear interpolation between the points, on logarithmic
/// axes, reproduces all magnitudes within a tolerance: many points around resonances and
/// antiresonances, few elsewhere.
///
/// * `grid`: ascending, with a point near each resonance ([`with_resonances`]): features narrower
///   than its steps are not found.
/// * `answer`: the response at a frequency; `None` if there is none (an undamped resonance), which
///   leaves that point out.
/// * `tolerance`: relative, such as 0.01. An interval of the grid is halved at most ten times.
///
/// Returns the frequencies and the responses there.
pub fn resolved_response(
    grid: &[f64],
    answer: impl Fn(f64) -> Option<DMatrix<Complex<f64>>>,
    tolerance: f64,
) -> (Vec<f64>, Vec<DMatrix<Complex<f64>>>) {
    let mut found: Vec<(f64, DMatrix<Complex<f64>>)> = Vec::new();
    for (frequency, response) in grid.iter().filter_map(|f| Some((*f, answer(*f)?))) {
        // Open intervals to the next points, the nearest last; each begins at the last point found.
        let mut open = vec![(frequency, response, 0)];
        while let Some((b, H_b, depth)) = open.pop() {
            let middle = found.last().filter(|_| depth < MAX_HALVINGS).and_then(|(a, H_a)| {
                let m = if *a > 0.0 { (a * b).sqrt() } else { 0.5 * (a + b) };
                let H_m = answer(m).filter(|H_m| *a < m && m < b && strays(H_a, H_m, &H_b, tolerance))?;
                Some((m, H_m))
            });
            match middle {
                Some((m, H_m)) => open.extend([(b, H_b, depth + 1), (m, H_m, depth + 1)]),
                None => found.push((b, H_b)),
            }
        }
    }
    found.into_iter().unzip()
}

/// Returns whether a magnitude in the middle of an interval deviates from the line between its
/// ends, on logarithmic axes.
fn strays(
    H_a: &DMatrix<Complex<f64>>,
    H_m: &DMatrix<Complex<f64>>,
    H_b: &DMatrix<Complex<f64>>,
    tolerance: f64,
) -> bool {
    let largest = H_m.iter().map(|h| h.norm()).fold(0.0, f64::max);
    let entries = H_a.iter().zip(H_m.iter()).zip(H_b.iter());
    entries.map(|((a, m), b)| [a, m, b].map(|h| h.norm())).any(|sizes| {
        let [a, m, b] = sizes.map(f64::ln);
        sizes.iter().all(|size| *size > ROUNDING * largest) && (m - 0.5 * (a + b)).abs() > tolerance
    })
}

/// A maximum of a response over frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponsePeak {
    /// Frequency, in the unit of the grid.
    pub frequency: f64,
    /// Magnitude.
    pub magnitude: f64,
}

/// Finds the local maxima of `magnitude` over a grid of frequencies (ascending, any unit), each
/// refined between its neighbours by golden-section search; the highest first. The ends of the grid
/// are not peaks.
///
/// * `grid`: ascending, fine enough that each peak has its own point ([`with_resonances`]).
/// * `values`: magnitudes there, one per frequency. `magnitude`: the same function, anywhere.
///
/// # Panics
/// If `grid` and `values` differ in length.
pub fn response_peaks(grid: &[f64], values: &[f64], magnitude: impl Fn(f64) -> f64) -> Vec<ResponsePeak> {
    assert_eq!(grid.len(), values.len(), "one magnitude for each frequency");
    let mut peaks: Vec<ResponsePeak> = (1..grid.len().saturating_sub(1))
        .filter(|&k| values[k] >= values[k - 1] && values[k] > values[k + 1])
        .map(|k| {
            // 45 steps reduce the interval to 4e-10 of itself, the accuracy limit of a maximum.
            let refined = golden_maximum(&magnitude, grid[k - 1], grid[k + 1], 45);
            let top = magnitude(refined);
            if top >= values[k] { (refined, top) } else { (grid[k], values[k]) }
        })
        .map(|(frequency, magnitude)| ResponsePeak { frequency, magnitude })
        .collect();
    peaks.sort_by(|a, b| b.magnitude.total_cmp(&a.magnitude));
    peaks
}

/// Reason why a linear structure has no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearError {
    /// A matrix of the wrong size.
    #[error("the {what} has {} x {} entries, expected {} x {}", found.0, found.1, expected.0, expected.1)]
    Size {
        /// Name of the matrix.
        what: &'static str,
        /// Its number of rows and columns.
        found: (usize, usize),
        /// Expected number of rows and columns.
        expected: (usize, usize),
    },
    /// A NaN or infinite entry.
    #[error("the {what} has a NaN or infinite entry")]
    NotFinite {
        /// Name of the matrix.
        what: &'static str,
    },
    /// A matrix that is not positive definite, although it must be.
    #[error("the {what} is not positive definite")]
    NotPositiveDefinite {
        /// Name of the matrix.
        what: &'static str,
    },
    /// The eigenvalue iteration did not converge.
    #[error("the eigenvalues of the damped structure were not found")]
    NotConverged,
    /// The dynamic stiffness is singular.
    #[error("the structure has an undamped resonance at {} Hz, where its response is infinite", omega / std::f64::consts::TAU)]
    Resonance {
        /// Angular frequency, rad/s.
        omega: f64,
    },
}
