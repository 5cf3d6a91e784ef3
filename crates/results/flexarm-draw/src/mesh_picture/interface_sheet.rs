//! The sheet of tied nodes and of the cut of the link: three views and a legend.
//!
//! Start at [`draw`]. Frames: L link (all vectors in L, in m), A and B interfaces, S split.
//! Not here: drawing of triangles ([`super::scene`]), the text of the legend ([`super::legend`]).

use nalgebra::Vector3;
use rayon::prelude::*;

use flexarm_fem::reduction::{Interface, Tie};

use super::MeshPictures;
use super::color;
use super::draw::{Align, Style};
use super::image::{Image, Rgb};
use super::legend::{self, LEGEND};
use super::numbers;
use super::scene::{Mark, Paint, Scene, render};
use super::sheet::{self, HEAD, HEIGHT, WIDTH};
use super::surface::Tied;
use super::topology::feature_edges;
use super::view::{LinkAxes, View, side_name};

/// Maximum number of spokes drawn between a frame and its nodes.
const SPOKES: usize = 40;
/// Length of the axes of a frame, as a share of the size of the body.
const TRIAD: f64 = 0.065;
/// Opacity of the cut plane.
const GLASS: f64 = 0.20;

/// Draws the sheet.
pub(super) fn draw(pictures: &MeshPictures<'_>) -> Image {
    let (reduction, interfaces) = (pictures.reduction, pictures.interfaces);
    let tied: Vec<Tied> = interfaces.iter().map(|i| pictures.surface.tied(pictures.mesh, i)).collect();
    let mut sheet = sheet::sheet(&format!("{}: what is tied, where it is cut", reduction.link.name), "link axes x y z");

    let axes = &pictures.axes;
    let first = best_side(axes, &tied);
    // From two opposite sides, every flat face is visible once.
    let sides = [(first, "seen from"), (-first, "the other side, from"), (-axes.across, "edge on, from")];
    let content = Content::new(pictures, &tied);
    let (width, height) = (WIDTH - LEGEND, (HEIGHT - HEAD) / sides.len());
    let panel = |(row, (toward, title)): (usize, &(Vector3<f64>, &str))| {
        let (title, is_last) = (format!("{title} {}", side_name(toward)), row + 1 == sides.len());
        content.panel(pictures, toward, [width, height], &title, is_last)
    };
    let panels: Vec<Image> = sides.par_iter().enumerate().map(panel).collect();
    for (row, panel) in panels.iter().enumerate() {
        sheet.paste(panel, 0, HEAD + row * height);
        if row > 0 {
            sheet.fill(0.0, (HEAD + row * height) as f64, width as f64, 1.0, color::RULE);
        }
    }
    sheet.fill(width as f64, HEAD as f64, 1.0, (HEIGHT - HEAD) as f64, color::RULE);
    legend::draw(&mut sheet, pictures, &tied);
    sheet
}

/// Returns the tilted direction from which the largest area of tied faces is visible.
pub(super) fn best_side(axes: &LinkAxes, tied: &[Tied]) -> Vector3<f64> {
    let (turn, tilt) = (28_f64.to_radians(), 26_f64.to_radians());
    let half = std::f64::consts::PI;
    let mut best = (f64::MIN, Vector3::zeros());
    for (turn, tilt) in [
        (-turn, tilt),
        (turn, tilt),
        (-turn, -tilt),
        (turn, -tilt),
        (half - turn, tilt),
        (half + turn, tilt),
        (half - turn, -tilt),
        (half + turn, -tilt),
    ] {
        let toward = axes.viewpoint(turn, tilt);
        // The second interface has a slightly larger weight, since it is the one that moves.
        let visible =
            |(number, tied): (usize, &Tied)| (if number == 1 { 1.1 } else { 1.0 }) * tied.normal.dot(&toward).max(0.0);
        let visible: f64 = tied.iter().enumerate().map(visible).sum();
        if visible > best.0 + 1e-9 {
            best = (visible, toward);
        }
    }
    best.1
}

/// Content shared by all views.
struct Content {
    colors: Vec<[Rgb; 2]>,
    /// Whether a triangle is tied.
    bright: Vec<bool>,
    /// Distance from the cut plane, positive on the side of B.
    side: Vec<f64>,
    /// Corners of the cut plane.
    glass: Vec<Vector3<f64>>,
    marks: Vec<Mark>,
    /// Spacing of tied nodes, m.
    spacing: Vec<f64>,
}

