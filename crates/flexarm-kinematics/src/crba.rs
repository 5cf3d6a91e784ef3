//! Mass matrix by composite rigid bodies, O(n × depth).
//!
//! The composite inertia of everything outward of B acts on B's motion subspace; the resulting wrench,
//! carried inward, gives one column of M. An elastic joint is six columns at once, as 3×3 blocks in its parent's
//! axes, where its translations are constant. Source: [Featherstone 2008], Table 6.2.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::data::{Data, joint_position};
use crate::model::{JointMotion, Model};
use crate::spatial::{Pose, SpatialInertia, Twist, Wrench, cross3, mul3, tr_mul, tr_mul3};

/// Mass matrix `M(q)`, nv×nv, both triangles (kg, kg m, kg m²). Fills `data.{X_PB, M}`. No allocation.
pub fn mass_matrix<'d>(model: &Model, data: &'d mut Data, q: &DVector<f64>) -> &'d DMatrix<f64> {
    for i in 1..model.bodies.len() {
        joint_position(model, data, i, q.as_slice());
    }
    mass_matrix_at_poses(model, data);
    &data.M
}

/// As [`mass_matrix`], for the joint poses that the last pass of another algorithm left in `data`.
pub fn mass_matrix_at_poses(model: &Model, data: &mut Data) {
    let n = model.bodies.len();
    for (composite, body) in data.composite.iter_mut().zip(&model.bodies) {
        *composite = body.inertia;
    }
    data.M.as_mut_slice().fill(0.0);
    let nv = data.M.nrows();
    for i in (1..n).rev() {
        let body = &model.bodies[i];
        let (composite, X_PB) = (data.composite[i], data.X_PB[i]);
        // Column of each coordinate of joint i, rows of itself and of the joints inward of it.
        match body.motion {
            JointMotion::Revolute(axis) => {
                let F = composite.mul_twist(&Twist::new(Vector3::zeros(), axis)) * body.ratio;
                let k = body.coordinate;
                data.M.as_mut_slice()[k * nv + k] += body.ratio * axis.dot(&F.torque);
                one_column(model, data, i, k, F);
            }
            JointMotion::Prismatic(axis) => {
                let F = composite.mul_twist(&Twist::new(axis, Vector3::zeros())) * body.ratio;
                let k = body.coordinate;
                data.M.as_mut_slice()[k * nv + k] += body.ratio * axis.dot(&F.force);
                one_column(model, data, i, k, F);
            }
            JointMotion::Elastic(_) => {}
        }
        let is_elastic = matches!(body.motion, JointMotion::Elastic(_));
        if body.parent > 0 || is_elastic {
            let M_P = composite.at_parent(&X_PB);
            data.composite[body.parent] += M_P;
            if is_elastic {
                elastic_columns(model, data, i, &M_P);
            }
        }
    }
}

/// Rows of all joints inward of body j in the column of one coordinate; `F` at j.
#[inline(always)]
fn one_column(model: &Model, data: &mut Data, mut j: usize, column: usize, mut F: Wrench) {
    let nv = data.M.nrows();
    let M = data.M.as_mut_slice();
    loop {
        let parent = model.bodies[j].parent;
        if parent == 0 {
            return;
        }
        F = F.at_parent(&data.X_PB[j]);
        j = parent;
        let inward = &model.bodies[j];
        let row = inward.coordinate;
        match inward.motion {
            JointMotion::Revolute(axis) => add_pair(M, nv, row, column, inward.ratio * axis.dot(&F.torque)),
            JointMotion::Prismatic(axis) => add_pair(M, nv, row, column, inward.ratio * axis.dot(&F.force)),
            JointMotion::Elastic(_) => {
                let S = &data.elastic[j];
                let (f, t) = (tr_mul(&S.L, &F.force), tr_mul(&S.B, &F.torque));
                add_six(M, nv, row, column, [f.x, f.y, f.z, t.x, t.y, t.z]);
            }
        }
    }
}

/// Adds to both triangles; on the diagonal (a joint that mimics one inward of it) that is twice.
#[inline(always)]
fn add_pair(M: &mut [f64], nv: usize, row: usize, column: usize, value: f64) {
    M[column * nv + row] += value;
    M[row * nv + column] += value;
}

