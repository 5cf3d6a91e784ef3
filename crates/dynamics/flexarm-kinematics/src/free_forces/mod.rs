//! Inverse dynamics of free coordinates alone, where the motion of the others is given: Newton-Euler over the accelerations of
//! points, O(n).
//!
//! ```text
//! Outward pass for body B with parent P, in B axes; a is the acceleration of Bo less gravity, p the place of Bo in P, P axes:
//!   ω_B = R_BP ω_P + w                                        (1)
//!   α_B = R_BP α_P + ẇ + (R_BP ω_P) × w                       (2)   w: angular velocity of the joint, B axes
//!   a_B = R_BP (a_P + W_P p + 2 ω_P × ṗ + p̈)                  (3)   W = [α]x + [ω]x²
//!   f_B = m a_B + W_B h - f_ext                               (4)   h: first moment about Bo
//!   n_B = I α_B + ω_B × I ω_B + h × a_B - n_ext               (5)
//! Inward pass:
//!   τ_B = S_Bᵀ [f_B; n_B],   f_P += R_PB f_B,   n_P += R_PB n_B + p × R_PB f_B      (6)
//! ```
//! No velocity of a point occurs, so there are a third fewer operations than in [`crate::inverse_dynamics`] over spatial vectors. Bodies whose
//! wrench moves no free coordinate (all before the first spring of an arm) take part in (1) to (3) alone, those that carry no
//! other one not even in that.
//!
//! Start at [`PointTree`], the recursion over any [`Space`], or at [`FreeForces`], which is it over one state in the quickest space of the
//! processor; [`Observer`] is it for all coordinates, with poses and energies. Trees with closed loops, balancers or bodies that bend in modes are not for it.
//!
//! Source: [Luh, Walker & Paul 1980].

mod composite;
mod node;
mod observed;

use flexarm_spatial::quickest::{Kept, Make, Quickest, Work};
use flexarm_spatial::space::{Fixed, Plain, Space};
use flexarm_spatial::{Real, Wrench};
use nalgebra::{Matrix3, Vector3};

use crate::aba::Roles;
use crate::lanes::Tree;
use crate::model::Model;
use composite::Composites;
use node::{Moving, Node, NodeJoint};
pub use observed::{BodyMotion, Observer};

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

/// A tree with the workspaces of the recursion.
#[derive(Clone, Debug)]
pub struct PointTree<S: Space> {
    /// All but the world, parents before children.
    nodes: Vec<Node<S>>,
    /// Minus gravity.
    up: S::Vector,
    /// Angles of the joints that turn (rad), their sines and cosines.
    angles: Vec<S::Real>,
    sines: Vec<S::Real>,
    cosines: Vec<S::Real>,
    /// Free row, coordinate and inertia of what rotors add.
    rotors: Vec<(usize, usize, f64)>,
    /// The workspace of the mass matrix, once it is asked for.
    composites: Option<Box<Composites<S>>>,
}

/// What (1) to (6) need of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Its pose.
    Placed,
    /// Its motion: something outward of it has a wrench that counts.
    Moving,
    /// Its wrench: it moves a free coordinate.
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

impl<S: Space> PointTree<S> {
    /// Of a tree whose free coordinates are those of the roles; `None` of trees with closed loops, balancers or bodies that bend in modes.
    #[inline(always)]
    pub(crate) fn of(tree: &impl Tree<S::Real>, roles: &Roles) -> Option<Self> {
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
        // Whole registers of them.
        let together = if S::Real::LANES > 1 { 1 } else { 4 };
        let zeros = vec![S::Real::splat(0.0); model.turning.len().next_multiple_of(together)];
        let up = S::fixed(&Fixed::from(&-model.gravity));
        Some(Self { nodes, up, angles: zeros.clone(), sines: zeros.clone(), cosines: zeros, rotors, composites: None })
    }

