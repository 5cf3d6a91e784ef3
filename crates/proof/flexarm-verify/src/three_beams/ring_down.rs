//! Ring-down under gravity: error of the stepper, error of the model, and their causes.

use flexarm::{Robot, StepperKind};
use flexarm_stepping::{Damping, ReferenceSettings};
use nalgebra::Vector3;

use crate::Error;
use crate::bench::{ALPHA, LUMPED, Rig, Worst, farthest, in_modes, in_parts, place};

/// Number of modes of each modal link.
pub(super) const MODES: usize = 12;
/// Damping ratio of the first mode.
pub(super) const DAMPING: f64 = 0.03;
/// Tolerance of the stepper with error control.
pub(super) const TOLERANCE: f64 = 1e-9;
/// Number of modes in the modal sums that explain the differences.
pub(super) const SUMMED: usize = 6;
/// Step size of the picture and of the claims, and sampling interval of the tip (s).
pub(super) const STEP_S: f64 = 1e-3;
/// A finer step size (s).
const FINE_STEP_S: f64 = 1e-4;

/// Indices of the models in lists.
const STIFFENED: usize = 0;
pub(super) const LINEAR: usize = 1;
pub(super) const TWO_PARTS: usize = 2;
pub(super) const FIVE_PARTS: usize = 3;

/// A link model, released and integrated by the stepper with error control.
pub(super) struct Model {
    pub(super) name: String,
    rig: Rig,
    /// Displacement of the tip from its undeformed position, every [`STEP_S`] (m).
    pub(super) path: Vec<Vector3<f64>>,
}

/// A run by one stepper.
pub(super) struct Run {
    /// Index of its model in the list.
    pub(super) model: usize,
    pub(super) stepper: &'static str,
    /// Whether its joints are compliant constraints.
    pub(super) compliant: bool,
    pub(super) step_s: f64,
    /// Maximum distance of the tip from the truth, over the peak: in total, then along x, y, z.
    pub(super) method_error: f64,
    pub(super) axis_errors: [f64; 3],
    /// Maximum distance from its own model integrated by the stepper with error control.
    pub(super) stepper_error: f64,
    pub(super) path: Vec<Vector3<f64>>,
}

/// Findings on the ring-down.
pub(super) struct RingDown {
    pub(super) duration_s: f64,
    /// First frequency of the modal links (Hz).
    pub(super) first_hz: f64,
    /// Maximum deflection of the truth (m).
    pub(super) peak_m: f64,
    /// The truth comes first.
    pub(super) models: Vec<Model>,
    pub(super) runs: Vec<Run>,
    pub(super) causes: Causes,
}

impl RingDown {
    pub(super) fn new(robot: &Robot, quick: bool) -> Result<Self, Error> {
        let duration_s = if quick { 0.2 } else { 1.0 };
        let first_hz = Rig::new(robot, &in_modes(MODES).1, None)?.arm.modes.frequencies_hz()[0];
        let beta = 2.0 * DAMPING / (std::f64::consts::TAU * first_hz);
        let models = models(robot, beta, duration_s)?;
        let peak_m = models[STIFFENED].path.iter().map(|u| u.norm()).worst();
        let runs = runs(&models, duration_s, peak_m, quick)?;
        let causes = Causes::new(&models, &runs, beta, peak_m);
        Ok(Self { duration_s, first_hz, peak_m, models, runs, causes })
    }

    /// Returns the true path of the tip.
    pub(super) fn truth(&self) -> &[Vector3<f64>] {
        &self.models[STIFFENED].path
    }

    /// Maximum distance of a model from the truth, both by the stepper with error control, over the
    /// peak.
    pub(super) fn model_error(&self, model: usize) -> f64 {
        farthest(&self.models[model].path, self.truth()) / self.peak_m
    }
}

