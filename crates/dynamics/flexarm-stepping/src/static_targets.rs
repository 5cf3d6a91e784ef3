//! Joint targets at which the tool of a flexible arm at rest is at the pose of the rigid arm.
//!
//! Newton's method on the displacement of the tool as a function of the motor positions; then servos
//! without an integral get the lead that their gains need. Start at [`static_targets`]. Not here:
//! motions (`flexarm-compensate`).

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, Pose, State, Wrench, forward_kinematics, inverse_dynamics, rotation_vector};
use nalgebra::{DVector, Vector6};

use crate::drive::ServoAxis;
use crate::error::StepError;
use crate::linear::linearise;
use crate::motion::Held;
use crate::plant::{Plant, Servo};

/// Accepted error of the tool pose (m, rad).
const TOLERANCE: f64 = 1e-12;
/// Maximum number of Newton iterations.
const MAX_ITERATIONS: usize = 30;
/// Relative singular value below which the joints cannot move the tool in that direction.
const RANK: f64 = 1e-6;

/// Joint targets for a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct StaticTargets {
    /// Joint targets (rad or m).
    pub q: Vec<f64>,
    /// Displacement of the tool from its desired pose with the original targets: position, then
    /// rotation vector, world axes.
    pub before: Vector6<f64>,
    /// Displacement with the new targets, in the requested components.
    pub after: Vector6<f64>,
    /// Newton iterations.
    pub iterations: usize,
}

/// Reason why no targets were found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// The equilibrium failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A servo has no position gain.
    #[error("the servo of joint {joint:?} holds no position: give it a position_gain and a velocity_gain")]
    NothingHolds {
        /// Name of the joint.
        joint: String,
    },
    /// The joints cannot move the tool there, or the iteration does not converge.
    #[error(
        "after {iterations} iterations the tool is still {left_m:.1e} m and {left_rad:.1e} rad from its place: the arm cannot move it there (singular pose, too few joints)"
    )]
    NotReached {
        /// Number of iterations.
        iterations: usize,
        /// Remaining position error (m).
        left_m: f64,
        /// Remaining rotation error (rad).
        left_rad: f64,
    },
}

/// Computes joint targets with which the tool at rest is where the rigid arm has it at `q`.
///
/// * `q`: positions of the actuated joints (rad or m).
/// * `plant`: its own motion is ignored; the payload is that at time 0.
/// * `F_T_W`: constant wrench on the tool, world axes, as in [`linearise`].
/// * `t`: time (s) at which the arm's loads are evaluated.
/// * `components`: components of position and rotation (world axes) to be matched.
///
/// With fewer components than joints the joints move as little as possible. Motors under servos
/// with an integral reach their commands at rest; those without deviate by the static error of
/// their gains, and the targets are offset by this error.
///
/// # Errors
/// [`TargetError`]; [`StepError::Setup`] for a wrong number of joints.
pub fn static_targets(
    plant: &Plant,
    tool: &Frame,
    q: &[f64],
    F_T_W: &Wrench,
    t: f64,
    components: &[bool; 6],
) -> Result<StaticTargets, TargetError> {
    let joints = plant.model.n_actuated();
    if q.len() != joints {
        let text = format!("{} joint positions are given, the arm has {joints} joints", q.len());
        return Err(StepError::Setup(text).into());
    }
    let (servo, plant) = (&plant.servo, &plant.with_motors_held());
    let wanted = rigid_pose(plant, tool, q);
    let rows: Vec<usize> = (0..6).filter(|k| components[*k]).collect();
    let mut targets = DVector::from_column_slice(q);
    let mut before = None;
    for iterations in 0..=MAX_ITERATIONS {
        // Pose of the tool at rest with the motors at the targets.
        let fixed = plant.along(Arc::new(Held(targets.as_slice().to_vec())));
        let at = linearise(&fixed, tool, F_T_W, t)?;
        let off = displacement(&wanted, &at.X_WT);
        let before = *before.get_or_insert(off);
        let left = DVector::from_iterator(rows.len(), rows.iter().map(|k| off[*k]));
        if left.amax() <= TOLERANCE {
            let after = Vector6::from_fn(|k, _| if components[k] { off[k] } else { 0.0 });
            let mut q = targets.as_slice().to_vec();
            if let Some(servo) = servo {
                lead(servo, &mut q, &at.holding)?;
            }
            return Ok(StaticTargets { q, before, after, iterations });
        }
        // Newton's method: Δq = -G⁺ (what is left), G = d(tool pose)/d(targets); the pseudo-inverse
        // gives the shortest step.
        let G = at.command_slopes().unwrap_or_else(|| at.J_a.clone()).select_rows(&rows);
        if iterations == MAX_ITERATIONS || !G.norm_squared().is_finite() {
            let norm = |range: std::ops::Range<usize>| {
                range.filter(|k| components[*k]).map(|k| off[k].abs()).fold(0.0, f64::max)
            };
            return Err(TargetError::NotReached { iterations, left_m: norm(0..3), left_rad: norm(3..6) });
        }
        let svd = G.svd(true, true);
        let rank = RANK * svd.singular_values.amax();
        let step = svd.solve(&left, rank).unwrap_or_else(|_| DVector::zeros(targets.len()));
        targets -= step;
    }
    unreachable!("the loop returns at its last iteration")
}

