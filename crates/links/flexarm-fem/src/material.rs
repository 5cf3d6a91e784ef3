//! Isotropic linear elastic materials.
//!
//! The presets are textbook values for a first estimate; prefer a certificate or a test of the
//! part. Start at [`Material::named`]; [`Material::warnings`] finds wrong units.
//!
//! Not here: Hooke's law of a solid ([`crate::element`]), strength, damping.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::error::{FemError, positive};
use crate::units::UnitSystem;

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
    /// Shear modulus, Pa; `E / (2 (1 + nu))` if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub G: Option<f64>,
}

impl Material {
    /// Structural steel: EN 1993-1-1, 3.2.6 (E 210 GPa, nu 0.3); density from EN 1991-1-1, annex A.
    pub const STEEL: Self = Self::isotropic(210e9, 0.30, 7850.0);

    /// Aluminium alloys: E 70 GPa and density from EN 1999-1-1, 3.2.5; nu 0.33 as in Gere & Goodno,
    /// *Mechanics of Materials*, appendix I (E 70 to 79 GPa, nu 0.33, 2600 to 2800 kg/m³).
    pub const ALUMINIUM: Self = Self::isotropic(70e9, 0.33, 2700.0);

    /// Grey cast iron of the class EN-GJL-250: EN 1561, annex (E 103 to 118 GPa, nu 0.26, 7200
    /// kg/m³).
    pub const CAST_IRON: Self = Self::isotropic(110e9, 0.26, 7200.0);

    /// Ductile (spheroidal) cast iron, EN-GJS-400: EN 1563, annex (E 169 GPa, nu 0.275, 7100
    /// kg/m³).
    pub const DUCTILE_IRON: Self = Self::isotropic(169e9, 0.275, 7100.0);

    /// Presets by the names used in files.
    pub const PRESETS: [(&'static str, Self); 4] = [
        ("steel", Self::STEEL),
        ("aluminium", Self::ALUMINIUM),
        ("cast_iron", Self::CAST_IRON),
        ("ductile_iron", Self::DUCTILE_IRON),
    ];

    /// Aliases of the presets, in the form that [`Self::preset`] looks up: lower case, words joined
    /// by `_`.
    const OTHER_NAMES: [(&'static str, &'static str); 19] = [
        ("structural_steel", "steel"),
        ("carbon_steel", "steel"),
        ("mild_steel", "steel"),
        ("aluminum", "aluminium"),
        ("aluminium_alloy", "aluminium"),
        ("aluminum_alloy", "aluminium"),
        ("alu", "aluminium"),
        ("al", "aluminium"),
        ("castiron", "cast_iron"),
        ("grey_iron", "cast_iron"),
        ("gray_iron", "cast_iron"),
        ("grey_cast_iron", "cast_iron"),
        ("gray_cast_iron", "cast_iron"),
        ("en_gjl_250", "cast_iron"),
        ("ductile_cast_iron", "ductile_iron"),
        ("nodular_iron", "ductile_iron"),
        ("nodular_cast_iron", "ductile_iron"),
        ("spheroidal_cast_iron", "ductile_iron"),
        ("en_gjs_400", "ductile_iron"),
    ];

    /// Material with the isotropic shear modulus `G = E / (2 (1 + nu))`.
    ///
    /// * `E`: Pa; `nu`: Poisson's ratio; `rho`: kg/m³; checked by [`Self::check`].
    pub const fn isotropic(E: f64, nu: f64, rho: f64) -> Self {
        Self { E, nu, rho, G: None }
    }

    /// Looks up a preset by one of its names (`aluminium`, `Aluminum`, `cast iron`, ...); returns
    /// it with the name used in files.
    pub fn preset(name: &str) -> Option<(&'static str, Self)> {
        let plain = plain(name);
        let other = Self::OTHER_NAMES.iter().find(|(other, _)| *other == plain).map(|(_, name)| *name);
        let name = other.unwrap_or(&plain);
        Self::PRESETS.into_iter().find(|(known, _)| *known == name)
    }

    /// Preset whose name is closest to an unknown name.
    pub fn suggestion(name: &str) -> Option<&'static str> {
        let others = Self::OTHER_NAMES.iter().map(|(other, _)| *other);
        let found =
            flexarm_settings::closest(&plain(name), Self::PRESETS.iter().map(|(known, _)| *known).chain(others))?;
        Self::preset(&found).map(|(known, _)| known)
    }

