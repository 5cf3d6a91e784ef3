//! Point-to-point planning: moves with a profile and holds between them, made into a trajectory.
//!
//! Start at [`Plan::build`]. One move is planned in `leg`, from the unit shapes in `shape` and
//! `via`.
//!
//! **Duration given**: every joint takes it. A quintic needs nothing else. A trapezoid uses the
//! acceleration limit in its ramps if there is one, otherwise each ramp takes a quarter of the
//! duration; an S-curve uses acceleration and jerk limit if both are there, otherwise each ramp
//! takes a third, a third of that for either rise. A duration too short for these limits gets the
//! default ramps and a [`crate::Warning::ShorterThanLimitsAllow`].
//!
//! **No duration**: the move is as fast as the limits allow. Synchronised, all joints follow one
//! common shape (a straight line in joint space) under the strictest limits; otherwise each joint
//! has a shape of its own and the move lasts as long as its slowest joint.

use crate::error::TrajectoryError;
use crate::leg::Leg;
use crate::problem::PlanError;
use crate::trajectory::{Curve, Trajectory};

/// How a move gathers and loses speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Profile {
    /// `D u³ (10 - 15 u + 6 u²)`: peaks `15/8 D/T`, `10/sqrt(3) D/T²`.
    Quintic,
    /// Ramp, cruise, ramp.
    Trapezoid {
        /// Part of each ramp, 0 to 1, in which the acceleration rises and falls linearly (half of
        /// it at either side); 0 is the plain trapezoid, whose acceleration jumps.
        rounding: f64,
    },
    /// Ramp, cruise, ramp with limited jerk: seven phases.
    SCurve,
    /// The least time along the spline through the points on the way, within speeds, accelerations
    /// and jerks. A joint without a limit of its jerk takes 0.05 s or more to reach its
    /// acceleration.
    Optimal,
}

/// Limits that shape the moves of one joint; infinite when there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Greatest speed, rad/s or m/s.
    pub velocity: f64,
    /// Greatest acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Greatest jerk, rad/s³ or m/s³.
    pub jerk: f64,
}

impl MotionLimits {
    /// No limit at all.
    pub const UNLIMITED: Self = Self { velocity: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };
}

/// One move and the hold after it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMove {
    /// Goal of every joint, rad or m.
    pub to: Vec<f64>,
    /// Points passed without a stop (quintic and optimal only), each with a value for every joint.
    pub via: Vec<Vec<f64>>,
    /// Duration in s; `None` is as fast as the limits allow.
    pub duration: Option<f64>,
    /// Rest after the move, s.
    pub hold: f64,
    /// Shape of the move.
    pub profile: Profile,
    /// Do all joints start and stop together? Matters only without a duration and without points on
    /// the way.
    pub synchronised: bool,
    /// One per joint.
    pub limits: Vec<MotionLimits>,
}

impl PlannedMove {
    /// A quintic move to the goal within `duration` seconds, without limits, points on the way or
    /// hold.
    pub fn quintic(to: Vec<f64>, duration: f64) -> Self {
        let limits = vec![MotionLimits::UNLIMITED; to.len()];
        let (via, duration, profile) = (Vec::new(), Some(duration), Profile::Quintic);
        Self { to, via, duration, hold: 0.0, profile, synchronised: true, limits }
    }
}

/// A start and the moves after it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Joint names.
    pub joints: Vec<String>,
    /// Position of every joint at `t = 0`, rad or m.
    pub start: Vec<f64>,
    /// The moves, each from where the one before it ended.
    pub moves: Vec<PlannedMove>,
}

impl Plan {
    /// The trajectory that carries out the plan; starts and ends every move at rest.
    ///
    /// # Errors
    /// [`TrajectoryError::Plan`] when the plan contradicts itself or a limit that it needs is
    /// missing; [`TrajectoryError::OutOfRange`] when numbers are too extreme for f64.
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
            return Err(PlanError::NothingHappens.into());
        }
        Trajectory::from_curves(self.joints.clone(), curves, now, notes)
    }

    /// Checks shapes and numbers of everything that is given.
    fn check(&self) -> Result<(), PlanError> {
        let n = self.joints.len();
        let length = |what: &'static str, number: usize, found: usize| match found == n {
            true => Ok(()),
            false => Err(PlanError::Length { what, number, found, expected: n }),
        };
        let finite = |what: &'static str, number: usize, values: &[f64]| match values.iter().find(|q| !q.is_finite()) {
            None => Ok(()),
            Some(&value) => Err(PlanError::BadNumber { what, number, value, allowed: "a finite number" }),
        };
        let within = |what: &'static str, number: usize, value: f64, is_good: bool, allowed: &'static str| match is_good
        {
            true => Ok(()),
            false => Err(PlanError::BadNumber { what, number, value, allowed }),
        };

        if n == 0 {
            return Err(PlanError::NoJoint);
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
