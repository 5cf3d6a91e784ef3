//! A body and its joint, as the recursion of [`super::PointTree`] sees them; letters and equations are those of the module above.

use flexarm_spatial::products::{columns, mul};
use flexarm_spatial::space::{Fixed, Space, TurnTable};
use flexarm_spatial::{ElasticAngles, Real, SpatialInertia, Wrench};
use nalgebra::Vector3;

use super::{Motions, Part};
use crate::axis_motion::AxisMotion;
use crate::model::{Body, JointMotion};

/// Place of a body among the nodes; the world has none.
type Number = Option<usize>;

/// A body and its joint.
#[derive(Clone, Debug)]
pub(super) struct Node<S: Space> {
    pub(super) parent: Number,
    pub(super) part: Part,
    pub(super) joint: NodeJoint,
    /// First coordinate, and its row among the free ones.
    pub(super) coordinate: usize,
    pub(super) row: Option<usize>,
    pub(super) ratio: f64,
    pub(super) offset: f64,
    pub(super) p_PJ: Fixed,
    pub(super) mass: S::Real,
    pub(super) h: S::Vector,
    pub(super) I: S::Matrix,
    /// `R_PB` and p.
    pub(super) R: S::Both,
    pub(super) p: S::Vector,
    /// Rate map of an elastic joint.
    pub(super) B: S::Both,
    /// `R_PJ` of an elastic joint.
    pub(super) R_PJ: S::Both,
    /// Its motion, where that is kept: where a body other than the next one hangs on it, or it is looked at.
    pub(super) moving: Moving<S>,
    pub(super) keeps_motion: bool,
    pub(super) force: S::Vector,
    pub(super) torque: S::Vector,
}

/// (1) to (3) of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moving<S: Space> {
    pub(super) omega: S::Vector,
    pub(super) alpha: S::Vector,
    pub(super) a: S::Vector,
    pub(super) W: S::Matrix,
}

/// What the recursion does with a joint.
#[derive(Clone, Debug)]
pub(super) enum NodeJoint {
    /// Turns about an axis, the number among those that turn, and moves so far along it per rad (P axes).
    Turns { axis: Fixed, table: Box<TurnTable>, turning: usize, along: Option<Fixed> },
    /// Slides along this (P axes).
    Slides { along: Fixed },
    /// Translation, then angles; whether the joint frame has the axes of the parent.
    Elastic { angles: ElasticAngles, is_parallel: bool },
}

/// What of the joint the outward pass needs.
pub(super) struct JointRates<S: Space> {
    /// w and ẇ, B axes.
    pub(super) turn: Option<[S::Vector; 2]>,
    /// ṗ and p̈, P axes.
    pub(super) shift: Option<[S::Vector; 2]>,
}

impl<S: Space> Node<S> {
    #[inline(always)]
    pub(super) fn new(body: &Body, part: Part, row: Option<usize>, inertia: &SpatialInertia<S::Real>) -> Option<Self> {
        let R_PJ = body.X_PJ.rotation.matrix();
        let joint = match body.motion {
            JointMotion::Axis(AxisMotion::Prismatic(axis)) => {
                NodeJoint::Slides { along: Fixed::from(&mul(R_PJ, &axis)) }
            }
            JointMotion::Axis(motion) => {
                let along = match motion {
                    AxisMotion::Helical { axis, pitch } => Some(Fixed::from(&mul(R_PJ, &(axis * pitch)))),
                    _ => None,
                };
                let table = Box::new(body.turn.table());
                NodeJoint::Turns { axis: Fixed::from(&motion.axis()), table, turning: body.turning, along }
            }
            JointMotion::Elastic(angles) => NodeJoint::Elastic { angles, is_parallel: body.is_parallel },
            JointMotion::Welded | JointMotion::Interface { .. } => return None,
        };
        let fixed = |v: &Vector3<f64>| S::fixed(&Fixed::from(v));
        let zero = fixed(&Vector3::zeros());
        let none = S::dyad_both(&zero, &zero, &zero, S::Real::splat(1.0));
        let matrix = S::dyad(&zero, &zero, &zero, S::Real::splat(0.0));
        let [a, b, c] = [0, 1, 2].map(|j| Fixed::from(&R_PJ.column(j).into_owned()));
        let mut node = Self {
            parent: body.parent.checked_sub(1),
            part,
            joint,
            coordinate: body.coordinate,
            row,
            ratio: body.ratio,
            offset: body.offset,
            p_PJ: Fixed::from(&body.X_PJ.translation.vector),
            mass: S::Real::splat(0.0),
            h: zero,
            I: matrix,
            R: none,
            p: fixed(&body.X_PJ.translation.vector),
            B: none,
            R_PJ: S::both(&columns(
                S::components(&S::fixed(&a)),
                S::components(&S::fixed(&b)),
                S::components(&S::fixed(&c)),
            )),
            moving: Moving { omega: zero, alpha: zero, a: zero, W: matrix },
            keeps_motion: false,
            force: zero,
            torque: zero,
        };
        node.weigh(inertia);
        Some(node)
    }

