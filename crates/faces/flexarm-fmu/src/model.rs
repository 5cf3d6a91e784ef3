//! An arm with named inputs and outputs, stepped by another program.
//!
//! Start at [`FmuModel`]: made, set, started, then stepped (co-simulation) or evaluated (model
//! exchange, `exchange.rs`). Values are SI numbers in the order of the variables; poses, twists and
//! wrenches are those of the TCP in world axes, linear first.
//!
//! Not here: names and units of variables (`variables.rs`), phases and C (`instance.rs`, `ffi`).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::live::{Command, Equations, Live, LiveOptions, LiveState, Readings, Servos};
use flexarm::{Arm, LoadOptions, Modelling, Pose, Robot, RobotSource, RunOptions, StepperKind, Wrench};
use nalgebra::UnitQuaternion;
use toml_edit::DocumentMut;

use crate::error::FmuError;
use crate::variables::{Causality, Kind, Meaning, Starts, StateReferences, Variable, variables};

/// Tolerance for a communication step to be a whole number of solver steps (in steps).
const WHOLE: f64 = 1e-6;
/// Tolerance between the time of the caller and that of the plant (in communication steps).
const SAME_TIME: f64 = 1e-3;
/// Minimum length of the first communication step: all later ones are solved in steps of it (in steps).
const SHORTEST: f64 = 1e-3;

/// Settings for making a plant of a robot.
#[derive(Clone, Debug, Default)]
pub struct FmuSettings {
    /// Options for loading the robot.
    pub load: LoadOptions,
    /// Models of links and drives.
    pub modelling: Modelling,
    /// Stepper; one with a fixed step size.
    pub stepper: StepperKind,
    /// Step size (s); the default of the stepper if `None`.
    pub step_s: Option<f64>,
    /// Joint positions at the start (rad or m); zero if `None`.
    pub pose: Option<Vec<f64>>,
}

/// Source of the motion of a started arm.
pub(crate) enum Running {
    /// Its own stepper, for co-simulation.
    Steps(Box<Live>),
    /// A solver outside, for model exchange.
    Equations {
        equations: Box<Equations>,
        time_s: f64,
        /// Whether state or inputs changed after the last evaluation.
        is_stale: bool,
    },
}

impl Running {
    fn readings(&mut self) -> &mut Readings {
        match self {
            Self::Steps(live) => live,
            Self::Equations { equations, .. } => equations.readings(),
        }
    }
}

/// An arm with its variables. It is made, gets parameters and inputs, is started, and then steps, or
/// is evaluated at states that a solver outside sets.
pub struct FmuModel {
    path: PathBuf,
    settings: FmuSettings,
    /// The arm as filed, shared by copies and kept when a parameter changes the robot.
    arm: Arc<Arm>,
    pub(crate) variables: Arc<[Variable]>,
    /// Value of each variable; 1 is true.
    pub(crate) values: Vec<f64>,
    pub(crate) states: StateReferences,
    pub(crate) running: Option<Running>,
    /// Parameters and inputs for which the outputs before the start are computed.
    previewed: Option<Vec<f64>>,
    /// Time of the caller at the start (s).
    pub(crate) begin_s: f64,
    steps: u64,
}

/// State of a plant that is started.
pub struct FmuState {
    /// `None` in model exchange, where the values have the state.
    live: Option<LiveState>,
    time_s: f64,
    values: Vec<f64>,
    begin_s: f64,
    steps: u64,
}

