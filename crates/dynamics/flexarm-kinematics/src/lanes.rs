//! Recursions over several runs or poses of one tree at once, in the lanes of a SIMD scalar type.
//!
//! Poses, velocities and inertias differ between lanes; bodies, joints and mode shapes are those of
//! one [`Model`](crate::Model). Every lane gives bitwise the result of the `f64` function of the
//! same name. Functions are inlined into their callers, so that the SIMD instructions are available
//! ([`flexarm_spatial::lanes::with_lanes`]).

use flexarm_spatial::products::{add, lift, lift3, mul};
use flexarm_spatial::{ElasticAngles, Real};
use nalgebra::{Matrix3, Vector3};

use crate::crba::composite_bodies;
use crate::data::{Data, State};
use crate::kinematics::{place_bodies, tree_jacobian};
use crate::model::{Frame, JointMotion};
use crate::rnea::{at_rest, newton_euler};
use crate::static_tangent::{PointLoad, StaticTangent};

pub use crate::tree::{LaneTree, Tree};

/// [`crate::inverse_dynamics`] without balancers; the generalised forces are in `data.tau`.
#[inline(always)]
pub fn inverse_dynamics<T: Real>(tree: &LaneTree<T>, data: &mut Data<T>, state: &State<T>, qddot: &[T]) {
    newton_euler(tree, data, state.q.as_slice(), state.qdot.as_slice(), Some(qddot));
}

/// [`crate::mass_matrix_at_poses`]; the mass matrix is in `data.M`.
#[inline(always)]
pub fn mass_matrix_at_poses<T: Real>(tree: &LaneTree<T>, data: &mut Data<T>) {
    composite_bodies(tree, data);
}

/// [`crate::forward_kinematics`]; the poses are in `data.X_WB`.
#[inline(always)]
pub fn forward_kinematics<T: Real>(tree: &LaneTree<T>, data: &mut Data<T>, q: &[T]) {
    place_bodies(&tree.model, data, q);
}

/// [`crate::gravity_forces_at_poses`] without balancers; the generalised forces are in `data.tau`.
#[inline(always)]
pub fn gravity_forces_at_poses<T: Real>(tree: &LaneTree<T>, data: &mut Data<T>) {
    at_rest(tree, data);
}

/// [`crate::frame_jacobian`], column by column in `J` (6×nv).
#[inline(always)]
pub fn frame_jacobian<T: Real>(tree: &LaneTree<T>, data: &Data<T>, frame: &Frame, J: &mut [T]) {
    tree_jacobian(
        &tree.model,
        data,
        frame,
        J,
        #[inline(always)]
        |_, _, _| (),
    );
}

/// [`StaticTangent::compute`] without balancers, under one load, column by column in `G`.
#[inline(always)]
pub fn static_tangent<T: Real>(
    tangent: &mut StaticTangent<T>,
    tree: &LaneTree<T>,
    data: &Data<T>,
    q: &[T],
    load: PointLoad,
    G: &mut [T],
) {
    tangent.of_bodies(tree, data, q, std::iter::once(load), G);
}

/// World positions of a frame origin (m): with all elastic coordinates at zero, and at `q`.
///
/// Uses the joint poses left in `data` by the last algorithm at the same joint coordinates; the
/// elastic coordinates may differ.
#[inline(always)]
pub fn rigid_and_flexible<T: Real>(tree: &LaneTree<T>, data: &Data<T>, frame: &Frame, q: &[T]) -> [Vector3<T>; 2] {
    let model = tree.model();
    let pose = |i: usize| (data.X_PB[i].rotation.matrix(), &data.X_PB[i].translation.vector);
    let mut rigid = lift(&frame.X_BF.translation.vector);
    let mut i = frame.body;
    // Outward of all springs both positions are equal.
    while i > 0 {
        let body = &model.bodies[i];
        if body.elastic || !matches!(body.motion, JointMotion::Axis(_) | JointMotion::Welded) {
            break;
        }
        rigid = carried(pose(i), &rigid);
        i = body.parent;
    }
    let mut flexible = rigid;
    while i > 0 {
        let body = &model.bodies[i];
        let elastic = match body.motion {
            // Single-DoF spring.
            JointMotion::Axis(motion) if body.elastic => {
                let [still, moved] = [body.along_axis(motion, T::zero()), body.along_axis(motion, q[body.coordinate])];
                rigid = carried((still.rotation.matrix(), &still.translation.vector), &rigid);
                flexible = carried((moved.rotation.matrix(), &moved.translation.vector), &flexible);
                i = body.parent;
                continue;
            }
            JointMotion::Axis(_) | JointMotion::Welded => {
                rigid = carried(pose(i), &rigid);
                flexible = carried(pose(i), &flexible);
                i = body.parent;
                continue;
            }
            JointMotion::Elastic(angles) => {
                let own = &q[body.coordinate..body.coordinate + 6];
                let (R, _) = angles.pose(&Vector3::new(own[3], own[4], own[5]));
                add(&mul(&R, &flexible), &Vector3::new(own[0], own[1], own[2]))
            }
            JointMotion::Interface { modal, interface } => {
                let modal = &model.modal[modal];
                let shape = &modal.tables.shapes.interfaces[interface];
                let (d, phi) = shape.times(&q[body.coordinate..body.coordinate + modal.n]);
                let (R, _) = ElasticAngles::RotationVector.pose(&phi);
                add(&mul(&R, &flexible), &d)
            }
        };
        // The joint frame in the parent is common to both.
        let (R_PJ, p_PJ) = (lift3(body.X_PJ.rotation.matrix()), lift(&body.X_PJ.translation.vector));
        rigid = carried((&R_PJ, &p_PJ), &rigid);
        flexible = carried((&R_PJ, &p_PJ), &elastic);
        i = body.parent;
    }
    [rigid, flexible]
}

/// Transforms a point from B to P.
#[inline(always)]
fn carried<T: Real>((R_PB, p_PB): (&Matrix3<T>, &Vector3<T>), p: &Vector3<T>) -> Vector3<T> {
    add(p_PB, &mul(R_PB, p))
}
