//! The sheets of link deformations: six unit loads at B, and modes with A clamped.
//!
//! Start at [`unit_loads`] and [`modes`]; both draw six [`Panel`]s. Displacements in link axes,
//! drawn with one scale per panel. Not here: drawing of triangles ([`super::scene`]).

use nalgebra::{Point3, Vector3, Vector6};
use rayon::prelude::*;

use super::color;
use super::draw::{Align, Style};
use super::image::{Image, Rgb};
use super::numbers;
use super::scene::{Mark, Paint, Scene, render};
use super::sheet::{self, HEAD, HEIGHT, WIDTH};
use super::view::View;
use super::{MeshPictures, PictureError, interface_sheet};

/// Peak displacement in the picture, as a share of the size of the body.
const SWING: f64 = 0.08;
/// Magnitude of the loads of the sheet (N or N m).
const LOAD: f64 = 1e3;
/// Colour of load symbols.
const LOAD_COLOR: Rgb = [214, 0, 110];
/// Number of panels of a sheet.
const PANELS: usize = 6;
/// Ratio of length to height in the picture above which there are two panels in a row, otherwise
/// three.
const LONG: f64 = 2.6;
/// Colour of edges on the coloured body, visible on dark and on light.
const EDGE: Rgb = [225, 228, 235];
/// Displacements below this share of the maximum are labelled zero.
const NOISE: f64 = 1e-6;

/// One panel.
struct Panel {
    title: String,
    /// The line below the title.
    remark: String,
    /// Displacement of every node, in the unit of `scale_names`.
    field: Vec<Vector3<f64>>,
    /// Labels of the ends and the middle of the colour bar.
    scale_names: fn(f64) -> [String; 3],
    /// Whether the field has a magnitude, unlike a mode.
    has_size: bool,
    /// Load drawn at B, at its displaced position in the picture.
    load: Option<Load>,
}

#[derive(Debug, Clone, Copy)]
struct Load {
    axis: usize,
    is_moment: bool,
    /// Displacement of B, in the unit of the field.
    u_B: Vector3<f64>,
}

/// Draws the sheet of unit loads.
pub(super) fn unit_loads(pictures: &MeshPictures<'_>) -> Image {
    let link = &pictures.reduction.link;
    let compliance = link.tip_compliance().ok();
    let [a, b] = [0, 1].map(|k| pictures.interfaces.get(k).map_or("", |i| i.name.as_str()));
    let panels = (0..6).map(|k| {
        let field: Vec<_> = pictures.field(&pictures.reduction.unit_loads, k).into_iter().map(|u| u * LOAD).collect();
        let (letter, unit) = if k < 3 { ('F', "kN") } else { ('M', "kN m") };
        let name = format!("{letter}{} = 1 {unit}", ["x", "y", "z"][k % 3]);
        let peak = pictures.peak(&field);
        let title = format!("{name}: {}", numbers::displacement(peak));
        let motion = compliance.map(|C| -> Vector6<f64> { C.column(k) * LOAD });
        let (u_B, theta_B) = motion
            .map_or_else(Default::default, |u| (u.fixed_rows::<3>(0).into_owned(), u.fixed_rows::<3>(3).into_owned()));
        let remark = motion.map(|_| {
            let moves = numbers::displacements(&u_B, NOISE * peak);
            let turns = numbers::rotations(&theta_B, NOISE * peak / pictures.surface.size);
            format!("{b} moves {moves}, turns {turns}")
        });
        let load = Some(Load { axis: k % 3, is_moment: k >= 3, u_B });
        let scale_names = |peak: f64| ["0".into(), numbers::displacement(peak / 2.0), numbers::displacement(peak)];
        Panel { title, remark: remark.unwrap_or_default(), field, scale_names, has_size: true, load }
    });
    let title = format!("{}: 1 kN and 1 kN m at {b}, {a} held", link.name);
    draw(pictures, &title, "peak displacement in the titles; linear, so 2 kN give twice as much", panels.collect())
}

