//! Pictures of the arm at one instant, with magnified deflections, coloured by the deviation from
//! its rigid twin.
//!
//! The rigid twin is light grey with an outline, the flexible arm is magnified by
//! [`RunHeader::magnification`]; colours show the true deviation, from 0 to
//! [`RunHeader::color_scale_m`]. An arrow points from the rigid TCP to the magnified one. Links
//! without surfaces are drawn as rods. Start at [`arm_pictures`] for pages that explain the picture
//! in their text, and at [`arm_png`] for a self-explanatory picture; [`arm_sheet`] shows both sides
//! next to each other under a heading.
//!
//! Not here: projection, surfaces and pixels (`crate::mesh_picture`), charts (`crate::plot`).

pub(crate) mod ellipsoid;
pub(crate) mod legend;
mod skin;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::Magnifier;
use crate::mesh_picture::draw::{Align, Style};
use crate::mesh_picture::scene::{Layer, Paint, Scene};
use crate::mesh_picture::{Image, PngError, Rgb, View, color};
use ellipsoid::Ellipsoid;
use flexarm_sample::{RunHeader, Sample, TwinSample};
use legend::{ARROW, GHOST, GHOST_FADE, legend, on_scale};
use skin::{Skin, bodies, reach};

pub use legend::arm_color;

/// Width of a picture at which lines and text have their nominal size (pixels).
const NOMINAL_WIDTH: f64 = 900.0;
/// Outline of the rigid twin where the flexible arm covers it.
const GHOST_LINE: Rgb = [70, 78, 92];

/// Reason why there is no picture of an arm.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArmPictureError {
    /// A run without a rigid twin to compare with.
    #[error("no picture of the arm: the run has no rigid twin")]
    NoTwin,
    /// The sample does not match the header, or there is none.
    #[error("no picture of the arm: the sample has {found} links, the header {expected}")]
    Links {
        /// Number of links in the sample.
        found: usize,
        /// Number of links in the header.
        expected: usize,
    },
    /// A diverged run.
    #[error("no picture of the arm: its places are not finite")]
    NotFinite,
    /// An arm with neither surfaces nor distances between joints.
    #[error("no picture of the arm: it has no extent")]
    Nothing,
    /// The image does not fit into its file format.
    #[error("no picture of the arm: cannot make a PNG: {0}")]
    Encode(PngError),
}

/// Direction of view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmSide {
    /// Perpendicular to the vertical plane through base and tool.
    Side,
    /// From the front, the side and above.
    Oblique,
}

/// A picture of the arm without legend.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmPicture {
    /// A PNG file, transparent where there is no arm, for light and dark backgrounds.
    pub png: Vec<u8>,
    /// Directions of the world axes x, y and z in the picture: right and up, as fractions of their
    /// length.
    pub axes: [[f64; 2]; 3],
}

/// Draws the rigid twin and the magnified flexible arm from several sides, for a page that explains
/// them: without scale, axes and background.
///
/// * `size`: width and height, pixels.
///
/// The same input gives the same bytes.
///
/// # Errors
/// [`ArmPictureError`].
pub fn arm_pictures(
    header: &RunHeader,
    sample: &Sample,
    sides: &[ArmSide],
    size: [usize; 2],
) -> Result<Vec<ArmPicture>, ArmPictureError> {
    let stage = Stage::new(header, sample)?;
    sides.par_iter().map(|side| stage.picture(*side, size)).collect()
}

/// Draws the rigid twin and the magnified flexible arm as a PNG picture on white, with a colour
/// scale.
///
/// * `size`: width and height, pixels.
///
/// The same input gives the same bytes.
///
/// # Errors
/// [`ArmPictureError`].
pub fn arm_png(
    header: &RunHeader,
    sample: &Sample,
    side: ArmSide,
    size: [usize; 2],
) -> Result<Vec<u8>, ArmPictureError> {
    let image = Stage::new(header, sample)?.explained(side, size, header, None);
    image.to_png().map_err(ArmPictureError::Encode)
}

