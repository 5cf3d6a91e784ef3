//! A software renderer: triangles and marks in, an image out.
//!
//! Parallel projection, depth buffer, soft light from the upper left, four samples per pixel.
//! Start at [`render`]. Not here: what the triangles are.

use nalgebra::Vector3;

use super::color;
use super::draw::cover_line;
use super::image::{Image, Rgb};
use super::topology::corner_normals;
use super::view::View;

/// Samples per pixel in each direction.
const FINE: usize = 2;
/// A step in depth that gets an outline, as a share of the size of the scene.
const OUTLINE: f64 = 0.02;
/// How much ink an outline has.
const OUTLINE_INK: f64 = 0.65;
/// What lies on the surface is lifted towards the viewer by this share of the size of the scene.
const LIFT: f64 = 0.004;

/// How the triangles are coloured.
#[derive(Debug, Clone, Copy)]
pub enum Paint<'a> {
    /// Each triangle in a colour of its own, and another one where the value `side` of its points is positive.
    Faces {
        /// Colours of each triangle, for negative and for positive `side`.
        colors: &'a [[Rgb; 2]],
        /// Triangles that are to be seen by their colour and take little shade.
        bright: &'a [bool],
        /// One number per position.
        side: &'a [f64],
    },
    /// By a number at each position over `peak`, in the scale of [`color::magnitude`].
    Magnitude {
        /// One number per position.
        values: &'a [f64],
        /// The number at the upper end of the scale.
        peak: f64,
    },
}

/// What is drawn onto or around the triangles, in the order given.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A straight line.
    Line {
        /// One end, m.
        from: Vector3<f64>,
        /// The other end.
        to: Vector3<f64>,
        /// Pixels.
        width: f64,
        /// Colour.
        color: Rgb,
        /// How much it covers where it is in front, and where it is behind the body; 0 to 1.
        alpha: [f64; 2],
    },
    /// A disc that faces the viewer.
    Dot {
        /// Its centre, m.
        at: Vector3<f64>,
        /// Pixels.
        diameter: f64,
        /// Colour.
        color: Rgb,
        /// As for lines.
        alpha: [f64; 2],
    },
    /// A flat convex polygon.
    Polygon {
        /// Its corners in order, m.
        corners: Vec<Vector3<f64>>,
        /// Colour.
        color: Rgb,
        /// As for lines.
        alpha: [f64; 2],
    },
}

/// What there is to see.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// Positions, m, finite.
    pub positions: &'a [Vector3<f64>],
    /// Triangles, counter-clockwise from outside.
    pub triangles: &'a [[u32; 3]],
    /// Colours of the triangles.
    pub paint: Paint<'a>,
    /// Everything else.
    pub marks: &'a [Mark],
}

/// Draws a scene.
pub fn render(scene: &Scene<'_>, view: &View, width: usize, height: usize) -> Image {
    render_over(scene, view, &Image::new(width, height, color::PAPER))
}

/// Draws a scene over what is on an image already.
pub fn render_over(scene: &Scene<'_>, view: &View, under: &Image) -> Image {
    let mut canvas = Canvas::new(scene, view, [under.width, under.height]);
    canvas.triangles(scene);
    canvas.outline();
    canvas.lay_over(under);
    for mark in scene.marks {
        canvas.mark(mark);
    }
    canvas.image()
}

/// The triangles of a scene as they cover what is under them: drawn once, laid over any ground.
pub struct Layer(Canvas);

impl Layer {
    /// Draws the triangles; marks are left out.
    pub fn new(scene: &Scene<'_>, view: &View, width: usize, height: usize) -> Self {
        let mut canvas = Canvas::new(scene, view, [width, height]);
        canvas.triangles(scene);
        canvas.outline();
        Self(canvas)
    }

    /// The layer over an image of its size: what [`render_over`] draws, without marks.
    pub fn over(&self, under: &Image) -> Image {
        let mut image = under.clone();
        for (number, pixel) in image.rgba.chunks_exact_mut(4).enumerate() {
            let samples = self.0.samples_of(number);
            if samples.iter().all(|at| self.0.depths[*at] == f32::NEG_INFINITY) {
                continue;
            }
            for (channel, out) in pixel.iter_mut().take(3).enumerate() {
                let ground = *out;
                let color = |at: usize| match self.0.depths[at] {
                    f32::NEG_INFINITY => ground,
                    _ => self.0.colors[at][channel],
                };
                *out = (samples.map(|at| usize::from(color(at))).iter().sum::<usize>() / samples.len()) as u8;
            }
        }
        image
    }

