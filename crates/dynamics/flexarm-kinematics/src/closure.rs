//! Closed chains: planar loops closed by a pin, treated as dependent joints of the tree.
//!
//! A pin on link A passes through an eye of link B. In the plane of the loop this gives two
//! equations, which determine two joints of the loop. All algorithms see only the tree of the
//! independent coordinates. `p_AB` is the position of the eye relative to A, E the two axes of A
//! perpendicular to the pin, q the independent and q_d the dependent coordinates:
//!
//! ```text
//! c(q, q_d) = Eᵀ p_AB = 0                                                     position             (1)
//! q̇_d = T q̇            T = -J_d^-1 J                                          J = ∂c/∂q            (2)
//! q̈_d = T q̈ + γ        γ = -J_d^-1 (J̇ q̇ + J̇_d q̇_d)                            acceleration         (3)
//! τ   = τ_t + Tᵀ τ_d    M = [1; T]ᵀ M_t [1; T]                                 virtual work         (4)
//! ∂τ/∂q = [1; T]ᵀ (∂τ_t/∂q_t) [1; T] + Σ_d τ_d ∂²q_d/∂q²                       statics              (5)
//! ```
//! τ_t and M_t belong to the opened tree with all its coordinates and come from the ordinary
//! recursions. The two dependent joints and the pin form a triangle whose sides follow from the
//! independent coordinates. (1) therefore has two closed-form solutions, the two assembly modes; a
//! loop keeps the mode in which it was built. Newton's method on (1) starts from the closed form
//! and adds the effect of out-of-plane deflection and the last digits. Hence q_d is a function of q
//! only and does not depend on the history.
//!
//! Loops may depend on each other: dependent joints of one loop may be part of another. They are
//! solved in sequence. Not here: reading loops from robot files, springs.

use std::f64::consts::{FRAC_PI_2, TAU};

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, DVector, Matrix2, Rotation3, Unit, Vector2, Vector3};

use crate::axis_motion::AxisMotion;
use crate::data::{Data, State, begin, joint_position};
use crate::kinematics::{joint_column_rates, joint_columns, move_bodies as move_tree, place_and_measure};
use crate::mechanism::Mechanism;
use crate::model::{Body, Frame, JointMotion, Model, ModelError};
use crate::rnea::balanced;

/// Angular tolerance on joint axes being parallel or perpendicular to the pin axis (rad).
pub const LOOP_AXIS_TOLERANCE_RAD: f64 = 1e-6;
/// Minimum angle between the two columns of J_d at assembly (rad). Nearer to a dead point, the loop
/// cannot be distinguished from its mirror image.
const DEAD_RAD: f64 = 1e-4;
/// Maximum number of Newton iterations after the closed form. Rigid links need one as confirmation,
/// flexible links three or four.
const MOST_ITERATIONS: usize = 12;

/// Pin joint that closes a chain of links in a plane: the eye on one link stays on the axis of the
/// pin on another.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopClosure {
    /// Unique name.
    pub name: String,
    /// Name of the link whose origin is on the pin axis.
    pub pin: String,
    /// Axis of the pin, in the frame of the `pin` link.
    pub axis: Unit<Vector3<f64>>,
    /// Name of the link whose origin is the eye.
    pub eye: String,
    /// The two joints of the loop that are determined by the others.
    pub dependent: [String; 2],
    /// Joint values near which the loop is assembled (rad or m); joints not listed are at zero.
    pub at: Vec<(String, f64)>,
}

/// Loop closure placed on the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedLoop {
    /// Name of the loop.
    pub name: String,
    /// Bodies moved by its dependent joints.
    pub dependent: [usize; 2],
    /// Bodies that carry the pin and the eye.
    pub ends: [usize; 2],
    /// Values of the dependent joints in the assembly configuration (rad or m).
    pub start: [f64; 2],
    /// Difference between `start` and the requested values (rad or m).
    pub start_miss: [f64; 2],
    /// First dependent coordinate in the tree; the second one follows it.
    first: usize,
    common: usize,
    /// Bodies outward of the common body, to the pin and to the eye.
    chains: [Vec<usize>; 2],
    X_pin: Pose,
    p_eye: Vector3<f64>,
    /// Tree coordinates that move the loop, without its own dependent ones.
    moved_by: Vec<usize>,
    /// Selected solution of (1), 1 or -1.
    root: f64,
    shape: Shape,
    /// Corner of the transmission angle, opposite the side with the driving joints; `None` for the
    /// minimum over all corners.
    corner: Option<usize>,
}

/// Location of the dependent joints: both on one chain (`inner` is the inner one), or one on each.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    OneChain { chain: usize, inner: usize },
    BothChains { of_pin: usize },
}

/// Closed loops at the last coordinates, with the workspace of the tree.
#[derive(Clone, Debug)]
pub(crate) struct LoopData {
    /// Tree coordinates: independent, then dependent.
    q: Vec<f64>,
    qdot: Vec<f64>,
    qddot: Vec<f64>,
    tau: DVector<f64>,
    M: DMatrix<f64>,
    solved: Solved,
    rates: LoopRates,
    free: CholeskyRoom,
}

/// Positions of the dependent joints and (2).
#[derive(Clone, Debug)]
struct Solved {
    /// Rows of (2), one per dependent coordinate, nv long.
    T: Vec<f64>,
    nv: usize,
    /// `∂c/∂q` of each loop, two rows per coordinate of the tree.
    J: Vec<Vec<Vector2<f64>>>,
    /// `J_d^-1` of each loop.
    inverse: Vec<Matrix2<f64>>,
    /// Transmission angle of each loop (rad).
    angle: Vec<f64>,
    /// First loop that cannot be closed.
    open: Option<usize>,
    /// Poses in the common body.
    X: Vec<Pose>,
}

/// (3) and the time derivative of T in (2) at tree velocities.
#[derive(Clone, Debug)]
pub(crate) struct LoopRates {
    X: Vec<Pose>,
    v: Vec<Vector3<f64>>,
    w: Vec<Vector3<f64>>,
    Jdot: Vec<Vector2<f64>>,
    gamma: Vec<f64>,
    /// Laid out as `T`.
    Tdot: Vec<f64>,
}

impl LoopRates {
    fn new(model: &Model) -> Self {
        let (n, nd) = (model.bodies.len(), model.dependent().len());
        Self {
            X: vec![Pose::identity(); n],
            v: vec![Vector3::zeros(); n],
            w: vec![Vector3::zeros(); n],
            Jdot: vec![Vector2::zeros(); model.nv() + nd],
            gamma: vec![0.0; nd],
            Tdot: vec![0.0; nd * model.nv()],
        }
    }
}

