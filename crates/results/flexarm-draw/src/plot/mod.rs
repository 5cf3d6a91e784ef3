//! Curves over a common axis as a picture (SVG): stacked panels with a legend.
//!
//! Start at [`LinePlot`] for the screen, [`paper_plot`] for a column of a paper. All SVG pictures
//! of the crate are drawn by `plotters` with only its SVG backend: no fonts, no files, no clock.
//! They share [`picture`], [`axes`] and [`plain`].

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

use crate::palette::{self, Ground, Rgb};

/// Maximum ratio of the highest to the lowest value of a logarithmic panel.
const MOST_DECADES: f64 = 1e8;
/// Colour of marks across a panel.
pub(crate) const MARK: RGBColor = RGBColor(140, 146, 156);
/// Background colour of highlighted intervals, such as moves.
const BAND: RGBColor = RGBColor(234, 241, 247);

/// Reason why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no plot: {0}")]
pub struct PlotError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PlotError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self(error.to_string())
    }
}

/// Style of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CurveLook {
    /// With its own colour.
    #[default]
    Plain,
    /// Black and slightly wider: the magnitude of the others.
    Total,
    /// With its own colour, dashed: the reference of a comparison.
    Dashed,
    /// With its own colour, a dot at each point: values measured or computed only there.
    Dots,
    /// Like [`CurveLook::Plain`], with a dot at each point.
    Marked,
    /// In the colour of axis x (0), y (1) or z (2).
    Axis(usize),
    /// In the colour of the link, spring or joint of this index.
    Part(usize),
    /// Dashed, in the grey of the rigid twin.
    Rigid,
}

impl CurveLook {
    fn is_dashed(self) -> bool {
        matches!(self, Self::Dashed | Self::Rigid)
    }

    /// Returns whether its colour is the next one in the order of the plot.
    fn is_counted(self) -> bool {
        matches!(self, Self::Plain | Self::Dashed | Self::Dots | Self::Marked)
    }
}

/// A curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotCurve {
    /// Name in the legend.
    pub name: String,
    /// Style.
    pub look: CurveLook,
    /// Abscissae, ascending.
    pub x: Vec<f64>,
    /// Ordinates, one per x.
    pub y: Vec<f64>,
}

/// Curves that share a vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Label of the vertical axis.
    pub label: String,
    /// Whether the vertical axis is logarithmic; values that are not positive are left out.
    pub logarithmic: bool,
    /// Whether its curves are named in a legend.
    pub legend: bool,
    /// Curves; those with the same name have the same colour in all panels.
    pub curves: Vec<PlotCurve>,
}

/// Sizes in units of the picture.
#[derive(Clone, Copy, Debug)]
struct Style {
    panel: (u32, u32),
    margin: u32,
    x_area: u32,
    y_area: u32,
    title: u32,
    font: u32,
    legend_font: u32,
    stroke: u32,
    /// Width of the picture on paper (mm); if `None`, units are pixels.
    width_mm: Option<f64>,
    x_labels: usize,
    /// Whether both axes have the same scale.
    equal: bool,
}

const SCREEN: Style = Style {
    panel: (960, 340),
    margin: 12,
    x_area: 36,
    y_area: 72,
    title: 18,
    font: 13,
    legend_font: 13,
    stroke: 2,
    width_mm: None,
    x_labels: 11,
    equal: false,
};

/// A picture between paragraphs, 960 browser pixels in half-pixel units.
const PAGE: Style = Style {
    panel: (1920, 660),
    margin: 24,
    x_area: 88,
    y_area: 168,
    title: 36,
    font: 30,
    legend_font: 30,
    stroke: 4,
    width_mm: Some(254.0),
    x_labels: 11,
    equal: false,
};

/// A column of a paper, 88 mm, in twelfths of a millimetre: text of 8 points, lines of 0.3 mm.
const COLUMN: Style = Style {
    panel: (1056, 560),
    margin: 14,
    x_area: 84,
    y_area: 132,
    title: 36,
    font: 33,
    legend_font: 31,
    stroke: 4,
    width_mm: Some(88.0),
    x_labels: 8,
    equal: false,
};

/// A plan: both axes have the same scale.
const PLAN: Style = Style { panel: (1920, 1300), equal: true, ..PAGE };

