//! Why measurements tell nothing.

use crate::estimation::{FoundSlip, IdentifyError, Slip};
use flexarm_run::ExternalError;

use super::file::MeasurementInput;
use flexarm_run::Error;

/// What keeps measurements from telling anything.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyFileError {
    /// A rigid robot.
    #[error(
        "the robot has no flexible link and no elastic drive: there is no stiffness to find; add [[flexible_link]] or [[drive]] \
         entries with a first guess"
    )]
    NothingGives,
    /// A name that is not there.
    #[error("{text}")]
    UnknownParameter {
        /// All of it.
        text: String,
    },
    /// An entry of a matrix and a factor on it.
    #[error("{entry} and {factor} say the same twice: fit one of them and keep the other")]
    Twice {
        /// Entry.
        entry: String,
        /// Factor.
        factor: String,
    },
    /// A tool that is not the robot file's.
    #[error("{name} is that of the robot file, and link {link:?} was chosen in its place at loading: leave that out")]
    OtherTool {
        /// Parameter.
        name: String,
        /// Link.
        link: String,
    },
    /// Nodes on a tool that is to be found.
    #[error(
        "{reading} is seen or hit at a node on the tool, which {name} would move: give the node the link on which the sensor sits, and its \
         place there"
    )]
    ToolNode {
        /// Parameter.
        name: String,
        /// Which.
        reading: String,
    },
    /// Everything is kept.
    #[error("nothing is left to fit: of {known:?} all are kept")]
    NothingFitted {
        /// Names.
        known: Vec<String>,
    },
    /// Numbers out of all proportion.
    #[error(
        "the measured {what} are {ratio:.3e} times as large as those of the robot as it is: no robot is that far from its description. \
         The file says length = {length:?}; {help}"
    )]
    Units {
        /// Displacements, or distances between places.
        what: &'static str,
        /// Measured over expected.
        ratio: f64,
        /// Unit of the file.
        length: &'static str,
        /// What to try.
        help: String,
    },
    /// A point that does not move.
    #[error(
        "{reading}: the arm as it is does not move there along that direction, or cannot be hit so: look at nodes, their links and directions"
    )]
    Still {
        /// Which.
        reading: String,
    },
    /// A response out of all proportion.
    #[error(
        "{reading}: the measured response is {ratio:.3e} times as large as that of the robot as it is: no robot is that far from its \
         description; look at unit, at what was measured (displacement, velocity, acceleration), at nodes and directions"
    )]
    ResponseUnits {
        /// Which.
        reading: String,
        /// Measured over expected.
        ratio: f64,
    },
    /// A mode that the model does not have.
    #[error("{reading}: mode {mode} is asked for, the model has {modes} modes")]
    NoMode {
        /// Which reading.
        reading: String,
        /// From 1.
        mode: usize,
        /// How many there are.
        modes: usize,
    },
    /// Recordings that tell no gear.
    #[error("the recordings of {joints:?} tell no stiffness: deflection and torque do not go together")]
    NoGear {
        /// Joints.
        joints: Vec<String>,
    },
    /// Joint values in another order.
    #[error(
        "the readings do not fit the robot's joints in their order {joints:?} ({:.0} % of them is left without a cause), but they do if the \
         values are those of {likely:?} ({:.0} %): is the order of `joints`, or are the names of the columns, another one?",
        100.0 * rest, 100.0 * mended
    )]
    JointOrder {
        /// The robot's joints.
        joints: Vec<String>,
        /// Whose values they seem to be, in this order.
        likely: Vec<String>,
        /// Part of the readings that nothing explains.
        rest: f64,
        /// The same in the other order.
        mended: f64,
    },
    /// Displacements in other axes.
    #[error(
        "the displacements do not fit the robot in world axes ({:.0} % of them is left without a cause), but they do in axes that are \
         turned by rpy = [{:.1}, {:.1}, {:.1}] degrees ({:.0} %): are they in the axes of the instrument? Then add an instrument, \
         [instrument.NAME], and instrument = \"NAME\" to [[displacement]]: with rpy as it stands, or without, and its axes are found",
        100.0 * rest, rpy_deg[0], rpy_deg[1], rpy_deg[2], 100.0 * mended
    )]
    Axes {
        /// Roll, pitch and yaw of the axes in the world (degrees).
        rpy_deg: [f64; 3],
        /// Part of the displacements that nothing explains.
        rest: f64,
        /// The same in the other axes.
        mended: f64,
    },
    /// No fit.
    #[error("{0}")]
    Fit(String),
}

impl From<IdentifyFileError> for flexarm_run::Error {
    fn from(error: IdentifyFileError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for IdentifyFileError {}

/// A slip that explains what the arm does not.
pub(super) fn of_slip(found: FoundSlip, joints: &[(String, bool)]) -> Error {
    let FoundSlip { slip, rest, rest_mended: mended } = found;
    let joints: Vec<String> = joints.iter().map(|(name, _)| name.clone()).collect();
    match slip {
        Slip::Order(order) => {
            // The value of joint k stands at place order[k].
            let mut likely = joints.clone();
            order.iter().zip(&joints).for_each(|(place, joint)| likely[*place].clone_from(joint));
            IdentifyFileError::JointOrder { joints, likely, rest, mended }.into()
        }
        Slip::Axes(R_WI) => {
            let (r, p, y) = R_WI.euler_angles();
            IdentifyFileError::Axes { rpy_deg: [r, p, y].map(f64::to_degrees), rest, mended }.into()
        }
    }
}

/// The fit's error with the names of instruments.
pub(super) fn of_names(input: &MeasurementInput) -> impl Fn(IdentifyError) -> Error + '_ {
    |error| {
        let text = error.to_string();
        let named = input.instruments.iter().enumerate().fold(text, |text, (k, name)| {
            text.replace(&format!("instrument {k}:"), &format!("instrument {name:?}:"))
                .replace(&format!("where instrument {k} stands"), &format!("where instrument {name:?} stands"))
                .replace(&format!("how instrument {k} is turned"), &format!("how instrument {name:?} is turned"))
        });
        IdentifyFileError::Fit(named).into()
    }
}
