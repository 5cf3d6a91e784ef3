//! Cross sections of beams and their properties: area, second moments, torsion, shear factors.
//!
//! Beam axes E: x along the beam, y and z in the section. `width` is along y, `height` along z.
//! `I_y` is the second moment *about* y (bending with deflection along z), `k_y` the shear factor
//! for a force *along* y. y and z are principal axes and the beam axis runs through the centroid,
//! which is also the shear centre of all shapes except the channel: see
//! [`SectionProperties::shear_centre_y`].
//!
//! Start at [`Section::bar`]; [`Section::properties`] is the purely geometric step.
//!
//! Not here: I-beams and channels (`open_section`), stress on the outline (`section_outline`), the
//! element ([`crate::beam`]).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::{FemError, positive};
use crate::material::Material;
use crate::open_section::Open;

/// Cross section of a straight beam; lengths in m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum Section {
    /// Hollow rectangle with one wall thickness, sharp corners.
    Box {
        /// Outer size along y, m.
        width: f64,
        /// Outer size along z, m.
        height: f64,
        /// Wall thickness, m.
        wall: f64,
    },
    /// Solid rectangle.
    Rectangle {
        /// Size along y, m.
        width: f64,
        /// Size along z, m.
        height: f64,
    },
    /// Hollow circle.
    Tube {
        /// Outer diameter, m.
        outer_diameter: f64,
        /// Wall thickness, m.
        wall: f64,
    },
    /// Solid circle.
    Circle {
        /// Diameter, m.
        diameter: f64,
    },
    /// I-beam with parallel flanges: web along z in the middle, both flanges along y.
    IBeam {
        /// Width of the flanges along y, m.
        width: f64,
        /// Outer size along z, m.
        height: f64,
        /// Thickness of the web, m.
        web: f64,
        /// Thickness of the flanges, m.
        flange: f64,
        /// Radius of the four fillets between web and flanges, m; 0 for sharp corners.
        #[serde(default)]
        fillet: f64,
    },
    /// Channel (U) with parallel flanges: web along z, both flanges from it along +y.
    Channel {
        /// Outer size along y, web included, m.
        width: f64,
        /// Outer size along z, m.
        height: f64,
        /// Thickness of the web, m.
        web: f64,
        /// Thickness of the flanges, m.
        flange: f64,
        /// Radius of the two fillets between web and flanges, m; 0 for sharp corners.
        #[serde(default)]
        fillet: f64,
    },
    /// Any section, given by its stiffness and mass per length; the material is not used.
    Given(Bar),
}

/// Geometry of a section; independent of the material except for Poisson's ratio in the shear
/// factors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SectionProperties {
    /// Area, m².
    pub A: f64,
    /// Second moment of area about y, m⁴.
    pub I_y: f64,
    /// Second moment of area about z, m⁴.
    pub I_z: f64,
    /// Torsion constant (St. Venant), m⁴.
    pub J: f64,
    /// Shear factor for a force along y.
    pub k_y: f64,
    /// Shear factor for a force along z.
    pub k_z: f64,
    /// Position of the shear centre along y relative to the centroid, m; 0 except for channels. A
    /// force along z that does not pass through the shear centre twists the beam. [`crate::Beam`]
    /// bends and twists about the centroid and ignores this value, so bending of a channel across
    /// its web is incomplete (caveat `shear-centre` of robots).
    pub shear_centre_y: f64,
}

/// Stiffness and mass of a bar per unit length: the section data that a beam needs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bar {
    /// Axial stiffness, N.
    pub EA: f64,
    /// Bending stiffness about y, N·m².
    pub EI_y: f64,
    /// Bending stiffness about z, N·m².
    pub EI_z: f64,
    /// Torsional stiffness, N·m².
    pub GJ: f64,
    /// Shear stiffness along y, N; needed by Timoshenko's theory only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kGA_y: Option<f64>,
    /// Shear stiffness along z, N; needed by Timoshenko's theory only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kGA_z: Option<f64>,
    /// Mass per length, kg/m.
    pub mass_per_length: f64,
    /// Second mass moment per length about y, `rho I_y`, kg·m.
    pub rotary_y: f64,
    /// Second mass moment per length about z, `rho I_z`, kg·m.
    pub rotary_z: f64,
}

/// Lists the shapes: name in files, variant, and lengths with optional defaults, one line per
/// shape.
macro_rules! shapes {
    ($($word:literal => $shape:ident { $($length:ident $(= $default:literal)?),+ }),+ $(,)?) => {
        /// Names of the shapes in files, with the lengths (m) of each.
        pub const SHAPES: &'static [(&'static str, &'static [&'static str])] =
            &[$(($word, &[$(stringify!($length)),+])),+];

        /// Creates the shape with this name in [`Self::SHAPES`]. Its lengths (m) come from
        /// `length`, which is called with the key and its default value; `None` for an unknown
        /// name.
        ///
        /// # Errors
        /// The first error of `length`.
        pub fn from_lengths<E>(
            word: &str,
            length: impl Fn(&'static str, Option<f64>) -> Result<f64, E>,
        ) -> Result<Option<Self>, E> {
            Ok(Some(match word {
                $($word => Self::$shape { $($length: length(stringify!($length), None$(.or(Some($default)))?)?),+ },)+
                _ => return Ok(None),
            }))
        }
    };
}

