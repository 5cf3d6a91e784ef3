//! Derivatives of static forces with respect to the coordinates, in closed form.
//!
//! All quantities are about the world origin, in world axes: the column of coordinate i is the
//! twist `s_i = [v; w]` of its subtree, and `W_i = [f; n]` the wrench of weight and loads on that
//! subtree.
//!
//! ```text
//! τ_i = -s_i · W_i                                                           (1)
//! dW  = T s_j,   T = [   0    A ]    weight m g at c: f = m g, A = 0, N = c fᵀ - (c · f) 1
//!                    [ -[f]x  N ]    follower loads add terms to A and N                    (2)
//!
//! j outward of i, or in the same joint:   ∂τ_i/∂q_j = -s_i · T_j s_j             (3)
//! j inward of i:                          ∂τ_i/∂q_j = -(s_j × s_i) · W_i - s_i · T_i s_j
//!                                                   = -w_j · (v_i × f + w_i × n + Aᵀ v_i + Nᵀ w_i)   (4)
//! in addition, in the same elastic joint: -∂s_i/∂q_j · W_i                       (5)
//! ```
//! The coordinates of a modal body move the bodies on its interfaces like an elastic joint, and
//! also its own centre of mass:
//!
//! ```text
//! τ_k = -(R C_t,k) · g,    ∂τ_k/∂q_j = ∂τ_j/∂η_k = -w_j · (R C_t,k × g)       j inward of the body      (6)
//! ```
//! Balancers (`balancer`) enter (2) as a pair of loads of constant direction. Their change of
//! direction and length adds the following terms, where `d_i` is the relative velocity of the two
//! ends per unit rate of coordinate i:
//!
//! ```text
//! line:  ∂τ_i/∂q_j += d_i · K d_j        joint:  ∂τ_i/∂q_j += c_i k c_j                    (7)
//! ```
//! Cost: one pass over the bodies and one over the pairs of coordinates; central differences of
//! [`crate::gravity_forces`] take 2 n passes over the bodies. Start at [`StaticTangent::compute`]. Not
//! here: springs, and the reduction to independent coordinates of closed loops (`closure`).

use flexarm_spatial::products::{add, add3, column as column_of, cross, cross3, dot, lift, mul, scaled, sub, tr_mul};
use flexarm_spatial::{ElasticAngles, Pose, Real, SpatialInertia, Twist, Wrench, skew};
use nalgebra::{DMatrix, DVector, Matrix3, Scalar, Vector3};

use crate::balancer::{BalancerLine, BalancerPlace};
use crate::closure::LoopTangent;
use crate::data::Data;
use crate::model::{JointMotion, Model};

/// Wrench on a body, for [`StaticTangent::compute`].
#[derive(Clone, Copy, Debug)]
pub struct PointLoad {
    /// Body on which it acts.
    pub body: usize,
    /// Point of application, in body axes from Bo (m).
    pub p_B: Vector3<f64>,
    /// Force and moment at that point, world axes (N, N m).
    pub F_W: Wrench,
    /// Whether the load rotates with the body; otherwise its direction is constant in the world.
    pub turns: bool,
}

/// Tangent `∂τ/∂q` of the static forces, with its workspace.
#[derive(Clone, Debug)]
pub struct StaticTangent<T: Scalar = f64> {
    /// First coordinate covered by the matrix.
    first: usize,
    columns: Vec<Column<T>>,
    /// Per body: weight and loads on its subtree, and their derivatives.
    carried: Vec<Carried<T>>,
    /// `R C_t,k × g` in (6), one per coordinate of the widest modal body.
    g: Vec<Vector3<T>>,
    /// Closed loops: tangent of the tree; `tau_d` holds the forces on the dependent coordinates.
    loops: Option<Box<LoopTangent>>,
    tau_d: Vec<f64>,
}