impl LoopData {
    pub(crate) fn new(model: &Model) -> Self {
        let (nv, nd, loops) = (model.nv(), model.dependent().len(), model.loops.len());
        let n = nv + nd;
        Self {
            q: vec![0.0; n],
            qdot: vec![0.0; n],
            qddot: vec![0.0; n],
            tau: DVector::zeros(n),
            M: DMatrix::zeros(n, n),
            solved: Solved {
                T: vec![0.0; nd * nv],
                nv,
                J: vec![vec![Vector2::zeros(); n]; loops],
                inverse: vec![Matrix2::zeros(); loops],
                angle: vec![FRAC_PI_2; loops],
                open: None,
                X: vec![Pose::identity(); model.bodies.len()],
            },
            rates: LoopRates::new(model),
            free: CholeskyRoom::default(),
        }
    }

    /// Calls `add` with each independent coordinate that moves the dependent coordinate k, and the
    /// entry of T.
    #[inline]
    pub(crate) fn each_leader(&self, k: usize, add: &mut impl FnMut(usize, f64)) {
        self.solved.row(k).iter().enumerate().filter(|(_, t)| **t != 0.0).for_each(|(j, t)| add(j, *t));
    }

    /// As [`Self::each_leader`], for all independent coordinates and with the entry of Ṫ.
    pub(crate) fn each_leader_rate(&self, k: usize, mut add: impl FnMut(usize, f64, f64)) {
        let first = (k - self.solved.nv) * self.solved.nv;
        let rates = &self.rates.Tdot[first..first + self.solved.nv];
        self.solved.row(k).iter().zip(rates).enumerate().for_each(|(j, (t, rate))| add(j, *t, *rate));
    }

    /// Tree velocities from (2) and tree accelerations from (3); `None` stands for zero.
    fn follow(&mut self, model: &Model, data: &Data, qdot: Option<&[f64]>, qddot: Option<&[f64]>) {
        let nv = self.solved.nv;
        match qdot {
            None => self.qdot.fill(0.0),
            Some(qdot) => {
                self.qdot[..nv].copy_from_slice(qdot);
                self.solved.carry_over(&mut self.qdot);
            }
        }
        match qddot {
            None => self.qddot.fill(0.0),
            Some(qddot) => {
                self.qddot[..nv].copy_from_slice(qddot);
                self.solved.carry_over(&mut self.qddot);
            }
        }
        if qdot.is_some() {
            self.solved.rates(model, data, &self.q, &self.qdot, &mut self.rates, false);
            self.qddot[nv..].iter_mut().zip(&self.rates.gamma).for_each(|(a, gamma)| *a += gamma);
        }
    }

    /// Adds the pin forces to the joint wrenches of the opened tree; uses up the efforts `τ_d`.
    ///
    /// A force f on the eye, and -f on the pin, relieves the dependent joints: `J_dᵀ f = τ_d` (f in
    /// the axes of the pin). A pin also loads the dependent joints of earlier loops, so that the
    /// last loop comes first.
    fn add_pin_forces(&mut self, model: &Model, data: &mut Data) {
        let Self { solved, rates, tau, .. } = self;
        for (k, loop_) in model.loops.iter().enumerate().rev() {
            let tau_d = Vector2::new(tau[loop_.first], tau[loop_.first + 1]);
            let f = solved.inverse[k].transpose() * tau_d;
            for &j in loop_.moved_by.iter().filter(|j| **j >= solved.nv) {
                tau[j] -= solved.J[k][j].dot(&f);
            }
            loop_.place_chains(model, data, &mut rates.X);
            let (A, p_B) = loop_.ends_at(&rates.X);
            let force = A.rotation * Vector3::new(f.x, f.y, 0.0);
            for (chain, sign) in loop_.chains.iter().zip([1.0, -1.0]) {
                for &i in chain {
                    let R = rates.X[i].rotation.inverse().matrix() * sign;
                    let moment = (p_B - rates.X[i].translation.vector).cross(&force);
                    data.F[i].force += R * force;
                    data.F[i].torque += R * moment;
                }
            }
        }
    }
}

impl Solved {
    fn row(&self, k: usize) -> &[f64] {
        let first = (k - self.nv) * self.nv;
        &self.T[first..first + self.nv]
    }

    /// `x_d = T x`.
    fn carry_over(&self, x: &mut [f64]) {
        let (x, x_d) = x.split_at_mut(self.nv);
        for (x_d, row) in x_d.iter_mut().zip(self.T.chunks_exact(self.nv.max(1))) {
            *x_d = row.iter().zip(&*x).map(|(t, x)| t * x).sum();
        }
    }

    /// Computes the dependent coordinates from (1) into `q`, the joint poses of the loops into
    /// `data`, and (2).
    fn positions(&mut self, model: &Model, data: &mut Data, q: &mut [f64]) {
        self.open = None;
        for loop_ in &model.loops {
            q[loop_.first..loop_.first + 2].copy_from_slice(&loop_.start);
        }
        begin(model, data, q);
        for (k, loop_) in model.loops.iter().enumerate() {
            for &i in loop_.chains.iter().flatten() {
                // Joints solved by an earlier loop are kept.
                let found = model.loops[..k].iter().any(|other| other.dependent.contains(&i));
                if !found {
                    joint_position(model, data, i, q);
                }
            }
            self.close(model, data, q, k);
        }
    }

