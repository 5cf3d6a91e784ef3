//! Inverse dynamics for the free coordinates only, with the motion of all coordinates given:
//! Newton-Euler recursion over point accelerations, O(n).
//!
//! ```text
//! Outward pass for body B with parent P, in B axes;
//!   a is the acceleration of Bo minus gravity, p the position of Bo in P, P axes:
//!   ω_B = R_BP ω_P + w                                        (1)
//!   α_B = R_BP α_P + ẇ + (R_BP ω_P) × w                       (2)   w: angular velocity of the joint, B axes
//!   a_B = R_BP (a_P + W_P p + 2 ω_P × ṗ + p̈)                  (3)   W = [α]x + [ω]x²
//!   f_B = m a_B + W_B h - f_ext                               (4)   h: first moment about Bo
//!   n_B = I α_B + ω_B × I ω_B + h × a_B - n_ext               (5)
//! Inward pass:
//!   τ_B = S_Bᵀ [f_B; n_B],   f_P += R_PB f_B,   n_P += R_PB n_B + p × R_PB f_B      (6)
//! ```
//! Point velocities are not needed, so the recursion takes a third fewer operations than
//! [`crate::inverse_dynamics`] with spatial vectors. Bodies whose wrench moves no free coordinate
//! (all before the first spring of an arm) take part only in (1) to (3), and those without a
//! loading body outward of them not even in these.
//!
//! Start at [`FreeForces`]. Trees with closed loops, balancers or modal bodies are not supported.
//!
//! Source: [Luh, Walker & Paul 1980].

mod composite;
mod node;

use flexarm_spatial::products::{add, cross, lift, mul};
use flexarm_spatial::{Real, Wrench, sin_cos_all};
use nalgebra::{Matrix3, Vector3};

use crate::aba::Roles;
use crate::model::Model;
use crate::tree::Tree;
use composite::Composites;
use node::{Moving, Node, NodeJoint};

/// Motion of all coordinates: positions, velocities and accelerations.
#[derive(Clone, Copy, Debug)]
pub struct Motions<'a, T> {
    /// Positions (rad or m).
    pub q: &'a [T],
    /// Velocities.
    pub qdot: &'a [T],
    /// Accelerations.
    pub qddot: &'a [T],
}

/// Tree with the workspace of the recursion.
#[derive(Clone, Debug)]
pub struct FreeForces<T: Real = f64> {
    /// All bodies except the world, parents before children.
    nodes: Vec<Node<T>>,
    /// Negative gravitational acceleration.
    up: Vector3<T>,
    /// Angles of the rotating joints (rad), with sines and cosines.
    angles: Vec<T>,
    sines: Vec<T>,
    cosines: Vec<T>,
    /// Rotor terms: row among the free coordinates, coordinate and inertia.
    rotors: Vec<(usize, usize, f64)>,
    /// Workspace of the mass matrix, created on first use.
    composites: Option<Box<Composites<T>>>,
}

/// Part of (1) to (6) that is evaluated for a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Pose only.
    Placed,
    /// Pose and motion: a body outward of it is loading.
    Moving,
    /// Pose, motion and wrench: it moves a free coordinate.
    Loading,
}

/// Parts of all bodies.
fn parts(model: &Model, roles: &Roles) -> Vec<Part> {
    let mut parts = vec![Part::Placed; model.bodies.len()];
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        if !roles.prescribed_body[i] || parts[body.parent] == Part::Loading {
            parts[i] = Part::Loading;
        }
    }
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        if parts[i] != Part::Placed && parts[body.parent] == Part::Placed {
            parts[body.parent] = Part::Moving;
        }
    }
    parts
}

