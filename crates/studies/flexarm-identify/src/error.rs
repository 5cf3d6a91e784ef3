//! Errors of an identification.

use crate::estimation::{FoundSlip, IdentifyError, Slip};
use flexarm_run::ExternalError;

use super::file::MeasurementInput;
use flexarm_run::Error;
use flexarm_run::RobotFileError;

/// Reason why measurements cannot be used for an identification.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyFileError {
    /// The robot is rigid, and no joint frame is to be fitted.
    #[error(
        "the robot has no flexible link and no elastic drive: there is no stiffness to identify; add \
         [[flexible_link]] or [[drive]] entries with initial values, or fit its frames by fit = [\"joint.*\"]"
    )]
    NothingGives,
    /// Unknown name of a parameter.
    #[error("{text}")]
    UnknownParameter {
        /// Message.
        text: String,
    },
    /// An entry of a matrix and a factor on the same matrix.
    #[error("{entry} and {factor} describe the same stiffness: fit one of them and keep the other")]
    Twice {
        /// Name of the entry.
        entry: String,
        /// Name of the factor.
        factor: String,
    },
    /// The tool is not that of the robot file.
    #[error(
        "{name} describes the tool of the robot file, but link {link:?} was chosen as the TCP at loading: do not \
         choose it"
    )]
    OtherTool {
        /// Name of the parameter.
        name: String,
        /// Name of the link.
        link: String,
    },
    /// A node is on a tool whose pose is unknown.
    #[error(
        "{reading} is measured or excited at a node on the tool, which {name} would move: define the node on the link \
         that carries the sensor, with its position there"
    )]
    ToolNode {
        /// Name of the parameter.
        name: String,
        /// Name of the reading.
        reading: String,
    },
    /// All parameters are kept.
    #[error("there is no parameter to fit: all of {known:?} are kept")]
    NothingFitted {
        /// Names of the parameters.
        known: Vec<String>,
    },
    /// Displacements or distances differ from the model by orders of magnitude.
    #[error(
        "the measured {what} are {ratio:.3e} times as large as those of the robot model, which is implausible. The \
         file has length = {length:?}; {help}"
    )]
    Units {
        /// Quantity: displacements, or distances between positions.
        what: &'static str,
        /// Ratio of measured to predicted values.
        ratio: f64,
        /// Unit of length of the file.
        length: &'static str,
        /// Advice.
        help: String,
    },
    /// Frequencies are probably in rad/s.
    #[error(
        "the measured frequencies are {ratio:.2} times as large as those of the robot model, all of them about 2 pi \
         times: they are expected in Hz; divide numbers in rad/s by 2 pi, or give initial stiffnesses of the right \
         order of magnitude"
    )]
    Radians {
        /// Geometric mean of the ratios of measured to predicted frequencies.
        ratio: f64,
    },
    /// A measured point does not move.
    #[error(
        "{reading}: in the model the arm does not move there in that direction, or cannot be excited so: check nodes, \
         their links and directions"
    )]
    Still {
        /// Name of the reading.
        reading: String,
    },
    /// A response differs from the model by orders of magnitude.
    #[error(
        "{reading}: the measured response is {ratio:.3e} times as large as that of the robot model, which is \
         implausible; check the unit, the measured quantity (displacement, velocity, acceleration), nodes and \
         directions"
    )]
    ResponseUnits {
        /// Name of the reading.
        reading: String,
        /// Ratio of measured to predicted values.
        ratio: f64,
    },
    /// The model does not have a measured mode.
    #[error("{reading}: mode {mode} does not exist, the model has {modes} modes")]
    NoMode {
        /// Name of the reading.
        reading: String,
        /// Number of the mode, from 1.
        mode: usize,
        /// Number of modes of the model.
        modes: usize,
    },
    /// The recordings do not determine the stiffness of any gear.
    #[error("the recordings of {joints:?} do not determine a stiffness: deflection and torque are not correlated")]
    NoGear {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// The joint values are in another order.
    #[error(
        "the readings do not fit the robot with the joint order {joints:?} (residual {:.0} %), but they do with the \
         order {likely:?} (residual {:.0} %): check the order of `joints`, or the names of the columns",
        100.0 * rest, 100.0 * mended
    )]
    JointOrder {
        /// Joints of the robot.
        joints: Vec<String>,
        /// Probable order of the joint values.
        likely: Vec<String>,
        /// Relative residual of the readings.
        rest: f64,
        /// Relative residual in the other order.
        mended: f64,
    },
    /// The displacements are in other axes.
    #[error(
        "the displacements do not fit the robot in world axes (residual {:.0} %), but they do in axes that are turned \
         by rpy = [{:.1}, {:.1}, {:.1}] degrees (residual {:.0} %): are they in the axes of the instrument? Then add \
         an instrument, [instrument.NAME], and instrument = \"NAME\" to [[displacement]]: with this rpy, or without \
         rpy to fit it",
        100.0 * rest, rpy_deg[0], rpy_deg[1], rpy_deg[2], 100.0 * mended
    )]
    Axes {
        /// Roll, pitch and yaw of the axes in the world (degrees).
        rpy_deg: [f64; 3],
        /// Relative residual of the displacements.
        rest: f64,
        /// Relative residual in the other axes.
        mended: f64,
    },
    /// One change of the readings makes them fit the robot.
    #[error(
        "the places do not fit the robot (residual {:.0} %), but they do if {likely} (residual {:.0} %): check the \
         readings",
        100.0 * rest, 100.0 * mended
    )]
    OneSlip {
        /// Change, as a clause.
        likely: String,
        /// Relative residual of the readings.
        rest: f64,
        /// Relative residual with the change.
        mended: f64,
    },
    /// The fit failed.
    #[error("{0}")]
    Fit(String),
}