    /// Solves one loop: closed form, Newton iterations, then (2).
    fn close(&mut self, model: &Model, data: &mut Data, q: &mut [f64], k: usize) {
        let loop_ = &model.loops[k];
        // Closed form.
        loop_.place_chains(model, data, &mut self.X);
        let start = loop_.triangle(model, &self.X).solve(loop_.root);
        let mut x = match start {
            Some(turn) => [loop_.start[0] + turn[0], loop_.start[1] + turn[1]],
            None => [f64::NAN; 2],
        };
        // Newton's method on (1), with J at the current poses.
        let mut last = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            for (body, x) in loop_.dependent.into_iter().zip(x) {
                let own = &model.bodies[body];
                if let JointMotion::Axis(motion) = own.motion {
                    data.X_PB[body] = own.X_PJ * motion.pose(x);
                }
            }
            loop_.place_chains(model, data, &mut self.X);
            let (c, size) = loop_.gap(&self.X);
            loop_.jacobian(model, data, &self.X, &mut self.J[k]);
            let J_d = Matrix2::from_columns(&[self.J[k][loop_.first], self.J[k][loop_.first + 1]]);
            self.inverse[k] = J_d.try_inverse().unwrap_or_else(|| Matrix2::from_element(f64::NAN));
            let gap = c.norm();
            // Stops at rounding level, where the residual no longer decreases.
            if gap <= f64::EPSILON * size || gap >= 0.5 * last || gap.is_nan() {
                break;
            }
            last = gap;
            let step = self.inverse[k] * c;
            x = [x[0] - step.x, x[1] - step.y];
        }
        let (c, size) = loop_.gap(&self.X);
        let closed = c.norm() <= 1e-9 * size && self.inverse[k].iter().all(|x| x.is_finite());
        if !closed {
            x = [f64::NAN; 2];
            self.open = self.open.or(Some(k));
        }
        q[loop_.first..loop_.first + 2].copy_from_slice(&x);
        self.angle[k] = loop_.transmission(model, &self.X, &self.J[k]);
        self.slopes(loop_, k);
    }

    /// (2) of one loop, after the loops it depends on.
    fn slopes(&mut self, loop_: &PlacedLoop, k: usize) {
        let (nv, inverse) = (self.nv, self.inverse[k]);
        let (before, own) = self.T.split_at_mut((loop_.first - nv) * nv);
        let (first, second) = own[..2 * nv].split_at_mut(nv);
        first.fill(0.0);
        second.fill(0.0);
        let mut add = |j: usize, c: Vector2<f64>| {
            let t = inverse * c;
            first[j] -= t.x;
            second[j] -= t.y;
        };
        for &j in &loop_.moved_by {
            match j < nv {
                true => add(j, self.J[k][j]),
                false => {
                    let row = &before[(j - nv) * nv..][..nv];
                    row.iter().enumerate().filter(|(_, t)| **t != 0.0).for_each(|(i, t)| add(i, self.J[k][j] * *t));
                }
            }
        }
    }

    /// (3) at the tree velocities `qdot`, and Ṫ if `with_T`.
    fn rates(&self, model: &Model, data: &Data, q: &[f64], qdot: &[f64], to: &mut LoopRates, with_T: bool) {
        let nv = self.nv;
        for (k, loop_) in model.loops.iter().enumerate() {
            loop_.place_chains(model, data, &mut to.X);
            loop_.move_chains(model, data, q, qdot, to);
            let (J, Jdot) = (&self.J[k], &to.Jdot);
            let minus = -self.inverse[k];
            // J̇ q̇ over all coordinates, plus the γ of dependent joints of earlier loops.
            let own = [loop_.first, loop_.first + 1];
            let all = loop_.moved_by.iter().copied().chain(own);
            let mut c = all.fold(Vector2::zeros(), |sum, j| sum + Jdot[j] * qdot[j]);
            for &j in loop_.moved_by.iter().filter(|j| **j >= nv) {
                c += J[j] * to.gamma[j - nv];
            }
            let gamma = minus * c;
            let d = loop_.first - nv;
            (to.gamma[d], to.gamma[d + 1]) = (gamma.x, gamma.y);
            if with_T {
                self.slope_rates(loop_, k, minus, to);
            }
        }
    }

    /// `Ṫ = -J_d^-1 (J̇ + J̇_d T)`.
    fn slope_rates(&self, loop_: &PlacedLoop, k: usize, minus: Matrix2<f64>, to: &mut LoopRates) {
        let (nv, d) = (self.nv, loop_.first - self.nv);
        let LoopRates { Jdot, Tdot, .. } = to;
        let J = &self.J[k];
        for i in 0..nv {
            let mut c = Jdot[loop_.first] * self.T[d * nv + i] + Jdot[loop_.first + 1] * self.T[(d + 1) * nv + i];
            for &j in &loop_.moved_by {
                if j == i {
                    c += Jdot[j];
                } else if j >= nv {
                    let at = (j - nv) * nv + i;
                    c += Jdot[j] * self.T[at] + J[j] * Tdot[at];
                }
            }
            let rate = minus * c;
            Tdot[d * nv + i] = rate.x;
            Tdot[(d + 1) * nv + i] = rate.y;
        }
    }
}

impl PlacedLoop {
    /// Pose `X_AP` of the pin in the body that carries it, pin axis along z.
    pub fn pin(&self) -> &Pose {
        &self.X_pin
    }

    /// Position `p_BE_B` of the eye in the body that carries it (m).
    pub fn eye(&self) -> &Vector3<f64> {
        &self.p_eye
    }

    /// Poses of the loop's bodies in the common body.
    fn place_chains(&self, model: &Model, data: &Data, X: &mut [Pose]) {
        X[self.common] = Pose::identity();
        for &i in self.chains.iter().flatten() {
            X[i] = X[model.bodies[i].parent] * data.X_PB[i];
        }
    }

    /// Pose of the pin and position of the eye in the common body.
    fn ends_at(&self, X: &[Pose]) -> (Pose, Vector3<f64>) {
        let eye = &X[self.ends[1]];
        (X[self.ends[0]] * self.X_pin, eye.rotation * self.p_eye + eye.translation.vector)
    }

    /// Residual of (1) (m), and the size of the loop (m).
    fn gap(&self, X: &[Pose]) -> (Vector2<f64>, f64) {
        let (A, p_B) = self.ends_at(X);
        let p = A.rotation.inverse() * (p_B - A.translation.vector);
        let size = self.chains.iter().flatten().map(|&i| X[i].translation.vector.amax());
        (p.xy(), size.chain([p_B.amax(), A.translation.vector.amax()]).fold(0.0, f64::max))
    }

    /// `∂c/∂q`, two rows per coordinate of the tree; zero for coordinates that do not move the
    /// loop.
    fn jacobian(&self, model: &Model, data: &Data, X: &[Pose], J: &mut [Vector2<f64>]) {
        J.fill(Vector2::zeros());
        let (A, p_B) = self.ends_at(X);
        let R_A = A.rotation.inverse();
        for (chain, sign) in self.chains.iter().zip([-1.0, 1.0]) {
            for &i in chain {
                let r = p_B - X[i].translation.vector;
                joint_columns(model, data, i, X[i].rotation.matrix(), |k, l, a| {
                    J[k] += (R_A * (l + a.cross(&r))).xy() * sign;
                });
            }
        }
    }

