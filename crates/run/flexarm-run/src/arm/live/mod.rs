//! An arm commanded during the simulation: a controller or a learning agent supplies targets period
//! by period.
//!
//! A [`Motion`](crate::Motion) is known before a run; here only the target of the next control
//! period is known. Joints move between targets on cubics if target velocities are given. Otherwise
//! they follow the parabola through the last three targets, whose acceleration lags by one period,
//! as in any controller that receives positions only. Drives respond as in a run: prescribed joints
//! follow exactly, servos with their gains and lag.
//!
//! Not here: equations of motion for integrators of others (`equations.rs`), sensors
//! (`readings.rs`).

mod equations;
mod readings;

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, PoisonError, RwLock};

use flexarm_kinematics::Wrench;
use flexarm_settings::Setting;
use flexarm_stepping::{
    Load, Observation, Plant, PrescribedMotion, Start, StepRule, Stepper, TimedWrench, new_stepper,
};

use crate::arm::Arm;
use crate::arm::options::RunOptions;
use crate::error::Error;
use crate::motions::payload::PayloadChange;
use crate::poses::posed::pose_of;
use crate::robot::PAYLOAD_LINK;

pub use equations::{ElasticCoordinate, EquationCommand, Equations};
pub use readings::Readings;

/// Tolerance for the control period to be a whole number of steps (in steps).
const WHOLE: f64 = 1e-6;

/// Command for one control period.
#[derive(Clone, Copy, Debug, Default)]
pub struct Command<'a> {
    /// Targets of the joints at the end of the period, all joints (rad or m).
    pub q: &'a [f64],
    /// Target velocities there (rad/s or m/s). Without them the joints follow the parabola through
    /// the last three targets.
    pub qdot: Option<&'a [f64]>,
    /// Torques that are added to those of the servos, all joints, at the joint (N m or N). Zero if
    /// left out.
    pub torque: Option<&'a [f64]>,
    /// Wrench on the TCP, world axes (N, N m).
    pub wrench: Wrench,
}

/// Whether servos close their loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Servos {
    /// Servos follow the targets.
    #[default]
    Closed,
    /// Servos have no gains and no feed-forward: motors get the torques of the commands alone.
    Open,
}

/// Options of a live arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiveOptions {
    /// Whether servos close their loops.
    pub servos: Servos,
    /// Factor on all stiffnesses, as in [`Variation`](crate::Variation).
    pub stiffness: f64,
    /// Factor on all damping, as in [`Variation`](crate::Variation).
    pub damping: f64,
    /// Whether the arm carries the payload of its robot file at the start.
    pub payload: bool,
}

impl Default for LiveOptions {
    fn default() -> Self {
        Self { servos: Servos::Closed, stiffness: 1.0, damping: 1.0, payload: true }
    }
}

/// State of a [`Live`], for [`Live::restore`].
pub struct LiveState {
    targets: Arc<Targets>,
    period: Period,
    push: Wrench,
    has_payload: bool,
    stepper: Box<dyn Stepper>,
    observed: Observation,
}

/// Targets at the start and the end of a control period.
#[derive(Clone, Debug)]
struct Period {
    /// Start and length of the period (s).
    begin: f64,
    length: f64,
    q: [Vec<f64>; 2],
    qdot: [Vec<f64>; 2],
    /// Second derivatives of the parabola times the squared length, if no velocities are given.
    bend: Option<Vec<f64>>,
    /// Targets at the start of the period before, and its length (s).
    earlier: Vec<f64>,
    earlier_length: f64,
    /// Torques added to those of the servos (N m or N).
    torque: Vec<f64>,
}

/// Motion between the targets.
struct Targets(RwLock<Period>);

