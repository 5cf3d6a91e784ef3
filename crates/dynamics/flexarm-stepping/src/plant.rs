//! Plant, the input of every stepper: tree of an arm, springs, damping, drives, motion, external
//! loads.
//!
//! Immutable and shared; each stepper derives its own state from it. Start at [`Plant::new`]
//! (`assembly.rs`).
//!
//! The free coordinates x of a plant are those of the joints driven by torque, followed by the
//! elastic ones. All other joints are prescribed.
//!
//! Not here: state, events, or anything that changes during a run (`reduced`).

use std::sync::Arc;

use flexarm_kinematics::{AxisMotion, Data, JointMotion, Model, SpatialInertia, State, Wrench};
use flexarm_spatial::GeometricStiffness;
use nalgebra::{DMatrix, DVector, Matrix6};

use crate::dense::add_product;
use crate::drive::{Friction, ServoAxis, SpringCurve};
use crate::gear::{GearCoupling, Hysteresis, LoadFriction, TransmissionError};
use crate::load::Load;
use crate::motion::PrescribedMotion;

/// Stiffness and damping of one group of elastic coordinates, before it is assigned to the model.
#[derive(Clone, Debug)]
pub struct Spring {
    /// Name for logs.
    pub name: String,
    /// Stiffness matrix, size×size of the group.
    pub K: DMatrix<f64>,
    /// Damping.
    pub damping: Damping,
    /// Law of the spring if it is nonlinear; only for a single coordinate.
    pub curve: Option<SpringCurve>,
    /// Hysteresis of a gear, which takes the place of `K` and `curve`; only for a single coordinate.
    pub hysteresis: Option<Hysteresis>,
    /// Load-dependent stiffness (geometric stiffening); only for modal bodies.
    pub geometric: Option<Arc<GeometricStiffness>>,
}

impl Spring {
    /// Creates a linear spring. `K`: square, on the coordinates of the spring (N/m, N m/rad).
    pub fn linear(name: impl Into<String>, K: DMatrix<f64>, damping: Damping) -> Self {
        Self { name: name.into(), K, damping, curve: None, hysteresis: None, geometric: None }
    }

    /// Returns the spring with its forces multiplied by a factor; damping and geometric stiffness
    /// stay.
    #[must_use]
    pub fn stiffened(self, factor: f64) -> Self {
        Self {
            K: self.K * factor,
            curve: self.curve.map(|curve| curve.scaled(factor)),
            hysteresis: self.hysteresis.map(|law| law.scaled(factor)),
            ..self
        }
    }
}

impl From<(String, Matrix6<f64>, Damping)> for Spring {
    fn from((name, K, damping): (String, Matrix6<f64>, Damping)) -> Self {
        Self::linear(name, DMatrix::from_column_slice(6, 6, K.as_slice()), damping)
    }
}

/// A spring assigned to its coordinates: generalised force `-(K e + D ė)`.
#[derive(Clone, Debug)]
pub struct ElasticElement {
    /// Name for logs.
    pub name: String,
    /// Body behind the joint (distal part), or the modal body.
    pub body: usize,
    /// Index of its first coordinate in the model.
    pub coordinate: usize,
    /// Number of its coordinates.
    pub size: usize,
    /// Whether these are modal coordinates.
    pub modal: bool,
    /// Stiffness, size×size.
    pub K: DMatrix<f64>,
    /// Compliance `K^-1`.
    pub C: DMatrix<f64>,
    /// Damping.
    pub damping: Damping,
    /// See [`Spring::curve`]; with hysteresis, the curve of first loading.
    pub curve: Option<SpringCurve>,
    /// See [`Spring::hysteresis`].
    pub hysteresis: Option<Hysteresis>,
    /// See [`Spring::geometric`].
    pub geometric: Option<Arc<GeometricStiffness>>,
}

impl ElasticElement {
    /// Returns whether it is a single translation (m, N).
    pub fn slides(&self, model: &Model) -> bool {
        matches!(model.bodies()[self.body].motion, JointMotion::Axis(motion) if motion.slides())
    }

    /// Returns the stored energy (J) at its coordinates `e` with the joints at `q`.
    pub fn energy(&self, e: &[f64], q: &[f64]) -> f64 {
        match &self.curve {
            Some(curve) => curve.energy(e[0], q),
            None => {
                let columns = self.K.as_slice().chunks_exact(self.size);
                let row = |column: &[f64]| -> f64 { column.iter().zip(e).map(|(k, e)| k * e).sum() };
                columns.zip(e).map(|(column, e)| 0.5 * e * row(column)).sum()
            }
        }
    }

