//! One move of a plan, from the end of the previous move.
//!
//! Start at [`Leg::curves`]: unit shapes (`shape`, or `via` for moves through via points) times the
//! travel of each joint.
//!
//! Not here: the sequence of the moves (`plan`), the time-optimal law (`optimal`).

use flexarm_settings::Finding;

use crate::curve::Curve;
use crate::error::PlanError;
use crate::findings::SHORT_DURATION;
use crate::optimal::JointPath;
use crate::plan::{MotionLimits, PlannedMove, Profile};
use crate::polynomial::Piece;
use crate::shape::{self, Phases, ShapeLimits};
use crate::via;

/// One move and its start.
pub(crate) struct Leg<'a> {
    /// Number of the move, counted from 1.
    pub(crate) number: usize,
    /// Position of every joint at the start.
    pub(crate) from: &'a [f64],
    pub(crate) planned: &'a PlannedMove,
    pub(crate) joints: &'a [String],
}

impl Leg<'_> {
    /// Returns the curve of every joint from time 0 of the move, and the duration of the move. The
    /// curve of a joint at rest has no pieces; that of a joint that arrives early ends early.
    pub(crate) fn curves(&self) -> Result<(Vec<Curve>, f64), PlanError> {
        if self.planned.profile == Profile::Optimal {
            return self.fastest_curves();
        }
        if !self.planned.via.is_empty() {
            return self.curves_through_points();
        }
        let moving: Vec<usize> = (0..self.joints.len()).filter(|&i| self.way(i) != 0.0).collect();
        let stay = Curve { knots: vec![0.0], pieces: Vec::new() };
        if moving.is_empty() {
            return Ok((vec![stay; self.joints.len()], self.planned.duration.unwrap_or(0.0)));
        }

        // One shape for all joints under the strictest limits, or one for each joint.
        let is_common = self.planned.synchronised || self.planned.duration.is_some();
        let common = if is_common { Some(self.shape(&moving)?) } else { None };
        let mut curves = Vec::with_capacity(self.joints.len());
        for i in 0..self.joints.len() {
            let curve = match (&common, self.way(i) == 0.0) {
                (_, true) => stay.clone(),
                (Some(shape), _) => shape.mapped(self.from[i], self.way(i)),
                (None, _) => self.shape(&[i])?.mapped(self.from[i], self.way(i)),
            };
            curves.push(curve);
        }
        let duration = curves.iter().map(|curve| curve.knots[curve.knots.len() - 1]).fold(0.0, f64::max);
        Ok((curves, duration))
    }

    fn way(&self, joint: usize) -> f64 {
        self.planned.to[joint] - self.from[joint]
    }

    /// The shape `s(t)` that moves the given joints within their limits or in the given duration.
    fn shape(&self, moving: &[usize]) -> Result<Curve, PlanError> {
        let mut limits = ShapeLimits { velocity: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };
        for &i in moving {
            let (way, joint) = (self.way(i).abs(), &self.planned.limits[i]);
            limits.velocity = limits.velocity.min(joint.velocity / way);
            limits.acceleration = limits.acceleration.min(joint.acceleration / way);
            limits.jerk = limits.jerk.min(joint.jerk / way);
        }
        match self.planned.duration {
            Some(duration) => Ok(self.shape_lasting(duration, &limits)),
            None => self.fastest_shape(moving, &limits),
        }
    }

    fn shape_lasting(&self, duration: f64, limits: &ShapeLimits) -> Curve {
        let ShapeLimits { acceleration, jerk, .. } = *limits;
        match self.planned.profile {
            Profile::Quintic | Profile::Optimal => shape::quintic(duration),
            Profile::Trapezoid { rounding } => Phases::trapezoid_in(duration, acceleration, rounding)
                .unwrap_or_else(|| Phases::trapezoid_default(duration, rounding))
                .curve(),
            Profile::SCurve => Some(())
                .filter(|()| acceleration.is_finite() && jerk.is_finite())
                .and_then(|()| Phases::s_curve_in(duration, acceleration, jerk))
                .unwrap_or_else(|| Phases::s_curve_default(duration))
                .curve(),
        }
    }

    /// Shape of a move without a duration: every moving joint needs the limits that the profile
    /// uses.
    fn fastest_shape(&self, moving: &[usize], limits: &ShapeLimits) -> Result<Curve, PlanError> {
        self.require("velocity", moving, |limits| limits.velocity)?;
        match self.planned.profile {
            Profile::Quintic | Profile::Optimal => {
                Ok(shape::quintic(shape::duration_for_peaks(shape::quintic_peaks(), limits)))
            }
            Profile::Trapezoid { rounding } => {
                self.require("acceleration", moving, |limits| limits.acceleration)?;
                Ok(Phases::trapezoid(limits, rounding).curve())
            }
            Profile::SCurve => {
                self.require("acceleration", moving, |limits| limits.acceleration)?;
                self.require("jerk", moving, |limits| limits.jerk)?;
                Ok(Phases::s_curve(limits).curve())
            }
        }
    }

    fn require(
        &self,
        quantity: &'static str,
        moving: &[usize],
        limit: impl Fn(&MotionLimits) -> f64,
    ) -> Result<(), PlanError> {
        match moving.iter().find(|&&i| !limit(&self.planned.limits[i]).is_finite()) {
            None => Ok(()),
            Some(&i) => Err(PlanError::MissingLimit { number: self.number, joint: self.joints[i].clone(), quantity }),
        }
    }

    /// Curves of a move through via points: always synchronised, always quintic.
    fn curves_through_points(&self) -> Result<(Vec<Curve>, f64), PlanError> {
        let Self { number, planned, .. } = *self;
        if planned.profile != Profile::Quintic {
            let message = format!(
                "move {number} passes points on the way, which only the quintic and the optimal law can; set `profile = \
                 \"quintic\"` in this move or drop `via`"
            );
            return Err(PlanError::Invalid { number: Some(number), message });
        }
        // Spline through the points over unit time, at rest at both ends.
        let (points, weights, moving) = self.points();
        let u = via::passing_times(&points, &weights).map_err(|via| PlanError::repeated_point(number, via))?;
        let unit_curve = |i: usize| {
            let q: Vec<f64> = points.iter().map(|point| point[i]).collect();
            Curve { knots: u.clone(), pieces: via::rest_to_rest_spline(&u, &q) }
        };
        let unit: Vec<Curve> = (0..self.joints.len()).map(unit_curve).collect();

        // Duration as given, or the shortest within the limits.
        let duration = match planned.duration {
            Some(duration) => duration,
            None => {
                self.require("velocity", &moving, |limits| limits.velocity)?;
                let needed = |&i: &usize| {
                    let MotionLimits { velocity, acceleration, jerk } = planned.limits[i];
                    shape::duration_for_peaks(unit[i].peaks(), &ShapeLimits { velocity, acceleration, jerk })
                };
                moving.iter().map(needed).fold(0.0, f64::max)
            }
        };
        Ok((unit.iter().map(|curve| curve.stretched(duration)).collect(), duration))
    }

    /// Returns all points from start to goal, the unit of travel of each joint, and the joints that
    /// move.
    fn points(&self) -> (Vec<&[f64]>, Vec<f64>, Vec<usize>) {
        let mut points: Vec<&[f64]> = vec![self.from];
        points.extend(self.planned.via.iter().map(Vec::as_slice));
        points.push(&self.planned.to);
        let n = self.joints.len();
        let moving: Vec<usize> = (0..n).filter(|&i| points.iter().any(|point| point[i] != self.from[i])).collect();
        // The unit of travel is the travel per unit of time at the speed limit if all limits are
        // known, otherwise 1.
        let speed = |i: usize| self.planned.limits[i].velocity;
        let weighted = moving.iter().all(|&i| speed(i).is_finite());
        let weights = (0..n).map(|i| if weighted && speed(i).is_finite() { speed(i) } else { 1.0 }).collect();
        (points, weights, moving)
    }

    /// Returns the time-optimal curves along the spline through all points, slowed to the duration
    /// if one is given.
    fn fastest_curves(&self) -> Result<(Vec<Curve>, f64), PlanError> {
        let Self { number, planned, .. } = *self;
        let (points, weights, moving) = self.points();
        if moving.is_empty() {
            let stay = Curve { knots: vec![0.0], pieces: Vec::new() };
            return Ok((vec![stay; self.joints.len()], planned.duration.unwrap_or(0.0)));
        }
        self.require("velocity", &moving, |limits| limits.velocity)?;
        self.require("acceleration", &moving, |limits| limits.acceleration)?;
        let path = JointPath::new(&points, &weights, &planned.limits);
        let curves = path.map_err(|via| PlanError::repeated_point(number, via))?.fastest();
        let least = curves.iter().filter_map(|curve| curve.knots.last()).fold(0.0, |end: f64, t| end.max(*t));
        let duration = planned.duration.unwrap_or(least);
        Ok((curves.iter().map(|curve| curve.stretched(duration / least)).collect(), duration))
    }

    /// Acceleration and jerk limits that the given duration violates.
    pub(crate) fn warnings(&self, curves: &[Curve]) -> Vec<Finding> {
        let mut warnings = Vec::new();
        if self.planned.duration.is_none() {
            return warnings;
        }
        for ((curve, limits), joint) in curves.iter().zip(&self.planned.limits).zip(self.joints) {
            let [_, acceleration, jerk] = curve.peaks();
            // The jerk limit applies to S-curve and optimal moves; the other profiles do not keep
            // it.
            let is_jerk_limited = matches!(self.planned.profile, Profile::SCurve | Profile::Optimal);
            let jerk = if is_jerk_limited { jerk } else { 0.0 };
            let checks = [("acceleration", acceleration, limits.acceleration), ("jerk", jerk, limits.jerk)];
            for (quantity, value, limit) in checks {
                if value > limit * (1.0 + 1e-9) {
                    let message = format!(
                        "move {}: the given duration takes the {quantity} of joint {joint:?} to {value:.4}, over its \
                         limit of {limit:.4} (SI units): allow more time or drop the limit",
                        self.number
                    );
                    warnings.push(Finding::warning(SHORT_DURATION, "", message, ""));
                }
            }
        }
        warnings
    }
}

