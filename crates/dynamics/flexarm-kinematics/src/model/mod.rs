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
//!
//! `check` rejects what is not a tree, `builder` makes the bodies, `numbering` their coordinates.

mod body;
mod builder;
mod check;
mod error;
mod numbering;

use std::collections::HashMap;

use flexarm_spatial::{Pose, SpatialInertia};
use nalgebra::{Rotation3, Vector3};

use crate::axis_motion::RevoluteTable;
use crate::balancer::PlacedBalancer;
use crate::closure::PlacedLoop;

pub use body::{Body, Coordinate, ElasticGroup, Frame, JointMotion};
pub use check::moment_floor;
pub use error::{MAX_COORDINATES, ModelError};

pub(crate) use body::Modal;

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

impl Model {
    /// Number of independent coordinates; positions and velocities both have this size.
    pub fn nv(&self) -> usize {
        self.coordinates.len()
    }

    /// Checks that there is one value per coordinate.
    ///
    /// * `what`: name of the values for the message.
    ///
    /// # Panics
    /// If there is not.
    #[track_caller]
    #[inline]
    pub fn check_size(&self, what: &str, found: usize) {
        let expected = self.nv();
        assert!(found == expected, "{what} has {found} values, expected one for each of the {expected} coordinates");
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

    /// Whether a body is in the subtree of another one, or is that body.
    ///
    /// # Panics
    /// If there is no body `of`.
    pub(crate) fn is_in_subtree(&self, body: usize, of: usize) -> bool {
        (of..self.bodies[of].subtree_end).contains(&body)
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
    /// B axes and includes everything fixed to the body. It is not checked.
    ///
    /// # Panics
    /// If there is no such body.
    pub fn with_inertia(&self, body: usize, inertia: SpatialInertia) -> Self {
        let mut model = self.clone();
        model.bodies[body].inertia = inertia;
        model
    }

    /// Sets the pose of the joint frame of a body in its parent body, at zero coordinate.
    /// Translation in m.
    ///
    /// # Panics
    /// If there is no such body.
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
}
