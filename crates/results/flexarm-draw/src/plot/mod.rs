//! Curves over a common axis as a picture (SVG): stacked panels with a legend.
//!
//! Start at [`LinePlot`] for the screen, [`paper_plot`] for a column of a paper. All SVG pictures
//! of the crate are drawn by `plotters` with only its SVG backend: no fonts, no files, no clock.
//! They share [`picture`], [`axes`] and [`plain`].

mod curve;
mod frame;
mod legend;
pub(crate) mod ranges;
pub(crate) mod style;
pub(crate) mod svg;

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

/// Draws a plot in a style, with intervals `bands` of the horizontal axis tinted.
fn plot(what: &LinePlot<'_>, bands: &[(f64, f64)], style: &Style) -> Result<String, PlotError> {
    // Curves in the order of their colours; the same name in two panels is one curve.
    let panels = what.panels;
    let mut curves: Vec<&PlotCurve> = Vec::new();
    for curve in panels.iter().flat_map(|panel| &panel.curves) {
        if !curves.iter().any(|known| known.name == curve.name) {
            curves.push(curve);
        }
    }
    let legend = if panels.iter().any(|p| p.legend) { legend_rows(&curves, style) } else { Vec::new() };
    // Heading and legend above the panels.
    let row = style.legend_font * 3 / 2;
    let above_legend = heading_height(what, style);
    let above = above_legend + if legend.is_empty() { 0 } else { row * legend.len() as u32 + style.margin };
    let (width, height) = (style.panel.0, style.panel.1 * panels.len().max(1) as u32 + above);
    let mut text = picture((width, height), |area| {
        let (strip, area) = area.split_vertically(above);
        let (heading, strip) = strip.split_vertically(above_legend);
        draw_heading(&heading, what, style)?;
        draw_legend(&strip, &legend, &curves, style)?;
        // Panels, the horizontal axis labelled in the last one.
        for (k, (panel, part)) in panels.iter().zip(area.split_evenly((panels.len(), 1))).enumerate() {
            let x_label = if k + 1 == panels.len() { what.x_label } else { "" };
            let points = points(panel);
            let ranges = ranges(&points, panel.logarithmic)
                .ok_or_else(|| PlotError::NothingFinite { panel: panel.label.clone() })?;
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
    // Size on paper instead of pixels.
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
