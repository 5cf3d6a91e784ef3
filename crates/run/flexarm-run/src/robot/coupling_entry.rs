//! Coupling entry of a robot file: motors that move several joints through their gears.
//!
//! `q_joints = C q_motors`, motor angles after their gears (rad or m). The rotors couple the joints:
//! `C⁻ᵀ diag(armature) C⁻¹`, whose diagonal goes to the joints and the rest to pairs of them. Start at
//! [`coupling`]. Not here: springs behind coupled gears (`flexarm_stepping::GearCoupling`).

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_flexlink::GearStiffness;
use flexarm_kinematics::{Joint, RotorCoupling};
use flexarm_settings::known_names;
use flexarm_stepping::GearCoupling;
use nalgebra::DMatrix;
use serde::Deserialize;
use toml::Spanned;

use crate::robot::Robot;
use crate::robot::drive_entry::Drive;
use crate::robot::gear_entry::RobotCoupling;

/// Motors that move several joints through their gears.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CouplingEntry {
    /// Joints; motor k is that of the drive of joint k.
    pub joints: Spanned<Vec<String>>,
    /// Matrix C of `q_joints = C q_motors`, with motor angles after their gears; one row per joint.
    pub matrix: Spanned<Vec<Vec<f64>>>,
}

/// Checks a coupling and distributes the rotor inertias of its motors to the joints.
///
/// # Errors
/// [`RobotFileError`] with line and column.
pub(crate) fn coupling(
    robot: &mut Robot,
    entry: &CouplingEntry,
    source: &Source,
) -> Result<RobotCoupling, RobotFileError> {
    let fail = |span: std::ops::Range<usize>, message: String| Err(source.error(span, format!("coupling: {message}")));
    // Names: two or more joints with one coordinate and a motor each.
    let joints = entry.joints.get_ref();
    let n = joints.len();
    if n < 2 {
        return fail(
            entry.joints.span(),
            format!("joints has {n} names, expected two or more: one motor moves one joint without it"),
        );
    }
    for (k, name) in joints.iter().enumerate() {
        let single = |j: &&Joint| j.kind.turns() || j.kind.slides();
        match robot.rigid.joint(name).filter(single) {
            None => {
                let known: Vec<_> = robot.rigid.joints.iter().filter(single).map(|j| j.name.as_str()).collect();
                let known = known_names(name, &known);
                return fail(entry.joints.span(), format!("the robot has no movable joint {name:?}; it has {known}"));
            }
            Some(joint) if joint.mimic.is_some() => {
                return fail(
                    entry.joints.span(),
                    format!("joint {name:?} mimics another one and has no motor of its own"),
                );
            }
            Some(_) if joints[..k].contains(name) => {
                return fail(entry.joints.span(), format!("joint {name:?} is listed twice"));
            }
            Some(_) => {}
        }
    }
    // Matrix: square, finite, invertible.
    let rows = entry.matrix.get_ref();
    if rows.len() != n || rows.iter().any(|row| row.len() != n) {
        let widths: Vec<usize> = rows.iter().map(Vec::len).collect();
        return fail(
            entry.matrix.span(),
            format!("matrix has rows of {widths:?} numbers, expected {n} rows of {n}: a row per joint"),
        );
    }
    let C = DMatrix::from_fn(n, n, |i, j| rows[i][j]);
    if let Some(hole) = C.iter().find(|x| !x.is_finite()) {
        return fail(entry.matrix.span(), format!("matrix has the entry {hole}, expected finite numbers"));
    }
    let singular = C.singular_values();
    let inverse = C.clone().try_inverse().filter(|_| singular.min() > 1e-6 * singular.max());
    let Some(C_inverse) = inverse else {
        return fail(entry.matrix.span(), "matrix cannot be inverted: some motion of the joints has no motor".into());
    };
    if let Err(error) = gears_fit(robot, joints) {
        return fail(entry.joints.span(), error);
    }
    couple_rotors(robot, joints, &C_inverse);
    Ok(RobotCoupling { joints: joints.clone(), C, C_inverse })
}

/// Sets the inertias of the rotors, each of which turns with several joints.
fn couple_rotors(robot: &mut Robot, joints: &[String], C_inverse: &DMatrix<f64>) {
    let armature: Vec<f64> =
        joints.iter().map(|name| robot.drives.iter().find(|d| d.joint == *name).map_or(0.0, |d| d.armature)).collect();
    let rotors = GearCoupling::on_joints(C_inverse, &armature);
    for (i, name) in joints.iter().enumerate() {
        robot.rigid.joints.iter_mut().filter(|j| j.name == *name).for_each(|joint| joint.armature = rotors[(i, i)]);
        for j in (i + 1..joints.len()).filter(|j| rotors[(i, *j)] != 0.0) {
            let pair = [name.clone(), joints[j].clone()];
            robot.rigid.rotor_couplings.push(RotorCoupling { joints: pair, inertia: rotors[(i, j)] });
        }
    }
}

/// Checks that the drives of coupled joints are supported by a coupling.
fn gears_fit(robot: &Robot, joints: &[String]) -> Result<(), String> {
    let drives: Vec<Option<&Drive>> =
        joints.iter().map(|name| robot.drives.iter().find(|d| d.joint == *name)).collect();
    // Springs on all joints or on none.
    let yields = |drive: &Option<&Drive>| drive.is_some_and(|d| d.gearbox.is_some());
    let kinds: Vec<_> = drives.iter().map(|d| d.map(|d| d.kind)).collect();
    if drives.iter().any(yields) && (!drives.iter().all(yields) || kinds.windows(2).any(|pair| pair[0] != pair[1])) {
        return Err("each of its joints needs a [[drive]] of the same kind with a gearbox, or none has a gearbox: a \
                    rigid gear among elastic ones leaves no springs on the joints"
            .into());
    }
    // Linear springs about the axes, without laws that depend on one motor.
    for drive in drives.iter().flatten() {
        let Some((gearbox, gear)) = &drive.gearbox else { continue };
        let fail = |what: &str| Err(format!("the gearbox of joint {:?} {what}", drive.joint));
        if !matches!(gearbox.stiffness, GearStiffness::Axis(_)) || !gear.curves.is_empty() {
            return fail("needs one stiffness, without backlash and curve");
        }
        if gear.hysteresis.is_some() || !gear.transmission.is_empty() {
            return fail("has a transmission error or hysteresis, which coupled gears do not support");
        }
    }
    match drives.iter().flatten().find(|d| d.load_friction > 0.0) {
        Some(drive) => Err(format!(
            "the friction of joint {joint:?} grows with its load, which coupled gears do not support",
            joint = drive.joint
        )),
        None => Ok(()),
    }
}
