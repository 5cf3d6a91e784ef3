//! Time-optimal laws along a path within bounds that are linear in the squared speed and the
//! acceleration along it, and their smoothing with a finite rise time of the acceleration.
//!
//! ```text
//! x = s'^2,  u = s'',     low <= a u + b x <= high at every point,   x <= x_max
//! x(s + ds) = x + 2 u ds  between two points
//! ```
//! A backward pass finds the largest `x` at each point from which the end can be reached; a forward
//! pass then takes the largest `u` that stays below it: reachability analysis [Pham & Pham 2018].
//! Bounds are enforced at both ends of every interval, which costs time in proportion to its
//! length; intervals are therefore divided if there are few points, with linear interpolation of
//! the bounds. Rest must be admissible: no bound may be violated at `x = u = 0`.
//!
//! [`Law::smoothed`] is the moving average of the speed over a time T: the path stays the same,
//! accelerations rise and fall within T, and the duration increases by T.
//!
//! Start at [`least_time`]; [`Law`] turns its result into a motion. Units: the parameter `s` has a
//! unit of the caller's choice (m, rad or 1), times are in s. Not here: bounds of the jerk
//! ([`crate::jerk_law`]), bounds of a particular arm (`flexarm-path`).
#![allow(non_snake_case, reason = "letters of the formulas")]

/// Bound `low <= a u + b x <= high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Factor of the acceleration along the path.
    pub a: f64,
    /// Factor of the squared speed.
    pub b: f64,
    /// Minimum value, not positive.
    pub low: f64,
    /// Maximum value, not negative.
    pub high: f64,
}

/// Bounds at a point of a path.
///
/// Corresponding bounds have the same index in the lists of all points. A point at which the set of
/// bounds changes has those of the path before it, followed by those of the path after it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathPoint {
    /// Parameter of the path, ascending from point to point.
    pub s: f64,
    /// Maximum squared speed; infinite if only the bounds below apply.
    pub x_max: f64,
    /// Linear bounds.
    pub bounds: Vec<Bound>,
}

impl PathPoint {
    /// Bounds between two points at a fraction of their distance.
    fn between(here: &Self, next: &Self, part: f64) -> Self {
        let s = here.s + part * (next.s - here.s);
        Self { s, x_max: between(here.x_max, next.x_max, part), bounds: bounds_between(here, next, part).collect() }
    }

    /// Returns the maximum ratio of a squared speed `x` and an acceleration `u` to the bounds
    /// between two neighbouring points, at most 1 if they keep them.
    ///
    /// * `part`: place between the points, from 0 (`here`) to 1 (`next`).
    pub fn passed(here: &Self, next: &Self, part: f64, x: f64, u: f64) -> f64 {
        let ratio = |bound: Bound| {
            let value = bound.a * u + bound.b * x;
            if value > 0.0 {
                value / bound.high
            } else if value < 0.0 {
                value / bound.low
            } else {
                0.0
            }
        };
        let speed = x / between(here.x_max, next.x_max, part);
        bounds_between(here, next, part).map(ratio).fold(speed, f64::max)
    }
}

fn between(from: f64, to: f64, part: f64) -> f64 {
    if from.is_finite() && to.is_finite() { from + part * (to - from) } else { from.min(to) }
}

fn bounds_between<'a>(here: &'a PathPoint, next: &'a PathPoint, part: f64) -> impl Iterator<Item = Bound> + 'a {
    let n = here.bounds.len().min(next.bounds.len());
    let pairs = here.bounds[here.bounds.len() - n..].iter().zip(&next.bounds[..n]);
    pairs.map(move |(from, to)| Bound {
        a: between(from.a, to.a, part),
        b: between(from.b, to.b, part),
        low: between(from.low, to.low, part),
        high: between(from.high, to.high, part),
    })
}

/// No time law exists for the path.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LawError {
    /// Fewer than two points, or parameters that are not ascending.
    #[error("a path needs two points or more, with ascending parameters (point {0})")]
    Points(usize),
    /// A bound excludes rest, or speed limit and bounds leave no admissible motion.
    #[error("no speed along the path keeps all bounds at point {0}")]
    Infeasible(usize),
}

/// Paths with fewer intervals than this are divided, each interval into at most `MAX_PARTS` parts.
const INTERVALS: usize = 4000;
const MAX_PARTS: usize = 128;
/// Relative to `b`, a factor of `u` below this counts as zero.
const NO_FACTOR: f64 = 1e-12;

/// Bounds at a point and at the end of the interval that begins there, as lines `u <= p + q x` and
/// `u >= p + q x`.
#[derive(Default)]
struct Lines {
    upper: Vec<[f64; 2]>,
    lower: Vec<[f64; 2]>,
    x_max: f64,
}

