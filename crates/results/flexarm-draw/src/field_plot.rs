//! A quantity over a plane of cells as a picture (SVG): colours with scale, axes, marked points.
//!
//! Neighbouring cells of one colour in a row are drawn as one rectangle. Grids finer than the
//! picture are thinned to the maximum of the merged cells, so that a page with many maps stays
//! small. Start at [`FieldPlot`]. Not here: curves ([`crate::LinePlot`]), charts
//! ([`crate::charts`]).

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::charts::{LEADING, draw_lines, range, wrapped};
use crate::palette::magnitude;
use crate::plot::{Area, Axes, Chart, PlotError, axes, ink, picture, plain, three_digits};

/// Maximum number of cells along an axis of the picture.
const MAX_CELLS: usize = 120;
/// Number of shades of the scale.
const SHADES: u8 = 48;
/// Longest side of the field of cells (pixels), and sides of the field of named cells.
const FIELD: f64 = 300.0;
const NAMED_FIELD: [f64; 2] = [560.0, 360.0];
/// Space above and below the field for title and names, and on its right for the scale.
const TOP: u32 = 28;
const FOOT: u32 = 22;
const RIGHT: u32 = 78;
/// Colour of outlines.
const OUTLINE: RGBColor = RGBColor(200, 0, 60);
/// Colour of letters on a light colour, also where a page turns black into white.
const INK: RGBColor = RGBColor(20, 20, 20);

/// A quantity over a plane.
#[derive(Clone, Debug, Default)]
pub struct FieldPlot<'a> {
    /// Title above the picture.
    pub title: &'a str,
    /// Labels of the horizontal and vertical axis.
    pub labels: [&'a str; 2],
    /// Centres of the first and of the last cell along both axes.
    pub ranges: [[f64; 2]; 2],
    /// Number of cells along both axes.
    pub count: [usize; 2],
    /// One value per cell, along the horizontal axis first; NaN stays white.
    pub values: &'a [f64],
    /// Label of the scale.
    pub value_label: &'a str,
    /// Values at the first and last colour; if `None`, the range of the values.
    pub scale: Option<[f64; 2]>,
    /// Whether both axes have the same scale.
    pub equal: bool,
    /// Outlined rectangles: lower left and upper right corner.
    pub outlines: &'a [[[f64; 2]; 2]],
    /// Marked points, each with a letter.
    pub marks: &'a [([f64; 2], &'a str)],
    /// Names of columns and rows, instead of ranges and count. Values are written into the cells if
    /// there is space.
    pub names: Option<[&'a [String]; 2]>,
}

/// Drawn cells, along both axes.
struct Cells {
    /// Number of cells of the grid in a drawn one.
    every: [usize; 2],
    /// Number of drawn cells.
    shown: [usize; 2],
    /// Size of a drawn cell, lower edge of the first, and size of all, in units of the axis.
    step: [f64; 2],
    edge: [f64; 2],
    span: [f64; 2],
    /// Size of a drawn cell in pixels.
    pixels: [u32; 2],
}

