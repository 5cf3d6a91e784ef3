//! Chatter: limits of the depth of cut of a cutting tool on the flexible arm over the spindle
//! speed, at a pose or along a motion.
//!
//! At each pose the arm is a linear structure about its equilibrium, in series with the tool's own
//! modes (`place.rs`). The limits are those of [`milling`]. Start at [`lobes`].
//!
//! ```
//! use flexarm_chatter::{CuttingPlace, CuttingTool, LobesRequest, lobes};
//! use flexarm_run::Robot;
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let robot = Robot::load("robots/kr210")?;
//! let mut tool = CuttingTool::load("robots/tools/endmill_20mm.toml")?;
//! tool.rpm = vec![6000.0, 9000.0];
//! let found = lobes(&robot, &tool, &CuttingPlace::At(None), &LobesRequest::default(), &|_, _| true)?;
//! println!("stable up to {} m at {} rpm", found.best_depth_m, found.best_rpm);
//! # assert!(found.best_depth_m >= found.stable_below_m.unwrap_or(0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

mod caveats;
mod files;
pub mod milling;
mod place;
mod tool_file;

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use flexarm_files::check_free;
use flexarm_run::caveat::of_use;
use flexarm_run::{Error, ExternalError, Finding, Modelling, Motion, Robot, caveat};
use flexarm_settings::Quantity;
use rayon::prelude::*;
use serde::Serialize;

use crate::milling::{Kind, LimitOptions, limit_of_depth, unstable_ranges};

pub use crate::milling::ChatterError;
pub use caveats::{feed_caveat, tool_caveats};
pub use files::rounded_down;
pub use tool_file::CuttingTool;

use place::CutPose;

