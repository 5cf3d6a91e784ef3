//! Caveats that every command reports about its robot, motion and loads.
//!
//! Start at [`Arm::caveats`]: what holds for the robot, then for its use by the command, without
//! duplicates. Not here: caveats of a finished run, which need its results (`run/summary.rs`).

use std::sync::Arc;

use flexarm_kinematics::Model;
use flexarm_stepping::{Linear, StepperKind};
use flexarm_trajectory::LimitViolation;
use nalgebra::Vector6;

use super::size::{Size, middle};
use super::{Finding, motion, once_each, validity};
use crate::arm::Arm;
use crate::arm::options::Modelling;
use crate::error::Error;
use crate::motions::motion::Motion;
use crate::motions::scenario::Scenario;
use crate::poses::posed::Posed;
use crate::robot::Robot;

/// Use of a robot by a command.
#[derive(Clone, Copy)]
pub enum Use<'a> {
    /// Holds it at a pose (rad or m) with a wrench on the TCP (world axes; N, N m).
    Held(&'a [f64], &'a [f64; 6]),
    /// Steps it from a pose (rad or m) on commands that come later, with a stepper and its step (s).
    Commanded(&'a [f64], StepperKind, f64),
    /// Moves it along a motion with its loads.
    Along(&'a Scenario),
    /// Neither: the robot is checked at the start of its own motion, or else in the middle of its
    /// joint ranges.
    Any,
}

impl Arm {
    /// Returns all caveats about the robot as modelled and about its use by a command, without
    /// duplicates.
    pub fn caveats(self: &Arc<Self>, used: Use<'_>) -> Vec<Finding> {
        let (arm, robot) = (self, self.robot());
        // The robot, then its use, with the pose in which the use begins.
        let mut caveats = of_model(arm);
        let (pose, wrench) = match used {
            Use::Held(at, wrench) => (Ok(at.to_vec()), *wrench),
            Use::Commanded(at, ..) => (Ok(at.to_vec()), [0.0; 6]),
            Use::Along(scenario) => {
                caveats.extend(of_motion(&scenario.motion, &arm.rigid));
                caveats.extend(of_scenario(arm, scenario));
                (standing_pose(robot, Some(&scenario.motion)), [0.0; 6])
            }
            Use::Any => {
                let own = robot.default_trajectory.as_deref().and_then(|path| Motion::load(path, robot).ok());
                (standing_pose(robot, own.as_ref()), [0.0; 6])
            }
        };
        // The arm at rest in that pose.
        let standing = pose.and_then(|at| {
            let posed = Posed::new(arm.clone(), at)?;
            let linear = posed.linear(&Vector6::from(wrench))?;
            let mut caveats = at_rest(&posed, &linear, &wrench);
            if let (Use::Commanded(_, stepper, step_s), Some(first)) =
                (used, posed.plant.modes.frequencies_hz().first())
            {
                caveats.extend(validity::step(stepper, step_s, *first, posed.plant.first_damping_ratio()));
            }
            Ok(caveats)
        });
        caveats.extend(standing.unwrap_or_else(|error| {
            vec![Finding::warning("no-equilibrium", "robot", error.to_string(), "check stiffness, masses and units")]
        }));
        once_each(caveats)
    }
}

/// As [`Arm::caveats`], for a robot as modelled by its file, in commands that compute nothing with its
/// links and drives.
pub(crate) fn of_robot(robot: &Robot) -> Result<Vec<Finding>, Error> {
    Ok(robot.model(&Modelling::default())?.caveats(Use::Any))
}

/// Returns the caveats about a robot's files, and about its links and drives as modelled.
pub(crate) fn of_model(arm: &Arm) -> Vec<Finding> {
    arm.robot_caveats().iter().cloned().chain(arm.link_caveats()).collect()
}

/// Returns the caveats about a motion on a robot.
pub fn of_motion(motion: &Motion, rigid: &Model) -> Vec<Finding> {
    let mut caveats = motion.caveats();
    let passed = |v: &LimitViolation| {
        let warning = v.warning();
        Finding { message: format!("joint limit: {}", warning.message), ..warning }
    };
    caveats.extend(motion.violations.iter().map(passed));
    caveats.extend(motion::of_motion(&motion.name, &motion.trajectory, rigid));
    caveats
}

/// Returns the caveats about the loads and payloads of a scenario. Those that do not fit the robot
/// are an error of the command instead.
fn of_scenario(arm: &Arm, scenario: &Scenario) -> Vec<Finding> {
    let robot = arm.robot();
    let Ok(acting) = scenario.acting_on(robot, &arm.model) else { return Vec::new() };
    let loads = motion::of_loads(&acting.loads, scenario.duration_s(), &Size::of(&robot.rigid));
    acting.caveats.into_iter().chain(loads).collect()
}

/// Returns the caveats about the arm at rest at a pose, under a wrench on the TCP.
pub(crate) fn at_rest(posed: &Posed, linear: &Linear, wrench: &[f64; 6]) -> Vec<Finding> {
    let mut caveats = posed.caveats();
    caveats.extend(motion::of_wrench(wrench, &Size::of(&posed.arm.robot().rigid)));
    caveats.extend(posed.validity(linear));
    caveats
}

/// Returns the pose at which a robot is checked: the start of the motion, or else the middle of its
/// joint ranges (rad or m).
pub(crate) fn standing_pose(robot: &Robot, motion: Option<&Motion>) -> Result<Vec<f64>, Error> {
    let model = robot.rigid_model()?;
    let actuated = &model.coordinates()[..model.n_actuated()];
    let mut at: Vec<f64> = actuated.iter().map(|c| middle(c.limits.lower, c.limits.upper)).collect();
    if let Some(motion) = motion {
        let n = at.len();
        motion.trajectory.sample(0.0, &mut at, &mut vec![0.0; n], &mut vec![0.0; n]);
    }
    Ok(at)
}
