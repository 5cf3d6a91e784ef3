//! Charts of studies as SVG: main effects, bars with intervals, histograms, scatter plots, single
//! and as a matrix.
//!
//! Input: plain numbers and names; output: SVG text with sizes in browser pixels.
//! Not here: curves over time ([`crate::LinePlot`]), numbers over a plane ([`crate::FieldPlot`]).

use std::cmp::Ordering;
use std::ops::Range;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::palette::{self, Ground};
use crate::plot::{Area, Axes, MARK, PlotError, axes, ink, picture};

/// Means of a result over groups of a parameter.
#[derive(Clone, Debug, Default)]
pub struct EffectPanel<'a> {
    /// Name of the parameter.
    pub x_label: &'a str,
    /// Name of the result.
    pub y_label: &'a str,
    /// Parameter, mean, standard error.
    pub points: Vec<[f64; 3]>,
}

/// A pair of numbers with intervals, side by side.
#[derive(Clone, Debug)]
pub struct BarPair<'a> {
    /// Label of the pair.
    pub name: &'a str,
    /// Value, lower and upper end of its interval, for both.
    pub values: [[f64; 3]; 2],
}

/// Points of two results.
#[derive(Clone, Debug, Default)]
pub struct ScatterPlot<'a> {
    /// Label of the horizontal axis.
    pub x_label: &'a str,
    /// Label of the vertical axis.
    pub y_label: &'a str,
    /// All points.
    pub points: &'a [[f64; 2]],
    /// Points that are connected and marked.
    pub front: &'a [[f64; 2]],
    /// A point with a stronger mark.
    pub best: Option<[f64; 2]>,
}

/// Line spacing of labels (pixels).
pub(crate) const LEADING: u32 = 14;
/// Height of a panel of effects.
const PANEL: u32 = 134;
/// Space for numbers on the left and below (pixels).
const MARGIN: [u32; 2] = [52, 22];
/// Number of bars of a histogram behind a name.
const BINS: usize = 14;
const BIN: RGBColor = RGBColor(201, 214, 228);

/// Splits a label into lines of at most `most` letters, after dots, underscores and blanks where
/// possible. No letter is dropped: names that differ in one letter stay different.
#[doc(hidden)]
pub fn wrapped(label: &str, most: usize) -> Vec<String> {
    let most = most.max(8);
    let mut lines: Vec<Vec<char>> = vec![Vec::new()];
    for piece in label.split_inclusive(['.', '_', ' ', '-', '[']) {
        let piece: Vec<char> = piece.chars().collect();
        let last = lines.len() - 1;
        match lines[last].len() + piece.len() <= most {
            true => lines[last].extend(piece),
            false => lines.extend(piece.chunks(most).map(<[char]>::to_vec)),
        }
    }
    lines.into_iter().filter(|line| !line.is_empty()).map(String::from_iter).collect()
}

/// Draws lines centred at a position, one below the other; or rotated upwards, one to the right of
/// the other.
pub(crate) fn draw_lines(
    area: &Area<'_>,
    (x, y): (u32, u32),
    lines: &[String],
    upright: bool,
) -> Result<(), PlotError> {
    let style = TextStyle::from(("sans-serif", 14)).pos(Pos::new(HPos::Center, VPos::Top));
    let style = if upright { style.transform(FontTransform::Rotate270) } else { style };
    for (line, k) in lines.iter().zip(0..) {
        let (right, down) = if upright { (LEADING * k, 0) } else { (0, LEADING * k) };
        area.draw(&Text::new(line.as_str(), ((x + right) as i32, (y + down) as i32), style.clone()))?;
    }
    Ok(())
}

/// Returns the minimum and maximum of the finite numbers, with a margin.
#[doc(hidden)]
pub fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    let (span, size) = (high - low, low.abs().max(high.abs()).max(1e-12));
    let margin = if span > 1e-9 * size { 0.05 * span } else { 0.5 * size };
    low - margin..high + margin
}