impl FieldPlot<'_> {
    /// Returns the text of an SVG file; empty if there is no finite value.
    #[must_use]
    pub fn svg(&self) -> String {
        let finite = || self.values.iter().copied().filter(|x| x.is_finite());
        // Range of the scale, and cells by name with ranges of their own.
        let [low, high] = self
            .scale
            .unwrap_or_else(|| [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)]);
        let named = self.names.map_or_else(
            || self.clone(),
            |names| Self {
                count: names.map(<[String]>::len),
                ranges: names.map(|names| [0.0, names.len() as f64 - 1.0]),
                ..self.clone()
            },
        );
        if !(low.is_finite() && high.is_finite()) || named.count.contains(&0) {
            return String::new();
        }
        // Writing to a string does not fail.
        named.draw([low, high]).unwrap_or_default()
    }

    /// Sizes of the drawn cells.
    fn cells(&self) -> Cells {
        // A grid finer than the picture is thinned.
        let every = if self.names.is_some() { [1, 1] } else { self.count.map(|n| n.div_ceil(MAX_CELLS)) };
        let shown = [0, 1].map(|k| self.count[k].div_ceil(every[k]));
        let steps = [0, 1].map(|k| {
            let [first, last] = self.ranges[k];
            (self.count[k] > 1).then(|| (last - first) / (self.count[k] - 1) as f64)
        });
        // A single row has square cells.
        let step = [steps[0].or(steps[1]).unwrap_or(1.0), steps[1].or(steps[0]).unwrap_or(1.0)];
        let edge = [0, 1].map(|k| self.ranges[k][0] - 0.5 * step[k]);
        let step = [0, 1].map(|k| step[k] * every[k] as f64);
        let span = [0, 1].map(|k| step[k] * shown[k] as f64);
        // Each cell has a whole number of pixels.
        let field = [0, 1].map(|k| match self.names {
            Some(_) => NAMED_FIELD[k].clamp(14.0 * shown[k] as f64, [96.0, 120.0][k] * shown[k] as f64),
            None if self.equal => FIELD * span[k] / span[0].max(span[1]),
            None => FIELD,
        });
        let pixels = [0, 1].map(|k| (field[k] / shown[k] as f64).round().max(1.0) as u32);
        Cells { every, shown, step, edge, span, pixels }
    }

    fn draw(&self, scale: [f64; 2]) -> Result<String, PlotError> {
        let Cells { every, shown, step, edge, span, pixels } = self.cells();
        let [width, height] = [0, 1].map(|k| pixels[k] * shown[k] as u32);
        // Size of the picture with labels and scale.
        let x_label = wrapped(self.labels[0], (width + RIGHT) as usize / 7);
        let y_label = wrapped(self.labels[1], (height + FOOT) as usize / 7);
        let left = 52 + LEADING * y_label.len() as u32;
        // A long title must not overlap the scale.
        let right = left + width.max(8 * self.title.chars().count() as u32) + 14;
        let size = (right + RIGHT, TOP + height.max(80) + FOOT + LEADING * x_label.len() as u32 + 8);
        picture(size, |area| {
            area.draw(&Text::new(self.title, (left as i32, 6), ("sans-serif", 15).into_font().style(FontStyle::Bold)))?;
            // The last row and column of pixels belong to the ends of the axes.
            let part = area.clone().shrink((0, TOP), (left + width + 1, height + FOOT + 1));
            let ranges = [0, 1].map(|k| edge[k]..edge[k] + span[k]);
            let names = [0, 1].map(|k| self.names.map(|names| names[k]));
            let mut chart = axes(&part, Axes { ranges, margin: [left, FOOT], names })?;
            // Row by row: rectangles of one colour, then numbers in named cells.
            for j in 0..shown[1] {
                let largest: Vec<f64> = (0..shown[0]).map(|i| self.largest([i, j], every)).collect();
                let mut end = 0;
                for run in largest.chunk_by(|a, b| shade(*a, scale) == shade(*b, scale)) {
                    let at = |i: usize, j: usize| (edge[0] + step[0] * i as f64, edge[1] + step[1] * j as f64);
                    let corners = [at(end, j), at(end + run.len(), j + 1)];
                    end += run.len();
                    if let Some(shade) = shade(run[0], scale) {
                        chart.draw_series([Rectangle::new(corners, color(shade).filled())])?;
                    }
                }
                for (i, value) in largest.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                    if self.names.is_some() && pixels[0] >= 44 && pixels[1] >= 16 {
                        let letters = if shade(*value, scale) < Some(SHADES / 2) { WHITE } else { INK };
                        let style = centred(("sans-serif", 13).into_font().color(&letters));
                        chart.draw_series([Text::new(plain(three_digits(*value)), (i as f64, j as f64), style)])?;
                    }
                }
            }
            self.draw_overlays(&mut chart)?;
            draw_lines(area, (left + width / 2, TOP + height + FOOT), &x_label, false)?;
            draw_lines(area, (0, TOP + height / 2), &y_label, true)?;
            self.draw_scale(&area.clone().shrink((right, 0), (RIGHT, TOP + height.max(80) + 6)), scale)
        })
    }

    /// Maximum value of a drawn cell; NaN if there is none.
    fn largest(&self, cell: [usize; 2], every: [usize; 2]) -> f64 {
        let [columns, rows] = [0, 1].map(|k| cell[k] * every[k]..((cell[k] + 1) * every[k]).min(self.count[k]));
        rows.flat_map(|y| columns.clone().map(move |x| self.values[x + self.count[0] * y])).fold(f64::NAN, f64::max)
    }

    /// Draws outlines and marks over the cells.
    fn draw_overlays(&self, chart: &mut Chart<'_, '_, RangedCoordf64, RangedCoordf64>) -> Result<(), PlotError> {
        for [low, high] in self.outlines {
            let corners =
                [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]), (low[0], low[1])];
            for (color, width) in [(WHITE, 4), (OUTLINE, 2)] {
                chart.draw_series([PathElement::new(corners, color.stroke_width(width))])?;
            }
        }
        for ([x, y], letter) in self.marks {
            let letter = Text::new(
                (*letter).to_owned(),
                (0, 0),
                centred(("sans-serif", 14).into_font().style(FontStyle::Bold).color(&INK)),
            );
            let circle = Circle::new((0, 0), 8, WHITE.filled());
            chart.draw_series([EmptyElement::at((*x, *y)) + circle + Circle::new((0, 0), 8, BLACK) + letter])?;
        }
        Ok(())
    }

    /// Draws the colours with their values and label.
    fn draw_scale(&self, area: &Area<'_>, [low, high]: [f64; 2]) -> Result<(), PlotError> {
        area.draw(&Text::new(self.value_label, (0, 6), ("sans-serif", 13)))?;
        let y = if high > low { low..high } else { range([low].into_iter()) };
        let mut chart = ChartBuilder::on(area)
            .margin_top(TOP)
            .margin_bottom(6)
            .right_y_label_area_size(64)
            .build_cartesian_2d(0.0..1.0, y.clone())?;
        let at = |k: u8| y.start + (y.end - y.start) * f64::from(k) / f64::from(SHADES);
        chart.draw_series((0..SHADES).map(|k| Rectangle::new([(0.0, at(k)), (1.0, at(k + 1))], color(k).filled())))?;
        let numbers = &|y: &f64| plain(*y);
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh().set_all_tick_mark_size(3).label_style(("sans-serif", 13)).y_labels(6);
        Ok(mesh.y_label_formatter(numbers).draw()?)
    }
}

/// Returns the shade of a value; `None` for NaN.
fn shade(value: f64, [low, high]: [f64; 2]) -> Option<u8> {
    let share = if high > low { (value - low) / (high - low) } else { 0.5 };
    value.is_finite().then(|| (share.clamp(0.0, 1.0) * f64::from(SHADES)).round() as u8)
}

fn color(shade: u8) -> RGBColor {
    ink(magnitude(f64::from(shade) / f64::from(SHADES)))
}

fn centred(style: TextStyle<'_>) -> TextStyle<'_> {
    style.pos(Pos::new(HPos::Center, VPos::Center))
}
