//! From a path to a trajectory: reads the file and chooses the reader by the ending of its name.

use std::path::Path;

use crate::error::{FileError, TrajectoryError};
use crate::limits::JointLimits;
use crate::problem::Problem;
use crate::trajectory::Trajectory;

impl Trajectory {
    /// Reads a trajectory file: `.csv` holds samples ([`Trajectory::parse_csv`]), `.toml` waypoints
    /// ([`Trajectory::parse_toml`]).
    ///
    /// * `limits`: what is known about the robot's joints, by name; used by waypoints without a duration. Joints
    ///   may be missing and need not occur in the file.
    ///
    /// # Errors
    /// [`TrajectoryError::Read`], [`TrajectoryError::UnknownExtension`], or [`TrajectoryError::File`] with line and
    /// column of what is wrong in the file.
    pub fn from_path(path: &Path, limits: &[(&str, JointLimits)]) -> Result<Self, TrajectoryError> {
        let extension = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        if extension != "csv" && extension != "toml" {
            return Err(TrajectoryError::UnknownExtension { path: path.to_owned(), found: extension });
        }

        let origin = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| TrajectoryError::Read { path: path.to_owned(), source })?;
        let text = text_of(bytes, &origin)?;
        match extension.as_str() {
            "csv" => Self::parse_csv(&text, &origin),
            _ => Self::parse_toml(&text, &origin, limits),
        }
    }
}

fn text_of(bytes: Vec<u8>, origin: &str) -> Result<String, Box<FileError>> {
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
        Box::new(FileError { origin: origin.to_owned(), line: Some(line), column: None, problem: Problem::NotUtf8 })
    })
}
