//! Stiffness of gears from recorded positions of motors and of the links they drive, while the robot
//! moves.
//!
//! ```text
//! C q_m - q_link = C diag(c) Cᵀ τ:    row i:  Σ_k c_k C_ik (Cᵀ τ)_k - T_i dδ_i/dt + d_i q̇_i + offset of the run
//! ```
//! with the compliance `c_k` of each motor's gear (C is 1 for gears that move one joint), the torques τ
//! through the gears, a delay `d_i` of each link's encoder, and the time constant `T_i` = damping /
//! stiffness, which is fitted to the residual of the other terms. The deflection of one link may be a
//! combination of springs, and one encoder may determine several of them. The torque is computed from
//! the link's motion or measured by a sensor. The noise of the link's encoder is in the deflection
//! and, through its second derivative, in the torque; a plain least-squares fit would be biased by this
//! correlation. The fit therefore uses an instrumental variable without that noise: the torque computed
//! from the motor's motion. Samples of a recording are not independent: standard deviations come from a
//! jackknife over blocks of time. Runs that the fit has not seen, or halves of a single run, show
//! whether the recordings determine the stiffness at all. Not here: torques, filters.

use nalgebra::{DMatrix, DVector};

/// Recording of one link's encoder, evenly sampled, all signals filtered alike.
#[derive(Clone, Debug, PartialEq)]
pub struct GearOutput {
    /// Joint position from the motors minus link position (rad).
    pub deflection: Vec<f64>,
    /// Velocity of the joint (rad/s).
    pub rate: Vec<f64>,
    /// Rate of the deflection (rad/s); zeros for gears without damping.
    pub deflection_rate: Vec<f64>,
    /// Derivative of the deflection with respect to each spring's compliance: `C_ik (Cᵀ τ)_k` (N
    /// m).
    pub torques: Vec<Vec<f64>>,
    /// Instrumental variables: correlated with `torques` but not with the noise of the link's
    /// encoder; the torques themselves if they are measured.
    pub instruments: Vec<Vec<f64>>,
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
    pub fn is_determined(&self) -> bool {
        let sound = |x: &f64| x.is_finite() && *x > 0.0;
        let mut unseen = self.unseen_r2.clone();
        unseen.sort_by(f64::total_cmp);
        let middle = unseen.get(unseen.len() / 2).copied().unwrap_or(f64::NAN);
        let same = |x: &f64| sound(x) && (x / self.stiffness).ln().abs() < 0.5;
        sound(&self.stiffness) && middle > 0.3 && self.without_each.iter().all(same) && self.std_ln < 0.5
    }
}

/// Number of samples in one block of the jackknife.
const BLOCK: usize = 250;

