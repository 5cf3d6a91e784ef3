//! The least time of a path within bounds that know the jerk.
//!
//! ```text
//! s = sigma(theta),  y = theta'^2,  u = theta'' = y_theta / 2,  w = u_theta
//! T = int d theta / sqrt(y),   low <= a u + b y <= high,   |a w + b u + c y| <= most / sqrt(y)
//! ```
//! Over the parameter `s` itself (`sigma` the identity) the last bound is the jerk of a joint with
//! `a = q'`, `b = 3 q''`, `c = q'''`. Here the parameter is the time `theta` of a law that runs the
//! path already: then `y` is smooth and not zero, also where the path begins and ends at rest, and
//! `y = 1` where that law cannot be improved. The bounds keep their form, with
//!
//! ```text
//! a -> a v,   b -> b v^2 + 3 a v',   c -> c v^3 + b v v' + a v''      (jerk;  v = d sigma / d theta)
//! a -> a v,   b -> b v^2 + a v'                                       (bounds that are linear)
//! ```
//! `1 / sqrt(y)` is convex: replaced by its tangent it is a bound that is tighter and linear, so
//! that a convex program with ever new tangents ends at a law that cannot be improved nearby and
//! keeps every bound on the way [Debrouwere et al. 2013]. The steps of an interior-point method
//! take these tangents as they go. `y` is a cubic spline, so that the jerk is continuous; what its
//! switches cost falls with the square of the distance of the nodes.
//!
//! Start at [`QuinticLaw::improved`]. Not here: which bounds a path has, how nodes are chosen.
#![allow(non_snake_case, reason = "letters of the formulas")]

use crate::barrier;
use crate::time_law::{Bound, Law, Progress};

/// `|a u' + b u + c x| sqrt(x) <= most` along the parameter `s` with `x = s'^2`, `u = s''`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JerkBound {
    /// Factor of `u'`: first derivative of a joint by `s`.
    pub a: f64,
    /// Factor of `u`: three times the second derivative.
    pub b: f64,
    /// Factor of `x`: third derivative.
    pub c: f64,
    /// Greatest value, positive.
    pub most: f64,
}

/// What holds at a place of a path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Place {
    /// Greatest squared speed; infinite where only the bounds rule.
    pub x_max: f64,
    /// Linear bounds.
    pub bounds: Vec<Bound>,
    /// Bounds of jerks.
    pub jerks: Vec<JerkBound>,
}

impl Place {
    /// Bounds without jerk and bounds of jerk that a run keeps if it would keep those here so many
    /// times slower.
    #[must_use]
    pub fn drawn_in(mut self, [linear, jerk]: [f64; 2]) -> Self {
        let (second, third) = (linear * linear, jerk.powi(3));
        self.x_max /= second;
        for bound in &mut self.bounds {
            (bound.low, bound.high) = (bound.low / second, bound.high / second);
        }
        self.jerks.iter_mut().for_each(|bound| bound.most /= third);
        self
    }

