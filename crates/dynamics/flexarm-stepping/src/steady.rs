//! Linearisation about steady rotation: joints move at constant rates, the deflections are constant.
//!
//! ```text
//! r(e, ė) = 0 at ė = ë = 0        K = ∂r/∂e        D = ∂r/∂ė
//! ```
//! r: forces on the elastic coordinates with the joints on their motion. K holds springs, weight,
//! stiffening by centrifugal loads and spin softening; D damping and Coriolis terms. Rotation is
//! steady if r does not depend on time, as for one vertical axis. Otherwise the matrices are those
//! of one instant.

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, forward_kinematics, frame_jacobian};
use nalgebra::{DMatrix, DVector, Matrix6xX};

use crate::equilibrium::{Equilibrium, Forces, equilibrium};
use crate::error::StepError;
use crate::linear::Linear;
use crate::motion::MotionFn;
use crate::plant::Plant;
use crate::reduced::ReducedArm;
use crate::statics::{for_vibration, spring_forces, static_equilibrium};
use crate::system::SecondOrderSystem;

/// Step size of the central differences with respect to coordinates (m, rad).
const DIFFERENCE: f64 = 1e-6;
/// The same for rates: forces are quadratic in rates, so that any step size is exact.
const RATE: f64 = 1.0;
/// Number of stages in which centrifugal loads rise if they are too large for Newton's method.
const STAGES: u32 = 16;

/// Linear model about steady rotation.
#[derive(Clone, Debug)]
pub struct SteadyRotation {
    /// Linear model of the elastic coordinates; commands do not act on it.
    pub linear: Linear,
    /// Damping without the Coriolis terms, n×n.
    pub damping: DMatrix<f64>,
    /// Change of the forces after a turn by one radian, relative to the largest force: zero for steady
    /// rotation.
    pub change: f64,
}

/// Linearises the arm about rotation at constant rates of the joints, motors held to it.
///
/// * `tool`: a frame of the arm's model; `at`: joint positions (rad or m), at which the arm's own
///   motion is at time 0; `rates`: joint rates (rad/s or m/s).
///
/// # Errors
/// [`StepError::Setup`] for a wrong number of joints, [`StepError::NoEquilibrium`],
/// [`StepError::Singular`], [`StepError::OpenLoop`].
pub fn linearise_rotation(plant: &Plant, tool: &Frame, at: &[f64], rates: &[f64]) -> Result<SteadyRotation, StepError> {
    let joints = plant.model.n_actuated();
    for (what, found) in [("positions", at.len()), ("rates", rates.len())] {
        if found != joints {
            return Err(StepError::Setup(format!("{found} joint {what} are given, the arm has {joints} joints")));
        }
    }
    let plant = plant.with_motors_held();
    let in_stages = |stages: u32| {
        let mut e = static_equilibrium(&plant, 0.0)?;
        for k in 1..stages {
            // Centrifugal loads are quadratic in the rates.
            let share = f64::from(k) / f64::from(stages);
            e = equilibrium(&mut Rotation::new(&plant, at, rates, share.sqrt()), e)?.e;
        }
        let mut rotation = Rotation::new(&plant, at, rates, 1.0);
        let found = equilibrium(&mut rotation, e)?;
        Ok((rotation, found))
    };
    let (mut rotation, found) = in_stages(1).or_else(|_: StepError| in_stages(STAGES))?;
    rotation.linearise(tool, found, rates)
}

/// An arm whose joints move at constant rates.
struct Rotation {
    system: ReducedArm,
    zero: DVector<f64>,
}

