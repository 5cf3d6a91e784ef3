//! Mass matrix by composite rigid bodies, O(n × depth).
//!
//! The composite inertia of everything outward of B acts on B's motion subspace; the resulting wrench,
//! carried inward, gives one column of M. An elastic joint is six columns at once, as 3×3 blocks in its parent's
//! axes, where its translations are constant. The coordinates of a modal body are n columns more: its own `C_t` and `C_r`
//! and what its interfaces carry. Source: [Featherstone 2008], Table 6.2.

use flexarm_spatial::products::{
    add, add3, cross, cross3, dot, lift, lift3, mul, mul3, scaled, scaled3, sub, tr_mul, tr_mul3,
};
use flexarm_spatial::{Pose, Real, SpatialInertia, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Scalar, Vector3};

use crate::axis_motion::AxisMotion;
use crate::closure;
use crate::data::{Data, ElasticSubspace, begin, joint_position};
use crate::lanes::Tree;
use crate::model::{Body, JointMotion, Model};

/// Mass matrix `M(q)`, nv×nv, both triangles (kg, kg m, kg m²). Fills `data.{X_PB, M}`. No allocation.
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

/// [`mass_matrix_at_poses`] over any scalar.
#[inline(always)]
pub(crate) fn composite_bodies<T: Real>(tree: &impl Tree<T>, data: &mut Data<T>) {
    let model = tree.model();
    let n = model.bodies.len();
    for (i, composite) in data.composite.iter_mut().enumerate() {
        *composite = tree.inertia(i);
    }
    data.M.as_mut_slice().fill(T::zero());
    let nv = data.M.nrows();
    for (entry, modal) in model.modal.iter().zip(&mut data.modal) {
        data.composite[entry.body] += modal.inertia;
        let (c, shapes) = (entry.coordinate, &entry.tables.shapes);
        data.M.view_mut((c, c), (entry.n, entry.n)).zip_apply(&shapes.M, |to, m| *to = T::splat(m));
        for (k, column) in modal.columns.iter_mut().enumerate() {
            *column = Wrench::new(lift(&shapes.C_t[k]), modal.C_r[k]);
        }
    }
    for i in (1..n).rev() {
        let body = &model.bodies[i];
        let (composite, X_PB) = (data.composite[i], data.X_PB[i]);
        let k = body.coordinate;
        match body.motion {
            JointMotion::Axis(motion) => {
                let F = axis_wrench(motion, &composite, body.ratio);
                let own = motion.linear(
                    #[inline(always)]
                    |axis| dot(&lift(&(axis * body.ratio)), &F.torque),
                    #[inline(always)]
                    |axis| dot(&lift(&(axis * body.ratio)), &F.force),
                );
                data.M.as_mut_slice()[k * nv + k] += own + T::splat(body.ratio * body.ratio * body.armature);
                data.U[i] = F;
            }
            JointMotion::Welded => {}
            JointMotion::Elastic(_) => elastic_columns(model, data, i, &composite),
            JointMotion::Interface { modal, interface } => {
                interface_columns(model, data, i, modal, interface, &composite)
            }
        }
        if let Some(m) = body.modal {
            let entry = &model.modal[m];
            for (k, F) in data.modal[m].columns.iter().enumerate() {
                let column = entry.coordinate + k;
                meet(model, &data.elastic, data.M.as_mut_slice(), nv, i, column, F);
            }
        }
        if body.parent > 0 {
            data.composite[body.parent] += composite.at_parent(&X_PB);
            carry_columns(model, data, i);
        }
    }
    for &(a, b, inertia) in &model.rotor_couplings {
        add_pair(data.M.as_mut_slice(), nv, a, b, T::splat(inertia));
    }
}

/// `I_c S` of a joint of one coordinate: the wrench that moves all that is outward of it, at Bo in B axes.
#[inline(always)]
fn axis_wrench<T: Real>(motion: AxisMotion, composite: &SpatialInertia<T>, ratio: f64) -> Wrench<T> {
    motion.linear(
        #[inline(always)]
        |axis| {
            let a = lift::<T>(&(axis * ratio));
            Wrench::new(cross(&a, &composite.first_moment), mul(&composite.rotational, &a))
        },
        #[inline(always)]
        |axis| {
            let l = lift::<T>(&(axis * ratio));
            Wrench::new(scaled(&l, composite.mass), cross(&composite.first_moment, &l))
        },
    )
}