/// Twist of the subtree of a body per unit rate of a coordinate.
#[derive(Clone, Copy, Debug)]
struct Column<T: Scalar = f64> {
    /// Coordinate, relative to the first one of the matrix.
    k: usize,
    body: usize,
    /// Displacement in joint axes (`t`) and rates of the angles (`phi`) per unit rate of the
    /// coordinate, for joints with angles.
    t: Vector3<f64>,
    phi: Vector3<f64>,
    /// `s = [v; w]`.
    v: Vector3<T>,
    w: Vector3<T>,
    /// `T s` in (3).
    force: Vector3<T>,
    moment: Vector3<T>,
    /// Bracket in (4).
    row: Vector3<T>,
    /// d in (7) for the current balancer.
    d: Vector3<f64>,
}

/// W and T of (2).
#[derive(Clone, Copy, Debug)]
struct Carried<T: Scalar> {
    f: Vector3<T>,
    n: Vector3<T>,
    A: Matrix3<T>,
    N: Matrix3<T>,
}

impl<T: Real> Carried<T> {
    /// Force of constant direction at the point c.
    #[inline(always)]
    fn weight(f: Vector3<T>, c: &Vector3<T>) -> Self {
        Self { f, n: cross(c, &f), A: Matrix3::zeros(), N: moved_moment(c, &f) }
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        self.f = add(&self.f, &other.f);
        self.n = add(&self.n, &other.n);
        self.A = add3(&self.A, &other.A);
        self.N = add3(&self.N, &other.N);
    }
}

/// `(w × r) × f` as a matrix on w: `r fᵀ - (r · f) 1`.
#[inline(always)]
fn moved_moment<T: Real>(r: &Vector3<T>, f: &Vector3<T>) -> Matrix3<T> {
    let s = dot(r, f);
    Matrix3::new(
        r.x * f.x - s,
        r.x * f.y,
        r.x * f.z,
        r.y * f.x,
        r.y * f.y - s,
        r.y * f.z,
        r.z * f.x,
        r.z * f.y,
        r.z * f.z - s,
    )
}

impl PointLoad {
    /// W and T of (2).
    #[inline(always)]
    fn carried<T: Real>(&self, X_WB: &Pose<T>) -> Carried<T> {
        let p = add(&X_WB.translation.vector, &mul(X_WB.rotation.matrix(), &lift(&self.p_B)));
        let (f, m) = (lift(&self.F_W.force), lift(&self.F_W.torque));
        let mut carried = Carried::weight(f, &p);
        carried.n = add(&carried.n, &m);
        if self.turns {
            // w × f and w × m as matrices on w.
            carried.A = skew(&-f);
            carried.N = add3(&carried.N, &add3(&skew(&-m), &cross3(&p, &carried.A)));
        }
        carried
    }
}

impl<T: Real> StaticTangent<T> {
    /// Number of rows and columns of the matrix over the independent coordinates.
    pub(crate) fn size(&self, model: &Model) -> usize {
        model.nv() - self.first
    }

