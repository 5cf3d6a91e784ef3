//! Caveats about beams and damping in a robot file: material, section relative to length, mass
//! relative to the section's.
//!
//! Start at [`of_link`] and [`of_mounting`]. Not here: a 6×6 given for a link (`stiffness.rs`), rigid
//! parts against the mesh (`lumping.rs`).

use std::ops::RangeInclusive;

use flexarm_fem::{Bar, BeamLink, Material, Section};
use flexarm_flexlink::Parts;
use flexarm_kinematics::LinkInertia;
use flexarm_settings::Setting;
use flexarm_stepping::Damping;

use super::size::gyration;
use super::slip::{self, outside, slip};
use super::{Finding, kinds};
use crate::arm::options::LinkModel;
use crate::body_change::BodyChange;
use crate::robot::Robot;
use crate::robot::mounting::RobotMounting;
use crate::robot::robot_link::RobotLink;

/// Range of density, from foam to osmium (kg/m³).
const RHO: RangeInclusive<f64> = 20.0..=22_600.0;
/// Range of Poisson's ratio of structural materials; rubber has almost 0.5, auxetic foams less than
/// 0.
const NU: RangeInclusive<f64> = 0.0..=0.495;
/// Maximum thickness of a section relative to the beam's length.
const THICK: f64 = 3.0;
/// Range of a section's radius of gyration relative to the beam's length: from wires to bodies too
/// thick for a beam.
const SLENDER: RangeInclusive<f64> = 5e-4..=1.0;
/// Range of torsional stiffness relative to bending stiffness.
const TORSION: RangeInclusive<f64> = 1e-3..=1e3;
/// Range of shear stiffness relative to axial stiffness: from lattices to thick walls of low
/// modulus; 0.1 to 0.35 for one material.
const SHEAR: RangeInclusive<f64> = 1e-3..=1.0;
/// Range of the radius of gyration of a section by its mass, relative to that by its stiffness.
const ROTARY: RangeInclusive<f64> = 0.1..=10.0;
/// Maximum tip deflection due to an eccentric shear centre, relative to that of bending.
const TWIST: f64 = 0.01;
/// Wall thickness relative to the width (diameter) of a hollow section: note, warning. By Eurocode
/// 3 (EN 1993-1-1, table 5.2) flat walls buckle before yielding below 1/42, round ones below 1/90.
const THIN: [f64; 2] = [1.0 / 42.0, 1.0 / 90.0];
/// Default damping ratio.
pub(super) const USUAL_DAMPING: f64 = 0.03;
/// Range of the link's mass relative to that of its section.
const MASS: RangeInclusive<f64> = 0.02..=50.0;
/// Maximum distance between the centres of mass of the parts and of the URDF's link, relative to
/// the length.
const SHIFT: f64 = 0.01;
/// Maximum change of the moments of inertia, relative to the largest.
const INERTIA: f64 = 0.05;
/// Range of the damping ratio of jointed structures.
const RATIO: RangeInclusive<f64> = 1e-3..=0.2;
/// Maximum beta in `D = beta K` (s); above it the link creeps instead of vibrating.
pub(crate) const CREEP: f64 = 0.05;

/// Returns all of these caveats about a link. `own`: its inertia in the URDF.
pub(crate) fn of_link(link: &RobotLink, own: Option<&LinkInertia>) -> Vec<Finding> {
    let name = format!("link {:?}", link.flexible.link);
    let mut caveats: Vec<Finding> = damping(&name, &link.damping).into_iter().collect();
    if let Some(beam) = &link.beam {
        if !matches!(beam.section, Section::Given(_)) {
            caveats.extend(material(&name, &beam.material));
        }
        caveats.extend(section(&name, beam));
        caveats.extend(sizes(&name, beam, own));
    }
    caveats.extend(own.and_then(|own| body(&name, link, own)));
    caveats.extend(geometric(&name, link));
    caveats.extend(super::stiffness::of_stiffness(&name, link));
    caveats
}

/// Compares the body of the parts with that of the URDF, if the parts do not take it from there.
fn body(name: &str, link: &RobotLink, own: &LinkInertia) -> Option<Finding> {
    let RobotLink { flexible, .. } = link;
    let (length, body) = (flexible.reduced.p_AB().norm(), flexible.reduced.rigid());
    let change = BodyChange::of(own, &body);
    if flexible.parts != Parts::Reduced || (change.shift < SHIFT * length && change.inertia < INERTIA) {
        return None;
    }
    let message = format!(
        "{name}: its parts move the centre of mass by {:.4} m from the URDF's, {:.1} N m of static torque, and change \
         its moments of inertia by up to {:.0} %",
        change.shift,
        9.81 * body.mass * change.shift,
        100.0 * change.inertia
    );
    let help = match link.beam {
        Some(_) => "leave parts = \"uniform\" out, unless the URDF's inertia is wrong",
        None => "compare the mesh of the .flex file with the URDF",
    };
    let caveat = Finding { value: Some(change.shift), ..Finding::warning("uniform-mass", name, message, help) };
    // Moments of inertia alone change no static torque.
    Some(if change.shift < SHIFT * length { caveat.as_note() } else { caveat })
}

