//! Flexible arm in reduced coordinates: elastic coordinates and joints driven by torque are free,
//! all other joints are prescribed.
//!
//! ```text
//! M_ff ẍ + h_f(q, q̇, [q̈_p, 0]) + K x + D ẋ + friction(ẋ) = τ
//! ```
//! The residual is one Newton-Euler pass, the acceleration one hybrid-dynamics pass. Mass matrix,
//! damping and stiffness are dense in the free coordinates. Torques of a sampled controller are
//! constant between its samples. Discrete events are in `events`. Not here: integration.

use std::sync::Arc;

use flexarm_kinematics::{
    Data, FreeForces, JointMotion, Motions, Observer, Pose, Roles, State, Wrench, forward_kinematics, hybrid_dynamics,
    inverse_dynamics, kinetic_energy_of, mass_matrix_at_poses, potential_energy_of, world_poses,
};
use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector, Dyn};

use crate::arm::{ElasticElement, FlexibleArm, GeometricStiffness};
use crate::dense::{Loops, add_product, quickly};
use crate::elastic_tree::ElasticTree;
use crate::error::StepError;
use crate::events::{ArmDamping, EventQueue, StepStart, damping_after_changes};
use crate::gear::{GearState, LoadFriction};
use crate::mode_matrix::ModeMatrices;
use crate::servo::ServoState;
use crate::system::SecondOrderSystem;
use crate::tree_matrix::TreeMatrices;
use crate::workspaces::PooledWorkspace;

/// Maximum number of fixed-point passes for accelerations with load-dependent (geometric)
/// stiffness.
const GEOMETRIC_PASSES: usize = 12;

/// A flexible arm as a second-order system; see the module documentation.
#[derive(Clone)]
pub struct ReducedArm {
    pub(crate) arm: Arc<FlexibleArm>,
    pub(crate) data: PooledWorkspace<Data>,
    pub(crate) state: State,
    pub(crate) qddot: DVector<f64>,
    pub(crate) tau: DVector<f64>,
    roles: Roles,
    /// Free coordinates in the model's order.
    pub(crate) free: Vec<usize>,
    pub(crate) servo: Option<ServoState>,
    pub(crate) events: EventQueue,
    /// Damping after each change of inertia.
    pub(crate) dampings: Vec<ArmDamping>,
    /// Work done by the drives at jumps of prescribed velocities (J).
    pub(crate) struck: f64,
    geometric: bool,
    pub(crate) sampled_at: f64,
    pub(crate) step_start: StepStart,
    /// Storage of the factor of `M_ff` at velocity jumps.
    pub(crate) mass_factor: Option<Cholesky<f64, Dyn>>,
    pub(crate) shifted: DVector<f64>,
    /// Forces of the springs, or of load-dependent stiffness.
    pub(crate) forces: DVector<f64>,
    /// State of gear effects other than elasticity.
    pub(crate) gears: Option<Box<GearState>>,
    /// Tree of the elastic joints, if there are enough of them and they are damped by element.
    tree: Option<ElasticTree>,
    /// Modes that are eliminated first, if there are enough of them.
    modes: Option<HeldModes>,
    /// Equations of motion of the free coordinates only, if these suffice and the tree is
    /// supported.
    points: Option<PooledWorkspace<FreeForces>>,
    poses: Poses,
    /// Workspace of observations, if supported for this tree; created at the first observation.
    observer: Option<Option<PooledWorkspace<Observer>>>,
}

/// Location of the poses of the current state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Poses {
    /// In `data`.
    InData,
    /// In `points`, after a residual.
    InPoints,
    /// In neither place, after an observation.
    Nowhere,
}

/// Partition of the free coordinates into modes, which are eliminated first, and others.
#[derive(Clone, Debug)]
pub(crate) struct HeldModes {
    others: Vec<usize>,
    modes: Vec<usize>,
    /// Workspace for `c_D D + c_K K`, and for K, over all free coordinates.
    dense: DMatrix<f64>,
    K: DMatrix<f64>,
}

/// Minimum number of modes for elimination: with 16 a step takes the same time with a dense
/// inverse, with 40 12 instead of 19 us, with 80 25 instead of 74 (`examples/modal.rs`).
const FEWEST_MODES: usize = 16;

