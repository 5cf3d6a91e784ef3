//! From a program to joints over time: the public face of the planner, what it is told and what it
//! tells.

use flexarm_kinematics::{ControllerAxes, Frame, Model, NullSpaceRule};
use flexarm_spatial::Pose;
use flexarm_trajectory::{JointKnots, Trajectory, TrajectoryError};
use nalgebra::DVector;

use crate::curve::ArcError;
use crate::follow::{Blocked, coordinates_of};
use crate::legs::{Legs, Start};
use crate::program::{Item, Program};
use crate::range::{OutOfRange, check_end};
use crate::route::Route;
use crate::schedule::{Knot, Schedule};

/// A joint that moves less in all of a motion stays, rad or m.
const STILL: f64 = 1e-12;

/// What a joint may do while it follows a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBounds {
    /// rad/s or m/s, positive, may be infinite.
    pub velocity: f64,
    /// rad/s² or m/s², positive.
    pub acceleration: f64,
    /// N m or N of the rigid arm, positive; `None`: not looked at.
    pub torque: Option<f64>,
    /// rad/s³ or m/s³, positive. Where it is told of some joint, the accelerations of the others
    /// rise to their bounds in [`PathOptions::rise_s`] or more.
    pub jerk: Option<f64>,
}

/// How paths are resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct PathOptions {
    /// Points of the time law are no further apart than this, m of path.
    pub spacing_m: f64,
    /// The joints leave the path by no more than this between points, m and rad.
    pub chord_m: f64,
    /// Accelerations rise and fall in this time, s; 0: they jump.
    pub rise_s: f64,
    /// What an arm with more joints than the path needs does with them: it moves them along towards
    /// the posture of this rule; they stay without it.
    pub rule: Option<NullSpaceRule>,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { spacing_m: 5e-3, chord_m: 1e-10, rise_s: 0.05, rule: None }
    }
}

/// The arm that runs a program, as its controller sees it.
#[derive(Debug, Clone)]
pub struct ProgramArm<'m> {
    /// Rigid arm.
    pub model: &'m Model,
    /// Flange of the controller, F.
    pub flange: Frame,
    /// The robot's own tool on it, `X_FT`, where the program tells none.
    pub X_FT: Pose,
    /// The controller's world in the model's, `X_MW`.
    pub X_MW: Pose,
    /// Coordinates in the order in which the controller counts its axes.
    pub axes: Vec<usize>,
    /// How it counts each of them; empty where its axes are the joints.
    pub controller: Vec<ControllerAxis>,
    /// One for each independent coordinate.
    pub bounds: Vec<JointBounds>,
    /// All independent coordinates before the program; joints that it does not move stay there.
    pub rest: DVector<f64>,
    /// Whether the program begins there; otherwise it begins where its first move ends.
    pub starts_at_rest: bool,
}

/// How a controller counts an axis. The joint is at
///
/// ```text
/// q = zero + sense a + factor a_other
/// ```
/// where `a` is the value of the axis and `a_other` that of an axis before it: arms whose third
/// axis is driven by a rod count it against the horizontal and not against the link that carries
/// it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerAxis {
    /// 1 or -1.
    pub sense: f64,
    /// Value of the joint where the axis is at zero (rad or m).
    pub zero: f64,
    /// Number of the other axis, from 0, and its factor.
    pub relative: Option<(usize, f64)>,
}

impl ControllerAxis {
    /// The joint itself.
    pub const SAME: Self = Self { sense: 1.0, zero: 0.0, relative: None };
}