    /// Where the outline of the triangles runs: how much of each pixel it covers, row by row.
    pub fn outline(&self) -> Vec<f32> {
        let (paper, ink) = (color::PAPER, color::mix(color::PAPER, color::INK, OUTLINE_INK));
        let full = 255.0 - f32::from(ink[0]);
        let (width, height) = (self.0.width / FINE, self.0.height / FINE);
        let mean = |number: usize| {
            let samples =
                self.0.samples_of(number).map(|at| usize::from(if self.0.lines[at] { ink } else { paper }[0]));
            (samples.iter().sum::<usize>() / samples.len()) as u8
        };
        (0..width * height).map(|number| (255.0 - f32::from(mean(number))) / full).collect()
    }
}

/// Colours and depths of all samples.
struct Canvas {
    view: View,
    width: usize,
    height: usize,
    colors: Vec<Rgb>,
    /// Nearness to the viewer, samples; minus infinity where there is nothing.
    depths: Vec<f32>,
    /// Where the outline of the triangles runs.
    lines: Vec<bool>,
    /// Size of the scene, samples.
    size: f64,
}

impl Canvas {
    /// For an image of this size, pixels.
    fn new(scene: &Scene<'_>, view: &View, size: [usize; 2]) -> Self {
        let [width, height] = size.map(|pixels| FINE * pixels);
        let fine = FINE as f64;
        let view = View { scale: view.scale * fine, origin: view.origin.map(|x| x * fine), ..*view };
        let used = scene.triangles.as_flattened().iter().map(|v| scene.positions[*v as usize]);
        let limits = used.fold(None, |limits: Option<(Vector3<f64>, Vector3<f64>)>, p| {
            Some(limits.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))))
        });
        let size = limits.map_or(0.0, |(low, high)| (high - low).norm()) * view.scale;
        let samples = width * height;
        let (colors, depths) = (vec![color::PAPER; samples], vec![f32::NEG_INFINITY; samples]);
        Self { view, width, height, colors, depths, lines: vec![false; samples], size }
    }

    /// Puts an image where there is nothing yet.
    fn lay_over(&mut self, under: &Image) {
        for (at, (color, depth)) in self.colors.iter_mut().zip(&self.depths).enumerate() {
            if *depth == f32::NEG_INFINITY {
                *color = under.pixel(at % self.width / FINE, at / self.width / FINE);
            }
        }
    }

    /// Places of the samples of a pixel.
    fn samples_of(&self, pixel: usize) -> [usize; FINE * FINE] {
        let width = self.width / FINE;
        let (x, y) = (FINE * (pixel % width), FINE * (pixel / width));
        std::array::from_fn(|k| (y + k / FINE) * self.width + x + k % FINE)
    }

    fn triangles(&mut self, scene: &Scene<'_>) {
        let View { right, up, toward, .. } = self.view;
        let projected: Vec<[f64; 3]> = scene.positions.iter().map(|p| self.view.project(p)).collect();
        let corners = |number: usize| scene.triangles[number].map(|v| projected[v as usize]);
        // Which triangle is nearest; what it looks like is asked where it is seen.
        let mut nearest = vec![u32::MAX; self.depths.len()];
        let mut depths = std::mem::take(&mut self.depths);
        for (triangle, number) in (0..scene.triangles.len()).zip(0_u32..) {
            self.samples(corners(triangle), |at, depth, _| {
                if depth as f32 > depths[at] {
                    (depths[at], nearest[at]) = (depth as f32, number);
                }
            });
        }
        self.depths = depths;

        let normals = corner_normals(scene.positions, scene.triangles);
        let mean = |w: [f64; 3], x: [f64; 3]| w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
        let light =
            |normals: &[Vector3<f64>; 3]| normals.map(|n| brightness(right.dot(&n), up.dot(&n), toward.dot(&n)));
        let lights: Vec<[f64; 3]> = normals.iter().map(light).collect();
        for (at, number) in nearest.into_iter().enumerate().filter(|(_, number)| *number != u32::MAX) {
            let number = number as usize;
            let Some(w) = Weights::new(corners(number)).map(|of| of.at(at % self.width, at / self.width)) else {
                continue;
            };
            let own = |values: &[f64]| scene.triangles[number].map(|v| values[v as usize]);
            let light = lights[number];
            self.colors[at] = match scene.paint {
                Paint::Faces { colors, bright, side } => {
                    let light = if bright[number] { light.map(|light| 0.68 + 0.32 * light) } else { light };
                    lit(colors[number][usize::from(mean(w, own(side)) > 0.0)], mean(w, light))
                }
                Paint::Magnitude { values, peak } => lit(color::magnitude(mean(w, own(values)) / peak), mean(w, light)),
            };
        }
    }

    /// Calls with index, depth and weights of every sample in a triangle.
    fn samples(&self, corners: [[f64; 3]; 3], mut call: impl FnMut(usize, f64, [f64; 3])) {
        let Some(weights) = Weights::new(corners) else { return };
        let [a, b, c] = corners;
        let range = |k: usize, end: usize| {
            let low = (a[k].min(b[k]).min(c[k]) - 0.5).ceil().max(0.0);
            let high = (a[k].max(b[k]).max(c[k]) + 0.5).floor().min(end as f64).max(0.0);
            low as usize..high as usize
        };
        let columns = range(0, self.width);
        for y in range(1, self.height) {
            let columns = if columns.len() > NARROW { weights.columns(y, columns.clone()) } else { columns.clone() };
            for x in columns {
                if weights.are_far_out(x, y) {
                    continue;
                }
                let w = weights.at(x, y);
                if w.iter().all(|w| *w >= -EDGE) {
                    call(y * self.width + x, w[0] * a[2] + w[1] * b[2] + w[2] * c[2], w);
                }
            }
        }
    }

    /// Darkens samples behind whose neighbours it goes down a long way: the outline of the body and of its limbs.
    fn outline(&mut self) {
        let step = (OUTLINE * self.size) as f32;
        let (width, height) = (self.width as isize, self.height as isize);
        for y in 0..height {
            for x in 0..width {
                let at = (y * width + x) as usize;
                let own = self.depths[at];
                if own == f32::NEG_INFINITY {
                    continue;
                }
                let falls = |dx: isize, dy: isize| {
                    let (x, y) = (x + dx, y + dy);
                    let inside = (0..width).contains(&x) && (0..height).contains(&y);
                    inside && own - self.depths[(y * width + x) as usize] > step
                };
                let count: u8 = [(1, 0), (-1, 0), (0, 1), (0, -1), (2, 0), (-2, 0), (0, 2), (0, -2)]
                    .map(|(dx, dy)| u8::from(falls(dx, dy)))
                    .iter()
                    .sum();
                if count > 0 {
                    self.lines[at] = true;
                    self.colors[at] = color::mix(self.colors[at], color::INK, OUTLINE_INK);
                }
            }
        }
    }

    fn mark(&mut self, mark: &Mark) {
        let fine = FINE as f64;
        match mark {
            Mark::Line { from, to, width, color, alpha } => self.line(from, to, width * fine, *color, *alpha),
            Mark::Dot { at, diameter, color, alpha } => {
                let [x, y, depth] = self.view.project(at);
                // Hidden or not as a whole, by what lies at its centre.
                let front = !(x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64)
                    || self.in_front(y as usize * self.width + x as usize, depth);
                let alpha = alpha[usize::from(!front)];
                let size = [self.width, self.height];
                cover_line(size, [x, y], [x, y], diameter * fine, |x, y, _, share| {
                    let at = y * size[0] + x;
                    self.colors[at] = color::mix(self.colors[at], *color, alpha * share);
                });
            }
            Mark::Polygon { corners, color, alpha } => {
                let projected: Vec<_> = corners.iter().map(|p| self.view.project(p)).collect();
                let mut touched = Vec::new();
                for k in 2..projected.len() {
                    self.samples([projected[0], projected[k - 1], projected[k]], |at, depth, _| {
                        touched.push((at, alpha[usize::from(!self.in_front(at, depth))]));
                    });
                }
                // Triangles share samples on their common side.
                touched.sort_unstable_by_key(|(at, _)| *at);
                touched.dedup_by_key(|(at, _)| *at);
                for (at, alpha) in touched {
                    self.colors[at] = color::mix(self.colors[at], *color, alpha);
                }
            }
        }
    }

    fn line(&mut self, from: &Vector3<f64>, to: &Vector3<f64>, width: f64, color: Rgb, alpha: [f64; 2]) {
        let (a, b) = (self.view.project(from), self.view.project(to));
        let size = [self.width, self.height];
        cover_line(size, [a[0], a[1]], [b[0], b[1]], width, |x, y, along, share| {
            let at = y * size[0] + x;
            let front = self.in_front(at, a[2] + (b[2] - a[2]) * along);
            self.colors[at] = color::mix(self.colors[at], color, alpha[usize::from(!front)] * share);
        });
    }

    fn in_front(&self, at: usize, depth: f64) -> bool {
        (depth + LIFT * self.size) as f32 >= self.depths[at]
    }

    /// Mean of the samples of each pixel.
    fn image(&self) -> Image {
        let mut image = Image::new(self.width / FINE, self.height / FINE, color::PAPER);
        for (number, pixel) in image.rgba.chunks_exact_mut(4).enumerate() {
            let samples = self.samples_of(number).map(|at| self.colors[at]);
            for (channel, out) in pixel.iter_mut().take(3).enumerate() {
                *out = (samples.map(|color| usize::from(color[channel])).iter().sum::<usize>() / samples.len()) as u8;
            }
        }
        image
    }
}

