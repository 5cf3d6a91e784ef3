//! A map as a recording for the Rerun viewer: coloured places, slices, iso-surfaces, compliance
//! ellipsoids, and the arm at the worst and at the best pose.
//!
//! All poses in the world; colours from the worst to the best value of the metric. Not here: the
//! map as a table (`table.rs`) or a page (`page.rs`).

use std::path::Path;

use flexarm_draw::palette::magnitude;
use flexarm_kinematics::{Data, forward_kinematics};
use flexarm_log::{Caption, CreateOptions, RecordingFormat, RunResult, Sample, Scenery, SceneryForm, TwinSample};
use nalgebra::{DVector, Matrix3, Rotation3, UnitQuaternion};

use super::columns::PLACE;
use super::iso_surface::iso_surface;
use super::region::Grid;
use super::{Map, MapPose, MapRequest};
use flexarm_chatter::rounded_down;
use flexarm_run::record::{link_frames, robot_header};
use flexarm_run::{Arm, Error, Robot};
use flexarm_settings::written::markdown;

/// Maximum number of points in a view; larger maps are thinned.
const MAX_POINTS: usize = 300_000;
/// Maximum number of ellipsoids.
const MAX_ELLIPSOIDS: usize = 400;
/// Duration for which each pose is shown (s).
const SHOWN_S: f64 = 2.0;
/// Fractions of the places with better values than the iso-surfaces.
const SURFACES: [f64; 2] = [0.25, 0.6];

/// Writes the recording, if this process can write the format.
pub(super) fn write(
    map: &Map,
    path: &Path,
    robot: &Robot,
    request: &MapRequest,
    arm: &Arm,
    grid: Option<&Grid>,
) -> Result<(), Error> {
    let options = CreateOptions::default().with_overwrite(request.overwrite);
    let Some(mut recorder) = RecordingFormat::Rrd.recorder(path, options) else { return Ok(()) };
    let posed = arm.operating_point()?;
    let mut header = robot_header(robot, posed.plant());
    header.trajectory = "map".into();
    header.elements = Vec::new();
    header.log_rate_hz = 1.0 / SHOWN_S;
    header.scenery = scenery(map, grid);
    header.description = text(map);
    let poses = [("worst pose", &map.worst), ("best pose", &map.best)];
    header.captions = poses
        .iter()
        .enumerate()
        .map(|(k, (name, pose))| {
            let text = format!("{name}: {} {} {}", map.by, quantity_text(&map.by, pose.value), readable(&map.by).1);
            Caption { from_s: k as f64 * SHOWN_S, text }
        })
        .collect();
    let model = &posed.plant().model;
    let frames = link_frames(robot, model);
    let (mut data, mut q) = (Data::new(model), DVector::zeros(model.nv()));
    let mut twin = |pose: &MapPose| {
        q.rows_mut(0, pose.q.len()).copy_from_slice(&pose.q);
        forward_kinematics(model, &mut data, &q);
        let zero = vec![0.0; pose.q.len()];
        TwinSample {
            q: pose.q.clone(),
            qdot: zero.clone(),
            effort: zero,
            X_WL: frames.iter().map(|frame| data.X_WF(frame)).collect(),
            X_WT: data.X_WF(posed.tool()),
            X_WS: Vec::new(),
        }
    };
    // The best pose twice, so that it is shown as long as the worst.
    let twins = [&map.worst, &map.best, &map.best].map(&mut twin);
    let links = twins.iter().flat_map(|twin| twin.X_WL.iter().map(|X| X.translation.vector.into()));
    header.volume = Some(around(places_of(map).chain(links)));
    recorder.begin(&header)?;
    for (k, twin) in twins.into_iter().enumerate() {
        let sample = Sample {
            time_s: k as f64 * SHOWN_S,
            step: k as u64,
            flexible: twin.clone(),
            rigid: twin,
            ..Sample::default()
        };
        recorder.record(&sample)?;
    }
    recorder.finish(&RunResult::default())?;
    Ok(())
}

/// Positions of all poses (m, world).
fn places_of(map: &Map) -> impl Iterator<Item = [f64; 3]> + '_ {
    (0..map.table.rows()).map(|k| [0, 1, 2].map(|c| map.table.row(k)[c]))
}

/// Bounding box of places.
fn around(places: impl Iterator<Item = [f64; 3]>) -> [[f64; 3]; 2] {
    places.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], place| {
        [[0, 1, 2].map(|c| low[c].min(place[c])), [0, 1, 2].map(|c| high[c].max(place[c]))]
    })
}

/// Returns factor and unit for the display of a quantity of a map, by its name.
pub fn readable(name: &str) -> (f64, &'static str) {
    let ends = [
        ("_m_per_n", 1e6, "mm/kN"),
        ("_rad_per_nm", 1e6, "mrad/(kN m)"),
        ("_rad", 1e3, "mrad"),
        ("_hz", 1.0, "Hz"),
        ("_m", 1e3, "mm"),
    ];
    let found = ends.iter().find(|(end, ..)| name.ends_with(end));
    found.map_or((1.0, ""), |(_, factor, unit)| (*factor, *unit))
}

