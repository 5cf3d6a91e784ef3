//! Folder of figures for papers: every plot of the page as SVG at column width, with its data as
//! CSV, and pictures of the arm at print resolution.

use std::path::{Path, PathBuf};

use flexarm_draw::{CurveLook, Panel, PlotCurve, paper_plot};
use flexarm_files::{file_stem, write_all};
use flexarm_log::{EventKind, Trace};
use flexarm_settings::written::csv_field;

use super::curves::{Kind, Plot, PlotView, plots};
use super::picture::printed;
use crate::error::Error;
use crate::run::summary::Summary;

/// Width of the pictures of the arm (pixels): 300 per inch across both columns of a paper.
const PICTURE_WIDTH: usize = 1800;

/// Writes the folder. Plots without a finite value, and pictures that cannot be drawn, are left
/// out.
///
/// # Errors
/// [`Error::Write`].
pub(super) fn write(folder: &Path, summary: &Summary, trace: &Trace) -> Result<(), Error> {
    let mut files: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    let bands = moves(trace);
    for plot in plots(summary, trace) {
        for (k, view) in plot.views.iter().enumerate() {
            let stem = if k == 0 { plot.id.to_owned() } else { file_stem(&format!("{}_{}", plot.id, view.name)) };
            let stem = stem.replace(' ', "_");
            if let Ok(svg) = svg(&plot, view, if plot.over_time { &bands } else { &[] }) {
                files.push((folder.join(format!("{stem}.svg")), svg.into_bytes()));
                files.push((folder.join(format!("{stem}.csv")), csv(&plot, view).into_bytes()));
            }
        }
    }
    for (name, png) in printed(trace, PICTURE_WIDTH) {
        files.push((folder.join(format!("{name}.png")), png));
    }
    Ok(write_all(&files)?)
}

/// Returns start and end of each move (s).
fn moves(trace: &Trace) -> Vec<(f64, f64)> {
    let mut moves = Vec::new();
    for event in trace.events() {
        match (event.kind, moves.last_mut()) {
            (EventKind::MoveStart, _) => moves.push((event.time_s, f64::INFINITY)),
            (EventKind::MoveEnd, Some(last)) => last.1 = event.time_s,
            _ => {}
        }
    }
    moves
}

/// Returns the unit of the curves of a view.
fn unit_of<'a>(plot: &'a Plot, view: &'a PlotView) -> &'a str {
    if view.y_unit.is_empty() { plot.y_unit } else { view.y_unit }
}

/// Draws a view of a plot at column width; moves are shaded bands.
fn svg(plot: &Plot, view: &PlotView, bands: &[(f64, f64)]) -> Result<String, flexarm_draw::PlotError> {
    let curves = view.tables.iter().flat_map(|table| {
        table.curves.iter().map(|curve| PlotCurve {
            name: curve.name.clone(),
            look: match curve.kind {
                Kind::Plain => CurveLook::Plain,
                Kind::Total => CurveLook::Total,
                Kind::Dashed => CurveLook::Rigid,
                Kind::Axis(k) => CurveLook::Axis(k),
                Kind::Part(k) => CurveLook::Part(k),
            },
            x: table.x.clone(),
            y: curve.y.clone(),
        })
    });
    let label = format!("{} ({})", plot.y_label, unit_of(plot, view));
    let panel = Panel { label, logarithmic: plot.logarithmic, legend: true, curves: curves.collect() };
    paper_plot(&format!("{} ({})", plot.x_label, plot.x_unit), &[panel], bands)
}

/// Returns the data of a plot: one column per curve, units in the names; sets of curves with their
/// own x axes are side by side.
fn csv(plot: &Plot, view: &PlotView) -> String {
    let plain = |unit: &str| unit.replace('°', "deg").replace(' ', "_");
    let name = |text: &str, unit: &str| csv_field(&format!("{}_{}", text.replace(' ', "_"), plain(unit)));
    let several = view.tables.len() > 1;
    let (mut heads, mut columns): (Vec<String>, Vec<&[f64]>) = (Vec::new(), Vec::new());
    for table in &view.tables {
        let first = table.curves.first().map_or("", |curve| curve.name.as_str());
        let x = if several { format!("{first} {}", plot.x_label) } else { plot.x_label.to_owned() };
        heads.push(name(&x, plot.x_unit));
        columns.push(&table.x);
        for curve in &table.curves {
            heads.push(name(&curve.name, unit_of(plot, view)));
            columns.push(&curve.y);
        }
    }
    let mut text = heads.join(",") + "\n";
    for row in 0..columns.iter().map(|column| column.len()).max().unwrap_or(0) {
        let cells = columns
            .iter()
            .map(|column| column.get(row).filter(|x| x.is_finite()).map_or_else(String::new, f64::to_string));
        text += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    text
}
