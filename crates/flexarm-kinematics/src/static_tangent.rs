//! How the forces that hold a mechanism still change with its coordinates, in closed form.
//!
//! All about the origin of the world, in its axes: the column of coordinate i is the twist `s_i = [v; w]` of what it moves, and
//! `W_i = [f; n]` the weight and the loads on that.
//!
//! ```text
//! τ_i = -s_i · W_i                                                           (1)
//! dW  = T s_j,   T = [   0    A ]    weight m g at c: f = m g, A = 0, N = c fᵀ - (c · f) 1
//!                    [ -[f]x  N ]    loads that turn with their body have A and more in N   (2)
//!
//! j outward of i, or in the same joint:   ∂τ_i/∂q_j = -s_i · T_j s_j             (3)
//! j inward of i:                          ∂τ_i/∂q_j = -(s_j × s_i) · W_i - s_i · T_i s_j
//!                                                   = -w_j · (v_i × f + w_i × n + Aᵀ v_i + Nᵀ w_i)   (4)
//! in the same elastic joint besides:      -∂s_i/∂q_j · W_i                       (5)
//! ```
//! The coordinates of a modal body move what hangs on its interfaces as an elastic joint does, and its own centre of mass:
//!
//! ```text
//! τ_k = -(R C_t,k) · g,    ∂τ_k/∂q_j = ∂τ_j/∂η_k = -w_j · (R C_t,k × g)       j inward of the body      (6)
//! ```
//! Balancers (`balancer.rs`) act as a pair of loads that keep their direction in (2); that they turn and stretch is, with the
//! velocity `d_i` of their one end against the other per rate of coordinate i,
//!
//! ```text
//! line:  ∂τ_i/∂q_j += d_i · K d_j        joint:  ∂τ_i/∂q_j += c_i k c_j                    (7)
//! ```
//! One pass over the bodies and one over the pairs of coordinates; central differences of [`crate::gravity_forces`] take 2 n
//! passes over the bodies.

