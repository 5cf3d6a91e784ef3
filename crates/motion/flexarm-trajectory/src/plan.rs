//! Point-to-point planning: builds a trajectory from moves with a profile and holds between them.
//!
//! Start at [`Plan::build`]. `leg` plans one move from the unit shapes in `shape` and `via`.
//!
//! **Duration given**: it applies to every joint. A quintic needs nothing else. A trapezoid uses
//! the acceleration limit in its ramps if there is one; otherwise each ramp takes a quarter of the
//! duration. An S-curve uses acceleration and jerk limits if both are given; otherwise each ramp
//! takes a third of the duration, and each rise of the acceleration a third of that. If the
//! duration is too short for these limits, the move gets the default ramps and a
//! warning with the code `short-duration`.
//!
//! **No duration**: the move is as fast as the limits allow. If synchronised, all joints follow one
//! common shape (a straight line in joint space) under the strictest limits; otherwise each joint
//! has its own shape and the slowest joint determines the duration.
//!
//! Not here: files of waypoints (`waypoints`), paths of the tool (crate `flexarm-path`).

use flexarm_settings::Finding;

use crate::curve::Curve;
use crate::error::{PlanError, TrajectoryError};
use crate::leg::Leg;

use crate::trajectory::Trajectory;

/// Message about a plan that lasts no time.
const STILL: &str = "nothing moves and nothing is held, so the trajectory lasts 0 s; add a move or a hold";

/// Velocity profile of a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Profile {
    /// `D u³ (10 - 15 u + 6 u²)`: peaks `15/8 D/T`, `10/sqrt(3) D/T²`.
    Quintic,
    /// Ramp, cruise, ramp.
    Trapezoid {
        /// Fraction of each ramp, 0 to 1, in which the acceleration rises and falls linearly (half
        /// of it at either end); 0 is the plain trapezoid, whose acceleration jumps.
        rounding: f64,
    },
    /// Ramp, cruise, ramp with limited jerk: seven phases.
    SCurve,
    /// Minimum time along the spline through the via points, within velocity, acceleration and jerk
    /// limits. Without a jerk limit a joint takes at least 0.05 s to reach its acceleration limit.
    Optimal,
}

/// Limits of one joint for planning; infinite means no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Maximum speed, rad/s or m/s.
    pub velocity: f64,
    /// Maximum acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Maximum jerk, rad/s³ or m/s³.
    pub jerk: f64,
}

impl MotionLimits {
    /// No limits.
    pub const UNLIMITED: Self = Self { velocity: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };

    /// Returns a warning about the first limit that does not suit the others, as one in another
    /// unit.
    ///
    /// * `own`: maximum speed of the robot's joint (rad/s or m/s).
    pub fn unusual(&self, joint: &str, own: f64) -> Option<Finding> {
        let found = [
            ("its speed limit over that of the robot is", self.velocity / own, SPEED_RATIO),
            ("the time to its full speed in s is", self.velocity / self.acceleration, FULL_SPEED_S),
            ("the time to its full acceleration in s is", self.acceleration / self.jerk, FULL_ACCELERATION_S),
        ];
        let is_unusual =
            |value: f64, [low, high]: [f64; 2]| value.is_finite() && value > 0.0 && !(low..=high).contains(&value);
        let (what, value, [low, high]) = found.into_iter().find(|(_, value, usual)| is_unusual(*value, *usual))?;
        let message = format!(
            "limits of joint {joint:?}: {what} {value:.2e}, usual are {low} to {high}: are speed, acceleration and jerk \
             in the unit of the file (deg or rad)?"
        );
        let yardstick = if value < low { low } else { high };
        Some(Finding::warning("motion-limits", joint, message, "").measured(value, yardstick))
    }
}

/// Usual speed limit of a motion over that of the robot; a factor of 57 lies between degrees and
/// radians.
const SPEED_RATIO: [f64; 2] = [0.02, 10.0];
/// Usual time to full speed (s): delta robots take 0.02, cranes 5.
const FULL_SPEED_S: [f64; 2] = [0.01, 10.0];
/// Usual time to full acceleration (s): the Franka arm takes 0.002.
const FULL_ACCELERATION_S: [f64; 2] = [1e-3, 3.0];

/// One move and the hold after it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMove {
    /// Goal of every joint, rad or m.
    pub to: Vec<f64>,
    /// Via points, passed without a stop (quintic and optimal only), each with a value for every
    /// joint.
    pub via: Vec<Vec<f64>>,
    /// Duration (s); `None` means as fast as the limits allow.
    pub duration: Option<f64>,
    /// Hold after the move (s).
    pub hold: f64,
    /// Profile of the move.
    pub profile: Profile,
    /// Whether all joints start and stop together. Matters only without a duration and without via
    /// points.
    pub synchronised: bool,
    /// Limits, one per joint.
    pub limits: Vec<MotionLimits>,
}

