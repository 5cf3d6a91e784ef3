//! The flexible arm that every stepper gets: tree, springs, damping, motion, external loads.
//!
//! Immutable and shared; each stepper makes its own state from it. Start at [`FlexibleArm::new`].

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, State, Wrench, mass_matrix};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use crate::error::StepError;
use crate::modes::{Modes, modes_at};
use crate::motion::PrescribedMotion;

/// A spring across one elastic joint of the model: generalised force `-(K e + D ė)` on its six coordinates.
#[derive(Clone, Debug)]
pub struct ElasticElement {
    /// Name for logs.
    pub name: String,
    /// Body behind the joint (distal part).
    pub body: usize,
    /// First of its six coordinates.
    pub coordinate: usize,
    /// `K_S` (N/m, N/rad; N m/m, N m/rad).
    pub K_S: Matrix6<f64>,
    /// `K_S^-1`.
    pub C_S: Matrix6<f64>,
    /// How it is damped.
    pub damping: Damping,
}

/// Damping of an elastic element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    /// Damping ratio of the modes, weighted by the share of strain energy that this element has in each mode.
    Modal(f64),
    /// `D = beta K` (s).
    StiffnessProportional(f64),
}

/// Tree, springs, damping and motion.
#[derive(Clone)]
pub struct FlexibleArm {
    /// The tree; elastic joints in it are the springs.
    pub model: Arc<Model>,
    /// Springs, in coordinate order; one per elastic joint.
    pub elements: Vec<ElasticElement>,
    /// Damping matrix on the elastic coordinates (6 per element).
    pub D: DMatrix<f64>,
    /// `beta` per element that comes nearest to `D` (exact when stiffness-proportional), for SPOOK (s).
    pub tau: Vec<f64>,
    /// Whether `D` is block diagonal with `beta K` in the blocks.
    pub proportional: bool,
    /// Motion of the actuated joints.
    pub motion: Arc<dyn PrescribedMotion>,
    /// Constant external wrench per body, at Bo in **world** axes (empty: none).
    pub loads: Vec<(usize, Wrench)>,
    /// Natural modes at the start pose, drives locked.
    pub modes: Modes,
}

impl FlexibleArm {
    /// Puts springs on the elastic joints of a model.
    ///
    /// `springs` lists name, stiffness and damping in the order of `model.elastic_bodies()`. The modal damping
    /// matrix and the modes are those of the static pose at `t = 0`.
    ///
    /// # Errors
    /// [`StepError::Setup`] if the counts differ, [`StepError::Singular`] if a stiffness is not positive definite,
    /// [`StepError::NoEquilibrium`] if the arm cannot carry its weight.
    pub fn new(
        model: Arc<Model>,
        springs: Vec<(String, Matrix6<f64>, Damping)>,
        motion: Arc<dyn PrescribedMotion>,
    ) -> Result<Self, StepError> {
        if springs.len() != model.n_elastic() {
            return Err(StepError::Setup(format!(
                "the model has {} elastic joints but {} springs were given",
                model.n_elastic(),
                springs.len()
            )));
        }
        let bodies: Vec<usize> = model.elastic_bodies().collect();
        let mut elements = Vec::new();
        for ((name, K_S, damping), body) in springs.into_iter().zip(bodies) {
            let C_S = K_S.cholesky().map(|c| c.inverse());
            let Some(C_S) = C_S else {
                return Err(StepError::Singular { matrix: "stiffness of an elastic joint", t: 0.0 });
            };
            let coordinate = model.bodies()[body].coordinate;
            elements.push(ElasticElement { name, body, coordinate, K_S, C_S, damping });
        }
        let n = 6 * elements.len();
        let mut arm = Self {
            model,
            elements,
            D: DMatrix::zeros(n, n),
            tau: Vec::new(),
            proportional: true,
            motion,
            loads: Vec::new(),
            modes: Modes::default(),
        };
        arm.update_modes_and_damping()?;
        Ok(arm)
    }

