//! Section and material of a `beam = { ... }` entry.

use flexarm_fem::{Bar, Material, Section};

use crate::robot_file::{BeamEntry, MaterialEntry};

/// Section and material; messages say which key is missing or too much.
pub(crate) fn beam_section(beam: &BeamEntry) -> Result<(Section, Material), String> {
    let given = beam.section == "given";
    let material = match &beam.material {
        Some(MaterialEntry::Named(name)) => Material::named(name).map_err(|e| e.to_string())?,
        Some(MaterialEntry::Given(m)) => Material::isotropic(m.young, m.nu, m.rho),
        // A given section carries its own stiffness.
        None if given => Material::STEEL,
        None => return Err("material is missing: a name such as \"steel\" or { E = ..., nu = ..., rho = ... }".into()),
    };
    let need = |value: Option<f64>, key: &str| value.ok_or_else(|| format!("section {:?} needs {key}", beam.section));
    let section = match beam.section.as_str() {
        "box" => Section::Box {
            width: need(beam.width, "width")?,
            height: need(beam.height, "height")?,
            wall: need(beam.wall, "wall")?,
        },
        "rectangle" => Section::Rectangle { width: need(beam.width, "width")?, height: need(beam.height, "height")? },
        "tube" => Section::Tube {
            outer_diameter: need(beam.outer_diameter, "outer_diameter")?,
            wall: need(beam.wall, "wall")?,
        },
        "circle" => Section::Circle { diameter: need(beam.diameter, "diameter")? },
        "given" => Section::Given(Bar {
            EA: need(beam.ea, "EA")?,
            EI_y: need(beam.ei_y, "EI_y")?,
            EI_z: need(beam.ei_z, "EI_z")?,
            GJ: need(beam.gj, "GJ")?,
            kGA_y: beam.kga_y,
            kGA_z: beam.kga_z,
            mass_per_length: need(beam.mass_per_length, "mass_per_length")?,
            rotary_y: need(beam.rotary_y, "rotary_y")?,
            rotary_z: need(beam.rotary_z, "rotary_z")?,
        }),
        other => return Err(format!("section {other:?} is not known; use box, rectangle, tube, circle or given")),
    };
    let used: &[&str] = match beam.section.as_str() {
        "box" => &["width", "height", "wall"],
        "rectangle" => &["width", "height"],
        "tube" => &["outer_diameter", "wall"],
        "circle" => &["diameter"],
        _ => &["EA", "EI_y", "EI_z", "GJ", "kGA_y", "kGA_z", "mass_per_length", "rotary_y", "rotary_z"],
    };
    let present = [
        ("width", beam.width),
        ("height", beam.height),
        ("wall", beam.wall),
        ("outer_diameter", beam.outer_diameter),
        ("diameter", beam.diameter),
        ("EA", beam.ea),
        ("EI_y", beam.ei_y),
        ("EI_z", beam.ei_z),
        ("GJ", beam.gj),
        ("kGA_y", beam.kga_y),
        ("kGA_z", beam.kga_z),
        ("mass_per_length", beam.mass_per_length),
        ("rotary_y", beam.rotary_y),
        ("rotary_z", beam.rotary_z),
    ];
    if let Some((key, _)) = present.iter().find(|(key, value)| value.is_some() && !used.contains(key)) {
        return Err(format!("section {:?} does not take {key}; it takes {used:?}", beam.section));
    }
    Ok((section, material))
}
