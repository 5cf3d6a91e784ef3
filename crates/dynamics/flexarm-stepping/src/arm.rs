//! Flexible arm, the input of every stepper: tree, springs, damping, drives, motion, external
//! loads.
//!
//! Immutable and shared; each stepper derives its own state from it. Start at [`FlexibleArm::new`].
//!
//! The free coordinates x of an arm are those of the joints driven by torque, followed by the
//! elastic ones. All other joints are prescribed.

use std::sync::Arc;

use flexarm_kinematics::{AxisMotion, Data, JointMotion, Model, SpatialInertia, State, Wrench, mass_matrix};
use nalgebra::{DMatrix, DVector, Matrix6};

use crate::dense::add_product;
use crate::drive::{Friction, ServoAxis, SpringCurve};
use crate::error::StepError;
use crate::events::SAME_TIME;
use crate::gear::{GearCoupling, Hysteresis, LoadFriction, TransmissionError};
use crate::load::Load;
use crate::modes::{Modes, modes_at};
use crate::motion::PrescribedMotion;
use crate::workspaces::Workspaces;

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
    /// Load-dependent stiffness (geometric stiffening); only for modal bodies.
    pub geometric: Option<Arc<GeometricStiffness>>,
}

impl From<(String, Matrix6<f64>, Damping)> for Spring {
    fn from((name, K, damping): (String, Matrix6<f64>, Damping)) -> Self {
        let K = DMatrix::from_column_slice(6, 6, K.as_slice());
        Self { name, K, damping, curve: None, geometric: None }
    }
}

/// Geometric stiffness of a modal body: contributions of loads to its stiffness, n×n per unit load.
///
/// `K + Σ α_i acceleration_i + Σ ω_i ω_j centrifugal_ij` accounts for the body's own inertia forces
/// under acceleration and rotation, in body axes. Loads of the attached bodies are in `interface`.
#[derive(Clone, Debug, PartialEq)]
pub struct GeometricStiffness {
    /// Per unit acceleration of the origin, gravity subtracted (s²/m).
    pub acceleration: [DMatrix<f64>; 3],
    /// Per unit angular acceleration.
    pub angular: [DMatrix<f64>; 3],
    /// Per `ω_x², ω_y², ω_z², ω_x ω_y, ω_x ω_z, ω_y ω_z`.
    pub centrifugal: [DMatrix<f64>; 6],
    /// Per unit force and moment at each interface, link axes.
    pub interface: Vec<[DMatrix<f64>; 6]>,
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
    /// `K^-1`.
    pub C: DMatrix<f64>,
    /// Damping.
    pub damping: Damping,
    /// See [`Spring::curve`].
    pub curve: Option<SpringCurve>,
    /// See [`Spring::geometric`].
    pub geometric: Option<Arc<GeometricStiffness>>,
}

impl ElasticElement {
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

/// Tree, springs, damping, drives and motion.
#[derive(Clone)]
pub struct FlexibleArm {
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
    /// Transmission errors; see [`FlexibleArm::with_transmission_errors`].
    pub transmission: Vec<TransmissionError>,
    /// Gears with hysteresis; see [`FlexibleArm::with_hysteresis`].
    pub hysteresis: Vec<Hysteresis>,
    /// Friction that grows with the transmitted torque.
    pub load_friction: Vec<LoadFriction>,
    /// Gears that couple several joints; see [`FlexibleArm::with_coupling`].
    pub coupling: Option<GearCoupling>,
    /// Stiffness between elastic coordinates of coupled gears: row, column, entry; the symmetric
    /// entry is implied.
    pub cross_stiffness: Vec<(usize, usize, f64)>,
    /// Damping between elastic coordinates of coupled gears, in the same form.
    pub cross_damping: Vec<(usize, usize, f64)>,
    /// Natural modes at the start pose, drives locked.
    pub modes: Modes,
    /// Reusable workspaces, shared with all copies of the arm.
    pub workspaces: Workspaces,
}

/// Sampled joint controllers; see [`ServoAxis`].
#[derive(Clone, Debug)]
pub struct Servo {
    /// Sampling period (s).
    pub sample_s: f64,
    /// One axis per joint driven by torque, in the order of [`FlexibleArm::torque_driven`].
    pub axes: Vec<ServoAxis>,
    /// Rigid robot for the feed-forward; its coordinates are the actuated ones.
    pub rigid: Arc<Model>,
}

impl FlexibleArm {
    /// Returns the damping ratio of the first mode; 0 without elastic coordinates.
    pub fn first_damping_ratio(&self) -> f64 {
        let Some(omega) = self.modes.omega.first() else { return 0.0 };
        let shape = self.modes.shapes.column(0);
        shape.dot(&(&self.D * shape)) / (2.0 * omega)
    }