    /// The same arm with constant external loads: (body, wrench at Bo in world axes).
    ///
    /// # Errors
    /// As [`FlexibleArm::new`].
    pub fn with_loads(mut self, loads: Vec<(usize, Wrench)>) -> Result<Self, StepError> {
        self.loads = loads;
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Number of elastic coordinates.
    pub fn n_elastic_coordinates(&self) -> usize {
        6 * self.elements.len()
    }

    /// Stiffness on the elastic coordinates, block diagonal.
    pub fn stiffness(&self) -> DMatrix<f64> {
        let n = self.n_elastic_coordinates();
        let mut K = DMatrix::zeros(n, n);
        for (k, element) in self.elements.iter().enumerate() {
            K.fixed_view_mut::<6, 6>(6 * k, 6 * k).copy_from(&element.K_S);
        }
        K
    }

    /// Elastic energy (J) at elastic coordinates `e`.
    pub fn elastic_energy(&self, e: &[f64]) -> f64 {
        self.elements
            .iter()
            .enumerate()
            .map(|(k, element)| {
                let x = Vector6::from_column_slice(&e[6 * k..6 * k + 6]);
                0.5 * x.dot(&(element.K_S * x))
            })
            .sum()
    }

    /// Full state at time `t` with elastic coordinates zero; the accelerations go into `qddot`.
    pub fn prescribed_state(&self, t: f64, state: &mut State, qddot: &mut DVector<f64>) {
        let n = self.model.n_actuated();
        let (q, qdot) = (state.q.as_mut_slice(), state.qdot.as_mut_slice());
        self.motion.sample(t, &mut q[..n], &mut qdot[..n], &mut qddot.as_mut_slice()[..n]);
    }

    /// Turns the constant loads into body axes for the poses in `data.X_WB`.
    pub fn apply_loads(&self, data: &mut Data) {
        for (body, F_W) in &self.loads {
            let R = data.X_WB[*body].rotation;
            data.F_ext[*body] = Wrench::new(R.inverse() * F_W.force, R.inverse() * F_W.torque);
        }
    }

    fn update_modes_and_damping(&mut self) -> Result<(), StepError> {
        let n = self.n_elastic_coordinates();
        if n == 0 {
            return Ok(());
        }
        self.modes = modes_at(self, 0.0)?;
        self.proportional = self.elements.iter().all(|e| matches!(e.damping, Damping::StiffnessProportional(_)));
        let first = self.modes.omega[0];
        self.tau = self
            .elements
            .iter()
            .map(|e| match e.damping {
                Damping::Modal(zeta) => 2.0 * zeta / first,
                Damping::StiffnessProportional(beta) => beta,
            })
            .collect();
        self.D.fill(0.0);

        // D = M Φ diag(2 ζ ω) Φᵀ M with ζ of each mode weighted by strain energy, plus beta K blocks.
        let model = self.model.clone();
        let (mut state, mut qddot) = (State::zeros(&model), DVector::zeros(model.nv()));
        self.prescribed_state(0.0, &mut state, &mut qddot);
        state.q.rows_mut(model.n_actuated(), n).copy_from(&self.modes.equilibrium);
        let mut data = Data::new(&model);
        let M = mass_matrix(&model, &mut data, &state.q)
            .view((model.n_actuated(), model.n_actuated()), (n, n))
            .clone_owned();
        for (j, omega) in self.modes.omega.iter().enumerate() {
            let phi = self.modes.shapes.column(j);
            let (mut zeta, mut total) = (0.0, 0.0);
            for (k, element) in self.elements.iter().enumerate() {
                let x: Vector6<f64> = phi.fixed_rows::<6>(6 * k).into();
                let energy = x.dot(&(element.K_S * x));
                total += energy;
                if let Damping::Modal(z) = element.damping {
                    zeta += z * energy;
                }
            }
            let Mphi = &M * phi;
            self.D.ger(2.0 * zeta / total * omega, &Mphi, &Mphi, 1.0);
        }
        for (k, element) in self.elements.iter().enumerate() {
            if let Damping::StiffnessProportional(beta) = element.damping {
                let mut block = self.D.fixed_view_mut::<6, 6>(6 * k, 6 * k);
                block += element.K_S * beta;
            }
        }
        Ok(())
    }
}
