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
//! processor. Trees with closed loops, balancers or bodies that bend in modes are not for it.
//!
//! Source: [Luh, Walker & Paul 1980].

use flexarm_spatial::products::{columns, mul};
use flexarm_spatial::space::{Fixed, Plain, Space, TurnTable};
use flexarm_spatial::{ElasticAngles, Pose, Real, SpatialInertia, Wrench};
use nalgebra::Vector3;

use crate::aba::Roles;
use crate::axis_motion::AxisMotion;
use crate::data::pose;
use crate::lanes::Tree;
use crate::model::{Body, JointMotion, Model};

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
}

/// Place of a body among the nodes; the world has none.
type Number = Option<usize>;

/// A body and its joint.
#[derive(Clone, Debug)]
struct Node<S: Space> {
    parent: Number,
    part: Part,
    joint: NodeJoint,
    /// First coordinate, and its row among the free ones.
    coordinate: usize,
    row: Option<usize>,
    ratio: f64,
    offset: f64,
    p_PJ: Fixed,
    mass: S::Real,
    h: S::Vector,
    I: S::Matrix,
    /// `R_PB` and p.
    R: S::Both,
    p: S::Vector,
    /// Rate map of an elastic joint.
    B: S::Both,
    /// `R_PJ` of an elastic joint.
    R_PJ: S::Both,
    moving: Moving<S>,
    force: S::Vector,
    torque: S::Vector,
    /// Inertia of the body with all that it carries outward.
    composite: Composite<S>,
}

/// Mass, first moment about Bo and inertia about Bo, B axes.
#[derive(Clone, Copy, Debug)]
struct Composite<S: Space> {
    mass: S::Real,
    h: S::Vector,
    I: S::Matrix,
}

impl<S: Space> Composite<S> {
    /// Force and torque at Bo that give it these accelerations while it does not move.
    #[inline(always)]
    fn wrench(&self, [a, alpha]: &[S::Vector; 2]) -> [S::Vector; 2] {
        let force = S::add(&S::scaled(a, self.mass), &S::cross(alpha, &self.h));
        [force, S::add(&S::mul(&self.I, alpha), &S::cross(&self.h, a))]
    }

    /// Takes in that of a body which sits at p, turned by R.
    #[inline(always)]
    fn take(&mut self, other: &Self, R: &S::Both, p: &S::Vector) {
        let real = S::Real::splat;
        let zero = S::fixed(&Fixed::default());
        let h = S::turn(R, &other.h);
        // R I Rᵀ + (2 p·h + m p·p) 1 - (p hᵀ + h pᵀ + m p pᵀ), with k = h + m p/2
        let k = S::add(&h, &S::scaled(p, other.mass * real(0.5)));
        let [back, k_back] = [S::scaled(p, real(-1.0)), S::scaled(&k, real(-1.0))];
        let moved =
            S::sum(&S::dyad(&back, &k, &zero, real(2.0) * S::dot(p, &k)), &S::dyad(&k_back, p, &zero, real(0.0)));
        self.I = S::sum(&self.I, &S::sum(&S::congruent(R, &other.I), &moved));
        self.h = S::add(&self.h, &S::add(&h, &S::scaled(p, other.mass)));
        self.mass += other.mass;
    }
}

/// (1) to (3) of a body.
#[derive(Clone, Copy, Debug)]
struct Moving<S: Space> {
    omega: S::Vector,
    alpha: S::Vector,
    a: S::Vector,
    W: S::Matrix,
}

