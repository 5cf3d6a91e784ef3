//! Loading of a robot: from a robot file, its texts, or a bare URDF or xacro file.
//!
//! Start at [`RobotSource::load`]. Text becomes plain structs (`robot_file.rs`); the description is
//! read with the options of the file; then the entries change the rigid robot or stay beside it, in
//! the order of [`Robot::add_entries`]; at last links and drives are modelled once, so that a file
//! that loads can run. Faults are collected and reported together. Not here: the URDF itself
//! (`flexarm-urdf`), single entries (`*_entry.rs`).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_files::{Source, TextFileError as RobotFileError, named_file};
use flexarm_kinematics::{Joint, JointKind, Link, Mechanism, Pose};
use flexarm_urdf::{InertiaEstimate, ReadOptions, UrdfRobot, default_tcp, parse_urdf, read_urdf};
use toml::Spanned;

use super::entries::{held_joint, limit_effort, make_helical, tcp_of};
use super::inertial_entry::weigh;
use super::{Robot, TCP_FRAME, finding_text};
use crate::arm::Arm;
use crate::arm::options::Modelling;
use crate::caveat::Finding;
use crate::error::Error;
use crate::ranges::{not_finite, unusual};
use crate::robot::balancer_entry::add_balancers;
use crate::robot::calibration_entry::{Calibration, calibrate};
use crate::robot::controller_entry::controller_axes;
use crate::robot::coupling_entry::coupling;
use crate::robot::drive_entry::drives;
use crate::robot::entry_checks::{check_finite, keep};
use crate::robot::file_cache::FileCache;
use crate::robot::gauge_entry::gauges;
use crate::robot::link_entry::{LinkHome, flexible_link};
use crate::robot::loop_entry::add_loops;
use crate::robot::mounting_entry::add_mounting;
use crate::robot::robot_file::{RobotFile, parse_robot_file};

/// Options for loading a robot.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Link to use as TCP instead of the one in the file.
    pub tcp: Option<String>,
    /// Options for the URDF reader.
    pub urdf: ReadOptions,
}

/// Source of a robot: a path, or texts that need not exist as files.
pub struct RobotSource<'a> {
    /// Path of a `robot.toml`, a folder with one, a `.urdf` or a `.xacro`. Relative paths in the
    /// text start from its folder, and messages quote it.
    pub path: &'a Path,
    /// Text of the robot file, used instead of the content of `path`.
    pub text: Option<&'a str>,
    /// Description, used instead of the file that the key `urdf` names.
    pub description: Option<Description<'a>>,
    /// Options for loading.
    pub options: &'a LoadOptions,
    /// Content of the files that the text names, as far as they are already read.
    pub files: Option<&'a FileCache>,
}

