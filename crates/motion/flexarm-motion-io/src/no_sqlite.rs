//! Replacement of the SQLite reader without the feature `sqlite`.

use std::path::Path;

use crate::collect::Collector;
use crate::error::{MotionError, PlacedProblem};

pub(crate) fn collect_file(path: &Path, _: u64, _: &mut Collector<'_>) -> Result<Option<String>, MotionError> {
    Err(refused().of(&path.display().to_string()))
}

pub(crate) fn collect_bytes(_: Vec<u8>, _: u64, _: &mut Collector<'_>) -> Result<Option<String>, PlacedProblem> {
    Err(refused())
}

fn refused() -> PlacedProblem {
    let what = "it is a SQLite bag, which this build does not read: build flexarm with the feature sqlite, install the Python \
                package, which reads it, or make an MCAP of it with ros2 bag convert";
    PlacedProblem::new(what)
}
