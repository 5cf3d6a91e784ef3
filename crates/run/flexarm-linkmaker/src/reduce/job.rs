//! Job file of a reduction, parsed into a plain struct; command-line flags fill a second such
//! struct that overrides it.
//!
//! Unknown keys are errors. Lengths are in the unit of the mesh, positions in the link frame,
//! angles in rad. Not here: notations of single values (`words.rs`), checks against the mesh
//! (`prepare.rs`).

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use flexarm_fem::reduction::Tie;
use flexarm_fem::{NodeSelector, UnitSystem};
use flexarm_files::{FileError, Source};
use flexarm_settings::exact;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::words::{At, MaterialChoice, OrderingChoice, QuadratureChoice, SplitChoice, text};
use crate::LinkError;

/// A reduction job. A value of `None` has a default, or is requested in an error if it is needed.
///
/// ```toml
/// mesh = "lower_arm.msh.gz"        # relative to this file
/// units = "mm-t-s"
/// material = "aluminium"           # or { E = 70e9, nu = 0.33, rho = 2700 }; left out if the mesh has its own
/// modes = 10
/// [[interface]]
/// name = "A"
/// select = "interface_A"           # a set, plane(...), cylinder(...), box(...), joined with &
/// xyz = [0.0, -75.0, 0.0]          # unit of the mesh, link frame; or at = "centroid", or joint = "..." with [urdf]
/// [[interface]]
/// name = "B"
/// select = "cylinder(40,0,1100; 0,1,0; 60)"
/// at = "centroid"
/// tie = "distributing"
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ReduceJob {
    /// Job file, if the job is read from one.
    #[serde(skip)]
    pub file: Option<PathBuf>,
    /// Mesh file; relative to the job file in a file, to the working folder in memory.
    pub mesh: PathBuf,
    /// Name of the link; default: that of the URDF's link, or of the mesh file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// Units of the mesh, such as `mm-t-s`.
    #[serde(default, with = "text", skip_serializing_if = "Option::is_none")]
    pub units: Option<UnitSystem>,
    /// Material of all regions, including those with a material in the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<MaterialChoice>,
    /// Material of single regions by name; overrides `material`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, MaterialChoice>,
    /// Number of fixed-interface modes to keep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modes: Option<usize>,
    /// Alternatively, keep all modes below this frequency (Hz).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modes_up_to_hz: Option<f64>,
    /// Default tie of the interfaces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tie: Option<Tie>,
    /// Position of the elastic joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub split: Option<SplitChoice>,
    /// Chains to store in the link, by their number of parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chains: Option<Vec<usize>>,
    /// Whether to compute the geometric stiffness of the modal link, which
    /// `geometric_stiffening = true` of a robot file needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub geometric: Option<bool>,
    /// Whether to store the stress at the nodes of the surface, in a file beside the link file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stress: Option<bool>,
    /// Distance below which nodes are merged, unit of the mesh; closes seams and cracks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub merge: Option<f64>,
    /// Quadrature of solid elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature: Option<QuadratureChoice>,
    /// Elimination ordering.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ordering: Option<OrderingChoice>,
    /// Pose of the mesh frame in the link frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_frame: Option<FrameEntry>,
    /// Robot that defines the interface frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<UrdfEntry>,
    /// Interfaces: proximal, distal, then any others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interface: Vec<InterfaceEntry>,
}

/// A pose; lengths in the unit of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FrameEntry {
    /// Position.
    #[serde(default)]
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw (rad).
    #[serde(default)]
    pub rpy: [f64; 3],
}

/// An interface: its nodes and its frame.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct InterfaceEntry {
    /// Name; default A, B, C, ...
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Selection of nodes, in frame and unit of the mesh file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub select: Option<NodeSelector>,
    /// Position in the link frame, unit of the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xyz: Option<[f64; 3]>,
    /// Roll, pitch, yaw in the link frame (rad).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rpy: Option<[f64; 3]>,
    /// Alternatively, position at the centroid of the nodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<At>,
    /// Alternatively, position at the origin of a joint of the robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Tie of the nodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tie: Option<Tie>,
    /// File and line of the entry, for messages.
    #[serde(skip)]
    pub place: String,
}

