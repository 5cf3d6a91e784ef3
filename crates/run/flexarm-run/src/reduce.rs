//! Reduction of a mesh to a flexible link with its files, as in `flexarm reduce`.
//!
//! ```no_run
//! use flexarm_run::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
//!
//! let job = ReduceJob::load("lower_arm.reduce.toml".as_ref())?;
//! let outputs = ReduceOutputs { folder: Some("out/lower_arm".into()), ..ReduceOutputs::default() };
//! let summary = reduce(&job, &ReduceOptions::default(), Some(&outputs), &mut |_| {})?;
//! println!("{:.2} kg, first frequency {:.1} Hz", summary.statics.mass_kg, summary.frequencies_hz[0]);
//! # Ok::<(), flexarm_run::Error>(())
//! ```
//!
//! Not here: jobs, interfaces, figures and files (`flexarm-linkmaker`). A job may name a robot
//! whose joints define the interfaces; that robot is read here.

use flexarm_fem::RigidPart;
use flexarm_flexlink::{SubstitutionError, distal_joint};
use flexarm_kinematics::{Joint, Pose};
use flexarm_settings::Finding;
use flexarm_settings::Setting;
use flexarm_urdf::{ReadOptions, UrdfError, read_urdf};

use crate::error::Error;

pub use flexarm_linkmaker::reduce::*;

/// Options that are not part of a job.
#[derive(Clone, Debug, Default)]
pub struct ReduceOptions {
    /// Options for the URDF reader.
    pub urdf: ReadOptions,
}

/// Reduces a mesh to a link and writes the files.
///
/// All checks that are possible come before the work starts; if it fails, nothing is written.
///
/// # Errors
/// [`Error`]; several errors of a job are reported together. See [`Error::fault`].
pub fn reduce(
    job: &ReduceJob,
    options: &ReduceOptions,
    outputs: Option<&ReduceOutputs>,
    progress: &mut dyn FnMut(ReduceProgress),
) -> Result<ReduceSummary, Error> {
    let reduction = Reduction::open(job, outputs, progress)?;
    let robot = job.urdf.as_ref().map(|entry| urdf_link(entry, &options.urdf)).transpose()?;
    Ok(reduction.finish(robot.as_ref(), progress)?)
}

/// Returns the link of a robot with the joints on it, for [`Reduction::finish`].
///
/// # Errors
/// [`Error::Urdf`], also if the link does not exist, or if its joint at B is ambiguous or missing.
pub fn urdf_link(entry: &UrdfEntry, options: &ReadOptions) -> Result<UrdfLink, Error> {
    let mechanism = read_urdf(&entry.file, options)?.mechanism;
    let X_LB = distal_joint(&mechanism, &entry.link, entry.joint.as_deref()).map(|joint| joint.X_PJ);
    let X_LB = X_LB.map_err(|error| {
        let place = entry.file.display().to_string();
        UrdfError::from(Box::new(Finding::error("distal-joint", place, no_distal_joint(&error), "")))
    })?;
    let leads_on = |joint: &Joint| joint.parent == entry.link;
    let on_link = mechanism.joints.iter().filter(|joint| leads_on(joint) || joint.child == entry.link);
    let joints = on_link.map(|joint| {
        let leads_on = leads_on(joint);
        let X_LJ = if leads_on { joint.X_PJ } else { Pose::identity() };
        LinkJoint { name: joint.name.clone(), X_LJ, leads_on }
    });
    let joints = joints.collect();
    let inertia = mechanism.link(&entry.link).and_then(|link| link.inertia);
    let inertia = inertia.map(|i| RigidPart { mass: i.mass, com: i.com, inertia: i.inertia_com });
    Ok(UrdfLink { name: entry.link.clone(), X_LB, joints, inertia })
}

fn no_distal_joint(error: &SubstitutionError) -> String {
    match error {
        SubstitutionError::DistalUnclear { link, children } => format!(
            "link {link:?} has {} joints that lead on ({children:?}): name the one at B with {} NAME, or joint = \
             \"NAME\" in [urdf]; the others may be further interfaces, such as {} C=SELECTOR {} C=joint:{}",
            children.len(),
            Setting::Joint,
            Setting::Interface,
            Setting::At,
            children.last().map_or("NAME", String::as_str)
        ),
        other => other.to_string(),
    }
}
