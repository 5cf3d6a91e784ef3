//! Compliance of arm and tool at the cutter at one pose: poles in the axes of the cut.
//!
//! Start at [`CutPose::at`] and [`CutPose::along`]. Frames: W world, T TCP, C cut, whose x is along
//! the feed and z from the tip to the spindle. Not here: stability ([`crate::milling`]).

use std::f64::consts::TAU;

use crate::milling::{Mode, Structure};
use flexarm_kinematics::{Data, forward_kinematics};
use flexarm_stepping::Linear;
use nalgebra::{DVector, Matrix3, Matrix3xX, Vector3, Vector6};

use super::LobesError;
use super::tool_file::{CuttingTool, ToolDirection};
use flexarm_run::posed::Posed;
use flexarm_run::response::pose_in_words;
use flexarm_run::{Error, Finding, Modelling, Motion, Robot, TCP_FRAME};

/// Minimum number of poses along a motion.
const MIN_PLACES: usize = 2;
/// Speed below which the tool counts as at rest (m/s).
pub(super) const STANDS: f64 = 1e-5;
/// Sine of the angle to the tool's axis below which a feed counts as parallel to it.
const ALONG_AXIS: f64 = 0.05;
/// Time difference for the direction of the feed (s).
const INSTANT: f64 = 1e-4;
/// Maximum number of reported natural frequencies.
const MAX_FREQUENCIES: usize = 6;

/// Tip of a tool at an instant of a motion.
pub(super) struct TipMotion {
    t: f64,
    q: Vec<f64>,
    /// Velocity (m/s) and direction from the spindle to the tip, world axes.
    pub(super) velocity: Vector3<f64>,
    axis: Vector3<f64>,
}

/// Returns the tip of a tool on the rigid robot at the middles of `n` equal parts of a motion.
pub(super) fn tip_motion(
    robot: &Robot,
    tool: &CuttingTool,
    motion: &Motion,
    n: usize,
) -> Result<Vec<TipMotion>, Error> {
    // The rigid arm at the middle of each part, and the tip shortly before and after.
    let model = robot.rigid_model()?;
    let names: Vec<&str> = model.coordinates().iter().map(|c| c.joint.as_str()).collect();
    let trajectory = motion.trajectory.with_joint_order(&names)?;
    let frame = model.frame(TCP_FRAME).expect("the TCP of the model").clone();
    let mut data = Data::new(&model);
    let sample = |t: f64| {
        let mut q = vec![0.0; names.len()];
        let (mut qdot, mut qddot) = (q.clone(), q.clone());
        trajectory.sample(t, &mut q, &mut qdot, &mut qddot);
        q
    };
    let mut tip = |t: f64| {
        forward_kinematics(&model, &mut data, &DVector::from_vec(sample(t)));
        let X_WT = data.X_WF(&frame);
        (X_WT.transform_point(&tool.tip.into()).coords, tool.axis.in_world(&X_WT.rotation))
    };
    let part = trajectory.duration() / n as f64;
    let instant = |k: usize| {
        let t = part * (k as f64 + 0.5);
        let ((before, _), (after, axis)) = (tip(t - INSTANT), tip(t + INSTANT));
        TipMotion { t, q: sample(t), velocity: (after - before) / (2.0 * INSTANT), axis }
    };
    Ok((0..n).map(instant).collect())
}

/// One pose with the axes of the cut: x along the feed, z from the tip to the spindle.
pub(super) struct CutPose {
    posed: Posed,
    linear: Linear,
    pub(super) time_s: Option<f64>,
    /// Direction of the feed, world axes.
    pub(super) feed: Vector3<f64>,
    /// Direction from the spindle to the tip, world axes.
    pub(super) axis: Vector3<f64>,
    /// Arm and modes of the tool, in the axes of the cut.
    pub(super) structure: Structure,
}

impl CutPose {
    /// Returns the place at a pose.
    pub(super) fn at(
        robot: &Robot,
        modelling: &Modelling,
        tool: &CuttingTool,
        at: Option<&[f64]>,
    ) -> Result<Self, Error> {
        Self::new(robot.model(modelling)?.posed(at)?, tool, None, None)
    }

    /// Returns places along a motion, at equal intervals of time, where the tool moves across its
    /// axis, and the number of intervals without a place.
    pub(super) fn along(
        robot: &Robot,
        modelling: &Modelling,
        tool: &CuttingTool,
        motion: &Motion,
        n: usize,
    ) -> Result<(Vec<Self>, usize), Error> {
        if n < MIN_PLACES {
            return Err(LobesError::Input(format!("{n} poses along the motion: expected at least {MIN_PLACES}")).into());
        }
        let arm = robot.model(modelling)?;
        let (mut places, mut left_out) = (Vec::new(), 0);
        // The feed has no direction where the tool stands or moves along its axis.
        for TipMotion { t, q, velocity, axis } in tip_motion(robot, tool, motion, n)? {
            let across = velocity.cross(&axis).norm();
            if velocity.norm() < STANDS || across < ALONG_AXIS * velocity.norm() {
                left_out += 1;
                continue;
            }
            let posed = Posed::new(arm.clone(), q)?;
            places.push(Self::new(posed, tool, Some(t), Some(velocity / velocity.norm()))?);
        }
        if places.is_empty() {
            let mend = "set the feed direction (feed = [...] in [tool])";
            let text = format!("the motion never moves the tool across its axis: {mend}");
            return Err(LobesError::Input(text).into());
        }
        Ok((places, left_out))
    }

