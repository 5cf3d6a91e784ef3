//! Poses, velocities, forces and energies of a tree at one instant, in a single outward pass after
//! the recursion of the parent module.
//!
//! ```text
//!   v_B  = R_BP (v_P + ω_P × p + ṗ)                              (7)   v: velocity of Bo, B axes
//!   T    = Σ m v·v / 2 + v·(ω × h) + ω·I ω / 2                   (8)
//!   R_WB = R_WP R_PB,   p_WB = p_WP + R_WP p,   Σ R_WB h + m p_WB (9)
//! ```

use flexarm_spatial::{Pose, Wrench};
use nalgebra::{Matrix3, Vector3};

use super::{FreeForces, Motions};
use crate::aba::Roles;
use crate::data::rotor_energy;
use crate::model::Model;
use crate::pose::pose;

/// World pose and velocity of a body, from (7) and (9).
#[derive(Clone, Copy, Debug)]
struct Placed {
    /// `R_WB`.
    R: Matrix3<f64>,
    /// `p_WB`, world axes (m).
    p: Vector3<f64>,
    /// Angular velocity, B axes (rad/s).
    omega: Vector3<f64>,
    /// Velocity of Bo, B axes (m/s).
    v: Vector3<f64>,
}

/// Motion of a body, B axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyMotion {
    /// Velocity of Bo (m/s).
    pub v: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub omega: Vector3<f64>,
    /// Acceleration of the point Bo minus gravity (m/s²).
    pub a: Vector3<f64>,
    /// Angular acceleration (rad/s²).
    pub alpha: Vector3<f64>,
}

impl BodyMotion {
    /// Velocity of the point at r from Bo (m/s).
    pub fn velocity(&self, r: &Vector3<f64>) -> Vector3<f64> {
        self.v + self.omega.cross(r)
    }

    /// Acceleration of the point at r from Bo, minus gravity (m/s²).
    pub fn acceleration(&self, r: &Vector3<f64>) -> Vector3<f64> {
        self.a + self.alpha.cross(r) + self.omega.cross(&self.omega.cross(r))
    }
}

/// Inverse dynamics, poses and energies of a tree in one call.
#[derive(Clone, Debug)]
pub struct Observer {
    /// Recursion with all coordinates free.
    tree: FreeForces,
    /// All bodies except the world.
    placed: Vec<Placed>,
}

impl Observer {
    /// Creates the observer; `None` for trees with closed loops, balancers or modal bodies.
    pub fn new(model: &Model) -> Option<Self> {
        let mut tree = FreeForces::new(model, &Roles::all_free(model))?;
        tree.nodes.iter_mut().for_each(|node| node.keeps_motion = true);
        let zero = Vector3::zeros();
        let placed = Placed { R: Matrix3::identity(), p: zero, omega: zero, v: zero };
        Some(Self { placed: vec![placed; model.bodies.len() - 1], tree })
    }

    /// Computes the world poses of all bodies into `X_WB` and the generalised forces of all
    /// coordinates (N m or N) into `tau`. Returns kinetic energy, including rotors, and
    /// gravitational potential energy, zero at the world origin (J). The results equal those of
    /// [`crate::inverse_dynamics`], [`crate::world_poses`], [`crate::kinetic_energy_of`] and
    /// [`crate::potential_energy_of`] to rounding. O(n), no allocation.
    ///
    /// * `loads`: external wrench on each body at Bo, B axes, if any; they are subtracted.
    pub fn observe(
        &mut self,
        model: &Model,
        motions: Motions<'_, f64>,
        loads: Option<&[Wrench]>,
        X_WB: &mut [Pose],
        tau: &mut [f64],
    ) -> [f64; 2] {
        X_WB[0] = Pose::identity();
        self.tree.compute(motions, loads, tau);
        let (mut kinetic, mut moment) = (0.0, Vector3::zeros());
        for i in 0..self.placed.len() {
            let Placed { R, p, omega, v } = self.follow(i, self.tree.nodes[i].moving.omega, motions.qdot, X_WB);
            let node = &self.tree.nodes[i];
            kinetic += 0.5 * (node.mass * v.dot(&v) + omega.dot(&(node.I * omega))) + v.dot(&omega.cross(&node.h)); // (8)
            moment += R * node.h + p * node.mass; // (9)
        }
        [kinetic + rotor_energy(model, motions.qdot), -model.gravity.dot(&moment)]
    }

    /// Computes poses as [`Observer::observe`] does, and velocities, but no forces or
    /// accelerations.
    pub fn place(&mut self, motions: Motions<'_, f64>, X_WB: &mut [Pose]) {
        X_WB[0] = Pose::identity();
        self.tree.turn_joints(motions.q);
        for i in 0..self.placed.len() {
            let FreeForces { nodes, sines, cosines, .. } = &mut self.tree;
            let rates = nodes[i].place(motions, sines, cosines);
            let parent = nodes[i].parent.map_or(Vector3::zeros(), |parent| self.placed[parent].omega);
            let omega = nodes[i].turns_with(&parent, &rates);
            self.follow(i, omega, motions.qdot, X_WB);
        }
    }

    /// Motion of a body in the last observation; [`Observer::place`] updates the velocities only.
    ///
    /// # Panics
    /// If `body` is the world or not a body of the tree.
    pub fn motion(&self, body: usize) -> BodyMotion {
        let (Placed { v, omega, .. }, moving) = (self.placed[body - 1], &self.tree.nodes[body - 1].moving);
        BodyMotion { v, omega, a: moving.a, alpha: moving.alpha }
    }

    /// Replaces the inertias by those of a model that is otherwise identical.
    pub fn weigh(&mut self, model: &Model) {
        self.tree.weigh(model);
    }

    /// (7) and the poses of (9), for a body with angular velocity `omega`, B axes.
    fn follow(&mut self, i: usize, omega: Vector3<f64>, qdot: &[f64], X_WB: &mut [Pose]) -> Placed {
        let node = &self.tree.nodes[i];
        let mut v = node.shift_rate(qdot).unwrap_or_default();
        let (mut R, mut p) = (node.R, node.p);
        if let Some(parent) = node.parent.map(|parent| &self.placed[parent]) {
            v += parent.v + parent.omega.cross(&p);
            p = parent.p + parent.R * p;
            R = parent.R * R;
        }
        v = node.R.tr_mul(&v);
        X_WB[i + 1] = pose(R, p);
        self.placed[i] = Placed { R, p, omega, v };
        self.placed[i]
    }
}
