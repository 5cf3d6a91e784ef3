//! Materials and sections of a deck, converted to SI.
//!
//! Start at [`MaterialCard`] and [`SectionCard`]. Dimensions are those of Abaqus; where CalculiX
//! differs, a warning says so. Not here: elements of a section ([`super::finish`]).

use std::collections::HashMap;

use nalgebra::Vector3;

use super::lines::{Card, Lines, numbers, squeezed};
use super::sets::Scope;
use crate::FeFileError;
use crate::mesh::source::Source;
use flexarm_fem::FemError;
use flexarm_fem::beam::BeamTheory;
use flexarm_fem::material::Material;
use flexarm_fem::mesh::BeamProperties;
use flexarm_fem::section::Section;
use flexarm_fem::units::UnitSystem;
use flexarm_settings::listed;

/// `*MATERIAL` with its sub-cards; SI.
pub(super) struct MaterialCard {
    pub(super) name: String,
    at: usize,
    elastic: Option<(f64, f64)>,
    density: Option<f64>,
}

/// `*SOLID SECTION` or `*BEAM SECTION`.
pub(super) struct SectionCard {
    pub(super) elset: String,
    pub(super) material: String,
    pub(super) scope: Scope,
    pub(super) at: usize,
    pub(super) title: String,
    /// For beams, shape and direction of the section's y axis.
    pub(super) beam: Option<(Section, Vector3<f64>)>,
}

impl MaterialCard {
    pub(super) fn new(src: &Source, card: &Card) -> Result<Self, FeFileError> {
        let name = card.need(src, "NAME")?.to_owned();
        Ok(Self { name, at: card.at, elastic: None, density: None })
    }

    /// Reads `*ELASTIC`: modulus and Poisson's ratio.
    pub(super) fn elastic(
        &mut self,
        lines: &mut Lines,
        card: &Card,
        units: &UnitSystem,
        warnings: &mut Vec<String>,
    ) -> Result<(), FeFileError> {
        let src = lines.src;
        let kind = card.get("TYPE").unwrap_or("ISOTROPIC");
        if !["ISOTROPIC", "ISO"].contains(&squeezed(kind).as_str()) {
            let found = format!("TYPE={kind} in material {:?}", self.name);
            return Err(card.refuse(&src, found, "TYPE=ISOTROPIC").help("only isotropic materials are read"));
        }
        let values = first_line(lines, card)?;
        let [E, nu, ..] = values[..] else {
            return Err(src.error(card.at, "*ELASTIC", format!("{values:?}"), "E, nu"));
        };
        if lines.data().is_some() {
            let name = &self.name;
            warnings.push(format!("material {name:?} depends on temperature; its first line of *ELASTIC is used"));
        }
        self.elastic = Some((E * units.stress(), nu));
        Ok(())
    }

    /// Reads `*DENSITY`.
    pub(super) fn density(&mut self, lines: &mut Lines, card: &Card, units: &UnitSystem) -> Result<(), FeFileError> {
        self.density = Some(first_line(lines, card)?[0] * units.density());
        Ok(())
    }

    /// Returns the material, or `None` with a warning if the data in the deck is incomplete.
    pub(super) fn material(&self, src: &Source, warnings: &mut Vec<String>) -> Result<Option<Material>, FeFileError> {
        let (Some((E, nu)), Some(rho)) = (self.elastic, self.density) else {
            let missing = if self.elastic.is_none() { "*ELASTIC" } else { "*DENSITY" };
            warnings.push(format!("material {:?} has no {missing} and was left out", self.name));
            return Ok(None);
        };
        let material = Material::isotropic(E, nu, rho);
        match material.check() {
            Ok(()) => Ok(Some(material)),
            Err(error) => Err(impossible(src, self.at, format!("material {:?}", self.name), &error)),
        }
    }
}

impl SectionCard {
    /// Reads `*SOLID SECTION`.
    pub(super) fn solid(src: &Source, card: &Card, scope: Scope) -> Result<Self, FeFileError> {
        if card.has("COMPOSITE") {
            return Err(card.refuse(src, "COMPOSITE", "one material per section"));
        }
        Ok(Self {
            elset: card.need(src, "ELSET")?.to_owned(),
            material: card.need(src, "MATERIAL")?.to_owned(),
            scope,
            at: card.at,
            title: card.title.clone(),
            beam: None,
        })
    }

