//! Model exchange: the plant as a differential equation, at states that a solver outside sets.
//!
//! ```text
//! x = (q, q̇),   ẋ = (q̇, q̈(x, u))        u: motion of prescribed joints, torques, wrench
//! ```
//! `q` are the coordinates of driven joints and the elastic ones. Outputs are computed when they are
//! read and state or inputs have changed. Not here: co-simulation (`model.rs`).

use flexarm::live::EquationCommand;

use crate::error::FmuError;
use crate::model::{FmuModel, Running};
use crate::variables::{Causality, Kind, Meaning};

/// Central difference of fourth order: steps and weights.
const DIFFERENCE: [(f64, f64); 4] = [(-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)];

impl FmuModel {
    /// Returns whether the arm is a differential equation in its coordinates.
    pub fn has_equations(&self) -> bool {
        !self.states.states.is_empty()
    }

    /// Returns the references of the continuous states: coordinates, then their velocities. Empty
    /// for an arm without equations of motion.
    pub fn state_references(&self) -> &[usize] {
        &self.states.states
    }

    /// Returns the references of the derivatives of the continuous states, in their order.
    pub fn derivative_references(&self) -> &[usize] {
        &self.states.derivatives
    }

    /// Starts as [`FmuModel::start`], for a solver outside. Servos are open: their joints get only
    /// the inputs `torque`.
    ///
    /// # Errors
    /// As [`FmuModel::start`]; [`FmuError::NoEquations`] for an arm without equations of motion.
    pub fn start_equations(&mut self, begin_s: f64) -> Result<(), FmuError> {
        if !self.has_equations() {
            return Err(FmuError::NoEquations);
        }
        self.check_start(begin_s)?;
        let pose = self.all(Meaning::TargetPosition);
        let equations = Box::new(self.loaded()?.equations(Some(&pose), &self.live_options())?);
        self.begin_s = begin_s;
        self.running = Some(Running::Equations { equations, time_s: begin_s, is_stale: true });
        self.update();
        Ok(())
    }

    /// Sets the time (s).
    ///
    /// # Errors
    /// [`FmuError::Value`]; [`FmuError::NotStarted`] before [`FmuModel::start_equations`].
    pub fn set_time(&mut self, to_s: f64) -> Result<(), FmuError> {
        let Some(Running::Equations { time_s, is_stale, .. }) = &mut self.running else {
            return Err(FmuError::NotStarted);
        };
        if !to_s.is_finite() {
            return Err(FmuError::not_finite("time", to_s));
        }
        (*time_s, *is_stale) = (to_s, true);
        Ok(())
    }

    /// Returns the continuous states.
    pub fn states(&self) -> Vec<f64> {
        self.states.states.iter().map(|&reference| self.values[reference]).collect()
    }

    /// Sets the continuous states, in the order of [`FmuModel::state_references`].
    ///
    /// # Errors
    /// [`FmuError::Length`], [`FmuError::Value`]; [`FmuError::NotStarted`] before [`FmuModel::start_equations`].
    pub fn set_states(&mut self, states: &[f64]) -> Result<(), FmuError> {
        if !matches!(self.running, Some(Running::Equations { .. })) {
            return Err(FmuError::NotStarted);
        }
        FmuError::check_length("continuous states", states.len(), self.states.states.len())?;
        for (&reference, &found) in self.states.states.iter().zip(states) {
            if !found.is_finite() {
                return Err(FmuError::not_finite(&self.variables[reference].name, found));
            }
        }
        for (&reference, &value) in self.states.states.iter().zip(states) {
            self.values[reference] = value;
        }
        self.make_stale();
        Ok(())
    }

    /// Computes the derivatives of the continuous states, in their order (unit of the state per s).
    ///
    /// # Errors
    /// As [`FmuModel::evaluate`].
    pub fn derivatives(&mut self) -> Result<Vec<f64>, FmuError> {
        self.evaluate()?;
        Ok(self.states.derivatives.iter().map(|&reference| self.values[reference]).collect())
    }

    /// Returns the nominal values of the continuous states.
    pub fn nominals(&self) -> Vec<f64> {
        self.states.states.iter().map(|&reference| self.variables[reference].nominal()).collect()
    }

    /// Computes outputs and derivatives if state or inputs changed; nothing in co-simulation.
    ///
    /// # Errors
    /// [`FmuError::Robot`] for a state without finite accelerations.
    pub fn evaluate(&mut self) -> Result<(), FmuError> {
        if !matches!(self.running, Some(Running::Equations { is_stale: true, .. })) {
            return Ok(());
        }
        let command = [Meaning::TargetPosition, Meaning::TargetVelocity, Meaning::TargetAcceleration, Meaning::Torque];
        let [q, qdot, qddot, torque] = command.map(|meaning| self.all(meaning));
        let (states, wrench) = (self.states(), self.wrench());
        let payload = self.parameter(Meaning::Payload, 1.0) != 0.0;
        let (x, v) = states.split_at(states.len() / 2);
        if let Some(Running::Equations { equations, is_stale, .. }) = &mut self.running {
            let command = EquationCommand { q: &q, qdot: &qdot, qddot: &qddot, torque: &torque, wrench, payload };
            equations.set(x, v, &command)?;
            *is_stale = false;
        }
        self.update();
        Ok(())
    }

    /// Computes the derivative of `unknowns` (outputs, derivatives of states) in a direction of
    /// `knowns` (inputs, states), by central differences of fourth order:
    ///
    /// ```text
    /// y' = Σ_k s_k [y(u - 2h) - 8 y(u - h) + 8 y(u + h) - y(u + 2h)] / 12h
    /// ```
    ///
    /// * `seed`: `s`, one number for each of the knowns.
    ///
    /// Returns one number for each of the unknowns. Costs four evaluations for each known whose
    /// seed is not zero. State and inputs are those of before.
    ///
    /// # Errors
    /// [`FmuError::Length`]; [`FmuError::Variable`], also for a known that is neither input nor
    /// state; as [`FmuModel::evaluate`].
    pub fn directional_derivative(
        &mut self,
        unknowns: &[usize],
        knowns: &[usize],
        seed: &[f64],
    ) -> Result<Vec<f64>, FmuError> {
        if !matches!(self.running, Some(Running::Equations { .. })) {
            return Err(FmuError::NotStarted);
        }
        FmuError::check_length("seed", seed.len(), knowns.len())?;
        unknowns.iter().try_for_each(|&reference| self.get(reference).map(drop))?;
        for &reference in knowns {
            let known = self.variable(reference, Kind::Real)?;
            if known.causality != Causality::Input && !self.states.states.contains(&reference) {
                return Err(FmuError::not_settable(&known.name));
            }
        }
        // The plant is evaluated beside its state, which is put back whatever happens.
        let values = self.values.clone();
        let mut slopes = vec![0.0; unknowns.len()];
        let mut differences = || {
            for (&known, &seed) in knowns.iter().zip(seed).filter(|(_, seed)| **seed != 0.0) {
                let h = self.variables[known].difference_step();
                for (steps, weight) in DIFFERENCE {
                    self.values.copy_from_slice(&values);
                    self.values[known] += steps * h;
                    self.make_stale();
                    self.evaluate()?;
                    for (slope, &unknown) in slopes.iter_mut().zip(unknowns) {
                        *slope += seed * weight / h * self.values[unknown];
                    }
                }
            }
            Ok(())
        };
        let done = differences();
        self.values = values;
        self.make_stale();
        done.map(|()| slopes)
    }
}
