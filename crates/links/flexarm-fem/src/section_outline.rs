//! Points on the outline of a section, and the shear stress there.
//!
//! Normal stress follows from the position of a point, shear stress from the shape:
//!
//! ```text
//! σ = N/A + M_y z/I_y - M_z y/I_z
//! τ = T torsion + V_y shear_y + V_z shear_z
//! ```
//! τ is positive along the outline, counter-clockwise seen against x. Torsion is that of St.
//! Venant: exact for circles and at the middles of the sides of rectangles, Bredt's for boxes, that
//! of strips for I-beams and channels. Shear by forces is the shear flow of thin walls, and the
//! formula of Jouravski for solid shapes. Warping of open sections is not included.
//!
//! Source: Timoshenko & Goodier, *Theory of Elasticity*, art. 109 and 113 to 115.

use std::f64::consts::{PI, TAU};

use crate::error::FemError;
use crate::open_section::Open;
use crate::section::{Section, SectionProperties};

/// Number of points on the outline of a circle.
const ON_CIRCLE: usize = 16;

/// Point on the outline of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OutlinePoint {
    /// Position from the centroid, m.
    pub(crate) y: f64,
    pub(crate) z: f64,
    /// Direction of the outline in y and z, counter-clockwise.
    pub(crate) tangent: [f64; 2],
    /// Shear stress per torque, 1/m³.
    pub(crate) torsion: f64,
    /// Shear stress per force along y, 1/m².
    pub(crate) shear_y: f64,
    /// Shear stress per force along z, 1/m².
    pub(crate) shear_z: f64,
}

impl OutlinePoint {
    /// Corner of a solid or open section, which bears no shear stress.
    fn corner([y, z]: [f64; 2]) -> Self {
        Self { y, z, tangent: [0.0, 1.0], torsion: 0.0, shear_y: 0.0, shear_z: 0.0 }
    }

    /// Point with a tangent and the stress by torsion.
    fn on_side([y, z]: [f64; 2], tangent: [f64; 2], torsion: f64) -> Self {
        Self { tangent, torsion, ..Self::corner([y, z]) }
    }
}

impl Section {
    /// Returns the points of the outline, counter-clockwise. Two of them at one place are the ends
    /// of two walls.
    ///
    /// # Errors
    /// As [`Section::properties`].
    pub(crate) fn outline(&self, nu: f64) -> Result<Vec<OutlinePoint>, FemError> {
        let own = self.properties(nu)?;
        Ok(match *self {
            Self::Circle { diameter } => round(0.5 * diameter, 0.0, &own),
            Self::Tube { outer_diameter, wall } => round(0.5 * outer_diameter, 0.5 * outer_diameter - wall, &own),
            Self::Rectangle { width, height } => rectangle(width, height, &own),
            Self::Box { width, height, wall } => hollow_box([width, height], wall, &own),
            Self::IBeam { width, height, web, flange, fillet } => {
                i_beam(&Open { width, height, web, flange, fillet }, &own)
            }
            Self::Channel { width, height, web, flange, fillet } => {
                channel(&Open { width, height, web, flange, fillet }, &own)
            }
            // Its properties are an error.
            Self::Given(_) => Vec::new(),
        })
    }
}

/// Circle or tube with the radii `outer` and `inner`.
fn round(outer: f64, inner: f64, own: &SectionProperties) -> Vec<OutlinePoint> {
    let (R, r) = (outer, inner);
    // Mean over the wall at the neutral axis over the mean over the section.
    let peak = 4.0 / 3.0 * (R * R + R * r + r * r) / (R * R + r * r) / own.A;
    let point = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / ON_CIRCLE as f64).sin_cos();
        OutlinePoint {
            shear_y: -peak * sin,
            shear_z: peak * cos,
            ..OutlinePoint::on_side([R * cos, R * sin], [-sin, cos], R / own.J)
        }
    };
    (0..ON_CIRCLE).map(point).collect()
}

/// Corners and middles of the sides of a rectangle.
fn rectangle(width: f64, height: f64, own: &SectionProperties) -> Vec<OutlinePoint> {
    let (y, z, peak) = (0.5 * width, 0.5 * height, 1.5 / own.A);
    let (upright, level) = (side_torsion(height, width) / own.J, side_torsion(width, height) / own.J);
    vec![
        OutlinePoint { shear_z: peak, ..OutlinePoint::on_side([y, 0.0], [0.0, 1.0], upright) },
        OutlinePoint::corner([y, z]),
        OutlinePoint { shear_y: -peak, ..OutlinePoint::on_side([0.0, z], [-1.0, 0.0], level) },
        OutlinePoint::corner([-y, z]),
        OutlinePoint { shear_z: -peak, ..OutlinePoint::on_side([-y, 0.0], [0.0, -1.0], upright) },
        OutlinePoint::corner([-y, -z]),
        OutlinePoint { shear_y: peak, ..OutlinePoint::on_side([0.0, -z], [1.0, 0.0], level) },
        OutlinePoint::corner([y, -z]),
    ]
}