impl ProgramArm<'_> {
    /// Puts values of the controller's first axes into all coordinates.
    pub fn set_axes(&self, values: &[f64], q: &mut DVector<f64>) {
        for (n, (value, &k)) in values.iter().zip(&self.axes).enumerate() {
            let axis = self.controller.get(n).unwrap_or(&ControllerAxis::SAME);
            let other = axis.relative.and_then(|(other, factor)| Some(factor * values.get(other)?));
            q[k] = axis.zero + axis.sense * value + other.unwrap_or(0.0);
        }
    }

    /// Values of the controller's axes for all coordinates: the inverse of
    /// [`ProgramArm::set_axes`].
    pub fn axis_values(&self, q: &DVector<f64>) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.axes.len());
        for (n, &k) in self.axes.iter().enumerate() {
            let axis = self.controller.get(n).unwrap_or(&ControllerAxis::SAME);
            // An axis is relative to one before it.
            let other = axis.relative.and_then(|(other, factor)| Some(factor * values.get(other)?));
            values.push((q[k] - axis.zero - other.unwrap_or(0.0)) / axis.sense);
        }
        values
    }

    /// Zeros and senses of six joints, for words that speak of the controller's axes. What is
    /// measured against another axis decides none of them.
    pub(crate) fn controller_axes(&self, joints: [usize; 6]) -> ControllerAxes {
        let of = |k: usize| {
            let n = self.axes.iter().position(|&axis| axis == k);
            *n.and_then(|n| self.controller.get(n)).unwrap_or(&ControllerAxis::SAME)
        };
        let axes = joints.map(of);
        ControllerAxes { sign: axes.map(|axis| axis.sense), offset: axes.map(|axis| -axis.sense * axis.zero) }
    }
}

/// What became of a move.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMove {
    /// Line in the program.
    pub line: usize,
    /// Statement.
    pub statement: String,
    /// First and last moment, s; with a blend, the middle of it.
    pub span_s: [f64; 2],
    /// Greatest speed of the tool centre point on its path, m/s (`None` for joint moves).
    pub top_m_s: Option<f64>,
    /// Programmed speed, m/s.
    pub programmed_m_s: Option<f64>,
    /// Where it is slower than programmed because a limit demands it: the worst place.
    pub slowed: Option<Slowed>,
    /// Least singular value of the Jacobian on the way, m/rad, with its moment, s; tool paths only.
    pub least_sigma: Option<(f64, f64)>,
    /// Distance from the target at which its corner is left, m; 0 at a stop.
    pub blend_m: f64,
}

/// A place where a limit of the robot slows a move.
#[derive(Debug, Clone, PartialEq)]
pub struct Slowed {
    /// s from the start of the motion.
    pub time_s: f64,
    /// Part of the programmed speed, or of the joints' own limits.
    pub part: f64,
    /// What demands it.
    pub by: SlowedBy,
}

/// What slows a move.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SlowedBy {
    /// Speed of a joint.
    JointSpeed(String),
    /// Acceleration of a joint where the path bends.
    JointAcceleration(String),
    /// Torque of a joint.
    JointTorque(String),
    /// Jerk of a joint.
    JointJerk(String),
    /// Turning of the tool.
    Turning,
    /// Acceleration of the tool across its path.
    PathAcceleration,
}

/// A program as a motion.
#[derive(Debug, Clone)]
pub struct Planned {
    /// All actuated joints over time.
    pub trajectory: Trajectory,
    /// Move by move.
    pub moves: Vec<PlannedMove>,
    /// Corners that are stops although a blend was asked for: line and why.
    pub stops: Vec<(usize, String)>,
    /// Joints that stay although they could move the tool (redundant arms).
    pub held: Vec<String>,
}