/// Description of a robot that is not read from a file.
pub enum Description<'a> {
    /// Text of a URDF or xacro.
    Text(&'a str),
    /// Description that is already read.
    Read(&'a UrdfRobot),
}

impl<'a> RobotSource<'a> {
    /// Returns the source of a robot file, URDF or xacro at a path.
    pub fn new(path: &'a Path, options: &'a LoadOptions) -> Self {
        Self { path, text: None, description: None, options, files: None }
    }

    /// Reads the robot and models its links and drives as the file asks.
    ///
    /// # Errors
    /// [`Error`] with the file, the location, the value found and how to fix it.
    pub fn load(self) -> Result<Arc<Arm>, Error> {
        let Some(text) = self.text else { return self.load_path() };
        let own = FileCache::default();
        let files = self.files.unwrap_or(&own);
        let (file, source) = parse_robot_file(text, self.path)?;
        let folder = self.path.parent().unwrap_or(Path::new("."));
        let urdf_path = folder.join(file.urdf.get_ref());
        let description = match self.description {
            Some(Description::Read(urdf)) => urdf.clone(),
            given => {
                if given.is_none() {
                    let located = |message: String| source.error(file.urdf.span(), message);
                    named_file("urdf", file.urdf.get_ref(), folder).map_err(located)?;
                }
                let options = urdf_options(&file, &source, folder, self.options)?;
                match given {
                    Some(Description::Text(text)) => parse_urdf(text, &urdf_path, &options)?,
                    _ => files.urdf(&urdf_path, &options)?,
                }
            }
        };
        let found = Robot::of_file(self.path, urdf_path, description, &file, &source, self.options, files)?;
        match not_finite(text) {
            Some((span, message)) => Err(source.error(span, message).into()),
            None => Ok(found),
        }
    }

    fn load_path(self) -> Result<Arc<Arm>, Error> {
        let path = if self.path.is_dir() { self.path.join("robot.toml") } else { self.path.to_owned() };
        if !path.exists() {
            let what = "there is no such file; give a robot.toml, a folder with one, or a .urdf or .xacro file".into();
            return Err(Error::File { path, what });
        }
        match path.extension().and_then(|e| e.to_str()) {
            Some("toml") => {
                let text = flexarm_files::read_text(&path)?;
                RobotSource { path: &path, text: Some(&text), ..self }.load()
            }
            Some("urdf" | "xacro") => Robot::from_urdf(&path, self.options),
            _ => {
                let what = "expected a robot.toml, a folder with one, or a file ending in .urdf or .xacro".into();
                Err(Error::File { path, what })
            }
        }
    }
}

impl Robot {
    /// Loads a `robot.toml`, a folder with one, or a bare `.urdf` or `.xacro`. With options, or from
    /// texts, it is the robot of the arm that a [`RobotSource`] loads ([`Arm::robot`]).
    ///
    /// # Errors
    /// As [`RobotSource::load`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        RobotSource::new(path.as_ref(), &LoadOptions::default()).load().map(|arm| arm.robot().clone())
    }

    fn from_urdf(path: &Path, options: &LoadOptions) -> Result<Arc<Arm>, Error> {
        let urdf = read_urdf(path, &options.urdf)?;
        let name = urdf.mechanism.name.clone();
        let link = options.tcp.clone().or_else(|| default_tcp(&urdf.mechanism).map(str::to_owned));
        let link = link.ok_or(Error::NoTcp { in_file: false })?;
        let tcp = (link, Pose::identity());
        Self { tcp, tcp_override: options.tcp.clone(), ..Self::of_urdf(name, path, path.to_owned(), urdf) }.finish(None)
    }

    /// Returns the robot of a description, without a TCP and without what a robot file adds.
    fn of_urdf(name: String, path: &Path, urdf_path: PathBuf, urdf: UrdfRobot) -> Self {
        Self {
            name,
            path: path.to_owned(),
            urdf_path,
            rigid: urdf.mechanism.clone(),
            urdf,
            flexible_links: Vec::new(),
            mounting: None,
            drives: Vec::new(),
            coupling: None,
            tcp: Default::default(),
            tcp_override: None,
            default_trajectory: None,
            hold: Vec::new(),
            warnings: Vec::new(),
            controller: Vec::new(),
            calibration: Vec::new(),
            gauges: Vec::new(),
            written: Vec::new(),
        }
    }

    /// Builds a robot from a parsed robot file and its description.
    fn of_file(
        path: &Path,
        urdf_path: PathBuf,
        mut urdf: UrdfRobot,
        file: &RobotFile,
        source: &Source,
        options: &LoadOptions,
        files: &FileCache,
    ) -> Result<Arc<Arm>, Error> {
        let folder = path.parent().unwrap_or(Path::new("."));
        // Faults of all entries are collected, so that one call reports them together.
        let mut faults: Vec<Error> = Vec::new();
        let (rigid, calibration) = changed_mechanism(&mut urdf.mechanism, file, source, &mut faults);
        let tcp = keep(tcp_of(file, source, &urdf, options), &mut faults);
        let name = file.name.clone().unwrap_or_else(|| name_of_folder(folder));
        let mut robot = Self {
            rigid,
            tcp: tcp.unwrap_or_default(),
            tcp_override: options.tcp.clone(),
            default_trajectory: file.default_trajectory.as_ref().map(|t| folder.join(t.get_ref())),
            calibration,
            written: written_caveats(file, source),
            ..Self::of_urdf(name, path, urdf_path, urdf)
        };
        robot.add_entries(file, source, &LinkHome { folder, files }, &mut faults);
        match faults.len() {
            0 => {}
            1 => return Err(faults.remove(0)),
            _ => return Err(Error::Several(faults)),
        }
        robot.finish(Some((file, source)))
    }

    /// Adds payload, loops, drives, balancers, flexible links, gauges and mounting of the file, in
    /// an order in which each finds what it builds on.
    fn add_entries(&mut self, file: &RobotFile, source: &Source, home: &LinkHome<'_>, faults: &mut Vec<Error>) {
        // The rigid tree: payload and loops, before entries that name their joints.
        if let Some(payload) = &file.payload {
            let link = file.tcp.as_ref().map(|t| t.get_ref().link.get_ref().as_str());
            let link = link.or_else(|| default_tcp(&self.urdf.mechanism)).unwrap_or_default().to_owned();
            keep(self.add_payload(payload, &link, source), faults);
        }
        add_loops(self, &file.loops, source, faults);
        for (joint, value) in &file.hold {
            let held = held_joint(joint, value, &self.rigid, source).map_err(Error::from);
            self.hold.extend(keep(held, faults));
        }
        // Drives with their rotors, which couplings distribute over several joints.
        self.drives = drives(&file.drive, &self.rigid, source, &mut self.warnings, faults);
        for drive in &self.drives {
            for joint in self.rigid.joints.iter_mut().filter(|j| j.name == drive.joint) {
                joint.armature = drive.armature;
            }
        }
        self.controller = controller_axes(&file.controller_axis, &self.rigid, source, faults);
        if let Some(entry) = &file.coupling {
            let found = coupling(self, entry, source).map_err(Error::from);
            self.coupling = keep(found, faults);
        }
        add_balancers(self, &file.balancer, source, faults);
        // Flexible links, whose masses count in the rigid robot too; then what is on them.
        for entry in &file.flexible_link {
            keep(self.reweigh(entry, source).map_err(Error::from), faults);
            let urdf = &self.urdf.mechanism;
            let flexible = flexible_link(entry, urdf, source, home, &mut self.warnings, faults);
            self.flexible_links.extend(keep(flexible, faults));
        }
        self.weigh_flexible_links();
        // A gauge on a link that has a fault of its own is not judged.
        let links = file.flexible_link.iter().map(|entry| {
            let name = entry.link.get_ref().as_str();
            let loaded = self.flexible_links.iter().find(|link| link.flexible.link == name);
            (name, loaded.is_none_or(|link| link.stress.is_some()))
        });
        let (found, wrong) = gauges(&file.strain_gauge, &file.stress_point, &links.collect::<Vec<_>>(), source);
        self.gauges = found;
        faults.extend(wrong.into_iter().map(Error::from));
        if let Some(mounting) = &file.mounting {
            add_mounting(self, mounting, source, home, faults);
        }
    }

    /// Adds the TCP frame and models links and drives.
    fn finish(mut self, file: Option<(&RobotFile, &Source)>) -> Result<Arc<Arm>, Error> {
        let (link, X_LT) = self.tcp.clone();
        if self.rigid.link(&link).is_none() {
            let known = self.rigid.links.iter().map(|l| l.name.clone()).collect();
            return Err(Error::UnknownTcp { link, known });
        }
        self.rigid.joints.push(Joint::new("__tcp_joint", JointKind::Fixed, link, TCP_FRAME, X_LT));
        self.rigid.links.push(Link { name: TCP_FRAME.into(), inertia: None });
        self.warnings.extend(self.urdf.warnings_only().map(finding_text));
        // Errors of the model as a whole are reported at the last flexible link, where a duplicate
        // entry would be.
        let last_flexible = file.and_then(|(f, s)| {
            let mounting = f.mounting.as_ref().map(Spanned::span);
            f.flexible_link.last().map(|e| e.link.span()).or(mounting).map(|span| (s, span))
        });
        match (Arc::new(self).modelled(&Modelling::default()), last_flexible) {
            (Ok(arm), _) => Ok(Arc::new(arm)),
            (Err(Error::Modelling(fault)), Some((source, span))) => Err(source.error(span, fault.to_string()).into()),
            (Err(error), _) => Err(error),
        }
    }
}