    /// Looks up a preset as [`Self::preset`] does, or returns an error that lists all presets.
    ///
    /// # Errors
    /// [`FemError::UnknownName`], with all known names and the closest one.
    pub fn named(name: &str) -> Result<Self, FemError> {
        Self::preset(name).map(|(_, material)| material).ok_or_else(|| FemError::UnknownName {
            what: "material",
            found: name.to_owned(),
            known: {
                let known = Self::PRESETS.map(|(known, _)| known).join(", ");
                match Self::suggestion(name) {
                    Some(meant) => format!("{known}; is {meant:?} meant?"),
                    None => known,
                }
            },
        })
    }

    /// Shear modulus, Pa: the given one, or `E / (2 (1 + nu))`.
    pub fn shear_modulus(&self) -> f64 {
        self.G.unwrap_or(self.E / (2.0 * (1.0 + self.nu)))
    }

    /// Checks that `E > 0`, `rho > 0`, `G > 0`, `-1 < nu <= 0.5`.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for the first value out of range.
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

    /// Returns the plausible Young's moduli of a material of its density (Pa).
    pub fn usual_moduli(&self) -> RangeInclusive<f64> {
        let (soft, light) = ELASTOMERS;
        let least = if self.rho < light { soft } else { *MODULI.start() };
        least..=*MODULI.end()
    }

    /// Warns about constants that pass [`Self::check`] but are implausible for a robot; usually
    /// because of a wrong unit.
    ///
    /// * `units`: units of the file, so that the message shows the value as written there.
    pub fn warnings(&self, units: &UnitSystem) -> Vec<String> {
        let mut warnings = Vec::new();
        let written = |value: f64, unit: f64| match *units == UnitSystem::SI {
            true => String::new(),
            false => format!(" ({:.4e} in units {units})", value / unit),
        };
        // Each constant outside the range of solids, with the unit that would explain it.
        let moduli = self.usual_moduli();
        if !moduli.contains(&self.E) {
            warnings.push(format!(
                "Young's modulus E is {:.3e} Pa{}; solids have {:.0e} to {:.1e} Pa{}",
                self.E,
                written(self.E, units.stress()),
                moduli.start(),
                moduli.end(),
                likely(self.E, &moduli, &MODULUS_SLIPS)
            ));
        }
        if !DENSITIES.contains(&self.rho) {
            warnings.push(format!(
                "the density is {:.3e} kg/m3{}; solids have {} to {} kg/m3{}",
                self.rho,
                written(self.rho, units.density()),
                DENSITIES.start(),
                DENSITIES.end(),
                likely(self.rho, &DENSITIES, &DENSITY_SLIPS)
            ));
        }
        if !RATIOS.contains(&self.nu) {
            warnings.push(format!(
                "Poisson's ratio nu is {}; metals have 0.25 to 0.35, other solids {} to {}{}",
                self.nu,
                RATIOS.start(),
                RATIOS.end(),
                if self.nu < 0.0 { ": is the sign right?" } else { ": is rubber meant?" }
            ));
        }
        warnings
    }
}

/// Plausible Young's moduli, from soft plastics to diamond, Pa.
const MODULI: RangeInclusive<f64> = 1e8..=1.3e12;
/// Minimum modulus of rubbers and printed elastomers (Pa), and their greatest density (kg/m³).
const ELASTOMERS: (f64, f64) = (1e6, 1800.0);
/// Plausible densities, from rigid foam to osmium, kg/m³.
const DENSITIES: RangeInclusive<f64> = 20.0..=23_000.0;
/// Plausible Poisson's ratios, from cork to stiff rubber.
const RATIOS: RangeInclusive<f64> = 0.0..=0.49;

/// Unit errors of a modulus: factor by which the value is too large, and description.
const MODULUS_SLIPS: [(f64, &str); 5] = [
    (1e6, "given in Pa where the file is in MPa (mm, N)?"),
    (1e-6, "given in MPa where Pa is expected?"),
    (1e-9, "given in GPa where Pa is expected?"),
    (1e3, "given in MPa where the file is in GPa?"),
    (1e-3, "a factor of 1000 too small?"),
];
/// Unit errors of a density, as [`MODULUS_SLIPS`].
const DENSITY_SLIPS: [(f64, &str); 5] = [
    (1e12, "given in kg/m3 where the file is in t/mm3?"),
    (1e-12, "given in t/mm3 where kg/m3 is expected?"),
    (1e-9, "given in kg/mm3 where kg/m3 is expected?"),
    (1e9, "given in kg/m3 where the file is in kg/mm3?"),
    (1e-3, "given in g/cm3 where kg/m3 is expected?"),
];

