//! Formats of recordings: one row of [`FORMATS`] each, the only place with facts about a format.
//!
//! A format is its module and its row. The row determines the files of a run, the words of
//! `convert`, the files that reports look for, the keys of summaries and the flags of the command
//! line. Start at [`RecordingFormat`]; [`open_recording`] reads a recording back.
//!
//! | format | contents read back |
//! | --- | --- |
//! | MCAP | everything; numbers exactly, poses of links to 1e-13 (stored as quaternions from link to link) |
//! | Parquet | the numbers of the columns exactly; names, set-up, result and events; no poses of links, no velocities |
//! | CSV | the numbers of the columns exactly (times to 1 ns once converted through MCAP); no poses, velocities, result, nor names of robot and trajectory |
//! | .rrd | nothing; for viewing only |

mod open;
mod rrd;

use std::fmt;
use std::path::{Path, PathBuf};

pub use self::open::open_recording;
pub use self::rrd::{RrdWriter, StudyRecorder, install_rrd_writer, study_recorder};
use crate::{CreateOptions, LogError, Recorder, RunHeader, RunSource, table};

/// Formats of recordings, in the order in which a run lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
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

/// Recorder and reader of a format; `None` if this build lacks its feature.
macro_rules! code {
    ($recorder:ty, $reader:ty) => {
        Some(Code {
            recorder: |path, options| Box::new(<$recorder>::create(path, options)),
            reader: Some(|path| Ok(Box::new(<$reader>::open(path)?))),
        })
    };
    ($feature:literal, $recorder:ty, $reader:ty) => {{
        #[cfg(feature = $feature)]
        let code = code!($recorder, $reader);
        #[cfg(not(feature = $feature))]
        let code = None;
        code
    }};
}

/// All formats, in the order of [`RecordingFormat`].
const FORMATS: &[FormatInfo] = &[
    FormatInfo {
        format: RecordingFormat::Mcap,
        name: "MCAP",
        extension: "mcap",
        file_name: "run.mcap",
        magic: b"\x89MCAP",
        content: ContentLevel::Everything,
        by_default: true,
        feature: Some("mcap"),
        survives_a_kill: true,
        most_samples: None,
        latest_s: Some(i32::MAX as f64 - 946_684_800.0), // ROS counts seconds in 32 bits; from the year 2000 on
        code: code!("mcap", crate::McapRecorder, crate::read::McapRun),
    },
    FormatInfo {
        format: RecordingFormat::Rrd,
        name: "Rerun",
        extension: "rrd",
        file_name: "run.rrd",
        magic: b"RRF",
        content: ContentLevel::Pictures,
        by_default: true,
        feature: Some("rerun"),
        survives_a_kill: true,
        most_samples: None,
        latest_s: Some(i64::MAX as f64 * 1e-9),
        code: None, // see install_rrd_writer
    },
    FormatInfo {
        format: RecordingFormat::Csv,
        name: "CSV",
        extension: "csv",
        file_name: "run.csv",
        magic: b"",
        content: ContentLevel::Table,
        by_default: true,
        feature: None,
        survives_a_kill: true,
        most_samples: None,
        latest_s: None,
        code: code!(crate::CsvRecorder, crate::read::CsvRun),
    },
    FormatInfo {
        format: RecordingFormat::Parquet,
        name: "Parquet",
        extension: "parquet",
        file_name: "run.parquet",
        magic: b"PAR1",
        content: ContentLevel::DescribedTable,
        by_default: false,
        feature: Some("parquet"),
        survives_a_kill: false,
        most_samples: Some(16_384 * i16::MAX as u64), // row groups are counted in 16 bits
        latest_s: None,
        code: code!("parquet", crate::ParquetRecorder, crate::read::ParquetRun),
    },
];

/// Facts about a format: its row in the table of formats.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FormatInfo {
    /// The format.
    pub format: RecordingFormat,
    /// Common name.
    pub name: &'static str,
    /// File name extension, without the dot; also the word on command lines and the key in
    /// summaries.
    pub extension: &'static str,
    /// File name in the folder of a run.
    pub file_name: &'static str,
    /// First bytes of every file; empty for text.
    pub magic: &'static [u8],
    /// Extent of the data that it holds.
    pub content: ContentLevel,
    /// Whether a run writes it by default.
    pub by_default: bool,
    /// Feature of the program that enables it; `None` if it is always available.
    pub feature: Option<&'static str>,
    /// Whether the file of a killed run can be read; otherwise there is either a complete file or
    /// none.
    pub survives_a_kill: bool,
    /// Maximum number of samples in a file.
    pub most_samples: Option<u64>,
    /// Maximum time of a sample (s), for a run that begins at
    /// [`crate::START_NS`].
    pub latest_s: Option<f64>,
    code: Option<Code>,
}

