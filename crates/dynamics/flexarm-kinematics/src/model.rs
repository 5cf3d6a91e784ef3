//! Immutable kinematic tree used by the recursions: bodies in order, parents before children.
//!
//! Body 0 is the world (the base link and everything fixed to it); every other body has exactly one
//! joint to its parent. Links on fixed joints are lumped into the body that carries them and remain
//! available as named [`Frame`]s. Start at [`Model::new`]. Not here: state and results
//! ([`crate::Data`], [`crate::State`]).
//!
//! Coordinates: actuated joints first (in tree order), then the elastic coordinates in groups,
//! proximal to distal: six or one per elastic joint, n per modal body. The offsets are in
//! [`Model::elastic`] and [`Body::coordinate`].

use std::collections::HashMap;
use std::ops::Range;
use std::slice::ChunksExact;

use flexarm_settings::{OutOfRange, Quantity};
use flexarm_spatial::{ElasticAngles, Pose, SpatialInertia};
use nalgebra::{Rotation3, Vector3};

use crate::axis_motion::{AxisMotion, RevoluteTable};
use crate::balancer::{PlacedBalancer, place_balancers};
use crate::closure::{LoopDraft, PlacedLoop, assemble, draft_loops};
use crate::lanes::along_axis;
use crate::mechanism::{Joint, JointKind, Limits, Mechanism, RotorCoupling};
use crate::modal::ModalTables;

/// Validated tree of bodies; built once, then read-only and shared between threads.
#[derive(Clone, Debug)]
pub struct Model {
    /// Name of the mechanism.
    pub name: String,
    pub(crate) bodies: Vec<Body>,
    frames: Vec<Frame>,
    frame_by_name: HashMap<String, usize>,
    coordinates: Vec<Coordinate>,
    n_actuated: usize,
    elastic: Vec<ElasticGroup>,
    pub(crate) modal: Vec<Modal>,
    pub(crate) balancers: Vec<PlacedBalancer>,
    /// Coordinates with rotors, and the rotor inertia reflected to each.
    pub(crate) rotors: Vec<(usize, f64)>,
    /// Pairs of coordinates and the off-diagonal entry that rotors add to the mass matrix.
    pub(crate) rotor_couplings: Vec<(usize, usize, f64)>,
    pub(crate) has_mimic: bool,
    /// Whether entries of the mass matrix may be zero or sums: branches, modal bodies or mimic
    /// joints.
    pub(crate) sums_entries: bool,
    /// Closed loops, each after the loops it depends on.
    pub(crate) loops: Vec<PlacedLoop>,
    /// Coordinates determined by the loops; in the tree they follow all independent ones.
    dependent: Vec<Coordinate>,
    /// Bodies moved by single-coordinate joints that rotate.
    pub(crate) turning: Vec<usize>,
    /// Coordinates of single-DoF joints, in body order; `six` holds the first coordinate of each
    /// six-DoF joint.
    pub(crate) single: Vec<usize>,
    pub(crate) six: Vec<usize>,
    /// Gravitational acceleration in world axes (m/s²).
    pub gravity: Vector3<f64>,
}

/// Moving body B (or the world, index 0) with the joint to its parent P.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name of the link whose frame is the body frame.
    pub name: String,
    /// Name of the joint that moves the body.
    pub joint: String,
    /// Index of the parent body; 0 is the world. Meaningless for body 0.
    pub parent: usize,
    /// Pose of the joint frame in the parent body at zero coordinate.
    pub X_PJ: Pose,
    /// Inertia about Bo in B axes, including everything fixed to the body.
    pub inertia: SpatialInertia,
    /// Motion allowed by the joint.
    pub motion: JointMotion,
    /// Index of the (first) independent coordinate; indices from [`Model::nv`] on are dependent
    /// coordinates of closed loops.
    pub coordinate: usize,
    /// Joint value = ratio × coordinate + offset; (1, 0) except for mimic joints.
    pub ratio: f64,
    /// Offset of the joint value, see `ratio`.
    pub offset: f64,
    /// Rotor inertia reflected to the coordinate (kg m² or kg).
    pub armature: f64,
    /// Whether the joint coordinates are elastic.
    pub elastic: bool,
    /// Index of its modal body, if it is one.
    pub(crate) modal: Option<usize>,
    pub(crate) turn: RevoluteTable,
    /// Index of its joint among the rotating ones.
    pub(crate) turning: usize,
    /// One past the last body of the subtree; depth-first order makes a subtree a contiguous range.
    pub(crate) subtree_end: usize,
    /// Whether the joint frame has the same axes as the parent frame.
    pub(crate) is_parallel: bool,
    pub(crate) columns: Outward,
}

/// Joints of a subtree, including the body's own joint, as ranges of the model's lists `single` and
/// `six`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outward {
    pub(crate) single: Range<usize>,
    pub(crate) six: Range<usize>,
}