/// Describes the unit error that explains a value, if there is one.
fn likely(value: f64, sound: &RangeInclusive<f64>, slips: &[(f64, &str)]) -> String {
    // Metals are the most common, so the factor that leads closest to the middle of the range is
    // chosen.
    let middle = (sound.start() * sound.end()).sqrt();
    let explains = slips.iter().filter(|(factor, _)| sound.contains(&(value / factor)));
    let off = |factor: f64| (value / factor / middle).ln().abs();
    let best = explains.min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    best.map_or_else(|| ": is the unit right?".into(), |(_, words)| format!(": {words}"))
}

/// Converts a name to lower case with `_` between words.
fn plain(name: &str) -> String {
    name.trim().to_lowercase().replace([' ', '-'], "_")
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
    fn common_spellings_of_a_material_are_the_material() {
        for (word, name) in [
            ("aluminum", "aluminium"),
            ("Aluminium", "aluminium"),
            ("STEEL", "steel"),
            ("cast iron", "cast_iron"),
            ("grey cast-iron", "cast_iron"),
            ("nodular iron", "ductile_iron"),
        ] {
            assert_eq!(Material::preset(word).unwrap().0, name, "{word}");
        }
        for (word, name) in [("alumnium", "aluminium"), ("steal", "steel"), ("duktile_iron", "ductile_iron")] {
            assert_eq!(Material::suggestion(word), Some(name));
        }
        assert_eq!(Material::suggestion("unobtainium"), None);
    }

    /// Truth: the same steel, each time with one unit error.
    #[test]
    fn a_slip_of_the_unit_is_told_with_the_value_in_the_file_and_the_slip() {
        let mm: UnitSystem = "mm-t-s".parse().unwrap();
        let finding = |material: Material, units: &UnitSystem| material.warnings(units).join("; ");
        let pa_in_mpa = finding(Material::isotropic(2.1e11 * mm.stress(), 0.3, 7850.0), &mm);
        assert!(pa_in_mpa.contains("2.1000e11 in units mm-t-s") && pa_in_mpa.contains("Pa where"), "{pa_in_mpa}");
        let kg_in_t = finding(Material::isotropic(2.1e11, 0.3, 7850.0 * mm.density()), &mm);
        assert!(kg_in_t.contains("7.8500e3 in units mm-t-s") && kg_in_t.contains("t/mm3"), "{kg_in_t}");
        for (E, nu, rho, word) in [
            (2.1e5, 0.3, 7850.0, "given in MPa"),
            (210.0, 0.3, 7850.0, "given in GPa"),
            (2.1e11, 0.3, 7.85, "g/cm3"),
            (2.1e11, 0.3, 7.85e-9, "t/mm3"),
            (2.1e11, 0.3, 7.85e-6, "kg/mm3"),
            (2.1e11, 0.5, 7850.0, "rubber"),
            (2.1e11, -0.9, 7850.0, "sign"),
        ] {
            let said = finding(Material::isotropic(E, nu, rho), &UnitSystem::SI);
            assert!(said.contains(word), "{E} {nu} {rho}: {said}");
        }
    }

    /// No false alarm for metals, plastics, composites and ceramics of data sheets.
    #[test]
    fn materials_of_data_sheets_raise_no_doubt() {
        for (E, nu, rho) in [
            (210e9, 0.3, 7850.0),
            (193e9, 0.29, 8000.0),
            (45e9, 0.35, 1800.0),
            (113e9, 0.34, 4430.0),
            (70e9, 0.33, 2700.0),
            (135e9, 0.3, 1600.0),
            (12e9, 0.35, 1400.0),
            (2.3e9, 0.39, 1050.0),
            (400e9, 0.28, 19_300.0),
            (600e9, 0.22, 15_600.0),
            (370e9, 0.22, 3900.0),
            (0.6e9, 0.45, 950.0),
        ] {
            assert_eq!(Material::isotropic(E, nu, rho).warnings(&UnitSystem::SI), Vec::<String>::new());
        }
    }

    #[test]
    fn impossible_moduli_are_refused() {
        assert!(Material::isotropic(-1.0, 0.3, 7850.0).check().is_err());
        assert!(Material::isotropic(210e9, 0.6, 7850.0).check().is_err());
        assert!(Material::isotropic(f64::NAN, 0.3, 7850.0).check().is_err());
    }
}