impl PrescribedMotion for Targets {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let period = self.0.read().unwrap_or_else(PoisonError::into_inner);
        let (h, s) = (period.length, (t - period.begin) / period.length);
        if let Some(bend) = &period.bend {
            for k in 0..q.len() {
                let (start, rise) = (period.q[0][k], period.q[1][k] - period.q[0][k]);
                q[k] = start + s * rise + 0.5 * s * (s - 1.0) * bend[k];
                qdot[k] = (rise + (s - 0.5) * bend[k]) / h;
                qddot[k] = bend[k] / (h * h);
            }
            return;
        }
        // Cubic Hermite polynomials on 0..1.
        for k in 0..q.len() {
            let (q0, q1, v0, v1) = (period.q[0][k], period.q[1][k], period.qdot[0][k], period.qdot[1][k]);
            let (rise, a, b) = (q1 - q0, h * v0, h * v1);
            let (c2, c3) = (3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise);
            q[k] = q0 + s * (a + s * (c2 + s * c3));
            qdot[k] = (a + s * (2.0 * c2 + s * 3.0 * c3)) / h;
            qddot[k] = (2.0 * c2 + s * 6.0 * c3) / (h * h);
        }
    }

    fn added_torque(&self, _t: f64, coordinate: usize) -> f64 {
        self.0.read().unwrap_or_else(PoisonError::into_inner).torque[coordinate]
    }
}

/// A running arm, commanded period by period.
pub struct Live {
    arm: Arc<Arm>,
    plants: Loaded,
    has_payload: bool,
    servos: Servos,
    options: RunOptions,
    period_s: f64,
    targets: Arc<Targets>,
    push: Arc<RwLock<Wrench>>,
    stepper: Box<dyn Stepper>,
    readings: Readings,
}

/// A live arm is read as its [`Readings`].
impl Deref for Live {
    type Target = Readings;

    fn deref(&self) -> &Readings {
        &self.readings
    }
}

impl DerefMut for Live {
    fn deref_mut(&mut self) -> &mut Readings {
        &mut self.readings
    }
}

impl Arm {
    /// Returns the arm at rest at a pose, in static equilibrium under gravity, to be commanded
    /// every `period_s` (s).
    ///
    /// * `at`: values of all actuated joints (rad or m), [`Robot::start_pose`](crate::Robot::start_pose) by default.
    /// * `options`: stepper and step size; the period must be a whole number of steps.
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit, [`Error::Value`] for a step size or a
    /// period that is not positive or not a whole number of steps, [`Error::Step`] if there is no
    /// equilibrium, [`Error::File`] for damaged stress fields below gauges.
    pub fn live(self: &Arc<Self>, at: Option<&[f64]>, period_s: f64, options: &RunOptions) -> Result<Live, Error> {
        self.live_with(at, period_s, options, &LiveOptions::default())
    }

    /// As [`Arm::live`], with options. With open servos the first torques are those that hold the
    /// pose.
    ///
    /// # Errors
    /// As [`Arm::live`]; [`Error::Value`] for open servos if no joint is driven by torque, and for
    /// factors that are not positive.
    pub fn live_with(
        self: &Arc<Self>,
        at: Option<&[f64]>,
        period_s: f64,
        options: &RunOptions,
        own: &LiveOptions,
    ) -> Result<Live, Error> {
        // Options that fit: open servos need motors, the period a whole number of fixed steps.
        let servos = own.servos;
        if servos == Servos::Open && !self.has_servo() {
            return Err(Error::Value(
                "open servos need joints that are driven by torque: model the drives as servos".into(),
            ));
        }
        if options.stepper.entry().steps == StepRule::ByErrorControl {
            return Err(runs_ahead(options.stepper.name()));
        }
        let at = pose_of(self.robot(), at)?;
        let step_s = options.step_s;
        if !(step_s.is_finite() && step_s > 0.0) {
            return Err(Error::Value(format!(
                "{setting}: the step must be positive, found {step_s} s",
                setting = Setting::Step
            )));
        }
        whole_steps(period_s, step_s)?;

        // The arm at rest at its targets, and its first readings.
        let targets = Arc::new(Targets(RwLock::new(Period::at_rest(&at, period_s))));
        let Commanded { arm, plants, push, readings } = Commanded::new(self, own, targets.clone())?;
        let (has_payload, options) = (own.payload, options.clone());
        let stepper = started(&arm, plants.carrying(has_payload)?, &options, servos, &targets)?;
        let mut live = Live { arm, plants, has_payload, servos, options, period_s, targets, push, stepper, readings };
        live.observe();
        Ok(live)
    }
}

