//! The formats of recordings: a row of [`FORMATS`] each, and nothing about a format is said
//! anywhere else.
//!
//! A format is its module and its row. From the row come the files of a run, the words of
//! `convert`, what reports look for, the keys of summaries and the flags of the command line. Start
//! at [`RecordingFormat`]; [`open_recording`] is the way back.
//!
//! | format | what comes back |
//! | --- | --- |
//! | MCAP | everything; numbers exactly, poses of links to 1e-13 (they are stored as quaternions from link to link) |
//! | Parquet, Arrow | the numbers of the columns exactly; names, set-up, result and events; no poses of links, no velocities |
//! | CSV | the numbers of the columns exactly (times to 1 ns once they went through MCAP); no poses, velocities, result, nor names of robot and trajectory |
//! | .rrd | nothing: it is for viewing |

#[cfg(feature = "arrow")]
mod arrow_file;
mod open;

use std::fmt;
use std::path::{Path, PathBuf};

#[cfg(feature = "arrow")]
pub use self::arrow_file::ArrowRecorder;
pub use self::open::open_recording;
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
    /// Apache Arrow IPC, also called Feather, version 2.
    Arrow,
}

/// The module of a format, if this build has its feature: its recorder and, where it is read back,
/// its reader.
macro_rules! code {
    ($recorder:ty) => {
        Some(Code { recorder: |path, options| Box::new(<$recorder>::create(path, options)), reader: None })
    };
    ($recorder:ty, $reader:ty) => {
        Some(Code {
            recorder: |path, options| Box::new(<$recorder>::create(path, options)),
            reader: Some(|path| Ok(Box::new(<$reader>::open(path)?))),
        })
    };
    ($feature:literal, $($types:ty),+) => {{
        #[cfg(feature = $feature)]
        let code = code!($($types),+);
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
        other_extensions: &[],
        file_name: "run.mcap",
        magic: b"\x89MCAP",
        holds: Holds::Everything,
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
        other_extensions: &[],
        file_name: "run.rrd",
        magic: b"RRF",
        holds: Holds::Pictures,
        by_default: true,
        feature: Some("rerun"),
        survives_a_kill: true,
        most_samples: None,
        latest_s: Some(i64::MAX as f64 * 1e-9),
        code: code!("rerun", crate::RrdRecorder),
    },
    FormatInfo {
        format: RecordingFormat::Csv,
        name: "CSV",
        extension: "csv",
        other_extensions: &[],
        file_name: "run.csv",
        magic: b"",
        holds: Holds::Table,
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
        other_extensions: &[],
        file_name: "run.parquet",
        magic: b"PAR1",
        holds: Holds::DescribedTable,
        by_default: false,
        feature: Some("parquet"),
        survives_a_kill: false,
        most_samples: Some(16_384 * i16::MAX as u64), // row groups are counted in 16 bits
        latest_s: None,
        code: code!("parquet", crate::ParquetRecorder, crate::read::ParquetRun),
    },
    FormatInfo {
        format: RecordingFormat::Arrow,
        name: "Arrow",
        extension: "arrow",
        other_extensions: &["feather"],
        file_name: "run.arrow",
        magic: b"ARROW1",
        holds: Holds::DescribedTable,
        by_default: false,
        feature: Some("arrow"),
        survives_a_kill: false,
        most_samples: None,
        latest_s: None,
        code: code!("arrow", arrow_file::ArrowRecorder, arrow_file::ArrowRun),
    },
];

/// What there is to know of a format: its row in the table of formats.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FormatInfo {
    /// Which one it is.
    pub format: RecordingFormat,
    /// What people call it.
    pub name: &'static str,
    /// Ending of file names, without the dot; also its word on command lines and its key in
    /// summaries.
    pub extension: &'static str,
    /// Endings that are understood besides.
    pub other_extensions: &'static [&'static str],
    /// Name of its file in the folder of a run.
    pub file_name: &'static str,
    /// First bytes of every file; none for text.
    pub magic: &'static [u8],
    /// How much of a run it holds.
    pub holds: Holds,
    /// Whether a run writes it without being asked to.
    pub by_default: bool,
    /// Feature of this crate that brings it; every build has one without.
    pub feature: Option<&'static str>,
    /// Whether what a killed run leaves can be read; otherwise the file is there whole or not at
    /// all.
    pub survives_a_kill: bool,
    /// Most samples that a file can hold.
    pub most_samples: Option<u64>,
    /// Latest time of a sample that a file can hold (s), for a run that begins at
    /// [`crate::START_NS`].
    pub latest_s: Option<f64>,
    code: Option<Code>,
}