/// Draws the sheet of modes.
pub(super) fn modes(pictures: &MeshPictures<'_>) -> Result<Image, PictureError> {
    let (link, modes) = (&pictures.reduction.link, &pictures.reduction.held_modes);
    // The checks have the frequencies of the reduced models for comparison.
    let checks = link.details.as_ref().and_then(|details| details.gate.as_ref()).map(|gate| gate.modes.as_slice());
    let panels: Vec<Panel> = modes
        .frequencies_hz()
        .iter()
        .take(PANELS)
        .enumerate()
        .map(|(k, hz)| {
            let check = checks.and_then(|checks| checks.get(k));
            let against = |name: &str, other: Option<f64>| {
                other.map(|other| {
                    let error = 100.0 * (other / hz - 1.0);
                    format!("{name} {} Hz ({error:+.1} %)", numbers::significant(other, 4))
                })
            };
            let remark = check.map(|check| {
                let reduced = against("reduced", check.reduced_hz);
                let parts: Vec<_> = reduced.into_iter().chain(against("two rigid parts", check.lumped_hz)).collect();
                parts.join(", ")
            });
            Panel {
                title: format!("mode {}: {} Hz", k + 1, numbers::significant(*hz, 4)),
                remark: remark.unwrap_or_default(),
                field: pictures.field(&modes.shapes, k),
                scale_names: |_| ["0".into(), "1/2".into(), "largest".into()],
                has_size: false,
                load: None,
            }
        })
        .collect();
    if panels.is_empty() {
        return Err(PictureError::NoModes);
    }
    let base = pictures.interfaces.first().map_or("", |i| i.name.as_str());
    Ok(draw(pictures, &format!("{}: modes with {base} held", link.name), "shapes have no size of their own", panels))
}

