//! Mass matrix by the composite rigid body algorithm, O(n × depth).
//!
//! The composite inertia of the subtree of B acts on B's motion subspace; the resulting wrench,
//! carried inward, gives one column of M. All quantities are in the axes of the first body of the
//! arm, so that carrying a wrench inward changes only its moment. The six columns of an elastic
//! joint are processed together. The coordinates of a modal body give n more columns: its own `C_t`
//! and `C_r` plus the contribution of the bodies on its interfaces. Start at [`composite_bodies`].
//! Not here: reduction of M by closed loops (`closure`). Source: [Featherstone 2008], Table 6.2.

use std::ops::Add;

use flexarm_spatial::products::{add, column, cross, dot, lift, mul, mul3, scaled, tr_mul};
use flexarm_spatial::{Real, SpatialInertia, Twist, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Scalar, Vector3};

use crate::axis_motion::AxisMotion;
use crate::closure;
use crate::data::{Data, ElasticSubspace, begin, joint_position};
use crate::kinematics::turned;
use crate::model::{Body, JointMotion, Model};

/// Computes the mass matrix `M(q)`, nv×nv, both triangles (kg, kg m, kg m²), rotors included. Fills
/// `data.{X_PB, M}`. Does not allocate.
///
/// # Panics
/// If `q` is not nv long, or `data` is of another model.
///
/// # Source
/// [Featherstone 2008], Table 6.2.
pub fn mass_matrix<'d>(model: &Model, data: &'d mut Data, q: &DVector<f64>) -> &'d DMatrix<f64> {
    model.check_size("q", q.len());
    data.check_sizes(model);
    if model.loops.is_empty() {
        begin(model, data, q.as_slice());
        for i in 1..model.bodies.len() {
            joint_position(model, data, i, q.as_slice());
        }
    } else {
        closure::place(model, data, q.as_slice());
    }
    mass_matrix_at_poses(model, data);
    &data.M
}

/// As [`mass_matrix`], into `data.M`, with the joint poses left in `data` by the last pass of another
/// algorithm.
pub fn mass_matrix_at_poses(model: &Model, data: &mut Data) {
    match model.loops.is_empty() {
        true => composite_bodies(model, data),
        false => closure::mass_matrix_at_poses(model, data),
    }
}

/// Body rotated to the axes of the first body of its arm: the child of the base, or the base itself
/// if it is a modal body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotatedBody<T: Scalar> {
    /// Rotation from body axes to these axes.
    R: Matrix3<T>,
    /// Position of Bo relative to the parent's origin.
    r: Vector3<T>,
    /// Motion subspace of a single-DoF joint.
    axis: Twist<T>,
    /// Motion subspace of a six-DoF joint.
    S: ElasticSubspace<T>,
}

impl<T: Real> RotatedBody<T> {
    /// Identity rotation and zero offset.
    pub(crate) fn identity() -> Self {
        let one = Matrix3::identity();
        Self { R: one, r: Vector3::zeros(), axis: Twist::zeros(), S: ElasticSubspace { L: one, B: one } }
    }
}

/// Six wrenches, stored as rows of their components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SixWrenches<T> {
    force: [[T; 6]; 3],
    torque: [[T; 6]; 3],
}

/// One value for each of six coordinates.
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
    /// Six zero wrenches.
    pub(crate) fn zeros() -> Self {
        Self { force: [[T::zero(); 6]; 3], torque: [[T::zero(); 6]; 3] }
    }

    /// Sets the wrenches that give a composite body unit accelerations along the six coordinates of
    /// an elastic joint, about Bo.
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

    /// Shifts the reference point of the moments inward by r, row by row for contiguous access.
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

/// `aᵀ` times three rows of six values.
#[inline(always)]
fn along<T: Real>(a: &Vector3<T>, rows: &[[T; 6]; 3]) -> Six<T> {
    let [x, y, z] = rows;
    let mut all = [T::zero(); 6];
    for c in 0..6 {
        all[c] = a.x * x[c] + a.y * y[c] + a.z * z[c];
    }
    Six(all)
}

