//! Errors of a map: a request without a result, or an interruption, as errors of a run.
//!
//! Texts name the request's value and the remedy. Not here: errors of robot and pose (`flexarm-run`).

use std::path::PathBuf;

use flexarm_run::ExternalError;
use flexarm_settings::{Fault, Setting};

use super::MAX_PLACES;

/// An error of a map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// A request without a result: what was found, what was expected and the remedy.
    #[error("{0}")]
    Input(String),
    /// Interrupted by the user.
    #[error("stopped after {done} of {places} places; {}", match folder {
        Some(folder) => format!("their results are in {}", folder.display()),
        None => "nothing is written".to_owned(),
    })]
    Interrupted {
        /// Number of places done.
        done: usize,
        /// Total number of places.
        places: usize,
        /// Folder of the results of the places done.
        folder: Option<PathBuf>,
    },
}

impl MapError {
    pub(super) fn instants() -> Self {
        Self::Input(format!("a map along a motion needs from one to {MAX_PLACES} instants"))
    }

    pub(super) fn too_many(places: f64) -> Self {
        Self::Input(format!(
            "the map would have {places:.3e} places, at most {:.0e} are held in memory: increase {} or map a smaller \
             region",
            MAX_PLACES,
            Setting::GridSpacing
        ))
    }
}

impl From<MapError> for flexarm_run::Error {
    fn from(error: MapError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for MapError {
    fn fault(&self) -> Fault {
        match self {
            Self::Interrupted { .. } => Fault::Run,
            Self::Input(_) => Fault::Input,
        }
    }
}