/// Draws the panels on a sheet, with lines between them.
fn draw(pictures: &MeshPictures<'_>, title: &str, remark: &str, panels: Vec<Panel>) -> Image {
    let mut sheet = sheet::sheet(title, remark);
    let tied: Vec<_> = pictures.interfaces.iter().map(|i| pictures.surface.tied(pictures.mesh, i)).collect();
    let toward = interface_sheet::best_side(&pictures.axes, &tied);
    let flat = View::fit(toward, pictures.axes.along, std::iter::empty(), [0.0, 0.0, 1.0, 1.0]);
    let extent = |axis: Vector3<f64>| {
        let along = pictures.surface.positions.iter().map(|p| axis.dot(p));
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    // Long links have two panels in a row.
    let columns = if extent(flat.right) > LONG * extent(flat.up) { 2 } else { 3 };
    let rows = PANELS / columns;
    let (width, height) = (WIDTH / columns, (HEIGHT - HEAD) / rows);
    let drawn: Vec<Image> = panels.par_iter().map(|panel| panel.draw(pictures, toward, [width, height])).collect();
    for (number, panel) in drawn.iter().enumerate() {
        sheet.paste(panel, number % columns * width, HEAD + number / columns * height);
    }
    for column in 1..columns {
        sheet.fill((column * width) as f64, HEAD as f64, 1.0, (HEIGHT - HEAD) as f64, color::RULE);
    }
    for row in 1..rows {
        sheet.fill(0.0, (HEAD + row * height) as f64, WIDTH as f64, 1.0, color::RULE);
    }
    sheet
}

impl Panel {
    /// Draws the deformed surface seen from `toward` (link axes), with the undeformed edges.
    fn draw(&self, pictures: &MeshPictures<'_>, toward: Vector3<f64>, [width, height]: [usize; 2]) -> Image {
        // Deformed surface, with a peak of fixed size in the picture.
        let surface = &pictures.surface;
        let peak = pictures.peak(&self.field);
        let scale = if peak > 0.0 { SWING * surface.size / peak } else { 0.0 };
        let positions = surface.deformed(&self.field, scale);
        let values: Vec<f64> = surface.nodes.iter().map(|node| self.field[*node as usize].norm()).collect();

        // Edges of the undeformed and the deformed body, and the load.
        let mut marks: Vec<Mark> = Vec::new();
        marks.extend(sheet::edges(&surface.positions, &surface.features, 0.9, color::FAINT, [0.45, 0.10]));
        marks.extend(sheet::edges(&positions, &surface.features, 1.1, EDGE, [0.60, 0.0]));
        let load = self.load.map(|load| symbol(pictures, &load, scale)).unwrap_or_default();
        marks.extend(load.iter().cloned());
        let ends = load.iter().filter_map(|mark| match mark {
            Mark::Line { from, to, .. } => Some([*from, *to]),
            _ => None,
        });
        let points = surface.positions.iter().chain(&positions).copied().chain(ends.flatten());
        let frame = [110.0, 64.0, width as f64 - 150.0, height as f64 - 122.0];
        let view = View::fit(toward, pictures.axes.along, points, frame);
        let paint = Paint::Magnitude { values: &values, peak: if peak > 0.0 { peak } else { 1.0 } };
        let scene = Scene { positions: &positions, triangles: &surface.triangles, paint, marks: &marks };
        let mut image = render(&scene, &view, width, height);

        // Names of the interfaces, axes, texts and scale.
        for (number, interface) in pictures.interfaces.iter().enumerate() {
            let moved = match self.load {
                Some(load) if number == 1 => load.u_B * scale,
                _ => Vector3::zeros(),
            };
            let at = interface.X_LI * Point3::origin() + moved;
            sheet::label(&mut image, &view, &at.coords, &interface.name, 19.0, color::interface(number));
        }
        sheet::compass(&mut image, &view);
        let left = 20.0;
        image.text(&self.title, [left, 29.0], Align::Left, Style::new(19.0, color::INK).bold());
        image.text(&self.remark, [left, 51.0], Align::Left, Style::new(14.0, color::FAINT));
        let names = (self.scale_names)(peak);
        let bar = [width as f64 - 300.0, height as f64 - 44.0];
        sheet::color_bar(&mut image, bar, 250.0, names.each_ref().map(String::as_str));
        if self.has_size && scale > 0.0 {
            let text = format!("drawn {} times as large", numbers::significant(scale, 2));
            let at = [width as f64 - 20.0, 28.0];
            image.text(&text, at, Align::Right, Style::new(14.0, color::FAINT));
        }
        image
    }
}

/// Draws the load at B: an arrow for a force, an arrow around its axis for a moment.
fn symbol(pictures: &MeshPictures<'_>, load: &Load, scale: f64) -> Vec<Mark> {
    let Some(B) = pictures.interfaces.get(1) else { return Vec::new() };
    let at = B.X_LI.translation.vector + load.u_B * scale;
    let size = pictures.surface.size;
    let axis: Vector3<f64> = Vector3::ith(load.axis, 1.0);
    let alpha = [1.0, 0.7];
    let width = 3.0;
    if !load.is_moment {
        return sheet::arrow(at, at + axis * (0.14 * size), width, LOAD_COLOR, alpha);
    }
    // Counter-clockwise about the axis, three quarters of a turn.
    let (radius, steps) = (0.075 * size, 36);
    let side = Vector3::ith((load.axis + 1) % 3, 1.0);
    let other = axis.cross(&side);
    let place = |k: usize| {
        let (sin, cos) = (f64::from(k as u32) / f64::from(steps) * 1.5 * std::f64::consts::PI).sin_cos();
        at + (side * cos + other * sin) * radius
    };
    let line = |from, to, width| Mark::Line { from, to, width, color: LOAD_COLOR, alpha };
    let count = steps as usize;
    let mut marks: Vec<Mark> = (1..count - 3).map(|k| line(place(k - 1), place(k), width)).collect();
    marks.extend(sheet::arrow(place(count - 8), place(count), width, LOAD_COLOR, alpha).into_iter().skip(1));
    marks.extend(sheet::arrow(at, at + axis * radius, 0.6 * width, LOAD_COLOR, alpha));
    marks
}
