//! Isotropic linear elastic materials.
//!
//! The presets are textbook values for a first answer; a certificate or a test of the part is better.

use serde::{Deserialize, Serialize};

use crate::error::{FemError, positive};

/// Isotropic linear elastic material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus, Pa.
    pub E: f64,
    /// Poisson's ratio.
    pub nu: f64,
    /// Density, kg/m³.
    pub rho: f64,
    /// Shear modulus, Pa; `E / (2 (1 + nu))` where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub G: Option<f64>,
}

impl Material {
    /// Structural steel: EN 1993-1-1, 3.2.6 (E 210 GPa, nu 0.3); density from EN 1991-1-1, annex A.
    pub const STEEL: Self = Self::isotropic(210e9, 0.30, 7850.0);

    /// Aluminium alloys: E 70 GPa and density from EN 1999-1-1, 3.2.5; nu 0.33 as in Gere & Goodno,
    /// *Mechanics of Materials*, appendix I (E 70 to 79 GPa, nu 0.33, 2600 to 2800 kg/m³).
    pub const ALUMINIUM: Self = Self::isotropic(70e9, 0.33, 2700.0);

    /// Grey cast iron of the class EN-GJL-250: EN 1561, annex (E 103 to 118 GPa, nu 0.26, 7200 kg/m³).
    pub const CAST_IRON: Self = Self::isotropic(110e9, 0.26, 7200.0);

    /// Ductile (spheroidal) cast iron, EN-GJS-400: EN 1563, annex (E 169 GPa, nu 0.275, 7100 kg/m³).
    pub const DUCTILE_IRON: Self = Self::isotropic(169e9, 0.275, 7100.0);

    /// The presets by the name that files use.
    pub const PRESETS: [(&'static str, Self); 4] = [
        ("steel", Self::STEEL),
        ("aluminium", Self::ALUMINIUM),
        ("cast_iron", Self::CAST_IRON),
        ("ductile_iron", Self::DUCTILE_IRON),
    ];

    /// Material with the shear modulus that isotropy asks for.
    pub const fn isotropic(E: f64, nu: f64, rho: f64) -> Self {
        Self { E, nu, rho, G: None }
    }

    /// A preset by its name.
    ///
    /// # Errors
    /// [`FemError::UnknownName`], with all the names there are.
    pub fn named(name: &str) -> Result<Self, FemError> {
        Self::PRESETS.iter().find(|(known, _)| *known == name).map(|(_, material)| *material).ok_or_else(|| {
            FemError::UnknownName {
                what: "material",
                found: name.to_owned(),
                known: Self::PRESETS.map(|(known, _)| known).join(", "),
            }
        })
    }

    /// Shear modulus, Pa: the given one, or `E / (2 (1 + nu))`.
    pub fn shear_modulus(&self) -> f64 {
        self.G.unwrap_or(self.E / (2.0 * (1.0 + self.nu)))
    }

    /// Checks the ranges: `E > 0`, `rho > 0`, `G > 0`, `-1 < nu <= 0.5`.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the first value that is outside.
    pub fn check(&self) -> Result<(), FemError> {
        positive("Young's modulus E (Pa)", self.E)?;
        positive("density rho (kg/m3)", self.rho)?;
        if !(self.nu > -1.0 && self.nu <= 0.5) {
            return Err(FemError::OutOfRange {
                what: "Poisson's ratio nu".into(),
                found: self.nu,
                allowed: "above -1 and up to 0.5".into(),
            });
        }
        positive("shear modulus G (Pa)", self.shear_modulus())?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_possible_material_and_found_by_its_name() {
        for (name, material) in Material::PRESETS {
            material.check().unwrap();
            assert_eq!(Material::named(name).unwrap(), material);
        }
    }

    #[test]
    fn an_unknown_material_is_answered_with_the_known_ones() {
        let message = Material::named("steal").unwrap_err().to_string();
        assert!(message.contains("\"steal\"") && message.contains("aluminium"), "{message}");
    }

    #[test]
    fn impossible_moduli_are_refused() {
        assert!(Material::isotropic(-1.0, 0.3, 7850.0).check().is_err());
        assert!(Material::isotropic(210e9, 0.6, 7850.0).check().is_err());
        assert!(Material::isotropic(f64::NAN, 0.3, 7850.0).check().is_err());
    }
}
