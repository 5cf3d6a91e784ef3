//! Mass matrix by composite rigid bodies, O(n × depth).
//!
//! The composite inertia of everything outward of B acts on B's motion subspace; the resulting
//! wrench, carried inward, gives one column of M. All of it is in the axes of the arm's first body,
//! so that a wrench keeps its force on the way and only its moment changes with the point. The six
//! columns of an elastic joint go side by side. The coordinates of a modal body are n columns more:
//! its own `C_t` and `C_r` and what its interfaces carry. Source: [Featherstone 2008], Table 6.2.

use std::ops::Add;

use flexarm_spatial::products::{add, column, cross, dot, lift, mul, mul3, scaled, tr_mul};
use flexarm_spatial::{Real, SpatialInertia, Twist, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Scalar, Vector3};

use crate::axis_motion::AxisMotion;
use crate::closure;
use crate::data::{Data, ElasticSubspace, begin, joint_position};
use crate::kinematics::turned;
use crate::lanes::Tree;
use crate::model::{Body, JointMotion, Model};

/// Mass matrix `M(q)`, nv×nv, both triangles (kg, kg m, kg m²). Fills `data.{X_PB, M}`. No
/// allocation.
///
/// Of trees without closed loops, balancers and modal bodies [`crate::FreeForces::mass_at`] has the
/// same matrix, to rounding, in two thirds to four fifths of the time.
pub fn mass_matrix<'d>(model: &Model, data: &'d mut Data, q: &DVector<f64>) -> &'d DMatrix<f64> {
    if !model.loops.is_empty() {
        closure::place(model, data, q.as_slice());
        mass_matrix_at_poses(model, data);
        return &data.M;
    }
    begin(model, data, q.as_slice());
    for i in 1..model.bodies.len() {
        joint_position(model, data, i, q.as_slice());
    }
    mass_matrix_at_poses(model, data);
    &data.M
}

/// As [`mass_matrix`], for the joint poses that the last pass of another algorithm left in `data`.
pub fn mass_matrix_at_poses(model: &Model, data: &mut Data) {
    match model.loops.is_empty() {
        true => composite_bodies(model, data),
        false => closure::mass_matrix_at_poses(model, data),
    }
}

/// A body in the axes of the first body of its arm: those of the body that hangs on the base, or of
/// the base if that bends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turned<T: Scalar> {
    /// Turns vectors of the body's axes.
    R: Matrix3<T>,
    /// From the parent's origin to the body's.
    r: Vector3<T>,
    /// Motion subspace of its joint, of one coordinate.
    axis: Twist<T>,
    /// Motion subspace of its joint, of six coordinates.
    S: ElasticSubspace<T>,
}

impl<T: Real> Turned<T> {
    /// Not turned at all.
    pub(crate) fn identity() -> Self {
        let one = Matrix3::identity();
        Self { R: one, r: Vector3::zeros(), axis: Twist::zeros(), S: ElasticSubspace { L: one, B: one } }
    }
}

/// Six wrenches side by side, as rows of their components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SixWrenches<T> {
    force: [[T; 6]; 3],
    torque: [[T; 6]; 3],
}

/// One number for each of six coordinates.
#[derive(Clone, Copy)]
struct Six<T>([T; 6]);

impl<T: Real> Add for Six<T> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        for (to, x) in self.0.iter_mut().zip(other.0) {
            *to += x;
        }
        self
    }
}

impl<T: Real> SixWrenches<T> {
    /// None.
    pub(crate) fn zeros() -> Self {
        Self { force: [[T::zero(); 6]; 3], torque: [[T::zero(); 6]; 3] }
    }

    /// What moves a composite body along the six coordinates of an elastic joint, about Bo.
    ///
    /// ```text
    /// translations: force m L,          moment [h]x L
    /// angles:       force -[h]x B,      moment J B
    /// ```
    #[inline(always)]
    fn move_body(&mut self, composite: &SpatialInertia<T>, S: &ElasticSubspace<T>) {
        let SpatialInertia { mass, first_moment: h, rotational: J } = composite;
        for c in 0..3 {
            let (l, a) = (column(&S.L, c), column(&S.B, c));
            self.set(c, &Wrench::new(scaled(&l, *mass), cross(h, &l)));
            self.set(3 + c, &Wrench::new(cross(&a, h), mul(J, &a)));
        }
    }

