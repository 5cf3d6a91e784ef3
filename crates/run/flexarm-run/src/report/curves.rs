//! Data of the plots: curves of a run in readable units, thinned such that peaks remain.
//!
//! Start at `plots` (one run) and `overlays` (several). Units are those of the labels (mm, mrad, °,
//! N). Not here: the curves of a run (`flexarm_log::Trace`), drawing (`figures`,
//! `assets/report.js`).

use flexarm_analysis::amplitude_spectrum;
use flexarm_log::{CurveQuantity, GaugeQuantity, Trace};

use crate::run::summary::Summary;

/// Maximum number of points of a curve that is always shown.
const MAX_POINTS: usize = 3000;
/// Maximum number of values of a plot with many curves.
const MAX_NUMBERS: usize = 24_000;
/// Maximum number of points of curves behind a selector.
const MAX_DETAIL: usize = 1000;
/// A spectrum is shown up to the last amplitude above this share of its maximum.
const QUIET: f64 = 1e-3;

const WHOLE_RUN: &str = "whole run";

/// Maximum number of stops whose spectra are shown.
const MAX_STOPS: usize = 8;

/// A plot: curves over a common axis, or several such sets to choose from.
#[derive(Clone, Debug, Default)]
pub(super) struct Plot {
    /// Used in links and file names.
    pub(super) id: &'static str,
    pub(super) section: &'static str,
    pub(super) title: &'static str,
    /// Text that explains the plot.
    pub(super) note: String,
    pub(super) x_label: &'static str,
    pub(super) x_unit: &'static str,
    pub(super) y_label: &'static str,
    pub(super) y_unit: &'static str,
    /// Whether the x axis is time; such plots share cursor and zoom.
    pub(super) over_time: bool,
    pub(super) logarithmic: bool,
    /// Whether the plot takes the full width of the page.
    pub(super) wide: bool,
    /// Vertical lines in the plot: x value and name.
    pub(super) marks: Vec<(f64, String)>,
    pub(super) views: Vec<PlotView>,
}

/// One choice of curves.
#[derive(Clone, Debug, Default)]
pub(super) struct PlotView {
    pub(super) name: String,
    /// Unit of its curves if it differs from the plot's.
    pub(super) y_unit: &'static str,
    /// One table per run: curves with their own x axis.
    pub(super) tables: Vec<Table>,
}

/// Curves over common x values.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub(super) x: Vec<f64>,
    pub(super) curves: Vec<Curve>,
    /// Whether points were removed.
    pub(super) is_thinned: bool,
}

/// Values of a curve, one per x value of its table.
#[derive(Clone, Debug, Default)]
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) y: Vec<f64>,
}

/// Style of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Kind {
    #[default]
    Plain,
    /// Magnitude of a vector whose components are the other curves.
    Total,
    /// Rigid twin, the reference for the other curves.
    Dashed,
    /// Along the world axis x (0), y (1) or z (2), drawn in its colour.
    Axis(usize),
    /// Link, spring or joint, drawn in the colour with this number.
    Part(usize),
}

impl Kind {
    /// Returns the style of a link, spring or joint.
    fn of(trace: &Trace, name: &str) -> Self {
        Self::Part(trace.header.color_number(name))
    }
}

impl Table {
    /// Creates a table of at most about `most` points, fewer with many curves.
    fn new(x: Vec<f64>, curves: Vec<Curve>, most: usize) -> Self {
        let most = most.min(MAX_NUMBERS / (curves.len() + 1)).max(200);
        let keep = thinned(&curves.iter().map(|c| c.y.as_slice()).collect::<Vec<_>>(), x.len(), most);
        let pick = |values: &[f64]| keep.iter().map(|k| values[*k]).collect();
        let curves = curves.iter().map(|c| Curve { y: pick(&c.y), ..c.clone() }).collect();
        Self { x: pick(&x), curves, is_thinned: keep.len() < x.len() }
    }
}

