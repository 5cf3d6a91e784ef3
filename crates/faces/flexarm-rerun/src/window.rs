//! Layout of the viewer for one or several runs: robots on the left, plots and text on the right.
//!
//! Not here: how a layout is encoded (`layout.rs`), what is drawn (`run.rs`).

use rerun::EntityPath;

use super::entity::path;
use super::layout::Part;
use super::run::RunRole;
use super::scenery;
use flexarm_log::{GaugeQuantity, RunHeader, STRESS_VIEW};

/// Lays out the robots with the result below, and the error and its causes beside them.
pub(crate) fn window(header: &RunHeader, role: &RunRole, labels: &[String]) -> Part {
    if !header.scenery.is_empty() {
        return scenery::window(header, &role.root(header));
    }
    if !header.captions.is_empty() {
        return shapes(&role.root(header));
    }
    let plot = |title: &str, parts: &[&str]| Part::plot(title, path(["plots"].iter().chain(parts)));
    // Plots of the first run of a study carry its label.
    let own = |title: &str| match role {
        RunRole::Alone => title.to_owned(),
        RunRole::InStudy(_, label) => format!("{label}: {}{}", title[..1].to_lowercase(), &title[1..]),
    };
    let cause = |title: &str, parts: &[&str]| plot(&own(title), parts);
    let shows = |quantity| header.gauges_of(quantity).next().is_some();
    let causes = [
        (!header.contributors.is_empty()).then(|| cause("Shares of the error [mm]", &["contributions"])),
        (!header.elements.is_empty()).then(|| cause("Deflections [mm, mrad]", &["elastic"])),
        (!header.elements.is_empty()).then(|| cause("Loads [N, N m]", &["elastic_load"])),
        shows(GaugeQuantity::Stress).then(|| cause("Stress [MPa]", &["stress"])),
        shows(GaugeQuantity::Strain).then(|| cause("Strain [µm/m]", &["strain"])),
        Some(cause("Joint positions", &["joints", "position"])),
        Some(cause("Joint efforts", &["joints", "effort"])),
        Some(cause("Energy [J]", &["energy"])),
        Some(cause("Joint velocities", &["joints", "velocity"])),
        Some(cause("Solver", &["solver"])),
    ];
    // A recording of modes has neither a path nor events.
    let moves = !header.contributors.is_empty() || header.magnification > 0.0 || header.elements.is_empty();
    // At most two plots below each other: with little space the viewer labels an axis at powers
    // of ten only.
    let errors = match role {
        RunRole::InStudy(..) => vec![
            plot("TCP error of all runs [mm]", &["study", "error"]),
            plot("Across the path [mm]", &["study", "lateral"]),
        ],
        RunRole::Alone if header.has_rigid => [
            Some(plot("TCP error [mm], world axes", &["tcp_error"])),
            moves.then(|| plot("Along and across the path [mm]", &["tcp_error_path"])),
            Some(plot("Rotation [mrad]", &["tcp_error_rotation"])),
        ]
        .into_iter()
        .flatten()
        .collect(),
        RunRole::Alone => Vec::new(),
    };
    let tabs = [errors, causes.into_iter().flatten().collect()];
    let right = tabs.into_iter().filter(|tabs| !tabs.is_empty()).map(|tabs| (1.0, Part::Tabs(tabs))).collect();
    let summary = Part::text("Summary", path(["summary"]));
    let text = match moves {
        true => {
            // The table of a study is wide.
            let share = if matches!(role, RunRole::Alone) { 1.0 } else { 1.7 };
            Part::Row(vec![(share, summary), (1.0, Part::log(&own("Events"), path(["events"])))])
        }
        false => summary,
    };
    let left = Part::Column(vec![(5.8, robots(header, role, labels)), (3.6, text)]);
    Part::Row(vec![(3.0, left), (2.0, Part::Column(right))])
}

/// Lays out mode shapes: the robot, the current caption, and the list of all.
fn shapes(root: &EntityPath) -> Part {
    let title = "Shapes without amplitude (colour: displacement, from grey, zero, to red, maximum)";
    let scene = Part::scene(title, root.clone(), vec![format!("+ {root}/**")]);
    let right = vec![(1.0, Part::text("Now", path(["caption"]))), (4.0, Part::text("All", path(["summary"])))];
    Part::Row(vec![(3.0, scene), (2.0, Part::Column(right))])
}

/// Lays out the magnified robot and the one at true scale as tabs.
fn robots(header: &RunHeader, role: &RunRole, labels: &[String]) -> Part {
    let factor = header.magnification;
    if let RunRole::InStudy(..) = role {
        let roots = labels.iter().map(|label| path([label]));
        let contents = roots.map(|root| format!("+ {root}/**")).collect();
        let title = format!("All runs, deflections x {factor}");
        return Part::scene(&title, EntityPath::root(), contents);
    }
    let root = role.root(header);
    let without = |hidden: &[&str]| {
        let hidden = hidden.iter().map(|what| format!("- {root}/{what}/**"));
        std::iter::once(format!("+ {root}/**")).chain(hidden).collect()
    };
    let life_size =
        |title: &str| Part::scene(title, root.clone(), without(&["magnified", "path/magnified", "path/peak"]));
    let mut tabs = match header.has_rigid && factor > 0.0 {
        false => vec![life_size("Robot")],
        true => {
            let title = format!("Deflections x {factor}");
            let magnified = Part::scene(&title, root.clone(), without(&["flexible", "path/flexible"]));
            vec![magnified, life_size("True scale")]
        }
    };
    tabs.extend(header.has_stress.then(|| scenery::view(STRESS_VIEW)));
    if tabs.len() == 1 { tabs.remove(0) } else { Part::Tabs(tabs) }
}
