//! Scenario of a run: motion of the joints, loads, and payloads that the arm picks up and
//! puts down, how it starts.
//!
//! A scenario is a value and knows no arm: the same one is run with many, and one arm, which does
//! not change, takes many. A file of loads fills the same values that a program makes, so that both
//! are checked and act in one way ([`Scenario::acting_on`]). Not here: how a run is stepped and
//! recorded ([`crate::RunOptions`]).

use std::path::{Path, PathBuf};

use flexarm_kinematics::Model;
use flexarm_stepping::{InertiaChange, Load, Start};

use crate::applied_load::AppliedLoad;
use crate::caveat::size::Size;
use crate::caveat::{Caveat, chain, loads, parts};
use crate::error::Error;
use crate::loads_file::read_loads;
use crate::motion::Motion;
use crate::payload::PayloadChange;
use crate::robot::Robot;

/// Motion, loads, changes of payload and start of a run.
///
/// A value that knows no arm: the same scenario is run with many arms, and an arm takes many. A
/// file of loads fills the same values as a program.
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
/// let run = robot.flexible(Modelling::default())?.simulate(&scenario, &RunOptions::default())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Motion of the joints; it gives the duration of the run.
    pub motion: Motion,
    /// External loads.
    pub loads: Vec<AppliedLoad>,
    /// Changes of the payload, in any order.
    pub payloads: Vec<PayloadChange>,
    /// Whether the springs carry the weight at the start.
    pub start: Start,
    /// File of loads and payloads, for recordings.
    pub loads_file: Option<PathBuf>,
}

impl Scenario {
    /// A motion and nothing else, from the equilibrium.
    pub fn new(motion: Motion) -> Self {
        Self { motion, loads: Vec::new(), payloads: Vec::new(), start: Start::default(), loads_file: None }
    }

    /// The same with the loads and payloads of a file besides; `docs/loads.md` describes it.
    ///
    /// What has no end in the file ends with the motion. Whether its frames and links are there
    /// shows on a robot.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read, [`Error::RobotFile`] with line and column for what is
    /// not the format, and for numbers and expressions that make no load.
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

    /// The same from another start.
    #[must_use]
    pub fn with_start(self, start: Start) -> Self {
        Self { start, ..self }
    }

    /// When the run ends (s).
    pub fn duration_s(&self) -> f64 {
        self.motion.trajectory.duration()
    }

    /// Loads on a model of the robot.
    ///
    /// # Errors
    /// [`Error::Load`], or [`Error::RobotFile`] with the place if the value was read from a file: a
    /// load on a frame, or a payload on a link, that the model does not move; a payload whose link
    /// bends, without a mass or with an inertia that no body has; payloads on two bodies.
    pub fn acting_on(&self, robot: &Robot, model: &Model) -> Result<Disturbances, Error> {
        let duration = self.duration_s();
        let mut acting = Disturbances::default();
        for load in &self.loads {
            acting.loads.push(load.on(model, duration)?);
            acting.caveats.extend(load.doubts.iter().cloned());
            // A table, samples or an impulse; other loads may go on for as long as they like.
            if load.wrench.jumps.len() > 2 {
                let last = load.wrench.jumps.iter().fold(0.0, |last: f64, t| last.max(*t));
                acting.caveats.extend(loads::of_end(last, duration));
            }
            if let Some(start) = load.start_s.filter(|start| *start >= duration) {
                let text = format!("a load starts at {start} s, the run ends at {duration} s: it does nothing");
                acting.caveats.push(Caveat::said("no-effect", "loads", text, "move it into the run"));
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
                acting.caveats.push(Caveat::said("no-effect", "loads", text, "move it into the run"));
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
    /// As [`Scenario::new`]; the curves of the motion are shared, not copied.
    fn from(motion: &Motion) -> Self {
        Self::new(motion.clone())
    }
}

impl From<&Self> for Scenario {
    /// A copy; the curves of motion and loads are shared.
    fn from(scenario: &Self) -> Self {
        scenario.clone()
    }
}

/// Loads and changes of payload, on the bodies of a model.
#[derive(Clone, Debug, Default)]
pub struct Disturbances {
    /// Loads.
    pub loads: Vec<Load>,
    /// Changes of what bodies carry, by time.
    pub changes: Vec<InertiaChange>,
    /// Adds caveats about loads without effect and about unlikely payloads.
    pub caveats: Vec<Caveat>,
}