    /// Inertias of the tree, which is otherwise that of before.
    #[inline(always)]
    pub(crate) fn weigh(&mut self, tree: &impl Tree<S::Real>) {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            node.weigh(&tree.inertia(i + 1));
        }
    }

    /// Sines and cosines of the joints that turn.
    #[inline(always)]
    fn turn_joints(&mut self, q: &[S::Real]) {
        for node in &self.nodes {
            if let NodeJoint::Turns { turning, .. } = node.joint {
                self.angles[turning] = node.value(q);
            }
        }
        S::sin_cos_all(&self.angles, &mut self.sines, &mut self.cosines);
    }

    /// Poses of the bodies in their parents.
    #[inline(always)]
    fn place(&mut self, q: &[S::Real]) {
        self.turn_joints(q);
        // Nothing is computed of rates that nobody looks at.
        let motions = Motions { q, qdot: q, qddot: q };
        for node in &mut self.nodes {
            node.place(motions, &self.sines, &self.cosines);
        }
    }

    /// Angular velocity of the world.
    #[inline(always)]
    fn still(&self) -> S::Vector {
        S::scaled(&self.up, S::Real::splat(0.0))
    }

    /// Generalised forces `τ = M(q) q̈ + bias(q, q̇)` (N m or N) of the free coordinates, in their order, into `tau`.
    ///
    /// * `loads`: external wrench on each body at Bo, B axes, if there are any; they are subtracted.
    #[inline(always)]
    pub(crate) fn forces(
        &mut self,
        motions: Motions<'_, S::Real>,
        loads: Option<&[Wrench<S::Real>]>,
        tau: &mut [S::Real],
    ) {
        self.turn_joints(motions.q);
        let still = self.still();
        let world =
            Moving { omega: still, alpha: still, a: self.up, W: S::dyad(&still, &still, &still, S::Real::splat(0.0)) };
        let mut last = world;
        for i in 0..self.nodes.len() {
            let (inward, outward) = self.nodes.split_at_mut(i);
            let node = &mut outward[0];
            let rates = node.place(motions, &self.sines, &self.cosines);
            if node.part == Part::Placed {
                continue;
            }
            // Mostly the parent is the body just done, whose motion is still in registers.
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
            tau[row] += S::Real::splat(inertia) * motions.qddot[coordinate];
        }
    }

    /// (6).
    #[inline(always)]
    fn carry_inward(&mut self, tau: &mut [S::Real]) {
        tau.fill(S::Real::splat(0.0));
        // What the body just done puts on the one before it, if that is its parent.
        let none = [S::fixed(&Fixed::default()); 2];
        let mut carried = none;
        for i in (0..self.nodes.len()).rev() {
            let (inward, outward) = self.nodes.split_at_mut(i);
            let node = &outward[0];
            if node.part != Part::Loading {
                continue;
            }
            let [force, torque] = [S::add(&node.force, &carried[0]), S::add(&node.torque, &carried[1])];
            carried = none;
            let force = S::turn(&node.R, &force);
            if let Some(row) = node.row {
                let own = node.project(&force, &torque);
                for (tau, own) in tau[row..].iter_mut().zip(own).take(node.size()) {
                    *tau += own;
                }
            }
            let Some(number) = node.parent.filter(|parent| inward[*parent].part == Part::Loading) else { continue };
            let torque = S::add(&S::turn(&node.R, &torque), &S::cross(&node.p, &force));
            if number + 1 == i {
                carried = [force, torque];
            } else {
                let parent = &mut inward[number];
                parent.force = S::add(&parent.force, &force);
                parent.torque = S::add(&parent.torque, &torque);
            }
        }
    }
}

impl<T: Real> PointTree<Plain<T>> {
    /// Rotation of a body in its parent and place of its origin, as the last forces found them.
    #[inline(always)]
    pub(crate) fn pose(&self, body: usize) -> (&Matrix3<T>, &Vector3<T>) {
        let node = &self.nodes[body - 1];
        (&node.R, &node.p)
    }
}

/// The recursion over one state: packed where the processor packs vectors, to the same bits.
pub struct FreeForces(Quickest<FreeTree>);

impl FreeForces {
    /// For the free coordinates of the roles; `None` of trees with closed loops, balancers or bodies that bend in modes.
    pub fn new(model: &Model, roles: &Roles) -> Option<Self> {
        Some(Self(Quickest::new(Of(model, roles))?))
    }

    /// Over numbers, whatever the processor has.
    pub fn plain(model: &Model, roles: &Roles) -> Option<Self> {
        Some(Self(Quickest::plain(Of(model, roles))?))
    }

    /// Generalised forces `τ = M(q) q̈ + bias(q, q̇)` (N m or N) of the free coordinates, in their order, into `tau`: those of
    /// [`crate::inverse_dynamics`], to rounding. O(n), no allocation.
    ///
    /// * `loads`: external wrench on each body at Bo, B axes, if there are any; they are subtracted.
    ///
    /// # Source
    /// [Luh, Walker & Paul 1980].
    #[inline]
    pub fn compute(&mut self, motions: Motions<'_, f64>, loads: Option<&[Wrench]>, tau: &mut [f64]) {
        self.0.run(Forces { motions, loads, tau });
    }

    /// Mass matrix of the free coordinates (kg, kg m, kg m²) at the poses of the last forces, column after column into M, both triangles:
    /// that of [`crate::mass_matrix`], to rounding. Allocates when it is called first, and not again.
    ///
    /// # Source
    /// [Featherstone 2008], section 6.2.
    pub fn mass(&mut self, M: &mut [f64]) {
        self.0.run(Mass { q: None, M });
    }

    /// [`FreeForces::mass`] at the positions of all coordinates (rad or m).
    pub fn mass_at(&mut self, q: &[f64], M: &mut [f64]) {
        self.0.run(Mass { q: Some(q), M });
    }

    /// The model has other inertias than before, and is else the same.
    pub fn weigh(&mut self, model: &Model) {
        self.0.run(Weigh(model));
    }
}

/// What [`FreeForces`] keeps.
struct FreeTree;

impl Kept for FreeTree {
    type Of<S: Space<Real = f64>> = PointTree<S>;
}

#[derive(Clone, Copy)]
struct Of<'a>(&'a Model, &'a Roles);

impl Make<FreeTree> for Of<'_> {
    #[inline(always)]
    fn make<S: Space<Real = f64>>(self) -> Option<PointTree<S>> {
        PointTree::of(self.0, self.1)
    }
}

/// See [`FreeForces::compute`].
struct Forces<'a> {
    motions: Motions<'a, f64>,
    loads: Option<&'a [Wrench]>,
    tau: &'a mut [f64],
}

impl Work<FreeTree> for Forces<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut PointTree<S>) {
        tree.forces(self.motions, self.loads, self.tau);
    }
}

/// See [`FreeForces::mass`] and [`FreeForces::mass_at`].
struct Mass<'a> {
    q: Option<&'a [f64]>,
    M: &'a mut [f64],
}

impl Work<FreeTree> for Mass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut PointTree<S>) {
        if let Some(q) = self.q {
            tree.place(q);
        }
        tree.mass(self.M);
    }
}

/// See [`FreeForces::weigh`].
struct Weigh<'a>(&'a Model);

impl Work<FreeTree> for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut PointTree<S>) {
        tree.weigh(self.0);
    }
}
