//! Curves over a common axis as a picture (SVG): panels one above the other with a legend.
//!
//! The one module that names `plotters`, with its SVG backend alone: no fonts, no files, no clock. Start at
//! [`line_plot`].

use std::ops::Range;

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// Width of a picture and height of a panel (points).
const PANEL: (u32, u32) = (960, 340);
/// Decades that a logarithmic panel shows at most below its highest value.
const MOST_DECADES: f64 = 1e8;

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no plot: {0}")]
pub struct PlotError(String);

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotCurve {
    /// For the legend.
    pub name: String,
    /// Ascending.
    pub x: Vec<f64>,
    /// One per x.
    pub y: Vec<f64>,
}

/// Curves that share a vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What is on the vertical axis.
    pub label: String,
    /// Logarithmic vertical axis; values that are not positive are left out.
    pub logarithmic: bool,
    /// Whether its curves are named in a legend.
    pub legend: bool,
    /// The curves; those of one name have one colour in all panels.
    pub curves: Vec<PlotCurve>,
}

/// Draws panels over a common horizontal axis, logarithmic if asked for and possible; the text of an SVG file.
///
/// # Errors
/// [`PlotError`] if nothing finite is to be drawn.
pub fn line_plot(title: &str, x_label: &str, logarithmic_x: bool, panels: &[Panel]) -> Result<String, PlotError> {
    let mut text = String::new();
    let mut names: Vec<&str> = Vec::new();
    for curve in panels.iter().flat_map(|panel| &panel.curves) {
        if !names.contains(&curve.name.as_str()) {
            names.push(&curve.name);
        }
    }
    let height = PANEL.1 * panels.len().max(1) as u32;
    {
        let area = SVGBackend::with_string(&mut text, (PANEL.0, height)).into_drawing_area();
        area.fill(&WHITE).map_err(fault)?;
        for (k, (panel, part)) in panels.iter().zip(area.split_evenly((panels.len(), 1))).enumerate() {
            let title = if k == 0 { title } else { "" };
            let x_label = if k + 1 == panels.len() { x_label } else { "" };
            let points = points(panel);
            let (x, y) = ranges(&points, panel.logarithmic)
                .ok_or_else(|| PlotError(format!("{:?} has nothing finite to draw", panel.label)))?;
            let frame = Frame { title, x_label, panel, points: &points, names: &names };
            match (logarithmic_x && x.start > 0.0, panel.logarithmic) {
                (true, true) => frame.draw(&part, x.log_scale(), y.log_scale()),
                (true, false) => frame.draw(&part, x.log_scale(), y),
                (false, true) => frame.draw(&part, x, y.log_scale()),
                (false, false) => frame.draw(&part, x, y),
            }?;
        }
        area.present().map_err(fault)?;
    }
    Ok(text)
}

fn fault(error: impl std::fmt::Display) -> PlotError {
    PlotError(error.to_string())
}

/// The points of each curve that can be drawn.
fn points(panel: &Panel) -> Vec<Vec<(f64, f64)>> {
    let good = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite() && (*y > 0.0 || !panel.logarithmic);
    panel.curves.iter().map(|c| c.x.iter().copied().zip(c.y.iter().copied()).filter(good).collect()).collect()
}

/// What the axes must show, with some room.
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

struct Frame<'a> {
    title: &'a str,
    x_label: &'a str,
    panel: &'a Panel,
    points: &'a [Vec<(f64, f64)>],
    /// Of all curves, in the order of their colours.
    names: &'a [&'a str],
}

impl Frame<'_> {
    fn draw<X, Y>(
        &self,
        area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
        x: X,
        y: Y,
    ) -> Result<(), PlotError>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
        Y::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
    {
        let mut chart = ChartBuilder::on(area);
        chart.margin(12).x_label_area_size(36).y_label_area_size(72);
        if !self.title.is_empty() {
            chart.caption(self.title, ("sans-serif", 18));
        }
        let mut chart = chart.build_cartesian_2d(x, y).map_err(fault)?;
        chart
            .configure_mesh()
            .x_desc(self.x_label)
            .y_desc(&self.panel.label)
            .label_style(("sans-serif", 13))
            .light_line_style(RGBColor(240, 240, 240))
            .y_max_light_lines(4)
            .x_label_formatter(&|x| plain(*x))
            .y_label_formatter(&|y| plain(*y))
            .draw()
            .map_err(fault)?;
        for (k, (curve, points)) in self.panel.curves.iter().zip(self.points).enumerate() {
            let color = Palette99::pick(self.names.iter().position(|n| *n == curve.name).unwrap_or(k)).to_rgba();
            chart
                .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))
                .map_err(fault)?
                .label(&curve.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        }
        if self.panel.legend && !self.panel.curves.is_empty() {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperRight)
                .background_style(WHITE.mix(0.8))
                .label_font(("sans-serif", 12))
                .draw()
                .map_err(fault)?;
        }
        Ok(())
    }
}

/// Short form of a number on an axis.
fn plain(x: f64) -> String {
    if x != 0.0 && !(1e-2..1e4).contains(&x.abs()) {
        format!("{x:.0e}")
    } else {
        format!("{}", (x * 1e4).round() / 1e4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, y: &[f64]) -> PlotCurve {
        PlotCurve { name: name.into(), x: (1..=y.len()).map(|k| k as f64).collect(), y: y.to_vec() }
    }

    #[test]
    fn curves_and_their_names_are_in_the_picture() {
        let panel =
            |label: &str, logarithmic, curves| Panel { label: label.into(), logarithmic, legend: logarithmic, curves };
        let panels = [
            panel("size", true, vec![curve("a < b", &[1.0, 1e-3, f64::NAN, 0.0])]),
            panel("angle", false, vec![curve("flat", &[2.0, 2.0])]),
        ];
        let text = line_plot("all of it", "time", true, &panels).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in ["all of it", "time", "size", "angle", "a &lt; b"] {
            assert!(text.contains(word), "{word}");
        }
        assert!(text.matches("<polyline").count() >= 2);
        assert_eq!(text, line_plot("all of it", "time", true, &panels).unwrap());
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        let curves = vec![curve("a", &[0.0, f64::INFINITY])];
        let panel = Panel { label: "size".into(), logarithmic: true, legend: true, curves };
        let error = line_plot("", "", false, &[panel]).unwrap_err();
        assert!(error.to_string().contains("nothing finite"), "{error}");
    }
}
