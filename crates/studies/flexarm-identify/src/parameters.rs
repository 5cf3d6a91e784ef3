//! Identifiable parameters of a robot file: their names, their effect on the arm, and their places
//! in the file. `docs/identify.md` lists the names.
//!
//! Start at `candidates`, which has one function per kind of element. A `Candidate` joins the
//! effect on the arm (`Effect`) with the place in the file (`ParameterLocation`). Not here:
//! writing to these places (`super::rewrite`), the search coordinates (`crate::Parameter`).

use flexarm_flexlink::{GearStiffness, SEAT};
use flexarm_kinematics::{JointMotion, LinkInertia, SpatialInertia};
use flexarm_run::robot::PAYLOAD_LINK;
use flexarm_run::{Arm, Drive, GuideTilt, Owner, Robot, RobotLink, RobotMounting};
use flexarm_stepping::{Damping, GuideTerm, SpringCurve};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::estimation::{Effect, LinkPart, Parameter, SpringPart};

/// Key of parameters that are fitted only if named explicitly: together the directions make up the
/// whole stiffness of a link.
const DIRECTIONS: &str = "stiffness_factors";

/// Location of a parameter in the robot file.
#[derive(Clone, Debug, PartialEq)]
#[doc(hidden)]
pub enum ParameterLocation {
    /// `[[drive]]` of the joint: stiffness of its gearbox, or one of its entries.
    Gearbox { joint: String, entry: Option<usize> },
    /// `[[drive]]` of the joint: one of the two stiffnesses of its seat.
    Seat { joint: String, entry: usize },
    /// `[[drive]]` of the joint: damping of its gearbox, or one of its entries.
    GearboxDamping { joint: String, entry: Option<usize> },
    /// `[[flexible_link]]` of the link: damping.
    LinkDamping { link: String },
    /// `[[flexible_link]]` of the link: `stiffness_factor`.
    Link { link: String },
    /// `[[flexible_link]]` of the link: one of `stiffness_factors`.
    LinkDirection { link: String, entry: usize },
    /// `[[flexible_link]]` of the link: entry of `stiffness`, which is `K` if the file has none.
    LinkEntry { link: String, row: usize, column: usize, K: Box<Matrix6<f64>> },
    /// `tcp`: x, y, z, rx, ry, rz.
    Tool { axis: usize },
    /// One of the six `mounting.stiffness`.
    Mounting { entry: usize },
    /// `payload.mass`.
    Payload,
    /// Mass of a link: of its `[[flexible_link]]`, or of its `[[inertial]]`.
    Mass { link: String, flexible: bool },
    /// `[[inertial]]` of the link: a coordinate of the centre of mass, which is `com` if the file has
    /// none.
    Com { link: String, axis: usize, com: Vector3<f64> },
    /// `[[drive]]` of the joint: number of its guide.
    Guide { joint: String, axis: char, term: GuideTerm },
    /// `[[calibration]]` of the joint: its zero, or a twist of its frame; `axis` is that of the joint.
    Frame { joint: String, twist: Vector6<f64>, axis: Vector6<f64>, zero: bool },
}

/// A parameter and its location in the robot file.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) parameter: Parameter,
    pub(crate) written: ParameterLocation,
    /// Locations of other parameters with the same value.
    pub(crate) tied: Vec<ParameterLocation>,
}

/// Returns all parameters of an arm, in the order of drives, links, tool and payload.
pub(crate) fn candidates(robot: &Robot, arm: &Arm) -> Vec<Candidate> {
    // Springs of a drive or a link, by number.
    let springs_of = |owner: Owner| -> Vec<usize> {
        arm.owners.iter().enumerate().filter(|(_, o)| **o == owner).map(|(k, _)| k).collect()
    };
    let mut found = Vec::new();
    for (number, drive) in robot.drives.iter().enumerate() {
        found.extend(drive_parameters(drive, springs_of(Owner::Drive(number)), arm));
    }
    for (number, span) in arm.spans.iter().enumerate() {
        let springs = springs_of(Owner::Link(number));
        if robot.stands_on(&span.link) {
            found.extend(mounting_parameters(robot, &springs));
        } else if let Some(link) = robot.flexible_links.iter().find(|link| link.flexible.link == span.link) {
            found.extend(link_parameters(link, &springs, arm));
        }
    }
    if let Some(frame) = arm.model.frame(PAYLOAD_LINK) {
        let mass = robot.rigid.link(PAYLOAD_LINK).and_then(|link| link.inertia).map_or(0.0, |inertia| inertia.mass);
        let per_kg = SpatialInertia::from_com(1.0, &Vector3::zeros(), &Matrix3::zeros()).at_parent(&frame.X_BF);
        let effect = Effect::Mass(vec![(frame.body, per_kg)]);
        found.push(Candidate::new("payload.mass".into(), "kg", mass, effect, ParameterLocation::Payload));
    }
    found.extend(robot.rigid.links.iter().filter(|link| link.name != PAYLOAD_LINK).flat_map(|link| {
        let inertia = link.inertia.filter(|inertia| inertia.mass > 0.0);
        inertia.map_or(Vec::new(), |inertia| mass_parameters(&link.name, inertia, robot, arm))
    }));
    found.extend(tool_parameters());
    found.extend(frame_parameters(arm));
    found
}