/// A program that this arm cannot run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// Nothing moves.
    #[error("the program has no move")]
    NoMove,
    /// A tool path from nowhere.
    #[error(
        "line {line}: {statement}: the program begins with a move of the tool, and where it starts is not known: begin with a \
         joint move, or tell a start"
    )]
    NoStart {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
    },
    /// More axes than the arm has.
    #[error("line {line}: {statement}: {found} axis values for an arm of {axes} axes")]
    Axes {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Values.
        found: usize,
        /// Axes of the arm.
        axes: usize,
    },
    /// No joint values.
    #[error("line {line}: {statement}: no joint values bring the tool there: {why}")]
    Unreachable {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// What was found.
        why: String,
    },
    /// A path that leads out of reach or through a singular pose.
    #[error("line {line}: {statement}: {why}")]
    Blocked {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Where and why, as numbers.
        blocked: Blocked,
        /// The same as a sentence.
        why: String,
    },
    /// Three points that are no circle.
    #[error("line {line}: {statement}: {source}")]
    Arc {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Which.
        source: ArcError,
    },
    /// A number that is none, or outside of what a robot can do.
    #[error("line {line}: {statement}: {source}")]
    Value {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Which.
        source: OutOfRange,
    },
    /// The time law.
    #[error("line {line}: {statement}: {why}")]
    Law {
        /// Line of the first move up to the next stop.
        line: usize,
        /// Statement.
        statement: String,
        /// Why.
        why: String,
    },
    /// Joints over time.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

impl PathError {
    pub(crate) fn out_of_range(item: &Item, source: OutOfRange) -> Self {
        match item {
            Item::Move(of) => Self::Value { line: of.line, statement: of.statement.clone(), source },
            Item::Dwell { line, .. } => Self::Value { line: *line, statement: "wait".to_owned(), source },
        }
    }
}

/// The motion that a program asks for.
///
/// # Errors
/// [`PathError`]: targets out of reach, paths through singular poses, statements that contradict each other.
pub fn plan(program: &Program, arm: &ProgramArm<'_>, options: &PathOptions) -> Result<Planned, PathError> {
    let moving = coordinates_of(arm.model, &arm.flange);
    if moving.len() != 7 {
        return plan_holding(program, arm, options, None);
    }
    // Of seven joints one stays while the tool follows its path: the best at the start, or the
    // first with which the path can be run.
    let first = plan_holding(program, arm, options, None);
    if !matches!(first, Err(PathError::Blocked { .. })) {
        return first;
    }
    let others = moving.into_iter().map(|held| plan_holding(program, arm, options, Some(held)));
    others.into_iter().find(Result::is_ok).unwrap_or(first)
}

/// The same with a joint that stays on paths of the tool; `None`: the one without which the rest
/// moves the tool best.
fn plan_holding(
    program: &Program,
    arm: &ProgramArm<'_>,
    options: &PathOptions,
    held: Option<usize>,
) -> Result<Planned, PathError> {
    let mut legs = Legs::new(arm, options, held);
    let mut knots: Vec<Knot> = Vec::new();
    // A dwell before the first target is known is one at that target.
    let mut waiting = 0.0;
    let (mut moves, mut stops, mut now) = (Vec::new(), Vec::new(), 0.0);
    let items = &program.items;
    let mut start = Start::of(items, arm)?;
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
    let last = items.last().filter(|_| !knots.is_empty()).ok_or(PathError::NoMove)?;
    check_end(now).map_err(|source| PathError::out_of_range(last, source))?;
    let held = legs.held();
    Ok(Planned { trajectory: trajectory(arm.model, knots)?, moves, stops, held })
}

/// Knots of all routes and dwells as curves.
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

/// The quintics through knots.
pub(crate) fn through(model: &Model, knots: &[Knot]) -> Result<Trajectory, TrajectoryError> {
    let times: Vec<f64> = knots.iter().map(|knot| knot.t).collect();
    let joint = |k: usize| JointKnots {
        name: model.coordinates()[k].joint.clone(),
        position: knots.iter().map(|knot| knot.q[k]).collect(),
        velocity: knots.iter().map(|knot| knot.v[k]).collect(),
        acceleration: knots.iter().map(|knot| [knot.before[k], knot.after[k]]).collect(),
    };
    let joints: Vec<JointKnots> = (0..model.n_actuated()).map(joint).collect();
    Trajectory::through_knots(&times, &joints)
}

/// Does a joint move by no more than the rounding of Newton's method?
fn stays(knots: &[Knot], joint: usize) -> bool {
    let range = knots
        .iter()
        .map(|knot| knot.q[joint])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
    range.1 - range.0 <= STILL
}
