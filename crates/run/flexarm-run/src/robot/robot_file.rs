//! The robot file `robot.toml`, read into plain structs. [`crate::Robot`] interprets them.
//!
//! Unknown keys are rejected, so that a misspelt key is never ignored. Units are SI; angles in rad.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

pub use flexarm_files::Source;
pub use flexarm_files::TextFileError as RobotFileError;

use crate::ranges::OF_ROBOT;
use crate::robot::balancer_entry::BalancerEntry;
use crate::robot::calibration_entry::CalibrationEntry;
use crate::robot::controller_entry::ControllerAxisEntry;
use crate::robot::coupling_entry::CouplingEntry;
use crate::robot::drive_entry::DriveEntry;
use crate::robot::gauge_entry::{StrainGaugeEntry, StressPointEntry};
use crate::robot::inertial_entry::InertialEntry;
use crate::robot::link_entry::FlexibleLinkEntry;
use crate::robot::loop_entry::LoopEntry;
use crate::robot::mounting_entry::MountingEntry;
use crate::robot::toml_file::parsed;

/// Robot file as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotFile {
    /// Version of the format: 1.
    pub format: Spanned<i64>,
    /// Name for logs; the name of the folder by default.
    pub name: Option<String>,
    /// URDF or xacro file, relative to the robot file.
    pub urdf: Spanned<PathBuf>,
    /// Tool centre point.
    pub tcp: Option<Spanned<TcpEntry>>,
    /// Payload of the tool.
    pub payload: Option<Spanned<PayloadEntry>>,
    /// Acceleration of gravity in base axes (m/s²).
    pub gravity: Option<Spanned<[f64; 3]>>,
    /// Default trajectory of `flexarm compare`, relative to the robot file.
    pub default_trajectory: Option<Spanned<PathBuf>>,
    /// Folders of `package://` names.
    #[serde(default)]
    pub packages: std::collections::BTreeMap<String, PathBuf>,
    /// Values of the arguments of a xacro file: text, numbers, or true and false.
    #[serde(default)]
    pub args: std::collections::BTreeMap<String, Spanned<toml::Value>>,
    /// Links whose inertia may be unphysical (as published data sometimes are).
    #[serde(default)]
    pub waive_inertia: Vec<String>,
    /// Links whose `<inertial>` is ignored because it is only a placeholder.
    #[serde(default)]
    pub discard_inertia: Vec<String>,
    /// Density of links without `<inertial>` (kg/m³), for masses from their meshes.
    pub inertia_from_density: Option<Spanned<f64>>,
    /// Total mass of all links without `<inertial>` (kg), distributed by volume.
    pub inertia_from_total_mass: Option<Spanned<f64>>,
    /// Positions of joints that a motion does not drive (rad or m).
    #[serde(default)]
    pub hold: std::collections::BTreeMap<String, Spanned<f64>>,
    /// Effort limits that replace the URDF's (N m or N); infinite if unknown.
    #[serde(default)]
    pub effort_limit: std::collections::BTreeMap<String, Spanned<f64>>,
    /// Helical joints: lead per turn (m), positive for right-handed threads.
    #[serde(default)]
    pub lead: std::collections::BTreeMap<String, Spanned<f64>>,
    /// Corrections of joint frames and joint zeros.
    #[serde(default)]
    pub calibration: Vec<CalibrationEntry>,
    /// Masses and centres of mass of rigid links, instead of the URDF's.
    #[serde(default)]
    pub inertial: Vec<InertialEntry>,
    /// Elastic mounting of the base.
    pub mounting: Option<Spanned<MountingEntry>>,
    /// Flexible links.
    #[serde(default)]
    pub flexible_link: Vec<FlexibleLinkEntry>,
    /// Drives of the joints.
    #[serde(default)]
    pub drive: Vec<DriveEntry>,
    /// Motors that move several joints.
    pub coupling: Option<CouplingEntry>,
    /// Springs, gas springs and counterbalances.
    #[serde(default)]
    pub balancer: Vec<Spanned<BalancerEntry>>,
    /// Axis conventions of the controller.
    #[serde(default)]
    pub controller_axis: Vec<ControllerAxisEntry>,
    /// Pins that close kinematic loops.
    #[serde(default)]
    #[serde(rename = "loop")]
    pub loops: Vec<Spanned<LoopEntry>>,
    /// Strain gauges on flexible links.
    #[serde(default)]
    pub strain_gauge: Vec<StrainGaugeEntry>,
    /// Points on flexible links whose stress is recorded.
    #[serde(default)]
    pub stress_point: Vec<StressPointEntry>,
}

/// Pose of the tool centre point in a link.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TcpEntry {
    /// Link that carries it.
    pub link: Spanned<String>,
    /// Position (m).
    #[serde(default)]
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw (rad).
    #[serde(default)]
    pub rpy: [f64; 3],
}

/// A rigid body fixed to a link.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PayloadEntry {
    /// Link that carries it; the TCP link by default.
    pub link: Option<Spanned<String>>,
    /// Mass (kg).
    pub mass: Spanned<f64>,
    /// Centre of mass in link axes (m); required unless the mass is 0.
    pub com: Option<[f64; 3]>,
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass (kg m²).
    #[serde(default)]
    pub inertia: [f64; 6],
}

/// Reads the text of a robot file.
///
/// # Errors
/// [`RobotFileError`] with line and column for anything that does not follow the format.
pub(crate) fn parse_robot_file(text: &str, path: &Path) -> Result<(RobotFile, Source), RobotFileError> {
    let source = Source::new(path, text, "robot");
    let file: RobotFile = parsed(text, &source, OF_ROBOT, |file: &RobotFile| &file.format)?;
    Ok((file, source))
}
