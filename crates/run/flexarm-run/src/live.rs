//! An arm commanded during the simulation: a controller or a learning agent supplies targets period
//! by period.
//!
//! A [`Motion`](crate::Motion) is known before a run; here only the target of the next control
//! period is known. Joints move between targets on cubics if target velocities are given. Otherwise
//! they follow the parabola through the last three targets, whose acceleration lags by one period,
//! as in any controller that receives positions only. Drives respond as in a run: prescribed joints
//! follow exactly, servos with their gains and lag.

use std::sync::{Arc, PoisonError, RwLock};

use flexarm_kinematics::{
    Data, Pose, State, Wrench, forward_kinematics, forward_kinematics_velocity, frame_twist, inverse_dynamics,
};
use flexarm_stepping::{
    FlexibleArm, Load, Observation, PrescribedMotion, Start, StepRule, Stepper, TimedWrench, new_stepper,
};
use nalgebra::{DVector, Vector3, Vector6};

use crate::arm::Arm;
use crate::error::{Error, ValueError};
use crate::flexible::FlexibleRobot;
use crate::joint_values::joint_values;
use crate::monitor::stress::StressMonitor;
use crate::options::RunOptions;
use crate::robot::tcp_frame;
use crate::run::link_side_angles;

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
}

impl Default for LiveOptions {
    fn default() -> Self {
        Self { servos: Servos::Closed, stiffness: 1.0, damping: 1.0 }
    }
}

/// State of a [`Live`], for [`Live::restore`].
pub struct LiveState {
    targets: Arc<Targets>,
    period: Period,
    push: Wrench,
    stepper: Box<dyn Stepper>,
    seen: Observation,
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
    flexible: Arc<FlexibleRobot>,
    arm: FlexibleArm,
    servos: Servos,
    options: RunOptions,
    period_s: f64,
    targets: Arc<Targets>,
    push: Arc<RwLock<Wrench>>,
    stepper: Box<dyn Stepper>,
    seen: Observation,
    /// Workspaces for the poses of the rigid and for the velocities of the flexible arm.
    rigid: (Data, State),
    moving: (Data, State),
    /// Result of [`link_side_angles`].
    link_sides: Vec<(usize, usize, f64)>,
    /// Stress of the links; only for a robot with gauges.
    stress: Option<StressMonitor>,
}

impl Arm {
    /// Returns the arm at rest at a pose, in static equilibrium under gravity, to be commanded
    /// every `period_s` (s).
    ///
    /// * `at`: values of all actuated joints (rad or m), zero by default.
    /// * `options`: stepper and step size; the period must be a whole number of steps.
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit, [`Error::Value`] for a step size or a
    /// period that is not positive or not a whole number of steps, [`Error::Step`] if there is no
    /// equilibrium, [`Error::File`] for damaged stress fields below gauges.
    pub fn live(&self, at: Option<&[f64]>, period_s: f64, options: &RunOptions) -> Result<Live, Error> {
        self.live_with(at, period_s, options, &LiveOptions::default())
    }

    /// As [`Arm::live`], with options. With open servos the first torques are those that hold the
    /// pose.
    ///
    /// # Errors
    /// As [`Arm::live`]; [`Error::Value`] for open servos if no joint is driven by torque, and for
    /// factors that are not positive.
    pub fn live_with(
        &self,
        at: Option<&[f64]>,
        period_s: f64,
        options: &RunOptions,
        own: &LiveOptions,
    ) -> Result<Live, Error> {
        let LiveOptions { servos, stiffness, damping } = *own;
        if servos == Servos::Open && !self.flexible().has_servo() {
            return Err(ValueError::NoServo.into());
        }
        if options.stepper.entry().steps == StepRule::ByErrorControl {
            return Err(ValueError::RunsAhead(options.stepper.name()).into());
        }
        let names: Vec<&str> = self.joints().collect();
        let at = joint_values(at, &names)?;
        let step_s = options.step_s;
        if !(step_s.is_finite() && step_s > 0.0) {
            return Err(ValueError::Step(step_s).into());
        }
        whole_steps(period_s, step_s)?;
        let flexible = self.flexible().clone();
        let targets = Arc::new(Targets(RwLock::new(Period::at_rest(&at, period_s))));
        let push = Arc::new(RwLock::new(Wrench::zeros()));
        let springs = flexible.scaled_springs(stiffness, damping)?;
        let arm = flexible.arm_with(springs, targets.clone()).map_err(|error| flexible.explained(error))?;
        let at_tool = {
            let push = push.clone();
            let wrench = move |_: f64| *push.read().unwrap_or_else(PoisonError::into_inner);
            Load { body: flexible.tcp.body, X_BF: flexible.tcp.X_BF, wrench: TimedWrench::new(wrench) }
        };
        let arm = arm.with_timed_loads(vec![at_tool]).map_err(|source| Error::Step { source, partial: false })?;
        let stress = match self.robot().gauges.is_empty() {
            true => None,
            false => {
                let mut robot = self.robot().clone();
                robot.flexible_links.iter_mut().for_each(|link| link.stiffness_factor *= stiffness);
                StressMonitor::new(&robot, &flexible, &arm, self.modelling())?
            }
        };
        let seen = Observation::new(&arm);
        let stepper = started(&flexible, &arm, options, servos, &targets)?;
        let mut live = Live {
            servos,
            options: options.clone(),
            period_s,
            targets,
            push,
            stepper,
            seen,
            rigid: (Data::new(&flexible.rigid), State::zeros(&flexible.rigid)),
            moving: (Data::new(&flexible.model), State::zeros(&flexible.model)),
            link_sides: link_side_angles(self.robot(), &flexible),
            stress,
            flexible,
            arm,
        };
        live.look();
        Ok(live)
    }
}

