//! SPOOK: compliant constraints in maximal coordinates.
//!
//! Every body has six degrees of freedom; every joint is six constraint rows with a compliance:
//! `K_S^-1` for an elastic joint, almost zero for a rigid one, whose distal frame must follow the
//! proximal frame displaced by the prescribed coordinate. One step solves
//!
//! ```text
//! [ M  -Gᵀ ] [ v⁺ ]   [ M v + h f                             ]
//! [ G   Σ  ] [ λ  ] = [ -(4/h) Υ g + Υ (G v + g_t) - g_t⁺      ]        x⁺ = x + h v⁺
//!
//! Σ = (4/h²) Υ K_S^-1,   Υ = 1/(1 + 4 τ/h)                        τ: damping time, D_S = τ K_S
//! ```
//! λ is an impulse; at rest `λ/h = -K g` for any h and τ. `g_t` is the explicit time rate of a
//! prescribed joint. The matrix is block tridiagonal (a tree of 6×6 blocks) and is eliminated from
//! the leaves to the base, O(bodies).
//!
//! A step ends where a load or a prescribed velocity jumps; the rest of it has its own step size,
//! and thus its own Σ and Υ.
//!
//! Frames: P, Q proximal and distal face of a joint, P = Q when undeformed. [`constraint`] contains
//! the rows, [`solve`] the elimination, [`pins`] the closure of loops, [`observe`] what a run
//! reports. Source: [Lacoursière 2007]; theory page, section 4.
//!
//! Not here: elimination of the rows (`solve`), joint rows (`constraint`), pins of loops (`pins`).

mod checks;
mod compliance;
pub(crate) mod constraint;
mod observe;
mod pins;
mod settings;
pub(crate) mod solve;

use std::sync::Arc;

use flexarm_kinematics::{
    BalancerPlace, Data, ElasticAngles, JointMotion, Model, PlacedBalancer, Pose, State, Twist, Wrench,
    forward_kinematics_velocity, rotation_vector,
};
use flexarm_spatial::products::{mul, sub, turn_symmetric};
use flexarm_spatial::{composed, quaternion};
use nalgebra::{DVector, Matrix3, UnitQuaternion, Vector3, Vector6};

use crate::error::StepError;
use crate::events::{EventQueue, SAME_TIME};
use crate::observation::Observation;
use crate::plant::Plant;
use crate::stepper::{Counts, LARGEST_DEFLECTION, Stepper};
use checks::{check_ends, check_known};
use compliance::{JointCompliance, joint_compliance, rigid_upsilon};
use constraint::Rows;
use pins::Pins;
use solve::{Sigma, Symmetric, TreeSolver, joined};

pub(super) use settings::ENTRY;
pub use settings::{ConstraintForm, SpookPreset, SpookSettings};

/// Compliance of a rigid joint (m/N, rad/(N m)): 1e4 N displace it by 1e-13 m.
const RIGID_COMPLIANCE: f64 = 1e-17;

/// A body of the tree in maximal coordinates.
#[derive(Clone, Debug)]
struct BodyState {
    /// Position of the centre of mass in the world.
    x: Vector3<f64>,
    /// Orientation of the body axes.
    R: UnitQuaternion<f64>,
    /// Velocity of the centre of mass and angular velocity, world axes.
    V: Twist,
    mass: f64,
    /// Inertia about the centre of mass, body axes.
    J: Matrix3<f64>,
    /// Centre of mass in body axes from Bo.
    com: Vector3<f64>,
}

impl BodyState {
    /// Returns the pose of the body frame B.
    fn X_WB(&self) -> Pose {
        let R = self.R.to_rotation_matrix();
        Pose::from_parts(sub(&self.x, &mul(R.matrix(), &self.com)).into(), R)
    }
}

/// Prescribed motion at one time.
#[derive(Clone, Debug)]
struct Sampled {
    /// Time, on its side of a jump (s).
    at: f64,
    q: DVector<f64>,
    qdot: DVector<f64>,
    qddot: DVector<f64>,
}

impl Sampled {
    fn new(joints: usize) -> Self {
        let zeros = DVector::zeros(joints);
        Self { at: f64::NAN, q: zeros.clone(), qdot: zeros.clone(), qddot: zeros }
    }

    /// Samples the motion at `t` unless it was already sampled there.
    fn take(&mut self, plant: &Plant, events: &EventQueue, t: f64) {
        let t = events.side(t);
        if t != self.at {
            let Self { at, q, qdot, qddot } = self;
            plant.motion.sample(t, q.as_mut_slice(), qdot.as_mut_slice(), qddot.as_mut_slice());
            *at = t;
        }
    }
}

