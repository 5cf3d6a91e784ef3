//! Motions given as TCP paths: a program of moves and a robot become joint trajectories.
//!
//! `file` reads flexarm's own path files; robot programs are read elsewhere into a [`Program`].
//! Both end in `ToolPath::plan`. Frames: W controller's world, M model's world, F flange, T tool;
//! SI units. Not here: languages (`flexarm-programs`), inverse kinematics and time laws
//! (`flexarm-path`).

mod file;
mod program;
mod standard;
mod tables;

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;

use flexarm_kinematics::{Coordinate, Frame, Model, Pose};
use flexarm_path::program::{Move, Program, Speed};
use flexarm_path::{
    ControllerAxis, JointBounds, PathOptions, PlannedMove, ProgramArm, Slowed, SlowedBy, coordinates_of, plan,
};
use flexarm_trajectory::{MotionLimits, Trajectory};
use nalgebra::DVector;

use crate::caveat::slip::{self, Factor, outside};
use crate::caveat::{Finding, UNUSUAL};
use crate::error::Error;
use crate::robot::controller_entry::RobotAxis;
use crate::robot::tcp_frame;

pub(crate) use file::{is_path_file, read_path_file};
pub use program::program_text;
pub(crate) use program::read_robot_program;
pub use standard::{Standard, Step};

/// Assumed time for a joint to reach its top speed if its acceleration is not known, s.
const TO_TOP_SPEED: f64 = 0.4;
/// Assumed acceleration of a joint without a speed limit, rad/s² or m/s².
const ACCELERATION: f64 = 10.0;
/// Minimum singular value below which a path counts as near-singular, m/rad.
const NEAR_SINGULAR: f64 = 0.02;
/// Maximum number of notes of one kind that are listed individually.
const MAX_NOTES: usize = 4;
/// ROS name of the link at the controller's flange.
const FLANGE: &str = "tool0";
const BASE: &str = "base";

/// TCP motion with the planned moves.
#[derive(Debug, Clone, Default)]
pub struct ToolPath {
    /// Planned moves in order.
    pub moves: Vec<PlannedMove>,
    /// Jerk limits kept by the motion, by joint, rad/s³ or m/s³.
    pub(crate) jerks: Vec<(String, f64)>,
    /// Warnings, then notes.
    pub(crate) caveats: Vec<Finding>,
}

/// Robot data needed for planning.
#[derive(Clone, Copy)]
pub struct Cell<'a> {
    /// Rigid robot.
    pub model: &'a Model,
    /// Link that carries the tool centre point.
    pub tcp_link: Option<&'a str>,
    /// Held joints and their positions.
    pub hold: &'a [(String, f64)],
    /// Axes that the controller counts differently from the joints.
    pub controller: &'a [RobotAxis],
}

/// Assumptions made where data are missing, as sentences.
#[derive(Debug, Clone, Default)]
pub struct Assumed {
    /// Link on which tools are assumed to be mounted; irrelevant if a path has no tool of its own.
    pub(crate) flange: Option<String>,
    pub(crate) accelerations: Option<String>,
    /// A limit that does not suit the others.
    pub(crate) inconsistent: Option<String>,
}

impl Assumed {
    pub(crate) fn warnings(self) -> Vec<String> {
        self.flange.into_iter().chain(self.accelerations).chain(self.inconsistent).collect()
    }
}

/// Overrides of the joint limits in the robot's description.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    pub(crate) velocities: Vec<Option<f64>>,
    pub(crate) accelerations: Vec<Option<f64>>,
    pub(crate) jerks: Vec<Option<f64>>,
    pub(crate) torques: Vec<Option<f64>>,
}

impl<'a> Cell<'a> {
    /// Returns the flange frame of the controller, the robot's TCP in it, and a note if a link had
    /// to be chosen.
    fn flange(&self) -> (Frame, Pose, Option<String>) {
        let tcp = tcp_frame(self.model);
        let named = |name: &str| self.model.frame(name).filter(|frame| frame.body == tcp.body).cloned();
        let (flange, note) = match (named(FLANGE), self.tcp_link.and_then(named)) {
            (Some(flange), _) => (flange, None),
            (None, Some(link)) => {
                let note = format!(
                    "tools of the program are assumed to be mounted on link {:?}: the robot has no link {FLANGE:?}",
                    link.name
                );
                (link, Some(note))
            }
            (None, None) => (
                tcp.clone(),
                Some("tools of the program are assumed to be mounted on the tool centre point".to_owned()),
            ),
        };
        let X_FT = flange.X_BF.inverse() * tcp.X_BF;
        (flange, X_FT, note)
    }

