//! Generalised-alpha for second-order systems: implicit, second order, with adjustable
//! high-frequency damping.
//!
//! ```text
//! r(t⁺, x⁺, v⁺, ẍ⁺) = 0                           (1)  equations of motion at the new time
//! x⁺ = x + h v + h² [(1/2 - β) a + β a⁺]          (2)  Newmark
//! v⁺ = v + h [(1 - γ) a + γ a⁺]                   (3)
//! (1 - α_m) a⁺ + α_m a = (1 - α_f) ẍ⁺ + α_f ẍ    (4)  algorithmic acceleration a
//! ```
//! with `α_m = (2ρ-1)/(ρ+1)`, `α_f = ρ/(ρ+1)`, `γ = 1/2 + α_f - α_m`, `β = (γ + 1/2)²/4`; ρ is the
//! spectral radius at infinite frequency: 1 conserves all energy, 0 annihilates the highest modes
//! in one step.
//!
//! The unknown is ẍ⁺; Newton's method on (1) uses the matrix `M + h γ' D + h² β' K` with
//! `β' = β (1-α_f)/(1-α_m)` and γ' likewise. The matrix is kept until the convergence slows down.
//!
//! Source: [Chung & Hulbert 1993]; form (4) as in [Arnold & Brüls 2007].
//!
//! **Dispersion correction.** No A-stable linear multistep method has a smaller frequency error
//! than the `(hω)²/12` of the trapezoidal rule (Dahlquist's second barrier), and this error makes
//! the phase of a ringing arm drift. With the correction, (4) uses instead of ẍ
//!
//! ```text
//! x̃ = ẍ - c h² d²ẍ/dt² ≈ (1 + c h² M^-1 K) ẍ                                       (5)
//! c = β - Δ/2 + [α_f(1-α_f) - α_m(1-α_m)]/2 - Δ²/2 - 1/12,   Δ = α_f - α_m
//! ```
//! which cancels the second-order term of the frequency error of free vibration. The second
//! derivative of the acceleration is computed from the stiffness and not from previous steps, so
//! that the scheme stays unconditionally stable (a mode ω enters it as `ω² (1 + c (hω)²)`, still
//! positive). At rest ẍ = 0 and nothing changes. (5) neglects the second derivative of the load,
//! which is slow compared with the modes, and that of the damping force, a relative error of 2ζ.
//! Drawback: for rho far below 1 the scheme damps modes with `hω` near 1 about twice as much as
//! without the correction.
//!
//! **Events.** The scheme stores accelerations a and x̃, which are invalid after a jump:
//! [`Integrator::restart`] recomputes them from the equations of motion, and [`Integrator::renew`]
//! also renews the matrix. A step may end anywhere before the next multiple of h
//! ([`Integrator::advance_to`]). A step whose iteration fails is repeated with a matrix computed at
//! its start, then in halves, down to `h/64`; afterwards the grid of multiples of h continues.
//!
//! Not here: Newton's iteration (`implicit.rs`) and its matrix (`iteration_matrix.rs`).

mod dispersion;

use std::sync::Arc;

use nalgebra::DVector;

use crate::dense::largest_of_numbers;
use crate::error::StepError;
use crate::implicit::{ImplicitStep, Newton, Search, Sizes};
use crate::integrator::{Current, ReducedStepper};
use crate::plant::Plant;
use crate::stepper::Stepper;
use crate::steppers::{Method, StepRule, StepperEntry, StepperKind, StepperSetting};
use crate::system::SecondOrderSystem;
use dispersion::DispersionCorrection;

pub(super) static ENTRY: StepperEntry = StepperEntry {
    name: "generalized-alpha",
    aliases: &["generalised-alpha"],
    help: "Implicit, second order, damps what is too fast for the step; for all models",
    steps: StepRule::AnyLength,
    default_step_s: 1e-3,
    order: 2,
    maximal: false,
    allocates: false,
    with: |options| StepperKind::GeneralizedAlpha(options.alpha),
};

