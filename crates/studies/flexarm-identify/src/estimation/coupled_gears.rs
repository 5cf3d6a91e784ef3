//! Stiffness of gears that move several joints, from recorded positions of the motors and of the
//! links they drive.
//!
//! ```text
//! C q_m - q_link = C diag(c) Cᵀ τ:    row i:  Σ_k c_k C_ik (Cᵀ τ)_k + d_i q̇_i + offset of the run
//! ```
//! with the compliance `c_k` of each motor's gear and a delay `d_i` of each link's encoder. Damping
//! proportional to the deflection rate of each link is fitted to the residual. The deflection of
//! one link is a combination of springs, and one encoder may determine several of them. Standard
//! deviations and the criterion for a determined stiffness are as for a single gear
//! ([`crate::estimation::gear_stiffness`]), for the part of the deflection due to each spring.

use crate::estimation::encoders::{BLOCK, GearEstimate, Normal, centred, damping_time, jackknife, squares};

/// Recording of one link's encoder, evenly sampled, all signals filtered alike.
#[derive(Clone, Debug, PartialEq)]
pub struct CoupledOutput {
    /// Joint position from the motors minus link position (rad).
    pub deflection: Vec<f64>,
    /// Velocity of the joint (rad/s).
    pub rate: Vec<f64>,
    /// Rate of the deflection (rad/s); zeros for gears without damping.
    pub deflection_rate: Vec<f64>,
    /// Derivative of the deflection with respect to each spring's compliance: `C_ik (Cᵀ τ)_k` (N
    /// m).
    pub torques: Vec<Vec<f64>>,
    /// Instrumental variables, as `torques` but free of the noise of the encoders
    /// ([`crate::estimation::GearRun::instrument`]).
    pub instruments: Vec<Vec<f64>>,
}

/// Estimates the stiffness of each spring from all recordings of the same encoders; a single
/// recording is split into two halves.
///
/// Returns `None` with fewer than two blocks of samples, or if these encoders do not distinguish
/// the springs.
pub fn coupled_gear_stiffness(runs: &[Vec<CoupledOutput>]) -> Option<Vec<GearEstimate>> {
    let halves;
    let runs = match runs {
        [one] => {
            halves = split(one);
            &halves[..]
        }
        runs => runs,
    };
    let first = runs.first()?.first()?;
    let length = |run: &[CoupledOutput]| run.first().map_or(0, |output| output.deflection.len());
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
    let of = |motor: usize| {
        let scatter = |fits: &[Fit]| jackknife(&fits.iter().map(|fit| fit.compliance[motor]).collect::<Vec<_>>());
        let unseen = runs.iter().zip(&without).map(|(run, fit)| squares(&fit.curves(run, motor)));
        let curves: Vec<_> = runs.iter().map(|run| fit.curves(run, motor)).collect();
        let sums = curves.iter().map(squares).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        let count = curves.iter().map(|[measured, _]| measured.len()).sum::<usize>() as f64;
        let compliance = fit.compliance[motor];
        GearEstimate {
            stiffness: 1.0 / compliance,
            std_ln: scatter(&left).max(scatter(&without)) / compliance.abs(),
            delay_s: fit.delay[seen_most(runs, motor)],
            r2: 1.0 - sums.0 / sums.1,
            unseen_r2: unseen.map(|(rest, whole)| 1.0 - rest / whole).collect(),
            without_each: without.iter().map(|fit| 1.0 / fit.compliance[motor]).collect(),
            rest_rms: (sums.0 / count).sqrt(),
            deflection_rms: (sums.1 / count).sqrt(),
            curves,
        }
    };
    Some((0..first.torques.len()).map(of).collect())
}

/// Returns the encoder with the largest contribution of a spring.
fn seen_most(runs: &[Vec<CoupledOutput>], motor: usize) -> usize {
    let size = |output: usize| {
        runs.iter().flat_map(|run| &run[output].torques[motor]).map(|torque| torque * torque).sum::<f64>()
    };
    (0..runs[0].len()).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(0)
}

fn split(run: &[CoupledOutput]) -> [Vec<CoupledOutput>; 2] {
    let half = |second: bool| {
        let cut = |x: &Vec<f64>| {
            let (a, b) = x.split_at(x.len() / 2);
            if second { b.to_vec() } else { a.to_vec() }
        };
        let of = |output: &CoupledOutput| CoupledOutput {
            deflection: cut(&output.deflection),
            rate: cut(&output.rate),
            deflection_rate: cut(&output.deflection_rate),
            torques: output.torques.iter().map(cut).collect(),
            instruments: output.instruments.iter().map(cut).collect(),
        };
        run.iter().map(of).collect()
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
    fn of(runs: &[Vec<CoupledOutput>], some: &[usize], without: Option<(usize, usize)>) -> Option<Self> {
        let (outputs, motors) = (runs[0].len(), runs[0][0].torques.len());
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
        let mut values = sums.solved(motors)?;
        let delay = values.split_off(motors);
        let mut fit = Self { compliance: values, delay, damping_s: vec![0.0; outputs] };
        fit.damping_s = (0..outputs)
            .map(|number| {
                let of =
                    some.iter().map(|&k| (fit.rest(&runs[k][number], number), &runs[k][number].deflection_rate[..]));
                damping_time(of)
            })
            .collect();
        Some(fit)
    }

    /// Returns the residual of an encoder's deflection.
    fn rest(&self, output: &CoupledOutput, number: usize) -> Vec<f64> {
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
    fn curves(&self, run: &[CoupledOutput], motor: usize) -> [Vec<f64>; 2] {
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