/// Poses at which the tool cuts.
#[derive(Clone, Debug)]
pub enum CuttingPlace<'a> {
    /// One pose: all actuated joints (rad or m), zero if `None`.
    At(Option<&'a [f64]>),
    /// A number of poses along a motion, at equal intervals of time where the tool moves. The feed
    /// follows the motion unless the tool gives one.
    Along(&'a Motion, usize),
}

/// Arguments of [`lobes`].
#[derive(Clone, Debug, Default)]
pub struct LobesRequest {
    /// Modelling of links and drives.
    pub modelling: Modelling,
    /// Maximum depth of cut (m); that of the tool if absent.
    pub deepest_m: Option<f64>,
    /// Whether to find all unstable ranges of depth at each speed, not only the lowest limit (at a
    /// pose).
    pub ranges: bool,
    /// Folder of the output files; none are written if absent.
    pub output: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Result of `flexarm lobes`. SI units, spindle speeds in 1/min.
#[derive(Clone, Debug, Serialize)]
pub struct Lobes {
    /// Name of the robot.
    pub robot: String,
    /// Name of the tool.
    pub tool: String,
    /// Joints, in coordinate order.
    pub joints: Vec<String>,
    /// Maximum depth of cut in the search (m).
    pub deepest_m: f64,
    /// Minimum limit over all poses, one per speed.
    pub points: Vec<LobePoint>,
    /// Depth below which the cut is stable at every speed (m); null if it never chatters.
    pub stable_below_m: Option<f64>,
    /// Speed of this limit (1/min).
    pub stable_below_at_rpm: Option<f64>,
    /// Speed with the maximum stable depth of cut (1/min).
    pub best_rpm: f64,
    /// Maximum stable depth of cut at this speed (m); [`Self::deepest_m`] if it does not chatter.
    pub best_depth_m: f64,
    /// Limits at each pose.
    pub poses: Vec<PoseLobes>,
    /// Description of the first pose, for output.
    #[serde(skip)]
    pub(crate) pose_in_words: String,
    /// Number of poses of the motion that are left out: the tool is at rest or moves along its
    /// axis.
    pub left_out: usize,
    /// Path of the table; null if nothing was written.
    pub file: Option<String>,
    /// Output files.
    pub files: LobesFiles,
    /// Sentences of the caveats that are warnings.
    pub warnings: Vec<String>,
    /// Caveats about the input and the validity of the result.
    pub caveats: Vec<Finding>,
}

/// Stability limit.
#[derive(Clone, Debug, Serialize)]
pub struct LobePoint {
    /// Spindle speed (1/min).
    pub spindle_rpm: f64,
    /// Depth above which the cut chatters (m); null if it is stable up to the maximum depth.
    pub depth_m: Option<f64>,
    /// Frequency of the largest component of the tip's motion at the limit (Hz).
    pub chatter_hz: Option<f64>,
    /// Type of bifurcation: `hopf` (independent frequency) or `flip` (period of two teeth).
    pub kind: Option<&'static str>,
    /// Index of the pose.
    pub pose: usize,
    /// All unstable ranges of depth (m), if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unstable_m: Vec<[f64; 2]>,
}

/// Limits at one pose.
#[derive(Clone, Debug, Serialize)]
pub struct PoseLobes {
    /// Joint values (rad or m).
    pub at: Vec<f64>,
    /// Time of the pose in the motion (s).
    pub time_s: Option<f64>,
    /// Direction of the feed, world axes.
    pub feed: [f64; 3],
    /// Direction from the spindle to the tip, world axes.
    pub axis: [f64; 3],
    /// Lowest natural frequencies of arm and tool (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Static compliance along the feed, across it, and along the tool's axis (m/N).
    pub compliance: [f64; 3],
    /// Minimum limit over all speeds (m); null if the cut never chatters.
    pub stable_below_m: Option<f64>,
    /// Speed of this limit (1/min).
    pub stable_below_at_rpm: Option<f64>,
    /// Limit at each speed (m).
    pub depth_m: Vec<Option<f64>>,
}

/// Output files; null for files that were not written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LobesFiles {
    /// Table.
    pub csv: Option<String>,
    /// Diagram.
    pub plot: Option<String>,
    /// HTML page.
    pub page: Option<String>,
    /// Result as JSON.
    pub json: Option<String>,
}

/// Reason why limits cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LobesError {
    /// Error of the structure or the cut.
    #[error(
        "{place}: {source}{}",
        if matches!(source, ChatterError::Undamped { .. }) {
            "; add damping to the links and drives of the robot"
        } else {
            ""
        }
    )]
    Chatter {
        /// Description of the pose.
        place: String,
        /// Cause.
        source: ChatterError,
    },
    /// The feed is parallel to the tool's axis.
    #[error("the feed is parallel to the tool axis: set a feed direction across the axis (feed = [...] in [tool])")]
    FeedAlongAxis,
    /// Nothing is elastic, the feed is unknown, or a number is out of range.
    #[error("{0}")]
    Input(String),
    /// A spindle speed is not a positive number.
    #[error("the spindle speed is {found} 1/min, expected a positive number")]
    Speed {
        /// Value found (1/min).
        found: f64,
    },
}

