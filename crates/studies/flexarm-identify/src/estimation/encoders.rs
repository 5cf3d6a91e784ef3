//! Stiffness of a gear from recorded positions of its motor and of the link it drives, while the
//! robot moves.
//!
//! ```text
//! δ = motor - link = c τ - T dδ/dt + d q̇ + offset of the run
//! ```
//! with the compliance c, the torque τ through the gear, the time constant T = damping / stiffness
//! of the gear, and a delay d between the two encoders. T is fitted to the residual of the other
//! terms. The torque is computed from the link's motion or measured by a sensor. The noise of the
//! link's encoder is in the deflection and, through its second derivative, in the torque; a plain
//! least-squares fit would be biased by this correlation. The fit therefore uses an instrumental
//! variable without that noise: the torque computed from the motor's motion. Samples of a recording
//! are not independent: standard deviations come from a jackknife over blocks of time. Runs that
//! the fit has not seen, or halves of a single run, show whether the recordings determine the
//! stiffness at all. Not here: torques, filters.

use nalgebra::{DMatrix, DVector};

use crate::estimation::coupled_gears::{CoupledOutput, coupled_gear_stiffness};

/// Recording of one gear, evenly sampled, all signals filtered alike.
#[derive(Clone, Debug, PartialEq)]
pub struct GearRun {
    /// Motor position (over the ratio) minus link position (rad).
    pub deflection: Vec<f64>,
    /// Torque through the gear, on the link side (N m).
    pub torque: Vec<f64>,
    /// Instrumental variable (N m): correlated with the torque but not with the noise of the link's
    /// encoder; the torque itself if it is measured.
    pub instrument: Vec<f64>,
    /// Velocity of the joint (rad/s).
    pub rate: Vec<f64>,
    /// Rate of the deflection (rad/s); zeros for a gear without damping.
    pub deflection_rate: Vec<f64>,
}

/// Stiffness of a gear from recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct GearEstimate {
    /// Stiffness (N m/rad); not a positive number if the deflection does not follow the torque.
    pub stiffness: f64,
    /// Standard deviation of the logarithm of the stiffness.
    pub std_ln: f64,
    /// Delay of the link's encoder (s).
    pub delay_s: f64,
    /// Share of the deflection, without offsets and delay, that the torque explains (R²).
    pub r2: f64,
    /// R² of each run, with stiffness and delay fitted to the other runs.
    pub unseen_r2: Vec<f64>,
    /// Stiffness estimated without each run.
    pub without_each: Vec<f64>,
    /// RMS of the unexplained deflection (rad).
    pub rest_rms: f64,
    /// RMS of the deflection without offsets and delay (rad).
    pub deflection_rms: f64,
    /// Deflection without offset and delay, and the deflection that the torque predicts (rad), for
    /// each run or each half of a single run.
    pub curves: Vec<[Vec<f64>; 2]>,
}

impl GearEstimate {
    /// Whether the recordings determine the stiffness: the median R² of unseen runs is above 0.3,
    /// no single run changes the logarithm of the stiffness by 0.5 or more, and [`Self::std_ln`] is
    /// below 0.5.
    pub fn is_told(&self) -> bool {
        let sound = |x: &f64| x.is_finite() && *x > 0.0;
        let mut unseen = self.unseen_r2.clone();
        unseen.sort_by(f64::total_cmp);
        let middle = unseen.get(unseen.len() / 2).copied().unwrap_or(f64::NAN);
        let same = |x: &f64| sound(x) && (x / self.stiffness).ln().abs() < 0.5;
        sound(&self.stiffness) && middle > 0.3 && self.without_each.iter().all(same) && self.std_ln < 0.5
    }
}

/// Number of samples in one block of the jackknife.
pub(crate) const BLOCK: usize = 250;

/// Estimates the stiffness of a gear from all its runs; a single run is split into two halves.
///
/// Returns `None` with fewer than two blocks of samples, or if the torque is constant.
pub fn gear_stiffness(runs: &[GearRun]) -> Option<GearEstimate> {
    let output = |run: &GearRun| CoupledOutput {
        deflection: run.deflection.clone(),
        rate: run.rate.clone(),
        deflection_rate: run.deflection_rate.clone(),
        torques: vec![run.torque.clone()],
        instruments: vec![run.instrument.clone()],
    };
    let runs: Vec<Vec<CoupledOutput>> = runs.iter().map(|run| vec![output(run)]).collect();
    coupled_gear_stiffness(&runs)?.pop()
}