/// Shear stress in the middle of a side of a rectangle, times J over the torque (m).
///
/// * `along`: length of this side; `across`: of the other, m.
fn side_torsion(along: f64, across: f64) -> f64 {
    let odd = (0..40).map(|k| f64::from(2 * k + 1));
    if along >= across {
        let sum: f64 = odd.map(|n| 1.0 / (n * n * (0.5 * n * PI * along / across).cosh())).sum();
        return across * (1.0 - 8.0 / (PI * PI) * sum);
    }
    // Σ (-1)^k/n² is Catalan's constant; tanh = 1 - 2/(e^2x + 1) makes the rest converge fast.
    const CATALAN: f64 = 0.915_965_594_177_219;
    let rest: f64 = odd
        .enumerate()
        .map(|(k, n)| {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            sign * 2.0 / ((n * PI * across / along).exp() + 1.0) / (n * n)
        })
        .sum();
    along * 8.0 / (PI * PI) * (CATALAN - rest)
}

/// Both ends and the middle of each wall of a box.
fn hollow_box([width, height]: [f64; 2], wall: f64, own: &SectionProperties) -> Vec<OutlinePoint> {
    let (b, h) = (width - wall, height - wall);
    let torsion = 1.0 / (2.0 * b * h * wall);
    // Stress by a unit force along z: in the walls along it at the corners and in the middle.
    let along_z = [b * h / (4.0 * own.I_y), (b * h / 4.0 + h * h / 8.0) / own.I_y];
    let along_y = [b * h / (4.0 * own.I_z), (b * h / 4.0 + b * b / 8.0) / own.I_z];
    let walls = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    let points = walls.into_iter().flat_map(|[n_y, n_z]| {
        [-1.0, 0.0, 1.0].map(|s: f64| {
            let tangent = [-n_z, n_y];
            // Signs of y and z; the flow is continuous around a corner.
            let (y, z) = (n_y + s * tangent[0], n_z + s * tangent[1]);
            let at = usize::from(s == 0.0);
            let shear_z = if n_y == 0.0 { y * along_z[0] * s.abs() } else { n_y * along_z[at] };
            let shear_y = if n_z == 0.0 { -z * along_y[0] * s.abs() } else { -n_z * along_y[at] };
            let place = [0.5 * width * y, 0.5 * height * z];
            OutlinePoint { shear_y, shear_z, ..OutlinePoint::on_side(place, tangent, torsion) }
        })
    });
    points.collect()
}

/// Corners of an I-beam, and the middles of its web and flanges.
fn i_beam(open: &Open, own: &SectionProperties) -> Vec<OutlinePoint> {
    let Open { width, height, web, flange, .. } = *open;
    let (y, z, w, f) = (0.5 * width, 0.5 * height, 0.5 * web, 0.5 * height - flange);
    let (of_web, of_flange) = (web / own.J, flange / own.J);
    let peak_z = open.web_shear(own);
    let peak_y = 1.5 / (2.0 * width * flange);
    let corners = |places: [[f64; 2]; 3]| places.map(OutlinePoint::corner);
    let web_middle = |side: f64| OutlinePoint {
        shear_z: side * peak_z,
        ..OutlinePoint::on_side([side * w, 0.0], [0.0, side], of_web)
    };
    let flange_middle = |side: f64| OutlinePoint {
        shear_y: -side * peak_y,
        ..OutlinePoint::on_side([0.0, side * z], [-side, 0.0], of_flange)
    };
    let mut points = vec![web_middle(1.0)];
    points.extend(corners([[w, f], [y, f], [y, z]]));
    points.push(flange_middle(1.0));
    points.extend(corners([[-y, z], [-y, f], [-w, f]]));
    points.push(web_middle(-1.0));
    points.extend(corners([[-w, -f], [-y, -f], [-y, -z]]));
    points.push(flange_middle(-1.0));
    points.extend(corners([[y, -z], [y, -f], [w, -f]]));
    points
}

/// Corners of a channel, and both sides of the middle of its web.
fn channel(open: &Open, own: &SectionProperties) -> Vec<OutlinePoint> {
    let Open { width, height, web, flange, .. } = *open;
    let outside = -open.channel_centroid();
    let (inside, tip) = (outside + web, outside + width);
    let (z, f) = (0.5 * height, 0.5 * height - flange);
    let middle = |y: f64, side: f64| OutlinePoint {
        shear_z: side * open.web_shear(own),
        ..OutlinePoint::on_side([y, 0.0], [0.0, side], web / own.J)
    };
    let mut points = vec![middle(inside, 1.0)];
    points.extend([[inside, f], [tip, f], [tip, z], [outside, z]].map(OutlinePoint::corner));
    points.push(middle(outside, -1.0));
    points.extend([[outside, -z], [tip, -z], [tip, -f], [inside, -f]].map(OutlinePoint::corner));
    points
}