/// Joint motion as used by the recursions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointMotion {
    /// One coordinate along a constant motion axis.
    Axis(AxisMotion),
    /// Translation in P axes, then rotation angles.
    Elastic(ElasticAngles),
    /// No motion: a modal link on a fixed joint is a separate body without a joint coordinate.
    Welded,
    /// Interface of the parent's modal body; it uses the coordinates of that body.
    Interface {
        /// Index of the modal body in the model.
        modal: usize,
        /// Index of the interface.
        interface: usize,
    },
}

/// Modal body in the tree.
#[derive(Clone, Debug)]
pub(crate) struct Modal {
    pub(crate) body: usize,
    pub(crate) coordinate: usize,
    pub(crate) n: usize,
    pub(crate) tables: ModalTables,
}

impl Body {
    /// Pose in the parent for the coordinate value (rad or m) of a single-DoF joint.
    ///
    /// # Panics
    /// If the joint does not have exactly one coordinate.
    #[inline]
    pub fn X_PB(&self, coordinate: f64) -> Pose {
        let JointMotion::Axis(motion) = self.motion else { panic!("joint {:?} has not one coordinate", self.joint) };
        along_axis(self, motion, coordinate)
    }
}

impl Modal {
    /// Mode shape columns of an interface, six components for each coordinate that moves it.
    #[inline(always)]
    pub(crate) fn columns_of(&self, interface: usize) -> ChunksExact<'_, f64> {
        let moving = 6 * self.tables.moving[interface];
        self.tables.shapes.interfaces[interface].Phi.as_slice()[..moving].chunks_exact(6)
    }
}

/// Contiguous elastic coordinates of one elastic joint or one modal body.
#[derive(Clone, Debug, PartialEq)]
pub struct ElasticGroup {
    /// Name of the elastic joint, or of the modal link.
    pub name: String,
    /// Child body of the joint, or the modal body.
    pub body: usize,
    /// First coordinate.
    pub coordinate: usize,
    /// Number of coordinates.
    pub size: usize,
    /// Whether these are modal coordinates.
    pub modal: bool,
}

/// Named frame fixed to a body; there is one per link of the mechanism.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Name of the link.
    pub name: String,
    /// Body that carries the frame.
    pub body: usize,
    /// Pose of the frame in the body.
    pub X_BF: Pose,
}

/// Independent coordinate.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// Joint that owns the coordinate.
    pub joint: String,
    /// Component within the joint: 0, or 0..6 for elastic joints.
    pub component: usize,
    /// Body moved by the joint.
    pub body: usize,
    /// Limits of the joint.
    pub limits: Limits,
    /// URDF name of the joint type.
    pub kind: &'static str,
}

impl Coordinate {
    /// Whether the joint is prismatic: its value is a length.
    pub fn slides(&self) -> bool {
        self.kind == "prismatic"
    }

    /// Unit of the value: m or rad.
    pub fn unit(&self) -> &'static str {
        if self.slides() { "m" } else { "rad" }
    }

    /// Unit of the effort: N or N m.
    pub fn effort_unit(&self) -> &'static str {
        if self.slides() { "N" } else { "N m" }
    }
}

/// Maximum number of independent coordinates of a model.
pub const MOST_COORDINATES: usize = 600;