/// Panels over a common horizontal axis, for the screen. Curves are named above the panels, where
/// the names hide nothing.
#[derive(Clone, Debug, Default)]
pub struct LinePlot<'a> {
    /// Title.
    pub title: &'a str,
    /// Notes below the title, one per line, in smaller letters.
    pub notes: &'a [String],
    /// Label of the horizontal axis.
    pub x_label: &'a str,
    /// Whether the horizontal axis is logarithmic, if possible.
    pub logarithmic_x: bool,
    /// Positions on the horizontal axis that are marked in every panel, with a name in the first.
    pub marks: &'a [(f64, String)],
    /// Panels, from top to bottom.
    pub panels: &'a [Panel],
}

impl LinePlot<'_> {
    /// Returns the text of an SVG file.
    ///
    /// # Errors
    /// [`PlotError`] if there is nothing finite to draw.
    pub fn svg(&self) -> Result<String, PlotError> {
        plot(self, &[], &SCREEN)
    }
}

/// Draws panels in the size of a column of a two-column paper (88 mm, text of 8 points), without a
/// title, which belongs in the caption. Curves are named above the panels; `bands` are intervals of
/// the horizontal axis to be tinted. SVG.
/// horizontal axis to be tinted. SVG.
///
/// Those of [`LinePlot::svg`].
/// As [`LinePlot::svg`].
pub fn paper_plot(x_label: &str, panels: &[Panel], bands: &[(f64, f64)]) -> Result<String, PlotError> {
    plot(&LinePlot { x_label, panels, ..LinePlot::default() }, bands, &COLUMN)
}

/// Draws stacked panels for a page of text, 960 pixels wide, with curve names above them, as SVG.
///
/// # Errors
/// Those of [`LinePlot::svg`].
pub fn page_plot(x_label: &str, logarithmic_x: bool, panels: &[Panel]) -> Result<String, PlotError> {
    plot(&LinePlot { x_label, logarithmic_x, panels, ..LinePlot::default() }, &[], &PAGE)
}

/// Draws a plan for a page of text: one panel with the same scale on both axes and curves of any
/// shape, named above it. SVG.
///
/// # Errors
/// Those of [`LinePlot::svg`].
pub fn plan_plot(x_label: &str, panel: &Panel) -> Result<String, PlotError> {
    plot(&LinePlot { x_label, panels: std::slice::from_ref(panel), ..LinePlot::default() }, &[], &PLAN)
}

/// A picture or a part of it.
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Creates an SVG picture on white with the given size in pixels.
pub(crate) fn picture(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    area.fill(&WHITE)?;
    draw(&area)?;
    area.present()?;
    drop(area);
    // The stroke width of an absent stroke is removed: pages with many dots become a third smaller.
    let text = text.replace(" stroke=\"none\" stroke-width=\"1\"", "");
    // The drawing library escapes markup, not control characters.
    Ok(flexarm_settings::written::visible(&text))
}

/// Axes of a chart.
#[derive(Clone, Debug, Default)]
pub(crate) struct Axes<'a> {
    /// From left to right and from bottom to top; from top to bottom if the end is smaller.
    pub(crate) ranges: [Range<f64>; 2],
    /// Space for numbers on the left and below (pixels).
    pub(crate) room: [u32; 2],
    /// Names at 0, 1, 2, ... instead of numbers.
    pub(crate) names: [Option<&'a [String]>; 2],
}

/// Draws a chart with its axes, and grid lines at their numbers.
pub(crate) fn axes<'a, 'b>(
    area: &Area<'b>,
    Axes { ranges: [x, y], room: [left, below], names }: Axes<'_>,
) -> Result<Chart<'a, 'b, RangedCoordf64, RangedCoordf64>, PlotError> {
    let (width, height) = area.dim_in_pixel();
    let mut chart = ChartBuilder::on(area).y_label_area_size(left).x_label_area_size(below).build_cartesian_2d(x, y)?;
    let at = |k: usize, x: f64| match names[k] {
        None => plain(x),
        Some(names) if (x - x.round()).abs() < 1e-6 => names.get(x.round() as usize).cloned().unwrap_or_default(),
        Some(_) => String::new(),
    };
    // At most as many labels as there is space for.
    let most = |k: usize, room: usize| match names[k] {
        None => (room / 40).max(3),
        Some(names) => (room / [44, 14][k]).clamp(1, names.len().max(1)),
    };
    chart
        .configure_mesh()
        .label_style(("sans-serif", 13))
        .axis_style(MARK)
        .light_line_style(TRANSPARENT)
        .set_all_tick_mark_size(3)
        .x_labels(most(0, (width - left) as usize))
        .y_labels(most(1, (height - below) as usize))
        .x_label_formatter(&|x| at(0, *x))
        .y_label_formatter(&|y| at(1, *y))
        .draw()?;
    Ok(chart)
}

