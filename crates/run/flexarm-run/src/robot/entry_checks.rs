//! Checks and conversions shared by the entries of a robot file.
//!
//! Positions are in link axes (m), rotations roll, pitch, yaw (rad). Not here: ranges of numbers
//! ([`crate::ranges`]), a 6×6 stiffness (`flexarm_flexlink::spring_stiffness`).

use std::ops::Range;

use flexarm_files::{Source, TextFileError};
use flexarm_kinematics::{Joint, JointKind, Link, Mechanism, Pose};
use flexarm_settings::known_names;
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};

use crate::error::Error;

/// Returns the pose of a position (m) and roll, pitch, yaw (rad).
pub(crate) fn pose(xyz: [f64; 3], rpy: [f64; 3]) -> Pose {
    Pose::from_parts(Translation3::from(Vector3::from(xyz)), Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]))
}

/// Checks that numbers are finite.
pub(crate) fn check_finite(
    what: &str,
    values: &[f64],
    span: Range<usize>,
    source: &Source,
) -> Result<(), TextFileError> {
    match values.iter().find(|x| !x.is_finite()) {
        Some(found) => Err(source.error(span, format!("{what} has the entry {found}, expected finite numbers"))),
        None => Ok(()),
    }
}

/// Returns the inertia with the moments `ixx iyy izz ixy ixz iyz` about the centre of mass (kg m²).
pub(crate) fn inertia(
    what: &str,
    moments: &[f64; 6],
    span: Range<usize>,
    source: &Source,
) -> Result<Matrix3<f64>, TextFileError> {
    check_finite(&format!("{what} inertia"), moments, span.clone(), source)?;
    let [xx, yy, zz, xy, xz, yz] = *moments;
    let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    match inertia.symmetric_eigenvalues().min() < -1e-9 * inertia.norm() {
        true => {
            let wrong = "inertia has a negative principal moment; the order is ixx iyy izz ixy ixz iyz";
            Err(source.error(span, format!("{what} {wrong}")))
        }
        false => Ok(inertia),
    }
}

/// Returns the links of the URDF, without those that were added to it.
pub(crate) fn link_names(mechanism: &Mechanism) -> Vec<String> {
    mechanism.links.iter().map(|link| link.name.clone()).filter(|name| !name.starts_with("__")).collect()
}

/// Checks that a point is finite (m, link axes) and on a link of the robot.
///
/// # Errors
/// A sentence with the links of the robot, or the entry found.
pub(crate) fn check_point(mechanism: &Mechanism, link: &str, p: &[f64; 3]) -> Result<(), String> {
    if mechanism.link(link).is_none() {
        let known = link_names(mechanism);
        return Err(format!("{link:?} is not a link of the robot; its links are {}", known_names(link, &known)));
    }
    match p.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(format!("its point on link {link:?} has the entry {x}, expected finite numbers in m")),
        None => Ok(()),
    }
}

/// Adds a frame at a point of a link (m, link axes), fixed to the link: on a flexible link it moves
/// with the part that it is on.
pub(crate) fn add_point(mechanism: &mut Mechanism, link: &str, p: [f64; 3], frame: &str) {
    let joint = Joint::new(format!("{frame}_joint"), JointKind::Fixed, link, frame, pose(p, [0.0; 3]));
    mechanism.joints.push(joint);
    mechanism.links.push(Link { name: frame.to_owned(), inertia: None });
}

/// Returns the link of the same rigid body that is nearest to the base.
pub(crate) fn carrier<'m>(mechanism: &'m Mechanism, link: &'m str) -> &'m str {
    let mut body = link;
    while let Some(joint) = mechanism.joints.iter().find(|j| j.child == body && j.kind == JointKind::Fixed) {
        body = &joint.parent;
    }
    body
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
