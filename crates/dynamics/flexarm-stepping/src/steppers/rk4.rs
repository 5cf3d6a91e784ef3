//! Classical explicit Runge-Kutta method of fourth order, for non-stiff systems.
//!
//! Stable while `h ω < 2.78` for every undamped mode; stiffness-proportional damping narrows this
//! further ([`check_explicit_step`] refuses larger steps). Source: [Hairer, Nørsett & Wanner 1993], section II.1.
//!
//! Not here: the modes of the arm, stiff arms (`generalized_alpha`).

use std::sync::Arc;

use flexarm_kinematics::{Data, mass_matrix};
use nalgebra::{DMatrix, DVector};

use crate::error::StepError;
use crate::integrator::{Current, Integrator, ReducedStepper};
use crate::plant::Plant;
use crate::stepper::{Counts, Stepper};
use crate::steppers::{Method, StepRule, StepperEntry, StepperKind};
use crate::system::SecondOrderSystem;

pub(super) static ENTRY: StepperEntry = StepperEntry {
    name: "rk4",
    aliases: &[],
    help: "Explicit, fourth order; small steps only",
    steps: StepRule::UpToTheStabilityLimit,
    default_step_s: 1e-4,
    order: 4,
    maximal: false,
    allocates: false,
    with: |_| StepperKind::Rk4,
};

/// RK4 has no settings.
pub(super) struct Rk4Settings;

impl Method for Rk4Settings {
    fn entry(&self) -> &'static StepperEntry {
        &ENTRY
    }

    fn start(&self, plant: Arc<Plant>, h: f64, e: &DVector<f64>) -> Result<Box<dyn Stepper>, StepError> {
        check_explicit_step(&plant, h)?;
        let mut changed = Plant::clone(&plant);
        for change in &plant.inertia_changes {
            changed.model = Arc::new(changed.model.with_inertia(change.body, change.inertia));
            // An arm without static equilibrium with this payload may still be able to move with
            // it.
            if changed.update_modes_and_damping().is_ok() {
                check_explicit_step(&changed, h)?;
            }
        }
        Ok(Box::new(ReducedStepper::start(plant, e, |system, x, v| Rk4::new(system, 0.0, h, x, v))?))
    }
}

/// Bound of `h ω` on the imaginary axis.
const STABILITY_LIMIT: f64 = 2.78;

/// The integrator with its state.
#[derive(Clone, Debug)]
pub struct Rk4 {
    /// Time, positions, velocities and accelerations.
    pub now: Current,
    x_stage: DVector<f64>,
    v_stage: DVector<f64>,
    a_stage: DVector<f64>,
    dx: DVector<f64>,
    dv: DVector<f64>,
}

impl Rk4 {
    /// Starts at `t0` with step size `h` (s).
    ///
    /// # Errors
    /// [`StepError::Singular`] if the initial acceleration cannot be computed.
    ///
    /// # Panics
    /// If `h` is not positive.
    pub fn new(
        system: &mut impl SecondOrderSystem,
        t0: f64,
        h: f64,
        x: DVector<f64>,
        v: DVector<f64>,
    ) -> Result<Self, StepError> {
        let zeros = DVector::zeros(system.dimension());
        Ok(Self {
            now: Current::new(system, t0, h, x, v)?,
            x_stage: zeros.clone(),
            v_stage: zeros.clone(),
            a_stage: zeros.clone(),
            dx: zeros.clone(),
            dv: zeros,
        })
    }
}

impl Integrator for Rk4 {
    fn current(&self) -> &Current {
        &self.now
    }

    fn current_mut(&mut self) -> &mut Current {
        &mut self.now
    }

    fn counts(&self) -> Counts {
        Counts { steps: self.now.grid.steps(), evaluations: 4 * self.now.grid.steps(), factorisations: 0 }
    }

    fn copy(&self) -> Option<Self> {
        Some(self.clone())
    }

