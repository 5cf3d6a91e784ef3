//! Robot programs as motions: read by `flexarm-programs`, planned for a robot.
//!
//! Start at [`read_robot_program`]. Not here: the languages (`flexarm-programs`), planning
//! (`flexarm-path`).

use std::path::{Path, PathBuf};

use flexarm_kinematics::{Data, Pose, forward_kinematics};
use flexarm_path::program::Program;
use flexarm_path::{ControllerAxis, PathOptions, ProgramArm};
use flexarm_programs::{ProgramText, ReadOptions, read_program, read_program_text, recognise};
use flexarm_trajectory::Trajectory;

use super::{Cell, Overrides, ToolPath};
use crate::error::Error;

/// Reads a robot program and plans its motion; also returns the name of its language.
///
/// # Errors
/// [`Error::Program`] with line and statement if the program cannot be read; [`Error::Path`] if the
/// arm cannot follow it.
pub(crate) fn read_robot_program(
    path: &Path,
    cell: &Cell<'_>,
) -> Result<((Trajectory, ToolPath), &'static str), Error> {
    let bytes = flexarm_trajectory::bytes_of_file(path)?;
    let (mut arm, assumed) = cell.arm(&Overrides::default());
    arm.controller = cell.controller_axes(&arm.axes);
    let planned = plan_program(
        path,
        &bytes,
        &arm,
        &ReadOptions::default(),
        &PathOptions::default(),
        assumed.warnings(),
        &|_| {},
    )?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok((planned, recognise(&bytes, &name).map_or("", |language| language.name())))
}

/// Reads a program with the locations of its targets, for writing it with other ones.
///
/// * `companions`: replace further files on disk, such as `.dat` of a KUKA program.
///
/// # Errors
/// [`Error::Program`] with line and statement.
pub fn program_text(
    path: &Path,
    bytes: &[u8],
    arm: &ProgramArm<'_>,
    companions: Vec<(PathBuf, Vec<u8>)>,
) -> Result<ProgramText, Error> {
    let forward = |values: &[f64]| flange_at(arm, values);
    let options =
        ReadOptions { forward: Some(&forward), own_tool: Some(arm.X_FT), companions, ..ReadOptions::default() };
    Ok(read_program_text(path, bytes, &options).map_err(Box::new)?)
}

/// Reads a program with the given options, and plans it.
pub(super) fn plan_program(
    path: &Path,
    bytes: &[u8],
    arm: &ProgramArm<'_>,
    options: &ReadOptions<'_>,
    resolution: &PathOptions,
    mut warnings: Vec<String>,
    fill: &dyn Fn(&mut Program),
) -> Result<(Trajectory, ToolPath), Error> {
    let forward = |values: &[f64]| flange_at(arm, values);
    let options = ReadOptions { forward: Some(&forward), own_tool: Some(arm.X_FT), ..options.clone() };
    let mut program = read_program(path, bytes, &options).map_err(Box::new)?;
    fill(&mut program);
    warnings.push(taken_as(arm));
    ToolPath::plan(path, &program, arm, resolution, warnings)
}

/// Describes how the program's axes relate to the joints.
fn taken_as(arm: &ProgramArm<'_>) -> String {
    let joint = |&k: &usize| arm.model.coordinates()[k].joint.as_str();
    let joints: Vec<&str> = arm.axes.iter().map(joint).collect();
    if arm.controller.is_empty() {
        return format!(
            "axes of the program are taken as the joints {}, with their zeros and senses",
            joints.join(", ")
        );
    }
    let axis = |(n, axis): (usize, &ControllerAxis)| {
        let unit = if arm.model.coordinates()[arm.axes[n]].slides() { 1.0 } else { 1f64.to_degrees() };
        let mut words = format!("{} = {}A{}", joints[n], if axis.sense < 0.0 { "-" } else { "" }, n + 1);
        if axis.zero != 0.0 {
            words += &format!(" {} {:.4}", if axis.zero < 0.0 { "-" } else { "+" }, (unit * axis.zero).abs());
        }
        if let Some((other, factor)) = axis.relative {
            words += &format!(" {} {} A{}", if factor < 0.0 { "-" } else { "+" }, factor.abs(), other + 1);
        }
        words
    };
    let axes: Vec<String> = arm.controller.iter().enumerate().map(axis).collect();
    format!("axes of the program become joints as the robot file says, in degrees: {}", axes.join(", "))
}

/// Returns the flange pose in the controller's world at axis values.
fn flange_at(arm: &ProgramArm<'_>, values: &[f64]) -> Option<Pose> {
    if values.len() > arm.axes.len() {
        return None;
    }
    let mut q = arm.rest.clone();
    arm.set_axes(values, &mut q);
    let mut data = Data::new(arm.model);
    forward_kinematics(arm.model, &mut data, &q);
    Some(arm.X_MW.inverse() * data.X_WF(&arm.flange))
}