impl PlannedMove {
    /// Returns a quintic move to the goal `to` (rad or m, one value per joint) within `duration`
    /// seconds, without limits, via points or hold.
    pub fn quintic(to: Vec<f64>, duration: f64) -> Self {
        let limits = vec![MotionLimits::UNLIMITED; to.len()];
        let (via, duration, profile) = (Vec::new(), Some(duration), Profile::Quintic);
        Self { to, via, duration, hold: 0.0, profile, synchronised: true, limits }
    }
}

/// A start and the moves that follow.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Joint names.
    pub joints: Vec<String>,
    /// Position of every joint at `t = 0`, rad or m.
    pub start: Vec<f64>,
    /// The moves, each from the end of the previous one.
    pub moves: Vec<PlannedMove>,
}

impl Plan {
    /// Returns the trajectory of the plan, in which every move starts and ends at rest.
    ///
    /// # Errors
    /// [`TrajectoryError::Plan`] if the plan is inconsistent or a required limit is missing;
    /// [`TrajectoryError::OutOfRange`] if numbers are too extreme for f64.
    pub fn build(&self) -> Result<Trajectory, TrajectoryError> {
        self.check()?;
        let mut curves: Vec<Curve> =
            self.joints.iter().map(|_| Curve { knots: vec![0.0], pieces: Vec::new() }).collect();
        let (mut now, mut from, mut notes) = (0.0, &self.start, Vec::new());
        for (i, planned) in self.moves.iter().enumerate() {
            let leg = Leg { number: i + 1, from, planned, joints: &self.joints };
            let (parts, duration) = leg.curves()?;
            notes.extend(leg.warnings(&parts));
            for ((curve, part), goal) in curves.iter_mut().zip(&parts).zip(&planned.to) {
                curve.append(now, part, now + duration, *goal);
                curve.append_hold(now + duration + planned.hold, *goal);
            }
            now += duration + planned.hold;
            from = &planned.to;
        }
        if now <= 0.0 {
            return Err(PlanError::of_move(0, STILL).into());
        }
        Trajectory::from_curves(self.joints.clone(), curves, now, notes)
    }

    /// Checks list lengths and number ranges.
    fn check(&self) -> Result<(), PlanError> {
        let n = self.joints.len();
        let length = |what: &'static str, number: usize, found: usize| match found == n {
            true => Ok(()),
            false => {
                let what = format!("`{what}` has {found} entries; expected {n}, one per joint");
                Err(PlanError::of_move(number, what))
            }
        };
        let finite = |what: &'static str, number: usize, values: &[f64]| match values.iter().find(|q| !q.is_finite()) {
            None => Ok(()),
            Some(value) => Err(bad_number(what, number, *value, "a finite number")),
        };
        let within = |what: &'static str, number: usize, value: f64, is_good: bool, allowed: &'static str| match is_good
        {
            true => Ok(()),
            false => Err(bad_number(what, number, value, allowed)),
        };

        // The start, then each move: lengths first, then values.
        if n == 0 {
            return Err(PlanError::of_move(0, "the plan has no joints; name at least one"));
        }
        length("start", 0, self.start.len())?;
        finite("start", 0, &self.start)?;
        for (i, planned) in self.moves.iter().enumerate() {
            let number = i + 1;
            length("to", number, planned.to.len())?;
            finite("to", number, &planned.to)?;
            for point in &planned.via {
                length("via", number, point.len())?;
                finite("via", number, point)?;
            }
            length("limits", number, planned.limits.len())?;
            let duration = planned.duration.unwrap_or(1.0);
            within("duration", number, duration, duration > 0.0 && duration.is_finite(), "positive, in s")?;
            let hold = planned.hold;
            within("hold", number, hold, hold >= 0.0 && hold.is_finite(), "zero or positive, in s")?;
            if let Profile::Trapezoid { rounding } = planned.profile {
                within("rounding", number, rounding, (0.0..=1.0).contains(&rounding), "from 0 to 1")?;
            }
            for limit in &planned.limits {
                for value in [limit.velocity, limit.acceleration, limit.jerk] {
                    within("limits", number, value, value > 0.0, "positive, or infinite for no limit")?;
                }
            }
        }
        Ok(())
    }
}

fn bad_number(what: &str, number: usize, value: f64, allowed: &str) -> PlanError {
    PlanError::of_move(number, format!("`{what}` is {value}; expected {allowed}"))
}
