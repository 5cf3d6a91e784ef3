//! Mounting entry of a robot file: from the text to springs, or to a flexible link under the base.
//!
//! Springs stay beside the rigid robot until it is modelled; a beam or a mesh becomes a link of the
//! tree between the ground and the base, whose frame stays that of the world. B is the base, L the
//! link under it, S the frame of the springs. Start at [`add_mounting`]. Not here: insertion of the
//! springs in the tree (`flexarm_flexlink::insert_mounting`).

use std::ops::Range;
use std::path::PathBuf;

use flexarm_files::{Source, TextFileError as RobotFileError, named_file};
use flexarm_flexlink::{Mounting, base_link, spring_stiffness};
use flexarm_kinematics::{Joint, JointKind, Link, LinkInertia, Pose};
use nalgebra::{Matrix6, Vector3, Vector6};
use serde::Deserialize;
use toml::Spanned;

use crate::error::Error;
use crate::robot::Robot;
use crate::robot::beam_entry::BeamEntry;
use crate::robot::entry_checks::{check_finite, inertia, keep, pose};
use crate::robot::gearbox_entry::{Numbers, play_of, uncoupled};
use crate::robot::link_entry::{DampingEntry, FlexibleLinkEntry, LinkHome, damping_of, flexible_link};
use crate::robot::mounting::RobotMounting;

/// `[mounting]` of a robot file: what supports the base.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MountingEntry {
    /// Name used in results; `mounting` by default.
    pub name: Option<Spanned<String>>,
    /// Six stiffnesses along and about the axes of the springs' frame (N/m, N m/rad), or a 6x6
    /// matrix.
    pub stiffness: Option<Spanned<Numbers>>,
    /// Play of the six springs to each side (m, rad).
    pub backlash: Option<Spanned<Numbers>>,
    /// Beam from its foot to the base, instead of springs.
    pub beam: Option<Spanned<BeamEntry>>,
    /// Reduced mesh instead of springs: a `.flex` file, relative to the robot file, whose interface
    /// B is the base.
    pub reduced: Option<Spanned<PathBuf>>,
    /// Position of the springs, or of the foot of the beam, in the base link (m).
    pub xyz: Option<Spanned<[f64; 3]>>,
    /// Axes of the springs: roll, pitch, yaw in the base link (rad).
    pub rpy: Option<Spanned<[f64; 3]>>,
    /// Damping; 3 % modal damping by default.
    pub damping: Option<Spanned<DampingEntry>>,
    /// Mass carried by the springs in addition to the base (kg).
    pub mass: Option<Spanned<f64>>,
    /// Centre of mass in the axes of the springs (m).
    pub com: Option<[f64; 3]>,
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass (kg m²).
    pub inertia: Option<[f64; 6]>,
    /// Model of a beam or mesh: `lumped` or `modal`.
    pub model: Option<Spanned<String>>,
    /// Number of rigid parts of a beam or mesh.
    pub segments: Option<Spanned<i64>>,
    /// Number of fixed-interface modes of a beam or mesh.
    pub modes: Option<Spanned<i64>>,
}

/// Adds the mounting of a robot file to the robot; collects errors in `faults`.
pub(crate) fn add_mounting(
    robot: &mut Robot,
    entry: &Spanned<MountingEntry>,
    source: &Source,
    home: &LinkHome<'_>,
    faults: &mut Vec<Error>,
) {
    let found = mounting(robot, entry, source, home, faults);
    robot.mounting = keep(found, faults);
}

fn mounting(
    robot: &mut Robot,
    entry: &Spanned<MountingEntry>,
    source: &Source,
    home: &LinkHome<'_>,
    faults: &mut Vec<Error>,
) -> Result<RobotMounting, Error> {
    // Name and place.
    let given = entry.get_ref();
    let name = given.name.as_ref().map_or("mounting", |name| name.get_ref().as_str()).to_owned();
    let name_span = given.name.as_ref().map_or(entry.span(), Spanned::span);
    if name.trim().is_empty() {
        return Err(source.error(name_span, "mounting: name is empty, expected a word for results").into());
    }
    if robot.rigid.link(&name).is_some() {
        let message = format!(
            "mounting {name:?}: the robot has a link of that name; call the mounting otherwise with name = \"...\""
        );
        return Err(source.error(name_span, message).into());
    }
    let [xyz, rpy] = [("xyz", &given.xyz), ("rpy", &given.rpy)].map(|(key, value)| {
        let Some(value) = value else { return Ok([0.0; 3]) };
        check_finite(&format!("mounting {key}"), value.get_ref(), value.span(), source)?;
        Ok::<_, RobotFileError>(*value.get_ref())
    });
    let (xyz, rpy) = (xyz?, rpy?);
    // Springs, or a flexible link of a beam or a mesh.
    match (&given.stiffness, &given.beam, &given.reduced) {
        (Some(stiffness), None, None) => {
            let K_S = stiffness6(stiffness, source)?;
            if let Some((key, span)) = link_keys(given) {
                let message = format!("mounting: {key} belongs to a beam or a .flex file, springs have none");
                return Err(source.error(span, message).into());
            }
            let damping = damping_of(given.damping.as_ref(), source)?;
            let inertia = riding_mass(robot, given, entry, source)?;
            let backlash = given.backlash.as_ref();
            let play = play_of(backlash.map(Spanned::get_ref), uncoupled(&K_S)).map_err(|error| {
                source.error(backlash.map_or(entry.span(), Spanned::span), format!("mounting: {error}"))
            })?;
            let springs = Mounting { name, X_BS: pose(xyz, rpy), K_S, separate: !play.is_empty(), inertia };
            Ok(RobotMounting::Springs { springs, damping, play })
        }
        (None, Some(_), None) | (None, None, Some(_)) => {
            flexible_mounting(robot, entry, name, &xyz, source, home, faults)
        }
        _ => {
            let message =
                "mounting needs one of stiffness = [six values or 6x6], beam = { ... } and reduced = \"file.flex\"";
            Err(source.error(entry.span(), message).into())
        }
    }
}