impl Curve {
    /// Appends a part that starts at time `now`, and holds `goal` from the end of the part until
    /// `end`.
    pub(crate) fn append(&mut self, now: f64, part: &Self, end: f64, goal: f64) {
        self.pieces.extend(&part.pieces);
        self.knots.extend(part.knots[1..].iter().map(|knot| now + knot));
        self.append_hold(end, goal);
    }

    /// Holds `q` from the last knot until `until`.
    pub(crate) fn append_hold(&mut self, until: f64, q: f64) {
        let last = self.knots.len() - 1;
        // A remainder from rounding of the times is not a hold.
        if until - self.knots[last] > 1e-14 * until {
            self.pieces.push(Piece::constant(until - self.knots[last], q));
            self.knots.push(until);
        } else {
            self.knots[last] = until;
        }
    }

    /// `offset + factor * s(t)`.
    fn mapped(&self, offset: f64, factor: f64) -> Self {
        let pieces = self.pieces.iter().map(|piece| piece.mapped(offset, factor, 1.0)).collect();
        Self { knots: self.knots.clone(), pieces }
    }

    /// The same values with the time multiplied by `stretch`.
    pub(crate) fn stretched(&self, stretch: f64) -> Self {
        let pieces = self.pieces.iter().map(|piece| piece.mapped(0.0, 1.0, stretch)).collect();
        Self { knots: self.knots.iter().map(|knot| knot * stretch).collect(), pieces }
    }

    /// Maximum speed, acceleration and jerk.
    fn peaks(&self) -> [f64; 3] {
        if self.pieces.is_empty() {
            return [0.0; 3];
        }
        [1, 2, 3].map(|order| self.largest(order))
    }
}