impl Lines {
    /// Collects the lines of a point and of the next one, whose bounds apply as well; `goal` is the
    /// largest squared speed at the next point from which the end can be reached.
    fn fill(&mut self, here: &PathPoint, next: &PathPoint, goal: f64) {
        let ds = next.s - here.s;
        self.upper.clear();
        self.lower.clear();
        self.x_max = here.x_max;
        self.add(&Bound { a: 2.0 * ds, b: 1.0, low: 0.0, high: goal });
        for bound in &here.bounds {
            self.add(bound);
        }
        for bound in &next.bounds {
            // The squared speed of the next point is x + 2 u ds.
            self.add(&Bound { a: bound.a + 2.0 * ds * bound.b, ..*bound });
        }
    }

    fn add(&mut self, &Bound { a, b, low, high }: &Bound) {
        if a.abs() <= NO_FACTOR * b.abs() || a == 0.0 {
            let most = if b > 0.0 {
                high / b
            } else if b < 0.0 {
                low / b
            } else {
                f64::INFINITY
            };
            self.x_max = self.x_max.min(most);
            return;
        }
        let (at_low, at_high, slope) = (low / a, high / a, -b / a);
        let (least, most) = if a > 0.0 { (at_low, at_high) } else { (at_high, at_low) };
        if most.is_finite() {
            self.upper.push([most, slope]);
        }
        if least.is_finite() {
            self.lower.push([least, slope]);
        }
    }

    /// Lowest upper line and highest lower line at `x`.
    fn tightest(&self, x: f64) -> ([f64; 2], [f64; 2]) {
        let value = |line: &[f64; 2]| line[0] + line[1] * x;
        let none = [f64::INFINITY, 0.0];
        let upper = self.upper.iter().copied().min_by(|a, b| value(a).total_cmp(&value(b))).unwrap_or(none);
        let lower = self.lower.iter().copied().max_by(|a, b| value(a).total_cmp(&value(b)));
        (upper, lower.unwrap_or([f64::NEG_INFINITY, 0.0]))
    }

    /// Maximum `x` at which some `u` is admissible. The gap between the lines is concave in `x`, so
    /// Newton's method from above ends at the root after finitely many lines.
    fn largest_x(&self) -> Option<f64> {
        let mut x = self.x_max;
        if x == f64::INFINITY {
            // Beyond all crossings.
            x = 1e18;
        }
        for _ in 0..200 {
            let (upper, lower) = self.tightest(x);
            let gap = upper[0] - lower[0] + (upper[1] - lower[1]) * x;
            let size = (upper[0] + upper[1] * x).abs().max((lower[0] + lower[1] * x).abs());
            if gap >= -1e-12 * size {
                return Some(x.max(0.0));
            }
            let slope = upper[1] - lower[1];
            let crossing = (lower[0] - upper[0]) / slope;
            if !(slope < 0.0 && crossing >= -1e-12) {
                return None;
            }
            // The same lines again: the remainder is rounding.
            if crossing >= x {
                return Some(x);
            }
            x = crossing.max(0.0);
        }
        None
    }

    /// Maximum admissible `u` at `x`, at least the lower bound.
    fn largest_u(&self, x: f64) -> f64 {
        let (upper, lower) = self.tightest(x);
        (upper[0] + upper[1] * x).max(lower[0] + lower[1] * x)
    }
}

/// Returns the squared speeds `x = (ds/dt)²` of the time-optimal law, one per point, from `x = 0`
/// to `x = 0`.
///
/// With fewer than 4000 intervals, each one is divided, and the bounds are interpolated linearly in
/// between. The cost is that of two passes over the points with all their bounds.
///
/// # Errors
/// [`LawError`] if the points are fewer than two or not ascending, or the bounds cannot be kept.
///
/// # Source
/// [Pham & Pham 2018], with the bounds at both ends of each interval.
pub fn least_time(points: &[PathPoint]) -> Result<Vec<f64>, LawError> {
    let n = points.len();
    if n < 2 {
        return Err(LawError::Points(n));
    }
    if let Some(k) = (1..n).find(|&k| points[k].s.partial_cmp(&points[k - 1].s) != Some(std::cmp::Ordering::Greater)) {
        return Err(LawError::Points(k));
    }
    let parts = (INTERVALS / (n - 1)).clamp(1, MAX_PARTS);
    if parts == 1 {
        return least_time_at(points);
    }
    let part = |(k, i): (usize, usize)| PathPoint::between(&points[k], &points[k + 1], i as f64 / parts as f64);
    let divide = |k: usize| std::iter::once(points[k].clone()).chain((1..parts).map(move |i| (k, i)).map(part));
    let mut fine: Vec<PathPoint> = (0..n - 1).flat_map(divide).collect();
    fine.push(points[n - 1].clone());
    let x = least_time_at(&fine).map_err(|error| match error {
        LawError::Infeasible(k) => LawError::Infeasible(k / parts),
        error => error,
    })?;
    Ok(x.into_iter().step_by(parts).collect())
}