    /// Creates an arm from a model and the springs of its elastic groups.
    ///
    /// `springs` lists name, stiffness and damping in the order of `model.elastic()`. The modal
    /// damping matrix and the modes are computed at the static equilibrium at `t = 0`.
    ///
    /// # Errors
    /// [`StepError::Setup`] if counts or sizes differ, [`StepError::Singular`] if a stiffness is
    /// not positive definite, [`StepError::NoEquilibrium`] if the arm cannot carry its weight.
    pub fn new<S: Into<Spring>>(
        model: Arc<Model>,
        springs: Vec<S>,
        motion: Arc<dyn PrescribedMotion>,
    ) -> Result<Self, StepError> {
        let groups = model.elastic();
        if springs.len() != groups.len() {
            return Err(StepError::Setup(format!(
                "the model has {} elastic joints but {} springs were given",
                groups.len(),
                springs.len()
            )));
        }
        let mut elements = Vec::new();
        for (spring, group) in springs.into_iter().zip(groups) {
            let Spring { name, K, damping, curve, geometric } = spring.into();
            if K.shape() != (group.size, group.size) {
                let (rows, size) = (K.nrows(), group.size);
                let text = format!("the stiffness of {name:?} has {rows} rows, its joint has {size} coordinates");
                return Err(StepError::Setup(text));
            }
            let Some(C) = K.clone().cholesky().map(|c| c.inverse()) else {
                return Err(StepError::Singular { matrix: "stiffness of an elastic joint", t: 0.0 });
            };
            let (body, coordinate, size, modal) = (group.body, group.coordinate, group.size, group.modal);
            elements.push(ElasticElement { name, body, coordinate, size, modal, K, C, damping, curve, geometric });
        }
        let n = model.n_elastic();
        let mut arm = Self {
            workspaces: Workspaces::of(&model),
            model,
            elements,
            D: DMatrix::zeros(n, n),
            tau: Vec::new(),
            proportional: true,
            motion,
            torque_driven: Vec::new(),
            friction: Vec::new(),
            servo: None,
            loads: Vec::new(),
            inertia_changes: Vec::new(),
            transmission: Vec::new(),
            hysteresis: Vec::new(),
            load_friction: Vec::new(),
            coupling: None,
            cross_stiffness: Vec::new(),
            cross_damping: Vec::new(),
            modes: Modes::default(),
        };
        arm.update_modes_and_damping()?;
        Ok(arm)
    }

    /// Returns the arm with constant external loads: (body, wrench at Bo in world axes).
    ///
    /// # Errors
    /// As [`FlexibleArm::new`].
    pub fn with_loads(self, loads: Vec<(usize, Wrench)>) -> Result<Self, StepError> {
        self.with_timed_loads(loads.into_iter().map(|(body, F)| Load::constant(body, F)).collect())
    }

