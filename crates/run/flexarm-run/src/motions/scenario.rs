//! Scenario of a run: joint motion, loads, changes of payload, and start condition.
//!
//! A scenario is a value independent of any arm: it can be run with many arms, and an arm, which
//! does not change, runs many scenarios. A loads file fills the same values as a program, so both
//! are checked and act in the same way ([`Scenario::acting_on`]). Not here: stepping and recording
//! of a run ([`crate::RunOptions`]).

use std::path::{Path, PathBuf};

use flexarm_kinematics::Model;
use flexarm_stepping::{InertiaChange, Load, Start};

use crate::caveat::size::Size;
use crate::caveat::{Finding, chain, loads, parts};
use crate::error::Error;
use crate::motions::applied_load::AppliedLoad;
use crate::motions::loads_file::read_loads;
use crate::motions::motion::Motion;
use crate::motions::payload::PayloadChange;
use crate::robot::Robot;

/// Motion, loads, changes of payload and start of a run.
///
/// A value independent of any arm: the same scenario is run with many arms, and an arm runs many
/// scenarios. A loads file fills the same values as a program.
///
/// ```no_run
/// use flexarm_kinematics::Wrench;
/// use flexarm_run::{AppliedLoad, Modelling, Motion, PayloadChange, Robot, RunOptions, Scenario};
///
/// let robot = Robot::load("robots/kr210")?;
/// let motion = Motion::load("trajectories/pick_and_place.toml", &robot)?;
/// let push = Wrench::new([0.0, 0.0, -200.0].into(), [0.0; 3].into());
/// let scenario = Scenario::new(motion)
///     .with_load(AppliedLoad::during("tcp", push, 1.0, 1.5)) // 200 N down for half a second
///     .with_payload(PayloadChange::attach(2.0, 80.0, [0.0, 0.0, 0.2].into()))
///     .with_payload(PayloadChange::release(6.0));
/// let run = robot.model(&Modelling::default())?.simulate(&scenario, &RunOptions::default())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Motion of the joints; its duration is that of the run.
    pub motion: Motion,
    /// External loads.
    pub loads: Vec<AppliedLoad>,
    /// Changes of payload, in any order.
    pub payloads: Vec<PayloadChange>,
    /// Whether the springs carry the weight at the start.
    pub start: Start,
    /// File from which loads and payloads were read, for recordings.
    pub loads_file: Option<PathBuf>,
}

impl Scenario {
    /// Returns a scenario with a motion only, starting from the equilibrium.
    pub fn new(motion: Motion) -> Self {
        Self { motion, loads: Vec::new(), payloads: Vec::new(), start: Start::default(), loads_file: None }
    }

    /// Adds the loads and payloads of a file; `docs/loads.md` describes the format.
    ///
    /// Loads without an end in the file end with the motion. Frames and links are checked later, on
    /// a robot.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read, [`Error::RobotFile`] with line and column for
    /// format errors and for invalid numbers and expressions.
    pub fn with_loads_file(mut self, path: impl AsRef<Path>) -> Result<Self, Error> {
        let (loads, payloads) = read_loads(path.as_ref(), self.duration_s())?;
        self.loads.extend(loads);
        self.payloads.extend(payloads);
        self.loads_file = Some(path.as_ref().to_owned());
        Ok(self)
    }

    /// Adds a load.
    #[must_use]
    pub fn with_load(mut self, load: AppliedLoad) -> Self {
        self.loads.push(load);
        self
    }

    /// Adds a change of payload.
    #[must_use]
    pub fn with_payload(mut self, change: PayloadChange) -> Self {
        self.payloads.push(change);
        self
    }

    /// Replaces the start condition.
    #[must_use]
    pub fn with_start(self, start: Start) -> Self {
        Self { start, ..self }
    }

    /// Returns the duration of the run (s).
    pub fn duration_s(&self) -> f64 {
        self.motion.trajectory.duration()
    }

    /// Returns the loads and payload changes on a model of the robot.
    ///
    /// # Errors
    /// [`Error::Load`], or [`Error::RobotFile`] with the location if the value was read from a
    /// file: a load on a frame, or a payload on a link, that the model does not move; a payload on
    /// a flexible link, without a mass or with an unphysical inertia; payloads on two bodies.
    pub fn acting_on(&self, robot: &Robot, model: &Model) -> Result<Disturbances, Error> {
        let duration = self.duration_s();
        let mut acting = Disturbances::default();
        for load in &self.loads {
            acting.loads.push(load.on(model, duration)?);
            acting.caveats.extend(load.findings.iter().cloned());
            // Tables, samples and impulses have a definite end; other loads may continue.
            if load.wrench.jumps.len() > 2 {
                let last = load.wrench.jumps.iter().fold(0.0, |last: f64, t| last.max(*t));
                acting.caveats.extend(loads::of_end(last, duration));
            }
            if let Some(start) = load.start_s.filter(|start| *start >= duration) {
                let text = format!("a load starts at {start} s, the run ends at {duration} s: it does nothing");
                acting.caveats.push(Finding::warning("no-effect", "loads", text, "move it into the run"));
            }
        }
        let size = Size::of(&robot.urdf.mechanism);
        let weighs = robot.rigid.gravity.norm() > 0.0;
        let mut payloads: Vec<&PayloadChange> = self.payloads.iter().collect();
        payloads.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        for payload in payloads {
            let change = payload.on(robot, model, &acting.changes)?;
            acting.changes.push(change);
            let at = payload.at_s;
            let what = format!("the payload from {at} s on");
            acting.caveats.extend(parts::payload(&what, &payload.carried, &size, weighs));
            if let Some(link) = payload.link.as_ref().filter(|_| payload.carried.mass > 0.0) {
                acting.caveats.extend(chain::of_payload(robot, &size, &what, link));
            }
            if at > duration {
                let text = format!("the payload changes at {at} s, the run ends at {duration} s: it stays as it is");
                acting.caveats.push(Finding::warning("no-effect", "loads", text, "move it into the run"));
            }
        }
        Ok(acting)
    }
}

impl From<Motion> for Scenario {
    /// As [`Scenario::new`].
    fn from(motion: Motion) -> Self {
        Self::new(motion)
    }
}

impl From<&Motion> for Scenario {
    /// As [`Scenario::new`]; the trajectory of the motion is shared, not copied.
    fn from(motion: &Motion) -> Self {
        Self::new(motion.clone())
    }
}

impl From<&Self> for Scenario {
    /// Returns a copy; the trajectory and the loads are shared.
    fn from(scenario: &Self) -> Self {
        scenario.clone()
    }
}

/// Loads and changes of payload, on the bodies of a model.
#[derive(Clone, Debug, Default)]
pub struct Disturbances {
    /// Loads.
    pub loads: Vec<Load>,
    /// Changes of payload on bodies, by time.
    pub changes: Vec<InertiaChange>,
    /// Caveats about values without effect, and about payloads that are implausibly heavy or far
    /// away.
    pub caveats: Vec<Finding>,
}
