//! Forward kinematics, geometric Jacobian and its time derivative.
//!
//! Frames: W world, B a body, T any frame fixed to a body (usually the tool). `J_WT_W` maps `q̇` to
//! the twist of T: velocity of the point To and angular velocity, both in **world axes** (rows
//! linear first). Start at [`forward_kinematics`] and [`frame_jacobian`]. Not here: the motion of
//! one joint (`data`), closed loops (`closure`).

use flexarm_spatial::products::{add, column, cross, lift, mul, mul3, scaled, sub};
use flexarm_spatial::{ElasticAngles, Real, Twist};
use nalgebra::{DVector, Matrix3, Matrix6xX, Vector3};

use crate::axis_motion::AxisMotion;
use crate::balancer::measure;
use crate::closure;
use crate::data::{Data, State, begin, joint_motion, joint_position, rotor_energy};
use crate::model::{Frame, JointMotion, Model};
use crate::pose::identity;

/// Computes the poses of all bodies at coordinates `q` (nv, rad or m); fills `data.{X_PB, X_WB}`
/// and the lengths of the balancers. O(n), no allocation.
///
/// # Panics
/// If `q` is not nv long, or `data` is of another model.
pub fn forward_kinematics(model: &Model, data: &mut Data, q: &DVector<f64>) {
    model.check_size("q", q.len());
    data.check_sizes(model);
    match model.loops.is_empty() {
        true => place_and_measure(model, data, q.as_slice()),
        false => closure::place(model, data, q.as_slice()),
    }
}

/// [`forward_kinematics`] of the tree, with balancer lengths.
pub(crate) fn place_and_measure(model: &Model, data: &mut Data, q: &[f64]) {
    place_bodies(model, data, q);
    measure(model, data, q);
}

/// [`forward_kinematics`] for any scalar type.
#[inline(always)]
pub(crate) fn place_bodies<T: Real>(model: &Model, data: &mut Data<T>, q: &[T]) {
    begin(model, data, q);
    for i in 1..model.bodies.len() {
        joint_position(model, data, i, q);
    }
    world_poses(model, data);
}

/// Computes poses and twists `V_WB_B` of all bodies; fills `data.{X_PB, X_WB, V}` and the lengths of
/// the balancers. O(n), no allocation.
///
/// # Panics
/// If a vector is not nv long, or `data` is of another model.
pub fn forward_kinematics_velocity(model: &Model, data: &mut Data, state: &State) {
    state.check_sizes(model);
    data.check_sizes(model);
    match model.loops.is_empty() {
        true => move_bodies(model, data, state.q.as_slice(), state.qdot.as_slice()),
        false => closure::move_bodies(model, data, state),
    }
}

/// [`forward_kinematics_velocity`] of the tree, with balancer lengths.
pub(crate) fn move_bodies(model: &Model, data: &mut Data, q: &[f64], qdot: &[f64]) {
    data.V[0] = Twist::zeros();
    data.rotor_energy = rotor_energy(model, qdot);
    begin(model, data, q);
    for (modal, entry) in data.modal.iter_mut().zip(&model.modal) {
        modal.rates.copy_from_slice(&qdot[entry.coordinate..entry.coordinate + entry.n]);
    }
    for i in 1..model.bodies.len() {
        let (V_PB, bias) = joint_motion(model, data, i, q, qdot);
        data.bias[i] = bias;
        data.V[i] = data.V[model.bodies[i].parent].at_child(&data.X_PB[i]) + V_PB;
    }
    world_poses(model, data);
    measure(model, data, q);
}

/// Computes world poses from the joint poses left in `data.X_PB` by the last algorithm; fills
/// `data.X_WB`: `X_WB = X_WP X_PB`, from the base outward.
#[inline(always)]
pub fn world_poses<T: Real>(model: &Model, data: &mut Data<T>) {
    data.X_WB[0] = identity();
    for i in 1..model.bodies.len() {
        let (inward, outward) = data.X_WB.split_at_mut(i);
        let (X_WP, X_PB, X_WB) = (&inward[model.bodies[i].parent], &data.X_PB[i], &mut outward[0]);
        let R_WP = X_WP.rotation.matrix();
        *X_WB.rotation.matrix_mut_unchecked() = mul3(R_WP, X_PB.rotation.matrix());
        X_WB.translation.vector = add(&X_WP.translation.vector, &mul(R_WP, &X_PB.translation.vector));
    }
}

/// Returns `V_WF_W`, the twist of a frame F at its origin in world axes, from the last
/// [`forward_kinematics_velocity`].
pub fn frame_twist(data: &Data, frame: &Frame) -> Twist {
    let V = data.V[frame.body].at_child(&frame.X_BF);
    let R = data.X_WB[frame.body].rotation * frame.X_BF.rotation;
    Twist::new(R * V.linear, R * V.angular)
}

