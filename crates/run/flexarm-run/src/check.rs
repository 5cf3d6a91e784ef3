//! Checks a robot and a trajectory and collects all findings, as `flexarm check` does.
//!
//! Start at [`check`]. Whatever cannot be loaded or solved is a finding of severity `error`, so that
//! one command reports everything. Not here: the caveats themselves ([`crate::caveat`]), those of a
//! run.

use std::path::Path;

use flexarm_trajectory::{LimitViolation, MISSING_LIMIT};
use nalgebra::Vector6;

use crate::arm::options::Modelling;
use crate::caveat::motion::of_motion;
use crate::caveat::of_use::standing_pose;
use crate::caveat::size::Size;
use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::motions::motion::Motion;
use crate::motions::motion_formats::{self, MotionFile, MotionOptions};
use crate::motions::scenario::Scenario;
use crate::poses::posed::Posed;
use crate::robot::balancer;
use crate::robot::drive_entry::DriveKind;
use crate::robot::loops;
use crate::robot::{LoadOptions, Robot, RobotSource};
use crate::run::monitor::stress::StressMonitor;

/// Returns an error with its whole text as message.
fn error(code: &str, location: String, error: &dyn std::fmt::Display) -> Finding {
    Finding::error(code, location, error.to_string(), "")
}

/// Moves the place of a caveat, the file if it has none in it, from its message to its location.
fn about(file: &Path, caveat: Finding) -> Finding {
    let file = file.display().to_string();
    let location = if caveat.location.starts_with(&format!("{file}:")) { caveat.location } else { file };
    let message = caveat.message.strip_prefix(&format!("{location}: ")).unwrap_or(&caveat.message).to_owned();
    Finding { location, message, ..caveat }
}

/// Returns all findings about a robot, and about a trajectory on it.
///
/// Never fails: anything that cannot be loaded is a finding of severity `error`. The robot is
/// checked at the start of the trajectory, or of its default trajectory, or else in the middle of
/// its joint ranges.
pub fn check(robot: &Path, trajectory: Option<&Path>, options: &LoadOptions) -> Vec<Finding> {
    check_with_loads(robot, trajectory, None, options)
}

/// As [`check()`], and also checks the loads of a file that act during the trajectory.
pub fn check_with_loads(
    robot: &Path,
    trajectory: Option<&Path>,
    loads: Option<&Path>,
    options: &LoadOptions,
) -> Vec<Finding> {
    check_with_motion(robot, trajectory, &MotionOptions::default(), loads, options)
}

/// As [`check_with_loads`], with a given topic of a bag or given columns of a table.
pub fn check_with_motion(
    robot: &Path,
    trajectory: Option<&Path>,
    motion_options: &MotionOptions,
    loads: Option<&Path>,
    options: &LoadOptions,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    let path = robot;
    let arm = match RobotSource::new(path, options).load() {
        Ok(arm) => arm,
        Err(error) => {
            load_findings(error, path, &mut findings);
            findings.extend(trajectory.and_then(|path| motion_without_robot(path, motion_options)));
            return findings;
        }
    };
    let robot = arm.robot();
    findings.extend(robot.urdf.warnings.iter().cloned());
    let file = robot.path.clone();
    let own = robot.caveats().into_iter().filter(|caveat| !caveat.of_description);
    findings.extend(own.map(|caveat| about(&file, caveat)));
    let motion = match (trajectory, robot.default_trajectory.as_deref()) {
        (None, Some(own)) if !own.is_file() => {
            let message = format!("default_trajectory: there is no file {}: correct the path", own.display());
            findings.push(error("missing-file", path.display().to_string(), &message));
            None
        }
        (Some(path), _) => check_motion(robot, path, motion_options, &mut findings),
        // Errors of the default trajectory are only reported when it is checked itself.
        (None, Some(own)) => robot.rigid_model().ok().and_then(|model| {
            let motion = crate::Motion::load(own, robot).ok()?;
            let along = of_motion(&motion.name, &motion.trajectory, &model);
            findings.extend(along.into_iter().map(|caveat| about(own, caveat)));
            Some(motion)
        }),
        (None, None) => None,
    };
    check_flexible(robot, motion.as_ref(), &mut findings);
    if let Some(path) = loads {
        check_loads(robot, motion.as_ref(), path, &mut findings);
    }
    findings
}

/// Adds the findings about a loads file.
fn check_loads(robot: &Robot, motion: Option<&Motion>, path: &Path, findings: &mut Vec<Finding>) {
    let Some(motion) = motion else {
        let message = "loads belong to a motion, which is missing or cannot be read";
        findings.push(error("loads", path.display().to_string(), &message));
        return;
    };
    let acting = robot.model(&Modelling::default()).and_then(|arm| {
        Scenario::from(motion).with_loads_file(path).and_then(|scenario| scenario.acting_on(robot, &arm.model))
    });
    match acting {
        Err(cause) => findings.push(error("loads", path.display().to_string(), &cause)),
        Ok(acting) => {
            let duration = motion.trajectory.duration();
            let heavy = caveat::motion::of_loads(&acting.loads, duration, &Size::of(&robot.rigid));
            let caveats = acting.caveats.into_iter().chain(heavy);
            findings.extend(caveats.map(|caveat| about(path, caveat)));
        }
    }
}