/// Parameters of the scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaSettings {
    /// Spectral radius at infinite frequency, 0 to 1.
    pub rho: f64,
    /// Whether to cancel the leading frequency error; see the module documentation.
    pub dispersion_correction: bool,
}

impl Default for AlphaSettings {
    fn default() -> Self {
        Self { rho: 0.9, dispersion_correction: true }
    }
}

impl Method for AlphaSettings {
    fn entry(&self) -> &'static StepperEntry {
        &ENTRY
    }

    fn settings(&self) -> Vec<(&'static str, StepperSetting)> {
        let correction = StepperSetting::Flag(self.dispersion_correction);
        vec![("rho_inf", StepperSetting::Number(self.rho)), ("dispersion_correction", correction)]
    }

    fn start(&self, plant: Arc<Plant>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError> {
        Ok(Box::new(self.stepper(plant, h, e)?))
    }
}

impl AlphaSettings {
    /// Returns the permitted iteration error of a damped arm.
    fn may_leave(&self) -> f64 {
        (OF_DAMPING * (1.0 - self.rho)).min(QUICK)
    }

    /// Creates the stepper of an arm with its permitted iteration error.
    pub(crate) fn stepper(
        self,
        plant: Arc<Plant>,
        h: f64,
        e: &DVector<f64>,
    ) -> Result<ReducedStepper<GeneralizedAlpha>, StepError> {
        let rho = self.rho;
        let left = leave_of(self, &plant, h);
        if !(0.0..=1.0).contains(&rho) {
            return Err(StepError::Setup(format!("the spectral radius must lie between 0 and 1, found {rho}")));
        }
        ReducedStepper::start(plant, e, |system, x, v| {
            let integrator = GeneralizedAlpha::new(system, 0.0, h, self, x, v)?;
            Ok(match left {
                Some(left) => integrator.leaving(left),
                None => integrator,
            })
        })
    }
}

/// Returns the permitted iteration error of an arm as a fraction of the first correction; `None`
/// for full convergence.
pub(crate) fn leave_of(settings: AlphaSettings, plant: &Plant, h: f64) -> Option<f64> {
    let followed = plant.modes.omega.first().is_none_or(|omega| h * omega <= FOLLOWED);
    let left = if followed { settings.may_leave() } else { settings.may_leave().min(COARSE) };
    (left > 0.0 && forgets_errors(plant)).then_some(left)
}

/// Permitted iteration error of damped arms, as a fraction of the first correction of Newton's
/// method: well below the error of the scheme, for half the evaluations
/// (`what_a_quick_iteration_leaves_is_small_beside_the_error_of_its_step`).
///
/// The error is amplified by the next extrapolation, up to `2 + 1/ρ` times for a mode that changes
/// sign in every step; the damping of the scheme at infinite frequency, `1 - ρ`, must exceed this
/// ([`AlphaSettings::may_leave`]). Modes with `h ω` of 2 to 5 are damped less: a search whose first
/// correction points against the one before goes on ([`crate::implicit`]).
const QUICK: f64 = 0.03;
/// Permitted iteration error as a fraction of `1 - ρ`.
const OF_DAMPING: f64 = 0.3;
/// Minimum damping ratio of all modes for a permitted iteration error: the error of one step then
/// decays before many others accumulate.
const DAMPED: f64 = 1e-3;
/// Maximum `h ω` of the first mode that steps resolve, twelve steps per period; beyond it
/// extrapolations are poor predictions.
const FOLLOWED: f64 = 0.5;

/// Permitted iteration error for steps beyond [`FOLLOWED`].
const COARSE: f64 = 1e-3;