/// Draws main effects in rows of panels, one row per result; the panels of a row share their
/// vertical scale.
pub fn effects(rows: &[Vec<EffectPanel<'_>>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0).max(1) as u32;
    let width = (900 / columns).clamp(150, 320);
    let below = |panel: &EffectPanel<'_>| wrapped(panel.x_label, (width / 7) as usize);
    let beside = |panel: &EffectPanel<'_>| wrapped(panel.y_label, (PANEL / 7) as usize);
    let most = |lines: &dyn Fn(&EffectPanel<'_>) -> Vec<String>| {
        LEADING * rows.iter().flatten().map(|panel| lines(panel).len()).max().unwrap_or(1) as u32
    };
    let (left, height) = (most(&beside) + 4, 12 + PANEL + MARGIN[1] + most(&below));
    let color = ink(palette::series(0, Ground::Paper));
    // A line through the means with their standard errors, labels below and on the left.
    let draw = |area: &Area<'_>| {
        for (row, panels) in (0..).zip(rows) {
            let top = 12 + height * row;
            let y = range(panels.iter().flat_map(|panel| panel.points.iter().flat_map(|p| [p[1] - p[2], p[1] + p[2]])));
            for (column, panel) in (0..).zip(panels) {
                let part = area.clone().shrink((left + width * column, top), (width - 14, PANEL + MARGIN[1]));
                let x = range(panel.points.iter().map(|p| p[0]));
                let mut chart = axes(&part, Axes { ranges: [x, y.clone()], margin: MARGIN, ..Axes::default() })?;
                let points = panel.points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
                chart.draw_series(LineSeries::new(points.clone().map(|p| (p[0], p[1])), color.stroke_width(2)))?;
                let interval = |[x, mean, error]: &[f64; 3]| {
                    ErrorBar::new_vertical(*x, mean - error, *mean, mean + error, color.filled(), 6)
                };
                chart.draw_series(points.map(interval))?;
                let middle = left + width * column + (width - 14) / 2;
                draw_lines(area, (middle, top + PANEL + MARGIN[1]), &below(panel), false)?;
                if column == 0 {
                    draw_lines(area, (0, top + PANEL / 2), &beside(panel), true)?;
                }
            }
        }
        Ok(())
    };
    // Writing to a string does not fail; nor below.
    picture((left + width * columns, height * (rows.len() as u32).max(1)), draw).unwrap_or_default()
}

/// Draws pairs of bars with intervals.
///
/// * `names`: names of the two bars.
pub fn bar_pairs(title: &str, names: [&str; 2], pairs: &[BarPair<'_>]) -> String {
    let labels: Vec<String> = pairs.iter().map(|pair| pair.name.to_owned()).collect();
    let longest = labels.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let (left, top, width) = ((7 * longest as u32 + 20).max(230), 52, 480);
    let height = 40 * pairs.len().max(1) as u32;
    let high = pairs.iter().flat_map(|pair| pair.values.map(|v| v[2])).fold(1.0, f64::max);
    let low = pairs.iter().flat_map(|pair| pair.values.map(|v| v[1])).fold(0.0, f64::min);
    let inks = [0, 1].map(|k| ink(palette::series(k, Ground::Paper)));
    let draw = |area: &Area<'_>| {
        area.draw(&Text::new(title, (12, 6), ("sans-serif", 18)))?;
        for ((name, ink), x) in names.into_iter().zip(inks).zip([left as i32, left as i32 + 150]) {
            area.draw(&Rectangle::new([(x, 30), (x + 14, 42)], ink.filled()))?;
            area.draw(&Text::new(name, (x + 20, 30), ("sans-serif", 15)))?;
        }
        // The first pair is at the top.
        let ranges = [low..high, pairs.len().max(1) as f64 - 0.5..-0.5];
        let part = area.clone().shrink((0, top), (left + width, height + MARGIN[1]));
        let mut chart = axes(&part, Axes { ranges, margin: [left, MARGIN[1]], names: [None, Some(&labels)] })?;
        for (row, pair) in pairs.iter().enumerate() {
            for ((k, [value, from, to]), ink) in pair.values.into_iter().enumerate().zip(inks) {
                let y = row as f64 + 0.375 * (k as f64 - 0.5);
                let bar = Rectangle::new([(0.0, y - 0.165), (value, y + 0.165)], ink.mix(0.75).filled());
                chart.draw_series([bar])?;
                chart.draw_series([ErrorBar::new_horizontal(y, from, value, to, BLACK.filled(), 6)])?;
            }
        }
        Ok(())
    };
    picture((left + width + 30, top + height + MARGIN[1] + 6), draw).unwrap_or_default()
}

