//! Links modelled as beams: a hollow section from the outlines of the mesh and the mass of the
//! link.
//!
//! Frames: L link; S section, x from the link's origin to the distal joint, y and z across.
//!
//! Start at [`propose`]. Not here: end points for files whose frames are elsewhere
//! ([`super::ends`]).

use flexarm_kinematics::{Joint, LinkInertia, Pose};
use flexarm_urdf::{CrossSection, TriangleMesh, cross_section};
use nalgebra::{Matrix2, Matrix3, Rotation2, Rotation3, Translation3, Vector2, Vector3};
use serde::Serialize;

use super::ends;

/// Number of cuts along the whole mesh.
const CUTS: usize = 48;
/// Number of stations along the beam for the bending compliance.
const STATIONS: usize = 40;
/// Minimum fraction of the distance between the joints along which there must be a shape, on or
/// beside the line.
const ALONG: f64 = 0.75;
/// Maximum distance of the shape from the line between the joints, as a fraction of its length.
const BESIDE: f64 = 0.45;
/// Maximum ratio of the outer sizes along a beam.
const TAPER: f64 = 3.5;
/// Minimum share of the beam in the link's mass; the rest is housings at its ends.
const OWN: f64 = 0.2;
/// Minimum ratio of a beam's length to the thickness of its section.
const SLENDER: f64 = 1.2;
/// Minimum length of a beam, as a fraction of the arm's length.
const SHARE: f64 = 0.08;
/// Minimum wall thickness that can be cast, bent or printed (m).
const THINNEST: f64 = 5e-4;
/// Minimum wall thickness relative to the smaller outer size, below which walls buckle before they
/// yield (EN 1993-1-1, table 5.2, for round ones).
const THIN: f64 = 1.0 / 90.0;
/// Tolerances of a round section: ratio of the principal second moments, and ratio of perimeters.
const ROUND: [f64; 2] = [0.12, 0.06];
/// Candidate materials, lightest first: name, density (kg/m³), and description.
const MATERIALS: [(&str, f64, &str); 3] =
    [("aluminium", 2700.0, "aluminium casting"), ("ductile_iron", 7100.0, "cast iron"), ("steel", 7850.0, "steel")];

/// Cause of shapes that are not between the points.
const FRAMES: &str = "the frames of the file are not along the link";

/// A uniform section with the bending stiffness of the link's outline, hollow such that the link
/// has its mass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BeamSection {
    /// One of `box`, `tube`, `rectangle`, `circle`, as in the robot file.
    pub section: &'static str,
    /// Sizes along y and z of the section; diameters of round ones (m).
    pub width: f64,
    /// As `width`.
    pub height: f64,
    /// Wall thickness (m); none of solid ones.
    pub wall: Option<f64>,
    /// Wall thickness if only half of the mass is in the wall (m).
    pub wall_of_half: Option<f64>,
    /// Name of the material.
    pub material: &'static str,
    /// Direction of the section's y in link axes.
    pub y_axis: [f64; 3],
    /// Offset of the centroid from the line between the joints, in link axes (m).
    pub offset: [f64; 3],
    /// End points of the beam, link axes (m); none if it runs from the link's frame to the next
    /// joint.
    pub ends: Option<[[f64; 3]; 2]>,
    /// Ratio of maximum to minimum outer size along the beam.
    pub taper: f64,
    /// Fraction of the cuts with an open outline.
    pub open: f64,
}

impl BeamSection {
    /// Describes a section: `box of 120 x 180 mm with a wall of 8.0 mm`.
    pub(crate) fn words(&self) -> String {
        let mm = |x: f64| format!("{:.0}", 1e3 * x);
        let size = match self.section {
            "tube" | "circle" => format!("{} of {} mm", self.section, mm(self.width)),
            _ => format!("{} of {} x {} mm", self.section, mm(self.width), mm(self.height)),
        };
        self.wall.map_or(size.clone(), |wall| format!("{size} with a wall of {:.1} mm", 1e3 * wall))
    }
}

/// Data of a link that may be a beam.
pub struct Candidate<'a> {
    /// Parent joint of the link.
    pub proximal: Option<&'a Joint>,
    /// Joint at the distal end.
    pub distal: &'a Joint,
    /// Inertia of the link, if it is known.
    pub inertia: Option<LinkInertia>,
    /// Shapes, in link axes.
    pub meshes: &'a [TriangleMesh],
    /// Length of the whole arm (m).
    pub arm: f64,
}