/// Writes the Jacobian `J_WT_W`, 6×nv, of a frame T into `J`, from the last [`forward_kinematics`].
///
/// ```text
/// V_WT_W = J q̇,    column of a joint B inward of T: [ l + a × p_BoTo ; a ],  [ l; a ] = R_WB S_B
/// ```
/// Columns of coordinates that do not move T are zero. Cost: one pass from T to the base.
///
/// # Panics
/// If `J` does not have nv columns.
///
/// # Source
/// [Featherstone 2008], section 4.7, with the velocity of the point To instead of that of the point
/// at the world origin.
pub fn frame_jacobian(model: &Model, data: &Data, frame: &Frame, J: &mut Matrix6xX<f64>) {
    assert_eq!(J.ncols(), model.nv(), "the Jacobian needs one column per coordinate");
    tree_jacobian(model, data, frame, J.as_mut_slice(), |k, column, J| {
        let loops = data.loops.iter();
        loops.for_each(|loops| loops.each_leader(k, &mut |k, factor| add_column(column, factor, &mut J[6 * k..])));
    });
}

/// [`frame_jacobian`] for any scalar type; `J` is 6×nv, column by column. Columns of dependent
/// coordinates of closed loops, from nv on, are passed to `beyond`.
#[inline(always)]
pub(crate) fn tree_jacobian<T: Real>(
    model: &Model,
    data: &Data<T>,
    frame: &Frame,
    J: &mut [T],
    mut beyond: impl FnMut(usize, &Twist<T>, &mut [T]),
) {
    J.fill(T::zero());
    let p_T = data.X_WF(frame).translation.vector;
    let mut i = frame.body;
    // From the frame to the base: column of each joint moved from Bo to To, v_To = v_Bo + w × r.
    while i > 0 {
        let X_WB = &data.X_WB[i];
        let r = sub(&p_T, &X_WB.translation.vector);
        joint_columns(
            model,
            data,
            i,
            X_WB.rotation.matrix(),
            #[inline(always)]
            |k, linear, angular| {
                let column = Twist::new(add(&linear, &cross(&angular, &r)), angular);
                match k < model.nv() {
                    true => add_column(&column, T::one(), &mut J[6 * k..]),
                    false => beyond(k, &column, J),
                }
            },
        );
        i = model.bodies[i].parent;
    }
}

/// Adds a multiple of a twist to the first six entries.
#[inline(always)]
fn add_column<T: Real>(column: &Twist<T>, factor: T, to: &mut [T]) {
    let (l, a) = (&column.linear, &column.angular);
    for (to, x) in to.iter_mut().zip([l.x, l.y, l.z, a.x, a.y, a.z]) {
        *to += factor * x;
    }
}

/// Passes each motion subspace column of the joint of body i to `add`: tree coordinate, linear and
/// angular part, at Bo, in the axes to which R rotates those of B.
#[inline(always)]
pub(crate) fn joint_columns<T: Real>(
    model: &Model,
    data: &Data<T>,
    i: usize,
    R: &Matrix3<T>,
    mut add: impl FnMut(usize, Vector3<T>, Vector3<T>),
) {
    let body = &model.bodies[i];
    match body.motion {
        JointMotion::Axis(motion) => {
            let column = turned(motion, R, body.ratio);
            add(body.coordinate, column.linear, column.angular);
        }
        JointMotion::Welded => {}
        JointMotion::Elastic(_) => {
            let S = &data.elastic[i];
            // Translations move Bo only, as the frame turns about it; rotations act on the angular
            // part only.
            let (L, B) = (mul3(R, &S.L), mul3(R, &S.B));
            for c in 0..3 {
                add(body.coordinate + c, column(&L, c), Vector3::zeros());
                add(body.coordinate + 3 + c, Vector3::zeros(), column(&B, c));
            }
        }
        JointMotion::Interface { modal, interface } => {
            // One column per mode that moves the interface.
            let (S, modal) = (&data.elastic[i], &model.modal[modal]);
            for c in 0..modal.n {
                let column = modal.tables.shapes.interfaces[interface].twist(c, &S.L, &S.B);
                add(body.coordinate + c, mul(R, &column.linear), mul(R, &column.angular));
            }
        }
    }
}

/// `R_WB S` times the ratio of a mimic joint: column of the Jacobian at Bo, in W axes.
#[inline(always)]
pub(crate) fn turned<T: Real>(motion: AxisMotion, R_WB: &Matrix3<T>, ratio: f64) -> Twist<T> {
    let ratio = T::splat(ratio);
    motion.linear(
        #[inline(always)]
        |axis| Twist::new(Vector3::zeros(), scaled(&mul(R_WB, &lift(&axis)), ratio)),
        #[inline(always)]
        |axis| Twist::new(scaled(&mul(R_WB, &lift(&axis)), ratio), Vector3::zeros()),
    )
}