fn plot(what: &LinePlot<'_>, bands: &[(f64, f64)], style: &Style) -> Result<String, PlotError> {
    let panels = what.panels;
    let mut curves: Vec<&PlotCurve> = Vec::new();
    for curve in panels.iter().flat_map(|panel| &panel.curves) {
        if !curves.iter().any(|known| known.name == curve.name) {
            curves.push(curve);
        }
    }
    let legend = if panels.iter().any(|p| p.legend) { legend_rows(&curves, style) } else { Vec::new() };
    let row = style.legend_font * 3 / 2;
    let above_legend = heading_height(what, style);
    let above = above_legend + if legend.is_empty() { 0 } else { row * legend.len() as u32 + style.margin };
    let (width, height) = (style.panel.0, style.panel.1 * panels.len().max(1) as u32 + above);
    let mut text = picture((width, height), |area| {
        let (strip, area) = area.split_vertically(above);
        let (heading, strip) = strip.split_vertically(above_legend);
        draw_heading(&heading, what, style)?;
        draw_legend(&strip, &legend, &curves, style)?;
        for (k, (panel, part)) in panels.iter().zip(area.split_evenly((panels.len(), 1))).enumerate() {
            let x_label = if k + 1 == panels.len() { what.x_label } else { "" };
            let points = points(panel);
            let ranges = ranges(&points, panel.logarithmic)
                .ok_or_else(|| PlotError(format!("{:?} has nothing finite to draw", panel.label)))?;
            let ranges = if style.equal { equally_long(ranges, style) } else { ranges };
            let (x, y) = ranges.clone();
            let (marks, named) = (what.marks, k == 0);
            let frame = Frame { x_label, panel, points: &points, all: &curves, bands, marks, named, ranges, style };
            match (what.logarithmic_x && x.start > 0.0, panel.logarithmic) {
                (true, true) => frame.draw(&part, x.log_scale(), y.log_scale()),
                (true, false) => frame.draw(&part, x.log_scale(), y),
                (false, true) => frame.draw(&part, x, y.log_scale()),
                (false, false) => frame.draw(&part, x, y),
            }?;
        }
        Ok(())
    })?;
    if let Some(mm) = style.width_mm {
        let high = mm * f64::from(height) / f64::from(width);
        let (old, new) =
            (format!("width=\"{width}\" height=\"{height}\""), format!("width=\"{mm}mm\" height=\"{high:.2}mm\""));
        text = text.replacen(&old, &new, 1);
    }
    Ok(text)
}

/// Height of the title and the notes below it.
fn heading_height(what: &LinePlot<'_>, style: &Style) -> u32 {
    match (what.title.is_empty(), what.notes.len() as u32) {
        (true, 0) => 0,
        (_, notes) => style.margin + style.title * 3 / 2 + notes * style.legend_font * 3 / 2,
    }
}

fn draw_heading(area: &Area<'_>, what: &LinePlot<'_>, style: &Style) -> Result<(), PlotError> {
    if heading_height(what, style) == 0 {
        return Ok(());
    }
    let (x, mut y) = ((style.y_area + style.margin) as i32, style.margin as i32);
    let title = ("sans-serif", style.title as i32).into_font().style(FontStyle::Bold);
    area.draw(&Text::new(what.title, (x, y), title))?;
    y += style.title as i32 * 3 / 2;
    for note in what.notes {
        area.draw(&Text::new(note.as_str(), (x, y), ("sans-serif", style.legend_font as i32)))?;
        y += style.legend_font as i32 * 3 / 2;
    }
    Ok(())
}

/// Returns the drawable points of each curve.
fn points(panel: &Panel) -> Vec<Vec<(f64, f64)>> {
    let good = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite() && (*y > 0.0 || !panel.logarithmic);
    panel.curves.iter().map(|c| c.x.iter().copied().zip(c.y.iter().copied()).filter(good).collect()).collect()
}

/// Returns the ranges of the axes, with a margin.
fn ranges(points: &[Vec<(f64, f64)>], logarithmic: bool) -> Option<(Range<f64>, Range<f64>)> {
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
        0.7 * low.max(high / MOST_DECADES)..1.5 * high
    } else {
        let room = 0.05 * (high - low).max(1e-9 * high.abs()).max(1e-12);
        low - room..high + room
    };
    Some((x_low..if x_high > x_low { x_high } else { x_low + 1.0 }, y))
}

