//! Arms of one tree in SIMD lanes: the equations of motion of [`crate::ReducedArm`].
//!
//! The arms share the tree; inertias, stiffness, damping and motion differ. All joints are
//! prescribed, springs are linear, and there are no discrete events.

use flexarm_kinematics::lanes::{LaneTree, inverse_dynamics, mass_matrix_at_poses, rigid_and_flexible};
use flexarm_kinematics::products::sub;
use flexarm_kinematics::{Data, Frame, Real, State};
use nalgebra::Vector3;

use crate::arm::FlexibleArm;
use crate::dense::add_product;
use crate::elastic_tree::ElasticTree;

/// A spring assigned to its coordinates.
struct Element<T> {
    /// Its first coordinate among the elastic ones.
    first: usize,
    size: usize,
    /// Stiffness, size × size.
    K: Vec<T>,
    /// `D = tau K` (s).
    tau: T,
}

/// Arms in lanes, with the workspaces of their equations of motion.
pub(super) struct LaneArm<T: Real> {
    tree: LaneTree<T>,
    data: Data<T>,
    state: State<T>,
    qddot: Vec<T>,
    elements: Vec<Element<T>>,
    /// Damping matrix if not proportional to the stiffness, n × n.
    D: Option<Vec<T>>,
    shifted: Vec<T>,
    /// All coordinates, of which only the elastic ones are used.
    q: Vec<T>,
}

/// Collects one number per arm in lanes.
fn gather<'a, T: Real>(arms: &[&'a FlexibleArm], number: impl Fn(&'a FlexibleArm) -> f64) -> T {
    let mut all = T::zero();
    for (lane, arm) in arms.iter().enumerate() {
        all.set_lane(lane, number(arm));
    }
    all
}

impl<T: Real> LaneArm<T> {
    /// Creates the arms in lanes; `None` if they have different trees or unsupported features.
    pub(super) fn new(arms: &[&FlexibleArm]) -> Option<Self> {
        let first = arms.first()?;
        let plain = |arm: &&FlexibleArm| {
            arm.n_elastic_coordinates() > 0
                && ElasticTree::that_pays(arm).is_none()
                && arm.torque_driven.is_empty()
                && !arm.has_gear_laws()
                && arm.loads.is_empty()
                && arm.model.balancers().is_empty()
                && arm.inertia_changes.is_empty()
                && arm.proportional == first.proportional
                && arm.motion.velocity_jumps().is_empty()
                && arm.elements.iter().all(|element| element.curve.is_none() && element.geometric.is_none())
        };
        if !arms.iter().all(plain) {
            return None;
        }
        let models: Vec<_> = arms.iter().map(|arm| arm.model.clone()).collect();
        let tree = LaneTree::new(&models)?;
        let element = |k: usize| {
            let own = &first.elements[k];
            Element {
                first: first.offset(own),
                size: own.size,
                K: (0..own.size * own.size).map(|i| gather(arms, |arm| arm.elements[k].K[i])).collect(),
                tau: gather(arms, |arm| arm.tau[k]),
            }
        };
        let n = first.n_elastic_coordinates();
        let D = (!first.proportional).then(|| (0..n * n).map(|i| gather(arms, |arm| arm.D[i])).collect());
        let model = tree.model();
        Some(Self {
            data: Data::new(model),
            state: State::zeros(model),
            qddot: vec![T::zero(); model.nv()],
            elements: (0..first.elements.len()).map(element).collect(),
            D,
            shifted: vec![T::zero(); n],
            q: vec![T::zero(); model.nv()],
            tree,
        })
    }

    /// Returns the number of joints, all prescribed; their coordinates come first.
    pub(super) fn joints(&self) -> usize {
        self.tree.model().n_actuated()
    }

    /// Returns the number of elastic coordinates.
    pub(super) fn dimension(&self) -> usize {
        self.tree.model().n_elastic()
    }

    /// Sets the joint motion of one arm.
    pub(super) fn set_joints(&mut self, lane: usize, q: &[f64], qdot: &[f64], qddot: &[f64]) {
        let n = self.joints();
        set_lane(&mut self.state.q.as_mut_slice()[..n], lane, q);
        set_lane(&mut self.state.qdot.as_mut_slice()[..n], lane, qdot);
        set_lane(&mut self.qddot[..n], lane, qddot);
    }

    /// Returns velocities and accelerations of the joints.
    pub(super) fn joint_rates(&self) -> [&[T]; 2] {
        let n = self.joints();
        [&self.state.qdot.as_slice()[..n], &self.qddot[..n]]
    }

    /// Returns the flexible minus the rigid position of a frame (m, world axes), for the joints of
    /// the last residual and elastic coordinates x.
    #[inline(always)]
    pub(super) fn deflection(&mut self, tool: &Frame, x: &[T]) -> Vector3<T> {
        self.q[self.tree.model().n_actuated()..].copy_from_slice(x);
        let [rigid, flexible] = rigid_and_flexible(&self.tree, &self.data, tool, &self.q);
        sub(&flexible, &rigid)
    }

    /// Writes `r(x, v, a)` into `r`. Lanes in which `active` is not 1 keep the elastic state of the
    /// previous call, and their `r` belongs to it.
    #[inline(always)]
    pub(super) fn residual(&mut self, active: T, x: &[T], v: &[T], a: &[T], r: &mut [T]) {
        let n = self.joints();
        set(active, x, &mut self.state.q.as_mut_slice()[n..]);
        set(active, v, &mut self.state.qdot.as_mut_slice()[n..]);
        set(active, a, &mut self.qddot[n..]);
        inverse_dynamics(&self.tree, &mut self.data, &self.state, &self.qddot);
        r.copy_from_slice(&self.data.tau.as_slice()[n..]);
        let (x, v) = (&self.state.q.as_slice()[n..], &self.state.qdot.as_slice()[n..]);
        for element in &self.elements {
            let range = element.first..element.first + element.size;
            let (x, v, r) = (&x[range.clone()], &v[range.clone()], &mut r[range]);
            let y = &mut self.shifted[..element.size];
            match self.D.is_none() {
                true => {
                    for ((y, x), v) in y.iter_mut().zip(x).zip(v) {
                        *y = *x + element.tau * *v;
                    }
                }
                false => y.copy_from_slice(x),
            }
            add_product(&element.K, y, r);
        }
        if let Some(D) = &self.D {
            add_product(D, v, r);
        }
    }

    /// Computes the mass matrix at the configuration of the last residual.
    #[inline(always)]
    pub(super) fn mass(&mut self, M: &mut [T]) {
        mass_matrix_at_poses(&self.tree, &mut self.data);
        let (n, joints) = (self.dimension(), self.joints());
        for (column, to) in M.chunks_exact_mut(n).enumerate() {
            to.copy_from_slice(&self.data.M.as_slice()[(joints + column) * (joints + n) + joints..][..n]);
        }
    }
}

/// Copies numbers into one lane.
#[inline(always)]
pub(super) fn set_lane<T: Real>(to: &mut [T], lane: usize, from: &[f64]) {
    for (to, from) in T::flat_mut(to).chunks_exact_mut(T::LANES).zip(from) {
        to[lane] = *from;
    }
}

/// Copies `from` to `to` in the lanes in which `active` is 1.
#[inline(always)]
fn set<T: Real>(active: T, from: &[T], to: &mut [T]) {
    let half = T::splat(0.5);
    for (to, from) in to.iter_mut().zip(from) {
        *to = active.pick_below(half, *to, *from);
    }
}