    #[inline(always)]
    fn set(&mut self, c: usize, F: &Wrench<T>) {
        let (f, t) = (&F.force.data.0[0], &F.torque.data.0[0]);
        for k in 0..3 {
            self.force[k][c] = f[k];
            self.torque[k][c] = t[k];
        }
    }

    /// About a point r before this one. A row at a time: so the numbers of a row go side by side.
    #[inline(always)]
    fn carry(&mut self, r: &Vector3<T>) {
        let (r, Self { force: [x, y, z], torque: [tx, ty, tz] }) = (*r, self);
        for c in 0..6 {
            tx[c] += r.y * z[c] - r.z * y[c];
        }
        for c in 0..6 {
            ty[c] += r.z * x[c] - r.x * z[c];
        }
        for c in 0..6 {
            tz[c] += r.x * y[c] - r.y * x[c];
        }
    }
}

/// `aᵀ` times three rows.
#[inline(always)]
fn along<T: Real>(a: &Vector3<T>, rows: &[[T; 6]; 3]) -> Six<T> {
    let [x, y, z] = rows;
    let mut all = [T::zero(); 6];
    for c in 0..6 {
        all[c] = a.x * x[c] + a.y * y[c] + a.z * z[c];
    }
    Six(all)
}

/// [`mass_matrix_at_poses`] over any scalar.
#[inline(always)]
pub(crate) fn composite_bodies<T: Real>(tree: &impl Tree<T>, data: &mut Data<T>) {
    let model = tree.model();
    turn_bodies(tree, data);
    begin_modal_columns(model, data);
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        let (k, own, composite) = (body.coordinate, &data.turned[i], &data.composite[i]);
        let mut lower = Lower::of(&mut data.M, model);
        match &body.motion {
            JointMotion::Axis(motion) => {
                let F = axis_wrench(motion, &own.axis, composite);
                let armature = T::splat(body.ratio * body.ratio * body.armature);
                lower.put(k, k, axis_project(motion, &own.axis, &F) + armature);
                data.single[body.columns.single.start] = F;
            }
            JointMotion::Welded => {}
            JointMotion::Elastic(_) => {
                let F = &mut data.six[body.columns.six.start];
                F.move_body(composite, &own.S);
                lower.put_own_block(k, composite.mass, &own.S, F);
            }
            JointMotion::Interface { .. } => interface_columns(model, data, i),
        }
        if let Some(m) = body.modal {
            let mut lower = Lower::of(&mut data.M, model);
            for (k, F) in data.modal[m].columns.iter().enumerate() {
                lower.meet(model, body, &data.turned[i], model.modal[m].coordinate + k, F);
            }
        }
        if body.parent > 0 {
            let shifted = data.composite[i].shifted(&data.turned[i].r);
            data.composite[body.parent] += shifted;
            carry_columns(model, data, i);
        }
    }
    let mut lower = Lower::of(&mut data.M, model);
    for &(a, b, inertia) in &model.rotor_couplings {
        *lower.entry(a, b) += T::splat(inertia);
    }
    lower.mirror();
}

/// Fills `turned` and begins `composite` with the inertia of each body.
#[inline(always)]
fn turn_bodies<T: Real>(tree: &impl Tree<T>, data: &mut Data<T>) {
    let model = tree.model();
    let base_bends = model.bodies[0].modal.is_some();
    if base_bends {
        data.composite[0] = tree.inertia(0);
    }
    // Whose axes all others are turned to.
    let is_first = |i: usize| i == 0 || (model.bodies[i].parent == 0 && !base_bends);
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let (X_PB, S) = (&data.X_PB[i], &data.elastic[i]);
        let (inward, outward) = data.turned.split_at_mut(i);
        let (P, B) = (&inward[body.parent], &mut outward[0]);
        let mut inertia = tree.inertia(i);
        if let Some(m) = body.modal {
            inertia += data.modal[m].inertia;
        }
        if is_first(i) {
            match &body.motion {
                JointMotion::Axis(motion) => B.axis = motion.twist(T::splat(body.ratio)),
                JointMotion::Welded => {}
                JointMotion::Elastic(_) | JointMotion::Interface { .. } => B.S = *S,
            }
            data.composite[i] = inertia;
            continue;
        }
        let (R, r) = (X_PB.rotation.matrix(), &X_PB.translation.vector);
        if is_first(body.parent) {
            B.R = *R;
            B.r = *r;
        } else {
            B.R = mul3(&P.R, R);
            B.r = mul(&P.R, r);
        }
        match &body.motion {
            JointMotion::Axis(motion) => B.axis = turned(*motion, &B.R, body.ratio),
            JointMotion::Welded => {}
            JointMotion::Elastic(_) | JointMotion::Interface { .. } => {
                // The translations are along the axes of J.
                B.S.L = if body.is_parallel { P.R } else { mul3(&B.R, &S.L) };
                B.S.B = mul3(&B.R, &S.B);
            }
        }
        data.composite[i] = inertia.turned(&B.R);
    }
}

