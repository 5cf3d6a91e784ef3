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
//!
//! **Dispersion correction.** No A-stable linear multistep method has a smaller frequency error than the trapezoidal
//! rule's `(hω)²/12` (Dahlquist's second barrier), and in a ringing arm the phase drifts by just that. With the
//! correction on, (4) is fed not with ẍ but with
//!
//! ```text
//! x̃ = ẍ - c h² d²ẍ/dt² ≈ (1 + c h² M^-1 K) ẍ,     c = β - Δ/2 + [α_f(1-α_f) - α_m(1-α_m)]/2 - Δ²/2 - 1/12,   Δ = α_f - α_m     (5)
//! ```
//! which cancels the second-order term of the frequency error of free vibration: the second derivative of the
//! acceleration is taken from the stiffness, not from past steps, so that stability stays unconditional
//! (a mode ω meets the scheme as `ω² (1 + c (hω)²)`, still positive). At rest ẍ = 0 and nothing changes. What is left out
//! of (5) is the second derivative of the load, slow against the modes, and that of the damping force, 2ζ of the rest.
//! The price: where rho is far below 1, the scheme damps modes of `hω` near 1 about twice as much as without.
//!
//! **Events.** The scheme remembers accelerations a and x̃, which a jump makes wrong: after [`GeneralizedAlpha::restart`]
//! they are taken anew from the equations of motion, after [`GeneralizedAlpha::renew`] the matrix as well. A step may end
//! anywhere before the next multiple of h ([`GeneralizedAlpha::advance_to`]). A step whose iteration fails is tried again
//! with a matrix of its start, then in halves, down to `h/64`; after that the multiples of h go on.

use nalgebra::DVector;

use crate::error::StepError;
use crate::system::SecondOrderSystem;

/// Most Newton iterations in a step before it counts as failed.
const MAX_ITERATIONS: usize = 25;
/// A step that fails is halved so many times before the run is given up.
const MOST_HALVINGS: u32 = 6;
/// A step that needed more iterations than this renews the matrix for the next one.
const RENEW_ABOVE: usize = 4;
/// Accepted correction over the size of the acceleration.
const TOLERANCE: f64 = 1e-9;
/// Corrections of x below this fraction of x are rounding.
const ROUNDING: f64 = 1e-14;

/// Parameters of the scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaSettings {
    /// Spectral radius at infinite frequency, 0 to 1.
    pub rho: f64,
    /// Cancel the leading frequency error; see the module page.
    pub dispersion_correction: bool,
}

impl Default for AlphaSettings {
    fn default() -> Self {
        Self { rho: 0.9, dispersion_correction: true }
    }
}

/// The integrator with its state; see the module page.
#[derive(Clone, Debug)]
pub struct GeneralizedAlpha {
    coefficients: Coefficients,
    /// c of (5); 0 without the correction.
    dispersion: f64,
    /// `c h²`.
    c_h2: f64,
    /// x̃ at the current time and at the new one.
    x_tilde: DVector<f64>,
    x_tilde_new: DVector<f64>,
    stiff: DVector<f64>,
    h: f64,
    t0: f64,
    t: f64,
    steps: u64,
    /// Step to which `c_h2`, matrix and memory belong (s).
    dt: f64,
    /// Whether a and x̃ are to be taken anew.
    fresh: bool,
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
    /// `c` of (5).
    fn dispersion(&self) -> f64 {
        let Self { alpha_m, alpha_f, beta, .. } = *self;
        let shift = alpha_f - alpha_m;
        let filter = 0.5 * (alpha_f * (1.0 - alpha_f) - alpha_m * (1.0 - alpha_m));
        beta - 0.5 * shift + filter - 0.5 * shift * shift - 1.0 / 12.0
    }

