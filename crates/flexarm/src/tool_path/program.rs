//! Robot programs as motions: read by `flexarm-programs`, planned for a robot.

use std::path::Path;

use flexarm_kinematics::{Data, Pose, forward_kinematics};
use flexarm_path::program::Program;
use flexarm_path::{PathOptions, ProgramArm};
use flexarm_programs::{ReadOptions, read_program, recognise};
use flexarm_trajectory::Trajectory;

use super::{Cell, Overrides, ToolPath};
use crate::error::Error;

/// Reads a robot program and plans its motion; the name of its language beside it.
///
/// # Errors
/// [`Error::Program`] for what cannot be read, with line and statement; [`Error::Path`] for what the arm cannot do.
pub(crate) fn read_robot_program(
    path: &Path,
    cell: &Cell<'_>,
) -> Result<((Trajectory, ToolPath), &'static str), Error> {
    let bytes = flexarm_trajectory::bytes_of_file(path)?;
    let (arm, assumed) = cell.arm(&Overrides::default());
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

/// Reads a program with what is told beside it, and plans it.
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
    let joints: Vec<&str> = arm.axes.iter().map(|&k| arm.model.coordinates()[k].joint.as_str()).collect();
    warnings.push(format!(
        "axes of the program are taken as the joints {}, with their zeros and senses",
        joints.join(", ")
    ));
    ToolPath::plan(path, &program, arm, resolution, warnings)
}

/// The flange in the controller's world at axis values.
fn flange_at(arm: &ProgramArm<'_>, values: &[f64]) -> Option<Pose> {
    if values.len() > arm.axes.len() {
        return None;
    }
    let mut q = arm.rest.clone();
    for (value, &k) in values.iter().zip(&arm.axes) {
        q[k] = *value;
    }
    let mut data = Data::new(arm.model);
    forward_kinematics(arm.model, &mut data, &q);
    Some(arm.X_MW.inverse() * data.X_WF(&arm.flange))
}
