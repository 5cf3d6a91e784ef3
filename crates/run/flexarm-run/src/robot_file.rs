//! The robot file `robot.toml`, read into plain structs. [`crate::Robot`] interprets them.
//!
//! Unknown keys are rejected, so that a misspelt key is never ignored. Units are SI; angles in rad.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

pub use flexarm_files::Source;
pub use flexarm_files::TextFileError as RobotFileError;
pub(crate) use flexarm_linkmaker::MaterialEntry;

use crate::balancer_entry::BalancerEntry;
pub(crate) use crate::beam_entry::BeamEntry;
use crate::calibration_entry::CalibrationEntry;
use crate::controller_entry::ControllerAxisEntry;
use crate::drive_entry::DriveEntry;
use crate::gauge_entry::{StrainGaugeEntry, StressPointEntry};
use crate::gear_entry::CouplingEntry;
use crate::loop_entry::LoopEntry;
use crate::mounting::MountingEntry;
use crate::ranges::OF_ROBOT;
use crate::strength::StrengthEntry;
use crate::toml_file::parsed;

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

/// Flexible link.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlexibleLinkEntry {
    /// Link of the URDF.
    pub link: Spanned<String>,
    /// Joint at the far interface.
    pub distal: Option<Spanned<String>>,
    /// `.flex` file, relative to the robot file.
    pub reduced: Option<Spanned<PathBuf>>,
    /// Beam, instead of a `.flex` file.
    pub beam: Option<Spanned<BeamEntry>>,
    /// `lumped` or `modal`.
    pub model: Option<Spanned<String>>,
    /// Number of rigid parts of a lumped link; 2 by default.
    pub segments: Option<Spanned<i64>>,
    /// Number of fixed-interface modes of a modal link, in addition to those of its interfaces; by
    /// default all in the `.flex` file, or 6 for a beam.
    pub modes: Option<Spanned<i64>>,
    /// Modal: use this number of eigenmodes with A held instead of interface displacements.
    pub eigenmodes: Option<Spanned<i64>>,
    /// Modal: whether loads change the stiffness (geometric stiffening); false by default.
    pub geometric_stiffening: Option<Spanned<bool>>,
    /// Mass of a beam link (kg), replaces the URDF's; its inertia is scaled in proportion.
    pub mass: Option<Spanned<f64>>,
    /// Factor on its stiffness, for instance from measurements; 1 by default.
    pub stiffness_factor: Option<Spanned<f64>>,
    /// Lumped: stiffness of the spring between the two parts, replaces that of its source; 6x6,
    /// N/m, N, N m/rad.
    pub stiffness: Option<Spanned<Vec<Vec<f64>>>>,
    /// Lumped: additional factors on the six directions of its springs; 1 by default.
    pub stiffness_factors: Option<Spanned<Vec<f64>>>,
    /// Whether its stress is computed: false by default for a beam, true for a reduced link with a
    /// stress file.
    pub stress: Option<Spanned<bool>>,
    /// Strength of its material; that of the preset material by default.
    pub strength: Option<Spanned<StrengthEntry>>,
    /// Damping; 3 % modal damping by default.
    pub damping: Option<Spanned<DampingEntry>>,
    /// `rotation-vector` or `euler-zyx`.
    pub angles: Option<Spanned<String>>,
    /// `false` drops the coupling terms, only to show their effect.
    #[serde(default = "yes")]
    pub coupling: bool,
}

fn yes() -> bool {
    true
}

/// Damping, in one of these forms.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DampingEntry {
    /// Damping ratio of each mode.
    pub modal: Option<f64>,
    /// `D = beta K` (s).
    pub stiffness_beta: Option<f64>,
    /// `D = a M + b K` (1/s, s).
    pub rayleigh: Option<[f64; 2]>,
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