/// Carries the wrenches of all one-DoF joints from body i outward over to its parent and meets the parent's joint:
/// one level for all of them at once, because they do not wait for each other.
#[inline(always)]
fn carry_columns<T: Real>(model: &Model, data: &mut Data<T>, i: usize) {
    let (nv, X_PB) = (data.M.nrows(), data.X_PB[i]);
    let parent = model.bodies[i].parent;
    let inward = &model.bodies[parent];
    let row = inward.coordinate;
    let M = data.M.as_mut_slice();
    let outward = i..model.bodies[i].subtree_end;
    for (F, body) in data.U[outward.clone()].iter_mut().zip(&model.bodies[outward]) {
        if !matches!(body.motion, JointMotion::Axis(_)) {
            continue;
        }
        *F = F.at_parent(&X_PB);
        let column = body.coordinate;
        match inward.motion {
            JointMotion::Axis(motion) => add_pair(M, nv, row, column, T::splat(inward.ratio) * motion.project(F)),
            JointMotion::Elastic(_) => {
                let S = &data.elastic[parent];
                let (f, t) = (tr_mul(&S.L, &F.force), tr_mul(&S.B, &F.torque));
                add_six(M, nv, row, column, [f.x, f.y, f.z, t.x, t.y, t.z]);
            }
            JointMotion::Welded => {}
            JointMotion::Interface { .. } => meet(model, &data.elastic, M, nv, parent, column, F),
        }
    }
    for (entry, modal) in model.modal.iter().zip(&mut data.modal) {
        if (i..model.bodies[i].subtree_end).contains(&entry.body) {
            for (k, F) in modal.columns.iter_mut().enumerate() {
                *F = F.at_parent(&X_PB);
                meet(model, &data.elastic, M, nv, parent, entry.coordinate + k, F);
            }
        }
    }
}

/// Adds `Sᵀ F` of the joint that moves body j to one column, and the mirror image; F at Bo in B axes of that body.
#[inline(always)]
fn meet<T: Real>(
    model: &Model,
    elastic: &[ElasticSubspace<T>],
    M: &mut [T],
    nv: usize,
    j: usize,
    column: usize,
    F: &Wrench<T>,
) {
    let body = &model.bodies[j];
    let row = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => add_pair(M, nv, row, column, T::splat(body.ratio) * motion.project(F)),
        JointMotion::Welded => {}
        JointMotion::Elastic(_) => {
            let S = &elastic[j];
            let (f, t) = (tr_mul(&S.L, &F.force), tr_mul(&S.B, &F.torque));
            add_six(M, nv, row, column, [f.x, f.y, f.z, t.x, t.y, t.z]);
        }
        JointMotion::Interface { modal, interface } => {
            let (S, entry) = (&elastic[j], &model.modal[modal]);
            let (f, t) = (tr_mul(&S.L, &F.force), tr_mul(&S.B, &F.torque));
            let columns = entry.tables.shapes.interfaces[interface].Phi.as_slice().chunks_exact(6);
            for (k, c) in columns.enumerate() {
                let (l, a) = (Vector3::new(c[0], c[1], c[2]), Vector3::new(c[3], c[4], c[5]));
                let value = dot(&lift(&l), &f) + dot(&lift(&a), &t);
                add_pair(M, nv, row + k, column, value);
            }
        }
    }
}

/// What the composite body behind an interface adds to the coordinates of its modal body.
#[inline(always)]
fn interface_columns<T: Real>(
    model: &Model,
    data: &mut Data<T>,
    i: usize,
    modal: usize,
    interface: usize,
    composite: &SpatialInertia<T>,
) {
    let (entry, S) = (&model.modal[modal], data.elastic[i]);
    let (nv, c) = (data.M.nrows(), entry.coordinate);
    let shape = &entry.tables.shapes.interfaces[interface];
    let M = data.M.as_mut_slice();
    for (k, column) in data.modal[modal].columns.iter_mut().enumerate() {
        let F = composite.mul_twist(&shape.twist(k, &S.L, &S.B));
        shape.project(&S.L, &S.B, &F, &mut M[(c + k) * nv + c..][..entry.n]);
        *column += F.at_parent(&data.X_PB[i]);
    }
}