/// Usual error of a link's mass, and of its centre of mass over the radius of gyration about the
/// link's origin.
const INERTIAL: f64 = 0.2;

/// Returns mass and centre of mass of a link that moves; of a flexible link the mass, if it is a
/// lumped beam.
fn mass_parameters(link: &str, inertia: LinkInertia, robot: &Robot, arm: &Arm) -> Vec<Candidate> {
    let flexible = robot.flexible_links.iter().find(|own| own.flexible.link == link);
    let frame = arm.model.frame(link).filter(|_| flexible.is_none_or(|own| own.beam.is_some()));
    let Some(frame) = frame else { return Vec::new() };
    let parts = match arm.spans.iter().position(|span| span.link == link && flexible.is_some()) {
        // A rigid link has one part, a lumped beam one before each spring and one behind the last.
        None => vec![LinkPart { body: frame.body, X_BL: frame.X_BF, inertia }],
        Some(number) => {
            let Some(chain) = &arm.spans[number].lumped else { return Vec::new() };
            let springs = arm.owners.iter().zip(arm.model.elastic()).filter(|(own, _)| **own == Owner::Link(number));
            // The frames of the parts behind the springs are at the springs.
            let behind = springs.zip(&chain.joints).map(|((_, own), joint)| (own.body, joint.X_LS.inverse()));
            let places = std::iter::once((frame.body, frame.X_BF)).chain(behind);
            let all = places.zip(&chain.parts).map(|((body, X_BL), part)| {
                let inertia = LinkInertia { mass: part.mass, com: part.com, inertia_com: part.inertia };
                LinkPart { body, X_BL, inertia }
            });
            all.collect()
        }
    };
    if parts.iter().all(|part| part.body == 0) {
        return Vec::new();
    }
    let written = ParameterLocation::Mass { link: link.to_owned(), flexible: flexible.is_some() };
    // Its mass; the centre of mass only of rigid links, whose file has one.
    let effect = |axis, size| Effect::Link { parts: parts.clone(), axis, size };
    let mass = effect(None, INERTIAL * inertia.mass);
    let mut found = vec![Candidate::new(format!("link.{link}.mass"), "kg", inertia.mass, mass, written)];
    if flexible.is_none() {
        let moment = inertia.inertia_com.symmetric_eigenvalues().max();
        let size = INERTIAL * (inertia.com.norm_squared() + moment / inertia.mass).sqrt();
        found.extend(["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
            let written = ParameterLocation::Com { link: link.to_owned(), axis, com: inertia.com };
            let effect = effect(Some(axis), size);
            Candidate::new(format!("link.{link}.com.{name}"), "m", inertia.com[axis], effect, written)
        }));
    }
    found
}

/// Returns the stiffnesses and dampers of a drive, whose springs are `springs`.
fn drive_parameters(drive: &Drive, mut springs: Vec<usize>, arm: &Arm) -> Vec<Candidate> {
    let mut found = Vec::new();
    let Some((gearbox, damping)) = drive.gearbox.as_ref().filter(|_| !springs.is_empty()) else { return found };
    // A piecewise stiffness curve has no single stiffness, but one with backlash has.
    if !damping.curves.is_empty() && damping.play.is_empty() {
        return found;
    }
    let slides = arm.model.coordinates().iter().any(|c| c.joint == drive.joint && c.slides());
    if let Some(seat) = gearbox.seat {
        // They come before those of the gearbox.
        let own: Vec<usize> = springs.drain(..2).collect();
        found.extend(seat_parameters(&drive.joint, seat, &own));
    }
    match &gearbox.stiffness {
        GearStiffness::Guide(_) => found.extend(guide_parameters(&drive.joint, &damping.tilts, &springs, arm)),
        stiffness => found.extend(gearbox_parameters(&drive.joint, stiffness, &springs, slides)),
    }
    let slides = slides && drive.guide().is_none();
    found.extend(gearbox_damping(&drive.joint, damping.dampers.as_deref().unwrap_or_default(), &springs, slides));
    found
}