    /// Velocities in the axes of the common body, and the time derivative of the Jacobian.
    fn move_chains(&self, model: &Model, data: &Data, q: &[f64], qdot: &[f64], to: &mut LoopRates) {
        let LoopRates { X, v, w, Jdot, .. } = to;
        (v[self.common], w[self.common]) = (Vector3::zeros(), Vector3::zeros());
        // Velocities of the bodies, from the common body outward.
        for &i in self.chains.iter().flatten() {
            let parent = model.bodies[i].parent;
            let arm = X[i].translation.vector - X[parent].translation.vector;
            let (mut v_i, mut w_i) = (v[parent] + w[parent].cross(&arm), w[parent]);
            joint_columns(model, data, i, X[i].rotation.matrix(), |k, l, a| {
                v_i += l * qdot[k];
                w_i += a * qdot[k];
            });
            (v[i], w[i]) = (v_i, w_i);
        }
        // Columns of J̇ in A axes: d/dt (l + a × r) - w_A × (l + a × r).
        let (A, p_B) = self.ends_at(X);
        let [a, b] = self.ends;
        let v_B = v[b] + w[b].cross(&(p_B - X[b].translation.vector));
        let (R_A, w_A) = (A.rotation.inverse(), w[a]);
        Jdot.fill(Vector2::zeros());
        for (chain, sign) in self.chains.iter().zip([-1.0, 1.0]) {
            for &i in chain {
                let (r, rdot) = (p_B - X[i].translation.vector, v_B - v[i]);
                let R = X[i].rotation.matrix();
                joint_column_rates(model, data, i, R, &w[i], q, qdot, |k, [l, a, ldot, adot]| {
                    let column = l + a.cross(&r);
                    let rate = ldot + adot.cross(&r) + a.cross(&rdot) - w_A.cross(&column);
                    Jdot[k] += (R_A * rate).xy() * sign;
                });
            }
        }
    }

    /// The loop as a triangle in the plane normal to the pin, at the joint poses in `X`.
    fn triangle(&self, model: &Model, X: &[Pose]) -> Triangle {
        let (A, p_B) = self.ends_at(X);
        let R = A.rotation.inverse();
        let flat = |p: &Vector3<f64>| (R * (p - A.translation.vector)).xy();
        let joint = |which: usize| {
            let body = self.dependent[which];
            let axis = model.bodies[body].motion_axis();
            let axis_A = R * (X[body].rotation * axis);
            let slides = model.bodies[body].slides();
            let way = if slides { axis_A.xy() } else { Vector2::new(axis_A.z.signum(), 0.0) };
            FlatJoint { slides, at: flat(&X[body].translation.vector), way }
        };
        let (p_A, p_B) = (Vector2::zeros(), flat(&p_B));
        Triangle { joints: [joint(0), joint(1)], ends: [p_A, p_B], shape: self.shape }
    }

    /// Transmission angle (rad), 90 degrees at best: the angle between the two triangle sides
    /// without driving joints. With a sliding dependent joint it is the angle between the two
    /// directions in which the dependent joints move the pin.
    fn transmission(&self, model: &Model, X: &[Pose], J: &[Vector2<f64>]) -> f64 {
        let between = |a: Vector2<f64>, b: Vector2<f64>| (a.x * b.y - a.y * b.x).abs().atan2(a.dot(&b).abs());
        if self.dependent.iter().any(|&body| model.bodies[body].slides()) {
            return between(J[self.first], J[self.first + 1]);
        }
        let Triangle { joints, ends, .. } = self.triangle(model, X);
        let corners = [joints[0].at, joints[1].at, ends[1]];
        let angle = |k: usize| {
            let [a, b] = [1, 2].map(|step| corners[(k + step) % 3] - corners[k]);
            between(a, b)
        };
        match self.corner {
            Some(k) => angle(k),
            None => (0..3).map(angle).fold(FRAC_PI_2, f64::min),
        }
    }
}

/// Dependent joint projected onto the plane of the loop.
#[derive(Clone, Copy, Debug)]
struct FlatJoint {
    slides: bool,
    at: Vector2<f64>,
    /// Direction of a sliding joint; for a revolute joint, x is the sign of its axis along the pin
    /// axis.
    way: Vector2<f64>,
}

/// The loop in its plane: the dependent joints and the two end points to be joined.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    joints: [FlatJoint; 2],
    ends: [Vector2<f64>; 2],
    shape: Shape,
}

fn angle_of(v: &Vector2<f64>) -> f64 {
    v.y.atan2(v.x)
}

/// Wraps an angle to [-π, π].
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

impl Triangle {
    /// Displacements of the dependent joints that close the loop, for one of the two roots (1 or
    /// -1); `None` if the sides cannot reach.
    fn solve(&self, root: f64) -> Option<[f64; 2]> {
        // Either the first joint carries the second one and both move the first point, or the first
        // joint moves the first point and the second joint the second point.
        let (first, second, moved, other, carried) = match self.shape {
            Shape::OneChain { chain, inner } => (inner, 1 - inner, self.ends[chain], self.ends[1 - chain], true),
            Shape::BothChains { of_pin } => (of_pin, 1 - of_pin, self.ends[0], self.ends[1], false),
        };
        let (a, b) = (self.joints[first], self.joints[second]);
        // Carried: a(b(moved)) = other. Otherwise: a(moved) = b(other).
        let (x_a, x_b) = match (a.slides, b.slides) {
            (false, false) => turn_turn(&a, &b, &moved, &other, carried, root)?,
            (false, true) if carried => {
                let (w, r) = (moved - a.at, (other - a.at).norm());
                let s = slide_to(&w, &b.way, r, root)?;
                (angle_of(&(other - a.at)) - angle_of(&(w + b.way * s)), s)
            }
            (false, true) => {
                let (m, w) = (other - a.at, moved - a.at);
                let s = slide_to(&m, &b.way, w.norm(), root)?;
                (angle_of(&(m + b.way * s)) - angle_of(&w), s)
            }
            (true, false) => {
                // Relative to the rotating joint, the other end slides in the opposite direction.
                let (point, target) = if carried { (moved, other) } else { (other, moved) };
                let (w, m, sign) = (point - b.at, target - b.at, if carried { -1.0 } else { 1.0 });
                let s = slide_to(&m, &(a.way * sign), w.norm(), root)?;
                (s, angle_of(&(m + a.way * (sign * s))) - angle_of(&w))
            }
            (true, true) => {
                let sign = if carried { 1.0 } else { -1.0 };
                let s = Matrix2::from_columns(&[a.way, b.way * sign]).try_inverse()? * (other - moved);
                (s.x, s.y)
            }
        };
        let turned = |joint: &FlatJoint, x: f64| if joint.slides { x } else { wrapped(x) * joint.way.x };
        let mut found = [0.0; 2];
        (found[first], found[second]) = (turned(&a, x_a), turned(&b, x_b));
        found.iter().all(|x| x.is_finite()).then_some(found)
    }
}

/// Two revolute joints. Carried: `R_a (v + R_b w) = t`; otherwise `R_a u = v + R_b w`.
fn turn_turn(
    a: &FlatJoint,
    b: &FlatJoint,
    moved: &Vector2<f64>,
    other: &Vector2<f64>,
    carried: bool,
    root: f64,
) -> Option<(f64, f64)> {
    let v = b.at - a.at;
    let (w, t) = if carried { (moved - b.at, other - a.at) } else { (other - b.at, moved - a.at) };
    let cosine = (t.norm_squared() - v.norm_squared() - w.norm_squared()) / (2.0 * v.norm() * w.norm());
    // For an extended triangle, rounding may put the cosine slightly above 1.
    if cosine.is_nan() || cosine.abs() > 1.0 + 1e-12 {
        return None;
    }
    let x_b = root * cosine.clamp(-1.0, 1.0).acos() - (angle_of(&w) - angle_of(&v));
    let (sine, cosine) = x_b.sin_cos();
    let reached = v + Vector2::new(cosine * w.x - sine * w.y, sine * w.x + cosine * w.y);
    let x_a = angle_of(&t) - angle_of(&reached);
    Some((if carried { x_a } else { -x_a }, x_b))
}

