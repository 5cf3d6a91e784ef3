//! One panel: axes, bands, marks and curves.
//!
//! Start at [`Frame::draw`]; what is drawn first lies below.
//! Not here: ranges of the axes ([`super::ranges`]), names of the curves ([`super::legend`]).

use std::ops::Range;

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use crate::plot::curve::{CurveLook, Panel, PlotCurve};
use crate::plot::legend::{dot_radius, style_of};
use crate::plot::style::Style;
use crate::plot::svg::{Area, Chart, MARK, PlotError, plain};

/// Background colour of highlighted intervals, such as moves.
const BAND: RGBColor = RGBColor(234, 241, 247);

pub(super) struct Frame<'a> {
    pub(super) x_label: &'a str,
    pub(super) panel: &'a Panel,
    pub(super) points: &'a [Vec<(f64, f64)>],
    /// Curves of all panels, in the order of their colours.
    pub(super) all: &'a [&'a PlotCurve],
    pub(super) bands: &'a [(f64, f64)],
    pub(super) marks: &'a [(f64, String)],
    /// Whether the marks are named in this panel.
    pub(super) named: bool,
    pub(super) ranges: (Range<f64>, Range<f64>),
    pub(super) style: &'a Style,
}

impl Frame<'_> {
    /// Draws the panel; `x` and `y` are the ranges of [`Frame::ranges`], linear or logarithmic.
    pub(super) fn draw<X, Y>(&self, area: &Area<'_>, x: X, y: Y) -> Result<(), PlotError>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
        Y::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
    {
        // The area of the chart, with space for numbers.
        let style = self.style;
        let mut chart = ChartBuilder::on(area);
        chart
            .margin(style.margin)
            .margin_right(2 * style.margin)
            .x_label_area_size(style.x_area)
            .y_label_area_size(style.y_area);
        let mut chart = chart.build_cartesian_2d(x, y)?;
        // Bands, then grid and axes over them.
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
        // Marks, then curves with their dots.
        self.draw_marks(&mut chart)?;
        for (curve, points) in self.panel.curves.iter().zip(self.points) {
            let shape = style_of(curve, self.all, style);
            if curve.look.is_dashed() {
                let (dash, gap) = (6 * style.stroke, 4 * style.stroke);
                let dashes = DashedLineSeries::new(points.iter().copied(), dash, gap, shape);
                chart.draw_series(dashes)?;
            } else if curve.look != CurveLook::Dots {
                chart.draw_series(LineSeries::new(points.iter().copied(), shape))?;
            }
            if matches!(curve.look, CurveLook::Dots | CurveLook::Marked) {
                let dots = points.iter().map(|point| Circle::new(*point, dot_radius(style), shape.filled()));
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
                let shape = ("sans-serif", font).into_font().color(&MARK);
                let text = EmptyElement::at((*x, up.end)) + Text::new(name.clone(), (3, 2), shape);
                chart.draw_series(std::iter::once(text))?;
                free = left + 6 + name.chars().count() as i32 * font * 6 / 10;
            }
        }
        Ok(())
    }
}
