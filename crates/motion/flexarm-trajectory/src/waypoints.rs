//! Waypoint files: moves with a profile and holds between them, in TOML.
//!
//! ```toml
//! format = 1
//! unit = "deg"                 # "deg" or "rad", for every angle, speed, acceleration and jerk in the file
//! metres = ["rail"]            # optional: prismatic joints, in m, m/s, ... whatever the unit
//! joints = ["rail", "joint_1", "joint_2"]
//! start = [0.0, 0.0, 0.0]
//!
//! # These six and `law = "optimal"` may be set again within a [[move]].
//! profile = "quintic"          # quintic (default), trapezoid, s-curve
//! synchronised = true          # default; false: each joint as fast as its own limits allow
//! speed = 0.5                  # fraction of the velocity limits used by moves without a duration; default 1
//! acceleration = [2.0, 300.0, 300.0]  # for trapezoid and s-curve; one number, or one per joint
//! jerk = [20.0, 3000.0, 3000.0]       # for s-curve; likewise
//! rounding = 0.1               # trapezoid: part of each ramp with a rising or falling acceleration (default 0.1);
//!                              # 0 is the plain trapezoid, whose acceleration jumps
//!
//! [limits]                     # optional; goes before what the robot's description says
//! joint_1 = { velocity = 120.0, acceleration = 400.0, jerk = 4000.0 }
//!
//! [[move]]
//! to = [0.2, 60.0, 30.0]       # or some joints only: to = { joint_2 = 30.0 }
//! via = [[0.1, 30.0, 20.0]]    # optional: points passed without a stop; quintic and optimal only
//! duration = 1.2               # s; may be left out where velocity limits are known
//! hold = 0.8                   # s of rest afterwards; default 0
//! ```
//!
//! A limit is looked up in the move (`acceleration`, `jerk`), then at the top of the file, then in
//! `[limits]`, then among the limits that the caller gives (the robot's). [`crate::Plan`] describes
//! how the profiles use them, and how a given duration is divided. Unknown keys are errors.
//!
//! A move with `via` is the curve of least squared jerk through the points: quintic pieces with
//! continuous velocity, acceleration, jerk and snap, at rest at both ends. Each point is passed at
//! the time at which a straight quintic would have covered the same fraction of the travel; all
//! joints start and stop together. Via points on the straight line from start to goal therefore
//! change nothing.
//!
//! A move with `law = "optimal"` instead of a profile follows the natural cubic spline through its
//! points in minimum time, within velocity, acceleration and jerk limits ([`crate::jerk_law`]).
//!
//! A motion that does not consist of moves has `[samples]` instead ([`Trajectory::to_samples_toml`]
//! writes them).
//!
//! Start at [`Trajectory::parse_toml`]. Not here: the mathematics of the moves ([`crate::Plan`]).

use flexarm_settings::{Finding, Place, exact};

use crate::error::TrajectoryError;
use crate::findings::{at, fault, unknown_format};
use crate::limits::JointLimits;
use crate::samples_toml::{self, SamplesFileToml, has_samples};
use crate::trajectory::Trajectory;
use crate::waypoints_check::{Checked, check, stated_units};
use crate::waypoints_toml::FileToml;

impl Trajectory {
    /// Reads waypoints; the module page [`crate::waypoints`] describes the format.
    ///
    /// * `origin`: file name for messages.
    /// * `limits`: known limits of the robot's joints, by name; joints may be missing and need not
    ///   occur in the file. A velocity or acceleration that is not positive counts as unknown.
    ///
    /// # Errors
    /// [`TrajectoryError::File`] with line and column of the problem and its remedy.
    pub fn parse_toml(text: &str, origin: &str, limits: &[(&str, JointLimits)]) -> Result<Self, TrajectoryError> {
        let file = Place::of_file(origin);
        let fail = |offset: Option<usize>, fault: Box<Finding>| {
            let place = offset.map(|offset| line_and_column(text, offset));
            TrajectoryError::File(at(&place.map_or(file.clone(), |(line, column)| file.at(line, column)), fault))
        };
        let unread = |error: toml::de::Error| {
            let message = flexarm_settings::without_types(error.message());
            let message = format!("{message}; docs/motions.md has all keys, with types and units");
            fail(error.span().map(|span| span.start), fault("toml", message))
        };
        let line = |offset: usize| line_and_column(text, offset).0;
        // Samples of a motion.
        if has_samples(text) {
            let file: SamplesFileToml = toml::Deserializer::parse(text).and_then(exact).map_err(unread)?;
            if *file.format.get_ref() != 1 {
                return Err(fail(Some(file.format.span().start), unknown_format(*file.format.get_ref())));
            }
            let read = samples_toml::trajectory(&file).map_err(|error| fail(error.offset, error.fault))?;
            return Ok(read.with_stated_units(stated_units(&file.unit, &file.metres, &file.joints, line)));
        }
        let file: FileToml = toml::Deserializer::parse(text).and_then(exact).map_err(unread)?;

        // Moves between waypoints: an error of planning is located at its move.
        let Checked { plan, unusual_limit, move_offsets } =
            check(&file, limits).map_err(|error| fail(error.offset, error.fault))?;
        let planned = plan.build().map_err(|error| {
            let number = if let TrajectoryError::Plan(error) = &error { error.move_number() } else { None };
            fail(number.and_then(|number| move_offsets.get(number - 1).copied()), error.into())
        })?;
        let planned = unusual_limit.into_iter().fold(planned, Self::with_note);
        Ok(planned.with_stated_units(stated_units(&file.unit, &file.metres, &file.joints, line)))
    }
}

/// Line and column (in characters) of a byte offset, both from 1.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.as_bytes().get(..offset).map(String::from_utf8_lossy).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |start| start.chars().count()) + 1;
    (line, column)
}
