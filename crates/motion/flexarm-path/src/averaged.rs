//! Time-optimal law with an averaged speed: accelerations rise within a given time.
//!
//! The average over a window T keeps the bounds of the law behind it only where these change
//! slowly; elsewhere the law is slowed and tried again. Start at [`kept`]. Not here: bounded jerks
//! of joints (`jerk_bounded`).

use flexarm_trajectory::time_law::{Law, LawError, PathPoint, least_time};

use crate::route::Route;

/// Relative tolerance of limits.
pub(crate) const SLACK: f64 = 1e-3;
/// A law is better only if it is faster by more than this fraction of its duration.
const NEAR: f64 = 1e-4;
/// Maximum number of attempts to find a better law.
const ATTEMPTS: usize = 12;
/// Maximum jerk window that is tried, as a multiple of the requested one.
const WIDEST: f64 = 200.0;

/// Returns a smoothed law and the factor by which it must be slowed as a whole to keep all bounds.
///
/// Where the averaged law exceeds a bound, the underlying law is slowed; where it no longer reaches
/// a bound, the underlying law is sped up again. The fastest law of all iterations is returned.
///
/// * `points`: bounds along the route.
pub(crate) fn kept(points: &[PathPoint], route: &Route, rise: f64) -> Result<(Law, f64), LawError> {
    let s: Vec<f64> = points.iter().map(|point| point.s).collect();
    let mut slowed = points.to_vec();
    let mut window = rise;
    let mut best: Option<(Law, f64)> = None;
    let mut vain = 0;
    for _ in 0..ATTEMPTS {
        // Least-time law under the present bounds, averaged over the window, slowed to keep all
        // bounds: speeds by √(ratio of squares), jerk by its cube root.
        let x = least_time(&slowed)?;
        let raw = Law::new(&s, &x);
        let law = raw.clone().smoothed(window);
        let worst_jerk = path_jerk(&law, route);
        let ratios = ratios(&law, points);
        let most = ratios.iter().fold(1.0, |most: f64, (_, ratio)| most.max(*ratio));
        let slowing = most.sqrt().max(worst_jerk.cbrt());
        // Keep the fastest law; stop after two attempts that gain nothing.
        let duration = law.duration() * slowing;
        let before = best.as_ref().map_or(f64::INFINITY, |(law, slowing)| law.duration() * slowing);
        vain = if duration < before * (1.0 - NEAR) { 0 } else { vain + 1 };
        if duration < before {
            best = Some((law, slowing));
        }
        let widen = worst_jerk > 1.0 + SLACK && window < WIDEST * rise;
        if !widen && (vain > 1 || slowing == 1.0 && slowed == points) {
            break;
        }
        // Maximum ratio over all averages that include the point.
        let mut reached = vec![0.0f64; s.len()];
        for (t, ratio) in ratios {
            let [from, to] = [t - window, t].map(|t| raw.at(t).s);
            let first = s.partition_point(|s| *s < from).saturating_sub(1);
            let last = s.partition_point(|s| *s <= to).min(s.len() - 1);
            reached[first..=last].iter_mut().for_each(|reached| *reached = reached.max(ratio));
        }
        for k in 0..s.len() {
            // Lower the bounds that were exceeded, raise those that are no longer reached.
            let (cap, most) = (slowed[k].x_max, points[k].x_max);
            if reached[k] > 1.0 {
                slowed[k].x_max = cap.min(x[k] / reached[k]);
            } else if cap < most && x[k] > cap * (1.0 - NEAR) {
                slowed[k].x_max = most.min(cap / reached[k].max(0.5).sqrt());
            }
        }
        if widen {
            window *= worst_jerk.min(4.0);
        }
    }
    best.ok_or(LawError::Points(points.len()))
}

/// Times of an averaged law with the ratios of its squared speeds to the largest ones that the
/// bounds allow.
fn ratios(law: &Law, points: &[PathPoint]) -> Vec<(f64, f64)> {
    let knots = law.knots();
    let middles = knots.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    let ratio = |t: f64| {
        let at = law.at(t);
        let k = points.partition_point(|point| point.s <= at.s).clamp(1, points.len() - 1) - 1;
        let (here, next) = (&points[k], &points[k + 1]);
        (t, PathPoint::passed(here, next, (at.s - here.s) / (next.s - here.s), at.v * at.v, at.a))
    };
    knots.iter().copied().chain(middles).map(ratio).collect()
}

/// Maximum ratio of the jerk along the TCP path to the programmed one; 0 where none is programmed.
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
