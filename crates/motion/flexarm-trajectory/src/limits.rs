//! Checks a trajectory against the limits of its joints: all violations, each with its time and
//! size.
//!
//! Start at [`Trajectory::check_limits`](crate::Trajectory::check_limits). Not here: limits in
//! planning (`plan`), torques.

use flexarm_settings::Finding;

use crate::curve::Curve;
use crate::trajectory::Trajectory;

/// Relative tolerance: a limit counts as violated beyond this fraction of its value, so that a move
/// planned at the limit does not violate it.
const RELATIVE_SLACK: f64 = 1e-9;
/// Absolute tolerance for limits near zero, rad or m (and their rates).
const ABSOLUTE_SLACK: f64 = 1e-12;

/// Tolerance of positions over the range of the joint: a curve through the rounded positions of a
/// table passes a limit on which they lie by a part of their last digit.
const ROUNDING: f64 = 1e-5;

/// Limits of one joint; an infinite or NaN entry means no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Minimum position, rad or m.
    pub lower: f64,
    /// Greatest position, rad or m.
    pub upper: f64,
    /// Greatest speed, rad/s or m/s.
    pub velocity: f64,
    /// Greatest acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Greatest jerk, rad/s³ or m/s³.
    pub jerk: f64,
}

impl JointLimits {
    /// No limits, as a base for struct update.
    pub const UNLIMITED: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        acceleration: f64::INFINITY,
        jerk: f64::INFINITY,
    };
}

impl Default for JointLimits {
    fn default() -> Self {
        Self::UNLIMITED
    }
}

/// Kind of limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Position below [`JointLimits::lower`].
    Lower,
    /// Position above [`JointLimits::upper`].
    Upper,
    /// Speed above [`JointLimits::velocity`].
    Velocity,
    /// Acceleration above [`JointLimits::acceleration`].
    Acceleration,
    /// Jerk above [`JointLimits::jerk`].
    Jerk,
    /// Torque or force of a drive above its limit; only callers that know forces find it.
    Effort,
}

/// A limit that a joint violates, with the worst value.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitViolation {
    /// Joint name.
    pub joint: String,
    /// Kind of limit.
    pub kind: LimitKind,
    /// Time of the worst value, s.
    pub time_s: f64,
    /// Time of the first violation, s.
    pub since_s: f64,
    /// The worst value with its sign, rad, rad/s, rad/s², rad/s³ or N m (m, m/s, m/s², m/s³ or N).
    pub value: f64,
    /// The limit, in the same unit; for rates with the sign of `value`.
    pub limit: f64,
}

impl LimitViolation {
    /// Returns the warning `joint-limit` about the violation; its location is the joint.
    pub fn warning(&self) -> Finding {
        let (what, mend) = match self.kind {
            LimitKind::Lower => ("position falls below its lower limit", "change the waypoints"),
            LimitKind::Upper => ("position rises above its upper limit", "change the waypoints"),
            LimitKind::Velocity => ("velocity exceeds its limit", "allow the move more time"),
            LimitKind::Acceleration => ("acceleration exceeds its limit", "allow the move more time"),
            LimitKind::Jerk => ("jerk exceeds its limit", "allow the move more time"),
            LimitKind::Effort => ("effort exceeds its limit", "allow the move more time"),
        };
        let Self { joint, time_s, since_s, value, limit, .. } = self;
        let message = format!(
            "joint {joint:?}: {what} {limit:.4}: {value:.4} at t = {time_s:.4} s, first passed at {since_s:.4} s \
             (SI units); {mend}"
        );
        Finding::warning("joint-limit", joint, message, "")
    }
}

impl Trajectory {
    /// Returns all limit violations, by joint and then in the order of [`LimitKind`]; empty if
    /// there are none.
    ///
    /// Compares exact extrema of the polynomials, with a tolerance of 1e-9 relative and 1e-12
    /// absolute, so that a move planned at a limit keeps it.
    ///
    /// * `limits`: one entry per joint, in the order of [`Trajectory::joints`].
    ///
    /// # Panics
    /// If `limits` does not have one entry per joint.
    pub fn check_limits(&self, limits: &[JointLimits]) -> Vec<LimitViolation> {
        let n = self.joints().len();
        assert_eq!(limits.len(), n, "check_limits needs one JointLimits per joint of the trajectory");
        let mut violations = Vec::new();
        for ((joint, curve), limit) in self.joints().iter().zip(self.curves()).zip(limits) {
            let range = limit.upper - limit.lower;
            let slack = if range.is_finite() { ROUNDING * range } else { 0.0 };
            let rates = [limit.velocity, limit.acceleration, limit.jerk].map(|rate| [Some(-rate), Some(rate)]);
            violations.extend(passed(joint, curve, (LimitKind::Lower, 0), [Some(limit.lower), None], slack));
            violations.extend(passed(joint, curve, (LimitKind::Upper, 0), [None, Some(limit.upper)], slack));
            violations.extend(passed(joint, curve, (LimitKind::Velocity, 1), rates[0], 0.0));
            violations.extend(passed(joint, curve, (LimitKind::Acceleration, 2), rates[1], 0.0));
            violations.extend(passed(joint, curve, (LimitKind::Jerk, 3), rates[2], 0.0));
        }
        violations
    }
}

/// Checks one limit of one joint.
///
/// * `order`: of the derivative that is limited. `rounding`: excess that does not count (rad or m).
fn passed(
    joint: &str,
    curve: &Curve,
    (kind, order): (LimitKind, usize),
    [lower, upper]: [Option<f64>; 2],
    rounding: f64,
) -> Option<LimitViolation> {
    let limit = upper.or(lower).filter(|limit| limit.is_finite())?;
    let slack = RELATIVE_SLACK * limit.abs() + ABSOLUTE_SLACK;

    // Excess over either limit; the worse side is reported, the earlier one sets `since_s`.
    let [least, greatest] = curve.range(order);
    let beyond_upper = upper.map(|level| (greatest.value - level, greatest, level));
    let beyond_lower = lower.map(|level| (level - least.value, least, level));
    let sides: Vec<_> =
        [beyond_upper, beyond_lower].into_iter().flatten().filter(|side| side.0 > slack.max(rounding)).collect();
    let (_, worst, level) = *sides.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let first = |&(_, _, level): &(f64, _, f64)| first_beyond(curve, order, level, upper == Some(level), slack);
    let since_s = sides.iter().map(first).fold(worst.time_s, f64::min);
    Some(LimitViolation {
        joint: joint.to_owned(),
        kind,
        time_s: worst.time_s,
        since_s,
        value: worst.value,
        limit: level,
    })
}

/// First time at which derivative `order` is beyond `level` by more than `slack`.
fn first_beyond(curve: &Curve, order: usize, level: f64, above: bool, slack: f64) -> f64 {
    let bound = if above { level + slack } else { level - slack };
    let is_beyond = |value: f64| if above { value > bound } else { value < bound };
    for (knot, piece) in curve.knots.iter().zip(&curve.pieces) {
        if is_beyond(piece.at(0.0)[order]) {
            return *knot;
        }
        let [least, greatest] = piece.range(order);
        let worst = if above { greatest } else { least };
        if is_beyond(worst.1) {
            return knot + piece.first_crossing(order, bound).unwrap_or(worst.0);
        }
    }
    curve.knots[curve.knots.len() - 1]
}
