//! The sheet of a link's stress: both sides, coloured by the von Mises stress.
//!
//! Start at [`stress_sheet`]. Vectors in link axes, in m; stress in Pa, written in MPa.
//! Not here: the stress itself (`flexarm_fem`), drawing of triangles ([`super::scene`]).

use nalgebra::Vector3;

use super::color;
use super::draw::{Align, Style};
use super::image::Image;
use super::numbers;
use super::scene::{Mark, Paint, Scene, render};
use super::sheet::{self, HEAD, HEIGHT, WIDTH};
use super::topology::{feature_edges, triangle_normals};
use super::view::{LinkAxes, View};

/// Distance of a node from the surface when its visibility is found, over the length of the link.
const LIFT: f64 = 2e-3;

/// Stress on the surface of a link.
#[derive(Debug, Clone, Copy)]
pub struct StressPicture<'a> {
    /// Name of the link.
    pub link: &'a str,
    /// Text on the right of the heading.
    pub remark: &'a str,
    /// Text below each side.
    pub note: &'a str,
    /// Nodes of the surface, link axes, m.
    pub positions: &'a [Vector3<f64>],
    /// Triangles, as indices into the positions.
    pub triangles: &'a [[u32; 3]],
    /// Von Mises stress of each node, Pa.
    pub stress: &'a [f64],
    /// Worst nodes, with numbers in the picture; the stress of the first one is the end of the
    /// scale.
    pub worst: &'a [usize],
    /// From interface A to B.
    pub along: Vector3<f64>,
}

/// Draws the side on which the worst node is, and the opposite one.
///
/// # Panics
/// If a triangle or a worst node has an index beyond the positions or stresses.
pub fn stress_sheet(picture: &StressPicture<'_>) -> Image {
    let title = format!("{}: largest von Mises stress of the run", picture.link);
    let mut sheet = sheet::sheet(&title, picture.remark);
    let axes = LinkAxes::new(picture.positions, &picture.along);
    let toward = side_of_worst(picture, &axes);
    let edges = feature_edges(picture.positions, picture.triangles);
    let height = (HEIGHT - HEAD) / 2;
    for (row, toward) in [toward, -toward].into_iter().enumerate() {
        let places = picture.worst.iter().copied().enumerate();
        let visible: Vec<(usize, usize)> = places.filter(|(_, node)| is_visible(picture, *node, &toward)).collect();
        let panel = panel(picture, &edges, &visible, &axes, toward, [WIDTH, height]);
        sheet.paste(&panel, 0, HEAD + row * height);
    }
    sheet.fill(0.0, (HEAD + height) as f64, WIDTH as f64, 1.0, color::RULE);
    sheet
}

/// Whether no triangle is between a node and the viewer.
pub fn is_visible(picture: &StressPicture<'_>, node: usize, toward: &Vector3<f64>) -> bool {
    let start = picture.positions[node] + toward * (LIFT * picture.along.norm());
    let hides = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| picture.positions[corner as usize] - start);
        // The ray passes the triangle if it is on the same side of all three edges.
        let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| from.cross(&to).dot(toward));
        let is_through = sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0);
        let normal = (b - a).cross(&(c - a));
        is_through && a.dot(&normal) / toward.dot(&normal) > 0.0
    };
    !picture.triangles.iter().any(hides)
}

/// Direction across the link from which the worst node is seen.
pub fn side_of_worst(picture: &StressPicture<'_>, axes: &LinkAxes) -> Vector3<f64> {
    let worst = picture.worst.first().map_or(u32::MAX, |node| *node as u32);
    let around: Vec<[u32; 3]> = picture.triangles.iter().copied().filter(|corners| corners.contains(&worst)).collect();
    let normals = triangle_normals(picture.positions, &around);
    let normal: Vector3<f64> = normals.iter().map(|(normal, area)| normal * *area).sum();
    let across = normal - axes.along * axes.along.dot(&normal);
    across.try_normalize(1e-12).unwrap_or(axes.out)
}

/// Draws one view of the stress, with labels.
///
/// * `visible`: number and node of the worst places that face the viewer.
fn panel(
    picture: &StressPicture<'_>,
    edges: &[[u32; 2]],
    visible: &[(usize, usize)],
    axes: &LinkAxes,
    toward: Vector3<f64>,
    [width, height]: [usize; 2],
) -> Image {
    // The surface with its edges and a dot at each of the worst places.
    let peak = picture.worst.first().map_or(0.0, |node| picture.stress[*node]);
    let mut marks: Vec<Mark> = sheet::edges(picture.positions, edges, 1.0, color::FAINT, [0.5, 0.0]).collect();
    let dots = visible.iter().map(|(_, node)| Mark::Dot {
        at: picture.positions[*node],
        diameter: 9.0,
        color: color::INK,
        alpha: [0.9, 0.0],
    });
    marks.extend(dots);
    let frame = [110.0, 24.0, width as f64 - 150.0, height as f64 - 82.0];
    let view = View::fit(toward, axes.along, picture.positions.iter().copied(), frame);
    let paint = Paint::Magnitude { values: picture.stress, peak: if peak > 0.0 { peak } else { 1.0 } };
    let scene = Scene { positions: picture.positions, triangles: picture.triangles, paint, marks: &marks };
    let mut image = render(&scene, &view, width, height);
    // Numbers, axes, scale and note over the picture.
    for (number, node) in visible {
        let text = format!("{} {} MPa", number + 1, numbers::significant(1e-6 * picture.stress[*node], 3));
        sheet::label(&mut image, &view, &picture.positions[*node], &text, 15.0, color::INK);
    }
    sheet::compass(&mut image, &view);
    let megapascals = |stress: f64| format!("{} MPa", numbers::significant(1e-6 * stress, 3));
    let names = ["0".to_owned(), megapascals(0.5 * peak), megapascals(peak)];
    let bar = [width as f64 - 300.0, height as f64 - 44.0];
    sheet::color_bar(&mut image, bar, 250.0, names.each_ref().map(String::as_str));
    let style = Style::new(13.0, color::FAINT);
    image.text(picture.note, [width as f64 - 320.0, height as f64 - 33.0], Align::Right, style);
    image
}