    /// Reads `*BEAM SECTION`: dimensions, then the first local direction.
    pub(super) fn beam(
        lines: &mut Lines,
        card: &Card,
        scope: Scope,
        units: &UnitSystem,
        warnings: &mut Vec<String>,
    ) -> Result<Self, FeFileError> {
        let src = lines.src;
        let mut section = Self::solid(&src, card, scope)?;
        for key in ["OFFSET1", "OFFSET2"] {
            if card.get(key).is_some_and(|value| value.trim().parse() != Ok(0.0)) {
                return Err(card.refuse(&src, format!("{key}={}", card.get(key).unwrap_or("")), "no offset"));
            }
        }
        if card.has("NODALTHICKNESS") {
            return Err(card.refuse(&src, "NODAL THICKNESS", "one section for all elements"));
        }
        let shape = card.need(&src, "SECTION")?;
        let dimensions: Vec<f64> = first_line(lines, card)?.iter().map(|x| x * units.length).collect();
        let shape = beam_section(&squeezed(shape), &dimensions).ok_or_else(|| {
            let found = format!("SECTION={shape} with {} numbers", dimensions.len());
            let expected = "RECT (a, b), CIRC (radius), PIPE (radius, wall) or BOX (a, b, four equal walls)";
            card.refuse(&src, found, expected)
        })?;
        if matches!((&shape, dimensions.len()), (Section::Circle { .. }, 1)) {
            let elset = &section.elset;
            warnings.push(format!(
                "section {elset:?}: the one number of CIRC is taken as a radius, as in Abaqus; CalculiX takes it as \
                 a diameter: write two equal diameters to mean that"
            ));
        }
        // Poisson's ratio does not matter for the check of the dimensions.
        shape.properties(0.3).map_err(|error| impossible(&src, card.at, card.title.clone(), &error))?;

        let direction = match lines.data() {
            Some(line) => numbers(&src, card, line)?,
            None => vec![0.0, 0.0, -1.0],
        };
        let at = |k: usize| direction.get(k).copied().unwrap_or(0.0);
        let y_axis = Vector3::new(at(0), at(1), at(2));
        if y_axis.norm() == 0.0 {
            return Err(src.error(card.at, card.title.as_str(), "a direction of zero", "n1 of the section"));
        }
        section.beam = Some((shape, y_axis));
        Ok(section)
    }

    /// Returns the beam properties of the section, if it is one of beams.
    pub(super) fn beam_properties(&self, theory: BeamTheory) -> Option<BeamProperties> {
        self.beam.map(|(section, y_axis)| BeamProperties { section, y_axis, theory })
    }

    /// Finds the material of the section.
    pub(super) fn find<'a>(
        &self,
        src: &Source,
        materials: &'a [MaterialCard],
        by_name: &HashMap<String, usize>,
    ) -> Result<&'a MaterialCard, FeFileError> {
        let found = by_name.get(&squeezed(&self.material)).and_then(|k| materials.get(*k));
        found.ok_or_else(|| {
            let known = format!("one of: {}", listed(materials.iter().map(|known| &known.name)));
            let found = format!("MATERIAL={}", self.material);
            src.error(self.at, self.title.as_str(), found, known)
        })
    }
}

/// Dimensions as in Abaqus; two equal numbers for CIRC are diameters as in CalculiX
/// (beamsections.f).
fn beam_section(name: &str, dimensions: &[f64]) -> Option<Section> {
    match (name, dimensions) {
        ("RECT", [a, b]) => Some(Section::Rectangle { width: *a, height: *b }),
        ("CIRC", [radius]) => Some(Section::Circle { diameter: 2.0 * radius }),
        ("CIRC", [a, b]) if a == b => Some(Section::Circle { diameter: *a }),
        ("PIPE", [radius, wall]) => Some(Section::Tube { outer_diameter: 2.0 * radius, wall: *wall }),
        ("BOX", [a, b, walls @ ..]) if walls.len() == 4 && walls.iter().all(|wall| *wall == walls[0]) => {
            Some(Section::Box { width: *a, height: *b, wall: walls[0] })
        }
        _ => None,
    }
}

/// Numbers of the first data line, which is required.
fn first_line(lines: &mut Lines, card: &Card) -> Result<Vec<f64>, FeFileError> {
    let src = lines.src;
    match lines.data() {
        Some(line) => numbers(&src, card, line),
        None => Err(src.error(card.at, card.title.as_str(), "no data line", "numbers in the next line")),
    }
}

fn impossible(src: &Source, at: usize, element: String, error: &FemError) -> FeFileError {
    src.error(at, element, error.to_string(), "possible numbers").help("do the units fit?")
}
