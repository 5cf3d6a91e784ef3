//! A `beam = { ... }` entry: its keys, and the section and material built from them.
//!
//! [`Section::SHAPES`] lists the lengths that each shape takes.

use flexarm_fem::{Bar, BeamTheory, Material, Section};
use flexarm_linkmaker::MaterialEntry;
use serde::Deserialize;

/// Closed-form beam from the link's frame to the distal joint.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BeamEntry {
    /// `box`, `rectangle`, `tube`, `circle`, `i_beam`, `channel` or `given`.
    pub section: String,
    /// Width along section axis y (m).
    pub width: Option<f64>,
    /// Height along section axis z (m).
    pub height: Option<f64>,
    /// Wall thickness (m).
    pub wall: Option<f64>,
    /// Outer diameter of tubes (m).
    pub outer_diameter: Option<f64>,
    /// Diameter of circles (m).
    pub diameter: Option<f64>,
    /// Web thickness of I-beams and channels (m).
    pub web: Option<f64>,
    /// Flange thickness of I-beams and channels (m).
    pub flange: Option<f64>,
    /// Fillet radius between web and flange (m); 0 by default.
    pub fillet: Option<f64>,
    /// Axial stiffness (N).
    #[serde(rename = "EA")]
    pub ea: Option<f64>,
    /// Bending stiffness about y (N m²).
    #[serde(rename = "EI_y")]
    pub ei_y: Option<f64>,
    /// Bending stiffness about z (N m²).
    #[serde(rename = "EI_z")]
    pub ei_z: Option<f64>,
    /// Torsional stiffness (N m²).
    #[serde(rename = "GJ")]
    pub gj: Option<f64>,
    /// Shear stiffness along y (N).
    #[serde(rename = "kGA_y")]
    pub kga_y: Option<f64>,
    /// Shear stiffness along z (N).
    #[serde(rename = "kGA_z")]
    pub kga_z: Option<f64>,
    /// Mass per length of given sections (kg/m).
    pub mass_per_length: Option<f64>,
    /// Rotary inertia about y, `rho I_y`, of given sections (kg m).
    pub rotary_y: Option<f64>,
    /// Rotary inertia about z of given sections (kg m).
    pub rotary_z: Option<f64>,
    /// Name of a material, or its elastic constants.
    pub material: Option<MaterialEntry>,
    /// `euler-bernoulli` or `timoshenko`.
    pub theory: Option<String>,
    /// Direction of the section's y axis in link axes; chosen automatically by default.
    pub y_axis: Option<[f64; 3]>,
    /// Rotation of the section about the beam (rad).
    #[serde(default)]
    pub roll: f64,
    /// Offset of the beam from the line A-B, link axes (m).
    #[serde(default)]
    pub offset: [f64; 3],
    /// Ends of the beam itself, link axes (m); A and B by default. Rigid arms connect them to the
    /// joints.
    pub ends: Option<[[f64; 3]; 2]>,
    /// Position of the split, as a fraction of A-B.
    #[serde(default = "half")]
    pub split: f64,
    /// `from-link` or `uniform`.
    pub parts: Option<String>,
}

fn half() -> f64 {
    0.5
}

/// Section given by its stiffness instead of a shape.
pub(crate) const GIVEN: &str = "given";
const GIVEN_KEYS: &[&str] = &["EA", "EI_y", "EI_z", "GJ", "kGA_y", "kGA_z", "mass_per_length", "rotary_y", "rotary_z"];

fn shapes() -> String {
    Section::SHAPES.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", ")
}

impl BeamEntry {
    /// Returns all numbers that describe a section, by key.
    fn section_numbers(&self) -> [(&'static str, Option<f64>); 17] {
        [
            ("width", self.width),
            ("height", self.height),
            ("wall", self.wall),
            ("outer_diameter", self.outer_diameter),
            ("diameter", self.diameter),
            ("web", self.web),
            ("flange", self.flange),
            ("fillet", self.fillet),
            ("EA", self.ea),
            ("EI_y", self.ei_y),
            ("EI_z", self.ei_z),
            ("GJ", self.gj),
            ("kGA_y", self.kga_y),
            ("kGA_z", self.kga_z),
            ("mass_per_length", self.mass_per_length),
            ("rotary_y", self.rotary_y),
            ("rotary_z", self.rotary_z),
        ]
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.section_numbers().into_iter().find(|(name, _)| *name == key).and_then(|(_, value)| value)
    }

    fn needed(&self, key: &'static str) -> Result<f64, String> {
        self.number(key).ok_or_else(|| format!("section {section:?} needs {key}", section = self.section))
    }

    pub(crate) fn theory(&self) -> Result<BeamTheory, String> {
        match self.theory.as_deref() {
            None | Some("timoshenko") => Ok(BeamTheory::Timoshenko),
            Some("euler-bernoulli") => Ok(BeamTheory::EulerBernoulli),
            Some(other) => Err(format!("theory {other:?} is not known; use \"timoshenko\" or \"euler-bernoulli\"")),
        }
    }
}

/// Builds section and material; messages name missing and superfluous keys.
pub(crate) fn beam_section(beam: &BeamEntry) -> Result<(Section, Material), String> {
    let material = match &beam.material {
        Some(MaterialEntry::Named(name)) => Material::named(name).map_err(|error| error.to_string())?,
        Some(MaterialEntry::Given(m)) => Material::isotropic(m.young, m.nu, m.rho),
        // A given section contains its own stiffness.
        None if beam.section == GIVEN => Material::STEEL,
        None => return Err("material is missing: a name such as \"steel\" or { E = ..., nu = ..., rho = ... }".into()),
    };
    let (section, taken) = section(beam)?;
    let stray = |(key, value): &(&'static str, Option<f64>)| value.is_some() && !taken.contains(key);
    if let Some((key, _)) = beam.section_numbers().into_iter().find(stray) {
        return Err(format!("section {section:?} does not take {key}; it takes {taken:?}", section = beam.section));
    }
    Ok((section, material))
}

/// Builds the section, and returns the keys that it takes.
fn section(beam: &BeamEntry) -> Result<(Section, &'static [&'static str]), String> {
    if beam.section == GIVEN {
        let bar = Bar {
            EA: beam.needed("EA")?,
            EI_y: beam.needed("EI_y")?,
            EI_z: beam.needed("EI_z")?,
            GJ: beam.needed("GJ")?,
            kGA_y: beam.kga_y,
            kGA_z: beam.kga_z,
            mass_per_length: beam.needed("mass_per_length")?,
            rotary_y: beam.needed("rotary_y")?,
            rotary_z: beam.needed("rotary_z")?,
        };
        return Ok((Section::Given(bar), GIVEN_KEYS));
    }
    let length = |key: &'static str, default: Option<f64>| {
        default.map_or_else(|| beam.needed(key), |d| Ok(beam.number(key).unwrap_or(d)))
    };
    let shape = Section::SHAPES.iter().find(|(word, _)| *word == beam.section);
    let found = Section::from_lengths(&beam.section, length).map_err(|error| error.to_string())?;
    match (found, shape) {
        (Some(section), Some((_, keys))) => Ok((section, keys)),
        _ => Err(format!("section {section:?} is not known; use {} or {}", shapes(), GIVEN, section = beam.section)),
    }
}
