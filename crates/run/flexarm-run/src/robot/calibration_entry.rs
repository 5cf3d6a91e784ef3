//! `[[calibration]]` of a robot file: measured corrections of joint frames and joint zeros.
//!
//! ```text
//! X_PJ := X_PJ T(xyz) R(rpy) exp(axis zero)
//! ```

use flexarm_kinematics::{JointKind, Mechanism, Pose};
use nalgebra::{Rotation3, Translation3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use flexarm_files::{Source, TextFileError};

use crate::robot::entry_checks::{check_finite, pose};

/// Entry as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CalibrationEntry {
    /// Moving joint of the URDF.
    pub joint: Spanned<String>,
    /// Shift of its frame, in the axes of the frame (m).
    pub xyz: Option<Spanned<[f64; 3]>>,
    /// Rotation of its frame: roll, pitch, yaw in the axes of the frame (rad).
    pub rpy: Option<Spanned<[f64; 3]>>,
    /// Value by which the joint is off the URDF's when its encoder reads 0 (rad or m).
    pub zero: Option<Spanned<f64>>,
}

/// Correction of a joint frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Joint.
    pub joint: String,
    /// Shift (m) and rotation of the frame, in its own axes.
    pub frame: Pose,
    /// Zero of the joint (rad or m).
    pub zero: f64,
}

/// Applies all corrections to the mechanisms of a robot; returns them with the errors found.
pub(crate) fn calibrate(
    entries: &[CalibrationEntry],
    mechanisms: &mut [&mut Mechanism],
    source: &Source,
) -> (Vec<Calibration>, Vec<TextFileError>) {
    let (mut found, mut faults): (Vec<Calibration>, Vec<TextFileError>) = (Vec::new(), Vec::new());
    for entry in entries {
        let calibration = match calibration(entry, &found, mechanisms, source) {
            Ok(calibration) => calibration,
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        // X_PJ times the correction of the frame and of the zero.
        for mechanism in mechanisms.iter_mut() {
            let joint = mechanism.joints.iter_mut().find(|joint| joint.name == calibration.joint);
            if let Some(joint) = joint {
                joint.X_PJ = joint.X_PJ * calibration.frame * moved(joint.kind, calibration.zero);
            }
        }
        found.push(calibration);
    }
    (found, faults)
}

/// Returns the displacement of a joint by a value.
fn moved(kind: JointKind, value: f64) -> Pose {
    let Some(motion) = kind.axis_motion() else { return Pose::identity() };
    let column = motion.column() * value;
    let [linear, angular] = [0, 3].map(|k| Vector3::new(column[k], column[k + 1], column[k + 2]));
    Pose::from_parts(Translation3::from(linear), Rotation3::new(angular))
}

fn calibration(
    entry: &CalibrationEntry,
    before: &[Calibration],
    mechanisms: &[&mut Mechanism],
    source: &Source,
) -> Result<Calibration, TextFileError> {
    // The joint: moving, and named once.
    let name = entry.joint.get_ref();
    let fail = |message: String| source.error(entry.joint.span(), format!("calibration of joint {name:?}: {message}"));
    let joints = || mechanisms.iter().flat_map(|mechanism| &mechanism.joints).filter(|j| j.kind != JointKind::Fixed);
    if !joints().any(|joint| joint.name == *name) {
        let meant = match flexarm_urdf::closest(name, joints().map(|joint| joint.name.as_str())) {
            Some(meant) => format!("did you mean {meant:?}?"),
            None => "give a moving joint of the URDF".to_owned(),
        };
        return Err(fail(format!("the robot has no such moving joint; {meant}")));
    }
    if before.iter().any(|other| other.joint == *name) {
        return Err(fail("it has two [[calibration]] entries: keep one".into()));
    }
    // The numbers; keys left out are zero.
    let three = |key: &str, value: &Option<Spanned<[f64; 3]>>| match value {
        None => Ok([0.0; 3]),
        Some(value) => {
            check_finite(&format!("calibration {key}"), value.get_ref(), value.span(), source)?;
            Ok(*value.get_ref())
        }
    };
    let zero = match &entry.zero {
        None => 0.0,
        Some(zero) => {
            check_finite("calibration zero", &[*zero.get_ref()], zero.span(), source)?;
            *zero.get_ref()
        }
    };
    let frame = pose(three("xyz", &entry.xyz)?, three("rpy", &entry.rpy)?);
    Ok(Calibration { joint: name.clone(), frame, zero })
}
