//! Time-optimal move along a joint spline within velocity, acceleration and jerk limits.
//!
//! The path is the natural cubic spline through the points over chord length; [`crate::jerk_law`]
//! computes the time law.

use crate::curve::Curve;
use crate::jerk_law::{JerkBound, PathBounds, least_time_with_jerks};
use crate::plan::MotionLimits;
use crate::polynomial::Piece;
use crate::spline::natural_spline;
use crate::time_law::{Bound, Law, PathPoint, least_time};

/// Rise time of the acceleration to its limit where no jerk limit is given (s).
pub(crate) const RISE: f64 = 0.05;
/// Minimum number of stations of the path for the first law.
const STATIONS: usize = 400;

/// The joints along the path.
pub(crate) struct JointPath<'a> {
    /// Parameter of each point, ascending from 0.
    s: Vec<f64>,
    /// Pieces of the spline of each joint.
    splines: Vec<Vec<Piece>>,
    limits: &'a [MotionLimits],
}

impl<'a> JointPath<'a> {
    /// Returns the spline through the points, which must differ from their neighbours.
    ///
    /// * `weights`: unit of travel of each joint.
    ///
    /// # Errors
    ///
    /// The index of a point that equals the previous one.
    pub(crate) fn new(points: &[&[f64]], weights: &[f64], limits: &'a [MotionLimits]) -> Result<Self, usize> {
        let mut s = vec![0.0];
        for (i, pair) in points.windows(2).enumerate() {
            let ways = pair[0].iter().zip(pair[1]).zip(weights).map(|((a, b), weight)| (b - a).abs() / weight);
            s.push(s[i] + ways.fold(0.0, f64::max));
            if s[i + 1] <= s[i] {
                return Err(i + 1);
            }
        }
        let spline = |joint: usize| {
            let q: Vec<f64> = points.iter().map(|point| point[joint]).collect();
            let rates = natural_spline(&s, &q);
            let end = |k: usize| [q[k], rates[k][0], rates[k][1]];
            (1..s.len()).map(|k| Piece::hermite(s[k] - s[k - 1], end(k - 1), end(k))).collect()
        };
        let splines = (0..limits.len()).map(spline).collect();
        Ok(Self { s, splines, limits })
    }

    /// Value and three derivatives of each joint at `s` of an interval between two points.
    fn at(&self, interval: usize, s: f64) -> impl Iterator<Item = [f64; 4]> + '_ {
        self.splines.iter().map(move |pieces| pieces[interval].at(s - self.s[interval]))
    }

    /// Bounds at a place; a joint that does not move there adds none.
    fn place(&self, interval: usize, s: f64) -> PathBounds {
        let mut place = PathBounds { x_max: f64::INFINITY, ..PathBounds::default() };
        for ([_, d, dd, ddd], limit) in self.at(interval, s).zip(self.limits) {
            if [d, dd, ddd] == [0.0; 3] {
                continue;
            }
            let MotionLimits { velocity, acceleration, .. } = *limit;
            place.x_max = place.x_max.min((velocity / d).powi(2));
            place.bounds.push(Bound { a: d, b: dd, low: -acceleration, high: acceleration });
            place.jerks.push(JerkBound { a: d, b: 3.0 * dd, c: ddd, most: jerk(limit) });
        }
        place
    }

    /// The curves of all joints in the least time.
    pub(crate) fn fastest(&self) -> Vec<Curve> {
        let intervals = self.s.len() - 1;
        let parts = STATIONS.div_ceil(intervals);
        let part = |k: usize, i: usize| self.s[k] + (self.s[k + 1] - self.s[k]) * i as f64 / parts as f64;
        let mut stations: Vec<f64> = (0..intervals).flat_map(|k| (0..parts).map(move |i| part(k, i))).collect();
        stations.push(self.s[intervals]);
        let point = |(k, s): (usize, &f64)| {
            let PathBounds { x_max, bounds, .. } = self.place((k / parts).min(intervals - 1), *s);
            PathPoint { s: *s, x_max, bounds }
        };
        let points: Vec<PathPoint> = stations.iter().enumerate().map(point).collect();
        // Rest is admissible everywhere, so a law exists.
        let Ok(x) = least_time(&points) else { return Vec::new() };
        let law = Law::new(&stations, &x);
        let moving = (0..self.limits.len()).filter(|joint| self.splines[*joint].iter().any(|piece| !piece.is_still()));
        let rises = moving.map(|joint| self.limits[joint].acceleration / jerk(&self.limits[joint]));
        let (shortest, longest) = rises.fold((f64::INFINITY, 0.0f64), |(a, b), rise| (a.min(rise), b.max(rise)));
        let window = longest.min(law.duration());
        let law = law.smoothed(window);
        let law = least_time_with_jerks(&law, &stations, shortest, &mut |k, s| self.place(k / parts, s));

        let curve = |joint: usize| {
            let rates = |interval: usize, node: usize| {
                let [q, d, dd, _] = self.splines[joint][interval].at(law.s[node] - self.s[interval]);
                [q, d * law.v[node], dd * law.v[node].powi(2) + d * law.a[node]]
            };
            let piece = |node: usize| {
                let middle = 0.5 * (law.s[node] + law.s[node + 1]);
                let interval = self.s.partition_point(|s| *s <= middle).clamp(1, intervals) - 1;
                Piece::hermite(law.t[node + 1] - law.t[node], rates(interval, node), rates(interval, node + 1))
            };
            Curve { pieces: (0..law.t.len() - 1).map(piece).collect(), knots: law.t.clone() }
        };
        let curves: Vec<Curve> = (0..self.limits.len()).map(curve).collect();
        // Slows the curves for violations between the nodes of the law.
        let passed = |(curve, limit): (&Curve, &MotionLimits)| {
            let [speed, acceleration, third] = [1, 2, 3].map(|order| curve.largest(order));
            let ratios =
                [speed / limit.velocity, (acceleration / limit.acceleration).sqrt(), (third / jerk(limit)).cbrt()];
            ratios.into_iter().fold(1.0, f64::max)
        };
        let slowing = curves.iter().zip(self.limits).map(passed).fold(1.0, f64::max);
        curves.iter().map(|curve| curve.stretched(slowing)).collect()
    }
}

/// Maximum jerk of a joint.
fn jerk(limit: &MotionLimits) -> f64 {
    if limit.jerk.is_finite() { limit.jerk } else { limit.acceleration / RISE }
}
