//! HTML page of a map: slices, histograms, the best and the worst pose, the best place of a
//! workpiece; a single file without scripts.

use std::fmt::Write as _;

use flexarm_draw::FieldPlot;
use flexarm_draw::charts::histogram;

use super::recording::{quantity_text, readable, scale, shown, titled};
use super::region::Grid;
use super::{Map, MapPose};
use flexarm_run::html_page::{ENDING, opening, warnings};
use flexarm_settings::written::markup;

/// Number of bars of a histogram.
const BARS: usize = 40;

/// Returns the page.
pub(super) fn html(map: &Map, grid: Option<&Grid>) -> String {
    let mut page = opening(&format!("Map of {}", map.robot));
    let _ = writeln!(page, "<p>{}</p>", markup(&in_short(map)));
    page += &warnings("", &map.caveats.iter().map(|caveat| caveat.message.clone()).collect::<Vec<_>>());
    // Answers first, then pictures and tables.
    if let Some(placement) = &map.placement {
        let [low, high] = [placement.lower_m, placement.upper_m].map(|c| c.map(|x| format!("{x:.3}")).join(", "));
        let centre = placement.centre_m.map(|x| format!("{x:.3}")).join(", ");
        let _ = writeln!(
            page,
            "<h2>Best position of the workpiece</h2>\n<p>Centre at <b>{centre} m</b> (from {low} to {high} m, {} \
             places). Worst {} in it: <b>{}</b>. The slices show its outline.</p>",
            placement.points,
            markup(&titled(&map.by)),
            quantity_text(&map.by, placement.worst)
        );
    }
    if let Some(grid) = grid {
        page += "<h2>Slices through the best place</h2>\n<p class=\"note\">B: best place, W: worst place, if they \
                 are in the plane. White: not reached. The colour scale ends at the 98th percentile of all \
                 values.</p>\n";
        for column in shown(map) {
            page += &slices(map, grid, column);
        }
    }
    page += &quantities(map);
    page += "<h2>Best and worst pose</h2>\n";
    page += &poses(map);
    page += "<h2>Distributions</h2>\n<div class=\"row\">\n";
    for column in shown(map) {
        page += &spread(map, column);
    }
    page += "</div>\n<p class=\"note\">Drives locked, small vibrations, collisions not checked.";
    for (what, file) in [("Every pose", &map.files.table), ("Recording", &map.files.rrd)] {
        if let Some(file) = file {
            let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
            let _ = write!(page, " {what}: {}.", markup(name));
        }
    }
    page + "</p>\n" + ENDING
}

/// Describes the map in a sentence or two.
fn in_short(map: &Map) -> String {
    let mut text = match &map.grid {
        Some(grid) => format!(
            "{} of {} places within reach, {} mm apart, with {} tool direction{}; {} poses.",
            map.reachable,
            map.points,
            (1e3 * grid.spacing_m * 1e3).round() / 1e3,
            grid.directions,
            if grid.directions == 1 { "" } else { "s" },
            map.poses
        ),
        None => format!("{} poses.", map.poses),
    };
    if map.wrench != [0.0; 6] {
        let [fx, fy, fz, tx, ty, tz] = map.wrench;
        let _ = write!(text, " Load at the TCP: {fx}, {fy}, {fz} N and {tx}, {ty}, {tz} N m (world axes).");
    }
    text + &format!(" Best and worst by {}.", titled(&map.by))
}

/// Returns the table of the distributions.
fn quantities(map: &Map) -> String {
    let mut table = "<h2>Quantities</h2>\n<table><tr><th>quantity</th><th>minimum</th>\
                     <th>5 %</th><th>median</th><th>95 %</th><th>maximum</th></tr>\n"
        .to_owned();
    for column in map.table.columns.iter().filter(|column| column.quantity) {
        let Some(spread) = map.quantities.get(&column.name) else { continue };
        let at = |part: &str| spread.quantiles.get(part).copied().unwrap_or(f64::NAN);
        let values = [spread.min, at("0.05"), at("0.5"), at("0.95"), spread.max];
        let (meaning, title) = (markup(&column.meaning), markup(&titled(&column.name)));
        let _ = write!(table, "<tr><td title=\"{meaning}\">{title}</td>");
        for value in values {
            let _ = write!(table, "<td>{}</td>", quantity_text(&column.name, value));
        }
        table += "</tr>\n";
    }
    table + "</table>\n"
}