/// Returns whether iteration errors do not accumulate in the arm: joints are prescribed, springs
/// are linear and completely represented in Newton's matrix, modes are damped.
fn forgets_errors(plant: &Plant) -> bool {
    let straight = plant.elements.iter().all(|element| element.curve.is_none() && element.geometric.is_none());
    let mut force = DVector::zeros(plant.model.n_elastic());
    let damped = plant.modes.omega.iter().zip(plant.modes.shapes.column_iter()).all(|(omega, shape)| {
        force.fill(0.0);
        plant.add_damping(shape.as_slice(), force.as_mut_slice());
        let twice = shape.dot(&force);
        twice >= 2.0 * DAMPED * omega
    });
    plant.torque_driven.is_empty() && !plant.has_gear_laws() && straight && damped
}

/// The integrator with its state; see the module documentation.
#[derive(Clone, Debug)]
pub struct GeneralizedAlpha {
    coefficients: Coefficients,
    correction: Option<DispersionCorrection>,
    newton: Newton,
    /// See [`GeneralizedAlpha::exactly`].
    exact: bool,
    /// Time, positions, velocities and accelerations.
    pub now: Current,
    /// a and x̃ at the current time, ẍ one step earlier.
    a: DVector<f64>,
    x_tilde: DVector<f64>,
    previous: DVector<f64>,
    /// Trial values of x⁺, v⁺, ẍ⁺ and x̃⁺.
    x_new: DVector<f64>,
    v_new: DVector<f64>,
    trial: DVector<f64>,
    x_tilde_new: DVector<f64>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Coefficients {
    alpha_m: f64,
    alpha_f: f64,
    beta: f64,
    gamma: f64,
}

impl Coefficients {
    /// Returns `h γ'` and `h² β'`, the derivatives of v⁺ and x⁺ with respect to x̃⁺.
    pub(crate) fn derivatives(&self, h: f64) -> (f64, f64) {
        let ratio = (1.0 - self.alpha_f) / (1.0 - self.alpha_m);
        (h * self.gamma * ratio, h * h * self.beta * ratio)
    }

    /// Returns `c` of (5).
    pub(crate) fn dispersion(&self) -> f64 {
        let Self { alpha_m, alpha_f, beta, .. } = *self;
        let shift = alpha_f - alpha_m;
        let filter = 0.5 * (alpha_f * (1.0 - alpha_f) - alpha_m * (1.0 - alpha_m));
        beta - 0.5 * shift + filter - 0.5 * shift * shift - 1.0 / 12.0
    }

    pub(crate) fn new(rho: f64) -> Self {
        let (alpha_m, alpha_f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 + alpha_f - alpha_m;
        Self { alpha_m, alpha_f, beta: 0.25 * (gamma + 0.5).powi(2), gamma }
    }

    /// Returns x⁺ and v⁺ by (4), (2), (3) from x, v, a and x̃ of one coordinate and x̃⁺.
    pub(crate) fn advance(&self, h: f64, x: f64, v: f64, a: f64, x_tilde: f64, x_tilde_new: f64) -> (f64, f64) {
        let Self { alpha_m, alpha_f, beta, gamma } = *self;
        let ratio = (1.0 - alpha_f) / (1.0 - alpha_m);
        let a_new = (alpha_f * x_tilde - alpha_m * a) / (1.0 - alpha_m) + ratio * x_tilde_new;
        (x + h * v + h * h * ((0.5 - beta) * a + beta * a_new), v + h * ((1.0 - gamma) * a + gamma * a_new))
    }

    /// Returns a⁺ of (4).
    pub(crate) fn remembered(&self, a: f64, x_tilde: f64, x_tilde_new: f64) -> f64 {
        let Self { alpha_m, alpha_f, .. } = *self;
        ((1.0 - alpha_f) * x_tilde_new + alpha_f * x_tilde - alpha_m * a) / (1.0 - alpha_m)
    }
}

impl GeneralizedAlpha {
    /// [`Integrator::MOTION_RULE`]: the end points of a step.
    ///
    /// [`Integrator::MOTION_RULE`]: crate::Integrator::MOTION_RULE
    pub(crate) const ENDS: [(f64, f64); 2] = [(0.0, 0.5), (1.0, 0.5)];

