//! The bar in motion: error as a function of the step size, and a spin-up.
//!
//! [`Steps`] compares steppers at several step sizes with the one with error control, [`SpinUp`] compares
//! link models with a chain of many parts. World axes, m. Not here: statics (`study.rs`).

use std::sync::Arc;

use flexarm::steppers::{ConstraintForm, SpookPreset, SpookSettings, Start};
use flexarm::{LinkModel, Modelling, Robot, StepperKind};
use flexarm_stepping::{Damping, MotionFn, ReferenceSettings};
use nalgebra::Vector3;

use super::nth;
use crate::Error;
use crate::bench::{ALPHA, Rig, Worst, in_modes, in_parts, larger, parts, spook, tool_path};

/// Duration of the ring-down (s).
pub(super) const DURATION_S: f64 = 0.5;
/// Damping ratio of the first mode.
pub(super) const DAMPING: f64 = 0.03;
/// Tolerance of the stepper with error control.
pub(super) const TOLERANCE: f64 = 1e-10;
/// Interval at which errors are sampled, a multiple of every step size (s).
pub(super) const SAMPLE_S: f64 = 10e-3;
/// Shorter sampling interval of the truth, so that its peak is resolved (s).
const TRUTH_EVERY_S: f64 = 5e-4;
/// Step size of the claims (s).
pub(super) const CLAIMED_STEP_S: f64 = 1e-3;

/// One stepper at all step sizes.
pub(super) struct Stepped {
    pub(super) name: &'static str,
    kind: StepperKind,
    /// Maximum distance of the end from the truth over its peak, one per step size; NaN if the
    /// stepper refuses the step size.
    pub(super) errors: Vec<f64>,
}

/// Ring-down: error as a function of the step size.
pub(super) struct Steps {
    /// First frequency of upward bending (Hz).
    pub(super) first_hz: f64,
    /// Maximum deflection (m).
    pub(super) peak_m: f64,
    pub(super) steps_s: Vec<f64>,
    pub(super) steppers: Vec<Stepped>,
}

impl Steps {
    pub(super) fn new(robot: &Robot, quick: bool) -> Result<Self, Error> {
        // Stiffness-proportional damping, the same for all steppers.
        let mut robot = robot.clone();
        let first_hz = nth(&Rig::new(&robot, &parts(2), None)?.bending_hz()[1], 0);
        let beta = 2.0 * DAMPING / (std::f64::consts::TAU * first_hz);
        robot.flexible_links[0].damping = Damping::StiffnessProportional(beta);
        let rig = Rig::new(&robot, &parts(2), None)?;
        let precise = StepperKind::Reference(ReferenceSettings::new(TOLERANCE));
        let fine = rig.path(precise, TRUTH_EVERY_S, TRUTH_EVERY_S, DURATION_S)?;
        let peak_m = fine.iter().map(|u| u.norm()).worst();
        let stride = (SAMPLE_S / TRUTH_EVERY_S).round() as usize;
        let truth: Vec<Vector3<f64>> = fine.iter().step_by(stride).copied().collect();
        let steps_s = if quick { vec![1e-3, 0.5e-3] } else { vec![5e-3, 2e-3, 1e-3, 0.5e-3, 0.2e-3, 0.1e-3] };
        let steppers = steppers().map(|(name, kind)| {
            let errors = steps_s.iter().map(|h| step_error(&rig, kind, *h, &truth, peak_m));
            Ok(Stepped { name, kind, errors: errors.collect::<Result<_, Error>>()? })
        });
        let steppers = steppers.into_iter().collect::<Result<_, Error>>()?;
        Ok(Self { first_hz, peak_m, steps_s, steppers })
    }

    /// Error of a stepper at the step size of the claims; NaN if that step size was not run.
    pub(super) fn at_claimed_step(&self, stepper: &Stepped) -> f64 {
        self.steps_s.iter().position(|h| *h == CLAIMED_STEP_S).map_or(f64::NAN, |k| stepper.errors[k])
    }
}

impl Stepped {
    /// Returns whether the stepper is generalised-alpha.
    pub(super) fn is_alpha(&self) -> bool {
        self.kind == ALPHA
    }

    /// Returns whether the stepper is SPOOK in its exact form, with local or global constraint
    /// axes.
    pub(super) fn is_spook(&self, form: ConstraintForm) -> bool {
        self.kind == spook(form)
    }
}

