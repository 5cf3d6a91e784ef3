//! Public interface of the planner: converts a program to joint motions over time.

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

/// A joint that moves less than this during a whole motion is at rest (rad or m).
const STILL: f64 = 1e-12;

/// Limits of a joint while it follows a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBounds {
    /// Maximum speed (rad/s or m/s), positive, may be infinite.
    pub velocity: f64,
    /// Maximum acceleration (rad/s² or m/s²), positive.
    pub acceleration: f64,
    /// Maximum torque (N m) or force (N) of the rigid arm, positive; `None`: not checked.
    pub torque: Option<f64>,
    /// Maximum jerk (rad/s³ or m/s³), positive. If any joint has one, the accelerations of the
    /// others rise to their limits in at least [`PathOptions::rise_s`].
    pub jerk: Option<f64>,
}

/// Resolution of paths.
#[derive(Debug, Clone, PartialEq)]
pub struct PathOptions {
    /// Maximum spacing of the points of the time law (m of path).
    pub spacing_m: f64,
    /// Maximum deviation of the joints from the path between points (m and rad).
    pub chord_m: f64,
    /// Rise and fall time of accelerations (s).
    pub rise_s: f64,
    /// Null-space rule for an arm with more joints than the path needs: redundant joints move
    /// towards its posture; without a rule they are held.
    pub rule: Option<NullSpaceRule>,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { spacing_m: 5e-3, chord_m: 1e-10, rise_s: 0.05, rule: None }
    }
}

/// The arm that runs a program, in terms of its controller.
#[derive(Debug, Clone)]
pub struct ProgramArm<'m> {
    /// Rigid-body model.
    pub model: &'m Model,
    /// Flange of the controller, F.
    pub flange: Frame,
    /// The robot's own tool on the flange, `X_FT`, used if the program gives none.
    pub X_FT: Pose,
    /// Pose of the controller's world in the model's, `X_MW`.
    pub X_MW: Pose,
    /// Coordinates in the order of the controller's axes.
    pub axes: Vec<usize>,
    /// Definition of each controller axis; empty if the axes are the joints.
    pub controller: Vec<ControllerAxis>,
    /// Limits, one for each independent coordinate.
    pub bounds: Vec<JointBounds>,
    /// All independent coordinates before the program; joints that it does not move keep these
    /// values.
    pub rest: DVector<f64>,
    /// Whether the program starts at `rest`; otherwise it starts at the target of its first move.
    pub starts_at_rest: bool,
}

/// Definition of a controller axis. The joint value is
///
/// ```text
/// q = zero + sense a + factor a_other
/// ```
/// where `a` is the value of the axis and `a_other` that of an earlier axis: arms whose third axis
/// is driven by a rod measure it against the horizontal and not against the previous link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerAxis {
    /// Sign, 1 or -1.
    pub sense: f64,
    /// Joint value at axis value zero (rad or m).
    pub zero: f64,
    /// Index of the other axis, from 0, and its factor.
    pub relative: Option<(usize, f64)>,
}

impl ControllerAxis {
    /// Axis value equal to the joint value.
    pub const SAME: Self = Self { sense: 1.0, zero: 0.0, relative: None };
}

impl ProgramArm<'_> {
    /// Sets the coordinates of the controller's first axes from axis values.
    pub fn set_axes(&self, values: &[f64], q: &mut DVector<f64>) {
        for (n, (value, &k)) in values.iter().zip(&self.axes).enumerate() {
            let axis = self.controller.get(n).unwrap_or(&ControllerAxis::SAME);
            let other = axis.relative.and_then(|(other, factor)| Some(factor * values.get(other)?));
            q[k] = axis.zero + axis.sense * value + other.unwrap_or(0.0);
        }
    }

    /// Returns the values of the controller's axes for all coordinates: the inverse of
    /// [`ProgramArm::set_axes`].
    pub fn axis_values(&self, q: &DVector<f64>) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.axes.len());
        for (n, &k) in self.axes.iter().enumerate() {
            let axis = self.controller.get(n).unwrap_or(&ControllerAxis::SAME);
            // An axis is relative to an earlier one.
            let other = axis.relative.and_then(|(other, factor)| Some(factor * values.get(other)?));
            values.push((q[k] - axis.zero - other.unwrap_or(0.0)) / axis.sense);
        }
        values
    }

    /// Zeros and senses of six joints, for configuration words that refer to the controller's axes.
    /// Coupling to another axis is ignored.
    pub(crate) fn controller_axes(&self, joints: [usize; 6]) -> ControllerAxes {
        let of = |k: usize| {
            let n = self.axes.iter().position(|&axis| axis == k);
            *n.and_then(|n| self.controller.get(n)).unwrap_or(&ControllerAxis::SAME)
        };
        let axes = joints.map(of);
        ControllerAxes { sign: axes.map(|axis| axis.sense), offset: axes.map(|axis| -axis.sense * axis.zero) }
    }
}