/// Adds six rows from `row` on in one column, and their mirror image.
#[inline(always)]
fn add_six(M: &mut [f64], nv: usize, row: usize, column: usize, values: [f64; 6]) {
    for (entry, value) in M[column * nv + row..][..6].iter_mut().zip(values) {
        *entry += value;
    }
    let mut at = row * nv + column;
    for value in values {
        M[at] += value;
        at += nv;
    }
}

/// Wrenches on six columns, as 3×3 blocks: translations (t), then angles (r).
struct Columns {
    force_t: Matrix3<f64>,
    torque_t: Matrix3<f64>,
    force_r: Matrix3<f64>,
    torque_r: Matrix3<f64>,
}

impl Columns {
    #[inline(always)]
    fn at_parent(&self, X_PB: &Pose) -> Self {
        let (R, p) = (X_PB.rotation.matrix(), &X_PB.translation.vector);
        let (force_t, force_r) = (mul3(R, &self.force_t), mul3(R, &self.force_r));
        Self {
            torque_t: mul3(R, &self.torque_t) + cross3(p, &force_t),
            torque_r: mul3(R, &self.torque_r) + cross3(p, &force_r),
            force_t,
            force_r,
        }
    }
}

/// All columns of an elastic joint, from the composite inertia `M_P` of its body about Po in P axes.
///
/// With `Ω = R_PB B`, `p = p_PB`: S at Po in P axes is `[R_PJ, [p]x Ω; 0, Ω]`.
#[inline(always)]
fn elastic_columns(model: &Model, data: &mut Data, i: usize, M_P: &SpatialInertia) {
    let body = &model.bodies[i];
    let (X_PB, nv) = (&data.X_PB[i], data.M.nrows());
    let (R_PJ, p, h) = (body.X_PJ.rotation.matrix(), &X_PB.translation.vector, &M_P.first_moment);
    let Omega = mul3(X_PB.rotation.matrix(), &data.elastic[i].B);
    let force_r = cross3(&(p * M_P.mass - h), &Omega);
    let mut F = Columns {
        force_t: R_PJ * M_P.mass,
        torque_t: cross3(h, R_PJ),
        torque_r: cross3(h, &cross3(p, &Omega)) + mul3(&M_P.rotational, &Omega),
        force_r,
    };

    // Own block: the translations meet the mass alone.
    let k = body.coordinate;
    let tr = tr_mul3(R_PJ, &force_r);
    let rr = tr_mul3(&Omega, &(F.torque_r - cross3(p, &force_r)));
    let M = data.M.as_mut_slice();
    for c in 0..3 {
        let column = &mut M[(k + c) * nv + k..][..6];
        column[c] = M_P.mass;
        for r in 0..3 {
            column[3 + r] = tr[(c, r)];
        }
        let column = &mut M[(k + 3 + c) * nv + k..][..6];
        for r in 0..3 {
            column[r] = tr[(r, c)];
            column[3 + r] = rr[(r, c)];
        }
    }

    let mut j = body.parent;
    while j > 0 {
        let inward = &model.bodies[j];
        let row = inward.coordinate;
        match inward.motion {
            JointMotion::Revolute(axis) => {
                let a = axis * inward.ratio;
                let (t, r) = (tr_mul(&F.torque_t, &a), tr_mul(&F.torque_r, &a));
                add_six(M, nv, k, row, [t.x, t.y, t.z, r.x, r.y, r.z]);
            }
            JointMotion::Prismatic(axis) => {
                let a = axis * inward.ratio;
                let (t, r) = (tr_mul(&F.force_t, &a), tr_mul(&F.force_r, &a));
                add_six(M, nv, k, row, [t.x, t.y, t.z, r.x, r.y, r.z]);
            }
            JointMotion::Elastic(_) => {
                let S = &data.elastic[j];
                let (tt, rt) = (tr_mul3(&S.L, &F.force_t), tr_mul3(&S.B, &F.torque_t));
                let (tr, rr) = (tr_mul3(&S.L, &F.force_r), tr_mul3(&S.B, &F.torque_r));
                for c in 0..3 {
                    let six = |t: &Matrix3<f64>, r: &Matrix3<f64>| {
                        [t[(0, c)], t[(1, c)], t[(2, c)], r[(0, c)], r[(1, c)], r[(2, c)]]
                    };
                    add_six(M, nv, row, k + c, six(&tt, &rt));
                    add_six(M, nv, row, k + 3 + c, six(&tr, &rr));
                }
            }
        }
        if inward.parent > 0 {
            F = F.at_parent(&data.X_PB[j]);
        }
        j = inward.parent;
    }
}