/// Adds to both triangles; on the diagonal (a joint that mimics one inward of it) that is twice.
#[inline(always)]
fn add_pair<T: Real>(M: &mut [T], nv: usize, row: usize, column: usize, value: T) {
    M[column * nv + row] += value;
    M[row * nv + column] += value;
}

/// Column c of two matrices, one below the other.
#[inline(always)]
fn six<T: Real>(upper: &Matrix3<T>, lower: &Matrix3<T>, c: usize) -> [T; 6] {
    let ([a, b, d], [e, f, g]) = (upper.data.0[c], lower.data.0[c]);
    [a, b, d, e, f, g]
}

/// Adds six rows from `row` on in one column, and their mirror image.
#[inline(always)]
fn add_six<T: Real>(M: &mut [T], nv: usize, row: usize, column: usize, values: [T; 6]) {
    for (entry, value) in M[column * nv + row..][..6].iter_mut().zip(values) {
        *entry += value;
    }
    let mut at = row * nv + column;
    for value in values {
        M[at] += value;
        at += nv;
    }
}

/// All columns of an elastic joint of body i, whose composite inertia is `composite` (about Bo, B axes).
///
/// Everything is kept in the axes of the parent P, and the axes of the joints inward are turned there, one rotation
/// per level instead of four.
#[inline(always)]
fn elastic_columns<T: Real>(model: &Model, data: &mut Data<T>, i: usize, composite: &SpatialInertia<T>) {
    let (body, X_PB) = (&model.bodies[i], &data.X_PB[i]);
    let columns = ElasticColumns::new(body, X_PB, &data.elastic[i].B, composite, data.M.nrows());
    let M = data.M.as_mut_slice();
    columns.write_own_block(M);

    // From joint to joint inward: A the body there, R_AP its rotation, r from Ao to Bo in P axes.
    let mut j = body.parent;
    let (mut R_AP, mut r) = (Matrix3::identity(), X_PB.translation.vector);
    while j > 0 {
        columns.meet(model, &data.elastic[j], M, j, &R_AP, &r);
        let inward = &model.bodies[j];
        if inward.parent > 0 {
            let X = &data.X_PB[j];
            R_AP = mul3(X.rotation.matrix(), &R_AP);
            r = add(&r, &tr_mul(&R_AP, &X.translation.vector));
        }
        j = inward.parent;
    }
}

/// How what an elastic joint carries answers to its coordinates, in the axes of the parent P.
///
/// With `U = R_PJ` and `Ω = R_PB B` the joint moves Bo by `U d'` and turns B by `Ω φ'`; the composite's first moment `h_B` and
/// inertia `J_B` about Bo answer with
///
/// ```text
/// translations: force m U,          moment about Bo  [h_B]x U                (1)
/// angles:       force -[h_B]x Ω,    moment about Bo  W = J_B Ω               (2)
/// ```
/// About the origin of a joint inward, `r` before Bo, an axis a meets them as
///
/// ```text
/// Uᵀ (a × (m r + h_B)),   Wᵀ a - Ωᵀ ((a × r) × h_B)                          (3)
/// ```
struct ElasticColumns<T: Scalar> {
    /// First coordinate of the joint.
    k: usize,
    /// Rows of M.
    nv: usize,
    mass: T,
    U: Matrix3<T>,
    Omega: Matrix3<T>,
    W: Matrix3<T>,
    h_B: Vector3<T>,
    /// Force of the angles.
    force_r: Matrix3<T>,
}