    /// Creates the workspace for the coordinates from `first` on: 0 for all, [`Model::n_actuated`]
    /// for the elastic ones.
    pub fn new(model: &Model, first: usize) -> Self {
        // One column per coordinate and joint that it moves, in body order; a unit of the coordinate
        // moves the joint by t and turns it by φ.
        let mut columns = Vec::new();
        let (zero, nothing) = (Vector3::zeros(), Vector3::from_element(T::zero()));
        let column = |k: usize, body: usize, t: Vector3<f64>, phi: Vector3<f64>| Column {
            k: k - first,
            body,
            t,
            phi,
            v: nothing,
            w: nothing,
            force: nothing,
            moment: nothing,
            row: nothing,
            d: zero,
        };
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            let k = body.coordinate;
            match body.motion {
                JointMotion::Welded => {}
                _ if k < first => {}
                JointMotion::Axis(_) => columns.push(column(k, i, zero, zero)),
                JointMotion::Elastic(_) => {
                    let unit = |c: usize| Vector3::ith(c, 1.0);
                    columns.extend((0..3).map(|c| column(k + c, i, unit(c), zero)));
                    columns.extend((0..3).map(|c| column(k + 3 + c, i, zero, unit(c))));
                }
                JointMotion::Interface { modal, interface } => {
                    let Phi = &model.modal[modal].tables.shapes.interfaces[interface].Phi;
                    let mode_column = |(c, Phi): (usize, nalgebra::MatrixView6x1<'_, f64>)| {
                        column(k + c, i, Phi.fixed_rows::<3>(0).into(), Phi.fixed_rows::<3>(3).into())
                    };
                    columns.extend(Phi.column_iter().enumerate().map(mode_column));
                }
            }
        }
        // Workspaces; with closed loops also for the tree with all its coordinates.
        let widest = model.modal.iter().map(|modal| modal.n).max().unwrap_or(0);
        let loops = (!model.loops.is_empty()).then(|| Box::new(LoopTangent::new(model, first)));
        let tau_d = vec![0.0; model.dependent().len()];
        let carried = vec![Carried::weight(nothing, &nothing); model.bodies.len()];
        Self { first, columns, carried, g: vec![nothing; widest], loops, tau_d }
    }

    /// [`StaticTangent::compute`] under one load, without balancers and loops; `G` is stored column by
    /// column.
    #[inline(always)]
    pub(crate) fn under_load(&mut self, model: &Model, data: &Data<T>, q: &[T], load: &PointLoad, G: &mut [T]) {
        G.fill(T::zero());
        self.carry_weights(model, data);
        self.carry_load(data, load);
        self.finish(model, data, q, G);
    }

    #[inline(always)]
    fn carry_load(&mut self, data: &Data<T>, load: &PointLoad) {
        self.carried[load.body].add(&load.carried(&data.X_WB[load.body]));
    }

    /// W and T of (2) for the weight of each body.
    #[inline(always)]
    fn carry_weights(&mut self, model: &Model, data: &Data<T>) {
        let gravity = lift(&model.gravity);
        for (i, (carried, body)) in self.carried.iter_mut().zip(&model.bodies).enumerate() {
            let inertia = SpatialInertia::lift(&model.bodies[i].inertia);
            let (mut mass, mut h_B) = (inertia.mass, inertia.first_moment);
            if let Some(m) = body.modal {
                mass += data.modal[m].inertia.mass;
                h_B = add(&h_B, &data.modal[m].inertia.first_moment);
            }
            let X_WB = &data.X_WB[i];
            // Uses m c instead of c, so that massless bodies need no special case:
            // N = (m c) gᵀ - (m c · g) 1.
            let h = add(&scaled(&X_WB.translation.vector, mass), &mul(X_WB.rotation.matrix(), &h_B));
            *carried = Carried { f: scaled(&gravity, mass), ..Carried::weight(gravity, &h) };
        }
    }

    /// Sums the loads over subtrees and assembles `G`.
    #[inline(always)]
    fn finish(&mut self, model: &Model, data: &Data<T>, q: &[T], G: &mut [T]) {
        // Loads of each subtree, by (2).
        for i in (1..model.bodies.len()).rev() {
            let parent = model.bodies[i].parent;
            let (inner, outer) = self.carried.split_at_mut(i);
            inner[parent].add(&outer[0]);
        }
        // With closed loops, G also covers the dependent coordinates of the opened tree.
        let n = G.len().isqrt();
        self.place_columns(model, data);
        self.add_pairs(model, G, n);
        self.add_own_joints(model, data, q, G, n);
        self.add_modal_weights(model, data, G, n);
    }

    /// Twists of the coordinates, and the products in (3) and (4).
    #[inline(always)]
    fn place_columns(&mut self, model: &Model, data: &Data<T>) {
        for column in &mut self.columns {
            let (i, body) = (column.body, &model.bodies[column.body]);
            // Twist of the coordinate, at the world's origin, in W axes: w = R a_B, v = R l_B + p × w.
            let X_WB = &data.X_WB[i];
            let (R, p) = (X_WB.rotation.matrix(), &X_WB.translation.vector);
            let S_B = match body.motion {
                JointMotion::Axis(motion) => motion.twist(T::splat(body.ratio)),
                _ => {
                    let S = &data.elastic[i];
                    Twist::new(mul(&S.L, &lift(&column.t)), mul(&S.B, &lift(&column.phi)))
                }
            };
            let w = mul(R, &S_B.angular);
            let v = add(&mul(R, &S_B.linear), &cross(p, &w));
            let Carried { f, n, A, N } = &self.carried[i];
            let vf = cross(&v, f);
            (column.v, column.w) = (v, w);
            (column.force, column.moment) = (mul(A, &w), add(&mul(N, &w), &vf)); // (3)
            column.row = add(&add(&vf, &cross(&w, n)), &add(&tr_mul(A, &v), &tr_mul(N, &w))); // (4)
        }
    }

    /// (3) and (4) for all pairs of coordinates where one moves the other.
    #[inline(always)]
    fn add_pairs(&self, model: &Model, G: &mut [T], n: usize) {
        for (a, inner) in self.columns.iter().enumerate() {
            let end = model.bodies[inner.body].subtree_end;
            // Columns are in body order, so the subtree of `inner` comes after it.
            for outer in &self.columns[a..] {
                if outer.body >= end {
                    break;
                }
                G[outer.k * n + inner.k] -= dot(&inner.v, &outer.force) + dot(&inner.w, &outer.moment);
                if outer.body > inner.body {
                    G[inner.k * n + outer.k] -= dot(&inner.w, &outer.row);
                } else if outer.k != inner.k {
                    G[inner.k * n + outer.k] -= dot(&outer.v, &inner.force) + dot(&outer.w, &inner.moment);
                }
            }
        }
    }

    /// (5): with t the translations in joint axes and φ the angles, about Bo,
    ///
    /// ```text
    /// ∂s_i/∂q_j · W = (t_j × w_i) · f + ([B φ_j]x B φ_i + ∂B/∂φ_j φ_i) · n_Bo
    /// ```
    #[inline(always)]
    fn add_own_joints(&self, model: &Model, data: &Data<T>, q: &[T], G: &mut [T], n: usize) {
        let mut columns = &self.columns[..];
        while let Some(head) = columns.first() {
            let i = head.body;
            // Columns of one joint, which come together.
            let mut count = 1;
            while count < columns.len() && columns[count].body == i {
                count += 1;
            }
            let (joint, rest) = columns.split_at(count);
            columns = rest;
            let (angles, phi) = match model.bodies[i].motion {
                JointMotion::Elastic(angles) => {
                    let k = model.bodies[i].coordinate + 3;
                    (angles, Vector3::new(q[k], q[k + 1], q[k + 2]))
                }
                JointMotion::Interface { modal, interface } => {
                    let entry = &model.modal[modal];
                    let eta = &q[entry.coordinate..entry.coordinate + entry.n];
                    (ElasticAngles::RotationVector, entry.tables.shapes.interfaces[interface].times(eta).1)
                }
                JointMotion::Axis(_) | JointMotion::Welded => continue,
            };
            // Force f and moment n about Bo of what the joint carries, in B axes.
            let (S, X_WB) = (&data.elastic[i], &data.X_WB[i]);
            let R = X_WB.rotation.matrix();
            let f = &self.carried[i].f;
            let n_B = tr_mul(R, &sub(&self.carried[i].n, &cross(&X_WB.translation.vector, f)));
            // (t_j × w_i) · f = t_j · (w_i × f)
            let f_B = tr_mul(R, f);
            let (mut turns, mut slides) = (Matrix3::zeros(), Matrix3::zeros());
            for c in 0..3 {
                let (unit, w_B) = (lift(&Vector3::ith(c, 1.0)), column_of(&S.B, c));
                let dB = angles.rate_map_derivative(&phi, &unit);
                // Covector on φ_i for φ_j along axis c, as a column.
                let turn = add(&tr_mul(&S.B, &cross(&n_B, &w_B)), &tr_mul(&dB, &n_B));
                let slide = tr_mul(&S.L, &cross(&w_B, &f_B));
                turns.data.0[c] = [turn.x, turn.y, turn.z];
                slides.data.0[c] = [slide.x, slide.y, slide.z];
            }
            for row in joint {
                let phi = lift(&row.phi);
                let (slid, turned) = (mul(&slides, &phi), tr_mul(&turns, &phi));
                for column in joint {
                    G[column.k * n + row.k] -= dot(&lift(&column.t), &slid) + dot(&lift(&column.phi), &turned);
                }
            }
        }
    }

    /// Adds (6).
    #[inline(always)]
    fn add_modal_weights(&mut self, model: &Model, data: &Data<T>, G: &mut [T], n: usize) {
        let gravity = lift(&model.gravity);
        for entry in model.modal.iter().filter(|entry| entry.coordinate >= self.first) {
            let R = data.X_WB[entry.body].rotation.matrix();
            for (g, C_t) in self.g.iter_mut().zip(&entry.tables.shapes.C_t) {
                *g = cross(&mul(R, &lift(C_t)), &gravity);
            }
            for column in &self.columns {
                let moves = column.body <= entry.body && entry.body < model.bodies[column.body].subtree_end;
                if !moves {
                    continue;
                }
                for (k, g) in self.g[..entry.n].iter().enumerate() {
                    let k = entry.coordinate - self.first + k;
                    let slope = dot(&column.w, g);
                    G[k * n + column.k] -= slope;
                    G[column.k * n + k] -= slope;
                }
            }
        }
    }
}