impl Content {
    fn new(pictures: &MeshPictures<'_>, tied: &[Tied]) -> Self {
        // Colours: the two parts of the link, and tied faces.
        let (surface, link) = (&pictures.surface, &pictures.reduction.link);
        let mut colors = vec![[color::PROXIMAL, color::DISTAL]; surface.triangles.len()];
        let mut bright = vec![false; surface.triangles.len()];
        for (number, tied) in tied.iter().enumerate() {
            for (triangle, _) in tied.triangles.iter().enumerate().filter(|(_, tied)| **tied) {
                colors[triangle] = [color::interface(number); 2];
                bright[triangle] = true;
            }
        }
        // The cut is orthogonal to AB at the split.
        let p_LS = link.split.X_LS.translation.vector;
        let normal = link.p_AB().try_normalize(0.0).unwrap_or(pictures.axes.along);
        let side: Vec<f64> = surface.positions.iter().map(|p| normal.dot(&(p - p_LS))).collect();
        let section = section(&surface.positions, &surface.triangles, &side);
        let glass = glass(&section, &p_LS, &normal, &pictures.axes, surface.size);

        // Edges of the body, cut plane with its section, ties.
        let mut marks = Vec::new();
        marks.extend(sheet::edges(&surface.positions, &surface.features, 1.0, color::INK, [0.75, 0.0]));
        marks.push(Mark::Polygon { corners: glass.clone(), color: color::CUT, alpha: [GLASS, 0.05] });
        let line = |from, to, width, color, alpha| Mark::Line { from, to, width, color, alpha };
        for k in 0..glass.len() {
            marks.push(line(glass[k], glass[(k + 1) % glass.len()], 1.6, color::CUT, [1.0, 0.12]));
        }
        for [from, to] in section {
            marks.push(line(from, to, 2.4, color::CUT, [1.0, 0.10]));
        }
        for (number, (interface, tied)) in pictures.interfaces.iter().zip(tied).enumerate() {
            // Their rim is also visible from the edge and from behind.
            let of_faces = surface.triangles.iter().zip(&tied.triangles).filter(|(_, tied)| **tied);
            let rim = feature_edges(&surface.positions, &of_faces.map(|(t, _)| *t).collect::<Vec<_>>());
            marks.extend(sheet::edges(&surface.positions, &rim, 3.4, color::interface(number), [1.0, 0.22]));
            let origin = interface.X_LI.translation.vector;
            for node in spokes(pictures, interface, tied) {
                spoke(&mut marks, origin, node, interface.tie, color::interface(number), surface.size);
            }
        }
        let spacing = tied.iter().zip(pictures.interfaces).map(|(tied, interface)| {
            if tied.faces == 0 { f64::MAX } else { (tied.area / interface.nodes.len().max(1) as f64).sqrt() }
        });
        Self { colors, bright, side, glass, marks, spacing: spacing.collect() }
    }

