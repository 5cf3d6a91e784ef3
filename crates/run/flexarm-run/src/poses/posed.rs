//! A robot held at a pose: starting point of statics, modes and frequency response.
//!
//! Start at [`Arm::posed`]. World axes at the TCP, six-vectors linear first, SI units. Not here:
//! equilibria and linearisation (`flexarm-stepping`), thousands of poses (`OperatingPoint`).

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, Pose, State, Wrench, forward_kinematics};
use flexarm_settings::Quantity;
use flexarm_stepping::{Held, Linear, OperatingPoint, Plant, StepError, linearise};
use nalgebra::{DVector, Vector6};

use crate::arm::Arm;
use crate::arm::joint_values::joint_values;
use crate::caveat::pose::ArmAtRest;
use crate::caveat::{Finding, kinds, of_use, once_each, validity};
use crate::error::Error;
use crate::motions::motion::Motion;
use crate::robot::Robot;
use crate::robot::balancer;
use crate::robot::loops;
use crate::run::monitor::strain::Strains;

/// Flexible arm with its drives locked at a pose.
pub struct Posed {
    /// Robot with its links and drives as modelled.
    pub arm: Arc<Arm>,
    /// Arm with its drives locked.
    pub plant: Plant,
    /// Frame of the TCP.
    pub tool: Frame,
    /// Actuated joints, in coordinate order.
    pub joints: Vec<String>,
    /// Whether each joint is prismatic.
    pub prismatic: Vec<bool>,
    /// Joint values (rad or m).
    pub at: Vec<f64>,
}

impl Robot {
    /// Returns the pose at which the robot is analysed by default (rad or m): the start of the
    /// motion of the robot file, or zero for a robot without one.
    ///
    /// # Errors
    /// [`Error::Model`].
    pub fn start_pose(&self) -> Result<Vec<f64>, Error> {
        let n = self.rigid_model()?.n_actuated();
        let mut q = vec![0.0; n];
        // A motion that cannot be loaded is an error of the commands that run it.
        if let Some(motion) = self.default_trajectory.as_deref().and_then(|path| Motion::load(path, self).ok()) {
            motion.trajectory.sample(0.0, &mut q, &mut vec![0.0; n], &mut vec![0.0; n]);
        }
        Ok(q)
    }
}

/// Returns the values of all actuated joints (rad or m), by default [`Robot::start_pose`].
pub(crate) fn pose_of(robot: &Robot, at: Option<&[f64]>) -> Result<Vec<f64>, Error> {
    if at.is_none() {
        return robot.start_pose();
    }
    let model = robot.rigid_model()?;
    let names: Vec<&str> = model.coordinates().iter().map(|c| c.joint.as_str()).collect();
    joint_values(at, &names)
}

/// Wraps a step error of a command that takes no steps.
pub fn step_error(source: StepError) -> Error {
    Error::Step { source, partial: false }
}

/// Checks a force (N) and moment (N m) on the TCP, six values.
///
/// # Errors
/// [`Error::Value`] for the first number that is not finite or out of range.
pub fn check_wrench(wrench: &[f64]) -> Result<(), Error> {
    let force = Quantity::FORCE.check_all("the force at the tool", wrench.iter().take(3));
    let torque = Quantity::TORQUE.check_all("the torque at the tool", wrench.iter().skip(3));
    Ok(force.and(torque)?)
}

impl Arm {
    /// Holds the arm at a pose; `at`: values of all actuated joints (rad or m),
    /// [`Robot::start_pose`] by default.
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit the arm.
    pub fn posed(self: &Arc<Self>, at: Option<&[f64]>) -> Result<Posed, Error> {
        Posed::new(self.clone(), pose_of(&self.robot, at)?)
    }

    /// As [`Arm::posed`], for equilibria alone ([`Posed::resting`]).
    pub(crate) fn resting(self: &Arc<Self>, at: Option<&[f64]>) -> Result<Posed, Error> {
        Posed::resting(self.clone(), pose_of(&self.robot, at)?)
    }

    /// Returns mass, damping and stiffness about the static equilibrium at a pose under gravity and
    /// a wrench at the TCP, and the Jacobian of the TCP with respect to the free coordinates.
    ///
    /// * `at`: values of all actuated joints (rad or m), [`Robot::start_pose`] by default.
    /// * `wrench`: force and moment at the TCP, world axes (N, N m).
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit, [`Error::Step`] if there is no
    /// equilibrium.
    pub fn linearise(self: &Arc<Self>, at: Option<&[f64]>, wrench: [f64; 6]) -> Result<Linear, Error> {
        self.posed(at)?.linear(&wrench.into())
    }

