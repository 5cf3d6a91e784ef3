//! Mass matrix by composite rigid bodies, O(n × depth).
//!
//! The composite inertia of everything outward of B acts on B's motion subspace; the resulting wrench,
//! carried inward, gives one column of M. Source: [Featherstone 2008], Table 6.2.

use nalgebra::{DMatrix, DVector};

use crate::data::{Data, joint_position};
use crate::model::{JointMotion, Model};
use crate::spatial::{Twist, Wrench};

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
    for i in 1..n {
        data.composite[i] = model.bodies[i].inertia;
    }
    for i in (1..n).rev() {
        let parent = model.bodies[i].parent;
        if parent > 0 {
            let M_P = data.composite[i].at_parent(&data.X_PB[i]);
            data.composite[parent] += M_P;
        }
    }
    data.M.fill(0.0);
    for i in 1..n {
        match model.bodies[i].motion {
            JointMotion::Revolute(axis) => {
                let F = data.composite[i].mul_twist(&Twist::new(nalgebra::Vector3::zeros(), axis));
                add_column(model, data, i, 0, F);
            }
            JointMotion::Prismatic(axis) => {
                let F = data.composite[i].mul_twist(&Twist::new(axis, nalgebra::Vector3::zeros()));
                add_column(model, data, i, 0, F);
            }
            JointMotion::Elastic(_) => {
                for c in 0..6 {
                    let S = &data.elastic[i];
                    let V = if c < 3 {
                        Twist::new(S.L.column(c).into(), nalgebra::Vector3::zeros())
                    } else {
                        Twist::new(nalgebra::Vector3::zeros(), S.B.column(c - 3).into())
                    };
                    let F = data.composite[i].mul_twist(&V);
                    add_column(model, data, i, c, F);
                }
            }
        }
    }
}

/// Adds the terms of coordinate `c` of joint i with itself and with every joint inward of it.
#[inline(always)]
fn add_column(model: &Model, data: &mut Data, i: usize, c: usize, mut F: Wrench) {
    let body = &model.bodies[i];
    let (row, ratio) = (body.coordinate + c, body.ratio);
    let M = &mut data.M;
    // With itself: an elastic joint's own block is filled column by column.
    match body.motion {
        JointMotion::Revolute(axis) => M[(row, row)] += ratio * ratio * axis.dot(&F.torque),
        JointMotion::Prismatic(axis) => M[(row, row)] += ratio * ratio * axis.dot(&F.force),
        JointMotion::Elastic(_) => {
            let S = &data.elastic[i];
            let (f, t) = (S.L.tr_mul(&F.force), S.B.tr_mul(&F.torque));
            for r in 0..3 {
                M[(body.coordinate + r, row)] = f[r];
                M[(body.coordinate + 3 + r, row)] = t[r];
            }
        }
    }
    let mut j = i;
    loop {
        F = F.at_parent(&data.X_PB[j]);
        j = model.bodies[j].parent;
        if j == 0 {
            return;
        }
        let inward = &model.bodies[j];
        let k = inward.coordinate;
        match inward.motion {
            JointMotion::Revolute(axis) => {
                let value = ratio * inward.ratio * axis.dot(&F.torque);
                M[(row, k)] += value;
                M[(k, row)] += value;
            }
            JointMotion::Prismatic(axis) => {
                let value = ratio * inward.ratio * axis.dot(&F.force);
                M[(row, k)] += value;
                M[(k, row)] += value;
            }
            JointMotion::Elastic(_) => {
                let S = &data.elastic[j];
                let (f, t) = (S.L.tr_mul(&F.force) * ratio, S.B.tr_mul(&F.torque) * ratio);
                for r in 0..3 {
                    M[(row, k + r)] += f[r];
                    M[(k + r, row)] += f[r];
                    M[(row, k + 3 + r)] += t[r];
                    M[(k + 3 + r, row)] += t[r];
                }
            }
        }
    }
}
