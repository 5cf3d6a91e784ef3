//! Errors of compensating a motion.

use flexarm_analysis::{InversionError, LinearError, ShaperError};
use flexarm_run::ExternalError;

/// An error of compensating a motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// A request without a result: what was found, what was expected and the remedy.
    #[error("{0}")]
    Input(String),
    /// An invalid shaper.
    #[error(transparent)]
    Shaper(#[from] ShaperError),
    /// The modes at the end of the motion cannot be computed.
    #[error("cannot compute the modes at the end of the motion for the shaper: {0}")]
    Modes(#[from] LinearError),
    /// The linearised arm cannot be inverted.
    #[error(transparent)]
    Inversion(#[from] InversionError),
}

impl CompensateError {
    pub(super) fn nothing_yields() -> Self {
        Self::Input("the robot has no flexible link and no elastic drive: there is no deflection to compensate".into())
    }
}

impl From<CompensateError> for flexarm_run::Error {
    fn from(error: CompensateError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for CompensateError {}
