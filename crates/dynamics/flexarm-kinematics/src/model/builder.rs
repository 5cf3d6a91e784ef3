//! Construction of the tree from a mechanism: bodies and frames, coordinates, loops, rotors.
//!
//! Start at [`Model::new`]. [`Builder::grow`] walks the tree and lumps links on fixed joints into the
//! body that carries them; [`Builder::finish`] numbers the coordinates and fills the lists of the
//! [`Model`]. Not here: checks of names and inertias (`check`), assembly of closed loops (`closure`).

use std::collections::HashMap;

use flexarm_settings::Quantity;
use flexarm_spatial::{Pose, SpatialInertia};
use nalgebra::{Rotation3, Vector3};

use crate::axis_motion::{AxisMotion, RevoluteTable};
use crate::balancer::place_balancers;
use crate::closure::{LoopDraft, assemble, draft_loops};
use crate::mechanism::{Joint, JointKind, Mechanism, RotorCoupling};
use crate::modal::ModalTables;
use crate::model::Model;
use crate::model::body::{Body, Frame, JointMotion, Modal, Outward};
use crate::model::check::{check_inertia, check_tree, children_of_links, out_of_range};
use crate::model::error::{MAX_COORDINATES, ModelError};
use crate::model::numbering::Numbering;

impl Model {
    /// Checks the mechanism and builds the tree.
    ///
    /// # Errors
    /// [`ModelError`] with the names of the invalid links or joints.
    pub fn new(mechanism: &Mechanism) -> Result<Self, ModelError> {
        // Names, connectivity and gravity; inertias are checked link by link.
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
        // Body 0, the world, has the base link and no joint.
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
}

pub(super) struct Follower {
    pub(super) body: usize,
    pub(super) joint: String,
    pub(super) leader: String,
}

pub(super) struct Builder<'a> {
    pub(super) mechanism: &'a Mechanism,
    pub(super) links: HashMap<&'a str, usize>,
    pub(super) children: HashMap<&'a str, Vec<&'a Joint>>,
    pub(super) bodies: Vec<Body>,
    pub(super) frames: Vec<Frame>,
    pub(super) followers: Vec<Follower>,
    pub(super) modal: Vec<Modal>,
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
                return Err(ModelError::modal(&link.name, what));
            }
            if self.bodies[body].modal.is_some() || X_BL != Pose::identity() {
                let what = "its position in a body that is modal already";
                return Err(ModelError::modal(&link.name, what));
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
            return Err(ModelError::not_finite("origin", &joint.name));
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
                Some(modal)
                    if interface < self.modal[modal].tables.shapes.interfaces.len()
                        && self.frames_are_at(body, &link.name) =>
                {
                    JointMotion::Interface { modal, interface }
                }
                _ => {
                    let what = "an interface joint on it that its modal body does not have";
                    return Err(ModelError::modal(&link.name, what));
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
                let (link, joint) = (&body.name, &body.joint);
                return Err(ModelError::Value(format!(
                    "link {link:?} is elastic (joint {joint:?}) and has mass {mass} kg with all that it carries: give \
                     it a positive mass, or keep everything before it rigid"
                )));
            }
            carried[body.parent] += mass;
        }
        Ok(())
    }

    /// Numbers the coordinates, connects mimic joints and interfaces to theirs, and builds the
    /// model.
    fn finish(mut self) -> Result<Model, ModelError> {
        // Coordinates: independent ones, those of mimic joints and interfaces, then dependent ones.
        let drafts = draft_loops(self.mechanism, &self.frames, &self.bodies)?;
        let followers: Vec<usize> = drafts.iter().flat_map(LoopDraft::dependent).collect();
        let Numbering { coordinates, elastic, n_actuated } = self.number(&followers);
        if coordinates.len() > MAX_COORDINATES {
            return Err(ModelError::Value(format!(
                "the model has {} coordinates (joints, springs and modes together), at most {MAX_COORDINATES} are \
                 taken: memory grows with their square and the time of a step with their cube",
                coordinates.len()
            )));
        }
        self.share(&coordinates[..n_actuated])?;
        let dependent = self.number_dependent(&followers, coordinates.len());
        let nv = coordinates.len();
        let loops = drafts.iter().map(|d| d.placed(&self.bodies, nv, |modal| self.modal[modal].n)).collect();
        // Lists of the recursions: subtrees, joints by type, rotors, balancers.
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
        // Assembly modes of the loops, which need the forward kinematics of the model.
        assemble(&mut model, self.mechanism)?;
        Ok(model)
    }

    /// Coordinates coupled by rotors, with the coupling inertia.
    fn rotor_couplings(&self) -> Result<Vec<(usize, usize, f64)>, ModelError> {
        let bad = |joint: &str| {
            let needs = "it needs two joints of one coordinate each, and a finite inertia";
            ModelError::Structure(format!("the rotor between joint {joint:?} and another one: {needs}"))
        };
        let coordinate = |joint: &String| {
            let own = |b: &&Body| b.joint == *joint && matches!(b.motion, JointMotion::Axis(_)) && b.ratio == 1.0;
            let body = self.bodies[1..].iter().find(own);
            body.map(|b| b.coordinate).ok_or_else(|| bad(joint))
        };
        let placed = |coupling: &RotorCoupling| {
            let [first, second] = &coupling.joints;
            let (a, b) = (coordinate(first)?, coordinate(second)?);
            if a == b || !coupling.inertia.is_finite() {
                return Err(bad(second));
            }
            Ok((a, b, coupling.inertia))
        };
        self.mechanism.rotor_couplings.iter().map(placed).collect()
    }
}
