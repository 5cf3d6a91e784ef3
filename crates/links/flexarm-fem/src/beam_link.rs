//! A whole link as one beam: from a section, a material and a few frames to a [`ReducedLink`].
//!
//! The beam runs along x of its frame E, from `X_LE` over `length`. Rigid arms connect its two ends
//! to the joint frames A and B, wherever they are. The link is cut at a fraction of the beam; the
//! elastic joint is at the same fraction of the straight line from A to B unless `X_LS` is given.
//!
//! ```text
//! u_E2 = Ad_E2B u_B,    K_BB = Ad_E2Bᵀ K_E2E2 Ad_E2B        E2: distal end of the beam, beam axes
//! ```

use flexarm_spatial::{Pose, adjoint};
use nalgebra::{Matrix3, Matrix6, Rotation3, Translation3, Vector3};

use crate::beam::{Beam, BeamTheory};
use crate::error::{FemError, positive};
use crate::frames::LinkFrames;
use crate::gate::GateLimits;
use crate::material::Material;
use crate::reduced::{Provenance, ReducedLink};
use crate::rigid_part::RigidPart;
use crate::section::Section;

/// Definition of a link that is one uniform beam between two joints.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamLink {
    /// Name of the link.
    pub name: String,
    /// Cross section.
    pub section: Section,
    /// Material; not used by [`Section::Given`].
    pub material: Material,
    /// Beam theory, with or without shear deformation.
    pub theory: BeamTheory,
    /// Length of the beam, m.
    pub length: f64,
    /// Beam frame E: origin at the proximal end, x along the beam, y and z the axes of the section.
    pub X_LE: Pose,
    /// Proximal interface.
    pub X_LA: Pose,
    /// Distal interface.
    pub X_LB: Pose,
    /// Position of the cut as a fraction of the beam, between 0 and 1.
    pub split_fraction: f64,
    /// Split frame; if not given, at `split_fraction` of the line from A to B, in link axes.
    pub X_LS: Option<Pose>,
    /// Mass of the whole link, kg, distributed along the beam; if not given, that of the section.
    pub mass: Option<f64>,
}

/// Minimum part of a section's y axis across the beam, 6 degrees off the beam.
const ACROSS: f64 = 0.1;

impl BeamLink {
    /// Beam along link x from A at the link origin to B, cut in the middle, Timoshenko's theory.
    ///
    /// * `length`: of the beam, and from A to B, m; checked by [`Self::reduce`].
    pub fn new(name: impl Into<String>, section: Section, material: Material, length: f64) -> Self {
        Self {
            name: name.into(),
            section,
            material,
            theory: BeamTheory::default(),
            length,
            X_LE: Pose::identity(),
            X_LA: Pose::identity(),
            X_LB: Pose::translation(length, 0.0, 0.0),
            split_fraction: 0.5,
            X_LS: None,
            mass: None,
        }
    }

    /// Places the joints at the link origin and at `length * axis`, and the beam parallel to that
    /// line.
    ///
    /// * `axis`: direction of the beam, link axes.
    /// * `y`: direction of the section's y axis before `roll`; only its component across `axis`
    ///   counts.
    /// * `roll`: rotation of the section about `axis`, rad.
    /// * `offset`: from the joint line to the beam, link axes, m.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] if `axis` is zero or `y` is within 6 degrees of it.
    pub fn along(self, axis: Vector3<f64>, y: Vector3<f64>, roll: f64, offset: Vector3<f64>) -> Result<Self, FemError> {
        let direction = |what: &str, v: Vector3<f64>, least: f64| {
            v.try_normalize(least).filter(|v| v.amax().is_finite()).ok_or_else(|| {
                let (what, found) = (what.to_owned(), v.norm());
                FemError::OutOfRange { what, found, allowed: format!("above {least} in length") }
            })
        };
        let x = direction("beam axis", axis, 1e-9)?;
        let y = direction("section axis y", y, 1e-9)?;
        let y = direction("part of the section axis y across the beam", y - x * x.dot(&y), ACROSS)?;
        let turned = y * roll.cos() + x.cross(&y) * roll.sin();
        let R_LE = Matrix3::from_columns(&[x, turned, x.cross(&turned)]);
        Ok(Self {
            X_LE: Pose::from_parts(Translation3::from(offset), Rotation3::from_matrix_unchecked(R_LE)),
            X_LA: Pose::identity(),
            X_LB: Pose::from_parts(Translation3::from(x * self.length), Rotation3::identity()),
            ..self
        })
    }

    /// Reduces the link in closed form.
    ///
    /// Returns the link with `K_BB` at Bo, link axes, and the two parts of the cut beam. `K_BB` is
    /// exact for every wrench at B.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for impossible dimensions, materials, fractions and masses,
    /// [`FemError::Missing`] for a section without shear stiffness in Timoshenko's theory, and the
    /// errors of the gate if the lever arms are so long that the stiffness is lost in rounding.
    pub fn reduce(&self) -> Result<ReducedLink, FemError> {
        let frames = LinkFrames::new(self.X_LA, self.X_LB);
        let frames = match self.X_LS {
            Some(X_LS) => frames.with_split(X_LS),
            None => frames.with_split_fraction(self.split_fraction),
        };
        let beam = self.beam()?;
        ReducedLink::from_matrix6(
            &self.name,
            frames,
            &self.tip_stiffness()?,
            self.parts(&beam)?,
            self.provenance(),
            &GateLimits::default(),
        )
    }

    /// Returns the beam between its own ends.
    fn beam(&self) -> Result<Beam, FemError> {
        Beam::new(self.section.bar(&self.material)?, self.theory, self.length)
    }

    /// Stiffness of the distal beam end E2, transferred over the rigid arm to Bo.
    ///
    /// Returns `K_BB = Ad_E2Bᵀ K_E2E2 Ad_E2B`, 6×6 (N/m, N/rad; N·m/m, N·m/rad), at Bo, link axes.
    pub(crate) fn tip_stiffness(&self) -> Result<Matrix6<f64>, FemError> {
        let X_LE2 = self.X_LE * Pose::translation(self.length, 0.0, 0.0);
        let Ad_E2B = adjoint(&(X_LE2.inverse() * Pose::from(self.X_LB.translation)));
        Ok(Ad_E2B.transpose() * self.beam()?.tip_stiffness() * Ad_E2B)
    }

    /// Rigid parts of the two halves of the beam; the rigid arms are massless.
    fn parts(&self, beam: &Beam) -> Result<[RigidPart; 2], FemError> {
        if !(self.split_fraction > 0.0 && self.split_fraction < 1.0) {
            return Err(FemError::OutOfRange {
                what: "split_fraction".into(),
                found: self.split_fraction,
                allowed: "above 0 and below 1: each part needs a mass (S itself may lie anywhere)".into(),
            });
        }
        let proximal = beam.piece(0.0, self.split_fraction)?;
        let distal = beam.piece(self.split_fraction, 1.0)?;
        let factor = match self.mass {
            Some(mass) => positive("mass of the link (kg)", mass)? / (proximal.mass + distal.mass),
            None => 1.0,
        };
        let place = |part: RigidPart| part.with_mass(part.mass * factor).transformed(&self.X_LE);
        Ok([place(proximal), place(distal)])
    }

    fn provenance(&self) -> Provenance {
        Provenance {
            source: "uniform beam in closed form".into(),
            method: format!("beam {}", self.theory.name()),
            tie: "rigid".into(),
            units: "m, N, kg, rad".into(),
            ..Provenance::default()
        }
    }
}
