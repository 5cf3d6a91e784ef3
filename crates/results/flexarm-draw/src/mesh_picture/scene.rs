//! A software renderer: draws triangles and marks into an image.
//!
//! Parallel projection, depth buffer, soft light from the upper left, four samples per pixel. Start
//! at [`render`]. Not here: the meaning of the triangles.

use nalgebra::Vector3;

use super::color;
use super::draw::cover_line;
use super::image::{Image, Rgb};
use super::raster::cover;
use super::topology::corner_normals;
use super::view::View;

/// Samples per pixel in each direction.
const FINE: usize = 2;
/// Depth step that gets an outline, as a share of the size of the scene.
const OUTLINE: f64 = 0.02;
/// Opacity of an outline.
const OUTLINE_INK: f64 = 0.65;
/// Offset of marks on the surface towards the viewer, as a share of the size of the scene.
const LIFT: f64 = 0.004;

/// Colouring of the triangles.
#[derive(Debug, Clone, Copy)]
pub enum Paint<'a> {
    /// A colour for each triangle, and another one where the value `side` of its points is
    /// positive.
    Faces {
        /// Colours of each triangle, for negative and for positive `side`.
        colors: &'a [[Rgb; 2]],
        /// Triangles that should be recognised by their colour and get little shading.
        bright: &'a [bool],
        /// One number per position.
        side: &'a [f64],
    },
    /// Colour by a value at each position over `peak`, in the scale of [`color::magnitude`].
    Magnitude {
        /// One number per position.
        values: &'a [f64],
        /// Value at the upper end of the scale.
        peak: f64,
    },
}

/// A mark on or around the triangles; marks are drawn in the given order.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A straight line.
    Line {
        /// One end, m.
        from: Vector3<f64>,
        /// The other end.
        to: Vector3<f64>,
        /// Width, pixels.
        width: f64,
        /// Colour.
        color: Rgb,
        /// Opacity in front of and behind the body; 0 to 1.
        alpha: [f64; 2],
    },
    /// A disc that faces the viewer.
    Dot {
        /// Centre, m.
        at: Vector3<f64>,
        /// Diameter, pixels.
        diameter: f64,
        /// Colour.
        color: Rgb,
        /// Opacity, as for lines.
        alpha: [f64; 2],
    },
    /// A flat convex polygon.
    Polygon {
        /// Corners in order, m.
        corners: Vec<Vector3<f64>>,
        /// Colour.
        color: Rgb,
        /// Opacity, as for lines.
        alpha: [f64; 2],
    },
}

/// Content of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// Positions, m, finite.
    pub positions: &'a [Vector3<f64>],
    /// Triangles, counter-clockwise from outside.
    pub triangles: &'a [[u32; 3]],
    /// Colouring of the triangles.
    pub paint: Paint<'a>,
    /// Marks.
    pub marks: &'a [Mark],
}

/// Draws a scene on paper, `width` times `height` pixels. The cost grows with the covered samples,
/// four per pixel, and with the triangles.
///
/// # Panics
/// If a triangle has an index beyond the positions, or the paint has too few numbers.
pub fn render(scene: &Scene<'_>, view: &View, width: usize, height: usize) -> Image {
    let mut canvas = Canvas::new(scene, view, [width, height]);
    for mark in scene.marks {
        canvas.mark(mark);
    }
    canvas.image()
}

/// The triangles of a scene with their coverage: drawn once, blended over any background.
pub struct Layer {
    width: usize,
    pixels: Vec<Cover>,
}

/// Coverage of a pixel.
struct Cover {
    /// Mean colour of the covered samples.
    color: Rgb,
    /// Share of the covered samples, and of those on the outline.
    share: f32,
    outline: f32,
}