impl Rotation {
    fn new(plant: &Plant, at: &[f64], rates: &[f64], share: f64) -> Self {
        let (at, rates) = (at.to_vec(), rates.iter().map(|rate| rate * share).collect::<Vec<_>>());
        let motion = MotionFn(move |t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
            for ((q, at), rate) in q.iter_mut().zip(&at).zip(&rates) {
                *q = at + rate * t;
            }
            qdot.copy_from_slice(&rates);
            qddot.fill(0.0);
        });
        Self { system: ReducedArm::new(plant.along(Arc::new(motion))), zero: DVector::zeros(plant.model.n_elastic()) }
    }

    /// Returns the forces on the elastic coordinates at time t (s), without accelerations.
    fn forces(&mut self, t: f64, e: &DVector<f64>, rates: &DVector<f64>) -> DVector<f64> {
        let mut r = DVector::zeros(e.len());
        self.system.residual(t, e, rates, &self.zero, &mut r);
        r
    }

    /// Returns the derivatives of the forces: by the coordinates, or by their rates.
    fn slopes(&mut self, e: &DVector<f64>, of_rates: bool) -> DMatrix<f64> {
        let n = e.len();
        let (step, zero) = (if of_rates { RATE } else { DIFFERENCE }, self.zero.clone());
        let mut slopes = DMatrix::zeros(n, n);
        for k in 0..n {
            let mut moved = |sign: f64| {
                let mut d = zero.clone();
                d[k] = sign * step;
                if of_rates { self.forces(0.0, e, &d) } else { self.forces(0.0, &(e + d), &zero) }
            };
            slopes.set_column(k, &((moved(1.0) - moved(-1.0)) / (2.0 * step)));
        }
        slopes
    }

    /// Linearises the arm about the steady rotation.
    fn linearise(&mut self, tool: &Frame, found: Equilibrium, rates: &[f64]) -> Result<SteadyRotation, StepError> {
        let Equilibrium { e, residual, iterations } = found;
        let e = &e;
        // Matrices about the steady state, by central differences of r.
        let (K, D) = (self.slopes(e, false), self.slopes(e, true));
        let (r, scale) = self.unbalanced(e)?;
        let (m, n) = (rates.len(), e.len());
        let mut M = DMatrix::zeros(n, n);
        self.system.mass(&mut M);
        // Torques that keep the rotation, and poses and Jacobian of the tool.
        self.system.evaluate(0.0, e, &self.zero, &self.zero);
        let holding = self.system.data.tau.rows(0, m).into_owned();
        let q = self.system.state.q.clone();
        let plant = self.system.plant().clone();
        let mut data = Data::new(&plant.model);
        forward_kinematics(&plant.model, &mut data, &q);
        if let Some(open) = StepError::open_loop(&plant.model, &data, 0.0) {
            return Err(open);
        }
        let mut J = Matrix6xX::zeros(plant.model.nv());
        frame_jacobian(&plant.model, &data, tool, &mut J);
        // r after a turn by one radian: the same for steady rotation.
        let fastest = rates.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
        let later = self.forces(1.0 / fastest.max(f64::MIN_POSITIVE), e, &self.zero.clone());
        let linear = Linear {
            equilibrium: e.clone(),
            springs: for_vibration(&plant, &plant.stiffness(), q.as_slice(), e),
            elements: plant
                .elements
                .iter()
                .map(|own| (own.name.clone(), plant.offset(own)..plant.offset(own) + own.size))
                .collect(),
            M,
            D,
            K: (&K + K.transpose()) * 0.5,
            driven: 0,
            M_a: DMatrix::zeros(n, m),
            D_a: DMatrix::zeros(n, m),
            K_a: DMatrix::zeros(n, m),
            J: J.columns(m, n).into_owned(),
            J_a: J.columns(0, m).into_owned(),
            X_WT: data.X_WF(tool),
            holding,
            residual,
            iterations,
            q,
        };
        Ok(SteadyRotation { linear, damping: plant.D.clone(), change: (later - r).amax() / scale })
    }
}

impl Forces for Rotation {
    fn unbalanced(&mut self, e: &DVector<f64>) -> Result<(DVector<f64>, f64), StepError> {
        let r = self.forces(0.0, e, &self.zero.clone());
        let springs = spring_forces(self.system.plant(), self.system.state.q.as_slice(), e);
        let scale = (&r - &springs).amax().max(springs.amax()).max(f64::MIN_POSITIVE);
        Ok((r, scale))
    }

    fn step(&mut self, e: &DVector<f64>, r: &DVector<f64>, _: f64) -> Result<DVector<f64>, StepError> {
        let singular = StepError::Singular { matrix: "stiffness under rotation", t: 0.0 };
        self.slopes(e, false).lu().solve(r).ok_or(singular)
    }

    fn has_hysteresis(&self) -> bool {
        self.system.plant().has_hysteresis()
    }

    fn time(&self) -> f64 {
        0.0
    }
}