/// Returns the table of the best and the worst pose.
fn poses(map: &Map) -> String {
    let mut table = "<table><tr><th></th><th>best</th><th>worst</th></tr>\n".to_owned();
    let mut row = |name: &str, value: &dyn Fn(&MapPose) -> String| {
        let _ = writeln!(table, "<tr><td>{name}</td><td>{}</td><td>{}</td></tr>", value(&map.best), value(&map.worst));
    };
    row("place (m)", &|pose| pose.place_m.map(|x| format!("{x:.3}")).join(", "));
    for (k, joint) in map.joints.iter().enumerate() {
        row(&markup(joint), &|pose| format!("{:.4}", pose.q[k]));
    }
    for column in map.table.columns.iter().filter(|column| column.quantity) {
        let name = markup(&titled(&column.name));
        let value = |pose: &MapPose| pose.quantities.get(&column.name).copied().unwrap_or(f64::NAN);
        row(&name, &|pose| quantity_text(&column.name, value(pose)));
    }
    table + "</table>\n"
}

/// Draws the three planes through the best place.
fn slices(map: &Map, grid: &Grid, column: usize) -> String {
    // Values of the best pose at each place, on one colour scale for the three planes.
    let values = map.by_place(column, grid);
    let (factor, unit) = readable(&map.table.columns[column].name);
    let [low, high] = scale(&values).map(|x| factor * x);
    let centre = grid.index(map.best_place());
    let mut row = format!("<h3>{}</h3>\n<div class=\"row\">\n", markup(&titled(&map.table.columns[column].name)));
    for (across, along, up) in [(1, 0, 2), (0, 1, 2), (2, 0, 1)] {
        let at = grid.place(map.best_place())[across];
        let axis = ["x", "y", "z"];
        let title = format!("{} = {at:.3} m", axis[across]);
        let count = [grid.count[along], grid.count[up]];
        let mut plane = Vec::with_capacity(count[0] * count[1]);
        for j in 0..count[1] {
            for i in 0..count[0] {
                let mut index = centre;
                (index[along], index[up]) = (i, j);
                plane.push(factor * values[index[0] + grid.count[0] * (index[1] + grid.count[1] * index[2])]);
            }
        }
        // Best and worst place, and the workpiece, where the plane meets them.
        let range = |c: usize| [grid.lower[c], grid.lower[c] + grid.spacing_m * (grid.count[c] - 1) as f64];
        let within = |place: &[f64; 3]| (place[across] - at).abs() < 0.5 * grid.spacing_m;
        let marked = [(&map.best.place_m, "B"), (&map.worst.place_m, "W")];
        let marks: Vec<([f64; 2], &str)> = marked
            .iter()
            .filter(|(place, _)| within(place))
            .map(|(place, letter)| ([place[along], place[up]], *letter))
            .collect();
        let outlines: Vec<[[f64; 2]; 2]> = map
            .placement
            .iter()
            .filter(|p| p.lower_m[across] <= at + 1e-9 && at - 1e-9 <= p.upper_m[across])
            .map(|p| [[p.lower_m[along], p.lower_m[up]], [p.upper_m[along], p.upper_m[up]]])
            .collect();
        let labels = [format!("{} (m)", axis[along]), format!("{} (m)", axis[up])];
        row += &FieldPlot {
            title: &title,
            labels: [&labels[0], &labels[1]],
            ranges: [range(along), range(up)],
            count,
            values: &plane,
            value_label: unit,
            scale: Some([low, high]),
            equal: true,
            outlines: &outlines,
            marks: &marks,
            names: None,
        }
        .svg();
    }
    row + "</div>\n"
}

/// Draws the histogram of a quantity over the poses.
fn spread(map: &Map, column: usize) -> String {
    let name = &map.table.columns[column].name;
    let factor = readable(name).0;
    let values: Vec<f64> = map.table.at(column).into_iter().map(|x| factor * x).collect();
    histogram(&titled(name), &values, BARS)
}
