//! The least time with a speed that is averaged: accelerations rise in a given time.

use crate::route::Route;
use crate::schedule::SLACK;
use crate::time_law::{Law, LawError, PathPoint, least_time};

/// Attempts to bring an averaged law below its limits by local slowing, before all of it is slowed.
const ATTEMPTS: usize = 12;
/// Widest jerk window that is tried, as a multiple of the one asked for.
const WIDEST: f64 = 200.0;

/// A smoothed law that keeps all bounds, and by how much it must be slowed as a whole.
pub(crate) fn kept(points: &[PathPoint], route: &Route, rise: f64) -> Result<(Law, f64), LawError> {
    let mut points = points.to_vec();
    let limits: Vec<PathPoint> = points.clone();
    let s: Vec<f64> = points.iter().map(|point| point.s).collect();
    let mut window = rise;
    for _ in 0..ATTEMPTS {
        let x = least_time(&points)?;
        let law = Law::new(&s, &x).smoothed(window);
        let worst_jerk = path_jerk(&law, route);
        let excess = excesses(&law, &limits);
        let most = excess.iter().fold(1.0, |most: f64, (_, ratio)| most.max(*ratio));
        if worst_jerk <= 1.0 + SLACK && most <= 1.0 + SLACK {
            return Ok((law, 1.0));
        }
        if worst_jerk > 1.0 + SLACK && window < WIDEST * rise {
            window *= worst_jerk.min(4.0);
        }
        // Slower where the average took in faster neighbours.
        let times = Law::new(&s, &x);
        let mut slower = x.clone();
        for (t, ratio) in excess {
            let [from, to] = [t - window, t].map(|t| times.at(t).s);
            let first = s.partition_point(|s| *s < from).saturating_sub(1);
            let last = s.partition_point(|s| *s <= to).min(s.len() - 1);
            for k in first..=last {
                slower[k] = f64::min(slower[k], x[k] / (ratio * (1.0 + 0.2 * SLACK)));
            }
        }
        for (point, (slower, x)) in points.iter_mut().zip(slower.iter().zip(&x)) {
            if slower < x {
                point.x_max = point.x_max.min(*slower);
            }
        }
    }
    let x = least_time(&points)?;
    let law = Law::new(&s, &x).smoothed(window);
    let most = excesses(&law, &limits).iter().fold(path_jerk(&law, route).powf(2.0 / 3.0), |most, (_, r)| most.max(*r));
    Ok((law, most.max(1.0).sqrt()))
}

/// Moments at which an averaged law passes a limit, with the ratio by which squared speeds are too large.
fn excesses(law: &Law, limits: &[PathPoint]) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    let knots = law.knots();
    let middles = knots.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    for t in knots.iter().copied().chain(middles) {
        let at = law.at(t);
        let (x, u) = (at.v * at.v, at.a);
        let last = limits.len() - 1;
        let k = limits.partition_point(|point| point.s <= at.s).clamp(1, last) - 1;
        let ratio = |point: &PathPoint| {
            let by_bounds = point.bounds.iter().map(|bound| {
                let value = bound.a * u + bound.b * x;
                if value > 0.0 {
                    value / bound.high
                } else if value < 0.0 {
                    value / bound.low
                } else {
                    0.0
                }
            });
            by_bounds.fold(x / point.x_max, f64::max)
        };
        // Between two points the wider of the two bounds: at a step of the program both are right.
        let least = ratio(&limits[k]).min(ratio(&limits[k + 1]));
        if least > 1.0 + SLACK {
            found.push((t, least));
        }
    }
    found
}

/// Greatest jerk along the path of the tool over the programmed one; 0 where none is programmed.
fn path_jerk(law: &Law, route: &Route) -> f64 {
    let bounded: Vec<(f64, f64, f64)> = route
        .pieces
        .iter()
        .filter(|piece| !piece.tool.is_empty())
        .filter_map(|piece| {
            let [a, b] = piece.stations.map(|k| route.stations[k].s);
            Some((a, b, piece.speed.linear_m_s3?))
        })
        .collect();
    if bounded.is_empty() {
        return 0.0;
    }
    let ratio = |t: f64| {
        let at = law.at(t);
        let k = bounded.partition_point(|(_, b, _)| *b < at.s);
        bounded.get(k).filter(|(a, _, _)| at.s >= *a).map_or(0.0, |(_, _, most)| at.j.abs() / most)
    };
    law.knots().into_iter().map(ratio).fold(0.0, f64::max)
}
