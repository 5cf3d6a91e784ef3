//! Recorders: write a run of the simulator to CSV, Parquet and MCAP files, and read it back.
//!
//! A run hands over one [`RunHeader`], then [`Sample`]s, then its result figures; every
//! [`Recorder`] takes the same three calls, and [`RecorderSet`] passes them to several files at
//! once. Start at [`CsvRecorder`] for tables (`ParquetRecorder`, feature `parquet`, for the same
//! table as Parquet), `McapRecorder` (feature `mcap`) for ROS 2 tools, Foxglove and PlotJuggler,
//! the crate `flexarm-rerun` for the Rerun viewer with meshes and a layout ([`RrdWriter`]).
//!
//! To read a file, start at [`open_recording`]: a [`RunSource`] gives header, samples and result,
//! for reports and for other formats. [`RecordingFormat::lost_on_the_way_to`] lists what a format
//! cannot hold.
//!
//! Guarantees of all recorders:
//! * a file is created by [`Recorder::begin`] and replaces an existing one only if
//!   [`CreateOptions::overwrite`] is set;
//! * a killed run loses at most the samples since the last flush ([`CreateOptions::flush_every`];
//!   in an MCAP file the last chunk), and the rest can be read; formats without
//!   [`FormatInfo::survives_a_kill`] are written under another name and are either complete or
//!   absent;
//! * the same samples give the same bytes, on any day and at any speed: nothing in a file depends
//!   on the clock. An `.rrd` file has the same content, but Rerun's SDK draws chunk identifiers
//!   from clock and random numbers.
//!
//! Not here: the meaning of the numbers (`flexarm-analysis`), running the simulation (`flexarm`).
//!
//! ```
//! use flexarm_log::*;
//!
//! let path = std::env::temp_dir().join(format!("flexarm-log-{}.csv", std::process::id()));
//! let header = RunHeader { joints: vec!["joint_1".into()], ..RunHeader::default() };
//! let mut recorder = CsvRecorder::create(&path, CreateOptions::default());
//! recorder.begin(&header)?;
//! for step in 0..3_u64 {
//!     let time_s = step as f64 * 1e-3;
//!     let flexible = TwinSample { q: vec![2.0 * time_s], qdot: vec![2.0], effort: vec![0.5], ..Default::default() };
//!     recorder.record(&Sample { time_s, step, flexible, ..Sample::default() })?;
//! }
//! let figures = vec![("tcp.peak_m".into(), "0.0".into())];
//! recorder.finish(&RunResult { figures, ..RunResult::default() })?;
//!
//! let text = std::fs::read_to_string(&path)?;
//! assert!(text.starts_with("time,flexible_x_m,flexible_y_m,flexible_z_m,joint_1_position_rad,joint_1_effort,"));
//! assert_eq!(text.lines().count(), 4);
//!
//! // A second run does not silently replace the first.
//! let again = CsvRecorder::create(&path, CreateOptions::default()).begin(&header);
//! assert!(again.unwrap_err().to_string().contains("overwrite"));
//! # std::fs::remove_file(&path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]

mod create;
mod csv_file;
mod data_table;
#[cfg(feature = "parquet")]
mod described_table;
mod error;
mod file_recorder;
mod flat;
mod formats;
#[cfg(feature = "mcap")]
mod mcap_file;
mod multi;
#[cfg(feature = "parquet")]
mod parquet_file;
mod poses;
mod read;
mod record;
#[cfg(any(feature = "mcap", feature = "parquet"))]
mod run_json;
mod shape;
mod table;
mod threads;
mod trace;
mod trace_blocks;
#[cfg(feature = "parquet")]
mod whole_file;
mod written_behind;

pub use create::{CreateOptions, FlushClock};
pub use csv_file::CsvRecorder;
pub use data_table::{DataColumn, DataTable, DataValues};
pub use error::LogError;
pub use file_recorder::{FileRecorder, OpenFile};
pub use flat::flat_columns;
pub use flexarm_sample::*;
pub use formats::*;
#[cfg(feature = "mcap")]
pub use mcap_file::McapRecorder;
#[cfg(feature = "mcap")]
pub use mcap_file::bag::rosbag2_metadata;
#[cfg(feature = "mcap")]
pub use mcap_file::layouts::{foxglove_layout, plotjuggler_layout};
pub use multi::RecorderSet;
#[cfg(feature = "parquet")]
pub use parquet_file::ParquetRecorder;
pub use poses::{PoseClock, PoseReasons};
pub use record::*;
pub use shape::Shape;
pub use trace::{RunSource, Trace, TraceRow};
pub use trace_blocks::CurveQuantity;

/// Kernels that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    #[cfg(feature = "mcap")]
    pub use crate::mcap_file::beat::Beat;
    #[cfg(feature = "mcap")]
    pub use crate::mcap_file::bent::{BentLink, INNER};
    #[cfg(feature = "mcap")]
    pub use crate::mcap_file::channels::topic_names;
    #[cfg(feature = "mcap")]
    pub use crate::mcap_file::markers::{MAX_POINTS, Path, thinned};
    #[cfg(feature = "mcap")]
    pub use crate::mcap_file::messages::{decode, encode};
    #[cfg(feature = "mcap")]
    pub use crate::mcap_file::output::WholeRecords;
    #[cfg(feature = "mcap")]
    pub use crate::poses::{PoseClock, PoseReasons};
    #[cfg(any(feature = "mcap", feature = "parquet"))]
    pub use crate::read::wall::{CAUGHT, caught};
    pub use crate::written_behind::{CACHED, REACH, WrittenBehind};
}
