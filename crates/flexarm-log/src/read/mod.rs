//! Recordings read back: start at [`open_recording`].
//!
//! | format | what comes back |
//! | --- | --- |
//! | MCAP | everything; numbers exactly, poses of links to 1e-13 (they are stored as quaternions from link to link) |
//! | Parquet | the numbers of its columns exactly; names, set-up, result and events; no poses of links, no velocities |
//! | CSV | the numbers of its columns exactly (times to 1 ns once they went through MCAP); no poses, velocities, result, nor names of robot and trajectory |
//! | .rrd | the error to rounding (it is stored in mm); other curves and poses, these as `f32`, at the rate of the pictures, interpolated between them |
//!
//! A file that a killed run left, or a copy that broke off, is read up to its break; [`RunSource::warnings`] says so.
//! What a format does not hold is not made up: numbers are NaN, lists empty, and [`RunSource::missing`] lists it.

#[cfg(feature = "mcap")]
mod cdr;
mod csv_table;
#[cfg(feature = "mcap")]
mod mcap_run;
#[cfg(feature = "parquet")]
mod parquet_table;
#[cfg(feature = "rerun")]
mod rrd_messages;
#[cfg(feature = "rerun")]
mod rrd_run;
#[cfg(feature = "rerun")]
mod rrd_track;
#[cfg(any(feature = "mcap", feature = "parquet", feature = "rerun"))]
mod wall;

use std::fmt;
use std::io::Read;
use std::path::{Path, PathBuf};

use flexarm_settings::Setting;

use crate::{LogError, RunHeader, RunSource, table};

/// Formats of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingFormat {
    /// ROS 2 messages.
    Mcap,
    /// Rerun.
    Rrd,
    /// Comma-separated values.
    Csv,
    /// Apache Parquet.
    Parquet,
}

impl RecordingFormat {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Mcap, Self::Rrd, Self::Csv, Self::Parquet];

    /// The ending of file names, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Mcap => "mcap",
            Self::Rrd => "rrd",
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        }
    }

    /// The format that the ending of a file name says.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.extension() == ending)
    }

    /// Whether this build can read and write it.
    #[must_use]
    pub fn is_built_in(self) -> bool {
        match self {
            Self::Mcap => cfg!(feature = "mcap"),
            Self::Rrd => cfg!(feature = "rerun"),
            Self::Csv => true,
            Self::Parquet => cfg!(feature = "parquet"),
        }
    }

    /// Whether it is a table of scalars.
    #[must_use]
    pub fn is_table(self) -> bool {
        matches!(self, Self::Csv | Self::Parquet)
    }

    /// What is lost on the way from this format to another by their nature, as sentences.
    #[must_use]
    pub fn lost_on_the_way_to(self, to: Self, header: &RunHeader) -> Vec<String> {
        let mut lost = match (self.is_table(), to.is_table()) {
            (false, true) => table::left_out(header),
            (true, false) => table::unknown(header),
            _ => Vec::new(),
        };
        if self == Self::Rrd && !to.is_table() {
            lost.push(
                "Rerun files hold no joint values of the rigid twin: NaN; poses of links are those of the last picture"
                    .into(),
            );
        }
        if to == Self::Rrd && !self.is_table() {
            lost.push("Rerun files hold poses in single precision, at most 200 a second".into());
        }
        if self == Self::Csv && to != Self::Csv {
            lost.push("CSV says neither robot nor trajectory, and has no set-up, result figures and events".into());
        }
        if to == Self::Csv && self != Self::Csv {
            lost.push("CSV has no place for robot and trajectory, set-up, result figures and events".into());
        }
        lost
    }
}

impl fmt::Display for RecordingFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mcap => "MCAP",
            Self::Rrd => "Rerun",
            Self::Csv => "CSV",
            Self::Parquet => "Parquet",
        })
    }
}