/// A robot with joints at the interfaces of the link.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct UrdfEntry {
    /// URDF or xacro file; relative to the job file, like `mesh`.
    pub file: PathBuf,
    /// Name of the link.
    pub link: String,
    /// Joint at B; default: the only moving child joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Whether the mass of the URDF's link beyond that of the mesh (motors, gears, cables) is
    /// attached to the two parts, as the halves of a uniform bar, so that the rigid robot stays
    /// that of the URDF.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rest: bool,
}

/// Maximum size of a job file (bytes); larger files are meshes.
const LONGEST_JOB: u64 = 1 << 20;

impl ReduceJob {
    /// Creates a job with only a mesh.
    pub fn for_mesh(mesh: impl Into<PathBuf>) -> Self {
        Self { mesh: mesh.into(), ..Self::default() }
    }

    /// Reads a job file, or creates a job with only this mesh. The content decides: a job is TOML
    /// with `mesh = ...`.
    ///
    /// # Errors
    /// [`LinkError::Files`] if the file cannot be read, [`LinkError::JobFile`] with line and column
    /// if it is not a valid job.
    pub fn load(path: &Path) -> Result<Self, LinkError> {
        let unreadable = |e: std::io::Error| {
            let what = match e.kind() {
                std::io::ErrorKind::NotFound => {
                    "there is no such file; give a mesh (.msh or .inp, also .gz) or a job file (.toml)".to_owned()
                }
                _ => format!("cannot be read: {e}"),
            };
            LinkError::Files(FileError::Unusable { path: path.to_owned(), what })
        };
        let mut bytes = Vec::new();
        // Reading a device may never end, opening a pipe may block.
        if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
            return Err(unreadable(std::io::Error::other("this is not a file; give the path of a regular one")));
        }
        let file = std::fs::File::open(path).map_err(unreadable)?;
        file.take(LONGEST_JOB + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        let is_toml = path.extension().is_some_and(|e| e == "toml");
        match std::str::from_utf8(&bytes) {
            Ok(text) if is_toml || is_job(text) => parse_job(text, path),
            Err(_) if is_toml => Err(LinkError::content(path, "is not UTF-8 text, which a job file must be")),
            _ => Ok(Self::for_mesh(path)),
        }
    }

    /// Parses the text of a job file.
    ///
    /// * `path`: path of the file, real or assumed; paths in the job are relative to it.
    ///
    /// # Errors
    /// [`LinkError::JobFile`] with line and column.
    pub fn parse(text: &str, path: &Path) -> Result<Self, LinkError> {
        parse_job(text, path)
    }

    /// Name of the link: the one given, that of the URDF's link, or that of the mesh file.
    pub fn link_name(&self) -> String {
        let given = self.link.clone().or_else(|| self.urdf.as_ref().map(|urdf| urdf.link.clone()));
        given.unwrap_or_else(|| stem(&self.mesh))
    }