/// A sample belongs to a triangle if none of its weights is below minus this.
const EDGE: f64 = 1e-9;

/// So many samples of a row are looked at one by one: that costs no more than to ask where the triangle is in it.
const NARROW: usize = 8;
/// A side is steep if it moves down by more than this while twice the area to it changes by as much, samples.
const STEEP: f64 = 1e-3;

/// Weights of the corners of a triangle at the samples of a picture: 1 at its own corner, 0 on the side across.
struct Weights {
    corners: [[f64; 3]; 3],
    /// Twice the area, with the sign of the sense of rotation.
    double: f64,
    /// Twice the area of what has a weight surely below the edge, less than zero.
    far_out: f64,
}

impl Weights {
    /// None for a triangle without area.
    fn new(corners: [[f64; 3]; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let double = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        (double != 0.0).then(|| Self { corners, double, far_out: -1.001 * EDGE * double.abs() })
    }

    /// Twice the areas between a sample and the sides.
    fn areas(&self, x: usize, y: usize) -> [f64; 3] {
        let [a, b, c] = self.corners;
        let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
        let area = |p: [f64; 3], q: [f64; 3]| (p[0] - px) * (q[1] - py) - (p[1] - py) * (q[0] - px);
        [area(b, c), area(c, a), area(a, b)]
    }

    fn at(&self, x: usize, y: usize) -> [f64; 3] {
        self.areas(x, y).map(|area| area / self.double)
    }

    /// The part of a row that may be in the triangle: one sample more on either side than the sides say.
    fn columns(&self, y: usize, mut row: std::ops::Range<usize>) -> std::ops::Range<usize> {
        let (py, sign) = (y as f64 + 0.5, self.double.signum());
        let [a, b, c] = self.corners;
        for (p, q) in [(b, c), (c, a), (a, b)] {
            // Twice the area to a side is linear along the row: first + px slope.
            let slope = sign * (p[1] - q[1]);
            let first = sign * (p[0] * (q[1] - py) - q[0] * (p[1] - py));
            let limit = (self.far_out - first) / slope - 0.5;
            if slope > STEEP {
                row.start = row.start.max((limit - 1.0).max(0.0) as usize);
            } else if slope < -STEEP {
                row.end = row.end.min((limit + 2.0).max(0.0) as usize);
            }
        }
        row.start..row.end.max(row.start)
    }

    /// Whether a sample is not in the triangle, as far as that is seen without a division.
    fn are_far_out(&self, x: usize, y: usize) -> bool {
        let sign = self.double.signum();
        self.areas(x, y).iter().any(|area| sign * area < self.far_out)
    }
}

/// Light on a wall by its normal in axes of the picture: a key light from the upper left, one from the viewer.
fn brightness(right: f64, up: f64, toward: f64) -> f64 {
    // A wall seen from behind is lit like one seen from the front.
    let sign = if toward < 0.0 { -1.0 } else { 1.0 };
    let key = (sign * (-0.40 * right + 0.58 * up + 0.71 * toward)).max(0.0);
    0.62 + 0.34 * key + 0.12 * toward.abs()
}

/// A colour under light; more than full light whitens.
fn lit(color: Rgb, light: f64) -> Rgb {
    if light <= 1.0 { color.map(|c| (f64::from(c) * light) as u8) } else { color::mix(color, [255; 3], light - 1.0) }
}
