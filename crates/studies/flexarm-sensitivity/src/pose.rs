//! Sensitivity of the static TCP pose, the compliance and the natural frequencies at a pose.
//!
//! Start at [`pose_sensitivity`]. Closed-form derivatives, world axes, linear part first; the TCP
//! moved in its own axes has a closed form too ([`of_tool`]). Not here: derivatives along a motion
//! ([`super::slopes`]).

use std::sync::Arc;

use flexarm_identify::{Effect, Parameter, compliance_slopes, frequency_slopes, nominal, tool_slopes};
use flexarm_kinematics::{Pose, Wrench};
use flexarm_run::caveat::{Use, warnings};
use flexarm_run::inspect::joint_values;
use flexarm_run::{Arm, Error, Finding, Modelling, Robot};
use nalgebra::{Matrix6, Vector3};
use serde::Serialize;

use super::{change_of, chosen, numbers};

/// Result of `flexarm sensitivity --at`: drives locked, world axes, under gravity.
#[derive(Clone, Debug, Serialize)]
pub struct PoseSensitivity {
    /// Name of the robot.
    pub robot: String,
    /// Joints, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which they are held (rad or m).
    pub at: Vec<f64>,
    /// Compliance at the TCP, displacement (m, rad) per force (N) and moment (N m), 6×6.
    pub compliance: [[f64; 6]; 6],
    /// Natural frequencies (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Sensitivities to the parameters of the robot.
    pub parameters: Vec<PoseParameter>,
    /// Messages of the caveats.
    pub warnings: Vec<String>,
    /// Caveats.
    pub caveats: Vec<Finding>,
}

/// Effect of a change of one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct PoseParameter {
    /// Name as in the robot file; `tcp.x`, `.y` and `.z` for the position of the TCP in its own
    /// axes.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Value of the parameter.
    pub value: f64,
    /// Change to which the following effects refer: `1 %`, `1 % of the root of K_ii K_jj`, `1 kg`
    /// or `1 mm`. They are derivatives times that change.
    pub per: &'static str,
    /// Effect on the TCP position (m).
    pub tcp_m: [f64; 3],
    /// Effect on the TCP orientation, as a rotation vector (rad).
    pub tcp_rad: [f64; 3],
    /// Effect on the compliance.
    pub compliance: [[f64; 6]; 6],
    /// Effect on the natural frequencies (Hz).
    pub frequencies_hz: Vec<f64>,
}

/// Computes the sensitivity to the parameters of the robot at a pose: of the static TCP pose under
/// gravity, the compliance and the natural frequencies, with drives locked.
///
/// * `at`: positions of all actuated joints (rad or m); default zero.
/// * `parameters`: names, with * as wildcard; empty for all.
///
/// # Errors
/// [`Error::Value`] for a name that matches nothing, [`Error::Step`] if there is no equilibrium.
pub fn pose_sensitivity(
    robot: &Robot,
    modelling: Modelling,
    at: Option<&[f64]>,
    parameters: &[String],
) -> Result<PoseSensitivity, Error> {
    let arm = robot.model(&modelling)?;
    if arm.springs.is_empty() {
        return Err(Error::nothing_yields());
    }
    let joints: Vec<String> = arm.joints().map(str::to_owned).collect();
    let names: Vec<&str> = joints.iter().map(String::as_str).collect();
    let at = joint_values(at, &names)?;
    let all: Vec<Parameter> = numbers(&arm, parameters);
    let still = |parameter: &Parameter| !matches!(parameter.effect, Effect::Damping(_) | Effect::Damper { .. });
    let all =
        all.into_iter().filter(still).map(PoseParameterKind::Arm).chain((0..3).map(PoseParameterKind::Tool)).collect();
    slopes(robot, &arm, joints, at, chosen(all, parameters, PoseParameterKind::name)?)
}

/// A requested parameter.
enum PoseParameterKind {
    Arm(Parameter),
    /// Position of the TCP along one of its axes.
    Tool(usize),
}

