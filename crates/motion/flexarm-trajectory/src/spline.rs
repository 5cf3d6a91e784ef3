//! Splines through sampled joint positions, with velocities and accelerations where they are known.
//!
//! Between two samples every joint follows the quintic with the position, velocity and acceleration
//! of both, so position, velocity and acceleration are continuous. Missing values are estimated:
//!
//! | given | velocity at the samples | acceleration at the samples |
//! | --- | --- | --- |
//! | positions | of the cubic spline through them | of the same spline |
//! | and velocities | given | mean of the two cubic Hermite pieces that meet there; 0 at an end at rest |
//! | and accelerations | given | given |
//!
//! A cubic spline would oscillate next to a hold. Hence, where only positions are given, it is cut
//! at holds: at the ends of the record one repeated position counts as a hold, inside the record
//! two do (a symmetric turning point repeats a position once). During a hold the joint is exactly
//! at rest; next to it the spline has zero velocity (clamped) and the last quintic takes the
//! acceleration to zero. An end without a hold is natural (zero acceleration), unless the speed of
//! the spline there is below 2 % of its top speed: then the end is taken to be at rest as well.
//! Otherwise the velocity jumps at that end, which [`crate::Trajectory::warnings`] reports.
//!
//! A cubic spline would also oscillate around a velocity jump in the sampled positions, and no
//! integrator would see the impulse. Corners are therefore found (`corner`), at a sample or between
//! two, and the joint's curve is cut there: either side has its own spline with an end of constant
//! acceleration, and the velocity jumps in between. Given velocities and accelerations next to a
//! corner are not used, since it is unknown which side they belong to.
//!
//! Not here: reading the samples (`table`), gaps in them (`gap.rs`), noise (`noise.rs`).

use std::borrow::Cow;

use flexarm_settings::Finding;
use flexarm_settings::finding::FindingKind;

use crate::corner::{Corner, corners};
use crate::curve::Curve;
use crate::error::{SampleError, TrajectoryError};
use crate::findings::RATE;
use crate::gap::gaps;
use crate::noise::{MAX_SHARE, Noise, noise, smoothed, without_rounding};
use crate::polynomial::Piece;

use crate::trajectory::Trajectory;

/// An end with a speed below this fraction of the top speed is at rest.
const REST_FRACTION: f64 = 0.02;

/// Joint values at common times, read from a file or a message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// Times in s, strictly increasing; the first becomes `t = 0`.
    pub times: Vec<f64>,
    /// The joints, in the order of the trajectory.
    pub joints: Vec<JointSamples>,
}

/// The values of one joint, SI.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointSamples {
    /// Joint name.
    pub name: String,
    /// Positions, one per time, rad or m.
    pub position: Vec<f64>,
    /// Velocities, one per time, rad/s or m/s, if known.
    pub velocity: Option<Vec<f64>>,
    /// Accelerations, one per time, rad/s² or m/s², if known; used only together with velocities.
    pub acceleration: Option<Vec<f64>>,
}

/// Rows whose time does not exceed all earlier times.
pub(crate) fn not_increasing(times: &[f64]) -> impl Iterator<Item = usize> {
    let mut latest = f64::NEG_INFINITY;
    times.iter().enumerate().filter_map(move |(row, time)| {
        let follows = *time > latest;
        latest = latest.max(*time);
        (!follows).then_some(row)
    })
}