/// Returns the options for reading the URDF, with the packages, arguments and waived inertias of
/// the robot file.
fn urdf_options(
    file: &RobotFile,
    source: &Source,
    folder: &Path,
    options: &LoadOptions,
) -> Result<ReadOptions, RobotFileError> {
    let mut urdf = options.urdf.clone();
    urdf.packages.extend(file.packages.iter().map(|(name, to)| (name.clone(), folder.join(to))));
    urdf.waive.extend(file.waive_inertia.iter().cloned());
    urdf.discard.extend(file.discard_inertia.iter().cloned());
    for (name, value) in &file.args {
        let given = urdf.arguments.iter().any(|(given, _)| given == name);
        let value = argument_text(name, value, source)?;
        if !given {
            urdf.arguments.push((name.clone(), value));
        }
    }
    if let Some(estimate) = inertia_estimate(file, source)? {
        urdf.inertia_from_mesh.get_or_insert(estimate);
    }
    Ok(urdf)
}

/// Returns the rigid robot with the gravity, helical joints, calibration, masses and effort limits of
/// the file, and its corrections of joints; those and the masses also go into the mechanism of the
/// URDF.
fn changed_mechanism(
    urdf: &mut Mechanism,
    file: &RobotFile,
    source: &Source,
    faults: &mut Vec<Error>,
) -> (Mechanism, Vec<Calibration>) {
    let mut rigid = urdf.clone();
    // Only the rigid robot has the gravity and the helical joints of the file.
    if let Some(gravity) = &file.gravity {
        rigid.gravity = (*gravity.get_ref()).into();
        keep(check_finite("gravity", gravity.get_ref(), gravity.span(), source).map_err(Error::from), faults);
    }
    for (joint, lead) in &file.lead {
        keep(make_helical(&mut rigid, joint, lead, source).map_err(Error::from), faults);
    }
    // Calibration and masses go into both mechanisms.
    let (calibration, wrong) = calibrate(&file.calibration, &mut [&mut rigid, urdf], source);
    faults.extend(wrong.into_iter().map(Error::from));
    for entry in &file.inertial {
        let is_flexible = file.flexible_link.iter().any(|link| link.link.get_ref() == entry.link.get_ref());
        let weighed = weigh(entry, &file.inertial, is_flexible, &mut [&mut rigid, urdf], source);
        keep(weighed.map_err(Error::from), faults);
    }
    for (joint, limit) in &file.effort_limit {
        keep(limit_effort(&mut rigid, joint, limit, source).map_err(Error::from), faults);
    }
    (rigid, calibration)
}