/// Draws the arm from both sides on one sheet (PNG), under lines of text, the first of which is the
/// heading.
///
/// * `width`: pixels.
/// * `compliance`: TCP displacement per force, world axes (m/N). It is drawn at the TCP as an
///   ellipsoid: the displacements under a force of constant magnitude in all directions, with its
///   principal axes.
///
/// # Errors
/// [`ArmPictureError`].
pub fn arm_sheet(
    header: &RunHeader,
    sample: &Sample,
    lines: &[String],
    compliance: Option<&Matrix3<f64>>,
    width: usize,
) -> Result<Vec<u8>, ArmPictureError> {
    let stage = Stage::new(header, sample)?;
    let half = width / 2;
    let unit = half as f64 / NOMINAL_WIDTH;
    let ellipsoid = compliance.and_then(|C| Ellipsoid::new(C, stage.size));
    let top = (unit * (24.0 + 24.0 * lines.len() as f64)) as usize;
    let height = half * 7 / 9;
    let mut sheet = Image::new(2 * half, top + height, color::PAPER);
    // Both sides next to each other, under the lines of text.
    for (k, side) in [ArmSide::Side, ArmSide::Oblique].into_iter().enumerate() {
        sheet.paste(&stage.explained(side, [half, height], header, ellipsoid.as_ref()), k * half, top);
    }
    for (k, line) in lines.iter().enumerate() {
        let at = [26.0 * unit, unit * (34.0 + 24.0 * k as f64)];
        match k {
            0 => sheet.text(line, at, Align::Left, Style::new(21.0 * unit, color::INK).bold()),
            _ => sheet.text(line, at, Align::Left, Style::new(16.0 * unit, color::INK)),
        }
    }
    sheet.to_png().map_err(ArmPictureError::Encode)
}

/// Surfaces of both arms at one instant.
pub struct Stage {
    rigid: Skin,
    /// Surface of the magnified arm.
    shown: Skin,
    /// Position on the scale, per corner.
    values: Vec<f64>,
    rigid_twin: TwinSample,
    factor: f64,
    /// TCP of the rigid arm (m).
    pub tool: Vector3<f64>,
    /// TCP of the magnified arm (m).
    pub moved: Vector3<f64>,
    /// Maximum distance of a link from the base (m).
    size: f64,
}

impl Stage {
    /// Returns the surfaces, if both arms can be drawn.
    pub fn new(header: &RunHeader, sample: &Sample) -> Result<Self, ArmPictureError> {
        // Surfaces of the rigid, the flexible and the magnified arm, with the same corners.
        check(header, sample)?;
        let bodies = bodies(header, sample);
        let magnifier = Magnifier::new(header);
        let magnified = magnifier.magnified(sample);
        let rigid = Skin::rigid(&bodies, &sample.rigid);
        let real = Skin::bent(&bodies, header, &sample.flexible);
        let shown = Skin::bent(&bodies, header, &magnified);
        if rigid.triangles.is_empty() {
            return Err(ArmPictureError::Nothing);
        }
        let finite = |skin: &Skin| skin.positions.iter().all(|p| p.iter().all(|x| x.is_finite()));
        if ![&rigid, &real, &shown].into_iter().all(finite) {
            return Err(ArmPictureError::NotFinite);
        }
        // Colours by the distance between flexible and rigid corners.
        let peak = if header.color_scale_m > 0.0 { header.color_scale_m } else { 1.0 };
        let deviation = real.positions.iter().zip(&rigid.positions).map(|(a, b)| (a - b).norm());
        let values = deviation.map(|d| on_scale((d / peak).min(1.0))).collect();
        let [tool, moved] = [&sample.rigid.X_WT, &magnified.X_WT].map(|X| X.translation.vector);
        let (factor, size) = (magnifier.factor(), reach(&sample.rigid));
        Ok(Self { rigid, shown, values, rigid_twin: sample.rigid.clone(), factor, tool, moved, size })
    }

    /// View from a side that fits everything within the margins at the sides and below (pixels).
    pub fn view(
        &self,
        side: ArmSide,
        [width, height]: [usize; 2],
        [margin, foot]: [f64; 2],
        around: Option<&Ellipsoid>,
    ) -> View {
        let (toward, right) = directions(side, &self.rigid_twin);
        let ellipsoid = around.into_iter().flat_map(|e| e.corners(&self.moved));
        let points = self.rigid.positions.iter().chain(&self.shown.positions).copied();
        let points = points.chain([self.tool, self.moved]).chain(ellipsoid);
        View::fit(toward, right, points, [margin, margin, width as f64 - 2.0 * margin, height as f64 - margin - foot])
    }