/// Checks whether requested geometric stiffening is available for the link.
fn geometric(name: &str, link: &RobotLink) -> Option<Finding> {
    let (message, help) = match (link.choices.model, link.has_geometric()) {
        _ if !link.choices.geometric => return None,
        (_, false) => (
            format!("{name}: geometric_stiffening is requested, but its .flex file has no geometric stiffness"),
            format!("make it with flexarm reduce {}", Setting::Geometric),
        ),
        (LinkModel::Modal, true) => return None,
        (_, true) => (
            format!("{name}: geometric_stiffening only counts for model = \"modal\""),
            format!("add model = \"modal\", or run with {} modal", Setting::Links),
        ),
    };
    Some(Finding::warning("geometric-stiffening", name, message, &help))
}

/// Maximum sink (m) of the base under the weight of the whole robot, and maximum tilt (rad) under
/// that weight at a lever of 1 m: cast pedestals and anchored plates stay below a tenth of it.
const SINKS: [f64; 2] = [1e-3, 5e-3];

/// Minimum sink (m): even the softest of stiff springs gives more.
const RIGID_SINK: f64 = 1e-9;

/// Maximum radius of gyration of a body on the springs (m).
const FOUNDATION: f64 = 20.0;

/// Checks the springs under the base.
pub(crate) fn of_mounting(robot: &Robot) -> Vec<Finding> {
    let Some(RobotMounting::Springs { springs, damping: damped, .. }) = &robot.mounting else { return Vec::new() };
    let name = format!("mounting {:?}", springs.name);
    let mut caveats: Vec<Finding> = damping(&name, damped).into_iter().collect();
    let links = robot.rigid.links.iter().filter_map(|link| link.inertia).map(|inertia| inertia.mass);
    let weight = 9.81 * (links.sum::<f64>() + springs.inertia.map_or(0.0, |inertia| inertia.mass));
    let K = &springs.K_S;
    let least = |first: usize| (first..first + 3).map(|i| K[(i, i)]).fold(f64::INFINITY, f64::min);
    let (sink, tilt) = (weight / least(0), weight / least(3));
    let soft = &[(1e3, "stiffness in kN/m or N/mm"), (1e6, "stiffness in kN/mm")];
    let stiff = &[(1e-6, "stiffness in uN/m"), (1e-3, "stiffness in mN/m")];
    let turned = &[(57.3, "stiffness in N m/deg"), (1e3, "stiffness in kN m/rad")];
    caveats.extend(outside(&kinds::MOUNTING_SINK, &name, sink, &(f64::MIN..=SINKS[0]), soft, 1.0));
    caveats.extend(outside(&kinds::MOUNTING_RIGID, &name, sink, &(RIGID_SINK..=f64::MAX), stiff, 1.0));
    caveats.extend(outside(&kinds::MOUNTING_TILT, &name, tilt, &(f64::MIN..=SINKS[1]), turned, 1.0));
    let radius = springs.inertia.filter(|own| own.mass > 0.0).map_or(0.0, |own| gyration(&own));
    let what = format!("the radius of gyration of {name}");
    caveats.extend(outside(&kinds::UNUSUAL.with_unit("m"), what, radius, &(0.0..=FOUNDATION), slip::INERTIA, 0.5));
    caveats
}

/// Checks elastic constants and density.
fn material(name: &str, material: &Material) -> impl Iterator<Item = Finding> {
    let young = outside(&kinds::MODULUS, name, material.E, &material.usual_moduli(), slip::MODULUS, 1.0);
    let rho = outside(&kinds::MATERIAL_DENSITY, name, material.rho, &RHO, slip::DENSITY, 1.0);
    let nu = outside(&kinds::POISSON, name, material.nu, &NU, &[(100.0, "per cent")], 1.0);
    young.into_iter().chain(rho).chain(nu)
}