/// What the recursion does with a joint.
#[derive(Clone, Debug)]
enum NodeJoint {
    /// Turns about an axis, the number among those that turn, and moves so far along it per rad (P axes).
    Turns { axis: Fixed, table: Box<TurnTable>, turning: usize, along: Option<Fixed> },
    /// Slides along this (P axes).
    Slides { along: Fixed },
    /// Translation, then angles; whether the joint frame has the axes of the parent.
    Elastic { angles: ElasticAngles, is_parallel: bool },
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

/// What of the joint the outward pass needs.
struct JointRates<S: Space> {
    /// w and ẇ, B axes.
    turn: Option<[S::Vector; 2]>,
    /// ṗ and p̈, P axes.
    shift: Option<[S::Vector; 2]>,
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
        }
        let single = model.rotors.iter().map(|&(k, inertia)| (k, k, inertia));
        let coupled = model.rotor_couplings.iter().flat_map(|&(a, b, inertia)| [(a, b, inertia), (b, a, inertia)]);
        let rotors = single.chain(coupled).filter_map(|(to, of, inertia)| Some((row(to)?, of, inertia))).collect();
        // Whole registers of them.
        let zeros = vec![S::Real::splat(0.0); model.turning.len().next_multiple_of(4)];
        let up = S::fixed(&Fixed::from(&-model.gravity));
        Some(Self { nodes, up, angles: zeros.clone(), sines: zeros.clone(), cosines: zeros, rotors })
    }

    /// Inertias of the tree, which is otherwise that of before.
    #[inline(always)]
    pub(crate) fn weigh(&mut self, tree: &impl Tree<S::Real>) {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            node.weigh(&tree.inertia(i + 1));
        }
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
        for node in &self.nodes {
            if let NodeJoint::Turns { turning, .. } = node.joint {
                self.angles[turning] = node.value(motions.q);
            }
        }
        S::sin_cos_all(&self.angles, &mut self.sines, &mut self.cosines);
        let still = S::scaled(&self.up, S::Real::splat(0.0));
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
            if node.part == Part::Loading {
                node.load(loads.map(|loads| &loads[i + 1]));
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

impl<S: Space> PointTree<S> {
    /// Mass matrix of the free coordinates (kg, kg m, kg m²) at the poses of the last forces, column after column into M.
    ///
    /// # Source
    /// [Featherstone 2008], section 6.2, over the free joints alone.
    #[inline(always)]
    pub(crate) fn mass(&mut self, M: &mut [S::Real]) {
        let n = M.len().isqrt();
        M.fill(S::Real::splat(0.0));
        for node in &mut self.nodes {
            node.composite = Composite { mass: node.mass, h: node.h, I: node.I };
        }
        for i in (0..self.nodes.len()).rev() {
            let (inward, outward) = self.nodes.split_at_mut(i);
            let node = &outward[0];
            if node.part != Part::Loading {
                continue;
            }
            if let Some(row) = node.row {
                for c in 0..node.size() {
                    node.column(inward, row, c, M, n);
                }
            }
            if let Some(parent) = node.parent.map(|parent| &mut inward[parent])
                && parent.part == Part::Loading
            {
                parent.composite.take(&node.composite, &node.R, &node.p);
            }
        }
        for &(row, coordinate, inertia) in &self.rotors {
            let column = self.nodes.iter().find(|node| node.coordinate == coordinate).and_then(|node| node.row);
            if let Some(column) = column {
                M[column * n + row] += S::Real::splat(inertia);
            }
        }
    }
}

impl<T: Real> PointTree<Plain<T>> {
    /// Poses of the bodies on joints of one coordinate in their parents, as the last forces found them.
    #[inline(always)]
    pub(crate) fn poses_of_axes(&self, X_PB: &mut [Pose<T>]) {
        for (node, X) in self.nodes.iter().zip(&mut X_PB[1..]) {
            if !matches!(node.joint, NodeJoint::Elastic { .. }) {
                *X = pose(node.R, node.p);
            }
        }
    }
}

impl<S: Space> Node<S> {
    #[inline(always)]
    fn new(body: &Body, part: Part, row: Option<usize>, inertia: &SpatialInertia<S::Real>) -> Option<Self> {
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
            force: zero,
            torque: zero,
            composite: Composite { mass: S::Real::splat(0.0), h: zero, I: matrix },
        };
        node.weigh(inertia);
        Some(node)
    }

    #[inline(always)]
    fn weigh(&mut self, inertia: &SpatialInertia<S::Real>) {
        self.mass = inertia.mass;
        self.h = S::vector(&inertia.first_moment);
        self.I = S::matrix(&inertia.rotational);
    }

    /// Value of a joint of one coordinate.
    #[inline(always)]
    fn value(&self, q: &[S::Real]) -> S::Real {
        S::Real::splat(self.ratio) * q[self.coordinate] + S::Real::splat(self.offset)
    }

    /// Pose in the parent, and the rates of the joint.
    #[inline(always)]
    fn place(&mut self, motions: Motions<'_, S::Real>, sines: &[S::Real], cosines: &[S::Real]) -> JointRates<S> {
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

    /// (1) to (3).
    #[inline(always)]
    fn follow(&mut self, parent: &Moving<S>, rates: &JointRates<S>) -> Moving<S> {
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
        self.moving = Moving { omega, alpha, a: S::turn_back(R, &a), W }; // (3)
        self.moving
    }

    /// (4) and (5).
    #[inline(always)]
    fn load(&mut self, external: Option<&Wrench<S::Real>>) {
        let Moving { omega, alpha, a, W } = &self.moving;
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
    fn size(&self) -> usize {
        if matches!(self.joint, NodeJoint::Elastic { .. }) { 6 } else { 1 }
    }

    /// `Sᵀ F`, as many numbers as the joint has coordinates; the force in P axes, the torque in B axes.
    #[inline(always)]
    fn project(&self, force: &S::Vector, torque: &S::Vector) -> [S::Real; 6] {
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

    /// Entries of M between one of its coordinates and those of its own joint and of all joints inward.
    #[inline(always)]
    fn column(&self, inward: &[Self], row: usize, c: usize, M: &mut [S::Real], n: usize) {
        let [mut force, mut torque] = self.composite.wrench(&self.accelerated(c));
        let mut force_P = S::turn(&self.R, &force);
        for (k, entry) in self.project(&force_P, &torque).into_iter().take(self.size()).enumerate() {
            M[(row + c) * n + row + k] += entry;
        }
        let mut at = self;
        while let Some(parent) = at.parent.map(|parent| &inward[parent])
            && parent.part == Part::Loading
        {
            torque = S::add(&S::turn(&at.R, &torque), &S::cross(&at.p, &force_P));
            force = force_P;
            force_P = S::turn(&parent.R, &force);
            if let Some(inner) = parent.row {
                for (k, entry) in parent.project(&force_P, &torque).into_iter().take(parent.size()).enumerate() {
                    M[(row + c) * n + inner + k] += entry;
                    M[(inner + k) * n + row + c] += entry;
                }
            }
            at = parent;
        }
    }

    /// Acceleration of Bo and angular acceleration, B axes, of a coordinate that is accelerated by 1 while nothing moves.
    #[inline(always)]
    fn accelerated(&self, coordinate: usize) -> [S::Vector; 2] {
        let ratio = S::Real::splat(self.ratio);
        let zero = S::fixed(&Fixed::default());
        match &self.joint {
            NodeJoint::Turns { axis, along, .. } => {
                let a = match along {
                    Some(along) => S::scaled(&S::turn_back(&self.R, &S::fixed(along)), ratio),
                    None => zero,
                };
                [a, S::scaled(&S::fixed(axis), ratio)]
            }
            NodeJoint::Slides { along } => [S::scaled(&S::turn_back(&self.R, &S::fixed(along)), ratio), zero],
            NodeJoint::Elastic { is_parallel, .. } => match coordinate {
                0..3 if *is_parallel => [S::row(&self.R, coordinate), zero],
                0..3 => [S::turn_back(&self.R, &S::column(&self.R_PJ, coordinate)), zero],
                _ => [zero, S::column(&self.B, coordinate - 3)],
            },
        }
    }
}

/// Two vectors of six numbers.
#[inline(always)]
fn pair<S: Space>(x: &[S::Real]) -> [S::Vector; 2] {
    [S::vector(&Vector3::new(x[0], x[1], x[2])), S::vector(&Vector3::new(x[3], x[4], x[5]))]
}

/// The recursion over one state: packed where the processor packs vectors, to the same bits.
pub struct FreeForces(Way);

enum Way {
    /// Over numbers.
    Plain(Box<PointTree<Plain<f64>>>),
    /// In registers.
    #[cfg(target_arch = "x86_64")]
    Packed(packed::Room),
}

impl FreeForces {
    /// For the free coordinates of the roles; `None` of trees with closed loops, balancers or bodies that bend in modes.
    pub fn new(model: &Model, roles: &Roles) -> Option<Self> {
        let plain = Box::new(PointTree::of(model, roles)?);
        #[cfg(target_arch = "x86_64")]
        if let Some(room) = packed::Room::new(packed::Make(model, roles)) {
            return Some(Self(Way::Packed(room)));
        }
        Some(Self(Way::Plain(plain)))
    }

    /// Over numbers, whatever the processor has.
    pub fn plain(model: &Model, roles: &Roles) -> Option<Self> {
        Some(Self(Way::Plain(Box::new(PointTree::of(model, roles)?))))
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
        match &mut self.0 {
            Way::Plain(tree) => tree.forces(motions, loads, tau),
            #[cfg(target_arch = "x86_64")]
            Way::Packed(room) => room.run(packed::Forces { motions, loads, tau }),
        }
    }

    /// Mass matrix of the free coordinates (kg, kg m, kg m²) at the poses of the last forces, column after column into M: that of
    /// [`crate::mass_matrix`], to rounding. No allocation.
    pub fn mass(&mut self, M: &mut [f64]) {
        match &mut self.0 {
            Way::Plain(tree) => tree.mass(M),
            #[cfg(target_arch = "x86_64")]
            Way::Packed(room) => room.run(packed::Mass(M)),
        }
    }

    /// The model has other inertias than before, and is else the same.
    pub fn weigh(&mut self, model: &Model) {
        match &mut self.0 {
            Way::Plain(tree) => tree.weigh(model),
            #[cfg(target_arch = "x86_64")]
            Way::Packed(room) => room.run(packed::Weigh(model)),
        }
    }
}

/// The recursion in registers.
#[cfg(target_arch = "x86_64")]
mod packed {
    use flexarm_spatial::Wrench;
    use flexarm_spatial::packed::{Keeps, Kept, OverPacked, PackedRoom};
    use flexarm_spatial::space::Space;

    use super::{Motions, PointTree};
    use crate::aba::Roles;
    use crate::model::Model;

    pub(super) type Room = PackedRoom<Tree>;

    /// What is kept.
    pub(super) struct Tree;

    impl Kept for Tree {
        type Of<S: Space<Real = f64>> = PointTree<S>;
    }

    /// Makes it, of a model that is known to be for it.
    pub(super) struct Make<'a>(pub(super) &'a Model, pub(super) &'a Roles);

    impl Keeps<Tree> for Make<'_> {
        #[inline(always)]
        fn make<S: Space<Real = f64>>(self) -> Option<PointTree<S>> {
            PointTree::of(self.0, self.1)
        }
    }

    /// See [`super::FreeForces::compute`].
    pub(super) struct Forces<'a> {
        pub(super) motions: Motions<'a, f64>,
        pub(super) loads: Option<&'a [Wrench]>,
        pub(super) tau: &'a mut [f64],
    }

    impl OverPacked<Tree> for Forces<'_> {
        #[inline(always)]
        fn run<S: Space<Real = f64>>(self, tree: &mut PointTree<S>) {
            tree.forces(self.motions, self.loads, self.tau);
        }
    }

    /// See [`super::FreeForces::mass`].
    pub(super) struct Mass<'a>(pub(super) &'a mut [f64]);

    impl OverPacked<Tree> for Mass<'_> {
        #[inline(always)]
        fn run<S: Space<Real = f64>>(self, tree: &mut PointTree<S>) {
            tree.mass(self.0);
        }
    }

    /// See [`super::FreeForces::weigh`].
    pub(super) struct Weigh<'a>(pub(super) &'a Model);

    impl OverPacked<Tree> for Weigh<'_> {
        #[inline(always)]
        fn run<S: Space<Real = f64>>(self, tree: &mut PointTree<S>) {
            tree.weigh(self.0);
        }
    }
}