/// Returns the jackknife standard deviation of an estimate, from the estimates that each leave out
/// one part of the data.
pub(crate) fn jackknife(without: &[f64]) -> f64 {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    ((n - 1.0) / n * without.iter().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt()
}

/// Normal equations of a linear fit with instrumental variables: `Zᵀ X a = Zᵀ y`.
pub(crate) struct Normal {
    zx: DMatrix<f64>,
    zy: DVector<f64>,
    /// Squared norms of the columns of X and Z.
    sizes: [DVector<f64>; 2],
}

impl Normal {
    pub(crate) fn new(n: usize) -> Self {
        let zeros = || DVector::zeros(n);
        Self { zx: DMatrix::zeros(n, n), zy: zeros(), sizes: [zeros(), zeros()] }
    }

    /// Adds samples, given as column number, X and Z per column.
    pub(crate) fn add(&mut self, columns: &[(usize, &[f64], &[f64])], y: &[f64]) {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (a, x, z) in columns {
            self.sizes[0][*a] += dot(x, x);
            self.sizes[1][*a] += dot(z, z);
            self.zy[*a] += dot(z, y);
            for (b, x, _) in columns {
                self.zx[(*a, *b)] += dot(z, x);
            }
        }
    }

    /// Returns the coefficients, 0 for zero columns. Returns `None` if one of the first `needed`
    /// columns is zero, or if the columns are linearly dependent.
    pub(crate) fn solved(&self, needed: usize) -> Option<Vec<f64>> {
        let n = self.zy.len();
        let scales = self.sizes.each_ref().map(|sizes| sizes.map(f64::sqrt));
        let determined: Vec<usize> = (0..n).filter(|k| scales.iter().all(|scale| scale[*k] > 0.0)).collect();
        if (0..needed).any(|k| !determined.contains(&k)) {
            return None;
        }
        let unit = DMatrix::from_fn(determined.len(), determined.len(), |i, j| {
            self.zx[(determined[i], determined[j])] / (scales[1][determined[i]] * scales[0][determined[j]])
        });
        let right = DVector::from_fn(determined.len(), |i, _| self.zy[determined[i]] / scales[1][determined[i]]);
        let svd = unit.svd(true, true);
        if svd.singular_values.min() <= DEPENDENT {
            return None;
        }
        let found = svd.solve(&right, 0.0).ok()?;
        let mut values = vec![0.0; n];
        determined.iter().zip(found.iter()).for_each(|(k, x)| values[*k] = x / scales[0][*k]);
        Some(values)
    }
}

/// Minimum singular value of the scaled matrix for linearly independent columns.
const DEPENDENT: f64 = 1e-9;

/// Returns the time constant T of a residual modelled as `-T` times a rate; 0 if the rates are
/// zero.
pub(crate) fn damping_time<'a>(of: impl Iterator<Item = (Vec<f64>, &'a [f64])>) -> f64 {
    let sums = of.fold((0.0, 0.0), |sums, (rest, rate)| {
        rest.iter().zip(rate).fold(sums, |(a, b), (r, w)| (a + r * w, b + w * w))
    });
    if sums.1 > 0.0 { -sums.0 / sums.1 } else { 0.0 }
}

/// Returns the sums of squares of the residual of a measured curve and of the curve itself.
pub(crate) fn squares([measured, expected]: &[Vec<f64>; 2]) -> (f64, f64) {
    measured.iter().zip(expected).fold((0.0, 0.0), |(rest, whole), (y, c)| (rest + (y - c).powi(2), whole + y * y))
}

pub(crate) fn centred(x: &[f64], kept: &[usize]) -> Vec<f64> {
    let mean = kept.iter().map(|i| x[*i]).sum::<f64>() / kept.len().max(1) as f64;
    kept.iter().map(|i| x[*i] - mean).collect()
}
