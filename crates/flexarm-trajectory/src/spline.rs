//! Splines through sampled joint values: positions, with velocities and accelerations where they are known.
//!
//! Between two samples every joint follows the quintic with the position, velocity and acceleration of both, so
//! position, velocity and acceleration are continuous. What is not given is estimated:
//!
//! | given | velocity at the samples | acceleration at the samples |
//! | --- | --- | --- |
//! | positions | of the cubic spline through them | of the same spline |
//! | and velocities | given | mean of the two cubic Hermite pieces that meet there; 0 at an end at rest |
//! | and accelerations | given | given |
//!
//! A cubic spline knows nothing of rest and would ring into a hold. Hence, where only positions are given, it is cut
//! at holds: at the ends of the record one repeated position is a hold, further inside two are (a symmetric
//! turning point repeats a position once). In a hold the joint stands still, exactly; towards it, the spline has
//! zero velocity (clamped) and the last quintic takes the acceleration to zero. An end without a hold is natural
//! (zero acceleration), unless the spline is slower there than 2 % of its top speed: then it is taken to be at rest
//! as well. Otherwise the velocity jumps at that end, which [`crate::Trajectory::warnings`] tells.

use crate::error::TrajectoryError;
use crate::polynomial::Piece;
use crate::problem::SampleError;
use crate::trajectory::{Curve, Trajectory};

/// An end slower than this part of the top speed is at rest.
const REST_FRACTION: f64 = 0.02;

/// Joint values at common times, as read from a file or a message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// Times in s, strictly increasing; the first becomes `t = 0`.
    pub times: Vec<f64>,
    /// The joints, in the order that the trajectory shall have.
    pub joints: Vec<JointSamples>,
}

/// The values of one joint, SI.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointSamples {
    /// Joint name.
    pub name: String,
    /// One per time, rad or m.
    pub position: Vec<f64>,
    /// One per time, rad/s or m/s, when known.
    pub velocity: Option<Vec<f64>>,
    /// One per time, rad/s² or m/s², when known; used together with velocities only.
    pub acceleration: Option<Vec<f64>>,
}

impl Samples {
    /// The trajectory through the samples; the module page says how.
    ///
    /// # Errors
    /// [`TrajectoryError::Samples`] for fewer than two samples, times that do not increase, values that are not
    /// finite, columns of another length, accelerations without velocities, repeated names; or
    /// [`TrajectoryError::OutOfRange`] when the values are too extreme for f64.
    pub fn interpolate(&self) -> Result<Trajectory, TrajectoryError> {
        self.check()?;
        let knots: Vec<f64> = self.times.iter().map(|t| t - self.times[0]).collect();
        let curve = |joint: &JointSamples| {
            let rates = rates(&knots, joint);
            let state = |i: usize| [joint.position[i], rates[i][0], rates[i][1]];
            let pieces = (1..knots.len()).map(|i| Piece::hermite(knots[i] - knots[i - 1], state(i - 1), state(i)));
            Curve { pieces: pieces.collect(), knots: knots.clone() }
        };
        let curves = self.joints.iter().map(curve).collect();
        let names = self.joints.iter().map(|joint| joint.name.clone()).collect();
        Trajectory::from_curves(names, curves, knots[knots.len() - 1], Vec::new())
    }

    /// Checks everything that [`Samples::interpolate`] relies on.
    fn check(&self) -> Result<(), SampleError> {
        let n = self.times.len();
        if n < 2 {
            return Err(SampleError::TooFew { found: n });
        }
        if self.joints.is_empty() {
            return Err(SampleError::NoJoint);
        }
        if let Some(row) = self.times.iter().position(|t| !t.is_finite()) {
            return Err(SampleError::NotFinite { what: "time".to_owned(), row, value: self.times[row] });
        }
        // The first time is subtracted below; two close times far from zero may fall together then.
        let elapsed = |row: usize| self.times[row] - self.times[0];
        if let Some(row) = (1..n).find(|&row| !(elapsed(row) > elapsed(row - 1) && elapsed(row).is_finite())) {
            return Err(SampleError::TimeNotIncreasing { row, previous: self.times[row - 1], this: self.times[row] });
        }
        for (i, joint) in self.joints.iter().enumerate() {
            if self.joints[..i].iter().any(|other| other.name == joint.name) {
                return Err(SampleError::RepeatedJoint { joint: joint.name.clone() });
            }
            joint.check(n)?;
        }
        Ok(())
    }
}

impl JointSamples {
    fn check(&self, n: usize) -> Result<(), SampleError> {
        if self.acceleration.is_some() && self.velocity.is_none() {
            return Err(SampleError::AccelerationWithoutVelocity { joint: self.name.clone() });
        }
        let columns =
            [("", Some(&self.position)), (".vel", self.velocity.as_ref()), (".acc", self.acceleration.as_ref())];
        for (suffix, column) in columns {
            let Some(column) = column else { continue };
            let what = format!("{}{suffix}", self.name);
            if column.len() != n {
                return Err(SampleError::Length { what, found: column.len(), expected: n });
            }
            if let Some(row) = column.iter().position(|value| !value.is_finite()) {
                return Err(SampleError::NotFinite { what, row, value: column[row] });
            }
        }
        Ok(())
    }
}