/// Returns the stiffnesses and the damping of a flexible link, whose springs are `springs`.
fn link_parameters(link: &RobotLink, springs: &[usize], arm: &Arm) -> Vec<Candidate> {
    let name = &link.flexible.link;
    let places = springs.iter().map(|spring| SpringPart { spring: *spring, coordinate: None }).collect();
    let written = ParameterLocation::Link { link: name.clone() };
    let mut found =
        vec![stiffness(format!("link.{name}.stiffness_factor"), "1", link.stiffness_factor, places, written)];
    // Factors per direction and entries of the matrix need six-DoF springs, not modes.
    let groups = arm.model.elastic();
    if springs.iter().all(|spring| groups[*spring].size == 6 && !groups[*spring].modal) {
        found.extend(link_directions(name, &link.stiffness_factors, springs));
    }
    if let ([spring], true) = (springs, link.flexible.coupling) {
        found.extend(link_entries(link, *spring, arm));
    }
    let (unit, initial) = match link.damping {
        Damping::Modal(zeta) => ("1", zeta),
        Damping::StiffnessProportional(beta) => ("s", beta),
        _ => ("1", 1.0),
    };
    if initial > 0.0 {
        let written = ParameterLocation::LinkDamping { link: name.clone() };
        let effect = Effect::Damping(springs.to_vec());
        found.push(Candidate::new(format!("link.{name}.damping"), unit, initial, effect, written));
    }
    found
}

/// Returns the two stiffnesses of a seat.
fn seat_parameters(joint: &str, seat: [f64; 2], springs: &[usize]) -> impl Iterator<Item = Candidate> {
    springs.iter().zip(seat).enumerate().map(move |(entry, (spring, k))| {
        let place = SpringPart { spring: *spring, coordinate: None };
        let written = ParameterLocation::Seat { joint: joint.to_owned(), entry };
        stiffness(format!("drive.{joint}.gearbox.seat[{entry}]"), "N m/rad", k, vec![place], written)
    })
}

/// Returns the numbers of the law of each tilt of a telescopic guide.
fn guide_parameters(joint: &str, tilts: &[GuideTilt], springs: &[usize], arm: &Arm) -> Vec<Candidate> {
    let mut found = Vec::new();
    for (tilt, spring) in tilts.iter().zip(springs) {
        let Some(guide) = arm.springs[*spring].curve.as_ref().and_then(SpringCurve::guide) else { continue };
        let (spring, axis, name) = (*spring, tilt.axis, format!("drive.{joint}.gearbox.guide.{}", tilt.axis));
        let mut add = |key: &str, unit: &str, initial: f64, term: GuideTerm, size: f64| {
            let effect = Effect::Guide { springs: vec![spring], term, size };
            let written = ParameterLocation::Guide { joint: joint.to_owned(), axis, term };
            found.push(Candidate::new(format!("{name}.{key}"), unit, initial, effect, written));
        };
        // An overlap of the usual size.
        let overlap = 0.5 * guide.overlap[0].abs();
        let compliance = guide.compliance(overlap);
        for (k, unit) in ["rad/(N m)", "rad/N", "rad m/N"].into_iter().enumerate() {
            let size = compliance * overlap.powi(k as i32);
            add(&format!("compliance[{k}]"), unit, tilt.compliance[k], GuideTerm::Compliance(k), size);
        }
        if let Some(play) = tilt.play {
            add("play.gap", "m", play.gap, GuideTerm::Gap, play.gap);
            add("play.centre", "N m", play.centre, GuideTerm::Centre, play.width.max(play.centre.abs()));
            add("play.width", "N m", play.width, GuideTerm::Width, play.width);
        }
    }
    found
}

/// Usual shifts (m) and rotations (rad) of joint frames, and zeros of joints.
const FRAME_SIZE: f64 = 3e-3;
const ZERO_SIZE: f64 = 1e-2;

