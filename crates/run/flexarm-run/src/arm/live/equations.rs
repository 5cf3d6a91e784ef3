//! The arm as an ordinary differential equation `ẋ = f(x, u)`, for the solvers of other programs.
//!
//! The state is that of the free coordinates and of their velocities: joints driven by torque, then
//! elastic coordinates. Prescribed joints follow position, velocity and acceleration of the command.
//! Servos are sampled and are no part of a differential equation: motors get torques.

use std::sync::{Arc, PoisonError, RwLock};

use flexarm_kinematics::Wrench;
use flexarm_stepping::{EquationsOfMotion, PrescribedMotion};

use crate::arm::Arm;
use crate::arm::joint_values::joint_values;
use crate::arm::live::{Commanded, LiveOptions, Loaded, Readings};
use crate::error::Error;

/// Inputs of [`Equations`].
#[derive(Clone, Copy, Debug)]
pub struct EquationCommand<'a> {
    /// Positions of the prescribed joints, all joints (rad or m).
    pub q: &'a [f64],
    /// Their velocities (rad/s or m/s).
    pub qdot: &'a [f64],
    /// Their accelerations (rad/s² or m/s²).
    pub qddot: &'a [f64],
    /// Torques of the joints with motors, all joints, at the joint (N m or N).
    pub torque: &'a [f64],
    /// Wrench on the TCP, world axes (N, N m).
    pub wrench: Wrench,
    /// Whether the arm carries the payload of its robot file.
    pub payload: bool,
}

/// Motion of the joints as given: position, velocity, acceleration.
struct Given(RwLock<[Vec<f64>; 3]>);

impl PrescribedMotion for Given {
    fn sample(&self, _t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let given = self.0.read().unwrap_or_else(PoisonError::into_inner);
        for (to, from) in [q, qdot, qddot].into_iter().zip(given.iter()) {
            to.copy_from_slice(from);
        }
    }
}

/// Equations of motion of an arm, at a state and under a command that are set from outside.
pub struct Equations {
    arm: Arc<Arm>,
    plants: Loaded,
    given: Arc<Given>,
    push: Arc<RwLock<Wrench>>,
    equations: EquationsOfMotion,
    readings: Readings,
}

impl Arm {
    /// Returns the equations of motion, with the arm at rest at a pose in static equilibrium.
    ///
    /// * `at`: values of all actuated joints (rad or m), zero by default.
    /// * `own`: factors on stiffness and damping; servos are always open.
    ///
    /// # Errors
    /// As [`Arm::live_with`]; [`Error::Step`] for an arm with hysteresis.
    pub fn equations(self: &Arc<Self>, at: Option<&[f64]>, own: &LiveOptions) -> Result<Equations, Error> {
        let names: Vec<&str> = self.joints().collect();
        let at = joint_values(at, &names)?;
        let still = vec![0.0; at.len()];
        let given = Arc::new(Given(RwLock::new([at.clone(), still.clone(), still])));
        let Commanded { arm, plants, push, mut readings } = Commanded::new(self, own, given.clone())?;
        let plant = plants.carrying(own.payload)?.clone();
        let equations = EquationsOfMotion::at_rest(plant).map_err(|error| arm.explained(error))?;
        readings.set_targets(&at);
        let mut own = Equations { arm, plants, given, push, equations, readings };
        own.evaluate()?;
        Ok(own)
    }
}

/// An elastic coordinate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ElasticCoordinate {
    /// Name of the link or gearbox.
    pub element: String,
    /// Its number in the element, from 1 on.
    pub number: usize,
    /// Unit: "m", "rad", or "1" for a modal coordinate.
    pub unit: &'static str,
}

impl Equations {
    /// Returns the elastic coordinates; they follow the joints driven by torque.
    pub fn elastic(&self) -> Vec<ElasticCoordinate> {
        let plant = self.equations.plant();
        let all = plant.elements.iter().flat_map(|own| (1..=own.size).map(move |number| (own, number)));
        all.map(|(own, number)| {
            let unit = match (own.modal, own.size) {
                (true, _) => "1",
                (_, 6) if number <= 3 => "m",
                (_, 1) if own.slides(&plant.model) => "m",
                _ => "rad",
            };
            ElasticCoordinate { element: own.name.clone(), number, unit }
        })
        .collect()
    }

    /// Returns the free coordinates (rad, m; modal coordinates in their own units).
    pub fn coordinates(&self) -> &[f64] {
        self.equations.x()
    }

    /// Returns the accelerations of the free coordinates (per s²).
    pub fn accelerations(&self) -> &[f64] {
        self.equations.a()
    }

    /// Sets state and command, and computes accelerations and readings.
    ///
    /// * `x`, `v`: free coordinates and their velocities.
    ///
    /// # Errors
    /// [`Error::Pose`] for a wrong number of joint values and for values that are not finite,
    /// [`Error::Value`] for a state or a wrench that is not finite, or without a payload that can be
    /// put down, [`Error::Step`] if there are no finite accelerations.
    ///
    /// # Panics
    /// If `x` or `v` has another length than [`Equations::coordinates`].
    pub fn set(&mut self, x: &[f64], v: &[f64], command: &EquationCommand<'_>) -> Result<(), Error> {
        let EquationCommand { q, qdot, qddot, torque, wrench, payload } = command;
        let plant = self.plants.carrying(*payload)?;
        let model = &self.arm.model;
        let names: Vec<&str> = model.coordinates()[..model.n_actuated()].iter().map(|c| c.joint.as_str()).collect();
        // Check the command and the state before anything changes.
        for values in [q, qdot, qddot, torque] {
            joint_values(Some(values), &names)?;
        }
        let of_wrench = wrench.force.iter().chain(wrench.torque.iter());
        for (what, mut values) in [
            ("the wrench", of_wrench.copied().collect::<Vec<_>>().into_iter()),
            ("the state", [x, v].concat().into_iter()),
        ] {
            if let Some(found) = values.find(|value| !value.is_finite()) {
                return Err(Error::not_finite(what, found));
            }
        }
        // Hand the command to the motion, the load, the plant and the drives.
        {
            let mut given = self.given.0.write().unwrap_or_else(PoisonError::into_inner);
            given.iter_mut().zip([q, qdot, qddot]).for_each(|(to, from)| to.copy_from_slice(from));
        }
        *self.push.write().unwrap_or_else(PoisonError::into_inner) = *wrench;
        self.equations.change_masses(plant);
        let driven: Vec<f64> = self.equations.plant().torque_driven.iter().map(|&k| torque[k]).collect();
        self.equations.set_torques(&driven);
        self.equations.set_state(x, v);
        self.readings.set_targets(q);
        self.evaluate()
    }

    fn evaluate(&mut self) -> Result<(), Error> {
        self.equations.evaluate().map_err(|source| Error::Step { source, partial: false })?;
        self.equations.observe(&mut self.readings.observed);
        Ok(())
    }

    /// Returns the readings; their time is 0.
    pub fn readings(&mut self) -> &mut Readings {
        &mut self.readings
    }
}