    /// Returns the arm with external loads that change with time.
    ///
    /// # Errors
    /// As [`FlexibleArm::new`].
    pub fn with_timed_loads(mut self, loads: Vec<Load>) -> Result<Self, StepError> {
        self.loads = loads;
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns the arm with inertias that change during the motion; changes at t ≤ 0 apply from the
    /// start.
    ///
    /// # Errors
    /// As [`FlexibleArm::new`].
    pub fn with_inertia_changes(mut self, mut changes: Vec<InertiaChange>) -> Result<Self, StepError> {
        changes.sort_by(|a, b| a.t.total_cmp(&b.t));
        self.inertia_changes = changes;
        self.carry_from_start()?;
        Ok(self)
    }

    /// Applies the inertia changes that are due at the start, so that the initial equilibrium
    /// includes them.
    pub(crate) fn carry_from_start(&mut self) -> Result<(), StepError> {
        let due = self.inertia_changes.iter().take_while(|change| change.t <= SAME_TIME).count();
        for change in self.inertia_changes.drain(..due) {
            self.model = Arc::new(self.model.with_inertia(change.body, change.inertia));
        }
        if due > 0 { self.update_modes_and_damping() } else { Ok(()) }
    }

    /// Returns the arm with some joints driven by torque, under a controller.
    ///
    /// # Errors
    /// [`StepError::Setup`] if the axes are not ascending actuated coordinates, the rigid robot has
    /// a different number of coordinates, friction of an axis depends on its load without a
    /// gearbox, or an axis without inertia behind it has no rotor.
    pub fn with_servo(mut self, servo: Servo) -> Result<Self, StepError> {
        let n = self.model.n_actuated();
        self.torque_driven = servo.axes.iter().map(|a| a.coordinate).collect();
        let sorted = self.torque_driven.windows(2).all(|w| w[0] < w[1]);
        if !sorted || self.torque_driven.last().is_some_and(|&k| k >= n) {
            let text = format!("servo axes {:?} must be ascending coordinates below {n}", self.torque_driven);
            return Err(StepError::Setup(text));
        }
        if servo.rigid.nv() != n {
            let text = format!("the servo's rigid robot has {} coordinates, the arm has {n} drives", servo.rigid.nv());
            return Err(StepError::Setup(text));
        }
        for &k in &self.torque_driven {
            let mut bodies = self.model.bodies().iter().enumerate().skip(1);
            let body = bodies.find(|(_, b)| b.coordinate == k && !b.elastic);
            let bends = |i: usize| self.model.elastic().iter().any(|g| g.modal && g.body == i);
            let friction = self.load_friction.iter().find(|law| law.coordinate == k && law.element.is_none());
            if friction.is_some() {
                let joint = &self.model.coordinates()[k].joint;
                let text = format!(
                    "joint {joint:?} is driven by torque and has friction that grows with its load: give it a gearbox, whose torque is the load"
                );
                return Err(StepError::Setup(text));
            }
            if let Some((i, body)) = body
                && body.inertia.mass == 0.0
                && !bends(i)
                && body.armature <= 0.0
            {
                let text = format!(
                    "joint {:?} is driven by torque through a spring: its motor needs an inertia (motor_inertia and ratio)",
                    body.joint
                );
                return Err(StepError::Setup(text));
            }
        }
        self.servo = Some(Arc::new(servo));
        Ok(self)
    }

    /// Returns the arm with the inertia of one body replaced (about Bo, B axes); modes and damping
    /// are not updated.
    #[must_use]
    pub fn with_inertia(&self, body: usize, inertia: SpatialInertia) -> Self {
        Self { model: Arc::new(self.model.with_inertia(body, inertia)), ..self.clone() }
    }

    /// Returns the arm with another motion; modes and damping are not updated.
    #[must_use]
    pub fn along(&self, motion: Arc<dyn PrescribedMotion>) -> Self {
        Self { motion, ..self.clone() }
    }

    /// Returns the number of elastic coordinates.
    pub fn n_elastic_coordinates(&self) -> usize {
        self.model.n_elastic()
    }

    /// Returns the number of free coordinates: joints driven by torque, then elastic ones.
    pub fn n_free(&self) -> usize {
        self.torque_driven.len() + self.model.n_elastic()
    }

    /// Returns the stiffness on the elastic coordinates: blocks of the elements plus cross
    /// stiffness of coupled gears. Nonlinear springs contribute their `K`.
    pub fn stiffness(&self) -> DMatrix<f64> {
        let n = self.n_elastic_coordinates();
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
    pub fn elastic_energy(&self, q: &[f64]) -> f64 {
        let own = |element: &ElasticElement| element.energy(&q[element.coordinate..][..element.size], q);
        let e = &q[self.model.n_actuated()..];
        self.cross_stiffness.iter().fold(self.elements.iter().map(own).sum(), |sum, &(i, j, k)| sum + k * e[i] * e[j])
    }

    /// Writes positions and velocities of the actuated joints at time `t` into `state` and their
    /// accelerations into `qddot`.
    pub fn prescribed_state(&self, t: f64, state: &mut State, qddot: &mut DVector<f64>) {
        let n = self.model.n_actuated();
        let (q, qdot) = (state.q.as_mut_slice(), state.qdot.as_mut_slice());
        self.motion.sample(t, &mut q[..n], &mut qdot[..n], &mut qddot.as_mut_slice()[..n]);
    }

    /// Writes the external loads at time `t` into `data.F_ext`, for the poses in `data.X_WB`.
    pub fn apply_loads(&self, data: &mut Data, t: f64) {
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

    /// Recomputes the modes at `t = 0` and the damping matrix that depends on them; to be called
    /// after fields were changed directly.
    ///
    /// # Errors
    /// As [`FlexibleArm::new`].
    pub fn update_modes_and_damping(&mut self) -> Result<(), StepError> {
        let n = self.n_elastic_coordinates();
        if n == 0 {
            return Ok(());
        }
        self.modes = modes_at(self, 0.0)?;
        self.proportional = self.cross_stiffness.is_empty()
            && self.elements.iter().all(|e| matches!(e.damping, Damping::StiffnessProportional(_)));
        let first = self.modes.omega[0];
        self.tau = self
            .elements
            .iter()
            .map(|e| match e.damping {
                Damping::Modal(zeta) => 2.0 * zeta / first,
                Damping::StiffnessProportional(beta) => beta,
                Damping::Rayleigh(a, b) => a / (first * first) + b,
                // Factor that gives the same trace.
                Damping::Dampers(d) => d[..e.size].iter().sum::<f64>() / e.K.trace(),
            })
            .collect();
        self.D.fill(0.0);

        // D = M Φ diag(2 ζ ω) Φᵀ M, ζ of each mode weighted by strain energy, plus the blocks of
        // the elements.
        let M = self.mass_at_start();
        if !self.damps_by_element() {
            self.add_modal_damping(&M);
        }
        for element in &self.elements {
            let (k, size) = (element.coordinate - self.model.n_actuated(), element.size);
            let mut block = self.D.view_mut((k, k), (size, size));
            match element.damping {
                Damping::Modal(_) => {}
                Damping::StiffnessProportional(beta) => block += &element.K * beta,
                Damping::Rayleigh(a, b) => block += &element.K * b + M.view((k, k), (size, size)) * a,
                Damping::Dampers(d) => {
                    for c in 0..size.min(6) {
                        block[(c, c)] += d[c];
                    }
                }
            }
        }
        for &(i, j, d) in &self.cross_damping {
            self.D[(i, j)] += d;
            if i != j {
                self.D[(j, i)] += d;
            }
        }
        Ok(())
    }

    /// Returns the mass matrix of the elastic coordinates at the pose at which the modes are
    /// computed.
    fn mass_at_start(&self) -> DMatrix<f64> {
        let (model, n) = (&self.model, self.n_elastic_coordinates());
        let (mut state, mut qddot) = (State::zeros(model), DVector::zeros(model.nv()));
        self.prescribed_state(0.0, &mut state, &mut qddot);
        state.q.rows_mut(model.n_actuated(), n).copy_from(&self.modes.equilibrium);
        let mut data = self.lend_data();
        let M = mass_matrix(model, &mut data, &state.q);
        M.view((model.n_actuated(), model.n_actuated()), (n, n)).clone_owned()
    }

    /// Returns the modal damping ratio of the element of an elastic coordinate.
    fn modal_ratio(&self, offset: usize) -> f64 {
        let own = self.elements.iter().find(|e| (self.offset(e)..self.offset(e) + e.size).contains(&offset));
        own.map_or(0.0, |e| if let Damping::Modal(ratio) = e.damping { ratio } else { 0.0 })
    }

    fn add_modal_damping(&mut self, M: &DMatrix<f64>) {
        for (j, omega) in self.modes.omega.iter().enumerate() {
            let phi = self.modes.shapes.column(j);
            let (mut zeta, mut total) = (0.0, 0.0);
            for element in &self.elements {
                let x = phi.rows(self.offset(element), element.size);
                let energy = x.dot(&(&element.K * x));
                total += energy;
                if let Damping::Modal(z) = element.damping {
                    zeta += z * energy;
                }
            }
            for &(i, j, k) in &self.cross_stiffness {
                let energy = k * phi[i] * phi[j];
                total += 2.0 * energy;
                zeta += energy * (self.modal_ratio(i) + self.modal_ratio(j));
            }
            let Mphi = M * phi;
            self.D.ger(2.0 * zeta / total * omega, &Mphi, &Mphi, 1.0);
        }
    }
}