/// The stepper; see the module documentation.
#[derive(Clone)]
pub struct Spook {
    plant: Plant,
    h: f64,
    steps: u64,
    t: f64,
    /// Step size of `compliance` and of the impulses in `lambda` (s).
    dt: f64,
    events: EventQueue,
    settings: SpookSettings,
    /// Index 0 is the world and never moves.
    bodies: Vec<BodyState>,
    compliance: Vec<JointCompliance>,
    /// Σ in the axes of the rows.
    sigma: Vec<Sigma>,
    rows: Vec<Rows>,
    lambda: Vec<Vector6<f64>>,
    solver: TreeSolver,
    pins: Pins,
    /// Blocks of the bodies before the elimination; used for arms with loops.
    masses: Vec<Symmetric>,
    /// Prescribed motion at the current time and at the end of the step.
    now: Sampled,
    next: Sampled,
    /// Prescribed velocities at the start of the step, consistent with those of the bodies.
    rates: DVector<f64>,
    /// Poses of the bodies at the current time.
    poses: Vec<Pose>,
    velocities: Vec<Vector6<f64>>,
    trial: Vec<BodyState>,
    loads: Vec<Vector6<f64>>,
}

impl Spook {
    /// Starts at `t = 0` at rest with elastic coordinates `e`.
    ///
    /// # Errors
    /// [`StepError::Setup`] for a wrong number of elastic coordinates, and for features that are not
    /// supported in maximal coordinates: mimic joints, torque drives, payload changes, nonlinear
    /// springs, gear effects other than elasticity, and end links without mass or moments of
    /// inertia; [`StepError::ModalLinks`] for modal links.
    pub fn new(plant: Plant, h: f64, settings: SpookSettings, e: &DVector<f64>) -> Result<Self, StepError> {
        check_known(&plant)?;
        let (found, expected) = (e.len(), plant.model.n_elastic());
        if found != expected {
            return Err(StepError::Setup(format!("{found} elastic coordinates are given, the arm has {expected}")));
        }
        let model = plant.model.clone();
        check_ends(&model)?;
        let (mut state, mut qddot) = (State::zeros(&model), DVector::zeros(model.nv()));
        plant.prescribed_state(0.0, &mut state, &mut qddot);
        let na = model.n_actuated();
        state.q.rows_mut(na, e.len()).copy_from(e);
        let mut events = EventQueue::of(&plant);
        events.pass_jumps(0.0);
        if plant.motion.velocity_jumps().iter().any(|t| t.abs() <= SAME_TIME) {
            state.qdot.fill(0.0);
        }
        let rates = state.qdot.rows(0, na).clone_owned();
        let mut data = Data::new(&model);
        forward_kinematics_velocity(&model, &mut data, &state);

        let bodies: Vec<BodyState> = (0..model.bodies().len()).map(|i| body_state(&model, &data, i)).collect();
        let compliance: Vec<_> = (0..bodies.len()).map(|i| joint_compliance(&plant, i, h, settings.preset)).collect();
        let n = bodies.len();
        let loads = vec![Vector6::zeros(); n];
        let mut spook = Self {
            solver: TreeSolver::new(model.bodies().iter().map(|b| b.parent).collect()),
            pins: Pins::new(&model),
            masses: vec![Symmetric::zeros(); n],
            plant,
            h,
            steps: 0,
            t: 0.0,
            dt: h,
            events,
            settings,
            trial: bodies.clone(),
            bodies,
            sigma: compliance.iter().map(|compliance| compliance.sigma).collect(),
            compliance,
            rows: vec![Rows::zeros(); n],
            lambda: vec![Vector6::zeros(); n],
            now: Sampled::new(na),
            next: Sampled::new(na),
            rates,
            poses: vec![Pose::identity(); n],
            velocities: vec![Vector6::zeros(); n],
            loads,
        };
        // Compute the impulses of the first step, so that forces are available before it.
        spook.solve(h)?;
        Ok(spook)
    }
}