impl Layer {
    /// Draws the triangles without marks.
    pub fn new(scene: &Scene<'_>, view: &View, width: usize, height: usize) -> Self {
        let canvas = Canvas::new(scene, view, [width, height]);
        let cover = |pixel: usize| {
            let samples = canvas.samples_of(pixel);
            let covered = samples.iter().filter(|at| canvas.depths[**at] > NOTHING);
            let share = |count: usize| count as f32 / samples.len() as f32;
            Cover {
                color: mean(covered.clone().map(|at| canvas.colors[*at])),
                share: share(covered.count()),
                outline: share(samples.iter().filter(|at| canvas.outline[**at]).count()),
            }
        };
        Self { width, pixels: (0..width * height).map(cover).collect() }
    }

    fn pixels(&self) -> impl Iterator<Item = (usize, usize, &Cover)> {
        let covered = self.pixels.iter().enumerate().filter(|(_, cover)| cover.share > 0.0);
        covered.map(|(k, cover)| (k % self.width, k / self.width, cover))
    }

    /// Blends it over an image of the same size. With an opacity of 1 this equals [`render`]
    /// without marks, on any background.
    pub fn lay_over(&self, image: &mut Image, opacity: f32) {
        self.pixels().for_each(|(x, y, cover)| image.blend(x, y, cover.color, opacity * cover.share));
    }

    /// Returns the pixels that the outline of the triangles covers, and their coverage.
    pub fn outline(&self) -> impl Iterator<Item = (usize, usize, f32)> {
        self.pixels().map(|(x, y, cover)| (x, y, cover.outline)).filter(|(.., share)| *share > 0.0)
    }
}

/// Colours and depths of all samples.
struct Canvas {
    view: View,
    width: usize,
    height: usize,
    colors: Vec<Rgb>,
    /// Depth towards the viewer, samples; [`NOTHING`] where there is nothing.
    depths: Vec<f32>,
    /// Samples on the outline of the body and of its limbs.
    outline: Vec<bool>,
    /// Size of the scene, samples.
    size: f64,
}

/// Depth where there is nothing.
const NOTHING: f32 = f32::NEG_INFINITY;