/// Slide s for which `|m + s d| = r`.
fn slide_to(m: &Vector2<f64>, d: &Vector2<f64>, r: f64, root: f64) -> Option<f64> {
    let along = m.dot(d);
    let square = along * along - m.norm_squared() + r * r;
    (square >= 0.0).then(|| -along + root * square.sqrt())
}

impl Body {
    fn motion_axis(&self) -> Vector3<f64> {
        match self.motion {
            JointMotion::Axis(motion) => motion.axis(),
            _ => Vector3::z(),
        }
    }

    fn slides(&self) -> bool {
        matches!(self.motion, JointMotion::Axis(motion) if motion.slides())
    }
}

impl Model {
    /// Actuated coordinates that move a dependent coordinate of the tree, in ascending order.
    pub(crate) fn leaders(&self, dependent: usize) -> Vec<usize> {
        let (mut found, mut open) = (Vec::new(), vec![dependent]);
        while let Some(k) = open.pop() {
            let moved_by = self.loops.iter().filter(|l| (l.first..l.first + 2).contains(&k)).flat_map(|l| &l.moved_by);
            for &j in moved_by {
                match j {
                    j if j >= self.nv() => open.push(j),
                    j if j < self.n_actuated() && !found.contains(&j) => found.push(j),
                    _ => {}
                }
            }
        }
        found.sort_unstable();
        found
    }
}

impl Data {
    /// Index of the first loop that cannot be closed at the last coordinates; quantities that
    /// depend on it are NaN.
    pub fn open_loop(&self) -> Option<usize> {
        self.loops.as_ref().and_then(|loops| loops.solved.open)
    }

    /// Values of the dependent joints at the last coordinates (rad or m), in the order of
    /// [`Model::dependent`].
    pub fn dependent_values(&self) -> &[f64] {
        self.loops.as_ref().map_or(&[], |loops| &loops.q[loops.solved.nv..])
    }

    /// Rates of the dependent joints at the last velocities (rad/s or m/s).
    pub fn dependent_rates(&self) -> &[f64] {
        self.loops.as_ref().map_or(&[], |loops| &loops.qdot[loops.solved.nv..])
    }

    /// Transmission angle of each loop at the last coordinates (rad, at most π/2).
    pub fn transmission_angles(&self) -> &[f64] {
        self.loops.as_ref().map_or(&[], |loops| &loops.solved.angle)
    }
}

/// Runs `run` with the loop data taken out of the workspace; solves the loop positions first if `q`
/// is given.
fn with_loops(model: &Model, data: &mut Data, q: Option<&[f64]>, run: impl FnOnce(&mut Data, &mut LoopData)) {
    let mut loops = data.loops.take().unwrap_or_else(|| Box::new(LoopData::new(model)));
    if let Some(q) = q {
        loops.q[..q.len()].copy_from_slice(q);
        let LoopData { solved, q, .. } = &mut *loops;
        solved.positions(model, data, q);
    }
    run(data, &mut loops);
    data.loops = Some(loops);
}

/// [`crate::forward_kinematics`] with closed loops.
#[inline(never)]
pub(crate) fn place(model: &Model, data: &mut Data, q: &[f64]) {
    with_loops(model, data, Some(q), |data, loops| place_and_measure(model, data, &loops.q));
}

/// [`crate::forward_kinematics_velocity`] with closed loops.
#[inline(never)]
pub(crate) fn move_bodies(model: &Model, data: &mut Data, state: &State) {
    with_loops(model, data, Some(state.q.as_slice()), |data, loops| {
        loops.follow(model, data, Some(state.qdot.as_slice()), None);
        let LoopData { solved, rates, q, qdot, .. } = loops;
        solved.rates(model, data, q, qdot, rates, true);
        move_tree(model, data, q, qdot);
    });
}

/// [`crate::inverse_dynamics`] by (4); `qdot` of `None` means zero velocities.
#[inline(never)]
pub(crate) fn inverse_dynamics(model: &Model, data: &mut Data, q: &[f64], qdot: Option<&[f64]>, qddot: Option<&[f64]>) {
    with_loops(model, data, Some(q), |data, loops| {
        loops.follow(model, data, qdot, qddot);
        std::mem::swap(&mut data.tau, &mut loops.tau);
        balanced(model, data, &loops.q, &loops.qdot, Some(&loops.qddot));
        std::mem::swap(&mut data.tau, &mut loops.tau);
        let nv = loops.solved.nv;
        data.tau.as_mut_slice().copy_from_slice(&loops.tau.as_slice()[..nv]);
        for (row, tau_d) in loops.solved.T.chunks_exact(nv.max(1)).zip(&loops.tau.as_slice()[nv..]) {
            data.tau.iter_mut().zip(row).for_each(|(tau, t)| *tau += t * tau_d);
        }
        loops.add_pin_forces(model, data);
    });
}

/// [`crate::mass_matrix_at_poses`] by (4).
#[inline(never)]
pub(crate) fn mass_matrix_at_poses(model: &Model, data: &mut Data) {
    with_loops(model, data, None, |data, loops| {
        std::mem::swap(&mut data.M, &mut loops.M);
        crate::crba::composite_bodies(model, data);
        std::mem::swap(&mut data.M, &mut loops.M);
        reduce(&loops.M, &loops.solved, 0, &mut data.M);
    });
}

/// `[1; T]ᵀ A [1; T]` for the coordinates from `first` on; A covers the tree coordinates from there
/// on.
fn reduce(A: &DMatrix<f64>, solved: &Solved, first: usize, to: &mut DMatrix<f64>) {
    let n = solved.nv - first;
    let nd = A.nrows() - n;
    let T = |d: usize, j: usize| solved.T[d * solved.nv + first + j];
    for j in 0..n {
        for i in 0..n {
            let mut sum = A[(i, j)];
            for d in 0..nd {
                let (left, right) = (T(d, i), T(d, j));
                if right != 0.0 {
                    sum += A[(i, n + d)] * right;
                }
                if left != 0.0 {
                    sum += left * A[(n + d, j)];
                    for e in 0..nd {
                        let right = T(e, j);
                        if right != 0.0 {
                            sum += left * A[(n + d, n + e)] * right;
                        }
                    }
                }
            }
            to[(i, j)] = sum;
        }
    }
}

