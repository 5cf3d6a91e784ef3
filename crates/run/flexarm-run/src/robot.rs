//! A loaded robot: URDF, payload, tool centre point and flexible links, from which models are
//! built.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_kinematics::{Frame, Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose};
use flexarm_urdf::{InertiaEstimate, ReadOptions, UrdfRobot, closest, default_tcp, parse_urdf, read_urdf};
use nalgebra::{Matrix3, Vector3};
use toml::Spanned;

use crate::balancer_entry::add_balancers;
use crate::calibration_entry::{Calibration, calibrate};
use crate::caveat::{self, Caveat};
use crate::controller_entry::{RobotAxis, controller_axes};
use crate::drive_entry::{Drive, drives};
use crate::entry_checks::{check_finite, pose};
use crate::error::{Error, ValueError};
use crate::file_cache::FileCache;
use crate::flexible::{FlexibleRobot, RobotLink};
use crate::gauge_entry::{Gauge, gauges};
use crate::gear_entry::{RobotCoupling, coupling};
use crate::link_entry::{LinkHome, flexible_link};
use crate::loop_entry::add_loops;
use crate::loops;
use crate::mounting::{RobotMounting, add_mounting};
use crate::ranges::not_finite;
use crate::robot_file::{FlexibleLinkEntry, PayloadEntry, RobotFile, RobotFileError, Source, parse_robot_file};

/// Name of the frame added for the tool centre point.
pub const TCP_FRAME: &str = "__tcp";
/// Name of the link added for the payload.
pub const PAYLOAD_LINK: &str = "__payload";

/// Options for loading a robot.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Link to use as TCP instead of the one in the file.
    pub tcp: Option<String>,
    /// Options for the URDF reader.
    pub urdf: ReadOptions,
}

/// Last model built, with the mechanism it was built from.
type KeptModel = Arc<Mutex<Option<(Mechanism, Arc<Model>)>>>;

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
    pub flexible: Vec<RobotLink>,
    /// Elastic mounting of the base, if there is one.
    pub mounting: Option<RobotMounting>,
    /// Drives given in the robot file; all other joints are prescribed.
    pub drives: Vec<Drive>,
    /// Motors that move several joints.
    pub(crate) coupling: Option<RobotCoupling>,
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
    written: Vec<Caveat>,
    /// Last tree of the rigid robot, with the mechanism it was built from.
    rigid_tree: KeptModel,
}

