//! Matrices on a tree for a flexible arm whose free coordinates are all elastic joints: one node
//! per elastic joint, with the bodies behind prescribed joints fixed to it.
//!
//! ```text
//! V_B = Ad_BQ V_Q + S x'
//! α = S^-1 V_B                  I = Sᵀ M_BBo S,   X = S_B^-1 Ad_BQ S_Q
//! ```
//! Q is the body behind the next elastic joint inward, S the motion subspace of B's own joint. Start
//! at [`ElasticTree::place`]. Not here: elimination along the tree (`tree_matrix`).

use flexarm_kinematics::{Data, ElasticAngles, JointMotion, Model, Pose, SpatialInertia, State, skew};
use nalgebra::{Matrix3, Matrix6};

use crate::dense::add_product;
use crate::plant::{Damping, Plant};
use crate::tree_matrix::{TreeMatrices, TreeNode};

/// Minimum number of elastic joints for elimination instead of a dense inverse: with two, 12
/// coordinates, a step takes the same time either way, with three 2.8 instead of 3.3 us, with five
/// 4.0 instead of 7.5, with 64 48 instead of 1800 (`examples/chains.rs`).
const FEWEST_NODES: usize = 4;

/// Assignment of the bodies to nodes, and workspaces.
#[derive(Clone, Debug)]
pub(crate) struct ElasticTree {
    joints: Vec<ElasticJoint>,
    /// Per body: the node to which it is fixed, and its pose there.
    carriers: Vec<(Option<usize>, Pose)>,
}

#[derive(Clone, Debug)]
struct ElasticJoint {
    body: usize,
    coordinate: usize,
    angles: ElasticAngles,
    /// S: `[L 0; 0 B]`.
    L: Matrix3<f64>,
    B: Matrix3<f64>,
    /// Inertia of all bodies fixed to the joint's body, about its origin, in its axes.
    inertia: SpatialInertia,
}

impl ElasticTree {
    /// Returns the tree of an arm if its steps are faster along the tree than with dense matrices.
    pub(crate) fn that_pays(plant: &Plant) -> Option<Self> {
        Self::of(plant).filter(|tree| tree.len() >= FEWEST_NODES && plant.damps_by_element())
    }

    /// Returns `None` if a free coordinate does not belong to an elastic joint with six
    /// coordinates, if a spring is nonlinear or a gear has other effects, or if closed loops
    /// connect branches of the tree.
    pub(crate) fn of(plant: &Plant) -> Option<Self> {
        let model = &plant.model;
        let straight = plant.elements.iter().all(|e| e.size == 6 && !e.modal && e.curve.is_none());
        if model.has_modal()
            || !model.loops().is_empty()
            || !straight
            || plant.has_gear_laws()
            || !plant.torque_driven.is_empty()
        {
            return None;
        }
        let mut joints = Vec::with_capacity(plant.elements.len());
        for element in &plant.elements {
            let JointMotion::Elastic(angles) = model.bodies()[element.body].motion else { return None };
            let (body, coordinate, one) = (element.body, element.coordinate, Matrix3::identity());
            // Coordinates must be in the order of the nodes, nodes in the order of the bodies.
            let in_order = plant.offset(element) == 6 * joints.len();
            let outward = joints.last().is_none_or(|last: &ElasticJoint| last.body < body);
            if !(in_order && outward) {
                return None;
            }
            joints.push(ElasticJoint { body, coordinate, angles, L: one, B: one, inertia: SpatialInertia::zeros() });
        }
        Some(Self { joints, carriers: vec![(None, Pose::identity()); model.bodies().len()] })
    }

    /// Returns the number of nodes.
    fn len(&self) -> usize {
        self.joints.len()
    }