/// Widens the ranges around their centres until both axes have the same scale, with a margin.
fn equally_long((x, y): (Range<f64>, Range<f64>), style: &Style) -> (Range<f64>, Range<f64>) {
    let wide = f64::from(style.panel.0 - 3 * style.margin - style.y_area);
    let high = f64::from(style.panel.1 - 2 * style.margin - style.x_area);
    let unit = 1.05 * ((x.end - x.start) / wide).max((y.end - y.start) / high);
    let around = |range: Range<f64>, pixels: f64| {
        let (middle, half) = (0.5 * (range.start + range.end), 0.5 * unit * pixels);
        middle - half..middle + half
    };
    (around(x, wide), around(y, high))
}

/// Converts a colour of the palette.
pub(crate) fn ink([red, green, blue]: Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

/// Returns colour and width of a curve; curves with the same name look the same in all panels.
fn look_of(curve: &PlotCurve, all: &[&PlotCurve], style: &Style) -> ShapeStyle {
    match curve.look {
        CurveLook::Total => BLACK.stroke_width(style.stroke + style.stroke / 3),
        CurveLook::Axis(k) => ink(palette::axis(k, Ground::Paper)).stroke_width(style.stroke),
        CurveLook::Part(k) => ink(palette::series(k, Ground::Paper)).stroke_width(style.stroke),
        CurveLook::Rigid => ink(palette::rigid(Ground::Paper)).stroke_width(style.stroke),
        _ => {
            let place = all.iter().filter(|known| known.look.is_counted()).position(|known| known.name == curve.name);
            ink(palette::series(place.unwrap_or(0), Ground::Paper)).stroke_width(style.stroke)
        }
    }
}

/// Returns the layout of the names above the panels: curve and distance from the left, row by row.
fn legend_rows(curves: &[&PlotCurve], style: &Style) -> Vec<Vec<(usize, u32)>> {
    let mut rows = vec![Vec::new()];
    let first = style.y_area + style.margin;
    let mut x = first;
    for (k, curve) in curves.iter().enumerate() {
        // Without fonts the width of a name is estimated: slightly more than half its height per
        // letter.
        let width = swatch(style) + curve.name.chars().count() as u32 * style.legend_font * 6 / 10 + style.legend_font;
        if x > first && x + width > style.panel.0 {
            rows.push(Vec::new());
            x = first;
        }
        if let Some(row) = rows.last_mut() {
            row.push((k, x));
        }
        x += width;
    }
    rows
}

fn dot_radius(style: &Style) -> u32 {
    2 * style.stroke
}

/// Length of the line next to a name in the legend, with its gap.
fn swatch(style: &Style) -> u32 {
    2 * style.legend_font
}

fn draw_legend(
    strip: &Area<'_>,
    rows: &[Vec<(usize, u32)>],
    curves: &[&PlotCurve],
    style: &Style,
) -> Result<(), PlotError> {
    let font = style.legend_font as i32;
    for (row, places) in rows.iter().enumerate() {
        let y = style.margin as i32 + row as i32 * font * 3 / 2;
        for (k, x) in places {
            let (curve, x, look) = (curves[*k], *x as i32, look_of(curves[*k], curves, style));
            let (from, middle, to) = (x, y + font / 2, x + font * 3 / 2);
            let cut = (to - from) / 3;
            let lines = match curve.look {
                CurveLook::Dots => {
                    let dot = Circle::new(((from + to) / 2, middle), dot_radius(style), look.filled());
                    strip.draw(&dot)?;
                    vec![]
                }
                look if look.is_dashed() => vec![(from, from + cut), (to - cut, to)],
                _ => vec![(from, to)],
            };
            for (a, b) in lines {
                strip.draw(&PathElement::new([(a, middle), (b, middle)], look))?;
            }
            let place = (x + swatch(style) as i32 - font / 6, y);
            strip.draw(&Text::new(curve.name.clone(), place, ("sans-serif", font)))?;
        }
    }
    Ok(())
}

struct Frame<'a> {
    x_label: &'a str,
    panel: &'a Panel,
    points: &'a [Vec<(f64, f64)>],
    /// Curves of all panels, in the order of their colours.
    all: &'a [&'a PlotCurve],
    bands: &'a [(f64, f64)],
    marks: &'a [(f64, String)],
    /// Whether the marks are named in this panel.
    named: bool,
    ranges: (Range<f64>, Range<f64>),
    style: &'a Style,
}

