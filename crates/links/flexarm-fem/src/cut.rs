//! Mass properties of a mesh, whole and cut into rigid parts by planes.
//!
//! Start at [`cut`]. [`mass_properties`] is the case without planes; [`volume_fractions`] is the
//! share of one element in each part. Planes are ordered from the proximal to the distal end, and
//! their normals point that way: plane k separates part k from part k + 1, and a point belongs to
//! the part whose number is the number of planes behind it. Planes must not intersect inside the
//! body.
//!
//! The material ahead of each plane is integrated; a part is the difference of two such integrals,
//! so the parts add up to the whole. Mesh axes, m, kg.
//!
//! Not here: choice of the planes; the elastic joint between the parts ([`crate::reduced`]).

mod moments;
mod piece;
#[cfg(test)]
mod tests;

use nalgebra::{Unit, Vector3};

use crate::element::InvertedElement;
use crate::error::{FemError, positive};
use crate::mesh::{ElementKind, Mesh, Region};
use crate::rigid_part::RigidPart;
use moments::{Line, Moments};

/// Ratio of part mass to total mass below which a part counts as empty.
const EMPTY: f64 = 1e-9;

/// Plane that cuts a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutPlane {
    /// Any point in the plane, m.
    pub point: Vector3<f64>,
    /// Normal, from the proximal to the distal side; any non-zero length.
    pub normal: Vector3<f64>,
}

/// Errors of weighing or cutting a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CutError {
    /// The mesh has no elements.
    #[error("the mesh has no elements")]
    NoElements,
    /// The number of densities differs from the number of regions.
    #[error("{found} densities were given for the {expected} regions of the mesh")]
    WrongCount {
        /// Number of regions of the mesh.
        expected: usize,
        /// Number of densities.
        found: usize,
    },
    /// A density, section or length is out of range.
    #[error("region {region:?}: {source}")]
    Region {
        /// Name of the region.
        region: String,
        /// Cause.
        source: Box<FemError>,
    },
    /// A region has beam elements but no section.
    #[error("region {region:?} has beam elements but no section: give one to the region")]
    NoSection {
        /// Name of the region.
        region: String,
    },
    /// An element is inverted.
    #[error("element {element}: {source}")]
    Inverted {
        /// Number of the element in the file.
        element: u64,
        /// Place and determinant.
        source: InvertedElement,
    },
    /// A plane has no direction, or a point or normal that is not finite.
    #[error("plane {plane} has no direction: its normal is ({}, {}, {})", normal.x, normal.y, normal.z)]
    NoNormal {
        /// Number of the plane, from 0.
        plane: usize,
        /// The normal.
        normal: Vector3<f64>,
    },
    /// A part contains no material.
    #[error(
        "cut plane {plane} leaves part {part} empty: {mass:.3e} kg of {whole:.3e} kg; does it miss the body, \
         point the other way, or stand in the wrong order?"
    )]
    EmptyPart {
        /// Number of the plane, from 0: the one that bounds the part, or the first of the two.
        plane: usize,
        /// Number of the part, from 0.
        part: usize,
        /// Computed mass of the part, kg; negative if planes are out of order.
        mass: f64,
        /// Mass of the mesh, kg.
        whole: f64,
    },
}

/// Checked plane: `distance = normal · (x - point)`, positive ahead; mesh axes, m.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: Vector3<f64>,
    point: Vector3<f64>,
}

impl Plane {
    fn new(number: usize, plane: &CutPlane) -> Result<Self, CutError> {
        match Unit::try_new(plane.normal, f64::MIN_POSITIVE) {
            Some(normal) if normal.iter().chain(&plane.point).all(|x| x.is_finite()) => {
                Ok(Self { normal: normal.into_inner(), point: plane.point })
            }
            _ => Err(CutError::NoNormal { plane: number, normal: plane.normal }),
        }
    }

    /// Signed distance of a point (m, mesh axes) if the normal is a unit vector.
    fn distance(&self, x: &Vector3<f64>) -> f64 {
        self.normal.dot(&(x - self.point))
    }
}

/// Mass, centre of mass and inertia of a mesh.
///
/// Exact for solids, straight or curved: the integrands are polynomials, and the rule is exact for
/// their degree. Beams count as lines with the mass and the rotary inertia of their section.
///
/// * `densities`: one per region, kg/m³. A beam section given by stiffness and mass per length
///   ([`Section::Given`](crate::Section::Given)) keeps its own mass.
///
/// Returns mass (kg), centre of mass (m) and inertia about it (kg·m²), mesh axes.
///
/// # Errors
/// As [`cut`].
pub fn mass_properties(mesh: &Mesh, densities: &[f64]) -> Result<RigidPart, CutError> {
    let (whole, _) = weigh(mesh, densities, &[])?;
    Ok(whole.rigid_part())
}

