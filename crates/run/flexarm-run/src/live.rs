//! An arm commanded during the simulation: a controller or a learning agent supplies targets period
//! by period.
//!
//! A [`Motion`](crate::Motion) is known before a run; here only the target of the next control
//! period is known. Joints move between targets on cubics if target velocities are given. Otherwise
//! they follow the parabola through the last three targets, whose acceleration lags by one period,
//! as in any controller that receives positions only. Drives respond as in a run: prescribed joints
//! follow exactly, servos with their gains and lag.

use std::sync::{Arc, PoisonError, RwLock};

use flexarm_kinematics::{Data, Pose, State, Wrench, forward_kinematics};
use flexarm_stepping::{FlexibleArm, Load, Observation, PrescribedMotion, Start, Stepper, TimedWrench, new_stepper};
use nalgebra::DVector;

use crate::arm::Arm;
use crate::error::{Error, ValueError};
use crate::flexible::FlexibleRobot;
use crate::inspect::joint_values;
use crate::options::RunOptions;
use crate::robot::tcp_frame;

/// Tolerance for the control period to be a whole number of steps (in steps).
const WHOLE: f64 = 1e-6;

/// Targets at the start and the end of a control period.
#[derive(Debug)]
struct Period {
    /// Start and length of the period (s).
    begin: f64,
    length: f64,
    q: [Vec<f64>; 2],
    qdot: [Vec<f64>; 2],
    /// Second differences of the last three targets, if no velocities are given.
    bend: Option<Vec<f64>>,
    /// Targets one period before those at the start.
    earlier: Vec<f64>,
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
}

/// A running arm, commanded period by period.
pub struct Live {
    flexible: Arc<FlexibleRobot>,
    arm: FlexibleArm,
    options: RunOptions,
    period_s: f64,
    steps: usize,
    targets: Arc<Targets>,
    push: Arc<RwLock<Wrench>>,
    stepper: Box<dyn Stepper>,
    seen: Observation,
    rigid: (Data, State),
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
    /// equilibrium.
    pub fn live(&self, at: Option<&[f64]>, period_s: f64, options: &RunOptions) -> Result<Live, Error> {
        let names: Vec<&str> = self.joints().collect();
        let at = joint_values(at, &names)?;
        let step_s = options.step_s;
        if !(step_s.is_finite() && step_s > 0.0) {
            return Err(ValueError::Step(step_s).into());
        }
        let steps = (period_s / step_s).round();
        if !((1.0..1e9).contains(&steps) && (period_s / step_s - steps).abs() <= WHOLE) {
            return Err(ValueError::Period { period_s, step_s }.into());
        }
        let flexible = self.flexible().clone();
        let targets = Arc::new(Targets(RwLock::new(Period::at_rest(&at, period_s))));
        let push = Arc::new(RwLock::new(Wrench::zeros()));
        let arm = flexible.arm(targets.clone()).map_err(|error| flexible.explained(error))?;
        let at_tool = {
            let push = push.clone();
            let wrench = move |_: f64| *push.read().unwrap_or_else(PoisonError::into_inner);
            Load { body: flexible.tcp.body, X_BF: flexible.tcp.X_BF, wrench: TimedWrench::new(wrench) }
        };
        let arm = arm.with_timed_loads(vec![at_tool]).map_err(|source| Error::Step { source, partial: false })?;
        let stepper = stepper(&flexible, &arm, options)?;
        let rigid = (Data::new(&flexible.rigid), State::zeros(&flexible.rigid));
        let seen = Observation::new(&arm);
        let mut live = Live {
            flexible,
            options: options.clone(),
            period_s,
            steps: steps as usize,
            targets,
            push,
            stepper,
            seen,
            rigid,
            arm,
        };
        live.look();
        Ok(live)
    }
}

impl Period {
    fn at_rest(q: &[f64], length: f64) -> Self {
        let still = vec![0.0; q.len()];
        Self {
            begin: 0.0,
            length,
            q: [q.to_vec(), q.to_vec()],
            qdot: [still.clone(), still],
            bend: None,
            earlier: q.to_vec(),
        }
    }

    /// Starts the next period, towards targets `q` and, if given, target velocities.
    fn go_to(&mut self, begin: f64, q: &[f64], qdot: Option<&[f64]>) {
        self.begin = begin;
        self.earlier.copy_from_slice(&self.q[0]);
        self.q.swap(0, 1);
        self.qdot.swap(0, 1);
        self.q[1].copy_from_slice(q);
        match qdot {
            Some(qdot) => {
                self.qdot[1].copy_from_slice(qdot);
                self.bend = None;
            }
            None => {
                let mut bend = self.bend.take().unwrap_or_else(|| vec![0.0; q.len()]);
                for k in 0..q.len() {
                    bend[k] = q[k] - 2.0 * self.q[0][k] + self.earlier[k];
                    self.qdot[1][k] = (q[k] - self.q[0][k] + 0.5 * bend[k]) / self.length;
                }
                self.bend = Some(bend);
            }
        }
    }
}

fn stepper(flexible: &FlexibleRobot, arm: &FlexibleArm, options: &RunOptions) -> Result<Box<dyn Stepper>, Error> {
    new_stepper(options.stepper, arm.clone(), options.step_s, Start::Equilibrium)
        .map_err(|error| flexible.explained(error))
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
        self.stepper = stepper(&self.flexible, &self.arm, &self.options)?;
        self.look();
        Ok(())
    }

    /// Simulates one control period, at whose end the target of the joints is `q` (rad or m).
    ///
    /// * `qdot`: target velocities (rad/s or m/s); without them the joints follow the parabola
    ///   through the last three targets.
    /// * `wrench`: wrench on the TCP during the period, world axes (N, N m).
    ///
    /// # Errors
    /// [`Error::Pose`] for a wrong number of values and for values that are not finite,
    /// [`Error::Step`] if the step fails.
    pub fn step(&mut self, q: &[f64], qdot: Option<&[f64]>, wrench: &Wrench) -> Result<(), Error> {
        self.check(q)?;
        qdot.map_or(Ok(()), |qdot| self.check(qdot))?;
        let begin = self.stepper.time();
        self.targets.0.write().unwrap_or_else(PoisonError::into_inner).go_to(begin, q, qdot);
        *self.push.write().unwrap_or_else(PoisonError::into_inner) = *wrench;
        for _ in 0..self.steps {
            self.stepper.step().map_err(|source| Error::Step { source, partial: false })?;
        }
        self.look();
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

    /// Returns the elastic coordinates.
    pub fn deflection(&self) -> &[f64] {
        &self.seen.q.as_slice()[self.flexible.model.n_actuated()..]
    }

    /// Returns the TCP pose in the world.
    pub fn tcp_pose(&self) -> Pose {
        let tcp = &self.flexible.tcp;
        self.seen.X_WB[tcp.body] * tcp.X_BF
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
