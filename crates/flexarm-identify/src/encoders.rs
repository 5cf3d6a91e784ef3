//! Stiffness of a gear from the positions of its motor and of the link behind it, recorded while the robot moves.
//!
//! ```text
//! motor - link = c τ + d q̇ + offset of the run
//! ```
//! with the compliance c, the torque τ through the gear that the rigid robot needs, and a delay d between the two instruments.
//! Samples of a recording are not independent: deviations are those of a jackknife over blocks of time. Whether the gear is told at
//! all is asked of runs, or halves of one run, that the fit has not seen. Not here: torques, filters.

use nalgebra::{DMatrix, DVector};

/// One recording of one gear, evenly sampled, all filtered alike.
#[derive(Clone, Debug, PartialEq)]
pub struct GearRun {
    /// Motor (over the ratio) less link (rad).
    pub deflection: Vec<f64>,
    /// Through the gear, on the link's side (N m).
    pub torque: Vec<f64>,
    /// Speed of the joint (rad/s).
    pub rate: Vec<f64>,
}

/// What recordings tell of a gear.
#[derive(Clone, Debug, PartialEq)]
pub struct GearEstimate {
    /// N m/rad; not a positive number where the deflection does not follow the torque.
    pub stiffness: f64,
    /// Standard deviation of its logarithm.
    pub std_ln: f64,
    /// By how much the link's instrument is late (s).
    pub delay_s: f64,
    /// Share of the deflection, without offsets and delay, that the torque explains.
    pub r2: f64,
    /// The same of each run, with stiffness and delay of the others.
    pub unseen_r2: Vec<f64>,
    /// Stiffness without each run.
    pub without_each: Vec<f64>,
    /// What is left of the deflection (rad, RMS).
    pub rest_rms: f64,
    /// Deflection without offsets and delay (rad, RMS).
    pub deflection_rms: f64,
}

impl GearEstimate {
    /// Whether the recordings tell the stiffness: most of a run that was not seen follows from it, and it does not depend on one run.
    pub fn is_told(&self) -> bool {
        let sound = |x: &f64| x.is_finite() && *x > 0.0;
        let mut unseen = self.unseen_r2.clone();
        unseen.sort_by(f64::total_cmp);
        let middle = unseen.get(unseen.len() / 2).copied().unwrap_or(f64::NAN);
        let same = |x: &f64| sound(x) && (x / self.stiffness).ln().abs() < 0.5;
        sound(&self.stiffness) && middle > 0.3 && self.without_each.iter().all(same) && self.std_ln < 0.5
    }
}

/// Samples of one block of the jackknife.
pub(crate) const BLOCK: usize = 250;

/// Finds the stiffness of a gear from all its runs; one run is taken as two halves.
///
/// None for less than two blocks of samples, or torques that do not change.
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
    let blocks: Vec<(usize, usize)> =
        all.iter().flat_map(|run| (0..runs[*run].deflection.len() / BLOCK).map(move |k| (*run, k * BLOCK))).collect();
    let left: Vec<f64> =
        blocks.iter().filter_map(|block| Fit::of(runs, &all, Some(*block))).map(|fit| fit.compliance).collect();
    let (n, mean) = (left.len() as f64, left.iter().sum::<f64>() / left.len() as f64);
    let variance = (n - 1.0) / n * left.iter().map(|c| (c - mean).powi(2)).sum::<f64>();
    let (mut unseen_r2, mut without_each) = (Vec::new(), Vec::new());
    for run in &all {
        let others: Vec<usize> = all.iter().copied().filter(|k| k != run).collect();
        let other = Fit::of(runs, &others, None)?;
        without_each.push(1.0 / other.compliance);
        let (rest, whole) = other.left_of(&runs[*run]);
        unseen_r2.push(1.0 - rest / whole);
    }
    let sums = runs.iter().map(|run| fit.left_of(run)).fold((0.0, 0.0), |(a, b), (rest, whole)| (a + rest, b + whole));
    let count = runs.iter().map(|run| run.deflection.len()).sum::<usize>() as f64;
    Some(GearEstimate {
        stiffness: 1.0 / fit.compliance,
        std_ln: variance.sqrt() / fit.compliance.abs(),
        delay_s: fit.delay,
        r2: 1.0 - sums.0 / sums.1,
        unseen_r2,
        without_each,
        rest_rms: (sums.0 / count).sqrt(),
        deflection_rms: (sums.1 / count).sqrt(),
    })
}

fn split(run: &GearRun) -> [GearRun; 2] {
    let middle = run.deflection.len() / 2;
    let part = |range: std::ops::Range<usize>| GearRun {
        deflection: run.deflection[range.clone()].to_vec(),
        torque: run.torque[range.clone()].to_vec(),
        rate: run.rate[range].to_vec(),
    };
    [part(0..middle), part(middle..run.deflection.len())]
}