/// Builds the models, all with the same material damping, proportional to stiffness with factor
/// `beta` (s).
fn models(robot: &Robot, beta: f64, duration_s: f64) -> Result<Vec<Model>, Error> {
    let mut robot = robot.clone();
    for link in &mut robot.flexible_links {
        link.damping = Damping::StiffnessProportional(beta);
    }
    let mut stiffened = robot.clone();
    for link in &mut stiffened.flexible_links {
        link.choices.geometric = true;
    }
    let (modal, links) = in_modes(MODES);
    let [(two, two_links), (five, five_links)] = [in_parts(2), in_parts(5)];
    let list = [
        (format!("{modal}, stiffness by load"), &stiffened, links),
        (modal, &robot, links),
        (two, &robot, two_links),
        (five, &robot, five_links),
    ];
    let precise = StepperKind::Reference(ReferenceSettings::new(TOLERANCE));
    let made = list.into_iter().map(|(name, robot, links)| {
        let rig = Rig::new(robot, &links, None)?;
        let path = rig.path(precise, STEP_S, STEP_S, duration_s)?;
        Ok(Model { name, rig, path })
    });
    made.collect()
}

/// Runs every stepper.
fn runs(models: &[Model], duration_s: f64, peak_m: f64, quick: bool) -> Result<Vec<Run>, Error> {
    let mut list = Vec::new();
    for step_s in [STEP_S, FINE_STEP_S].into_iter().take(if quick { 1 } else { 2 }) {
        list.extend(LUMPED.map(|(stepper, kind)| (TWO_PARTS, stepper, kind, step_s)));
        if step_s == STEP_S {
            list.push((FIVE_PARTS, LUMPED[2].0, ALPHA, step_s));
            list.push((LINEAR, "generalised-alpha", ALPHA, step_s));
        }
    }
    let truth = &models[STIFFENED].path;
    let made = list.into_iter().map(|(model, stepper, kind, step_s)| {
        let path = models[model].rig.path(kind, step_s, STEP_S, duration_s)?;
        let axis = |i: usize| path.iter().zip(truth).map(|(a, b)| a[i] - b[i]).worst() / peak_m;
        Ok(Run {
            model,
            stepper,
            compliant: matches!(kind, StepperKind::Spook(_)),
            step_s,
            method_error: farthest(&path, truth) / peak_m,
            axis_errors: [axis(0), axis(1), axis(2)],
            stepper_error: farthest(&path, &models[model].path) / peak_m,
            path,
        })
    });
    made.collect()
}

/// Causes of the differences between models (frequencies and shares of the sag, each separately),
/// and of the error of compliant constraints.
///
/// All distances are maxima over the peak.
pub(super) struct Causes {
    /// Distance of the truth from the sum of its modes.
    pub(super) sum_error: f64,
    /// One per model except the truth.
    pub(super) models: Vec<ModelCauses>,
    pub(super) constraints: ConstraintCauses,
}

/// Causes of the difference of one model from the truth.
pub(super) struct ModelCauses {
    /// Index of the model in the list.
    pub(super) model: usize,
    /// Relative differences of the frequencies of the summed modes.
    pub(super) hz_errors: Vec<f64>,
    /// Distances of modal sums with its frequencies and the truth's shares, with the truth's
    /// frequencies and its shares, and with both its own.
    pub(super) by_frequencies: f64,
    pub(super) by_shares: f64,
    pub(super) by_both: f64,
    /// Distance of the stepped motions.
    pub(super) stepped: f64,
    /// Share that the modal sums do not explain.
    pub(super) unexplained: f64,
}

/// Compliant constraints with two parts, compared with the same model by the stepper with error
/// control.
pub(super) struct ConstraintCauses {
    pub(super) stepped: f64,
    /// Distance due to positions half a step ahead, in a modal sum.
    pub(super) by_half_a_step: f64,
    /// Distance due to the frequency of the recurrence.
    pub(super) by_frequency: f64,
    pub(super) by_both: f64,
    pub(super) unexplained: f64,
    /// Distance of the local form from the global one.
    pub(super) local_from_global: f64,
}