impl ScatterPlot<'_> {
    /// Returns the picture as SVG.
    pub fn svg(&self) -> String {
        self.draw().unwrap_or_default()
    }

    fn draw(&self) -> Result<String, PlotError> {
        let all = || self.points.iter().chain(self.front);
        let ranges = [range(all().map(|p| p[0])), range(all().map(|p| p[1]))];
        let [grey, color] = [palette::rigid(Ground::Paper), palette::series(1, Ground::Paper)].map(ink);
        picture((730, 420), |area| {
            let part = area.clone().shrink((22, 14), (690, 382));
            let mut chart = axes(&part, Axes { ranges, margin: MARGIN, ..Axes::default() })?;
            chart.draw_series(dots(self.points, 2, grey.mix(0.5).filled()))?;
            chart.draw_series(LineSeries::new(finite(self.front), color.stroke_width(2)))?;
            chart.draw_series(dots(self.front, 4, color.filled()))?;
            chart.draw_series(self.best.map(|best| Circle::new((best[0], best[1]), 8, BLACK.stroke_width(2))))?;
            draw_lines(area, (393, 398), &[self.x_label.to_owned()], false)?;
            draw_lines(area, (4, 194), &[self.y_label.to_owned()], true)
        })
    }
}

fn finite(points: &[[f64; 2]]) -> impl Iterator<Item = (f64, f64)> {
    points.iter().filter(|p| p.iter().all(|x| x.is_finite())).map(|p| (p[0], p[1]))
}

fn dots(points: &[[f64; 2]], radius: u32, style: ShapeStyle) -> impl Iterator<Item = Circle<(f64, f64), u32>> {
    finite(points).map(move |point| Circle::new(point, radius, style))
}

/// Draws every column against every other one: points below the diagonal, rank correlations above
/// it, histograms on it.
///
/// * `columns`: name and values, of equal length.
pub fn scatter_matrix(columns: &[(&str, &[f64])]) -> String {
    let n = columns.len().max(1) as u32;
    let cell = (900 / n).clamp(70, 170);
    let color = ink(palette::series(0, Ground::Paper));
    let draw = |area: &Area<'_>| {
        for (row, (_, y)) in columns.iter().enumerate() {
            for (column, (name, x)) in columns.iter().enumerate() {
                let [left, top] = [column, row].map(|k| 8 + cell * k as u32);
                let part = area.clone().shrink((left, top), (cell - 4, cell - 4));
                let middle = (cell / 2) as i32 - 2;
                match column.cmp(&row) {
                    // Points of the column over those of the row.
                    Ordering::Less => {
                        let ranges = (range(x.iter().copied()), range(y.iter().copied()));
                        let mut chart = ChartBuilder::on(&part).build_cartesian_2d(ranges.0, ranges.1)?;
                        let points: Vec<[f64; 2]> = x.iter().zip(*y).map(|(x, y)| [*x, *y]).collect();
                        chart.draw_series(dots(&points, 1, color.mix(0.6).filled()))?;
                    }
                    // Histogram behind the name, with space for it.
                    Ordering::Equal => {
                        let (range, bars) = (range(x.iter().copied()), bars(x, range(x.iter().copied()), BINS));
                        let most = bars.iter().map(|[_, (_, count)]| *count).fold(1.0, f64::max);
                        let mut chart = ChartBuilder::on(&part).build_cartesian_2d(range, 0.0..most / 0.75)?;
                        chart.draw_series(bars.into_iter().map(|bar| Rectangle::new(bar, BIN.filled())))?;
                        draw_lines(&part, (cell / 2 - 2, 4), &wrapped(name, (cell / 7) as usize), false)?;
                    }
                    // Rank correlation, larger where it is stronger.
                    Ordering::Greater => {
                        let rank = rank_correlation(x, y);
                        let font = ("sans-serif", 12 + (12.0 * rank.abs()) as i32).into_font();
                        let style = TextStyle::from(font).pos(Pos::new(HPos::Center, VPos::Center));
                        let number = if rank.is_finite() { format!("{rank:.2}") } else { String::new() };
                        part.draw(&Text::new(number, (middle, middle), style))?;
                    }
                }
                let end = (cell - 5) as i32;
                part.draw(&Rectangle::new([(0, 0), (end, end)], MARK.mix(0.4)))?;
            }
        }
        Ok(())
    };
    picture((cell * n + 12, cell * n + 12), draw).unwrap_or_default()
}

