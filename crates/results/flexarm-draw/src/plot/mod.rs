//! Curves over a common axis as a picture (SVG): stacked panels with a legend.
//!
//! Start at [`LinePlot`] for the screen, [`paper_plot`] for a column of a paper. All SVG pictures
//! of the crate are drawn by `plotters` with only its SVG backend: no fonts, no files, no clock.
//! They share [`picture`], [`axes`] and [`plain`].

mod curve;
mod frame;
mod legend;
mod ranges;
mod style;
mod svg;

use plotters::prelude::*;

use frame::Frame;
use legend::{draw_legend, legend_rows};
use ranges::{equally_long, points, ranges};
use style::{COLUMN, PAGE, PLAN, SCREEN, Style};

pub use curve::{CurveLook, Panel, PlotCurve};
pub use svg::PlotError;

pub(crate) use svg::{Area, Axes, Chart, MARK, axes, ink, picture, plain, three_digits};

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
///
/// # Errors
/// Those of [`LinePlot::svg`].
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::palette::{self, Ground};

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
