//! Errors of messages and bags: place, value found, value expected and remedy.
//!
//! [`MotionError`] leaves the crate; parsers raise [`PlacedProblem`], which gets its file last. Lines
//! and columns count from 1. Not here: caveats about motions that can be read (`assemble.rs`).

use std::path::PathBuf;

use flexarm_settings::{Finding, Place};
use flexarm_trajectory::TrajectoryError;

/// Content expected of a point without positions.
pub(crate) const NO_POSITIONS: &str =
    "expected a position for each joint; ros2 topic echo prints them all with --full-length";

/// Problem of an array that the program which printed it shortened (`...`) or left out.
pub(crate) const SHORTENED_ARRAY: &str =
    "an array was shortened when it was printed; print it whole (ros2 topic echo --full-length, without --no-arr)";

/// Error of reading a motion.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be opened or read.
    #[error("cannot read motion {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content of a file is invalid.
    #[error(transparent)]
    Content(Box<Finding>),
}

/// Place of a problem in a file.
#[derive(Debug)]
pub(crate) enum FilePosition {
    /// The file as a whole.
    Whole,
    /// A line and a column of text, from 1.
    Text(usize, usize),
    /// A message of a bag.
    Message { topic: String, number: usize },
}

/// Formats names as `"a", "b"`, at most twelve.
pub(crate) fn list(names: &[String]) -> String {
    const MAX: usize = 12;
    if names.is_empty() {
        return "none".to_owned();
    }
    let mut shown: Vec<String> = names.iter().take(MAX).map(|name| format!("{name:?}")).collect();
    if names.len() > MAX {
        shown.push(format!("... ({} in all)", names.len()));
    }
    shown.join(", ")
}

/// A problem with its place, before the file name is known; the message includes the remedy.
#[derive(Debug)]
pub(crate) struct PlacedProblem {
    pub(crate) place: FilePosition,
    /// Whether no topic of a bag holds a motion.
    pub(crate) is_without_motion: bool,
    pub(crate) message: String,
}

impl PlacedProblem {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { place: FilePosition::Whole, is_without_motion: false, message: message.into() }
    }

    /// A problem at a line and a column of text; line 0 means no place.
    pub(crate) fn at([line, column]: [u32; 2], message: impl Into<String>) -> Self {
        let text = FilePosition::Text(line as usize, column as usize);
        let place = if line > 0 { text } else { FilePosition::Whole };
        Self { place, ..Self::new(message) }
    }

    /// Sets the place to a message unless a place is set already.
    pub(crate) fn in_message(mut self, topic: &str, number: usize) -> Self {
        if matches!(self.place, FilePosition::Whole) {
            self.place = FilePosition::Message { topic: topic.to_owned(), number };
        }
        self
    }

    pub(crate) fn of(self, origin: &str) -> MotionError {
        let file = Place::of_file(origin);
        let place = match self.place {
            FilePosition::Whole => file.to_string(),
            FilePosition::Text(line, column) => file.at(line, column).to_string(),
            FilePosition::Message { topic, number } => format!("{file}, message {number} on {topic}"),
        };
        MotionError::Content(Box::new(Finding::error("motion", place, self.message, "")))
    }
}

impl From<TrajectoryError> for PlacedProblem {
    fn from(error: TrajectoryError) -> Self {
        Self::new(error.to_string())
    }
}