    /// Starts at `t0` with step size `h` (s).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the initial acceleration cannot be computed.
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
        let now = Current::new(system, t0, h, x, v)?;
        let n = now.x.len();
        let zeros = DVector::zeros(n);
        let coefficients = Coefficients::new(rho);
        let c = coefficients.dispersion();
        Ok(Self {
            coefficients,
            correction: (dispersion_correction && c > 0.0).then(|| DispersionCorrection::new(c, h, n)),
            newton: Newton::new(n, h),
            exact: false,
            x_new: now.x.clone(),
            v_new: now.v.clone(),
            a: now.acceleration.clone(),
            x_tilde: now.acceleration.clone(),
            previous: now.acceleration.clone(),
            now,
            trial: zeros.clone(),
            x_tilde_new: zeros,
        })
    }

    /// Permits an iteration error of `part` times the first Newton correction, which is the error
    /// of an extrapolation over the step.
    #[must_use]
    pub fn leaving(self, part: f64) -> Self {
        Self { newton: self.newton.leaving(part), ..self }
    }

    /// Makes steps smooth functions of all their inputs: the matrix, and with it that of the
    /// dispersion correction, is computed at the start of each step, and the iteration converges
    /// fully. Along a tree, where the matrix contains the correction, this holds for steps
    /// of at most eight iterations.
    #[must_use]
    pub fn exactly(self) -> Self {
        Self { exact: true, ..self.leaving(0.0) }
    }

    /// Initialises a and x̃ with the current acceleration, without the correction: with it, a jump
    /// would excite modes with `hω >> 1` that alternate from step to step.
    fn remember(&mut self) {
        self.a.copy_from(&self.now.acceleration);
        self.previous.copy_from(&self.now.acceleration);
        self.x_tilde.copy_from(&self.now.acceleration);
        self.newton.fresh = false;
    }

    /// Computes Newton's matrix, (7) or (8), at the configuration of the last residual; `kept`:
    /// without updating (6).
    fn factor(&mut self, system: &mut impl SecondOrderSystem, t: f64, kept: bool) -> Result<(), StepError> {
        let (c_D, c_K) = self.coefficients.derivatives(self.newton.dt);
        let matrix = &mut self.newton.matrix;
        matrix.read(system, c_D, c_K, self.correction.as_ref().map(DispersionCorrection::c_h2));
        if let Some(correction) = &mut self.correction {
            correction.correct(system, matrix, t, kept)?;
        }
        matrix.invert(t)?;
        self.newton.renewed();
        Ok(())
    }

    /// Computes x̃⁺, a⁺, x⁺, v⁺ from the trial ẍ⁺ by (5), (4), (2), (3).
    fn place(&mut self) {
        let h = self.newton.dt;
        match &mut self.correction {
            Some(correction) => correction.corrected(&mut self.newton.matrix, &self.trial, &mut self.x_tilde_new),
            None => self.x_tilde_new.copy_from(&self.trial),
        }
        let Self { now: Current { x, v, .. }, a, x_tilde, x_tilde_new, .. } = self;
        for k in 0..x.len() {
            (self.x_new[k], self.v_new[k]) = self.coefficients.advance(h, x[k], v[k], a[k], x_tilde[k], x_tilde_new[k]);
        }
    }

    /// Computes `r(t⁺, x⁺, v⁺, ẍ⁺)` of (1).
    fn residual(&mut self, system: &mut impl SecondOrderSystem, t: f64) {
        system.residual(t, &self.x_new, &self.v_new, &self.trial, &mut self.newton.r);
    }

