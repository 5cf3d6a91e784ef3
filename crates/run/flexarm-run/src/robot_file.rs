//! The robot file `robot.toml`: what it may say, read into plain structs. [`crate::Robot`] makes
//! sense of it.
//!
//! Unknown keys are refused, so that a misspelt one is never ignored. Units are SI; angles in rad.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

pub use flexarm_files::Source;
pub use flexarm_files::TextFileError as RobotFileError;
pub(crate) use flexarm_linkmaker::MaterialEntry;

use crate::balancer_entry::BalancerEntry;
pub(crate) use crate::beam_entry::BeamEntry;
use crate::controller_entry::ControllerAxisEntry;
use crate::drive_entry::DriveEntry;
use crate::gear_entry::CouplingEntry;
use crate::loop_entry::LoopEntry;
use crate::mounting::MountingEntry;
use crate::ranges::OF_ROBOT;
use crate::toml_file::parsed;

/// The file as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotFile {
    /// Version of the format: 1.
    pub format: Spanned<i64>,
    /// Name for logs; the folder's name if not given.
    pub name: Option<String>,
    /// URDF or xacro file, relative to the robot file.
    pub urdf: Spanned<PathBuf>,
    /// Tool centre point.
    pub tcp: Option<Spanned<TcpEntry>>,
    /// Payload of the tool.
    pub payload: Option<Spanned<PayloadEntry>>,
    /// Acceleration of gravity in base axes (m/s²).
    pub gravity: Option<Spanned<[f64; 3]>>,
    /// Trajectory for `flexarm compare` without one, relative to the robot file.
    pub default_trajectory: Option<Spanned<PathBuf>>,
    /// Folders of `package://` names.
    #[serde(default)]
    pub packages: std::collections::BTreeMap<String, PathBuf>,
    /// Values of the arguments of a xacro file: text, numbers or true and false.
    #[serde(default)]
    pub args: std::collections::BTreeMap<String, Spanned<toml::Value>>,
    /// Links whose inertia may be one that no body has (published data sometimes do).
    #[serde(default)]
    pub waive_inertia: Vec<String>,
    /// Links whose `<inertial>` counts as not written: masses that only hold a place.
    #[serde(default)]
    pub discard_inertia: Vec<String>,
    /// Density for links without `<inertial>` (kg/m³): masses from their meshes.
    pub inertia_from_density: Option<Spanned<f64>>,
    /// Mass of all links without `<inertial>` together (kg), distributed by volume.
    pub inertia_from_total_mass: Option<Spanned<f64>>,
    /// Positions of joints that a motion does not name (rad or m).
    #[serde(default)]
    pub hold: std::collections::BTreeMap<String, Spanned<f64>>,
    /// Effort limits in the place of the URDF's (N m or N); infinite where none is known.
    #[serde(default)]
    pub effort_limit: std::collections::BTreeMap<String, Spanned<f64>>,
    /// Joints that slide as they turn: how far in a turn (m), right-handed threads positive.
    #[serde(default)]
    pub lead: std::collections::BTreeMap<String, Spanned<f64>>,
    /// Elastic mounting of the base.
    pub mounting: Option<Spanned<MountingEntry>>,
    /// Links that bend.
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
    /// Pins that close loops of links.
    #[serde(default)]
    #[serde(rename = "loop")]
    pub loops: Vec<Spanned<LoopEntry>>,
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
    /// Link that carries it; that of the TCP if not given.
    pub link: Option<Spanned<String>>,
    /// Mass (kg).
    pub mass: Spanned<f64>,
    /// Centre of mass in link axes (m); must be there unless the mass is 0.
    pub com: Option<[f64; 3]>,
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass (kg m²).
    #[serde(default)]
    pub inertia: [f64; 6],
}

/// A flexible link.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlexibleLinkEntry {
    /// Link of the URDF.
    pub link: Spanned<String>,
    /// Joint at the far interface.
    pub distal: Option<Spanned<String>>,
    /// `.flex` file, relative to the robot file.
    pub reduced: Option<Spanned<PathBuf>>,
    /// Or a beam.
    pub beam: Option<Spanned<BeamEntry>>,
    /// `lumped` or `modal`.
    pub model: Option<Spanned<String>>,
    /// Number of rigid parts of a lumped link; 2 if not given.
    pub segments: Option<Spanned<i64>>,
    /// Number of fixed-interface modes of a modal link, beside those of its interfaces; all that
    /// the .flex file has, 6 of a beam.
    pub modes: Option<Spanned<i64>>,
    /// Modal: use the link's own modes with A held instead of interface displacements, only as many
    /// as given.
    pub eigenmodes: Option<Spanned<i64>>,
    /// Modal: let loads change the stiffness; false if not given.
    pub geometric_stiffening: Option<Spanned<bool>>,
    /// Mass of a link that is a beam instead of the URDF's, its inertia in proportion (kg).
    pub mass: Option<Spanned<f64>>,
    /// Factor on its stiffness, as identified; 1 if not given.
    pub stiffness_factor: Option<Spanned<f64>>,
    /// Stiffness of the spring between its two parts in the place of its source's, lumped links;
    /// 6x6, N/m, N, N m/rad.
    pub stiffness: Option<Spanned<Vec<Vec<f64>>>>,
    /// Factors on the six directions of its springs beside that, lumped links; 1 if not given.
    pub stiffness_factors: Option<Spanned<Vec<f64>>>,
    /// Damping; 3 % modal if not given.
    pub damping: Option<Spanned<DampingEntry>>,
    /// `rotation-vector` or `euler-zyx`.
    pub angles: Option<Spanned<String>>,
    /// `false` drops the coupling terms, only to show what that costs.
    #[serde(default = "yes")]
    pub coupling: bool,
}

fn yes() -> bool {
    true
}

/// One of the ways to damp.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DampingEntry {
    /// Ratio to critical, per mode.
    pub modal: Option<f64>,
    /// `D = beta K` (s).
    pub stiffness_beta: Option<f64>,
    /// `D = a M + b K` (1/s, s).
    pub rayleigh: Option<[f64; 2]>,
}

/// Reads the text of a robot file.
///
/// # Errors
/// [`RobotFileError`] with line and column for anything that is not the format.
pub(crate) fn parse_robot_file(text: &str, path: &Path) -> Result<(RobotFile, Source), RobotFileError> {
    let source = Source::new(path, text, "robot");
    let file: RobotFile = parsed(text, &source, OF_ROBOT, |file: &RobotFile| &file.format)?;
    Ok((file, source))
}
