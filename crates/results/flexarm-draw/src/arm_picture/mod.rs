//! Pictures of the arm at one instant, with magnified deflections, coloured by the deviation from
//! its rigid twin.
//!
//! The rigid twin is light grey with an outline, the flexible arm is magnified by
//! [`RunHeader::magnification`]; colours show the true deviation, from 0 to
//! [`RunHeader::color_scale_m`]. An arrow points from the rigid TCP to the magnified one. Links
//! without surfaces are drawn as rods. Start at [`arm_pictures`] for pages that explain the picture
//! in their text, and at [`arm_png`] for a self-explanatory picture; [`arm_sheet`] shows both sides
//! next to each other under a heading.

mod ellipsoid;
mod legend;
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
struct Stage {
    rigid: Skin,
    /// Surface of the magnified arm.
    shown: Skin,
    /// Position on the scale, per corner.
    values: Vec<f64>,
    rigid_twin: TwinSample,
    factor: f64,
    /// TCP of the rigid arm and of the magnified one (m).
    tool: Vector3<f64>,
    moved: Vector3<f64>,
    /// Maximum distance of a link from the base (m).
    size: f64,
}

impl Stage {
    fn new(header: &RunHeader, sample: &Sample) -> Result<Self, ArmPictureError> {
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
        let peak = if header.color_scale_m > 0.0 { header.color_scale_m } else { 1.0 };
        let deviation = real.positions.iter().zip(&rigid.positions).map(|(a, b)| (a - b).norm());
        let values = deviation.map(|d| on_scale((d / peak).min(1.0))).collect();
        let [tool, moved] = [&sample.rigid.X_WT, &magnified.X_WT].map(|X| X.translation.vector);
        let (factor, size) = (magnifier.factor(), reach(&sample.rigid));
        Ok(Self { rigid, shown, values, rigid_twin: sample.rigid.clone(), factor, tool, moved, size })
    }

    /// View from a side that fits everything within the margins at the sides and below (pixels).
    fn view(
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
    fn draw(&self, view: &View, image: &mut Image) {
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
fn arrow(image: &mut Image, view: &View, unit: f64, from: &Vector3<f64>, to: &Vector3<f64>) {
    let [a, b] = [view.project(from), view.project(to)].map(|[x, y, _]| [x, y]);
    if (b[0] - a[0]).hypot(b[1] - a[1]) > 2.0 * unit {
        image.line(a, b, 5.4 * unit, color::PAPER, 1.0);
        image.arrow(a, b, 3.6 * unit, ARROW);
    }
    image.line(a, a, 8.0 * unit, color::PAPER, 1.0);
    image.line(a, a, 5.5 * unit, color::INK, 1.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexarm_sample::LinkInfo;
    use flexarm_spatial::Pose;
    use nalgebra::{Rotation3, Translation3};

    /// An arm without surfaces: base, upright link, and a link along x, rotated so that the TCP
    /// sags by 2 mm.
    fn arm() -> (RunHeader, Sample) {
        let link = |name: &str, parent| LinkInfo { name: name.into(), parent, fixed: false };
        let header = RunHeader {
            links: vec![link("base", None), link("arm", Some(0)), link("tool", Some(1))],
            tcp: "tool".into(),
            has_rigid: true,
            magnification: 100.0,
            color_scale_m: 2e-3,
            ..RunHeader::default()
        };
        let places = |sag: f64| -> Vec<Pose> {
            let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), sag / 1.2);
            let places =
                [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.2, 0.0, 1.0 - sag]].map(|p| Translation3::from(Vector3::from(p)));
            let turns = [Rotation3::identity(), turned, turned];
            places.into_iter().zip(turns).map(|(place, turn)| Pose::from_parts(place, turn)).collect()
        };
        let twin = |sag: f64| TwinSample { X_WL: places(sag), X_WT: places(sag)[2], ..TwinSample::default() };
        let sample = Sample { flexible: twin(2e-3), rigid: twin(0.0), ..Sample::default() };
        (header, sample)
    }

    fn decoded(png: &[u8]) -> Vec<Rgb> {
        rgba(png).into_iter().map(|p| [p[0], p[1], p[2]]).collect()
    }

    fn rgba(png: &[u8]) -> Vec<[u8; 4]> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
    }

