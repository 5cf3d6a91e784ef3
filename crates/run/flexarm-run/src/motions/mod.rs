//! Motions of an arm, loads and payloads, and their files.

pub mod applied_load;
pub(crate) mod load_jumps;
pub mod loads_file;
pub mod motion;
pub(crate) mod motion_formats;
pub mod motion_report;
pub(crate) mod payload;
pub(crate) mod scenario;
pub mod tool_path;