impl HeldModes {
    /// Returns the partition if steps are faster with the modes eliminated.
    pub(crate) fn that_pay(arm: &FlexibleArm) -> Option<Self> {
        let shift = |k: usize| k - arm.model.n_actuated() + arm.torque_driven.len();
        let modes: Vec<usize> = arm.model.held_modes().into_iter().map(shift).collect();
        if modes.len() < FEWEST_MODES || !arm.damps_by_element() {
            return None;
        }
        let driven = arm.torque_driven.len();
        let alone = |element: &ElasticElement| {
            let first = arm.offset(element);
            let D = arm.D.view((first, first), (element.size, element.size));
            (0..element.size)
                .filter(|k| modes.contains(&(driven + first + k)))
                .all(|k| element.curve.is_none() && is_alone(&element.K.as_view(), k) && is_alone(&D, k))
        };
        if !arm.elements.iter().all(alone) {
            return None;
        }
        let n = arm.n_free();
        let others = (0..n).filter(|k| !modes.contains(k)).collect();
        Some(Self { others, modes, dense: DMatrix::zeros(n, n), K: DMatrix::zeros(n, n) })
    }
}

/// Returns whether a coordinate is uncoupled in a matrix, up to round-off.
fn is_alone(A: &DMatrixView<'_, f64>, k: usize) -> bool {
    const ROUNDING: f64 = 1e-11;
    (0..A.nrows()).all(|j| j == k || A[(k, j)].abs() <= ROUNDING * (A[(k, k)] * A[(j, j)]).abs().sqrt())
}

impl ReducedArm {
    /// Creates the workspaces for the arm, reusing those of an earlier run if available.
    pub fn new(arm: impl Into<Arc<FlexibleArm>>) -> Self {
        let arm = arm.into();
        let model = &arm.model;
        let n = arm.n_free();
        let driven = arm.torque_driven.clone();
        let roles = Roles::new(model, |k| k < model.n_actuated() && !driven.contains(&k));
        // Load-dependent stiffness needs the spatial accelerations of the full pass.
        let geometric = arm.elements.iter().any(|e| e.geometric.is_some());
        let points = if geometric { None } else { arm.lend_points(&roles) };
        Self {
            data: arm.lend_data(),
            state: State::zeros(model),
            qddot: DVector::zeros(model.nv()),
            tau: DVector::zeros(model.nv()),
            free: roles.free_coordinates().to_vec(),
            roles,
            servo: arm.servo.clone().map(|servo| ServoState::new(servo, &arm)),
            events: EventQueue::of(&arm),
            dampings: damping_after_changes(&arm),
            struck: 0.0,
            geometric,
            sampled_at: f64::NAN,
            step_start: StepStart::new(model.n_actuated()),
            mass_factor: Cholesky::new(DMatrix::identity(n, n)),
            shifted: DVector::zeros(n),
            forces: DVector::zeros(n),
            gears: GearState::of(&arm),
            tree: ElasticTree::that_pays(&arm),
            modes: HeldModes::that_pay(&arm),
            points,
            poses: Poses::InData,
            observer: None,
            arm,
        }
    }

    /// Returns the arm.
    pub fn arm(&self) -> &FlexibleArm {
        &self.arm
    }

    /// Returns free coordinates and rates at `t = 0`: driven joints at position and speed of their
    /// reference, springs at `e`. A motion whose velocities jump at 0 starts from rest.
    pub(crate) fn start(&mut self, e: &DVector<f64>) -> Result<(DVector<f64>, DVector<f64>), StepError> {
        let (n, driven) = (self.arm.n_free(), self.arm.torque_driven.len());
        let (mut x, mut v) = (DVector::zeros(n), DVector::zeros(n));
        self.arm.prescribed_state(0.0, &mut self.state, &mut self.qddot);
        for (i, &k) in self.arm.torque_driven.iter().enumerate() {
            x[i] = self.state.q[k];
            v[i] = self.state.qdot[k];
        }
        x.rows_mut(driven, e.len()).copy_from(e);
        if let Some(gears) = &mut self.gears {
            gears.begin(&self.arm, self.state.q.as_slice(), e.as_slice());
        }
        if self.servo.is_some() {
            // Initialise the controller with the torques that keep the arm on its motion with the
            // springs as they are.
            let mut at_rest = DVector::zeros(n);
            for (i, &k) in self.arm.torque_driven.iter().enumerate() {
                at_rest[i] = self.qddot[k];
            }
            self.evaluate(0.0, &x, &v, &at_rest);
            let tau = self.data.tau.clone();
            if let Some(servo) = &mut self.servo {
                servo.hold(&tau);
            }
        }
        self.at_time(0.0, &x, &mut v)?;
        Ok((x, v))
    }

