//! Closed-form derivatives of dynamic forces with respect to coordinates and velocities: `∂τ/∂q`
//! and `∂τ/∂q̇` of [`crate::inverse_dynamics`], and `∂(M a)/∂q`.
//!
//! All quantities are about the world origin, in world axes: `s_j` is the column of coordinate j, V
//! and A the twist and spatial acceleration of the body b that it moves, V' and A' those of its
//! parent, and `(S q̇)_j` the derivative of `S q̇` of an elastic joint with respect to its own
//! coordinate. All bodies outward of a joint have the same change of motion:
//!
//! ```text
//! δV_i = ψ_j δq_j,   δA_i = (χ_j + ψ_j × V_i) δq_j                                   i = b and outward      (1)
//! ψ_j = V' × s_j + (S q̇)_j,   χ_j = A' × s_j + V' × ψ_j + V × (S q̇)_j + (S q̈ + Ṡ q̇)_j
//! δV_i = s_j δq̇_j,   δA_i = (κ_j + s_j × V_i) δq̇_j,   κ_j = V' × s_j + V × s_j + ∂(Ṡ q̇)/∂q̇_j               (2)
//! ```
//! The wrench on a body, `F = I A + V ×* I V`, then changes by `I χ + C ψ` (for velocities by
//! `I κ + C s`), with
//!
//! ```text
//! C ψ = I (ψ × V) + ψ ×* I V + V ×* I ψ                 zero for translations ψ                           (3)
//! ```
//! and, with I, C and F summed over the subtree of a joint,
//!
//! ```text
//! k outward of j, or in the same joint:   ∂τ_k/∂q_j = s_k · (I_k χ_j + C_k ψ_j) + ∂S_k/∂q_j · F           (4)
//! k inward of j:                          ∂τ_k/∂q_j = s_k · (I_j χ_j + C_j ψ_j + s_j ×* F_j)
//! ```
//! External wrenches and balancers are not included, as they depend only on the configuration
//! ([`crate::StaticTangent::of_loads`]). Not here: closed loops and modal bodies. Source: the
//! recursions of [Carpentier & Mansard 2018], in summed form for joints whose motion subspace
//! depends on the coordinates.