/// Result of one move.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMove {
    /// Line in the program.
    pub line: usize,
    /// Statement.
    pub statement: String,
    /// Start and end time (s); with a blend, the time at its middle.
    pub span_s: [f64; 2],
    /// Maximum speed of the tool centre point on its path, m/s (`None` for joint moves).
    pub top_m_s: Option<f64>,
    /// Programmed speed, m/s.
    pub programmed_m_s: Option<f64>,
    /// Place where a limit makes it slowest relative to the programmed speed.
    pub slowed: Option<Slowed>,
    /// Minimum singular value of the Jacobian on the path, m/rad, with its time, s; tool paths
    /// only.
    pub least_sigma: Option<(f64, f64)>,
    /// Distance from the target at which the path enters the blend, m; 0 at a stop.
    pub blend_m: f64,
}

/// A place where a limit of the robot slows a move.
#[derive(Debug, Clone, PartialEq)]
pub struct Slowed {
    /// Time from the start of the motion (s).
    pub time_s: f64,
    /// Fraction of the programmed speed, or of the joints' own limits.
    pub part: f64,
    /// The limit.
    pub by: SlowedBy,
}

/// Limit that slows a move.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SlowedBy {
    /// Speed of a joint.
    JointSpeed(String),
    /// Acceleration of a joint where the path is curved.
    JointAcceleration(String),
    /// Torque of a joint.
    JointTorque(String),
    /// Jerk of a joint.
    JointJerk(String),
    /// Rotation of the tool.
    Turning,
    /// Acceleration of the tool normal to its path.
    PathAcceleration,
}

/// A program planned as a motion.
#[derive(Debug, Clone)]
pub struct Planned {
    /// All actuated joints over time.
    pub trajectory: Trajectory,
    /// Results by move.
    pub moves: Vec<PlannedMove>,
    /// Corners at which the tool stops although a blend was requested: line and reason.
    pub stops: Vec<(usize, String)>,
    /// Joints held although they could move the tool (redundant arms).
    pub held: Vec<String>,
}

/// Error for a program that the arm cannot run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// The program has no move.
    #[error("the program has no move")]
    NoMove,
    /// Tool path from an unknown start.
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
    /// More axis values than the arm has axes.
    #[error("line {line}: {statement}: {found} axis values for an arm of {axes} axes")]
    Axes {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Number of values.
        found: usize,
        /// Number of axes of the arm.
        axes: usize,
    },
    /// No joint values reach the target.
    #[error("line {line}: {statement}: no joint values bring the tool there: {why}")]
    Unreachable {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Reason.
        why: String,
    },
    /// A path that leaves the workspace or passes a singular pose.
    #[error("line {line}: {statement}: {why}")]
    Blocked {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Place and cause as numbers.
        blocked: Blocked,
        /// The same as a sentence.
        why: String,
    },
    /// Three points that do not define a circle.
    #[error("line {line}: {statement}: {source}")]
    Arc {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Cause.
        source: ArcError,
    },
    /// Number that is not finite, or outside the range of a robot.
    #[error("line {line}: {statement}: {source}")]
    Value {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Cause.
        source: OutOfRange,
    },
    /// No time law was found.
    #[error("line {line}: {statement}: {why}")]
    Law {
        /// Line of the first move up to the next stop.
        line: usize,
        /// Statement.
        statement: String,
        /// Reason.
        why: String,
    },
    /// The joint trajectory is invalid.
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

/// Plans the motion of a program.
///
/// # Errors
/// [`PathError`] for targets out of reach, paths through singular poses, contradictory statements.
pub fn plan(program: &Program, arm: &ProgramArm<'_>, options: &PathOptions) -> Result<Planned, PathError> {
    let moving = coordinates_of(arm.model, &arm.flange);
    if moving.len() != 7 {
        return plan_holding(program, arm, options, None);
    }
    // Of seven joints one is held while the tool follows its path: the best one at the start, or
    // the first one with which the path can be run.
    let first = plan_holding(program, arm, options, None);
    if !matches!(first, Err(PathError::Blocked { .. })) {
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
) -> Result<Planned, PathError> {
    let mut legs = Legs::new(arm, options, held);
    let mut knots: Vec<Knot> = Vec::new();
    // A dwell before the first target is known takes place at that target.
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

/// Whether a joint moves by no more than the rounding error of Newton's method.
fn stays(knots: &[Knot], joint: usize) -> bool {
    let range = knots
        .iter()
        .map(|knot| knot.q[joint])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
    range.1 - range.0 <= STILL
}
