//! Shapes of a move: travel of length 1 from rest to rest.
//!
//! A shape is a [`Curve`] `s(t)` from `s(0) = 0` to `s(T) = 1`; a joint that moves by `D` follows
//! `q0 + D s(t)`. Limits are given per unit of travel: a joint with velocity limit `v` that moves
//! by `D` allows `s' <= v / |D|`.
//!
//! ```text
//! quintic      s(u) = u³ (10 - 15 u + 6 u²),  u = t / T;  peaks 15/8 1/T, 10/sqrt(3) 1/T², 60 1/T³
//! seven-phase  the acceleration rises, stays, falls; cruise; the same in reverse
//!
//!              a ┐   ________                             t_jerk  rise of the acceleration
//!                │  /        \                            t_ramp  from rest to the cruise, including both t_jerk
//!              0 ┼-/          \--------\          /--     T       total
//!                │                      \________/        v = 1 / (T - t_ramp),  a = v / (t_ramp - t_jerk)
//! ```
//! Trapezoid and S-curve are both seven-phase: a trapezoid rounds a fixed fraction of its ramps
//! (`t_jerk = rounding t_ramp / 2`; without rounding the acceleration jumps), an S-curve rounds by
//! a jerk limit (`t_jerk = a / jerk`).
//!
//! Not here: moves through via points (`via`), the time-optimal law (`optimal`).

use crate::curve::Curve;
use crate::polynomial::Piece;

/// Fraction of the duration for each ramp of a trapezoid if only the duration is given.
const TRAPEZOID_RAMP: f64 = 0.25;
/// Fraction of the duration for each ramp of an S-curve if only the duration is given.
const S_CURVE_RAMP: f64 = 1.0 / 3.0;
/// Fraction of such a ramp in which the acceleration rises (and again in which it falls).
const S_CURVE_RISE: f64 = 1.0 / 3.0;

/// Limits of `s'`, `s''` and `s'''`; infinite means no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShapeLimits {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

/// Times of a seven-phase shape, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phases {
    pub(crate) jerk: f64,
    pub(crate) ramp: f64,
    pub(crate) total: f64,
}

/// The quintic of the given duration.
pub(crate) fn quintic(duration: f64) -> Curve {
    let c = [0.0, 0.0, 0.0, 10.0, -15.0, 6.0];
    let unit = Piece { width: 1.0, c };
    Curve { knots: vec![0.0, duration], pieces: vec![unit.mapped(0.0, 1.0, duration)] }
}

/// Minimum duration within the limits of a shape with these peaks (for `T = 1`).
pub(crate) fn duration_for_peaks(peaks: [f64; 3], limits: &ShapeLimits) -> f64 {
    let [velocity, acceleration, jerk] = peaks;
    let by_velocity = velocity / limits.velocity;
    let by_acceleration = (acceleration / limits.acceleration).sqrt();
    by_velocity.max(by_acceleration).max((jerk / limits.jerk).cbrt())
}

/// Peaks of the quintic with `T = 1`.
pub(crate) fn quintic_peaks() -> [f64; 3] {
    [15.0 / 8.0, 10.0 / 3.0_f64.sqrt(), 60.0]
}

impl Phases {
    /// The fastest trapezoid within the velocity and the (finite) acceleration limit; a triangle if
    /// the travel is short.
    pub(crate) fn trapezoid(limits: &ShapeLimits, rounding: f64) -> Self {
        // A rounded ramp reaches the speed of a plain one with this mean acceleration.
        let mean = limits.acceleration * (1.0 - rounding / 2.0);
        let ramp = (limits.velocity / mean).min((1.0 / mean).sqrt());
        let speed = mean * ramp;
        Self { jerk: rounding * ramp / 2.0, ramp, total: ramp + 1.0 / speed }
    }

    /// The trapezoid of the given duration that uses the acceleration limit, if there is one and it
    /// suffices; `None` if even a triangle would exceed it.
    pub(crate) fn trapezoid_in(duration: f64, acceleration: f64, rounding: f64) -> Option<Self> {
        let mean = acceleration * (1.0 - rounding / 2.0);
        // v (T - ramp) = 1 with v = mean ramp: the smaller root.
        let root = (duration * duration - 4.0 / mean).sqrt();
        let ramp = 2.0 / (mean * (duration + root)); // = (T - root) / 2 without cancellation
        (ramp > 0.0).then_some(Self { jerk: rounding * ramp / 2.0, ramp, total: duration })
    }