impl Robot {
    /// Loads a `robot.toml`, a folder with one, or a bare `.urdf` or `.xacro`.
    ///
    /// # Errors
    /// [`Error`] with the file, the location, the value found and how to fix it.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_with(path.as_ref(), &LoadOptions::default())
    }

    /// As [`Robot::load`], with options.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Self, Error> {
        Self::load_modelled(path, options).map(|(robot, _)| robot)
    }

    /// As [`Robot::load_with`], and also returns the robot with its links and drives modelled as
    /// the file asks ([`Robot::flexible_robot`]).
    ///
    /// Loading already builds this model as a check; pass it to [`Arm::new`](crate::Arm::new).
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn load_modelled(path: &Path, options: &LoadOptions) -> Result<(Self, FlexibleRobot), Error> {
        let path = if path.is_dir() { path.join("robot.toml") } else { path.to_owned() };
        if !path.exists() {
            let what = "there is no such file; give a robot.toml, a folder with one, or a .urdf or .xacro file".into();
            return Err(Error::File { path, what });
        }
        match path.extension().and_then(|e| e.to_str()) {
            Some("toml") => {
                let text = flexarm_files::read_text(&path)?;
                Self::of_texts(&path, &text, None, options, &FileCache::default())
            }
            Some("urdf" | "xacro") => Self::from_urdf(&path, options),
            _ => {
                let what = "expected a robot.toml, a folder with one, or a file ending in .urdf or .xacro".into();
                Err(Error::File { path, what })
            }
        }
    }

    fn from_urdf(path: &Path, options: &LoadOptions) -> Result<(Self, FlexibleRobot), Error> {
        let urdf = read_urdf(path, &options.urdf)?;
        let name = urdf.mechanism.name.clone();
        let link = options.tcp.clone().or_else(|| default_tcp(&urdf.mechanism).map(str::to_owned));
        let link = link.ok_or(Error::NoTcp { in_file: false })?;
        let mut robot = Self {
            name,
            path: path.to_owned(),
            urdf_path: path.to_owned(),
            rigid: urdf.mechanism.clone(),
            urdf,
            flexible: Vec::new(),
            mounting: None,
            drives: Vec::new(),
            coupling: None,
            tcp: (link, Pose::identity()),
            tcp_override: options.tcp.clone(),
            default_trajectory: None,
            hold: Vec::new(),
            warnings: Vec::new(),
            controller: Vec::new(),
            calibration: Vec::new(),
            gauges: Vec::new(),
            written: Vec::new(),
            rigid_tree: Arc::default(),
        };
        let flexible = robot.finish(None)?;
        Ok((robot, flexible))
    }

    /// Builds a robot from the text of a robot file, which need not exist on disk.
    ///
    /// * `path`: nominal path of the file; relative paths start from its folder, and messages quote
    ///   it.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn from_toml(text: &str, path: &Path, options: &LoadOptions) -> Result<Self, Error> {
        Self::of_text(path, text, options, &FileCache::default())
    }

    /// As [`Robot::from_toml`], with the text of the URDF or xacro as well: neither needs to exist
    /// as a file.
    ///
    /// The key `urdf` of the robot file then only gives the name quoted in messages and the
    /// location from which meshes are searched.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn from_texts(text: &str, urdf: &str, path: &Path, options: &LoadOptions) -> Result<Self, Error> {
        Self::of_texts(path, text, Some(urdf), options, &FileCache::default()).map(|(robot, _)| robot)
    }

    /// As [`Robot::from_toml`]; reads the files named in the text through the cache.
    pub fn of_text(path: &Path, text: &str, options: &LoadOptions, files: &FileCache) -> Result<Self, Error> {
        Self::of_texts(path, text, None, options, files).map(|(robot, _)| robot)
    }

    /// As [`Self::of_text`], optionally with the text of the description.
    fn of_texts(
        path: &Path,
        text: &str,
        description: Option<&str>,
        options: &LoadOptions,
        files: &FileCache,
    ) -> Result<(Self, FlexibleRobot), Error> {
        let (file, source) = parse_robot_file(text, path)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let urdf_path = folder.join(file.urdf.get_ref());
        if description.is_none() && !urdf_path.is_file() {
            let message = format!("urdf = {:?}: there is no file {}", file.urdf.get_ref(), urdf_path.display());
            return Err(source.error(file.urdf.span(), message).into());
        }
        let mut urdf_options = options.urdf.clone();
        urdf_options.packages.extend(file.packages.iter().map(|(name, to)| (name.clone(), folder.join(to))));
        urdf_options.waive.extend(file.waive_inertia.iter().cloned());
        urdf_options.discard.extend(file.discard_inertia.iter().cloned());
        for (name, value) in &file.args {
            let given = urdf_options.arguments.iter().any(|(given, _)| given == name);
            let value = argument_text(name, value, &source)?;
            if !given {
                urdf_options.arguments.push((name.clone(), value));
            }
        }
        if let Some(estimate) = inertia_estimate(&file, &source)? {
            urdf_options.inertia_from_mesh.get_or_insert(estimate);
        }
        let urdf = match description {
            Some(text) => parse_urdf(text, &urdf_path, &urdf_options)?,
            None => files.urdf(&urdf_path, &urdf_options)?,
        };
        let found = Self::of_file(path, urdf_path, urdf, &file, &source, options, files)?;
        match not_finite(text) {
            Some((span, message)) => Err(source.error(span, message).into()),
            None => Ok(found),
        }
    }

    /// Builds a robot from the text of a robot file at `path` and a description that is already
    /// read; also returns it with its links and drives modelled as the file asks.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn with_description(
        path: &Path,
        text: &str,
        urdf_path: PathBuf,
        urdf: UrdfRobot,
    ) -> Result<(Self, FlexibleRobot), Error> {
        let (file, source) = parse_robot_file(text, path)?;
        Self::of_file(path, urdf_path, urdf, &file, &source, &LoadOptions::default(), &FileCache::default())
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
    ) -> Result<(Self, FlexibleRobot), Error> {
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut faults: Vec<Error> = Vec::new();
        let mut rigid = urdf.mechanism.clone();
        if let Some(gravity) = &file.gravity {
            rigid.gravity = (*gravity.get_ref()).into();
            keep(check_finite("gravity", gravity.get_ref(), gravity.span(), source).map_err(Error::from), &mut faults);
        }
        for (joint, lead) in &file.lead {
            keep(make_helical(&mut rigid, joint, lead, source).map_err(Error::from), &mut faults);
        }
        let mechanisms = &mut [&mut rigid, &mut urdf.mechanism];
        let (calibration, wrong) = calibrate(&file.calibration, mechanisms, source);
        faults.extend(wrong.into_iter().map(Error::from));
        for (joint, limit) in &file.effort_limit {
            keep(limit_effort(&mut rigid, joint, limit, source).map_err(Error::from), &mut faults);
        }
        let tcp = keep(tcp_of(file, source, &urdf, options), &mut faults);
        // Paths such as `robot.toml`, `.` and links to folders do not contain the folder's name.
        let real_folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let real_folder = real_folder.canonicalize().unwrap_or_else(|_| real_folder.to_owned());
        let fallback_name =
            real_folder.file_name().map_or_else(|| "robot".into(), |n| n.to_string_lossy().into_owned());
        let mut robot = Self {
            name: file.name.clone().unwrap_or(fallback_name),
            path: path.to_owned(),
            urdf_path,
            rigid,
            urdf,
            flexible: Vec::new(),
            mounting: None,
            drives: Vec::new(),
            coupling: None,
            tcp: tcp.unwrap_or_default(),
            tcp_override: options.tcp.clone(),
            default_trajectory: file.default_trajectory.as_ref().map(|t| folder.join(t.get_ref())),
            hold: Vec::new(),
            warnings: Vec::new(),
            controller: Vec::new(),
            calibration,
            gauges: Vec::new(),
            written: written_caveats(file),
            rigid_tree: Arc::default(),
        };
        if let Some(payload) = &file.payload {
            let link = file.tcp.as_ref().map(|t| t.get_ref().link.get_ref().as_str());
            let link = link.or_else(|| default_tcp(&robot.urdf.mechanism)).unwrap_or_default().to_owned();
            keep(robot.add_payload(payload, &link, source), &mut faults);
        }
        add_loops(&mut robot, &file.loops, source, &mut faults);
        for (joint, value) in &file.hold {
            let held = held_joint(joint, value, &robot.rigid, source).map_err(Error::from);
            robot.hold.extend(keep(held, &mut faults));
        }
        robot.drives = drives(&file.drive, &robot.rigid, source, &mut robot.warnings, &mut faults);
        for drive in &robot.drives {
            for joint in robot.rigid.joints.iter_mut().filter(|j| j.name == drive.joint) {
                joint.armature = drive.armature;
            }
        }
        robot.controller = controller_axes(&file.controller_axis, &robot.rigid, source, &mut faults);
        if let Some(entry) = &file.coupling {
            let found = coupling(&mut robot, entry, source).map_err(Error::from);
            robot.coupling = keep(found, &mut faults);
        }
        add_balancers(&mut robot, &file.balancer, source, &mut faults);
        let home = LinkHome { folder, files };
        for entry in &file.flexible_link {
            keep(robot.reweigh(entry, source).map_err(Error::from), &mut faults);
            let urdf = &robot.urdf.mechanism;
            let flexible = flexible_link(entry, urdf, source, &home, &mut robot.warnings, &mut faults);
            robot.flexible.extend(keep(flexible, &mut faults));
        }
        let links = robot.flexible.iter().map(|link| (link.flexible.link.as_str(), link.stress.is_some()));
        let (found, wrong) = gauges(&file.strain_gauge, &file.stress_point, &links.collect::<Vec<_>>(), source);
        robot.gauges = found;
        faults.extend(wrong.into_iter().map(Error::from));
        if let Some(mounting) = &file.mounting {
            add_mounting(&mut robot, mounting, source, &home, &mut faults);
        }
        match faults.len() {
            0 => {}
            1 => return Err(faults.remove(0)),
            _ => return Err(Error::Several(faults)),
        }
        let flexible = robot.finish(Some((file, source)))?;
        Ok((robot, flexible))
    }

    /// Adds the TCP frame and checks that both trees can be built.
    fn finish(&mut self, file: Option<(&RobotFile, &Source)>) -> Result<FlexibleRobot, Error> {
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
        match (self.flexible_robot(), last_flexible) {
            (Ok(flexible), _) => {
                for span in &flexible.spans {
                    let (own, parts) = (span.own_mass, span.part_masses.iter().sum::<f64>());
                    if own > 0.0 && (parts / own - 1.0).abs() > 1e-6 {
                        self.warnings.push(format!(
                            "link {:?}: the two parts weigh {parts:.4} kg, the URDF's link {own:.4} kg; the parts count",
                            span.link
                        ));
                    }
                }
                Ok(flexible)
            }
            (Err(Error::Modelling(fault)), Some((source, span))) => Err(source.error(span, fault.to_string()).into()),
            (Err(error), _) => Err(error),
        }
    }

    /// Sets the mass of a beam link to the value in its entry, keeping its centre of mass and radii
    /// of gyration.
    fn reweigh(&mut self, entry: &FlexibleLinkEntry, source: &Source) -> Result<(), RobotFileError> {
        let (Some(mass), name) = (&entry.mass, entry.link.get_ref()) else { return Ok(()) };
        let fail = |message: String| source.error(mass.span(), format!("link {name:?}: {message}"));
        let wanted = *mass.get_ref();
        if !(wanted > 0.0 && wanted.is_finite()) {
            return Err(fail(format!("mass = {wanted}: expected a positive number of kg")));
        }
        if entry.beam.is_none() {
            return Err(fail("mass belongs to beams; the parts of a .flex file have their own masses".into()));
        }
        let mut found = false;
        for mechanism in [&mut self.rigid, &mut self.urdf.mechanism] {
            let link = mechanism.links.iter_mut().find(|link| link.name == *name);
            if let Some(inertia) = link.and_then(|link| link.inertia.as_mut()).filter(|inertia| inertia.mass > 0.0) {
                inertia.inertia_com *= wanted / inertia.mass;
                inertia.mass = wanted;
                found = true;
            }
        }
        match found {
            true => Ok(()),
            false => Err(fail("the URDF gives it no mass that could be changed: leave mass out".into())),
        }
    }

    /// Attaches the payload to its link, or to the TCP link of the file; a TCP chosen by the user
    /// does not matter here.
    fn add_payload(&mut self, entry: &Spanned<PayloadEntry>, tcp_link: &str, source: &Source) -> Result<(), Error> {
        let payload = entry.get_ref();
        let com = payload.com.unwrap_or_default();
        check_finite("payload com", &com, entry.span(), source)?;
        check_finite("payload inertia", &payload.inertia, entry.span(), source)?;
        let link = payload.link.as_ref().map_or_else(|| tcp_link.to_owned(), |l| l.get_ref().clone());
        if self.rigid.link(&link).is_none() {
            let span = payload.link.as_ref().map_or(0..0, Spanned::span);
            return Err(source.error(span, unknown_link("payload", &link, &self.rigid)).into());
        }
        let mass = *payload.mass.get_ref();
        if !(mass.is_finite() && mass >= 0.0) {
            let message = format!("payload mass is {mass} kg, it must be 0 or positive");
            return Err(source.error(payload.mass.span(), message).into());
        }
        if mass == 0.0 {
            let help = "leave the payload out if there is none";
            let none = Caveat::from_message("no-payload", "the payload", "the payload has 0 kg: it is ignored", help);
            self.written.push(none.as_note());
            return Ok(());
        }
        if payload.com.is_none() {
            let message =
                "payload has no com: its centre of mass in axes of the link, such as com = [0.0, 0.0, 0.1], in m";
            return Err(source.error(entry.span(), message).into());
        }
        let [xx, yy, zz, xy, xz, yz] = payload.inertia;
        let inertia_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        if inertia_com.symmetric_eigenvalues().min() < -1e-9 * inertia_com.norm() {
            let message = "payload inertia has a negative principal moment; the order is ixx iyy izz ixy ixz iyz";
            return Err(source.error(entry.span(), message).into());
        }
        // The payload frame is at its centre of mass, so a cut through the link assigns the payload
        // to the correct side.
        let inertia = LinkInertia { mass, com: Vector3::zeros(), inertia_com };
        self.rigid.links.push(Link { name: PAYLOAD_LINK.into(), inertia: Some(inertia) });
        let joint = Joint::new("__payload_joint", JointKind::Fixed, link, PAYLOAD_LINK, pose(com, [0.0; 3]));
        self.rigid.joints.push(joint);
        Ok(())
    }

    /// Returns the link that carries the tool centre point, and the pose `X_LT` of that point in
    /// the link.
    pub fn tcp(&self) -> (&str, &Pose) {
        (&self.tcp.0, &self.tcp.1)
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
        let known = || self.rigid.links.iter().map(|l| l.name.clone()).filter(|name| !name.starts_with("__")).collect();
        if link.starts_with("__") || self.rigid.link(link).is_none() {
            return Err(Error::UnknownTcp { link: link.to_owned(), known: known() });
        }
        let place = X_LT.translation.vector;
        if let Some(found) = place.iter().chain(X_LT.rotation.matrix().iter()).find(|x| !x.is_finite()) {
            return Err(ValueError::NotFinite { what: "the pose of the TCP", found: *found }.into());
        }
        for joint in self.rigid.joints.iter_mut().filter(|joint| joint.child == TCP_FRAME) {
            (joint.parent, joint.X_PJ) = (link.to_owned(), X_LT);
        }
        self.tcp_override = Some(link.to_owned());
        self.tcp = (link.to_owned(), X_LT);
        Ok(self)
    }

    /// Returns the elastic mounting of the base, if there is one.
    pub fn mounting(&self) -> Option<&RobotMounting> {
        self.mounting.as_ref()
    }

    /// Returns the coupling of motors that move several joints; their rotors are in
    /// [`Self::rigid`].
    pub fn coupling(&self) -> Option<&RobotCoupling> {
        self.coupling.as_ref()
    }

    /// Returns the caveats that are known before any computation.
    pub fn caveats(&self) -> Vec<Caveat> {
        let file = self.path.display().to_string();
        let of_urdf = |text: &&String| self.urdf.warnings_only().any(|w| **text == finding_text(w));
        let own = self.warnings.iter().filter(|text| !of_urdf(text));
        let own = own.map(|text| Caveat::from_message("flexible-link", &file, text, "compare both sources"));
        let of_description = |caveat| Caveat { of_description: true, ..caveat };
        let urdf =
            self.urdf.warnings_only().map(|w| Caveat::from_message(w.code, &w.location, finding_text(w), &w.help));
        let urdf = urdf.map(of_description);
        let mut caveats: Vec<Caveat> = own.chain(urdf).chain(self.written.iter().cloned()).collect();
        caveats.extend(caveat::parts::of_robot(self));
        let inertia = |link: &RobotLink| self.urdf.mechanism.link(&link.flexible.link).and_then(|own| own.inertia);
        caveats.extend(self.flexible.iter().flat_map(|link| caveat::links::of_link(link, inertia(link).as_ref())));
        caveats.extend(caveat::links::of_mounting(self));
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
        let mut kept = self.rigid_tree.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, model)) = kept.as_ref().filter(|(of, _)| *of == self.rigid) {
            return Ok(model.clone());
        }
        let model = Model::new(&self.rigid);
        let model = model
            .map(Arc::new)
            .map_err(|source| Error::Model { path: self.urdf_path.clone(), source: Box::new(source) })?;
        *kept = Some((self.rigid.clone(), model.clone()));
        Ok(model)
    }
}