    /// Linearises the arm at a pose, and turns arm and tool into the axes of the cut.
    ///
    /// * `along`: direction of the motion, if there is one; the feed of the tool replaces it.
    fn new(posed: Posed, tool: &CuttingTool, time_s: Option<f64>, along: Option<Vector3<f64>>) -> Result<Self, Error> {
        let linear = posed.linear(&Vector6::zeros())?;
        let R_WT = linear.X_WT.rotation;
        let axis = tool.axis.in_world(&R_WT);
        let feed = match (tool.feed, along) {
            (Some(feed), _) => feed.in_world(&R_WT),
            (None, Some(along)) => along,
            // Arbitrary direction across the tool: the x axis of the TCP, or y if x is near the
            // tool's axis.
            (None, None) if (R_WT.inverse() * axis).x.abs() < 0.9 => R_WT * Vector3::x(),
            (None, None) => R_WT * Vector3::y(),
        };
        let R_WC = cutting_axes(&feed, &axis)?;
        let structure = structure(&linear, tool, R_WC.transpose(), &R_WT.into_inner()).map_err(|source| {
            LobesError::Chatter { place: pose_in_words(&posed.joints, &posed.at, &posed.prismatic), source }
        })?;
        if structure.poles().is_empty() {
            let what = "the robot has no flexible link and no elastic drive, and the tool has no mode";
            return Err(LobesError::Input(format!("nothing is elastic: {what}")).into());
        }
        Ok(Self { feed: R_WC.column(0).into(), axis, structure, time_s, posed, linear })
    }

    /// Returns the lowest natural frequencies of arm and tool (Hz).
    pub(super) fn frequencies_hz(&self) -> Vec<f64> {
        let oscillate = self.structure.poles().iter().filter(|p| p.value.im > 0.0);
        let mut hz: Vec<f64> = oscillate.map(|p| p.value.norm() / TAU).collect();
        hz.sort_by(f64::total_cmp);
        hz.truncate(MAX_FREQUENCIES);
        hz
    }

    /// Returns the description of the pose.
    pub(super) fn words(&self) -> String {
        pose_in_words(&self.posed.joints, &self.posed.at, &self.posed.prismatic)
    }

    /// Returns the actuated joints.
    pub(super) fn joints(&self) -> &[String] {
        &self.posed.joints
    }

    /// Values of the actuated joints (rad or m).
    pub(super) fn pose(&self) -> &[f64] {
        &self.posed.at
    }

    /// Returns the caveats about the robot and its pose.
    pub(super) fn caveats(&self) -> Vec<Finding> {
        self.posed.caveats_of(&self.linear, &[0.0; 6])
    }
}

/// Returns the axes of the cut as columns: x along the feed, z from the tip to the spindle.
fn cutting_axes(feed: &Vector3<f64>, axis: &Vector3<f64>) -> Result<Matrix3<f64>, LobesError> {
    let z = -axis;
    let across = feed - z * z.dot(feed);
    if across.norm() < ALONG_AXIS * feed.norm() {
        return Err(LobesError::FeedAlongAxis);
    }
    let x = across.normalize();
    Ok(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// Returns arm and tool in series. `R_CW`: rotation from world axes to those of the cut; `R_WT`:
/// from TCP to world axes.
fn structure(
    linear: &Linear,
    tool: &CuttingTool,
    R_CW: Matrix3<f64>,
    R_WT: &Matrix3<f64>,
) -> Result<Structure, crate::milling::ChatterError> {
    // v_tip = v_T + w × p with the tip p from the TCP, world axes; then in the axes of the cut.
    let p = R_WT * tool.tip;
    let mut J = Matrix3xX::zeros(linear.J.ncols());
    for (mut column, twist) in J.column_iter_mut().zip(linear.J.column_iter()) {
        let (v, w): (Vector3<f64>, Vector3<f64>) = (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into());
        column.copy_from(&(R_CW * (v + w.cross(&p))));
    }
    let arm = Structure::from_matrices(&linear.M, &linear.D, &linear.K, &J)?;
    Ok(arm.in_series(&Structure::from_modes(&tool_modes(tool, &(R_CW * R_WT)))?))
}

/// Returns the tool's own modes in the axes of the cut. `R_CT`: rotation from the axes of the TCP.
fn tool_modes(tool: &CuttingTool, R_CT: &Matrix3<f64>) -> Vec<Mode> {
    let modes = tool.modes.iter().flat_map(|mode| {
        let directions = match mode.direction {
            ToolDirection::Radial => vec![Vector3::x(), Vector3::y()],
            ToolDirection::Axial => vec![Vector3::z()],
            ToolDirection::Along(direction) => vec![R_CT * direction],
        };
        directions.into_iter().map(|direction| Mode {
            angular_frequency: mode.omega,
            damping_ratio: mode.damping_ratio,
            shape: direction / mode.mass.sqrt(),
        })
    });
    modes.collect()
}
