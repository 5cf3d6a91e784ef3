//! A loaded robot: URDF, payload, tool centre point and flexible links, from which models are
//! built.
//!
//! Start at [`Robot::load`]. Every `[[entry]]` of a robot file has a file `*_entry.rs` here with its
//! keys, its checks and its units; the order in which entries are applied is in `load.rs`. Inside,
//! everything is SI; link axes are those of the URDF.
//! Not here: models with elastic coordinates ([`crate::Arm`]), unusual values ([`crate::caveat`]).

pub mod balancer;
pub(crate) mod balancer_entry;
pub(crate) mod beam_entry;
pub(crate) mod calibration_entry;
pub(crate) mod controller_entry;
pub(crate) mod coupling_entry;
pub(crate) mod drive_entry;
pub(crate) mod entry_checks;
pub mod file_cache;
pub(crate) mod gauge_entry;
pub(crate) mod gear_entry;
pub(crate) mod gearbox_entry;
pub(crate) mod guide_entry;
pub(crate) mod inertial_entry;
pub(crate) mod link_entry;
pub(crate) mod loop_entry;
pub mod loops;
pub(crate) mod mounting;
pub(crate) mod mounting_entry;
pub mod robot_file;
pub(crate) mod robot_link;
pub(crate) mod strength;
pub mod toml_file;

mod entries;
mod load;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use flexarm_kinematics::{Frame, Mechanism, Model, Pose};
use flexarm_stepping::Plant;
use flexarm_urdf::UrdfRobot;

use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::robot::calibration_entry::Calibration;
use crate::robot::controller_entry::RobotAxis;
use crate::robot::drive_entry::Drive;
use crate::robot::entry_checks::link_names;
use crate::robot::gauge_entry::Gauge;
use crate::robot::gear_entry::RobotCoupling;
use crate::robot::mounting::RobotMounting;
use crate::robot::robot_link::RobotLink;

pub use load::{Description, LoadOptions, RobotSource};

/// Name of the frame added for the tool centre point.
pub const TCP_FRAME: &str = "__tcp";
/// Name of the link added for the payload.
pub const PAYLOAD_LINK: &str = "__payload";

/// A loaded robot.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Name of the robot.
    pub name: String,
    /// Path of the loaded file.
    pub path: PathBuf,
    /// Description as read. Models are built from [`Self::rigid`], which also contains the TCP,
    /// payload and rotors.
    pub urdf: UrdfRobot,
    /// Path of the URDF.
    pub urdf_path: PathBuf,
    /// Rigid robot: the URDF with TCP frame, payload and gravity.
    pub rigid: Mechanism,
    /// Flexible links.
    pub flexible_links: Vec<RobotLink>,
    /// Elastic mounting of the base, if there is one.
    pub mounting: Option<RobotMounting>,
    /// Drives given in the robot file; all other joints are prescribed.
    pub drives: Vec<Drive>,
    /// Coupling of motors that move several joints; their rotors are in [`Self::rigid`].
    pub coupling: Option<RobotCoupling>,
    /// Link that carries the TCP, and the pose of the TCP in that link.
    pub tcp: (String, Pose),
    /// Link requested as TCP instead of the one in the file.
    pub tcp_override: Option<String>,
    /// Default trajectory, used by runs that name none.
    pub default_trajectory: Option<PathBuf>,
    /// Positions of joints that a motion does not drive (rad or m).
    pub hold: Vec<(String, f64)>,
    /// Warnings from loading.
    pub warnings: Vec<String>,
    /// Axes that the controller counts differently from the joints.
    pub controller: Vec<RobotAxis>,
    /// Corrections of joint frames and joint zeros, which [`Self::rigid`] contains.
    pub calibration: Vec<Calibration>,
    /// Strain gauges and stress points.
    pub gauges: Vec<Gauge>,
    /// Caveats that can only be found in the text of the file.
    written: Vec<Finding>,
}

impl Robot {
    /// Returns the link that carries the tool centre point, and the pose `X_LT` of that point in
    /// the link.
    pub fn tcp(&self) -> (&str, &Pose) {
        (&self.tcp.0, &self.tcp.1)
    }

    /// Returns the mass of the payload at the start of a run (kg), 0 without one.
    pub fn payload_kg(&self) -> f64 {
        self.rigid.link(PAYLOAD_LINK).and_then(|link| link.inertia).map_or(0.0, |inertia| inertia.mass)
    }

