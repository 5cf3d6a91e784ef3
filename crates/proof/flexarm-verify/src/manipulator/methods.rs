//! One motion, every model and stepper.
//!
//! Errors are largest distances from the reference run, over its peak. Not here: the runs
//! (`runs.rs`).

use flexarm::steppers::{ConstraintForm, ReferenceSettings, SpookPreset, SpookSettings};
use flexarm::{LinkModel, Modelling, Motion, Robot, StepperKind};
use flexarm_stepping::Damping;

use super::runs::{MethodRun, Run, Runs, Sizes, stepper_name};
use super::{ALL_MODES, DAMPING, TOLERANCE};
use crate::Error;
use crate::bench::{ALPHA, Bench, in_modes, in_parts, modal, parts, spook};

const SOURCE: StepperKind =
    StepperKind::Spook(SpookSettings { form: ConstraintForm::Local, preset: SpookPreset::Source });
/// Output step of the stepper with error control (s).
pub(super) const SHOWN_STEP_S: f64 = 2e-3;
/// The usual step size and a fine one (s).
const STEP_S: f64 = 1e-3;
pub(super) const FINE_STEP_S: f64 = 1e-4;

/// Indices of runs in [`Methods::made`].
pub(super) const TWO_PARTS: usize = 0;
pub(super) const EIGHT_PARTS: usize = 3;
pub(super) const CONSTRAINTS: usize = 4;
pub(super) const FINE_CONSTRAINTS: usize = 5;
pub(super) const MODAL: usize = 10;

/// Findings on one motion.
pub(super) struct Methods {
    pub(super) motion: &'static str,
    /// Modal links with all modes by the stepper with error control.
    pub(super) truth: Run,
    /// Its maximum deflection (m).
    pub(super) peak_m: f64,
    pub(super) rigid: Run,
    pub(super) rigid_error: Sizes,
    pub(super) made: Vec<MethodRun>,
    pub(super) steps: Vec<StepErrors>,
}

/// Two parts with stiffness-proportional damping everywhere, at one step size: maximum distance of
/// the TCP from the stepper with error control, over the peak.
pub(super) struct StepErrors {
    pub(super) step_s: f64,
    /// Compliant constraints, local.
    pub(super) constraints: f64,
    /// Spring-damper.
    pub(super) spring_damper: f64,
}

impl Methods {
    pub(super) fn new(
        bench: &Bench,
        runs: &mut Runs<'_, '_>,
        robot: &Robot,
        name: &'static str,
    ) -> Result<Self, Error> {
        let motion = bench.motion(robot, &format!("trajectories/{name}.toml"))?;
        let truth = runs.make(robot, &motion, modal(ALL_MODES), reference(), SHOWN_STEP_S)?;
        let peak_m = truth.peaks().all;
        let rigid_links = Modelling { links: LinkModel::Rigid, ..Modelling::default() };
        let rigid = runs.make(robot, &motion, rigid_links, ALPHA, SHOWN_STEP_S)?;
        let made = list().into_iter().map(|((links, modelling), stepper, kind, step_s)| {
            let run = runs.make(robot, &motion, modelling, kind, step_s)?;
            let error = run.apart(&truth).over(peak_m);
            Ok(MethodRun { links, stepper: stepper_name(stepper, step_s), run, error })
        });
        let made = made.collect::<Result<_, Error>>()?;
        let proportional = proportionally_damped(robot, truth.frequencies_hz[0]);
        let steps_s: &[f64] = if bench.quick { &[1e-3] } else { &[2e-3, 1e-3, 5e-4, 1e-4] };
        let steps = step_errors(runs, &proportional, &motion, steps_s, peak_m)?;
        let rigid_error = rigid.apart(&truth).over(peak_m);
        Ok(Self { motion: name, truth, peak_m, rigid, rigid_error, made, steps })
    }
}

/// The stepper with error control.
pub(super) fn reference() -> StepperKind {
    StepperKind::Reference(ReferenceSettings::new(TOLERANCE))
}

/// Links with their name, name of the stepper, stepper, step size (s).
type Method = ((String, Modelling), &'static str, StepperKind, f64);

/// Every link model with the spring-damper, then compliant constraints, then modal links.
fn list() -> Vec<Method> {
    let mut list: Vec<Method> = Vec::new();
    list.extend([2, 3, 4, 8].map(|n| (in_parts(n), "spring-damper", ALPHA, STEP_S)));
    let local = ("compliant constraints, local", spook(ConstraintForm::Local));
    let global = ("compliant constraints, global", spook(ConstraintForm::Global));
    let source = ("compliant constraints, preset `source`", SOURCE);
    let compliant = [
        (2, local, STEP_S),
        (2, local, FINE_STEP_S),
        (2, global, FINE_STEP_S),
        (4, local, FINE_STEP_S),
        (2, source, STEP_S),
    ];
    list.extend(compliant.map(|(n, (stepper, kind), step_s)| (in_parts(n), stepper, kind, step_s)));
    let guyan = ("modal, no modes (Guyan)".to_owned(), modal(0));
    list.extend([guyan, in_modes(ALL_MODES)].map(|links| (links, "spring-damper", ALPHA, STEP_S)));
    list
}

/// Returns the robot with damping proportional to stiffness. SPOOK damps each spring in this way;
/// with the same damping in both models, only the steppers differ.
fn proportionally_damped(robot: &Robot, first_hz: f64) -> Robot {
    let mut robot = robot.clone();
    for link in &mut robot.flexible_links {
        link.damping = Damping::StiffnessProportional(2.0 * DAMPING / (std::f64::consts::TAU * first_hz));
    }
    robot
}

/// Computes the remaining error of compliant constraints, compared with the stepper with error
/// control on the same model with the same damping.
fn step_errors(
    runs: &mut Runs<'_, '_>,
    robot: &Robot,
    motion: &Motion,
    steps_s: &[f64],
    peak_m: f64,
) -> Result<Vec<StepErrors>, Error> {
    let exact = runs.make(robot, motion, parts(2), reference(), SHOWN_STEP_S)?;
    let errors = steps_s.iter().map(|&step_s| {
        let mut error = |kind| -> Result<f64, Error> {
            Ok(runs.make(robot, motion, parts(2), kind, step_s)?.apart(&exact).all / peak_m)
        };
        let constraints = error(spook(ConstraintForm::Local))?;
        Ok(StepErrors { step_s, constraints, spring_damper: error(ALPHA)? })
    });
    errors.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The claims refer to runs by index.
    #[test]
    fn the_methods_are_where_the_claims_look_for_them() {
        let list = list();
        let name = |k: usize| format!("{}, {}", list[k].0.0, stepper_name(list[k].1, list[k].3));
        assert_eq!(name(TWO_PARTS), "2 parts, spring-damper, 1 ms");
        assert_eq!(name(EIGHT_PARTS), "8 parts, spring-damper, 1 ms");
        assert_eq!(name(CONSTRAINTS), "2 parts, compliant constraints, local, 1 ms");
        assert_eq!(name(FINE_CONSTRAINTS), "2 parts, compliant constraints, local, 0.1 ms");
        assert_eq!(name(MODAL), "modal, 10 modes, spring-damper, 1 ms");
        assert_eq!(list.len(), MODAL + 1);
    }
}
