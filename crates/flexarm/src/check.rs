//! Lint: everything that can be said about a robot and a trajectory, not only the first thing.

use std::path::Path;

use serde::Serialize;

use crate::drive_entry::DriveKind;
use crate::error::Error;
use crate::motion::Motion;
use crate::options::LinkModel;
use crate::robot::{LoadOptions, Robot};
use flexarm_urdf::{Finding as UrdfFinding, Severity};

/// One thing found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// error, warning or note.
    pub severity: &'static str,
    /// Short, stable name of the kind of finding.
    pub code: String,
    /// File and line, or joint or link.
    #[serde(rename = "where")]
    pub location: String,
    /// What was found.
    pub message: String,
    /// How to mend it.
    pub help: String,
}

impl Finding {
    fn error(code: &str, location: String, error: &dyn std::fmt::Display) -> Self {
        Self { severity: "error", code: code.into(), location, message: error.to_string(), help: String::new() }
    }

    fn warning(code: &str, location: String, message: String, help: &str) -> Self {
        Self { severity: "warning", code: code.into(), location, message, help: help.into() }
    }
}

impl From<&UrdfFinding> for Finding {
    fn from(f: &UrdfFinding) -> Self {
        let severity = match f.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        let (code, location) = (f.code.to_owned(), f.location.clone());
        Self { severity, code, location, message: f.message.clone(), help: f.help.clone() }
    }
}

/// All findings about a robot, and about a trajectory on it.
///
/// Never fails: what cannot be loaded is a finding of severity `error`.
pub fn check(robot: &Path, trajectory: Option<&Path>, options: &LoadOptions) -> Vec<Finding> {
    let mut findings = Vec::new();
    let path = robot;
    let robot = match Robot::load(path, options) {
        Ok(robot) => robot,
        Err(error) => {
            load_findings(&error, path, &mut findings);
            if let Some(trajectory) = trajectory
                && let Err(error) = flexarm_trajectory::Trajectory::from_path(trajectory, &[])
            {
                findings.push(Finding::error("trajectory", trajectory.display().to_string(), &error));
            }
            return findings;
        }
    };
    if let Some(own) = robot.default_trajectory.as_ref().filter(|t| !t.is_file()) {
        let message = format!("default_trajectory: there is no file {}", own.display());
        findings.push(Finding::error("missing-file", path.display().to_string(), &message));
    }
    findings.extend(robot.urdf.warnings.iter().map(Finding::from));
    findings.extend(robot.warnings.iter().filter(|w| !w.contains(".urdf")).map(|w| {
        Finding::warning(
            "flexible-link",
            robot.path.display().to_string(),
            w.clone(),
            "compare the masses of both sources",
        )
    }));
    check_flexible(&robot, &mut findings);
    if let Some(path) = trajectory {
        check_trajectory(&robot, path, &mut findings);
    }
    findings
}

/// What kept a robot from being loaded, one finding per fault.
fn load_findings(error: &Error, path: &Path, findings: &mut Vec<Finding>) {
    match error {
        Error::Several(errors) => errors.iter().for_each(|e| load_findings(e, path, findings)),
        Error::Urdf(error) => findings.extend(error.findings().iter().map(Finding::from)),
        Error::RobotFile(e) => {
            let location = format!("{}:{}", e.path.display(), e.line);
            findings.push(Finding::error("robot-file", location, &e.message));
        }
        Error::File { path, what } => findings.push(Finding::error("missing-file", path.display().to_string(), what)),
        Error::Flex(error) => findings.push(Finding::error("reduced-link", path.display().to_string(), error)),
        error => findings.push(Finding::error("model", path.display().to_string(), error)),
    }
}

fn check_flexible(robot: &Robot, findings: &mut Vec<Finding>) {
    let gives_way = robot.drives.iter().any(|d| d.kind != DriveKind::Prescribed);
    if robot.flexible.is_empty() && !gives_way {
        findings.push(Finding {
            severity: "note",
            code: "no-flexible-link".into(),
            location: robot.path.display().to_string(),
            message: "no link is flexible and no drive gives way: compare will find no deflection".into(),
            help: "add [[flexible_link]] or [[drive]] entries to a robot.toml".into(),
        });
        return;
    }
    for link in robot.flexible.iter().filter(|link| link.choices.geometric) {
        let name = &link.flexible.link;
        let (message, help) = match (link.choices.model, link.has_geometric()) {
            (_, false) => (
                format!(
                    "link {name:?}: geometric_stiffening is asked for, but its .flex file has no stiffness by load"
                ),
                "make it with flexarm reduce --geometric",
            ),
            (LinkModel::Modal, true) => continue,
            (_, true) => (
                format!("link {name:?}: geometric_stiffening only counts for model = \"modal\""),
                "add model = \"modal\", or run with --links modal",
            ),
        };
        findings.push(Finding::warning("geometric-stiffening", robot.path.display().to_string(), message, help));
    }
    let arm = robot.flexible_robot().and_then(|f| {
        findings.extend(f.doubts.iter().map(|doubt| {
            let help = "reduce the mesh itself (flexarm reduce) to have them";
            Finding::warning("second-order-unknown", robot.path.display().to_string(), doubt.clone(), help)
        }));
        let n = f.model.n_actuated();
        let held = std::sync::Arc::new(flexarm_stepping::Held(vec![0.0; n]));
        f.arm(held).map_err(|source| Error::Step { source, partial: false })
    });
    match arm {
        Err(error) => findings.push(Finding::error("no-equilibrium", robot.path.display().to_string(), &error)),
        Ok(arm) => {
            let hz = arm.modes.frequencies_hz();
            let sag = arm.modes.equilibrium.iter().skip(3).step_by(6).fold(0.0f64, |m, x| m.max(x.abs()));
            findings.push(Finding {
                severity: "note",
                code: "modes".into(),
                location: robot.path.display().to_string(),
                message: format!("first frequencies at zero joint values {:.2?} Hz", &hz[..hz.len().min(4)]),
                help: String::new(),
            });
            if sag > crate::compare::ROTATION_LIMIT {
                let message = format!("a link bends by {sag:.3} rad under its own weight");
                let help = "the model is linear elastic: check stiffness and units";
                findings.push(Finding::warning("large-deformation", robot.path.display().to_string(), message, help));
            }
        }
    }
}

fn check_trajectory(robot: &Robot, path: &Path, findings: &mut Vec<Finding>) {
    let motion = robot.rigid_model().and_then(|model| Motion::load(path, &model));
    match motion {
        Err(error) => findings.push(Finding::error("trajectory", path.display().to_string(), &error)),
        Ok(motion) => {
            findings.extend(motion.violations.iter().map(|v| Finding {
                severity: "error",
                code: "joint-limit".into(),
                location: path.display().to_string(),
                message: v.to_string(),
                help: "slow the motion down or keep away from the limit".into(),
            }));
            findings.extend(
                motion.warnings.into_iter().map(|w| Finding::warning("trajectory", path.display().to_string(), w, "")),
            );
        }
    }
}
