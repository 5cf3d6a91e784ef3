//! Result of making a robot: SI units, angles in rad.
//!
//! The structures are the JSON of `--json`: their names are a contract. Start at [`of`].

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::draft::{Draft, DraftJoint, DraftLink};
use super::gears::three_digits;
use super::place::Placed;
use flexarm_run::{Finding, MotionPeak, MotionReport, Summary};

/// Result of `flexarm new`.
#[derive(Debug, Serialize)]
pub struct NewRobot {
    /// Robot file.
    pub robot: String,
    /// Sample motion file.
    pub motion: String,
    /// Description that the robot file refers to.
    pub urdf: String,
    /// Name of the robot.
    pub name: String,
    /// Whether and from where the description was copied, as text.
    pub placed: String,
    /// Base link of the arm.
    pub base: String,
    /// Tool link.
    pub tool: String,
    /// Links from the base to the tool.
    pub chain: Vec<String>,
    /// Joints of the arm, in the order of the description.
    pub joints: Vec<NewJoint>,
    /// Joints that are held.
    pub held: Vec<NewHeld>,
    /// Links of the arm, with a section where one is proposed.
    pub links: Vec<NewLink>,
    /// Proposed drives.
    pub drives: Vec<NewDrive>,
    /// Payload.
    pub payload: NewPayload,
    /// Maximum distance of the TCP from the first joint in the sampled poses (m).
    pub reach_m: f64,
    /// Mass moved by the joints of the arm, without payload (kg).
    pub moving_mass_kg: f64,
    /// All assumptions.
    pub assumptions: Vec<Assumption>,
    /// Questions for the manufacturer, or quantities to measure.
    pub questions: Vec<String>,
    /// Duration of the sample motion (s).
    pub duration_s: f64,
    /// Peaks of the motion against the limits.
    pub peaks: Vec<MotionPeak>,
    /// Limits violated by the motion, as sentences; only effort limits that the arm cannot keep at
    /// all.
    pub violations: Vec<String>,
    /// Findings of `check` in the result.
    pub findings: Vec<Finding>,
    /// Written files.
    pub files: Vec<String>,
    /// Summary of the first run, if there was one.
    pub summary: Option<Box<Summary>>,
}

/// An assumption about the robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumption {
    /// Subject: a joint, a link, the payload.
    pub about: String,
    /// The assumption made.
    pub text: String,
    /// Way to replace it by a fact.
    pub mend: String,
}

/// A joint of the arm; limits are null where there are none.
#[derive(Clone, Debug, Serialize)]
pub struct NewJoint {
    /// Name.
    pub name: String,
    /// Joint type in the URDF.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Minimum position (rad or m).
    pub lower: Option<f64>,
    /// Maximum position (rad or m).
    pub upper: Option<f64>,
    /// Speed limit (rad/s or m/s).
    pub velocity: Option<f64>,
    /// Effort limit of the description (N m or N).
    pub effort: Option<f64>,
    /// Fault of the effort limit, as text; null if none.
    pub effort_fault: Option<&'static str>,
    /// Maximum gravity torque over the workspace, with payload (N m or N).
    pub weight_torque: f64,
    /// Gravity torque plus the torque to accelerate to full speed in 0.35 s (N m or N).
    pub needed_torque: f64,
}

/// A joint that is held.
#[derive(Clone, Debug, Serialize)]
pub struct NewHeld {
    /// Name.
    pub joint: String,
    /// Position at which it is held (rad or m).
    pub at: f64,
    /// Reason.
    pub why: &'static str,
}

/// A link of the arm. Lengths in m.
#[derive(Clone, Debug, Default, Serialize)]
pub struct NewLink {
    /// Name.
    pub name: String,
    /// Joint at its distal end.
    pub distal: String,
    /// Distance from its frame to that joint; length of its body where the frames do not run along
    /// it.
    pub length: f64,
    /// Mass (kg).
    pub mass: Option<f64>,
    /// One of `box`, `tube`, `rectangle`, `circle`; null if none is proposed.
    pub section: Option<&'static str>,
    /// Size along y of the section; diameter of round ones.
    pub width: Option<f64>,
    /// Size along z of the section.
    pub height: Option<f64>,
    /// Wall thickness; null for solid ones.
    pub wall: Option<f64>,
    /// Wall thickness if only half of the mass is in the wall.
    pub wall_of_half_mass: Option<f64>,
    /// Name of the material.
    pub material: Option<&'static str>,
    /// Direction of the section's y in link axes.
    pub y_axis: Option<[f64; 3]>,
    /// Offset from the line between the joints to the beam, link axes.
    pub offset: Option<[f64; 3]>,
    /// End points of the beam, link axes; null if it runs from the link's frame to the distal
    /// joint.
    pub ends: Option<[[f64; 3]; 2]>,
    /// Ratio of maximum to minimum outer size along the beam.
    pub taper: Option<f64>,
    /// Fraction of the cuts through the mesh with an open outline, for which the convex hull is
    /// used.
    pub open_cuts: Option<f64>,
    /// Reason why no section is proposed.
    pub reason: Option<String>,
    /// Whether section and material are assumed: always, if there are any.
    pub assumed: bool,
}