impl Canvas {
    /// Draws the triangles on paper, for an image of this size.
    fn new(scene: &Scene<'_>, view: &View, size: [usize; 2]) -> Self {
        let [width, height] = size.map(|pixels| FINE * pixels);
        let fine = FINE as f64;
        let view = View { scale: view.scale * fine, origin: view.origin.map(|x| x * fine), ..*view };
        let used = scene.triangles.as_flattened().iter().map(|v| scene.positions[*v as usize]);
        let limits = used.fold(None, |limits: Option<(Vector3<f64>, Vector3<f64>)>, p| {
            Some(limits.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))))
        });
        let size = limits.map_or(0.0, |(low, high)| (high - low).norm()) * view.scale;
        let count = width * height;
        let (colors, depths, outline) = (vec![color::PAPER; count], vec![NOTHING; count], vec![false; count]);
        let mut canvas = Self { view, width, height, colors, depths, outline, size };
        let normals = corner_normals(scene.positions, scene.triangles);
        for (number, normals) in normals.iter().enumerate() {
            canvas.triangle(scene, number, normals);
        }
        canvas.draw_outline();
        canvas
    }

    /// Draws a triangle with its `normals` at the corners (axes of the scene). Of two triangles at
    /// equal depth the first is kept.
    fn triangle(&mut self, scene: &Scene<'_>, number: usize, normals: &[Vector3<f64>; 3]) {
        let View { right, up, toward, .. } = self.view;
        let vertices = scene.triangles[number].map(|v| v as usize);
        let corners = vertices.map(|v| self.view.project(&scene.positions[v]));
        let light = normals.map(|n| brightness(right.dot(&n), up.dot(&n), toward.dot(&n)));
        cover(corners, [self.width, self.height], |x, y, weights| {
            let mean =
                |values: [f64; 3]| -> f64 { values.iter().zip(weights).map(|(value, weight)| value * weight).sum() };
            // Depth and light are interpolated from the corners.
            let (at, depth) = (y * self.width + x, mean(corners.map(|p| p[2])) as f32);
            if depth > self.depths[at] {
                let light = mean(light);
                self.depths[at] = depth;
                self.colors[at] = match scene.paint {
                    Paint::Faces { colors, bright, side } => {
                        let color = colors[number][usize::from(mean(vertices.map(|v| side[v])) > 0.0)];
                        lit(color, if bright[number] { 0.68 + 0.32 * light } else { light })
                    }
                    Paint::Magnitude { values, peak } => {
                        lit(color::magnitude(mean(vertices.map(|v| values[v])) / peak), light)
                    }
                };
            }
        });
    }

    /// Draws the outline: samples where the depth drops by a large step one or two samples away in
    /// any direction.
    fn draw_outline(&mut self) {
        let step = (OUTLINE * self.size) as f32;
        for (x, y) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y))) {
            let at = y * self.width + x;
            if self.depths[at] == NOTHING {
                continue;
            }
            let falls = |other: usize| self.depths[other] < self.depths[at] - step;
            let is_edge = [1, 2].into_iter().any(|k| {
                (x >= k && falls(at - k))
                    || (x + k < self.width && falls(at + k))
                    || (y >= k && falls(at - k * self.width))
                    || (y + k < self.height && falls(at + k * self.width))
            });
            self.outline[at] = is_edge;
            if is_edge {
                self.colors[at] = color::mix(self.colors[at], color::INK, OUTLINE_INK);
            }
        }
    }

    fn mark(&mut self, mark: &Mark) {
        let fine = FINE as f64;
        match mark {
            Mark::Line { from, to, width, color, alpha } => self.line(from, to, width * fine, *color, *alpha),
            Mark::Dot { at, diameter, color, alpha } => {
                let [x, y, depth] = self.view.project(at);
                // Visibility of the whole dot is decided at its centre.
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
                let mut shares = vec![0.0; self.depths.len()];
                for k in 2..projected.len() {
                    let corners = [projected[0], projected[k - 1], projected[k]];
                    cover(corners, [self.width, self.height], |x, y, weights| {
                        let depth = corners.iter().zip(weights).map(|(p, weight)| weight * p[2]).sum();
                        let at = y * self.width + x;
                        shares[at] = alpha[usize::from(!self.in_front(at, depth))];
                    });
                }
                for (old, share) in self.colors.iter_mut().zip(shares).filter(|(_, share)| *share > 0.0) {
                    *old = color::mix(*old, *color, share);
                }
            }
        }
    }

    /// Draws a line in space, fainter where a surface hides it.
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

    /// Returns the indices of the samples of a pixel.
    fn samples_of(&self, pixel: usize) -> [usize; FINE * FINE] {
        let width = self.width / FINE;
        let (x, y) = (FINE * (pixel % width), FINE * (pixel / width));
        std::array::from_fn(|k| (y + k / FINE) * self.width + x + k % FINE)
    }

    /// Averages the samples of each pixel.
    fn image(&self) -> Image {
        let mut image = Image::new(self.width / FINE, self.height / FINE, color::PAPER);
        for pixel in 0..image.width * image.height {
            let color = mean(self.samples_of(pixel).into_iter().map(|at| self.colors[at]));
            image.rgba[4 * pixel..][..3].copy_from_slice(&color);
        }
        image
    }
}

/// Mean colour; black for no colours.
fn mean(colors: impl Iterator<Item = Rgb> + Clone) -> Rgb {
    let count = colors.clone().count().max(1);
    [0, 1, 2].map(|c| (colors.clone().map(|color| usize::from(color[c])).sum::<usize>() / count) as u8)
}

/// Brightness of a face by its normal in axes of the picture: a key light from the upper left, one
/// from the viewer.
fn brightness(right: f64, up: f64, toward: f64) -> f64 {
    // A face seen from behind is lit like one seen from the front.
    let sign = if toward < 0.0 { -1.0 } else { 1.0 };
    let key = (sign * (-0.40 * right + 0.58 * up + 0.71 * toward)).max(0.0);
    0.62 + 0.34 * key + 0.12 * toward.abs()
}

/// Applies light to a colour; more than full light whitens.
fn lit(color: Rgb, light: f64) -> Rgb {
    if light <= 1.0 { color::mix([0; 3], color, light) } else { color::mix(color, [255; 3], light - 1.0) }
}
