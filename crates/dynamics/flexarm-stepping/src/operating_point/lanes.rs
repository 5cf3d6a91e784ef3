//! Equilibria of one arm at several poses in SIMD lanes: the operations of the standard path of
//! [`super::OperatingPoint`] in the same order, so that each lane is bitwise the same.
//!
//! The standard path is Newton's iteration with the factor of the springs at rest, up to
//! convergence. A lane that leaves it (weight or loads that change the stiffness much, steps that
//! are too large, no equilibrium) is reported and solved individually.
//!
//! Not here: lanes that are solved individually (`each.rs`).

use std::sync::Arc;

use flexarm_kinematics::lanes::{
    forward_kinematics, frame_jacobian, gravity_forces_at_poses, mass_matrix_at_poses, static_tangent,
};
use flexarm_kinematics::{Data, Frame, Model, Pose, Real, StaticTangent, Wrench};
use nalgebra::DMatrix;

use super::each::{PoseAnswer, PoseOutputs};
use super::tangent::{Tangent, to_hertz};
use super::{MAX_ITERATIONS, OperatingPoint, SLOW};
use crate::dense::{Factor, larger, largest};
use crate::equilibrium::settled;
use crate::plant::Plant;
use crate::statics::{add_wrench, load_at};

/// Returns whether poses of an arm can be computed in lanes.
pub(super) fn plain(plant: &Plant) -> bool {
    plant.model.n_elastic() > 0
        && !plant.has_gear_laws()
        && plant.loads.is_empty()
        && plant.model.balancers().is_empty()
        && plant.elements.iter().all(|element| element.curve.is_none() && element.geometric.is_none())
}

/// Stiffness of an element, assigned to its coordinates.
struct Element {
    first: usize,
    /// size × size, column-major.
    K: Vec<f64>,
    size: usize,
}

/// Poses in lanes, with the workspaces for them.
pub(super) struct LanePoints<T: Real> {
    tool: Frame,
    model: Arc<Model>,
    data: Data<T>,
    slopes: StaticTangent<T>,
    elements: Vec<Element>,
    K: DMatrix<f64>,
    rest: Factor<T>,
    /// Joints, then elastic coordinates.
    q: Vec<T>,
    r: Vec<T>,
    tangent: Tangent<T>,
    X_WT: Pose<T>,
    X_WT_rigid: Pose<T>,
    J: Vec<T>,
}

impl<T: Real> LanePoints<T> {
    /// Creates the workspaces for a supported arm; `None` if its tree has closed loops or the
    /// stiffness is not positive definite.
    pub(super) fn new(point: &OperatingPoint) -> Option<Self> {
        let OperatingPoint { plant, tool, K, .. } = point;
        let (model, n) = (&plant.model, plant.model.n_elastic());
        // Loops are closed by an iteration whose length depends on the pose.
        if !model.loops().is_empty() {
            return None;
        }
        let springs: Vec<T> = K.iter().map(|k| T::splat(*k)).collect();
        let mut rest = Factor::new(n);
        if rest.compute(&springs).any_below(0.5) {
            return None;
        }
        let element = |own: &crate::ElasticElement| Element {
            first: plant.offset(own),
            K: own.K.as_slice().to_vec(),
            size: own.size,
        };
        let data = Data::new(model);
        let X = data.X_WB[0];
        Some(Self {
            tool: tool.clone(),
            data,
            slopes: StaticTangent::new(model, model.n_actuated()),
            elements: plant.elements.iter().map(element).collect(),
            K: K.clone(),
            rest,
            q: vec![T::zero(); model.nv()],
            r: vec![T::zero(); n],
            tangent: Tangent::new(n),
            X_WT: X,
            X_WT_rigid: X,
            J: vec![T::zero(); 6 * model.nv()],
            model: model.clone(),
        })
    }

    /// Sets the joints of a lane.
    pub(super) fn place(&mut self, lane: usize, pose: &[f64]) {
        for (to, from) in self.q.iter_mut().zip(pose) {
            to.set_lane(lane, *from);
        }
    }

    /// Computes the equilibria of all lanes and their tangents; returns 1 in the lanes with a
    /// result on the standard path.
    #[inline(always)]
    pub(super) fn solve(&mut self, F_T_W: &Wrench) -> T {
        let joints = self.q.len() - self.r.len();
        self.q[joints..].fill(T::zero());
        forward_kinematics(&self.model, &mut self.data, &self.q);
        self.X_WT_rigid = self.data.X_WF(&self.tool);
        let found = self.newton(F_T_W);
        self.X_WT = self.data.X_WF(&self.tool);
        static_tangent(
            &mut self.slopes,
            &self.model,
            &self.data,
            &self.q,
            load_at(&self.tool, F_T_W),
            &mut self.tangent.T,
        );
        self.tangent.add_springs(&self.K);
        self.tangent.symmetric = F_T_W.torque.norm() == 0.0;
        let positive = self.tangent.factorise();
        frame_jacobian(&self.model, &self.data, &self.tool, &mut self.J);
        found * positive
    }