impl<T: Real> ElasticColumns<T> {
    #[inline(always)]
    fn new(body: &Body, X_PB: &Pose<T>, B: &Matrix3<T>, composite: &SpatialInertia<T>, nv: usize) -> Self {
        let (R_PB, U) = (X_PB.rotation.matrix(), lift3(body.X_PJ.rotation.matrix()));
        let Omega = mul3(R_PB, B);
        let W = mul3(R_PB, &mul3(&composite.rotational, B)); // (2)
        let h_B = mul(R_PB, &composite.first_moment);
        let force_r = scaled3(&cross3(&h_B, &Omega), -T::one());
        Self { k: body.coordinate, nv, mass: composite.mass, U, Omega, W, h_B, force_r }
    }

    /// The joint's own six columns: the translations meet the mass alone.
    #[inline(always)]
    fn write_own_block(&self, M: &mut [T]) {
        let (k, nv) = (self.k, self.nv);
        let (tr, rr) = (tr_mul3(&self.U, &self.force_r), tr_mul3(&self.Omega, &self.W));
        for c in 0..3 {
            let column = &mut M[(k + c) * nv + k..][..6];
            column[c] = self.mass;
            for r in 0..3 {
                column[3 + r] = tr[(c, r)];
            }
            let column = &mut M[(k + 3 + c) * nv + k..][..6];
            for r in 0..3 {
                column[r] = tr[(r, c)];
                column[3 + r] = rr[(r, c)];
            }
        }
    }

    /// Adds what the joint of body j, inward, meets: `S` its subspace if it is elastic, `R_AP` and r as in [`elastic_columns`].
    #[inline(always)]
    fn meet(&self, model: &Model, S: &ElasticSubspace<T>, M: &mut [T], j: usize, R_AP: &Matrix3<T>, r: &Vector3<T>) {
        let Self { k, nv, mass, U, Omega, W, h_B, force_r } = self;
        let inward = &model.bodies[j];
        let (row, nv, mass) = (inward.coordinate, *nv, *mass);
        // m r + h_B of (3).
        let moment = add(&scaled(r, mass), h_B);
        match inward.motion {
            JointMotion::Axis(motion) => {
                // Forces of the translations and of the angles, (3).
                let Wrench { force: t, torque: q } = motion.linear(
                    #[inline(always)]
                    |axis| {
                        let a = tr_mul(R_AP, &lift(&(axis * inward.ratio)));
                        let t = tr_mul(U, &cross(&a, &moment));
                        Wrench::new(t, sub(&tr_mul(W, &a), &tr_mul(Omega, &cross(&cross(&a, r), h_B))))
                    },
                    #[inline(always)]
                    |axis| {
                        let l = tr_mul(R_AP, &lift(&(axis * inward.ratio)));
                        Wrench::new(scaled(&tr_mul(U, &l), mass), tr_mul(force_r, &l))
                    },
                );
                add_six(M, nv, *k, row, [t.x, t.y, t.z, q.x, q.y, q.z]);
            }
            JointMotion::Welded => {}
            JointMotion::Elastic(_) => {
                let (L, B) = (tr_mul3(R_AP, &S.L), tr_mul3(R_AP, &S.B));
                let (tt, tr) = (tr_mul3(&L, &scaled3(U, mass)), tr_mul3(&L, force_r));
                let rt = tr_mul3(&B, &cross3(&moment, U));
                let rr = tr_mul3(&B, &add3(W, &cross3(r, force_r)));
                for c in 0..3 {
                    add_six(M, nv, row, k + c, six(&tt, &rt, c));
                    add_six(M, nv, row, k + 3 + c, six(&tr, &rr, c));
                }
            }
            JointMotion::Interface { modal, interface } => {
                let entry = &model.modal[modal];
                let shape = &entry.tables.shapes.interfaces[interface];
                for m in 0..entry.n {
                    let column = shape.twist(m, &S.L, &S.B);
                    let (l, a) = (tr_mul(R_AP, &column.linear), tr_mul(R_AP, &column.angular));
                    let t = tr_mul(U, &add(&scaled(&l, mass), &cross(&a, &moment)));
                    let turned = sub(&tr_mul(W, &a), &tr_mul(Omega, &cross(&cross(&a, r), h_B)));
                    let q = add(&tr_mul(force_r, &l), &turned);
                    add_six(M, nv, *k, row + m, [t.x, t.y, t.z, q.x, q.y, q.z]);
                }
            }
        }
    }
}