/// An arm that follows a motion under a wrench on its TCP, both set from outside.
struct Commanded {
    arm: Arc<Arm>,
    plants: Loaded,
    /// Wrench on the TCP, world axes.
    push: Arc<RwLock<Wrench>>,
    readings: Readings,
}

impl Commanded {
    fn new(of: &Arc<Arm>, own: &LiveOptions, motion: Arc<dyn PrescribedMotion>) -> Result<Self, Error> {
        let arm = of.clone();
        let push = Arc::new(RwLock::new(Wrench::zeros()));
        let springs = arm.scaled_springs(own.stiffness, own.damping)?;
        let plant = arm.plant_with(springs, motion).map_err(|error| arm.explained(error))?;
        let at_tool = {
            let push = push.clone();
            let wrench = move |_: f64| *push.read().unwrap_or_else(PoisonError::into_inner);
            Load { body: arm.tcp.body, X_BF: arm.tcp.X_BF, wrench: TimedWrench::new(wrench) }
        };
        let plant = plant.with_timed_loads(vec![at_tool]).map_err(|source| Error::Step { source, partial: false })?;
        let readings = Readings::new(of, &plant, own.stiffness)?;
        let plants = Loaded::new(of, plant);
        Ok(Self { arm, plants, push, readings })
    }
}

/// An arm with and without the payload of its robot file.
struct Loaded {
    with: Arc<Plant>,
    /// `None` if there is no payload that can be put down.
    without: Option<Arc<Plant>>,
}

impl Loaded {
    fn new(of: &Arm, plant: Plant) -> Self {
        // A payload on a flexible link cannot be put down, nor one without which a part of the arm
        // has no mass.
        let release = match of.robot().rigid.link(PAYLOAD_LINK).is_some() {
            true => PayloadChange::release(0.0).on(of.robot(), &of.model, &[]).ok(),
            false => None,
        };
        let without = release.and_then(|change| plant.clone().with_inertia_changes(vec![change]).ok());
        Self { with: Arc::new(plant), without: without.map(Arc::new) }
    }

    fn carrying(&self, payload: bool) -> Result<&Arc<Plant>, Error> {
        if payload {
            return Ok(&self.with);
        }
        let message = "this arm has no payload that can be put down: give its robot file a [payload] on a rigid link";
        self.without.as_ref().ok_or_else(|| Error::Value(message.into()))
    }
}

/// Error for a stepper that controls its step size.
fn runs_ahead(name: &str) -> Error {
    Error::Value(format!("the stepper {name} runs ahead of the commands; use one with a fixed step size"))
}

/// Returns the number of steps in a control period (s).
fn whole_steps(period_s: f64, step_s: f64) -> Result<usize, Error> {
    let steps = (period_s / step_s).round();
    match (1.0..1e9).contains(&steps) && (period_s / step_s - steps).abs() <= WHOLE {
        true => Ok(steps as usize),
        false => Err(Error::Value(format!(
            "a control period of {period_s} s is not a whole number of steps ({} {step_s} s)",
            Setting::Step
        ))),
    }
}

impl Period {
    fn at_rest(q: &[f64], length: f64) -> Self {
        let still = vec![0.0; q.len()];
        Self {
            begin: 0.0,
            length,
            q: [q.to_vec(), q.to_vec()],
            qdot: [still.clone(), still.clone()],
            bend: None,
            earlier: q.to_vec(),
            earlier_length: length,
            torque: still,
        }
    }