impl Samples {
    /// Returns the trajectory through the samples; the module page describes the interpolation.
    ///
    /// [`TrajectoryError::Samples`] for fewer than two samples, times that do not increase, values
    /// that are not finite, columns of different lengths, accelerations without velocities, or
    /// repeated names; [`TrajectoryError::OutOfRange`] if the values are too extreme for f64.
    pub fn interpolate(&self) -> Result<Trajectory, TrajectoryError> {
        self.check()?;
        let knots: Vec<f64> = self.times.iter().map(|t| t - self.times[0]).collect();
        let (curves, notes): (Vec<Curve>, Vec<Option<Finding>>) = (self.joints.iter())
            .map(|joint| {
                let Judged { joint, note, smoothed } = joint.judged(&knots);
                // Smoothing leaves small bends at the ends of holds, which are no corners.
                let corners = if smoothed { Vec::new() } else { corners(&knots, &joint.position) };
                (joint.curve(&knots, &corners), note)
            })
            .unzip();
        let names = self.joints.iter().map(|joint| joint.name.clone()).collect();
        let notes = notes.into_iter().flatten().collect();
        let made = Trajectory::from_curves(names, curves, knots[knots.len() - 1], notes)?;
        Ok(made.with_gaps(gaps(&knots, &self.joints).into_iter().collect()))
    }

    /// Returns the samples with smoothed positions, which pass half the amplitude at the cut-off;
    /// velocities and accelerations follow from them. Holds are kept.
    ///
    /// # Errors
    /// [`SampleError`] as [`Samples::interpolate`], and for a cut-off that is not between 0 and
    /// half the sampling rate.
    pub fn smoothed(&self, cutoff_hz: f64) -> Result<Self, SampleError> {
        self.check()?;
        let n = self.times.len();
        let most_hz = 0.5 * (n - 1) as f64 / (self.times[n - 1] - self.times[0]);
        if !(cutoff_hz > 0.0 && cutoff_hz < most_hz) {
            return Err(SampleError::Cutoff { found: cutoff_hz, most_hz });
        }
        let joint = |joint: &JointSamples| JointSamples {
            name: joint.name.clone(),
            position: smoothed(&self.times, &joint.position, cutoff_hz),
            ..JointSamples::default()
        };
        Ok(Self { times: self.times.clone(), joints: self.joints.iter().map(joint).collect() })
    }

    /// Checks the preconditions of [`Samples::interpolate`].
    fn check(&self) -> Result<(), SampleError> {
        let n = self.times.len();
        if n < 2 {
            return Err(SampleError::too_few(n));
        }
        if self.joints.is_empty() {
            return Err(SampleError::no_joint());
        }
        if let Some(time) = self.times.iter().find(|t| !t.is_finite()) {
            return Err(SampleError::not_finite("time", *time));
        }
        // The first time is subtracted below; two close times far from zero may then coincide.
        let elapsed = |row: usize| self.times[row] - self.times[0];
        if let Some(row) = (1..n).find(|&row| !(elapsed(row) > elapsed(row - 1) && elapsed(row).is_finite())) {
            return Err(SampleError::TimeNotIncreasing { row, previous: self.times[row - 1], this: self.times[row] });
        }
        for (i, joint) in self.joints.iter().enumerate() {
            if self.joints[..i].iter().any(|other| other.name == joint.name) {
                return Err(SampleError::repeated_joint(&joint.name));
            }
            joint.check(n)?;
        }
        Ok(())
    }
}

/// Maximum step (s) and minimum number of samples for which velocities are compared with slopes.
const DENSE: (f64, usize) = (0.1, 6);
/// Velocities are foreign if they differ from the slopes by more than this part of the slopes and
/// this (rad/s or m/s).
const FOREIGN: [f64; 2] = [0.5, 0.02];

/// Returns the RMS difference of velocities to the slopes between samples, and the RMS slope (both
/// rad/s or m/s).
///
/// * `t`, `q`, `v`: times (s, increasing), positions and velocities of at least two samples.
pub fn velocity_mismatch(t: &[f64], q: &[f64], v: &[f64]) -> [f64; 2] {
    let n = (t.len() - 1) as f64;
    let (mut slopes, mut misses) = (0.0, 0.0);
    for i in 1..t.len() {
        let slope = (q[i] - q[i - 1]) / (t[i] - t[i - 1]);
        slopes += slope * slope / n;
        misses += (slope - 0.5 * (v[i] + v[i - 1])).powi(2) / n;
    }
    [f64::sqrt(misses), f64::sqrt(slopes)]
}