/// Returns a section for the link, or the reason why there is none. If the shape is not between the
/// link's frames, the beam runs along the body given by shape and joint axes.
pub fn propose(link: &Candidate<'_>) -> Result<BeamSection, NoSection> {
    let reason = match between(link, [Vector3::zeros(), link.distal.X_PJ.translation.vector]) {
        Err(reason) if reason.is_elsewhere => reason,
        found => return found,
    };
    let Some(ends) = ends::of(link) else { return Err(reason) };
    let mut section = between(link, ends).map_err(|own| match own.is_elsewhere {
        true => reason,
        false => format!("its geometry between the joint axes: {own}").into(),
    })?;
    section.ends = Some(ends.map(|end| (end + Vector3::from(section.offset)).into()));
    section.offset = [0.0; 3];
    Ok(section)
}

/// Reason why a link has no section.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message}")]
pub struct NoSection {
    message: String,
    /// Whether the shape may be elsewhere: the points are too close, or there is none between them.
    is_elsewhere: bool,
}

impl From<String> for NoSection {
    fn from(message: String) -> Self {
        Self { message, is_elsewhere: false }
    }
}

/// Error about points with too little shape between them.
fn elsewhere(message: String) -> NoSection {
    NoSection { message, is_elsewhere: true }
}

/// Returns a section for the part of the link between two points, link axes.
fn between(link: &Candidate<'_>, [from, to]: [Vector3<f64>; 2]) -> Result<BeamSection, NoSection> {
    let axis = to - from;
    let length = axis.norm();
    if length < SHARE * link.arm || length < 1e-3 {
        let [length, arm] = [length, link.arm].map(|x| 1e3 * x);
        return Err(elsewhere(format!("too short: {length:.0} mm of the arm's {arm:.0} mm")));
    }
    let inertia = link.inertia.filter(|i| i.mass > 0.0).ok_or_else(|| "its mass is unknown".to_owned())?;
    if link.meshes.is_empty() {
        return Err("it has no readable geometry".to_owned().into());
    }
    let joint = &link.distal.name;
    // Outlines along the line, which must be on or beside it.
    let cuts = Cuts::of(link.meshes, &from, &axis)?;
    let along = cuts.along(length);
    let aside = cuts.centroid(length).norm();
    if along < ALONG {
        return Err(elsewhere(format!(
            "between its frame and joint {joint:?} its geometry covers only {:.0} % of the distance: {FRAMES}",
            100.0 * along
        )));
    }
    if aside > BESIDE * length {
        return Err(elsewhere(format!(
            "between its frame and joint {joint:?} its geometry is offset by {:.0} mm: {FRAMES}",
            1e3 * aside
        )));
    }
    // Boxes or circles with the second moments of the outlines, slender enough for a beam.
    let shape = if cuts.is_round(length) { Shape::Tube } else { Shape::Box };
    let turn = if shape == Shape::Box { cuts.principal_turn(length) } else { 0.0 };
    let outlines = cuts.outlines(turn, shape);
    let thickness = weighted(&outlines, length, |o| o.width.max(o.height));
    if length < SLENDER * thickness {
        let [length, thickness] = [length, thickness].map(|x| 1e3 * x);
        return Err(format!("not slender: {length:.0} mm long, {thickness:.0} mm thick").into());
    }
    // Wall with the mass of the link, and the uniform section with the same tip deflection.
    let (material, wall) = wall(&outlines, shape, inertia.mass)?;
    let mut section = equivalent(&outlines, shape, length, wall);
    section.material = material;
    if let Some(wall) = section.wall.filter(|wall| *wall < THIN * section.width.min(section.height)) {
        return Err(thin_wall(inertia.mass, wall, material));
    }
    if section.taper > TAPER {
        let taper = section.taper;
        return Err(format!("its width varies by a factor of {taper:.1} between the joints: not a beam").into());
    }
    // Share of the mass that is in the beam.
    let density = MATERIALS.iter().find(|m| m.0 == material).map_or(2700.0, |m| m.1);
    let (whole, own) = (shell(&outlines, shape, wall), shell_between(&outlines, shape, length, wall));
    if own < OWN * whole {
        return Err(format!("only {:.0} % of its mass is between the joints", 100.0 * own / whole).into());
    }
    section.wall_of_half = section.wall.and_then(|_| wall_for(&outlines, shape, 0.5 * inertia.mass / density));
    place(&mut section, &cuts, length, turn);
    section.open = cuts.open();
    Ok(section)
}

