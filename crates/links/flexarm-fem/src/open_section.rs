//! Section properties of I-beams and channels with parallel flanges, from their five lengths.
//!
//! Area and second moments are exact, including fillets. The torsion constant is that of thin walls
//! with a correction for each junction and each free edge; shear factors and shear centre are those
//! of thin walls. Their errors were measured against finite elements over the section
//! (`tests/open_sections.rs`):
//!
//! | quantity | rolled profiles, webs of 0.25 to 2 flanges, fillets up to 1.5 flanges |
//! | --- | --- |
//! | `J` | 3 % (without junctions and edges 25 %) |
//! | `k_z`, force along the web | 9 % too soft |
//! | `k_y`, force along the flanges | 22 % too soft: fillets and web width matter there |
//! | shear centre | 5 % |
//!
//! If warping of a flange is restrained at one end, the beam is stiffer in torsion than St.
//! Venant's `J`; the beams of this crate do not model that.
//!
//! Axes as in [`crate::Section`]: y along the flanges, z along the web.

use std::f64::consts::PI;

use crate::error::{FemError, positive};
use crate::section::SectionProperties;

/// Lengths of an open section, m.
#[derive(Clone, Copy)]
pub(crate) struct Open {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) web: f64,
    pub(crate) flange: f64,
    pub(crate) fillet: f64,
}

/// Area, second moment about its own centroid, and position of the centroid along one axis.
struct Piece {
    A: f64,
    I: f64,
    at: f64,
}

impl Open {
    /// Properties of an I-beam, web along z; see [`Section::IBeam`](crate::Section).
    ///
    /// * `nu`: Poisson's ratio, for the shear factors.
    pub(crate) fn i_beam(&self, nu: f64) -> Result<SectionProperties, FemError> {
        self.check(0.5 * (self.width - self.web))?;
        let Self { width: b, height: h, web, flange, .. } = *self;
        let along_y = [rectangle(2.0 * flange, b, 0.0), rectangle(h - 2.0 * flange, web, 0.0)]
            .into_iter()
            .chain([0.5, 0.5, -0.5, -0.5].map(|side| self.fillet_at(side * web, side.signum())));
        let [A, _, I_z] = sum(along_y);
        let (I_y, h_mid) = (self.about_y(4.0), h - flange);
        // The web is unstressed in bending along y: only the two flanges shear, as rectangles.
        let k_y = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * (2.0 * b * flange / A);
        let k_z = web_shear_factor(2.0 * b * flange / (h_mid * web), b / h_mid, nu);
        Ok(SectionProperties { A, I_y, I_z, J: self.torsion(Junction::Tee), k_y, k_z, shear_centre_y: 0.0 })
    }

    /// Properties of a channel, web along z, flanges to +y; see
    /// [`Section::Channel`](crate::Section).
    ///
    /// * `nu`: Poisson's ratio, for the shear factors.
    pub(crate) fn channel(&self, nu: f64) -> Result<SectionProperties, FemError> {
        self.check(self.width - self.web)?;
        let Self { width: b, height: h, web, flange, .. } = *self;
        let [A, y_c, I_z] = self.channel_along_y();
        let (b_mid, h_mid) = (b - 0.5 * web, h - flange);
        Ok(SectionProperties {
            A,
            I_y: self.about_y(2.0),
            I_z,
            J: self.torsion(Junction::Corner),
            k_y: flange_shear_factor(b_mid, h_mid, web, flange),
            // Two channels back to back form an I-beam of twice the width and twice the web
            // thickness that shears without twist.
            k_z: web_shear_factor(2.0 * b_mid * flange / (h_mid * web), 2.0 * b_mid / h_mid, nu),
            shear_centre_y: 0.5 * web - y_c - shear_centre(b_mid, h_mid, web, flange),
        })
    }

