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
    let mut canvas = Canvas::new(scene, view, under);
    canvas.triangles(scene);
    canvas.outline();
    for mark in scene.marks {
        canvas.mark(mark);
    }
    canvas.image()
}

/// Where the outline of the triangles runs: how much of each pixel it covers, row by row.
pub fn outline_of(scene: &Scene<'_>, view: &View, width: usize, height: usize) -> Vec<f32> {
    let mut canvas = Canvas::new(scene, view, &Image::new(width, height, color::PAPER));
    canvas.triangles(scene);
    canvas.colors.fill(color::PAPER);
    canvas.outline();
    let full = 255.0 - f32::from(color::mix(color::PAPER, color::INK, OUTLINE_INK)[0]);
    canvas.image().rgba.chunks_exact(4).map(|pixel| (255.0 - f32::from(pixel[0])) / full).collect()
}

/// Colours and depths of all samples.
struct Canvas {
    view: View,
    width: usize,
    height: usize,
    colors: Vec<Rgb>,
    /// Nearness to the viewer, samples; minus infinity where there is nothing.
    depths: Vec<f32>,
    /// Size of the scene, samples.
    size: f64,
}

impl Canvas {
    fn new(scene: &Scene<'_>, view: &View, under: &Image) -> Self {
        let (width, height) = (FINE * under.width, FINE * under.height);
        let fine = FINE as f64;
        let view = View { scale: view.scale * fine, origin: view.origin.map(|x| x * fine), ..*view };
        let used = scene.triangles.as_flattened().iter().map(|v| scene.positions[*v as usize]);
        let limits = used.fold(None, |limits: Option<(Vector3<f64>, Vector3<f64>)>, p| {
            Some(limits.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))))
        });
        let size = limits.map_or(0.0, |(low, high)| (high - low).norm()) * view.scale;
        let samples = width * height;
        let below = |at: usize| under.pixel(at % width / FINE, at / width / FINE);
        let (colors, depths) = ((0..samples).map(below).collect(), vec![f32::NEG_INFINITY; samples]);
        Self { view, width, height, colors, depths, size }
    }

    fn triangles(&mut self, scene: &Scene<'_>) {
        let View { right, up, toward, .. } = self.view;
        let projected: Vec<[f64; 3]> = scene.positions.iter().map(|p| self.view.project(p)).collect();
        let normals = corner_normals(scene.positions, scene.triangles);
        for (number, (triangle, normals)) in scene.triangles.iter().zip(&normals).enumerate() {
            let corners = triangle.map(|v| projected[v as usize]);
            let light = normals.map(|n| brightness(right.dot(&n), up.dot(&n), toward.dot(&n)));
            let own = |values: &[f64]| triangle.map(|v| values[v as usize]);
            let mean = |w: [f64; 3], x: [f64; 3]| w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
            match scene.paint {
                Paint::Faces { colors, bright, side } => {
                    let (colors, side) = (colors[number], own(side));
                    let light = if bright[number] { light.map(|light| 0.68 + 0.32 * light) } else { light };
                    self.triangle(corners, |w| lit(colors[usize::from(mean(w, side) > 0.0)], mean(w, light)));
                }
                Paint::Magnitude { values, peak } => {
                    let values = own(values);
                    self.triangle(corners, |w| lit(color::magnitude(mean(w, values) / peak), mean(w, light)));
                }
            }
        }
    }

    /// Calls with index, depth and weights of every sample in a triangle.
    fn samples(&self, [a, b, c]: [[f64; 3]; 3], mut call: impl FnMut(usize, f64, [f64; 3])) {
        let double = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if double == 0.0 {
            return;
        }
        let range = |k: usize, end: usize| {
            let low = (a[k].min(b[k]).min(c[k]) - 0.5).ceil().max(0.0);
            let high = (a[k].max(b[k]).max(c[k]) + 0.5).floor().min(end as f64).max(0.0);
            low as usize..high as usize
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let share = |p: [f64; 3], q: [f64; 3]| ((p[0] - px) * (q[1] - py) - (p[1] - py) * (q[0] - px)) / double;
                let w = [share(b, c), share(c, a), share(a, b)];
                if w.iter().all(|w| *w >= -1e-9) {
                    call(y * self.width + x, w[0] * a[2] + w[1] * b[2] + w[2] * c[2], w);
                }
            }
        }
    }

    fn triangle(&mut self, corners: [[f64; 3]; 3], color: impl Fn([f64; 3]) -> Rgb) {
        let (mut colors, mut depths) = (std::mem::take(&mut self.colors), std::mem::take(&mut self.depths));
        self.samples(corners, |at, depth, w| {
            if depth as f32 > depths[at] {
                depths[at] = depth as f32;
                colors[at] = color(w);
            }
        });
        (self.colors, self.depths) = (colors, depths);
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
        let (width, height) = (self.width / FINE, self.height / FINE);
        let mut image = Image::new(width, height, color::PAPER);
        for (number, pixel) in image.rgba.chunks_exact_mut(4).enumerate() {
            let (x, y) = (FINE * (number % width), FINE * (number / width));
            for (channel, out) in pixel.iter_mut().take(3).enumerate() {
                let samples =
                    (0..FINE * FINE).map(|k| self.colors[(y + k / FINE) * self.width + x + k % FINE][channel]);
                *out = (samples.map(usize::from).sum::<usize>() / (FINE * FINE)) as u8;
            }
        }
        image
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
