//! Why measurements tell nothing.

use flexarm_identify::IdentifyError;

use super::file::MeasurementInput;
use crate::error::Error;

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
    /// No fit.
    #[error("{0}")]
    Fit(String),
}

/// The fit's error with the names of instruments.
pub(super) fn of_names(input: &MeasurementInput) -> impl Fn(IdentifyError) -> Error + '_ {
    |error| {
        let text = error.to_string();
        let named = input.instruments.iter().enumerate().fold(text, |text, (k, name)| {
            text.replace(&format!("instrument {k}:"), &format!("instrument {name:?}:"))
                .replace(&format!("where instrument {k} stands"), &format!("where instrument {name:?} stands"))
        });
        IdentifyFileError::Fit(named).into()
    }
}