impl Section {
    shapes! {
        "box" => Box { width, height, wall },
        "rectangle" => Rectangle { width, height },
        "tube" => Tube { outer_diameter, wall },
        "circle" => Circle { diameter },
        "i_beam" => IBeam { width, height, web, flange, fillet = 0.0 },
        "channel" => Channel { width, height, web, flange, fillet = 0.0 },
    }

    /// Maximum outer size (m); none for [`Section::Given`].
    pub fn largest_size(&self) -> Option<f64> {
        match *self {
            Self::Box { width, height, .. }
            | Self::Rectangle { width, height }
            | Self::IBeam { width, height, .. }
            | Self::Channel { width, height, .. } => Some(width.max(height)),
            Self::Tube { outer_diameter: d, .. } | Self::Circle { diameter: d } => Some(d),
            Self::Given(_) => None,
        }
    }

    /// Computes area, second moments, torsion constant and shear factors of the shape.
    ///
    /// * `nu`: Poisson's ratio, for Cowper's shear factors.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for impossible dimensions; [`FemError::Missing`] for
    /// [`Section::Given`], which has no shape.
    ///
    /// # Source
    /// Shear factors: Cowper (1966), table 1, circle, hollow circle, rectangle, thin-walled box.
    /// Torsion: rectangle by St. Venant's series (Timoshenko & Goodier, art. 109), box by Bredt's
    /// formula on the midline of the wall. I-beam and channel: the module `open_section`.
    pub fn properties(&self, nu: f64) -> Result<SectionProperties, FemError> {
        match *self {
            Self::Rectangle { width, height } => rectangle(width, height, nu),
            Self::Box { width, height, wall } => hollow_box(width, height, wall, nu),
            Self::Circle { diameter } => ring(diameter, 0.0, nu),
            Self::Tube { outer_diameter, wall } => {
                positive("outer diameter (m)", outer_diameter)?;
                check_wall(wall, outer_diameter)?;
                ring(outer_diameter, outer_diameter - 2.0 * wall, nu)
            }
            Self::IBeam { width, height, web, flange, fillet } => {
                Open { width, height, web, flange, fillet }.i_beam(nu)
            }
            Self::Channel { width, height, web, flange, fillet } => {
                Open { width, height, web, flange, fillet }.channel(nu)
            }
            Self::Given(_) => Err(FemError::Missing {
                what: "the shape of a section",
                help: "it is given by its stiffness; use `bar` instead",
            }),
        }
    }

    /// Stiffness and mass of the section with a material, along its axes y and z.
    ///
    /// ```text
    /// EA, EI_y, EI_z, GJ, k_y GA, k_z GA,   μ = rho A,   rotary = rho I
    /// ```
    /// * `material`: not used by [`Section::Given`].
    ///
    /// # Errors
    /// As [`Section::properties`], and [`FemError::OutOfRange`] for an impossible material or bar.
    pub fn bar(&self, material: &Material) -> Result<Bar, FemError> {
        if let Self::Given(bar) = self {
            bar.check()?;
            return Ok(*bar);
        }
        material.check()?;
        let s = self.properties(material.nu)?;
        let (E, G, rho) = (material.E, material.shear_modulus(), material.rho);
        let bar = Bar {
            EA: E * s.A,
            EI_y: E * s.I_y,
            EI_z: E * s.I_z,
            GJ: G * s.J,
            kGA_y: Some(s.k_y * G * s.A),
            kGA_z: Some(s.k_z * G * s.A),
            mass_per_length: rho * s.A,
            rotary_y: rho * s.I_y,
            rotary_z: rho * s.I_z,
        };
        bar.check()?;
        Ok(bar)
    }
}

impl Bar {
    /// Checks that every value is positive and finite.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for the first value that is not.
    pub fn check(&self) -> Result<(), FemError> {
        let values = [
            ("EA (N)", Some(self.EA)),
            ("EI_y (N m2)", Some(self.EI_y)),
            ("EI_z (N m2)", Some(self.EI_z)),
            ("GJ (N m2)", Some(self.GJ)),
            ("kGA_y (N)", self.kGA_y),
            ("kGA_z (N)", self.kGA_z),
            ("mass_per_length (kg/m)", Some(self.mass_per_length)),
            ("rotary_y (kg m)", Some(self.rotary_y)),
            ("rotary_z (kg m)", Some(self.rotary_z)),
        ];
        for (what, value) in values {
            if let Some(value) = value {
                positive(what, value)?;
            }
        }
        Ok(())
    }
}