/// Sets the axes and the offset of a section in link axes; an offset below 3 % of its smaller outer
/// size counts as zero.
///
/// * `turn`: angle of its principal axes about x of S (rad).
fn place(section: &mut BeamSection, cuts: &Cuts, length: f64, turn: f64) {
    let R_LS = cuts.X_LS.rotation * Rotation3::from_axis_angle(&Vector3::x_axis(), turn);
    section.y_axis = (R_LS * Vector3::y()).into();
    let c = cuts.centroid(length);
    let offset = cuts.X_LS.rotation * Vector3::new(0.0, c.x, c.y);
    let matters = offset.norm() > 0.03 * section.width.min(section.height);
    section.offset = if matters { offset.into() } else { [0.0; 3] };
}

/// Outlines of a link across the line to its distal joint.
struct Cuts {
    /// Section frame at the start of the beam.
    X_LS: Pose,
    /// Positions along x (m) with their sections, equally spaced over the whole mesh.
    sections: Vec<(f64, Option<CrossSection>)>,
}

/// Shape by which outlines are approximated.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Box,
    Tube,
}

/// Outer size of the box or circle with the outline's second moments, about principal axes.
#[derive(Clone, Copy, Debug)]
struct Outline {
    x: f64,
    /// Thickness of the slice (m).
    step: f64,
    width: f64,
    height: f64,
}

impl Cuts {
    /// Cuts the shapes across the line that starts at `from`, link axes (m).
    fn of(meshes: &[TriangleMesh], from: &Vector3<f64>, axis: &Vector3<f64>) -> Result<Self, NoSection> {
        let x = axis.normalize();
        let across = Vector3::ith(axis.abs().imin(), 1.0);
        let y = (across - x * x.dot(&across)).normalize();
        let R_LS = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        let X_LS = Pose::from_parts(Translation3::from(*from), R_LS);
        let along = |p: &[f32; 3]| (Vector3::from(p.map(f64::from)) - from).dot(&x);
        let places = || meshes.iter().flat_map(|m| &m.positions).map(along);
        let (low, high) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
        if high - low < 1e-4 {
            return Err("its geometry is flat".to_owned().into());
        }
        let step = (high - low) / CUTS as f64;
        let cut = |k: usize| {
            let at = low + (k as f64 + 0.5) * step;
            let X_LC = X_LS * Pose::from_parts(Translation3::new(at, 0.0, 0.0), Rotation3::identity());
            (at, cross_section(meshes, &X_LC))
        };
        Ok(Self { X_LS, sections: (0..CUTS).map(cut).collect() })
    }

    /// Returns the cuts with an outline.
    fn found(&self) -> impl Iterator<Item = (f64, &CrossSection)> {
        self.sections.iter().filter_map(|(x, section)| Some((*x, section.as_ref()?)))
    }

    /// Returns the outlines between the ends of the beam.
    fn within(&self, length: f64) -> impl Iterator<Item = (f64, &CrossSection)> {
        self.found().filter(move |(x, _)| (0.0..=length).contains(x))
    }

    /// Fraction of the distance between the joints with an outline.
    fn along(&self, length: f64) -> f64 {
        let step = self.sections[1].0 - self.sections[0].0;
        (self.within(length).count() as f64 * step / length).min(1.0)
    }

    /// Returns the fraction of the outlines that are open.
    fn open(&self) -> f64 {
        let (all, open) =
            self.found().fold((0.0, 0.0), |(n, k), (_, s)| (n + 1.0, k + f64::from(u8::from(!s.is_closed))));
        open / f64::max(all, 1.0)
    }