    fn new(rho: f64) -> Self {
        let (alpha_m, alpha_f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 + alpha_f - alpha_m;
        Self { alpha_m, alpha_f, beta: 0.25 * (gamma + 0.5).powi(2), gamma }
    }
}

impl GeneralizedAlpha {
    /// Starts at `t0` with step `h` (s).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the first acceleration cannot be found.
    ///
    /// # Panics
    /// If the spectral radius is outside `[0, 1]` or `h` is not positive.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        settings: AlphaSettings,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        let AlphaSettings { rho, dispersion_correction } = settings;
        assert!((0.0..=1.0).contains(&rho), "the spectral radius lies between 0 and 1");
        assert!(h > 0.0, "the step is positive");
        let n = system.dimension();
        let mut acceleration = DVector::zeros(n);
        system.acceleration(t0, &x, &v, &mut acceleration)?;
        let zeros = DVector::zeros(n);
        let coefficients = Coefficients::new(rho);
        let dispersion = if dispersion_correction { coefficients.dispersion() } else { 0.0 };
        Ok(Self {
            coefficients,
            dispersion,
            c_h2: dispersion * h * h,
            x_tilde: acceleration.clone(),
            x_tilde_new: zeros.clone(),
            stiff: zeros.clone(),
            h,
            t0,
            t: t0,
            steps: 0,
            dt: h,
            fresh: true,
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

    /// Step (s).
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// Current time (s).
    pub fn time(&self) -> f64 {
        self.t
    }

    /// Next multiple of the step (s).
    pub fn next_time(&self) -> f64 {
        self.t0 + (self.steps + 1) as f64 * self.h
    }

    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Starts anew from the current state: to be called when a force or a velocity has jumped.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the acceleration cannot be found.
    pub fn restart(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        system.acceleration(self.t, &self.x, &self.v, &mut self.acceleration)?;
        self.fresh = true;
        Ok(())
    }

    /// As [`GeneralizedAlpha::restart`], when masses, stiffness or damping have changed: the matrix too is out of date.
    ///
    /// # Errors
    /// As [`GeneralizedAlpha::restart`].
    pub fn renew(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.factored = false;
        self.restart(system)
    }

    /// Advances to the next multiple of the step. On error the state stays at the last good time. No allocation.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Diverged`] or [`StepError::Singular`].
    pub fn step(&mut self, system: &mut impl SecondOrderSystem) -> Result<(), StepError> {
        self.advance_to(system, self.next_time())
    }

    /// Advances to t, which lies after the current time and not beyond the next multiple of the step.
    ///
    /// # Errors
    /// As [`GeneralizedAlpha::step`].
    pub fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError> {
        let whole = t == self.next_time();
        // Whole steps are all the same, so that their matrix lasts.
        let from_grid = self.t == self.t0 + self.steps as f64 * self.h;
        let dt = if whole && from_grid { self.h } else { t - self.t };
        self.last_iterations = 0;
        self.cross(system, t, dt, MOST_HALVINGS)?;
        self.steps += u64::from(whole);
        Ok(())
    }

    /// From the current time to t: in one step, else in two halves.
    fn cross(&mut self, system: &mut impl SecondOrderSystem, t: f64, dt: f64, halvings: u32) -> Result<(), StepError> {
        if dt != self.dt {
            (self.dt, self.c_h2) = (dt, self.dispersion * dt * dt);
            (self.factored, self.fresh) = (false, true);
        }
        let kept = self.factored;
        let mut result = self.attempt(system, t);
        if result.is_err() && kept {
            (self.factored, self.fresh) = (false, true);
            result = self.attempt(system, t);
        }
        let Err(error) = result else { return Ok(()) };
        (self.factored, self.fresh) = (false, true);
        if halvings == 0 {
            return Err(error);
        }
        self.cross(system, t - 0.5 * dt, 0.5 * dt, halvings - 1)?;
        self.cross(system, t, 0.5 * dt, halvings - 1)
    }

    /// One step of length `dt` to t; on error nothing but the matrix has changed.
    fn attempt(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError> {
        let Coefficients { alpha_m, alpha_f, beta, gamma } = self.coefficients;
        let h = self.dt;
        let ratio = (1.0 - alpha_f) / (1.0 - alpha_m);
        let (c_D, c_K) = (h * gamma * ratio, h * h * beta * ratio);

        if !self.factored {
            // The matrix belongs to the configuration of the last residual.
            system.residual(self.t, &self.x, &self.v, &self.acceleration, &mut self.r);
            self.factor(system, t, c_D, c_K)?;
        }
        if self.fresh {
            self.remember();
        }
        // Predict ẍ⁺ by extrapolation.
        for k in 0..self.x.len() {
            self.trial[k] = 2.0 * self.acceleration[k] - self.previous[k];
        }
        self.place(system);

        let mut iterations = 0;
        let mut last = f64::INFINITY;
        loop {
            system.residual(t, &self.x_new, &self.v_new, &self.trial, &mut self.r);
            // A step that stalls gets a fresh matrix.
            if iterations == 2 * RENEW_ABOVE {
                self.factor(system, t, c_D, c_K)?;
                self.place(system);
                system.residual(t, &self.x_new, &self.v_new, &self.trial, &mut self.r);
            }
            system.solve_iteration(&mut self.r);
            if self.c_h2 > 0.0 {
                system.inverse_mass_times_stiffness(&self.r, &mut self.stiff);
            }
            iterations += 1;
            let (mut correction, mut size, mut place) = (0.0f64, 0.0f64, 0.0f64);
            for k in 0..self.r.len() {
                let d = self.r[k];
                let d_tilde = d + self.c_h2 * self.stiff[k];
                self.trial[k] -= d;
                self.x_tilde_new[k] -= d_tilde;
                self.x_new[k] -= c_K * d_tilde;
                self.v_new[k] -= c_D * d_tilde;
                // `max` passes over NaN.
                correction = if d.is_finite() { correction.max(d.abs()) } else { f64::INFINITY };
                size = size.max(self.trial[k].abs());
                place = place.max(self.x_new[k].abs());
            }
            if !correction.is_finite() || place > 1e6 {
                let place = if correction.is_finite() { place } else { f64::INFINITY };
                let what = format!("a coordinate reached {place:.1e}");
                return Err(StepError::Diverged { t, h, what });
            }
            self.last_correction = if size > 0.0 { correction / size } else { 0.0 };
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
            self.a[k] = ((1.0 - alpha_f) * self.x_tilde_new[k] + alpha_f * self.x_tilde[k] - alpha_m * self.a[k])
                / (1.0 - alpha_m);
        }
        std::mem::swap(&mut self.x, &mut self.x_new);
        std::mem::swap(&mut self.v, &mut self.v_new);
        std::mem::swap(&mut self.x_tilde, &mut self.x_tilde_new);
        std::mem::swap(&mut self.previous, &mut self.acceleration);
        std::mem::swap(&mut self.acceleration, &mut self.trial);
        self.t = t;
        self.iterations += iterations as u64;
        self.last_iterations += iterations;
        self.factored = iterations <= RENEW_ABOVE;
        Ok(())
    }

    fn factor(&mut self, system: &mut impl SecondOrderSystem, t: f64, c_D: f64, c_K: f64) -> Result<(), StepError> {
        system.factor_iteration_matrix(t, c_D, c_K, self.c_h2)?;
        self.factored = true;
        self.factorisations += 1;
        Ok(())
    }

    /// a and x̃ of the current acceleration alone. With the correction in x̃, a jump would set modes of `hω >> 1` ringing
    /// from one step to the next.
    fn remember(&mut self) {
        self.a.copy_from(&self.acceleration);
        self.previous.copy_from(&self.acceleration);
        self.x_tilde.copy_from(&self.acceleration);
        self.fresh = false;
    }

    /// x̃⁺, a⁺, x⁺, v⁺ of the trial ẍ⁺ by (5), (4), (2), (3).
    fn place(&mut self, system: &mut impl SecondOrderSystem) {
        let Coefficients { alpha_m, alpha_f, beta, gamma } = self.coefficients;
        let (h, ratio) = (self.dt, (1.0 - alpha_f) / (1.0 - alpha_m));
        self.x_tilde_new.as_mut_slice().copy_from_slice(self.trial.as_slice());
        if self.c_h2 > 0.0 {
            system.inverse_mass_times_stiffness(&self.trial, &mut self.stiff);
            self.x_tilde_new.axpy(self.c_h2, &self.stiff, 1.0);
        }
        for k in 0..self.x.len() {
            let a_new =
                (alpha_f * self.x_tilde[k] - alpha_m * self.a[k]) / (1.0 - alpha_m) + ratio * self.x_tilde_new[k];
            self.x_new[k] = self.x[k] + h * self.v[k] + h * h * ((0.5 - beta) * self.a[k] + beta * a_new);
            self.v_new[k] = self.v[k] + h * ((1.0 - gamma) * self.a[k] + gamma * a_new);
        }
    }
}