impl StaticTangent {
    /// Computes `∂τ/∂q` of the forces that keep the mechanism static under gravity, `loads` and
    /// balancers, without springs, into `G` (N/m, N, N m/rad), (nv - first)×(nv - first). It is
    /// symmetric unless a load has a moment or rotates with its body. Does not allocate.
    ///
    /// * `data`: after [`crate::forward_kinematics`] at `q` (nv).
    ///
    /// # Panics
    /// If the size of `G` does not match, or `q` is not nv long.
    ///
    /// # Source
    /// Theory page, section on statics; (1) to (7) of `static_tangent.rs`.
    pub fn compute(&mut self, model: &Model, data: &Data, q: &DVector<f64>, loads: &[PointLoad], G: &mut DMatrix<f64>) {
        let n = self.size(model);
        assert_eq!(G.shape(), (n, n), "a row and a column per coordinate");
        model.check_size("q", q.len());
        let Some(mut tangent) = self.loops.take() else { return self.of_tree(model, data, q, loads, G) };
        self.of_tree(model, data, q, loads, &mut tangent.G);
        self.tau_d.fill(0.0);
        for column in self.columns.iter().filter(|column| column.k >= n) {
            let Carried { f, n: moment, .. } = &self.carried[column.body];
            self.tau_d[column.k - n] = -column.v.dot(f) - column.w.dot(moment); // (1)
        }
        tangent.reduce(model, data, self.first, &self.tau_d, G);
        self.loops = Some(tangent);
    }

