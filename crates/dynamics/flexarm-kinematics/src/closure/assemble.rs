//! Assembly of the loops: choice of the assembly mode, and checks of plane and dead points.
//!
//! Start at [`assemble`]. A, C, `X_C` as in `geometry`. Not here: the names in a loop closure
//! (`draft`), the equations (`positions`).

use flexarm_spatial::Pose;
use nalgebra::Vector3;

use crate::axis_motion::AxisMotion;
use crate::closure::draft::bad;
use crate::closure::loop_closure::LoopClosure;
use crate::closure::placed_loop::PlacedLoop;
use crate::closure::workspace::LoopData;
use crate::data::{Data, begin, joint_position};
use crate::mechanism::Mechanism;
use crate::model::{JointMotion, Model, ModelError};

/// Angular tolerance on joint axes being parallel or perpendicular to the pin axis (rad): several times
/// what a calibration of joint frames finds. The closure holds for tilted axes too.
const LOOP_AXIS_TOLERANCE_RAD: f64 = 2e-2;
/// Minimum angle between the two columns of J_d at assembly (rad). Nearer to a dead point, the loop
/// cannot be distinguished from its mirror image.
const DEAD_RAD: f64 = 1e-4;

/// Finds the assembly mode of each loop and checks that the loop is planar, can be closed and is
/// not at a dead point.
///
/// # Errors
/// [`ModelError::BadLoop`].
pub(crate) fn assemble(model: &mut Model, mechanism: &Mechanism) -> Result<(), ModelError> {
    for k in 0..model.loops.len() {
        let closure = mechanism.loops.iter().find(|c| c.name == model.loops[k].name);
        let Some(closure) = closure else { continue };
        let mut q = start_values(model, closure)?;
        let nv = model.nv();
        let wanted = {
            let first = model.loops[k].first;
            [q[first], q[first + 1]]
        };
        // Solves the preceding loops at these values of the driving joints.
        let mut data = Data::new(model);
        let mut solved = LoopData::new(model).solved;
        let later = model.loops.split_off(k + 1);
        let mut own = model.loops.split_off(k);
        solved.positions(model, &mut data, &mut q);
        let mut loop_ = own.remove(0);
        if let Some(open) = solved.open {
            let other = &model.loops[open].name;
            return Err(bad(
                closure,
                format!("loop {other:?}, on which it depends, does not close there: give start values in at"),
            ));
        }
        q[nv + 2 * k..nv + 2 * k + 2].copy_from_slice(&wanted);
        begin(model, &mut data, &q);
        for &i in loop_.chains.iter().flatten() {
            joint_position(model, &mut data, i, &q);
        }
        loop_.place_chains(model, &data, &mut solved.X_C);
        check_plane(&loop_, closure, model, &solved.X_C)?;
        let triangle = loop_.triangle(model, &solved.X_C);
        let size = loop_.gap(&solved.X_C).1;
        // Size of a displacement, with rotations weighted by the size of the loop.
        let far = |turn: &[f64; 2]| {
            let length = |d: usize| if triangle.joints[d].slides { 1.0 } else { size };
            (turn[0] * length(0)).hypot(turn[1] * length(1))
        };
        // Assembly mode: the root closest to the requested values.
        let found = [1.0, -1.0].map(|root| triangle.solve(root).map(|turn| (root, turn)));
        let nearest = found.into_iter().flatten().min_by(|a, b| far(&a.1).total_cmp(&far(&b.1)));
        let Some((root, turn)) = nearest else {
            let gap = loop_.gap(&solved.X_C).0.norm();
            let what = format!(
                "it does not close where its driving joints are at the start: pin and eye are {gap:.6} m apart there and no \
                 values of {:?} and {:?} bring them together; check the two points, or give values in at at which it is assembled",
                closure.dependent[0], closure.dependent[1]
            );
            return Err(bad(closure, what));
        };
        loop_.root = root;
        loop_.start = [wanted[0] + turn[0], wanted[1] + turn[1]];
        loop_.start_miss = turn;
        model.loops.push(loop_);
        model.loops.extend(later);
        check_alive(model, closure, k, &q)?;
    }
    Ok(())
}

/// Tree coordinates near which a loop is assembled.
fn start_values(model: &Model, closure: &LoopClosure) -> Result<Vec<f64>, ModelError> {
    let mut q = vec![0.0; model.nv() + model.dependent().len()];
    for (name, value) in &closure.at {
        let actuated = model.coordinates()[..model.n_actuated()].iter().position(|c| c.joint == *name);
        let dependent = model.dependent().iter().position(|c| c.joint == *name).map(|d| model.nv() + d);
        match actuated.or(dependent) {
            Some(k) => q[k] = *value,
            None => {
                return Err(bad(
                    closure,
                    format!(
                        "at names joint {name:?}, which is neither an independent joint nor one that follows from a loop"
                    ),
                ));
            }
        }
    }
    Ok(q)
}

/// Checks that revolute axes are parallel and sliding axes perpendicular to the pin axis.
fn check_plane(loop_: &PlacedLoop, closure: &LoopClosure, model: &Model, X_C: &[Pose]) -> Result<(), ModelError> {
    let (X_CA, _) = loop_.ends_at(X_C);
    let normal: Vector3<f64> = X_CA.rotation * Vector3::z();
    for &i in loop_.chains.iter().flatten() {
        let body = &model.bodies[i];
        let JointMotion::Axis(motion) = body.motion else { continue };
        if body.elastic {
            continue;
        }
        // Angle by which the axis is off: sliding axes lie in the plane, revolute ones along its
        // normal.
        let axis = X_C[i].rotation * motion.axis();
        let (off, expected) = match motion {
            AxisMotion::Prismatic(_) => (axis.dot(&normal).abs().min(1.0).asin(), "slide across it"),
            AxisMotion::Revolute(_) => (axis.cross(&normal).norm().min(1.0).asin(), "turn about axes along it"),
            AxisMotion::Helical { .. } => {
                let what =
                    format!("joint {:?} in it is helical: a planar loop has joints that turn or slide", body.joint);
                return Err(bad(closure, what));
            }
        };
        if off > LOOP_AXIS_TOLERANCE_RAD {
            let what = format!(
                "the axis of joint {:?} is {:.4} deg off the plane of the loop: across the pin's axis all joints must {expected} \
                 (loops in space are not known)",
                body.joint,
                off.to_degrees()
            );
            return Err(bad(closure, what));
        }
    }
    Ok(())
}

/// Checks that the loop is not assembled at a dead point.
fn check_alive(model: &Model, closure: &LoopClosure, k: usize, q: &[f64]) -> Result<(), ModelError> {
    let mut data = Data::new(model);
    let mut solved = LoopData::new(model).solved;
    let mut q = q.to_vec();
    solved.positions(model, &mut data, &mut q);
    let flattest = {
        let J = [solved.J[k][model.loops[k].first], solved.J[k][model.loops[k].first + 1]];
        (J[0].x * J[1].y - J[0].y * J[1].x).abs().atan2(J[0].dot(&J[1]).abs())
    };
    let dead = solved.open == Some(k) || flattest.is_nan() || flattest < DEAD_RAD;
    if dead {
        let what = format!(
            "it is assembled at a dead point, where its links are collinear and {:?} and {:?} do not follow from the pin: give values in at \
             away from it, or choose other dependent joints",
            closure.dependent[0], closure.dependent[1]
        );
        return Err(bad(closure, what));
    }
    Ok(())
}