/// Compliance and delay of some runs.
struct Fit {
    compliance: f64,
    delay: f64,
}

impl Fit {
    /// Least squares with an offset for each run, without one block.
    fn of(runs: &[GearRun], some: &[usize], without: Option<(usize, usize)>) -> Option<Self> {
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(2, 2), DVector::<f64>::zeros(2));
        for &k in some {
            let run = &runs[k];
            let left_out = |i: &usize| without.is_some_and(|(r, first)| r == k && (first..first + BLOCK).contains(i));
            let kept: Vec<usize> = (0..run.deflection.len()).filter(|i| !left_out(i)).collect();
            let [y, t, v] = [&run.deflection, &run.torque, &run.rate].map(|x| centred(x, &kept));
            for i in 0..kept.len() {
                let row = [t[i], v[i]];
                for a in 0..2 {
                    right[a] += row[a] * y[i];
                    (0..2).for_each(|b| normal[(a, b)] += row[a] * row[b]);
                }
            }
        }
        let scale: Vec<f64> = (0..2).map(|k| f64::sqrt(normal[(k, k)])).collect();
        if scale[0].is_nan() || scale[0] <= 0.0 {
            return None;
        }
        // A joint that stands still has no delay to be told.
        if scale[1] == 0.0 {
            return Some(Self { compliance: right[0] / normal[(0, 0)], delay: 0.0 });
        }
        let unit = DMatrix::from_fn(2, 2, |i, j| normal[(i, j)] / (scale[i] * scale[j]));
        let found = unit.cholesky()?.solve(&DVector::from_fn(2, |i, _| right[i] / scale[i]));
        Some(Self { compliance: found[0] / scale[0], delay: found[1] / scale[1] })
    }

    /// Sums of squares of a run: what is left, and without the torque, offset free.
    fn left_of(&self, run: &GearRun) -> (f64, f64) {
        let kept: Vec<usize> = (0..run.deflection.len()).collect();
        let [y, t, v] = [&run.deflection, &run.torque, &run.rate].map(|x| centred(x, &kept));
        (0..y.len()).fold((0.0, 0.0), |(rest, whole), i| {
            let late = y[i] - self.delay * v[i];
            (rest + (late - self.compliance * t[i]).powi(2), whole + late * late)
        })
    }
}

pub(crate) fn centred(x: &[f64], kept: &[usize]) -> Vec<f64> {
    let mean = kept.iter().map(|i| x[*i]).sum::<f64>() / kept.len().max(1) as f64;
    kept.iter().map(|i| x[*i] - mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seed: f64, noise: f64, stiffness: f64) -> GearRun {
        let n = 2500;
        let t = |k: usize| 0.004 * k as f64;
        let torque: Vec<f64> = (0..n).map(|k| 900.0 * (0.9 * t(k) + seed).sin() + 400.0 * (2.3 * t(k)).cos()).collect();
        let rate: Vec<f64> = (0..n).map(|k| 0.4 * (1.3 * t(k) + 2.0 * seed).cos()).collect();
        let error = |k: usize| noise * (17.0 * t(k) * (1.0 + 0.1 * seed)).sin();
        let deflection = (0..n).map(|k| torque[k] / stiffness + 3e-3 * rate[k] + 1e-3 * seed + error(k)).collect();
        GearRun { deflection, torque, rate }
    }

    #[test]
    fn a_gear_is_found_with_its_delay_whatever_the_offsets_of_the_runs() {
        let runs: Vec<GearRun> = [0.0, 1.0, 2.0].map(|seed| run(seed, 0.0, 8e6)).to_vec();
        let found = gear_stiffness(&runs).unwrap();
        assert!((found.stiffness / 8e6 - 1.0).abs() < 1e-10 && (found.delay_s - 3e-3).abs() < 1e-12, "{found:?}");
        assert!(found.is_told() && found.r2 > 1.0 - 1e-12 && found.unseen_r2.iter().all(|r2| *r2 > 1.0 - 1e-12));
        // One run is held against itself by halves.
        assert!(gear_stiffness(&runs[..1]).unwrap().is_told());
    }

    #[test]
    fn a_deflection_below_the_error_of_the_encoder_is_not_told() {
        let runs: Vec<GearRun> = [0.0, 1.0, 2.0].map(|seed| run(seed, 4e-4, 4e7)).to_vec();
        let found = gear_stiffness(&runs).unwrap();
        assert!(!found.is_told(), "{found:?}");
    }
}