/// Returns the title of a quantity with the unit of [`readable`], such as "compliance worst (mm/kN)".
pub fn titled(name: &str) -> String {
    let unit = readable(name).1;
    let words = ["_m_per_n", "_rad_per_nm", "_rad", "_hz", "_m"].iter().find_map(|end| name.strip_suffix(end));
    // The name of a link or joint stays as it is.
    let words = match name.strip_prefix("share_") {
        Some(element) => format!("share of {element}"),
        None => words.unwrap_or(name).replace('_', " "),
    };
    if unit.is_empty() { words } else { format!("{words} ({unit})") }
}

/// Formats a quantity for display, in the unit of [`readable`]; limits of depth are rounded down.
pub fn quantity_text(name: &str, value: f64) -> String {
    let shown = readable(name).0 * value;
    if name == "depth_m" { rounded_down(shown, 4) } else { format!("{shown:.4}") }
}

/// Columns with a view of their own, the one by which poses are compared first.
pub(super) fn shown(map: &Map) -> Vec<usize> {
    let wanted = [map.by.as_str(), "compliance_worst_m_per_n", "sag_m", "error_m", "frequency_1_hz"];
    let mut shown: Vec<usize> = Vec::new();
    for name in wanted {
        if let Some(k) = map.table.columns.iter().position(|column| column.name == name)
            && !shown.contains(&k)
        {
            shown.push(k);
        }
    }
    shown
}

/// Returns the description of the recording, Markdown.
fn text(map: &Map) -> String {
    let mut text =
        format!("# {}: {} of {} places are within reach\n\n", markdown(&map.robot), map.reachable, map.points);
    text += "Dark is low, light is high. The colour scale runs from the minimum to the 98th percentile of the \
             values.\n\n";
    text += "| view | minimum | median | maximum |\n| --- | --- | --- | --- |\n";
    for k in shown(map) {
        let name = &map.table.columns[k].name;
        let Some(spread) = map.quantities.get(name) else { continue };
        let unit = readable(name).1;
        let median = spread.quantiles.get("0.5").copied().unwrap_or(f64::NAN);
        let [low, middle, high] = [spread.min, median, spread.max].map(|x| quantity_text(name, x));
        let name = markdown(name);
        text += &format!("| {name} | {low} {unit} | {middle} {unit} | {high} {unit} |\n");
    }
    if let Some(placement) = &map.placement {
        let (worst, unit) = (quantity_text(&map.by, placement.worst), readable(&map.by).1);
        let [x, y, z] = placement.centre_m;
        text += &format!(
            "\nBest position of the workpiece: centre {x:.3}, {y:.3}, {z:.3} m; worst value in it {worst} \
                 {unit}.\n"
        );
    }
    text
}

/// Colour of a value on the scale.
fn color(value: f64, [low, high]: [f64; 2]) -> [u8; 4] {
    let [r, g, b] = magnitude(if high > low { (value - low) / (high - low) } else { 0.5 });
    [r, g, b, 255]
}

/// Returns the ends of the colour scale: minimum and 98th percentile, since the few largest values
/// would leave all others dark.
pub(super) fn scale(values: &[f64]) -> [f64; 2] {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    match sorted.len() {
        0 => [0.0, 0.0],
        n => [sorted[0], sorted[(0.98 * (n - 1) as f64).round() as usize]],
    }
}

/// Returns what the viewer shows beside the arm.
fn scenery(map: &Map, grid: Option<&Grid>) -> Vec<Scenery> {
    // Coloured places of each quantity, thinned, and those in the planes through the best place.
    let place = |k: usize| [0, 1, 2].map(|c| map.table.row(k)[c] as f32);
    let every = map.table.rows().div_ceil(MAX_POINTS).max(1);
    let rows: Vec<usize> = (0..map.table.rows()).step_by(every).collect();
    let size = size_of(map, grid);
    let mut all = Vec::new();
    for column in shown(map) {
        let name = map.table.columns[column].name.clone();
        let scale = scale(&map.table.at(column));
        let colors = |rows: &[usize]| rows.iter().map(|&k| color(map.table.row(k)[column], scale)).collect::<Vec<_>>();
        let points = |rows: &[usize], radius_m: f32| SceneryForm::Points {
            places: rows.iter().map(|&k| place(k)).collect(),
            colors: colors(rows),
            radius_m,
            labels: Vec::new(),
        };
        all.push(Scenery { view: name.clone(), name: "places".into(), form: points(&rows, 0.14 * size) });
        if let Some(grid) = grid {
            let slice = slices(map, grid);
            let view = format!("{name}, slices");
            all.push(Scenery { view, name: "slices".into(), form: points(&slice, 0.45 * size) });
        }
    }
    // Surfaces, ellipsoids, and marks in all views.
    if let Some(grid) = grid {
        all.extend(surfaces(map, grid));
    }
    all.extend(ellipsoids(map, size));
    let marks = SceneryForm::Points {
        places: vec![map.worst.place_m.map(|x| x as f32), map.best.place_m.map(|x| x as f32)],
        colors: vec![[255, 90, 70, 255], [110, 220, 130, 255]],
        radius_m: 0.3 * size,
        labels: vec!["worst".into(), "best".into()],
    };
    all.push(Scenery { view: String::new(), name: "marks".into(), form: marks });
    if let Some(placement) = &map.placement {
        let corners = [placement.lower_m, placement.upper_m].map(|corner| corner.map(|x| x as f32));
        let form = SceneryForm::Box { corners, color: [255, 255, 255, 255] };
        all.push(Scenery { view: String::new(), name: "workpiece".into(), form });
    }
    all
}