impl FmuModel {
    /// Makes a plant of a robot file or URDF.
    ///
    /// # Errors
    /// [`FmuError::Robot`] if the robot cannot be loaded or has no equilibrium at the first pose.
    pub fn new(path: &Path, settings: &FmuSettings) -> Result<Self, FmuError> {
        let filed = RobotSource::new(path, &settings.load).load()?;
        let robot = filed.robot();
        let arm = robot.model(&settings.modelling)?;
        let options = options(settings, None);
        let pose = first_pose(&arm, settings);
        let live = arm.live(Some(&pose), options.step_s, &options)?;
        // Variables depend on the arm at its first pose, and on whether it has equations of motion.
        let has_acceleration = !settings.stepper.entry().maximal;
        let equations = arm.equations(Some(&pose), &LiveOptions::default()).ok();
        let equations = equations.filter(|own| has_acceleration && !own.coordinates().is_empty());
        let elastic = equations.map(|own| own.elastic());
        let starts = Starts {
            pose: live.position(),
            step_s: options.step_s,
            payload: filed_payload(robot)?.map(|(_, mass)| mass),
            releases: live.can_release() && has_acceleration,
            holding: live.effort(),
            has_acceleration,
            gauges: &live.gauge_channels(),
            elastic: elastic.as_deref(),
        };
        // The list of variables is complete; outputs are those of the arm at rest.
        let variables: Arc<[Variable]> = variables(&arm, &starts).into();
        let values = variables.iter().map(|variable| variable.start.unwrap_or(0.0)).collect();
        let (path, settings, states) = (robot.path.clone(), settings.clone(), StateReferences::of(&variables));
        let (running, previewed) = (Some(Running::Steps(Box::new(live))), None);
        let (begin_s, steps) = (0.0, 0);
        let mut model = Self { path, settings, arm, variables, values, states, running, previewed, begin_s, steps };
        model.update();
        model.running = None;
        model.previewed = Some(model.settable());
        Ok(model)
    }

    /// Returns the variables; the position of a variable is its reference.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Returns the arm.
    pub fn arm(&self) -> &Arc<Arm> {
        &self.arm
    }