    /// Writes the joint motion at `t` (sampled once per time) and the free coordinates into the
    /// full state.
    pub(crate) fn set(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>) {
        let t = self.events.side(t);
        self.sample_joints(t);
        let n = self.arm.model.n_actuated();
        let driven = self.arm.torque_driven.len();
        for (i, &k) in self.arm.torque_driven.iter().enumerate() {
            self.state.q[k] = x[i];
            self.state.qdot[k] = v[i];
        }
        self.state.q.as_mut_slice()[n..].copy_from_slice(&x.as_slice()[driven..]);
        self.state.qdot.as_mut_slice()[n..].copy_from_slice(&v.as_slice()[driven..]);
        if !self.arm.loads.is_empty() {
            forward_kinematics(&self.arm.model, &mut self.data, &self.state.q);
            self.arm.apply_loads(&mut self.data, t);
        }
    }

    /// Checks that the loops of the arm close at the start.
    ///
    /// # Errors
    /// [`StepError::OpenLoop`].
    pub(crate) fn check_loops(&mut self, x: &DVector<f64>, v: &DVector<f64>) -> Result<(), StepError> {
        if self.arm.model.loops().is_empty() {
            return Ok(());
        }
        self.set(0.0, x, v);
        forward_kinematics(&self.arm.model, &mut self.data, &self.state.q);
        StepError::open_loop(&self.arm.model, &self.data, 0.0).map_or(Ok(()), Err)
    }

    /// Updates the workspaces after a change of the masses of the bodies.
    pub(crate) fn weigh(&mut self) {
        if let Some(points) = &mut self.points {
            points.weigh(&*self.arm.model);
            points.keep();
        }
        if let Some(Some(observer)) = &mut self.observer {
            observer.weigh(&self.arm.model);
            observer.keep();
        }
    }

    /// Computes the poses of the state in `data` if a residual or an observation has not left them
    /// there.
    fn place(&mut self) {
        if self.poses != Poses::InData {
            forward_kinematics(&self.arm.model, &mut self.data, &self.state.q);
        }
    }

    fn set_accelerations(&mut self, a: &DVector<f64>) {
        let (n, driven) = (self.arm.model.n_actuated(), self.arm.torque_driven.len());
        for (i, &k) in self.arm.torque_driven.iter().enumerate() {
            self.qddot[k] = a[i];
        }
        self.qddot.as_mut_slice()[n..].copy_from_slice(&a.as_slice()[driven..]);
    }

    /// Adds springs, dampers, friction and controller: `f += K x + D v + friction - τ`.
    fn add_forces(&mut self, x: &DVector<f64>, v: &DVector<f64>, f: &mut DVector<f64>) {
        let driven = self.arm.torque_driven.len();
        if self.gears.is_some() {
            return self.add_gear_forces(x, v, f);
        }
        for (i, &k) in self.arm.torque_driven.iter().enumerate() {
            f[i] += self.arm.friction_torque(k, v[i]);
            f[i] -= self.servo.as_ref().map_or(0.0, |s| s.torque[i]);
        }
        let (x, v, f) = (&x.as_slice()[driven..], &v.as_slice()[driven..], &mut f.as_mut_slice()[driven..]);
        for (k, element) in self.arm.elements.iter().enumerate() {
            let first = self.arm.offset(element);
            let range = first..first + element.size;
            if self.arm.proportional && element.curve.is_none() {
                quickly(Damped {
                    K: element.K.as_slice(),
                    tau: self.arm.tau[k],
                    x: &x[range.clone()],
                    v: &v[range.clone()],
                    y: &mut self.shifted.as_mut_slice()[..element.size],
                    f: &mut f[range],
                });
            } else {
                element.add_spring_force(&x[range.clone()], &[], &mut f[range.clone()]);
                if self.arm.proportional {
                    f[first] += self.arm.tau[k] * element.K[(0, 0)] * v[first];
                }
            }
        }
        if !self.arm.proportional {
            self.arm.add_damping(v, f);
        }
    }

