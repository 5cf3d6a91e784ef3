//! Readers of recordings. Start at [`crate::open_recording`].
//!
//! The table of formats (`formats/mod.rs`) lists the contents that each format gives back.
//!
//! A file left by a killed run, or an incomplete copy, is read up to the point where it breaks off;
//! [`crate::RunSource::warnings`] reports this. Data that a format does not hold are not made up:
//! numbers are NaN, lists are empty, and [`crate::RunSource::missing`] lists them.

mod csv_table;
#[cfg(feature = "mcap")]
mod mcap_run;
#[cfg(feature = "parquet")]
pub(crate) mod parquet_table;
#[cfg(any(feature = "mcap", feature = "parquet"))]
pub(crate) mod wall;

use std::path::{Path, PathBuf};

pub(crate) use self::csv_table::CsvRun;
#[cfg(feature = "mcap")]
pub(crate) use self::mcap_run::McapRun;
#[cfg(feature = "parquet")]
pub(crate) use self::parquet_table::ParquetRun;
use crate::LogError;

/// Creates the error for a file that cannot be read as a recording.
pub(crate) fn not_a_recording(path: &Path, found: impl Into<String>, expected: impl Into<String>) -> LogError {
    LogError::NotARecording {
        path: path.to_owned(),
        line: None,
        found: found.into(),
        expected: expected.into(),
        mend: "give a file that flexarm compare or run wrote".into(),
    }
}

/// Describes the point where a recording breaks off.
fn broken_end(path: &Path, cause: &str, samples: u64, time_s: f64) -> String {
    match samples {
        0 => format!("{}: breaks off before the first sample ({cause})", path.display()),
        _ => format!("{}: breaks off ({cause}); {samples} samples, up to t = {time_s} s, were read", path.display()),
    }
}

/// Returns the file name without folder and extension: the robot's name where the file has none.
pub(crate) fn stem(path: &Path) -> String {
    PathBuf::from(path.file_stem().unwrap_or_default()).display().to_string()
}

/// Returns time (s) and step number of a stamp. Stamps are whole nanoseconds; where the step size
/// is known, the time is the exact multiple of it.
#[cfg(feature = "mcap")]
fn exact_time(time_ns: u64, step_s: f64) -> (f64, u64) {
    let time_s = time_ns as f64 / 1e9;
    let step = (time_s / step_s).round();
    if step_s <= 0.0 || !step.is_finite() {
        return (time_s, 0);
    }
    let exact_s = step * step_s;
    let same = (exact_s * 1e9).round() as u64 == time_ns;
    (if same { exact_s } else { time_s }, step as u64)
}