/// Returns the state of body i from `data`.
fn body_state(model: &Model, data: &Data, i: usize) -> BodyState {
    let (body, X) = (&model.bodies()[i], data.X_WB[i]);
    let (com, mass) = (body.inertia.com(), body.inertia.mass);
    let w = X.rotation * data.V[i].angular;
    let linear = X.rotation * (data.V[i].linear + data.V[i].angular.cross(&com));
    BodyState {
        x: X.translation.vector + X.rotation * com,
        R: UnitQuaternion::from_rotation_matrix(&X.rotation),
        V: Twist::new(linear, w),
        mass,
        J: if mass > 0.0 { body.inertia.inertia_com() } else { Matrix3::zeros() },
        com,
    }
}

impl Stepper for Spook {
    fn time(&self) -> f64 {
        self.t
    }

    fn step(&mut self) -> Result<(), StepError> {
        let (start, end) = (self.steps as f64 * self.h, (self.steps + 1) as f64 * self.h);
        loop {
            let stop = self.events.next(self.t, end).filter(|t| *t < end).unwrap_or(end);
            let dt = if self.t == start && stop == end { self.h } else { stop - self.t };
            self.advance(stop, dt)?;
            self.events.pass_jumps(stop);
            if stop == end {
                self.steps += 1;
                return Ok(());
            }
        }
    }

    fn observe(&mut self, out: &mut Observation) {
        let (h, t) = (self.dt, self.t);
        self.now.take(&self.plant, &self.events, t);
        let n = self.plant.model.n_actuated();
        out.t = t;
        out.model.clone_from(&self.plant.model);
        out.q.rows_mut(0, n).copy_from(&self.now.q);
        out.qdot.rows_mut(0, n).copy_from(&self.now.qdot);
        out.qddot.fill(f64::NAN);
        let (mut kinetic, mut potential) = self.observe_bodies(out);
        for i in 1..self.bodies.len() {
            // Mean force over the last step; before the first step, over that step.
            self.observe_joint(i, self.lambda[i] / h, out);
        }
        for balancer in self.plant.model.balancers() {
            potential += balancer.law.energy(balancer.length(&out.X_WB, out.q.as_slice()));
        }
        // Drives: friction and rotors are not part of the constraints.
        for (k, rate) in self.now.qdot.iter().enumerate() {
            out.drive[k] += self.plant.friction_torque(k, *rate);
        }
        for body in self.plant.model.bodies().iter().skip(1).filter(|b| b.armature != 0.0) {
            let k = body.coordinate;
            out.drive[k] += body.armature * self.now.qddot[k];
            kinetic += 0.5 * body.armature * self.now.qdot[k].powi(2);
        }
        out.power = [out.drive.dot(&out.qdot.rows(0, n)), self.load_power(), self.damping_power(&out.qdot)];
        out.energy = [kinetic, potential, self.plant.elastic_energy(out.q.as_slice())];
    }

    fn counts(&self) -> Counts {
        Counts { steps: self.steps, evaluations: self.steps, factorisations: self.steps }
    }

    fn change_masses(&mut self, _arm: &Arc<Plant>) -> Result<(), StepError> {
        Err(StepError::NotInMaximal(checks::CHANGES))
    }

    fn copy(&self) -> Option<Box<dyn Stepper>> {
        Some(Box::new(self.clone()))
    }
}

impl Spook {
    /// Returns the relative displacement of the two faces of the joint of body i and its rate at
    /// the current poses, in the local form.
    fn deflection_now(&self, i: usize, angles: ElasticAngles) -> (Vector6<f64>, Vector6<f64>) {
        let body = &self.plant.model.bodies()[i];
        let (parent, child) = (&self.bodies[body.parent], &self.bodies[i]);
        let (X_WP, X_WQ) = (parent.X_WB() * body.X_PJ, child.X_WB());
        let rows = Rows::new(ConstraintForm::Local, angles, &X_WP, &parent.x, &X_WQ, &child.x);
        (rows.g, rows.G.of_parent(&parent.V.to_vector()) + rows.G.of_child(&child.V.to_vector()))
    }

