//! Checks and conversions shared by the entries of a robot file.

use flexarm_files::{Source, TextFileError};
use flexarm_kinematics::{Mechanism, Pose};
use flexarm_settings::known_names;
use nalgebra::{Rotation3, Translation3, Vector3};

use crate::error::Error;

/// Returns the pose of a position (m) and roll, pitch, yaw (rad).
pub(crate) fn pose(xyz: [f64; 3], rpy: [f64; 3]) -> Pose {
    Pose::from_parts(Translation3::from(Vector3::from(xyz)), Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]))
}

/// Checks that numbers are finite.
pub(crate) fn check_finite(
    what: &str,
    values: &[f64],
    span: std::ops::Range<usize>,
    source: &Source,
) -> Result<(), TextFileError> {
    match values.iter().find(|x| !x.is_finite()) {
        Some(found) => Err(source.error(span, format!("{what} has the entry {found}, expected finite numbers"))),
        None => Ok(()),
    }
}

/// Returns the name of the loop that determines a dependent joint.
pub(crate) fn loop_of_joint<'m>(mechanism: &'m Mechanism, joint: &str) -> Option<&'m str> {
    mechanism.loops.iter().find(|l| l.dependent.iter().any(|d| d == joint)).map(|l| l.name.as_str())
}

/// Returns the message that an entry names a link that the URDF does not have.
pub(crate) fn unknown_link(what: &str, link: &str, mechanism: &Mechanism) -> String {
    let known: Vec<_> = mechanism.links.iter().map(|l| l.name.as_str()).collect();
    format!("{what} link {link:?} is not a link of the URDF; its links are {}", known_names(link, &known))
}

/// Returns the value, or records the error so that later errors are found too.
pub(crate) fn keep<T>(result: Result<T, Error>, faults: &mut Vec<Error>) -> Option<T> {
    result.map_err(|e| faults.push(e)).ok()
}