/// Reason why a mechanism is not a valid tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The mechanism is empty.
    #[error("mechanism {0:?} has no links: add at least a base link")]
    NoLinks(String),
    /// Two links or two joints have the same name.
    #[error("{what} {name:?} is defined twice: names must be unique")]
    Duplicate {
        /// "link" or "joint".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A joint refers to an unknown link.
    #[error("joint {joint:?} refers to link {link:?}, which does not exist")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The missing link.
        link: String,
    },
    /// A link is the child of two joints.
    #[error("link {link:?} is the child of both joint {first:?} and joint {second:?}: a tree has one parent each")]
    TwoParents {
        /// The link.
        link: String,
        /// First joint.
        first: String,
        /// Second joint.
        second: String,
    },
    /// More than one link without a parent.
    #[error("the links form {} separate parts with bases {roots:?}: connect them by joints", roots.len())]
    Disconnected {
        /// The links without parent.
        roots: Vec<String>,
    },
    /// The links form a cycle.
    #[error("links {links:?} form a loop: open it at one joint")]
    Cycle {
        /// The links that cannot be reached from a base.
        links: Vec<String>,
    },
    /// A body on a spring has no mass, so its motion is undetermined.
    #[error(
        "link {link:?} is elastic (joint {joint:?}) and has mass {mass} kg with all that it carries: give it a positive mass, or keep everything before it rigid"
    )]
    NoMass {
        /// The link.
        link: String,
        /// The joint that moves it.
        joint: String,
        /// Carried mass found (kg).
        mass: f64,
    },
    /// Mass properties are not physical.
    #[error("link {link:?}: {what} is {value}, which no body has")]
    BadInertia {
        /// The link.
        link: String,
        /// Name of the quantity.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A value is outside its allowed range.
    #[error("{part} {name:?}: {what}")]
    OutOfRange {
        /// Part of the mechanism: "mechanism", "link" or "joint".
        part: &'static str,
        /// Name of the part.
        name: String,
        /// Value and allowed range.
        what: OutOfRange,
    },
    /// A rotor coupling does not connect two joints of one coordinate each.
    #[error(
        "the rotor between joint {joint:?} and another one: it needs two joints of one coordinate each, and a finite inertia"
    )]
    BadRotor {
        /// The joint.
        joint: String,
    },
    /// A modal link is inconsistent with the tree.
    #[error("link {link:?} is modal, but {what} is wrong")]
    BadModal {
        /// The link.
        link: String,
        /// The inconsistent item.
        what: &'static str,
    },
    /// A balancer refers to a missing item.
    #[error("balancer {balancer:?}: {what} is not in the robot")]
    BadBalancer {
        /// The balancer.
        balancer: String,
        /// The missing item.
        what: &'static str,
    },
    /// A loop closure is invalid.
    #[error("loop {name:?}: {what}")]
    BadLoop {
        /// The loop.
        name: String,
        /// Description of the problem.
        what: String,
    },
    /// A quantity is NaN or infinite.
    #[error("{what} of {name:?} has a NaN or infinite entry")]
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
        /// Name of the link or joint.
        name: String,
    },
    /// The model has more than [`MOST_COORDINATES`] coordinates.
    #[error(
        "the model has {found} coordinates (joints, springs and modes together), at most {MOST_COORDINATES} are taken: memory grows with \
         their square and the time of a step with their cube"
    )]
    TooManyCoordinates {
        /// Number of coordinates of the model.
        found: usize,
    },
    /// A mimic joint has no valid leader.
    #[error("joint {joint:?} mimics {leader:?}, which is not a movable, independent joint")]
    BadMimic {
        /// The follower.
        joint: String,
        /// Name of the requested leader.
        leader: String,
    },
}

impl Model {
    /// Checks the mechanism and builds the tree.
    ///
    /// # Errors
    /// [`ModelError`] with the names of the invalid links or joints.
    pub fn new(mechanism: &Mechanism) -> Result<Self, ModelError> {
        let base = check_tree(mechanism)?;
        let gravity = Quantity::ACCELERATION.check_all("gravity", &mechanism.gravity);
        gravity.map_err(|what| out_of_range("mechanism", &mechanism.name, what))?;
        let mut build = Builder {
            mechanism,
            links: mechanism.links.iter().enumerate().map(|(i, link)| (link.name.as_str(), i)).collect(),
            children: children_of_links(mechanism),
            bodies: Vec::new(),
            frames: Vec::new(),
            followers: Vec::new(),
            modal: Vec::new(),
        };
        let world = &mechanism.links[base];
        build.bodies.push(Body {
            name: world.name.clone(),
            joint: String::new(),
            parent: 0,
            X_PJ: Pose::identity(),
            inertia: SpatialInertia::zeros(),
            motion: JointMotion::Welded,
            coordinate: usize::MAX,
            ratio: 1.0,
            offset: 0.0,
            armature: 0.0,
            elastic: false,
            modal: None,
            turn: RevoluteTable::new(&Pose::identity(), &Vector3::z()),
            turning: 0,
            subtree_end: 0,
            is_parallel: true,
            columns: Outward::default(),
        });
        build.grow(base)?;
        build.finish()
    }

    /// Number of independent coordinates; positions and velocities both have this size.
    pub fn nv(&self) -> usize {
        self.coordinates.len()
    }

    /// Number of actuated coordinates; they come first.
    pub fn n_actuated(&self) -> usize {
        self.n_actuated
    }

    /// Number of elastic coordinates; they come after the actuated ones.
    pub fn n_elastic(&self) -> usize {
        self.coordinates.len() - self.n_actuated
    }

    /// Groups of elastic coordinates in order: elastic joints and modal bodies.
    pub fn elastic(&self) -> &[ElasticGroup] {
        &self.elastic
    }

    /// Whether the model has modal bodies.
    pub fn has_modal(&self) -> bool {
        !self.modal.is_empty()
    }

    /// Modal coordinates that move no interface and are mutually orthogonal with respect to the
    /// body's mass, such as fixed-interface modes. The mass matrix has a constant diagonal entry
    /// for each and zeros between them.
    pub fn held_modes(&self) -> Vec<usize> {
        self.modal
            .iter()
            .flat_map(|modal| modal.tables.shapes.held().into_iter().map(|k| modal.coordinate + k))
            .collect()
    }

    /// Bodies, parents before children; body 0 is the world.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Named frames, one per link.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Returns the frame with this name.
    pub fn frame(&self, name: &str) -> Option<&Frame> {
        self.frame_by_name.get(name).map(|&i| &self.frames[i])
    }

