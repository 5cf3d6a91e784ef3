//! Numerical inverse kinematics: damped least squares with joint limits.
//!
//! Levenberg-Marquardt on the pose error `[p_target - p; log(R_target Rᵀ)]` in world axes, with
//! steps clamped to the joint limits. Joints at a limit that the step would push further out are
//! excluded from it. Elastic coordinates keep their start values.
//!
//! Source: [Nakamura & Hanafusa 1986], [Wampler 1986]; damping update as in [Marquardt 1963].
//!
//! Not here: closed forms (`analytic_ik`), all solutions (`many_starts.rs`), redundant arms
//! (`redundancy.rs`).

use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{DMatrix, DVector, Matrix6xX, Vector6};

use crate::data::Data;
use crate::kinematics::{forward_kinematics, frame_jacobian};
use crate::model::{Frame, Model};

/// Tolerances and limits of the iteration.
#[derive(Clone, Copy, Debug)]
pub struct IkOptions {
    /// Position tolerance (m).
    pub position_tolerance_m: f64,
    /// Rotation tolerance (rad).
    pub rotation_tolerance_rad: f64,
    /// Maximum number of iterations.
    pub max_iterations: usize,
    /// Length by which rotations are weighted against translations in the damped step (m).
    pub characteristic_length_m: f64,
}

impl Default for IkOptions {
    fn default() -> Self {
        Self {
            position_tolerance_m: 1e-10,
            rotation_tolerance_rad: 1e-10,
            max_iterations: 300,
            characteristic_length_m: 0.5,
        }
    }
}

/// Error: no joint values were found.
#[derive(Debug, Clone, thiserror::Error)]
#[error(
    "inverse kinematics of frame {frame:?} stopped after {iterations} iterations {position_m:.3e} m and \
     {rotation_rad:.3e} rad from the target{}: is it out of reach or near a singular pose?",
    if at_limit.is_empty() { String::new() } else { format!(" with {at_limit:?} at their limits") }
)]
pub struct IkError {
    /// Frame that should reach the target.
    pub frame: String,
    /// Number of iterations done.
    pub iterations: usize,
    /// Remaining position error (m).
    pub position_m: f64,
    /// Remaining rotation error (rad).
    pub rotation_rad: f64,
    /// Joints at a limit.
    pub at_limit: Vec<String>,
}

/// Finds joint values, nv long, that bring `frame` to `X_WT`, starting from `q_start` (nv long; rad
/// or m).
///
/// # Errors
/// [`IkError`] if the target is not reached within tolerance.
///
/// # Panics
/// If `q_start` is not nv long.
pub fn inverse_kinematics(
    model: &Model,
    data: &mut Data,
    frame: &Frame,
    X_WT: &Pose,
    q_start: &DVector<f64>,
    options: &IkOptions,
) -> Result<DVector<f64>, IkError> {
    model.check_size("q_start", q_start.len());
    let n = model.n_actuated();
    let limits: Vec<(f64, f64)> = model.coordinates()[..n].iter().map(|c| (c.limits.lower, c.limits.upper)).collect();
    let mut q = q_start.clone();
    clamp(&mut q, &limits);
    let mut J = Matrix6xX::zeros(model.nv());
    let mut error = pose_error(model, data, frame, X_WT, &q);
    let mut damping = 1e-4;
    let length = options.characteristic_length_m;
    let weigh = |e: &Vector6<f64>| Vector6::from_fn(|i, _| if i < 3 { e[i] } else { e[i] * length });

    for iteration in 0..options.max_iterations {
        // Done: position and rotation are within their tolerances.
        let (position_m, rotation_rad) = sizes(&error);
        if position_m <= options.position_tolerance_m && rotation_rad <= options.rotation_tolerance_rad {
            return Ok(q);
        }
        // Rows of rotation times the characteristic length, so that all errors are lengths (m).
        frame_jacobian(model, data, frame, &mut J);
        let mut Jw = DMatrix::from_fn(6, n, |r, c| if r < 3 { J[(r, c)] } else { J[(r, c)] * length });
        let e = weigh(&error);
        fix_at_limits(&mut Jw, &e, &q, &limits);
        // Increase the damping until a step reduces the error.
        let scale = Jw.norm_squared().max(1e-12);
        let mut improved = false;
        for _ in 0..25 {
            // Levenberg-Marquardt step: (Jᵀ J + λ 1) Δq = Jᵀ e.
            let A = Jw.tr_mul(&Jw) + DMatrix::identity(n, n) * (damping * scale);
            let Some(factor) = A.cholesky() else { break };
            let step = factor.solve(&Jw.tr_mul(&e));
            let mut trial = q.clone();
            trial.rows_mut(0, n).zip_apply(&step, |x, s| *x += s.clamp(-0.5, 0.5));
            clamp(&mut trial, &limits);
            let trial_error = pose_error(model, data, frame, X_WT, &trial);
            if weigh(&trial_error).norm() < e.norm() {
                (q, error) = (trial, trial_error);
                damping = (damping * 0.1).max(1e-14);
                improved = true;
                break;
            }
            damping = (damping * 10.0).max(1e-14);
        }
        if !improved {
            return Err(failure(model, frame, iteration + 1, &error, &q));
        }
    }
    Err(failure(model, frame, options.max_iterations, &error, &q))
}

/// Moves coordinates beyond their limits to the limits.
fn clamp(q: &mut DVector<f64>, limits: &[(f64, f64)]) {
    for (k, (lower, upper)) in limits.iter().enumerate() {
        q[k] = q[k].max(*lower).min(*upper);
    }
}

/// Zeroes the columns of joints at a limit that the gradient of the error pushes outward.
fn fix_at_limits(Jw: &mut DMatrix<f64>, e: &Vector6<f64>, q: &DVector<f64>, limits: &[(f64, f64)]) {
    let gradient = Jw.tr_mul(e);
    for (k, (lower, upper)) in limits.iter().enumerate() {
        let is_fixed = (q[k] <= *lower && gradient[k] < 0.0) || (q[k] >= *upper && gradient[k] > 0.0);
        if is_fixed {
            Jw.column_mut(k).fill(0.0);
        }
    }
}

fn pose_error(model: &Model, data: &mut Data, frame: &Frame, X_WT: &Pose, q: &DVector<f64>) -> Vector6<f64> {
    forward_kinematics(model, data, q);
    let X = data.X_WF(frame);
    let p = X_WT.translation.vector - X.translation.vector;
    let r = rotation_vector((X_WT.rotation * X.rotation.inverse()).matrix());
    Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z)
}

fn sizes(e: &Vector6<f64>) -> (f64, f64) {
    (e.fixed_rows::<3>(0).norm(), e.fixed_rows::<3>(3).norm())
}

fn failure(model: &Model, frame: &Frame, iterations: usize, error: &Vector6<f64>, q: &DVector<f64>) -> IkError {
    let (position_m, rotation_rad) = sizes(error);
    let at_limit = model.coordinates()[..model.n_actuated()]
        .iter()
        .enumerate()
        .filter(|(k, c)| q[*k] <= c.limits.lower || q[*k] >= c.limits.upper)
        .map(|(_, c)| c.joint.clone())
        .collect();
    IkError { frame: frame.name.clone(), iterations, position_m, rotation_rad, at_limit }
}