    /// Returns the reference of a variable.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|variable| variable.name == name)
    }

    /// Returns whether the plant is started.
    pub fn is_started(&self) -> bool {
        self.running.is_some()
    }

    /// Returns the time (s).
    pub fn time_s(&self) -> f64 {
        match &self.running {
            None => self.begin_s,
            Some(Running::Steps(live)) => self.begin_s + live.time_s(),
            Some(Running::Equations { time_s, .. }) => *time_s,
        }
    }

    pub(crate) fn variable(&self, reference: usize, kind: Kind) -> Result<&Variable, FmuError> {
        let variable = self
            .variables
            .get(reference)
            .ok_or_else(|| FmuError::Variable(format!("there is no variable with the reference {reference}")))?;
        if variable.kind != kind {
            let kind = match variable.kind {
                Kind::Real => "number",
                Kind::Boolean => "truth value",
            };
            return Err(FmuError::Variable(format!("{} is a {kind}", variable.name)));
        }
        Ok(variable)
    }

    /// Returns a number.
    ///
    /// # Errors
    /// [`FmuError::Variable`].
    pub fn get(&self, reference: usize) -> Result<f64, FmuError> {
        self.variable(reference, Kind::Real)?;
        Ok(self.values[reference])
    }

    /// Returns a truth value.
    ///
    /// # Errors
    /// As [`FmuModel::get`].
    pub fn get_flag(&self, reference: usize) -> Result<bool, FmuError> {
        self.variable(reference, Kind::Boolean)?;
        Ok(self.values[reference] != 0.0)
    }

    /// Sets a number: a parameter before the start, an input at any time.
    ///
    /// # Errors
    /// [`FmuError::Variable`], [`FmuError::Value`].
    pub fn set(&mut self, reference: usize, value: f64) -> Result<(), FmuError> {
        self.set_value(reference, Kind::Real, value)
    }

    /// Sets a truth value.
    ///
    /// # Errors
    /// As [`FmuModel::set`].
    pub fn set_flag(&mut self, reference: usize, value: bool) -> Result<(), FmuError> {
        self.set_value(reference, Kind::Boolean, f64::from(value))
    }

    fn set_value(&mut self, reference: usize, kind: Kind, value: f64) -> Result<(), FmuError> {
        let variable = self.variable(reference, kind)?;
        let name = &variable.name;
        match variable.causality {
            Causality::Input => {}
            Causality::Parameter if !self.is_started() => {}
            Causality::Parameter => return Err(FmuError::started(name)),
            Causality::Output | Causality::Independent | Causality::Local => {
                return Err(FmuError::not_settable(name));
            }
        }
        if !value.is_finite() {
            return Err(FmuError::not_finite(name, value));
        }
        self.values[reference] = value;
        self.make_stale();
        Ok(())
    }

    /// Returns to parameters and inputs of before the start.
    pub(crate) fn return_to(&mut self, values: &[f64]) {
        self.running = None;
        self.values.copy_from_slice(values);
    }

    /// Computes the outputs that a start would give, without starting.
    pub(crate) fn preview(&mut self, begin_s: f64) -> Result<(), FmuError> {
        if self.previewed.as_ref() == Some(&self.settable()) {
            return Ok(());
        }
        let settable = self.settable();
        self.start(begin_s)?;
        self.running = None;
        self.previewed = Some(settable);
        Ok(())
    }

    /// Returns the values of parameters and inputs.
    fn settable(&self) -> Vec<f64> {
        let both = self.values.iter().zip(self.variables.iter());
        both.filter(|(_, variable)| variable.start.is_some()).map(|(value, _)| *value).collect()
    }

    /// Starts the arm at rest at the target positions, at time `begin_s` (s) of the caller.
    ///
    /// # Errors
    /// [`FmuError::Robot`] for parameters without sense, [`FmuError::Variable`] after the start.
    pub fn start(&mut self, begin_s: f64) -> Result<(), FmuError> {
        self.check_start(begin_s)?;
        (self.begin_s, self.steps) = (begin_s, 0);
        self.running = Some(Running::Steps(Box::new(self.begun(None)?)));
        self.update();
        Ok(())
    }

    /// Checks that the arm may start at a time (s).
    pub(crate) fn check_start(&self, begin_s: f64) -> Result<(), FmuError> {
        if self.is_started() {
            return Err(FmuError::started("start"));
        }
        match begin_s.is_finite() {
            true => Ok(()),
            false => Err(FmuError::not_finite("start time", begin_s)),
        }
    }

    /// Marks the outputs of model exchange as out of date.
    pub(crate) fn make_stale(&mut self) {
        if let Some(Running::Equations { is_stale, .. }) = &mut self.running {
            *is_stale = true;
        }
    }

    /// Returns the arm at rest at the targets.
    ///
    /// * `step_s`: step size instead of that of the parameter (s).
    fn begun(&self, step_s: Option<f64>) -> Result<Live, FmuError> {
        let step_s = step_s.unwrap_or(self.parameter(Meaning::Step, 0.0));
        let options = options(&self.settings, Some(step_s));
        let pose = self.all(Meaning::TargetPosition);
        Ok(self.loaded()?.live_with(Some(&pose), step_s, &options, &self.live_options())?)
    }

    pub(crate) fn live_options(&self) -> LiveOptions {
        LiveOptions {
            servos: if self.parameter(Meaning::OpenServos, 0.0) == 0.0 { Servos::Closed } else { Servos::Open },
            stiffness: self.parameter(Meaning::StiffnessFactor, 1.0),
            damping: self.parameter(Meaning::DampingFactor, 1.0),
            payload: self.parameter(Meaning::Payload, 1.0) != 0.0,
        }
    }

    /// Returns the arm with the payload of the parameter.
    pub(crate) fn loaded(&self) -> Result<Arc<Arm>, FmuError> {
        let filed = self.variables.iter().find(|variable| variable.meaning == Meaning::PayloadMass);
        let Some(start) = filed.and_then(|variable| variable.start) else { return Ok(self.arm.clone()) };
        let mass = self.parameter(Meaning::PayloadMass, start);
        if mass == start {
            return Ok(self.arm.clone());
        }
        let Some((mut text, _)) = filed_payload(self.arm.robot())? else { return Ok(self.arm.clone()) };
        let payload = &mut text["payload"];
        payload["mass"] = toml_edit::value(mass);
        if let Some(inertia) = payload.get_mut("inertia").and_then(|inertia| inertia.as_array_mut()) {
            for moment in inertia.iter_mut() {
                let filed = moment.as_float().or_else(|| moment.as_integer().map(|whole| whole as f64));
                *moment = (filed.unwrap_or(0.0) * mass / start).into();
            }
        }
        let source = RobotSource::new(&self.path, &self.settings.load);
        let filed = RobotSource { text: Some(&text.to_string()), ..source }.load()?;
        Ok(filed.robot().model(&self.settings.modelling)?)
    }

    /// Returns the value of a parameter; `default` if the plant has none such.
    pub(crate) fn parameter(&self, meaning: Meaning, default: f64) -> f64 {
        let place = self.variables.iter().position(|variable| variable.meaning == meaning);
        place.map_or(default, |reference| self.values[reference])
    }

    /// Returns the values of an input of all joints; zero where a joint has none.
    pub(crate) fn all(&self, meaning: impl Fn(usize) -> Meaning) -> Vec<f64> {
        (0..self.arm.joints().count()).map(|k| self.parameter(meaning(k), 0.0)).collect()
    }

    /// Simulates one communication step with the inputs as they are.
    ///
    /// The first step chooses a shorter solver step if its length is no multiple of the parameter
    /// `step`.
    ///
    /// * `from_s`: time of the caller at the begin of the step (s); that of the plant, within a
    ///   thousandth of `length_s`. `length_s`: length of the step (s), positive.
    ///
    /// # Errors
    /// [`FmuError::NotStarted`]; [`FmuError::Step`] if `from_s` is not the time of the plant, and
    /// for a first step below a thousandth of the parameter `step`;
    /// [`FmuError::Robot`] for a length that is no multiple of the solver step, and for a step
    /// that fails.
    pub fn step(&mut self, from_s: f64, length_s: f64) -> Result<(), FmuError> {
        // The step must continue from where the plant is.
        let own_s = self.time_s();
        match &self.running {
            None => return Err(FmuError::NotStarted),
            Some(Running::Equations { .. }) => {
                return Err(FmuError::Order { function: "a step", phase: "in model exchange" });
            }
            Some(Running::Steps(_)) => {}
        }
        if !(length_s.is_finite() && length_s > 0.0) {
            let what = format!("the communication step is {length_s} s: expected a positive length");
            return Err(FmuError::Step(what));
        }
        let is_same = (from_s - own_s).abs() <= SAME_TIME * length_s;
        if !is_same {
            let what = format!("the communication step starts at {from_s} s, the arm is at {own_s} s");
            return Err(FmuError::Step(what));
        }
        // The first step decides on the solver's step: a whole number of them fills it.
        if self.steps == 0 {
            let step_s = self.parameter(Meaning::Step, 0.0);
            let count = length_s / step_s;
            if count < SHORTEST {
                return Err(FmuError::Step(format!(
                    "the first communication step is {length_s} s, less than a thousandth of the solver's step of \
                     {step_s} s: set the parameter step to what such steps need"
                )));
            }
            if (count - count.round()).abs() > WHOLE || count < 0.5 {
                let live = self.begun(Some(length_s / count.ceil().max(1.0)))?;
                self.running = Some(Running::Steps(Box::new(live)));
            }
        }
        // The inputs hold for the whole step; targets are those at its end.
        let (q, qdot, torque) =
            (self.all(Meaning::TargetPosition), self.all(Meaning::TargetVelocity), self.all(Meaning::Torque));
        let wrench = self.wrench();
        let with_velocity = self.parameter(Meaning::UseTargetVelocity, 0.0) != 0.0;
        let command = Command { q: &q, qdot: with_velocity.then_some(&qdot[..]), torque: Some(&torque), wrench };
        let payload = self.parameter(Meaning::Payload, 1.0) != 0.0;
        if let Some(Running::Steps(live)) = &mut self.running {
            live.set_payload(payload)?;
            live.advance(length_s, &command)?;
        }
        self.steps += 1;
        self.update();
        Ok(())
    }

    /// Returns the input wrench on the arm at the TCP, world axes (N, N m).
    pub(crate) fn wrench(&self) -> Wrench {
        let F: [f64; 6] = std::array::from_fn(|k| self.parameter(Meaning::Wrench(k), 0.0));
        let mut wrench = Wrench::zeros();
        wrench.force.copy_from_slice(&F[..3]);
        wrench.torque.copy_from_slice(&F[3..]);
        wrench
    }

    /// Returns a copy of the state of a started plant.
    ///
    /// # Errors
    /// [`FmuError::NotStarted`].
    pub fn state(&self) -> Result<FmuState, FmuError> {
        let live = match self.running.as_ref().ok_or(FmuError::NotStarted)? {
            Running::Steps(live) => Some(live.state()?),
            Running::Equations { .. } => None,
        };
        let (values, time_s) = (self.values.clone(), self.time_s());
        Ok(FmuState { live, time_s, values, begin_s: self.begin_s, steps: self.steps })
    }

    /// Returns to a state of this plant, taken since it was started.
    ///
    /// # Errors
    /// [`FmuError::NotStarted`]; [`FmuError::Robot`] for a state of another plant or of before
    /// a reset.
    pub fn restore(&mut self, state: &FmuState) -> Result<(), FmuError> {
        match (self.running.as_mut().ok_or(FmuError::NotStarted)?, &state.live) {
            (Running::Steps(live), Some(state)) => live.restore(state)?,
            (Running::Equations { time_s, is_stale, .. }, None) => (*time_s, *is_stale) = (state.time_s, true),
            _ => return Err(FmuError::Order { function: "a return to a state", phase: "of the other kind of FMU" }),
        }
        self.values.clone_from(&state.values);
        (self.begin_s, self.steps) = (state.begin_s, state.steps);
        Ok(())
    }

    /// Returns to the state in which the plant was made: not started, with all start values.
    pub fn reset(&mut self) {
        self.running = None;
        for (value, variable) in self.values.iter_mut().zip(self.variables.iter()) {
            if let Some(start) = variable.start {
                *value = start;
            }
        }
    }

    /// Computes the outputs.
    pub(crate) fn update(&mut self) {
        let time_s = self.time_s();
        let Some(live) = self.running.as_mut().map(Running::readings) else { return };
        let (link_position, link_velocity) = (live.link_position(), live.link_velocity());
        let (tcp, rigid, V) = (live.tcp_pose(), live.target_pose(), live.tcp_velocity());
        let (a, gauges) = (live.tcp_acceleration(), live.gauges());
        // Error of the TCP: translation and rotation vector from the rigid to the flexible one.
        let error = tcp.translation.vector - rigid.translation.vector;
        let turned = (tcp.rotation * rigid.rotation.inverse()).scaled_axis();
        let (own, of_rigid) = (quaternion(&tcp), quaternion(&rigid));
        for (value, variable) in self.values.iter_mut().zip(self.variables.iter()) {
            *value = match variable.meaning {
                Meaning::Time => time_s,
                Meaning::MotorPosition(k) => live.position()[k],
                Meaning::MotorVelocity(k) => live.velocity()[k],
                Meaning::MotorAcceleration(k) => live.acceleration()[k],
                Meaning::LinkPosition(k) => link_position[k],
                Meaning::LinkVelocity(k) => link_velocity[k],
                Meaning::Effort(k) => live.effort()[k],
                Meaning::TcpPosition(k) => tcp.translation.vector[k],
                Meaning::TcpQuaternion(k) => own[k],
                Meaning::TcpVelocity(k) => V[k],
                Meaning::TcpAcceleration(k) => a[k],
                Meaning::RigidPosition(k) => rigid.translation.vector[k],
                Meaning::RigidQuaternion(k) => of_rigid[k],
                Meaning::Error(k) => error[k],
                Meaning::ErrorLength => error.norm(),
                Meaning::RotationError(k) => turned[k],
                Meaning::Gauge(k) => gauges[k],
                Meaning::Deflection(k) => live.deflection()[k],
                Meaning::DeflectionVelocity(k) => live.deflection_velocity()[k],
                Meaning::DeflectionAcceleration(k) => live.deflection_acceleration()[k],
                _ => continue,
            };
        }
    }
}

