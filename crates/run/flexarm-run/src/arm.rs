//! A flexible robot, built once and used for many runs and operating points.
//!
//! [`Robot::flexible`] does the costly work (substitution, modes). Its result is immutable, `Send`
//! and `Sync`, and shared by threads. Each query uses numbers and a workspace of its own.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use flexarm_log::{Columns, Trace};
use flexarm_stepping::{FlexibleArm, Held, Linear, OperatingPoint};
use rayon::prelude::*;

use crate::caveat::{Caveat, Use, of_use};
use crate::error::Error;
use crate::flexible::FlexibleRobot;
use crate::joint_values::joint_values;
use crate::options::{Modelling, RunOptions};
use crate::posed::Posed;
use crate::robot::Robot;
use crate::run::{self, RunRequest};
use crate::scenario::Scenario;
use crate::summary::Summary;

/// Joint positions of the last start (rad or m), with the arm at rest there.
type LastStart = Arc<Mutex<Option<(Vec<f64>, Arc<FlexibleArm>)>>>;

/// A robot with its flexible links and drives modelled.
#[derive(Clone)]
pub struct Arm {
    robot: Arc<Robot>,
    modelling: Modelling,
    flexible: Arc<FlexibleRobot>,
    /// Result of [`Robot::caveats`].
    caveats: Arc<[Caveat]>,
    /// Joint values at the start of the last motion, and the arm in equilibrium there.
    pub(crate) last_start: LastStart,
}

/// Results of a run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Figures, as in `summary.json`.
    pub summary: Summary,
    /// Signals; empty unless the request keeps [`Keep::Columns`](crate::Keep::Columns).
    pub columns: Columns,
    /// Curves, thinned for long runs; empty unless the request keeps
    /// [`Keep::Curves`](crate::Keep::Curves) or writes recordings.
    pub trace: Trace,
}

impl Run {
    /// Returns the times of the samples (s).
    pub fn time_s(&self) -> &[f64] {
        self.values("time")
    }

    /// Returns the TCP error, flexible minus rigid, world axes (m): three values per sample. Empty
    /// without the rigid twin.
    pub fn error_world_m(&self) -> &[f64] {
        self.values("error_world")
    }

    /// Returns the values of a signal, row by row; empty if there is no signal with this name.
    /// [`Columns::columns`] lists the names.
    pub fn values(&self, name: &str) -> &[f64] {
        self.columns.column(name).map_or(&[], |column| &column.values)
    }
}

impl Robot {
    /// Returns the robot with its links and drives modelled as requested.
    ///
    /// Cost: a few milliseconds for reading modes and substitution.
    ///
    /// # Errors
    /// [`Error::Modelling`] if a link or drive has no such model, [`Error::Model`] if the result is
    /// not a valid tree.
    pub fn flexible(&self, modelling: Modelling) -> Result<Arm, Error> {
        Ok(Arm::new(self.clone(), modelling, self.modelled(&modelling)?))
    }
}

impl Arm {
    /// Returns the arm of a robot that is already modelled.
    ///
    /// * `flexible`: result of [`Robot::modelled`] with the same `modelling`.
    pub fn new(robot: Robot, modelling: Modelling, flexible: FlexibleRobot) -> Self {
        let caveats = robot.caveats().into();
        Self { robot: Arc::new(robot), modelling, flexible: Arc::new(flexible), caveats, last_start: Arc::default() }
    }

    /// Returns the robot from which the arm was built.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns the shared tree, springs and drives.
    pub fn flexible(&self) -> &Arc<FlexibleRobot> {
        &self.flexible
    }

    /// Returns [`Robot::caveats`], computed once.
    pub fn robot_caveats(&self) -> Arc<[Caveat]> {
        self.caveats.clone()
    }

    /// Returns the caveats about the robot as modelled, and about its use by a command.
    pub fn caveats(&self, used: Use<'_>) -> Vec<Caveat> {
        of_use(&self.robot, &self.flexible, Some(&self.caveats), used)
    }

    /// Holds the arm at a pose; `at`: values of all actuated joints (rad or m), zero by default.
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit the arm.
    pub fn posed(&self, at: Option<&[f64]>) -> Result<Posed, Error> {
        let posed = Posed::with(self.flexible.clone(), self.values(at)?)?;
        Ok(Posed { of_robot: Some(self.robot_caveats()), ..posed })
    }

