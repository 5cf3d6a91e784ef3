//! Checks of the region of a map, and its places or poses.
//!
//! Start at [`region_of`]. Not here: inverse kinematics ([`super::finder`]), the evaluation
//! ([`super::take`]).

use flexarm_kinematics::{Data, Model, forward_kinematics};
use flexarm_run::robot::tcp_frame;
use flexarm_run::{Error, Finding, Robot};
use flexarm_settings::{Quantity, Setting, known_names};
use nalgebra::{DVector, Rotation3};

use crate::finder::Finder;
use crate::region::{Grid, JointRange, MAX_PLACES, MAX_QUERIES, MapRegion, WorkspaceGrid, round_number};
use crate::take::{Places, PoseOf};
use crate::{MapError, MapRequest, column, poses};

/// Number of poses sampled to estimate the reach of the arm.
const REACH_POSES: usize = 20_000;
/// Default number of places along the longest edge of a box; fewer for arms whose inverse
/// kinematics is a numerical search, and for many tool directions.
const USUAL_PLACES: f64 = 32.0;
const FEW_PLACES: f64 = 10.0;

/// A checked region.
pub(super) enum Region<'m> {
    /// Places, their inverse kinematics, and the radius about the first joint's axis to leave out (m).
    Grid(Grid, Box<Finder<'m>>, f64),
    /// Number of poses, and their joint values.
    Poses(usize, Box<PoseOf<'m>>),
}

impl<'m> Region<'m> {
    /// Returns the places to evaluate, with all tool directions at each place of a grid.
    pub(super) fn as_places<'a>(&'a self, rotations: &'a [Rotation3<f64>]) -> Places<'a>
    where
        'm: 'a,
    {
        match self {
            Self::Grid(grid, finder, keep_out_m) => {
                Places::Grid { grid: *grid, rotations, finder, keep_out_m: *keep_out_m }
            }
            Self::Poses(count, values) => Places::Joints { count: *count, values: &**values },
        }
    }

    /// Returns the grid, if the region is one.
    pub(super) fn grid(&self) -> Option<Grid> {
        match self {
            Self::Grid(grid, ..) => Some(*grid),
            Self::Poses(..) => None,
        }
    }
}

/// Checks the region and returns the places or poses to evaluate.
pub(super) fn region_of<'m>(
    robot: &Robot,
    request: &'m MapRequest,
    model: &'m Model,
    near: &[f64],
    rotations: &[Rotation3<f64>],
) -> Result<(Region<'m>, Vec<Finding>), Error> {
    // A workpiece is placed on a grid.
    if let Some(edges) = request.workpiece_m {
        if !edges.iter().all(|edge| edge.is_finite() && *edge >= 0.0) {
            return Err(MapError::Input(format!(
                "the edges of the workpiece must be zero or positive lengths, found {edges:?} m"
            ))
            .into());
        }
        if !matches!(request.region, MapRegion::Workspace(_)) {
            return Err(MapError::Input(
                "a workpiece requires a grid of places: it cannot be combined with joint values or a motion".into(),
            )
            .into());
        }
    }
    match &request.region {
        MapRegion::Workspace(workspace) => grid_region(robot, workspace, model, near, rotations.len()),
        MapRegion::Joints(ranges) => joint_region(ranges, model, near),
        MapRegion::Poses(poses) => poses::region(poses, model),
        MapRegion::Along { motion, points } => {
            if !(1..=MAX_PLACES).contains(points) {
                return Err(MapError::instants().into());
            }
            let (n, trajectory, points) = (near.len(), &motion.trajectory, *points);
            let end = trajectory.duration();
            let values = move |k: usize, q: &mut Vec<f64>| {
                let t = if points == 1 { 0.0 } else { end * k as f64 / (points - 1) as f64 };
                q.resize(n, 0.0);
                let (mut v, mut a) = (vec![0.0; n], vec![0.0; n]);
                trajectory.sample(t, q, &mut v, &mut a);
            };
            Ok((Region::Poses(points, Box::new(values)), Vec::new()))
        }
    }
}