    /// Adds the elastic force (N, N m) with the joints at `q`: `f += K e`, or the torque of the
    /// curve.
    #[inline]
    pub(crate) fn add_spring_force(&self, e: &[f64], q: &[f64], f: &mut [f64]) {
        match &self.curve {
            Some(curve) => f[0] += curve.torque(e[0], q),
            None => add_product(self.K.as_slice(), e, f),
        }
    }
}

/// Damping of an elastic element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    /// Damping ratio of the arm's modes, weighted by the share of strain energy of this element in
    /// each mode.
    Modal(f64),
    /// `D = beta K` (s).
    StiffnessProportional(f64),
    /// `D = a M + b K` with the mass matrix of its own coordinates (1/s, s).
    Rayleigh(f64, f64),
    /// A damper per coordinate (N s/m, N m s/rad); the first `size` of them count.
    Dampers([f64; 6]),
}

impl Damping {
    /// Returns the damping scaled by `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Modal(zeta) => Self::Modal(factor * zeta),
            Self::StiffnessProportional(beta) => Self::StiffnessProportional(factor * beta),
            Self::Rayleigh(a, b) => Self::Rayleigh(factor * a, factor * b),
            Self::Dampers(d) => Self::Dampers(d.map(|d| factor * d)),
        }
    }
}

/// A change of the inertia of a body during the motion, such as a payload that is picked up.
#[derive(Clone, Debug, PartialEq)]
pub struct InertiaChange {
    /// Time of the change (s).
    pub t: f64,
    /// Index of the body.
    pub body: usize,
    /// New inertia about Bo, in B axes, including everything fixed to the body.
    pub inertia: SpatialInertia,
}

/// An arm on its motion: tree, springs, damping, drives and loads.
#[derive(Clone)]
pub struct Plant {
    /// Kinematic tree; its elastic joints and modal bodies are the springs.
    pub model: Arc<Model>,
    /// Springs, in coordinate order; one per elastic group of the model.
    pub elements: Vec<ElasticElement>,
    /// Damping matrix on the elastic coordinates.
    pub D: DMatrix<f64>,
    /// `beta` per element that approximates `D` (s); exact when stiffness-proportional. Used by
    /// SPOOK.
    pub tau: Vec<f64>,
    /// Whether `D` is block diagonal with `beta K` in the blocks.
    pub proportional: bool,
    /// Motion of the actuated joints; reference of the servos.
    pub motion: Arc<dyn PrescribedMotion>,
    /// Actuated coordinates driven by torque, ascending.
    pub torque_driven: Vec<usize>,
    /// Friction per actuated coordinate (empty: none).
    pub friction: Vec<Friction>,
    /// Controller of the joints driven by torque.
    pub servo: Option<Arc<Servo>>,
    /// External loads.
    pub loads: Vec<Load>,
    /// Changes of inertia, by time.
    pub inertia_changes: Vec<InertiaChange>,
    /// Transmission errors; see [`Plant::with_transmission_errors`].
    pub transmission: Vec<TransmissionError>,
    /// Friction that grows with the transmitted torque.
    pub load_friction: Vec<LoadFriction>,
    /// Gears that couple several joints; see [`Plant::with_coupling`].
    pub coupling: Option<GearCoupling>,
    /// Stiffness between elastic coordinates of coupled gears: row, column, entry; the symmetric
    /// entry is implied.
    pub cross_stiffness: Vec<(usize, usize, f64)>,
    /// Damping between elastic coordinates of coupled gears, in the same form.
    pub cross_damping: Vec<(usize, usize, f64)>,
    /// Natural modes at the start pose, drives locked.
    pub modes: Modes,
    /// Whether it serves equilibria alone: without modes and damping, so that links need no mass.
    pub at_rest: bool,
}

/// Sampled joint controllers; see [`ServoAxis`].
#[derive(Clone, Debug)]
pub struct Servo {
    /// Sampling period (s).
    pub sample_s: f64,
    /// One axis per joint driven by torque, in the order of [`Plant::torque_driven`].
    pub axes: Vec<ServoAxis>,
    /// Rigid robot for the feed-forward; its coordinates are the actuated ones.
    pub rigid: Arc<Model>,
}

/// Modes of `K_t φ = ω² M φ`, mass-normalised, ascending.
#[derive(Clone, Debug, Default)]
pub struct Modes {
    /// Angular frequencies (rad/s).
    pub omega: Vec<f64>,
    /// Shapes in the elastic coordinates, one column each; `Φᵀ M Φ = 1`.
    pub shapes: DMatrix<f64>,
    /// Elastic coordinates of the static pose.
    pub equilibrium: DVector<f64>,
    /// Maximum of `|K φ - ω² M φ| / |K φ|`: check of the eigensolver.
    pub residual: f64,
}

impl Modes {
    /// Returns the frequencies (Hz), ascending.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.omega.iter().map(|w| w / std::f64::consts::TAU).collect()
    }
}

