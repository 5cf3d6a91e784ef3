//! Errors of an identification: files, readings without an estimate, mistakes in the readings.
//!
//! Mistakes in a file have its path, line and column ([`at_place`]); mistakes that only the arm shows,
//! such as exchanged joints, are found in `estimation/slips.rs` and put into words by [`of_slip`].

use flexarm_run::{Error, ExternalError, RobotFileError};

use crate::estimation::{FoundSlip, IdentifyError, Slip};

/// Measurements that cannot be used for an identification.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyFileError {
    /// The readings have no estimate, or the model no solution for them.
    #[error(transparent)]
    Estimate(#[from] IdentifyError),
    /// The readings do not fit the robot or the request: what was found and the remedy.
    #[error("{0}")]
    Input(String),
}

impl ExternalError for IdentifyFileError {}

impl From<IdentifyError> for Error {
    fn from(error: IdentifyError) -> Self {
        Self::External(Box::new(IdentifyFileError::from(error)))
    }
}

/// Returns the error with a message.
pub(super) fn refused(message: impl Into<String>) -> Error {
    Error::External(Box::new(IdentifyFileError::Input(message.into())))
}

/// Returns an error at a place of the file of measurements.
pub(super) fn at_place(place: &RobotFileError, message: impl Into<String>) -> Error {
    RobotFileError { message: message.into(), ..place.clone() }.into()
}

/// Returns the error for a mistake that explains the readings.
pub(super) fn of_slip(found: FoundSlip, joints: &[(String, bool)]) -> Error {
    let FoundSlip { slip, rest, rest_mended: mended } = found;
    let names: Vec<&String> = joints.iter().map(|(name, _)| name).collect();
    let (rest, mended) = (100.0 * rest, 100.0 * mended);
    let likely = match slip {
        Slip::Order(order) => {
            // The value of joint k is at position order[k].
            let mut likely = names.clone();
            order.iter().zip(&names).for_each(|(place, joint)| likely[*place] = joint);
            return refused(format!(
                "the readings do not fit the robot with the joint order {names:?} (residual {rest:.0} %), but they do \
                 with the order {likely:?} (residual {mended:.0} %): check the order of `joints`, or the names of the \
                 columns"
            ));
        }
        Slip::Axes(R_WI) => {
            let (r, p, y) = R_WI.euler_angles();
            let [r, p, y] = [r, p, y].map(f64::to_degrees);
            return refused(format!(
                "the displacements do not fit the robot in world axes (residual {rest:.0} %), but they do in axes that \
                 are turned by rpy = [{r:.1}, {p:.1}, {y:.1}] degrees (residual {mended:.0} %): are they in the axes of \
                 the instrument? Then add an instrument, [instrument.NAME], and instrument = \"NAME\" to \
                 [[displacement]]: with this rpy, or without rpy to fit it"
            ));
        }
        Slip::Sign(joint) => format!("joint {:?} turns the other way (its values have the wrong sign)", names[joint]),
        Slip::Zero(joint, by) => {
            format!("{:.0} degrees are added to the values of joint {:?}", by.to_degrees(), names[joint])
        }
        Slip::Mirrored => "one axis of the instrument is reversed (its axes are left-handed)".into(),
    };
    refused(format!(
        "the places do not fit the robot (residual {rest:.0} %), but they do if {likely} (residual {mended:.0} %): \
         check the readings"
    ))
}