    /// Adds to `dtau` the change of the static forces on the coordinates from the first one on, as
    /// the subtree of a body moves with a twist (world axes, about the world origin) while all
    /// coordinates keep their values: (3) and (4) with the body's joint frame as another joint; closed
    /// loops follow. Call [`StaticTangent::compute`] before.
    ///
    /// Returns the twist of the body `observed`, in world axes about the world origin.
    ///
    /// # Panics
    /// If the model has balancers, or `dtau` is not nv - first long.
    pub fn add_moved_subtree(
        &mut self,
        model: &Model,
        data: &Data,
        (body, moved): (usize, &Twist),
        observed: usize,
        dtau: &mut [f64],
    ) -> Twist {
        assert_eq!(dtau.len(), self.size(model), "one change of force per coordinate of the tangent");
        // The body moves with the subtree; closed loops add the motion of their joints.
        let mut twist = if model.is_in_subtree(observed, body) { *moved } else { Twist::zeros() };
        let Some(mut tangent) = self.loops.take() else {
            self.add_moved_in_tree(model, data, body, moved, dtau);
            return twist;
        };
        // Forces of the opened tree, projected onto the independent coordinates.
        let mut dtree = vec![0.0; tangent.G.nrows()];
        self.add_moved_in_tree(model, data, body, moved, &mut dtree);
        let forces = (&self.tau_d[..], &mut dtree[..]);
        let rates = tangent.add_moved_subtree(model, data, self.first, (body, moved), forces, dtau);
        // Twist due to the dependent joints between the root and the observed body.
        let n = self.size(model);
        for column in self.columns.iter().filter(|column| column.k >= n && model.is_in_subtree(observed, column.body)) {
            let rate = rates[column.k - n];
            twist += Twist::new(column.v * rate, column.w * rate);
        }
        self.loops = Some(tangent);
        twist
    }

