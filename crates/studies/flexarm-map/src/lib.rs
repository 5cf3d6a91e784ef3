//! Workspace maps: sag, compliance, frequencies and error under load at any number of poses.
//!
//! [`map()`] evaluates TCP positions, joint positions or a motion ([`MapRegion`]) and returns a
//! [`Map`]: figures, the best and the worst pose, and every pose as a row of a [`MapTable`].
//!
//! ```
//! use flexarm_run::Robot;
//! use flexarm_map::{JointRange, MapRegion, MapRequest, map};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let robot = Robot::load("robots/kr210")?;
//! let joint = |joint: &str, range| JointRange { joint: joint.into(), range, points: 5 };
//! let region = MapRegion::Joints(vec![joint("joint_2", [-1.8, 0.0]), joint("joint_3", [0.0, 2.0])]);
//! let found = map(&robot, &MapRequest { region, ..MapRequest::default() }, &mut |_, _| std::ops::ControlFlow::Continue(()))?;
//! println!("softest with the joints at {:?}", found.worst.q);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! At each pose the results equal those of [`Arm::statics`] and [`Arm::modes`] to the last bit.
//! Drives are locked. Collisions are not checked.
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

mod checked_region;
mod column;
mod columns;
mod error;
mod evaluate;
mod files;
mod finder;
mod iso_surface;
mod page;
mod placement;
mod poses;
mod recording;
mod region;
mod table;
mod take;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use flexarm_kinematics::Model;
use flexarm_settings::{Setting, Words};
use serde::Serialize;

pub use columns::MapColumn;
pub use error::MapError;
pub use placement::Placement;
pub use poses::read_poses;
pub use recording::{quantity_text, readable as readable_quantity, titled as quantity_title};
pub use region::{Grid, JointRange, MAX_PLACES, MapRegion, ToolDirections, WorkspaceGrid};
pub use table::{MapPose, MapTable, QUANTILES, Spread};

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::columns::cheapest;
    pub use crate::evaluate::largest_gain;
    pub use crate::iso_surface::iso_surface;
    pub use crate::placement::best_box;
    pub use crate::region::round_number;
}

use self::checked_region::region_of;
use self::columns::{Layout, PLACE};
use self::evaluate::{Cut, Evaluator};
use self::take::{Choice, Evaluation, take};
use flexarm_chatter::{CuttingTool, LobesError, lowest_limit};
use flexarm_run::caveat::Use;
use flexarm_run::caveat::motion::of_wrench;
use flexarm_run::caveat::size::Size;
use flexarm_run::inspect::joint_values;
use flexarm_run::posed::check_wrench;
use flexarm_run::{Arm, Error, Finding, Modelling, Robot, Scenario, caveat};

/// Poses kept at each place, among all tool directions and branches of the inverse kinematics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeptPoses {
    /// The best pose.
    #[default]
    Best,
    /// The worst pose.
    Worst,
    /// All poses.
    All,
}

impl Words for KeptPoses {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("best", Self::Best, "The best pose at each position"),
        ("worst", Self::Worst, "The worst pose at each position"),
        ("all", Self::All, "All poses"),
    ];
}