/// Writes `J̇ = dJ_WT_W/dt`, 6×nv, into `Jdot`, from the last [`forward_kinematics_velocity`] at
/// `state`.
///
/// `A_WT_W = J q̈ + J̇ q̇` is the acceleration of the point To and the angular acceleration, in world
/// axes.
///
/// # Panics
/// If `Jdot` does not have nv columns, or a vector is not nv long.
pub fn frame_jacobian_derivative(model: &Model, data: &Data, state: &State, frame: &Frame, Jdot: &mut Matrix6xX<f64>) {
    state.check_sizes(model);
    assert_eq!(Jdot.ncols(), model.nv(), "the Jacobian needs one column per coordinate");
    Jdot.fill(0.0);
    let p_T = (data.X_WB[frame.body] * frame.X_BF).translation.vector;
    let v_T = frame_twist(data, frame).linear;
    let mut i = frame.body;
    // Derivative of the columns l + a × r: l' + a' × r + a × r'.
    while i > 0 {
        let R = data.X_WB[i].rotation.matrix();
        let (v_B, w_B) = (R * data.V[i].linear, R * data.V[i].angular);
        let (r, rdot) = (p_T - data.X_WB[i].translation.vector, v_T - v_B);
        let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
        joint_column_rates(model, data, i, R, &w_B, q, qdot, |k, [l, a, ldot, adot]| {
            let rate = ldot + adot.cross(&r) + a.cross(&rdot);
            if k < model.nv() {
                for c in 0..3 {
                    Jdot[(c, k)] += rate[c];
                    Jdot[(3 + c, k)] += adot[c];
                }
            } else if let Some(loops) = &data.loops {
                // (J_k T)' = J_k' T + J_k T'
                let column = l + a.cross(&r);
                loops.each_leader_rate(k, |k, factor, its_rate| {
                    for c in 0..3 {
                        Jdot[(c, k)] += factor * rate[c] + its_rate * column[c];
                        Jdot[(3 + c, k)] += factor * adot[c] + its_rate * a[c];
                    }
                });
            }
        });
        i = model.bodies[i].parent;
    }
}

/// As [`joint_columns`], with the rates of the columns: `[l, a, l', a']`. `w_B` is the angular
/// velocity of the body in the axes of the columns; `q` and `qdot` are those of the tree.
#[allow(clippy::too_many_arguments, reason = "of two callers, each with other axes")]
pub(crate) fn joint_column_rates(
    model: &Model,
    data: &Data,
    i: usize,
    R: &Matrix3<f64>,
    w_B: &Vector3<f64>,
    q: &[f64],
    qdot: &[f64],
    mut add: impl FnMut(usize, [Vector3<f64>; 4]),
) {
    // Columns fixed in B axes rotate with B, those fixed in P axes with P.
    let (body, zero) = (&model.bodies[i], Vector3::zeros());
    match body.motion {
        JointMotion::Axis(motion) => {
            let Twist { linear: l, angular: a } = turned(motion, R, body.ratio);
            add(body.coordinate, [l, a, w_B.cross(&l), w_B.cross(&a)]);
        }
        JointMotion::Welded => {}
        JointMotion::Elastic(angles) => {
            let k = body.coordinate;
            let S = &data.elastic[i];
            let phi = Vector3::new(q[k + 3], q[k + 4], q[k + 5]);
            let rates = Vector3::new(qdot[k + 3], qdot[k + 4], qdot[k + 5]);
            let Bdot = angles.rate_map_derivative(&phi, &rates);
            // Translation columns are fixed in P and rotate with it, w_P = w_B - R B rates.
            let w_P = w_B - R * (S.B * rates);
            let (L, B) = (R * S.L, R * S.B);
            let Bdot_W = R * Bdot;
            for c in 0..3 {
                let l: Vector3<f64> = L.column(c).into();
                add(k + c, [l, zero, w_P.cross(&l), zero]);
                let a: Vector3<f64> = B.column(c).into();
                add(k + 3 + c, [zero, a, zero, w_B.cross(&a) + Bdot_W.column(c)]);
            }
        }
        JointMotion::Interface { modal, interface } => {
            let (S, modal) = (&data.elastic[i], &model.modal[modal]);
            let shape = &modal.tables.shapes.interfaces[interface];
            let range = body.coordinate..body.coordinate + modal.n;
            let (_, phi) = shape.times(&q[range.clone()]);
            let (_, rates) = shape.times(&qdot[range]);
            let Bdot = ElasticAngles::RotationVector.rate_map_derivative(&phi, &rates);
            let w_P = w_B - R * (S.B * rates);
            for c in 0..modal.n {
                let column = shape.twist(c, &S.L, &S.B);
                let (l, a) = (R * column.linear, R * column.angular);
                let turned = R * shape.twist(c, &S.L, &Bdot).angular;
                // Linear and angular part of the column belong to the same coordinate.
                add(body.coordinate + c, [l, a, w_P.cross(&l), w_B.cross(&a) + turned]);
            }
        }
    }
}