    /// Works as [`ReducedArm::add_forces`] for arms with gear effects other than elasticity, at the
    /// state set before.
    #[cold]
    fn add_gear_forces(&mut self, x: &DVector<f64>, v: &DVector<f64>, f: &mut DVector<f64>) {
        let Self { arm, gears: Some(gears), state, servo, tau, .. } = self else { return };
        let driven = arm.torque_driven.len();
        let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
        gears.update(arm, q, qdot, &x.as_slice()[driven..], &v.as_slice()[driven..]);
        f.rows_mut(driven, gears.F.len()).axpy(1.0, &gears.F, 1.0);
        if driven == 0 {
            return;
        }
        // Motors: transmission error and friction minus the torque of the controller.
        let GearState { F, friction, .. } = &mut **gears;
        let load = |k: Option<usize>| k.map_or(0.0, |k| F[arm.offset(&arm.elements[k])]);
        arm.friction_torques(qdot, |law| load(law.element), friction);
        let motors = &mut tau.as_mut_slice()[..friction.len()];
        motors.copy_from_slice(friction);
        arm.add_motor_forces(q, F.as_slice(), motors);
        for (i, &k) in arm.torque_driven.iter().enumerate() {
            f[i] += motors[k] - servo.as_ref().map_or(0.0, |s| s.torque[i]);
        }
    }

    /// Adds the torques of transmission errors and friction to the actuated joints in `data.tau`,
    /// at the state set before.
    #[cold]
    fn add_gear_torques(&mut self, x: &DVector<f64>, v: &DVector<f64>) {
        let Self { arm, gears: Some(gears), state, data, qddot, .. } = self else { return };
        let (n, driven) = (arm.model.n_actuated(), arm.torque_driven.len());
        let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
        gears.update(arm, q, qdot, &x.as_slice()[driven..], &v.as_slice()[driven..]);
        let GearState { F, friction, .. } = &mut **gears;
        let tau = &mut data.tau.as_mut_slice()[..n];
        let rotor = |k: usize| arm.model.rotor_inertia(k) * qddot[k];
        let load = |law: &LoadFriction| match law.element {
            Some(k) => F[arm.offset(&arm.elements[k])],
            // A rigid gear transmits the torque of the joint without the share of its own rotor.
            None => tau[law.coordinate] - rotor(law.coordinate),
        };
        arm.friction_torques(qdot, load, friction);
        arm.add_motor_forces(q, F.as_slice(), tau);
        tau.iter_mut().zip(friction).for_each(|(tau, friction)| *tau += *friction);
    }

    fn add_geometric_forces(&self, x: &DVector<f64>, f: &mut DVector<f64>) {
        let driven = self.arm.torque_driven.len();
        add_geometric_forces(&self.arm, &self.data, &x.as_slice()[driven..], &mut f.as_mut_slice()[driven..]);
    }

    /// Computes poses, twists and all generalised forces at `t`; those of the actuated joints are
    /// the drive torques, friction included.
    pub(crate) fn evaluate(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>) {
        self.set(t, x, v);
        self.set_accelerations(a);
        self.poses = Poses::InData;
        inverse_dynamics(&self.arm.model, &mut self.data, &self.state, &self.qddot);
        self.add_joint_torques(x, v);
        world_poses(&self.arm.model, &mut self.data);
    }

    /// Works as [`ReducedArm::evaluate`] with the poses in `X_WB` and without twists; returns
    /// kinetic energy and potential energy of gravity (J).
    pub(crate) fn observe(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &DVector<f64>,
        X_WB: &mut [Pose],
    ) -> [f64; 2] {
        let is_plain = self.points.is_some() && self.arm.loads.is_empty();
        let make = || if is_plain { self.arm.lend_observer() } else { None };
        let Some(mut observer) = self.observer.take().unwrap_or_else(make) else {
            self.observer = Some(None);
            self.evaluate(t, x, v, a);
            X_WB.copy_from_slice(&self.data.X_WB);
            return [kinetic_energy_of(&self.arm.model, &self.data), potential_energy_of(&self.arm.model, &self.data)];
        };
        self.set(t, x, v);
        self.set_accelerations(a);
        self.poses = Poses::Nowhere;
        let Self { arm, data, state, qddot, .. } = self;
        let motions = Motions { q: state.q.as_slice(), qdot: state.qdot.as_slice(), qddot: qddot.as_slice() };
        let energies = observer.observe(&arm.model, motions, None, X_WB, data.tau.as_mut_slice());
        self.observer = Some(Some(observer));
        self.add_joint_torques(x, v);
        energies
    }