/// Returns the number of steps in a control period (s).
fn whole_steps(period_s: f64, step_s: f64) -> Result<usize, ValueError> {
    let steps = (period_s / step_s).round();
    match (1.0..1e9).contains(&steps) && (period_s / step_s - steps).abs() <= WHOLE {
        true => Ok(steps as usize),
        false => Err(ValueError::Period { period_s, step_s }),
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
    flexible: &FlexibleRobot,
    arm: &FlexibleArm,
    options: &RunOptions,
    servos: Servos,
    targets: &Targets,
) -> Result<Box<dyn Stepper>, Error> {
    let start = |arm: FlexibleArm| {
        new_stepper(options.stepper, arm, options.step_s, Start::Equilibrium).map_err(|error| flexible.explained(error))
    };
    let mut stepper = start(arm.clone())?;
    if servos == Servos::Open {
        let mut seen = Observation::new(arm);
        stepper.observe(&mut seen);
        targets.0.write().unwrap_or_else(PoisonError::into_inner).torque.copy_from_slice(seen.drive.as_slice());
        stepper = start(arm.with_servo_opened())?;
    }
    Ok(stepper)
}

impl Live {
    /// Resets the arm to rest at a pose at time 0.
    ///
    /// # Errors
    /// As [`Arm::live`].
    pub fn reset(&mut self, at: Option<&[f64]>) -> Result<(), Error> {
        let at = self.checked(at)?;
        *self.targets.0.write().unwrap_or_else(PoisonError::into_inner) = Period::at_rest(&at, self.period_s);
        *self.push.write().unwrap_or_else(PoisonError::into_inner) = Wrench::zeros();
        self.stepper = started(&self.flexible, &self.arm, &self.options, self.servos, &self.targets)?;
        self.look();
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
            return Err(ValueError::NotFinite { what: "the wrench", found }.into());
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
        self.look();
        Ok(())
    }

    /// Returns a copy of the current state.
    ///
    /// # Errors
    /// [`Error::Value`] if the stepper cannot be copied; those of [`Arm::live`] can.
    pub fn state(&self) -> Result<LiveState, Error> {
        let stepper = self.stepper.copy().ok_or(ValueError::RunsAhead(self.options.stepper.name()))?;
        Ok(LiveState {
            targets: self.targets.clone(),
            period: self.targets.0.read().unwrap_or_else(PoisonError::into_inner).clone(),
            push: *self.push.read().unwrap_or_else(PoisonError::into_inner),
            stepper,
            seen: self.seen.clone(),
        })
    }

    /// Returns to a state of this arm; what follows has the same bits as then.
    ///
    /// # Errors
    /// [`Error::Value`] for a state of another [`Live`].
    pub fn restore(&mut self, state: &LiveState) -> Result<(), Error> {
        if !Arc::ptr_eq(&self.targets, &state.targets) {
            return Err(ValueError::OtherState.into());
        }
        self.stepper = state.stepper.copy().ok_or(ValueError::RunsAhead(self.options.stepper.name()))?;
        self.targets.0.write().unwrap_or_else(PoisonError::into_inner).clone_from(&state.period);
        *self.push.write().unwrap_or_else(PoisonError::into_inner) = state.push;
        self.seen.clone_from(&state.seen);
        Ok(())
    }

    fn names(&self) -> Vec<&str> {
        let model = &self.flexible.model;
        model.coordinates()[..model.n_actuated()].iter().map(|c| c.joint.as_str()).collect()
    }

    fn checked(&self, at: Option<&[f64]>) -> Result<Vec<f64>, Error> {
        joint_values(at, &self.names())
    }

    /// Checks values; allocates only on failure.
    fn check(&self, values: &[f64]) -> Result<(), Error> {
        match values.len() == self.flexible.model.n_actuated() && values.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => self.checked(Some(values)).map(drop),
        }
    }

    fn look(&mut self) {
        self.stepper.observe(&mut self.seen);
    }

    /// Returns the time (s).
    pub fn time_s(&self) -> f64 {
        self.seen.t
    }

    /// Returns the length of a control period (s).
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Returns the actual joint positions (rad or m); under servos they lag behind their targets.
    pub fn position(&self) -> &[f64] {
        &self.seen.q.as_slice()[..self.flexible.model.n_actuated()]
    }

    /// Returns the joint velocities (rad/s or m/s).
    pub fn velocity(&self) -> &[f64] {
        &self.seen.qdot.as_slice()[..self.flexible.model.n_actuated()]
    }

    /// Returns the torques or forces of the drives (N m or N).
    pub fn effort(&self) -> &[f64] {
        self.seen.drive.as_slice()
    }

    /// Returns the joint positions at the links: with the deflections of the gearboxes (rad or m).
    pub fn link_position(&self) -> Vec<f64> {
        self.at_links(self.seen.q.as_slice())
    }

    /// Returns the joint velocities at the links (rad/s or m/s).
    pub fn link_velocity(&self) -> Vec<f64> {
        self.at_links(self.seen.qdot.as_slice())
    }

    fn at_links(&self, values: &[f64]) -> Vec<f64> {
        let mut at_links = values[..self.flexible.model.n_actuated()].to_vec();
        for &(joint, coordinate, share) in &self.link_sides {
            at_links[joint] += share * values[coordinate];
        }
        at_links
    }

    /// Returns the elastic coordinates.
    pub fn deflection(&self) -> &[f64] {
        &self.seen.q.as_slice()[self.flexible.model.n_actuated()..]
    }

    /// Returns the TCP pose in the world.
    pub fn tcp_pose(&self) -> Pose {
        let tcp = &self.flexible.tcp;
        self.seen.X_WB[tcp.body] * tcp.X_BF
    }

    /// Returns the velocity of the TCP: linear, then angular, world axes (m/s, rad/s).
    pub fn tcp_velocity(&mut self) -> Vector6<f64> {
        let (data, state) = &mut self.moving;
        state.q.copy_from(&self.seen.q);
        state.qdot.copy_from(&self.seen.qdot);
        forward_kinematics_velocity(&self.flexible.model, data, state);
        let V = frame_twist(data, &self.flexible.tcp);
        Vector6::from_iterator(V.linear.iter().chain(V.angular.iter()).copied())
    }

    /// Returns the acceleration of the TCP, world axes (m/s²); NaN with a stepper that has no
    /// accelerations.
    pub fn tcp_acceleration(&mut self) -> Vector3<f64> {
        let (model, tcp) = (&self.flexible.model, &self.flexible.tcp);
        let (data, state) = &mut self.moving;
        state.q.copy_from(&self.seen.q);
        state.qdot.copy_from(&self.seen.qdot);
        inverse_dynamics(model, data, state, &self.seen.qddot);
        // Spatial acceleration plus ω × v, without the gravity term.
        let (V, A) = (data.V[tcp.body].at_child(&tcp.X_BF), data.A[tcp.body].at_child(&tcp.X_BF));
        let R = self.seen.X_WB[tcp.body].rotation * tcp.X_BF.rotation;
        R * (A.linear + V.angular.cross(&V.linear)) + model.gravity
    }

    /// Returns the names of the channels of strain gauges and stress points, as in recordings; those
    /// on links that the arm has rigid are left out.
    pub fn gauge_channels(&self) -> Vec<String> {
        self.stress.as_ref().map_or_else(Vec::new, StressMonitor::channels)
    }

    /// Returns the values of [`Live::gauge_channels`]: strain (m/m) or stress (Pa); NaN with a
    /// stepper that has no accelerations.
    pub fn gauges(&mut self) -> Vec<f64> {
        let mut values = Vec::new();
        if let Some(stress) = &mut self.stress {
            stress.clear();
            stress.update(&self.seen);
            stress.read_gauges(&self.seen, &mut values);
        }
        values
    }

    /// Returns the TCP pose of the rigid arm with its joints at the last targets.
    pub fn target_pose(&mut self) -> Pose {
        let period = self.targets.0.read().unwrap_or_else(PoisonError::into_inner);
        let (data, state) = &mut self.rigid;
        state.q.copy_from(&DVector::from_column_slice(&period.q[1]));
        forward_kinematics(&self.flexible.rigid, data, &state.q);
        data.X_WF(&tcp_frame(&self.flexible.rigid))
    }
}
