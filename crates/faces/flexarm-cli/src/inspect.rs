//! `flexarm inspect` and `check`.

use std::process::ExitCode;

use flexarm::settings::written::visible;

use crate::args::{CheckArgs, InspectArgs};
use crate::failure::Failure;
use crate::terminal::{Terminal, answer, answer_as_is, to_json};
use crate::{print, shipped, values};

pub(crate) fn inspect(terminal: &Terminal, args: &InspectArgs) -> Result<ExitCode, Failure> {
    let robot = args.load.load(&args.robot)?;
    let at = values::joint_values(args.at.as_deref(), &robot)?;
    let velocity = values::joint_values(args.velocity.as_deref(), &robot)?;
    let inspection = flexarm::inspect(&robot, at.as_deref(), velocity.as_deref())?;
    if !terminal.quiet {
        inspection.warnings.iter().for_each(|text| print::warning(text));
    }
    answer(terminal, || to_json(&inspection), || print::inspection(&inspection));
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn check(terminal: &Terminal, args: &CheckArgs) -> Result<ExitCode, Failure> {
    let trajectory = args.trajectory.as_deref().map(shipped::trajectory).transpose()?;
    let robot = shipped::robot(Some(&args.robot))?;
    let (motion, options) = (args.motion.options(), args.load.options()?);
    let loads = args.loads.as_deref();
    let findings = flexarm::robots::check_with_motion(&robot, trajectory.as_deref(), &motion, loads, &options);
    let json = || serde_json::json!({ "findings": findings }).to_string();
    // Messages, which editors and scripts read line by line, are not wrapped.
    answer_as_is(terminal, json, || visible(&print::findings(&findings)));
    let wrong = findings.iter().any(|f| f.is_error());
    Ok(if wrong { ExitCode::from(2) } else { ExitCode::SUCCESS })
}