/// Returns the TCP frame in a tree of the robot.
pub fn tcp_frame(model: &Model) -> Frame {
    model.frame(TCP_FRAME).expect("added when the robot was loaded").clone()
}

/// Returns caveats about angles as written and about unused materials, which only the text of the
/// file shows.
fn written_caveats(file: &RobotFile) -> Vec<Caveat> {
    let rpy = file.tcp.as_ref().and_then(|tcp| caveat::parts::angles("rpy of the TCP", &tcp.get_ref().rpy));
    let beams = file.flexible_link.iter().filter_map(|link| {
        let roll = link.beam.as_ref()?.get_ref().roll;
        caveat::parts::angles(&format!("roll of link {:?}", link.link.get_ref()), &[roll])
    });
    let unused = file.flexible_link.iter().filter(|link| {
        link.beam.as_ref().is_some_and(|beam| beam.get_ref().section == "given" && beam.get_ref().material.is_some())
    });
    let unused = unused.map(|link| {
        let name = link.link.get_ref();
        let message = format!("the material of link {name:?} has no effect: its section is given by its stiffness");
        Caveat::from_message("no-effect", format!("link {name:?}"), message, "leave it out").as_note()
    });
    rpy.into_iter().chain(beams).chain(unused).collect()
}

/// Formats a finding with its location as a sentence.
fn finding_text(finding: &flexarm_urdf::Finding) -> String {
    format!("{}: {}", finding.location, finding.message)
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

/// Turns a rotating joint into a helical one with `lead` metres per turn.
fn make_helical(
    mechanism: &mut Mechanism,
    name: &str,
    lead: &Spanned<f64>,
    source: &Source,
) -> Result<(), RobotFileError> {
    let fail = |message: String| source.error(lead.span(), format!("lead of joint {name:?}: {message}"));
    let turning: Vec<String> = mechanism.joints.iter().filter(|j| j.kind.turns()).map(|j| j.name.clone()).collect();
    let joint = mechanism.joints.iter_mut().find(|j| j.name == name && j.kind.turns());
    let joint = joint.ok_or_else(|| fail(format!("the robot has no such joint that turns; it has {turning:?}")))?;
    let lead = *lead.get_ref();
    if !lead.is_finite() || lead == 0.0 {
        return Err(fail(format!("is {lead}, expected metres per turn: 0.02 for 20 mm")));
    }
    if let JointKind::Revolute(axis) | JointKind::Continuous(axis) = joint.kind {
        joint.kind = JointKind::Helical { axis, pitch: lead / std::f64::consts::TAU };
    }
    Ok(())
}

/// Replaces the effort limit of the URDF (N m or N).
fn limit_effort(
    mechanism: &mut Mechanism,
    name: &str,
    limit: &Spanned<f64>,
    source: &Source,
) -> Result<(), RobotFileError> {
    let fail = |message: String| source.error(limit.span(), format!("effort_limit of joint {name:?}: {message}"));
    let is_free = |joint: &Joint| joint.kind.degrees_of_freedom() == 1;
    let known: Vec<String> = mechanism.joints.iter().filter(|j| is_free(j)).map(|j| j.name.clone()).collect();
    let joint = mechanism.joints.iter_mut().find(|j| j.name == name && is_free(j));
    let joint = joint.ok_or_else(|| fail(format!("the robot has no such joint that moves; it has {known:?}")))?;
    match *limit.get_ref() {
        effort if effort > 0.0 => joint.limits.effort = effort,
        effort => return Err(fail(format!("is {effort}, expected a positive torque in N m (or force in N), or inf"))),
    }
    Ok(())
}

/// Checks an entry of `[hold]`: the joint must be independent and the value within its limits.
fn held_joint(
    name: &str,
    value: &Spanned<f64>,
    mechanism: &Mechanism,
    source: &Source,
) -> Result<(String, f64), RobotFileError> {
    let free = |joint: &&Joint| {
        joint.kind.degrees_of_freedom() == 1 && joint.mimic.is_none() && loops::owner(mechanism, &joint.name).is_none()
    };
    let at = *value.get_ref();
    if let Some(own) = loops::owner(mechanism, name) {
        let message = format!("hold: {name:?} follows from loop {own:?}: hold the joints that drive the loop");
        return Err(source.error(value.span(), message));
    }
    let Some(joint) = mechanism.joints.iter().filter(free).find(|joint| joint.name == name) else {
        let names: Vec<&str> = mechanism.joints.iter().filter(free).map(|joint| joint.name.as_str()).collect();
        let meant = closest(name, names.iter().copied());
        let meant =
            meant.map_or_else(|| format!("its joints are {names:?}"), |meant| format!("did you mean {meant:?}?"));
        let message = format!("hold: {name:?} is not an independent joint of the robot; {meant}");
        return Err(source.error(value.span(), message));
    };
    let (lower, upper) = (joint.limits.lower, joint.limits.upper);
    if !(at.is_finite() && lower <= at && at <= upper) {
        let message = format!("hold: {name:?} is to stay at {at}, outside of its limits {lower} to {upper} (rad or m)");
        return Err(source.error(value.span(), message));
    }
    Ok((name.to_owned(), at))
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

fn unknown_link(what: &str, link: &str, mechanism: &Mechanism) -> String {
    let known: Vec<_> = mechanism.links.iter().map(|l| l.name.as_str()).collect();
    format!("{what} link {link:?} is not a link of the URDF; its links are {known:?}")
}

fn tcp_of(file: &RobotFile, source: &Source, urdf: &UrdfRobot, options: &LoadOptions) -> Result<(String, Pose), Error> {
    if let Some(link) = &options.tcp {
        return Ok((link.clone(), Pose::identity()));
    }
    if let Some(tcp) = &file.tcp {
        check_finite("tcp xyz", &tcp.get_ref().xyz, tcp.span(), source)?;
        check_finite("tcp rpy", &tcp.get_ref().rpy, tcp.span(), source)?;
    }
    match file.tcp.as_ref().map(Spanned::get_ref) {
        Some(tcp) if urdf.mechanism.link(tcp.link.get_ref()).is_none() => {
            Err(source.error(tcp.link.span(), unknown_link("TCP", tcp.link.get_ref(), &urdf.mechanism)).into())
        }
        Some(tcp) => Ok((tcp.link.get_ref().clone(), pose(tcp.xyz, tcp.rpy))),
        None => {
            let link = default_tcp(&urdf.mechanism).ok_or(Error::NoTcp { in_file: true })?;
            Ok((link.to_owned(), Pose::identity()))
        }
    }
}

/// Returns the value, or records the error so that later errors are found too.
pub(crate) fn keep<T>(result: Result<T, Error>, faults: &mut Vec<Error>) -> Option<T> {
    result.map_err(|e| faults.push(e)).ok()
}