    /// Returns the outline closest to a position (m).
    fn nearest(&self, x: f64) -> Option<&CrossSection> {
        self.found().min_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs())).map(|(_, section)| section)
    }

    /// Mean over the beam, weighted for a force at its tip.
    fn mean(&self, length: f64) -> (Matrix2<f64>, Vector2<f64>) {
        stations(length).fold((Matrix2::zeros(), Vector2::zeros()), |(I, c), (x, weight)| {
            self.nearest(x).map_or((I, c), |s| (I + s.second_moments * weight, c + s.centroid * weight))
        })
    }

    /// Returns the mean centroid, in the axes y and z of S (m).
    fn centroid(&self, length: f64) -> Vector2<f64> {
        self.mean(length).1
    }

    /// Returns the angle from y to the axis of the maximum `∫ y²` (rad); zero if the axes of S are
    /// nearly principal.
    fn principal_turn(&self, length: f64) -> f64 {
        let (I, _) = self.mean(length);
        let (a, b, c) = (I[(0, 0)], I[(1, 1)], I[(0, 1)]);
        if c.abs() < 0.02 * (a + b) { 0.0 } else { 0.5 * (2.0 * c).atan2(a - b) }
    }

    /// Returns boxes or circles with the second moments of the outlines.
    ///
    /// * `turn`: angle from the axes of S to the principal axes (rad).
    fn outlines(&self, turn: f64, shape: Shape) -> Vec<Outline> {
        let R = Rotation2::new(turn);
        let step = self.sections[1].0 - self.sections[0].0;
        let outline = |(x, s): (f64, &CrossSection)| {
            // I_y = w h³/12, I_z = h w³/12
            let turned = R.matrix().transpose() * s.second_moments * R.matrix();
            let (I_z, I_y) = (turned[(0, 0)], turned[(1, 1)]);
            if shape == Shape::Tube {
                // I_y + I_z = π D⁴/32
                let diameter = (32.0 * (I_y + I_z) / std::f64::consts::PI).powf(0.25);
                return Outline { x, step, width: diameter, height: diameter };
            }
            let ratio = (I_z / I_y).sqrt();
            let height = (12.0 * I_y / ratio).powf(0.25);
            Outline { x, step, width: ratio * height, height }
        };
        self.found().map(outline).filter(|o| o.width.is_normal() && o.height.is_normal()).collect()
    }

    /// Whether most outlines are circles.
    fn is_round(&self, length: f64) -> bool {
        let round = |s: &CrossSection| {
            let [low, high] = {
                let moments = s.second_moments.symmetric_eigenvalues();
                [moments.min(), moments.max()]
            };
            let radius_of_gyration = (s.second_moments.trace() / s.area).sqrt();
            let of_area = (s.area / (2.0 * std::f64::consts::PI)).sqrt();
            high / low - 1.0 < ROUND[0] && (radius_of_gyration / of_area - 1.0) < 0.5 * ROUND[1] && {
                let circle = 2.0 * (std::f64::consts::PI * s.area).sqrt();
                s.perimeter / circle - 1.0 < ROUND[1]
            }
        };
        let (all, of_circles) = self.within(length).fold((0, 0), |(n, k), (_, s)| (n + 1, k + usize::from(round(s))));
        2 * of_circles > all
    }
}

/// Returns positions along the beam with the weights of the tip compliance under a force at the
/// tip: `3 (1 - x/l)²`, normalised to a sum of 1.
fn stations(length: f64) -> impl Iterator<Item = (f64, f64)> {
    let weight = move |k: usize| {
        let s = (k as f64 + 0.5) / STATIONS as f64;
        (s * length, 3.0 * (1.0 - s).powi(2) / STATIONS as f64)
    };
    let sum: f64 = (0..STATIONS).map(|k| weight(k).1).sum();
    (0..STATIONS).map(move |k| (weight(k).0, weight(k).1 / sum))
}

/// Interpolates linearly between the cuts; constant beyond them.
fn outline_at(outlines: &[Outline], x: f64) -> [f64; 2] {
    let above = outlines.iter().position(|o| o.x >= x);
    let size = |o: &Outline| [o.width, o.height];
    match above {
        Some(0) => size(&outlines[0]),
        None => outlines.last().map_or([0.0; 2], size),
        Some(k) => {
            let (a, b) = (&outlines[k - 1], &outlines[k]);
            let part = (x - a.x) / (b.x - a.x);
            [a.width + part * (b.width - a.width), a.height + part * (b.height - a.height)]
        }
    }
}

/// Returns a mean over the beam, weighted for a force at its tip.
fn weighted(outlines: &[Outline], length: f64, of: impl Fn(&Outline) -> f64) -> f64 {
    let value = |x: f64| {
        let [width, height] = outline_at(outlines, x);
        of(&Outline { x, step: 0.0, width, height })
    };
    stations(length).map(|(x, weight)| weight * value(x)).sum()
}

/// Volume of a shell of this wall thickness over all cuts, solid where the walls meet (m³).
fn shell(outlines: &[Outline], shape: Shape, wall: f64) -> f64 {
    let filled = if shape == Shape::Tube { std::f64::consts::FRAC_PI_4 } else { 1.0 };
    let area = |o: &Outline| {
        let inner = (o.width - 2.0 * wall).max(0.0) * (o.height - 2.0 * wall).max(0.0);
        filled * (o.width * o.height - inner)
    };
    outlines.iter().map(|o| area(o) * o.step).sum()
}