    /// [`Self::add_moved_subtree`] over all coordinates of the opened tree.
    fn add_moved_in_tree(&self, model: &Model, data: &Data, body: usize, moved: &Twist, dtau: &mut [f64]) {
        assert!(model.balancers.is_empty(), "balancers are not covered");
        // Coordinates behind the body by (4), those before it by (3).
        let (v, w, end) = (&moved.linear, &moved.angular, model.bodies[body].subtree_end);
        let Carried { f, A, N, .. } = &self.carried[body];
        let (force, moment) = (A * w, N * w + v.cross(f));
        for column in &self.columns {
            if (body..end).contains(&column.body) {
                dtau[column.k] -= w.dot(&column.row);
            } else if column.body < body && body < model.bodies[column.body].subtree_end {
                dtau[column.k] -= column.v.dot(&force) + column.w.dot(&moment);
            }
        }
        // Modal coordinates behind the body by (6).
        let behind =
            model.modal.iter().filter(|entry| (body..end).contains(&entry.body) && entry.coordinate >= self.first);
        for entry in behind {
            let R = data.X_WB[entry.body].rotation.matrix();
            for (k, C_t) in entry.tables.shapes.C_t.iter().enumerate() {
                dtau[entry.coordinate - self.first + k] -= w.dot(&(R * C_t).cross(&model.gravity));
            }
        }
    }

    /// [`StaticTangent::compute`] over all coordinates of the opened tree.
    fn of_tree(&mut self, model: &Model, data: &Data, q: &DVector<f64>, loads: &[PointLoad], G: &mut DMatrix<f64>) {
        G.as_mut_slice().fill(0.0);
        self.carry_weights(model, data);
        loads.iter().for_each(|load| self.carry_load(data, load));
        // Forces at both ends of line balancers.
        for line in model.balancers.iter().filter_map(|balancer| balancer.line(&data.X_WB)) {
            for (end, F_W) in [line.F_W, -line.F_W].into_iter().enumerate() {
                self.carried[line.bodies[end]].add(&Carried::weight(F_W, &line.p_W[end]));
            }
        }
        self.finish(model, data, q.as_slice(), G.as_mut_slice());
        self.add_balancers(model, data, G);
    }

    /// Adds (7).
    fn add_balancers(&mut self, model: &Model, data: &Data, G: &mut DMatrix<f64>) {
        for (balancer, x) in model.balancers.iter().zip(&data.balanced) {
            match &balancer.place {
                BalancerPlace::Points(_) => {
                    if let Some(line) = balancer.line(&data.X_WB) {
                        self.add_line(model, &line, G);
                    }
                }
                BalancerPlace::Joint { terms, .. } => {
                    let k = balancer.law.rate(*x);
                    let own = || terms.iter().filter(|(i, _)| *i >= self.first).map(|(i, c)| (i - self.first, *c));
                    for (i, c_i) in own() {
                        for (j, c_j) in own() {
                            G[(i, j)] += c_i * k * c_j;
                        }
                    }
                }
            }
        }
    }

    /// (7) of one line balancer: `d_i · K d_j` over all pairs of coordinates.
    fn add_line(&mut self, model: &Model, line: &BalancerLine, G: &mut DMatrix<f64>) {
        for column in &mut self.columns {
            let moves = |body: usize| column.body <= body && body < model.bodies[column.body].subtree_end;
            column.d = Vector3::zeros();
            for (end, sign) in [-1.0, 1.0].into_iter().enumerate() {
                if moves(line.bodies[end]) {
                    column.d += (column.v + column.w.cross(&line.p_W[end])) * sign;
                }
            }
        }
        for row in &self.columns {
            let Kd = mul(&line.K_W, &row.d);
            for column in &self.columns {
                G[(row.k, column.k)] += Kd.dot(&column.d);
            }
        }
    }
}
