//! Looks of curves, and their names above the panels.
//!
//! Start at [`style_of`] and [`draw_legend`]; the total is black and thick, other curves have colours
//! of the palette. Sizes in units of the style.
//! Not here: axes and ticks (`frame.rs`, `ranges.rs`).

use plotters::prelude::*;

use crate::palette::{self, Ground};
use crate::plot::curve::{CurveLook, PlotCurve};
use crate::plot::style::Style;
use crate::plot::svg::{Area, PlotError, ink};

/// Returns colour and width of a curve; curves with the same name look the same in all panels.
pub(super) fn style_of(curve: &PlotCurve, all: &[&PlotCurve], style: &Style) -> ShapeStyle {
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
pub(super) fn legend_rows(curves: &[&PlotCurve], style: &Style) -> Vec<Vec<(usize, u32)>> {
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

pub(super) fn dot_radius(style: &Style) -> u32 {
    2 * style.stroke
}

/// Length of the line next to a name in the legend, with its gap.
fn swatch(style: &Style) -> u32 {
    2 * style.legend_font
}

/// Draws the legend: per row the curves with their horizontal positions in pixels.
pub(super) fn draw_legend(
    strip: &Area<'_>,
    rows: &[Vec<(usize, u32)>],
    curves: &[&PlotCurve],
    style: &Style,
) -> Result<(), PlotError> {
    let font = style.legend_font as i32;
    for (row, places) in rows.iter().enumerate() {
        let y = style.margin as i32 + row as i32 * font * 3 / 2;
        for (k, x) in places {
            let (curve, x, look) = (curves[*k], *x as i32, style_of(curves[*k], curves, style));
            let (from, middle, to) = (x, y + font / 2, x + font * 3 / 2);
            let cut = (to - from) / 3;
            // Sample of the curve: a dot, two dashes or a line.
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