/// Estimates the stiffness of each spring from all recordings of the same encoders; a single
/// recording is split into two halves.
///
/// Returns `None` with fewer than two blocks of samples, or if these encoders do not distinguish
/// the springs.
pub fn gear_stiffness(runs: &[Vec<GearOutput>]) -> Option<Vec<GearEstimate>> {
    let halves;
    let runs = match runs {
        [one] => {
            halves = split(one);
            &halves[..]
        }
        runs => runs,
    };
    let first = runs.first()?.first()?;
    let length = |run: &[GearOutput]| run.first().map_or(0, |output| output.deflection.len());
    if runs.iter().map(|run| length(run)).sum::<usize>() < 2 * BLOCK {
        return None;
    }
    let all: Vec<usize> = (0..runs.len()).collect();
    let fit = Fit::of(runs, &all, None)?;
    // Jackknife over blocks of time, and cross-validation over runs.
    let blocks = all.iter().flat_map(|run| (0..length(&runs[*run]) / BLOCK).map(move |k| (*run, k * BLOCK)));
    let left: Vec<Fit> = blocks.filter_map(|block| Fit::of(runs, &all, Some(block))).collect();
    let others = |run: usize| all.iter().copied().filter(|k| *k != run).collect::<Vec<_>>();
    let without: Vec<Fit> = all.iter().map(|run| Fit::of(runs, &others(*run), None)).collect::<Option<_>>()?;
    // Per spring: both jackknives, and what the torque explains of seen and unseen runs.
    let fitted = |motor: usize| {
        let scatter = |fits: &[Fit]| jackknife(&fits.iter().map(|fit| fit.compliance[motor]).collect::<Vec<_>>());
        let unseen = runs.iter().zip(&without).map(|(run, fit)| squares(&fit.curves(run, motor)));
        let curves: Vec<_> = runs.iter().map(|run| fit.curves(run, motor)).collect();
        let sums = curves.iter().map(squares).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        let count = curves.iter().map(|[measured, _]| measured.len()).sum::<usize>() as f64;
        let compliance = fit.compliance[motor];
        GearEstimate {
            stiffness: 1.0 / compliance,
            std_ln: scatter(&left).max(scatter(&without)) / compliance.abs(),
            delay_s: fit.delay[main_output(runs, motor)],
            r2: 1.0 - sums.0 / sums.1,
            unseen_r2: unseen.map(|(rest, whole)| 1.0 - rest / whole).collect(),
            without_each: without.iter().map(|fit| 1.0 / fit.compliance[motor]).collect(),
            rest_rms: (sums.0 / count).sqrt(),
            deflection_rms: (sums.1 / count).sqrt(),
            curves,
        }
    };
    Some((0..first.torques.len()).map(fitted).collect())
}

/// Returns the encoder with the largest contribution of a spring.
fn main_output(runs: &[Vec<GearOutput>], motor: usize) -> usize {
    let size = |output: usize| {
        runs.iter().flat_map(|run| &run[output].torques[motor]).map(|torque| torque * torque).sum::<f64>()
    };
    (0..runs[0].len()).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(0)
}

fn split(run: &[GearOutput]) -> [Vec<GearOutput>; 2] {
    let half = |second: bool| {
        let cut = |x: &Vec<f64>| {
            let (a, b) = x.split_at(x.len() / 2);
            if second { b.to_vec() } else { a.to_vec() }
        };
        let shortened = |output: &GearOutput| GearOutput {
            deflection: cut(&output.deflection),
            rate: cut(&output.rate),
            deflection_rate: cut(&output.deflection_rate),
            torques: output.torques.iter().map(cut).collect(),
            instruments: output.instruments.iter().map(cut).collect(),
        };
        run.iter().map(shortened).collect()
    };
    [half(false), half(true)]
}

/// Compliance of each spring, delay and damping time constant of each encoder.
struct Fit {
    compliance: Vec<f64>,
    delay: Vec<f64>,
    damping_s: Vec<f64>,
}

impl Fit {
    /// Fits runs with an offset for each encoder of each run, without one block.
    fn of(runs: &[Vec<GearOutput>], some: &[usize], without: Option<(usize, usize)>) -> Option<Self> {
        let (outputs, motors) = (runs[0].len(), runs[0][0].torques.len());
        // Normal equations: signals less their mean in each run, compliances shared by all runs.
        let mut sums = Normal::new(motors + outputs);
        for &k in some {
            let left_out = |i: &usize| without.is_some_and(|(r, first)| r == k && (first..first + BLOCK).contains(i));
            let kept: Vec<usize> = (0..runs[k][0].deflection.len()).filter(|i| !left_out(i)).collect();
            for (number, output) in runs[k].iter().enumerate() {
                let all = |signals: &[Vec<f64>]| signals.iter().map(|x| centred(x, &kept)).collect::<Vec<_>>();
                let (x, z) = (all(&output.torques), all(&output.instruments));
                let rate = centred(&output.rate, &kept);
                let mut columns: Vec<(usize, &[f64], &[f64])> =
                    x.iter().zip(&z).enumerate().map(|(k, (x, z))| (k, &x[..], &z[..])).collect();
                columns.push((motors + number, &rate, &rate));
                sums.add(&columns, &centred(&output.deflection, &kept));
            }
        }
        // The first values are compliances, the last ones delays of the outputs.
        let mut values = sums.solved(motors)?;
        let delay = values.split_off(motors);
        let mut fit = Self { compliance: values, delay, damping_s: vec![0.0; outputs] };
        // Damping from the rest of the deflection over its rate.
        fit.damping_s = (0..outputs)
            .map(|number| {
                let rests =
                    some.iter().map(|&k| (fit.rest(&runs[k][number], number), &runs[k][number].deflection_rate[..]));
                damping_time(rests)
            })
            .collect();
        Some(fit)
    }