impl From<IdentifyFileError> for flexarm_run::Error {
    fn from(error: IdentifyFileError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for IdentifyFileError {}

/// Returns an error at a place of the file of measurements.
pub(super) fn at_place(place: &RobotFileError, message: impl Into<String>) -> Error {
    RobotFileError { message: message.into(), ..place.clone() }.into()
}

/// Returns the error for a mistake that explains the readings.
pub(super) fn of_slip(found: FoundSlip, joints: &[(String, bool)]) -> Error {
    let FoundSlip { slip, rest, rest_mended: mended } = found;
    let joints: Vec<String> = joints.iter().map(|(name, _)| name.clone()).collect();
    match slip {
        Slip::Order(order) => {
            // The value of joint k is at position order[k].
            let mut likely = joints.clone();
            order.iter().zip(&joints).for_each(|(place, joint)| likely[*place].clone_from(joint));
            IdentifyFileError::JointOrder { joints, likely, rest, mended }.into()
        }
        Slip::Sign(joint) => {
            let likely = format!("joint {:?} turns the other way (its values have the wrong sign)", joints[joint]);
            IdentifyFileError::OneSlip { likely, rest, mended }.into()
        }
        Slip::Zero(joint, by) => {
            let likely = format!("{:.0} degrees are added to the values of joint {:?}", by.to_degrees(), joints[joint]);
            IdentifyFileError::OneSlip { likely, rest, mended }.into()
        }
        Slip::Mirrored => {
            let likely = "one axis of the instrument is reversed (its axes are left-handed)".into();
            IdentifyFileError::OneSlip { likely, rest, mended }.into()
        }
        Slip::Axes(R_WI) => {
            let (r, p, y) = R_WI.euler_angles();
            IdentifyFileError::Axes { rpy_deg: [r, p, y].map(f64::to_degrees), rest, mended }.into()
        }
    }
}

/// Returns the error of the fit with names instead of numbers of instruments.
pub(super) fn of_names(input: &MeasurementInput) -> impl Fn(IdentifyError) -> Error + '_ {
    |error| {
        let text = error.to_string();
        let named = input.instruments.iter().enumerate().fold(text, |text, (k, name)| {
            text.replace(&format!("instrument {k}:"), &format!("instrument {name:?}:"))
                .replace(
                    &format!("the pose of instrument {k} in the world"),
                    &format!("the pose of instrument {name:?} in the world"),
                )
                .replace(
                    &format!("the orientation of instrument {k} in the world"),
                    &format!("the orientation of instrument {name:?} in the world"),
                )
        });
        IdentifyFileError::Fit(named).into()
    }
}
