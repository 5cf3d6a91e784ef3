//! Numbering of the coordinates: actuated, elastic, dependent; and those shared by several joints.
//!
//! The order is that of [`crate::Model`]: actuated joints in tree order or in that of
//! `coordinate_order`, elastic joints and modal bodies proximal to distal, joints that follow from
//! closed loops.
//!
//! Not here: checks of the mechanism (`check.rs`).

use std::collections::HashMap;

use flexarm_spatial::Pose;

use crate::mechanism::{Joint, Limits};
use crate::model::body::{Coordinate, ElasticGroup, JointMotion, Outward};
use crate::model::builder::Builder;
use crate::model::error::ModelError;

/// Coordinate numbering under construction.
pub(super) struct Numbering {
    pub(super) coordinates: Vec<Coordinate>,
    pub(super) elastic: Vec<ElasticGroup>,
    pub(super) n_actuated: usize,
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

impl Builder<'_> {
    /// Coordinates of the joints determined by closed loops; they are numbered after all others.
    pub(super) fn number_dependent(&mut self, followers: &[usize], nv: usize) -> Vec<Coordinate> {
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
    pub(super) fn number(&mut self, dependent: &[usize]) -> Numbering {
        let mut to = Numbering { coordinates: Vec::new(), elastic: Vec::new(), n_actuated: 0 };
        let joints: HashMap<&str, &Joint> = self.children.values().flatten().map(|j| (j.name.as_str(), *j)).collect();
        let places: HashMap<&str, usize> =
            self.mechanism.coordinate_order.iter().map(String::as_str).zip(0..).collect();
        // Order of the actuated coordinates: as the mechanism lists them, others after those.
        let place = |i: usize| places.get(self.bodies[i].joint.as_str()).copied().unwrap_or(usize::MAX);
        let mut ordered: Vec<usize> = (0..self.bodies.len()).collect();
        ordered.sort_by_key(|i| place(*i));
        let as_they_are = (0..self.bodies.len()).collect();
        // Actuated coordinates first, then elastic and modal ones in the order of the tree.
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
    pub(super) fn share(&mut self, actuated: &[Coordinate]) -> Result<(), ModelError> {
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
                    return Err(ModelError::Structure(format!(
                        "joint {:?} mimics {:?}, which is not a movable, independent joint",
                        follower.joint, follower.leader
                    )));
                }
            }
        }
        Ok(())
    }

    /// Lists the single-DoF and the six-DoF joints and sets, for each body, the ranges of those in
    /// its subtree.
    pub(super) fn list_columns(&mut self) -> (Vec<usize>, Vec<usize>) {
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
    pub(super) fn close_subtrees(&mut self) {
        for i in (0..self.bodies.len()).rev() {
            let end = self.bodies[i].subtree_end.max(i + 1);
            self.bodies[i].subtree_end = end;
            let parent = self.bodies[i].parent;
            self.bodies[parent].subtree_end = self.bodies[parent].subtree_end.max(end);
        }
    }
}