/// Offsets the targets of servos without an integral such that their motors hold the torques
/// `holding` at the desired positions.
fn lead(servo: &Servo, q: &mut [f64], holding: &DVector<f64>) -> Result<(), TargetError> {
    let (motors, n) = (q.to_vec(), servo.rigid.nv());
    let sagging = |axis: &&ServoAxis| axis.integral_gain * axis.position_gain == 0.0;
    // Without gain, no offset of the target makes a torque.
    if let Some(axis) = servo.axes.iter().filter(sagging).find(|axis| axis.position_gain * axis.velocity_gain <= 0.0) {
        let joint = servo.rigid.coordinates()[axis.coordinate].joint.clone();
        return Err(TargetError::NothingHolds { joint });
    }
    let (mut data, mut state) = (Data::new(&servo.rigid), State::zeros(&servo.rigid));
    // Fixed-point iteration, since the torque fed forward depends on the target.
    for _ in 0..MAX_ITERATIONS {
        state.q.copy_from_slice(q);
        let fed = inverse_dynamics(&servo.rigid, &mut data, &state, &DVector::zeros(n)).clone();
        let mut moved = 0.0f64;
        for axis in servo.axes.iter().filter(sagging) {
            let k = axis.coordinate;
            let target =
                motors[k] + (holding[k] - axis.feed_forward * fed[k]) / (axis.position_gain * axis.velocity_gain);
            moved = moved.max((target - q[k]).abs());
            q[k] = target;
        }
        if moved <= TOLERANCE {
            return Ok(());
        }
    }
    let (left_m, left_rad) = (f64::INFINITY, f64::INFINITY);
    Err(TargetError::NotReached { iterations: MAX_ITERATIONS, left_m, left_rad })
}

/// Returns the tool pose of the rigid arm, with all elastic coordinates zero.
fn rigid_pose(plant: &Plant, tool: &Frame, q: &[f64]) -> Pose {
    let mut all = DVector::zeros(plant.model.nv());
    all.rows_mut(0, q.len()).copy_from_slice(q);
    let mut data = Data::new(&plant.model);
    forward_kinematics(&plant.model, &mut data, &all);
    data.X_WF(tool)
}

/// Returns the displacement between two poses: position, then rotation vector, world axes.
fn displacement(from: &Pose, to: &Pose) -> Vector6<f64> {
    let p = to.translation.vector - from.translation.vector;
    let r = rotation_vector((to.rotation * from.rotation.inverse()).matrix());
    Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z)
}