    /// Returns `X_MW`, the pose of the controller's world in the model's: that of the link `base`
    /// if it does not move.
    fn world(&self) -> Pose {
        let base = self.model.frame(BASE).filter(|frame| frame.body == 0);
        base.map_or_else(Pose::identity, |frame| frame.X_BF)
    }

    /// Returns the coordinates before the program (rad or m).
    fn rest(&self) -> DVector<f64> {
        let coordinates = self.model.coordinates();
        DVector::from_fn(self.model.nv(), |k, _| held_at(self.hold, &coordinates[k]).0)
    }

    /// Returns the controller's convention for these axes; empty if it counts the joints as they
    /// are.
    pub fn controller_axes(&self, axes: &[usize]) -> Vec<ControllerAxis> {
        let place = |joint: &str| axes.iter().position(|&k| self.model.coordinates()[k].joint == joint);
        let axis = |&k: &usize| {
            let given = self.controller.iter().find(|axis| axis.joint == self.model.coordinates()[k].joint);
            given.map_or(ControllerAxis::SAME, |given| {
                let relative = given.relative.as_ref();
                let relative = relative.and_then(|(joint, factor)| Some((place(joint)?, *factor)));
                ControllerAxis { sense: given.sense, zero: given.zero, relative }
            })
        };
        if self.controller.is_empty() { Vec::new() } else { axes.iter().map(axis).collect() }
    }

    /// Returns the arm as the program's controller has it, and what had to be assumed.
    ///
    /// * `overrides`: limits by coordinate that replace those of the robot.
    pub fn arm(&self, overrides: &Overrides) -> (ProgramArm<'a>, Assumed) {
        let (flange, X_FT, flange_note) = self.flange();
        let mut assumed = false;
        let of = |list: &[Option<f64>], k: usize| list.get(k).copied().flatten();
        let finite = |limit: f64| limit.is_finite().then_some(limit);
        // Limits of each joint: the override, else the robot's, else an assumption.
        let bounds = (0..self.model.nv())
            .map(|k| {
                let limits = &self.model.coordinates()[k].limits;
                let velocity = of(&overrides.velocities, k).unwrap_or(limits.velocity);
                let velocity = if velocity > 0.0 { velocity } else { f64::INFINITY };
                let acceleration =
                    of(&overrides.accelerations, k).or(finite(limits.acceleration)).unwrap_or_else(|| {
                        assumed = true;
                        if velocity.is_finite() { velocity / TO_TOP_SPEED } else { ACCELERATION }
                    });
                let (torque, jerk) = (of(&overrides.torques, k), of(&overrides.jerks, k).or(finite(limits.jerk)));
                JointBounds { velocity, acceleration, torque, jerk }
            })
            .collect();
        let inconsistent = self.model.coordinates().iter().zip(&bounds).find_map(|(c, of): (_, &JointBounds)| {
            let jerk = of.jerk.unwrap_or(f64::INFINITY);
            let limits = MotionLimits { velocity: of.velocity, acceleration: of.acceleration, jerk };
            Some(limits.unusual(&c.joint, c.limits.velocity)?.message)
        });
        let accelerations = assumed.then(|| {
            format!(
                "accelerations of the joints are not known: each is taken to reach its top speed in {TO_TOP_SPEED} s ([limits] of a \
                 path file tells them)"
            )
        });
        let axes = coordinates_of(self.model, &tcp_frame(self.model));
        let (X_MW, rest) = (self.world(), self.rest());
        let controller = Vec::new();
        let arm =
            ProgramArm { model: self.model, flange, X_FT, X_MW, axes, controller, bounds, rest, starts_at_rest: false };
        (arm, Assumed { flange: flange_note, accelerations, inconsistent })
    }
}

/// Returns the position at which a joint is held (rad or m), and whether the robot file gives it;
/// else it is the position within the limits that is closest to zero.
pub(crate) fn held_at(hold: &[(String, f64)], c: &Coordinate) -> (f64, bool) {
    let given = hold.iter().find(|(joint, _)| *joint == c.joint).map(|(_, value)| *value);
    (given.unwrap_or(0.0f64.max(c.limits.lower).min(c.limits.upper)), given.is_some())
}