/// Returns the first given key that only a flexible link has.
fn link_keys(given: &MountingEntry) -> Option<(&'static str, Range<usize>)> {
    let model = given.model.as_ref().map(|key| ("model", key.span()));
    let segments = given.segments.as_ref().map(|key| ("segments", key.span()));
    model.or(segments).or(given.modes.as_ref().map(|key| ("modes", key.span())))
}

/// Reads six diagonal values or a symmetric positive definite 6x6 matrix.
fn stiffness6(given: &Spanned<Numbers>, source: &Source) -> Result<Matrix6<f64>, RobotFileError> {
    let fail = |message: String| source.error(given.span(), format!("mounting stiffness: {message}"));
    let K =
        match given.get_ref() {
            Numbers::Many(k) if k.len() == 6 => Matrix6::from_diagonal(&Vector6::from_column_slice(k)),
            Numbers::Matrix(rows) if rows.len() == 6 && rows.iter().all(|row| row.len() == 6) => {
                Matrix6::from_fn(|i, j| rows[i][j])
            }
            Numbers::One(_) => return Err(fail(
                "one number, expected three for translations (N/m) and three for rotations (N m/rad), or a 6x6 matrix"
                    .into(),
            )),
            Numbers::Many(k) => return Err(fail(format!("{} numbers, expected six or a 6x6 matrix", k.len()))),
            Numbers::Matrix(rows) => {
                let widths: Vec<usize> = rows.iter().map(Vec::len).collect();
                return Err(fail(format!("a matrix with rows of {widths:?} numbers, expected six rows of six")));
            }
        };
    spring_stiffness(&K).map_err(|error| fail(error.to_string()))
}

/// Reads the mass carried by the springs in addition to the base. If the base has no mass, the
/// entry must give one, or `mass = 0.0` explicitly.
fn riding_mass(
    robot: &Robot,
    given: &MountingEntry,
    entry: &Spanned<MountingEntry>,
    source: &Source,
) -> Result<Option<LinkInertia>, Error> {
    // Without a mass of its own the springs carry the base, which must then have one.
    let Some(mass) = &given.mass else {
        if given.com.is_some() || given.inertia.is_some() {
            return Err(source
                .error(entry.span(), "mounting: com and inertia belong to a mass, which is not given")
                .into());
        }
        let base = base_link(&robot.rigid, "mounting").map_err(|e| source.error(entry.span(), e.to_string()))?;
        if !base_has_mass(robot, &base.name) {
            let message = format!(
                "mounting: base link {:?} has no mass of its own (no <inertial>), so that the mass on the springs is unknown: give mass, com and inertia of pedestal and base, or mass = 0.0 if there is nothing else on the springs",
                base.name
            );
            return Err(source.error(entry.span(), message).into());
        }
        return Ok(None);
    };
    // A mass with its inertia about its centre; without a mass there is no body.
    let (kg, com) = (*mass.get_ref(), given.com.unwrap_or_default());
    if !(kg.is_finite() && kg >= 0.0) {
        return Err(source.error(mass.span(), format!("mounting mass is {kg} kg, it must be 0 or positive")).into());
    }
    let moments = given.inertia.unwrap_or_default();
    check_finite("mounting com", &com, entry.span(), source)?;
    let inertia_com = inertia("mounting", &moments, entry.span(), source)?;
    if kg == 0.0 && moments != [0.0; 6] {
        return Err(source.error(mass.span(), "mounting: 0 kg with an inertia: give the mass that has it").into());
    }
    Ok((kg > 0.0).then(|| LinkInertia { mass: kg, com: Vector3::from(com), inertia_com }))
}

