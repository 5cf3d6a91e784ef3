//! Time-optimal law along a path within bounds that include the jerk.
//!
//! ```text
//! s = sigma(theta),  y = theta'^2,  u = theta'' = y_theta / 2,  w = u_theta
//! T = int d theta / sqrt(y),   low <= a u + b y <= high,   |a w + b u + c y| <= most / sqrt(y)
//! ```
//! Over the parameter `s` itself (`sigma` the identity), the last bound is the jerk of a joint with
//! `a = q'`, `b = 3 q''`, `c = q'''`. Here the parameter is the time `theta` of a law that already
//! follows the path: then `y` is smooth and not zero, even where the path begins and ends at rest,
//! and `y = 1` where that law cannot be improved. The bounds keep their form, with
//!
//! ```text
//! a -> a v,   b -> b v^2 + 3 a v',   c -> c v^3 + b v v' + a v''      (jerk;  v = d sigma / d theta)
//! a -> a v,   b -> b v^2 + a v'                                       (linear bounds)
//! ```
//! `1 / sqrt(y)` is convex: replacing it by its tangent gives a bound that is tighter and linear,
//! so that a sequence of convex programs with updated tangents ends at a locally optimal law and
//! keeps every bound on the way [Debrouwere et al. 2013]. The steps of the interior-point method
//! update these tangents as they go. `y` is a cubic spline, so that the jerk is continuous; the
//! loss of time at jerk switches falls with the square of the node spacing.
//!
//! Start at [`QuinticLaw::improved`]. Not here: the bounds of a particular path.
#![allow(non_snake_case, reason = "letters of the formulas")]

use crate::barrier;
use crate::time_law::{Bound, Law, Progress};

/// Bound `|a u' + b u + c x| sqrt(x) <= most` along the parameter `s` with `x = s'^2`, `u = s''`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JerkBound {
    /// Factor of `u'`: first derivative of a joint by `s`.
    pub a: f64,
    /// Factor of `u`: three times the second derivative.
    pub b: f64,
    /// Factor of `x`: third derivative.
    pub c: f64,
    /// Maximum value, positive.
    pub most: f64,
}

/// Bounds at one place of a path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathBounds {
    /// Maximum squared speed; infinite if only the bounds below apply.
    pub x_max: f64,
    /// Linear bounds.
    pub bounds: Vec<Bound>,
    /// Jerk bounds.
    pub jerks: Vec<JerkBound>,
}

impl PathBounds {
    /// Tightens the bounds for a run that passes them by the given factors of speed: `linear` for
    /// the bounds without jerk, `jerk` for those of jerk.
    #[must_use]
    fn drawn_in(mut self, [linear, jerk]: [f64; 2]) -> Self {
        let (second, third) = (linear * linear, jerk.powi(3));
        self.x_max /= second;
        for bound in &mut self.bounds {
            (bound.low, bound.high) = (bound.low / second, bound.high / second);
        }
        self.jerks.iter_mut().for_each(|bound| bound.most /= third);
        self
    }

    /// Removes bounds that are implied by others at the same place, such as those of joints that
    /// move along with one nearer to its bound.
    ///
    /// With `a = l a_m` and `|a_m u + b_m x| <= 1`, `x <= X`: `|a u + b x| <= |l| + |b - l b_m| X`;
    /// likewise for jerks.
    #[must_use]
    pub(crate) fn pruned(mut self) -> Self {
        // Bounds without jerk, by the one with the largest factor of u.
        let X = self.x_max;
        let even = |bound: &Bound| bound.low == -bound.high;
        let strength = |bound: &Bound| (bound.a / bound.high).abs();
        let strongest = self.bounds.iter().copied().filter(even).max_by(|a, b| strength(a).total_cmp(&strength(b)));
        let Some(m) = strongest.filter(|m| m.a != 0.0 && X.is_finite()) else { return self };
        let (a_m, b_m) = (m.a / m.high, m.b / m.high);
        self.bounds.retain(|bound| {
            let (a, b) = (bound.a / bound.high, bound.b / bound.high);
            let l = a / a_m;
            *bound == m || !even(bound) || l.abs() + (b - l * b_m).abs() * X > 1.0
        });
        // Bounds of the jerk likewise, with the largest |u| that the bound above allows.
        let U = (1.0 + b_m.abs() * X) / a_m.abs();
        let strength = |bound: &JerkBound| (bound.a / bound.most).abs();
        let strongest = self.jerks.iter().copied().max_by(|a, b| strength(a).total_cmp(&strength(b)));
        let Some(m) = strongest.filter(|m| m.a != 0.0) else { return self };
        let (b_m, c_m) = (m.b / m.most, m.c / m.most);
        self.jerks.retain(|bound| {
            let l = bound.a / bound.most / (m.a / m.most);
            let rest = (bound.b / bound.most - l * b_m).abs() * U + (bound.c / bound.most - l * c_m).abs() * X;
            *bound == m || l.abs() + rest * X.sqrt() > 1.0
        });
        self
    }

