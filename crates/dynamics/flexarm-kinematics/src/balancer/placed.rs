//! Balancer placed on the tree: the points or coordinates on which it acts, and its forces.
//!
//! (1) to (3) of the module. W world, B a body; From and To are the ends 0 and 1 of a line.

use flexarm_spatial::{Pose, Twist, Wrench};
use nalgebra::{Matrix3, Vector3};

use crate::balancer::law::BalancerLaw;

/// Balancer placed on the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedBalancer {
    /// Name of the balancer.
    pub name: String,
    /// Force law.
    pub law: BalancerLaw,
    /// Points or joint on which it acts.
    pub place: BalancerPlace,
}

/// Points or joint of the tree on which a balancer acts.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerPlace {
    /// Between two points: body, and position from Bo in body axes (m).
    Points([(usize, Vector3<f64>); 2]),
    /// About a joint.
    Joint {
        /// Coordinates and their factors c.
        terms: Vec<(usize, f64)>,
        /// `x_0` (rad or m).
        offset: f64,
        /// Body that carries the joint.
        parent: usize,
        /// First body outward of the joint; the axis is constant in its axes.
        body: usize,
        /// Last body outward of the drive springs.
        child: usize,
        /// Joint twist per unit of x, in axes of `body`.
        axis: Twist,
    },
}

/// Force and stiffness of a line balancer at given poses, (1) and (2).
#[derive(Clone, Copy, Debug)]
pub struct BalancerLine {
    /// The two bodies.
    pub bodies: [usize; 2],
    /// Positions of the two ends in their bodies (m).
    pub p_B: [Vector3<f64>; 2],
    /// Positions of the two ends in the world (m).
    pub p_W: [Vector3<f64>; 2],
    /// Distance (m).
    pub length: f64,
    /// Force on the first end, world axes (N); the second end has the opposite force.
    pub F_W: Vector3<f64>,
    /// Stiffness (2), world axes (N/m).
    pub K_W: Matrix3<f64>,
}

impl BalancerLine {
    fn new(law: &BalancerLaw, ends: &[(usize, Vector3<f64>); 2], X_WB: &[Pose]) -> Self {
        let p_W = ends.map(|(body, p_B)| X_WB[body].rotation * p_B + X_WB[body].translation.vector);
        let d = p_W[1] - p_W[0];
        let length = d.norm();
        let (T, k) = (law.tension(length), law.rate(length));
        let bodies = ends.map(|(body, _)| body);
        let p_B = ends.map(|(_, p_B)| p_B);
        // At zero length with zero tension the direction is undefined, but the force is zero and
        // the stiffness isotropic.
        if length == 0.0 && T == 0.0 {
            return Self { bodies, p_B, p_W, length, F_W: Vector3::zeros(), K_W: Matrix3::from_diagonal_element(k) };
        }
        let (u, across) = (d / length, T / length);
        let K_W = Matrix3::from_diagonal_element(across) + u * u.transpose() * (k - across);
        Self { bodies, p_B, p_W, length, F_W: u * T, K_W }
    }
}

impl PlacedBalancer {
    /// Line at these body poses; `None` for a balancer about a joint.
    ///
    /// # Panics
    /// If `X_WB` is shorter than the number of bodies.
    pub fn line(&self, X_WB: &[Pose]) -> Option<BalancerLine> {
        match &self.place {
            BalancerPlace::Points(ends) => Some(BalancerLine::new(&self.law, ends, X_WB)),
            BalancerPlace::Joint { .. } => None,
        }
    }

    /// Length of the line (m) or value of the joint (rad or m) at these poses and coordinates.
    ///
    /// # Panics
    /// If `X_WB` is shorter than the number of bodies, or `q` than nv.
    pub fn length(&self, X_WB: &[Pose], q: &[f64]) -> f64 {
        match &self.place {
            BalancerPlace::Points(ends) => BalancerLine::new(&self.law, ends, X_WB).length,
            BalancerPlace::Joint { terms, offset, .. } => terms.iter().fold(*offset, |x, (k, c)| x + c * q[*k]),
        }
    }

    /// Wrenches on the two bodies about their origins, in world axes, at length or joint value `x`.
    /// About a joint with a six-DoF spring, they are exact to first order in its deflection.
    ///
    /// # Panics
    /// If `X_WB` is shorter than the number of bodies.
    pub fn wrenches(&self, X_WB: &[Pose], x: f64) -> [(usize, Wrench); 2] {
        let at_origin = |body: usize, p_W: &Vector3<f64>, F: Vector3<f64>| {
            let arm = p_W - X_WB[body].translation.vector;
            (body, Wrench::new(F, arm.cross(&F)))
        };
        match &self.place {
            BalancerPlace::Points(ends) => {
                let line = BalancerLine::new(&self.law, ends, X_WB);
                [at_origin(line.bodies[0], &line.p_W[0], line.F_W), at_origin(line.bodies[1], &line.p_W[1], -line.F_W)]
            }
            BalancerPlace::Joint { parent, body, child, axis, .. } => {
                let R = X_WB[*body].rotation;
                let T = self.law.tension(x);
                // A revolute joint takes a couple; a sliding one a force at the origin of the
                // child.
                if axis.angular.norm_squared() > 0.0 {
                    let moment = R * axis.angular * T;
                    let couple = |moment: Vector3<f64>| Wrench::new(Vector3::zeros(), moment);
                    return [(*parent, couple(moment)), (*child, couple(-moment))];
                }
                let (force, p_W) = (R * axis.linear * T, X_WB[*child].translation.vector);
                [at_origin(*parent, &p_W, force), at_origin(*child, &p_W, -force)]
            }
        }
    }
}
