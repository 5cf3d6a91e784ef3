//! What the viewer shows of a run, or of several: robots on the left, plots and text on the right.

use rerun::EntityPath;

use super::layout::Part;
use super::path;
use super::run::Seat;
use crate::RunHeader;

/// The robots, below them the result; beside them the error and its causes.
pub(crate) fn window(header: &RunHeader, seat: &Seat, labels: &[String]) -> Part {
    if !header.captions.is_empty() {
        return shapes(&seat.root(header));
    }
    let plot = |title: &str, parts: &[&str]| Part::plot(title, path(["plots"].iter().chain(parts)));
    let causes = [
        (!header.contributors.is_empty()).then(|| plot("Shares of the error [mm]", &["contributions"])),
        (!header.elements.is_empty()).then(|| plot("Deflections [mm, mrad]", &["elastic"])),
        (!header.elements.is_empty()).then(|| plot("Loads [N, N m]", &["elastic_load"])),
        Some(plot("Joint positions", &["joints", "position"])),
        Some(plot("Joint efforts", &["joints", "effort"])),
        Some(plot("Energy [J]", &["energy"])),
        header.has_rigid.then(|| plot("TCP rotation error [mrad]", &["tcp_error_rotation"])),
        Some(plot("Joint velocities", &["joints", "velocity"])),
        Some(plot("Solver", &["solver"])),
    ];
    // A recording of modes has neither a path nor events.
    let moves = !header.contributors.is_empty() || header.magnification > 0.0 || header.elements.is_empty();
    let mut right = Vec::new();
    match seat {
        Seat::InStudy(..) => {
            right.push((3.0, plot("TCP error of all runs [mm]", &["study", "error"])));
            right.push((3.0, plot("TCP error across the path [mm]", &["study", "lateral"])));
        }
        Seat::Alone if header.has_rigid => {
            right.push((3.0, plot("TCP error [mm], world axes", &["tcp_error"])));
            if moves {
                right.push((3.0, plot("TCP error [mm], along and across the path", &["tcp_error_path"])));
            }
        }
        Seat::Alone => {}
    }
    right.push((3.0, Part::Tabs(causes.into_iter().flatten().collect())));
    let summary = Part::text("Summary", path(["summary"]));
    let text = match moves {
        true => Part::Row(vec![(3.0, summary), (2.0, Part::log("Events", path(["events"])))]),
        false => summary,
    };
    let left = Part::Column(vec![(7.0, robots(header, seat, labels)), (2.6, text)]);
    Part::Row(vec![(3.0, left), (2.0, Part::Column(right))])
}

/// Shapes that have no size: the robot, what it shows now, and the list of all.
fn shapes(root: &EntityPath) -> Part {
    let title = "Shapes without a size (colour: how far a place moves, grey not at all, red most)";
    let scene = Part::scene(title, root.clone(), vec![format!("+ {root}/**")]);
    let right = vec![(1.0, Part::text("Now", path(["caption"]))), (4.0, Part::text("All", path(["summary"])))];
    Part::Row(vec![(3.0, scene), (2.0, Part::Column(right))])
}

/// Magnified and at life size, one behind the other.
fn robots(header: &RunHeader, seat: &Seat, labels: &[String]) -> Part {
    let factor = header.magnification;
    if let Seat::InStudy(..) = seat {
        let roots = labels.iter().map(|label| path([label]));
        let contents = roots.map(|root| format!("+ {root}/**")).collect();
        let title = format!("All runs, deflections x {factor}");
        return Part::scene(&title, EntityPath::root(), contents);
    }
    let root = seat.root(header);
    let without = |hidden: &[&str]| {
        let hidden = hidden.iter().map(|what| format!("- {root}/{what}/**"));
        std::iter::once(format!("+ {root}/**")).chain(hidden).collect()
    };
    let life_size =
        |title: &str| Part::scene(title, root.clone(), without(&["magnified", "path/magnified", "path/peak"]));
    let scale = 1e3 * header.color_scale_m;
    if !(header.has_rigid && factor > 0.0) {
        return life_size(&match header.has_rigid && scale > 0.0 {
            true => format!("Robot (colour: off the rigid robot, grey 0 to red {scale} mm)"),
            false => "Robot".to_owned(),
        });
    }
    let title = match header.meshes.is_empty() {
        true => format!("Deflections x {factor}"),
        false => format!("Deflections x {factor} (colour: off the rigid robot, grey 0 to red {scale} mm)"),
    };
    let magnified = Part::scene(&title, root.clone(), without(&["flexible", "path/flexible"]));
    Part::Tabs(vec![magnified, life_size("True scale")])
}