    /// Computes velocities and impulses of the step from the current time; poses stay unchanged.
    fn solve(&mut self, t_next: f64) -> Result<(), StepError> {
        let t = self.t;
        // Rates are taken at the end of the step, with the new velocities; positions at its start,
        // for g.
        self.next.take(&self.plant, &self.events, t_next);
        self.now.take(&self.plant, &self.events, t);
        for (pose, body) in self.poses.iter_mut().zip(&self.bodies) {
            *pose = body.X_WB();
        }
        self.update_rows()?;
        self.update_loads();
        self.update_body_blocks();

        self.update_right_hand_sides();
        // Without loops the tree is the whole system.
        let Self { rows, sigma, solver, velocities, lambda, pins, masses, .. } = self;
        let singular = || StepError::Singular { matrix: "constraint matrix", t };
        if pins.is_empty() {
            return solver.solve(rows, sigma, velocities, lambda).map_err(|_| singular());
        }
        if let Some(k) = pins.update(&self.plant.model, &self.poses, &self.bodies) {
            return Err(StepError::OpenLoop { t, name: self.plant.model.loops()[k].name.clone() });
        }
        masses.copy_from_slice(&solver.M);
        solver.solve(rows, sigma, velocities, lambda).map_err(|_| singular())?;
        // With loops: the opened tree, then the impulses of the pins that close it.
        let h = self.dt;
        let upsilon = rigid_upsilon(self.settings.preset);
        let of_pins = [h, upsilon, RIGID_COMPLIANCE * 4.0 / (h * h) * upsilon];
        let closed = pins.close((velocities, lambda), &self.bodies, of_pins, |momenta, (v, lambda)| {
            solver.M.copy_from_slice(masses);
            solver.b.fill(Vector6::zeros());
            solver.s.fill(Vector6::zeros());
            for (body, momentum) in momenta {
                solver.b[body] += momentum;
            }
            solver.solve(rows, sigma, v, lambda)
        });
        closed.map_err(|_| singular())?.ok_or_else(singular)
    }

    /// Updates the right-hand sides of the joints, and their compliances in the axes of their rows.
    fn update_right_hand_sides(&mut self) {
        let h = self.dt;
        for (i, body) in self.plant.model.bodies().iter().enumerate().skip(1) {
            let (row, JointCompliance { sigma, upsilon }) = (&self.rows[i], &self.compliance[i]);
            if let Sigma::Soft(C, K) = sigma
                && self.settings.form == ConstraintForm::Global
            {
                let R = self.poses[body.parent].rotation * body.X_PJ.rotation;
                self.sigma[i] = Sigma::Soft(C.turned(R.matrix()), K.turned(R.matrix()));
            }
            // s = Υ (-(4/h) g + G v), the rate of the constraint towards zero.
            let (parent, child) = (&self.bodies[body.parent], &self.bodies[i]);
            let rate = row.G.of_parent(&parent.V.to_vector()) + row.G.of_child(&child.V.to_vector());
            let mut s = row.g * (-4.0 / h * upsilon) + rate * *upsilon;
            if matches!(body.motion, JointMotion::Axis(_)) && !body.elastic && body.coordinate < self.rates.len() {
                // g_t = -S q̇ at the start and at the end of the step.
                s -= row.S * (upsilon * self.rates[body.coordinate] - self.next.qdot[body.coordinate]);
            }
            self.solver.s[i] = s;
        }
    }

    /// Updates the rows of every joint, including the effect of its prescribed coordinate.
    fn update_rows(&mut self) -> Result<(), StepError> {
        let (h, t) = (self.dt, self.t);
        for (i, body) in self.plant.model.bodies().iter().enumerate().skip(1) {
            let (parent, child) = (&self.bodies[body.parent], &self.bodies[i]);
            let (on, X_WQ) = (&self.poses[body.parent], &self.poses[i]);
            let X_WP = || composed(on, &body.X_PJ);
            self.rows[i] = match body.motion {
                JointMotion::Elastic(angles) => {
                    Rows::new(self.settings.form, angles, &X_WP(), &parent.x, X_WQ, &child.x)
                }
                // A single spring is measured from its relaxed position.
                _ if body.elastic => {
                    Rows::new(ConstraintForm::Local, Default::default(), &X_WP(), &parent.x, X_WQ, &child.x)
                }
                JointMotion::Axis(motion) => {
                    let q = match self.now.q.get(body.coordinate) {
                        Some(q) => *q,
                        // The coordinate of a dependent joint follows from its bodies.
                        None => {
                            let X = X_WP().inverse() * X_WQ;
                            let turn = rotation_vector(X.rotation.matrix());
                            motion.coordinate_of(&joined(&X.translation.vector, &turn))
                        }
                    };
                    let moved = composed(on, &body.X_PB(q));
                    Rows::hard(Some(motion), &moved, &parent.x, X_WQ, &child.x)
                }
                JointMotion::Interface { .. } | JointMotion::Welded => {
                    Rows::hard(None, &X_WP(), &parent.x, X_WQ, &child.x)
                }
            };
            let deflection = self.rows[i].g.amax();
            if deflection > LARGEST_DEFLECTION || deflection.is_nan() {
                let what = format!("joint {:?} came apart by {deflection:.1e} m or rad", body.joint);
                return Err(StepError::Diverged { t, h, what });
            }
        }
        Ok(())
    }

