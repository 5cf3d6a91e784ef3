//! A software renderer: triangles and marks in, an image out.
//!
//! Parallel projection, depth buffer, soft light from the upper left, four samples per pixel.
//! Start at [`render`]. Not here: what the triangles are.

use std::ops::Range;

use nalgebra::Vector3;

use super::color;
use super::draw::cover_line;
use super::image::{Image, Rgb};
use super::raster::{Facet, Linear, Nearest, Spans};
pub use super::topology::corner_normals;
use super::view::View;

/// Samples per pixel in each direction.
const FINE: usize = 2;
/// Samples per pixel.
const SAMPLES: u16 = (FINE * FINE) as u16;
/// A step in depth that gets an outline, as a share of the size of the scene.
const OUTLINE: f64 = 0.02;
/// How much ink an outline has.
const OUTLINE_INK: f64 = 0.65;
const INK_PART: u64 = (OUTLINE_INK * 256.0 + 0.5) as u64;
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
    for mark in scene.marks {
        canvas.mark(mark);
    }
    canvas.image()
}

/// The triangles of a scene as they cover what is under them: drawn once, laid over any ground.
pub struct Layer {
    width: usize,
    /// What of each pixel is covered, packed; nothing takes no memory.
    pixels: Vec<Packed>,
    /// Pixels of each row outside of which there is nothing.
    touched: Vec<Range<usize>>,
}

/// What covers a pixel: sum of the colours of its covered samples, their number, and how many of them the outline runs over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cover {
    sum: [u16; 3],
    count: u8,
    lines: u8,
}

/// A sample in a number: its colour in three parts of 16 bits, 1 if it is covered, 1 if the outline runs there. Sums of four of
/// them, and products of colours with 256, do not run into each other.
type Packed = u64;
const COVERED: Packed = 1 << 8;
const LINE: Packed = 1;

const fn packed([r, g, b]: Rgb) -> Packed {
    (r as u64) << 48 | (g as u64) << 32 | (b as u64) << 16
}

/// One packed colour into the other, in 256 parts.
fn mixed(from: Packed, to: Packed, part: u64) -> Packed {
    (from * (256 - part) + to * part) >> 8 & packed([255; 3])
}

impl Cover {
    fn unpacked(pixel: Packed) -> Self {
        let sum = [(pixel >> 48) as u16, (pixel >> 32) as u16, (pixel >> 16) as u16];
        Self { sum, count: (pixel >> 8) as u8, lines: pixel as u8 }
    }

    /// Mean of the samples, with the ground where they do not cover it.
    fn over(self, ground: Rgb) -> Rgb {
        let open = SAMPLES - u16::from(self.count);
        let part = |c: usize| ((self.sum[c] + open * u16::from(ground[c])) / SAMPLES) as u8;
        [part(0), part(1), part(2)]
    }

    /// How much of the pixel the outline covers.
    fn outline(self) -> f32 {
        let (paper, ink) =
            (u16::from(color::PAPER[0]), u16::from(color::mix(color::PAPER, color::INK, OUTLINE_INK)[0]));
        let lines = u16::from(self.lines);
        let mean = (lines * ink + (SAMPLES - lines) * paper) / SAMPLES;
        f32::from(paper - mean) / f32::from(paper - ink)
    }
}

impl Layer {
    /// Draws the triangles; marks are left out. `normals`: of the corners of each triangle ([`corner_normals`]).
    pub fn new(scene: &Scene<'_>, normals: &[[Vector3<f64>; 3]], view: &View, width: usize, height: usize) -> Self {
        let mut layer = Self { width, pixels: vec![0; width * height], touched: vec![0..0; height] };
        Samples::new(scene, view, [width, height]).each_row(scene, normals, |columns, y, _, samples| {
            let (y, columns) = (y / FINE, columns.start / FINE..columns.end / FINE);
            let (row, touched) = (&mut layer.pixels[y * width..][..width], &mut layer.touched[y]);
            let [before, behind] = match touched.end == 0 {
                true => [columns.clone(), columns.end..columns.end],
                false => [columns.start.min(touched.start)..touched.start, touched.end..columns.end.max(touched.end)],
            };
            *touched = before.start..behind.end;
            // Memory that was never written is not read: that would be two faults a page.
            row[before].fill(0);
            row[behind].fill(0);
            for (pixel, samples) in row[columns].iter_mut().zip(samples.as_chunks::<FINE>().0) {
                *pixel += samples.iter().sum::<Packed>();
            }
        });
        layer
    }

    /// Calls with each pixel that is covered, at least in part.
    fn each(&self, mut call: impl FnMut(usize, usize, Cover)) {
        for (y, columns) in self.touched.iter().enumerate() {
            for x in columns.clone() {
                match self.pixels[y * self.width + x] {
                    0 => {}
                    pixel => call(x, y, Cover::unpacked(pixel)),
                }
            }
        }
    }

    /// Lays it over an image of its size: then that is what [`render_over`] draws, without marks.
    pub fn lay_over(&self, image: &mut Image) {
        self.each(|x, y, cover| image.set(x, y, cover.over(image.pixel(x, y))));
    }