    /// As [`Arm::posed`], for equilibria alone ([`Posed::resting`]).
    pub(crate) fn resting(&self, at: Option<&[f64]>) -> Result<Posed, Error> {
        let posed = Posed::resting(self.flexible.clone(), self.values(at)?)?;
        Ok(Posed { of_robot: Some(self.robot_caveats()), ..posed })
    }

    fn values(&self, at: Option<&[f64]>) -> Result<Vec<f64>, Error> {
        let names: Vec<&str> = self.flexible.rigid.coordinates().iter().map(|c| c.joint.as_str()).collect();
        joint_values(at, &names)
    }

    /// Returns mass, damping and stiffness about the static equilibrium at a pose under gravity and
    /// a wrench at the TCP, and the Jacobian of the TCP with respect to the free coordinates.
    ///
    /// * `at`: values of all actuated joints (rad or m), zero by default.
    /// * `wrench`: force and moment at the TCP, world axes (N, N m).
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit, [`Error::Step`] if there is no
    /// equilibrium.
    pub fn linearise(&self, at: Option<&[f64]>, wrench: [f64; 6]) -> Result<Linear, Error> {
        self.posed(at)?.linear(&wrench.into())
    }

    /// Returns how links and drives are modelled.
    pub fn modelling(&self) -> &Modelling {
        &self.modelling
    }

    /// Returns the actuated joints, in the order of poses and motions.
    pub fn joints(&self) -> impl Iterator<Item = &str> {
        let model = &self.flexible().model;
        model.coordinates()[..model.n_actuated()].iter().map(|coordinate| coordinate.joint.as_str())
    }

    /// Runs a motion (`&motion`), or a motion with loads, payloads and a start condition
    /// (`&scenario`), and returns figures and columns. The modelling in `options` is ignored.
    ///
    /// # Errors
    /// [`Error`]; [`Error::fault`] returns whether the input or the run is at fault.
    pub fn simulate(&self, scenario: impl Into<Scenario>, options: &RunOptions) -> Result<Run, Error> {
        self.simulate_with(scenario, options, RunRequest::default())
    }

    /// As [`Arm::simulate`], with recordings, an observer, progress or fewer signals kept,
    /// according to `request`.
    ///
    /// The whole input is checked before the first file is created. If the run stops early, the
    /// recordings are closed such that every reader accepts them.
    ///
    /// # Errors
    /// As [`Arm::simulate`]; [`Error::Interrupted`] if observer or progress breaks.
    pub fn simulate_with(
        &self,
        scenario: impl Into<Scenario>,
        options: &RunOptions,
        request: RunRequest<'_>,
    ) -> Result<Run, Error> {
        let options = RunOptions { modelling: self.modelling, ..options.clone() };
        run::simulate(self, &scenario.into(), &options, request)
    }

    /// Runs all scenarios on all cores. Results are bitwise identical to [`Arm::simulate`], for any
    /// number of threads. Once `stop` returns true, unfinished runs end with
    /// [`Error::Interrupted`].
    ///
    /// Uses the thread pool of `rayon`. A failed run does not stop the others.
    pub fn simulate_batch(
        &self,
        scenarios: &[Scenario],
        options: &RunOptions,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Result<Run, Error>> {
        let one = |scenario| {
            let progress = &mut |_, _| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            self.simulate_with(scenario, options, RunRequest { progress: Some(progress), ..RunRequest::default() })
        };
        scenarios.par_iter().map(one).collect()
    }

    /// Returns a workspace for equilibria, compliances and frequencies at any number of poses.
    ///
    /// # Errors
    /// [`Error::Step`] if a spring is not positive definite, or the arm has no equilibrium under
    /// gravity at the middle of its joint ranges.
    pub fn operating_point(&self) -> Result<OperatingPoint, Error> {
        let flexible = self.flexible();
        let model = &flexible.model;
        // Any pose within the limits is suitable.
        let middle = |lower: f64, upper: f64| match (lower.is_finite(), upper.is_finite()) {
            (true, true) => 0.5 * (lower + upper),
            (false, false) => 0.0,
            (finite, _) => {
                if finite {
                    lower.max(0.0)
                } else {
                    upper.min(0.0)
                }
            }
        };
        let actuated = &model.coordinates()[..model.n_actuated()];
        let pose = actuated.iter().map(|c| middle(c.limits.lower, c.limits.upper)).collect();
        let arm = flexible.arm(Arc::new(Held(pose))).map_err(|error| flexible.explained(error))?;
        Ok(OperatingPoint::new(arm, flexible.tcp.clone()))
    }
}