/// Volume of the shell between the joints only (m³).
fn shell_between(outlines: &[Outline], shape: Shape, length: f64, wall: f64) -> f64 {
    let piece = |(x, _): (f64, f64)| {
        let [width, height] = outline_at(outlines, x);
        shell(&[Outline { x, step: length / STATIONS as f64, width, height }], shape, wall)
    };
    stations(length).map(piece).sum()
}

/// Returns the wall thickness of a shell with this volume; `None` if a solid body has less.
fn wall_for(outlines: &[Outline], shape: Shape, volume: f64) -> Option<f64> {
    let most = outlines.iter().map(|o| 0.5 * o.width.min(o.height)).fold(0.0, f64::max);
    if shell(outlines, shape, most) < volume * (1.0 - 1e-3) {
        return None;
    }
    let (mut low, mut high) = (0.0, most);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if shell(outlines, shape, middle) < volume { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

/// Returns the lightest material with which the shape can have the mass, and the wall thickness.
fn wall(outlines: &[Outline], shape: Shape, mass: f64) -> Result<(&'static str, f64), NoSection> {
    for (name, density, material) in MATERIALS {
        let Some(wall) = wall_for(outlines, shape, mass / density) else { continue };
        if wall < THINNEST {
            return Err(thin_wall(mass, wall, material));
        }
        return Ok((name, wall));
    }
    let volume = shell(outlines, shape, f64::INFINITY);
    Err(format!(
        "its mass contradicts its mesh: {mass:.2} kg in {:.2} litres, solid steel would have {:.2} kg",
        1e3 * volume,
        7850.0 * volume
    )
    .into())
}

/// Returns the reason why a wall is too thin.
fn thin_wall(mass: f64, wall: f64, material: &str) -> NoSection {
    format!(
        "its {mass:.3} kg would be a wall of {:.2} mm of {material} around its outline: the mass does not match the \
         mesh",
        1e3 * wall
    )
    .into()
}

/// Second moments of a hollow section about y and z (m⁴).
fn hollow(shape: Shape, [width, height]: [f64; 2], wall: f64) -> [f64; 2] {
    let (w, h) = ((width - 2.0 * wall).max(0.0), (height - 2.0 * wall).max(0.0));
    if shape == Shape::Tube {
        return [std::f64::consts::PI / 64.0 * (width.powi(4) - w.powi(4)); 2];
    }
    [(width * height.powi(3) - w * h.powi(3)) / 12.0, (height * width.powi(3) - h * w.powi(3)) / 12.0]
}

/// Returns the uniform section with the tip deflection of the link under a force:
/// `1/I = ∑ weight / I(x)` about both axes.
fn equivalent(outlines: &[Outline], shape: Shape, length: f64, wall: f64) -> BeamSection {
    let compliance = stations(length).fold([0.0; 2], |[a, b], (x, weight)| {
        let [I_y, I_z] = hollow(shape, outline_at(outlines, x), wall);
        [a + weight / I_y, b + weight / I_z]
    });
    let [I_y, I_z] = compliance.map(|c| 1.0 / c);
    let [mut width, mut height] = [weighted(outlines, length, |o| o.width), weighted(outlines, length, |o| o.height)];
    let largest = |x: f64| outline_at(outlines, x).into_iter().fold(0.0, f64::max);
    let sizes = || stations(length).map(|(x, _)| largest(x));
    let taper = sizes().fold(0.0, f64::max) / sizes().fold(f64::INFINITY, f64::min);
    // Fixed-point iteration: second moments scale roughly with the fourth power of the sizes, so
    // each step about halves the error.
    for _ in 0..60 {
        let [now_y, now_z] = hollow(shape, [width, height], wall);
        height *= (I_y / now_y).powf(0.25);
        width *= (I_z / now_z).powf(0.25);
    }
    let solid = 2.0 * wall > 0.98 * width.min(height);
    let section = match (shape, solid) {
        (Shape::Box, false) => "box",
        (Shape::Box, true) => "rectangle",
        (Shape::Tube, false) => "tube",
        (Shape::Tube, true) => "circle",
    };
    BeamSection {
        section,
        width,
        height,
        wall: (!solid).then_some(wall),
        wall_of_half: None,
        material: "aluminium",
        y_axis: [0.0, 1.0, 0.0],
        offset: [0.0; 3],
        ends: None,
        taper,
        open: 0.0,
    }
}