    /// Independent coordinates in order: actuated, then elastic.
    pub fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    /// Balancers, in the order given in the mechanism.
    pub fn balancers(&self) -> &[PlacedBalancer] {
        &self.balancers
    }

    /// Closed loops, each after the loops it depends on.
    pub fn loops(&self) -> &[PlacedLoop] {
        &self.loops
    }

    /// Coordinates determined by the closed loops, two per loop in the order of [`Model::loops`].
    /// They are not part of [`Model::coordinates`].
    pub fn dependent(&self) -> &[Coordinate] {
        &self.dependent
    }

    /// Whether the model has mimic joints.
    pub fn has_mimic(&self) -> bool {
        self.has_mimic
    }

    /// Total mass of all moving bodies (kg), including a modal base.
    pub fn moving_mass(&self) -> f64 {
        let rigid: f64 = self.bodies[1..].iter().map(|b| b.inertia.mass).sum();
        rigid + self.modal.iter().map(|m| m.tables.shapes.mass).sum::<f64>()
    }

    /// Returns a copy of the model with the inertia of one body replaced. `inertia` is about Bo in
    /// B axes and includes everything fixed to the body.
    pub fn with_inertia(&self, body: usize, inertia: SpatialInertia) -> Self {
        let mut model = self.clone();
        model.bodies[body].inertia = inertia;
        model
    }

    /// Sets the pose of the joint frame of a body in its parent body, at zero coordinate.
    pub fn set_joint_frame(&mut self, body: usize, X_PJ: Pose) {
        let body = &mut self.bodies[body];
        body.is_parallel = X_PJ.rotation == Rotation3::identity();
        if let JointMotion::Axis(motion) = body.motion {
            body.turn = RevoluteTable::new(&X_PJ, &motion.axis());
        }
        body.X_PJ = X_PJ;
    }

    /// Rotor inertia of a coordinate, reflected to it (kg m² or kg).
    pub fn rotor_inertia(&self, coordinate: usize) -> f64 {
        self.rotors.iter().filter(|(k, _)| *k == coordinate).map(|(_, inertia)| inertia).sum()
    }

    /// Whether the other model has bitwise the same joints, frames, modal bodies, balancers, loops
    /// and gravity; inertias may differ.
    pub fn is_same_tree(&self, other: &Self) -> bool {
        let body =
            |b: &Body| (b.parent, b.X_PJ, b.motion, b.coordinate, b.ratio, b.offset, b.armature, b.elastic, b.modal);
        self.gravity == other.gravity
            && self.balancers == other.balancers
            && self.rotor_couplings == other.rotor_couplings
            && self.loops == other.loops
            && self.bodies.len() == other.bodies.len()
            && self.bodies.iter().zip(&other.bodies).all(|(a, b)| body(a) == body(b))
            && self
                .frames
                .iter()
                .map(|f| (&f.name, f.body, f.X_BF))
                .eq(other.frames.iter().map(|f| (&f.name, f.body, f.X_BF)))
            && self.modal.len() == other.modal.len()
            && self.modal.iter().zip(&other.modal).all(|(a, b)| a.body == b.body && a.tables.shapes == b.tables.shapes)
    }
}

fn modal_has(modal: &Modal, interface: usize) -> bool {
    interface < modal.tables.shapes.interfaces.len()
}

/// Checks names, parents and connectivity; returns the index of the base link.
fn check_tree(mechanism: &Mechanism) -> Result<usize, ModelError> {
    if mechanism.links.is_empty() {
        return Err(ModelError::NoLinks(mechanism.name.clone()));
    }
    let mut parent_of: HashMap<&str, Option<&str>> = HashMap::new();
    for link in &mechanism.links {
        if parent_of.insert(&link.name, None).is_some() {
            return Err(ModelError::Duplicate { what: "link", name: link.name.clone() });
        }
    }
    let mut seen = HashMap::new();
    for joint in &mechanism.joints {
        if seen.insert(joint.name.as_str(), ()).is_some() {
            return Err(ModelError::Duplicate { what: "joint", name: joint.name.clone() });
        }
        for link in [&joint.parent, &joint.child] {
            if !parent_of.contains_key(link.as_str()) {
                return Err(ModelError::UnknownLink { joint: joint.name.clone(), link: link.clone() });
            }
        }
        if let Some(first) = parent_of.insert(&joint.child, Some(&joint.name)).flatten() {
            return Err(ModelError::TwoParents {
                link: joint.child.clone(),
                first: first.to_owned(),
                second: joint.name.clone(),
            });
        }
    }

    // Links that cannot be reached from a link without parent are on a cycle.
    let roots: Vec<usize> =
        (0..mechanism.links.len()).filter(|&i| parent_of[mechanism.links[i].name.as_str()].is_none()).collect();
    let children = children_of_links(mechanism);
    let mut reached: HashMap<&str, ()> = HashMap::new();
    let mut open: Vec<&str> = roots.iter().map(|&i| mechanism.links[i].name.as_str()).collect();
    while let Some(link) = open.pop() {
        reached.insert(link, ());
        open.extend(children.get(link).into_iter().flatten().map(|j| j.child.as_str()));
    }
    let looped: Vec<String> =
        mechanism.links.iter().filter(|l| !reached.contains_key(l.name.as_str())).map(|l| l.name.clone()).collect();
    if !looped.is_empty() {
        return Err(ModelError::Cycle { links: looped });
    }
    if roots.len() > 1 {
        let roots = roots.iter().map(|&i| mechanism.links[i].name.clone()).collect();
        return Err(ModelError::Disconnected { roots });
    }
    Ok(roots[0])
}