    /// Adds friction and gear torques to the actuated joints in `data.tau`, at the state set
    /// before.
    fn add_joint_torques(&mut self, x: &DVector<f64>, v: &DVector<f64>) {
        if self.gears.is_some() {
            return self.add_gear_torques(x, v);
        }
        for k in 0..self.arm.model.n_actuated() {
            self.data.tau[k] += self.arm.friction_torque(k, self.state.qdot[k]);
        }
    }

    /// Returns the torques currently held by the controller, in the order of
    /// [`FlexibleArm::torque_driven`]; empty without a controller.
    pub(crate) fn held_torques(&self) -> &[f64] {
        self.servo.as_ref().map_or(&[], |s| &s.torque)
    }
}

/// `f += K (x + tau v)` of a spring; `y` is workspace.
struct Damped<'a> {
    K: &'a [f64],
    tau: f64,
    x: &'a [f64],
    v: &'a [f64],
    y: &'a mut [f64],
    f: &'a mut [f64],
}

impl Loops for Damped<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { K, tau, x, v, y, f } = self;
        for ((y, x), v) in y.iter_mut().zip(x).zip(v) {
            *y = x + tau * v;
        }
        add_product(K, y, f);
    }
}

impl GeometricStiffness {
    fn matrices(&self) -> impl Iterator<Item = &DMatrix<f64>> {
        self.acceleration.iter().chain(&self.angular).chain(&self.centrifugal).chain(self.interface.iter().flatten())
    }
}

/// Adds the forces of load-dependent stiffness of modal bodies, for the loads of the last
/// Newton-Euler pass in `data`; `e` and `f` are over the elastic coordinates.
pub(crate) fn add_geometric_forces(arm: &FlexibleArm, data: &Data, e: &[f64], f: &mut [f64]) {
    for element in &arm.elements {
        let Some(geometric) = &element.geometric else { continue };
        let range = arm.offset(element)..arm.offset(element) + element.size;
        for (matrix, load) in geometric.matrices().zip(geometric_loads(arm, data, element.body, geometric)) {
            if load == 0.0 {
                continue;
            }
            for (column, eta) in matrix.as_slice().chunks_exact(matrix.nrows()).zip(&e[range.clone()]) {
                for (f, g) in f[range.clone()].iter_mut().zip(column) {
                    *f += load * g * eta;
                }
            }
        }
    }
}

/// Returns the loads in the order of [`GeometricStiffness::matrices`], from the last Newton-Euler
/// pass.
fn geometric_loads<'a>(
    arm: &'a FlexibleArm,
    data: &'a Data,
    body: usize,
    geometric: &'a GeometricStiffness,
) -> impl Iterator<Item = f64> + 'a {
    let (V, A) = (data.V[body], data.A[body]);
    let (w, a) = (V.angular, A.linear + V.angular.cross(&V.linear));
    let own = [
        a.x,
        a.y,
        a.z,
        A.angular.x,
        A.angular.y,
        A.angular.z,
        w.x * w.x,
        w.y * w.y,
        w.z * w.z,
        w.x * w.y,
        w.x * w.z,
        w.y * w.z,
    ];
    let wrenches = (0..geometric.interface.len()).flat_map(move |number| {
        // The load at the interface is the negative of the wrench that the attached body requires,
        // in link axes.
        let carried = arm.model.bodies().iter().enumerate().find(|(_, b)| {
            b.parent == body && matches!(b.motion, JointMotion::Interface { interface, .. } if interface == number)
        });
        let F = carried.map_or(Wrench::zeros(), |(i, _)| {
            let R = data.X_PB[i].rotation;
            Wrench::new(-(R * data.F[i].force), -(R * data.F[i].torque))
        });
        [F.force.x, F.force.y, F.force.z, F.torque.x, F.torque.y, F.torque.z]
    });
    own.into_iter().chain(wrenches)
}

