//! The manipulator picks up a workpiece and sets it down: every stepper across sudden payload
//! changes.

use flexarm::{DriveModel, Modelling, Robot, RunOptions, Scenario, StepperKind};

use super::methods::{SHOWN_STEP_S, reference};
use super::runs::{Run, Runs, stepper_name};
use crate::Error;
use crate::bench::{ALPHA, Bench, in_parts, modal, parts};

const MOTION: &str = "trajectories/pick_and_place.toml";
pub(super) const LOADS: &str = "trajectories/pick_and_place.loads.toml";

/// A link model with one stepper.
pub(super) struct Picked {
    pub(super) links: String,
    pub(super) stepper: String,
    pub(super) explicit: bool,
    pub(super) run: Run,
    /// Maximum distance of the TCP from that of the same links by the stepper with error control,
    /// over its peak.
    pub(super) error: f64,
}

/// Findings on the pick.
pub(super) struct Pick {
    /// Masses of the gripper and of the workpiece (kg).
    pub(super) gripper_kg: f64,
    pub(super) workpiece_kg: f64,
    /// Times at which it is picked up and set down (s).
    pub(super) picked_s: f64,
    pub(super) placed_s: f64,
    /// Truths by the stepper with error control: links in two parts, and links with static shapes.
    pub(super) truths: [(String, Run); 2],
    pub(super) picked: Vec<Picked>,
}

/// Index in [`Pick::picked`] of the run that is drawn.
pub(super) const DRAWN: usize = 1;

impl Pick {
    /// Compares the steppers with the one with error control.
    pub(super) fn new(bench: &Bench, runs: &mut Runs<'_, '_>, robot: &Robot) -> Result<Self, Error> {
        let scenario = Scenario::new(bench.motion(robot, MOTION)?).with_loads_file(bench.file(LOADS))?;
        let mut make = |links: Modelling, stepper: StepperKind, step_s: f64| {
            let modelling = Modelling { drives: DriveModel::Rigid, ..links };
            runs.make_with(robot, &scenario, &modelling, &RunOptions { stepper, step_s, ..RunOptions::default() })
        };
        let links = [in_parts(2), ("modal, no modes".to_owned(), modal(0))];
        let truths = [make(parts(2), reference(), SHOWN_STEP_S)?, make(modal(0), reference(), SHOWN_STEP_S)?];
        let list = [
            (0, "spring-damper", ALPHA, 2e-3),
            (0, "spring-damper", ALPHA, 1e-3),
            (0, "explicit", StepperKind::Rk4, 1e-4),
            (1, "spring-damper", ALPHA, 1e-3),
        ];
        let picked = list.into_iter().map(|(k, stepper, kind, step_s)| {
            let run = make(links[k].1, kind, step_s)?;
            let error = run.apart(&truths[k]).all / truths[k].peaks().all;
            let (links, stepper) = (links[k].0.clone(), stepper_name(stepper, step_s));
            Ok(Picked { links, stepper, explicit: kind == StepperKind::Rk4, run, error })
        });
        let picked = picked.collect::<Result<_, Error>>()?;
        let payload = |k: usize| scenario.payloads.get(k).map_or([f64::NAN; 2], |p| [p.at_s, p.carried.mass]);
        let ([_, gripper_kg], [picked_s, full_kg], [placed_s, _]) = (payload(0), payload(1), payload(2));
        let [two, none] = truths;
        let truths = [(links[0].0.clone(), two), (links[1].0.clone(), none)];
        Ok(Self { gripper_kg, workpiece_kg: full_kg - gripper_kg, picked_s, placed_s, truths, picked })
    }
}