/// [`crate::hybrid_dynamics`] with the reduced mass matrix: `M_ff q̈_f = τ_f - bias_f - M_fp q̈_p`.
/// Does not allocate after the first call.
#[inline(never)]
pub(crate) fn solve(model: &Model, data: &mut Data, state: &State, free: &[usize]) {
    let Some(loops) = &mut data.loops else { return };
    let mut room = std::mem::take(&mut loops.free);
    room.fit(free.len());
    room.right.iter_mut().zip(free).for_each(|(right, &k)| *right = data.tau[k]);
    free.iter().for_each(|&k| data.qddot[k] = 0.0);
    // Bias, including the accelerations of the prescribed coordinates.
    let mut qddot = std::mem::replace(&mut data.qddot, DVector::zeros(0));
    crate::rnea::inverse_dynamics(model, data, state, &qddot);
    room.right.iter_mut().zip(free).for_each(|(right, &k)| *right -= data.tau[k]);
    mass_matrix_at_poses(model, data);
    room.solve(|i, j| data.M[(free[i], free[j])]);
    room.right.iter().zip(free).for_each(|(a, &k)| qddot[k] = *a);
    crate::rnea::inverse_dynamics(model, data, state, &qddot);
    data.qddot = qddot;
    if let Some(loops) = &mut data.loops {
        loops.free = room;
    }
}

/// Workspace of a Cholesky solve; the solution is NaN if the matrix is not positive definite.
#[derive(Clone, Debug, Default)]
struct CholeskyRoom {
    L: Vec<f64>,
    right: Vec<f64>,
}

impl CholeskyRoom {
    fn fit(&mut self, n: usize) {
        self.L.resize(n * n, 0.0);
        self.right.resize(n, 0.0);
    }

    /// Solves in place in `right`; `entry` returns the entries of a symmetric matrix.
    fn solve(&mut self, entry: impl Fn(usize, usize) -> f64) {
        let n = self.right.len();
        let (L, x) = (&mut self.L, &mut self.right);
        for i in 0..n {
            for j in 0..=i {
                let inner: f64 = (0..j).map(|k| L[i * n + k] * L[j * n + k]).sum();
                let rest = entry(i, j) - inner;
                L[i * n + j] = if i == j { rest.sqrt() } else { rest / L[j * n + j] };
            }
            let inner: f64 = (0..i).map(|k| L[i * n + k] * x[k]).sum();
            x[i] = (x[i] - inner) / L[i * n + i];
        }
        for i in (0..n).rev() {
            let inner: f64 = (i + 1..n).map(|k| L[k * n + i] * x[k]).sum();
            x[i] = (x[i] - inner) / L[i * n + i];
        }
    }
}

/// Loop terms of [`crate::StaticTangent`], with workspace.
#[derive(Clone, Debug)]
pub(crate) struct LoopTangent {
    /// `∂τ_t/∂q_t` of the tree.
    pub(crate) G: DMatrix<f64>,
    rates: LoopRates,
    qdot: Vec<f64>,
}

impl LoopTangent {
    pub(crate) fn new(model: &Model, first: usize) -> Self {
        let n = model.nv() + model.dependent().len();
        Self { G: DMatrix::zeros(n - first, n - first), rates: LoopRates::new(model), qdot: vec![0.0; n] }
    }

    /// (5) into `to`, for the tangent of the tree in `G` and the forces `tau_d` on the dependent
    /// coordinates.
    pub(crate) fn reduce(&mut self, model: &Model, data: &Data, first: usize, tau_d: &[f64], to: &mut DMatrix<f64>) {
        let Some(loops) = &data.loops else { return };
        let solved = &loops.solved;
        reduce(&self.G, solved, first, to);
        let nv = solved.nv;
        for j in first..nv {
            // T does not depend on this coordinate, so the second term of (5) is zero.
            let moves = model.loops.iter().any(|loop_| loop_.moved_by.contains(&j));
            if !moves {
                continue;
            }
            self.qdot.fill(0.0);
            self.qdot[j] = 1.0;
            solved.carry_over(&mut self.qdot);
            solved.rates(model, data, &loops.q, &self.qdot, &mut self.rates, true);
            for (row, tau) in self.rates.Tdot.chunks_exact(nv).zip(tau_d) {
                for i in first..nv {
                    to[(i - first, j - first)] += tau * row[i];
                }
            }
        }
    }
}

/// Loop on the bodies of the tree, before its coordinates are numbered.
pub(crate) struct LoopDraft<'m> {
    closure: &'m LoopClosure,
    dependent: [usize; 2],
    ends: [usize; 2],
    X_pin: Pose,
    p_eye: Vector3<f64>,
    common: usize,
    chains: [Vec<usize>; 2],
    shape: Shape,
}

fn bad(closure: &LoopClosure, what: impl Into<String>) -> ModelError {
    ModelError::BadLoop { name: closure.name.clone(), what: what.into() }
}

/// Loops of a mechanism, ordered so that each depends only on loops before it.
///
/// # Errors
/// [`ModelError::BadLoop`], [`ModelError::Duplicate`].
pub(crate) fn draft_loops<'m>(
    mechanism: &'m Mechanism,
    frames: &[Frame],
    bodies: &[Body],
) -> Result<Vec<LoopDraft<'m>>, ModelError> {
    let mut drafts: Vec<LoopDraft<'m>> = Vec::new();
    for closure in &mechanism.loops {
        if drafts.iter().any(|other| other.closure.name == closure.name) {
            return Err(ModelError::Duplicate { what: "loop", name: closure.name.clone() });
        }
        let draft = LoopDraft::new(closure, mechanism, frames, bodies)?;
        for other in &drafts {
            if let Some(&body) = draft.dependent.iter().find(|body| other.dependent.contains(body)) {
                let (joint, other) = (&bodies[body].joint, &other.closure.name);
                return Err(bad(
                    closure,
                    format!("joint {joint:?} already follows from loop {other:?}: name another one of its joints"),
                ));
            }
        }
        drafts.push(draft);
    }
    let mut ordered: Vec<LoopDraft<'m>> = Vec::new();
    while !drafts.is_empty() {
        let rests =
            |draft: &LoopDraft, other: &LoopDraft| draft.chains.iter().flatten().any(|i| other.dependent.contains(i));
        let ready = (0..drafts.len())
            .find(|&k| (0..drafts.len()).all(|other| other == k || !rests(&drafts[k], &drafts[other])));
        let Some(ready) = ready else {
            let names: Vec<&str> = drafts.iter().map(|d| d.closure.name.as_str()).collect();
            let what = format!(
                "the loops {names:?} depend on each other in a circle: each must close once those before it have; choose other dependent joints"
            );
            return Err(bad(drafts[0].closure, what));
        };
        ordered.push(drafts.remove(ready));
    }
    Ok(ordered)
}