/// The same for velocities that do not belong to densely sampled positions: of another sign or
/// unit, or zeros.
fn foreign(t: &[f64], q: &[f64], v: &[f64]) -> Option<[f64; 2]> {
    let (n, lasts) = (t.len(), t[t.len() - 1] - t[0]);
    if n < DENSE.1 || lasts > DENSE.0 * (n - 1) as f64 {
        return None;
    }
    let [miss, slope] = velocity_mismatch(t, q, v);
    (miss > FOREIGN[0] * slope + FOREIGN[1]).then_some([miss, slope])
}

const FOREIGN_VELOCITIES: FindingKind = FindingKind::warning(
    "motion-velocities",
    "the velocities of joint \"{where}\" are not those of its positions (they differ by {value} of {yardstick} {unit}) \
     and are not used; check their sign and unit, or leave them out",
    RATE,
    "",
);

fn noise_warning(joint: &str, Noise { rms, share, cutoff_hz }: &Noise) -> Finding {
    let message = format!(
        "joint {joint:?} has noise of {rms:.1e} rad (or m) in its positions, which makes {:.0} % of its acceleration: \
         smooth it with a cut-off in the file, such as `# cutoff: {cutoff_hz:.2} Hz` in a table or `cutoff_hz` in \
         [samples]",
        100.0 * share
    );
    Finding::warning("motion-noise", joint, message, "").measured(*share, MAX_SHARE)
}

/// Exact values of one joint at knots: nothing is estimated, no corners are searched for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointKnots {
    /// Joint name.
    pub name: String,
    /// Positions, one per knot, rad or m.
    pub position: Vec<f64>,
    /// Velocities, one per knot, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Accelerations just before and just after each knot, rad/s² or m/s².
    pub acceleration: Vec<[f64; 2]>,
}

impl Trajectory {
    /// Returns the quintics through known positions, velocities and accelerations, such as those of
    /// a planner.
    ///
    /// * `times`: s, strictly increasing; the first becomes `t = 0`.
    ///
    /// # Errors
    /// [`TrajectoryError::Samples`] for fewer than two knots, values that are not finite, columns
    /// of different lengths, or repeated names; [`TrajectoryError::OutOfRange`] for values too
    /// extreme for f64.
    pub fn through_knots(times: &[f64], joints: &[JointKnots]) -> Result<Self, TrajectoryError> {
        let as_samples = |joint: &JointKnots| JointSamples {
            name: joint.name.clone(),
            position: joint.position.clone(),
            velocity: Some(joint.velocity.clone()),
            acceleration: Some(joint.acceleration.iter().map(|[before, after]| before + after).collect()),
        };
        Samples { times: times.to_vec(), joints: joints.iter().map(as_samples).collect() }.check()?;
        let knots: Vec<f64> = times.iter().map(|t| t - times[0]).collect();
        let curve = |joint: &JointKnots| {
            let end = |k: usize, side: usize| [joint.position[k], joint.velocity[k], joint.acceleration[k][side]];
            let piece = |k: usize| Piece::hermite(knots[k] - knots[k - 1], end(k - 1, 1), end(k, 0));
            Curve { pieces: (1..knots.len()).map(piece).collect(), knots: knots.clone() }
        };
        let names = joints.iter().map(|joint| joint.name.clone()).collect();
        Self::from_curves(names, joints.iter().map(curve).collect(), knots[knots.len() - 1], Vec::new())
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
                let found = column.len();
                let message = format!("{what} has {found} values; expected {n}, one for each time");
                return Err(SampleError::Invalid(message));
            }
            if let Some(value) = column.iter().find(|value| !value.is_finite()) {
                return Err(SampleError::not_finite(&what, *value));
            }
        }
        Ok(())
    }
}

/// Samples as they are used.
struct Judged<'a> {
    joint: Cow<'a, JointSamples>,
    /// Warning about velocities or noise.
    note: Option<Finding>,
    /// Whether positions without corners were smoothed within their rounding.
    smoothed: bool,
}