    fn advance_to(&mut self, system: &mut impl SecondOrderSystem, t_new: f64) -> Result<(), StepError> {
        let t = self.now.grid.time();
        let h = t_new - t;
        // Stage 1 is the acceleration at the end of the last step.
        self.dx.copy_from(&self.now.v);
        self.dv.copy_from(&self.now.acceleration);
        self.v_stage.copy_from(&self.now.v);
        self.a_stage.copy_from(&self.now.acceleration);
        // Stages 2 to 4.
        for (fraction, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for k in 0..self.now.x.len() {
                self.x_stage[k] = self.now.x[k] + fraction * h * self.v_stage[k];
                self.v_stage[k] = self.now.v[k] + fraction * h * self.a_stage[k];
            }
            system.acceleration(t + fraction * h, &self.x_stage, &self.v_stage, &mut self.a_stage)?;
            self.dx.axpy(weight, &self.v_stage, 1.0);
            self.dv.axpy(weight, &self.a_stage, 1.0);
        }
        // x⁺ = x + h/6 Σ w_i v_i, v⁺ likewise.
        let mut largest = 0.0f64;
        for k in 0..self.now.x.len() {
            self.x_stage[k] = self.now.x[k] + h / 6.0 * self.dx[k];
            self.v_stage[k] = self.now.v[k] + h / 6.0 * self.dv[k];
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
        std::mem::swap(&mut self.now.x, &mut self.x_stage);
        std::mem::swap(&mut self.now.v, &mut self.v_stage);
        std::mem::swap(&mut self.now.acceleration, &mut self.a_stage);
        self.now.grid.reach(t_new);
        system.settle(t_new, &self.now.x);
        Ok(())
    }
}

/// Checks that every mode is inside the stability region: on the imaginary axis up to 2.78, 2.61
/// where damping moves the eigenvalue inwards, on the negative real axis up to 2.78 again.
fn check_explicit_step(plant: &Plant, h: f64) -> Result<(), StepError> {
    let mut rate = 0.0f64;
    for (j, omega) in plant.modes.omega.iter().enumerate() {
        let phi = plant.modes.shapes.column(j);
        rate = rate.max(omega * STABILITY_LIMIT / 2.61).max(fastest_decay(phi.dot(&(&plant.D * phi)), *omega));
    }
    let mut highest = plant.modes.omega.last().copied().unwrap_or(0.0);
    if !plant.torque_driven.is_empty() {
        // Free motors oscillate against their springs.
        let (omega, decay) = free_rates(plant)?;
        rate = rate.max(omega * STABILITY_LIMIT / 2.61).max(decay);
        highest = highest.max(omega);
    }
    if h * rate <= STABILITY_LIMIT {
        return Ok(());
    }
    Err(StepError::UnstableStep {
        stepper: "rk4",
        h,
        highest_hz: highest / std::f64::consts::TAU,
        largest_s: STABILITY_LIMIT / rate,
    })
}

/// Returns the decay rate (1/s) of an overdamped mode with damping `2 ζ ω`; 0 for an oscillating
/// mode, which is bounded by its frequency.
fn fastest_decay(damping: f64, omega: f64) -> f64 {
    let squared = damping * damping - 4.0 * omega * omega;
    if squared > 0.0 { 0.5 * (damping + squared.sqrt()) } else { 0.0 }
}

/// Returns the highest angular frequency and decay rate (1/s) with the joints driven by torque
/// free, without Coulomb and Stribeck friction.
fn free_rates(plant: &Plant) -> Result<(f64, f64), StepError> {
    let (model, na) = (&plant.model, plant.model.n_actuated());
    let mut data = Data::new(model);
    // M, K and D over the driven joints and the elastic coordinates; driven joints have no spring.
    let q = plant.coordinates_at(0.0, &plant.modes.equilibrium);
    let M = mass_matrix(model, &mut data, &q);
    let free: Vec<usize> = plant.torque_driven.iter().copied().chain(na..model.nv()).collect();
    let (n, driven) = (free.len(), plant.torque_driven.len());
    let M = DMatrix::from_fn(n, n, |i, j| M[(free[i], free[j])]);
    let (mut K, mut D) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    K.view_mut((driven, driven), (n - driven, n - driven)).copy_from(&plant.stiffness());
    D.view_mut((driven, driven), (n - driven, n - driven)).copy_from(&plant.D);
    for (i, k) in plant.torque_driven.iter().enumerate() {
        D[(i, i)] = plant.friction.get(*k).map_or(0.0, |f| f.viscous);
    }
    let singular = StepError::Singular { matrix: "mass matrix", t: 0.0 };
    // Maximum eigenvalues of L^-1 K L^-T (ω²) and of L^-1 D L^-T (decay), M = L Lᵀ.
    let L = M.cholesky().ok_or(singular.clone())?.l();
    let largest = |A: &DMatrix<f64>| {
        let half = L.solve_lower_triangular(A)?;
        let whole = L.solve_lower_triangular(&half.transpose())?;
        Some((&whole + whole.transpose()).symmetric_eigenvalues().max() * 0.5)
    };
    let (stiff, damped) = (largest(&K).ok_or(singular.clone())?, largest(&D).ok_or(singular)?);
    Ok((stiff.max(0.0).sqrt(), damped.max(0.0)))
}