    /// Overrides this job with the values given in `flags`. Interfaces are matched by name; a new
    /// name adds an interface. The mesh is kept.
    pub fn put_over(&mut self, flags: Self) {
        fn put<T>(own: &mut Option<T>, given: Option<T>) {
            if given.is_some() {
                *own = given;
            }
        }
        if flags.modes.is_some() || flags.modes_up_to_hz.is_some() {
            (self.modes, self.modes_up_to_hz) = (flags.modes, flags.modes_up_to_hz);
        }
        if flags.tie.is_some() {
            // A tie on the command line applies to all interfaces.
            self.interface.iter_mut().for_each(|entry| entry.tie = None);
        }
        if flags.material.is_some() {
            self.materials.clear();
        }
        put(&mut self.link, flags.link);
        put(&mut self.units, flags.units);
        put(&mut self.material, flags.material);
        self.materials.extend(flags.materials);
        put(&mut self.tie, flags.tie);
        put(&mut self.split, flags.split);
        put(&mut self.chains, flags.chains);
        put(&mut self.geometric, flags.geometric);
        put(&mut self.stress, flags.stress);
        put(&mut self.merge, flags.merge);
        put(&mut self.quadrature, flags.quadrature);
        put(&mut self.ordering, flags.ordering);
        put(&mut self.mesh_frame, flags.mesh_frame);
        if let Some(mut urdf) = flags.urdf {
            if let Some(own) = self.urdf.take() {
                urdf.rest |= own.rest;
                urdf.joint = urdf.joint.or(own.joint.filter(|_| own.link == urdf.link));
            }
            self.urdf = Some(urdf);
        }
        self.name_interfaces();
        for given in flags.interface {
            let Some(own) = self.interface.iter_mut().find(|own| own.name == given.name) else {
                self.interface.push(given);
                continue;
            };
            if given.select.is_some() {
                own.place.clone_from(&given.place);
            }
            put(&mut own.select, given.select);
            if given.xyz.is_some() || given.at.is_some() || given.joint.is_some() {
                (own.xyz, own.rpy, own.at, own.joint) = (given.xyz, given.rpy, given.at, given.joint);
            }
            put(&mut own.tie, given.tie);
        }
        self.name_interfaces();
    }

    /// Names unnamed interfaces by letters in their order.
    fn name_interfaces(&mut self) {
        for (entry, letter) in self.interface.iter_mut().zip('A'..='Z') {
            entry.name.get_or_insert_with(|| letter.to_string());
        }
    }
}

/// Whether the text is TOML with a mesh rather than a mesh, even with errors further down.
pub fn is_job(text: &str) -> bool {
    let lines = text.lines().map(str::trim_start);
    let mut keys = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    !text.trim_start().starts_with(['$', '*'])
        && keys.any(|line| line.strip_prefix("mesh").is_some_and(|rest| rest.trim_start().starts_with('=')))
}

/// Parses a job; its paths are relative to the folder of `path`.
///
/// # Errors
/// [`LinkError`] with line and column.
pub fn parse_job(text: &str, path: &Path) -> Result<ReduceJob, LinkError> {
    let source = Source::new(path, text, "flex");
    let failed = |error: toml::de::Error| {
        let hint = match error.message().contains("missing field `mesh`") {
            true => ": add mesh = \"file.msh\"",
            false => "",
        };
        LinkError::from(source.unread(error.span(), &format!("{}{hint}", error.message().trim())))
    };
    let mut job: ReduceJob = toml::Deserializer::parse(text).and_then(exact).map_err(failed)?;
    let places: Places = toml::from_str(text).map_err(failed)?;
    for (entry, place) in job.interface.iter_mut().zip(places.interface) {
        let span = place.select.or(place.name).map_or(0..0, |value| value.span());
        entry.place = source.error(span, "").place().to_string();
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    job.file = Some(path.to_owned());
    job.mesh = folder.join(&job.mesh);
    if let Some(urdf) = &mut job.urdf {
        urdf.file = folder.join(&urdf.file);
    }
    Ok(job)
}

/// Positions of the interface entries in the file.
#[derive(Deserialize)]
struct Places {
    #[serde(default)]
    interface: Vec<InterfacePlace>,
}

#[derive(Deserialize)]
struct InterfacePlace {
    name: Option<Spanned<IgnoredAny>>,
    select: Option<Spanned<IgnoredAny>>,
}

/// Returns the name of a file without folder and extensions.
fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(|| "link".into(), |name| name.to_string_lossy().into_owned());
    name.split('.').find(|part| !part.is_empty()).unwrap_or("link").to_owned()
}