impl JointSamples {
    /// The samples without velocities that are not theirs and without the noise of rounding.
    fn judged(&self, times: &[f64]) -> Judged<'_> {
        let (joint, position) = (self.name.clone(), &self.position);
        let as_given = |note| Judged { joint: Cow::Borrowed(self), note, smoothed: false };
        if let Some(velocity) = &self.velocity {
            let Some([miss, slope]) = foreign(times, position, velocity) else { return as_given(None) };
            let bare = Self { name: joint.clone(), position: position.clone(), ..Self::default() };
            let note = Some(FOREIGN_VELOCITIES.found(joint, miss, slope));
            return Judged { joint: Cow::Owned(bare), note, smoothed: false };
        }
        let Some(noise) = noise(times, position).filter(|noise| noise.share > MAX_SHARE) else {
            return as_given(None);
        };
        match without_rounding(times, position, &noise) {
            Some(position) => {
                Judged { joint: Cow::Owned(Self { position, ..self.clone() }), note: None, smoothed: true }
            }
            None => as_given(Some(noise_warning(&joint, &noise))),
        }
    }
}

/// Velocity and acceleration just before and just after a knot; they differ at corners.
#[derive(Clone, Copy, Default)]
struct Rates {
    before: [f64; 2],
    after: [f64; 2],
}

impl JointSamples {
    /// The curve through the samples, with an additional knot for each corner between two samples.
    fn curve(&self, times: &[f64], found: &[Corner]) -> Curve {
        let (mut knots, mut position, mut is_corner) = (Vec::new(), Vec::new(), Vec::new());
        let mut next = found.iter().peekable();
        for (i, (&t, &q)) in times.iter().zip(&self.position).enumerate() {
            let corner = next.next_if(|corner| corner.sample == i);
            knots.push(t);
            position.push(q);
            is_corner.push(corner.is_some_and(|corner| corner.fraction == 0.0));
            if let Some(Corner { fraction, position: q, .. }) = corner.filter(|corner| corner.fraction > 0.0) {
                knots.push(t + fraction * (times[i + 1] - t));
                position.push(*q);
                is_corner.push(true);
            }
        }
        let rates = self.rates(times, &knots, &position, &is_corner);
        let piece = |i: usize| {
            let (a, b) = (rates[i - 1].after, rates[i].before);
            Piece::hermite(knots[i] - knots[i - 1], [position[i - 1], a[0], a[1]], [position[i], b[0], b[1]])
        };
        let pieces = (1..knots.len()).map(piece).collect();
        Curve { pieces, knots }
    }