/// Opens a recording of flexarm and reads what it says about the run as a whole.
///
/// # Errors
/// [`LogError::Io`] if it cannot be read, [`LogError::NotARecording`] if it is something else.
pub fn open_recording(path: &Path, format: RecordingFormat) -> Result<Box<dyn RunSource>, LogError> {
    check_kind(path, format)?;
    match format {
        RecordingFormat::Csv => Ok(Box::new(csv_table::CsvRun::open(path)?)),
        #[cfg(feature = "mcap")]
        RecordingFormat::Mcap => Ok(Box::new(mcap_run::McapRun::open(path)?)),
        #[cfg(feature = "parquet")]
        RecordingFormat::Parquet => Ok(Box::new(parquet_table::ParquetRun::open(path)?)),
        #[cfg(feature = "rerun")]
        RecordingFormat::Rrd => Ok(Box::new(rrd_run::RrdRun::open(path)?)),
        #[allow(unreachable_patterns, reason = "which formats are left depends on the features")]
        _ => Err(LogError::NotARecording {
            path: path.to_owned(),
            found: format!("a file in the format {format}"),
            expected: "a format that this build can read".into(),
            mend: format!("use a build with {format}, or convert the file there"),
        }),
    }
}

/// Looks at the first bytes, so that a file under a wrong name is called what it is.
fn check_kind(path: &Path, expected: RecordingFormat) -> Result<(), LogError> {
    let refuse = |found: &str, mend: String| {
        let (found, expected) = (found.to_owned(), format!("a recording of flexarm in the format {expected}"));
        Err(LogError::NotARecording { path: path.to_owned(), found, expected, mend })
    };
    if path.is_dir() {
        let inside = path.join(format!("run.{}", expected.extension()));
        return refuse("a folder", format!("give a file in it, such as {}", inside.display()));
    }
    // A device might never end, a pipe never begin.
    if path.exists() && !path.is_file() {
        return refuse("what is not a file", "write it to a file first".into());
    }
    let mut start = Vec::new();
    let file = std::fs::File::open(path).map_err(LogError::io(path, "open the recording"))?;
    file.take(64).read_to_end(&mut start).map_err(LogError::io(path, "read the recording"))?;
    if start.is_empty() {
        return refuse("an empty file", "the run that should write it did not begin".into());
    }
    let found = match start.as_slice() {
        [0x89, b'M', b'C', b'A', b'P', ..] => Some(RecordingFormat::Mcap),
        [b'P', b'A', b'R', b'1', ..] => Some(RecordingFormat::Parquet),
        [b'R', b'R', b'F', _, ..] => Some(RecordingFormat::Rrd),
        _ => None,
    };
    let text = !start.contains(&0) && std::str::from_utf8(&start).is_ok_or_cut();
    match found {
        Some(found) if found == expected => Ok(()),
        Some(found) => {
            let mend = format!("name the file *.{0}, or say {1} {0}", found.extension(), Setting::ReadFormat);
            refuse(&format!("a file in the format {found}"), mend)
        }
        None if expected == RecordingFormat::Csv && text => Ok(()),
        None if text => {
            let line: String =
                String::from_utf8_lossy(&start).chars().take_while(|c| !c.is_control()).take(30).collect();
            let mend = match line.starts_with("time,") {
                true => format!("it looks like a table: name the file *.csv, or say {} csv", Setting::ReadFormat),
                false => "give a file that flexarm compare or run wrote".into(),
            };
            refuse(&format!("text, beginning {line:?}"), mend)
        }
        None => refuse("something else", "give a file that flexarm compare or run wrote".into()),
    }
}

/// UTF-8, perhaps with a character cut at the end.
trait OkOrCut {
    fn is_ok_or_cut(&self) -> bool;
}

impl OkOrCut for Result<&str, std::str::Utf8Error> {
    fn is_ok_or_cut(&self) -> bool {
        self.map_or_else(|error| error.error_len().is_none(), |_| true)
    }
}

/// A refusal in one's own words.
fn not_a_recording(path: &Path, found: impl Into<String>, expected: impl Into<String>) -> LogError {
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
fn stem(path: &Path) -> String {
    PathBuf::from(path.file_stem().unwrap_or_default()).display().to_string()
}

/// Time (s) and number of steps of a stamp. Stamps are whole nanoseconds; where the step is known, the time is that
/// multiple of it to the last bit.
#[cfg(any(feature = "mcap", feature = "rerun"))]
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