/// Whether the base link, or a link fixed to it, has mass.
fn base_has_mass(robot: &Robot, base: &str) -> bool {
    let own = robot.rigid.link(base).and_then(|link| link.inertia).is_some_and(|inertia| inertia.mass > 0.0);
    let mut fixed = robot.rigid.child_joints(base).filter(|joint| joint.kind == JointKind::Fixed);
    own || fixed.any(|joint| base_has_mass(robot, &joint.child))
}

/// Uses the beam's own mass by default: the URDF has no link below the base whose mass it could
/// take.
fn with_own_mass(beam: &Spanned<BeamEntry>) -> Spanned<BeamEntry> {
    let mut own = beam.clone();
    own.get_mut().parts.get_or_insert_with(|| "uniform".to_owned());
    own
}

/// Returns the pose of the base in the link under it.
fn base_in_link(
    entry: &Spanned<MountingEntry>,
    xyz: &[f64; 3],
    home: &LinkHome<'_>,
    fail: &impl Fn(Range<usize>, &str) -> Error,
) -> Result<Pose, Error> {
    let given = entry.get_ref();
    match (&given.reduced, &given.xyz) {
        (Some(_), Some(xyz)) => {
            Err(fail(xyz.span(), "the .flex file gives the position of the base (its interface B): leave xyz out"))
        }
        (Some(file), None) => {
            let located = |message: String| fail(file.span(), &message);
            let path = named_file("reduced", file.get_ref(), home.folder).map_err(located)?;
            Ok(home.files.flex(&path)?.X_LB)
        }
        (None, Some(foot)) if foot.get_ref().iter().all(|x| *x == 0.0) => {
            Err(fail(foot.span(), "the foot of the beam is at the origin of the base: a beam needs a length"))
        }
        (None, Some(_)) => Ok(pose([-xyz[0], -xyz[1], -xyz[2]], [0.0; 3])),
        (None, None) => Err(fail(
            entry.span(),
            "a beam needs its foot in the base link, xyz = [x, y, z] in m: [0.0, 0.0, -0.6] is 0.6 m below",
        )),
    }
}

/// Builds a flexible link, from a beam or a reduced mesh, between the ground and the base.
fn flexible_mounting(
    robot: &mut Robot,
    entry: &Spanned<MountingEntry>,
    name: String,
    xyz: &[f64; 3],
    source: &Source,
    home: &LinkHome<'_>,
    faults: &mut Vec<Error>,
) -> Result<RobotMounting, Error> {
    let given = entry.get_ref();
    let fail = |span: Range<usize>, message: &str| Error::from(source.error(span, format!("mounting: {message}")));
    if given.mass.is_some() || given.com.is_some() || given.inertia.is_some() {
        return Err(fail(
            entry.span(),
            "mass, com and inertia belong to springs; a beam has the mass of its section, a .flex file its own",
        ));
    }
    if let Some(backlash) = &given.backlash {
        return Err(fail(backlash.span(), "backlash belongs to springs; a beam and a .flex file have none"));
    }
    if let Some(rpy) = &given.rpy {
        return Err(fail(
            rpy.span(),
            "rpy belongs to springs; the axes of a beam are those of the base, those of a .flex file its own",
        ));
    }
    let X_LB = base_in_link(entry, xyz, home, &fail)?;
    let base = base_link(&robot.rigid, &name).map_err(|e| source.error(entry.span(), e.to_string()))?.name.clone();
    // The base keeps its pose at the origin of the world.
    let (ground, joint) = (format!("{name}__ground"), format!("{name}__base"));
    let rigid = &mut robot.rigid;
    rigid.links.push(Link { name: ground.clone(), inertia: None });
    rigid.links.push(Link { name: name.clone(), inertia: None });
    rigid.joints.push(Joint::new(format!("{name}__foot"), JointKind::Fixed, ground, &name, X_LB.inverse()));
    rigid.joints.push(Joint::new(&joint, JointKind::Fixed, &name, base, X_LB));
    let span = given.name.as_ref().map_or(entry.span(), Spanned::span);
    let link = FlexibleLinkEntry {
        link: Spanned::new(span, name.clone()),
        distal: None,
        reduced: given.reduced.clone(),
        beam: given.beam.as_ref().map(with_own_mass),
        model: given.model.clone(),
        segments: given.segments.clone(),
        modes: given.modes.clone(),
        eigenmodes: None,
        geometric_stiffening: None,
        mass: None,
        stiffness_factor: None,
        stiffness: None,
        stiffness_factors: None,
        stress: None,
        strength: None,
        damping: given.damping.clone(),
        angles: None,
        coupling: true,
    };
    let flexible = flexible_link(&link, &robot.rigid, source, home, &mut robot.warnings, faults)?;
    robot.flexible_links.push(flexible);
    Ok(RobotMounting::Link { name })
}