impl Causes {
    fn new(models: &[Model], runs: &[Run], beta: f64, peak_m: f64) -> Self {
        let truth = &models[STIFFENED];
        let base = Ringing::new(&truth.rig, beta, SUMMED);
        let times = Times { every_s: STEP_S, count: truth.path.len() };
        let sum = base.path(&base, &times, 0.0);
        let causes = |model: usize| {
            let other = Ringing::new(&models[model].rig, beta, SUMMED);
            let both = other.path(&other, &times, 0.0);
            ModelCauses {
                model,
                hz_errors: base.modes.iter().zip(&other.modes).map(|(a, b)| b.omega / a.omega - 1.0).collect(),
                by_frequencies: farthest(&other.path(&base, &times, 0.0), &sum) / peak_m,
                by_shares: farthest(&base.path(&other, &times, 0.0), &sum) / peak_m,
                by_both: farthest(&both, &sum) / peak_m,
                stepped: farthest(&models[model].path, &truth.path) / peak_m,
                unexplained: unexplained([&models[model].path, &truth.path], [&both, &sum]) / peak_m,
            }
        };
        Self {
            sum_error: farthest(&sum, &truth.path) / peak_m,
            models: (1..models.len()).map(causes).collect(),
            constraints: ConstraintCauses::new(&models[TWO_PARTS], runs, beta, peak_m),
        }
    }
}

impl ConstraintCauses {
    /// `runs`: the first two are those by compliant constraints, local and global, with steps of
    /// [`STEP_S`].
    fn new(two: &Model, runs: &[Run], beta: f64, peak_m: f64) -> Self {
        let [local, global] = [0, 1].map(|k| runs[k].path.as_slice());
        let times = Times { every_s: STEP_S, count: two.path.len() };
        let sum = Ringing::new(&two.rig, beta, SUMMED);
        let (slower, ahead_s) = (sum.stepped(STEP_S), 0.5 * STEP_S);
        let alone = sum.path(&sum, &times, 0.0);
        let both = slower.path(&sum, &times, ahead_s);
        Self {
            stepped: farthest(local, &two.path) / peak_m,
            by_half_a_step: farthest(&sum.path(&sum, &times, ahead_s), &alone) / peak_m,
            by_frequency: farthest(&slower.path(&sum, &times, 0.0), &alone) / peak_m,
            by_both: farthest(&both, &alone) / peak_m,
            unexplained: unexplained([local, &two.path], [&both, &alone]) / peak_m,
            local_from_global: farthest(local, global) / peak_m,
        }
    }
}

/// Maximum distance of two stepped motions that the difference of two modal sums does not explain
/// (m).
fn unexplained(stepped: [&[Vector3<f64>]; 2], sums: [&[Vector3<f64>]; 2]) -> f64 {
    let ([a, b], [c, d]) = (stepped, sums);
    (0..a.len()).map(|k| ((a[k] - b[k]) - (c[k] - d[k])).norm()).worst()
}

/// Instants, starting at 0.
struct Times {
    every_s: f64,
    count: usize,
}

/// A mode of the arm, oscillating about the sag.
struct Mode {
    /// Undamped angular frequency (rad/s).
    omega: f64,
    /// Damping ratio.
    zeta: f64,
    /// Its contribution to the sag of the tip (m).
    sag: Vector3<f64>,
}

/// The arm as a sum of its lowest modes, and the remaining static sag.
struct Ringing {
    modes: Vec<Mode>,
    rest: Vector3<f64>,
}

impl Ringing {
    fn new(rig: &Rig, beta: f64, count: usize) -> Self {
        let modes = &rig.arm.modes;
        let e = &modes.equilibrium;
        let at = |e: &nalgebra::DVector<f64>| place(&rig.arm, &rig.frame, e).translation.vector;
        // Equilibrium in modal coordinates.
        let eta = modes.shapes.clone().lu().solve(e).unwrap_or_else(|| e * f64::NAN);
        let mode = |k: usize| Mode {
            omega: modes.omega[k],
            zeta: 0.5 * beta * modes.omega[k],
            sag: at(e) - at(&(e - modes.shapes.column(k) * eta[k])),
        };
        let kept: Vec<Mode> = (0..count).map(mode).collect();
        let sum: Vector3<f64> = kept.iter().map(|mode| mode.sag).sum();
        Self { rest: at(e) - rig.X_WF.translation.vector - sum, modes: kept }
    }