/// [`mass_matrix_at_poses`] for any scalar type.
#[inline(always)]
pub(crate) fn composite_bodies<T: Real>(model: &Model, data: &mut Data<T>) {
    turn_bodies(model, data);
    begin_modal_columns(model, data);
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        let (k, own, composite) = (body.coordinate, &data.turned[i], &data.composite[i]);
        let mut lower = Lower::of(&mut data.M, model);
        // Columns of the body's own joint: F = I_c S, and its diagonal block Sᵀ F.
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
        // Columns of modal coordinates against the joint that carries the modal body.
        if let Some(m) = body.modal {
            let mut lower = Lower::of(&mut data.M, model);
            for (k, F) in data.modal[m].columns.iter().enumerate() {
                lower.meet(model, body, &data.turned[i], model.modal[m].coordinate + k, F);
            }
        }
        // I_c of P += I_c of B; all wrenches of the subtree move to Po and meet the joint of P.
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

/// Fills `turned` and initialises `composite` with the inertia of each body.
#[inline(always)]
fn turn_bodies<T: Real>(model: &Model, data: &mut Data<T>) {
    let base_bends = model.bodies[0].modal.is_some();
    if base_bends {
        data.composite[0] = SpatialInertia::lift(&model.bodies[0].inertia);
    }
    // Bodies whose axes are used for their whole arm.
    let is_first = |i: usize| i == 0 || (model.bodies[i].parent == 0 && !base_bends);
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let (X_PB, S) = (&data.X_PB[i], &data.elastic[i]);
        let (inward, outward) = data.turned.split_at_mut(i);
        let (P, B) = (&inward[body.parent], &mut outward[0]);
        let mut inertia = SpatialInertia::lift(&model.bodies[i].inertia);
        if let Some(m) = body.modal {
            inertia += data.modal[m].inertia;
        }
        // R is the identity and r zero: axes and subspace as they are.
        if is_first(i) {
            match &body.motion {
                JointMotion::Axis(motion) => B.axis = motion.twist(T::splat(body.ratio)),
                JointMotion::Welded => {}
                JointMotion::Elastic(_) | JointMotion::Interface { .. } => B.S = *S,
            }
            data.composite[i] = inertia;
            continue;
        }
        // R_0B = R_0P R_PB and p_PoBo_0 = R_0P p_PoBo_P, 0 being the first body of the arm.
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
                // Translations are along the axes of the joint frame J.
                B.S.L = if body.is_parallel { P.R } else { mul3(&B.R, &S.L) };
                B.S.B = mul3(&B.R, &S.B);
            }
        }
        data.composite[i] = inertia.turned(&B.R);
    }
}

/// Zeroes M if not all pairs of coordinates are written; initialises mass and wrenches of modal
/// bodies.
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

/// `I_c S` of a single-DoF joint, about Bo.
#[inline(always)]
fn axis_wrench<T: Real>(motion: &AxisMotion, S: &Twist<T>, composite: &SpatialInertia<T>) -> Wrench<T> {
    motion.linear(
        #[inline(always)]
        |_| Wrench::new(cross(&S.angular, &composite.first_moment), mul(&composite.rotational, &S.angular)),
        #[inline(always)]
        |_| Wrench::new(scaled(&S.linear, composite.mass), cross(&composite.first_moment, &S.linear)),
    )
}

/// `Sᵀ F` of a single-DoF joint.
#[inline(always)]
fn axis_project<T: Real>(motion: &AxisMotion, S: &Twist<T>, F: &Wrench<T>) -> T {
    motion.linear(
        #[inline(always)]
        |_| dot(&S.angular, &F.torque),
        #[inline(always)]
        |_| dot(&S.linear, &F.force),
    )
}

/// Carries the wrenches of the subtree of body i to its parent and projects them onto the parent's
/// joint. All wrenches of one level are processed together, as they are independent of each other.
#[inline(always)]
fn carry_columns<T: Real>(model: &Model, data: &mut Data<T>, i: usize) {
    let body = &model.bodies[i];
    let parent = &model.bodies[body.parent];
    let (r, own) = (&data.turned[i].r, &data.turned[body.parent]);
    let mut lower = Lower::of(&mut data.M, model);
    // Wrenches about the parent's origin: t += r × f. Single-axis joints first.
    let range = body.columns.single.clone();
    for (F, column) in data.single[range.clone()].iter_mut().zip(&model.single[range]) {
        F.torque = add(&F.torque, &cross(r, &F.force));
        lower.meet(model, parent, own, *column, F);
    }
    // Elastic joints: six wrenches at once.
    let range = body.columns.six.clone();
    for (F, column) in data.six[range.clone()].iter_mut().zip(&model.six[range]) {
        F.carry(r);
        lower.meet_six(model, parent, own, *column, F);
    }
    // Modal bodies in the subtree: a wrench per mode.
    for (entry, modal) in model.modal.iter().zip(&mut data.modal) {
        if (i..body.subtree_end).contains(&entry.body) {
            for (k, F) in modal.columns.iter_mut().enumerate() {
                F.torque = add(&F.torque, &cross(r, &F.force));
                lower.meet(model, parent, own, entry.coordinate + k, F);
            }
        }
    }
}