/// Returns the joint positions at the start (rad or m).
pub(crate) fn first_pose(arm: &Arm, settings: &FmuSettings) -> Vec<f64> {
    settings.pose.clone().unwrap_or_else(|| vec![0.0; arm.joints().count()])
}

/// Returns w, x, y, z of the orientation, w not negative.
fn quaternion(pose: &Pose) -> [f64; 4] {
    let q = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|part| sign * part)
}

fn options(settings: &FmuSettings, step_s: Option<f64>) -> RunOptions {
    let stepper = settings.stepper;
    let step_s = step_s.or(settings.step_s).unwrap_or(stepper.entry().default_step_s);
    RunOptions { stepper, step_s, ..RunOptions::default() }
}

/// Returns the robot file and the mass of its payload (kg), if it has one with a mass.
fn filed_payload(robot: &Robot) -> Result<Option<(DocumentMut, f64)>, FmuError> {
    if robot.path.extension().is_none_or(|ending| ending != "toml") {
        return Ok(None);
    }
    let unreadable = |what: String| FmuError::File { path: robot.path.clone(), what };
    let text = std::fs::read_to_string(&robot.path).map_err(|error| unreadable(error.to_string()))?;
    let document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| unreadable(error.to_string()))?;
    let mass = document.get("payload").and_then(|payload| payload.get("mass"));
    let mass = mass.and_then(|mass| mass.as_float().or_else(|| mass.as_integer().map(|whole| whole as f64)));
    Ok(mass.filter(|mass| *mass > 0.0).map(|mass| (document, mass)))
}