/// [`least_time`] without dividing the intervals.
fn least_time_at(points: &[PathPoint]) -> Result<Vec<f64>, LawError> {
    let n = points.len();
    // Backward pass: largest speeds from which the end can be reached.
    let mut lines = Lines::default();
    let mut reach = vec![0.0; n];
    for k in (0..n - 1).rev() {
        lines.fill(&points[k], &points[k + 1], reach[k + 1]);
        reach[k] = lines.largest_x().ok_or(LawError::Infeasible(k))?;
    }
    // Forward pass: as fast as these allow.
    let mut x = vec![0.0; n];
    for k in 0..n - 1 {
        lines.fill(&points[k], &points[k + 1], reach[k + 1]);
        let u = lines.largest_u(x[k]);
        let ds = points[k + 1].s - points[k].s;
        x[k + 1] = (x[k] + 2.0 * ds * u).clamp(0.0, reach[k + 1]);
        if x[k] <= 0.0 && x[k + 1] <= 0.0 {
            return Err(LawError::Infeasible(k));
        }
    }
    Ok(x)
}

/// Motion along a path: the speed is linear in time between the points, optionally averaged over a
/// window.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    t: Vec<f64>,
    s: Vec<f64>,
    v: Vec<f64>,
    /// Integral of `s` from the start to each point.
    integral: Vec<f64>,
    /// Width of the moving average (s); 0 for none.
    window: f64,
}

/// Parameter of a path and its time derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Parameter.
    pub s: f64,
    /// Speed (1/s times the unit of the parameter).
    pub v: f64,
    /// Acceleration (1/s² times the unit of the parameter).
    pub a: f64,
    /// Jerk just after the time (1/s³ times the unit of the parameter).
    pub j: f64,
}

impl Law {
    /// Builds the law with squared speeds `x` at the parameters `s`, such as those of
    /// [`least_time`]; no two neighbouring speeds may both be zero.
    ///
    /// # Panics
    /// If `s` and `x` differ in length.
    pub fn new(s: &[f64], x: &[f64]) -> Self {
        assert_eq!(s.len(), x.len(), "a speed at each point");
        let v: Vec<f64> = x.iter().map(|x| x.sqrt()).collect();
        let (mut t, mut integral) = (vec![0.0], vec![0.0]);
        for k in 1..s.len() {
            let dt = 2.0 * (s[k] - s[k - 1]) / (v[k] + v[k - 1]);
            t.push(t[k - 1] + dt);
            // Between the points s is quadratic in time.
            let a = (v[k] - v[k - 1]) / dt;
            integral.push(integral[k - 1] + dt * (s[k - 1] + dt * (v[k - 1] / 2.0 + dt * a / 6.0)));
        }
        Self { t, s: s.to_vec(), v, integral, window: 0.0 }
    }

    /// Returns the motion on the same path with the speed averaged over the last `window` seconds;
    /// its duration is longer by `window`.
    #[must_use]
    pub fn smoothed(self, window: f64) -> Self {
        Self { window, ..self }
    }

    /// Duration (s).
    pub fn duration(&self) -> f64 {
        self.t[self.t.len() - 1] + self.window
    }

    /// Times at which the acceleration or jerk may jump, ascending, including start and end.
    pub fn knots(&self) -> Vec<f64> {
        let mut knots = self.t.clone();
        if self.window > 0.0 {
            knots.extend(self.t.iter().map(|t| t + self.window));
            knots.sort_unstable_by(f64::total_cmp);
        }
        knots
    }

    /// Integral of s, s, speed and acceleration just after `t`, without averaging.
    fn raw(&self, t: f64) -> [f64; 4] {
        let last = self.t.len() - 1;
        if t < 0.0 {
            return [t * self.s[0], self.s[0], 0.0, 0.0];
        }
        if t >= self.t[last] {
            return [self.integral[last] + (t - self.t[last]) * self.s[last], self.s[last], 0.0, 0.0];
        }
        let k = self.t.partition_point(|&knot| knot <= t).clamp(1, last) - 1;
        let (dt, tau) = (self.t[k + 1] - self.t[k], t - self.t[k]);
        let (s, v, a) = (self.s[k], self.v[k], (self.v[k + 1] - self.v[k]) / dt);
        let integral = self.integral[k] + tau * (s + tau * (v / 2.0 + tau * a / 6.0));
        [integral, s + tau * (v + tau * a / 2.0), v + a * tau, a]
    }

    /// Returns the state of the motion at time `t` (s); before 0 and after the end it is at rest.
    pub fn at(&self, t: f64) -> Progress {
        let [integral, s, v, a] = self.raw(t);
        if self.window <= 0.0 {
            return Progress { s, v, a, j: 0.0 };
        }
        let [before, s0, v0, a0] = self.raw(t - self.window);
        let T = self.window;
        Progress { s: (integral - before) / T, v: (s - s0) / T, a: (v - v0) / T, j: (a - a0) / T }
    }
}