impl Frame<'_> {
    fn draw<X, Y>(&self, area: &Area<'_>, x: X, y: Y) -> Result<(), PlotError>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
        Y::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
    {
        let style = self.style;
        let mut chart = ChartBuilder::on(area);
        chart
            .margin(style.margin)
            .margin_right(2 * style.margin)
            .x_label_area_size(style.x_area)
            .y_label_area_size(style.y_area);
        let mut chart = chart.build_cartesian_2d(x, y)?;
        let (across, up) = &self.ranges;
        let bands = self.bands.iter().filter(|(from, to)| *to > across.start && *from < across.end);
        let corners = |(from, to): &(f64, f64)| [(from.max(across.start), up.start), (to.min(across.end), up.end)];
        chart.draw_series(bands.map(|band| Rectangle::new(corners(band), BAND.filled())))?;
        chart
            .configure_mesh()
            .x_desc(self.x_label)
            .y_desc(&self.panel.label)
            .label_style(("sans-serif", style.font))
            .light_line_style(RGBColor(240, 240, 240))
            .x_labels(style.x_labels)
            .y_max_light_lines(4)
            .x_label_formatter(&|x| plain(*x))
            .y_label_formatter(&|y| plain(*y))
            .draw()?;
        self.draw_marks(&mut chart)?;
        for (curve, points) in self.panel.curves.iter().zip(self.points) {
            let look = look_of(curve, self.all, style);
            if curve.look.is_dashed() {
                let (dash, gap) = (6 * style.stroke, 4 * style.stroke);
                let dashes = DashedLineSeries::new(points.iter().copied(), dash, gap, look);
                chart.draw_series(dashes)?;
            } else if curve.look != CurveLook::Dots {
                chart.draw_series(LineSeries::new(points.iter().copied(), look))?;
            }
            if matches!(curve.look, CurveLook::Dots | CurveLook::Marked) {
                let dots = points.iter().map(|point| Circle::new(*point, dot_radius(style), look.filled()));
                chart.draw_series(dots)?;
            }
        }
        Ok(())
    }

    /// Draws dashed lines across the panel; names that would overlap are left out.
    fn draw_marks<X, Y>(&self, chart: &mut Chart<'_, '_, X, Y>) -> Result<(), PlotError>
    where
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let (across, up) = &self.ranges;
        let (style, font) = (self.style, self.style.legend_font as i32);
        let mut free = i32::MIN;
        for (x, name) in self.marks.iter().filter(|(x, _)| across.contains(x)) {
            let line = [(*x, up.start), (*x, up.end)];
            let (dash, gap) = (2 * style.stroke, 2 * style.stroke);
            chart.draw_series(DashedLineSeries::new(line, dash, gap, MARK.stroke_width(1)))?;
            let (left, _) = chart.backend_coord(&(*x, up.end));
            if self.named && left >= free {
                let look = ("sans-serif", font).into_font().color(&MARK);
                let text = EmptyElement::at((*x, up.end)) + Text::new(name.clone(), (3, 2), look);
                chart.draw_series(std::iter::once(text))?;
                free = left + 6 + name.chars().count() as i32 * font * 6 / 10;
            }
        }
        Ok(())
    }
}

/// A chart of `plotters` as SVG.
pub(crate) type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;

/// Short format of a number on an axis.
pub(crate) fn plain(x: f64) -> String {
    match x.abs() {
        // Rounding residues of the axis are zeros.
        size if size < 1e-12 => "0".into(),
        size if (1e-2..1e5).contains(&size) => format!("{}", (x * 1e4).round() / 1e4),
        _ => format!("{:e}", three_digits(x)),
    }
}