    /// See [`arm_pictures`].
    fn picture(&self, side: ArmSide, size: [usize; 2]) -> Result<ArmPicture, ArmPictureError> {
        let unit = size[0] as f64 / NOMINAL_WIDTH;
        let view = self.view(side, size, [26.0 * unit, 26.0 * unit], None);
        let mut image = Image::see_through(size[0], size[1]);
        self.draw(&view, &mut image);
        arrow(&mut image, &view, unit, &self.tool, &self.moved);
        let png = image.to_png_quickly().map_err(ArmPictureError::Encode)?;
        Ok(ArmPicture { png, axes: [0, 1, 2].map(|k| [view.right[k], view.up[k]]) })
    }

    /// Draws both arms.
    pub fn draw(&self, view: &View, image: &mut Image) {
        let count = self.rigid.triangles.len();
        let (colors, bright) = (vec![[GHOST; 2]; count], vec![false; count]);
        let side = vec![-1.0; self.rigid.positions.len()];
        let paint = Paint::Faces { colors: &colors, bright: &bright, side: &side };
        let layer = |skin: &Skin, paint| {
            let scene = Scene { positions: &skin.positions, triangles: &skin.triangles, paint, marks: &[] };
            Layer::new(&scene, view, image.width, image.height)
        };
        let ghost = layer(&self.rigid, paint);
        let flexible = layer(&self.shown, Paint::Magnitude { values: &self.values, peak: 1.0 });
        ghost.lay_over(image, 1.0 - GHOST_FADE as f32);
        flexible.lay_over(image, 1.0);
        ghost.outline().for_each(|(x, y, share)| image.blend(x, y, GHOST_LINE, 0.8 * share));
    }

    /// Draws the picture on white with legend.
    fn explained(&self, side: ArmSide, size: [usize; 2], header: &RunHeader, around: Option<&Ellipsoid>) -> Image {
        let unit = size[0] as f64 / NOMINAL_WIDTH;
        let view = self.view(side, size, [26.0 * unit, 78.0 * unit], around);
        let mut image = Image::new(size[0], size[1], color::PAPER);
        self.draw(&view, &mut image);
        if let Some(ellipsoid) = around {
            ellipsoid.draw(&mut image, &view, unit, &self.moved);
        }
        arrow(&mut image, &view, unit, &self.tool, &self.moved);
        legend(&mut image, &view, unit, header, self.factor);
        image
    }
}

fn check(header: &RunHeader, sample: &Sample) -> Result<(), ArmPictureError> {
    if !header.has_rigid {
        return Err(ArmPictureError::NoTwin);
    }
    let expected = header.links.len();
    for twin in [&sample.flexible, &sample.rigid] {
        let found = twin.X_WL.len();
        if found != expected || expected == 0 {
            return Err(ArmPictureError::Links { found, expected });
        }
        let poses = twin.X_WL.iter().chain(&twin.X_WS).chain([&twin.X_WT]);
        if !poses.into_iter().all(|X| X.to_homogeneous().iter().all(|x| x.is_finite())) {
            return Err(ArmPictureError::NotFinite);
        }
    }
    Ok(())
}

/// Returns the directions towards the viewer and to the right. The plane of the arm is the vertical
/// plane through base and tool.
fn directions(side: ArmSide, rigid: &TwinSample) -> (Vector3<f64>, Vector3<f64>) {
    let reach = rigid.X_WT.translation.vector - rigid.X_WL[0].translation.vector;
    let out = Vector3::new(reach.x, reach.y, 0.0).try_normalize(1e-3).unwrap_or(Vector3::x());
    // With the arm reaching to the right, this side faces the viewer.
    let across = out.cross(&Vector3::z());
    match side {
        ArmSide::Side => (across + Vector3::z() * 0.12, out),
        ArmSide::Oblique => (out * 0.75 + across * 0.65 + Vector3::z() * 0.6, out * 0.65 - across * 0.75),
    }
}

/// Draws the TCP error as an arrow from the rigid to the flexible TCP.
pub fn arrow(image: &mut Image, view: &View, unit: f64, from: &Vector3<f64>, to: &Vector3<f64>) {
    let [a, b] = [view.project(from), view.project(to)].map(|[x, y, _]| [x, y]);
    if (b[0] - a[0]).hypot(b[1] - a[1]) > 2.0 * unit {
        image.line(a, b, 5.4 * unit, color::PAPER, 1.0);
        image.arrow(a, b, 3.6 * unit, ARROW);
    }
    image.line(a, a, 8.0 * unit, color::PAPER, 1.0);
    image.line(a, a, 5.5 * unit, color::INK, 1.0);
}
