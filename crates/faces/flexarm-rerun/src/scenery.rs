//! Fixed objects around a robot: points, surfaces and ellipsoids of a map, with a view for each
//! group.

use flexarm_log::{RunHeader, Scenery, SceneryForm};
use rerun::{
    AlbedoFactor, AsComponents, Boxes3D, Color, Ellipsoids3D, EntityPath, Mesh3D, Points3D, Quaternion, Radius, Rgba32,
};

use super::entity::path;
use super::layout::Part;
use super::stream::{Result, RrdStream};

const ROOT: &str = "scenery";
/// Folder of the objects shown in all views.
const EVERYWHERE: &str = "everywhere";

/// Lays out one view per title, beside them the current caption and the summary.
pub(super) fn window(header: &RunHeader, robot: &EntityPath) -> Part {
    let mut titles: Vec<&str> = Vec::new();
    for scenery in &header.scenery {
        if !scenery.view.is_empty() && !titles.contains(&scenery.view.as_str()) {
            titles.push(&scenery.view);
        }
    }
    let scene = |title: &&str| {
        let contents = [robot.clone(), path([ROOT, title]), path([ROOT, EVERYWHERE])];
        Part::scene(title, EntityPath::root(), contents.iter().map(|at| format!("+ {at}/**")).collect())
    };
    let scenes = Part::Tabs(titles.iter().map(scene).collect());
    let right = vec![(1.0, Part::text("Now", path(["caption"]))), (4.0, Part::text("Map", path(["summary"])))];
    Part::Row(vec![(3.0, scenes), (1.6, Part::Column(right))])
}

/// Lays out the objects of one view.
pub(super) fn view(title: &str) -> Part {
    Part::scene(title, EntityPath::root(), vec![format!("+ {}/**", path([ROOT, title]))])
}

/// Writes a fixed object.
pub(super) fn write(stream: &RrdStream, scenery: &Scenery) -> Result<()> {
    let view = if scenery.view.is_empty() { EVERYWHERE } else { &scenery.view };
    stream.constant(&path([ROOT, view, &scenery.name]), &*archetype(&scenery.form))
}

/// Converts a form of the scenery to that of the viewer.
fn archetype(form: &SceneryForm) -> Box<dyn AsComponents> {
    let color = |[r, g, b, a]: &[u8; 4]| Color::from_unmultiplied_rgba(*r, *g, *b, *a);
    match form {
        SceneryForm::Points { places, colors, radius_m, labels } => {
            let points = Points3D::new(places.iter().copied())
                .with_radii([Radius::new_scene_units(*radius_m)])
                .with_colors(colors.iter().map(color));
            match labels.is_empty() {
                true => Box::new(points),
                false => Box::new(points.with_labels(labels.iter().map(String::as_str)).with_show_labels(true)),
            }
        }
        SceneryForm::Surface { places, triangles, colors } => {
            let mesh = Mesh3D::new(places.iter().copied()).with_triangle_indices(triangles.iter().copied());
            // One colour tints the whole mesh; otherwise there is one per vertex.
            match colors[..] {
                [[r, g, b, a]] => {
                    Box::new(mesh.with_albedo_factor(AlbedoFactor(Rgba32::from_unmultiplied_rgba(r, g, b, a))))
                }
                _ => Box::new(mesh.with_vertex_colors(colors.iter().map(color))),
            }
        }
        SceneryForm::Ellipsoids { places, half_axes_m, quaternions, colors } => Box::new(
            Ellipsoids3D::from_centers_and_half_sizes(places.iter().copied(), half_axes_m.iter().copied())
                .with_quaternions(quaternions.iter().map(|q| Quaternion::from_xyzw(*q)))
                .with_colors(colors.iter().map(color))
                .with_fill_mode(rerun::components::FillMode::Solid),
        ),
        SceneryForm::Box { corners, color: own } => {
            let [low, high] = corners;
            let size = [0, 1, 2].map(|c| high[c] - low[c]);
            Box::new(Boxes3D::from_mins_and_sizes([*low], [size]).with_colors([color(own)]))
        }
    }
}