/// Checks the section relative to the beam's length, and its mass relative to the link's.
fn section(name: &str, beam: &BeamLink) -> Vec<Finding> {
    let mut caveats = Vec::new();
    let length = beam.length;
    let thick = beam.section.largest_size().unwrap_or(0.0);
    if thick > THICK * length {
        let likely = slip(thick, &(0.0..=length), slip::LENGTH, 1.0);
        caveats.push(kinds::SECTION.found(name, thick, length).likely(likely));
    }
    let Ok(bar) = beam.section.bar(&beam.material) else { return caveats };
    let bending = bar.EI_y.max(bar.EI_z);
    if thick == 0.0 {
        let radius = (bending / bar.EA).sqrt();
        let factors = &[(1e6, "N mm2"), (1e-6, "EA in N beside EI in MN m2"), (1e-3, "kN m2"), (1e3, "EA in kN")];
        let range = SLENDER.start() * length..=SLENDER.end() * length;
        caveats.extend(outside(&kinds::SECTION_RADIUS, name, radius, &range, factors, 0.5));
        caveats.extend(outside(&kinds::TORSION, name, bar.GJ / bending, &TORSION, &[], 1.0));
        let shear = bar.kGA_y.into_iter().chain(bar.kGA_z).fold(f64::INFINITY, f64::min) / bar.EA;
        let what = format!("kGA over EA of {name}");
        let factors = &[(1e-3, "kN"), (1e3, "EA in kN")];
        let given = shear.is_finite().then(|| outside(&kinds::UNUSUAL, what, shear, &SHEAR, factors, 1.0));
        caveats.extend(given.flatten());
        // A section of one material has I_y from its mass as from its stiffness.
        let turns = (bar.rotary_y.max(bar.rotary_z) / bar.mass_per_length).sqrt();
        let far = turns > 0.0 && !ROTARY.contains(&(turns / radius));
        let likely = || slip(turns / radius, &ROTARY, &[(1e6, "kg mm"), (1e3, "g m")], 0.5);
        caveats.extend(far.then(|| kinds::ROTARY.found(name, turns, radius).likely(likely())));
    }
    caveats.extend(shear_centre(name, beam, &bar));
    let own = bar.mass_per_length * length;
    if let Some(mass) = beam.mass.filter(|m| *m > 0.0 && RHO.contains(&beam.material.rho))
        && !MASS.contains(&(mass / own))
    {
        let likely = slip(mass / own, &(0.1..=20.0), slip::MASS, 1.0);
        caveats.push(kinds::BEAM_MASS.found(name, mass, own).likely(likely));
    }
    caveats
}

/// Checks the offset of the shear centre from the centroid: the deflection it adds by twist under a
/// tip force, relative to bending.
///
/// ```text
/// F e² l/GJ < 0.01 F l³/(3 EI_y)      e_max = l √(0.01 GJ/(3 EI_y))
/// ```
fn shear_centre(name: &str, beam: &BeamLink, bar: &Bar) -> Option<Finding> {
    let e = beam.section.properties(beam.material.nu).ok()?.shear_centre_y.abs();
    let most = beam.length * (TWIST * bar.GJ / (3.0 * bar.EI_y)).sqrt();
    (e > most).then(|| kinds::SHEAR_CENTRE.found(name, e, most))
}

/// Checks for a wall that is too thin for its width, and for an outer size that is half or twice
/// that indicated by the link's inertia.
fn sizes(name: &str, beam: &BeamLink, own: Option<&LinkInertia>) -> Vec<Finding> {
    let mut caveats = Vec::new();
    let (width, wall) = match beam.section {
        Section::Box { width, height, wall } => (width.min(height), wall),
        Section::Tube { outer_diameter, wall } => (outer_diameter, wall),
        _ => (0.0, f64::INFINITY),
    };
    if wall < THIN[0] * width {
        let caveat = kinds::WALL.found(name, wall / width, THIN[0]);
        let likely = || slip(wall / width, &(THIN[0]..=0.3), &[(0.1, "a digit"), (1e-3, "metres for mm")], 1.0);
        caveats.push(if wall < THIN[1] * width { caveat.likely(likely()) } else { caveat.as_note() });
    }
    let (Some(own), Ok(bar)) = (own.filter(|own| own.mass > 0.0), beam.section.bar(&beam.material)) else {
        return caveats;
    };
    if beam.section.largest_size().is_none() {
        return caveats;
    }
    // For a link that consists only of the beam, both mass and inertia indicate the size.
    let axis = beam.X_LB.translation.vector.normalize();
    let of_link = (axis.dot(&(own.inertia_com * axis)) / own.mass).sqrt();
    let of_section = ((bar.EI_y + bar.EI_z) / bar.EA).sqrt();
    let (size, mass) = (of_link / of_section, own.mass / (bar.mass_per_length * beam.length));
    // The mass grows with the size for a constant wall, and with its square for a solid section.
    let fits = |factor: f64| {
        let power = mass.ln() / factor.ln();
        (size / factor - 1.0).abs() < 0.15 && (0.85..=2.3).contains(&power)
    };
    let words = match () {
        () if fits(2.0) => "about 2 times too small: a radius for a diameter?",
        () if fits(0.5) => "about 2 times: twice the size?",
        () => return caveats,
    };
    caveats.push(kinds::SECTION_SIZE.found(name, of_section, of_link).likely(words));
    caveats
}

/// Checks damping as written; its effect on the first mode is checked at the pose.
fn damping(name: &str, damping: &Damping) -> Option<Finding> {
    match damping {
        Damping::Modal(0.0) | Damping::StiffnessProportional(0.0) | Damping::Rayleigh(0.0, 0.0) => {
            Some(kinds::NO_DAMPING.found(name, 0.0, USUAL_DAMPING))
        }
        Damping::Modal(ratio) => {
            let slips = &[(100.0, "per cent"), (10.0, "a digit"), (0.01, "divided by 100 twice"), (0.1, "a digit")];
            outside(&kinds::DAMPING_RATIO, name, *ratio, &RATIO, slips, 1.0)
        }
        Damping::StiffnessProportional(beta) | Damping::Rayleigh(_, beta) if *beta > CREEP => {
            let likely = slip(*beta, &(0.0..=CREEP), &[(1e3, "milliseconds")], 1.0);
            Some(kinds::CREEP.found(name, *beta, CREEP).likely(likely))
        }
        _ => None,
    }
}