impl PoseParameterKind {
    fn name(&self) -> &str {
        match self {
            Self::Arm(parameter) => &parameter.name,
            Self::Tool(axis) => ["tcp.x", "tcp.y", "tcp.z"][*axis],
        }
    }
}

/// Returns the effect of moving the TCP by 1 mm along one of its axes, with `a` that axis in the
/// world. The pose of the arm does not change:
///
/// ```text
/// J' = X' J,   C' = X' C + C X'ᵀ,   X' = [0 -[a]x; 0 0]
/// ```
fn of_tool(axis: usize, X_WT: &Pose, C: &Matrix6<f64>, modes: usize) -> PoseParameter {
    let a: Vector3<f64> = 1e-3 * (X_WT.rotation * Vector3::ith(axis, 1.0));
    let mut X = Matrix6::zeros();
    X.fixed_view_mut::<3, 3>(0, 3).copy_from(&-a.cross_matrix());
    let half = X * C;
    PoseParameter {
        name: PoseParameterKind::Tool(axis).name().to_owned(),
        unit: "m".to_owned(),
        value: 0.0,
        per: "1 mm",
        tcp_m: a.into(),
        tcp_rad: [0.0; 3],
        compliance: rows(&(half + half.transpose()), 1.0),
        frequencies_hz: vec![0.0; modes],
    }
}

/// Returns a scaled matrix row after row.
fn rows(C: &Matrix6<f64>, scale: f64) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| scale * C[(i, j)]))
}

/// Computes the sensitivities to the requested parameters at a pose.
fn slopes(
    robot: &Robot,
    arm: &Arc<Arm>,
    joints: Vec<String>,
    at: Vec<f64>,
    asked: Vec<PoseParameterKind>,
) -> Result<PoseSensitivity, Error> {
    // Derivatives by the parameters of the arm, one solution of the pose for all of them.
    let explained = |error| arm.explained(error);
    let none = Wrench::zeros();
    let mut point = arm.operating_point()?;
    point.solve(&at, &none).map_err(explained)?;
    let of_arm = |asked: &PoseParameterKind| match asked {
        PoseParameterKind::Arm(parameter) => Some(parameter.clone()),
        PoseParameterKind::Tool(_) => None,
    };
    let all: Vec<Parameter> = asked.iter().filter_map(of_arm).collect();
    let tool = tool_slopes(&mut point, &all);
    let compliance = compliance_slopes(&mut point, &none, &all).map_err(explained)?;
    let frequencies = frequency_slopes(&nominal(arm), &all, &at).map_err(explained)?;
    let pose_parameter = |(k, parameter): (usize, Parameter)| {
        let (per, scale) = change_of(&parameter);
        let moved = |first: usize| std::array::from_fn(|i| scale * tool[(first + i, k)]);
        PoseParameter {
            per,
            tcp_m: moved(0),
            tcp_rad: moved(3),
            compliance: rows(&compliance[k], scale),
            frequencies_hz: frequencies.slopes.column(k).iter().map(|slope| scale * slope).collect(),
            name: parameter.name,
            unit: parameter.unit,
            value: parameter.initial,
        }
    };
    // The TCP moved in its own axes.
    let C = point.compliance();
    let modes = frequencies.hz.len();
    let of_tools = asked.iter().filter_map(|asked| match asked {
        PoseParameterKind::Arm(_) => None,
        PoseParameterKind::Tool(axis) => Some(of_tool(*axis, &point.tcp_pose(), &C, modes)),
    });
    let caveats = arm.caveats(Use::Held(&at, &[0.0; 6]));
    Ok(PoseSensitivity {
        robot: robot.name.clone(),
        compliance: rows(&C, 1.0),
        frequencies_hz: frequencies.hz.clone(),
        parameters: all.into_iter().enumerate().map(pose_parameter).chain(of_tools).collect(),
        warnings: warnings(&caveats),
        caveats,
        joints,
        at,
    })
}
