//! Drawable points of a panel, and the ranges of its axes.

use std::ops::Range;

use crate::plot::curve::Panel;
use crate::plot::style::Style;

/// Maximum ratio of the highest to the lowest value of a logarithmic panel.
const MAX_DECADES: f64 = 1e8;

/// Returns the drawable points of each curve.
pub(super) fn points(panel: &Panel) -> Vec<Vec<(f64, f64)>> {
    let good = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite() && (*y > 0.0 || !panel.logarithmic);
    panel.curves.iter().map(|c| c.x.iter().copied().zip(c.y.iter().copied()).filter(good).collect()).collect()
}

/// Returns the ranges of the axes, with a margin.
pub(super) fn ranges(points: &[Vec<(f64, f64)>], logarithmic: bool) -> Option<(Range<f64>, Range<f64>)> {
    let all = || points.iter().flatten();
    let span = |f: fn(&(f64, f64)) -> f64| {
        all().map(f).fold(None, |range: Option<(f64, f64)>, v| {
            let (low, high) = range.unwrap_or((v, v));
            Some((low.min(v), high.max(v)))
        })
    };
    let (x_low, x_high) = span(|p| p.0)?;
    let (low, high) = span(|p| p.1)?;
    let y = if logarithmic {
        0.7 * low.max(high / MAX_DECADES)..1.5 * high
    } else {
        let margin = 0.05 * (high - low).max(1e-9 * high.abs()).max(1e-12);
        low - margin..high + margin
    };
    Some((x_low..if x_high > x_low { x_high } else { x_low + 1.0 }, y))
}

/// Widens the ranges around their centres until both axes have the same scale, with a margin.
pub fn equally_long((x, y): (Range<f64>, Range<f64>), style: &Style) -> (Range<f64>, Range<f64>) {
    let wide = f64::from(style.panel.0 - 3 * style.margin - style.y_area);
    let high = f64::from(style.panel.1 - 2 * style.margin - style.x_area);
    let unit = 1.05 * ((x.end - x.start) / wide).max((y.end - y.start) / high);
    let around = |range: Range<f64>, pixels: f64| {
        let (middle, half) = (0.5 * (range.start + range.end), 0.5 * unit * pixels);
        middle - half..middle + half
    };
    (around(x, wide), around(y, high))
}