    /// Draws the body with its tied faces, seen from `toward` (link axes).
    fn panel(
        &self,
        pictures: &MeshPictures<'_>,
        toward: &Vector3<f64>,
        [width, height]: [usize; 2],
        title: &str,
        with_ruler: bool,
    ) -> Image {
        let (surface, axes) = (&pictures.surface, &pictures.axes);
        let tips = pictures.interfaces.iter().flat_map(|i| {
            (0..3).map(|k| (i.X_LI * nalgebra::Point3::from(Vector3::ith(k, 1.35 * TRIAD * surface.size))).coords)
        });
        let points = surface.positions.iter().copied().chain(tips).chain(self.glass.iter().copied());
        let frame = [96.0, 30.0, width as f64 - 150.0, height as f64 - 48.0];
        let view = View::fit(*toward, axes.along, points, frame);

        // Marks, those of this view first and last.
        let mut marks = self.grid(pictures, &view);
        marks.extend(self.marks.iter().cloned());
        marks.extend(self.dots(pictures, &view));
        let length = TRIAD * surface.size;
        let split = pictures.reduction.link.split.X_LS;
        for X in pictures.interfaces.iter().map(|i| i.X_LI) {
            marks.extend(triad(&X, length));
        }
        let at = split.translation.vector;
        for (diameter, color) in [(15.0, color::PAPER), (11.0, color::CUT)] {
            marks.push(Mark::Dot { at, diameter, color, alpha: [1.0, 1.0] });
        }
        let paint = Paint::Faces { colors: &self.colors, bright: &self.bright, side: &self.side };
        let scene = Scene { positions: &surface.positions, triangles: &surface.triangles, paint, marks: &marks };
        let mut image = render(&scene, &view, width, height);

        // Letters of the axes, names, compass and title over the picture.
        for (number, interface) in pictures.interfaces.iter().enumerate() {
            for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
                let tip = interface.X_LI * nalgebra::Point3::from(Vector3::ith(k, 1.22 * length));
                let [x, y, _] = view.project(&tip.coords);
                let style = Style::new(13.0, color::axis(k)).bold().halo(color::PAPER);
                // An axis that points at the viewer has no space for its letter.
                let [x0, y0, _] = view.project(&interface.X_LI.translation.vector);
                if (x - x0).hypot(y - y0) > 14.0 {
                    image.text(name, [x, y + 5.0], Align::Middle, style);
                }
            }
            let at = interface.X_LI.translation.vector;
            sheet::label(&mut image, &view, &at, &interface.name, 26.0, color::interface(number));
        }
        sheet::label(&mut image, &view, &at, "S", 24.0, color::CUT);
        sheet::compass(&mut image, &view);
        image.text(title, [20.0, 24.0], Align::Left, Style::new(16.0, color::INK).bold().halo(color::PAPER));
        if with_ruler {
            ruler(&mut image, &view);
        }
        image
    }

    /// Returns the edges of the elements, fainter for finer meshes.
    fn grid(&self, pictures: &MeshPictures<'_>, view: &View) -> Vec<Mark> {
        let surface = &pictures.surface;
        let length = |[a, b]: &[u32; 2]| (surface.positions[*a as usize] - surface.positions[*b as usize]).norm();
        let mean = surface.grid.iter().map(length).sum::<f64>() / surface.grid.len().max(1) as f64;
        let alpha = 0.20 * ((mean * view.scale - 2.0) / 8.0).clamp(0.0, 1.0);
        if alpha == 0.0 {
            return Vec::new();
        }
        sheet::edges(&surface.positions, &surface.grid, 0.7, color::INK, [alpha, 0.0]).collect()
    }

    /// Returns the tied nodes.
    fn dots(&self, pictures: &MeshPictures<'_>, view: &View) -> Vec<Mark> {
        let mut marks = Vec::new();
        for (number, (interface, spacing)) in pictures.interfaces.iter().zip(&self.spacing).enumerate() {
            // Without a tied face, show only the nodes.
            if *spacing == f64::MAX {
                let at = interface.nodes.iter().map(|node| pictures.mesh.nodes[*node as usize]);
                let color = color::interface(number);
                marks.extend(at.map(|at| Mark::Dot { at, diameter: 11.0, color, alpha: [1.0, 0.3] }));
                continue;
            }
            let diameter = (0.36 * spacing * view.scale).min(4.5);
            if diameter < 1.2 {
                continue;
            }
            let color = color::mix(color::interface(number), color::INK, 0.5);
            let at = interface.nodes.iter().map(|node| pictures.mesh.nodes[*node as usize]);
            marks.extend(at.map(|at| Mark::Dot { at, diameter, color, alpha: [0.9, 0.0] }));
        }
        marks
    }
}

/// Returns the intersection of the surface with the cut plane.
fn section(positions: &[Vector3<f64>], triangles: &[[u32; 3]], side: &[f64]) -> Vec<[Vector3<f64>; 2]> {
    let cut = |triangle: &[u32; 3]| {
        let mut ends = Vec::new();
        for k in 0..3 {
            let [a, b] = [triangle[k] as usize, triangle[(k + 1) % 3] as usize];
            if (side[a] > 0.0) != (side[b] > 0.0) {
                let at = side[a] / (side[a] - side[b]);
                ends.push(positions[a] + (positions[b] - positions[a]) * at);
            }
        }
        <[Vector3<f64>; 2]>::try_from(ends).ok()
    };
    triangles.iter().filter_map(cut).collect()
}

