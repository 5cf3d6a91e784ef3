//! Tables of a path file, as written, in the units that the file declares.
//!
//! `docs/motions.md` describes the keys. Not here: their conversion and checks (`file`).

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;

use super::standard::Standard;

/// Path file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PathFile {
    pub(super) format: Spanned<i64>,
    pub(super) path: PathTable,
    #[serde(default)]
    pub(super) limits: BTreeMap<Spanned<String>, LimitsTable>,
    #[serde(rename = "move", default)]
    pub(super) moves: Vec<Spanned<MoveTable>>,
    pub(super) standard: Option<Spanned<StandardTable>>,
    pub(super) program: Option<Spanned<ProgramTable>>,
}

/// `[program]`: a robot program instead of moves, with values for what the program leaves
/// undefined.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProgramTable {
    /// Path of the program, relative to this file.
    pub(super) file: Spanned<PathBuf>,
    /// Routine to start with.
    pub(super) entry: Option<String>,
    /// Joint values at the start.
    pub(super) start: Option<Vec<f64>>,
    /// Values of names that the program leaves undefined, in the program's language.
    #[serde(default)]
    pub(super) given: BTreeMap<String, String>,
    #[serde(default)]
    pub(super) waits_are_over: bool,
    pub(super) endless_passes: Option<usize>,
    /// G-code: orientation of the tool in the work frame.
    pub(super) rpy: Option<[f64; 3]>,
    pub(super) quaternion: Option<[f64; 4]>,
    /// G-code: whether A, B and C tilt the tool.
    #[serde(default)]
    pub(super) tilt: bool,
    /// G-code: speed of rapids, which become straight lines.
    pub(super) rapid: Option<f64>,
    /// G-code: whether the tool centre point is the tip of the tool.
    #[serde(default)]
    pub(super) tip_is_known: bool,
}

/// `[standard]`: a named motion instead of moves.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StandardTable {
    pub(super) motion: Standard,
    /// Centre of the cube, in the base.
    pub(super) centre: [f64; 3],
    /// Side of the cube, diameter of the circles, or length of the moves.
    pub(super) side: Spanned<f64>,
    pub(super) rpy: Option<[f64; 3]>,
    pub(super) quaternion: Option<[f64; 4]>,
    pub(super) near: Option<Vec<f64>>,
    pub(super) repeats: Option<usize>,
}

/// `[path]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PathTable {
    /// "m" or "mm".
    pub(super) lengths: Spanned<String>,
    /// "rad" or "deg".
    pub(super) angles: Spanned<String>,
    pub(super) base: Option<Spanned<FrameTable>>,
    pub(super) tool: Option<Spanned<FrameTable>>,
    /// Rise time of the accelerations (s).
    pub(super) rise: Option<Spanned<f64>>,
    /// Use of the joints that the path leaves free.
    pub(super) redundancy: Option<Spanned<Redundancy>>,
    pub(super) speed: Option<f64>,
    pub(super) acceleration: Option<f64>,
    pub(super) jerk: Option<f64>,
    pub(super) turning: Option<f64>,
    pub(super) turning_acceleration: Option<f64>,
    pub(super) joint_speed: Option<f64>,
    pub(super) joint_acceleration: Option<f64>,
    pub(super) blend: Option<f64>,
}

/// `redundancy` of `[path]`: a word, or joint values.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Redundancy {
    Word(String),
    Posture(Vec<f64>),
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameTable {
    pub(super) xyz: [f64; 3],
    pub(super) rpy: Option<[f64; 3]>,
    pub(super) quaternion: Option<[f64; 4]>,
}

/// One entry of `[limits]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LimitsTable {
    pub(super) velocity: Option<Spanned<f64>>,
    pub(super) acceleration: Option<Spanned<f64>>,
    pub(super) jerk: Option<Spanned<f64>>,
    pub(super) torque: Option<Spanned<f64>>,
}

/// One `[[move]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MoveTable {
    /// Joint move to joint values.
    pub(super) joints: Option<Spanned<Vec<f64>>>,
    /// Joint move to a TCP pose.
    pub(super) joint_to: Option<Spanned<[f64; 3]>>,
    pub(super) line: Option<Spanned<[f64; 3]>>,
    pub(super) arc: Option<Spanned<[f64; 3]>>,
    pub(super) spline: Option<Spanned<Vec<Vec<f64>>>>,
    /// Dwell time (s).
    pub(super) dwell: Option<Spanned<f64>>,
    pub(super) via: Option<Spanned<[f64; 3]>>,
    pub(super) angle: Option<f64>,
    pub(super) turns_with_path: Option<bool>,
    pub(super) rpy: Option<[f64; 3]>,
    pub(super) quaternion: Option<Spanned<[f64; 4]>>,
    pub(super) near: Option<Vec<f64>>,
    pub(super) duration: Option<f64>,
    pub(super) speed: Option<f64>,
    pub(super) acceleration: Option<f64>,
    pub(super) jerk: Option<f64>,
    pub(super) turning: Option<f64>,
    pub(super) turning_acceleration: Option<f64>,
    pub(super) joint_speed: Option<f64>,
    pub(super) joint_acceleration: Option<f64>,
    pub(super) blend: Option<f64>,
}
