//! Body and joint in the recursion of [`super::FreeForces`]; symbols and equations are those of the
//! parent module.

use flexarm_spatial::products::{add, cross, dot, dyad, lift, lift3, mul, mul3, scaled, sub, tr_mul};
use flexarm_spatial::{ElasticAngles, Real, SpatialInertia, Wrench};
use nalgebra::{Matrix3, Vector3};

use super::{Motions, Part};
use crate::axis_motion::{AxisMotion, RevoluteTable};
use crate::model::{Body, JointMotion};

/// Index of a body among the nodes; `None` for the world.
type Number = Option<usize>;

/// Body with its joint.
#[derive(Clone, Debug)]
pub(super) struct Node<T: Real> {
    pub(super) parent: Number,
    pub(super) part: Part,
    pub(super) joint: NodeJoint,
    /// First coordinate, and its row among the free coordinates.
    pub(super) coordinate: usize,
    pub(super) row: Option<usize>,
    pub(super) ratio: f64,
    pub(super) offset: f64,
    pub(super) p_PJ: Vector3<f64>,
    pub(super) mass: T,
    pub(super) h: Vector3<T>,
    pub(super) I: Matrix3<T>,
    /// `R_PB` and p.
    pub(super) R: Matrix3<T>,
    pub(super) p: Vector3<T>,
    /// Rate map of an elastic joint.
    pub(super) B: Matrix3<T>,
    /// `R_PJ` of an elastic joint.
    pub(super) R_PJ: Matrix3<T>,
    /// Motion of the body, if `keeps_motion`: a body other than the next one is its child.
    pub(super) moving: Moving<T>,
    pub(super) keeps_motion: bool,
    pub(super) force: Vector3<T>,
    pub(super) torque: Vector3<T>,
}

/// Motion of a body, (1) to (3).
#[derive(Clone, Copy, Debug)]
pub(super) struct Moving<T: Real> {
    pub(super) omega: Vector3<T>,
    pub(super) alpha: Vector3<T>,
    pub(super) a: Vector3<T>,
    pub(super) W: Matrix3<T>,
}

/// Joint type in the recursion.
#[derive(Clone, Debug)]
pub(super) enum NodeJoint {
    /// Rotation about an axis, with its index among the rotating joints and the translation per rad
    /// (P axes) of a helical joint.
    Turns { axis: Vector3<f64>, table: Box<RevoluteTable>, turning: usize, along: Option<Vector3<f64>> },
    /// Translation along this vector (P axes).
    Slides { along: Vector3<f64> },
    /// Translation, then angles; whether the joint frame has the same axes as the parent.
    Elastic { angles: ElasticAngles, is_parallel: bool },
}

/// Joint rates used by the outward pass.
pub(super) struct JointRates<T: Real> {
    /// w and ẇ, B axes.
    pub(super) turn: Option<[Vector3<T>; 2]>,
    /// ṗ and p̈, P axes.
    pub(super) shift: Option<[Vector3<T>; 2]>,
}

impl<T: Real> Node<T> {
    #[inline(always)]
    pub(super) fn new(body: &Body, part: Part, row: Option<usize>, inertia: &SpatialInertia<T>) -> Option<Self> {
        let R_PJ = body.X_PJ.rotation.matrix();
        let joint = match body.motion {
            JointMotion::Axis(AxisMotion::Prismatic(axis)) => NodeJoint::Slides { along: mul(R_PJ, &axis) },
            JointMotion::Axis(motion) => {
                let along = match motion {
                    AxisMotion::Helical { axis, pitch } => Some(mul(R_PJ, &(axis * pitch))),
                    _ => None,
                };
                let table = Box::new(body.turn);
                NodeJoint::Turns { axis: motion.axis(), table, turning: body.turning, along }
            }
            JointMotion::Elastic(angles) => NodeJoint::Elastic { angles, is_parallel: body.is_parallel },
            JointMotion::Welded | JointMotion::Interface { .. } => return None,
        };
        let zero = Vector3::zeros();
        let mut node = Self {
            parent: body.parent.checked_sub(1),
            part,
            joint,
            coordinate: body.coordinate,
            row,
            ratio: body.ratio,
            offset: body.offset,
            p_PJ: body.X_PJ.translation.vector,
            mass: T::splat(0.0),
            h: zero,
            I: Matrix3::zeros(),
            R: Matrix3::identity(),
            p: lift(&body.X_PJ.translation.vector),
            B: Matrix3::identity(),
            R_PJ: lift3(R_PJ),
            moving: Moving { omega: zero, alpha: zero, a: zero, W: Matrix3::zeros() },
            keeps_motion: false,
            force: zero,
            torque: zero,
        };
        node.weigh(inertia);
        Some(node)
    }

    #[inline(always)]
    pub(super) fn weigh(&mut self, inertia: &SpatialInertia<T>) {
        self.mass = inertia.mass;
        self.h = inertia.first_moment;
        self.I = inertia.rotational;
    }

    /// Value of a single-DoF joint.
    #[inline(always)]
    pub(super) fn value(&self, q: &[T]) -> T {
        T::splat(self.ratio) * q[self.coordinate] + T::splat(self.offset)
    }

