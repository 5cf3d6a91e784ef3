//! Changes of a robot file and of the speed of its motion for a single run, with the paths of
//! studies.

use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use toml_edit::DocumentMut;

use super::error::SweepError;
use super::file::Role;
use super::target::{Target, TargetFile, edits};
use super::value::ParameterValue;
use flexarm_run::{Arm, Error, LoadOptions, RobotSource};

/// A change: `payload.mass=150` replaces a value, `drive.*.gearbox.stiffness*=0.5` multiplies it.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    path: String,
    target: Target,
    role: Role,
    value: ParameterValue,
}

impl FromStr for Change {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let failed = |what: String| SweepError::Run(what);
        let (path, value) = text.split_once('=').ok_or_else(|| {
            failed("expected PATH=VALUE or PATH*=FACTOR, such as payload.mass=150 or motion.speed=0.8".into())
        })?;
        let (path, role) = match path.trim().strip_suffix('*') {
            // "drive.*" ends with a segment, not with an operator.
            Some(path) if !path.ends_with('.') => (path, Role::Factor),
            _ => (path, Role::Value),
        };
        let (path, value) = (path.trim().to_owned(), value.trim());
        let value = match (value.parse::<i64>(), value.parse::<f64>(), value.parse::<bool>()) {
            (Ok(n), ..) => ParameterValue::Whole(n),
            (_, Ok(x), _) if x.is_finite() => ParameterValue::Number(x),
            (_, Ok(_), _) => return Err(failed(format!("{path}: {value} is not a finite number"))),
            (.., Ok(truth)) => ParameterValue::Truth(truth),
            _ => ParameterValue::Text(value.to_owned()),
        };
        let target = Target::parse(&path, &[]).map_err(|error| failed(error.to_string()))?;
        match &target {
            Target::Speed if !value.number().is_some_and(|x| x > 0.0) => {
                Err(failed(format!("{path} is {value}, expected a positive number")))
            }
            Target::Speed | Target::Entry(TargetFile::Robot, _) => Ok(Self { path, target, role, value }),
            _ => Err(failed(format!("{path}: only entries of the robot file and motion.speed can be changed here"))),
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.role == Role::Factor { "*=" } else { "=" };
        write!(f, "{}{sign}{}", self.path, self.value)
    }
}

/// Loads the robot file at `path`, or in that folder, with changes applied in their order. Returns
/// the arm and the speed of the motion relative to its file. No file is written.
///
/// # Errors
/// [`SweepError::Run`] for a path without a match, with similar paths, for a factor of a value that
/// is not a number, and if `path` is not a robot file; otherwise as [`RobotSource::load`].
pub fn load_changed(path: &Path, options: &LoadOptions, changes: &[Change]) -> Result<(Arc<Arm>, f64), Error> {
    let path = if path.is_dir() { path.join("robot.toml") } else { path.to_owned() };
    if path.extension().is_none_or(|ending| ending != "toml") {
        let what = "not a robot file, so it has no entries to change: write a robot.toml that names it";
        return Err(SweepError::Run(format!("{}: {what}", path.display())).into());
    }
    let (text, speed) = change_text(&path, &flexarm_files::read_text(&path)?, changes)?;
    Ok((RobotSource { text: Some(&text), ..RobotSource::new(&path, options) }.load()?, speed))
}

/// Returns the changed text of a robot file, and the speed of the motion.
#[doc(hidden)]
pub fn change_text(path: &Path, text: &str, changes: &[Change]) -> Result<(String, f64), Error> {
    let (mut text, mut speed) = (text.to_owned(), 1.0);
    for change in changes {
        let Target::Entry(_, place) = &change.target else {
            let x = change.value.number().unwrap_or(1.0);
            speed = if change.role == Role::Factor { speed * x } else { x };
            continue;
        };
        // A file that is not TOML is reported, with its place, by the reader of robot files.
        let (Ok(root), Ok(mut document)) = (toml::from_str(&text), text.parse::<DocumentMut>()) else { break };
        let edits = edits(&root, place, &change.path, change.role, &change.value, &[]);
        for edit in edits.map_err(|error| SweepError::Run(format!("{}: {error}", path.display())))? {
            edit.place.put(&mut document, edit.value);
        }
        text = document.to_string();
    }
    Ok((text, speed))
}
