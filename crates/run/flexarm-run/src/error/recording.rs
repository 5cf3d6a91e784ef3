//! Errors about recordings, studies and reports.

use std::path::PathBuf;

use flexarm_log::RecordingFormat;
use flexarm_settings::Setting;

/// A recording cannot be read, written or reported as requested.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file name does not identify a format.
    #[error(
        "{}: the name has {}, expected one of {}: rename the file{}",
        path.display(), ending(path), endings(), or_say(*setting)
    )]
    UnknownEnding {
        /// Path of the file.
        path: PathBuf,
        /// Setting that gives the format regardless of the name.
        setting: Option<Setting>,
    },
    /// No format has this name.
    #[error("expected one of {}", RecordingFormat::ALL.map(RecordingFormat::extension).join(", "))]
    UnknownFormat,
    /// The program was built without this format.
    #[error("{}: this program was built without {format}; use a build with it", path.display())]
    NotBuiltIn {
        /// Path of the file.
        path: PathBuf,
        /// Format of the file.
        format: RecordingFormat,
    },
    /// A recording is requested in a format without which the program was built.
    #[error("this program was built without {format}; use a build with it")]
    WithoutFormat {
        /// Requested format.
        format: RecordingFormat,
    },
    /// No recording is given for a report.
    #[error("give at least one recording, or the folder of a run")]
    NothingToReport,
}

fn ending(path: &std::path::Path) -> String {
    path.extension().map_or("no ending".into(), |e| format!("the ending .{}", e.to_string_lossy()))
}

fn endings() -> String {
    RecordingFormat::ALL.map(|format| format!(".{}", format.extension())).join(", ")
}

fn or_say(setting: Option<Setting>) -> String {
    setting.map_or_else(String::new, |setting| format!(" or give its format with {setting}"))
}