    /// Computes the pose in the parent, and returns the joint rates.
    #[inline(always)]
    pub(super) fn place(&mut self, motions: Motions<'_, T>, sines: &[T], cosines: &[T]) -> JointRates<T> {
        let Motions { q, qdot, qddot } = motions;
        let k = self.coordinate;
        let ratio = T::splat(self.ratio);
        match &self.joint {
            NodeJoint::Turns { axis, table, turning, along } => {
                self.R = table.at(sines[*turning], cosines[*turning]);
                let (rate, acceleration) = (ratio * qdot[k], ratio * qddot[k]);
                let axis = lift(axis);
                let mut shift = None;
                if let Some(along) = along {
                    let along = lift(along);
                    self.p = add(&lift(&self.p_PJ), &scaled(&along, self.value(q)));
                    shift = Some([scaled(&along, rate), scaled(&along, acceleration)]);
                }
                JointRates { turn: Some([scaled(&axis, rate), scaled(&axis, acceleration)]), shift }
            }
            NodeJoint::Slides { along } => {
                let along = lift(along);
                self.R = self.R_PJ;
                self.p = add(&lift(&self.p_PJ), &scaled(&along, self.value(q)));
                let (rate, acceleration) = (ratio * qdot[k], ratio * qddot[k]);
                JointRates { turn: None, shift: Some([scaled(&along, rate), scaled(&along, acceleration)]) }
            }
            NodeJoint::Elastic { angles, is_parallel } => {
                let [d, phi] = pair::<T>(&q[k..k + 6]);
                let [rate, rates] = pair::<T>(&qdot[k..k + 6]);
                let [acceleration, accelerations] = pair::<T>(&qddot[k..k + 6]);
                let kin = angles.kinematics(&phi, &rates);
                self.B = kin.B;
                let turn = [mul(&kin.B, &rates), add(&mul(&kin.B, &accelerations), &kin.bias)];
                let p_PJ = lift(&self.p_PJ);
                if *is_parallel {
                    self.R = kin.R;
                    self.p = add(&p_PJ, &d);
                    return JointRates { turn: Some(turn), shift: Some([rate, acceleration]) };
                }
                self.R = mul3(&self.R_PJ, &kin.R);
                self.p = add(&p_PJ, &mul(&self.R_PJ, &d));
                let shift = [mul(&self.R_PJ, &rate), mul(&self.R_PJ, &acceleration)];
                JointRates { turn: Some(turn), shift: Some(shift) }
            }
        }
    }

    /// (1) to (3).
    #[inline(always)]
    pub(super) fn follow(&self, parent: &Moving<T>, rates: &JointRates<T>) -> Moving<T> {
        let R = &self.R;
        let (mut omega, mut alpha) = (tr_mul(R, &parent.omega), tr_mul(R, &parent.alpha));
        if let Some([w, wdot]) = &rates.turn {
            alpha = add(&add(&alpha, wdot), &cross(&omega, w)); // (2)
            omega = add(&omega, w); // (1)
        }
        let mut a = add(&parent.a, &mul(&parent.W, &self.p));
        if let Some([rate, acceleration]) = &rates.shift {
            let coriolis = cross(&parent.omega, rate);
            a = add(&a, &add(&add(&coriolis, &coriolis), acceleration));
        }
        // [ω]x² = ω ωᵀ - ω·ω 1
        let W = dyad(&omega, &omega, &alpha, -dot(&omega, &omega));
        Moving { omega, alpha, a: tr_mul(R, &a), W } // (3)
    }

    /// Inertia force and torque, (4) and (5).
    #[inline(always)]
    pub(super) fn load(&mut self, moving: &Moving<T>, external: Option<&Wrench<T>>) {
        let Moving { omega, alpha, a, W } = moving;
        let h = &self.h;
        let gyroscopic = cross(omega, &mul(&self.I, omega));
        self.force = add(&scaled(a, self.mass), &mul(W, h));
        self.torque = add(&add(&mul(&self.I, alpha), &gyroscopic), &cross(h, a));
        if let Some(external) = external {
            self.force = sub(&self.force, &external.force);
            self.torque = sub(&self.torque, &external.torque);
        }
    }

    /// Number of coordinates of the joint.
    #[inline(always)]
    pub(super) fn size(&self) -> usize {
        if matches!(self.joint, NodeJoint::Elastic { .. }) { 6 } else { 1 }
    }

    /// `Sᵀ F`, one value per joint coordinate; force in P axes, torque in B axes.
    #[inline(always)]
    pub(super) fn project(&self, force: &Vector3<T>, torque: &Vector3<T>) -> [T; 6] {
        let ratio = T::splat(self.ratio);
        let mut tau = [T::splat(0.0); 6];
        match &self.joint {
            NodeJoint::Turns { axis, along, .. } => {
                let mut own = dot(&lift(axis), torque);
                if let Some(along) = along {
                    own += dot(&lift(along), force);
                }
                tau[0] = ratio * own;
            }
            NodeJoint::Slides { along } => tau[0] = ratio * dot(&lift(along), force),
            NodeJoint::Elastic { is_parallel, .. } => {
                let force = if *is_parallel { *force } else { tr_mul(&self.R_PJ, force) };
                let (f, t) = (force, tr_mul(&self.B, torque));
                tau = [f.x, f.y, f.z, t.x, t.y, t.z];
            }
        }
        tau
    }
}

/// Splits six values into two vectors.
#[inline(always)]
fn pair<T: Real>(x: &[T]) -> [Vector3<T>; 2] {
    [Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5])]
}