    /// Replaces the tool centre point; the payload stays where it is. Arms built from the robot
    /// earlier keep their TCP.
    ///
    /// * `link`: link of the robot; `X_LT`: pose of the point in the link's axes (m).
    ///
    /// # Errors
    /// [`Error::UnknownTcp`] if the robot has no such link, [`Error::Value`] if the pose is not
    /// finite.
    pub fn with_tcp(mut self, link: &str, X_LT: Pose) -> Result<Self, Error> {
        if link.starts_with("__") || self.rigid.link(link).is_none() {
            return Err(Error::UnknownTcp { link: link.to_owned(), known: link_names(&self.rigid) });
        }
        let place = X_LT.translation.vector;
        if let Some(found) = place.iter().chain(X_LT.rotation.matrix().iter()).find(|x| !x.is_finite()) {
            return Err(Error::not_finite("the pose of the TCP", *found));
        }
        for joint in self.rigid.joints.iter_mut().filter(|joint| joint.child == TCP_FRAME) {
            (joint.parent, joint.X_PJ) = (link.to_owned(), X_LT);
        }
        self.tcp_override = Some(link.to_owned());
        self.tcp = (link.to_owned(), X_LT);
        Ok(self)
    }

    /// Whether the base has an elastic mounting.
    pub fn is_mounted(&self) -> bool {
        self.mounting.is_some()
    }

    /// Whether the elastic mounting has this name.
    pub fn stands_on(&self, name: &str) -> bool {
        self.mounting.as_ref().is_some_and(|mounting| mounting.name() == name)
    }

    /// Converts joint torques to the torques of the motors that move several joints, after their
    /// gears; keyed by the joint of the drive.
    pub(crate) fn motor_torques(&self, plant: &Plant, tau: &[f64]) -> BTreeMap<String, f64> {
        let (Some(robot), Some(plant)) = (&self.coupling, &plant.coupling) else { return BTreeMap::new() };
        robot.joints.iter().cloned().zip(plant.motor_torques(tau)).collect()
    }

    /// Returns the caveats that are known before any computation.
    pub fn caveats(&self) -> Vec<Finding> {
        // Findings of loading: entries, URDF, text of the file.
        let file = self.path.display().to_string();
        let of_urdf = |text: &&String| self.urdf.warnings_only().any(|w| **text == finding_text(w));
        let own = self.warnings.iter().filter(|text| !of_urdf(text));
        let own = own.map(|text| Finding::warning("flexible-link", &file, text, "compare both sources"));
        let urdf =
            self.urdf.warnings_only().map(|w| Finding { message: finding_text(w), of_description: true, ..w.clone() });
        let mut caveats: Vec<Finding> = own.chain(urdf).chain(self.written.iter().cloned()).collect();
        // Findings about the numbers: parts, links, mounting, drives, balancers, loops.
        caveats.extend(caveat::parts::of_robot(self));
        let inertia = |link: &RobotLink| self.urdf.mechanism.link(&link.flexible.link).and_then(|own| own.inertia);
        caveats
            .extend(self.flexible_links.iter().flat_map(|link| caveat::links::of_link(link, inertia(link).as_ref())));
        caveats.extend(caveat::links::of_mounting(self));
        caveats.extend(caveat::entries::of_entries(self));
        if let Ok(rigid) = self.rigid_model() {
            caveats.extend(caveat::drives::of_drives(&self.drives, &self.rigid, &rigid));
            caveats.extend(caveat::balancers::of_balancers(&self.rigid, &rigid));
            caveats.extend(caveat::loops::of_loops(&rigid));
        }
        caveats
    }

    /// Returns the tree of the rigid robot.
    ///
    /// # Errors
    /// [`Error::Model`].
    pub fn rigid_model(&self) -> Result<Arc<Model>, Error> {
        let model = Model::new(&self.rigid);
        model.map(Arc::new).map_err(|source| Error::Model { path: self.urdf_path.clone(), source: Box::new(source) })
    }
}

/// Returns the TCP frame in a tree of the robot.
pub fn tcp_frame(model: &Model) -> Frame {
    model.frame(TCP_FRAME).expect("added when the robot was loaded").clone()
}

/// Formats a finding with its location as a sentence.
fn finding_text(finding: &Finding) -> String {
    format!("{}: {}", finding.location, finding.message)
}