/// Returns a rectangle in the cut plane, slightly larger than the section.
fn glass(
    section: &[[Vector3<f64>; 2]],
    p_LS: &Vector3<f64>,
    normal: &Vector3<f64>,
    axes: &LinkAxes,
    size: f64,
) -> Vec<Vector3<f64>> {
    // Across the link, unless AB has that direction.
    let level = |axis: Vector3<f64>| (axis - normal * normal.dot(&axis)).try_normalize(0.1);
    let side = level(axes.across).or_else(|| level(axes.along)).unwrap_or(axes.out);
    let other = normal.cross(&side);
    let around = |axis: &Vector3<f64>| {
        let at_split = axis.dot(p_LS);
        let (low, high) = section
            .as_flattened()
            .iter()
            .map(|p| axis.dot(p))
            .fold((at_split, at_split), |(a, b), x| (a.min(x), b.max(x)));
        (low - at_split - 0.035 * size, high - at_split + 0.035 * size)
    };
    let ((a, b), (c, d)) = (around(&side), around(&other));
    [(a, c), (b, c), (b, d), (a, d)].map(|(u, v)| p_LS + side * u + other * v).to_vec()
}

/// Selects some of the tied nodes, evenly around the frame.
fn spokes(pictures: &MeshPictures<'_>, interface: &Interface, tied: &Tied) -> Vec<Vector3<f64>> {
    let origin = interface.X_LI.translation.vector;
    let axis = tied.normal.try_normalize(0.3).unwrap_or(pictures.axes.along);
    let start = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    let other = axis.cross(&start);
    let mut around: Vec<(f64, u32)> = interface
        .nodes
        .iter()
        .map(|node| {
            let r = pictures.mesh.nodes[*node as usize] - origin;
            (other.dot(&r).atan2(start.dot(&r)), *node)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let step = around.len().div_ceil(SPOKES).max(1);
    around.iter().step_by(step).map(|(_, node)| pictures.mesh.nodes[*node as usize]).collect()
}

/// Draws a tie between frame and node: a line if rigid, dashes if distributing.
fn spoke(marks: &mut Vec<Mark>, from: Vector3<f64>, to: Vector3<f64>, tie: Tie, color: Rgb, size: f64) {
    let color = color::mix(color, color::INK, 0.40);
    let mut line = |from, to| marks.push(Mark::Line { from, to, width: 1.0, color, alpha: [0.65, 0.14] });
    if tie == Tie::Rigid {
        return line(from, to);
    }
    let dashes = ((to - from).norm() / (0.012 * size)).ceil().clamp(1.0, 60.0) as usize;
    let at = |k: usize, part: f64| from + (to - from) * ((k as f64 + part) / dashes as f64);
    (0..dashes).for_each(|k| line(at(k, 0.0), at(k, 0.5)));
}

/// Returns the axes of a frame.
fn triad(X: &flexarm_fem::Pose, length: f64) -> Vec<Mark> {
    let origin = X.translation.vector;
    let axis = |k: usize| {
        let tip = origin + X.rotation * Vector3::ith(k, length);
        sheet::arrow(origin, tip, 2.6, color::axis(k), [1.0, 0.55])
    };
    let mut marks: Vec<Mark> = (0..3).flat_map(axis).collect();
    marks.push(Mark::Dot { at: origin, diameter: 7.0, color: color::INK, alpha: [1.0, 0.6] });
    marks
}

/// Draws a scale bar of round length.
fn ruler(image: &mut Image, view: &View) {
    let length = numbers::round_below(180.0 / view.scale);
    let (right, y) = (image.width as f64 - 24.0, image.height as f64 - 16.0);
    let left = right - length * view.scale;
    for (from, to) in
        [([left, y], [right, y]), ([left, y - 5.0], [left, y + 5.0]), ([right, y - 5.0], [right, y + 5.0])]
    {
        image.line(from, to, 1.6, color::INK, 1.0);
    }
    let text = format!("{} mm", numbers::significant(length * 1e3, 1));
    image.text(&text, [(left + right) / 2.0, y - 8.0], Align::Middle, Style::new(14.0, color::INK));
}
