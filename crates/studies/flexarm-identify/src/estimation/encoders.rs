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
    let halves;
    let runs = match runs {
        [one] => {
            halves = split(one);
            &halves[..]
        }
        runs => runs,
    };
    if runs.is_empty() || runs.iter().map(|run| run.deflection.len()).sum::<usize>() < 2 * BLOCK {
        return None;
    }
    let all: Vec<usize> = (0..runs.len()).collect();
    let fit = Fit::of(runs, &all, None)?;
    // Jackknife over blocks of time.
    let blocks: Vec<(usize, usize)> =
        all.iter().flat_map(|run| (0..runs[*run].deflection.len() / BLOCK).map(move |k| (*run, k * BLOCK))).collect();
    let left: Vec<f64> =
        blocks.iter().filter_map(|block| Fit::of(runs, &all, Some(*block))).map(|fit| fit.compliance).collect();
    // Cross-validation over runs.
    let (mut unseen_r2, mut without_each) = (Vec::new(), Vec::new());
    for run in &all {
        let others: Vec<usize> = all.iter().copied().filter(|k| k != run).collect();
        let other = Fit::of(runs, &others, None)?;
        without_each.push(1.0 / other.compliance);
        let (rest, whole) = other.left_of(&runs[*run]);
        unseen_r2.push(1.0 - rest / whole);
    }
    let apart: Vec<f64> = without_each.iter().map(|stiffness: &f64| 1.0 / stiffness).collect();
    let curves: Vec<_> = runs.iter().map(|run| fit.curves(run)).collect();
    let sums = curves.iter().map(squares).fold((0.0, 0.0), |(a, b), (rest, whole)| (a + rest, b + whole));
    let count = runs.iter().map(|run| run.deflection.len()).sum::<usize>() as f64;
    Some(GearEstimate {
        stiffness: 1.0 / fit.compliance,
        std_ln: jackknife(&left).max(jackknife(&apart)) / fit.compliance.abs(),
        delay_s: fit.delay,
        r2: 1.0 - sums.0 / sums.1,
        unseen_r2,
        without_each,
        rest_rms: (sums.0 / count).sqrt(),
        deflection_rms: (sums.1 / count).sqrt(),
        curves,
    })
}

/// Returns the jackknife standard deviation of an estimate, from the estimates that each leave out
/// one part of the data.
pub(crate) fn jackknife(without: &[f64]) -> f64 {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    ((n - 1.0) / n * without.iter().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt()
}

fn split(run: &GearRun) -> [GearRun; 2] {
    let middle = run.deflection.len() / 2;
    let part = |range: std::ops::Range<usize>| GearRun {
        deflection: run.deflection[range.clone()].to_vec(),
        torque: run.torque[range.clone()].to_vec(),
        instrument: run.instrument[range.clone()].to_vec(),
        rate: run.rate[range.clone()].to_vec(),
        deflection_rate: run.deflection_rate[range].to_vec(),
    };
    [part(0..middle), part(middle..run.deflection.len())]
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

/// Compliance, delay and damping time constant fitted to some runs.
struct Fit {
    compliance: f64,
    delay: f64,
    damping_s: f64,
}

impl Fit {
    /// Fits runs with an offset for each, without one block.
    fn of(runs: &[GearRun], some: &[usize], without: Option<(usize, usize)>) -> Option<Self> {
        let centred_runs: Vec<[Vec<f64>; 5]> = some
            .iter()
            .map(|&k| {
                let run = &runs[k];
                let left_out =
                    |i: &usize| without.is_some_and(|(r, first)| r == k && (first..first + BLOCK).contains(i));
                let kept: Vec<usize> = (0..run.deflection.len()).filter(|i| !left_out(i)).collect();
                let all = [&run.deflection, &run.torque, &run.instrument, &run.rate, &run.deflection_rate];
                all.map(|x| centred(x, &kept))
            })
            .collect();
        let mut sums = Normal::new(2);
        centred_runs.iter().for_each(|[y, t, z, v, _]| sums.add(&[(0, t, z), (1, v, v)], y));
        let found = sums.solved(1)?;
        let (compliance, delay) = (found[0], found[1]);
        // Damping is fitted to the residual: in a joint fit, friction, which jumps where the torque
        // is largest, would be taken for damping and change the compliance.
        let damping = centred_runs.iter().map(|[y, t, _, v, w]| {
            let rest: Vec<f64> = (0..y.len()).map(|k| y[k] - compliance * t[k] - delay * v[k]).collect();
            (rest, &w[..])
        });
        Some(Self { compliance, delay, damping_s: damping_time(damping) })
    }

    /// Returns the deflection of a run without offset, delay and damping, and the deflection that
    /// the torque predicts.
    fn curves(&self, run: &GearRun) -> [Vec<f64>; 2] {
        let kept: Vec<usize> = (0..run.deflection.len()).collect();
        let [y, t, v, w] = [&run.deflection, &run.torque, &run.rate, &run.deflection_rate].map(|x| centred(x, &kept));
        let measured = (0..y.len()).map(|k| y[k] - self.delay * v[k] + self.damping_s * w[k]).collect();
        [measured, t.iter().map(|t| self.compliance * t).collect()]
    }

    /// Returns the sums of squares of a run without offset: the residual, and the deflection.
    fn left_of(&self, run: &GearRun) -> (f64, f64) {
        squares(&self.curves(run))
    }
}

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