impl From<LobesError> for flexarm_run::Error {
    fn from(error: LobesError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for LobesError {}

/// Computes the limits of depth at a pose or along a motion.
///
/// `go_on` receives the numbers of finished limits and of all limits; it stops the computation by
/// returning `false`.
///
/// # Errors
/// [`LobesError`] if nothing is flexible or the feed is invalid; [`Error::Pose`], [`Error::Step`]
/// for poses without an equilibrium; [`Error::Interrupted`]; errors of files.
pub fn lobes(
    robot: &Robot,
    tool: &CuttingTool,
    place: &CuttingPlace<'_>,
    request: &LobesRequest,
    go_on: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<Lobes, Error> {
    // Numbers and files first: the computation takes long.
    let deepest_m = request.deepest_m.unwrap_or(tool.deepest);
    check_deepest(deepest_m)?;
    check_speeds(&tool.rpm)?;
    let paths = request.output.as_ref().map(|folder| files::NAMES.map(|name| folder.join(name)));
    check_free(paths.as_ref().map_or(&[], |paths| paths.as_slice()), request.overwrite)?;

    // Every speed at every pose, on all cores.
    let (places, left_out) = match place {
        CuttingPlace::At(at) => (vec![CutPose::at(robot, &request.modelling, tool, *at)?], 0),
        CuttingPlace::Along(motion, n) => CutPose::along(robot, &request.modelling, tool, motion, *n)?,
    };
    let (speeds, done) = (tool.rpm.len(), AtomicUsize::new(0));
    let limit = |k: usize| {
        let at = &places[k / speeds];
        let point = point(at, tool, tool.rpm[k % speeds], deepest_m, request.ranges, k / speeds);
        if !go_on(done.fetch_add(1, Ordering::Relaxed) + 1, speeds * places.len()) {
            return Err(Error::Interrupted { t: at.time_s.unwrap_or(0.0), partial: false });
        }
        point.map_err(|source| LobesError::Chatter { place: at.words(), source }.into())
    };
    let all: Vec<LobePoint> = (0..speeds * places.len()).into_par_iter().map(limit).collect::<Result<_, Error>>()?;
    // The result with its caveats.
    let mut answer = assembled(robot, tool, &places, &all, deepest_m);
    answer.left_out = left_out;
    if let CuttingPlace::Along(motion, _) = place {
        answer.caveats = of_use::of_motion(motion, &*robot.rigid_model()?);
        answer.caveats.extend(feed_caveat(robot, tool, motion)?);
    }
    answer.caveats.extend(places.iter().flat_map(CutPose::caveats));
    answer.caveats = caveat::once_each(std::mem::take(&mut answer.caveats));
    answer.caveats.extend(tool_caveats(tool, deepest_m));
    answer.warnings = caveat::warnings(&answer.caveats);
    if let Some(paths) = paths {
        files::save(&mut answer, tool, paths)?;
    }
    Ok(answer)
}

/// Computes the limit at a pose and a spindle speed (1/min), and all unstable ranges with `ranges`.
///
/// * `pose`: index of the pose.
fn point(
    place: &CutPose,
    tool: &CuttingTool,
    rpm: f64,
    deepest_m: f64,
    ranges: bool,
    pose: usize,
) -> Result<LobePoint, ChatterError> {
    let spindle = TAU * rpm / 60.0;
    let mut point =
        LobePoint { spindle_rpm: rpm, depth_m: None, chatter_hz: None, kind: None, pose, unstable_m: Vec::new() };
    let options = LimitOptions::to(deepest_m);
    if let Some(limit) = limit_of_depth(&place.structure, &tool.cutter, spindle, &options)? {
        point.depth_m = Some(limit.depth);
        point.chatter_hz = Some(limit.chatter_hz);
        point.kind = Some(if limit.kind == Kind::Flip { "flip" } else { "hopf" });
        if ranges {
            let found = unstable_ranges(&place.structure, &tool.cutter, spindle, &options)?;
            point.unstable_m = found.into_iter().map(|(low, high)| [low, high]).collect();
        }
    }
    Ok(point)
}

fn check_speeds(rpm: &[f64]) -> Result<(), Error> {
    if let Some(found) = rpm.iter().copied().find(|rpm| !(rpm.is_finite() && *rpm > 0.0)) {
        return Err(LobesError::Speed { found }.into());
    }
    Ok(Quantity::SPEED.check_all("the spindle speed", rpm)?)
}

fn check_deepest(depth_m: f64) -> Result<(), Error> {
    if !(depth_m.is_finite() && depth_m > 0.0) {
        return Err(
            LobesError::Input(format!("the maximum depth of cut is {depth_m} m, expected a positive number")).into()
        );
    }
    Quantity::LENGTH.check("the maximum depth of cut", depth_m)?;
    Ok(())
}

/// Returns the minimum limit of depth at a pose over all speeds of the tool (m): the maximum depth
/// if the cut never chatters, NaN if the feed is parallel to the tool's axis.
///
/// `go_on` is called before each speed; it stops the computation by returning `false`.
///
/// # Errors
/// As [`lobes`] at a pose.
pub fn lowest_limit(
    robot: &Robot,
    modelling: &Modelling,
    tool: &CuttingTool,
    q: &[f64],
    go_on: &dyn Fn() -> bool,
) -> Result<f64, Error> {
    check_speeds(&tool.rpm)?;
    let place = match CutPose::at(robot, modelling, tool, Some(q)) {
        Err(error) if error.external() == Some(&LobesError::FeedAlongAxis) => return Ok(f64::NAN),
        other => other?,
    };
    let mut lowest = tool.deepest;
    for rpm in &tool.rpm {
        if !go_on() {
            return Err(Error::Interrupted { t: 0.0, partial: false });
        }
        let found = point(&place, tool, *rpm, tool.deepest, false, 0)
            .map_err(|source| LobesError::Chatter { place: place.words(), source })?;
        lowest = lowest.min(found.depth_m.unwrap_or(lowest));
    }
    Ok(lowest)
}

/// Returns the smaller of two limits; no limit counts as infinite.
fn lower<'p>(a: &'p LobePoint, b: &'p LobePoint) -> &'p LobePoint {
    let depth = |p: &LobePoint| p.depth_m.unwrap_or(f64::INFINITY);
    if depth(b) < depth(a) { b } else { a }
}

/// Returns the result without caveats and files.
///
/// * `all`: limits, speed after speed for each pose.
fn assembled(robot: &Robot, tool: &CuttingTool, places: &[CutPose], all: &[LobePoint], deepest_m: f64) -> Lobes {
    // Per pose the lowest limit of all speeds.
    let speeds = tool.rpm.len();
    let of_pose = |k: usize| &all[k * speeds..(k + 1) * speeds];
    let lowest = |points: &[LobePoint]| points.iter().reduce(lower).filter(|p| p.depth_m.is_some()).cloned();
    let poses = places.iter().enumerate().map(|(k, place)| {
        let low = lowest(of_pose(k));
        PoseLobes {
            at: place.pose().to_vec(),
            time_s: place.time_s,
            feed: place.feed.into(),
            axis: place.axis.into(),
            frequencies_hz: place.frequencies_hz(),
            compliance: std::array::from_fn(|i| place.structure.frequency_response(0.0)[(i, i)].re),
            stable_below_m: low.as_ref().and_then(|p| p.depth_m),
            stable_below_at_rpm: low.map(|p| p.spindle_rpm),
            depth_m: of_pose(k).iter().map(|p| p.depth_m).collect(),
        }
    });
    // Per speed the lowest limit of all poses; the best speed is the one with the highest.
    let smallest = |i: usize| (0..places.len()).map(|k| &of_pose(k)[i]).reduce(lower).cloned();
    let points: Vec<LobePoint> = (0..speeds).filter_map(smallest).collect();
    let deepest = |p: &&LobePoint| p.depth_m.unwrap_or(f64::INFINITY);
    let best = points.iter().max_by(|a, b| deepest(a).total_cmp(&deepest(b)));
    let low = lowest(&points);
    Lobes {
        robot: robot.name.clone(),
        tool: tool.name.clone(),
        joints: places.first().map_or_else(Vec::new, |place| place.joints().to_vec()),
        deepest_m,
        stable_below_m: low.as_ref().and_then(|p| p.depth_m),
        stable_below_at_rpm: low.map(|p| p.spindle_rpm),
        best_rpm: best.map_or(0.0, |p| p.spindle_rpm),
        best_depth_m: best.map_or(0.0, |p| p.depth_m.unwrap_or(deepest_m)),
        points,
        poses: poses.collect(),
        pose_in_words: places.first().map_or_else(String::new, CutPose::words),
        left_out: 0,
        file: None,
        files: LobesFiles::default(),
        warnings: Vec::new(),
        caveats: Vec::new(),
    }
}

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::milling::leading::{SMALL as LARGEST_MATRIX, largest, leading};
    pub use crate::milling::moments::{Moments, NODES, RULE, Rule};
    pub use crate::milling::period::{Period, PeriodMap};
}
