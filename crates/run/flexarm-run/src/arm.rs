//! A robot that bends, built once and asked often: runs with columns, operating points.
//!
//! [`Robot::flexible`] does what costs (substitution, modes); what it returns is immutable, `Send` and `Sync`, and shared by
//! threads. Each query takes numbers and a workspace of its own.

use std::ops::ControlFlow;
use std::sync::Arc;

use flexarm_log::{Columns, RunHeader, Sample};
use flexarm_stepping::{Held, OperatingPoint};
use rayon::prelude::*;

use crate::caveat::{Caveat, Use, told};
use crate::error::Error;
use crate::flexible::FlexibleRobot;
use crate::options::{Modelling, Outputs, RunOptions};
use crate::prepare::Prepared;
use crate::robot::Robot;
use crate::run::{Observer, Progress, Together, Wanted, run_traced};
use crate::scenario::Scenario;
use crate::summary::Summary;

/// A robot with its flexible links and drives in place.
#[derive(Clone)]
pub struct Arm {
    robot: Arc<Robot>,
    modelling: Modelling,
    prepared: Arc<Prepared>,
    /// [`Robot::caveats`].
    caveats: Arc<[Caveat]>,
}

/// What a run gives: figures, and every logged sample as columns.
#[derive(Clone, Debug)]
pub struct Run {
    /// The figures, as in `summary.json`.
    pub summary: Summary,
    /// The signals.
    pub columns: Columns,
}

/// Called with each logged sample; breaking off stops the run.
pub type SampleObserver<'a> = dyn FnMut(&Sample) -> ControlFlow<()> + 'a;