    /// Subtracts the correction `d = J^-1 r` of ẍ⁺ from all trial values.
    fn correct(&mut self, mut sizes: Sizes) -> Sizes {
        let d = &self.newton.r;
        let shift = self.correction.as_mut().map(|correction| correction.shift(&self.newton.matrix, d));
        let (c_D, c_K) = self.coefficients.derivatives(self.newton.dt);
        for k in 0..d.len() {
            let d_tilde = d[k] + shift.map_or(0.0, |(factor, shift)| factor * shift[k]);
            self.trial[k] -= d[k];
            self.x_tilde_new[k] -= d_tilde;
            self.x_new[k] -= c_K * d_tilde;
            self.v_new[k] -= c_D * d_tilde;
        }
        let [d, acceleration, place] = [d, &self.trial, &self.x_new].map(|x| largest_of_numbers(x.as_slice()));
        sizes.include(d, acceleration, place);
        sizes
    }

    /// Accepts the trial values as the state at `t`.
    fn accept(&mut self, t: f64) {
        for ((a, x_tilde), new) in self.a.iter_mut().zip(&self.x_tilde).zip(&self.x_tilde_new) {
            *a = self.coefficients.remembered(*a, *x_tilde, *new);
        }
        std::mem::swap(&mut self.now.x, &mut self.x_new);
        std::mem::swap(&mut self.now.v, &mut self.v_new);
        std::mem::swap(&mut self.x_tilde, &mut self.x_tilde_new);
        std::mem::swap(&mut self.previous, &mut self.now.acceleration);
        std::mem::swap(&mut self.now.acceleration, &mut self.trial);
        self.now.grid.reach(t);
    }
}

impl ImplicitStep for GeneralizedAlpha {
    const MOTION_RULE: &'static [(f64, f64)] = &Self::ENDS;

    fn current(&self) -> &Current {
        &self.now
    }

    fn current_mut(&mut self) -> &mut Current {
        &mut self.now
    }

    fn newton(&self) -> &Newton {
        &self.newton
    }

    fn newton_mut(&mut self) -> &mut Newton {
        &mut self.newton
    }

    fn set_length(&mut self, dt: f64) {
        if let Some(correction) = &mut self.correction {
            correction.set_length(dt);
        }
    }

    fn attempt(&mut self, system: &mut impl SecondOrderSystem, t: f64) -> Result<(), StepError> {
        if self.exact || !self.newton.factored {
            // The matrix is computed at the configuration of the last residual.
            system.residual(self.now.grid.time(), &self.now.x, &self.now.v, &self.now.acceleration, &mut self.newton.r);
            self.factor(system, t, false)?;
        }
        if self.newton.fresh {
            self.remember();
        }

        // Predict ẍ⁺ by extrapolation.
        for ((trial, a), b) in self.trial.iter_mut().zip(&self.now.acceleration).zip(&self.previous) {
            *trial = 2.0 * a - b;
        }
        self.place();

        // Newton's method on (1).
        let h = self.newton.dt;
        let mut search = Search::new(t, h, self.coefficients.derivatives(h).1);
        loop {
            self.residual(system, t);
            if search.stalls() {
                // In exact mode keep (6) of the start of the step.
                self.factor(system, t, self.exact)?;
                self.place();
                self.residual(system, t);
            }
            let norm = self.newton.matrix.solve(&mut self.newton.r);
            let sizes = self.correct(Sizes::of(norm));
            if search.ends(sizes, &mut self.newton)? {
                break;
            }
        }
        if self.exact {
            // One more correction: the error left by the last one is smaller than it by the same
            // factor again.
            self.residual(system, t);
            self.newton.matrix.solve(&mut self.newton.r);
            self.correct(Sizes::default());
        }
        self.newton.found(search.iterations, search.iterations);
        self.accept(t);
        system.settle(t, &self.now.x);
        if !self.newton.factored {
            // The last residual is close enough to this configuration, and (6) then stays the same
            // throughout the next step.
            let _singular_is_found_again_in_the_next_step = self.factor(system, t, false);
            self.newton.renewed_between();
        }
        Ok(())
    }
}