/// How much of a run a format holds, most first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Holds {
    /// Every number of every sample, poses (of links at most 200 a second), surfaces, and what is
    /// said about the run.
    Everything,
    /// A table of scalars with names, set-up, result and events.
    DescribedTable,
    /// A table of scalars alone.
    Table,
    /// Curves, and pictures in single precision.
    Pictures,
}

impl Holds {
    fn is_table(self) -> bool {
        matches!(self, Self::DescribedTable | Self::Table)
    }
}

type Reader = fn(&Path) -> Result<Box<dyn RunSource>, LogError>;

/// How files of a format are opened.
#[derive(Clone, Copy, Debug)]
struct Code {
    recorder: fn(PathBuf, CreateOptions) -> Box<dyn Recorder>,
    /// None for formats that are only written.
    reader: Option<Reader>,
}

impl RecordingFormat {
    /// All of them.
    pub const ALL: [Self; FORMATS.len()] = {
        let mut all = [Self::Mcap; FORMATS.len()];
        let mut k = 0;
        while k < FORMATS.len() {
            all[k] = FORMATS[k].format;
            k += 1;
        }
        all
    };

    /// What there is to know of it.
    #[must_use]
    pub fn info(self) -> &'static FormatInfo {
        &FORMATS[self as usize]
    }

    /// The ending of file names, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        self.info().extension
    }

    /// The format that the ending of a file name says.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        Self::from_word(path.extension()?.to_str()?)
    }

    /// The format with this ending, in small or capital letters.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        let word = word.to_ascii_lowercase();
        let has = |info: &&FormatInfo| info.extension == word || info.other_extensions.contains(&word.as_str());
        FORMATS.iter().find(has).map(|info| info.format)
    }

    /// Returns the formats that are read back; those that hold most come first.
    #[must_use]
    pub fn read_back() -> Vec<Self> {
        let mut formats: Vec<Self> = Self::ALL.into_iter().filter(|format| format.is_read_back()).collect();
        formats.sort_by_key(|format| format.info().holds);
        formats
    }

    /// Whether recordings of this format are read back; others are for viewing.
    #[must_use]
    pub fn is_read_back(self) -> bool {
        self.info().holds != Holds::Pictures
    }

    /// Whether this build can write it and, where it is read back, read it.
    #[must_use]
    pub fn is_built_in(self) -> bool {
        self.info().code.is_some()
    }

    /// Whether it is a table of scalars.
    #[must_use]
    pub fn is_table(self) -> bool {
        self.info().holds.is_table()
    }

    /// A recorder that will write `path`; none if this build cannot
    /// ([`RecordingFormat::is_built_in`]).
    #[must_use]
    pub fn recorder(self, path: impl Into<PathBuf>, options: CreateOptions) -> Option<Box<dyn Recorder>> {
        self.info().code.map(|code| (code.recorder)(path.into(), options))
    }

    /// What is lost on the way from this format to another by their nature, as sentences.
    #[must_use]
    pub fn lost_on_the_way_to(self, to: Self, header: &RunHeader) -> Vec<String> {
        let (here, there) = (self.info().holds, to.info().holds);
        let mut lost = match (here.is_table(), there.is_table()) {
            (false, true) => table::left_out(header),
            (true, false) => table::unknown(header),
            _ => Vec::new(),
        };
        if there == Holds::Pictures && !here.is_table() {
            lost.push(format!("{to} files hold poses in single precision, at most 200 a second"));
        }
        if here == Holds::Table && there != Holds::Table {
            lost.push(format!(
                "{self} says neither robot nor trajectory, and has no set-up, result figures and events"
            ));
        }
        if there == Holds::Table && here != Holds::Table {
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