    /// Area, centroid from the outside of the web, and second moment about z of a channel.
    fn channel_along_y(&self) -> [f64; 3] {
        let Self { width: b, height: h, web, flange, .. } = *self;
        let along_y = [rectangle(2.0 * flange, b, 0.5 * b), rectangle(h - 2.0 * flange, web, 0.5 * web)]
            .into_iter()
            .chain([self.fillet_at(web, 1.0), self.fillet_at(web, 1.0)]);
        sum(along_y)
    }

    /// Distance of the centroid of a channel from the outside of its web, m.
    pub(crate) fn channel_centroid(&self) -> f64 {
        self.channel_along_y()[1]
    }

    /// Shear stress in the middle of the web per force along it, 1/m²: `S/(I_y t_w)` with the first
    /// moment S of one half of the section.
    pub(crate) fn web_shear(&self, own: &SectionProperties) -> f64 {
        let Self { width: b, height: h, web, flange, .. } = *self;
        let half = 0.5 * h - flange;
        (0.5 * b * flange * (h - flange) + 0.5 * web * half * half) / (own.I_y * web)
    }

    /// `overhang`: of a flange beyond the web on one side, m.
    fn check(&self, overhang: f64) -> Result<(), FemError> {
        let lengths = [("width (m)", self.width), ("height (m)", self.height), ("web thickness (m)", self.web)];
        for (what, length) in lengths {
            positive(what, length)?;
        }
        positive("flange thickness (m)", self.flange)?;
        let below = |what: &str, found: f64, limit: f64, of: &str| {
            let allowed = format!("below {of}, {limit}");
            (found < limit).then_some(()).ok_or(FemError::OutOfRange { what: what.into(), found, allowed })
        };
        below("web thickness (m)", self.web, self.width, "the width")?;
        below("flange thickness (m)", self.flange, 0.5 * self.height, "half the height")?;
        let overhang = overhang.min(0.5 * self.height - self.flange);
        if !(0.0..=overhang).contains(&self.fillet) {
            let allowed = format!("from 0 to what is free beside the web and between the flanges, {overhang}");
            return Err(FemError::OutOfRange { what: "fillet radius (m)".into(), found: self.fillet, allowed });
        }
        Ok(())
    }

    /// Fillet with its corner at `corner` along an axis, extending towards `side` (+1 or -1).
    ///
    /// A square minus a quarter circle: area `(1 - π/4) r²`, second moment about the corner
    /// `(1 - 5π/16) r⁴`.
    fn fillet_at(&self, corner: f64, side: f64) -> Piece {
        let r = self.fillet;
        let A = (1.0 - PI / 4.0) * r * r;
        let centroid = (10.0 - 3.0 * PI) / (12.0 - 3.0 * PI) * r;
        let I = (1.0 - 5.0 * PI / 16.0) * r.powi(4) - A * centroid * centroid;
        Piece { A, I, at: corner + side * centroid }
    }

    /// Second moment about y with `fillets` fillets: the outer rectangle minus the areas beside the
    /// web.
    fn about_y(&self, fillets: f64) -> f64 {
        let Self { width: b, height: h, web, flange, .. } = *self;
        let fillet = self.fillet_at(0.5 * h - flange, -1.0);
        (b * h.powi(3) - (b - web) * (h - 2.0 * flange).powi(3)) / 12.0
            + fillets * (fillet.I + fillet.A * fillet.at * fillet.at)
    }