/// Returns the displacements of the joint frames, and the zeros of the joints. The rotations are in
/// the order of roll, pitch and yaw as matrices multiply.
fn frame_parameters(arm: &Arm) -> Vec<Candidate> {
    let mut found = Vec::new();
    // Joints of the robot file; those of springs and parts of links have no parameters of their own.
    let robot_joints: Vec<&str> = arm.rigid.bodies().iter().map(|body| body.joint.as_str()).collect();
    let bodies = arm.model.bodies().iter().enumerate().skip(1);
    for (body, own) in bodies.filter(|(_, own)| robot_joints.contains(&own.joint.as_str())) {
        let JointMotion::Axis(motion) = own.motion else { continue };
        // The frame of a joint with a seat is that of the seat.
        let seat = SEAT.map(|suffix| format!("{}__spring{suffix}", own.joint));
        let body = arm.model.bodies().iter().position(|body| seat.contains(&body.joint)).unwrap_or(body);
        let (joint, axis) = (&own.joint, Vector6::from_row_slice(motion.column().as_slice()));
        let mut add = |key: &str, unit: &str, twist: Vector6<f64>, zero: bool| {
            let effect = Effect::Frame { body, twist, size: if zero { ZERO_SIZE } else { FRAME_SIZE } };
            let written = ParameterLocation::Frame { joint: joint.clone(), twist, axis, zero };
            found.push(Candidate::new(format!("{FRAME}.{joint}.{key}"), unit, 0.0, effect, written));
        };
        for (k, (key, unit)) in [
            (0, ("x", "m")),
            (1, ("y", "m")),
            (2, ("z", "m")),
            (5, ("yaw", "rad")),
            (4, ("pitch", "rad")),
            (3, ("roll", "rad")),
        ] {
            add(key, unit, Vector6::ith(k, 1.0), false);
        }
        let unit = if motion.slides() { "m" } else { "rad" };
        add("zero", unit, axis, true);
    }
    found
}

impl Candidate {
    /// Adds another parameter that has the same value.
    ///
    /// # Errors
    /// A message if the two have different laws or initial values.
    pub(crate) fn tie(&mut self, other: &Self) -> Result<(), String> {
        let (own, others) = (&mut self.parameter, &other.parameter);
        if (own.initial - others.initial).abs() > 1e-9 * own.initial.abs() {
            let Parameter { name, initial, .. } = others;
            let text =
                format!("{} = {}, {name} = {initial}: give them one value in the robot file", own.name, own.initial);
            return Err(text);
        }
        match (&mut own.effect, &others.effect) {
            (Effect::Stiffness(places), Effect::Stiffness(more)) => places.extend(more),
            (Effect::Guide { springs, term, .. }, Effect::Guide { springs: more, term: same, .. }) if term == same => {
                springs.extend(more);
            }
            _ => {
                let (own, other) = (&own.name, &others.name);
                return Err(format!(
                    "{own} and {other} cannot have one value: expected stiffnesses, or one number of guides"
                ));
            }
        }
        self.tied.push(other.written.clone());
        Ok(())
    }

    fn new(name: String, unit: &str, initial: f64, effect: Effect, written: ParameterLocation) -> Self {
        let parameter = Parameter { name, unit: unit.into(), initial, prior: None, effect };
        Self { parameter, written, tied: Vec::new() }
    }
}

fn stiffness(name: String, unit: &str, initial: f64, places: Vec<SpringPart>, written: ParameterLocation) -> Candidate {
    Candidate::new(name, unit, initial, Effect::Stiffness(places), written)
}

/// Returns a parameter per non-zero damper of a gearbox.
fn gearbox_damping(joint: &str, dampers: &[f64], springs: &[usize], slides: bool) -> Vec<Candidate> {
    let name = format!("drive.{joint}.gearbox.damping");
    let damper = |(k, initial): (usize, &f64)| {
        let (spring, coordinate) = if springs.len() > 1 { (springs[k], 0) } else { (springs[0], k) };
        let (name, entry, moves) = match dampers {
            [_] => (name.clone(), None, slides),
            list => (format!("{name}[{k}]"), Some(k), list.len() == 6 && k < 3),
        };
        let unit = if moves { "N s/m" } else { "N m s/rad" };
        let effect = match dampers {
            [_] => Effect::Damping(vec![spring]),
            _ => Effect::Damper { spring, coordinate },
        };
        Candidate::new(
            name,
            unit,
            *initial,
            effect,
            ParameterLocation::GearboxDamping { joint: joint.to_owned(), entry },
        )
    };
    dampers.iter().enumerate().filter(|(_, d)| **d > 0.0).map(damper).collect()
}