/// Velocity and acceleration of one joint at every knot.
fn rates(t: &[f64], joint: &JointSamples) -> Vec<[f64; 2]> {
    match (&joint.velocity, &joint.acceleration) {
        (Some(v), Some(a)) => v.iter().zip(a).map(|(&v, &a)| [v, a]).collect(),
        (Some(v), None) => {
            let a = accelerations_from_velocities(t, &joint.position, v);
            v.iter().zip(a).map(|(&v, a)| [v, a]).collect()
        }
        _ => rates_from_positions(t, &joint.position),
    }
}

/// Accelerations at the knots from the cubic Hermite pieces left and right of them.
fn accelerations_from_velocities(t: &[f64], q: &[f64], v: &[f64]) -> Vec<f64> {
    let last = q.len() - 1;
    let slope = |i: usize| (q[i + 1] - q[i]) / (t[i + 1] - t[i]);
    // Second derivative of the cubic of interval i at its start and at its end.
    let at_start = |i: usize| (6.0 * slope(i) - 4.0 * v[i] - 2.0 * v[i + 1]) / (t[i + 1] - t[i]);
    let at_end = |i: usize| (-6.0 * slope(i) + 2.0 * v[i] + 4.0 * v[i + 1]) / (t[i + 1] - t[i]);
    let is_hold = |i: usize| q[i] == q[i + 1] && v[i] == 0.0 && v[i + 1] == 0.0;
    let acceleration = |i: usize| {
        let touches_hold = (i > 0 && is_hold(i - 1)) || (i < last && is_hold(i));
        let ends_at_rest = (i == 0 || i == last) && v[i] == 0.0;
        if touches_hold || ends_at_rest {
            return 0.0;
        }
        match i {
            0 => at_start(0),
            i if i == last => at_end(last - 1),
            i => 0.5 * (at_end(i - 1) + at_start(i)),
        }
    };
    (0..=last).map(acceleration).collect()
}

/// Velocities and accelerations at the knots from cubic splines between the holds.
fn rates_from_positions(t: &[f64], q: &[f64]) -> Vec<[f64; 2]> {
    let last = q.len() - 1;
    let repeats = |i: usize| q[i] == q[i + 1];
    let is_hold = |i: usize| repeats(i) && (i == 0 || i + 1 == last || repeats(i - 1) || repeats(i + 1));

    let mut rates = vec![[0.0; 2]; q.len()];
    let mut first = 0;
    while first < last {
        if is_hold(first) {
            first += 1;
            continue;
        }
        let mut end = first + 1;
        while end < last && !is_hold(end) {
            end += 1;
        }
        // Within the record a run ends at a hold; at the ends of the record it need not.
        let (mut clamp_start, mut clamp_end) = (first > 0, end < last);
        let (t, q) = (&t[first..=end], &q[first..=end]);
        let free = cubic_spline(t, q, clamp_start, clamp_end);
        let top = free.iter().fold(0.0, |top: f64, rate| top.max(rate[0].abs()));
        clamp_start |= free[0][0].abs() <= REST_FRACTION * top;
        clamp_end |= free[free.len() - 1][0].abs() <= REST_FRACTION * top;

        let mut run = cubic_spline(t, q, clamp_start, clamp_end);
        let n = run.len();
        if clamp_start {
            run[0] = [0.0; 2];
        }
        if clamp_end {
            run[n - 1] = [0.0; 2];
        }
        rates[first..=end].copy_from_slice(&run);
        first = end;
    }
    rates
}

/// Velocity and acceleration at the knots of the cubic spline; an end is clamped (zero velocity) or natural.
///
/// Unknown are the accelerations `M`; the rows are the usual ones,
/// `h[i-1] M[i-1] + 2 (h[i-1] + h[i]) M[i] + h[i] M[i+1] = 6 (slope[i] - slope[i-1])`.
fn cubic_spline(t: &[f64], q: &[f64], clamp_start: bool, clamp_end: bool) -> Vec<[f64; 2]> {
    let last = q.len() - 1;
    let h: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> = (0..last).map(|i| (q[i + 1] - q[i]) / h[i]).collect();
    let row = |i: usize| match i {
        0 if clamp_start => [0.0, 2.0 * h[0], h[0], 6.0 * slope[0]],
        i if i == last && clamp_end => [h[i - 1], 2.0 * h[i - 1], 0.0, -6.0 * slope[i - 1]],
        i if i == 0 || i == last => [0.0, 1.0, 0.0, 0.0],
        i => [h[i - 1], 2.0 * (h[i - 1] + h[i]), h[i], 6.0 * (slope[i] - slope[i - 1])],
    };

    // Elimination from left to right: M[i] = g[i] - e[i] M[i+1].
    let mut eliminated: Vec<[f64; 2]> = Vec::with_capacity(q.len());
    for i in 0..=last {
        let [lower, diagonal, upper, rhs] = row(i);
        let [e, g] = if i == 0 { [0.0; 2] } else { eliminated[i - 1] };
        let pivot = diagonal - lower * e;
        eliminated.push([upper / pivot, (rhs - lower * g) / pivot]);
    }
    let mut m = vec![0.0; q.len()];
    let mut next = 0.0;
    for i in (0..=last).rev() {
        let [e, g] = eliminated[i];
        m[i] = g - e * next;
        next = m[i];
    }

    let velocity = |i: usize| match i {
        i if i == last => slope[i - 1] + h[i - 1] * (2.0 * m[i] + m[i - 1]) / 6.0,
        i => slope[i] - h[i] * (2.0 * m[i] + m[i + 1]) / 6.0,
    };
    (0..=last).map(|i| [velocity(i), m[i]]).collect()
}