/// Input of [`map()`].
#[derive(Clone, Debug, Default)]
pub struct MapRequest {
    /// Modelling of links and drives.
    pub modelling: Modelling,
    /// Region of the map.
    pub region: MapRegion,
    /// Positions of joints that the map does not move, and reference for the choice of branches
    /// (rad or m); default: zero, or the nearest value within the limits.
    pub at: Option<Vec<f64>>,
    /// Force and moment on the TCP in addition to gravity, world axes (N, N m).
    pub wrench: [f64; 6],
    /// Cutting tool with its spindle speeds: the lowest limit of the depth of cut at each pose
    /// becomes a quantity.
    pub tool: Option<CuttingTool>,
    /// Number of natural frequencies; default three.
    pub frequencies: Option<usize>,
    /// Poses kept at each place.
    pub keep: KeptPoses,
    /// Quantity by which poses are compared; default: the limit of depth of a tool, else the error
    /// under the load, else the worst compliance.
    pub by: Option<String>,
    /// Edges of a workpiece to be placed (m, along world axes).
    pub workpiece_m: Option<[f64; 3]>,
    /// Output folder; `None` writes nothing.
    pub output: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Written files.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MapFiles {
    /// Table of all poses.
    pub table: Option<String>,
    /// Page.
    pub page: Option<String>,
    /// Recording for the viewer.
    pub rrd: Option<String>,
    /// Figures.
    pub json: Option<String>,
}

/// Result of `flexarm map`. SI units, world axes, at the TCP.
#[derive(Clone, Debug, Serialize)]
pub struct Map {
    /// Name of the robot.
    pub robot: String,
    /// Link that carries the TCP.
    pub tcp: String,
    /// Joints in coordinate order.
    pub joints: Vec<String>,
    /// Number of places, or joint poses, requested.
    pub points: usize,
    /// Number of these with at least one pose within the limits that has an equilibrium under
    /// gravity.
    pub reachable: usize,
    /// Number of poses evaluated; larger than the number of places with several directions or
    /// branches.
    pub poses: usize,
    /// Number of poses without an equilibrium.
    pub failed: usize,
    /// Grid, for a map over TCP positions.
    pub grid: Option<GridFigures>,
    /// Force (N) and moment (N m) on the TCP, in addition to gravity.
    pub wrench: [f64; 6],
    /// Quantity that defines best and worst.
    pub by: String,
    /// Distribution of each quantity over the rows.
    pub quantities: BTreeMap<String, Spread>,
    /// The worst pose.
    pub worst: MapPose,
    /// The best pose.
    pub best: MapPose,
    /// Best placement of the workpiece; null without a workpiece, or if it fits nowhere.
    pub placement: Option<Placement>,
    /// Wall-clock time (s).
    pub wall_s: f64,
    /// File with the table of all poses.
    pub file: Option<String>,
    /// Written files.
    pub files: MapFiles,
    /// Messages of the caveats.
    pub warnings: Vec<String>,
    /// Probable errors of the input, and limits of the result's validity.
    pub caveats: Vec<Finding>,
    /// All poses.
    #[serde(skip)]
    pub table: MapTable,
}

impl Map {
    /// Returns the number of the place of the best pose.
    fn best_place(&self) -> usize {
        self.table.row(self.best.row)[PLACE] as usize
    }