    /// Runs Newton's iteration of all lanes until each has ended; returns 1 where it converged.
    #[inline(always)]
    fn newton(&mut self, F_T_W: &Wrench) -> T {
        let (mut active, mut found) = (T::one(), T::zero());
        let mut previous = T::splat(f64::INFINITY);
        let half = T::splat(0.5);
        for iteration in 0..MAX_ITERATIONS {
            let residual = self.unbalance(F_T_W);
            for lane in 0..T::LANES {
                if active.lane(lane) != 1.0 {
                    continue;
                }
                let (now, before) = (residual.lane(lane), previous.lane(lane));
                let done = settled(iteration, now, before);
                if done || !now.is_finite() || now > SLOW * before {
                    active.set_lane(lane, 0.0);
                    found.set_lane(lane, f64::from(u8::from(done)));
                }
            }
            if !active.any_above(0.5) {
                break;
            }
            previous = residual;
            self.rest.solve(&mut self.r);
            // Lanes whose step would have to be shortened leave the standard path.
            active = largest(&self.r).pick_below(T::splat(0.5 + 0.5 * f64::EPSILON), active, T::zero());
            let joints = self.q.len() - self.r.len();
            for (q, r) in self.q[joints..].iter_mut().zip(&self.r) {
                *q = half.pick_below(active, *q - *r, *q);
            }
        }
        found
    }

    /// Computes `r = K e + p`; returns its maximum relative to the largest force.
    #[inline(always)]
    fn unbalance(&mut self, F_T_W: &Wrench) -> T {
        let Self { tool, model, data, elements, q, r, .. } = self;
        forward_kinematics(model, data, q);
        data.clear_external_wrenches();
        add_wrench(data, tool, F_T_W);
        gravity_forces_at_poses(model, data);
        // r = K e, then + p; the scale is the largest force before both cancel.
        let joints = q.len() - r.len();
        let (e, p) = (&q[joints..], &data.tau.as_slice()[joints..]);
        r.fill(T::zero());
        for Element { first, K, size } in elements.iter() {
            let (r, e) = (&mut r[*first..first + size], &e[*first..first + size]);
            for (column, e) in K.chunks_exact(*size).zip(e) {
                for (r, k) in r.iter_mut().zip(column) {
                    *r += T::splat(*k) * *e;
                }
            }
        }
        let scale = larger(larger(largest(r), largest(p)), T::splat(f64::MIN_POSITIVE));
        for (r, p) in r.iter_mut().zip(p) {
            *r += *p;
        }
        largest(r) / scale
    }

    /// Computes the requested outputs of all lanes, one answer each.
    #[inline(always)]
    pub(super) fn answer(&mut self, asked: PoseOutputs, answers: &mut [PoseAnswer]) {
        // Compliance and frequencies of all lanes at once.
        let joints = self.q.len() - self.r.len();
        let zeros = [[T::zero(); 6]; 6];
        let C = if asked.compliance { self.tangent.compliance(&self.J[6 * joints..]) } else { zeros };
        let mut whole = T::zero();
        if asked.frequencies {
            mass_matrix_at_poses(&self.model, &mut self.data);
            whole = self.tangent.find_frequencies(self.data.M.as_slice());
        }
        // Copy each lane into its answer.
        for (lane, answer) in answers.iter_mut().enumerate() {
            answer.tcp_pose = pose_of(&self.X_WT, lane);
            answer.rigid_tcp_pose = pose_of(&self.X_WT_rigid, lane);
            copy_lane(&self.q[joints..], lane, &mut answer.deflections);
            if asked.jacobian {
                copy_lane(&self.J[6 * joints..], lane, answer.jacobian.as_mut_slice());
            }
            if asked.compliance {
                answer.compliance = nalgebra::Matrix6::from_fn(|i, j| C[i][j].lane(lane));
            }
            if asked.frequencies {
                copy_lane(&self.tangent.d, lane, &mut answer.frequencies_hz);
                to_hertz(whole.lane(lane) == 1.0, &mut answer.frequencies_hz);
            }
        }
    }
}

/// Copies the numbers of one lane.
#[inline(always)]
fn copy_lane<T: Real>(from: &[T], lane: usize, to: &mut [f64]) {
    for (to, from) in to.iter_mut().zip(T::flat(from).iter().skip(lane).step_by(T::LANES)) {
        *to = *from;
    }
}

fn pose_of<T: Real>(X: &Pose<T>, lane: usize) -> Pose {
    let R = X.rotation.matrix().map(|x| x.lane(lane));
    let p = X.translation.vector.map(|x| x.lane(lane));
    Pose::from_parts(p.into(), nalgebra::Rotation3::from_matrix_unchecked(R))
}