/// Child joints of each link, in source order.
fn children_of_links(mechanism: &Mechanism) -> HashMap<&str, Vec<&Joint>> {
    let mut children: HashMap<&str, Vec<&Joint>> = HashMap::new();
    for joint in &mechanism.joints {
        children.entry(&joint.parent).or_default().push(joint);
    }
    children
}

struct Follower {
    body: usize,
    joint: String,
    leader: String,
}

struct Builder<'a> {
    mechanism: &'a Mechanism,
    links: HashMap<&'a str, usize>,
    children: HashMap<&'a str, Vec<&'a Joint>>,
    bodies: Vec<Body>,
    frames: Vec<Frame>,
    followers: Vec<Follower>,
    modal: Vec<Modal>,
}

impl<'a> Builder<'a> {
    /// Adds bodies and frames of the whole tree, depth first. Iterative, since chains may be long.
    fn grow(&mut self, base: usize) -> Result<(), ModelError> {
        self.lump(base, 0, Pose::identity())?;
        // Stack of joints to visit: joint, parent link, body of the parent link, its pose in that
        // body.
        let mut pending: Vec<(&'a Joint, usize, usize, Pose)> = Vec::new();
        let (mut link, mut body, mut X_BL) = (base, 0, Pose::identity());
        loop {
            let name = self.mechanism.links[link].name.as_str();
            let children = self.children.get(name).into_iter().flatten().rev();
            pending.extend(children.map(|joint| (*joint, link, body, X_BL)));
            let Some((joint, parent, on, X_BP)) = pending.pop() else { break };
            link = self.links[joint.child.as_str()];
            (body, X_BL) = self.cross(joint, parent, on, &X_BP)?;
            self.lump(link, body, X_BL)?;
        }
        self.check_masses()
    }

    /// Adds a link to the body that carries it.
    fn lump(&mut self, link: usize, body: usize, X_BL: Pose) -> Result<(), ModelError> {
        let link = &self.mechanism.links[link];
        if let Some(inertia) = &link.inertia {
            check_inertia(&link.name, inertia, body != 0)?;
            self.bodies[body].inertia += inertia.spatial().at_parent(&X_BL);
        }
        self.frames.push(Frame { name: link.name.clone(), body, X_BF: X_BL });
        if let Some((_, shapes)) = self.mechanism.modal.iter().find(|(name, _)| *name == link.name) {
            if let Some(what) = shapes.fault() {
                return Err(ModelError::BadModal { link: link.name.clone(), what });
            }
            if self.bodies[body].modal.is_some() || X_BL != Pose::identity() {
                let what = "its position in a body that is modal already";
                return Err(ModelError::BadModal { link: link.name.clone(), what });
            }
            self.bodies[body].modal = Some(self.modal.len());
            let tables = ModalTables::new(shapes);
            self.modal.push(Modal { body, coordinate: usize::MAX, n: shapes.n(), tables });
        }
        Ok(())
    }

    /// Returns the child body of a joint (a new body unless the joint is fixed) and the pose of the
    /// child link in it.
    fn cross(&mut self, joint: &Joint, parent: usize, body: usize, X_BL: &Pose) -> Result<(usize, Pose), ModelError> {
        if !joint.X_PJ.translation.vector.iter().chain(joint.X_PJ.rotation.matrix().iter()).all(|x| x.is_finite()) {
            return Err(ModelError::NotFinite { what: "origin", name: joint.name.clone() });
        }
        let of_joint = |what| out_of_range("joint", &joint.name, what);
        Quantity::LENGTH.check_all("origin", &joint.X_PJ.translation.vector).map_err(of_joint)?;
        Quantity::INERTIA.check("inertia of the rotor", joint.armature).map_err(of_joint)?;
        let mechanism = self.mechanism;
        let link = &mechanism.links[parent];
        let X_BJ = X_BL * joint.X_PJ;
        let motion = match (joint.kind, joint.kind.axis_motion()) {
            // A modal link needs a body whose frame is its own.
            (JointKind::Fixed, _) if mechanism.modal.iter().any(|(name, _)| *name == joint.child) => {
                JointMotion::Welded
            }
            (_, Some(motion)) => JointMotion::Axis(motion),
            (JointKind::Elastic(angles), _) => JointMotion::Elastic(angles),
            (JointKind::Interface(interface), _) => match self.bodies[body].modal {
                Some(modal) if modal_has(&self.modal[modal], interface) && self.frames_are_at(body, &link.name) => {
                    JointMotion::Interface { modal, interface }
                }
                _ => {
                    let what = "an interface joint on it that its modal body does not have";
                    return Err(ModelError::BadModal { link: link.name.clone(), what });
                }
            },
            _ => return Ok((body, X_BJ)),
        };
        let axis = joint.kind.axis_motion().map_or(Vector3::z(), AxisMotion::axis);
        let (ratio, offset) = joint.mimic.as_ref().map_or((1.0, 0.0), |m| (m.ratio, m.offset));
        let index = self.bodies.len();
        if let Some(mimic) = &joint.mimic {
            let (joint, leader) = (joint.name.clone(), mimic.joint.clone());
            self.followers.push(Follower { body: index, joint, leader });
        }
        self.bodies.push(Body {
            name: joint.child.clone(),
            joint: joint.name.clone(),
            parent: body,
            X_PJ: X_BJ,
            inertia: SpatialInertia::zeros(),
            motion,
            coordinate: usize::MAX,
            ratio,
            offset,
            armature: joint.armature,
            elastic: joint.kind.is_elastic(),
            modal: None,
            turn: RevoluteTable::new(&X_BJ, &axis),
            turning: 0,
            subtree_end: 0,
            is_parallel: X_BJ.rotation == Rotation3::identity(),
            columns: Outward::default(),
        });
        Ok((index, Pose::identity()))
    }

    /// Whether the body frame coincides with the frame of the link.
    fn frames_are_at(&self, body: usize, link: &str) -> bool {
        self.frames.iter().any(|f| f.body == body && f.name == *link && f.X_BF == Pose::identity())
    }

    /// Checks that every elastic body carries mass: elastic coordinates are solved for, while a
    /// joint with prescribed motion needs no mass behind it.
    fn check_masses(&self) -> Result<(), ModelError> {
        let own = |b: &Body| b.inertia.mass + b.modal.map_or(0.0, |m| self.modal[m].tables.shapes.mass);
        let mut carried: Vec<f64> = self.bodies.iter().map(own).collect();
        for i in (1..self.bodies.len()).rev() {
            let body = &self.bodies[i];
            let mass = carried[i];
            if mass.is_nan() || mass < 0.0 || (mass == 0.0 && body.elastic) {
                return Err(ModelError::NoMass { link: body.name.clone(), joint: body.joint.clone(), mass });
            }
            carried[body.parent] += mass;
        }
        Ok(())
    }

    /// Numbers the coordinates, connects mimic joints and interfaces to theirs, and builds the
    /// model.
    fn finish(mut self) -> Result<Model, ModelError> {
        let drafts = draft_loops(self.mechanism, &self.frames, &self.bodies)?;
        let followers: Vec<usize> = drafts.iter().flat_map(LoopDraft::dependent).collect();
        let Numbering { coordinates, elastic, n_actuated } = self.number(&followers);
        if coordinates.len() > MOST_COORDINATES {
            return Err(ModelError::TooManyCoordinates { found: coordinates.len() });
        }
        self.share(&coordinates[..n_actuated])?;
        let dependent = self.number_dependent(&followers, coordinates.len());
        let nv = coordinates.len();
        let loops = drafts.iter().map(|d| d.placed(&self.bodies, nv, |modal| self.modal[modal].n)).collect();
        self.close_subtrees();
        let (single, six) = self.list_columns();
        let turns = |b: &Body| matches!(b.motion, JointMotion::Axis(motion) if !motion.slides());
        let turning: Vec<usize> = (1..self.bodies.len()).filter(|i| turns(&self.bodies[*i])).collect();
        for (number, &i) in turning.iter().enumerate() {
            self.bodies[i].turning = number;
        }
        let with_rotor = self.bodies[1..].iter().filter(|b| b.armature != 0.0);
        let rotors = with_rotor.map(|b| (b.coordinate, b.ratio * b.ratio * b.armature)).collect();
        let rotor_couplings = self.rotor_couplings()?;
        let balancers = place_balancers(self.mechanism, &self.frames, &self.bodies, nv)?;
        let frame_by_name = self.frames.iter().enumerate().map(|(i, f)| (f.name.clone(), i)).collect();
        let is_chain = (1..self.bodies.len()).all(|i| self.bodies[i].parent + 1 == i);
        let mut model = Model {
            name: self.mechanism.name.clone(),
            sums_entries: !is_chain || !self.modal.is_empty() || !self.followers.is_empty(),
            has_mimic: !self.followers.is_empty(),
            loops,
            dependent,
            turning,
            single,
            six,
            bodies: self.bodies,
            frames: self.frames,
            frame_by_name,
            coordinates,
            n_actuated,
            elastic,
            modal: self.modal,
            balancers,
            rotors,
            rotor_couplings,
            gravity: self.mechanism.gravity,
        };
        assemble(&mut model, self.mechanism)?;
        Ok(model)
    }

    /// Coordinates coupled by rotors, with the coupling inertia.
    fn rotor_couplings(&self) -> Result<Vec<(usize, usize, f64)>, ModelError> {
        let coordinate = |joint: &String| {
            let own = |b: &&Body| b.joint == *joint && matches!(b.motion, JointMotion::Axis(_)) && b.ratio == 1.0;
            let body = self.bodies[1..].iter().find(own);
            body.map(|b| b.coordinate).ok_or_else(|| ModelError::BadRotor { joint: joint.clone() })
        };
        let placed = |coupling: &RotorCoupling| {
            let [first, second] = &coupling.joints;
            let (a, b) = (coordinate(first)?, coordinate(second)?);
            if a == b || !coupling.inertia.is_finite() {
                return Err(ModelError::BadRotor { joint: second.clone() });
            }
            Ok((a, b, coupling.inertia))
        };
        self.mechanism.rotor_couplings.iter().map(placed).collect()
    }

    /// Coordinates of the joints determined by closed loops; they are numbered after all others.
    fn number_dependent(&mut self, followers: &[usize], nv: usize) -> Vec<Coordinate> {
        let joints: HashMap<&str, &Joint> = self.children.values().flatten().map(|j| (j.name.as_str(), *j)).collect();
        let mut dependent = Vec::new();
        for &body in followers {
            let own = &mut self.bodies[body];
            own.coordinate = nv + dependent.len();
            let (limits, kind) =
                joints.get(own.joint.as_str()).map_or((Limits::NONE, "revolute"), |j| (j.limits, j.kind.name()));
            dependent.push(Coordinate { joint: own.joint.clone(), component: 0, body, limits, kind });
        }
        dependent
    }

    /// Numbers the coordinates of joints and modal bodies, actuated ones first. Joints determined
    /// by closed loops, mimic joints and interfaces get none of their own.
    fn number(&mut self, dependent: &[usize]) -> Numbering {
        let mut to = Numbering { coordinates: Vec::new(), elastic: Vec::new(), n_actuated: 0 };
        let joints: HashMap<&str, &Joint> = self.children.values().flatten().map(|j| (j.name.as_str(), *j)).collect();
        let places: HashMap<&str, usize> =
            self.mechanism.coordinate_order.iter().map(String::as_str).zip(0..).collect();
        let place = |i: usize| places.get(self.bodies[i].joint.as_str()).copied().unwrap_or(usize::MAX);
        let mut ordered: Vec<usize> = (0..self.bodies.len()).collect();
        ordered.sort_by_key(|i| place(*i));
        let as_they_are = (0..self.bodies.len()).collect();
        for (elastic_pass, order) in [(false, ordered), (true, as_they_are)] {
            for i in order {
                let body = &self.bodies[i];
                let none = matches!(body.motion, JointMotion::Interface { .. } | JointMotion::Welded);
                let follows = dependent.contains(&i) || self.followers.iter().any(|f| f.body == i);
                let own = body.elastic == elastic_pass && !none && !follows;
                if let Some(joint) = joints.get(body.joint.as_str()).filter(|_| own) {
                    self.bodies[i].coordinate = to.joint(joint, i, elastic_pass);
                }
                if elastic_pass && let Some(m) = self.bodies[i].modal {
                    let link = self.frames.iter().find(|f| f.body == i && f.X_BF == Pose::identity());
                    let name = link.map_or_else(String::new, |f| f.name.clone());
                    self.modal[m].coordinate = to.modal(name, i, self.modal[m].n);
                }
            }
        }
        to
    }

    /// Gives interfaces the coordinates of their modal body and mimic joints that of their leader.
    fn share(&mut self, actuated: &[Coordinate]) -> Result<(), ModelError> {
        for body in &mut self.bodies {
            if let JointMotion::Interface { modal, .. } = body.motion {
                body.coordinate = self.modal[modal].coordinate;
            }
        }
        for follower in &self.followers {
            let leader = actuated.iter().position(|c| c.joint == follower.leader);
            let is_elastic = self.bodies[follower.body].elastic;
            match leader {
                Some(index) if !is_elastic => self.bodies[follower.body].coordinate = index,
                _ => {
                    let (joint, leader) = (follower.joint.clone(), follower.leader.clone());
                    return Err(ModelError::BadMimic { joint, leader });
                }
            }
        }
        Ok(())
    }

    /// Lists the single-DoF and the six-DoF joints and sets, for each body, the ranges of those in
    /// its subtree.
    fn list_columns(&mut self) -> (Vec<usize>, Vec<usize>) {
        let (mut single, mut six) = (Vec::new(), Vec::new());
        let mut begins = vec![(0, 0)];
        for body in &self.bodies {
            match body.motion {
                JointMotion::Axis(_) => single.push(body.coordinate),
                JointMotion::Elastic(_) => six.push(body.coordinate),
                JointMotion::Welded | JointMotion::Interface { .. } => {}
            }
            begins.push((single.len(), six.len()));
        }
        for (i, body) in self.bodies.iter_mut().enumerate() {
            let ((single, six), end) = (begins[i], begins[body.subtree_end]);
            body.columns = Outward { single: single..end.0, six: six..end.1 };
        }
        (single, six)
    }

    /// Computes the end of the subtree of each body.
    fn close_subtrees(&mut self) {
        for i in (0..self.bodies.len()).rev() {
            let end = self.bodies[i].subtree_end.max(i + 1);
            self.bodies[i].subtree_end = end;
            let parent = self.bodies[i].parent;
            self.bodies[parent].subtree_end = self.bodies[parent].subtree_end.max(end);
        }
    }
}

/// Coordinate numbering under construction.
struct Numbering {
    coordinates: Vec<Coordinate>,
    elastic: Vec<ElasticGroup>,
    n_actuated: usize,
}

impl Numbering {
    /// Adds the coordinates of a joint that moves `body`; returns the first.
    fn joint(&mut self, joint: &Joint, body: usize, elastic: bool) -> usize {
        let (coordinate, size) = (self.coordinates.len(), joint.kind.degrees_of_freedom());
        self.coordinates.extend((0..size).map(|component| Coordinate {
            joint: joint.name.clone(),
            component,
            body,
            limits: joint.limits,
            kind: joint.kind.name(),
        }));
        if elastic {
            self.elastic.push(ElasticGroup { name: joint.name.clone(), body, coordinate, size, modal: false });
        } else {
            self.n_actuated += size;
        }
        coordinate
    }