/// Returns the error of a motion whose robot cannot be loaded; limits that the robot would provide
/// do not count as missing.
fn motion_without_robot(path: &Path, options: &MotionOptions) -> Option<Finding> {
    let file = MotionFile { path, joints: None, limits: &[], options, cell: None, text: None };
    let cause = motion_formats::read(&file).err()?;
    let follows = matches!(&cause, Error::Motion(fault) if fault.code == MISSING_LIMIT);
    (!follows).then(|| error("trajectory", path.display().to_string(), &cause))
}

/// Adds one finding per error that prevented loading the robot.
fn load_findings(cause: Error, path: &Path, findings: &mut Vec<Finding>) {
    let file = path.display().to_string();
    match cause {
        Error::Several(errors) => errors.into_iter().for_each(|cause| load_findings(cause, path, findings)),
        Error::Urdf(cause) => findings.extend(cause.into_findings()),
        Error::RobotFile(e) => {
            findings.push(error("robot-file", e.place().to_string(), &e.message));
        }
        Error::File { path, what } => findings.push(error("missing-file", path.display().to_string(), &what)),
        Error::Flex(cause) => findings.push(error("reduced-link", file, &cause)),
        cause => findings.push(error("model", file, &cause)),
    }
}

fn check_flexible(robot: &Robot, motion: Option<&Motion>, findings: &mut Vec<Finding>) {
    let file = robot.path.display().to_string();
    let gives_way = robot.drives.iter().any(|d| d.kind != DriveKind::Prescribed);
    if robot.flexible_links.is_empty() && !gives_way && !robot.is_mounted() {
        let message = "no link is flexible and no drive is elastic: compare will find no deflection";
        let help = "add [[flexible_link]] or [[drive]] entries to a robot.toml";
        findings.push(Finding::warning("no-flexible-link", &file, message, help).as_note());
    }
    // At rest: frequencies, stress fields, caveats about links and the linear model.
    let posed = standing_pose(robot, motion).and_then(|at| {
        let posed = Posed::new(robot.model(&Modelling::default())?, at)?;
        let linear = posed.linear(&Vector6::zeros())?;
        Ok((posed, linear))
    });
    match posed {
        Err(cause) => findings.push(error("no-equilibrium", file, &cause)),
        Ok((posed, linear)) => {
            let words = motion.map_or_else(
                || "in the middle of the joint ranges".to_owned(),
                |motion| format!("at the start of {}", motion.name),
            );
            let hz = posed.plant.modes.frequencies_hz();
            if !hz.is_empty() {
                let message = format!("first frequencies {words} {:.2?} Hz", &hz[..hz.len().min(4)]);
                findings.push(Finding::warning("modes", file, message, "").as_note());
            }
            if let Err(cause) = StressMonitor::new(&posed.arm, &posed.plant) {
                findings.push(error("stress", robot.path.display().to_string(), &cause));
            }
            let caveats = posed.arm.link_caveats().into_iter().chain(posed.validity(&linear));
            findings.extend(caveats.map(|caveat| about(&robot.path, caveat)));
        }
    }
}

/// Returns the motion, if usable, and adds its findings.
fn check_motion(robot: &Robot, path: &Path, options: &MotionOptions, findings: &mut Vec<Finding>) -> Option<Motion> {
    let file = || path.display().to_string();
    match crate::Motion::load_with(path, robot, options) {
        Err(cause) => {
            findings.push(error("trajectory", file(), &cause));
            None
        }
        Ok(motion) => {
            let help = "slow the motion down or keep away from the limit";
            let likely = || motion.likely.to_owned();
            let passed = |v: &LimitViolation| {
                let error = error("joint-limit", file(), &v.warning().message);
                Finding { help: help.into(), likely: likely(), ..error }
            };
            findings.extend(motion.violations.iter().map(passed));
            // Checks of the rigid robot along the motion.
            let mut caveats = motion.caveats();
            if let Ok(model) = robot.rigid_model() {
                let closed = loops::along_motion(&model, &motion.trajectory);
                findings.extend(closed.err().map(|e| error("loop", file(), &e)));
                let balancers = balancer::check_motion(&model, &motion.trajectory);
                findings.extend(balancers.err().map(|e| error("balancer", file(), &e)));
                caveats.extend(of_motion(&motion.name, &motion.trajectory, &model));
            }
            findings.extend(caveats.into_iter().map(|caveat| about(path, caveat)));
            Some(motion)
        }
    }
}
