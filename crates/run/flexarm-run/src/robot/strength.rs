//! Strengths of materials, against which the stress of links is judged (Pa).
//!
//! Start at [`Strength`]: those of the preset materials, or the entry of a robot file. Not here: the
//! stress (`run::monitor::stress`), the count of its cycles (`flexarm_analysis::SnCurve`).

use flexarm_analysis::SnCurve;
use flexarm_fem::Material;
use flexarm_files::{Source, TextFileError};
use serde::Deserialize;
use toml::Spanned;

/// `strength` of a flexible link as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StrengthEntry {
    /// Yield strength (Pa).
    #[serde(rename = "yield")]
    pub yield_pa: f64,
    /// Tensile strength (Pa).
    pub tensile: f64,
    /// Amplitude of a reversed stress that 1e6 cycles bear (Pa).
    pub fatigue: Option<f64>,
}

/// Strength of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// Material with its class.
    pub name: &'static str,
    /// Yield strength; of grey iron, which does not yield, the tensile strength (Pa).
    pub yield_pa: f64,
    /// Tensile strength (Pa).
    pub tensile_pa: f64,
    /// Amplitude of a reversed stress at the knee of the S-N curve (Pa), if known.
    pub fatigue_pa: Option<f64>,
}

impl Strength {
    /// Returns the S-N curve of parts that are not welded: knee at 1e6 cycles, slope 5 (FKM guideline, 6th
    /// edition, 4.4.3), for a probability of survival of 97.5 %, without surface and size effects.
    pub(crate) fn curve(&self) -> Option<SnCurve> {
        let (amplitude_pa, tensile_pa) = (self.fatigue_pa?, self.tensile_pa);
        Some(SnCurve { amplitude_pa, cycles: 1e6, slope: 5.0, tensile_pa })
    }

    /// Returns the strength of a preset material.
    pub(crate) fn of(material: &Material) -> Option<Self> {
        PRESETS.iter().find(|(preset, _)| preset == material).map(|(_, strength)| *strength)
    }

    /// Reads an entry; `link`: name for messages.
    pub(crate) fn read(entry: &Spanned<StrengthEntry>, link: &str, source: &Source) -> Result<Self, TextFileError> {
        let &StrengthEntry { yield_pa, tensile, fatigue } = entry.get_ref();
        let fail = |message: String| source.error(entry.span(), format!("link {link:?}: strength: {message}"));
        let numbers = [("yield", yield_pa), ("tensile", tensile), ("fatigue", fatigue.unwrap_or(1.0))];
        match numbers.into_iter().find(|(_, pa)| !(pa.is_finite() && *pa > 0.0)) {
            Some((key, found)) => Err(fail(format!("{key} = {found}: expected a positive number of Pa"))),
            None if yield_pa > tensile || fatigue.is_some_and(|fatigue| fatigue > tensile) => {
                Err(fail(format!("tensile = {tensile}: expected at least yield and fatigue")))
            }
            None => Ok(Self { name: "the robot file's material", yield_pa, tensile_pa: tensile, fatigue_pa: fatigue }),
        }
    }
}

const fn preset(name: &'static str, yield_pa: f64, tensile_pa: f64, fatigue: f64) -> Strength {
    Strength { name, yield_pa, tensile_pa, fatigue_pa: Some(fatigue * tensile_pa) }
}

/// Strengths of the least class that the presets name: EN 10025-2, EN 1999-1-1 (table 3.2b), EN
/// 1561, EN 1563; ratios of fatigue to tensile strength: FKM guideline, table 4.2.1.
static PRESETS: [(Material, Strength); 4] = [
    (Material::STEEL, preset("S235", 235e6, 360e6, 0.45)),
    (Material::ALUMINIUM, preset("EN AW-6082 T6", 250e6, 290e6, 0.3)),
    (Material::CAST_IRON, preset("EN-GJL-250", 250e6, 250e6, 0.3)),
    (Material::DUCTILE_IRON, preset("EN-GJS-400", 250e6, 400e6, 0.34)),
];
