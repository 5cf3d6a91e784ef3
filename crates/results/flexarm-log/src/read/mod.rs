//! Recordings read back: start at [`crate::open_recording`].
//!
//! What comes back of a run is said beside the table of formats (`formats/mod.rs`).
//!
//! A file that a killed run left, or a copy that broke off, is read up to its break;
//! [`crate::RunSource::warnings`] says so. What a format does not hold is not made up: numbers are
//! NaN, lists empty, and [`crate::RunSource::missing`] lists it.

mod csv_table;
#[cfg(feature = "mcap")]
mod mcap_run;
#[cfg(feature = "parquet")]
pub(crate) mod parquet_table;
#[cfg(any(feature = "mcap", feature = "described-tables"))]
pub(crate) mod wall;

use std::path::{Path, PathBuf};

pub(crate) use self::csv_table::CsvRun;
#[cfg(feature = "mcap")]
pub(crate) use self::mcap_run::McapRun;
#[cfg(feature = "parquet")]
pub(crate) use self::parquet_table::ParquetRun;
use crate::LogError;

/// A refusal in one's own words.
pub(crate) fn not_a_recording(path: &Path, found: impl Into<String>, expected: impl Into<String>) -> LogError {
    LogError::NotARecording {
        path: path.to_owned(),
        found: found.into(),
        expected: expected.into(),
        mend: "give a file that flexarm compare or run wrote".into(),
    }
}

/// Where a recording breaks off, in words.
fn broken_end(path: &Path, cause: &str, samples: u64, time_s: f64) -> String {
    match samples {
        0 => format!("{}: breaks off before the first sample ({cause})", path.display()),
        _ => format!("{}: breaks off ({cause}); {samples} samples, up to t = {time_s} s, were read", path.display()),
    }
}

/// The file's name without folder and ending: the robot's name where the file has none.
pub(crate) fn stem(path: &Path) -> String {
    PathBuf::from(path.file_stem().unwrap_or_default()).display().to_string()
}

/// Time (s) and number of steps of a stamp. Stamps are whole nanoseconds; where the step is known,
/// the time is that multiple of it to the last bit.
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