/// Zeros in M where not every pair of coordinates meets; mass and wrenches of modal bodies.
#[inline(always)]
fn begin_modal_columns<T: Real>(model: &Model, data: &mut Data<T>) {
    if model.sums_entries {
        data.M.as_mut_slice().fill(T::zero());
    }
    let nv = data.M.nrows();
    for (entry, modal) in model.modal.iter().zip(&mut data.modal) {
        let (R, c, shapes) = (&data.turned[entry.body].R, entry.coordinate, &entry.tables.shapes);
        let M = data.M.as_mut_slice();
        for (k, from) in shapes.M.as_slice().chunks_exact(entry.n).enumerate() {
            for (to, m) in M[(c + k) * nv + c..].iter_mut().zip(from) {
                *to = T::splat(*m);
            }
        }
        for (k, column) in modal.columns.iter_mut().enumerate() {
            *column = Wrench::new(mul(R, &lift(&shapes.C_t[k])), mul(R, &modal.C_r[k]));
        }
    }
}

/// `I_c S` of a joint of one coordinate: the wrench that moves all that is outward of it, at Bo.
#[inline(always)]
fn axis_wrench<T: Real>(motion: &AxisMotion, S: &Twist<T>, composite: &SpatialInertia<T>) -> Wrench<T> {
    motion.linear(
        #[inline(always)]
        |_| Wrench::new(cross(&S.angular, &composite.first_moment), mul(&composite.rotational, &S.angular)),
        #[inline(always)]
        |_| Wrench::new(scaled(&S.linear, composite.mass), cross(&composite.first_moment, &S.linear)),
    )
}

/// `Sᵀ F` of a joint of one coordinate.
#[inline(always)]
fn axis_project<T: Real>(motion: &AxisMotion, S: &Twist<T>, F: &Wrench<T>) -> T {
    motion.linear(
        #[inline(always)]
        |_| dot(&S.angular, &F.torque),
        #[inline(always)]
        |_| dot(&S.linear, &F.force),
    )
}

/// Carries the wrenches of all that is outward of body i, and its own, over to its parent and meets
/// the parent's joint: one level for all of them at once, because they do not wait for each other.
#[inline(always)]
fn carry_columns<T: Real>(model: &Model, data: &mut Data<T>, i: usize) {
    let body = &model.bodies[i];
    let parent = &model.bodies[body.parent];
    let (r, own) = (&data.turned[i].r, &data.turned[body.parent]);
    let mut lower = Lower::of(&mut data.M, model);
    let range = body.columns.single.clone();
    for (F, column) in data.single[range.clone()].iter_mut().zip(&model.single[range]) {
        F.torque = add(&F.torque, &cross(r, &F.force));
        lower.meet(model, parent, own, *column, F);
    }
    let range = body.columns.six.clone();
    for (F, column) in data.six[range.clone()].iter_mut().zip(&model.six[range]) {
        F.carry(r);
        lower.meet_six(model, parent, own, *column, F);
    }
    for (entry, modal) in model.modal.iter().zip(&mut data.modal) {
        if (i..body.subtree_end).contains(&entry.body) {
            for (k, F) in modal.columns.iter_mut().enumerate() {
                F.torque = add(&F.torque, &cross(r, &F.force));
                lower.meet(model, parent, own, entry.coordinate + k, F);
            }
        }
    }
}

