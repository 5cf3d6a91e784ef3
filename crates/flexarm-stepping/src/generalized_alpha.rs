//! Generalised-alpha for second-order systems: implicit, second order, with chosen damping at infinity.
//!
//! ```text
//! r(t⁺, x⁺, v⁺, ẍ⁺) = 0                                        (1)  equations of motion hold at the new time
//! x⁺ = x + h v + h² [(1/2 - β) a + β a⁺]                        (2)  Newmark
//! v⁺ = v + h [(1 - γ) a + γ a⁺]                                 (3)
//! (1 - α_m) a⁺ + α_m a = (1 - α_f) ẍ⁺ + α_f ẍ                   (4)  algorithmic acceleration a
//! ```
//! with `α_m = (2ρ-1)/(ρ+1)`, `α_f = ρ/(ρ+1)`, `γ = 1/2 + α_f - α_m`, `β = (γ + 1/2)²/4`; ρ is the spectral
//! radius at infinite frequency: 1 keeps all energy, 0 kills the highest modes in one step.
//!
//! Unknown is ẍ⁺; Newton on (1) with `M + h γ' D + h² β' K`, `β' = β (1-α_f)/(1-α_m)`, γ' alike. The matrix is kept
//! until the iteration slows down.
//!
//! Source: [Chung & Hulbert 1993]; form (4) as in [Arnold & Brüls 2007].

use nalgebra::DVector;

use crate::error::StepError;
use crate::system::SecondOrderSystem;

/// Most Newton iterations in a step before it counts as failed.
const MAX_ITERATIONS: usize = 25;
/// A step that needed more iterations than this renews the matrix for the next one.
const RENEW_ABOVE: usize = 4;
/// Accepted correction over the size of the acceleration.
const TOLERANCE: f64 = 1e-9;
/// Corrections of x below this fraction of x are rounding.
const ROUNDING: f64 = 1e-14;

/// The integrator with its state; see the module page.
#[derive(Clone, Debug)]
pub struct GeneralizedAlpha {
    coefficients: Coefficients,
    h: f64,
    t0: f64,
    steps: u64,
    /// Positions at the current time.
    pub x: DVector<f64>,
    /// Velocities.
    pub v: DVector<f64>,
    /// Accelerations ẍ that fulfil the equations of motion.
    pub acceleration: DVector<f64>,
    a: DVector<f64>,
    previous: DVector<f64>,
    x_new: DVector<f64>,
    v_new: DVector<f64>,
    trial: DVector<f64>,
    r: DVector<f64>,
    factored: bool,
    /// Newton iterations so far.
    pub iterations: u64,
    /// Factorisations so far.
    pub factorisations: u64,
    /// Iterations of the last step.
    pub last_iterations: usize,
    /// Relative correction at which the last step ended.
    pub last_correction: f64,
}

#[derive(Clone, Copy, Debug)]
struct Coefficients {
    alpha_m: f64,
    alpha_f: f64,
    beta: f64,
    gamma: f64,
}

impl Coefficients {
    fn new(rho: f64) -> Self {
        let (alpha_m, alpha_f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 + alpha_f - alpha_m;
        Self { alpha_m, alpha_f, beta: 0.25 * (gamma + 0.5).powi(2), gamma }
    }
}

impl GeneralizedAlpha {
    /// Starts at `t0` with step `h` [s] and spectral radius `rho` in `[0, 1]`.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the first acceleration cannot be found.
    ///
    /// # Panics
    /// If `rho` is outside `[0, 1]` or `h` is not positive.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        rho: f64,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        assert!((0.0..=1.0).contains(&rho), "the spectral radius lies between 0 and 1");
        assert!(h > 0.0, "the step is positive");
        let n = system.dimension();
        let mut acceleration = DVector::zeros(n);
        system.acceleration(t0, &x, &v, &mut acceleration)?;
        let zeros = DVector::zeros(n);
        Ok(Self {
            coefficients: Coefficients::new(rho),
            h,
            t0,
            steps: 0,
            x_new: x.clone(),
            v_new: v.clone(),
            x,
            v,
            a: acceleration.clone(),
            previous: acceleration.clone(),
            acceleration,
            trial: zeros.clone(),
            r: zeros,
            factored: false,
            iterations: 0,
            factorisations: 0,
            last_iterations: 0,
            last_correction: 0.0,
        })
    }