/// Returns ascending indices of at most about `most` points of curves with a common axis: the first
/// and last point, and the minimum and maximum of every curve in each of equal pieces.
pub fn thinned(curves: &[&[f64]], length: usize, most: usize) -> Vec<usize> {
    if length <= most || curves.is_empty() {
        return (0..length).collect();
    }
    let pieces = (most / (2 * curves.len())).max(1);
    let mut keep = vec![0];
    for piece in 0..pieces {
        let range = piece * length / pieces..(piece + 1) * length / pieces;
        for curve in curves {
            let finite = || range.clone().filter(|k| curve[*k].is_finite());
            keep.extend(finite().min_by(|a, b| curve[*a].total_cmp(&curve[*b])));
            keep.extend(finite().max_by(|a, b| curve[*a].total_cmp(&curve[*b])));
        }
    }
    keep.push(length - 1);
    keep.sort_unstable();
    keep.dedup();
    keep
}

/// Returns a curve of a run, multiplied by `scale`.
fn curve(trace: &Trace, name: impl Into<String>, kind: Kind, scale: f64, of: CurveQuantity) -> Curve {
    let mut y = trace.curve(of);
    y.iter_mut().for_each(|y| *y *= scale);
    Curve { name: name.into(), kind, y }
}

/// Returns curves along the axes x, y and z.
fn axes(trace: &Trace, scale: f64, of: impl Fn(usize) -> CurveQuantity) -> Vec<Curve> {
    let names = ["x", "y", "z"].iter().enumerate();
    names.map(|(k, name)| curve(trace, *name, Kind::Axis(k), scale, of(k))).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns all plots of a run. Empty lists (a robot without elements, a run without a twin) give no
/// plot.
pub(super) fn plots(summary: &Summary, trace: &Trace) -> Vec<Plot> {
    let mut plots = Vec::new();
    if trace.rows.is_empty() {
        return plots;
    }
    if trace.header.has_rigid {
        plots.extend([error(trace), path_over_time(trace), path_over_length(trace)]);
        plots.extend(spectrum(summary, trace));
        plots.push(rotation(trace));
        plots.extend(contributions(trace));
    }
    plots.extend(elements(summary, trace));
    plots.extend(GaugeQuantity::ALL.into_iter().filter_map(|quantity| gauges(trace, quantity)));
    plots.push(torques(trace));
    plots.extend(joints(trace));
    plots.push(energy(trace));
    plots
}

/// Returns an empty plot over time.
fn over_time(id: &'static str, section: &'static str, title: &'static str) -> Plot {
    Plot { id, section, title, x_label: "time", x_unit: "s", over_time: true, ..Plot::default() }
}

/// Returns the views of a plot without a selector.
fn one_view(table: Table) -> Vec<PlotView> {
    vec![PlotView { tables: vec![table], ..PlotView::default() }]
}

const TOOL: &str = "Tool";
const PARTS: &str = "Links and elastic elements";
const DRIVES: &str = "Joints and energy";

/// Plot of the TCP error, and of its static and dynamic part.
fn error(trace: &Trace) -> Plot {
    let mut curves = vec![curve(trace, "size", Kind::Total, 1e3, CurveQuantity::ErrorSize)];
    curves.extend(axes(trace, 1e3, CurveQuantity::Error));
    let mut views = one_view(Table::new(trace.curve_times(), curves, MAX_POINTS));
    let mut note = "Flexible minus rigid tool centre point, world axes.".to_owned();
    if trace.header.has_static {
        views[0].name = "error".into();
        views.push(static_and_dynamic(trace));
        note += " Static: deflection of the arm at rest in the same pose; dynamic: the rest.";
    }
    Plot {
        y_label: "TCP error",
        y_unit: "mm",
        wide: true,
        note,
        views,
        ..over_time("tcp_error", TOOL, "TCP error over time")
    }
}

/// Magnitudes of the error and of its static and dynamic part.
fn static_and_dynamic(trace: &Trace) -> PlotView {
    let curves = vec![
        curve(trace, "size", Kind::Total, 1e3, CurveQuantity::ErrorSize),
        curve(trace, "static", Kind::Plain, 1e3, CurveQuantity::StaticSize),
        curve(trace, "dynamic", Kind::Plain, 1e3, CurveQuantity::MovingSize),
    ];
    let table = Table::new(trace.curve_times(), curves, MAX_POINTS);
    PlotView { name: "static and dynamic".into(), tables: vec![table], ..PlotView::default() }
}

fn rotation(trace: &Trace) -> Plot {
    let mut curves = vec![curve(trace, "size", Kind::Total, 1e3, CurveQuantity::TurnSize)];
    curves.extend(axes(trace, 1e3, |k| CurveQuantity::Error(3 + k)));
    Plot {
        y_label: "rotation error",
        y_unit: "mrad",
        note: "Rotation vector from the rigid to the flexible tool, world axes.".into(),
        views: one_view(Table::new(trace.curve_times(), curves, MAX_POINTS)),
        ..over_time("tcp_rotation", TOOL, "Rotation of the tool over time")
    }
}

fn path_curves(trace: &Trace) -> Vec<Curve> {
    let mut curves = vec![curve(trace, "distance from the path", Kind::Total, 1e3, CurveQuantity::AcrossPath)];
    let names = ["along", "normal", "binormal"];
    let parts = names.iter().enumerate();
    curves.extend(parts.map(|(k, name)| curve(trace, *name, Kind::Plain, 1e3, CurveQuantity::AlongPath(k))));
    curves
}

/// Plot of the deviation in path axes over time.
fn path_over_time(trace: &Trace) -> Plot {
    Plot {
        y_label: "deviation",
        y_unit: "mm",
        note: "Axes of the rigid tool's path: along it, and two across with minimum rotation (the normal begins on the inside of the first bend).".into(),
        views: one_view(Table::new(trace.curve_times(), path_curves(trace), MAX_POINTS)),
        ..over_time("path_time", TOOL, "Deviation in path axes over time")
    }
}

/// Plot of the same over the length of the path.
fn path_over_length(trace: &Trace) -> Plot {
    Plot {
        id: "path_length",
        section: TOOL,
        title: "Deviation in path axes along the path",
        note: "Upright strokes are stops: the tool rings while its place on the path stays.".into(),
        x_label: "path of the rigid tool",
        x_unit: "m",
        y_label: "deviation",
        y_unit: "mm",
        views: one_view(Table::new(trace.curve_ways(), path_curves(trace), MAX_POINTS)),
        ..Plot::default()
    }
}

/// Amplitude spectrum of a section of the run: all axes together, then each axis.
fn amplitudes(errors: &[(f64, [f64; 3])]) -> Option<(Vec<f64>, Vec<Curve>)> {
    let times: Vec<f64> = errors.iter().map(|(time_s, _)| *time_s).collect();
    let signal: Vec<[f64; 3]> = errors.iter().map(|(_, error)| error.map(|part| 1e3 * part)).collect();
    if signal.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let spectrum = amplitude_spectrum(&times, &signal)?;
    let total: Vec<f64> = spectrum.amplitude.iter().map(|a| norm(a)).collect();
    let largest = total.iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 {
        return None;
    }
    // Zero cannot be drawn on a logarithmic axis; amplitudes are cut off six decades below the
    // peak.
    let clipped = |a: f64| a.max(1e-6 * largest);
    let mut curves =
        vec![Curve { name: "all axes".into(), kind: Kind::Total, y: total.into_iter().map(clipped).collect() }];
    curves.extend(["x", "y", "z"].iter().enumerate().map(|(k, name)| Curve {
        name: (*name).into(),
        kind: Kind::Axis(k),
        y: spectrum.amplitude.iter().map(|a| clipped(a[k])).collect(),
    }));
    Some((spectrum.hz, curves))
}

/// Plot of the spectrum of the error, at each stop and over the whole run.
fn spectrum(summary: &Summary, trace: &Trace) -> Option<Plot> {
    let errors = trace.beginning();
    let (hz, curves) = amplitudes(&errors)?;
    // Shows the range up to the last significant amplitude, and at least the first natural
    // frequencies.
    let total = &curves[0].y;
    let largest = total.iter().copied().fold(0.0, f64::max);
    let significant_hz = total.iter().rposition(|a| *a > QUIET * largest).map_or(0.0, |k| hz[k]);
    let natural = summary.frequencies_hz.get(2).or(summary.frequencies_hz.last()).copied().unwrap_or(0.0);
    let end = (1.1 * significant_hz).max(1.2 * natural).min(*hz.last()?);
    let shown = |hz: &[f64], curves: Vec<Curve>| {
        let range = 1..hz.partition_point(|f| *f <= end).max(2).min(hz.len());
        let curves = curves.into_iter().map(|c| Curve { y: c.y[range.clone()].to_vec(), ..c });
        Table::new(hz[range.clone()].to_vec(), curves.collect(), MAX_POINTS)
    };
    // In a long run only the beginning is stored at the full sample rate.
    let end_s = errors.last().map_or(0.0, |(time_s, _)| *time_s);
    let is_whole = errors.len() as u64 == trace.samples();
    let name = if is_whole { WHOLE_RUN.to_owned() } else { format!("first {end_s:.4} s") };
    let mut views = vec![PlotView { name, tables: vec![shown(&hz, curves)], ..PlotView::default() }];
    // At stops the spectrum shows the vibration without the motion.
    let holds = summary.tcp.iter().flat_map(|tcp| &tcp.holds).take(MAX_STOPS).enumerate();
    let holds = holds.filter(|(_, hold)| is_whole || hold.end_s <= end_s);
    let stops = holds.filter_map(|(k, hold)| {
        let place = |t: f64| errors.partition_point(|(time_s, _)| *time_s < t - 1e-9);
        let (hz, mut curves) = amplitudes(&errors[place(hold.start_s)..place(hold.end_s)])?;
        curves.truncate(1);
        (curves[0].name, curves[0].kind) = (format!("stop {}", k + 1), Kind::Plain);
        Some(shown(&hz, curves))
    });
    let stops: Vec<Table> = stops.collect();
    if !stops.is_empty() {
        views.insert(0, PlotView { name: "stops".into(), tables: stops, ..PlotView::default() });
    }
    let marks = summary.frequencies_hz.iter().enumerate().filter(|(_, hz)| **hz <= end);
    Some(Plot {
        id: "spectrum",
        section: TOOL,
        title: "Spectrum of the TCP error",
        note: "Amplitudes (Hann window). Dashed: natural frequencies at the start pose, motors held.".into(),
        x_label: "frequency",
        x_unit: "Hz",
        y_label: "amplitude",
        y_unit: "mm",
        logarithmic: true,
        marks: marks.map(|(k, hz)| (*hz, format!("f{} = {hz:.2} Hz", k + 1))).collect(),
        views,
        ..Plot::default()
    })
}

/// Plot of the TCP displacement by each contributor.
fn contributions(trace: &Trace) -> Option<Plot> {
    let names = &trace.header.contributors;
    if names.is_empty() {
        return None;
    }
    let view = |name: &str, of: &dyn Fn(usize) -> CurveQuantity| {
        let curves =
            names.iter().enumerate().map(|(k, name)| curve(trace, name.clone(), Kind::of(trace, name), 1e3, of(k)));
        let table = Table::new(trace.curve_times(), curves.collect(), MAX_POINTS);
        PlotView { name: name.into(), tables: vec![table], ..PlotView::default() }
    };
    let mut views = vec![view("size", &CurveQuantity::ContributionSize)];
    views
        .extend(["x", "y", "z"].iter().enumerate().map(|(c, axis)| view(axis, &|k| CurveQuantity::Contribution(k, c))));
    Some(Plot {
        y_label: "TCP displacement",
        y_unit: "mm",
        wide: true,
        note: "TCP displacement caused by the deflection of one link or drive (first order).".into(),
        views,
        ..over_time("contributions", PARTS, "Who moves the tool")
    })
}

/// Plot of all strain gauges or of all stress points.
fn gauges(trace: &Trace, quantity: GaugeQuantity) -> Option<Plot> {
    let (id, unit, scale) = quantity.shown();
    let own = trace.header.gauges_of(quantity).enumerate();
    let curves = own.map(|(n, (k, name))| curve(trace, name, Kind::Part(n), scale, CurveQuantity::Gauge(k)));
    let table = Table::new(trace.curve_times(), curves.collect(), MAX_POINTS);
    let title = match quantity {
        GaugeQuantity::Strain => "Strain gauges",
        GaugeQuantity::Stress => "Stress points",
    };
    (!table.curves.is_empty()).then(|| Plot {
        y_label: id,
        y_unit: unit,
        wide: true,
        views: one_view(table),
        ..over_time(id, PARTS, title)
    })
}

/// Plots of loads and deflections: magnitudes of all elements, and the components of each.
fn elements(summary: &Summary, trace: &Trace) -> Vec<Plot> {
    let names = &trace.header.elements;
    if names.is_empty() {
        return Vec::new();
    }
    // First the magnitudes of all elements, then the components of each as a view of its own.
    let make = |plot: Plot, scale: f64, size: fn(usize) -> CurveQuantity, part: fn(usize, usize) -> CurveQuantity| {
        let sizes = names.iter().enumerate();
        let sizes = sizes.map(|(k, name)| curve(trace, name.clone(), Kind::of(trace, name), scale, size(k)));
        let table = Table::new(trace.curve_times(), sizes.collect(), MAX_POINTS);
        let mut views = vec![PlotView { name: "all, size".into(), tables: vec![table], ..PlotView::default() }];
        for (k, name) in names.iter().enumerate() {
            let axes = axes(trace, scale, |c| part(k, c));
            let table = Table::new(trace.curve_times(), axes, MAX_DETAIL);
            views.push(PlotView { name: name.clone(), tables: vec![table], ..PlotView::default() });
        }
        Plot { views, ..plot }
    };
    let note = match summary.links_model.as_str() {
        "modal" | "mixed" => {
            "Of modal links: the first six coordinates, which are the motion of the far interface unless the link has \
             modes of its own."
        }
        _ => "",
    };
    let plot = |id, title, y_label, y_unit| Plot { y_label, y_unit, note: note.into(), ..over_time(id, PARTS, title) };
    let plots = vec![
        make(
            plot("element_force", "Elastic forces", "force", "N"),
            1.0,
            |k| CurveQuantity::LoadSize(k, 0),
            CurveQuantity::Load,
        ),
        make(
            plot("element_moment", "Elastic moments", "moment", "N m"),
            1.0,
            |k| CurveQuantity::LoadSize(k, 1),
            |k, c| CurveQuantity::Load(k, 3 + c),
        ),
        make(
            plot("element_shift", "Elastic displacements", "displacement", "mm"),
            1e3,
            |k| CurveQuantity::DeflectionSize(k, 0),
            CurveQuantity::Deflection,
        ),
        make(
            plot("element_turn", "Elastic rotations", "rotation", "mrad"),
            1e3,
            |k| CurveQuantity::DeflectionSize(k, 1),
            |k, c| CurveQuantity::Deflection(k, 3 + c),
        ),
    ];
    plots.into_iter().filter(|plot| !is_zero(plot)).collect()
}

/// Whether all curves of a plot are zero everywhere, as in translation plots of an arm with
/// rotational springs only.
fn is_zero(plot: &Plot) -> bool {
    let tables = plot.views.iter().flat_map(|view| &view.tables);
    tables.flat_map(|table| &table.curves).flat_map(|curve| &curve.y).all(|y| *y == 0.0)
}

/// Returns whether a joint is prismatic.
fn slides(trace: &Trace, joint: usize) -> bool {
    trace.header.prismatic.get(joint).copied().unwrap_or(false)
}

/// Plot of the drive forces: of all joints, and of each beside the rigid twin.
fn torques(trace: &Trace) -> Plot {
    let names = &trace.header.joints;
    let all = names.iter().enumerate();
    let all = all.map(|(k, name)| curve(trace, name.clone(), Kind::of(trace, name), 1.0, CurveQuantity::Effort(k)));
    let table = Table::new(trace.curve_times(), all.collect(), MAX_POINTS);
    let mut views = vec![PlotView { name: "all, flexible".into(), tables: vec![table], ..PlotView::default() }];
    for (k, name) in names.iter().enumerate() {
        let mut curves = vec![curve(trace, "flexible", Kind::of(trace, name), 1.0, CurveQuantity::Effort(k))];
        if trace.header.has_rigid {
            curves.push(curve(trace, "rigid", Kind::Dashed, 1.0, CurveQuantity::RigidEffort(k)));
        }
        let y_unit = if slides(trace, k) { "N" } else { "N m" };
        let table = Table::new(trace.curve_times(), curves, MAX_DETAIL);
        views.push(PlotView { name: name.clone(), y_unit, tables: vec![table] });
    }
    // Unit of the common plot.
    let all_slide = !names.is_empty() && (0..names.len()).all(|k| slides(trace, k));
    let none_slides = (0..names.len()).all(|k| !slides(trace, k));
    let y_unit = if all_slide {
        "N"
    } else if none_slides {
        "N m"
    } else {
        "N m or N"
    };
    let note = "Forces of the drives; choose a joint to compare it with the rigid twin.".to_owned();
    let y_label = if none_slides { "torque" } else { "drive force" };
    Plot { y_label, y_unit, note, views, ..over_time("torques", DRIVES, "Joint torques") }
}

/// Plots of the joint positions: revolute ones, then prismatic ones.
fn joints(trace: &Trace) -> Vec<Plot> {
    let make = |sliding: bool| {
        let names = trace.header.joints.iter().enumerate().filter(|(k, _)| slides(trace, *k) == sliding);
        let scale = if sliding { 1e3 } else { 1f64.to_degrees() };
        let of_joint = |(k, name): (usize, &String)| {
            curve(trace, name.clone(), Kind::of(trace, name), scale, CurveQuantity::Joint(k))
        };
        let curves: Vec<Curve> = names.map(of_joint).collect();
        let (id, title) =
            if sliding { ("slides", "Positions of sliding joints") } else { ("joints", "Joint positions") };
        (!curves.is_empty()).then(|| Plot {
            y_label: "position",
            y_unit: if sliding { "mm" } else { "°" },
            note: "Of the flexible robot, at the link.".into(),
            views: one_view(Table::new(trace.curve_times(), curves, MAX_POINTS)),
            ..over_time(id, DRIVES, title)
        })
    };
    [make(false), make(true)].into_iter().flatten().collect()
}

/// Plot of the energies.
fn energy(trace: &Trace) -> Plot {
    let start = trace.rows.first().map_or(0.0, |row| row.energy.potential);
    let names = ["kinetic", "gravity", "elastic"].iter().enumerate();
    let mut curves: Vec<Curve> =
        names.map(|(k, name)| curve(trace, *name, Kind::Plain, 1.0, CurveQuantity::Energy(k))).collect();
    curves[1].y.iter_mut().for_each(|y| *y -= start);
    Plot {
        y_label: "energy",
        y_unit: "J",
        note: "Of the flexible robot; gravity from its value at the start.".into(),
        views: one_view(Table::new(trace.curve_times(), curves, MAX_POINTS)),
        ..over_time("energy", DRIVES, "Energy")
    }
}

/// Returns the plots that overlay several runs, one curve per run.
pub(super) fn overlays(runs: &[(&str, &Summary, &Trace)]) -> Vec<Plot> {
    // The table of a plot that has the wanted curve, reduced to it and named after the run.
    let only = |plot: Plot, wanted: &str, label: &str| {
        let mut tables = plot.views.into_iter().flat_map(|view| view.tables);
        let mut table = tables.find(|table| table.curves.iter().any(|curve| curve.name == wanted))?;
        table.curves.retain(|curve| curve.name == wanted);
        for curve in &mut table.curves {
            curve.name = label.to_owned();
            curve.kind = Kind::Plain;
        }
        Some(table)
    };
    let with_twin: Vec<_> =
        runs.iter().filter(|(_, _, trace)| trace.header.has_rigid && !trace.rows.is_empty()).collect();
    if with_twin.is_empty() {
        return Vec::new();
    }
    let overlaid = |plot: Plot, wanted: &str, each: &dyn Fn(&Summary, &Trace) -> Option<Plot>| {
        let tables = with_twin
            .iter()
            .filter_map(|(label, summary, trace)| each(summary, trace).and_then(|plot| only(plot, wanted, label)));
        let views = vec![PlotView { tables: tables.collect(), ..PlotView::default() }];
        let note = match plot.over_time {
            true => "Moves and marks are those of the first run.",
            false => "",
        };
        Plot { views, section: "", wide: true, marks: Vec::new(), note: note.into(), ..plot }
    };
    let (_, _, trace) = with_twin[0];
    let size = Plot { id: "all_error", title: "Size of the TCP error", ..error(trace) };
    let lateral = Plot { id: "all_path", title: "Distance from the path", ..path_over_length(trace) };
    let mut plots = vec![
        overlaid(size, "size", &|_, trace| Some(error(trace))),
        overlaid(lateral, "distance from the path", &|_, trace| Some(path_over_length(trace))),
    ];
    // A rigid run has no spectrum.
    if let Some(plot) = with_twin.iter().find_map(|(_, summary, trace)| spectrum(summary, trace)) {
        let plot = Plot { id: "all_spectrum", ..plot };
        plots.push(overlaid(plot, "all axes", &spectrum));
    }
    plots
}
