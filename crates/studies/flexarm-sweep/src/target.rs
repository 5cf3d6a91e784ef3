//! Targets of a parameter's path: the robot file, the motion, the loads, an option, or the job of a
//! reduced link.
//!
//! [`Target::parse`] reads a path, [`edits`] finds the values that it changes. Not here: paths within a
//! file ([`super::path`]).

use super::file::Role;
use super::path::{Segment, ValueLocation, changed, leaves, near, places, segments, written};
use super::value::ParameterValue;

/// File that contains a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum TargetFile {
    /// Robot file.
    Robot,
    /// Motion file.
    Motion,
    /// File of loads.
    Loads,
    /// Job of a link, by its index.
    Job(usize),
}

/// Target of one path of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Target {
    /// Choice of the robot, motion or loads.
    File(TargetFile),
    /// Speed of the motion, relative to the file.
    Speed,
    /// Option, by name.
    Option(String),
    /// Values in a file.
    Entry(TargetFile, Vec<Segment>),
}

impl Target {
    /// Parses a path.
    ///
    /// * `jobs`: names of the links with a job.
    ///
    /// # Errors
    /// Message for an invalid path.
    pub(super) fn parse(path: &str, jobs: &[String]) -> Result<Self, String> {
        let all = segments(path).ok_or_else(|| {
            let example = "drive.joint_2.gearbox.stiffness";
            format!("{path:?} is not a path: expected names separated by dots, such as {example}")
        })?;
        let word = |k: usize| match all.get(k) {
            Some(Segment::Key(key)) => key.as_str(),
            _ => "",
        };
        // Whole files, then options, then entries of a file; a path without a file is one of the
        // robot.
        match (word(0), all.len()) {
            ("robot", 1) => Ok(Self::File(TargetFile::Robot)),
            ("motion", 1) => Ok(Self::File(TargetFile::Motion)),
            ("loads", 1) => Ok(Self::File(TargetFile::Loads)),
            ("motion", 2) if word(1) == "speed" => Ok(Self::Speed),
            ("options", 2) => Ok(Self::Option(word(1).to_owned())),
            ("options", _) => Err(format!("{path:?}: an option has one name, such as options.step")),
            ("motion", _) => Ok(Self::Entry(TargetFile::Motion, all[1..].to_vec())),
            ("loads", _) => Ok(Self::Entry(TargetFile::Loads, all[1..].to_vec())),
            ("reduce", 3..) => match jobs.iter().position(|link| link == word(1)) {
                Some(job) => Ok(Self::Entry(TargetFile::Job(job), all[2..].to_vec())),
                None => {
                    let link = word(1);
                    Err(format!(
                        "{path:?}: the study names no job for link {link:?}; add {link} = \"job.toml\" to [reduce]"
                    ))
                }
            },
            ("robot", _) => Ok(Self::Entry(TargetFile::Robot, of_robot(all[1..].to_vec()))),
            _ => Ok(Self::Entry(TargetFile::Robot, of_robot(all))),
        }
    }
}

/// Replaces `link`, the short form, by `flexible_link`.
fn of_robot(mut path: Vec<Segment>) -> Vec<Segment> {
    if let Some(Segment::Key(key)) = path.first_mut()
        && key == "link"
        && path.len() > 1
    {
        path[0] = Segment::Key("flexible_link".into());
    }
    path
}

/// Change of one value in a file.
#[derive(Clone, Debug)]
pub(super) struct Edit {
    pub(super) place: ValueLocation,
    pub(super) value: toml_edit::Value,
}

/// Returns the edits that a value makes at all locations that a path matches.
///
/// * `known`: earlier edits, to which a factor or an offset is applied.
///
/// # Errors
/// Message for a path without a match, and for a factor or an offset of a value that is not
/// numeric.
pub(super) fn edits(
    root: &toml::Value,
    path: &[Segment],
    text: &str,
    role: Role,
    value: &ParameterValue,
    known: &[Edit],
) -> Result<Vec<Edit>, String> {
    let found = places(root, path);
    if found.is_empty() {
        return Err(format!("{text:?} matches no entry; {}", near(text, &leaves(root))));
    }
    // A value replaces; a factor or offset needs a number, which an earlier edit may have changed.
    let edit = |place: ValueLocation| {
        let before = known.iter().rev().find(|edit| edit.place == place).and_then(|edit| plain(&edit.value));
        let old = before.as_ref().or(place.value(root));
        let value = match (role, value.number(), old) {
            (Role::Value, ..) => written(value, old),
            (_, Some(x), Some(old)) => {
                let change: &dyn Fn(f64) -> f64 = if role == Role::Factor { &move |y| y * x } else { &move |y| y + x };
                changed(old, change).ok_or_else(|| {
                    format!("{text:?}: {} is not a number: a factor or offset does not apply", place.name)
                })?
            }
            (_, Some(_), None) => {
                let needs = "a factor or offset needs an existing number";
                return Err(format!("{text:?}: {} is not in the file: {needs}", place.name));
            }
            (_, None, _) => return Err(format!("{text:?}: factor or offset {value:?} must be a number")),
        };
        Ok(Edit { place, value })
    };
    found.into_iter().map(edit).collect()
}

/// Converts numbers and lists of them.
fn plain(value: &toml_edit::Value) -> Option<toml::Value> {
    match value {
        toml_edit::Value::Integer(n) => Some(toml::Value::Integer(*n.value())),
        toml_edit::Value::Float(x) => Some(toml::Value::Float(*x.value())),
        toml_edit::Value::Array(list) => list.iter().map(plain).collect::<Option<Vec<_>>>().map(toml::Value::Array),
        _ => None,
    }
}