/// `Sᵀ F` of a six-DoF joint.
#[inline(always)]
fn six<T: Real>(S: &ElasticSubspace<T>, F: &Wrench<T>) -> [T; 6] {
    let (f, t) = (tr_mul(&S.L, &F.force), tr_mul(&S.B, &F.torque));
    [f.x, f.y, f.z, t.x, t.y, t.z]
}

/// `Aᵀ` times three rows of six values.
#[inline(always)]
fn three_by_six<T: Real>(A: &Matrix3<T>, rows: &[[T; 6]; 3]) -> [[T; 6]; 3] {
    [along(&column(A, 0), rows).0, along(&column(A, 1), rows).0, along(&column(A, 2), rows).0]
}

/// Dot product of a mode shape column with the projections on six coordinates.
#[inline(always)]
fn times<T: Real>(phi: &[f64], s: &[T; 6]) -> T {
    let mut sum = T::zero();
    for (phi, s) in phi.iter().zip(s) {
        sum += T::splat(*phi) * *s;
    }
    sum
}

/// Adds the contribution of composite body i, moved by an interface, to the columns of its modal
/// body.
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

/// Lower triangle of M, into which the recursion writes.
struct Lower<'m, T> {
    M: &'m mut [T],
    nv: usize,
    /// Whether values are added to existing entries.
    sums: bool,
}

impl<'m, T: Real> Lower<'m, T> {
    #[inline(always)]
    fn of(M: &'m mut DMatrix<T>, model: &Model) -> Self {
        Self { nv: M.nrows(), M: M.as_mut_slice(), sums: model.sums_entries }
    }

    /// Entry of two coordinates in the lower triangle.
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

    /// Writes the entries of six coordinates, from `six` on, with another coordinate outside them.
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

    /// Writes the diagonal block of a six-DoF joint; in translation it is the mass times identity.
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

    /// Writes six rows of a column of the diagonal block; [`Self::mirror`] overwrites the part
    /// above the diagonal.
    #[inline(always)]
    fn put_block_column(&mut self, k: usize, column: usize, values: &[T; 6]) {
        self.M[column * self.nv + k..][..6].copy_from_slice(values);
    }

    /// Writes `Sᵀ F` of the joint of `body` into one column; F is about Bo of that body.
    #[inline(always)]
    fn meet(&mut self, model: &Model, body: &Body, own: &RotatedBody<T>, column: usize, F: &Wrench<T>) {
        let row = body.coordinate;
        match &body.motion {
            JointMotion::Axis(motion) => {
                let value = axis_project(motion, &own.axis, F);
                self.put(row, column, value);
                // A mimic joint inward of its leader or vice versa: both triangles contribute to
                // the diagonal.
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
    fn meet_six(&mut self, model: &Model, body: &Body, own: &RotatedBody<T>, column: usize, F: &SixWrenches<T>) {
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
                // Rows of Sᵀ F: translations Lᵀ f, then angles Bᵀ t.
                for c in 0..3 {
                    self.put_six(column, row + c, &along(&self::column(&own.S.L, c), &F.force).0);
                    self.put_six(column, row + 3 + c, &along(&self::column(&own.S.B, c), &F.torque).0);
                }
            }
            JointMotion::Interface { modal, interface } => {
                // Φᵀ times Sᵀ F of all six columns.
                let (tr, rr) = (three_by_six(&own.S.L, &F.force), three_by_six(&own.S.B, &F.torque));
                for (k, phi) in model.modal[*modal].columns_of(*interface).enumerate() {
                    let mut values = [T::zero(); 6];
                    for (phi, projected) in phi.iter().zip(tr.iter().chain(&rr)) {
                        for (value, x) in values.iter_mut().zip(projected) {
                            *value += T::splat(*phi) * *x;
                        }
                    }
                    self.put_six(column, row + k, &values);
                }
            }
        }
    }

    /// Copies the lower triangle to the upper one, four columns at a time.
    #[inline(always)]
    fn mirror(&mut self) {
        const WIDE: usize = 4;
        let (nv, whole) = (self.nv, self.nv / WIDE * WIDE);
        for c in (0..whole).step_by(WIDE) {
            let (own, outward) = self.M[c * nv..].split_at_mut(WIDE * nv);
            // Entries within the diagonal block.
            for j in 1..WIDE {
                let mut row = [T::zero(); WIDE];
                for k in 0..j {
                    row[k] = own[k * nv + c + j];
                }
                own[j * nv + c..][..j].copy_from_slice(&row[..j]);
            }
            // Entries below the block: one row of four from four columns.
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
        // Last columns, at most three.
        for c in whole..nv {
            for r in c + 1..nv {
                self.M[r * nv + c] = self.M[c * nv + r];
            }
        }
    }
}
