//! Facts and assumptions about a robot, collected before anything is written.
//!
//! Start at [`Draft::of`]: description, chain of joints, payload, workspace, drives, motion, beams,
//! each from what comes before it. Not here: whether a beam can be loaded, and the list of
//! assumptions ([`super::settle`]).

use std::collections::HashMap;
use std::path::Path;

use flexarm_kinematics::{Data, Joint, Link, Mechanism, Model, forward_kinematics};
use flexarm_settings::Setting;
use flexarm_urdf::{Geometry, ReadOptions, TriangleMesh, UrdfError, UrdfRobot, Visual, read_urdf};
use nalgebra::{DVector, Vector3};

use super::beams::{self, BeamSection, NoSection};
use super::chain::{self, Chain};
use super::gears::{self, GearClass, Reducer};
use super::loads::{self, Cube, Workspace};
use super::report::Assumption;
use super::sample::{self, Axis, SampleMotion};
use super::{NewError, NewOptions};
use flexarm_run::Error;

/// A link of the arm with its section, or the reason why it has none.
#[derive(Clone, Debug)]
pub(crate) struct DraftLink {
    pub(crate) link: String,
    pub(crate) distal: String,
    pub(crate) length: f64,
    pub(crate) mass: Option<f64>,
    pub(crate) section: Result<BeamSection, NoSection>,
    /// Whether its shapes are the collision shapes.
    pub(crate) of_collisions: bool,
}

/// A joint of the arm with its drive.
#[derive(Clone, Debug)]
pub(crate) struct DraftJoint {
    pub(crate) joint: Joint,
    pub(crate) speed: f64,
    pub(crate) speed_assumed: bool,
    /// Fault of its effort limit, if any.
    pub(crate) effort_fault: Option<&'static str>,
    pub(crate) weight: f64,
    pub(crate) needed: f64,
    /// Assumed rated torque of its reducer (N m), and the gear class.
    pub(crate) rated: f64,
    pub(crate) gear: Option<GearClass>,
}

/// Everything known or assumed about the robot.
#[derive(Clone, Debug)]
pub(crate) struct Draft {
    pub(crate) name: String,
    pub(crate) urdf: UrdfRobot,
    pub(crate) chain: Chain,
    pub(crate) waived: Vec<String>,
    /// Links with placeholder masses, which were estimated instead.
    pub(crate) discarded: Vec<String>,
    pub(crate) estimate: Option<flexarm_urdf::InertiaEstimate>,
    /// Whether an estimate of masses was requested although no link lacks one.
    pub(crate) idle_estimate: bool,
    pub(crate) moving_mass: f64,
    /// Maximum distance of the TCP from the first joint of the arm in the sampled poses (m).
    pub(crate) reach: f64,
    pub(crate) payload: Cube,
    pub(crate) payload_known: bool,
    pub(crate) held: Vec<(String, f64, &'static str)>,
    pub(crate) joints: Vec<DraftJoint>,
    pub(crate) links: Vec<DraftLink>,
    pub(crate) motion: SampleMotion,
    /// Assumptions, and questions for the manufacturer; set once the beams are settled.
    pub(crate) assumptions: Vec<Assumption>,
    pub(crate) questions: Vec<String>,
}

impl Draft {
    /// Reads a description and assumes what it lacks.
    ///
    /// # Errors
    /// [`NewError`] for a payload that is not a mass, and for an arm without joints or mass; those of the
    /// description.
    pub(crate) fn of(path: &Path, options: &NewOptions) -> Result<Self, Error> {
        if let Some(found) = options.payload_kg.filter(|kg| !(kg.is_finite() && *kg >= 0.0)) {
            return Err(NewError(format!("{} is {found}: expected a mass in kg, 0 for none", Setting::Payload)).into());
        }
        // Description, and the joints that are the arm.
        let Description { urdf, waived, discarded } = Description::read(path, &options.urdf)?;
        let mechanism = &urdf.mechanism;
        let chain = chain::find(mechanism, options)?;
        let name = if mechanism.name.trim().is_empty() { "robot".to_owned() } else { mechanism.name.clone() };
        let model = |payload: Option<Cube>| {
            let loaded = loads::loaded(mechanism, &chain.tool, payload);
            Model::new(&loaded).map_err(|source| Error::Model { path: path.to_owned(), source: Box::new(source) })
        };
        // An arm without mass has no loads.
        let bare = model(None)?;
        let moving_mass = mass_after(mechanism, &chain);
        if moving_mass <= 0.0 {
            return Err(massless(mechanism).into());
        }
        // Payload, as given or guessed from the loads over the workspace.
        let held = fixed_joints(mechanism, &chain);
        let ranges = ranges(&bare, mechanism, &chain, &held);
        let payload_known = options.payload_kg.is_some();
        let payload = match options.payload_kg {
            Some(mass) => mass,
            None => guess(&bare, &model(Some(Cube::of(1.0)))?, &ranges, moving_mass),
        };
        let payload = Cube::of(payload);
        let model = model((payload.mass > 0.0).then_some(payload))?;
        // Loads with it, and what follows: drives, sample motion, sections of the links.
        let workspace = Workspace::of(&model, &ranges);
        let reach = reach(&model, &workspace, mechanism, &chain);
        let floor = loads::wrist_torque(payload.mass, moving_mass, reach);
        let joints = joints(&model, mechanism, &chain, &workspace, floor, options.reducers);
        let axes: Vec<Axis> = joints.iter().filter_map(|j| axis(j, &model, &ranges)).collect();
        let motion = sample::sample_motion(&model, &workspace, &axes);
        let links = links(&urdf, &chain);
        let estimated = urdf.warnings.iter().any(|w| w.code == "estimated-inertia");
        Ok(Self {
            name,
            chain,
            waived,
            discarded,
            estimate: options.urdf.inertia_from_mesh.filter(|_| estimated),
            idle_estimate: options.urdf.inertia_from_mesh.is_some() && !estimated,
            moving_mass,
            reach,
            payload,
            payload_known,
            held,
            joints,
            links,
            motion,
            assumptions: Vec::new(),
            questions: Vec::new(),
            urdf,
        })
    }

