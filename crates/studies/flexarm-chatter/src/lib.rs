//! Chatter: the limits of depth of a cutting tool on the flexible arm, over the spindle speed, at a
//! pose or along a motion.
//!
//! At each pose the arm is a linear structure about its equilibrium; the tool's own modes, or its
//! measured response, are in series with it (`place.rs`). The limits are those of [`milling`].
//! Start at [`lobes`]. [`cut`] follows one cut over time, on the arm as it moves.
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod caveats;
mod cut;
mod files;
mod measured;
pub mod milling;
mod place;
mod tool_file;

use flexarm_run::ExternalError;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::milling::{Kind, LimitOptions, limit_of_depth, unstable_ranges, zero_order_limit};
use flexarm_files::check_free;
use flexarm_settings::Quantity;
use rayon::prelude::*;
use serde::Serialize;

use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::Modelling;
use flexarm_run::Motion;
use flexarm_run::Robot;
use flexarm_run::ValueError;
use flexarm_run::caveat;
use flexarm_run::caveat::told;

pub use crate::milling::{ChatterError, Simulated};
pub use caveats::tool_caveats;
pub use cut::{CutRequest, CutRun, cut};
pub use files::rounded_down;
pub use tool_file::CuttingTool;

use place::Place;

/// Where the tool cuts.
#[derive(Clone, Debug)]
pub enum CuttingPlace<'a> {
    /// At a pose: all actuated joints (rad or m), zero without it.
    At(Option<&'a [f64]>),
    /// At so many places of a motion, evenly in time, where the tool moves; the feed is along the
    /// motion if the tool says none.
    Along(&'a Motion, usize),
}

/// How limits are looked for.
#[derive(Clone, Debug, Default)]
pub struct LobesRequest {
    /// Which links bend and how.
    pub modelling: Modelling,
    /// Deepest cut that is looked at (m); that of the tool without it.
    pub deepest_m: Option<f64>,
    /// The mean force alone (zero-order solution) instead of the multipliers of the tooth period.
    pub zero_order: bool,
    /// All unstable ranges of depth of each speed, not the lowest limit alone (at a pose).
    pub ranges: bool,
    /// Folder of the files; none without it.
    pub output: Option<PathBuf>,
    /// Overwrite what is there.
    pub overwrite: bool,
}

/// Answer of `flexarm lobes`. SI units, speeds in 1/min.
#[derive(Clone, Debug, Serialize)]
pub struct Lobes {
    /// Name of the robot.
    pub robot: String,
    /// Name of the tool.
    pub tool: String,
    /// Joints, in coordinate order.
    pub joints: Vec<String>,
    /// floquet or zero-order.
    pub method: &'static str,
    /// Deepest cut that was looked at (m).
    pub deepest_m: f64,
    /// One per speed: the smallest limit over all poses.
    pub points: Vec<LobePoint>,
    /// Below this depth the cut is stable at every speed that was asked for (m); null if nothing
    /// chatters.
    pub stable_below_m: Option<f64>,
    /// Speed of that limit (1/min).
    pub stable_below_at_rpm: Option<f64>,
    /// The speed with the deepest stable cut (1/min), and that (m); the deepest that was looked at
    /// where nothing chatters.
    pub best_rpm: f64,
    /// Its depth (m).
    pub best_depth_m: f64,
    /// What was found at each pose.
    pub poses: Vec<PoseLobes>,
    /// The first of them, for people.
    #[serde(skip)]
    pub(crate) pose_in_words: String,
    /// Places of the motion that were left out: the tool stands still there, or moves along its
    /// axis.
    pub left_out: usize,
    /// The table; null if nothing was written.
    pub file: Option<String>,
    /// Written files.
    pub files: LobesFiles,
    /// What the caveats warn of, as sentences.
    pub warnings: Vec<String>,
    /// What is probably wrong with the input, or limits the worth of the result.
    pub caveats: Vec<Caveat>,
}

/// A limit.
#[derive(Clone, Debug, Serialize)]
pub struct LobePoint {
    /// Spindle speed (1/min).
    pub spindle_rpm: f64,
    /// Depth above which the cut chatters (m); null if it does not, up to the deepest that was
    /// looked at.
    pub depth_m: Option<f64>,
    /// Frequency at which the tip then swings most (Hz).
    pub chatter_hz: Option<f64>,
    /// hopf (a frequency of its own) or flip (every second tooth cuts the same).
    pub kind: Option<&'static str>,
    /// Limit of the zero-order solution, for comparison (m).
    pub zero_order_depth_m: Option<f64>,
    /// Which pose it is of.
    pub pose: usize,
    /// All unstable ranges of depth (m), if asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unstable_m: Vec<[f64; 2]>,
}

/// Limits at one pose.
#[derive(Clone, Debug, Serialize)]
pub struct PoseLobes {
    /// Joints (rad or m).
    pub at: Vec<f64>,
    /// When the motion is there (s).
    pub time_s: Option<f64>,
    /// Direction of the feed, world axes.
    pub feed: [f64; 3],
    /// From the spindle to the tip, world axes.
    pub axis: [f64; 3],
    /// Lowest natural frequencies of arm and tool (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Compliance at rest along the feed, across it, and along the tool (m/N).
    pub compliance: [f64; 3],
    /// Lowest limit (m); null if nothing chatters.
    pub stable_below_m: Option<f64>,
    /// Its speed (1/min).
    pub stable_below_at_rpm: Option<f64>,
    /// Limit at each speed (m).
    pub depth_m: Vec<Option<f64>>,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LobesFiles {
    /// Table.
    pub csv: Option<String>,
    /// Diagram.
    pub plot: Option<String>,
    /// Page for the browser.
    pub page: Option<String>,
    /// This answer.
    pub json: Option<String>,
}

/// Why there are no lobes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LobesError {
    /// The structure or the cut.
    #[error("{place}: {source}{}", if matches!(source, ChatterError::Undamped { .. }) { "; give the links and drives of the robot damping" } else { "" })]
    Chatter {
        /// The pose, in words.
        place: String,
        /// Why.
        source: ChatterError,
    },
    /// Neither the arm nor the tool yields.
    #[error(
        "nothing yields: the robot has no flexible link and no elastic drive, and the tool no mode and no measured response"
    )]
    NothingYields,
    /// The feed goes along the tool.
    #[error("the feed is along the tool's axis: give the tool a feed across its axis (feed = [...] in [tool])")]
    FeedAlongAxis,
    /// The feed is not known.
    #[error(
        "the motion never moves the tool across its axis: there is no feed; give the tool one (feed = [...] in [tool])"
    )]
    NoFeed,
    /// A motion without places.
    #[error("{found} places along the motion: expected {least} or more")]
    Places {
        /// Asked for.
        found: usize,
        /// Least.
        least: usize,
    },
    /// A measured response has no multipliers.
    #[error(
        "the tool has a measured response, which tells modes only when one is fitted: the limits are those of the zero-order solution; ranges and runs need [[mode]] entries"
    )]
    MeasuredTool,
    /// A depth that makes no sense.
    #[error("the deepest cut is {found} m, expected a positive number")]
    Deepest {
        /// Found.
        found: f64,
    },
    /// A run of too many steps.
    #[error("the run would take {steps} steps, at most {most}: ask for a shorter one, or fewer steps per tooth")]
    Long {
        /// Steps.
        steps: usize,
        /// Most.
        most: usize,
    },
    /// A length of a run that makes no sense.
    #[error("{} is {found} s, expected a positive number", flexarm_settings::Setting::Seconds)]
    Seconds {
        /// Found.
        found: f64,
    },
    /// A speed that makes no sense.
    #[error("the spindle speed is {found} 1/min, expected a positive number")]
    Speed {
        /// Found.
        found: f64,
    },
}

