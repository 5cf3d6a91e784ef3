//! All that a run is shown of a tree at an instant, in one pass outward behind the recursion of the module above.
//!
//! ```text
//!   v_B  = R_BP (v_P + ω_P × p + ṗ)                              (7)   v: velocity of Bo, B axes
//!   T    = Σ m v·v / 2 + v·(ω × h) + ω·I ω / 2                   (8)
//!   R_WB = R_WP R_PB,   p_WB = p_WP + R_WP p,   Σ R_WB h + m p_WB (9)
//! ```

use flexarm_spatial::quickest::{Kept, Make, Quickest, Work};
use flexarm_spatial::space::{Fixed, Space};
use flexarm_spatial::{Pose, Wrench};
use nalgebra::Vector3;

use super::{Motions, PointTree};
use crate::aba::Roles;
use crate::data::{pose, rotor_energy};
use crate::model::Model;

/// A body as (7) and (9) find it.
#[derive(Clone, Copy, Debug)]
struct Placed<S: Space> {
    R: S::Both,
    p: S::Vector,
    omega: S::Vector,
    v: S::Vector,
}

/// A tree all of whose coordinates count, with what is found of its bodies.
#[derive(Clone, Debug)]
struct ObservedTree<S: Space> {
    tree: PointTree<S>,
    placed: Vec<Placed<S>>,
}

/// How a body moves, B axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyMotion {
    /// Velocity of Bo (m/s).
    pub v: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub omega: Vector3<f64>,
    /// Acceleration of the point Bo less gravity (m/s²).
    pub a: Vector3<f64>,
    /// Angular acceleration (rad/s²).
    pub alpha: Vector3<f64>,
}

impl BodyMotion {
    /// Velocity of a point r of the body (m/s).
    pub fn velocity(&self, r: &Vector3<f64>) -> Vector3<f64> {
        self.v + self.omega.cross(r)
    }

    /// Acceleration of a point r of the body less gravity (m/s²).
    pub fn acceleration(&self, r: &Vector3<f64>) -> Vector3<f64> {
        self.a + self.alpha.cross(r) + self.omega.cross(&self.omega.cross(r))
    }
}

/// Sums over the bodies: kinetic energy without rotors, first moment about the world origin.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    kinetic: f64,
    moment: Vector3<f64>,
}

impl<S: Space<Real = f64>> ObservedTree<S> {
    #[inline(always)]
    fn of(model: &Model) -> Option<Self> {
        let mut tree = PointTree::of(model, &Roles::all_free(model))?;
        tree.nodes.iter_mut().for_each(|node| node.keeps_motion = true);
        let zero = S::fixed(&Fixed::default());
        let placed = Placed { R: S::dyad_both(&zero, &zero, &zero, 1.0), p: zero, omega: zero, v: zero };
        Some(Self { placed: vec![placed; model.bodies.len() - 1], tree })
    }

    #[inline(always)]
    fn observe(
        &mut self,
        motions: Motions<'_, f64>,
        loads: Option<&[Wrench]>,
        X_WB: &mut [Pose],
        tau: &mut [f64],
    ) -> Sums {
        self.tree.forces(motions, loads, tau);
        let (mut kinetic, mut moment) = (0.0, S::fixed(&Fixed::default()));
        for i in 0..self.placed.len() {
            let Placed { R, p, omega, v } = self.follow(i, self.tree.nodes[i].moving.omega, motions.qdot, X_WB);
            let node = &self.tree.nodes[i];
            let own = node.mass * S::dot(&v, &v) + S::dot(&omega, &S::mul(&node.I, &omega));
            kinetic += 0.5 * own + S::dot(&v, &S::cross(&omega, &node.h));
            moment = S::add(&moment, &S::add(&S::turn(&R, &node.h), &S::scaled(&p, node.mass)));
        }
        Sums { kinetic, moment: S::components(&moment) }
    }

    /// Poses and velocities alone, the same bits.
    #[inline(always)]
    fn place(&mut self, motions: Motions<'_, f64>, X_WB: &mut [Pose]) {
        self.tree.turn_joints(motions.q);
        let still = self.tree.still();
        for i in 0..self.placed.len() {
            let PointTree { nodes, sines, cosines, .. } = &mut self.tree;
            let rates = nodes[i].place(motions, sines, cosines);
            let parent = nodes[i].parent.map_or(still, |parent| self.placed[parent].omega);
            let omega = nodes[i].turns_with(&parent, &rates);
            self.follow(i, omega, motions.qdot, X_WB);
        }
    }