use flexarm_spatial::products::{mul, tr_mul};
use flexarm_spatial::{ElasticAngles, Twist, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::balancer::{BalancerLine, BalancerPlace};
use crate::closure::LoopTangent;
use crate::data::Data;
use crate::model::{JointMotion, Model};

/// A wrench on a body, for [`StaticTangent::compute`].
#[derive(Clone, Copy, Debug)]
pub struct PointLoad {
    /// The body.
    pub body: usize,
    /// The point at which it acts, in body axes from Bo (m).
    pub p_B: Vector3<f64>,
    /// Force and moment there, world axes (N, N m).
    pub F_W: Wrench,
    /// Whether it turns with the body; else it keeps its direction in the world.
    pub turns: bool,
}

/// `∂τ/∂q` of the static forces, with its workspace.
#[derive(Clone, Debug)]
pub struct StaticTangent {
    /// First coordinate of the matrix.
    first: usize,
    columns: Vec<Column>,
    /// One per body: weight and loads on all outward of it, and how they change.
    carried: Vec<Carried>,
    g: Vec<Vector3<f64>>,
    /// Of closed loops: slopes of the tree, and forces on the dependent coordinates.
    loops: Option<Box<LoopTangent>>,
    tau_d: Vec<f64>,
}

/// A twist by which a coordinate moves what is outward of a body.
#[derive(Clone, Copy, Debug)]
struct Column {
    /// Coordinate, from the first one of the matrix.
    k: usize,
    body: usize,
    /// Displacement in joint axes and rates of the angles per rate of the coordinate, of joints with angles.
    t: Vector3<f64>,
    phi: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
    /// `T s` in (3).
    force: Vector3<f64>,
    moment: Vector3<f64>,
    /// The bracket of (4).
    row: Vector3<f64>,
    /// d of (7) for the balancer at hand.
    d: Vector3<f64>,
}

/// W and T of (2).
#[derive(Clone, Copy, Debug)]
struct Carried {
    f: Vector3<f64>,
    n: Vector3<f64>,
    A: Matrix3<f64>,
    N: Matrix3<f64>,
}

impl Carried {
    const ZERO: Self = Self {
        f: Vector3::new(0.0, 0.0, 0.0),
        n: Vector3::new(0.0, 0.0, 0.0),
        A: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        N: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// A force that keeps its direction, at the point c.
    fn weight(f: Vector3<f64>, c: &Vector3<f64>) -> Self {
        Self { f, n: c.cross(&f), A: Matrix3::zeros(), N: arm_turns(c, &f) }
    }

    fn add(&mut self, other: &Self) {
        self.f += other.f;
        self.n += other.n;
        self.A += other.A;
        self.N += other.N;
    }
}

/// `(w × r) × f` as a matrix on w.
fn arm_turns(r: &Vector3<f64>, f: &Vector3<f64>) -> Matrix3<f64> {
    r * f.transpose() - Matrix3::from_diagonal_element(r.dot(f))
}

/// `w × a` as a matrix on w.
fn turned(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, a.z, -a.y, -a.z, 0.0, a.x, a.y, -a.x, 0.0)
}

impl PointLoad {
    /// W and T of (2).
    fn carried(&self, data: &Data) -> Carried {
        let X_WB = &data.X_WB[self.body];
        let p = X_WB.translation.vector + mul(X_WB.rotation.matrix(), &self.p_B);
        let (f, m) = (self.F_W.force, self.F_W.torque);
        let mut carried = Carried::weight(f, &p);
        carried.n += m;
        if self.turns {
            carried.A = turned(&f);
            carried.N += turned(&m) + p.cross_matrix() * carried.A;
        }
        carried
    }
}

impl StaticTangent {
    /// For the coordinates from `first` on: 0, or [`Model::n_actuated`] for the elastic ones.
    pub fn new(model: &Model, first: usize) -> Self {
        let mut columns = Vec::new();
        let zero = Vector3::zeros();
        let column = |k: usize, body: usize, t: Vector3<f64>, phi: Vector3<f64>| Column {
            k: k - first,
            body,
            t,
            phi,
            v: zero,
            w: zero,
            force: zero,
            moment: zero,
            row: zero,
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
                    let of = |(c, Phi): (usize, nalgebra::MatrixView6x1<'_, f64>)| {
                        column(k + c, i, Phi.fixed_rows::<3>(0).into(), Phi.fixed_rows::<3>(3).into())
                    };
                    columns.extend(Phi.column_iter().enumerate().map(of));
                }
            }
        }
        let widest = model.modal.iter().map(|modal| modal.n).max().unwrap_or(0);
        let loops = (!model.loops.is_empty()).then(|| Box::new(LoopTangent::new(model, first)));
        let tau_d = vec![0.0; model.dependent().len()];
        Self { first, columns, carried: vec![Carried::ZERO; model.bodies.len()], g: vec![zero; widest], loops, tau_d }
    }

    /// `∂τ/∂q` of the forces that hold the mechanism still under weight and `loads`, without springs; (n - first)×(n - first),
    /// written over all of `G`. Symmetric but where a load has a moment or turns with its body. No allocation.
    ///
    /// * `data`: after [`crate::forward_kinematics`] at `q`.
    ///
    /// # Panics
    /// If `G` has another size.
    pub fn compute(&mut self, model: &Model, data: &Data, q: &DVector<f64>, loads: &[PointLoad], G: &mut DMatrix<f64>) {
        let n = model.nv() - self.first;
        assert_eq!(G.shape(), (n, n), "a row and a column per coordinate");
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

    /// [`StaticTangent::compute`] with all coordinates of the opened tree.
    fn of_tree(&mut self, model: &Model, data: &Data, q: &DVector<f64>, loads: &[PointLoad], G: &mut DMatrix<f64>) {
        G.as_mut_slice().fill(0.0);
        self.carry(model, data, loads);
        self.place_columns(model, data);
        self.add_pairs(model, G);
        self.add_own_joints(model, data, q, G);
        self.add_modal_weights(model, data, G);
        self.add_balancers(model, data, G);
    }

    /// W and T of (2) of everything outward of each body.
    fn carry(&mut self, model: &Model, data: &Data, loads: &[PointLoad]) {
        for (i, (carried, body)) in self.carried.iter_mut().zip(&model.bodies).enumerate() {
            let (mut mass, mut h_B) = (body.inertia.mass, body.inertia.first_moment);
            if let Some(m) = body.modal {
                mass += data.modal[m].inertia.mass;
                h_B += data.modal[m].inertia.first_moment;
            }
            let X_WB = &data.X_WB[i];
            // m c, so that a body without mass is no exception: (m c) gᵀ - (m c · g) 1.
            let h = X_WB.translation.vector * mass + mul(X_WB.rotation.matrix(), &h_B);
            *carried = Carried { f: model.gravity * mass, ..Carried::weight(model.gravity, &h) };
        }
        for load in loads {
            self.carried[load.body].add(&load.carried(data));
        }
        for line in model.balancers.iter().filter_map(|balancer| balancer.line(&data.X_WB)) {
            for (end, F_W) in [line.F_W, -line.F_W].into_iter().enumerate() {
                self.carried[line.bodies[end]].add(&Carried::weight(F_W, &line.p_W[end]));
            }
        }
        for i in (1..model.bodies.len()).rev() {
            let parent = model.bodies[i].parent;
            let (inner, outer) = self.carried.split_at_mut(i);
            inner[parent].add(&outer[0]);
        }
    }

    /// Twists of the coordinates, and what (3) and (4) make of them.
    fn place_columns(&mut self, model: &Model, data: &Data) {
        for column in &mut self.columns {
            let (i, body) = (column.body, &model.bodies[column.body]);
            let X_WB = &data.X_WB[i];
            let (R, p) = (X_WB.rotation.matrix(), &X_WB.translation.vector);
            let S_B = match body.motion {
                JointMotion::Axis(motion) => motion.twist(body.ratio),
                _ => {
                    let S = &data.elastic[i];
                    Twist::new(mul(&S.L, &column.t), mul(&S.B, &column.phi))
                }
            };
            let w = mul(R, &S_B.angular);
            let v = mul(R, &S_B.linear) + p.cross(&w);
            let Carried { f, n, A, N } = &self.carried[i];
            (column.v, column.w) = (v, w);
            (column.force, column.moment) = (mul(A, &w), mul(N, &w) + v.cross(f)); // (3)
            column.row = v.cross(f) + w.cross(n) + tr_mul(A, &v) + tr_mul(N, &w); // (4)
        }
    }

    /// (3) and (4) for all pairs of which one moves the other.
    fn add_pairs(&self, model: &Model, G: &mut DMatrix<f64>) {
        for (a, inner) in self.columns.iter().enumerate() {
            let end = model.bodies[inner.body].subtree_end;
            // Columns are in the order of bodies: what `inner` moves comes after it.
            for outer in &self.columns[a..] {
                if outer.body >= end {
                    break;
                }
                G[(inner.k, outer.k)] -= inner.v.dot(&outer.force) + inner.w.dot(&outer.moment);
                if outer.body > inner.body {
                    G[(outer.k, inner.k)] -= inner.w.dot(&outer.row);
                } else if outer.k != inner.k {
                    G[(outer.k, inner.k)] -= outer.v.dot(&inner.force) + outer.w.dot(&inner.moment);
                }
            }
        }
    }

    /// (5): with t translations in joint axes and φ angles, about Bo,
    ///
    /// ```text
    /// ∂s_i/∂q_j · W = (t_j × w_i) · f + ([B φ_j]x B φ_i + ∂B/∂φ_j φ_i) · n_Bo
    /// ```
    fn add_own_joints(&self, model: &Model, data: &Data, q: &DVector<f64>, G: &mut DMatrix<f64>) {
        let mut columns = &self.columns[..];
        while let Some(head) = columns.first() {
            let i = head.body;
            let count = columns.iter().take_while(|column| column.body == i).count();
            let (joint, rest) = columns.split_at(count);
            columns = rest;
            let (angles, phi) = match model.bodies[i].motion {
                JointMotion::Elastic(angles) => {
                    let k = model.bodies[i].coordinate + 3;
                    (angles, Vector3::new(q[k], q[k + 1], q[k + 2]))
                }
                JointMotion::Interface { modal, interface } => {
                    let entry = &model.modal[modal];
                    let eta = &q.as_slice()[entry.coordinate..entry.coordinate + entry.n];
                    (ElasticAngles::RotationVector, entry.tables.shapes.interfaces[interface].times(eta).1)
                }
                JointMotion::Axis(_) | JointMotion::Welded => continue,
            };
            let (S, X_WB) = (&data.elastic[i], &data.X_WB[i]);
            let R = X_WB.rotation.matrix();
            let f = &self.carried[i].f;
            let n_B = tr_mul(R, &(self.carried[i].n - X_WB.translation.vector.cross(f)));
            // Row j: (…) · n_Bo as a covector on φ_i.
            let turns = Matrix3::from_rows(&[0, 1, 2].map(|c| {
                let unit = Vector3::ith(c, 1.0);
                let dB = angles.rate_map_derivative(&phi, &unit);
                let turn: Vector3<f64> = S.B.column(c).into();
                (tr_mul(&S.B, &n_B.cross(&turn)) + tr_mul(&dB, &n_B)).transpose()
            }));
            // (t_j × w_i) · f = t_j · (w_i × f)
            let f_B = tr_mul(R, f);
            let slides = Matrix3::from_columns(&[0, 1, 2].map(|c| {
                let w_B: Vector3<f64> = S.B.column(c).into();
                tr_mul(&S.L, &w_B.cross(&f_B))
            }));
            for row in joint {
                let (slid, turned) = (mul(&slides, &row.phi), mul(&turns, &row.phi));
                for column in joint {
                    G[(row.k, column.k)] -= column.t.dot(&slid) + column.phi.dot(&turned);
                }
            }
        }
    }

    /// (6).
    fn add_modal_weights(&mut self, model: &Model, data: &Data, G: &mut DMatrix<f64>) {
        for entry in model.modal.iter().filter(|entry| entry.coordinate >= self.first) {
            let R = data.X_WB[entry.body].rotation.matrix();
            for (g, C_t) in self.g.iter_mut().zip(&entry.tables.shapes.C_t) {
                *g = mul(R, C_t).cross(&model.gravity);
            }
            for column in &self.columns {
                let moves = column.body <= entry.body && entry.body < model.bodies[column.body].subtree_end;
                if !moves {
                    continue;
                }
                for (k, g) in self.g[..entry.n].iter().enumerate() {
                    let k = entry.coordinate - self.first + k;
                    let slope = column.w.dot(g);
                    G[(column.k, k)] -= slope;
                    G[(k, column.k)] -= slope;
                }
            }
        }
    }

    /// (7).
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