/// Cuts a mesh by planes into rigid parts, ordered from proximal to distal.
///
/// Straight tetrahedra, parallelepipeds and prisms are cut exactly, as is any element in which the
/// plane is also a plane in reference coordinates (a cut across an extruded mesh). In other curved
/// elements the cut face is replaced by small flat pieces, at most 1/16 of an element wide; the
/// mass of a part is then wrong by less than about 1e-6 of the mass of the elements that the plane
/// crosses (measured 2e-7 with arcs of 45 degrees per element). The parts always add up to the
/// mesh.
///
/// Beams are cut perpendicular to their axis.
///
/// * `densities`: as in [`mass_properties`].
/// * `planes`: mesh axes, m, from proximal to distal.
///
/// Returns one part more than there are planes, as in [`mass_properties`].
///
/// # Errors
/// [`CutError`] if the input is invalid, an element is inverted, or a part is empty.
pub fn cut(mesh: &Mesh, densities: &[f64], planes: &[CutPlane]) -> Result<Vec<RigidPart>, CutError> {
    let planes: Vec<Plane> =
        planes.iter().enumerate().map(|(number, plane)| Plane::new(number, plane)).collect::<Result<_, _>>()?;
    let (whole, ahead) = weigh(mesh, densities, &planes)?;

    // Part k is ahead of plane k - 1 and not ahead of plane k.
    let mut parts = Vec::with_capacity(planes.len() + 1);
    for part in 0..=planes.len() {
        let mut moments = if part == 0 { whole } else { ahead[part - 1] };
        if let Some(beyond) = ahead.get(part) {
            moments.subtract(beyond);
        }
        if !(moments.mass > EMPTY * whole.mass) {
            // Only the last plane bounds the last part.
            let plane = part.min(planes.len() - 1);
            return Err(CutError::EmptyPart { plane, part, mass: moments.mass, whole: whole.mass });
        }
        parts.push(moments.rigid_part());
    }
    Ok(parts)
}

/// Share of the volume of an element (of the length for a beam) in each part.
///
/// * `x`: positions of its nodes, in the order of [`ElementKind`], m.
/// * `planes`: same axes as x, from proximal to distal; the length of the normals does not matter.
///
/// Returns `planes.len() + 1` numbers that add up to one.
///
/// Costs one dot product per node and plane if no plane crosses the element.
///
/// # Errors
/// [`InvertedElement`] if a plane crosses the element and it is inverted.
///
/// # Panics
/// For a wrong number of nodes.
pub fn volume_fractions(
    kind: ElementKind,
    x: &[Vector3<f64>],
    planes: &[CutPlane],
) -> Result<Vec<f64>, InvertedElement> {
    let mut fractions = Vec::with_capacity(planes.len() + 1);
    let (mut whole, mut before) = (None, 1.0);
    for plane in planes {
        // Share ahead of the plane; the part between two planes is the difference.
        let plane = Plane { normal: plane.normal, point: plane.point };
        let ahead = match piece::side(kind, x, &plane) {
            piece::Side::Ahead => 1.0,
            piece::Side::Behind => 0.0,
            piece::Side::Crossed if kind.is_beam() => {
                let (from, to) = piece::ahead_of_line(x, &plane);
                to - from
            }
            piece::Side::Crossed => {
                let volume = match whole {
                    Some(volume) => volume,
                    None => *whole.insert(piece::whole(kind, x, &x[0])?.mass),
                };
                (piece::ahead(kind, x, &plane, &x[0]).mass / volume).clamp(0.0, before)
            }
        };
        fractions.push(before - ahead);
        before = ahead;
    }
    fractions.push(before);
    Ok(fractions)
}

/// Moments of the whole mesh and of the material ahead of each plane.
fn weigh(mesh: &Mesh, densities: &[f64], planes: &[Plane]) -> Result<(Moments, Vec<Moments>), CutError> {
    if densities.len() != mesh.regions.len() {
        return Err(CutError::WrongCount { expected: mesh.regions.len(), found: densities.len() });
    }
    // Moments about the centre of the bounding box keep the numbers at the size of the body.
    let (low, high) = mesh.bounding_box().ok_or(CutError::NoElements)?;
    let origin = (low + high) * 0.5;
    let mut whole = Moments::about(origin);
    let mut ahead = vec![whole; planes.len()];

    for block in &mesh.blocks {
        let region = &mesh.regions[block.region];
        let density =
            positive("density (kg/m3)", densities[block.region]).map_err(|source| in_region(region, source))?;
        // Each element counts to the whole, and ahead of a plane with all or with its cut piece.
        let mut x = Vec::with_capacity(block.kind.nodes());
        for (element, id) in block.elements().zip(&block.ids) {
            x.clear();
            x.extend(element.iter().map(|node| mesh.nodes[*node as usize]));
            let line = if block.kind.is_beam() { Some(line(region, density, &x)?) } else { None };

            let own = match &line {
                Some(line) => line.piece(0.0, 1.0, &origin),
                None => piece::whole(block.kind, &x, &origin)
                    .map_err(|source| CutError::Inverted { element: *id, source })?
                    .times(density),
            };
            whole.add(&own);
            for (plane, ahead) in planes.iter().zip(&mut ahead) {
                match (piece::side(block.kind, &x, plane), &line) {
                    (piece::Side::Behind, _) => {}
                    (piece::Side::Ahead, _) => ahead.add(&own),
                    (piece::Side::Crossed, Some(line)) => {
                        let (from, to) = piece::ahead_of_line(&x, plane);
                        ahead.add(&line.piece(from, to, &origin));
                    }
                    (piece::Side::Crossed, None) => {
                        ahead.add(&piece::ahead(block.kind, &x, plane, &origin).times(density));
                    }
                }
            }
        }
    }
    Ok((whole, ahead))
}

fn in_region(region: &Region, source: FemError) -> CutError {
    CutError::Region { region: region.name.clone(), source: Box::new(source) }
}

/// Creates the line with mass of a beam element.
fn line(region: &Region, density: f64, x: &[Vector3<f64>]) -> Result<Line, CutError> {
    let beam = region.beam.as_ref().ok_or_else(|| CutError::NoSection { region: region.name.clone() })?;
    Line::new(beam, density, x[0], x[1]).map_err(|source| in_region(region, source))
}