    /// Velocity and acceleration at every knot.
    fn rates(&self, times: &[f64], knots: &[f64], position: &[f64], is_corner: &[bool]) -> Vec<Rates> {
        let given = match (&self.velocity, &self.acceleration) {
            (Some(v), Some(a)) => v.iter().zip(a).map(|(&v, &a)| [v, a]).collect(),
            (Some(v), None) => {
                let a = accelerations_from_velocities(times, &self.position, v);
                v.iter().zip(a).map(|(&v, a)| [v, a]).collect()
            }
            _ => Vec::new(),
        };
        if !given.is_empty() && !is_corner.contains(&true) {
            return given.into_iter().map(|rate| Rates { before: rate, after: rate }).collect();
        }
        let mut rates = rates_from_positions(knots, position, is_corner);
        // Given values are used except next to corners. Knots between the samples are corners; all
        // other knots are samples.
        let mut samples = given.into_iter();
        for i in 0..knots.len() {
            let is_sample = times.binary_search_by(|t| t.total_cmp(&knots[i])).is_ok();
            let given = if is_sample { samples.next() } else { None };
            let beside = (i.saturating_sub(1)..=(i + 1).min(knots.len() - 1)).any(|k| is_corner[k]);
            if let Some(rate) = given.filter(|_| !beside) {
                rates[i] = Rates { before: rate, after: rate };
            }
        }
        rates
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

/// Velocities and accelerations at the knots from cubic splines between holds and corners.
fn rates_from_positions(t: &[f64], q: &[f64], is_corner: &[bool]) -> Vec<Rates> {
    let last = q.len() - 1;
    let repeats = |i: usize| q[i] == q[i + 1];
    let is_hold = |i: usize| repeats(i) && (i == 0 || i + 1 == last || repeats(i - 1) || repeats(i + 1));

    let mut rates = vec![Rates::default(); q.len()];
    let mut first = 0;
    while first < last {
        if is_hold(first) {
            first += 1;
            continue;
        }
        let mut end = first + 1;
        while end < last && !is_hold(end) && !is_corner[end] {
            end += 1;
        }
        // Inside the record a section ends at a hold or a corner; at the ends of the record it need
        // not.
        let kind = |k: usize, inside: bool| match (is_corner[k], inside) {
            (true, _) => End::Free,
            (false, true) => End::Clamped,
            (false, false) => End::Natural,
        };
        let (mut start_kind, mut end_kind) = (kind(first, first > 0), kind(end, end < last));
        let (t, q) = (&t[first..=end], &q[first..=end]);
        let free = cubic_spline(t, q, start_kind, end_kind);
        let top = free.iter().fold(0.0, |top: f64, rate| top.max(rate[0].abs()));
        let rests = |kind: End, rate: [f64; 2]| match kind {
            End::Natural if rate[0].abs() <= REST_FRACTION * top => End::Clamped,
            kind => kind,
        };
        start_kind = rests(start_kind, free[0]);
        end_kind = rests(end_kind, free[free.len() - 1]);

        let mut run = cubic_spline(t, q, start_kind, end_kind);
        let n = run.len();
        if start_kind == End::Clamped {
            run[0] = [0.0; 2];
        }
        if end_kind == End::Clamped {
            run[n - 1] = [0.0; 2];
        }
        for (k, rate) in run.iter().enumerate() {
            if k > 0 {
                rates[first + k].before = *rate;
            }
            if k + 1 < n {
                rates[first + k].after = *rate;
            }
        }
        first = end;
    }
    // No motion is known beyond the ends of the record.
    rates[0].before = rates[0].after;
    rates[last].after = rates[last].before;
    rates
}

/// End condition of a spline.
#[derive(Clone, Copy, PartialEq)]
enum End {
    /// Zero velocity.
    Clamped,
    /// Zero acceleration.
    Natural,
    /// Acceleration equal to that of the next knot.
    Free,
}

/// First and second derivative at the knots of the natural cubic spline.
pub(crate) fn natural_spline(t: &[f64], q: &[f64]) -> Vec<[f64; 2]> {
    cubic_spline(t, q, End::Natural, End::Natural)
}

/// Velocity and acceleration at the knots of the cubic spline.
///
/// The unknowns are the accelerations `M`; the rows are
/// `h[i-1] M[i-1] + 2 (h[i-1] + h[i]) M[i] + h[i] M[i+1] = 6 (slope[i] - slope[i-1])`.
fn cubic_spline(t: &[f64], q: &[f64], start: End, end: End) -> Vec<[f64; 2]> {
    let last = q.len() - 1;
    let h: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> = (0..last).map(|i| (q[i + 1] - q[i]) / h[i]).collect();
    let row = |i: usize| match i {
        0 if start == End::Clamped => [0.0, 2.0 * h[0], h[0], 6.0 * slope[0]],
        i if i == last && end == End::Clamped => [h[i - 1], 2.0 * h[i - 1], 0.0, -6.0 * slope[i - 1]],
        // With only two knots there is one slope and no acceleration.
        0 if start == End::Free && last > 1 => [0.0, 1.0, -1.0, 0.0],
        i if i == last && end == End::Free && last > 1 => [-1.0, 1.0, 0.0, 0.0],
        i if i == 0 || i == last => [0.0, 1.0, 0.0, 0.0],
        i => [h[i - 1], 2.0 * (h[i - 1] + h[i]), h[i], 6.0 * (slope[i] - slope[i - 1])],
    };

    // Thomas algorithm, from left to right: M[i] = g[i] - e[i] M[i+1].
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