    #[inline(always)]
    pub(super) fn weigh(&mut self, inertia: &SpatialInertia<S::Real>) {
        self.mass = inertia.mass;
        self.h = S::vector(&inertia.first_moment);
        self.I = S::matrix(&inertia.rotational);
    }

    /// Value of a joint of one coordinate.
    #[inline(always)]
    pub(super) fn value(&self, q: &[S::Real]) -> S::Real {
        S::Real::splat(self.ratio) * q[self.coordinate] + S::Real::splat(self.offset)
    }

    /// Pose in the parent, and the rates of the joint.
    #[inline(always)]
    pub(super) fn place(
        &mut self,
        motions: Motions<'_, S::Real>,
        sines: &[S::Real],
        cosines: &[S::Real],
    ) -> JointRates<S> {
        let Motions { q, qdot, qddot } = motions;
        let k = self.coordinate;
        let ratio = S::Real::splat(self.ratio);
        match &self.joint {
            NodeJoint::Turns { axis, table, turning, along } => {
                self.R = S::turned_by(table, sines[*turning], cosines[*turning]);
                let (rate, acceleration) = (ratio * qdot[k], ratio * qddot[k]);
                let axis = S::fixed(axis);
                let mut shift = None;
                if let Some(along) = along {
                    let along = S::fixed(along);
                    self.p = S::add(&S::fixed(&self.p_PJ), &S::scaled(&along, self.value(q)));
                    shift = Some([S::scaled(&along, rate), S::scaled(&along, acceleration)]);
                }
                JointRates { turn: Some([S::scaled(&axis, rate), S::scaled(&axis, acceleration)]), shift }
            }
            NodeJoint::Slides { along } => {
                let along = S::fixed(along);
                self.R = self.R_PJ;
                self.p = S::add(&S::fixed(&self.p_PJ), &S::scaled(&along, self.value(q)));
                let (rate, acceleration) = (ratio * qdot[k], ratio * qddot[k]);
                JointRates { turn: None, shift: Some([S::scaled(&along, rate), S::scaled(&along, acceleration)]) }
            }
            NodeJoint::Elastic { angles, is_parallel } => {
                let [d, phi] = pair::<S>(&q[k..k + 6]);
                let [rate, rates] = pair::<S>(&qdot[k..k + 6]);
                let [acceleration, accelerations] = pair::<S>(&qddot[k..k + 6]);
                let kin = angles.motion::<S>(&phi, &rates);
                self.B = kin.B;
                let turn = [S::turn(&kin.B, &rates), S::add(&S::turn(&kin.B, &accelerations), &kin.bias)];
                let p_PJ = S::fixed(&self.p_PJ);
                if *is_parallel {
                    self.R = kin.R;
                    self.p = S::add(&p_PJ, &d);
                    return JointRates { turn: Some(turn), shift: Some([rate, acceleration]) };
                }
                self.R = S::turned(&self.R_PJ, &kin.R);
                self.p = S::add(&p_PJ, &S::turn(&self.R_PJ, &d));
                let shift = [S::turn(&self.R_PJ, &rate), S::turn(&self.R_PJ, &acceleration)];
                JointRates { turn: Some(turn), shift: Some(shift) }
            }
        }
    }

    /// (1) alone.
    #[inline(always)]
    pub(super) fn turns_with(&self, parent: &S::Vector, rates: &JointRates<S>) -> S::Vector {
        let omega = S::turn_back(&self.R, parent);
        rates.turn.as_ref().map_or(omega, |[w, _]| S::add(&omega, w))
    }