/// Returns the name of a folder. Paths such as `robot.toml`, `.` and links to folders do not
/// contain it.
fn name_of_folder(folder: &Path) -> String {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.file_name().map_or_else(|| "robot".into(), |name| name.to_string_lossy().into_owned())
}

/// Reads how missing masses are estimated.
fn inertia_estimate(file: &RobotFile, source: &Source) -> Result<Option<InertiaEstimate>, RobotFileError> {
    let positive = |what: &str, value: &Spanned<f64>| match *value.get_ref() {
        x if x.is_finite() && x > 0.0 => Ok(x),
        x => Err(source.error(value.span(), format!("{what} is {x}, it must be positive"))),
    };
    match (&file.inertia_from_density, &file.inertia_from_total_mass) {
        (Some(_), Some(mass)) => {
            let message = "inertia_from_density and inertia_from_total_mass are both given: keep one of them";
            Err(source.error(mass.span(), message))
        }
        (Some(density), None) => positive("inertia_from_density", density).map(InertiaEstimate::Density).map(Some),
        (None, Some(mass)) => positive("inertia_from_total_mass", mass).map(InertiaEstimate::TotalMass).map(Some),
        (None, None) => Ok(None),
    }
}

/// Converts an argument for a xacro file to text.
fn argument_text(name: &str, value: &Spanned<toml::Value>, source: &Source) -> Result<String, RobotFileError> {
    match value.get_ref() {
        toml::Value::String(text) => Ok(text.clone()),
        toml::Value::Integer(number) => Ok(number.to_string()),
        toml::Value::Float(number) => Ok(format!("{number:?}")),
        toml::Value::Boolean(truth) => Ok(truth.to_string()),
        other => {
            let message = format!("args: {name} is a {}, expected a text, a number, true or false", other.type_str());
            Err(source.error(value.span(), message))
        }
    }
}

/// Returns caveats about unusual numbers and about unused materials, which only the text of the
/// file shows.
fn written_caveats(file: &RobotFile, source: &Source) -> Vec<Finding> {
    let unused = file.flexible_link.iter().filter(|link| {
        link.beam.as_ref().is_some_and(|beam| beam.get_ref().section == "given" && beam.get_ref().material.is_some())
    });
    let unused = unused.map(|link| {
        let name = link.link.get_ref();
        let message = format!("the material of link {name:?} has no effect: its section is given by its stiffness");
        Finding::warning("no-effect", format!("link {name:?}"), message, "leave it out").as_note()
    });
    unusual(source.text()).into_iter().chain(unused).collect()
}