impl<'m> LoopDraft<'m> {
    fn new(
        closure: &'m LoopClosure,
        mechanism: &Mechanism,
        frames: &[Frame],
        bodies: &[Body],
    ) -> Result<Self, ModelError> {
        let frame = |link: &str| {
            let found = frames.iter().find(|f| f.name == link);
            found.ok_or_else(|| bad(closure, format!("there is no link {link:?}")))
        };
        let (pin, eye) = (frame(&closure.pin)?, frame(&closure.eye)?);
        let finite = closure.axis.iter().chain(closure.at.iter().map(|(_, x)| x)).all(|x| x.is_finite());
        if !finite {
            return Err(ModelError::NotFinite { what: "axis or start value of loop", name: closure.name.clone() });
        }
        let path = |body: usize| {
            let mut path = vec![body];
            while let Some(&last) = path.last().filter(|last| **last > 0) {
                path.push(bodies[last].parent);
            }
            path.reverse();
            path
        };
        let (to_pin, to_eye) = (path(pin.body), path(eye.body));
        let shared = to_pin.iter().zip(&to_eye).take_while(|(a, b)| a == b).count();
        let common = to_pin[shared - 1];
        let chains = [to_pin[shared..].to_vec(), to_eye[shared..].to_vec()];
        let dependent = dependent_bodies(closure, mechanism, bodies, &chains)?;
        let place = |body: usize| chains.iter().position(|chain| chain.contains(&body)).unwrap_or(0);
        let at = |body: usize| chains[place(body)].iter().position(|i| *i == body);
        let shape = match (place(dependent[0]), place(dependent[1])) {
            (a, b) if a == b => Shape::OneChain { chain: a, inner: usize::from(at(dependent[0]) > at(dependent[1])) },
            (a, _) => Shape::BothChains { of_pin: a },
        };
        let turn = Rotation3::rotation_between(&Vector3::z(), &closure.axis)
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let X_pin = pin.X_BF * Pose::from_parts(Vector3::zeros().into(), turn);
        let p_eye = eye.X_BF.translation.vector;
        Ok(Self { closure, dependent, ends: [pin.body, eye.body], X_pin, p_eye, common, chains, shape })
    }

    /// Bodies whose joints are dependent.
    pub(crate) fn dependent(&self) -> [usize; 2] {
        self.dependent
    }

    /// Converts the draft to a placed loop, with coordinates numbered; the assembly mode is set
    /// later by [`assemble`].
    pub(crate) fn placed(&self, bodies: &[Body], nv: usize, modal_size: impl Fn(usize) -> usize) -> PlacedLoop {
        let mut moved_by: Vec<usize> = Vec::new();
        for &i in self.chains.iter().flatten().filter(|i| !self.dependent.contains(i)) {
            let k = bodies[i].coordinate;
            match bodies[i].motion {
                JointMotion::Axis(_) => moved_by.push(k),
                JointMotion::Elastic(_) => moved_by.extend(k..k + 6),
                JointMotion::Interface { modal, .. } => moved_by.extend(k..k + modal_size(modal)),
                JointMotion::Welded => {}
            }
        }
        moved_by.sort_unstable();
        moved_by.dedup();
        PlacedLoop {
            name: self.closure.name.clone(),
            dependent: self.dependent,
            ends: self.ends,
            start: [0.0; 2],
            start_miss: [0.0; 2],
            first: bodies[self.dependent[0]].coordinate.max(nv),
            common: self.common,
            chains: self.chains.clone(),
            X_pin: self.X_pin,
            p_eye: self.p_eye,
            moved_by,
            root: 1.0,
            shape: self.shape,
            corner: self.corner(bodies),
        }
    }

    /// Corner of the triangle opposite to the side with the driving joints, if only one side has
    /// any: 0 and 1 are the dependent joints, 2 is the pin.
    fn corner(&self, bodies: &[Body]) -> Option<usize> {
        let mut driven = [false; 3];
        for own in &self.chains {
            for (at, &i) in own.iter().enumerate() {
                let drives = !bodies[i].elastic && matches!(bodies[i].motion, JointMotion::Axis(_));
                if !drives || self.dependent.contains(&i) {
                    continue;
                }
                let inward: Vec<usize> = (0..2).filter(|d| own[..at].contains(&self.dependent[*d])).collect();
                let opposite = match (self.shape, inward.as_slice()) {
                    // Outward of both: the side from the outer joint to the pin.
                    (Shape::OneChain { inner, .. }, [_, _]) => inner,
                    (Shape::OneChain { .. }, [_]) => 2,
                    (Shape::OneChain { inner, .. }, _) => 1 - inner,
                    (Shape::BothChains { .. }, [own]) => 1 - own,
                    (Shape::BothChains { .. }, _) => 2,
                };
                driven[opposite] = true;
            }
        }
        match driven.iter().filter(|d| **d).count() {
            1 => driven.iter().position(|d| *d),
            _ => None,
        }
    }
}

/// Child bodies of the two dependent joints named in a loop closure.
fn dependent_bodies(
    closure: &LoopClosure,
    mechanism: &Mechanism,
    bodies: &[Body],
    chains: &[Vec<usize>; 2],
) -> Result<[usize; 2], ModelError> {
    let mut found = [0; 2];
    if closure.dependent[0] == closure.dependent[1] {
        return Err(bad(
            closure,
            format!("joint {:?} is named twice: two joints follow from a loop", closure.dependent[0]),
        ));
    }
    for (to, name) in found.iter_mut().zip(&closure.dependent) {
        let Some(joint) = mechanism.joint(name) else {
            return Err(bad(closure, format!("there is no joint {name:?}")));
        };
        let turns = (joint.kind.turns() || joint.kind.slides())
            && matches!(joint.kind.axis_motion(), Some(AxisMotion::Revolute(_) | AxisMotion::Prismatic(_)));
        if !turns {
            let kind = joint.kind.name();
            return Err(bad(
                closure,
                format!("joint {name:?} is {kind}: dependent joints are revolute, continuous or prismatic"),
            ));
        }
        if let Some(mimic) = &joint.mimic {
            let leader = &mimic.joint;
            return Err(bad(
                closure,
                format!("joint {name:?} mimics {leader:?}: remove the mimic: its position follows from the loop"),
            ));
        }
        if let Some(follower) = mechanism.joints.iter().find(|j| j.mimic.as_ref().is_some_and(|m| m.joint == *name)) {
            let follower = &follower.name;
            return Err(bad(
                closure,
                format!("joint {follower:?} mimics the dependent joint {name:?}, which is none that drives"),
            ));
        }
        let in_loop = |i: &usize| bodies[*i].joint == *name;
        let Some(&body) = chains.iter().flatten().find(|i| in_loop(i)) else {
            let moving = |i: &&usize| matches!(bodies[**i].motion, JointMotion::Axis(_)) && !bodies[**i].elastic;
            let known: Vec<&str> = chains.iter().flatten().filter(moving).map(|i| bodies[*i].joint.as_str()).collect();
            return Err(bad(
                closure,
                format!("joint {name:?} does not lie between pin and eye; the joints there are {known:?}"),
            ));
        };
        *to = body;
    }
    Ok(found)
}