    /// Without bounds that others of the same place imply: joints that go along with one that is
    /// nearer to its bound.
    ///
    /// With `a = l a_m` and `|a_m u + b_m x| <= 1`, `x <= X`: `|a u + b x| <= |l| + |b - l b_m| X`;
    /// likewise for jerks.
    #[must_use]
    pub fn pruned(mut self) -> Self {
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

    /// By how much a run must be slower to keep the bounds without jerk and those of jerk: at most
    /// 1 where it does.
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

/// In so many parts of an interval it is looked whether bounds are kept; in the second number where
/// one is near.
const CHECKED: [usize; 2] = [8, 32];
/// Nearer than this part of the speed.
const NEAR: f64 = 0.97;
/// Intervals of a rise of the acceleration, at the end.
const OF_RISE: f64 = 10.0;
/// Least and most intervals of a route, stations apart.
const LEAST: f64 = 200.0;
const MOST: f64 = 30_000.0;
/// Intervals are so many times longer at first; what is left to gain where each round begins and
/// ends, of the duration.
const ROUNDS: [(f64, [f64; 2]); 2] = [(4.0, [0.1, 1e-3]), (1.0, [1e-2, 1e-5])];
/// Bounds are drawn in where a run would have to be slower by more than this part to keep them,
/// this often.
const PASSED: f64 = 1e-4;
const DRAWN: usize = 3;
const DRAWN_GAP: [f64; 2] = [1e-3, 1e-5];

/// The least time within bounds that know the jerk; nowhere are they passed.
///
/// * `law`: a law of the same path whose acceleration is continuous and whose speed is zero at both
///   ends alone.
/// * `stations`: parameters from start to end, at which bounds and their derivatives may jump.
/// * `rise`: time that an acceleration takes from zero to its bound, s: where intervals must be
///   short.
/// * `place`: what holds at a parameter of the interval behind station `k`.
pub fn least_time_with_jerks(
    law: &Law,
    stations: &[f64],
    rise: f64,
    place: &mut dyn FnMut(usize, f64) -> Place,
) -> QuinticLaw {
    let step = |duration: f64| (rise / OF_RISE).min(duration / LEAST).max(duration / MOST);
    let mut law = QuinticLaw::along(law, stations, ROUNDS[0].0 * step(law.duration()));
    for (round, gap) in ROUNDS {
        law = law.divided(round * step(law.duration()));
        let of = intervals(stations, &law.s);
        law = law.improved(gap, &mut |k, s| place(of[k], s));
    }
    // Where bounds are passed between the places that were looked at, they are drawn in.
    let of = intervals(stations, &law.s);
    let mut drawn = vec![[1.0; 2]; of.len()];
    for _ in 0..DRAWN {
        let slowing = law.slowing(&mut |k, s| place(of[k], s));
        if slowing.iter().flatten().all(|slowing| *slowing <= 1.0 + PASSED) {
            break;
        }
        for (drawn, slowing) in drawn.iter_mut().flatten().zip(slowing.iter().flatten()) {
            *drawn *= slowing.max(1.0);
        }
        law = law.improved(DRAWN_GAP, &mut |k, s| place(of[k], s).drawn_in(drawn[k]));
    }
    let slowing = law.slowing(&mut |k, s| place(of[k], s));
    law.slowed(slowing.iter().flatten().fold(1.0, |most: f64, slowing| most.max(*slowing)))
}

/// Intervals between stations in which those between nodes lie.
fn intervals(stations: &[f64], nodes: &[f64]) -> Vec<usize> {
    let last = stations.len() - 2;
    let of = |pair: &[f64]| {
        let middle = 0.5 * (pair[0] + pair[1]);
        (stations.partition_point(|s| *s <= middle).max(1) - 1).min(last)
    };
    nodes.windows(2).map(of).collect()
}

/// A run along a path: place, speed and acceleration at moments, quintics between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QuinticLaw {
    /// s, ascending.
    pub t: Vec<f64>,
    /// Parameter of the path.
    pub s: Vec<f64>,
    /// Its speed.
    pub v: Vec<f64>,
    /// Its acceleration.
    pub a: Vec<f64>,
}

impl QuinticLaw {
    /// A law at stations of its path and at moments that are `step` apart.
    pub fn along(law: &Law, stations: &[f64], step: f64) -> Self {
        let (end, last) = (law.duration(), stations.len() - 1);
        let mut times: Vec<(f64, Option<usize>)> = (1..last).map(|k| (time_of(law, stations[k]), Some(k))).collect();
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
        let mut found = Self::default();
        found.push(0.0, &Progress { s: stations[0], v: 0.0, a: 0.0, j: 0.0 });
        for (t, station) in times {
            let at = law.at(t);
            found.push(t, &Progress { s: station.map_or(at.s, |k| stations[k]), ..at });
        }
        found.push(end, &Progress { s: stations[last], v: 0.0, a: 0.0, j: 0.0 });
        found
    }