    /// Current time [s].
    pub fn time(&self) -> f64 {
        self.t0 + self.steps as f64 * self.h
    }

    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Advances by one step. On error the state stays at the last good time. No allocation.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Diverged`] or [`StepError::Singular`].
    pub fn step(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        let Coefficients { alpha_m, alpha_f, beta, gamma } = self.coefficients;
        let h = self.h;
        let t = self.t0 + (self.steps + 1) as f64 * h;
        let ratio = (1.0 - alpha_f) / (1.0 - alpha_m);
        let (c_D, c_K) = (h * gamma * ratio, h * h * beta * ratio);

        // Predict ẍ⁺ by extrapolation; a⁺, x⁺, v⁺ follow from (4), (2), (3).
        for k in 0..self.x.len() {
            let guess = 2.0 * self.acceleration[k] - self.previous[k];
            let a_new = (alpha_f * self.acceleration[k] - alpha_m * self.a[k]) / (1.0 - alpha_m) + ratio * guess;
            self.trial[k] = guess;
            self.x_new[k] = self.x[k] + h * self.v[k] + h * h * ((0.5 - beta) * self.a[k] + beta * a_new);
            self.v_new[k] = self.v[k] + h * ((1.0 - gamma) * self.a[k] + gamma * a_new);
        }

        let mut iterations = 0;
        let mut last = f64::INFINITY;
        loop {
            system.residual(t, &self.x_new, &self.v_new, &self.trial, &mut self.r);
            // The matrix is renewed when it has become old, or once more when a step stalls.
            if !self.factored || (iterations == 2 * RENEW_ABOVE) {
                system.factor_iteration_matrix(t, c_D, c_K)?;
                self.factored = true;
                self.factorisations += 1;
            }
            system.solve_iteration(&mut self.r);
            iterations += 1;
            let (mut correction, mut size, mut place) = (0.0f64, 0.0f64, 0.0f64);
            for k in 0..self.r.len() {
                let d = self.r[k];
                self.trial[k] -= d;
                self.x_new[k] -= c_K * d;
                self.v_new[k] -= c_D * d;
                correction = correction.max(d.abs());
                size = size.max(self.trial[k].abs());
                place = place.max(self.x_new[k].abs());
            }
            if !correction.is_finite() || place > 1e6 {
                let what = format!("a coordinate reached {place:.1e}");
                return Err(StepError::Diverged { t, h, what });
            }
            if correction <= TOLERANCE * size || c_K * correction <= ROUNDING * place {
                break;
            }
            if iterations == MAX_ITERATIONS {
                return Err(StepError::NotConverged { t, h, iterations, correction: correction / size });
            }
            // Else the contraction seen so far tells whether the next correction would be small enough.
            let contraction = correction / last;
            last = correction;
            if iterations > 1 && contraction < 0.1 && correction * contraction <= TOLERANCE * size {
                break;
            }
        }

        for k in 0..self.x.len() {
            let a_new = ((1.0 - alpha_f) * self.trial[k] + alpha_f * self.acceleration[k] - alpha_m * self.a[k])
                / (1.0 - alpha_m);
            self.a[k] = a_new;
        }
        std::mem::swap(&mut self.x, &mut self.x_new);
        std::mem::swap(&mut self.v, &mut self.v_new);
        std::mem::swap(&mut self.previous, &mut self.acceleration);
        std::mem::swap(&mut self.acceleration, &mut self.trial);
        self.steps += 1;
        self.iterations += iterations as u64;
        self.last_iterations = iterations;
        self.last_correction = last;
        self.factored = iterations <= RENEW_ABOVE;
        Ok(())
    }
}