use flexarm_spatial::{ElasticAngles, Pose, SpatialInertia, Twist, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::data::{Data, ElasticSubspace, State};
use crate::model::{JointMotion, Model};

/// Finite-difference step for the second derivative of a rate map (rad). The term is of second
/// order in the elastic rates.
const DIFFERENCE: f64 = 1e-3;

/// Derivatives of inverse dynamics, with workspace.
#[derive(Clone, Debug)]
pub struct DynamicTangent {
    columns: Vec<Column>,
    bodies: Vec<Moving>,
}

/// Derivative terms of one coordinate.
#[derive(Clone, Copy, Debug)]
struct Column {
    /// Coordinate in the model; `body` that it moves; `component` within the joint.
    k: usize,
    body: usize,
    component: usize,
    s: Twist,
    /// ψ, χ of (1) and κ of (2).
    psi: Twist,
    chi: Twist,
    kappa: Twist,
    /// `I χ + C ψ`, and `I κ + C s` for velocities, of the subtree.
    by_q: Wrench,
    by_rate: Wrench,
    /// `I s` and the nonzero (angular) part of `Cᵀ s`, of the subtree.
    momentum: Wrench,
    turned: Vector3<f64>,
}

/// Motion of a body, and the sums of I, C and F over its subtree.
#[derive(Clone, Copy, Debug)]
struct Moving {
    V: Twist,
    A: Twist,
    inertia: SpatialInertia,
    /// Force and moment rows of C, acting on the angular part.
    C: [Matrix3<f64>; 2],
    F: Wrench,
}

/// Derivatives of the motion of an elastic joint with respect to one of its coordinates, B axes.
#[derive(Clone, Copy, Debug)]
struct JointChange {
    /// `(S q̇)_j`.
    velocity: Twist,
    /// `(S q̈ + Ṡ q̇)_j`.
    acceleration: Twist,
    /// `∂(Ṡ q̇)/∂q̇_j`.
    by_rate: Twist,
}

impl DynamicTangent {
    /// Creates the workspace for a tree; `None` for models with closed loops or modal bodies.
    pub fn new(model: &Model) -> Option<Self> {
        if !model.loops.is_empty() || !model.modal.is_empty() {
            return None;
        }
        let mut columns = Vec::new();
        for (body, joint) in model.bodies.iter().enumerate().skip(1) {
            let components = match joint.motion {
                JointMotion::Axis(_) => 1,
                JointMotion::Elastic(_) => 6,
                JointMotion::Welded | JointMotion::Interface { .. } => 0,
            };
            columns.extend((0..components).map(|component| Column::new(joint.coordinate + component, body, component)));
        }
        Some(Self { columns, bodies: vec![Moving::still(); model.bodies.len()] })
    }

    /// Computes `∂τ/∂q` into `by_q` and `∂τ/∂q̇` into `by_rate`, both nv×nv with one column per
    /// coordinate and overwritten. Does not allocate.
    ///
    /// * `data`: after [`crate::inverse_dynamics`] of this motion and [`crate::world_poses`].
    ///
    /// # Panics
    /// If the size of a matrix does not match.
    pub fn compute(
        &mut self,
        model: &Model,
        data: &Data,
        state: &State,
        qddot: &DVector<f64>,
        by_q: &mut DMatrix<f64>,
        by_rate: &mut DMatrix<f64>,
    ) {
        for (i, moving) in self.bodies.iter_mut().enumerate() {
            let X_WB = &data.X_WB[i];
            (moving.V, moving.A) = (data.V[i].at_parent(X_WB), data.A[i].at_parent(X_WB));
        }
        self.place(model, data);
        self.carry(model, data);
        self.change(model, data, state.q.as_slice(), state.qdot.as_slice(), qddot.as_slice());
        self.fill(model, by_q, Some(by_rate));
        self.add_own_joints(model, data, state.q.as_slice(), by_q);
    }

    /// Computes `∂(M a)/∂q` for constant accelerations a, without rotor inertia, into `G` (nv×nv,
    /// overwritten). Does not allocate.
    ///
    /// * `data`: after [`crate::forward_kinematics`] at q.
    ///
    /// # Panics
    /// If the size of the matrix does not match.
    pub fn of_inertia(&mut self, model: &Model, data: &Data, q: &DVector<f64>, a: &DVector<f64>, G: &mut DMatrix<f64>) {
        self.place(model, data);
        for moving in &mut self.bodies {
            (moving.V, moving.A) = (Twist::zeros(), Twist::zeros());
        }
        // Accelerations of the bodies at zero velocity: sums of the columns times a.
        let mut columns = self.columns.iter().peekable();
        for i in 1..self.bodies.len() {
            let mut A = self.bodies[model.bodies[i].parent].A;
            while let Some(column) = columns.next_if(|column| column.body == i) {
                A += column.s * a[column.k];
            }
            self.bodies[i].A = A;
        }
        self.carry(model, data);
        // Zero velocities.
        self.change(model, data, q.as_slice(), &[], a.as_slice());
        self.fill(model, G, None);
        self.add_own_joints(model, data, q.as_slice(), G);
    }

    /// Adds to `tau` (nv) the forces required by an additional inertia on a body in the motion of
    /// the last call, scaled by `factor`.
    ///
    /// * `more`: additional inertia about Bo, B axes; `data`: unchanged since that call.
    pub fn add_inertia_forces(
        &self,
        model: &Model,
        data: &Data,
        body: usize,
        more: &SpatialInertia,
        factor: f64,
        tau: &mut [f64],
    ) {
        let Moving { V, A, .. } = &self.bodies[body];
        let inertia = more.at_parent(&data.X_WB[body]);
        let F = (inertia.mul_twist(A) + V.cross_force(&inertia.mul_twist(V))) * factor;
        for column in &self.columns {
            if column.body <= body && body < model.bodies[column.body].subtree_end {
                tau[column.k] += column.s.power(&F);
            }
        }
    }

    /// Columns in world axes.
    fn place(&mut self, model: &Model, data: &Data) {
        for column in &mut self.columns {
            let body = &model.bodies[column.body];
            let S = &data.elastic[column.body];
            let s_B = match (body.motion, column.component) {
                (JointMotion::Axis(motion), _) => motion.twist(body.ratio),
                (_, c @ 0..3) => Twist::new(S.L.column(c).into(), Vector3::zeros()),
                (_, c) => Twist::new(Vector3::zeros(), S.B.column(c - 3).into()),
            };
            column.s = s_B.at_parent(&data.X_WB[column.body]);
        }
    }

    /// Computes I, C and F of all bodies and sums them over subtrees.
    fn carry(&mut self, model: &Model, data: &Data) {
        for (i, moving) in self.bodies.iter_mut().enumerate() {
            moving.load(&model.bodies[i].inertia, &data.X_WB[i]);
        }
        for i in (1..self.bodies.len()).rev() {
            let (inner, outer) = self.bodies.split_at_mut(i);
            inner[model.bodies[i].parent].add(&outer[0]);
        }
    }

    /// Computes (1), (2) and the resulting wrench changes; empty `qdot` for zero velocities.
    fn change(&mut self, model: &Model, data: &Data, q: &[f64], qdot: &[f64], qddot: &[f64]) {
        let mut all = [JointChange::none(); 6];
        for column in &mut self.columns {
            let (i, body) = (column.body, &model.bodies[column.body]);
            if let (JointMotion::Elastic(angles), 0) = (body.motion, column.component) {
                let range = body.coordinate..body.coordinate + 6;
                let rates = qdot.get(range.clone()).unwrap_or(&[0.0; 6]);
                all = joint_changes(angles, &data.elastic[i], &q[range.clone()], rates, &qddot[range]);
            }
            let own = match body.motion {
                JointMotion::Elastic(_) => all[column.component],
                _ => JointChange::none(),
            };
            let X_WB = &data.X_WB[i];
            let [velocity, acceleration, by_rate] =
                [own.velocity, own.acceleration, own.by_rate].map(|twist| twist.at_parent(X_WB));
            let (inner, outer) = (&self.bodies[body.parent], &self.bodies[i]);
            let s = column.s;
            // (1) and (2).
            column.psi = inner.V.cross(&s) + velocity;
            column.chi = inner.A.cross(&s) + inner.V.cross(&column.psi) + outer.V.cross(&velocity) + acceleration;
            column.kappa = inner.V.cross(&s) + outer.V.cross(&s) + by_rate;
            // (3) and the products in (4).
            column.by_q = outer.change(&column.chi, &column.psi);
            column.by_rate = outer.change(&column.kappa, &s);
            column.momentum = outer.inertia.mul_twist(&s);
            column.turned = outer.C[0].tr_mul(&s.linear) + outer.C[1].tr_mul(&s.angular);
        }
    }

    /// (4) for all pairs of coordinates where one moves the other.
    fn fill(&self, model: &Model, by_q: &mut DMatrix<f64>, mut by_rate: Option<&mut DMatrix<f64>>) {
        let n = model.nv();
        assert!(by_q.shape() == (n, n), "a row and a column per coordinate");
        by_q.fill(0.0);
        if let Some(by_rate) = &mut by_rate {
            assert!(by_rate.shape() == (n, n), "a row and a column per coordinate");
            by_rate.fill(0.0);
        }
        for (a, inner) in self.columns.iter().enumerate() {
            let end = model.bodies[inner.body].subtree_end;
            // Columns are in body order, so the subtree of `inner` comes after it.
            for (b, outer) in self.columns.iter().enumerate().skip(a).take_while(|(_, outer)| outer.body < end) {
                let (i, o) = (inner.k, outer.k);
                by_q[(o, i)] += inner.chi.power(&outer.momentum) + inner.psi.angular.dot(&outer.turned);
                if let Some(by_rate) = &mut by_rate {
                    by_rate[(o, i)] += inner.kappa.power(&outer.momentum) + inner.s.angular.dot(&outer.turned);
                }
                if b == a {
                    continue;
                }
                let mut F = outer.by_q;
                if outer.body > inner.body {
                    F += outer.s.cross_force(&self.bodies[outer.body].F);
                }
                by_q[(i, o)] += inner.s.power(&F);
                if let Some(by_rate) = &mut by_rate {
                    by_rate[(i, o)] += inner.s.power(&outer.by_rate);
                }
            }
        }
    }

    /// Adds `∂S_k/∂q_j · F` of elastic joints.
    fn add_own_joints(&self, model: &Model, data: &Data, q: &[f64], by_q: &mut DMatrix<f64>) {
        for (i, body) in model.bodies.iter().enumerate() {
            let JointMotion::Elastic(angles) = body.motion else { continue };
            let k = body.coordinate;
            let F = self.bodies[i].F.at_child(&data.X_WB[i]);
            let S = &data.elastic[i];
            let phi = Vector3::new(q[k + 3], q[k + 4], q[k + 5]);
            for c in 0..3 {
                let dB = angles.rate_map_derivative(&phi, &Vector3::ith(c, 1.0));
                // ∂L/∂φ_c = -[B e_c]x L; its transpose applied to f is Lᵀ (B e_c × f).
                let slid = S.L.tr_mul(&S.B.column(c).cross(&F.force));
                let turned = dB.tr_mul(&F.torque);
                for r in 0..3 {
                    by_q[(k + r, k + 3 + c)] += slid[r];
                    by_q[(k + 3 + r, k + 3 + c)] += turned[r];
                }
            }
        }
    }
}

impl Column {
    fn new(k: usize, body: usize, component: usize) -> Self {
        let (zero, none) = (Twist::zeros(), Wrench::zeros());
        Self {
            k,
            body,
            component,
            s: zero,
            psi: zero,
            chi: zero,
            kappa: zero,
            by_q: none,
            by_rate: none,
            momentum: none,
            turned: Vector3::zeros(),
        }
    }
}

impl Moving {
    fn still() -> Self {
        Self {
            V: Twist::zeros(),
            A: Twist::zeros(),
            inertia: SpatialInertia::zeros(),
            C: [Matrix3::zeros(); 2],
            F: Wrench::zeros(),
        }
    }

    /// Computes I, C and F of this body only, from its motion.
    fn load(&mut self, inertia: &SpatialInertia, X_WB: &Pose) {
        let inertia = inertia.at_parent(X_WB);
        let (V, momentum) = (self.V, inertia.mul_twist(&self.V));
        self.C = [Matrix3::zeros(); 2];
        // C is zero at zero velocity.
        let moving = if V == Twist::zeros() { 0 } else { 3 };
        for c in 0..moving {
            let psi = Twist::new(Vector3::zeros(), Vector3::ith(c, 1.0));
            let column = inertia.mul_twist(&psi.cross(&V))
                + psi.cross_force(&momentum)
                + V.cross_force(&inertia.mul_twist(&psi));
            self.C[0].set_column(c, &column.force);
            self.C[1].set_column(c, &column.torque);
        }
        self.F = inertia.mul_twist(&self.A) + V.cross_force(&momentum);
        self.inertia = inertia;
    }

    fn add(&mut self, other: &Self) {
        self.inertia += other.inertia;
        self.C[0] += other.C[0];
        self.C[1] += other.C[1];
        self.F += other.F;
    }

    /// `I χ + C ψ`.
    fn change(&self, chi: &Twist, psi: &Twist) -> Wrench {
        self.inertia.mul_twist(chi) + Wrench::new(self.C[0] * psi.angular, self.C[1] * psi.angular)
    }
}

impl JointChange {
    fn none() -> Self {
        let zero = Twist::zeros();
        Self { velocity: zero, acceleration: zero, by_rate: zero }
    }
}

/// Derivatives of `S q̇ = [L d'; B φ']` and `Ṡ q̇ = [L d' × w; B' φ']`, with `w = B φ'` and
/// `∂L/∂φ_c = -[B e_c]x L`.
fn joint_changes(
    angles: ElasticAngles,
    S: &ElasticSubspace,
    q: &[f64],
    qdot: &[f64],
    qddot: &[f64],
) -> [JointChange; 6] {
    let three = |x: &[f64]| Vector3::new(x[0], x[1], x[2]);
    let (phi, rates, turns) = (three(&q[3..]), three(&qdot[3..]), three(&qddot[3..]));
    let (slide, slides) = (S.L * three(qdot), S.L * three(qddot));
    let (w, rate_of_B) = (S.B * rates, angles.rate_map_derivative(&phi, &rates));
    let bias = |phi: &Vector3<f64>| angles.rate_map_derivative(phi, &rates) * rates;
    let mut all = [JointChange::none(); 6];
    for c in 0..3 {
        // Translation column: only Ṡ q̇ depends on its rate.
        let column: Vector3<f64> = S.L.column(c).into();
        all[c].by_rate = Twist::new(column.cross(&w), Vector3::zeros());

        // Angle column.
        let unit = Vector3::ith(c, 1.0);
        let (axis, dB) = (S.B * unit, angles.rate_map_derivative(&phi, &unit));
        let (slide_turned, slides_turned, w_changed) = (slide.cross(&axis), slides.cross(&axis), dB * rates);
        // ∂(B' φ')/∂φ_c by a five-point difference.
        let second = if rates == Vector3::zeros() {
            rates
        } else {
            let at = |steps: f64| bias(&(phi + unit * (steps * DIFFERENCE)));
            ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * DIFFERENCE)
        };
        all[3 + c] = JointChange {
            velocity: Twist::new(slide_turned, w_changed),
            acceleration: Twist::new(
                slides_turned + slide_turned.cross(&w) + slide.cross(&w_changed),
                dB * turns + second,
            ),
            by_rate: Twist::new(slide.cross(&axis), w_changed + rate_of_B * unit),
        };
    }
    all
}