/// Nobody breaks off.
fn to_the_end(_t: f64, _total: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

impl Run {
    /// Times of the samples (s).
    pub fn time_s(&self) -> &[f64] {
        self.values("time")
    }

    /// TCP error, flexible minus rigid, world axes (m): three numbers per sample. Empty without the rigid twin.
    pub fn error_world_m(&self) -> &[f64] {
        self.values("error_world")
    }

    /// Numbers of a signal, rows after each other; empty if there is none of this name. [`Columns::columns`] lists them.
    pub fn values(&self, name: &str) -> &[f64] {
        self.columns.column(name).map_or(&[], |column| &column.values)
    }
}

impl Robot {
    /// The robot with its links and drives modelled as asked for.
    ///
    /// Cost: reading of modes, substitution; milliseconds.
    ///
    /// # Errors
    /// [`Error::Modelling`] if a link or drive has no such model, [`Error::Model`] if the result is no tree.
    pub fn flexible(&self, modelling: Modelling) -> Result<Arm, Error> {
        let prepared = Arc::new(Prepared::new(self.modelled(&modelling)?));
        Ok(Arm { robot: Arc::new(self.clone()), modelling, prepared, caveats: self.caveats().into() })
    }
}

impl Arm {
    /// The robot that it was made of.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Tree, springs and drives.
    pub fn flexible(&self) -> &FlexibleRobot {
        &self.prepared.flexible
    }

    /// As [`Arm::flexible`], shared.
    pub(crate) fn shared(&self) -> Arc<FlexibleRobot> {
        self.prepared.flexible.clone()
    }

    /// [`Robot::caveats`], found once.
    pub(crate) fn robot_caveats(&self) -> Arc<[Caveat]> {
        self.caveats.clone()
    }

    /// Everything that is to be said of the robot as it is modelled, and of what a command does with it.
    pub(crate) fn told(&self, used: Use<'_>) -> Vec<Caveat> {
        told(&self.robot, &self.shared(), Some(&self.caveats), used)
    }

    /// How its links and drives are modelled.
    pub fn modelling(&self) -> &Modelling {
        &self.modelling
    }

    /// Actuated joints, in the order in which poses and motions have them.
    pub fn joints(&self) -> impl Iterator<Item = &str> {
        let model = &self.flexible().model;
        model.coordinates()[..model.n_actuated()].iter().map(|coordinate| coordinate.joint.as_str())
    }

    /// Runs a motion (`&motion`), or a motion with loads, payloads and a start of its own (`&scenario`); the options' own
    /// modelling does not count.
    ///
    /// # Errors
    /// As [`crate::simulate`].
    pub fn simulate(&self, scenario: impl Into<Scenario>, options: &RunOptions) -> Result<Run, Error> {
        let mut go_on = |_: &Sample| ControlFlow::Continue(());
        self.run(&scenario.into(), options, None, Wanted::Columns, &mut go_on, &mut to_the_end)
    }

    /// As [`Arm::simulate`], the figures alone: for studies of many runs of which nobody looks at the signals.
    ///
    /// # Errors
    /// As [`crate::simulate`].
    pub fn simulate_summary(&self, scenario: impl Into<Scenario>, options: &RunOptions) -> Result<Summary, Error> {
        let options = RunOptions { modelling: self.modelling, ..options.clone() };
        self.traced(&scenario.into(), &options, None, Wanted::Figures, None, &mut to_the_end)
    }

    /// As [`Arm::simulate`], writes recordings if asked to, and shows each logged sample to `observer`, which may break off.
    ///
    /// # Errors
    /// As [`crate::simulate`]; [`Error::Interrupted`] if the observer breaks off.
    pub fn simulate_with(
        &self,
        scenario: impl Into<Scenario>,
        options: &RunOptions,
        outputs: Option<&Outputs>,
        observer: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Result<Run, Error> {
        self.simulate_watched(scenario, options, outputs, Some(observer), &mut to_the_end)
    }

    /// As [`Arm::simulate_with`], and tells `progress` how far it is, which may break off too; without an observer, samples
    /// are made as far as columns and recordings need them.
    ///
    /// # Errors
    /// As [`Arm::simulate_with`].
    pub fn simulate_watched(
        &self,
        scenario: impl Into<Scenario>,
        options: &RunOptions,
        outputs: Option<&Outputs>,
        observer: Option<&mut SampleObserver<'_>>,
        progress: &mut Progress<'_>,
    ) -> Result<Run, Error> {
        // What things look like is asked by nobody but recordings.
        let wanted = match (outputs.is_some(), observer.is_some()) {
            (true, _) => Wanted::Curves,
            (false, true) => Wanted::Samples,
            (false, false) => Wanted::Columns,
        };
        let mut go_on = |_: &Sample| ControlFlow::Continue(());
        self.run(&scenario.into(), options, outputs, wanted, observer.unwrap_or(&mut go_on), progress)
    }

    /// A run with its columns.
    fn run(
        &self,
        scenario: &Scenario,
        options: &RunOptions,
        outputs: Option<&Outputs>,
        wanted: Wanted,
        observer: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
        progress: &mut Progress<'_>,
    ) -> Result<Run, Error> {
        let options = RunOptions { modelling: self.modelling, ..options.clone() };
        let mut columns = Columns::default();
        let mut watch = |header: &RunHeader, sample: &Sample| {
            if columns.rows() == 0 {
                columns = Columns::new(header);
            }
            columns.push(sample);
            observer(sample)
        };
        let summary = self.traced(scenario, &options, outputs, wanted, Some(&mut watch), progress)?;
        Ok(Run { summary, columns })
    }

    /// A run with all that is known of the arm; `options` with the arm's own modelling.
    fn traced<'a>(
        &'a self,
        scenario: &Scenario,
        options: &RunOptions,
        outputs: Option<&Outputs>,
        wanted: Wanted,
        observer: Option<&'a mut Observer<'a>>,
        progress: &mut Progress<'_>,
    ) -> Result<Summary, Error> {
        let together = Together {
            observer,
            prepared: Some(&self.prepared),
            wanted,
            robot_caveats: Some(self.caveats.clone()),
            ..Together::default()
        };
        run_traced(&self.robot, scenario, options, outputs, together, progress).map(|(summary, _)| summary)
    }

    /// Runs all scenarios, on all cores; each is the same to the last bit as by [`Arm::simulate`], for every number of threads.
    ///
    /// Threads are those of `rayon`'s pool. A run that fails does not stop the others.
    pub fn simulate_batch(&self, scenarios: &[Scenario], options: &RunOptions) -> Vec<Result<Run, Error>> {
        self.simulate_batch_until(scenarios, options, &|| false)
    }

    /// As [`Arm::simulate_batch`]; as soon as `stop` says so, runs that are not done end with [`Error::Interrupted`].
    pub fn simulate_batch_until(
        &self,
        scenarios: &[Scenario],
        options: &RunOptions,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Result<Run, Error>> {
        let one = |scenario| {
            let progress = &mut |_, _| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            self.simulate_watched(scenario, options, None, None, progress)
        };
        scenarios.par_iter().map(one).collect()
    }

    /// A workspace for equilibria, compliances and frequencies at any number of poses.
    ///
    /// # Errors
    /// [`Error::Step`] if a spring is not positive definite, or the arm cannot carry its weight at the middle of its joint
    /// ranges.
    pub fn operating_point(&self) -> Result<OperatingPoint, Error> {
        let flexible = self.flexible();
        let model = &flexible.model;
        // Any pose will do; this one is within the limits.
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