    /// (7) and the poses of (9), for a body that turns so, B axes.
    #[inline(always)]
    fn follow(&mut self, i: usize, omega: S::Vector, qdot: &[f64], X_WB: &mut [Pose]) -> Placed<S> {
        let node = &self.tree.nodes[i];
        let mut v = node.shift_rate(qdot).unwrap_or(S::fixed(&Fixed::default()));
        let (mut R, mut p) = (node.R, node.p);
        if let Some(parent) = node.parent.map(|parent| &self.placed[parent]) {
            v = S::add(&S::add(&parent.v, &S::cross(&parent.omega, &p)), &v);
            p = S::add(&parent.p, &S::turn(&parent.R, &p));
            R = S::turned(&parent.R, &R);
        }
        v = S::turn_back(&node.R, &v);
        X_WB[i + 1] = pose(S::entries(&R), S::components(&p));
        self.placed[i] = Placed { R, p, omega, v };
        self.placed[i]
    }

    /// Of a body other than the world.
    #[inline(always)]
    fn motion(&self, body: usize) -> BodyMotion {
        let (placed, moving) = (&self.placed[body - 1], &self.tree.nodes[body - 1].moving);
        let [v, omega, a, alpha] = [&placed.v, &placed.omega, &moving.a, &moving.alpha].map(S::components);
        BodyMotion { v, omega, a, alpha }
    }
}

/// Inverse dynamics, poses and energies of a tree in one go, in the quickest vectors of the processor; the same bits in all.
pub struct Observer(Quickest<WholeTree>);

impl Observer {
    /// `None` of trees with closed loops, balancers or bodies that bend in modes.
    pub fn new(model: &Model) -> Option<Self> {
        Some(Self(Quickest::new(Of(model))?))
    }

    /// Over numbers, whatever the processor has.
    pub fn plain(model: &Model) -> Option<Self> {
        Some(Self(Quickest::plain(Of(model))?))
    }

    /// Poses of all bodies in the world into `X_WB`, generalised forces of all coordinates (N m or N) into `tau`; kinetic energy,
    /// rotors included, and potential energy of gravity, zero at the world origin (J). They are those of [`crate::inverse_dynamics`],
    /// [`crate::world_poses`], [`crate::kinetic_energy_of`] and [`crate::potential_energy_of`], to rounding. O(n), no allocation.
    ///
    /// * `loads`: external wrench on each body at Bo, B axes, if there are any; they are subtracted.
    pub fn observe(
        &mut self,
        model: &Model,
        motions: Motions<'_, f64>,
        loads: Option<&[Wrench]>,
        X_WB: &mut [Pose],
        tau: &mut [f64],
    ) -> [f64; 2] {
        X_WB[0] = Pose::identity();
        let Sums { kinetic, moment } = self.0.run(Observe { motions, loads, X_WB, tau });
        [kinetic + rotor_energy(model, motions.qdot), -model.gravity.dot(&moment)]
    }

    /// Poses as [`Observer::observe`] finds them, and velocities; neither forces nor accelerations.
    pub fn place(&mut self, motions: Motions<'_, f64>, X_WB: &mut [Pose]) {
        X_WB[0] = Pose::identity();
        self.0.run(Place(motions, X_WB));
    }

    /// How a body moved in the last observation; after [`Observer::place`] its velocities are new.
    ///
    /// # Panics
    /// If the body is not one of the tree, or is the world.
    pub fn motion(&mut self, body: usize) -> BodyMotion {
        self.0.run(MotionOf(body))
    }

    /// The model has other inertias than before, and is else the same.
    pub fn weigh(&mut self, model: &Model) {
        self.0.run(Weigh(model));
    }
}

/// What [`Observer`] keeps.
struct WholeTree;

impl Kept for WholeTree {
    type Of<S: Space<Real = f64>> = ObservedTree<S>;
}

#[derive(Clone, Copy)]
struct Of<'a>(&'a Model);

impl Make<WholeTree> for Of<'_> {
    #[inline(always)]
    fn make<S: Space<Real = f64>>(self) -> Option<ObservedTree<S>> {
        ObservedTree::of(self.0)
    }
}

/// See [`Observer::observe`].
struct Observe<'a> {
    motions: Motions<'a, f64>,
    loads: Option<&'a [Wrench]>,
    X_WB: &'a mut [Pose],
    tau: &'a mut [f64],
}

impl Work<WholeTree> for Observe<'_> {
    type Output = Sums;

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut ObservedTree<S>) -> Sums {
        tree.observe(self.motions, self.loads, self.X_WB, self.tau)
    }
}

/// See [`Observer::place`].
struct Place<'a>(Motions<'a, f64>, &'a mut [Pose]);

impl Work<WholeTree> for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut ObservedTree<S>) {
        tree.place(self.0, self.1);
    }
}

/// See [`Observer::motion`].
struct MotionOf(usize);

impl Work<WholeTree> for MotionOf {
    type Output = BodyMotion;

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut ObservedTree<S>) -> BodyMotion {
        tree.motion(self.0)
    }
}

/// See [`Observer::weigh`].
struct Weigh<'a>(&'a Model);

impl Work<WholeTree> for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Space<Real = f64>>(self, tree: &mut ObservedTree<S>) {
        tree.tree.weigh(self.0);
    }
}