/// Finds the assembly mode of each loop and checks that the loop is planar, can be closed and is
/// not at a dead point.
///
/// # Errors
/// [`ModelError::BadLoop`].
pub(crate) fn assemble(model: &mut Model, mechanism: &Mechanism) -> Result<(), ModelError> {
    for k in 0..model.loops.len() {
        let closure = mechanism.loops.iter().find(|c| c.name == model.loops[k].name);
        let Some(closure) = closure else { continue };
        let mut q = start_values(model, closure)?;
        let nv = model.nv();
        let wanted = {
            let first = model.loops[k].first;
            [q[first], q[first + 1]]
        };
        // Solves the preceding loops at these values of the driving joints.
        let mut data = Data::new(model);
        let mut solved = LoopData::new(model).solved;
        let later = model.loops.split_off(k + 1);
        let mut own = model.loops.split_off(k);
        solved.positions(model, &mut data, &mut q);
        let mut loop_ = own.remove(0);
        if let Some(open) = solved.open {
            let other = &model.loops[open].name;
            return Err(bad(
                closure,
                format!("loop {other:?}, on which it depends, does not close there: give start values in at"),
            ));
        }
        q[nv + 2 * k..nv + 2 * k + 2].copy_from_slice(&wanted);
        begin(model, &mut data, &q);
        for &i in loop_.chains.iter().flatten() {
            joint_position(model, &mut data, i, &q);
        }
        loop_.place_chains(model, &data, &mut solved.X);
        check_plane(&loop_, closure, model, &solved.X)?;
        let triangle = loop_.triangle(model, &solved.X);
        let size = loop_.gap(&solved.X).1;
        // Size of a displacement, with rotations weighted by the size of the loop.
        let far = |turn: &[f64; 2]| {
            let length = |d: usize| if triangle.joints[d].slides { 1.0 } else { size };
            (turn[0] * length(0)).hypot(turn[1] * length(1))
        };
        // Assembly mode: the root closest to the requested values.
        let found = [1.0, -1.0].map(|root| triangle.solve(root).map(|turn| (root, turn)));
        let nearest = found.into_iter().flatten().min_by(|a, b| far(&a.1).total_cmp(&far(&b.1)));
        let Some((root, turn)) = nearest else {
            let gap = loop_.gap(&solved.X).0.norm();
            let what = format!(
                "it does not close where its driving joints are at the start: pin and eye are {gap:.6} m apart there and no \
                 values of {:?} and {:?} bring them together; check the two points, or give values in at at which it is assembled",
                closure.dependent[0], closure.dependent[1]
            );
            return Err(bad(closure, what));
        };
        loop_.root = root;
        loop_.start = [wanted[0] + turn[0], wanted[1] + turn[1]];
        loop_.start_miss = turn;
        model.loops.push(loop_);
        model.loops.extend(later);
        check_alive(model, closure, k, &q)?;
    }
    Ok(())
}

/// Tree coordinates near which a loop is assembled.
fn start_values(model: &Model, closure: &LoopClosure) -> Result<Vec<f64>, ModelError> {
    let mut q = vec![0.0; model.nv() + model.dependent().len()];
    for (name, value) in &closure.at {
        let actuated = model.coordinates()[..model.n_actuated()].iter().position(|c| c.joint == *name);
        let dependent = model.dependent().iter().position(|c| c.joint == *name).map(|d| model.nv() + d);
        match actuated.or(dependent) {
            Some(k) => q[k] = *value,
            None => {
                return Err(bad(
                    closure,
                    format!(
                        "at names joint {name:?}, which is neither an independent joint nor one that follows from a loop"
                    ),
                ));
            }
        }
    }
    Ok(q)
}

/// Checks that revolute axes are parallel and sliding axes perpendicular to the pin axis.
fn check_plane(loop_: &PlacedLoop, closure: &LoopClosure, model: &Model, X: &[Pose]) -> Result<(), ModelError> {
    let (A, _) = loop_.ends_at(X);
    let normal: Vector3<f64> = A.rotation * Vector3::z();
    for &i in loop_.chains.iter().flatten() {
        let body = &model.bodies[i];
        let JointMotion::Axis(motion) = body.motion else { continue };
        if body.elastic {
            continue;
        }
        let axis = X[i].rotation * motion.axis();
        let (off, expected) = match motion {
            AxisMotion::Prismatic(_) => (axis.dot(&normal).abs().min(1.0).asin(), "slide across it"),
            AxisMotion::Revolute(_) => (axis.cross(&normal).norm().min(1.0).asin(), "turn about axes along it"),
            AxisMotion::Helical { .. } => {
                let what =
                    format!("joint {:?} in it is helical: a planar loop has joints that turn or slide", body.joint);
                return Err(bad(closure, what));
            }
        };
        if off > LOOP_AXIS_TOLERANCE_RAD {
            let what = format!(
                "the axis of joint {:?} is {:.4} deg off the plane of the loop: across the pin's axis all joints must {expected} \
                 (loops in space are not known)",
                body.joint,
                off.to_degrees()
            );
            return Err(bad(closure, what));
        }
    }
    Ok(())
}

/// Checks that the loop is not assembled at a dead point.
fn check_alive(model: &Model, closure: &LoopClosure, k: usize, q: &[f64]) -> Result<(), ModelError> {
    let mut data = Data::new(model);
    let mut solved = LoopData::new(model).solved;
    let mut q = q.to_vec();
    solved.positions(model, &mut data, &mut q);
    let flattest = {
        let J = [solved.J[k][model.loops[k].first], solved.J[k][model.loops[k].first + 1]];
        (J[0].x * J[1].y - J[0].y * J[1].x).abs().atan2(J[0].dot(&J[1]).abs())
    };
    let dead = solved.open == Some(k) || flattest.is_nan() || flattest < DEAD_RAD;
    if dead {
        let what = format!(
            "it is assembled at a dead point, where its links are collinear and {:?} and {:?} do not follow from the pin: give values in at \
             away from it, or choose other dependent joints",
            closure.dependent[0], closure.dependent[1]
        );
        return Err(bad(closure, what));
    }
    Ok(())
}