impl Plant {
    /// Returns the damping ratio of the first mode, `φᵀ D φ / (2 ω)`; 0 without elastic coordinates.
    pub fn first_damping_ratio(&self) -> f64 {
        let Some(omega) = self.modes.omega.first() else { return 0.0 };
        let shape = self.modes.shapes.column(0);
        shape.dot(&(&self.D * shape)) / (2.0 * omega)
    }

    /// Returns the plant with the inertia of one body replaced (about Bo, B axes); modes and damping
    /// are not updated.
    #[must_use]
    pub fn with_inertia(&self, body: usize, inertia: SpatialInertia) -> Self {
        Self { model: Arc::new(self.model.with_inertia(body, inertia)), ..self.clone() }
    }

    /// Returns the plant with another motion; modes and damping are not updated.
    #[must_use]
    pub fn along(&self, motion: Arc<dyn PrescribedMotion>) -> Self {
        Self { motion, ..self.clone() }
    }

    /// Returns the number of free coordinates: joints driven by torque, then elastic ones.
    pub fn n_free(&self) -> usize {
        self.torque_driven.len() + self.model.n_elastic()
    }

    /// Returns the stiffness on the elastic coordinates: blocks of the elements plus cross
    /// stiffness of coupled gears. Nonlinear springs contribute their `K`. n×n; N/m, N m/rad.
    pub fn stiffness(&self) -> DMatrix<f64> {
        let n = self.model.n_elastic();
        let mut K = DMatrix::zeros(n, n);
        for element in &self.elements {
            let k = self.offset(element);
            K.view_mut((k, k), (element.size, element.size)).copy_from(&element.K);
        }
        for &(i, j, k) in &self.cross_stiffness {
            (K[(i, j)], K[(j, i)]) = (k, k);
        }
        K
    }

    /// Returns the first coordinate of an element within the elastic ones.
    pub fn offset(&self, element: &ElasticElement) -> usize {
        element.coordinate - self.model.n_actuated()
    }

    /// Returns the elastic energy (J) at all coordinates `q`, without transmission errors and
    /// losses of sliders.
    ///
    /// # Panics
    /// If `q` is not nv long.
    pub fn elastic_energy(&self, q: &[f64]) -> f64 {
        self.model.check_size("q", q.len());
        let own = |element: &ElasticElement| element.energy(&q[element.coordinate..][..element.size], q);
        let e = &q[self.model.n_actuated()..];
        self.cross_stiffness.iter().fold(self.elements.iter().map(own).sum(), |sum, &(i, j, k)| sum + k * e[i] * e[j])
    }

    /// Writes positions and velocities of the actuated joints at time `t` into `state` and their
    /// accelerations into `qddot`.
    ///
    /// # Panics
    /// If a vector is not nv long.
    pub fn prescribed_state(&self, t: f64, state: &mut State, qddot: &mut DVector<f64>) {
        self.model.check_size("q", state.q.len());
        self.model.check_size("qdot", state.qdot.len());
        self.model.check_size("qddot", qddot.len());
        let n = self.model.n_actuated();
        let (q, qdot) = (state.q.as_mut_slice(), state.qdot.as_mut_slice());
        self.motion.sample(t, &mut q[..n], &mut qdot[..n], &mut qddot.as_mut_slice()[..n]);
    }

    /// Returns all coordinates, nv: joints on the motion at time `t` (s), and elastic coordinates `e`.
    pub(crate) fn coordinates_at(&self, t: f64, e: &DVector<f64>) -> DVector<f64> {
        let (mut state, mut qddot) = (State::zeros(&self.model), DVector::zeros(self.model.nv()));
        self.prescribed_state(t, &mut state, &mut qddot);
        state.q.rows_mut(self.model.n_actuated(), e.len()).copy_from(e);
        state.q
    }

    /// Writes the external loads at time `t` into `data.F_ext`, for the poses in `data.X_WB`.
    pub(crate) fn apply_loads(&self, data: &mut Data, t: f64) {
        for load in &self.loads {
            data.F_ext[load.body] = Wrench::zeros();
        }
        for load in &self.loads {
            data.F_ext[load.body] += load.on_body(t, &data.X_WB[load.body]);
        }
    }

    /// Returns the friction torque of an actuated coordinate at a speed.
    pub(crate) fn friction_torque(&self, coordinate: usize, rate: f64) -> f64 {
        self.friction.get(coordinate).map_or(0.0, |f| f.torque(rate))
    }

    /// Returns the joint axis of a spring with one coordinate, for the constraint rows of SPOOK.
    pub(crate) fn single_axis(&self, body: usize) -> Option<AxisMotion> {
        match self.model.bodies()[body].motion {
            JointMotion::Axis(motion) => Some(motion),
            _ => None,
        }
    }
}