    /// Starts the next period, of this length (s). Returns whether the added torques jump.
    fn go_to(&mut self, begin: f64, length: f64, command: &Command<'_>) -> bool {
        self.begin = begin;
        self.earlier.copy_from_slice(&self.q[0]);
        (self.earlier_length, self.length) = (self.length, length);
        self.q.swap(0, 1);
        self.qdot.swap(0, 1);
        self.q[1].copy_from_slice(command.q);
        let mut jumps = false;
        for (k, own) in self.torque.iter_mut().enumerate() {
            let torque = command.torque.map_or(0.0, |torque| torque[k]);
            jumps |= *own != torque;
            *own = torque;
        }
        if let Some(qdot) = command.qdot {
            self.qdot[1].copy_from_slice(qdot);
            self.bend = None;
            return jumps;
        }
        let mut bend = self.bend.take().unwrap_or_else(|| vec![0.0; command.q.len()]);
        // Second divided difference of three targets; ratio and share are 1 for equal periods.
        let (ratio, share) = (length / self.earlier_length, 2.0 * length / (length + self.earlier_length));
        for (k, bend) in bend.iter_mut().enumerate() {
            let rise = command.q[k] - self.q[0][k];
            *bend = share * (rise - ratio * (self.q[0][k] - self.earlier[k]));
            self.qdot[1][k] = (rise + 0.5 * *bend) / length;
        }
        self.bend = Some(bend);
        jumps
    }
}

/// Returns the stepper of the arm at rest at the targets.
fn started(
    arm: &Arm,
    plant: &Arc<Plant>,
    options: &RunOptions,
    servos: Servos,
    targets: &Targets,
) -> Result<Box<dyn Stepper>, Error> {
    let start = |plant: Plant| {
        new_stepper(options.stepper, plant, options.step_s, Start::Equilibrium).map_err(|error| arm.explained(error))
    };
    let mut stepper = start(Plant::clone(plant))?;
    if servos == Servos::Open {
        let mut observed = Observation::new(plant);
        stepper.observe(&mut observed);
        targets.0.write().unwrap_or_else(PoisonError::into_inner).torque.copy_from_slice(observed.drive.as_slice());
        stepper = start(plant.with_servo_opened())?;
    }
    Ok(stepper)
}

impl Live {
    /// Resets the arm to rest at a pose at time 0, with or without its payload as it is.
    ///
    /// * `at`: as of [`Arm::live`].
    ///
    /// # Errors
    /// As [`Arm::live`].
    pub fn reset(&mut self, at: Option<&[f64]>) -> Result<(), Error> {
        let at = self.checked(at)?;
        *self.targets.0.write().unwrap_or_else(PoisonError::into_inner) = Period::at_rest(&at, self.period_s);
        *self.push.write().unwrap_or_else(PoisonError::into_inner) = Wrench::zeros();
        let plant = self.plants.carrying(self.has_payload)?;
        self.stepper = started(&self.arm, plant, &self.options, self.servos, &self.targets)?;
        self.observe();
        Ok(())
    }

    /// Simulates one control period.
    ///
    /// # Errors
    /// [`Error::Pose`] for a wrong number of values and for values that are not finite,
    /// [`Error::Value`] for a wrench that is not finite, [`Error::Step`] if the step fails.
    pub fn step(&mut self, command: &Command<'_>) -> Result<(), Error> {
        self.advance(self.period_s, command)
    }