    /// Returns the modes as compliant constraints change them with steps of `h`, to second order:
    /// `ω (1 - ζ h ω/2 - (h ω)²/12)` from the recurrence of the theory page, section 4, on an
    /// oscillator; the decay rate is unchanged.
    fn stepped(&self, h: f64) -> Self {
        let slower = |&Mode { omega, zeta, sag }: &Mode| {
            let factor = 1.0 - 0.5 * zeta * h * omega - (h * omega).powi(2) / 12.0;
            Mode { omega: omega * factor, zeta: zeta / factor, sag }
        };
        Self { modes: self.modes.iter().map(slower).collect(), rest: self.rest }
    }

    /// Returns the path of the tip released undeformed: with the frequencies of `self` and the sag
    /// contributions of `shapes`, ahead by `ahead_s` (s).
    fn path(&self, shapes: &Self, times: &Times, ahead_s: f64) -> Vec<Vector3<f64>> {
        let at = |t: f64| -> Vector3<f64> {
            let swing = self.modes.iter().zip(&shapes.modes).map(|(Mode { omega, zeta, .. }, Mode { sag, .. })| {
                let root = (1.0 - zeta * zeta).sqrt();
                let (sin, cos) = (omega * root * t).sin_cos();
                sag * (1.0 - (-zeta * omega * t).exp() * (cos + zeta / root * sin))
            });
            shapes.rest + swing.sum::<Vector3<f64>>()
        };
        (0..times.count).map(|k| at(k as f64 * times.every_s + ahead_s)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_mode() -> Ringing {
        let mode = Mode { omega: 40.0, zeta: 0.1, sag: Vector3::new(0.0, 0.0, -1e-3) };
        Ringing { modes: vec![mode], rest: Vector3::new(0.0, 0.0, -2e-4) }
    }

    /// Truth: the closed form of a damped oscillator released at rest: it starts at the remaining
    /// static sag, overshoots its sag by exp(-pi z/sqrt(1-z²)) after half a period, and ends at the
    /// sag.
    #[test]
    fn a_mode_let_go_overshoots_its_sag_by_its_damping() {
        let ringing = one_mode();
        let half_period = std::f64::consts::PI / (40.0 * (1.0 - 0.01f64).sqrt());
        let path = ringing.path(&ringing, &Times { every_s: half_period, count: 200 }, 0.0);
        assert!((path[0].z + 2e-4).abs() < 1e-18);
        let overshoot = (-0.1 * std::f64::consts::PI / (1.0 - 0.01f64).sqrt()).exp();
        assert!((path[1].z + 2e-4 + 1e-3 * (1.0 + overshoot)).abs() < 1e-15, "{}", path[1].z);
        assert!((path[199].z + 1.2e-3).abs() < 1e-15, "{}", path[199].z);
    }

    /// Truth by hand: h = 1 ms, 40 rad/s, damping ratio 0.1: factor 1 - 0.002 - 0.0016/12; the
    /// decay rate zeta omega is the same.
    #[test]
    fn compliant_constraints_lower_the_frequency_and_keep_the_decay() {
        let slower = one_mode().stepped(1e-3);
        let factor = 1.0 - 0.002 - 1.6e-3 / 12.0;
        assert!((slower.modes[0].omega - 40.0 * factor).abs() < 1e-12);
        assert!((slower.modes[0].omega * slower.modes[0].zeta - 4.0).abs() < 1e-12);
    }

    #[test]
    fn what_a_sum_of_modes_explains_is_taken_off_before_sizes_are() {
        let at = |z: f64| vec![Vector3::new(0.0, 0.0, z)];
        let (a, b, c, d) = (at(3.0), at(1.0), at(2.5), at(1.0));
        assert!((unexplained([&a, &b], [&c, &d]) - 0.5).abs() < 1e-15);
        assert_eq!(unexplained([&a, &b], [&a, &b]), 0.0);
    }
}