    /// Appends a moment.
    pub fn push(&mut self, t: f64, at: &Progress) {
        self.t.push(t);
        self.s.push(at.s);
        self.v.push(at.v);
        self.a.push(at.a);
    }

    /// How long it lasts, s.
    pub fn duration(&self) -> f64 {
        self.t[self.t.len() - 1]
    }

    /// Where the run is at `t` (s).
    pub fn at(&self, t: f64) -> Progress {
        let last = self.t.len() - 1;
        let k = self.t.partition_point(|knot| *knot <= t).clamp(1, last) - 1;
        self.within(k, (t - self.t[k]).clamp(0.0, self.t[k + 1] - self.t[k]))
    }

    /// `tau` behind node `k`, in the interval that begins there.
    pub fn within(&self, k: usize, tau: f64) -> Progress {
        let h = self.t[k + 1] - self.t[k];
        let (v0, v1, a0, a1) = (self.v[k], self.v[k + 1], self.a[k], self.a[k + 1]);
        // What goes beyond constant acceleration.
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

    /// The same run with intervals of at most `longest` seconds.
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

    /// The run in `factor` times its time.
    #[must_use]
    pub fn slowed(mut self, factor: f64) -> Self {
        self.t.iter_mut().for_each(|t| *t *= factor);
        self.v.iter_mut().for_each(|v| *v /= factor);
        self.a.iter_mut().for_each(|a| *a /= factor * factor);
        self
    }

    /// By how much the run must be slower in each interval to keep all bounds, also between the
    /// places at which [`QuinticLaw::improved`] keeps them; 1 or less where it does.
    ///
    /// * `place`: what holds at a parameter of interval `k`.
    pub fn slowing(&self, place: &mut dyn FnMut(usize, f64) -> Place) -> Vec<[f64; 2]> {
        let mut of = |k: usize, parts: usize| {
            let h = (self.t[k + 1] - self.t[k]) / parts as f64;
            let at = (0..=parts).map(|i| self.within(k, h * i as f64));
            at.map(|at| place(k, at.s).slowing(&at)).fold([0.0; 2], larger)
        };
        (0..self.t.len() - 1)
            .map(|k| match of(k, CHECKED[0]) {
                far if far[0].max(far[1]) < NEAR => far,
                _ => of(k, CHECKED[1]),
            })
            .collect()
    }

    /// The fastest run through the same nodes with a speed that is this one's times the root of a
    /// cubic spline over its time; this run itself need not keep its bounds. It begins and ends at
    /// rest as this one does.
    ///
    /// * `place`: what holds at a parameter of interval `k`; a standstill must be allowed
    ///   everywhere.
    /// * `gap`: what may be left to gain, of the duration: where the search begins and where it
    ///   ends.
    #[must_use]
    pub fn improved(&self, gap: [f64; 2], place: &mut dyn FnMut(usize, f64) -> Place) -> Self {
        let (t, v, a) = barrier::improved(self, gap, place);
        Self { t, s: self.s.clone(), v, a }
    }
}

/// The larger of both, one by one.
fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}

/// When a law is at `s`.
fn time_of(law: &Law, s: f64) -> f64 {
    let (mut low, mut high) = (0.0, law.duration());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if law.at(middle).s < s { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One joint that is the parameter, at rest at both ends; its run as a sine, over `n`
    /// intervals.
    fn sine(length: f64, n: usize) -> QuinticLaw {
        let tau = std::f64::consts::TAU;
        let mut law = QuinticLaw::default();
        for k in 0..=n {
            let t = k as f64 / n as f64;
            let phase = tau * t;
            let (s, v, a) = (t - phase.sin() / tau, 1.0 - phase.cos(), tau * phase.sin());
            law.push(t, &Progress { s: length * s, v: length * v, a: length * a, j: 0.0 });
        }
        (law.v[n], law.a[n]) = (0.0, 0.0);
        law
    }

    /// By hand: a ramp to the speed v takes v/a + a/j, or 2 sqrt(v/j) if a is not reached.
    fn s_curve(length: f64, [v, a, j]: [f64; 3]) -> f64 {
        let ramp = |v: f64| if v * j >= a * a { v / a + a / j } else { 2.0 * (v / j).sqrt() };
        if v * ramp(v) <= length {
            return ramp(v) + length / v;
        }
        let (mut low, mut high) = (0.0, v);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle * ramp(middle) <= length { low = middle } else { high = middle }
        }
        2.0 * ramp(low)
    }

    #[test]
    fn a_straight_path_is_run_as_the_s_curve_of_seven_phases() {
        // Cruise with constant accelerations; no cruise; jerk alone; no bound of the acceleration;
        // a short rise.
        let cases = [
            (1.0, [0.5, 2.0, 20.0]),
            (1.0, [10.0, 2.0, 20.0]),
            (0.01, [10.0, 20.0, 20.0]),
            (1.0, [0.5, f64::INFINITY, 20.0]),
            (2.0, [1.0, 5.0, 1000.0]),
        ];
        for (length, [v, a, j]) in cases {
            let mut place = |_: usize, _: f64| Place {
                x_max: v * v,
                bounds: vec![Bound { a: 1.0, b: 0.0, low: -a, high: a }],
                jerks: vec![JerkBound { a: 1.0, b: 0.0, c: 0.0, most: j }],
            };
            let truth = s_curve(length, [v, a, j]);
            let mut law = sine(length, 50);
            for (round, gap) in [(4.0, [0.1, 1e-3]), (1.0, [1e-2, 1e-5])] {
                // Ten intervals of each rise of the acceleration.
                let step = (0.1 * a / j).min(law.duration() / 200.0);
                law = law.divided(round * step).improved(gap, &mut place);
            }
            let (late, slowing) =
                (law.duration() / truth - 1.0, law.slowing(&mut place).into_iter().flatten().fold(0.0, f64::max));
            // measured 8.7e-5 and 1.00039, the latter without bounds that are drawn in
            assert!(late.abs() < 5e-4 && slowing < 1.002, "{length} {v} {a} {j}: {late:.1e} {slowing}");
        }
    }

    /// Truth: one joint over q = s + s², whose least time does not depend on what `s` is.
    #[test]
    fn a_curved_parameter_changes_nothing_of_the_least_time_with_jerk() {
        let [v, a, j] = [0.8, 2.0, 10.0];
        let mut place = |_: usize, s: f64| {
            let rate = 1.0 + 2.0 * s;
            Place {
                x_max: (v / rate).powi(2),
                bounds: vec![Bound { a: rate, b: 2.0, low: -a, high: a }],
                jerks: vec![JerkBound { a: rate, b: 6.0, c: 0.0, most: j }],
            }
        };
        let mut law = sine(1.0, 100);
        for parts in [100.0, 200.0, 400.0] {
            law = law.divided(law.duration() / parts).improved([0.1, 1e-5], &mut place);
        }
        let late = law.duration() / s_curve(2.0, [v, a, j]) - 1.0;
        assert!(late.abs() < 2e-4, "{late:.1e}"); // measured 1.3e-5
    }

    /// Second algorithm: differences of the law itself.
    #[test]
    fn speed_acceleration_and_jerk_of_quintics_are_derivatives_of_their_place() {
        let law = sine(0.7, 40);
        for k in 1..300 {
            let (t, h) = (0.00331 * f64::from(k), 1e-5);
            let (low, mid, high) = (law.at(t - h), law.at(t), law.at(t + h));
            assert!(((high.s - low.s) / (2.0 * h) - mid.v).abs() < 1e-8);
            assert!(((high.v - low.v) / (2.0 * h) - mid.a).abs() < 1e-7);
            assert!(((high.a - low.a) / (2.0 * h) - mid.j).abs() < 0.02, "{}", (high.a - low.a) / (2.0 * h) - mid.j);
        }
    }
}
