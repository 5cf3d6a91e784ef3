//! Equations of motion of an arm as an ordinary differential equation, for solvers of other
//! programs.
//!
//! ```text
//! M_ff ẍ = τ + Jᵀ F - h_f(q, q̇, [q̈_p, 0]) - K x - D ẋ - friction(ẋ)
//! ```
//! for the free coordinates x: joints driven by torque, then elastic coordinates. Start at
//! [`EquationsOfMotion::at_rest`]. Not here: integration, controllers, hysteresis.

use std::sync::Arc;

use nalgebra::DVector;

use crate::dense::largest_of_numbers;
use crate::error::StepError;
use crate::integrator::check_deflection;
use crate::observation::{Observation, observe_reduced};
use crate::plant::Plant;
use crate::reduced::ReducedArm;
use crate::statics::static_equilibrium;
use crate::system::SecondOrderSystem;

/// An arm at a state that its user sets. The motion of prescribed joints and the loads are those of
/// the arm at time 0.
#[derive(Clone)]
pub struct EquationsOfMotion {
    system: ReducedArm,
    x: DVector<f64>,
    v: DVector<f64>,
    a: DVector<f64>,
}

impl EquationsOfMotion {
    /// Returns the arm at rest in static equilibrium; the drives hold it.
    ///
    /// # Errors
    /// [`StepError::NoEquations`] for an arm with hysteresis; [`StepError::NoEquilibrium`] and
    /// [`StepError::OpenLoop`] as for a stepper.
    pub fn at_rest(plant: impl Into<Arc<Plant>>) -> Result<Self, StepError> {
        let plant = plant.into();
        if plant.has_hysteresis() {
            return Err(StepError::NoEquations);
        }
        let e = static_equilibrium(&plant, 0.0)?;
        let mut system = ReducedArm::new(plant);
        let (x, v) = system.start(&e)?;
        system.check_loops(&x, &v)?;
        let a = DVector::zeros(x.len());
        system.evaluate(0.0, &x, &v, &a);
        let holding: Vec<f64> = system.plant.torque_driven.iter().map(|&k| system.data.tau[k]).collect();
        let mut own = Self { system, x, v, a };
        own.set_torques(&holding);
        Ok(own)
    }

    /// Returns the arm.
    pub fn plant(&self) -> &Plant {
        &self.system.plant
    }

    /// Returns the free coordinates (rad, m; modal coordinates in their own units).
    pub fn x(&self) -> &[f64] {
        self.x.as_slice()
    }

    /// Returns the accelerations of the free coordinates at the last [`EquationsOfMotion::evaluate`].
    pub fn a(&self) -> &[f64] {
        self.a.as_slice()
    }

    /// Sets coordinates (rad, m) and velocities (rad/s, m/s).
    ///
    /// # Panics
    /// If a slice has another length than [`EquationsOfMotion::x`].
    pub fn set_state(&mut self, x: &[f64], v: &[f64]) {
        for (what, found) in [("x", x.len()), ("v", v.len())] {
            let expected = self.x.len();
            assert!(found == expected, "{what} has {found} entries, the arm has {expected} free coordinates");
        }
        self.x.copy_from_slice(x);
        self.v.copy_from_slice(v);
    }

    /// Sets the torques of the joints in [`Plant::torque_driven`] (N m or N), up to the limits
    /// of their drives.
    ///
    /// # Panics
    /// If there is not one torque per such joint.
    pub fn set_torques(&mut self, torques: &[f64]) {
        let Some(servo) = &mut self.system.servo else { return };
        assert_eq!(torques.len(), servo.torque.len(), "one torque per torque-driven joint");
        for ((own, torque), axis) in servo.torque.iter_mut().zip(torques).zip(&servo.servo.axes) {
            *own = torque.clamp(-axis.limit, axis.limit);
        }
    }

    /// Replaces masses and damping by those of an arm that is the same otherwise.
    pub fn change_masses(&mut self, plant: &Arc<Plant>) {
        self.system.plant = plant.clone();
    }

    /// Computes the accelerations.
    ///
    /// # Errors
    /// [`StepError::OpenLoop`] where a loop does not close, [`StepError::OutOfRange`] for
    /// deflections of metres and for accelerations that are not finite, [`StepError::Singular`] if
    /// the mass matrix cannot be factorised.
    pub fn evaluate(&mut self) -> Result<(), StepError> {
        if check_deflection(&self.system.plant, &self.x, 0.0, 0.0).is_err() {
            return Err(StepError::OutOfRange);
        }
        // The motion may have changed since the last call.
        self.system.sampled_at = f64::NAN;
        let computed = self.system.acceleration(0.0, &self.x, &self.v, &mut self.a);
        if let Err(error) = computed {
            return Err(StepError::dead_point(&self.system.plant.model, &self.system.data, 0.0).unwrap_or(error));
        }
        match largest_of_numbers(self.a.as_slice()).is_finite() {
            true => Ok(()),
            false => Err(StepError::OutOfRange),
        }
    }

    /// Writes the state into `out`.
    pub fn observe(&mut self, out: &mut Observation) {
        self.system.sampled_at = f64::NAN;
        observe_reduced(&mut self.system, 0.0, &self.x, &self.v, &self.a, out);
    }
}
