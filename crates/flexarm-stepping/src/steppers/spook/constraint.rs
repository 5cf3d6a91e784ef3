//! The six rows of one joint: value g, Jacobian G on both bodies, explicit time rate.
//!
//! ```text
//! local:   g_t = R_Pᵀ d,  g_r = angles(R_Pᵀ R_Q),   d = x_Q - x_P
//!          G_t = R_Pᵀ [ -1, [r_1 + d]x, 1, -[r_2]x ],   G_r = B_P R_Pᵀ [ 0, -1, 0, 1 ]
//! global:  g_t = d,       g_r = R_P angles(R_Pᵀ R_Q)
//!          G_t = [ -1, [r_1]x, 1, -[r_2]x ],            G_r = [ 0, -1, 0, 1 ]
//! ```
//! Columns: (v, w) of the parent's centre of mass, then of the child's, world axes. `r_i` from the centre of mass to
//! the joint's frame; `B_P` maps relative angular velocity in P axes to angle rates.

use flexarm_kinematics::{ElasticAngles, Pose, skew};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::ConstraintForm;

/// One joint's rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    /// Constraint value.
    pub(super) g: Vector6<f64>,
    /// Jacobian on the parent's velocity.
    pub(super) G_parent: Matrix6<f64>,
    /// Jacobian on the child's velocity.
    pub(super) G_child: Matrix6<f64>,
    /// Axes of the rows in the world: `R_WP` in the local form, identity in the global one.
    pub(super) axes: Matrix3<f64>,
}

impl Rows {
    pub(super) fn zeros() -> Self {
        let zero = Matrix6::zeros();
        Self { g: Vector6::zeros(), G_parent: zero, G_child: zero, axes: Matrix3::identity() }
    }

    /// Rows between frame P (pose in the world, on a body with centre of mass `x_1`) and frame Q (likewise `x_2`).
    pub(super) fn new(
        form: ConstraintForm,
        angles: ElasticAngles,
        X_WP: &Pose,
        x_1: &Vector3<f64>,
        X_WQ: &Pose,
        x_2: &Vector3<f64>,
    ) -> Self {
        let (R_P, p_P, p_Q) = (X_WP.rotation.matrix(), &X_WP.translation.vector, &X_WQ.translation.vector);
        let (r_1, r_2, d) = (p_P - x_1, p_Q - x_2, p_Q - p_P);
        let R_PQ = R_P.transpose() * X_WQ.rotation.matrix();
        let phi = angles.from_rotation(&R_PQ);
        let mut rows = Self::zeros();
        match form {
            ConstraintForm::Local => {
                let Rt = R_P.transpose();
                // Angle rates from relative angular velocity in P axes: B^-1 R_PQᵀ.
                let B = angles.kinematics(&phi, &Vector3::zeros()).B;
                let B_P = B.try_inverse().unwrap_or_else(Matrix3::identity) * R_PQ.transpose();
                let turn = B_P * Rt;
                set(&mut rows.g, &(Rt * d), &phi);
                set_blocks(&mut rows.G_parent, &-Rt, &(Rt * skew(&(r_1 + d))), &-turn);
                set_blocks(&mut rows.G_child, &Rt, &-(Rt * skew(&r_2)), &turn);
                rows.axes = *R_P;
            }
            ConstraintForm::Global => {
                let one = Matrix3::identity();
                set(&mut rows.g, &d, &(R_P * phi));
                set_blocks(&mut rows.G_parent, &-one, &skew(&r_1), &-one);
                set_blocks(&mut rows.G_child, &one, &-skew(&r_2), &one);
            }
        }
        rows
    }
}

fn set(g: &mut Vector6<f64>, t: &Vector3<f64>, r: &Vector3<f64>) {
    g.fixed_rows_mut::<3>(0).copy_from(t);
    g.fixed_rows_mut::<3>(3).copy_from(r);
}

/// `[[tv, tw], [0, rw]]`.
fn set_blocks(G: &mut Matrix6<f64>, tv: &Matrix3<f64>, tw: &Matrix3<f64>, rw: &Matrix3<f64>) {
    G.fixed_view_mut::<3, 3>(0, 0).copy_from(tv);
    G.fixed_view_mut::<3, 3>(0, 3).copy_from(tw);
    G.fixed_view_mut::<3, 3>(3, 3).copy_from(rw);
}
