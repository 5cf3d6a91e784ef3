//! Pictures as SVG: areas, axes, and numbers on them.
//!
//! Start at [`picture`] and [`axes`]. Sizes are pixels of the picture.
//! Not here: curves with a legend ([`super::frame`]), charts of studies ([`crate::charts`]).

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

use crate::palette::Rgb;

/// Colour of marks across a panel.
pub(crate) const MARK: RGBColor = RGBColor(140, 146, 156);

/// Reason why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlotError {
    /// No point of a panel is finite, or positive on a logarithmic axis.
    #[error("no plot: {panel:?} has nothing finite to draw")]
    NothingFinite {
        /// Label of its vertical axis.
        panel: String,
    },
    /// The drawing library refuses an element.
    #[error("no plot: {cause}")]
    Drawing {
        /// Message of the library.
        cause: String,
    },
}

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PlotError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self::Drawing { cause: error.to_string() }
    }
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
    pub(crate) margin: [u32; 2],
    /// Names at 0, 1, 2, ... instead of numbers.
    pub(crate) names: [Option<&'a [String]>; 2],
}

/// Draws a chart with its axes, and grid lines at their numbers.
pub(crate) fn axes<'a, 'b>(
    area: &Area<'b>,
    Axes { ranges: [x, y], margin: [left, below], names }: Axes<'_>,
) -> Result<Chart<'a, 'b, RangedCoordf64, RangedCoordf64>, PlotError> {
    let (width, height) = area.dim_in_pixel();
    let mut chart = ChartBuilder::on(area).y_label_area_size(left).x_label_area_size(below).build_cartesian_2d(x, y)?;
    let at = |k: usize, x: f64| match names[k] {
        None => plain(x),
        Some(names) if (x - x.round()).abs() < 1e-6 => names.get(x.round() as usize).cloned().unwrap_or_default(),
        Some(_) => String::new(),
    };
    // At most as many labels as there is space for.
    let most = |k: usize, margin: usize| match names[k] {
        None => (margin / 40).max(3),
        Some(names) => (margin / [44, 14][k]).clamp(1, names.len().max(1)),
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

/// A chart of `plotters` as SVG.
pub(crate) type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;

/// Converts a colour of the palette.
pub(crate) fn ink([red, green, blue]: Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

/// Short format of a number on an axis.
pub fn plain(x: f64) -> String {
    match x.abs() {
        // Rounding residues of the axis are zeros.
        size if size < 1e-12 => "0".into(),
        size if (1e-2..1e5).contains(&size) => format!("{}", (x * 1e4).round() / 1e4),
        _ => format!("{:e}", three_digits(x)),
    }
}

/// Rounds to three significant digits.
pub fn three_digits(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}