/// Properties of a solid rectangle, width along y; shear factor of [Cowper 1966].
fn rectangle(width: f64, height: f64, nu: f64) -> Result<SectionProperties, FemError> {
    positive("width (m)", width)?;
    positive("height (m)", height)?;
    let k = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu);
    Ok(SectionProperties {
        A: width * height,
        I_y: width * height.powi(3) / 12.0,
        I_z: height * width.powi(3) / 12.0,
        J: rectangle_torsion(width, height),
        k_y: k,
        k_z: k,
        shear_centre_y: 0.0,
    })
}

/// St. Venant's torsion constant of a rectangle, exact to rounding.
///
/// ```text
/// J = a b³ [1/3 - (64/π⁵) (b/a) Σ tanh(nπa/2b)/n⁵],   n = 1, 3, 5, ...,   a >= b
/// ```
/// With `tanh = 1 - 2/(e^{nπa/b} + 1)` the first part sums to (31/32) ζ(5) and the rest converges
/// exponentially: eight terms are exact to rounding even for a square.
fn rectangle_torsion(width: f64, height: f64) -> f64 {
    const ZETA_5: f64 = 1.036_927_755_143_37;
    let (a, b) = (width.max(height), width.min(height));
    let tail: f64 =
        (0..8).map(|k| f64::from(2 * k + 1)).map(|n| 2.0 / ((n * PI * a / b).exp() + 1.0) / n.powi(5)).sum();
    let sum = 31.0 / 32.0 * ZETA_5 - tail;
    a * b.powi(3) * (1.0 / 3.0 - 64.0 / PI.powi(5) * (b / a) * sum)
}

/// Properties of a box with walls of equal thickness, width along y.
fn hollow_box(width: f64, height: f64, wall: f64, nu: f64) -> Result<SectionProperties, FemError> {
    positive("width (m)", width)?;
    positive("height (m)", height)?;
    check_wall(wall, width.min(height))?;
    let (w_in, h_in) = (width - 2.0 * wall, height - 2.0 * wall);
    let (w_mid, h_mid) = (width - wall, height - wall);
    let A = width * height - w_in * h_in;

    Ok(SectionProperties {
        A,
        I_y: (width * height.powi(3) - w_in * h_in.powi(3)) / 12.0,
        I_z: (height * width.powi(3) - h_in * w_in.powi(3)) / 12.0,
        // Bredt: J = 4 A_m² / ∮ ds/t
        J: 4.0 * (w_mid * h_mid).powi(2) * wall / (2.0 * (w_mid + h_mid)),
        k_y: box_shear_factor(w_mid, h_mid, nu),
        k_z: box_shear_factor(h_mid, w_mid, nu),
        shear_centre_y: 0.0,
    })
}

/// Shear factor of a thin-walled box for a force along the walls of length `a` (midline to
/// midline); `b` is the length of the walls across.
///
/// All four walls shear, including those across the force: counting only the walls along the force,
/// `a/(a + b)`, is 14 to 45 % too stiff for ordinary boxes. Solid elements agree with this formula
/// to 1 % (case 2 of docs/verification.md).
///
/// # Source
/// [Cowper 1966], table 1, thin-walled box, one wall thickness (`m = n = b/a`).
fn box_shear_factor(a: f64, b: f64, nu: f64) -> f64 {
    let m = b / a;
    let (m2, m3) = (m * m, m * m * m);
    10.0 * (1.0 + nu) * (1.0 + 3.0 * m).powi(2)
        / (12.0
            + 72.0 * m
            + 150.0 * m2
            + 90.0 * m3
            + nu * (11.0 + 66.0 * m + 135.0 * m2 + 90.0 * m3)
            + 10.0 * m2 * ((3.0 + nu) * m + 3.0 * m2))
}

/// Properties of a circle or tube with the given diameters, m.
fn ring(outer: f64, inner: f64, nu: f64) -> Result<SectionProperties, FemError> {
    positive("diameter (m)", outer)?;
    let (ro, ri) = (0.5 * outer, 0.5 * inner);
    let I = PI / 4.0 * (ro.powi(4) - ri.powi(4));
    // Cowper's hollow circle; m = 0 is the solid one, m -> 1 the thin tube 2(1+nu)/(4+3nu).
    let m2 = (ri / ro).powi(2);
    let q = (1.0 + m2).powi(2);
    let k = 6.0 * (1.0 + nu) * q / ((7.0 + 6.0 * nu) * q + (20.0 + 12.0 * nu) * m2);
    Ok(SectionProperties {
        A: PI * (ro * ro - ri * ri),
        I_y: I,
        I_z: I,
        J: 2.0 * I,
        k_y: k,
        k_z: k,
        shear_centre_y: 0.0,
    })
}

/// Checks that a wall (m) leaves a hole in the smallest outer size (m).
fn check_wall(wall: f64, smallest: f64) -> Result<(), FemError> {
    if wall > 0.0 && wall < 0.5 * smallest {
        return Ok(());
    }
    Err(FemError::OutOfRange {
        what: "wall thickness (m)".into(),
        found: wall,
        allowed: format!("above 0 and below half the smallest outer size, {}", 0.5 * smallest),
    })
}