    /// Returns a workspace for equilibria, compliances and frequencies at any number of poses.
    ///
    /// # Errors
    /// [`Error::Step`] if a spring is not positive definite, or the arm has no equilibrium under
    /// gravity at the middle of its joint ranges.
    pub fn operating_point(&self) -> Result<OperatingPoint, Error> {
        let model = &self.model;
        // Any pose within the limits is suitable.
        let middle = |lower: f64, upper: f64| match (lower.is_finite(), upper.is_finite()) {
            (true, true) => 0.5 * (lower + upper),
            (true, false) => lower.max(0.0),
            (false, true) => upper.min(0.0),
            (false, false) => 0.0,
        };
        let actuated = &model.coordinates()[..model.n_actuated()];
        let pose = actuated.iter().map(|c| middle(c.limits.lower, c.limits.upper)).collect();
        let plant = self.plant(Arc::new(Held(pose))).map_err(|error| self.explained(error))?;
        Ok(OperatingPoint::new(plant, self.tcp.clone()))
    }
}

impl Posed {
    /// Holds an arm at a pose; `at` in coordinate order (rad or m). [`Arm::posed`] also accepts no
    /// values.
    pub fn new(arm: Arc<Arm>, at: Vec<f64>) -> Result<Self, Error> {
        let plant = arm.plant(Arc::new(Held(at.clone())));
        Self::of(arm, plant, at)
    }

    /// As [`Self::new`], for equilibria alone: an arm with a link between springs that has no mass
    /// has no modes.
    pub(crate) fn resting(arm: Arc<Arm>, at: Vec<f64>) -> Result<Self, Error> {
        let fixed = Arc::new(Held(at.clone()));
        let plant = match arm.plant(fixed.clone()) {
            Err(StepError::Singular { matrix, .. }) if matrix.starts_with("mass matrix") => arm.plant_at_rest(fixed),
            plant => plant,
        };
        Self::of(arm, plant, at)
    }

    /// Checks the pose, and completes the arm at it.
    fn of(arm: Arc<Arm>, plant: Result<Plant, StepError>, at: Vec<f64>) -> Result<Self, Error> {
        loops::check_pose(&arm.rigid, &mut Data::new(&arm.rigid), &DVector::from_column_slice(&at))?;
        balancer::check_pose(&arm.rigid, &mut Data::new(&arm.rigid), &DVector::from_column_slice(&at))?;
        let model = arm.model.clone();
        let actuated = &model.coordinates()[..model.n_actuated()];
        let joints: Vec<String> = actuated.iter().map(|c| c.joint.clone()).collect();
        let prismatic = actuated.iter().map(|c| c.slides()).collect();
        let plant = plant.map_err(|error| arm.explained(error))?;
        Ok(Self { tool: arm.tcp.clone(), arm, plant, joints, prismatic, at })
    }

    /// Returns the caveats about the robot and its equilibrium under a wrench on the TCP (world
    /// axes).
    pub fn caveats_of(&self, linear: &Linear, wrench: &[f64; 6]) -> Vec<Finding> {
        let mut caveats = of_use::of_model(&self.arm);
        caveats.extend(of_use::at_rest(self, linear, wrench));
        once_each(caveats)
    }

    /// Checks whether the pose is within the joint ranges, and whether anything is elastic.
    pub(crate) fn caveats(&self) -> Vec<Finding> {
        let model = &self.plant.model;
        let mut caveats: Vec<Finding> =
            validity::outside_limits(&model.coordinates()[..model.n_actuated()], &self.at).collect();
        if self.arm.springs.is_empty() {
            let message =
                "the robot has no flexible link and no elastic drive: it does not deflect and does not vibrate";
            caveats.push(Finding::warning(
                "nothing-yields",
                "robot",
                message,
                "add [[flexible_link]] or [[drive]] entries",
            ));
        }
        caveats
    }

