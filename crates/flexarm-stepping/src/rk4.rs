//! The classical explicit Runge-Kutta method of fourth order, for systems that are not stiff.
//!
//! Stable while `h ω < 2.78` for every undamped mode; stiffness-proportional damping narrows this further.
//! Source: [Hairer, Nørsett & Wanner 1993], section II.1.

use nalgebra::DVector;

use crate::error::StepError;
use crate::system::SecondOrderSystem;

/// Bound of `h ω` on the imaginary axis.
pub const STABILITY_LIMIT: f64 = 2.78;

/// The integrator with its state.
#[derive(Clone, Debug)]
pub struct Rk4 {
    h: f64,
    t0: f64,
    t: f64,
    steps: u64,
    /// Positions at the current time.
    pub x: DVector<f64>,
    /// Velocities.
    pub v: DVector<f64>,
    /// Accelerations at the current time.
    pub acceleration: DVector<f64>,
    x_stage: DVector<f64>,
    v_stage: DVector<f64>,
    a_stage: DVector<f64>,
    dx: DVector<f64>,
    dv: DVector<f64>,
}

impl Rk4 {
    /// Starts at `t0` with step `h` (s).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the first acceleration cannot be found.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        let zeros = DVector::zeros(system.dimension());
        let mut acceleration = zeros.clone();
        system.acceleration(t0, &x, &v, &mut acceleration)?;
        Ok(Self {
            h,
            t0,
            t: t0,
            steps: 0,
            x,
            v,
            acceleration,
            x_stage: zeros.clone(),
            v_stage: zeros.clone(),
            a_stage: zeros.clone(),
            dx: zeros.clone(),
            dv: zeros,
        })
    }

    /// Step (s).
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// Current time (s).
    pub fn time(&self) -> f64 {
        self.t
    }

    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Next multiple of the step (s).
    pub fn next_time(&self) -> f64 {
        self.t0 + (self.steps + 1) as f64 * self.h
    }

    /// Takes the acceleration anew: to be called when a force has jumped.
    ///
    /// # Errors
    /// [`StepError::Singular`] if it cannot be found.
    pub fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        system.acceleration(self.t, &self.x, &self.v, &mut self.acceleration)
    }

    /// Advances to the next multiple of the step. On error the state stays at the last good time. No allocation.
    ///
    /// # Errors
    /// [`StepError::Diverged`] or [`StepError::Singular`].
    pub fn step(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.advance_to(system, self.next_time())
    }

    /// Advances to `t_new`, which lies after the current time and not beyond the next multiple of the step.
    ///
    /// # Errors
    /// As [`Rk4::step`].
    pub fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t_new: f64) -> Result<(), StepError> {
        let (t, h) = (self.t, t_new - self.t);
        // Stage 1 is the acceleration kept from the end of the last step.
        self.dx.copy_from(&self.v);
        self.dv.copy_from(&self.acceleration);
        self.v_stage.copy_from(&self.v);
        self.a_stage.copy_from(&self.acceleration);
        for (fraction, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for k in 0..self.x.len() {
                self.x_stage[k] = self.x[k] + fraction * h * self.v_stage[k];
                self.v_stage[k] = self.v[k] + fraction * h * self.a_stage[k];
            }
            system.acceleration(t + fraction * h, &self.x_stage, &self.v_stage, &mut self.a_stage)?;
            self.dx.axpy(weight, &self.v_stage, 1.0);
            self.dv.axpy(weight, &self.a_stage, 1.0);
        }
        let mut largest = 0.0f64;
        for k in 0..self.x.len() {
            self.x_stage[k] = self.x[k] + h / 6.0 * self.dx[k];
            self.v_stage[k] = self.v[k] + h / 6.0 * self.dv[k];
            largest = largest.max(self.x_stage[k].abs());
            if !self.x_stage[k].is_finite() {
                largest = f64::INFINITY;
            }
        }
        if largest > 1e6 {
            let what = format!("a coordinate reached {largest:.1e}");
            return Err(StepError::Diverged { t: t_new, h, what });
        }
        system.acceleration(t_new, &self.x_stage, &self.v_stage, &mut self.a_stage)?;
        std::mem::swap(&mut self.x, &mut self.x_stage);
        std::mem::swap(&mut self.v, &mut self.v_stage);
        std::mem::swap(&mut self.acceleration, &mut self.a_stage);
        self.steps += u64::from(t_new == self.next_time());
        self.t = t_new;
        Ok(())
    }
}