/// Returns the factors on the six directions of a lumped link's springs, each common to all
/// springs.
fn link_directions<'a>(
    link: &'a str,
    factors: &'a [f64; 6],
    springs: &'a [usize],
) -> impl Iterator<Item = Candidate> + 'a {
    factors.iter().enumerate().map(move |(entry, factor)| {
        let places = springs.iter().map(|spring| SpringPart { spring: *spring, coordinate: Some(entry) }).collect();
        let written = ParameterLocation::LinkDirection { link: link.to_owned(), entry };
        stiffness(format!("link.{link}.{DIRECTIONS}[{entry}]"), "1", *factor, places, written)
    })
}

/// Returns the 6x6 entries of a link modelled as one spring between two rigid parts, before the
/// factors are applied.
fn link_entries(link: &RobotLink, spring: usize, arm: &Arm) -> Vec<Candidate> {
    let group = &arm.model.elastic()[spring];
    if group.size != 6 || group.modal {
        return Vec::new();
    }
    let root = link.stiffness_factors.map(f64::sqrt);
    let factor = |i: usize, j: usize| link.stiffness_factor * root[i] * root[j];
    let K = Matrix6::from_fn(|i, j| arm.springs[spring].K[(i, j)] / factor(i, j));
    let name = &link.flexible.link;
    let entry = |row: usize, column: usize| {
        let unit = match (row < 3, column < 3) {
            (true, true) => "N/m",
            (false, false) => "N m/rad",
            _ => "N",
        };
        let size = (K[(row, row)] * K[(column, column)]).sqrt();
        let effect = Effect::Entry { spring, row, column, factor: factor(row, column), size };
        let written = ParameterLocation::LinkEntry { link: name.clone(), row, column, K: Box::new(K) };
        Candidate::new(format!("link.{name}.stiffness[{row}][{column}]"), unit, K[(row, column)], effect, written)
    };
    (0..6).flat_map(|row| (row..6).map(move |column| (row, column))).map(|(row, column)| entry(row, column)).collect()
}

/// Returns translation and rotation of the tool about its own axes.
fn tool_parameters() -> impl Iterator<Item = Candidate> {
    ["x", "y", "z", "rx", "ry", "rz"].into_iter().enumerate().map(|(axis, name)| {
        let unit = if axis < 3 { "m" } else { "rad" };
        Candidate::new(format!("tcp.{name}"), unit, 0.0, Effect::Tool(axis), ParameterLocation::Tool { axis })
    })
}

fn gearbox_parameters(joint: &str, K: &GearStiffness, springs: &[usize], slides: bool) -> Vec<Candidate> {
    let name = format!("drive.{joint}.gearbox.stiffness");
    let about = if slides { "N/m" } else { "N m/rad" };
    let written = |entry| ParameterLocation::Gearbox { joint: joint.to_owned(), entry };
    let whole = |spring| vec![SpringPart { spring, coordinate: None }];
    match (K, springs) {
        (GearStiffness::Axis(k), [spring]) => vec![stiffness(name, about, *k, whole(*spring), written(None))],
        (GearStiffness::Tilting(k), [_, _, _]) => {
            let each = springs.iter().zip(k).enumerate();
            each.map(|(i, (s, k))| stiffness(format!("{name}[{i}]"), "N m/rad", *k, whole(*s), written(Some(i))))
                .collect()
        }
        (GearStiffness::Full(K), _) if is_diagonal(K) => {
            six_springs(&name, K.diagonal().as_slice(), springs, |i| written(Some(i)))
        }
        (GearStiffness::Separate(k), _) => six_springs(&name, k, springs, |i| written(Some(i))),
        // Full matrix: one factor on all entries.
        _ => {
            let places = springs.iter().map(|spring| SpringPart { spring: *spring, coordinate: None }).collect();
            vec![stiffness(name, "1", 1.0, places, written(None))]
        }
    }
}

