//! Recordings, studies and reports that cannot be made of what is given.

use std::path::PathBuf;

use flexarm_log::RecordingFormat;
use flexarm_settings::Setting;

/// A recording that cannot be read, written or reported as asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file name of no known format.
    #[error(
        "{}: the name has {}, expected one of {}: rename the file{}",
        path.display(), ending(path), endings(), or_say(*setting)
    )]
    UnknownEnding {
        /// The file.
        path: PathBuf,
        /// Setting that chooses the format independently of the name.
        setting: Option<Setting>,
    },
    /// A format that was left out when the program was built.
    #[error("{}: this program was built without {format}; use a build with it", path.display())]
    NotBuiltIn {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: RecordingFormat,
    },
    /// A recording is wanted of a program that was built without its format.
    #[error("this program was built without {format}; use a build with it")]
    WithoutFormat {
        /// The format.
        format: RecordingFormat,
    },
    /// A conversion of a file into itself.
    #[error("{} is input and output: give the output another name", path.display())]
    SameFile {
        /// The file.
        path: PathBuf,
    },
    /// A report that would replace what it is made of.
    #[error(
        "{} is a recording and the page to be written: give the page another name with {}",
        path.display(),
        Setting::Output
    )]
    PageOverRecording {
        /// The file.
        path: PathBuf,
    },
    /// A report of nothing.
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

/// Runs of a study with equal or unusable labels.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A study without runs.
    #[error("a study needs at least one run")]
    Empty,
    /// A label that is empty, or another run's.
    #[error(
        "the label {label:?} names two runs of the study, or none: give each {} a name=... of its own",
        Setting::Variant
    )]
    LabelTwice {
        /// The label.
        label: String,
    },
    /// A label that is the name of a file of the study.
    #[error("the label {label:?} is the name of a file of the study: give its {} another name=...", Setting::Variant)]
    LabelOfFile {
        /// The label.
        label: String,
    },
    /// A label that is too long for the name of a folder.
    #[error(
        "the label {label:?} has {letters} letters, at most {most} make a folder: give its {} a short name=...",
        Setting::Variant
    )]
    LongLabel {
        /// The label.
        label: String,
        /// Letters of the folder's name.
        letters: usize,
        /// Maximum length (characters).
        most: usize,
    },
}
