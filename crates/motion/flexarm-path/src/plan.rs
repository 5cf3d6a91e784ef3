//! Public interface of the planner: converts a program to joint motions over time.
//!
//! Start at [`plan`]: moves become legs (`legs`), legs between two stops a route (`route`), a route
//! gets its time law (`schedule`), and the knots of all routes make the curves.

use flexarm_kinematics::Model;
use flexarm_settings::Finding;
use flexarm_trajectory::{Trajectory, TrajectoryError};

use crate::arm::{PathOptions, ProgramArm};
use crate::error::{BLOCKED, at_item, no_move};
use crate::follow::coordinates_of;
use crate::legs::{Legs, Start};
use crate::planned::Planned;
use crate::program::{Item, Program};
use crate::range::check_end;
use crate::route::Route;
use crate::schedule::{Knot, Schedule, through};

/// A joint that moves less than this during a whole motion is at rest (rad or m).
const STILL: f64 = 1e-12;

/// Plans the motion of a program.
///
/// # Errors
/// A [`Finding`] at the statement, for targets out of reach, paths through singular poses,
/// contradictory statements.
pub fn plan(program: &Program, arm: &ProgramArm<'_>, options: &PathOptions) -> Result<Planned, Box<Finding>> {
    let moving = coordinates_of(arm.model, &arm.flange);
    if moving.len() != 7 {
        return plan_holding(program, arm, options, None);
    }
    // Of seven joints one is held while the tool follows its path: the best one at the start, or
    // the first one with which the path can be run.
    let first = plan_holding(program, arm, options, None);
    if !first.as_ref().is_err_and(|error| error.code == BLOCKED) {
        return first;
    }
    let others = moving.into_iter().map(|held| plan_holding(program, arm, options, Some(held)));
    others.into_iter().find(Result::is_ok).unwrap_or(first)
}

/// Plans with a given joint held on tool paths; `None`: the joint without which the minimum
/// singular value is largest.
fn plan_holding(
    program: &Program,
    arm: &ProgramArm<'_>,
    options: &PathOptions,
    held: Option<usize>,
) -> Result<Planned, Box<Finding>> {
    let mut legs = Legs::new(arm, options, held);
    let mut knots: Vec<Knot> = Vec::new();
    // A dwell before the first target is known takes place at that target.
    let mut waiting = 0.0;
    let (mut moves, mut stops, mut now) = (Vec::new(), Vec::new(), 0.0);
    let items = &program.items;
    let mut start = Start::of(program, arm)?;
    let mut k = start.first;
    while k < items.len() {
        if let Item::Dwell { seconds, .. } = &items[k] {
            if !start.known {
                waiting += seconds;
            } else if *seconds > 0.0 {
                knots.push(Knot::rest(now, &start.q));
                now += seconds;
                knots.push(Knot::rest(now, &start.q));
            }
            k += 1;
            continue;
        }
        let legs_here = legs.up_to_stop(items, &mut k, &mut start, &mut stops)?;
        if waiting > 0.0 {
            let q = legs_here.first().map_or(&start.q, |leg| &leg.q0);
            knots.push(Knot::rest(now, q));
            now += std::mem::take(&mut waiting);
            knots.push(Knot::rest(now, q));
        }
        for route in Route::all(&mut legs, legs_here, &mut stops)? {
            let mut schedule = Schedule::new(&route, arm, options)?;
            schedule.write_within(arm, now, &mut knots, &mut moves)?;
            now += schedule.duration();
        }
    }
    let last = items.last().filter(|_| !knots.is_empty()).ok_or_else(|| no_move(&program.name))?;
    check_end(now).map_err(|error| at_item(last, error))?;
    let fixed = legs.fixed_joints();
    Ok(Planned { trajectory: trajectory(arm.model, knots)?, moves, stops, fixed })
}

/// Builds curves from the knots of all routes and dwells.
fn trajectory(model: &Model, mut knots: Vec<Knot>) -> Result<Trajectory, TrajectoryError> {
    knots.dedup_by(|next, knot| {
        let same = next.t - knot.t <= 1e-9;
        if same {
            knot.after.clone_from(&next.after);
        }
        same
    });
    let still: Vec<usize> = (0..model.n_actuated()).filter(|&k| stays(&knots, k)).collect();
    for k in still {
        let q = knots[0].q[k];
        for knot in &mut knots {
            (knot.q[k], knot.v[k], knot.before[k], knot.after[k]) = (q, 0.0, 0.0, 0.0);
        }
    }
    through(model, &knots)
}

/// Whether a joint moves by no more than the rounding error of Newton's method.
fn stays(knots: &[Knot], joint: usize) -> bool {
    let range = knots
        .iter()
        .map(|knot| knot.q[joint])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
    range.1 - range.0 <= STILL
}