/// Extent of the data that a format holds, from most to least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ContentLevel {
    /// Every number of every sample, poses (of links at most 200 per second), surfaces, and the
    /// description of the run.
    Everything,
    /// A table of scalars with names, set-up, result and events.
    DescribedTable,
    /// A table of scalars only.
    Table,
    /// Curves, and poses in single precision.
    Pictures,
}

impl ContentLevel {
    fn is_table(self) -> bool {
        matches!(self, Self::DescribedTable | Self::Table)
    }
}

type Reader = fn(&Path) -> Result<Box<dyn RunSource>, LogError>;

/// Functions that open files of a format.
#[derive(Clone, Copy, Debug)]
struct Code {
    recorder: fn(PathBuf, CreateOptions) -> Box<dyn Recorder>,
    /// None for write-only formats.
    reader: Option<Reader>,
}

impl RecordingFormat {
    /// All formats.
    pub const ALL: [Self; FORMATS.len()] = {
        let mut all = [Self::Mcap; FORMATS.len()];
        let mut k = 0;
        while k < FORMATS.len() {
            all[k] = FORMATS[k].format;
            k += 1;
        }
        all
    };

    /// Returns the facts about the format.
    pub fn info(self) -> &'static FormatInfo {
        &FORMATS[self as usize]
    }

    /// Returns the file name extension, without the dot.
    pub fn extension(self) -> &'static str {
        self.info().extension
    }

    /// Returns the format of a file according to its extension.
    pub fn from_path(path: &Path) -> Option<Self> {
        Self::from_word(path.extension()?.to_str()?)
    }

    /// Returns the format with this extension, ignoring case.
    pub fn from_word(word: &str) -> Option<Self> {
        let word = word.to_ascii_lowercase();
        FORMATS.iter().find(|info| info.extension == word).map(|info| info.format)
    }

    /// Returns the formats that are read back, in the order of decreasing contents.
    pub fn read_back() -> Vec<Self> {
        let mut formats: Vec<Self> = Self::ALL.into_iter().filter(|format| format.is_read_back()).collect();
        formats.sort_by_key(|format| format.info().content);
        formats
    }

    /// Whether recordings of this format are read back; others are for viewing.
    pub fn is_read_back(self) -> bool {
        self.info().content != ContentLevel::Pictures
    }

    /// Whether this process can write the format and, if it is read back, read it. Recordings for
    /// the Rerun viewer need [`install_rrd_writer`], other formats a feature of this crate.
    pub fn is_built_in(self) -> bool {
        self.code().is_some()
    }

    fn code(self) -> Option<Code> {
        match self {
            Self::Rrd => rrd::writer().map(|writer| Code { recorder: writer.recorder, reader: None }),
            _ => self.info().code,
        }
    }

    /// Whether it is a table of scalars.
    pub fn is_table(self) -> bool {
        self.info().content.is_table()
    }

    /// Creates a recorder for `path`; `None` if the format is not available
    /// ([`RecordingFormat::is_built_in`]).
    pub fn recorder(self, path: impl Into<PathBuf>, options: CreateOptions) -> Option<Box<dyn Recorder>> {
        self.code().map(|code| (code.recorder)(path.into(), options))
    }

    /// Returns, as sentences, what a conversion from this format to another loses by their nature.
    pub fn lost_on_the_way_to(self, to: Self, header: &RunHeader) -> Vec<String> {
        let (here, there) = (self.info().content, to.info().content);
        let mut lost = match (here.is_table(), there.is_table()) {
            (false, true) => table::left_out(header),
            (true, false) => table::unknown(header),
            _ => Vec::new(),
        };
        if there == ContentLevel::Pictures && !here.is_table() {
            lost.push(format!("{to} files hold poses in single precision, at most 200 a second"));
        }
        if here == ContentLevel::Table && there != ContentLevel::Table {
            lost.push(format!(
                "{self} says neither robot nor trajectory, and has no set-up, result figures and events"
            ));
        }
        if there == ContentLevel::Table && here != ContentLevel::Table {
            lost.push(format!("{to} has no place for robot and trajectory, set-up, result figures and events"));
        }
        lost
    }
}

impl fmt::Display for RecordingFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.info().name)
    }
}
