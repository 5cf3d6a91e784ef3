//! Checks that the numbers of a program are finite and within the range of a robot, which bounds
//! the work of planning.
//!
//! Not here: limits of the robot (`limits.rs`).

use flexarm_spatial::Pose;
use flexarm_trajectory::LONGEST;

use crate::program::{Blend, Configuration, Item, Move, MoveKind, Target};

/// Maximum axis value, coordinate of a point, and angle of an arc (rad or m).
const FARTHEST: f64 = 1e4;
/// Minimum and maximum speed, acceleration, jerk, and fraction of them (SI units).
const RATES: [f64; 2] = [1e-6, 1e12];

/// A number of a program outside its range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {}, expected {} to {} ({unit})", short(*.value), short(.range[0]), short(.range[1]))]
pub struct OutOfRange {
    /// Name of the quantity.
    pub what: &'static str,
    /// The number.
    pub value: f64,
    /// Minimum and maximum value.
    pub range: [f64; 2],
    /// Unit of the numbers.
    pub unit: &'static str,
}

/// Formats a number without long rows of zeros.
fn short(value: f64) -> String {
    let size = value.abs();
    if size.is_finite() && size != 0.0 && !(1e-4..1e6).contains(&size) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

fn within(what: &'static str, unit: &'static str, value: f64, range: [f64; 2]) -> Result<(), OutOfRange> {
    if (range[0]..=range[1]).contains(&value) { Ok(()) } else { Err(OutOfRange { what, value, range, unit }) }
}

/// Checks axis values (rad or m).
///
/// # Errors
/// [`OutOfRange`] for the first value that is not finite or too large.
pub fn check_axes(values: &[f64]) -> Result<(), OutOfRange> {
    values.iter().try_for_each(|value| within("an axis value", "rad or m", *value, [-FARTHEST, FARTHEST]))
}

fn check_point(what: &'static str, p: &nalgebra::Vector3<f64>) -> Result<(), OutOfRange> {
    p.iter().try_for_each(|value| within(what, "m", *value, [-FARTHEST, FARTHEST]))
}

fn check_pose(what: &'static str, X: &Pose) -> Result<(), OutOfRange> {
    check_point(what, &X.translation.vector)?;
    X.rotation
        .matrix()
        .iter()
        .try_for_each(|value| within("a direction of the tool or a frame", "1", *value, [-1.1, 1.1]))
}

/// Checks the time at which a motion ends (s).
pub(crate) fn check_end(time: f64) -> Result<(), OutOfRange> {
    within("the time at which the motion ends", "s", time, [0.0, LONGEST])
}

/// Checks a speed, acceleration, jerk, or fraction of them (SI units).
///
/// # Errors
/// [`OutOfRange`] if the value is outside the range.
pub fn check_rate(what: &'static str, unit: &'static str, value: f64) -> Result<(), OutOfRange> {
    within(what, unit, value, RATES)
}

impl Item {
    /// Checks that all numbers are within the range of a robot.
    ///
    /// # Errors
    /// [`OutOfRange`] for the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Move(of) => of.check(),
            Self::Dwell { seconds, .. } => within("the time to wait", "s", *seconds, [0.0, LONGEST]),
        }
    }
}

impl Move {
    /// Checks that all numbers are within the range of a robot.
    ///
    /// # Errors
    /// [`OutOfRange`] for the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match &self.to {
            Target::Joints(values) => check_axes(values)?,
            Target::Pose { X_BT, configuration } => {
                check_pose("a coordinate of the target", X_BT)?;
                if let Configuration::Near(values) = configuration {
                    check_axes(values)?;
                }
            }
        }
        check_pose("a coordinate of the base", &self.X_WB)?;
        self.X_FT.iter().try_for_each(|X_FT| check_pose("a coordinate of the tool", X_FT))?;
        if let MoveKind::Arc { via, via_rotation, angle, .. } = &self.kind {
            check_point("a coordinate of the auxiliary point", via)?;
            let turned = via_rotation.map(|R| Pose::from_parts(nalgebra::Translation3::identity(), R));
            turned.iter().try_for_each(|X| check_pose("", X))?;
            angle.map_or(Ok(()), |angle| within("the angle of the arc", "rad", angle, [-FARTHEST, FARTHEST]))?;
        }
        // Speeds and accelerations, the duration, and the blend.
        let speed = &self.speed;
        let rates = [
            ("the speed of the path", "m/s", speed.linear_m_s),
            ("the acceleration of the path", "m/s2", speed.linear_m_s2),
            ("the jerk of the path", "m/s3", speed.linear_m_s3),
            ("the speed of turning", "rad/s", speed.angular_rad_s),
            ("the acceleration of turning", "rad/s2", speed.angular_rad_s2),
            ("the part of the joint speeds", "1", speed.joint_fraction),
            ("the part of the joint accelerations", "1", speed.joint_acceleration_fraction),
            ("the joint speed", "rad/s", speed.joint_rad_s),
            ("the joint acceleration", "rad/s2", speed.joint_rad_s2),
        ];
        for (what, unit, value) in rates {
            value.map_or(Ok(()), |value| check_rate(what, unit, value))?;
        }
        speed.duration_s.map_or(Ok(()), |value| within("the duration", "s", value, [RATES[0], LONGEST]))?;
        let (Blend::Distance(blend) | Blend::Fraction(blend) | Blend::Velocity(blend) | Blend::Orientation(blend)) =
            self.blend
        else {
            return Ok(());
        };
        within("the size of the blend", "m, rad or part", blend, [0.0, FARTHEST])
    }
}