/// `Sᵀ F` of a joint of six coordinates.
#[inline(always)]
fn six<T: Real>(S: &ElasticSubspace<T>, F: &Wrench<T>) -> [T; 6] {
    let (f, t) = (tr_mul(&S.L, &F.force), tr_mul(&S.B, &F.torque));
    [f.x, f.y, f.z, t.x, t.y, t.z]
}

/// [`six`] of six wrenches: a row for each coordinate.
#[inline(always)]
fn six_by_six<T: Real>(S: &ElasticSubspace<T>, F: &SixWrenches<T>) -> [[T; 6]; 6] {
    let ([a, b, c], [d, e, f]) = (three_by_six(&S.L, &F.force), three_by_six(&S.B, &F.torque));
    [a, b, c, d, e, f]
}

/// `Aᵀ` times three rows.
#[inline(always)]
fn three_by_six<T: Real>(A: &Matrix3<T>, rows: &[[T; 6]; 3]) -> [[T; 6]; 3] {
    [along(&column(A, 0), rows).0, along(&column(A, 1), rows).0, along(&column(A, 2), rows).0]
}

/// A column of shapes times what six coordinates meet.
#[inline(always)]
fn times<T: Real>(phi: &[f64], s: &[T; 6]) -> T {
    let mut sum = T::zero();
    for (phi, s) in phi.iter().zip(s) {
        sum += T::splat(*phi) * *s;
    }
    sum
}

/// What the composite body i, behind an interface, adds to the coordinates of its modal body.
#[inline(always)]
fn interface_columns<T: Real>(model: &Model, data: &mut Data<T>, i: usize) {
    let JointMotion::Interface { modal, interface } = model.bodies[i].motion else { return };
    let (entry, composite, own) = (&model.modal[modal], &data.composite[i], &data.turned[i]);
    let (nv, c, S) = (data.M.nrows(), entry.coordinate, &own.S);
    let shape = &entry.tables.shapes.interfaces[interface];
    let M = data.M.as_mut_slice();
    for (k, column) in data.modal[modal].columns[..entry.tables.moving[interface]].iter_mut().enumerate() {
        let F = composite.mul_twist(&shape.twist(k, &S.L, &S.B));
        shape.project(&S.L, &S.B, &F, &mut M[(c + k) * nv + c..][..entry.n]);
        *column += Wrench::new(F.force, add(&F.torque, &cross(&own.r, &F.force)));
    }
}

/// The lower triangle of M, where the recursion writes.
struct Lower<'m, T> {
    M: &'m mut [T],
    nv: usize,
    /// Whether values come on top of what is there.
    sums: bool,
}

impl<'m, T: Real> Lower<'m, T> {
    #[inline(always)]
    fn of(M: &'m mut DMatrix<T>, model: &Model) -> Self {
        Self { nv: M.nrows(), M: M.as_mut_slice(), sums: model.sums_entries }
    }

    /// The entry of two coordinates.
    #[inline(always)]
    fn entry(&mut self, a: usize, b: usize) -> &mut T {
        &mut self.M[a.min(b) * self.nv + a.max(b)]
    }

    #[inline(always)]
    fn put(&mut self, a: usize, b: usize, value: T) {
        let sums = self.sums;
        let entry = self.entry(a, b);
        *entry = if sums { *entry + value } else { value };
    }

    /// The entries of six coordinates, from `six` on, and another one that is none of them.
    #[inline(always)]
    fn put_six(&mut self, six: usize, one: usize, values: &[T; 6]) {
        if six < one {
            for (k, value) in values.iter().enumerate() {
                self.put(six + k, one, *value);
            }
            return;
        }
        let to = &mut self.M[one * self.nv + six..][..6];
        if self.sums {
            for (to, value) in to.iter_mut().zip(values) {
                *to += *value;
            }
        } else {
            to.copy_from_slice(values);
        }
    }

    /// The joint's own six columns: the translations meet the mass alone.
    #[inline(always)]
    fn put_own_block(&mut self, k: usize, mass: T, S: &ElasticSubspace<T>, F: &SixWrenches<T>) {
        let (tr, rr) = (three_by_six(&S.L, &F.force), three_by_six(&S.B, &F.torque));
        for c in 0..3 {
            let mut values = tr[c];
            values[..3].copy_from_slice(&[T::zero(); 3]);
            values[c] = mass;
            self.put_block_column(k, k + c, &values);
            self.put_block_column(k, k + 3 + c, &rr[c]);
        }
    }

