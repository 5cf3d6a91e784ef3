//! Isotropic linear elasticity of a solid: check of a material, and Lamé constants.

use crate::error::FemError;
use crate::material::Material;

/// Allowed relative difference between a given shear modulus and `E / (2 (1 + nu))`. Covers the
/// rounding of a computed value, but not that of data sheets printed to a few digits.
const SHEAR_SLACK: f64 = 1e-9;

/// Checks that a material is valid for solid elements.
///
/// An isotropic solid has two constants; a separate shear modulus is meaningful only for beams. The
/// matrices of this module use `E` and `nu`; call this once per region before computing them.
///
/// # Errors
/// [`FemError::OutOfRange`]: as [`Material::check`]; `nu = 0.5` (the bulk modulus is infinite); a
/// `G` that differs from `E / (2 (1 + nu))` by more than 1e-9 of it.
pub(crate) fn check_solid_material(material: &Material) -> Result<(), FemError> {
    material.check()?;
    let refuse =
        |what: &str, found, allowed: String| Err(FemError::OutOfRange { what: what.to_owned(), found, allowed });
    if !(material.nu < 0.5) {
        return refuse("Poisson's ratio nu of a solid", material.nu, "above -1 and below 0.5".to_owned());
    }
    let isotropic = material.E / (2.0 * (1.0 + material.nu));
    match material.G {
        Some(G) if !((G - isotropic).abs() <= SHEAR_SLACK * isotropic) => refuse(
            "shear modulus G (Pa) of a solid",
            G,
            format!("none, or E / (2 (1 + nu)) = {isotropic}: a solid is isotropic here"),
        ),
        _ => Ok(()),
    }
}

/// Lamé constants `(lambda, mu)`, Pa, from `E` and `nu`.
pub(crate) fn lame(material: &Material) -> (f64, f64) {
    let (E, nu) = (material.E, material.nu);
    (E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu)))
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn a_solid_refuses_a_third_constant_and_incompressibility() {
        let own_shear = Material { G: Some(70e9), ..Material::STEEL };
        assert!(check_solid_material(&own_shear).unwrap_err().to_string().contains("shear modulus"));
        let same_shear = Material { G: Some(210e9 / 2.6), ..Material::STEEL };
        check_solid_material(&same_shear).unwrap();
        assert!(check_solid_material(&Material::isotropic(1e6, 0.5, 1000.0)).is_err());
    }
}