    /// Returns the links proposed as flexible.
    pub(crate) fn beams_with_sections(&self) -> Vec<&DraftLink> {
        self.links.iter().filter(|link| link.section.is_ok()).collect()
    }
}

/// Returns the error for an arm without mass, with the settings that supply one.
fn massless(mechanism: &Mechanism) -> NewError {
    let links = mechanism.links.iter().filter(|l| l.inertia.is_none_or(|i| i.mass <= 0.0)).count();
    NewError(format!(
        "no link of the arm has a mass in this file ({links} links without <inertial>): without mass there \
         are no loads and no deflections. Give the mass of the arm from its data sheet with {} KG: it is \
         distributed over the links by the volume of their meshes; or a density with {} KG_PER_M3",
        Setting::InertiaFromTotalMass,
        Setting::InertiaFromDensity
    ))
}

/// The description as read, with the links whose inertia is doubtful.
struct Description {
    urdf: UrdfRobot,
    /// Links with impossible moments of inertia, used unchanged.
    waived: Vec<String>,
    /// Links with placeholder masses, which are estimated instead.
    discarded: Vec<String>,
}

impl Description {
    fn read(path: &Path, options: &ReadOptions) -> Result<Self, Error> {
        let (urdf, waived) = read(path, options)?;
        let discarded = placeholders(&urdf.mechanism);
        if options.inertia_from_mesh.is_none() || discarded.is_empty() {
            return Ok(Self { urdf, waived, discarded: Vec::new() });
        }
        let (urdf, waived) = read(path, &ReadOptions { discard: discarded.clone(), ..options.clone() })?;
        Ok(Self { urdf, waived, discarded })
    }
}

/// Reads the description. Inertias that violate the triangle inequality are accepted as they are;
/// the names of their links are returned.
fn read(path: &Path, options: &ReadOptions) -> Result<(UrdfRobot, Vec<String>), Error> {
    let error = match read_urdf(path, options) {
        Ok(urdf) => return Ok((urdf, Vec::new())),
        Err(error) => error,
    };
    let waived = match &error {
        UrdfError::Invalid { issues, waivable } if issues.len() == waivable.len() => waivable.clone(),
        _ => return Err(error.into()),
    };
    let mut again = options.clone();
    again.waive.extend(waived.iter().cloned());
    Ok((read_urdf(path, &again)?, waived))
}

/// Fraction of the links with a mass that must have the same one for it to be a placeholder.
const ALIKE: f64 = 0.7;

/// Returns the links with the mass shared by most links, if it is a placeholder.
pub(crate) fn placeholders(mechanism: &Mechanism) -> Vec<String> {
    let with = |link: &Link| Some((link.name.clone(), link.inertia?.mass)).filter(|(_, mass)| *mass > 0.0);
    let with: Vec<(String, f64)> = mechanism.links.iter().filter_map(with).collect();
    let alike = |mass: f64| with.iter().filter(move |(_, other)| (other - mass).abs() < 1e-9 * mass);
    let Some(most) = with.iter().map(|(_, mass)| *mass).max_by_key(|mass| alike(*mass).count()) else {
        return Vec::new();
    };
    let names: Vec<String> = alike(most).map(|(name, _)| name.clone()).collect();
    let many = names.len() > 3 && names.len() as f64 >= ALIKE * with.len() as f64;
    if many { names } else { Vec::new() }
}

/// Mass of all links carried by the joints of the arm (kg).
fn mass_after(mechanism: &Mechanism, chain: &Chain) -> f64 {
    let above: HashMap<&str, usize> = mechanism.joints.iter().enumerate().map(|(k, j)| (j.child.as_str(), k)).collect();
    let is_moved = |link: &str| {
        let mut at = link;
        for _ in 0..=mechanism.joints.len() {
            match above.get(at) {
                Some(k) if chain.joints.contains(k) => return true,
                Some(k) => at = &mechanism.joints[*k].parent,
                None => return false,
            }
        }
        false
    };
    mechanism.links.iter().filter(|l| is_moved(&l.name)).filter_map(|l| l.inertia).map(|i| i.mass).sum()
}

/// Returns the joints that are not part of the arm: name, position and reason.
fn fixed_joints(mechanism: &Mechanism, chain: &Chain) -> Vec<(String, f64, &'static str)> {
    let fixed = |&(k, why): &(usize, &'static str)| {
        let joint = &mechanism.joints[k];
        (joint.name.clone(), 0.0f64.clamp(joint.limits.lower, joint.limits.upper), why)
    };
    chain.held.iter().map(fixed).collect()
}

/// Returns the range of each coordinate to be sampled; held ones have a single value.
fn ranges(model: &Model, mechanism: &Mechanism, chain: &Chain, held: &[(String, f64, &'static str)]) -> Vec<[f64; 2]> {
    let range = |name: &str| {
        let joint = chain.joints.iter().map(|&k| &mechanism.joints[k]).find(|j| j.name == name);
        let at = held.iter().find(|(joint, ..)| joint == name).map_or(0.0, |(_, at, _)| *at);
        joint.map_or([at, at], loads::range)
    };
    model.coordinates().iter().map(|c| range(&c.joint)).collect()
}

/// Guesses the payload from gravity torques without it and with one kilogram (kg).
fn guess(bare: &Model, with_one_kg: &Model, ranges: &[[f64; 2]], mass: f64) -> f64 {
    let (without, with) = (Workspace::of(bare, ranges), Workspace::of(with_one_kg, ranges));
    let joint = |&k: &usize| {
        let effort = bare.coordinates()[k].limits.effort;
        (effort, without.weight[k], with.weight[k] - without.weight[k])
    };
    let joints: Vec<_> = without.moved.iter().map(joint).collect();
    loads::guessed_payload(mass, &joints)
}

/// Returns the maximum distance of the TCP from the first joint of the arm (m).
fn reach(model: &Model, workspace: &Workspace, mechanism: &Mechanism, chain: &Chain) -> f64 {
    let Some(frame) = model.frame(&mechanism.joints[chain.joints[0]].child) else { return 0.0 };
    let mut data = Data::new(model);
    let distance = |q: &DVector<f64>, tool: &Vector3<f64>, data: &mut Data| {
        forward_kinematics(model, data, q);
        (tool - data.X_WF(frame).translation.vector).norm()
    };
    workspace.poses.iter().map(|pose| distance(&pose.q, &pose.tool, &mut data)).fold(0.0, f64::max)
}

/// Returns the joints of the arm with their drives.
///
/// * `floor`: minimum torque assumed for a joint of this arm (N m).
fn joints(
    model: &Model,
    mechanism: &Mechanism,
    chain: &Chain,
    workspace: &Workspace,
    floor: f64,
    reducers: Option<Reducer>,
) -> Vec<DraftJoint> {
    let draft_joint = |&place: &usize| {
        let joint = &mechanism.joints[place];
        let k = model.coordinates().iter().position(|c| c.joint == joint.name)?;
        let (speed, speed_assumed) = sample::speed_of(joint);
        let weight = workspace.weight[k];
        let needed = workspace.needed(k, speed.min(4.0));
        let effort_fault = loads::effort_fault(joint.limits.effort, weight, needed, floor);
        let joint = joint.clone();
        Some(DraftJoint { joint, speed, speed_assumed, effort_fault, weight, needed, rated: 0.0, gear: None })
    };
    let mut joints: Vec<DraftJoint> = chain.joints.iter().filter_map(draft_joint).collect();
    // An effort limit equal for all joints and wrong for some is a placeholder.
    let same = |j: &DraftJoint| j.joint.limits.effort == joints[0].joint.limits.effort;
    let weak = |j: &DraftJoint| j.joint.limits.effort < j.weight;
    if joints.len() > 2 && joints.iter().all(same) {
        let (weak, faulty) = (joints.iter().any(weak), joints.iter().any(|j| j.effort_fault.is_some()));
        let too_little = "is the same for all joints and below the torque that holds the arm against gravity";
        let too_much = "is the same for all joints and far above the torque that some of them can require";
        for joint in &mut joints {
            joint.effort_fault = match joint.effort_fault {
                _ if weak => Some(too_little),
                None if faulty => Some(too_much),
                own => own,
            };
        }
    }
    // Rated torque and class of the reducers.
    for joint in &mut joints {
        joint.rated = match joint.effort_fault {
            None => joint.joint.limits.effort / gears::PEAK_OVER_RATED,
            // Gravity torque may last, acceleration torque does not.
            Some(_) => (joint.needed / gears::PEAK_OVER_RATED).max(joint.weight.max(floor) / 1.5),
        };
        let reducer = reducers.unwrap_or_else(|| Reducer::usual(joint.rated));
        joint.gear = (!joint.joint.kind.slides() && joint.rated > 1e-6).then(|| gears::class(reducer, joint.rated));
    }
    joints
}

/// Returns a joint of the sample motion; `None` if the model has no such coordinate.
fn axis(joint: &DraftJoint, model: &Model, ranges: &[[f64; 2]]) -> Option<Axis> {
    let k = model.coordinates().iter().position(|c| c.joint == joint.joint.name)?;
    let full = ranges[k];
    // Restrict the range to the distance covered within a few seconds.
    let (middle, half) =
        (0.5 * (full[0] + full[1]), (0.5 * (full[1] - full[0])).min(sample::LONGEST_WAY * joint.speed));
    Some(Axis {
        k,
        slides: joint.joint.kind.slides(),
        full,
        range: [middle - half, middle + half],
        speed: joint.speed,
        effort: if joint.effort_fault.is_some() { f64::INFINITY } else { joint.joint.limits.effort },
    })
}

/// Returns all links between the first moving joint and the tool, with their sections.
fn links(urdf: &UrdfRobot, chain: &Chain) -> Vec<DraftLink> {
    let mechanism = &urdf.mechanism;
    let joint = |k: usize| &mechanism.joints[k];
    let first = chain.path.iter().position(|k| chain.joints.contains(k)).map_or(chain.path.len(), |p| p + 1);
    let arm: f64 = chain.path.iter().map(|&k| joint(k).X_PJ.translation.vector.norm()).sum();
    // Every span between two joints of the path.
    let mut found = Vec::new();
    for &k in &chain.path[first.min(chain.path.len())..] {
        let distal = joint(k);
        let inertia = mechanism.link(&distal.parent).and_then(|l| l.inertia);
        let (meshes, of_collisions) = shapes(urdf, &distal.parent);
        let proximal = mechanism.joints.iter().find(|j| j.child == distal.parent);
        let section = beams::propose(&beams::Candidate { proximal, distal, inertia, meshes: &meshes, arm });
        let ends = section.as_ref().ok().and_then(|section| section.ends);
        let length = ends.map_or(distal.X_PJ.translation.vector, |[from, to]| Vector3::from(to) - Vector3::from(from));
        // Skip frames at the same point.
        if length.norm() < 1e-6 {
            continue;
        }
        found.push(DraftLink {
            link: distal.parent.clone(),
            distal: distal.name.clone(),
            length: length.norm(),
            mass: inertia.map(|i| i.mass),
            section,
            of_collisions,
        });
    }
    // A link is flexible between two joints only: keep the longest span.
    let mut kept: Vec<DraftLink> = Vec::new();
    for link in found {
        if let Some(other) = kept.iter_mut().find(|other| other.link == link.link) {
            if link.length > other.length {
                *other = link;
            }
        } else {
            kept.push(link);
        }
    }
    kept
}

/// Returns the visual shapes of a link, in its axes, or its collision shapes if no visual one can
/// be read.
fn shapes(urdf: &UrdfRobot, link: &str) -> (Vec<TriangleMesh>, bool) {
    let read = |visuals: &[Visual]| -> Vec<TriangleMesh> {
        let own = visuals.iter().filter(|v| v.link == link);
        own.filter(|v| !matches!(v.geometry, Geometry::Mesh { path: None, .. }))
            .filter_map(|v| Some(v.geometry.triangles().ok()?.transformed(&v.X_LV)))
            .collect()
    };
    let visual = read(&urdf.visuals);
    if visual.is_empty() { (read(&urdf.collisions), true) } else { (visual, false) }
}