    /// Computes inertias and motions at the poses of the last pass in `data`, evaluated at `state`;
    /// returns false at a singularity of the angles.
    pub(crate) fn place(&mut self, model: &Model, data: &Data, state: &State, nodes: &mut Vec<TreeNode>) -> bool {
        nodes.resize_with(self.joints.len(), || TreeNode::new(None));
        let mut next = 0;
        for (i, body) in model.bodies().iter().enumerate().skip(1) {
            // Pose in the last elastic body inward, Q.
            let (carrier, X_QP) = self.carriers[body.parent];
            let X_QB = X_QP * data.X_PB[i];
            self.carriers[i] = (carrier, X_QB);
            if self.joints.get(next).is_some_and(|joint| joint.body == i) {
                let X_PB = &data.X_PB[i];
                let joint = &mut self.joints[next];
                // An elastic body: S = [L 0; 0 B] of its joint, and X = S_B^-1 Ad_BQ S_Q.
                let phi = state.q.fixed_rows::<3>(joint.coordinate + 3).into_owned();
                joint.L = X_PB.rotation.matrix().transpose() * body.X_PJ.rotation.matrix();
                joint.B = joint.angles.pose(&phi).1;
                joint.inertia = SpatialInertia::zeros();
                let Some(B_inverse) = joint.B.try_inverse() else { return false };
                let node = &mut nodes[next];
                node.parent = carrier;
                if let Some(q) = carrier {
                    node.carried = motion(&self.joints[next], &B_inverse, &X_QB, &self.joints[q]);
                }
                self.carriers[i] = (Some(next), Pose::identity());
                next += 1;
            }
            // M_BBo of the elastic body and of all that it carries rigidly.
            if let (Some(j), X) = &self.carriers[i] {
                self.joints[*j].inertia += body.inertia.at_parent(X);
            }
        }
        for (node, joint) in nodes.iter_mut().zip(&self.joints) {
            node.inertia = joint.inertia_of_coordinates();
        }
        true
    }
}

/// Returns the blocks `X_t`, `X_tr`, `X_r` of `S_B^-1 Ad_BQ S_Q`.
fn motion(own: &ElasticJoint, B_inverse: &Matrix3<f64>, X_QB: &Pose, inner: &ElasticJoint) -> [Matrix3<f64>; 3] {
    let Rt = X_QB.rotation.matrix().transpose();
    let turn = own.L.transpose() * Rt;
    [turn * inner.L, -(turn * skew(&X_QB.translation.vector) * inner.B), B_inverse * Rt * inner.B]
}

impl ElasticJoint {
    /// Returns `Sᵀ M S`.
    fn inertia_of_coordinates(&self) -> Matrix6<f64> {
        let Self { L, B, inertia, .. } = self;
        let coupling = -(L.transpose() * skew(&inertia.first_moment) * B);
        let mut I = Matrix6::zeros();
        I.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(inertia.mass);
        I.fixed_view_mut::<3, 3>(0, 3).copy_from(&coupling);
        I.fixed_view_mut::<3, 3>(3, 0).copy_from(&coupling.transpose());
        I.fixed_view_mut::<3, 3>(3, 3).copy_from(&(B.transpose() * inertia.rotational * B));
        I
    }
}

impl Plant {
    /// Returns whether the damping matrix is block diagonal with one block per element.
    pub(crate) fn damps_by_element(&self) -> bool {
        self.cross_damping.is_empty()
            && !self.elements.iter().any(|e| matches!(e.damping, Damping::Modal(zeta) if zeta != 0.0))
    }

    /// Computes `f += D v` over the elastic coordinates; O(n) if the damping has one block per
    /// element.
    pub(crate) fn add_damping(&self, v: &[f64], f: &mut [f64]) {
        if !self.damps_by_element() {
            return add_product(self.D.as_slice(), v, f);
        }
        for element in &self.elements {
            let (first, size) = (self.offset(element), element.size);
            for (column, rate) in (first..first + size).zip(&v[first..]) {
                let block = &self.D.as_slice()[column * v.len() + first..];
                f[first..first + size].iter_mut().zip(block).for_each(|(f, d)| *f += d * rate);
            }
        }
    }

    /// Writes the blocks of `Z = c_D D + c_K K` and K for linear springs with six coordinates that are
    /// damped by element.
    pub(crate) fn blocks(&self, c_D: f64, c_K: f64, to: &mut TreeMatrices) {
        for (k, (node, element)) in to.nodes.iter_mut().zip(&self.elements).enumerate() {
            node.K.copy_from_slice(element.K.as_slice());
            if self.proportional {
                node.Z = node.K * (c_K + c_D * self.tau[k]);
            } else {
                let first = self.offset(element);
                node.Z = node.K * c_K + self.D.fixed_view::<6, 6>(first, first) * c_D;
            }
        }
    }
}