/// Returns the stiffness of six uncoupled springs: one element with six coordinates, or six.
fn six_springs(
    name: &str,
    k: &[f64],
    springs: &[usize],
    written: impl Fn(usize) -> ParameterLocation,
) -> Vec<Candidate> {
    let part = |i: usize| match springs {
        [spring] => SpringPart { spring: *spring, coordinate: Some(i) },
        _ => SpringPart { spring: springs[i], coordinate: None },
    };
    let entry = |(i, k): (usize, &f64)| {
        let unit = if i < 3 { "N/m" } else { "N m/rad" };
        stiffness(format!("{name}[{i}]"), unit, *k, vec![part(i)], written(i))
    };
    k.iter().enumerate().map(entry).collect()
}

/// Returns the six uncoupled springs under the base. A beam or mesh there has no stiffness values
/// in the robot file.
fn mounting_parameters(robot: &Robot, springs: &[usize]) -> Vec<Candidate> {
    let Some(RobotMounting::Springs { springs: mounting, .. }) = &robot.mounting else { return Vec::new() };
    if !is_diagonal(&mounting.K_S) || springs.is_empty() {
        return Vec::new();
    }
    let k = mounting.K_S.diagonal();
    six_springs("mounting.stiffness", k.as_slice(), springs, |entry| ParameterLocation::Mounting { entry })
}

fn is_diagonal(K: &nalgebra::Matrix6<f64>) -> bool {
    (0..6).all(|i| (0..6).all(|j| i == j || K[(i, j)] == 0.0))
}

/// Whether a pattern selects a parameter for fitting.
pub fn asks_for(pattern: &str, name: &str) -> bool {
    let by_name = match name {
        _ if is_direction(name) => pattern.contains(DIRECTIONS),
        _ if is_entry(name) => pattern.contains("]["),
        _ if is_tool(name) => pattern.starts_with("tcp"),
        _ if is_frame(name) => pattern.starts_with(FRAME),
        _ if is_inertial(name) => pattern.contains(".mass") || pattern.contains(".com"),
        _ => true,
    };
    by_name && fits(pattern, name)
}

/// Whether the name is that of the mass or the centre of mass of a link.
fn is_inertial(name: &str) -> bool {
    name.starts_with("link.") && (name.ends_with(".mass") || name.contains(".com."))
}

/// Whether the name is that of an entry of a link's matrix.
pub(crate) fn is_entry(name: &str) -> bool {
    name.starts_with("link.") && name.contains("][")
}

/// Whether the name is that of the position or orientation of the tool.
pub(crate) fn is_tool(name: &str) -> bool {
    name.starts_with("tcp.")
}

/// First word of the names of displacements of joint frames.
const FRAME: &str = "joint";

/// Whether the name is that of a displacement of a joint frame.
pub(crate) fn is_frame(name: &str) -> bool {
    name.strip_prefix(FRAME).is_some_and(|rest| rest.starts_with('.'))
}

/// Whether the name is that of a damping: of a gearbox, one of its dampers, or a link.
pub(crate) fn is_damping(name: &str) -> bool {
    name.split('[').next().is_some_and(|name| name.ends_with(".damping"))
}

/// Returns the name of a gearbox's damping from that of one of its dampers.
fn all_dampers(name: &str) -> Option<&str> {
    let whole = name.split('[').next()?;
    (whole.ends_with(".gearbox.damping") && whole != name).then_some(whole)
}

/// Returns the name of a matrix entry with row and column exchanged.
fn mirrored(name: &str) -> Option<String> {
    let (head, indices) = name.strip_suffix(']')?.split_once(".stiffness[")?;
    let (row, column) = indices.split_once("][")?;
    Some(format!("{head}.stiffness[{column}][{row}]"))
}

/// Whether the name is that of one direction of a link's springs.
pub(crate) fn is_direction(name: &str) -> bool {
    name.starts_with("link.") && name.contains(DIRECTIONS)
}

/// Whether a pattern with `*` as a wildcard matches a name, that of the symmetric matrix entry, or
/// that of the whole gearbox damping.
pub fn fits(pattern: &str, name: &str) -> bool {
    matches(pattern, name)
        || mirrored(name).is_some_and(|name| matches(pattern, &name))
        || all_dampers(name).is_some_and(|name| matches(pattern, name))
}

fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((before, after)) => {
            let Some(rest) = name.strip_prefix(before) else { return false };
            rest.char_indices().map(|(k, _)| &rest[k..]).chain([""]).any(|rest| matches(after, rest))
        }
    }
}