    /// The default trapezoid for a given duration.
    pub(crate) fn trapezoid_default(duration: f64, rounding: f64) -> Self {
        let ramp = TRAPEZOID_RAMP * duration;
        Self { jerk: rounding * ramp / 2.0, ramp, total: duration }
    }

    /// The fastest S-curve within the velocity and the (finite) acceleration and jerk limits.
    pub(crate) fn s_curve(limits: &ShapeLimits) -> Self {
        let ShapeLimits { velocity, acceleration: a, jerk } = *limits;
        let with_cruise = Self::ramp_to(velocity, a, jerk);
        if velocity * with_cruise.ramp <= 1.0 {
            return Self { total: with_cruise.ramp + 1.0 / velocity, ..with_cruise };
        }
        // No cruise: v ramp = 1, first assuming that the acceleration limit is reached, otherwise
        // with the jerk limit only.
        let rise = a / jerk;
        let ramp = 0.5 * (rise + (rise * rise + 4.0 / a).sqrt());
        if ramp >= 2.0 * rise {
            return Self { jerk: rise, ramp, total: 2.0 * ramp };
        }
        let rise = (0.5 / jerk).cbrt();
        Self { jerk: rise, ramp: 2.0 * rise, total: 4.0 * rise }
    }

    /// The S-curve of the given duration that uses the acceleration and jerk limits; `None` if they
    /// do not suffice.
    pub(crate) fn s_curve_in(duration: f64, acceleration: f64, jerk: f64) -> Option<Self> {
        let unlimited = ShapeLimits { velocity: f64::INFINITY, acceleration, jerk };
        let fastest = Self::s_curve(&unlimited);
        if fastest.total > duration * (1.0 + 1e-12) {
            return None;
        }
        // The travel v (T - ramp(v)) increases with the cruise speed v up to that of the fastest
        // curve.
        let (mut low, mut high) = (0.0, 1.0 / fastest.ramp);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if middle * (duration - Self::ramp_to(middle, acceleration, jerk).ramp) < 1.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(Self { total: duration, ..Self::ramp_to(high, acceleration, jerk) })
    }

    /// The default S-curve for a given duration.
    pub(crate) fn s_curve_default(duration: f64) -> Self {
        let ramp = S_CURVE_RAMP * duration;
        Self { jerk: S_CURVE_RISE * ramp, ramp, total: duration }
    }

    /// Rise and ramp times from rest to speed `v`; the total is not set.
    fn ramp_to(v: f64, acceleration: f64, jerk: f64) -> Self {
        let rise = acceleration / jerk;
        if v >= acceleration * rise {
            return Self { jerk: rise, ramp: v / acceleration + rise, total: 0.0 };
        }
        let rise = (v / jerk).sqrt();
        Self { jerk: rise, ramp: 2.0 * rise, total: 0.0 }
    }

    /// Builds the curve with these times; its length is exactly 1 regardless of the rounding of the
    /// times.
    pub(crate) fn curve(&self) -> Curve {
        let Self { jerk: rise, ramp, total } = *self;
        let v = 1.0 / (total - ramp);
        let a = v / (ramp - rise);
        let j = if rise > 0.0 { a / rise } else { 0.0 };

        // Each phase: duration, acceleration at its start, jerk. Position and speed carry over.
        let (plateau, cruise) = (ramp - 2.0 * rise, total - 2.0 * ramp);
        let phases = [
            (rise, 0.0, j),
            (plateau, a, 0.0),
            (rise, a, -j),
            (cruise, 0.0, 0.0),
            (rise, 0.0, -j),
            (plateau, -a, 0.0),
            (rise, -a, j),
        ];
        let mut curve = Curve { knots: vec![0.0], pieces: Vec::new() };
        let (mut t, mut s, mut speed) = (0.0, 0.0, 0.0);
        for (width, acceleration, jerk) in phases {
            // A phase this short is a rounding error.
            if width <= 1e-14 * total {
                continue;
            }
            let piece = Piece { width, c: [s, speed, acceleration / 2.0, jerk / 6.0, 0.0, 0.0] };
            [s, speed, _, _] = piece.at(width);
            t += width;
            curve.pieces.push(piece);
            curve.knots.push(t);
        }
        if let Some(last) = curve.knots.last_mut() {
            *last = total;
        }
        curve
    }
}
