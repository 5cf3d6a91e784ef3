//! What the numbers of the robot do to the tool at rest, its compliance and the natural frequencies at a pose.

use flexarm_identify::{Effect, compliance_slopes, frequency_slopes, tool_slopes};
use flexarm_kinematics::Wrench;
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::Caveat;
use crate::error::Error;
use crate::identify::Parameter;
use crate::inspect::joint_values;
use crate::options::Modelling;
use crate::robot::Robot;

use super::{change_of, chosen};

/// Answer of `flexarm sensitivity --at`: drives locked, world axes, under the robot's own weight.
#[derive(Clone, Debug, Serialize)]
pub struct PoseSensitivity {
    /// The robot.
    pub robot: String,
    /// Joints, in coordinate order.
    pub joints: Vec<String>,
    /// Where they are held (rad or m).
    pub at: Vec<f64>,
    /// Compliance of the tool, displacement (m, rad) per force (N) and moment (N m), 6×6.
    pub compliance: [[f64; 6]; 6],
    /// Natural frequencies (Hz).
    pub frequencies_hz: Vec<f64>,
    /// One per number of the robot.
    pub parameters: Vec<PoseParameter>,
    /// What is doubtful.
    pub caveats: Vec<Caveat>,
}

/// What a change of one number does.
#[derive(Clone, Debug, Serialize)]
pub struct PoseParameter {
    /// By the names of the robot file.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Of which change of it the following are the effect: `1 %` or `1 kg`. They are derivatives, times that.
    pub per: &'static str,
    /// Of the tool's place (m).
    pub tcp_m: [f64; 3],
    /// Of its attitude, a rotation vector (rad).
    pub tcp_rad: [f64; 3],
    /// Of the compliance.
    pub compliance: [[f64; 6]; 6],
    /// Of the natural frequencies (Hz).
    pub frequencies_hz: Vec<f64>,
}

/// What the numbers of the robot do at a pose: tool at rest under the arm's weight, its compliance, natural frequencies; drives locked.
///
/// * `at`: all actuated joints (rad or m), zero without it; `parameters`: names, * for anything, all without any.
///
/// # Errors
/// [`Error::Value`] for a name that fits nothing, [`Error::Step`] where there is no equilibrium.
pub fn pose_sensitivity(
    robot: &Robot,
    modelling: Modelling,
    at: Option<&[f64]>,
    parameters: &[String],
) -> Result<PoseSensitivity, Error> {
    let arm = robot.flexible(modelling)?;
    let joints: Vec<String> = arm.joints().map(str::to_owned).collect();
    let names: Vec<&str> = joints.iter().map(String::as_str).collect();
    let at = joint_values(at, &names)?;
    let all: Vec<Parameter> = arm.parameters().into_iter().chain(arm.link_directions()).collect();
    let all = chosen(all, parameters, |parameter| &parameter.name)?;
    let still = |parameter: &&Parameter| !matches!(parameter.effect, Effect::Damping(_));
    let all: Vec<Parameter> = all.iter().filter(still).cloned().collect();
    slopes(robot, &arm, joints, at, all)
}

fn slopes(
    robot: &Robot,
    arm: &Arm,
    joints: Vec<String>,
    at: Vec<f64>,
    all: Vec<Parameter>,
) -> Result<PoseSensitivity, Error> {
    let explained = |error| arm.flexible().explained(error);
    let none = Wrench::zeros();
    let mut point = arm.operating_point()?;
    point.solve(&at, &none).map_err(explained)?;
    let tool = tool_slopes(&mut point, &all).map_err(explained)?;
    let compliance = compliance_slopes(&mut point, &none, &all).map_err(explained)?;
    let frequencies = frequency_slopes(&arm.plant(), &all, &at).map_err(explained)?;
    let rows = |C: &nalgebra::Matrix6<f64>, scale: f64| -> [[f64; 6]; 6] {
        std::array::from_fn(|i| std::array::from_fn(|j| scale * C[(i, j)]))
    };
    let of = |(k, parameter): (usize, Parameter)| {
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
    Ok(PoseSensitivity {
        robot: robot.name.clone(),
        compliance: rows(&point.compliance(), 1.0),
        frequencies_hz: frequencies.hz.clone(),
        parameters: all.into_iter().enumerate().map(of).collect(),
        caveats: arm.robot_caveats().to_vec(),
        joints,
        at,
    })
}