/// Draws a histogram; empty if no number is finite.
///
/// * `label`: name and unit of the numbers.
pub fn histogram(label: &str, values: &[f64], bins: usize) -> String {
    if !values.iter().any(|x| x.is_finite()) {
        return String::new();
    }
    let range = range(values.iter().copied());
    let bars = bars(values, range.clone(), bins);
    let most = bars.iter().map(|[_, (_, count)]| *count).fold(1.0, f64::max);
    let draw = |area: &Area<'_>| {
        let part = area.clone().shrink((0, 8), (400, 120 + MARGIN[1]));
        let mut chart = axes(&part, Axes { ranges: [range, 0.0..most], margin: MARGIN, ..Axes::default() })?;
        let color = ink(palette::series(0, Ground::Paper));
        chart.draw_series(bars.into_iter().map(|bar| Rectangle::new(bar, color.filled())))?;
        draw_lines(area, (226, 130 + MARGIN[1]), &[label.to_owned()], false)
    };
    picture((420, 150 + MARGIN[1]), draw).unwrap_or_default()
}

/// Returns two opposite corners of each bar of a histogram.
#[doc(hidden)]
pub fn bars(values: &[f64], range: Range<f64>, bins: usize) -> Vec<[(f64, f64); 2]> {
    let width = (range.end - range.start) / bins as f64;
    let mut counts = vec![0_usize; bins];
    for x in values.iter().filter(|x| x.is_finite()) {
        counts[(((x - range.start) / width) as usize).min(bins - 1)] += 1;
    }
    let edge = |k: usize| range.start + width * k as f64;
    counts.iter().enumerate().map(|(k, count)| [(edge(k), 0.0), (edge(k + 1), *count as f64)]).collect()
}

/// Computes Spearman's rank correlation, from -1 to 1, of the pairs that are finite; NaN if one of
/// the two is constant. Equal values share their mean rank.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let pairs: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
    let (a, b) = (ranks(&a), ranks(&b));
    let mean = (a.len() as f64 - 1.0) / 2.0;
    let sum = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>();
    let (xy, xx, yy) =
        (sum(&|k| (a[k] - mean) * (b[k] - mean)), sum(&|k| (a[k] - mean).powi(2)), sum(&|k| (b[k] - mean).powi(2)));
    xy / (xx * yy).sqrt()
}

/// Ranks in ascending order; equal values share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|i, j| values[*i].total_cmp(&values[*j]));
    let mut ranks = vec![0.0; values.len()];
    let mut place = 0.0;
    for equal in order.chunk_by(|i, j| values[*i] == values[*j]) {
        let mean = place + 0.5 * (equal.len() as f64 - 1.0);
        equal.iter().for_each(|k| ranks[*k] = mean);
        place += equal.len() as f64;
    }
    ranks
}