    /// Six rows of a column on the diagonal; above it the mirror overwrites them.
    #[inline(always)]
    fn put_block_column(&mut self, k: usize, column: usize, values: &[T; 6]) {
        self.M[column * self.nv + k..][..6].copy_from_slice(values);
    }

    /// `Sᵀ F` of the joint that moves a body in one column; F at Bo of that body.
    #[inline(always)]
    fn meet(&mut self, model: &Model, body: &Body, own: &Turned<T>, column: usize, F: &Wrench<T>) {
        let row = body.coordinate;
        match &body.motion {
            JointMotion::Axis(motion) => {
                let value = axis_project(motion, &own.axis, F);
                self.put(row, column, value);
                // A joint that mimics one inward of it: both triangles meet on the diagonal.
                if row == column {
                    self.put(row, column, value);
                }
            }
            JointMotion::Welded => {}
            JointMotion::Elastic(_) => self.put_six(row, column, &six(&own.S, F)),
            JointMotion::Interface { modal, interface } => {
                let s = six(&own.S, F);
                for (k, phi) in model.modal[*modal].columns_of(*interface).enumerate() {
                    self.put(row + k, column, times(phi, &s));
                }
            }
        }
    }

    /// [`Self::meet`] for the six columns of an elastic joint.
    #[inline(always)]
    fn meet_six(&mut self, model: &Model, body: &Body, own: &Turned<T>, column: usize, F: &SixWrenches<T>) {
        let row = body.coordinate;
        match &body.motion {
            JointMotion::Axis(motion) => {
                let values = motion.linear(
                    #[inline(always)]
                    |_| along(&own.axis.angular, &F.torque),
                    #[inline(always)]
                    |_| along(&own.axis.linear, &F.force),
                );
                self.put_six(column, row, &values.0);
            }
            JointMotion::Welded => {}
            JointMotion::Elastic(_) => {
                for c in 0..3 {
                    self.put_six(column, row + c, &along(&self::column(&own.S.L, c), &F.force).0);
                    self.put_six(column, row + 3 + c, &along(&self::column(&own.S.B, c), &F.torque).0);
                }
            }
            JointMotion::Interface { modal, interface } => {
                let all = six_by_six(&own.S, F);
                for (k, phi) in model.modal[*modal].columns_of(*interface).enumerate() {
                    let mut values = [T::zero(); 6];
                    for (phi, all) in phi.iter().zip(&all) {
                        for (value, x) in values.iter_mut().zip(all) {
                            *value += T::splat(*phi) * *x;
                        }
                    }
                    self.put_six(column, row + k, &values);
                }
            }
        }
    }

    /// The upper triangle, four columns of the lower one at a time.
    #[inline(always)]
    fn mirror(&mut self) {
        const WIDE: usize = 4;
        let (nv, whole) = (self.nv, self.nv / WIDE * WIDE);
        for c in (0..whole).step_by(WIDE) {
            let (own, outward) = self.M[c * nv..].split_at_mut(WIDE * nv);
            for j in 1..WIDE {
                let mut row = [T::zero(); WIDE];
                for k in 0..j {
                    row[k] = own[k * nv + c + j];
                }
                own[j * nv + c..][..j].copy_from_slice(&row[..j]);
            }
            let ((c0, c1), (c2, c3)) = {
                let (first, second) = own.split_at(2 * nv);
                (first.split_at(nv), second.split_at(nv))
            };
            let rest = c + WIDE..;
            let rows = c0[rest.clone()].iter().zip(&c1[rest.clone()]).zip(&c2[rest.clone()]).zip(&c3[rest]);
            for (to, (((x0, x1), x2), x3)) in outward.chunks_exact_mut(nv).zip(rows) {
                to[c..c + WIDE].copy_from_slice(&[*x0, *x1, *x2, *x3]);
            }
        }
        for c in whole..nv {
            for r in c + 1..nv {
                self.M[r * nv + c] = self.M[c * nv + r];
            }
        }
    }
}