impl ReducedArm {
    /// Checks that the mass matrix at the last coordinates is positive definite.
    #[cold]
    fn check_mass(&mut self, t: f64) -> Result<(), StepError> {
        let n = self.dimension();
        let mut M = DMatrix::zeros(n, n);
        self.mass(&mut M);
        let finite = M.iter().all(|m| m.is_finite());
        match finite && Cholesky::new(M).is_none() {
            true => Err(StepError::Singular { matrix: "mass matrix", t }),
            false => Ok(()),
        }
    }
}

impl SecondOrderSystem for ReducedArm {
    fn dimension(&self) -> usize {
        self.arm.n_free()
    }

    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        self.set(t, x, v);
        self.set_accelerations(a);
        let Self { arm, data, state, qddot, points, .. } = self;
        match points {
            Some(points) => {
                let motions = Motions { q: state.q.as_slice(), qdot: state.qdot.as_slice(), qddot: qddot.as_slice() };
                let loads = (!arm.loads.is_empty()).then_some(data.F_ext.as_slice());
                points.compute(motions, loads, r.as_mut_slice());
                self.poses = Poses::InPoints;
            }
            None => {
                inverse_dynamics(&arm.model, data, state, qddot);
                for (r, &k) in r.iter_mut().zip(&self.free) {
                    *r = data.tau[k];
                }
            }
        }
        self.add_forces(x, v, r);
        if self.geometric {
            self.add_geometric_forces(x, r);
        }
    }

    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        self.set(t, x, v);
        self.poses = Poses::InData;
        let mut forces = std::mem::replace(&mut self.forces, DVector::zeros(0));
        for pass in 0..GEOMETRIC_PASSES {
            forces.fill(0.0);
            if pass > 0 {
                self.add_geometric_forces(x, &mut forces);
            }
            self.add_forces(x, v, &mut forces);
            for (&k, f) in self.free.iter().zip(forces.iter()) {
                self.tau[k] = -f;
            }
            let Self { arm, data, state, roles, qddot, tau, .. } = self;
            hybrid_dynamics(&arm.model, data, state, roles, qddot, tau);
            let mut change = 0.0f64;
            for (a, &k) in a.iter_mut().zip(&self.free) {
                change = change.max((qddot[k] - *a).abs());
                *a = qddot[k];
            }
            if !self.geometric || (pass > 0 && change <= 1e-13 * a.amax()) {
                break;
            }
            // Update the loads for the accelerations just computed.
            inverse_dynamics(&self.arm.model, &mut self.data, &self.state, &self.qddot);
        }
        self.forces = forces;
        match a.iter().all(|a| a.is_finite()) {
            true => Ok(()),
            false => self.check_mass(t),
        }
    }

    fn mass(&mut self, M: &mut DMatrix<f64>) {
        if self.poses == Poses::InPoints
            && let Some(points) = &mut self.points
        {
            return points.mass(M.as_mut_slice());
        }
        self.place();
        mass_matrix_at_poses(&self.arm.model, &mut self.data);
        for (column, &l) in self.free.iter().enumerate() {
            for (row, &k) in self.free.iter().enumerate() {
                M[(row, column)] = self.data.M[(k, l)];
            }
        }
    }

    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, C: &mut DMatrix<f64>) {
        let driven = self.arm.torque_driven.len();
        C.as_mut_slice().fill(0.0);
        // Friction of the joints driven by torque.
        for (i, &k) in self.arm.torque_driven.iter().enumerate() {
            // A negative friction slope (Stribeck) is dropped to keep the matrix positive definite.
            C[(i, i)] = c_D * self.arm.friction.get(k).map_or(0.0, |f| f.slope(self.state.qdot[k]).max(0.0));
        }
        if let Some(gears) = &self.gears {
            let rates = self.state.qdot.as_slice();
            for (i, &row) in self.arm.torque_driven.iter().enumerate() {
                for (j, &column) in self.arm.torque_driven.iter().enumerate() {
                    C[(i, j)] = c_D * self.arm.friction_slope(row, column, rates, gears);
                }
            }
        }
        // Springs, including their dampers if these are proportional.
        for (k, element) in self.arm.elements.iter().enumerate() {
            let (first, size) = (driven + self.arm.offset(element), element.size);
            let damping = if self.arm.proportional { c_D * self.arm.tau[k] } else { 0.0 };
            if let Some(curve) = &element.curve {
                let slope = match &self.gears {
                    Some(gears) => gears.slope(&self.arm, k, element, curve),
                    None => curve.slope(self.state.q[element.coordinate], self.state.q.as_slice()),
                };
                C[(first, first)] += c_K * slope + damping * element.K[(0, 0)];
            } else {
                let mut block = C.view_mut((first, first), (size, size));
                block.zip_apply(&element.K, |c, k| *c += (c_K + damping) * k);
            }
        }
        for &(i, j, k) in &self.arm.cross_stiffness {
            C[(driven + i, driven + j)] += c_K * k;
            C[(driven + j, driven + i)] += c_K * k;
        }
        // Otherwise the damping couples the elements.
        if !self.arm.proportional {
            let ne = self.dimension() - driven;
            C.view_mut((driven, driven), (ne, ne)).zip_apply(&self.arm.D, |s, d| *s += c_D * d);
        }
    }

    fn stiffness(&mut self, K: &mut DMatrix<f64>) {
        let driven = self.arm.torque_driven.len();
        K.as_mut_slice().fill(0.0);
        for element in &self.arm.elements {
            let (first, size) = (driven + self.arm.offset(element), element.size);
            K.view_mut((first, first), (size, size)).copy_from(&element.K);
        }
        for &(i, j, k) in &self.arm.cross_stiffness {
            (K[(driven + i, driven + j)], K[(driven + j, driven + i)]) = (k, k);
        }
    }

    fn settle(&mut self, t: f64, x: &DVector<f64>) {
        if self.arm.hysteresis.is_empty() {
            return;
        }
        self.sample_joints(t);
        for (i, &k) in self.arm.torque_driven.iter().enumerate() {
            self.state.q[k] = x[i];
        }
        if let Some(gears) = &mut self.gears {
            gears.settle(&self.arm, self.state.q.as_slice(), &x.as_slice()[self.arm.torque_driven.len()..]);
        }
    }

    fn along_tree(&mut self, c_D: f64, c_K: f64, to: &mut TreeMatrices) -> bool {
        if self.tree.is_some() {
            self.place();
        }
        let Some(tree) = &mut self.tree else { return false };
        let placed = tree.place(&self.arm.model, &self.data, &self.state, &mut to.nodes);
        if placed {
            self.arm.blocks(c_D, c_K, to);
        }
        placed
    }

    fn with_modes(&mut self, c_D: f64, c_K: f64, to: &mut ModeMatrices) -> bool {
        let Some(mut held) = self.modes.take() else { return false };
        self.place();
        mass_matrix_at_poses(&self.arm.model, &mut self.data);
        self.damping_and_stiffness(c_D, c_K, &mut held.dense);
        self.stiffness(&mut held.K);
        let HeldModes { others, modes, dense: C, K } = &held;
        let (nb, free, M) = (others.len(), &self.free, &self.data.M);
        if to.mass.nrows() != nb || to.modes.len() != modes.len() {
            let zero = DMatrix::zeros(nb, nb);
            (to.mass, to.C, to.K) = (zero.clone(), zero.clone(), zero);
            to.coupling = DMatrix::zeros(nb, modes.len());
            to.others.clone_from(others);
            to.modes.clone_from(modes);
        }
        for (j, &column) in others.iter().enumerate() {
            for (i, &row) in others.iter().enumerate() {
                to.mass[(i, j)] = M[(free[row], free[column])];
                to.C[(i, j)] = C[(row, column)];
                to.K[(i, j)] = K[(row, column)];
            }
        }
        to.own.clear();
        for (j, &mode) in modes.iter().enumerate() {
            for (i, &row) in others.iter().enumerate() {
                to.coupling[(i, j)] = M[(free[row], free[mode])];
            }
            to.own.push([M[(free[mode], free[mode])], C[(mode, mode)], K[(mode, mode)]]);
        }
        self.modes = Some(held);
        true
    }
}