    /// As [`Layer::lay_over`], and of what has changed colour takes a share away again.
    pub fn lay_faintly_over(&self, image: &mut Image, faded: f32) {
        self.each(|x, y, cover| {
            let ground = image.pixel(x, y);
            let color = cover.over(ground);
            if color != ground {
                image.set(x, y, color);
                image.blend(x, y, ground, faded);
            }
        });
    }

    /// Where the outline of the triangles runs: pixels with how much of them it covers.
    pub fn outline(&self, mut call: impl FnMut(usize, usize, f32)) {
        self.each(|x, y, cover| {
            if cover.lines > 0 {
                call(x, y, cover.outline());
            }
        });
    }
}

/// The triangles of a scene at the samples of a picture.
struct Samples {
    view: View,
    projected: Vec<[f64; 3]>,
    width: usize,
    height: usize,
    /// Size of the scene, samples.
    size: f64,
}

impl Samples {
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
        let projected: Vec<[f64; 3]> = scene.positions.iter().map(|p| view.project(p)).collect();
        Self { view, projected, width, height, size }
    }

    /// Calls with each row in which samples are covered: columns of whole pixels, the row, depths, and samples, 0 where there is
    /// nothing.
    ///
    /// The outline of the body and of its limbs runs where it goes down a long way behind a sample's neighbours; it is in the
    /// colour.
    fn each_row(
        &self,
        scene: &Scene<'_>,
        normals: &[[Vector3<f64>; 3]],
        mut call: impl FnMut(Range<usize>, usize, &[f32], &[Packed]),
    ) {
        let step = (OUTLINE * self.size) as f32;
        let scale: Vec<Packed> = match scene.paint {
            Paint::Magnitude { .. } => {
                (0..=SCALE_STEPS).map(|k| packed(color::magnitude(f64::from(k) / SCALE_END))).collect()
            }
            Paint::Faces { .. } => Vec::new(),
        };
        // Each row meets mostly the triangles of the row above it.
        let mut faces = vec![(usize::MAX, Face::default()); FACES.min(scene.triangles.len())];
        let (mut lowest, mut samples) = (Vec::new(), Vec::new());
        let corners = |number: usize| scene.triangles[number].map(|v| self.projected[v as usize]);
        Nearest::each_row([self.width, self.height], scene.triangles.len(), corners, |nearest, y| {
            let Range { start, end } = nearest.columns(y);
            let columns = start / FINE * FINE..end.next_multiple_of(FINE);
            nearest.lowest_beside(columns.clone(), y, &mut lowest);
            samples.clear();
            samples.resize(columns.len(), 0);
            let (depths, numbers) = nearest.at(columns.clone(), y);
            let mut end = 0;
            for run in numbers.chunk_by(|a, b| a == b) {
                let mut begin = end;
                end += run.len();
                // Where there is nothing, the number is one of before.
                let Some(open) = depths[begin..end].iter().position(|depth| *depth > Nearest::NOTHING) else {
                    continue;
                };
                begin += open;
                let number = run[0] as usize;
                let slot = number % faces.len();
                let near = [columns.start + begin, y];
                if faces[slot].0 != number {
                    faces[slot] = (number, self.face(scene, normals, number, near));
                }
                let light = faces[slot].1.along(near);
                let run = samples[begin..end].iter_mut().zip(&depths[begin..end]).zip(&lowest[begin..end]);
                let run = run.map(|((sample, depth), lowest)| (sample, *depth, *lowest < *depth - step));
                match scene.paint {
                    Paint::Faces { colors, .. } => {
                        let own = colors[number].map(packed);
                        light_up(run, light, |place| own[usize::from(place > 0.0)]);
                    }
                    Paint::Magnitude { .. } => {
                        light_up(run, light, |place| scale[(place.clamp(0.0, SCALE_END) + 0.5) as u32 as usize]);
                    }
                }
            }
            call(columns, y, depths, &samples);
        });
    }

    /// `near`: a sample in the triangle.
    fn face(&self, scene: &Scene<'_>, normals: &[[Vector3<f64>; 3]], number: usize, near: [usize; 2]) -> Face {
        let View { right, up, toward, .. } = self.view;
        let corners = scene.triangles[number].map(|v| v as usize);
        let light = normals[number].map(|n| brightness(right.dot(&n), up.dot(&n), toward.dot(&n)));
        let (place, light) = match scene.paint {
            Paint::Faces { bright, side, .. } if bright[number] => {
                (corners.map(|v| side[v]), light.map(|light| 0.68 + 0.32 * light))
            }
            Paint::Faces { side, .. } => (corners.map(|v| side[v]), light),
            Paint::Magnitude { values, peak } => (corners.map(|v| SCALE_END * (values[v] / peak)), light),
        };
        let facet = Facet::new(corners.map(|v| self.projected[v]), near).unwrap_or_default();
        Face { first: near.map(|n| n as f64), place: facet.mean(place), light: facet.mean(light) }
    }
}