fn steppers() -> [(&'static str, StepperKind); 5] {
    let source = StepperKind::Spook(SpookSettings { form: ConstraintForm::Local, preset: SpookPreset::Source });
    [
        ("spring-damper, generalised-alpha", ALPHA),
        ("spring-damper, RK4", StepperKind::Rk4),
        ("compliant constraints, local", spook(ConstraintForm::Local)),
        ("compliant constraints, global", spook(ConstraintForm::Global)),
        ("compliant constraints, preset `source`", source),
    ]
}

/// Maximum distance of the end from the truth, over the peak. NaN for the explicit stepper beyond
/// its stability limit, where it refuses the step size.
fn step_error(rig: &Rig, kind: StepperKind, h: f64, truth: &[Vector3<f64>], peak_m: f64) -> Result<f64, Error> {
    match rig.path(kind, h, SAMPLE_S, DURATION_S) {
        Ok(path) => Ok(path.iter().zip(truth).map(|(a, b)| (a - b).norm()).worst() / peak_m),
        Err(_) if kind == StepperKind::Rk4 => Ok(f64::NAN),
        Err(error) => Err(error),
    }
}

/// Speed at the end of the spin-up (rad/s), and its duration (s).
pub(super) const SPEED: f64 = 30.0;
pub(super) const TIME_S: f64 = 1.0;
/// Number of parts of the chain that serves as truth.
pub(super) const TRUE_PARTS: usize = 17;
/// Step size (s) and number of steps.
pub(super) const SPIN_STEP_S: f64 = 5e-4;
const SPIN_STEPS: usize = 2000;

/// A link model in the spin-up.
pub(super) struct Spun {
    pub(super) name: String,
    /// Whether loads change its stiffness.
    pub(super) stiffening: bool,
    /// Maximum distance of the end from the truth, over the peak: in total, along the undeformed
    /// bar, and across it.
    pub(super) errors: [f64; 3],
}

/// Spin-up: modal links, whose velocity terms are integrals over shapes, compared with chains of
/// rigid bodies, which do not use such integrals.
pub(super) struct SpinUp {
    /// Maximum deflection of the truth (m).
    pub(super) peak_m: f64,
    pub(super) models: Vec<Spun>,
}

impl SpinUp {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let path = |modelling: &Modelling, stiffening: bool| {
            let motion = Arc::new(MotionFn(spin_up));
            tool_path(robot, modelling, stiffening, motion, Start::Equilibrium, (SPIN_STEP_S, SPIN_STEPS))
        };
        let truth = path(&parts(TRUE_PARTS), false)?;
        let rigid = path(&Modelling { links: LinkModel::Rigid, ..Modelling::default() }, false)?;
        let [peak_m, ..] = apart(&rigid, &truth, &rigid);
        let linear = [in_parts(2), in_parts(5), in_parts(9), in_modes(6)].map(|(name, links)| (name, links, false));
        let (name, links) = in_modes(6);
        let stiffened = [(format!("{name}, stiffness by load"), links, true)];
        let models = linear.into_iter().chain(stiffened).map(|(name, links, stiffening)| {
            let errors = apart(&path(&links, stiffening)?, &truth, &rigid).map(|d| d / peak_m);
            Ok(Spun { name, stiffening, errors })
        });
        Ok(Self { peak_m, models: models.collect::<Result<_, Error>>()? })
    }
}

/// Motion of the joint from rest to [`SPEED`] in [`TIME_S`]: `q'' = (w/T)(1 - cos 2πt/T)`.
fn spin_up(t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
    let phase = std::f64::consts::TAU * t / TIME_S;
    let a = TIME_S / std::f64::consts::TAU;
    q[0] = SPEED / TIME_S * (0.5 * t * t + a * a * (phase.cos() - 1.0));
    qdot[0] = SPEED / TIME_S * (t - a * phase.sin());
    qddot[0] = SPEED / TIME_S * (1.0 - phase.cos());
}

/// Maximum distance between two paths in total, along the undeformed bar (whose end follows
/// `rigid`), and across it (m).
fn apart(path: &[Vector3<f64>], truth: &[Vector3<f64>], rigid: &[Vector3<f64>]) -> [f64; 3] {
    let parted = path.iter().zip(truth).zip(rigid).map(|((a, b), r)| {
        let (d, along) = (a - b, r.normalize());
        [d.norm(), d.dot(&along).abs(), (d - along * d.dot(&along)).norm()]
    });
    let most = parted.reduce(|a, b| std::array::from_fn(|i| larger(a[i], b[i])));
    most.unwrap_or([f64::NAN; 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: at T the speed is w and the angle is w T/2; the derivatives agree with central
    /// differences of the angle.
    #[test]
    fn the_spin_up_ends_at_its_speed_without_acceleration() {
        let at = |t: f64| {
            let (mut q, mut qdot, mut qddot) = ([0.0], [0.0], [0.0]);
            spin_up(t, &mut q, &mut qdot, &mut qddot);
            [q[0], qdot[0], qddot[0]]
        };
        let [q, qdot, qddot] = at(TIME_S);
        assert!((q - 15.0).abs() < 1e-12 && (qdot - 30.0).abs() < 1e-12 && qddot.abs() < 1e-12);
        for t in [0.1, 0.35, 0.8] {
            let (before, now, after) = (at(t - 1e-5), at(t), at(t + 1e-5));
            assert!(((after[0] - before[0]) / 2e-5 - now[1]).abs() < 1e-7);
            assert!(((after[1] - before[1]) / 2e-5 - now[2]).abs() < 1e-6);
        }
    }

    /// Truth by hand: a difference of (4, 3) with the bar along y is 3 along, 4 across, 5 in total.
    #[test]
    fn a_distance_is_parted_along_and_across_the_bar() {
        let at = |x: f64, y: f64| vec![Vector3::new(x, y, 0.0)];
        assert_eq!(apart(&at(4.0, 3.8), &at(0.0, 0.8), &at(0.0, 0.8)), [5.0, 3.0, 4.0]);
        assert!(apart(&[], &[], &[])[0].is_nan());
    }
}
