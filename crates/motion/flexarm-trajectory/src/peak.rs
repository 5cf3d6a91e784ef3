//! Extrema of the position, velocity, acceleration and jerk of each joint, with their times.
//!
//! Exact: extrema come from the roots of the next derivative of each polynomial piece, not from
//! samples.

use crate::curve::Curve;
use crate::trajectory::Trajectory;

/// A value and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extreme {
    /// Time, s.
    pub time_s: f64,
    /// Value with its sign, SI.
    pub value: f64,
}

/// Extrema of one joint over the whole trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct JointPeak {
    /// Joint name.
    pub joint: String,
    /// Minimum position, rad or m.
    pub lower: Extreme,
    /// Maximum position, rad or m.
    pub upper: Extreme,
    /// Velocity of greatest magnitude, rad/s or m/s.
    pub velocity: Extreme,
    /// Acceleration of greatest magnitude, rad/s² or m/s².
    pub acceleration: Extreme,
    /// Jerk of greatest magnitude within the pieces, rad/s³ or m/s³, without jumps of the
    /// acceleration.
    pub jerk: Extreme,
    /// Maximum jump of the acceleration, rad/s² or m/s²: at rounding level, except for an unrounded
    /// trapezoid or samples of a motion with jumps.
    pub acceleration_jump: Extreme,
}

impl Trajectory {
    /// Returns the extrema of every joint, in the order of [`Trajectory::joints`]; exact up to
    /// rounding.
    pub fn peak(&self) -> Vec<JointPeak> {
        let peak = |(joint, curve): (&String, &Curve)| {
            let [lower, upper] = curve.range(0);
            let jump = curve.jumps().map(|jump| Extreme { time_s: jump.time_s, value: jump.size[2] });
            JointPeak {
                joint: joint.clone(),
                lower,
                upper,
                velocity: largest(curve.range(1)),
                acceleration: largest(curve.range(2)),
                jerk: largest(curve.range(3)),
                acceleration_jump: largest(jump),
            }
        };
        self.joints().iter().zip(self.curves()).map(peak).collect()
    }
}

impl Curve {
    /// Minimum and maximum of derivative `order` over all pieces.
    pub(crate) fn range(&self, order: usize) -> [Extreme; 2] {
        let mut extremes = [f64::INFINITY, f64::NEG_INFINITY].map(|value| Extreme { time_s: 0.0, value });
        for (knot, piece) in self.knots.iter().zip(&self.pieces) {
            let [least, greatest] = piece.range(order).map(|(tau, value)| Extreme { time_s: knot + tau, value });
            if least.value < extremes[0].value {
                extremes[0] = least;
            }
            if greatest.value > extremes[1].value {
                extremes[1] = greatest;
            }
        }
        extremes
    }
}

/// Returns the extreme of greatest magnitude, the first one if several are equal.
fn largest(extremes: impl IntoIterator<Item = Extreme>) -> Extreme {
    let zero = Extreme { time_s: 0.0, value: 0.0 };
    extremes.into_iter().fold(zero, |best, e| if e.value.abs() > best.value.abs() { e } else { best })
}