    /// Factors by which a run must be slower to keep the bounds without jerk and those of jerk; at
    /// most 1 if it keeps them.
    pub fn slowing(&self, at: &Progress) -> [f64; 2] {
        let (x, u, third) = (at.v * at.v, at.a, at.v.powi(3));
        let linear = self.bounds.iter().map(|bound| {
            let value = bound.a * u + bound.b * x;
            if value > 0.0 { value / bound.high } else { value / bound.low }
        });
        let linear = linear.filter(|ratio| !ratio.is_nan()).fold(x / self.x_max, f64::max);
        // a s''' + b s' s'' + c s'^3
        let jerk =
            self.jerks.iter().map(|bound| (bound.a * at.j + bound.b * at.v * u + bound.c * third).abs() / bound.most);
        [linear.sqrt(), jerk.fold(0.0, f64::max).cbrt()]
    }
}

/// Number of parts of an interval at which bounds are checked: normally, and where a bound is near.
const CHECKED: [usize; 2] = [8, 32];
/// Fraction of the admissible speed above which a bound is near.
const NEAR: f64 = 0.97;
/// Number of intervals over a rise of the acceleration in the last round.
const OF_RISE: f64 = 10.0;
/// Minimum and maximum number of intervals over the duration, not counting the stations.
const MIN: f64 = 200.0;
const MAX: f64 = 30_000.0;
/// Rounds of the search: factor of the interval length, and relative gap to the optimal duration at
/// the start and at the end of the round.
const ROUNDS: [(f64, [f64; 2]); 2] = [(4.0, [0.1, 1e-3]), (1.0, [1e-2, 1e-5])];
/// Bounds are tightened where they are violated by more than this fraction of the speed, at most
/// `DRAWN` times.
const PASSED: f64 = 1e-4;
const DRAWN: usize = 3;
const DRAWN_GAP: [f64; 2] = [1e-3, 1e-5];

/// Returns the time-optimal law within bounds that include the jerk; no bound is violated anywhere.
///
/// * `law`: a law of the same path with continuous acceleration whose speed is zero only at both
///   ends.
/// * `stations`: parameters from start to end, at which bounds and their derivatives may jump.
/// * `rise`: time in which the acceleration rises from zero to its bound (s); it sets the length of
///   the intervals.
/// * `place`: bounds at a parameter within the interval after station `k`.
pub fn least_time_with_jerks(
    law: &Law,
    stations: &[f64],
    rise: f64,
    place: &mut dyn FnMut(usize, f64) -> PathBounds,
) -> QuinticLaw {
    // Rounds with ever finer intervals, each from the law of the one before.
    let step = |duration: f64| (rise / OF_RISE).min(duration / MIN).max(duration / MAX);
    let mut law = QuinticLaw::along(law, stations, ROUNDS[0].0 * step(law.duration()));
    for (round, gap) in ROUNDS {
        law = law.divided(round * step(law.duration()));
        let interval = intervals(stations, &law.s);
        law = law.improved(gap, &mut |k, s| place(interval[k], s));
    }
    // Tightens bounds that are violated between the places at which they are enforced.
    let interval = intervals(stations, &law.s);
    let mut drawn = vec![[1.0; 2]; interval.len()];
    for _ in 0..DRAWN {
        let slowing = law.slowing(&mut |k, s| place(interval[k], s));
        if slowing.iter().flatten().all(|slowing| *slowing <= 1.0 + PASSED) {
            break;
        }
        for (drawn, slowing) in drawn.iter_mut().flatten().zip(slowing.iter().flatten()) {
            *drawn *= slowing.max(1.0);
        }
        law = law.improved(DRAWN_GAP, &mut |k, s| place(interval[k], s).drawn_in(drawn[k]));
    }
    // The whole motion is slowed until no violation is left.
    let slowing = law.slowing(&mut |k, s| place(interval[k], s));
    law.slowed(slowing.iter().flatten().fold(1.0, |most: f64, slowing| most.max(*slowing)))
}