impl ToolPath {
    /// Plans the joint trajectory of a program; `warnings` are those found earlier.
    ///
    /// # Errors
    /// [`Error::Path`] with the statement that the arm cannot follow.
    pub(crate) fn plan(
        file: &Path,
        program: &Program,
        arm: &ProgramArm<'_>,
        options: &PathOptions,
        warnings: Vec<String>,
    ) -> Result<(Trajectory, Self), Error> {
        let planned = plan(program, arm, options).map_err(|mut finding| {
            // Findings about the program as a whole.
            if finding.location.is_empty() || finding.location == program.name {
                finding.location = file.display().to_string();
            }
            let notes =
                program.notes.iter().take(MAX_NOTES).map(|note| placed(&note.location, &note.message)).collect();
            Error::Path { finding, notes }
        })?;

        // Warnings by subject, a few of each kind; then the notes of the program.
        let file = file.display().to_string();
        let mut warnings: Vec<Finding> = warnings.iter().map(|text| warning(&file, text)).collect();
        let stops = planned.stops.iter().map(|(place, why)| warning(place, format!("no blend: {why}"))).collect();
        warnings.extend(first_of(stops, &file));
        let fixed = planned.fixed.join(", ");
        if !fixed.is_empty() {
            let what = match options.rule {
                None => "stay while the tool follows its path (redundancy of a path file chooses otherwise)",
                Some(_) => "move redundantly, towards the requested posture",
            };
            let text = format!("the arm has more joints than the path needs: {fixed} {what}");
            warnings.push(warning(&file, text));
        }
        warnings.extend(tool_warning(program, arm));
        warnings.extend(speed_warnings(program));
        let slowed = planned.moves.iter().filter_map(|of| of.slowed.as_ref().map(|slowed| slowed_warning(of, slowed)));
        warnings.extend(first_of(slowed.collect(), &file));
        let near = planned.moves.iter().filter_map(|of| {
            let (sigma, t) = of.least_sigma.filter(|(sigma, _)| *sigma < NEAR_SINGULAR)?;
            let text = format!(
                "{}: passes near a singular pose at {t:.3} s (least singular value {sigma:.1e} m/rad): joints move fast \
                 for little of the tool",
                of.statement
            );
            Some(warning(&of.place, text))
        });
        warnings.extend(first_of(near.collect(), &file));
        let jerk = |(k, bounds): (usize, &JointBounds)| Some((arm.model.coordinates()[k].joint.clone(), bounds.jerk?));
        let jerks = arm.bounds.iter().enumerate().filter_map(jerk).collect();
        let notes = program.notes.iter().map(|note| warning(&note.location, &note.message).as_note());
        warnings.extend(notes);
        Ok((planned.trajectory, Self { moves: planned.moves, jerks, caveats: warnings }))
    }

    /// Returns the jerk limit of a joint, rad/s³ or m/s³, if one is given.
    pub(crate) fn jerk_of(&self, joint: &str) -> Option<f64> {
        self.jerks.iter().find(|(name, _)| name == joint).map(|(_, jerk)| *jerk)
    }
}

/// Text of a caveat with its place.
fn placed(place: impl Display, text: impl Display) -> String {
    format!("{place}: {text}")
}

/// Returns a warning with its place.
fn warning(place: impl Display, text: impl Display) -> Finding {
    Finding::warning("tool-path", place.to_string(), placed(&place, text), "")
}

/// Returns the first few of a list, and the number of those left out.
fn first_of(mut notes: Vec<Finding>, file: &str) -> Vec<Finding> {
    let more = notes.len().saturating_sub(MAX_NOTES);
    if more > 0 {
        notes.truncate(MAX_NOTES);
        notes.push(warning(file, format!("and {more} more like the last")));
    }
    notes
}

/// Warns if the program's tool differs from the robot's, at which the error is measured.
fn tool_warning(program: &Program, arm: &ProgramArm<'_>) -> Option<Finding> {
    use flexarm_path::program::Item;
    let other = program.items.iter().find_map(|item| match item {
        Item::Move(of) => {
            let X_FT = of.X_FT?;
            let apart = (X_FT.translation.vector - arm.X_FT.translation.vector).norm();
            (apart > 1e-6).then_some((&of.place, apart))
        }
        Item::Dwell { .. } => None,
    })?;
    let text = format!(
        "the program's tool ends {:.1} mm from the robot's tool centre point: the program's follows the path, the error \
         is measured at the robot's (tcp of the robot file)",
        other.1 * 1e3
    );
    Some(warning(other.0, text))
}