    /// Linearises about the static equilibrium under gravity and a wrench at the TCP (N, N m; world
    /// axes).
    ///
    /// # Errors
    /// As [`check_wrench`]; [`Error::Step`] if there is no equilibrium.
    pub fn linear(&self, wrench: &Vector6<f64>) -> Result<Linear, Error> {
        let F = Wrench::new(wrench.fixed_rows::<3>(0).into(), wrench.fixed_rows::<3>(3).into());
        check_wrench(wrench.as_slice())?;
        linearise(&self.plant, &self.tool, &F, 0.0).map_err(|error| self.arm.explained(error))
    }

    /// Returns the static equilibrium under gravity and a wrench at the TCP (world axes), as used
    /// by maps.
    pub(crate) fn operating_point(&self, wrench: &[f64; 6]) -> Result<OperatingPoint, Error> {
        let [fx, fy, fz, tx, ty, tz] = *wrench;
        let mut at = OperatingPoint::new(self.plant.clone(), self.tool.clone());
        let F = Wrench::new([fx, fy, fz].into(), [tx, ty, tz].into());
        at.solve(&self.at, &F).map_err(|error| self.arm.explained(error))?;
        Ok(at)
    }

    /// Returns the TCP pose with all elastic coordinates at zero.
    pub(crate) fn rigid_tool(&self) -> Pose {
        let (mut data, state) = self.undeformed();
        forward_kinematics(&self.plant.model, &mut data, &state.q);
        data.X_WF(&self.tool)
    }

    /// Checks whether the models are valid at an equilibrium: deflections of links, torques of
    /// drives.
    pub(crate) fn validity(&self, linear: &Linear) -> Vec<Finding> {
        let links = self.arm.spans.iter().zip(strains(&self.arm, &self.plant, &linear.q));
        let links = links.flat_map(|(span, (strain, rotation))| validity::link(&span.link, rotation, strain));
        let holding = linear.holding.as_slice();
        let efforts = validity::efforts(&kinds::HOLDING, self.plant.model.coordinates(), holding);
        links.chain(efforts).chain(self.standing(linear)).collect()
    }

    /// Returns the caveats about the arm at rest.
    fn standing(&self, linear: &Linear) -> Vec<Finding> {
        let moved = linear.X_WT.translation.vector - self.rigid_tool().translation.vector;
        let elastic = &linear.q.as_slice()[self.plant.model.n_actuated()..];
        let (arm, plant) = (&self.arm, &self.plant);
        ArmAtRest { arm, plant, elastic, sag_m: moved.norm() }.caveats()
    }

    /// State with the joints at the pose and the elastic coordinates at zero.
    pub(crate) fn undeformed(&self) -> (Data, State) {
        undeformed(&self.plant)
    }
}

/// Returns the state with the joints at the start of the motion and the elastic coordinates at
/// zero.
pub(crate) fn undeformed(plant: &Plant) -> (Data, State) {
    let mut state = State::zeros(&plant.model);
    plant.prescribed_state(0.0, &mut state, &mut DVector::zeros(plant.model.nv()));
    (Data::new(&plant.model), state)
}

/// Sets the elastic coordinates of a state to their equilibrium at the start of the motion.
pub(crate) fn set_equilibrium(plant: &Plant, state: &mut State) {
    let n = plant.model.n_actuated();
    state.q.rows_mut(n, plant.model.nv() - n).copy_from(&plant.modes.equilibrium);
}

/// Returns the engineering strain of each flexible link and the rotation of its far end (rad), at
/// coordinates `q`.
pub(crate) fn strains(arm: &Arm, plant: &Plant, q: &DVector<f64>) -> Vec<(f64, f64)> {
    let (mut data, straight) = undeformed(plant);
    let mut poses = |q: &DVector<f64>| {
        forward_kinematics(&plant.model, &mut data, q);
        data.X_WB.clone()
    };
    let mut strains = Strains::new(arm, &plant.model);
    strains.update(0.0, &poses(q), &poses(&straight.q));
    strains.result().iter().map(|link| (link.strain, link.rotation)).collect()
}

/// Checks that the figures of a result are finite.
///
/// # Errors
/// [`Error::Pose`] if they are not: masses, lengths or joint values of 1e200 overflow.
pub(crate) fn all_finite<'a>(what: &str, values: impl IntoIterator<Item = &'a f64>) -> Result<(), Error> {
    match values.into_iter().all(|x| x.is_finite()) {
        true => Ok(()),
        false => Err(Error::Pose(format!(
            "{what} are not finite: a mass, a length, a stiffness, a force or a joint value is far too large or too \
             small"
        ))),
    }
}