    #[test]
    fn an_arm_without_surfaces_is_drawn_as_rods_with_the_way_of_its_tool() {
        let (header, sample) = arm();
        let size = [450, 350];
        for side in [ArmSide::Side, ArmSide::Oblique] {
            let png = arm_png(&header, &sample, side, size).unwrap();
            assert_eq!(png, arm_png(&header, &sample, side, size).unwrap(), "the same bytes");
            // Without the text at the bottom.
            let mut pixels = decoded(&png);
            pixels.truncate(size[0] * (size[1] - 50));
            let count = |near: Rgb, within: i32| {
                let close = |p: &&Rgb| (0..3).all(|k| (i32::from(p[k]) - i32::from(near[k])).abs() <= within);
                pixels.iter().filter(close).count()
            };
            assert!(count(ARROW, 12) > 8, "{side:?}: {} pixels of the arrow", count(ARROW, 12));
            // The base does not move, so it has the first colour of the scale; the rigid arm is
            // light grey.
            assert!(count(color::magnitude(on_scale(0.0)), 40) > 200, "{side:?}");
            let grey = |p: &&Rgb| p.iter().all(|c| (150..240).contains(c)) && p[0].abs_diff(p[2]) < 24;
            let ghost = pixels.iter().filter(grey).count();
            assert!(ghost > 400, "{side:?}: {ghost} pixels of the ghost");
        }
    }

    /// Truth: the picture on paper, drawn without transparency.
    #[test]
    fn a_picture_without_ground_is_the_same_on_white_and_shows_dark_paper_where_there_is_no_arm() {
        let (header, sample) = arm();
        let size = [450, 350];
        let picture = arm_pictures(&header, &sample, &[ArmSide::Oblique], size).unwrap().remove(0);
        let pixels = rgba(&picture.png);
        assert!(pixels.iter().filter(|p| p[3] == 0).count() > pixels.len() / 2, "most of it is ground");
        assert!(pixels.iter().filter(|p| p[3] == 255).count() > 1000, "the arm covers");
        assert!(pixels.iter().filter(|p| (100..220).contains(&p[3])).count() > 400, "the ghost is seen through");
        let stage = Stage::new(&header, &sample).unwrap();
        let view = stage.view(ArmSide::Oblique, size, [13.0, 13.0], None);
        for ground in [[255; 3], [27, 31, 38]] {
            let mut truth = Image::new(size[0], size[1], ground);
            stage.draw(&view, &mut truth);
            arrow(&mut truth, &view, 0.5, &stage.tool, &stage.moved);
            let worst = pixels.iter().zip(truth.rgba.chunks_exact(4)).flat_map(|(p, truth)| {
                let laid = |c: usize| {
                    let a = f64::from(p[3]) / 255.0;
                    (a * f64::from(p[c]) + (1.0 - a) * f64::from(ground[c]) - f64::from(truth[c])).abs()
                };
                [laid(0), laid(1), laid(2)]
            });
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 5.0, "{worst} of 255 on {ground:?}"); // rounding of opacity, of colours and of means
        }
        // z is drawn upwards from every side.
        let [right, up] = picture.axes[2];
        assert!(right.abs() < 1e-9 && up > 0.5, "{:?}", picture.axes);
    }

    #[test]
    fn what_cannot_be_drawn_is_an_error() {
        let size = [90, 70];
        let draw = |header: &RunHeader, sample: &Sample| arm_png(header, sample, ArmSide::Side, size).unwrap_err();
        let (header, sample) = arm();
        assert_eq!(draw(&RunHeader { has_rigid: false, ..header.clone() }, &sample), ArmPictureError::NoTwin);
        assert_eq!(draw(&header, &Sample::default()), ArmPictureError::Links { found: 0, expected: 3 });
        let mut diverged = sample.clone();
        diverged.flexible.X_WL[2] = Pose::from(Translation3::new(f64::NAN, 0.0, 0.0));
        assert_eq!(draw(&header, &diverged), ArmPictureError::NotFinite);
        let mut point = sample;
        for twin in [&mut point.flexible, &mut point.rigid] {
            twin.X_WL.fill(Pose::identity());
            twin.X_WT = Pose::identity();
        }
        assert_eq!(draw(&header, &point), ArmPictureError::Nothing);
    }
}