/// Rounds to three significant digits.
pub(crate) fn three_digits(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, y: &[f64]) -> PlotCurve {
        PlotCurve {
            name: name.into(),
            x: (1..=y.len()).map(|k| k as f64).collect(),
            y: y.to_vec(),
            ..PlotCurve::default()
        }
    }

    #[test]
    fn curves_and_their_names_are_in_the_picture() {
        let panel =
            |label: &str, logarithmic, curves| Panel { label: label.into(), logarithmic, legend: logarithmic, curves };
        let panels = [
            panel("size", true, vec![curve("a < b", &[1.0, 1e-3, f64::NAN, 0.0])]),
            panel("angle", false, vec![curve("flat", &[2.0, 2.0])]),
        ];
        let marks = [(1.5, "f1".to_owned()), (1.501, "f2".to_owned()), (99.0, "f3".to_owned())];
        let notes = ["at rest".to_owned()];
        let (title, x_label) = ("all of it", "time");
        let plot = LinePlot { title, notes: &notes, x_label, logarithmic_x: true, marks: &marks, panels: &panels };
        let text = plot.svg().unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in ["all of it", "at rest", "time", "size", "angle", "a &lt; b", "f1"] {
            assert!(text.contains(word), "{word}");
        }
        // The second name would overlap the first, the third is beyond the axis.
        assert!(!text.contains("f2") && !text.contains("f3"));
        assert!(text.matches("<polyline").count() >= 2);
        assert_eq!(text, plot.svg().unwrap());
    }

    #[test]
    fn a_unit_is_as_long_on_both_axes_of_a_plan() {
        let (x, y) = equally_long((0.0..2.0, 5.0..6.0), &PLAN);
        let (wide, high) = (f64::from(PLAN.panel.0 - 72 - PLAN.y_area), f64::from(PLAN.panel.1 - 48 - PLAN.x_area));
        assert!(((x.end - x.start) / wide - (y.end - y.start) / high).abs() < 1e-15);
        assert!(x.start < 0.0 && x.end > 2.0 && y.start < 5.0 && y.end > 6.0);
        let curves = vec![PlotCurve { x: vec![0.0, 1.0, 0.0], y: vec![0.0, 1.0, 2.0], ..curve("path", &[]) }];
        let panel = Panel { label: "y (mm)".into(), logarithmic: false, legend: true, curves };
        assert!(plan_plot("x (mm)", &panel).unwrap().contains("y (mm)"));
    }

    #[test]
    fn numbers_on_axes_are_short_and_differ_where_they_do() {
        let texts = [0.6000000000000001, 50.0, -0.0, 0.0025, 3.2e-4, 1e-3, 250_000.0].map(plain);
        assert_eq!(texts, ["0.6", "50", "0", "2.5e-3", "3.2e-4", "1e-3", "2.5e5"]);
        assert_eq!([0.012_345, 1234.5].map(three_digits), [0.0123, 1230.0]);
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        let curves = vec![curve("a", &[0.0, f64::INFINITY])];
        let panel = Panel { label: "size".into(), logarithmic: true, legend: true, curves };
        let error = LinePlot { panels: &[panel], ..LinePlot::default() }.svg().unwrap_err();
        assert!(error.to_string().contains("nothing finite"), "{error}");
    }

    #[test]
    fn axes_have_their_colours_whatever_is_drawn_before_them() {
        let mut curves: Vec<PlotCurve> = ["a", "x", "b", "z"].map(|n| curve(n, &[1.0, 2.0])).into();
        (curves[1].look, curves[3].look) = (CurveLook::Axis(0), CurveLook::Axis(2));
        let panel = Panel { label: "error".into(), logarithmic: false, legend: true, curves };
        let text = paper_plot("", &[panel], &[]).unwrap();
        let colors = [palette::series(0, Ground::Paper), palette::series(1, Ground::Paper)].into_iter();
        for color in colors.chain([0, 2].map(|k| palette::axis(k, Ground::Paper))) {
            let hex = palette::hex(color).to_uppercase();
            assert_eq!(text.matches(&format!("stroke=\"{hex}\"")).count(), 2, "{hex}: the curve and its name");
        }
    }

    /// Truth: the width of a column, and the units of the picture per millimetre.
    #[test]
    fn a_figure_for_a_paper_has_the_width_of_a_column_and_names_above_its_panel() {
        let mut curves: Vec<PlotCurve> =
            ["size", "x", "a rather long name", "y", "z"].map(|n| curve(n, &[1.0, 2.0, 1.5])).into();
        (curves[0].look, curves[1].look) = (CurveLook::Total, CurveLook::Dashed);
        let panel = Panel { label: "error (mm)".into(), logarithmic: false, legend: true, curves };
        let text = paper_plot("time (s)", &[panel], &[(0.5, 1.5), (7.0, 8.0)]).unwrap();
        assert!(text.contains("width=\"88mm\"") && text.contains("viewBox=\"0 0 1056 "), "{}", &text[..200]);
        for word in ["size", "a rather long name", "error (mm)", "time (s)"] {
            assert!(text.contains(word), "{word}");
        }
        assert_eq!(text.matches("#EAF1F7").count(), 1, "one band is within the axis");
    }
}
