//! Mass matrix by composite rigid bodies, O(n × depth).
//!
//! The composite inertia of everything outward of B acts on B's motion subspace; the resulting wrench,
//! carried inward, gives one column of M. An elastic joint is six columns at once, as 3×3 blocks in its parent's
//! axes, where its translations are constant. Source: [Featherstone 2008], Table 6.2.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::data::{Data, joint_position};
use crate::model::{JointMotion, Model};
use crate::spatial::{Pose, SpatialInertia, Twist, Wrench};

/// Mass matrix `M(q)`, nv×nv, both triangles [kg, kg m, kg m²]. Fills `data.{X_PB, M}`. No allocation.
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
                one_column(model, data, body.parent, k, F.at_parent(&X_PB));
            }
            JointMotion::Prismatic(axis) => {
                let F = composite.mul_twist(&Twist::new(axis, Vector3::zeros())) * body.ratio;
                let k = body.coordinate;
                data.M.as_mut_slice()[k * nv + k] += body.ratio * axis.dot(&F.force);
                one_column(model, data, body.parent, k, F.at_parent(&X_PB));
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
    // Each pair of different coordinates was written once.
    let M = data.M.as_mut_slice();
    for c in 0..nv {
        for r in 0..c {
            let sum = M[c * nv + r] + M[r * nv + c];
            M[c * nv + r] = sum;
            M[r * nv + c] = sum;
        }
    }
}

/// Rows of all joints from body j inward in the column of one coordinate; `F` at j.
#[inline(always)]
fn one_column(model: &Model, data: &mut Data, mut j: usize, column: usize, mut F: Wrench) {
    let nv = data.M.nrows();
    let rows = &mut data.M.as_mut_slice()[column * nv..(column + 1) * nv];
    while j > 0 {
        let inward = &model.bodies[j];
        let k = inward.coordinate;
        match inward.motion {
            JointMotion::Revolute(axis) => rows[k] += mirrored(k, column) * inward.ratio * axis.dot(&F.torque),
            JointMotion::Prismatic(axis) => rows[k] += mirrored(k, column) * inward.ratio * axis.dot(&F.force),
            JointMotion::Elastic(_) => {
                let S = &data.elastic[j];
                let (f, t) = (S.L.tr_mul(&F.force), S.B.tr_mul(&F.torque));
                let rows = &mut rows[k..k + 6];
                for r in 0..3 {
                    rows[r] += f[r];
                    rows[3 + r] += t[r];
                }
            }
        }
        F = F.at_parent(&data.X_PB[j]);
        j = inward.parent;
    }
}

/// A joint that mimics a joint inward of it meets itself twice on the diagonal.
#[inline(always)]
fn mirrored(row: usize, column: usize) -> f64 {
    if row == column { 2.0 } else { 1.0 }
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
        let (force_t, force_r) = (R * self.force_t, R * self.force_r);
        Self {
            torque_t: R * self.torque_t + cross(p, &force_t),
            torque_r: R * self.torque_r + cross(p, &force_r),
            force_t,
            force_r,
        }
    }
}

/// `[p]x A`.
#[inline(always)]
fn cross(p: &Vector3<f64>, A: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[p.cross(&A.column(0)), p.cross(&A.column(1)), p.cross(&A.column(2))])
}

/// All columns of an elastic joint, from the composite inertia `M_P` of its body about Po in P axes.
///
/// With `Ω = R_PB B`, `p = p_PB`: S at Po in P axes is `[R_PJ, [p]x Ω; 0, Ω]`.
#[inline(always)]
fn elastic_columns(model: &Model, data: &mut Data, i: usize, M_P: &SpatialInertia) {
    let body = &model.bodies[i];
    let (X_PB, nv) = (&data.X_PB[i], data.M.nrows());
    let (R_PJ, p, h) = (body.X_PJ.rotation.matrix(), &X_PB.translation.vector, &M_P.first_moment);
    let Omega = X_PB.rotation.matrix() * data.elastic[i].B;
    let force_r = cross(&(p * M_P.mass - h), &Omega);
    let mut F = Columns {
        force_t: R_PJ * M_P.mass,
        torque_t: cross(h, R_PJ),
        torque_r: cross(h, &cross(p, &Omega)) + M_P.rotational * Omega,
        force_r,
    };

    // Own block: the translations meet the mass alone; only the upper triangle, the rest is mirrored.
    let k = body.coordinate;
    let tr = R_PJ.tr_mul(&force_r);
    let rr = Omega.tr_mul(&(F.torque_r - cross(p, &force_r)));
    let M = data.M.as_mut_slice();
    for c in 0..3 {
        M[(k + c) * nv + k + c] = M_P.mass;
        let rows = &mut M[(k + 3 + c) * nv + k..][..6];
        for r in 0..3 {
            rows[r] = tr[(r, c)];
        }
        for r in 0..=c {
            rows[3 + r] = rr[(r, c)];
        }
    }

    let mut j = body.parent;
    while j > 0 {
        let inward = &model.bodies[j];
        let row = inward.coordinate;
        match inward.motion {
            JointMotion::Revolute(axis) => {
                let a = axis * inward.ratio;
                let (t, r) = (F.torque_t.tr_mul(&a), F.torque_r.tr_mul(&a));
                for c in 0..3 {
                    M[(k + c) * nv + row] += t[c];
                    M[(k + 3 + c) * nv + row] += r[c];
                }
            }
            JointMotion::Prismatic(axis) => {
                let a = axis * inward.ratio;
                let (t, r) = (F.force_t.tr_mul(&a), F.force_r.tr_mul(&a));
                for c in 0..3 {
                    M[(k + c) * nv + row] += t[c];
                    M[(k + 3 + c) * nv + row] += r[c];
                }
            }
            JointMotion::Elastic(_) => {
                let S = &data.elastic[j];
                let (tt, rt) = (S.L.tr_mul(&F.force_t), S.B.tr_mul(&F.torque_t));
                let (tr, rr) = (S.L.tr_mul(&F.force_r), S.B.tr_mul(&F.torque_r));
                for c in 0..3 {
                    let rows = &mut M[(k + c) * nv + row..][..6];
                    for r in 0..3 {
                        rows[r] = tt[(r, c)];
                        rows[3 + r] = rt[(r, c)];
                    }
                    let rows = &mut M[(k + 3 + c) * nv + row..][..6];
                    for r in 0..3 {
                        rows[r] = tr[(r, c)];
                        rows[3 + r] = rr[(r, c)];
                    }
                }
            }
        }
        F = F.at_parent(&data.X_PB[j]);
        j = inward.parent;
    }
}