/// Returns the station interval that contains each interval between nodes.
fn intervals(stations: &[f64], nodes: &[f64]) -> Vec<usize> {
    let last = stations.len() - 2;
    let interval_of = |pair: &[f64]| {
        let middle = 0.5 * (pair[0] + pair[1]);
        (stations.partition_point(|s| *s <= middle).max(1) - 1).min(last)
    };
    nodes.windows(2).map(interval_of).collect()
}

/// Motion along a path: parameter, speed and acceleration at given times, with quintics between
/// them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QuinticLaw {
    /// Times (s), ascending.
    pub t: Vec<f64>,
    /// Parameter of the path.
    pub s: Vec<f64>,
    /// Speed of the parameter.
    pub v: Vec<f64>,
    /// Acceleration of the parameter.
    pub a: Vec<f64>,
}

impl QuinticLaw {
    /// Samples a law at the stations of its path and at times about `step` seconds apart, none of
    /// which is nearer than `0.3 step` to that of a station.
    pub fn along(law: &Law, stations: &[f64], step: f64) -> Self {
        // Times of the stations between start and end, with their numbers.
        let (end, last) = (law.duration(), stations.len() - 1);
        let mut times: Vec<(f64, Option<usize>)> = (1..last).map(|k| (time_of(law, stations[k]), Some(k))).collect();
        // Even times that are not near a station.
        let count = (end / step).ceil() as usize;
        for k in 1..count {
            let t = end * k as f64 / count as f64;
            let next = times[..last - 1].partition_point(|(at, _)| *at < t);
            let near = |k: usize| times[..last - 1].get(k).is_some_and(|(at, _)| (at - t).abs() < 0.3 * step);
            if !(near(next) || next > 0 && near(next - 1)) {
                times.push((t, None));
            }
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The law at these times, with the exact parameters of the stations, from rest to rest.
        let mut found = Self::default();
        found.push(0.0, &Progress { s: stations[0], v: 0.0, a: 0.0, j: 0.0 });
        for (t, station) in times {
            let at = law.at(t);
            found.push(t, &Progress { s: station.map_or(at.s, |k| stations[k]), ..at });
        }
        found.push(end, &Progress { s: stations[last], v: 0.0, a: 0.0, j: 0.0 });
        found
    }

    /// Appends a node.
    pub fn push(&mut self, t: f64, at: &Progress) {
        self.t.push(t);
        self.s.push(at.s);
        self.v.push(at.v);
        self.a.push(at.a);
    }

    /// Duration (s).
    pub fn duration(&self) -> f64 {
        self.t[self.t.len() - 1]
    }

    /// Returns the state of the motion at time `t` (s), at the nearer end outside the motion.
    pub fn at(&self, t: f64) -> Progress {
        let last = self.t.len() - 1;
        let k = self.t.partition_point(|knot| *knot <= t).clamp(1, last) - 1;
        self.within(k, (t - self.t[k]).clamp(0.0, self.t[k + 1] - self.t[k]))
    }

    /// Returns the state of the motion at time `tau` (s) after node `k`, on the quintic of the
    /// interval that begins there.
    ///
    /// # Panics
    /// If `k` is the last node.
    pub fn within(&self, k: usize, tau: f64) -> Progress {
        let h = self.t[k + 1] - self.t[k];
        let (v0, v1, a0, a1) = (self.v[k], self.v[k + 1], self.a[k], self.a[k + 1]);
        // Change of position, speed and acceleration beyond constant acceleration.
        let step = (self.s[k + 1] - self.s[k]) - h * (v0 + 0.5 * h * a0);
        let (dv, da) = (v1 - v0 - h * a0, a1 - a0);
        let c3 = (10.0 * step - 4.0 * dv * h + 0.5 * da * h * h) / h.powi(3);
        let c4 = (-15.0 * step + 7.0 * dv * h - da * h * h) / h.powi(4);
        let c5 = (6.0 * step - 3.0 * dv * h + 0.5 * da * h * h) / h.powi(5);
        Progress {
            s: self.s[k] + tau * (v0 + tau * (0.5 * a0 + tau * (c3 + tau * (c4 + tau * c5)))),
            v: v0 + tau * (a0 + tau * (3.0 * c3 + tau * (4.0 * c4 + tau * 5.0 * c5))),
            a: a0 + tau * (6.0 * c3 + tau * (12.0 * c4 + tau * 20.0 * c5)),
            j: 6.0 * c3 + tau * (24.0 * c4 + tau * 60.0 * c5),
        }
    }

    /// The same motion with intervals of at most `longest` seconds.
    #[must_use]
    pub fn divided(&self, longest: f64) -> Self {
        let mut fine = Self::default();
        for k in 0..self.t.len() - 1 {
            let h = self.t[k + 1] - self.t[k];
            let parts = (h / longest).ceil().max(1.0) as usize;
            for i in 0..parts {
                let tau = h * i as f64 / parts as f64;
                fine.push(self.t[k] + tau, &self.within(k, tau));
            }
        }
        let last = self.t.len() - 1;
        fine.push(self.t[last], &Progress { s: self.s[last], v: self.v[last], a: self.a[last], j: 0.0 });
        fine
    }

    /// The motion with `factor` times its duration.
    #[must_use]
    pub fn slowed(mut self, factor: f64) -> Self {
        self.t.iter_mut().for_each(|t| *t *= factor);
        self.v.iter_mut().for_each(|v| *v /= factor);
        self.a.iter_mut().for_each(|a| *a /= factor * factor);
        self
    }

    /// Factors by which the motion must be slower in each interval to keep all bounds, also between
    /// the places at which [`QuinticLaw::improved`] enforces them; at most 1 where it keeps them.
    ///
    /// * `place`: bounds at a parameter of interval `k`.
    pub fn slowing(&self, place: &mut dyn FnMut(usize, f64) -> PathBounds) -> Vec<[f64; 2]> {
        let mut slowing_of = |k: usize, parts: usize| {
            let h = (self.t[k + 1] - self.t[k]) / parts as f64;
            let at = (0..=parts).map(|i| self.within(k, h * i as f64));
            at.map(|at| place(k, at.s).slowing(&at)).fold([0.0; 2], larger)
        };
        (0..self.t.len() - 1)
            .map(|k| match slowing_of(k, CHECKED[0]) {
                far if far[0].max(far[1]) < NEAR => far,
                _ => slowing_of(k, CHECKED[1]),
            })
            .collect()
    }

    /// Returns the fastest motion through the same nodes whose speed is that of this one times the
    /// square root of a cubic spline over its time. This motion itself need not keep the bounds.
    /// The result begins and ends at rest if this one does.
    ///
    /// * `place`: bounds at a parameter of interval `k`; rest must be admissible everywhere.
    /// * `gap`: relative gap to the optimal duration at the start and at the end of the search.
    #[must_use]
    pub fn improved(&self, gap: [f64; 2], place: &mut dyn FnMut(usize, f64) -> PathBounds) -> Self {
        let (t, v, a) = barrier::improved(self, gap, place);
        Self { t, s: self.s.clone(), v, a }
    }
}

/// Elementwise maximum.
fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}

/// Time at which a law reaches `s`.
fn time_of(law: &Law, s: f64) -> f64 {
    let (mut low, mut high) = (0.0, law.duration());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if law.at(middle).s < s { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