    /// Updates external loads and balancer forces on each body, at Bo in world axes.
    fn update_loads(&mut self) {
        self.loads.iter_mut().for_each(|load| *load = Vector6::zeros());
        for load in &self.plant.loads {
            let X_WB = self.poses[load.body];
            let F = load.on_body(self.events.side(self.t), &X_WB);
            self.loads[load.body] += Wrench::new(X_WB.rotation * F.force, X_WB.rotation * F.torque).to_vector();
        }
        let model = self.plant.model.clone();
        for balancer in model.balancers() {
            for (body, F_W) in balancer.wrenches(&self.poses, self.joint_value(balancer)) {
                self.loads[body] += F_W.to_vector();
            }
        }
    }

    /// Returns the joint value of a balancer at the current time: prescribed coordinates and
    /// deflections of springs.
    fn joint_value(&self, balancer: &PlacedBalancer) -> f64 {
        let BalancerPlace::Joint { terms, offset, .. } = &balancer.place else { return 0.0 };
        let model = &self.plant.model;
        let coordinate = |k: usize| {
            let joint = &model.coordinates()[k];
            match model.bodies()[joint.body].motion {
                _ if k < model.n_actuated() => self.now.q[k],
                JointMotion::Axis(motion) => {
                    motion.coordinate_of(&self.deflection_now(joint.body, Default::default()).0)
                }
                JointMotion::Elastic(angles) => self.deflection_now(joint.body, angles).0[joint.component],
                JointMotion::Interface { .. } | JointMotion::Welded => 0.0,
            }
        };
        terms.iter().fold(*offset, |x, (k, c)| x + c * coordinate(*k))
    }

    /// Updates the body blocks: mass, momentum, impulse of gravity, gyroscopic moment and loads,
    /// about the centre of mass in world axes.
    fn update_body_blocks(&mut self) {
        let (h, gravity) = (self.dt, self.plant.model.gravity);
        for (i, body) in self.bodies.iter().enumerate().skip(1) {
            // Mass matrix M.
            let R = self.poses[i].rotation.matrix();
            let J = turn_symmetric(R, &body.J);
            let mass = Matrix3::from_diagonal_element(body.mass);
            self.solver.M[i] = Symmetric { vv: mass, vw: Matrix3::zeros(), ww: J };
            // Momentum M v + h f.
            let spin = mul(&J, &body.V.angular);
            let load = &self.loads[i];
            let (F, T): (Vector3<f64>, Vector3<f64>) = (load.fixed_rows::<3>(0).into(), load.fixed_rows::<3>(3).into());
            let lever = -mul(R, &body.com);
            let force = gravity * body.mass + F;
            let torque = T + lever.cross(&F) - body.V.angular.cross(&spin);
            self.solver.b[i] = joined(&(body.V.linear * body.mass + force * h), &(spin + torque * h));
        }
    }

    /// Takes a step of size `h` to `t_next`. The old poses are kept until all new ones are known to
    /// be valid.
    fn advance(&mut self, t_next: f64, h: f64) -> Result<(), StepError> {
        if h != self.dt {
            self.dt = h;
            for (i, compliance) in self.compliance.iter_mut().enumerate() {
                *compliance = joint_compliance(&self.plant, i, h, self.settings.preset);
                self.sigma[i] = compliance.sigma;
            }
        }
        // x⁺ = x + h v⁺, R⁺ = exp(h ω⁺) R.
        self.solve(t_next)?;
        let mut largest = 0.0f64;
        for ((trial, body), v) in self.trial.iter_mut().zip(&self.bodies).zip(&self.velocities).skip(1) {
            trial.V = Twist::from_vector(v);
            trial.x = body.x + trial.V.linear * h;
            trial.R = quaternion(&(trial.V.angular * h)) * body.R;
            trial.R.renormalize_fast();
            let speed = v.amax();
            largest = if speed.is_finite() { largest.max(speed) } else { f64::INFINITY };
        }
        if largest > 1e5 {
            let what = format!("a body reached {largest:.1e} m/s or rad/s");
            return Err(StepError::Diverged { t: t_next, h, what });
        }
        std::mem::swap(&mut self.bodies, &mut self.trial);
        self.rates.copy_from(&self.next.qdot);
        std::mem::swap(&mut self.now, &mut self.next);
        self.t = t_next;
        Ok(())
    }
}