/// Returns the grid of TCP positions of a workspace.
fn grid_region<'m>(
    robot: &Robot,
    workspace: &WorkspaceGrid,
    model: &'m Model,
    near: &[f64],
    directions: usize,
) -> Result<(Region<'m>, Vec<Finding>), Error> {
    let found = match (workspace.keep_out_m, workspace.bounds) {
        (Some(radius), _) => radius,
        (None, Some(_)) => 0.0,
        (None, None) => column::radius(robot, model, near),
    };
    if !(found.is_finite() && found >= 0.0) {
        return Err(MapError::Input(format!(
            "the keep-out radius around the first joint must be zero or positive, found {found} m"
        ))
        .into());
    }
    // Inverse kinematics, in closed form or by search.
    let mut finder = Finder::new(model, tcp_frame(model), near.to_vec());
    let joints = finder.joints();
    if joints < 6 {
        let message = format!(
            "the arm has {joints} joints, but reaching a TCP pose requires six: map it over joint values ({})",
            Setting::MapJoints
        );
        return Err(MapError::Input(message).into());
    }
    let mut caveats = Vec::new();
    if !finder.is_closed() {
        let message = "the arm has no closed-form inverse kinematics: poses are found by search, which is \
                       slow and may miss branches, and places near the workspace boundary";
        caveats.push(Finding::warning("searched-poses", "map", message, "map the arm over joint values"));
    }
    caveats.extend(workspace.tool.caveat());
    // Box and spacing, as given or from the reach, and the number of poses that they ask for.
    let bounds = workspace.bounds.unwrap_or_else(|| reach(model));
    let edge = (0..3).map(|c| bounds[1][c] - bounds[0][c]).fold(0.0, f64::max);
    let usual = if finder.is_closed() && directions < 10 { USUAL_PLACES } else { FEW_PLACES };
    let spacing = workspace.spacing_m.unwrap_or_else(|| round_number(edge.max(1e-3) / usual));
    let grid = Grid::within(bounds, spacing)?;
    let queries = grid.places() as f64 * directions as f64;
    if queries > MAX_QUERIES {
        let message = format!(
            "the map would search for {queries:.1e} TCP poses, at most {MAX_QUERIES:.0e} are allowed: use fewer \
             directions, or increase {}",
            Setting::GridSpacing
        );
        return Err(MapError::Input(message).into());
    }
    Ok((Region::Grid(grid, Box::new(finder), found), caveats))
}

/// Returns the product of the joint values, the first joint varying fastest.
fn joint_region<'m>(
    ranges: &'m [JointRange],
    model: &Model,
    near: &[f64],
) -> Result<(Region<'m>, Vec<Finding>), Error> {
    // Each range names a joint once, with finite values that a joint can have.
    let actuated = &model.coordinates()[..model.n_actuated()];
    if ranges.is_empty() {
        return Err(MapError::Input("no joint is given for the map to vary".into()).into());
    }
    let (mut numbers, mut caveats, mut poses) = (Vec::new(), Vec::new(), 1.0);
    for range in ranges {
        let JointRange { joint, range: [first, last], points } = range;
        let k = actuated.iter().position(|c| c.joint == *joint).ok_or_else(|| {
            let known: Vec<String> = actuated.iter().map(|c| c.joint.clone()).collect();
            let known = known_names(joint, &known);
            MapError::Input(format!("there is no joint {joint:?} to vary; the joints are {known}"))
        })?;
        if numbers.contains(&k) {
            return Err(MapError::Input(format!("joint {joint:?} is named twice")).into());
        }
        if !first.is_finite() || !last.is_finite() || *points == 0 {
            let message = format!(
                "joint {joint:?} has a range from {} to {} in {points} values: expected finite numbers and at least \
                 one value",
                range.range[0], range.range[1]
            );
            return Err(MapError::Input(message).into());
        }
        Quantity::JOINT.check_all(&format!("joint {joint:?}"), &range.range)?;
        let limits = actuated[k].limits;
        if first.min(*last) < limits.lower || first.max(*last) > limits.upper {
            let (lower, upper) = (limits.lower, limits.upper);
            let message = format!("the map moves joint {joint:?} beyond its limits {lower} to {upper}");
            caveats.push(Finding::warning("outside-limits", joint, message, "reduce the range of the joint"));
        }
        numbers.push(k);
        poses *= *points as f64;
    }
    if poses > MAX_PLACES as f64 {
        return Err(MapError::too_many(poses).into());
    }
    // Pose number to joint values, as digits of a number with mixed radix.
    let near = near.to_vec();
    let values = move |pose: usize, q: &mut Vec<f64>| {
        q.extend_from_slice(&near);
        let mut rest = pose;
        for (&k, range) in numbers.iter().zip(ranges) {
            q[k] = range.value(rest % range.points);
            rest /= range.points;
        }
    };
    Ok((Region::Poses(poses as usize, Box::new(values)), caveats))
}

/// Returns a box, with a margin, around the TCP positions that the arm reaches within its joint
/// limits, estimated from many poses.
fn reach(model: &Model) -> [[f64; 3]; 2] {
    const PRIMES: [f64; 10] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0];
    let tool = tcp_frame(model);
    let actuated = &model.coordinates()[..model.n_actuated()];
    let range = |k: usize| {
        let limits = actuated[k].limits;
        let (lower, upper) = (limits.lower.max(-std::f64::consts::PI), limits.upper.min(std::f64::consts::PI));
        if lower < upper { (lower, upper) } else { (limits.lower, limits.upper) }
    };
    let (mut data, mut q) = (Data::new(model), DVector::zeros(model.nv()));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for pose in 0..REACH_POSES {
        for k in 0..actuated.len() {
            let (lower, upper) = range(k);
            // Kronecker sequence with square roots of primes.
            q[k] = lower
                + (upper - lower) * (0.5 + PRIMES[k % PRIMES.len()].sqrt() * (pose * (1 + k / 10)) as f64).fract();
        }
        forward_kinematics(model, &mut data, &q);
        let place = data.X_WF(&tool).translation.vector;
        for c in 0..3 {
            low[c] = low[c].min(place[c]);
            high[c] = high[c].max(place[c]);
        }
    }
    let margin = [0, 1, 2].map(|c| 0.02 * (high[c] - low[c]));
    [[0, 1, 2].map(|c| low[c] - margin[c]), [0, 1, 2].map(|c| high[c] + margin[c])]
}