    /// As [`Live::step`], with a control period of another length (s), a whole number of steps.
    ///
    /// # Errors
    /// As [`Live::step`]; [`Error::Value`] for a length that is not a whole number of steps.
    pub fn advance(&mut self, length_s: f64, command: &Command<'_>) -> Result<(), Error> {
        let steps = whole_steps(length_s, self.options.step_s)?;
        self.check(command.q)?;
        for values in [command.qdot, command.torque].into_iter().flatten() {
            self.check(values)?;
        }
        let F = &command.wrench;
        if let Some(&found) = F.force.iter().chain(F.torque.iter()).find(|value| !value.is_finite()) {
            return Err(Error::not_finite("the wrench", found));
        }
        let begin = self.stepper.time();
        let jumps = {
            let mut period = self.targets.0.write().unwrap_or_else(PoisonError::into_inner);
            let mut push = self.push.write().unwrap_or_else(PoisonError::into_inner);
            let pulls = *push != command.wrench;
            *push = command.wrench;
            period.go_to(begin, length_s, command) || pulls
        };
        if jumps {
            self.stepper.restart().map_err(|source| Error::Step { source, partial: false })?;
        }
        for _ in 0..steps {
            self.stepper.step().map_err(|source| Error::Step { source, partial: false })?;
        }
        self.observe();
        Ok(())
    }

    /// Picks up or puts down the payload of the robot file; positions and velocities stay.
    ///
    /// # Errors
    /// [`Error::Value`] if there is no payload that can be put down; [`Error::Step`] with a stepper
    /// in maximal coordinates.
    pub fn set_payload(&mut self, carried: bool) -> Result<(), Error> {
        let plant = self.plants.carrying(carried)?;
        if carried != self.has_payload {
            self.stepper.change_masses(plant).map_err(|source| Error::Step { source, partial: false })?;
            self.has_payload = carried;
            self.observe();
        }
        Ok(())
    }

    /// Returns whether there is a payload that can be put down.
    pub fn can_release(&self) -> bool {
        self.plants.without.is_some()
    }

    /// Returns a copy of the current state.
    ///
    /// # Errors
    /// [`Error::Value`] if the stepper cannot be copied; those of [`Arm::live`] can.
    pub fn state(&self) -> Result<LiveState, Error> {
        let stepper = self.stepper.copy().ok_or_else(|| runs_ahead(self.options.stepper.name()))?;
        Ok(LiveState {
            targets: self.targets.clone(),
            period: self.targets.0.read().unwrap_or_else(PoisonError::into_inner).clone(),
            push: *self.push.read().unwrap_or_else(PoisonError::into_inner),
            has_payload: self.has_payload,
            stepper,
            observed: self.readings.observed.clone(),
        })
    }

    /// Returns to a state of this arm; what follows has the same bits as then.
    ///
    /// # Errors
    /// [`Error::Value`] for a state of another [`Live`].
    pub fn restore(&mut self, state: &LiveState) -> Result<(), Error> {
        if !Arc::ptr_eq(&self.targets, &state.targets) {
            return Err(Error::Value(
                "the state belongs to another arm; a state returns only to the arm from which it was taken".into(),
            ));
        }
        self.stepper = state.stepper.copy().ok_or_else(|| runs_ahead(self.options.stepper.name()))?;
        self.targets.0.write().unwrap_or_else(PoisonError::into_inner).clone_from(&state.period);
        *self.push.write().unwrap_or_else(PoisonError::into_inner) = state.push;
        self.has_payload = state.has_payload;
        self.readings.observed.clone_from(&state.observed);
        self.readings.set_targets(&state.period.q[1]);
        Ok(())
    }

    fn checked(&self, at: Option<&[f64]>) -> Result<Vec<f64>, Error> {
        pose_of(self.arm.robot(), at)
    }

    /// Checks values; allocates only on failure.
    fn check(&self, values: &[f64]) -> Result<(), Error> {
        match values.len() == self.arm.model.n_actuated() && values.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => self.checked(Some(values)).map(drop),
        }
    }

    fn observe(&mut self) {
        self.stepper.observe(&mut self.readings.observed);
        let period = self.targets.0.read().unwrap_or_else(PoisonError::into_inner);
        self.readings.set_targets(&period.q[1]);
    }

    /// Returns the length of a control period (s).
    pub fn period_s(&self) -> f64 {
        self.period_s
    }
}