    /// Torsion constant: strips, corrections for the junctions and for the free edges of the
    /// flanges.
    ///
    /// ```text
    /// J = 2/3 b t_f³ + 1/3 (h - 2 t_f) t_w³ + 2 α D⁴ - 0.420 t_f⁴
    /// D: diameter of the largest circle inscribed in a junction
    /// ```
    ///
    /// # Source
    /// [El Darwish & Johnston 1965], with their fits of α for a T (I-beam) and an L (channel).
    fn torsion(&self, junction: Junction) -> f64 {
        let Self { width: b, height: h, web, flange, fillet: r } = *self;
        let (w, f) = (web / flange, r / flange);
        let (alpha, D) = match junction {
            Junction::Tee => (
                -0.042 + 0.2204 * w + 0.1355 * f - 0.0865 * w * f - 0.0725 * w * w,
                ((flange + r).powi(2) + web * (r + 0.25 * web)) / (2.0 * r + flange),
            ),
            Junction::Corner => (
                -0.0908 + 0.2621 * w + 0.1231 * f - 0.0752 * w * f - 0.0945 * w * w,
                2.0 * ((3.0 * r + web + flange) - (2.0 * (2.0 * r + web) * (2.0 * r + flange)).sqrt()),
            ),
        };
        2.0 / 3.0 * b * flange.powi(3) + (h - 2.0 * flange) * web.powi(3) / 3.0 + 2.0 * alpha * D.powi(4)
            - 0.420 * flange.powi(4)
    }
}

/// Kind of junction of web and flange.
#[derive(Clone, Copy)]
enum Junction {
    Tee,
    Corner,
}

/// Rectangle with these sizes across and along the axis.
fn rectangle(across: f64, along: f64, at: f64) -> Piece {
    Piece { A: across * along, I: across * along.powi(3) / 12.0, at }
}

/// Area, centroid and second moment about the centroid.
fn sum(pieces: impl IntoIterator<Item = Piece>) -> [f64; 3] {
    let (mut A, mut first, mut second) = (0.0, 0.0, 0.0);
    for piece in pieces {
        A += piece.A;
        first += piece.A * piece.at;
        second += piece.I + piece.A * piece.at * piece.at;
    }
    [A, first / A, second - first * first / A]
}

/// Shear factor of a thin-walled I-section for a force along the web.
///
/// * `m`: area of both flanges divided by that of the web.
/// * `n`: width divided by height, midlines.
///
/// # Source
/// [Cowper 1966], table 1, thin-walled I-section.
fn web_shear_factor(m: f64, n: f64, nu: f64) -> f64 {
    let (m2, m3, n2) = (m * m, m * m * m, n * n);
    10.0 * (1.0 + nu) * (1.0 + 3.0 * m).powi(2)
        / (12.0
            + 72.0 * m
            + 150.0 * m2
            + 90.0 * m3
            + nu * (11.0 + 66.0 * m + 135.0 * m2 + 90.0 * m3)
            + 30.0 * n2 * (m + m2)
            + 5.0 * nu * n2 * (8.0 * m + 9.0 * m2))
}

/// Shear factor of a thin-walled channel for a force along the flanges, from the energy of the
/// shear flow.
///
/// ```text
/// 1/(k A) = ∫ (S/I_z)² ds/t       S: first moment of the area farther out, t: thickness
/// flange  S = t_f (y_1² - y²)/2   from the edge y_1 to the web at -c
/// web     S = t_w c s             s from the middle, where the flow changes its sign
/// ```
/// Poisson's ratio is neglected; its effect is 2 % in a rectangle. Lengths are those of midlines.
fn flange_shear_factor(b: f64, h: f64, web: f64, flange: f64) -> f64 {
    let A = 2.0 * b * flange + h * web;
    let c = b * b * flange / A;
    let y_1 = b - c;
    let I_z = 2.0 * flange * (b.powi(3) / 12.0 + b * (0.5 * b - c).powi(2)) + h * web * c * c;
    // ∫ (y_1² - y²)² dy
    let integral = |y: f64| y_1.powi(4) * y - 2.0 / 3.0 * y_1 * y_1 * y.powi(3) + y.powi(5) / 5.0;
    let flow = 2.0 * (0.25 * flange * (integral(y_1) - integral(-c)) + web * c * c * (0.5 * h).powi(3) / 3.0);
    I_z * I_z / (A * flow)
}

/// Distance of the shear centre of a thin-walled channel from its web, on the outside, midlines:
/// `3 b² t_f / (h t_w + 6 b t_f)`.
fn shear_centre(b: f64, h: f64, web: f64, flange: f64) -> f64 {
    3.0 * b * b * flange / (h * web + 6.0 * b * flange)
}