impl<T: Real> FreeForces<T> {
    /// Creates the recursion for the free coordinates of `roles`; `None` for trees with closed
    /// loops, balancers or modal bodies.
    #[inline(always)]
    pub fn new(tree: &impl Tree<T>, roles: &Roles) -> Option<Self> {
        let model = tree.model();
        if !(model.loops.is_empty() && model.balancers.is_empty() && model.modal.is_empty()) {
            return None;
        }
        let parts = parts(model, roles);
        let row = |coordinate: usize| roles.free_coordinates().binary_search(&coordinate).ok();
        let mut nodes = Vec::with_capacity(model.bodies.len() - 1);
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            let row = if roles.prescribed_body[i] { None } else { row(body.coordinate) };
            nodes.push(Node::new(body, parts[i], row, &tree.inertia(i))?);
            if let Some(parent) = body.parent.checked_sub(1) {
                nodes[parent].keeps_motion |= body.parent + 1 != i;
            }
        }
        let single = model.rotors.iter().map(|&(k, inertia)| (k, k, inertia));
        let coupled = model.rotor_couplings.iter().flat_map(|&(a, b, inertia)| [(a, b, inertia), (b, a, inertia)]);
        let rotors = single.chain(coupled).filter_map(|(to, of, inertia)| Some((row(to)?, of, inertia))).collect();
        // Padded to whole SIMD registers.
        let together = if T::LANES > 1 { 1 } else { 4 };
        let zeros = vec![T::splat(0.0); model.turning.len().next_multiple_of(together)];
        let up = lift(&-model.gravity);
        Some(Self { nodes, up, angles: zeros.clone(), sines: zeros.clone(), cosines: zeros, rotors, composites: None })
    }

    /// Replaces the inertias by those of a tree that is otherwise identical.
    #[inline(always)]
    pub fn weigh(&mut self, tree: &impl Tree<T>) {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            node.weigh(&tree.inertia(i + 1));
        }
    }

    /// Computes sines and cosines of the rotating joints.
    #[inline(always)]
    fn turn_joints(&mut self, q: &[T]) {
        for node in &self.nodes {
            if let NodeJoint::Turns { turning, .. } = node.joint {
                self.angles[turning] = node.value(q);
            }
        }
        sin_cos_all(&self.angles, &mut self.sines, &mut self.cosines);
    }

    /// Computes the poses of the bodies in their parents.
    #[inline(always)]
    fn place(&mut self, q: &[T]) {
        self.turn_joints(q);
        // The rates are not used, so the values passed do not matter.
        let motions = Motions { q, qdot: q, qddot: q };
        for node in &mut self.nodes {
            node.place(motions, &self.sines, &self.cosines);
        }
    }

    /// Computes generalised forces `τ = M(q) q̈ + bias(q, q̇)` (N m or N) of the free coordinates,
    /// in their order, into `tau`. Equals [`crate::inverse_dynamics`] to rounding. O(n), no
    /// allocation.
    ///
    /// * `loads`: external wrench on each body at Bo, B axes, if any; they are subtracted.
    ///
    /// # Source
    /// [Luh, Walker & Paul 1980].
    #[inline(always)]
    pub fn compute(&mut self, motions: Motions<'_, T>, loads: Option<&[Wrench<T>]>, tau: &mut [T]) {
        self.turn_joints(motions.q);
        let world = Moving { omega: Vector3::zeros(), alpha: Vector3::zeros(), a: self.up, W: Matrix3::zeros() };
        let mut last = world;
        for i in 0..self.nodes.len() {
            let (inward, outward) = self.nodes.split_at_mut(i);
            let node = &mut outward[0];
            let rates = node.place(motions, &self.sines, &self.cosines);
            if node.part == Part::Placed {
                continue;
            }
            // The parent is usually the previous body, whose motion is still in registers.
            last = match node.parent {
                None => node.follow(&world, &rates),
                Some(parent) if parent + 1 == i => node.follow(&last, &rates),
                Some(parent) => node.follow(&inward[parent].moving, &rates),
            };
            if node.keeps_motion {
                node.moving = last;
            }
            if node.part == Part::Loading {
                node.load(&last, loads.map(|loads| &loads[i + 1]));
            }
        }
        self.carry_inward(tau);
        for &(row, coordinate, inertia) in &self.rotors {
            tau[row] += T::splat(inertia) * motions.qddot[coordinate];
        }
    }

    /// Inward pass (6).
    #[inline(always)]
    fn carry_inward(&mut self, tau: &mut [T]) {
        tau.fill(T::splat(0.0));
        // Wrench of the current body on the previous one, if that is its parent.
        let none = [Vector3::zeros(); 2];
        let mut carried = none;
        for i in (0..self.nodes.len()).rev() {
            let (inward, outward) = self.nodes.split_at_mut(i);
            let node = &outward[0];
            if node.part != Part::Loading {
                continue;
            }
            let [force, torque] = [add(&node.force, &carried[0]), add(&node.torque, &carried[1])];
            carried = none;
            let force = mul(&node.R, &force);
            if let Some(row) = node.row {
                let own = node.project(&force, &torque);
                for (tau, own) in tau[row..].iter_mut().zip(own).take(node.size()) {
                    *tau += own;
                }
            }
            let Some(number) = node.parent.filter(|parent| inward[*parent].part == Part::Loading) else { continue };
            let torque = add(&mul(&node.R, &torque), &cross(&node.p, &force));
            if number + 1 == i {
                carried = [force, torque];
            } else {
                let parent = &mut inward[number];
                parent.force = add(&parent.force, &force);
                parent.torque = add(&parent.torque, &torque);
            }
        }
    }

    /// Rotation of a body in its parent and position of its origin, from the last call.
    #[inline(always)]
    pub(crate) fn pose(&self, body: usize) -> (&Matrix3<T>, &Vector3<T>) {
        let node = &self.nodes[body - 1];
        (&node.R, &node.p)
    }
}