/// Distance of places (m); without a grid, 2 % of the longest edge.
fn size_of(map: &Map, grid: Option<&Grid>) -> f32 {
    let [low, high] = around(places_of(map));
    let edge = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    grid.map_or(0.02 * edge, |grid| grid.spacing_m) as f32
}

/// Rows in the three planes through the place of the best pose.
fn slices(map: &Map, grid: &Grid) -> Vec<usize> {
    let centre = grid.index(map.best_place());
    let within = |&k: &usize| {
        let index = grid.index(map.table.row(k)[PLACE] as usize);
        (0..3).any(|c| index[c] == centre[c])
    };
    (0..map.table.rows()).filter(within).collect()
}

/// Returns the iso-surfaces that enclose the best values.
fn surfaces(map: &Map, grid: &Grid) -> Vec<Scenery> {
    let Some(column) = map.table.columns.iter().position(|column| column.name == map.by) else { return Vec::new() };
    let values = map.by_place(column, grid);
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    if map.table.columns[column].more_is_better {
        sorted.reverse();
    }
    let scale = scale(&sorted);
    let (factor, unit) = readable(&map.by);
    let made = SURFACES.iter().filter_map(|share| {
        let level = *sorted.get((share * sorted.len() as f64) as usize)?;
        let surface = iso_surface(grid, &values, level);
        let [r, g, b, _] = color(level, scale);
        let form =
            SceneryForm::Surface { places: surface.places, triangles: surface.triangles, colors: vec![[r, g, b, 150]] };
        let name = format!("{:.3} {unit}", factor * level);
        matches!(&form, SceneryForm::Surface { triangles, .. } if !triangles.is_empty()).then(|| Scenery {
            view: format!("{}, surfaces", map.by),
            name,
            form,
        })
    });
    made.collect()
}

/// Returns the compliance ellipsoids at some of the places.
fn ellipsoids(map: &Map, size: f32) -> Option<Scenery> {
    let index = |name: &str| map.table.columns.iter().position(|column| column.name == name);
    let six = ["x", "y", "z", "xy", "xz", "yz"].map(|part| index(&format!("compliance_{part}_m_per_n")));
    let [x, y, z, xy, xz, yz] = six.iter().copied().collect::<Option<Vec<_>>>()?.try_into().ok()?;
    let worst = index("compliance_worst_m_per_n")?;
    let scale = scale(&map.table.at(worst));
    // An odd stride, so that the ellipsoids are not all in one plane of the grid.
    let every = map.table.rows().div_ceil(MAX_ELLIPSOIDS).max(1) | 1;
    let rows = (0..map.table.rows()).step_by(every);
    let apart = size * (every as f32).cbrt();
    let (mut places, mut half_axes_m, mut quaternions, mut colors) = (vec![], vec![], vec![], vec![]);
    for k in rows {
        let row = map.table.row(k);
        let C = Matrix3::new(row[x], row[xy], row[xz], row[xy], row[y], row[yz], row[xz], row[yz], row[z]);
        if !C.iter().all(|c| c.is_finite()) || C.amax() == 0.0 {
            continue;
        }
        let eigen = (C / C.amax()).symmetric_eigen();
        let mut R = eigen.eigenvectors;
        if R.determinant() < 0.0 {
            R.column_mut(2).neg_mut();
        }
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(R));
        let unit = 0.5 * f64::from(apart) * C.amax() / scale[1].max(f64::MIN_POSITIVE);
        half_axes_m.push([0, 1, 2].map(|c| (unit * eigen.eigenvalues[c].abs()) as f32));
        quaternions.push([q.i, q.j, q.k, q.w].map(|x| x as f32));
        places.push([0, 1, 2].map(|c| row[c] as f32));
        colors.push(color(row[worst], scale));
    }
    let form = SceneryForm::Ellipsoids { places, half_axes_m, quaternions, colors };
    Some(Scenery { view: "compliance ellipsoids".into(), name: "ellipsoids".into(), form })
}