/// Colours samples of one triangle.
///
/// * `run`: each of them, with its depth and whether the outline runs there.
/// * `light`: place and light of each.
/// * `own`: colour at a place.
fn light_up<'a>(
    run: impl Iterator<Item = (&'a mut Packed, f32, bool)>,
    [place, light]: [impl Iterator<Item = f64>; 2],
    own: impl Fn(f64) -> Packed,
) {
    for (((sample, depth, line), place), light) in run.zip(place).zip(light) {
        if depth > Nearest::NOTHING {
            let color = lit(own(place), light);
            *sample = COVERED | if line { mixed(color, packed(color::INK), INK_PART) | LINE } else { color };
        }
    }
}

/// Steps of the scale of colours: finer than what a channel of a colour can tell.
const SCALE_STEPS: u32 = 2048;
const SCALE_END: f64 = SCALE_STEPS as f64;

/// Triangles that are known at a time, each in the place of its number.
const FACES: usize = 4096;

/// What is to be known of a triangle to colour its samples.
#[derive(Clone, Copy, Default)]
struct Face {
    /// Sample from which columns and rows are counted.
    first: [f64; 2],
    /// On the scale of colours, in its steps, or on which side of a border, and the light.
    place: Linear,
    light: Linear,
}

impl Face {
    /// Place and light at a sample and those that follow it in its row.
    fn along(&self, [x, y]: [usize; 2]) -> [impl Iterator<Item = f64>; 2] {
        let (column, row) = (x as f64 - self.first[0], y as f64 - self.first[1]);
        [self.place, self.light].map(|number| number.along(column, row))
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
    /// Size of the scene, samples.
    size: f64,
}

impl Canvas {
    /// The triangles of a scene over an image.
    fn new(scene: &Scene<'_>, view: &View, under: &Image) -> Self {
        let [width, height] = [under.width, under.height].map(|pixels| FINE * pixels);
        let ground = |at: usize| under.pixel(at % width / FINE, at / width / FINE);
        let mut colors: Vec<Rgb> = (0..width * height).map(ground).collect();
        let mut depths = vec![f32::NEG_INFINITY; width * height];
        let samples = Samples::new(scene, view, [under.width, under.height]);
        let normals = corner_normals(scene.positions, scene.triangles);
        samples.each_row(scene, &normals, |columns, y, nearest, samples| {
            let at = y * width + columns.start..y * width + columns.end;
            depths[at.clone()].copy_from_slice(nearest);
            for (color, sample) in colors[at].iter_mut().zip(samples).filter(|(_, sample)| **sample != 0) {
                *color = Cover::unpacked(*sample).sum.map(|part| part as u8);
            }
        });
        Self { view: samples.view, width, height, colors, depths, size: samples.size }
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
                    let corners = [projected[0], projected[k - 1], projected[k]];
                    let Some(spans) = Spans::new(corners, self.width, &(0..self.height)) else { continue };
                    for (y, (columns, depths)) in spans.rows.clone().filter_map(|y| Some((y, spans.at(y)?))) {
                        for (x, depth) in columns.zip(depths) {
                            let at = y * self.width + x;
                            touched.push((at, alpha[usize::from(!self.in_front(at, depth))]));
                        }
                    }
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

    /// Places of the samples of a pixel.
    fn samples_of(&self, pixel: usize) -> [usize; FINE * FINE] {
        let width = self.width / FINE;
        let (x, y) = (FINE * (pixel % width), FINE * (pixel / width));
        std::array::from_fn(|k| (y + k / FINE) * self.width + x + k % FINE)
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

/// Light on a wall by its normal in axes of the picture: a key light from the upper left, one from the viewer.
fn brightness(right: f64, up: f64, toward: f64) -> f64 {
    // A wall seen from behind is lit like one seen from the front.
    let sign = if toward < 0.0 { -1.0 } else { 1.0 };
    let key = (sign * (-0.40 * right + 0.58 * up + 0.71 * toward)).max(0.0);
    0.62 + 0.34 * key + 0.12 * toward.abs()
}

/// A packed colour under light; more than full light whitens.
fn lit(color: Packed, light: f64) -> Packed {
    match (256.0 * light + 0.5) as u32 {
        part @ 0..=256 => mixed(0, color, part.into()),
        part => mixed(color, packed([255; 3]), u64::from(part - 256).min(256)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: each channel by itself, times the light, or as far towards white as the light is above 1.
    #[test]
    fn light_on_a_packed_colour_is_that_on_each_channel_within_one_step() {
        let mut largest = 0.0_f64;
        for (c, k) in (0..=255_u8).flat_map(|c| (0..=1100).map(move |k| (c, k))) {
            let light = f64::from(k) / 1000.0;
            let truth = match light <= 1.0 {
                true => f64::from(c) * light,
                false => f64::from(c) + (255.0 - f64::from(c)) * (light - 1.0),
            };
            let own = [c, 255 - c, c / 2];
            let sum = Cover::unpacked(COVERED | lit(packed(own), light)).sum;
            largest = largest.max((f64::from(sum[0]) - truth).abs());
            assert!(sum.iter().all(|part| *part <= 255));
        }
        assert!(largest < 1.5, "{largest}"); // rounded down, light in steps of 1/256; measured 1.463
    }
}
