//! The six rows of one joint: value g, Jacobian G on both bodies, explicit time rate.
//!
//! ```text
//! local:   g_t = R_Pᵀ d,  g_r = angles(R_Pᵀ R_Q),   d = x_Q - x_P
//!          G_t = R_Pᵀ [ -1, [r_1 + d]x, 1, -[r_2]x ],   G_r = B_P R_Pᵀ [ 0, -1, 0, 1 ]
//! global:  g_t = d,       g_r = R_P angles(R_Pᵀ R_Q)
//!          G_t = [ -1, [r_1]x, 1, -[r_2]x ],            G_r = [ 0, -1, 0, 1 ]
//! hard:    g_t = d,       g_r = R_P angles
//!          G_t = [ -1, [r_1 + d]x, 1, -[r_2]x ],        G_r = [ 0, -1, 0, 1 ]
//! ```
//! The hard rows are the local ones multiplied by `blkdiag(R_P, R_P B_P^-1)`, which has no effect
//! if the compliance is almost zero (angles are mapped to themselves). A prescribed joint moves P
//! by `S = [l; a]` per rate of its coordinate, in the hard rows by `[R_P l; R_Q B a]`.
//!
//! Columns: (v, w) of the parent's centre of mass, then of the child's, world axes. `r_i` points
//! from the centre of mass to the joint's frame; `B_P` maps relative angular velocity in P axes to
//! angle rates. `G` on the child has the inverse
//!
//! ```text
//! local:   [ R_P, [r_2]x R_P B_P^-1; 0, R_P B_P^-1 ],   B_P^-1 = R_PQ B
//! global:  [ 1, [r_2]x; 0, 1 ]
//! ```

use flexarm_kinematics::{AxisMotion, ElasticAngles, Pose, rotation_vector, skew};
use flexarm_spatial::products::{mul, mul3, tr_mul, tr_mul3};
use nalgebra::{Matrix3, Vector3, Vector6};

use super::settings::ConstraintForm;
use super::solve::{Jacobian, Triangle, joined};

/// Constraint rows of one joint.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    /// Constraint value.
    pub g: Vector6<f64>,
    /// Jacobians of both bodies.
    pub G: Jacobian,
    /// Motion of a prescribed joint in the rows: minus their explicit rate, per rate of its
    /// coordinate.
    pub S: Vector6<f64>,
}

impl Rows {
    pub(super) fn zeros() -> Self {
        let zero = Vector3::zeros();
        Self { g: Vector6::zeros(), G: Jacobian::Levers { parent: zero, child: zero }, S: Vector6::zeros() }
    }

    /// Creates the rows between frame P (pose in the world, on a body with centre of mass `x_1`)
    /// and frame Q (likewise with `x_2`).
    #[inline]
    pub(super) fn new(
        form: ConstraintForm,
        angles: ElasticAngles,
        X_WP: &Pose,
        x_1: &Vector3<f64>,
        X_WQ: &Pose,
        x_2: &Vector3<f64>,
    ) -> Self {
        let (R_P, p_P, p_Q) = (X_WP.rotation.matrix(), &X_WP.translation.vector, &X_WQ.translation.vector);
        let R_Q = X_WQ.rotation.matrix();
        let (r_1, r_2, d) = (p_P - x_1, p_Q - x_2, p_Q - p_P);
        let phi = angles.from_rotation(&tr_mul3(R_P, R_Q));
        match form {
            ConstraintForm::Local => {
                let Rt = R_P.transpose();
                // Angle rates from angular velocity in world axes, and the inverse map.
                let B = angles.pose(&phi).1;
                let turn = mul3(&B.try_inverse().unwrap_or_else(Matrix3::identity), &R_Q.transpose());
                let back = mul3(R_Q, &B);
                let parent = Triangle { tv: -Rt, tw: mul3(&Rt, &skew(&(r_1 + d))), rw: -turn };
                let child = Triangle { tv: Rt, tw: -mul3(&Rt, &skew(&r_2)), rw: turn };
                let back = Triangle { tv: *R_P, tw: mul3(&skew(&r_2), &back), rw: back };
                Self {
                    g: joined(&tr_mul(R_P, &d), &phi),
                    G: Jacobian::Turned { parent, child, back },
                    S: Vector6::zeros(),
                }
            }
            ConstraintForm::Global => {
                let G = Jacobian::Levers { parent: r_1, child: r_2 };
                Self { g: joined(&d, &mul(R_P, &phi)), G, S: Vector6::zeros() }
            }
        }
    }

    /// Creates the rows of a joint with almost no compliance: the local form without rotation into
    /// the axes and angles of P.
    #[inline]
    pub(super) fn hard(
        motion: Option<AxisMotion>,
        X_WP: &Pose,
        x_1: &Vector3<f64>,
        X_WQ: &Pose,
        x_2: &Vector3<f64>,
    ) -> Self {
        let (R_P, p_P, p_Q) = (X_WP.rotation.matrix(), &X_WP.translation.vector, &X_WQ.translation.vector);
        let R_Q = X_WQ.rotation.matrix();
        let phi = rotation_vector(&tr_mul3(R_P, R_Q));
        let S = motion.map_or(Vector6::zeros(), |motion| {
            let S = motion.twist(1.0);
            // R_Q B a with B = 1 - [φ]x/2 + [φ]x²/6.
            let turned = phi.cross(&S.angular);
            let B_a = S.angular - turned * 0.5 + phi.cross(&turned) / 6.0;
            joined(&mul(R_P, &S.linear), &mul(R_Q, &B_a))
        });
        let g = joined(&(p_Q - p_P), &mul(R_P, &phi));
        Self { g, S, G: Jacobian::Levers { parent: p_Q - x_1, child: p_Q - x_2 } }
    }
}