    /// Returns the residual of an encoder's deflection.
    fn rest(&self, output: &GearOutput, number: usize) -> Vec<f64> {
        let kept: Vec<usize> = (0..output.deflection.len()).collect();
        let mut rest = centred(&output.deflection, &kept);
        let mut take = |x: &[f64], factor: f64| {
            rest.iter_mut().zip(centred(x, &kept)).for_each(|(rest, x)| *rest -= factor * x);
        };
        take(&output.rate, self.delay[number]);
        take(&output.deflection_rate, -self.damping_s[number]);
        output.torques.iter().zip(&self.compliance).for_each(|(torque, c)| take(torque, *c));
        rest
    }

    /// Returns, for a run and the encoders that a spring affects, the deflection without the
    /// contributions of the other springs, and the deflection that the spring's torque predicts.
    fn curves(&self, run: &[GearOutput], motor: usize) -> [Vec<f64>; 2] {
        let (mut measured, mut expected) = (Vec::new(), Vec::new());
        for (number, output) in run.iter().enumerate() {
            if output.torques[motor].iter().all(|torque| *torque == 0.0) {
                continue;
            }
            let kept: Vec<usize> = (0..output.deflection.len()).collect();
            let own = centred(&output.torques[motor], &kept).into_iter().map(|torque| self.compliance[motor] * torque);
            let own: Vec<f64> = own.collect();
            measured.extend(self.rest(output, number).iter().zip(&own).map(|(rest, own)| rest + own));
            expected.extend(own);
        }
        [measured, expected]
    }
}

/// Returns the jackknife standard deviation of an estimate, from the estimates that each leave out
/// one part of the data.
fn jackknife(without: &[f64]) -> f64 {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    ((n - 1.0) / n * without.iter().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt()
}

/// Normal equations of a linear fit with instrumental variables: `Zᵀ X a = Zᵀ y`.
struct Normal {
    zx: DMatrix<f64>,
    zy: DVector<f64>,
    /// Squared norms of the columns of X and Z.
    sizes: [DVector<f64>; 2],
}

impl Normal {
    fn new(n: usize) -> Self {
        let zeros = || DVector::zeros(n);
        Self { zx: DMatrix::zeros(n, n), zy: zeros(), sizes: [zeros(), zeros()] }
    }

    /// Adds samples, given as column number, X and Z per column.
    fn add(&mut self, columns: &[(usize, &[f64], &[f64])], y: &[f64]) {
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
    fn solved(&self, needed: usize) -> Option<Vec<f64>> {
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
fn damping_time<'a>(of: impl Iterator<Item = (Vec<f64>, &'a [f64])>) -> f64 {
    let sums = of.fold((0.0, 0.0), |sums, (rest, rate)| {
        rest.iter().zip(rate).fold(sums, |(a, b), (r, w)| (a + r * w, b + w * w))
    });
    if sums.1 > 0.0 { -sums.0 / sums.1 } else { 0.0 }
}

/// Returns the sums of squares of the residual of a measured curve and of the curve itself.
fn squares([measured, expected]: &[Vec<f64>; 2]) -> (f64, f64) {
    measured.iter().zip(expected).fold((0.0, 0.0), |(rest, whole), (y, c)| (rest + (y - c).powi(2), whole + y * y))
}

fn centred(x: &[f64], kept: &[usize]) -> Vec<f64> {
    let mean = kept.iter().map(|i| x[*i]).sum::<f64>() / kept.len().max(1) as f64;
    kept.iter().map(|i| x[*i] - mean).collect()
}