/// A proposed drive.
#[derive(Clone, Debug, Serialize)]
pub struct NewDrive {
    /// Joint of the drive.
    pub joint: String,
    /// Torsional stiffness at the joint (N m/rad).
    pub stiffness: f64,
    /// Minimum of the gear class (N m/rad).
    pub low: f64,
    /// Maximum of the gear class (N m/rad).
    pub high: f64,
    /// Rated torque of the class (N m).
    pub rated_torque: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Source of the stiffness and its range.
    pub source: String,
    /// Whether it is assumed: always.
    pub assumed: bool,
}

/// Payload of the arm.
#[derive(Clone, Debug, Serialize)]
pub struct NewPayload {
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia about each axis (kg m²).
    pub inertia: f64,
    /// Whether the mass is assumed.
    pub assumed: bool,
}

/// Returns a limit; `None` for an infinite one.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Returns the result of making a robot.
///
/// * `motion`, `findings`: of the written files, read again.
pub(crate) fn of(
    draft: &Draft,
    placed: &Placed,
    files: &[PathBuf],
    folder: &Path,
    motion: MotionReport,
    findings: Vec<Finding>,
) -> NewRobot {
    // Facts and assumptions of the draft, then the figures of the written files.
    let shown = |path: PathBuf| path.display().to_string();
    let joint = |k: &usize| &draft.urdf.mechanism.joints[*k];
    let mut chain = vec![draft.chain.base.clone()];
    chain.extend(draft.chain.path.iter().map(|k| joint(k).child.clone()));
    NewRobot {
        robot: shown(folder.join("robot.toml")),
        motion: shown(folder.join("motion.toml")),
        urdf: shown(folder.join(&placed.reference)),
        name: draft.name.clone(),
        placed: placed.words.clone(),
        base: draft.chain.base.clone(),
        tool: draft.chain.tool.clone(),
        chain,
        joints: draft.joints.iter().map(of_joint).collect(),
        held: draft.held.iter().map(|(joint, at, why)| NewHeld { joint: joint.clone(), at: *at, why }).collect(),
        links: draft.links.iter().map(of_link).collect(),
        drives: draft.joints.iter().filter_map(of_drive).collect(),
        payload: NewPayload {
            mass: draft.payload.mass,
            inertia: draft.payload.moment(),
            assumed: !draft.payload_known,
        },
        reach_m: draft.reach,
        moving_mass_kg: draft.moving_mass,
        assumptions: draft.assumptions.clone(),
        questions: draft.questions.clone(),
        duration_s: motion.duration_s,
        peaks: motion.peaks,
        violations: motion.violations.into_iter().map(|v| v.message).collect(),
        findings,
        files: files.iter().map(|path| path.display().to_string()).collect(),
        summary: None,
    }
}

fn of_joint(joint: &DraftJoint) -> NewJoint {
    let limits = &joint.joint.limits;
    NewJoint {
        name: joint.joint.name.clone(),
        kind: joint.joint.kind.name(),
        lower: finite(limits.lower),
        upper: finite(limits.upper),
        velocity: finite(limits.velocity),
        effort: finite(limits.effort),
        effort_fault: joint.effort_fault,
        weight_torque: joint.weight,
        needed_torque: joint.needed,
    }
}

fn of_link(link: &DraftLink) -> NewLink {
    let (name, distal) = (link.link.clone(), link.distal.clone());
    let plain = NewLink { name, distal, length: link.length, mass: link.mass, ..NewLink::default() };
    match &link.section {
        Err(reason) => NewLink { reason: Some(reason.to_string()), ..plain },
        Ok(s) => NewLink {
            section: Some(s.section),
            width: Some(s.width),
            height: Some(s.height),
            wall: s.wall,
            wall_of_half_mass: s.wall_of_half,
            material: Some(s.material),
            y_axis: Some(s.y_axis),
            offset: Some(s.offset),
            ends: s.ends,
            taper: Some(s.taper),
            open_cuts: Some(s.open),
            assumed: true,
            ..plain
        },
    }
}

fn of_drive(joint: &DraftJoint) -> Option<NewDrive> {
    let gear = joint.gear.as_ref()?;
    Some(NewDrive {
        joint: joint.joint.name.clone(),
        stiffness: three_digits(gear.stiffness),
        low: gear.low,
        high: gear.high,
        rated_torque: joint.rated,
        damping_ratio: 0.03,
        source: gear.source.clone(),
        assumed: true,
    })
}
