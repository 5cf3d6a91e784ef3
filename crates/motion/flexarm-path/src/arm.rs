//! The arm that runs a program, and the resolution of its paths.
//!
//! Frames: M world of the model, W world of the controller, B base of a move, F flange of the
//! controller, T tool. Axes are the controller's, coordinates the model's; [`ProgramArm::set_axes`]
//! and [`ProgramArm::axis_values`] convert. Not here: the robot file that defines them.

use flexarm_kinematics::{ControllerAxes, Frame, Model, NullSpaceRule};
use flexarm_spatial::Pose;
use nalgebra::DVector;

use crate::program::Move;

/// Limits of a joint while it follows a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBounds {
    /// Maximum speed (rad/s or m/s), positive, may be infinite.
    pub velocity: f64,
    /// Maximum acceleration (rad/s² or m/s²), positive.
    pub acceleration: f64,
    /// Maximum torque (N m) or force (N) of the rigid arm, positive; `None`: not checked.
    pub torque: Option<f64>,
    /// Maximum jerk (rad/s³ or m/s³), positive. If any joint has one, the accelerations of the
    /// others rise to their limits in at least [`PathOptions::rise_s`].
    pub jerk: Option<f64>,
}

/// Resolution of paths.
#[derive(Debug, Clone, PartialEq)]
pub struct PathOptions {
    /// Maximum spacing of the points of the time law (m of path).
    pub spacing_m: f64,
    /// Maximum deviation of the joints from the path between points (m and rad).
    pub chord_m: f64,
    /// Rise and fall time of accelerations (s).
    pub rise_s: f64,
    /// Null-space rule for an arm with more joints than the path needs: redundant joints move
    /// towards its posture; without a rule they are held.
    pub rule: Option<NullSpaceRule>,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { spacing_m: 5e-3, chord_m: 1e-10, rise_s: 0.05, rule: None }
    }
}

/// The arm that runs a program, in terms of its controller.
#[derive(Debug, Clone)]
pub struct ProgramArm<'m> {
    /// Rigid-body model.
    pub model: &'m Model,
    /// Flange of the controller, F.
    pub flange: Frame,
    /// The robot's own tool on the flange, `X_FT`, used if the program gives none.
    pub X_FT: Pose,
    /// Pose of the controller's world in the model's, `X_MW`.
    pub X_MW: Pose,
    /// Coordinates in the order of the controller's axes.
    pub axes: Vec<usize>,
    /// Definition of each controller axis; empty if the axes are the joints.
    pub controller: Vec<ControllerAxis>,
    /// Limits, one for each independent coordinate.
    pub bounds: Vec<JointBounds>,
    /// All independent coordinates before the program; joints that it does not move keep these
    /// values.
    pub rest: DVector<f64>,
    /// Whether the program starts at `rest`; otherwise it starts at the target of its first move.
    pub starts_at_rest: bool,
}

/// Returns the frame of the tool of a move: its own tool or the robot's on the flange of the rigid
/// arm.
pub fn tool_of(arm: &ProgramArm<'_>, of: &Move) -> Frame {
    let X_FT = of.X_FT.unwrap_or(arm.X_FT);
    Frame { X_BF: arm.flange.X_BF * X_FT, ..arm.flange.clone() }
}

/// Returns the pose of the base of a move in the world of the model, `X_MB`.
pub fn base_of(arm: &ProgramArm<'_>, of: &Move) -> Pose {
    arm.X_MW * of.X_WB
}

/// Definition of a controller axis. The joint value is
///
/// ```text
/// q = zero + sense a + factor a_other
/// ```
/// where `a` is the value of the axis and `a_other` that of an earlier axis: arms whose third axis
/// is driven by a rod measure it against the horizontal and not against the previous link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerAxis {
    /// Sign, 1 or -1.
    pub sense: f64,
    /// Joint value at axis value zero (rad or m).
    pub zero: f64,
    /// Index of the other axis, from 0, and its factor.
    pub relative: Option<(usize, f64)>,
}

impl ControllerAxis {
    /// Axis value equal to the joint value.
    pub const SAME: Self = Self { sense: 1.0, zero: 0.0, relative: None };
}

impl ProgramArm<'_> {
    /// Sets the coordinates of the controller's first axes from axis values (rad or m).
    ///
    /// * `values`: one for each axis, or fewer; the coordinates of the others stay.
    /// * `q`: all independent coordinates of the model.
    pub fn set_axes(&self, values: &[f64], q: &mut DVector<f64>) {
        for (n, (value, &k)) in values.iter().zip(&self.axes).enumerate() {
            let axis = self.controller.get(n).unwrap_or(&ControllerAxis::SAME);
            let other = axis.relative.and_then(|(other, factor)| Some(factor * values.get(other)?));
            q[k] = axis.zero + axis.sense * value + other.unwrap_or(0.0);
        }
    }

    /// Returns the values of the controller's axes for all coordinates: the inverse of
    /// [`ProgramArm::set_axes`].
    pub fn axis_values(&self, q: &DVector<f64>) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.axes.len());
        for (n, &k) in self.axes.iter().enumerate() {
            let axis = self.controller.get(n).unwrap_or(&ControllerAxis::SAME);
            // An axis is relative to an earlier one.
            let other = axis.relative.and_then(|(other, factor)| Some(factor * values.get(other)?));
            values.push((q[k] - axis.zero - other.unwrap_or(0.0)) / axis.sense);
        }
        values
    }

    /// Whether some joint has a given jerk limit.
    pub(crate) fn has_jerk_limits(&self) -> bool {
        self.bounds.iter().any(|bounds| bounds.jerk.is_some())
    }

    /// Zeros and senses of six joints, for configuration words that refer to the controller's axes.
    /// Coupling to another axis is ignored.
    pub(crate) fn controller_axes(&self, joints: [usize; 6]) -> ControllerAxes {
        let controller_axis = |k: usize| {
            let n = self.axes.iter().position(|&axis| axis == k);
            *n.and_then(|n| self.controller.get(n)).unwrap_or(&ControllerAxis::SAME)
        };
        let axes = joints.map(controller_axis);
        ControllerAxes { sign: axes.map(|axis| axis.sense), offset: axes.map(|axis| -axis.sense * axis.zero) }
    }
}