impl From<LobesError> for flexarm_run::Error {
    fn from(error: LobesError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for LobesError {}

/// Limits of depth at a pose or along a motion.
///
/// `go_on` is told how many of how many limits are done and may break off by `false`.
///
/// # Errors
/// [`LobesError`] where nothing yields or the feed makes no sense; [`Error::Pose`], [`Error::Step`]
/// for poses without an equilibrium; [`Error::Interrupted`]; errors of files.
pub fn lobes(
    robot: &Robot,
    tool: &CuttingTool,
    place: &CuttingPlace<'_>,
    request: &LobesRequest,
    go_on: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<Lobes, Error> {
    let deepest_m = request.deepest_m.unwrap_or(tool.deepest);
    check_deepest(deepest_m)?;
    check_speeds(&tool.rpm)?;
    if tool.measured.is_some() && request.ranges {
        return Err(LobesError::MeasuredTool.into());
    }
    let paths = request.output.as_ref().map(|folder| files::NAMES.map(|name| folder.join(name)));
    check_free(paths.as_ref().map_or(&[], |paths| paths.as_slice()), request.overwrite)?;

    let (places, left_out) = match place {
        CuttingPlace::At(at) => (vec![Place::at(robot, &request.modelling, tool, *at)?], 0),
        CuttingPlace::Along(motion, n) => Place::along(robot, &request.modelling, tool, motion, *n)?,
    };
    let zero_order = request.zero_order || tool.measured.is_some();
    let (speeds, done) = (tool.rpm.len(), AtomicUsize::new(0));
    let limit = |k: usize| {
        let at = &places[k / speeds];
        let point = point(at, tool, tool.rpm[k % speeds], deepest_m, zero_order, request.ranges, k / speeds);
        if !go_on(done.fetch_add(1, Ordering::Relaxed) + 1, speeds * places.len()) {
            return Err(Error::Interrupted { t: at.time_s.unwrap_or(0.0), partial: false });
        }
        point.map_err(|source| LobesError::Chatter { place: at.words(), source }.into())
    };
    let all: Vec<LobePoint> = (0..speeds * places.len()).into_par_iter().map(limit).collect::<Result<_, Error>>()?;
    let mut answer = assembled(robot, tool, &places, &all, deepest_m);
    answer.method = if zero_order { "zero-order" } else { "floquet" };
    answer.left_out = left_out;
    if let CuttingPlace::Along(motion, _) = place {
        answer.caveats = told::of_motion(motion, &*robot.rigid_model()?);
    }
    answer.caveats.extend(places.iter().flat_map(|place| place.told(robot)));
    answer.caveats = caveat::once_each(std::mem::take(&mut answer.caveats));
    answer.caveats.extend(caveats::tool_caveats(tool));
    if tool.measured.is_some() && !request.zero_order {
        let message = "the tool has a measured response: the limits are those of the zero-order solution, which does not see period doubling";
        answer.caveats.push(Caveat::said(
            "zero-order",
            "tool",
            message,
            "fit modes to the response and give them as [[mode]]",
        ));
    }
    answer.warnings = caveat::warnings(&answer.caveats);
    if let Some(paths) = paths {
        files::save(&mut answer, tool, paths)?;
    }
    Ok(answer)
}

fn point(
    place: &Place,
    tool: &CuttingTool,
    rpm: f64,
    deepest_m: f64,
    zero_order: bool,
    ranges: bool,
    pose: usize,
) -> Result<LobePoint, ChatterError> {
    let spindle = TAU * rpm / 60.0;
    let zero = zero_order_limit(&|w| place.response(w), &tool.cutter, spindle, &place.band, deepest_m)?;
    let mut point = LobePoint {
        spindle_rpm: rpm,
        depth_m: None,
        chatter_hz: None,
        kind: None,
        zero_order_depth_m: zero.map(|limit| limit.depth),
        pose,
        unstable_m: Vec::new(),
    };
    if zero_order {
        point.depth_m = zero.map(|limit| limit.depth);
        point.chatter_hz = zero.map(|limit| limit.chatter_hz);
        point.kind = zero.map(|_| "hopf");
        return Ok(point);
    }
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
    Ok(Quantity::SPEED.check_all("the spindle speed", rpm).map_err(ValueError::from)?)
}

fn check_deepest(depth_m: f64) -> Result<(), Error> {
    if !(depth_m.is_finite() && depth_m > 0.0) {
        return Err(LobesError::Deepest { found: depth_m }.into());
    }
    Quantity::LENGTH.check("the deepest cut", depth_m).map_err(ValueError::from)?;
    Ok(())
}

/// The lowest limit of depth at a pose over all speeds of the tool (m): the deepest cut that is
/// looked at where nothing chatters, NaN where the feed is along the tool's axis.
///
/// * `zero_order`: by the mean force alone, as for a tool with a measured response.
///
/// # Errors
/// Those of [`lobes`] at a pose.
pub fn lowest_limit(
    robot: &Robot,
    modelling: &Modelling,
    tool: &CuttingTool,
    zero_order: bool,
    q: &[f64],
) -> Result<f64, Error> {
    check_speeds(&tool.rpm)?;
    let place = match Place::at(robot, modelling, tool, Some(q)) {
        Err(error) if error.external() == Some(&LobesError::FeedAlongAxis) => return Ok(f64::NAN),
        other => other?,
    };
    let mut lowest = tool.deepest;
    for rpm in &tool.rpm {
        let found = point(&place, tool, *rpm, tool.deepest, zero_order || tool.measured.is_some(), false, 0)
            .map_err(|source| LobesError::Chatter { place: place.words(), source })?;
        lowest = lowest.min(found.depth_m.unwrap_or(lowest));
    }
    Ok(lowest)
}

/// The smallest of two limits; none is the largest.
fn lower<'p>(a: &'p LobePoint, b: &'p LobePoint) -> &'p LobePoint {
    let depth = |p: &LobePoint| p.depth_m.unwrap_or(f64::INFINITY);
    if depth(b) < depth(a) { b } else { a }
}

fn assembled(robot: &Robot, tool: &CuttingTool, places: &[Place], all: &[LobePoint], deepest_m: f64) -> Lobes {
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
            compliance: std::array::from_fn(|i| place.response(0.0)[(i, i)].re),
            stable_below_m: low.as_ref().and_then(|p| p.depth_m),
            stable_below_at_rpm: low.map(|p| p.spindle_rpm),
            depth_m: of_pose(k).iter().map(|p| p.depth_m).collect(),
        }
    });
    let smallest = |i: usize| (0..places.len()).map(|k| &of_pose(k)[i]).reduce(lower).cloned();
    let points: Vec<LobePoint> = (0..speeds).filter_map(smallest).collect();
    let deepest = |p: &&LobePoint| p.depth_m.unwrap_or(f64::INFINITY);
    let best = points.iter().max_by(|a, b| deepest(a).total_cmp(&deepest(b)));
    let low = lowest(&points);
    Lobes {
        robot: robot.name.clone(),
        tool: tool.name.clone(),
        joints: places.first().map_or_else(Vec::new, |place| place.joints().to_vec()),
        method: "",
        deepest_m,
        stable_below_m: low.as_ref().and_then(|p| p.depth_m),
        stable_below_at_rpm: low.map(|p| p.spindle_rpm),
        best_rpm: best.map_or(0.0, |p| p.spindle_rpm),
        best_depth_m: best.map_or(0.0, |p| p.depth_m.unwrap_or(deepest_m)),
        points,
        poses: poses.collect(),
        pose_in_words: places.first().map_or_else(String::new, Place::words),
        left_out: 0,
        file: None,
        files: LobesFiles::default(),
        warnings: Vec::new(),
        caveats: Vec::new(),
    }
}