/// Usual range of a speed of a move.
struct UsualSpeed {
    what: &'static str,
    unit: &'static str,
    of: fn(&Speed) -> Option<f64>,
    range: RangeInclusive<f64>,
    factors: &'static [Factor],
}

const PER_CENT: &[Factor] = &[(100.0, "per cent"), (0.01, "divided by 100 twice")];

/// Usual speeds of robots: KUKA's default acceleration is 2.3 m/s², delta robots have 10 m/s and
/// 150 m/s².
const USUAL_SPEEDS: [UsualSpeed; 6] = [
    UsualSpeed {
        what: "the speed along the path",
        unit: "m/s",
        of: |speed| speed.linear_m_s,
        range: 1e-5..=12.0,
        factors: &[(60.0, "mm/min for mm/s"), (1e3, "mm/s")],
    },
    UsualSpeed {
        what: "the acceleration along the path",
        unit: "m/s2",
        of: |speed| speed.linear_m_s2,
        range: 0.01..=300.0,
        factors: &[(1e3, "mm/s2"), (1e-3, "mm/s2 for m/s2")],
    },
    UsualSpeed {
        what: "the jerk along the path",
        unit: "m/s3",
        of: |speed| speed.linear_m_s3,
        range: 0.1..=1e5,
        factors: &[(1e3, "mm/s3"), (1e-3, "mm/s3 for m/s3")],
    },
    UsualSpeed {
        what: "the angular speed of the tool",
        unit: "rad/s",
        of: |speed| speed.angular_rad_s,
        range: 1e-4..=60.0,
        factors: slip::ANGLE,
    },
    UsualSpeed {
        what: "the speed of the joints as a part of their limits",
        unit: "",
        of: |speed| speed.joint_fraction,
        range: 1e-3..=1.0,
        factors: PER_CENT,
    },
    UsualSpeed {
        what: "the acceleration of the joints as a part of their limits",
        unit: "",
        of: |speed| speed.joint_acceleration_fraction,
        range: 1e-3..=1.0,
        factors: PER_CENT,
    },
];
/// Usual distances of blends from their corners (m).
const BLEND: RangeInclusive<f64> = 2e-5..=2.0;

/// Warns about the first speed of each kind, and the first blend, that no robot has.
fn speed_warnings(program: &Program) -> Vec<Finding> {
    use flexarm_path::program::{Blend, Item};
    let moves = || {
        program.items.iter().filter_map(|item| match item {
            Item::Move(of) => Some(of),
            Item::Dwell { .. } => None,
        })
    };
    let text = |of: &Move, caveat: Finding| {
        let likely = if caveat.likely.is_empty() { String::new() } else { format!(" ({})", caveat.likely) };
        warning(&of.place, format!("{}: {}{likely}: check its unit", of.statement, caveat.message))
    };
    let speeds = USUAL_SPEEDS.iter().filter_map(|usual| {
        moves().find_map(|of| {
            let found = (usual.of)(&of.speed).filter(|found| found.is_finite())?;
            let kind = UNUSUAL.with_unit(usual.unit);
            let caveat = outside(&kind, usual.what, found, &usual.range, usual.factors, 1.0)?;
            Some(text(of, caveat))
        })
    });
    let blend = moves().find_map(|of| {
        let Blend::Distance(found) = of.blend else { return None };
        let caveat = outside(&UNUSUAL.with_unit("m"), "its blend", found, &BLEND, slip::LENGTH, 1.0)?;
        Some(text(of, caveat))
    });
    speeds.chain(blend).collect()
}

/// Warns about a move that is slower than programmed.
fn slowed_warning(of: &PlannedMove, slowed: &Slowed) -> Finding {
    let by = match &slowed.by {
        SlowedBy::JointSpeed(joint) => format!("the speed of joint {joint:?}"),
        SlowedBy::JointAcceleration(joint) => format!("the acceleration of joint {joint:?}"),
        SlowedBy::JointJerk(joint) => format!("the jerk of joint {joint:?}"),
        SlowedBy::JointTorque(joint) => format!("the torque of joint {joint:?}"),
        SlowedBy::Turning => "the turning of the tool".to_owned(),
        SlowedBy::PathAcceleration => "the acceleration across the path".to_owned(),
    };
    let (statement, t, part) = (&of.statement, slowed.time_s, 100.0 * slowed.part);
    warning(&of.place, format!("{statement}: slowed to {part:.0} % of its speed at {t:.3} s by {by}"))
}