    /// ṗ, P axes, of a joint that shifts its body.
    #[inline(always)]
    pub(super) fn shift_rate(&self, qdot: &[S::Real]) -> Option<S::Vector> {
        let k = self.coordinate;
        match &self.joint {
            NodeJoint::Turns { along: None, .. } => None,
            NodeJoint::Turns { along: Some(along), .. } | NodeJoint::Slides { along } => {
                Some(S::scaled(&S::fixed(along), S::Real::splat(self.ratio) * qdot[k]))
            }
            NodeJoint::Elastic { is_parallel, .. } => {
                let rate = S::vector(&Vector3::new(qdot[k], qdot[k + 1], qdot[k + 2]));
                Some(if *is_parallel { rate } else { S::turn(&self.R_PJ, &rate) })
            }
        }
    }

    /// (1) to (3).
    #[inline(always)]
    pub(super) fn follow(&self, parent: &Moving<S>, rates: &JointRates<S>) -> Moving<S> {
        let R = &self.R;
        let (mut omega, mut alpha) = (S::turn_back(R, &parent.omega), S::turn_back(R, &parent.alpha));
        if let Some([w, wdot]) = &rates.turn {
            alpha = S::add(&S::add(&alpha, wdot), &S::cross(&omega, w)); // (2)
            omega = S::add(&omega, w); // (1)
        }
        let mut a = S::add(&parent.a, &S::mul(&parent.W, &self.p));
        if let Some([rate, acceleration]) = &rates.shift {
            let coriolis = S::cross(&parent.omega, rate);
            a = S::add(&a, &S::add(&S::add(&coriolis, &coriolis), acceleration));
        }
        // [ω]x² = ω ωᵀ - ω·ω 1
        let W = S::dyad(&omega, &omega, &alpha, -S::dot(&omega, &omega));
        Moving { omega, alpha, a: S::turn_back(R, &a), W } // (3)
    }

    /// (4) and (5).
    #[inline(always)]
    pub(super) fn load(&mut self, moving: &Moving<S>, external: Option<&Wrench<S::Real>>) {
        let Moving { omega, alpha, a, W } = moving;
        let h = &self.h;
        let gyroscopic = S::cross(omega, &S::mul(&self.I, omega));
        self.force = S::add(&S::scaled(a, self.mass), &S::mul(W, h));
        self.torque = S::add(&S::add(&S::mul(&self.I, alpha), &gyroscopic), &S::cross(h, a));
        if let Some(external) = external {
            self.force = S::sub(&self.force, &S::vector(&external.force));
            self.torque = S::sub(&self.torque, &S::vector(&external.torque));
        }
    }

    /// Number of its coordinates.
    #[inline(always)]
    pub(super) fn size(&self) -> usize {
        if matches!(self.joint, NodeJoint::Elastic { .. }) { 6 } else { 1 }
    }

    /// `Sᵀ F`, as many numbers as the joint has coordinates; the force in P axes, the torque in B axes.
    #[inline(always)]
    pub(super) fn project(&self, force: &S::Vector, torque: &S::Vector) -> [S::Real; 6] {
        let ratio = S::Real::splat(self.ratio);
        let mut tau = [S::Real::splat(0.0); 6];
        match &self.joint {
            NodeJoint::Turns { axis, along, .. } => {
                let mut own = S::dot(&S::fixed(axis), torque);
                if let Some(along) = along {
                    own += S::dot(&S::fixed(along), force);
                }
                tau[0] = ratio * own;
            }
            NodeJoint::Slides { along } => tau[0] = ratio * S::dot(&S::fixed(along), force),
            NodeJoint::Elastic { is_parallel, .. } => {
                let force = if *is_parallel { *force } else { S::turn_back(&self.R_PJ, force) };
                let (f, t) = (S::components(&force), S::components(&S::turn_back(&self.B, torque)));
                tau = [f.x, f.y, f.z, t.x, t.y, t.z];
            }
        }
        tau
    }
}

/// Two vectors of six numbers.
#[inline(always)]
fn pair<S: Space>(x: &[S::Real]) -> [S::Vector; 2] {
    [S::vector(&Vector3::new(x[0], x[1], x[2])), S::vector(&Vector3::new(x[3], x[4], x[5]))]
}
