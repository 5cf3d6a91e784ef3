//! `[[controller_axis]]` of a robot file: axis conventions of the robot's controller that differ
//! from the description.
//!
//! `joint = zero + sense axis + factor axis_other` (rad or m). Start at [`controller_axes`]. Not
//! here: their use on a motion (`flexarm-programs`).

use std::ops::Range;

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_kinematics::{JointKind, Mechanism};
use flexarm_settings::known_names;
use serde::Deserialize;
use toml::Spanned;

use crate::error::Error;

/// Entry as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ControllerAxisEntry {
    /// Joint of the URDF.
    pub joint: Spanned<String>,
    /// Sense of rotation relative to the joint: 1 or -1.
    pub sense: Option<Spanned<i64>>,
    /// Joint value at which the axis is zero (rad or m).
    pub zero: Option<Spanned<f64>>,
    /// The same in degrees.
    pub zero_deg: Option<Spanned<f64>>,
    /// Joint of an earlier axis relative to which this one is measured.
    pub relative_to: Option<Spanned<String>>,
    /// Factor with which that axis adds to the joint; -1 by default.
    pub factor: Option<Spanned<f64>>,
}

/// Axis of the controller: `joint = zero + sense axis + factor axis_other`.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotAxis {
    pub(crate) joint: String,
    pub(crate) sense: f64,
    pub(crate) zero: f64,
    /// Joint of the other axis, and its factor.
    pub(crate) relative: Option<(String, f64)>,
}

/// Checks all entries; collects errors in `faults`.
pub(crate) fn controller_axes(
    entries: &[ControllerAxisEntry],
    mechanism: &Mechanism,
    source: &Source,
    faults: &mut Vec<Error>,
) -> Vec<RobotAxis> {
    let mut axes: Vec<RobotAxis> = Vec::new();
    for entry in entries {
        match axis(entry, &axes, mechanism, source) {
            Ok(axis) => axes.push(axis),
            Err(error) => faults.push(error.into()),
        }
    }
    axes
}

fn axis(
    entry: &ControllerAxisEntry,
    before: &[RobotAxis],
    mechanism: &Mechanism,
    source: &Source,
) -> Result<RobotAxis, RobotFileError> {
    let name = entry.joint.get_ref();
    let fail = |span: Range<usize>, message: String| {
        source.error(span, format!("controller axis of joint {name:?}: {message}"))
    };
    let free = |name: &str| mechanism.joint(name).is_some_and(|j| j.kind != JointKind::Fixed && j.mimic.is_none());
    let unknown = |name: &String, span| {
        let names: Vec<&str> = mechanism.joints.iter().map(|j| j.name.as_str()).filter(|name| free(name)).collect();
        let known = known_names(name, &names);
        fail(span, format!("the robot has no joint {name:?} that moves independently; it has {known}"))
    };
    // The joint: independent, and named once.
    if !free(name) {
        return Err(unknown(name, entry.joint.span()));
    }
    if before.iter().any(|axis| axis.joint == *name) {
        return Err(fail(entry.joint.span(), "it has a second entry: keep one of them".into()));
    }
    // joint = zero + sense axis.
    let sense = match &entry.sense {
        None => 1.0,
        Some(sense) if matches!(*sense.get_ref(), 1 | -1) => *sense.get_ref() as f64,
        Some(sense) => return Err(fail(sense.span(), format!("sense is {}, expected 1 or -1", sense.get_ref()))),
    };
    let zero = zero_of(entry, &fail)?;
    // An axis measured relative to one that carries it: + factor axis_other.
    let relative = match (&entry.relative_to, &entry.factor) {
        (None, None) => None,
        (None, Some(factor)) => {
            return Err(fail(factor.span(), "factor belongs to relative_to = \"joint\", which is missing".into()));
        }
        (Some(other), _) if !free(other.get_ref()) || other.get_ref() == name => {
            return Err(unknown(other.get_ref(), other.span()));
        }
        (Some(other), _) if !is_above(mechanism, other.get_ref(), name) => {
            let message = format!(
                "relative_to = {:?}: that joint does not carry it; an axis before it is needed",
                other.get_ref()
            );
            return Err(fail(other.span(), message));
        }
        (Some(other), factor) => {
            let factor = factor.as_ref().map(|factor| finite(factor, "factor", &fail)).transpose()?.unwrap_or(-1.0);
            Some((other.get_ref().clone(), factor))
        }
    };
    Ok(RobotAxis { joint: name.clone(), sense, zero, relative })
}

/// Makes an error of a place in the file and a message.
type Fail<'a> = &'a dyn Fn(Range<usize>, String) -> RobotFileError;

/// Returns the joint value at which the axis is zero (rad or m).
fn zero_of(entry: &ControllerAxisEntry, fail: Fail<'_>) -> Result<f64, RobotFileError> {
    match (&entry.zero, &entry.zero_deg) {
        (None, None) => Ok(0.0),
        (Some(zero), None) => finite(zero, "zero", fail),
        (None, Some(degrees)) => finite(degrees, "zero_deg", fail).map(f64::to_radians),
        (Some(_), Some(degrees)) => {
            Err(fail(degrees.span(), "zero (rad) and zero_deg are both given: keep one of them".into()))
        }
    }
}

fn finite(value: &Spanned<f64>, what: &str, fail: Fail<'_>) -> Result<f64, RobotFileError> {
    match *value.get_ref() {
        x if x.is_finite() => Ok(x),
        x => Err(fail(value.span(), format!("{what} is {x}, expected a finite number"))),
    }
}

/// Whether one joint carries another.
fn is_above(mechanism: &Mechanism, above: &str, joint: &str) -> bool {
    let joint_above = |link: &str| mechanism.joints.iter().find(|j| j.child == link);
    let mut at = mechanism.joint(joint).and_then(|j| joint_above(&j.parent));
    for _ in 0..mechanism.joints.len() {
        match at {
            Some(found) if found.name == above => return true,
            Some(found) => at = joint_above(&found.parent),
            None => return false,
        }
    }
    false
}