    /// Adds the coordinates of a modal body under the name of its link; returns the first.
    fn modal(&mut self, name: String, body: usize, size: usize) -> usize {
        let coordinate = self.coordinates.len();
        self.coordinates.extend((0..size).map(|component| Coordinate {
            joint: name.clone(),
            component,
            body,
            limits: Limits::NONE,
            kind: "modal",
        }));
        self.elastic.push(ElasticGroup { name, body, coordinate, size, modal: true });
        coordinate
    }
}

/// Relative tolerance for negative principal moments of inertia. Files have six significant digits;
/// anything below is an error, not rounding.
const MOMENT_TOLERANCE: f64 = 1e-6;

/// Magnitude of a negative principal moment of inertia that is accepted as rounding (kg m²).
///
/// ```text
/// floor = 1e-6 |I| + m (1 um)^2 + 1e-20 kg m^2
/// ```
/// * `mass`: mass (kg); `largest`: principal moment of largest magnitude (kg m²).
pub fn moment_floor(mass: f64, largest: f64) -> f64 {
    MOMENT_TOLERANCE * largest.abs() + 1e-12 * mass.abs() + 1e-20
}

fn out_of_range(part: &'static str, name: &str, what: OutOfRange) -> ModelError {
    ModelError::OutOfRange { part, name: name.to_owned(), what }
}

/// Checks that the inertia is finite and physically possible. The inertia of fixed links has no
/// effect, so only finiteness is checked for them.
fn check_inertia(link: &str, inertia: &crate::mechanism::LinkInertia, moves: bool) -> Result<(), ModelError> {
    let finite =
        inertia.mass.is_finite() && inertia.com.iter().chain(inertia.inertia_com.iter()).all(|x| x.is_finite());
    if !finite {
        return Err(ModelError::NotFinite { what: "inertia", name: link.to_owned() });
    }
    if !moves {
        return Ok(());
    }
    if inertia.mass < 0.0 {
        return Err(ModelError::BadInertia { link: link.to_owned(), what: "mass [kg]", value: inertia.mass });
    }
    Quantity::MASS.check("mass", inertia.mass).map_err(|what| out_of_range("link", link, what))?;
    Quantity::LENGTH.check_all("centre of mass", &inertia.com).map_err(|what| out_of_range("link", link, what))?;
    Quantity::INERTIA.check_all("inertia", &inertia.inertia_com).map_err(|what| out_of_range("link", link, what))?;
    let moments = inertia.inertia_com.symmetric_eigenvalues();
    let smallest = moments.min();
    if smallest < -moment_floor(inertia.mass, moments.amax()) {
        let what = "smallest principal moment of inertia [kg m²]";
        return Err(ModelError::BadInertia { link: link.to_owned(), what, value: smallest });
    }
    Ok(())
}