    /// Returns a quantity per place of the grid, for the best pose at each place; NaN for
    /// unreachable places.
    fn by_place(&self, column: usize, grid: &Grid) -> Vec<f64> {
        let by = self.table.columns.iter().position(|column| column.name == self.by).unwrap_or(column);
        self.table.best_by_place(by, column, grid).into_iter().map(|(_, value)| value).collect()
    }
}

/// Grid of a map.
#[derive(Clone, Debug, Serialize)]
pub struct GridFigures {
    /// First place (m).
    pub lower_m: [f64; 3],
    /// Last place (m).
    pub upper_m: [f64; 3],
    /// Spacing (m).
    pub spacing_m: f64,
    /// Number of places along x, y and z.
    pub count: [usize; 3],
    /// Number of tool directions at each place.
    pub directions: usize,
}

impl GridFigures {
    fn of(grid: &Grid, directions: usize) -> Self {
        Self {
            lower_m: grid.lower,
            upper_m: grid.place(grid.places() - 1),
            spacing_m: grid.spacing_m,
            count: grid.count,
            directions,
        }
    }
}

/// Computes a map.
///
/// `go_on` is called with the number of places done and their total, from any thread, and may
/// interrupt: the places done are then written before the error.
///
/// # Errors
/// [`MapError`] for an invalid or unreachable region, [`Error::Pose`] for joint positions that do
/// not match the robot, [`Error::Step`] for singular springs, [`Error::File`] and [`Error::Write`]
/// for files.
pub fn map(
    robot: &Robot,
    request: &MapRequest,
    go_on: &mut (dyn FnMut(f64, f64) -> ControlFlow<()> + Send),
) -> Result<Map, Error> {
    let begun = Instant::now();
    let paths = request.output.as_deref().map(|folder| files::places(folder, request.overwrite)).transpose()?;
    check_wrench(&request.wrench)?;
    let arm = robot.model(&request.modelling)?;
    let at = arm.operating_point()?;
    let model = &*arm.rigid;
    let actuated = &model.coordinates()[..model.n_actuated()];
    let joints: Vec<(String, bool)> = actuated.iter().map(|c| (c.joint.clone(), c.slides())).collect();
    let loaded = request.wrench != [0.0; 6];
    let (frequencies, listed) = (request.frequencies.unwrap_or(3), matches!(request.region, MapRegion::Poses(_)));
    let layout = Layout::new(at.plant(), &joints, loaded, frequencies, request.tool.as_ref(), listed);
    let by = layout.compared_by(request.by.as_deref())?;
    let near = home(model, request.at.as_deref())?;
    check_tool(robot, request, &near)?;
    // Quantities at each pose, and the choice of the poses kept.
    let cut = request.tool.as_ref().map(|tool| Cut { robot, modelling: &request.modelling, tool });
    let evaluator = Evaluator::new(at, &layout, request.wrench, cut);
    let choice = Choice { layout: &layout, keep: request.keep, by };

    // The places, or those done when the caller stops.
    let rotations = match &request.region {
        MapRegion::Workspace(workspace) => workspace.tool.rotations()?,
        _ => Vec::new(),
    };
    let (places, caveats) = region_of(robot, request, model, &near, &rotations)?;
    let region = places.as_places(&rotations);
    let mut taken = take(&region, &evaluator, &choice, go_on)?;
    let (done, all) = (taken.done, region.count());
    let stopped = |folder| MapError::Interrupted { done, places: all, folder };
    if done < all && taken.rows.is_empty() {
        return Err(stopped(None).into());
    }
    // Figures and caveats of the rows.
    let grid = places.grid();
    let table = MapTable { columns: layout.columns.clone(), values: std::mem::take(&mut taken.rows) };
    let mut found = summed_up(robot, &arm, request, table, &taken, by, (all, grid.as_ref()), rotations.len())?;
    found.caveats.extend(caveats);
    found.caveats.extend(one_place(&found));
    found.caveats.extend((done < all).then(|| unfinished(done, all)));
    found.caveats.extend(tool_caveats(robot, request)?);
    found.caveats.extend(caveat::validity::outside_limits(actuated, &near).filter(|_| request.at.is_some()));
    found.caveats.extend(validity(robot, request, &found));
    found.warnings = caveat::warnings(&found.caveats);
    found.wall_s = begun.elapsed().as_secs_f64();
    if let Some(paths) = paths {
        files::save(&mut found, &paths, robot, request, &arm, grid.as_ref())?;
    }
    match done < all {
        true => Err(stopped(request.output.clone()).into()),
        false => Ok(found),
    }
}

/// Checks the cutting tool at one pose: errors of tool or robot are the same at all poses.
fn check_tool(robot: &Robot, request: &MapRequest, q: &[f64]) -> Result<(), Error> {
    let Some(tool) = &request.tool else { return Ok(()) };
    match lowest_limit(robot, &request.modelling, tool, q, &|| true) {
        Err(error) if error.external::<LobesError>().is_some() => Err(error),
        _ => Ok(()),
    }
}

/// Returns the caveats of the cutting tool, along a motion with that of its feed.
fn tool_caveats(robot: &Robot, request: &MapRequest) -> Result<Vec<Finding>, Error> {
    let Some(tool) = &request.tool else { return Ok(Vec::new()) };
    let mut caveats = flexarm_chatter::tool_caveats(tool, tool.deepest);
    if let MapRegion::Along { motion, .. } = &request.region {
        caveats.extend(flexarm_chatter::feed_caveat(robot, tool, motion)?);
    }
    Ok(caveats)
}

/// Returns the positions of the joints not varied: as given, or zero clamped to the limits.
fn home(model: &Model, at: Option<&[f64]>) -> Result<Vec<f64>, Error> {
    let actuated = &model.coordinates()[..model.n_actuated()];
    let names: Vec<&str> = actuated.iter().map(|c| c.joint.as_str()).collect();
    if at.is_some() {
        return joint_values(at, &names);
    }
    Ok(actuated.iter().map(|c| 0.0_f64.max(c.limits.lower).min(c.limits.upper)).collect())
}

/// Computes the figures from the rows.
#[allow(clippy::too_many_arguments, reason = "called once, to keep the caller short")]
fn summed_up(
    robot: &Robot,
    arm: &Arc<Arm>,
    request: &MapRequest,
    table: MapTable,
    taken: &Evaluation,
    by: usize,
    (places, grid): (usize, Option<&Grid>),
    directions: usize,
) -> Result<Map, Error> {
    let points = grid.map_or(places, Grid::places);
    let Some((best, worst)) = table.extremes(by) else {
        return Err(nothing_found(request, &table, taken, by, points).into());
    };
    // Caveats of the arm where it is used, of the load, and of poses without a result.
    let joints: Vec<String> = arm.joints().map(str::to_owned).collect();
    let mut caveats = match &request.region {
        MapRegion::Along { motion, .. } => arm.caveats(Use::Along(&Scenario::new((**motion).clone()))),
        _ => arm.caveats(Use::Any),
    };
    caveats.extend(of_wrench(&request.wrench, &Size::of(&robot.rigid)));
    caveats.extend(no_equilibrium(taken));
    let placement = match (request.workpiece_m, grid) {
        (Some(edges), Some(grid)) => {
            let found = placement::best_placement(&table, grid, by, edges);
            if found.is_none() {
                caveats.push(no_placement(edges));
            }
            found
        }
        _ => None,
    };
    Ok(Map {
        robot: robot.name.clone(),
        tcp: robot.tcp.0.clone(),
        points,
        reachable: taken.reachable,
        poses: taken.poses - taken.failed,
        failed: taken.failed,
        grid: grid.map(|grid| GridFigures::of(grid, directions)),
        wrench: request.wrench,
        by: table.columns[by].name.clone(),
        quantities: table.spreads().into_iter().collect(),
        worst: MapPose::of(&table, worst, joints.len(), by),
        best: MapPose::of(&table, best, joints.len(), by),
        placement,
        joints,
        wall_s: 0.0,
        file: None,
        files: MapFiles::default(),
        warnings: Vec::new(),
        caveats,
        table,
    })
}

/// Returns the reason why no pose can be compared with others.
fn nothing_found(request: &MapRequest, table: &MapTable, taken: &Evaluation, by: usize, places: usize) -> MapError {
    match (&request.region, &taken.first_failure) {
        _ if table.rows() > 0 => {
            let by = &table.columns[by].name;
            let why = match by == "depth_m" {
                true => ", because the feed of the tool is along its axis (feed = [...] in [tool])",
                false => "",
            };
            MapError::Input(format!("none of the poses has a {by}{why}: compare by another quantity"))
        }
        (_, Some(first)) => MapError::Input(format!(
            "none of the {poses} poses has an equilibrium; at the first: {first}",
            poses = taken.poses
        )),
        (MapRegion::Workspace(w), None) => MapError::Input(format!(
            "none of the {places} places is within reach with the tool pointing along {axis:?} (world) and all \
             joints within their limits: try other values for {} or {}",
            Setting::Bounds,
            Setting::ToolAxis,
            axis = w.tool.axis
        )),
        (_, None) => MapError::instants(),
    }
}

/// Returns the caveat that some poses have no equilibrium.
fn no_equilibrium(taken: &Evaluation) -> Option<Finding> {
    let Evaluation { poses, failed, .. } = taken;
    let first = taken.first_failure.as_ref()?;
    let message = format!("{failed} of {poses} poses have no equilibrium and are left out; at the first: {first}");
    Some(Finding::warning("no-equilibrium", "map", message, "analyse one of them with statics"))
}

/// Returns the caveat that a workpiece fits nowhere.
fn no_placement(edges: [f64; 3]) -> Finding {
    let message =
        format!("the workpiece of {edges:?} m does not fit anywhere on the grid with all its places within reach");
    Finding::warning("no-placement", "map", message, "use a smaller workpiece or more tool directions")
}

/// Returns the caveat about a map that was stopped.
fn unfinished(done: usize, places: usize) -> Finding {
    let message = format!("the map was stopped: {done} of {places} places are in it");
    Finding::warning("map-stopped", "map", message, "run it to its end")
}

/// Returns a caveat if the map has a single place, so that there is nothing to compare.
fn one_place(found: &Map) -> Option<Finding> {
    let message = match (found.reachable, found.points) {
        (1, 1) => "the map has only one place: its best and worst poses do not characterise the workspace".to_owned(),
        (1, points) => {
            format!(
                "the tool reaches only one place of {points}: best and worst poses do not characterise the workspace"
            )
        }
        _ => return None,
    };
    let help = "map more places: a larger box, a smaller spacing or more joint values; for a single pose use statics";
    Some(Finding::warning("one-place", "map", message, help))
}

/// Returns caveats about the worst pose, where the deflections are largest.
fn validity(robot: &Robot, request: &MapRequest, found: &Map) -> Vec<Finding> {
    let arm = robot.model(&request.modelling);
    let Ok(worst) = arm.and_then(|arm| arm.statics(Some(&found.worst.q), request.wrench)) else {
        return Vec::new();
    };
    let known = &found.caveats;
    let new = worst.caveats.into_iter().filter(|caveat| !known.contains(caveat));
    new.map(|mut caveat| {
        caveat.message = format!("at the worst pose: {}", caveat.message);
        caveat
    })
    .collect()
}
