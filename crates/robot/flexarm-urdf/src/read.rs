//! Reads a robot from a file: text, elements, tree, joints, shapes, masses.
//!
//! Start at [`read_urdf`]; [`assemble`] runs the checks in their order. Every check reports all its
//! faults and goes on, so that one run lists them all.
//! Not here: the checks themselves ([`crate::lint`], [`crate::tree`], [`crate::joints`],
//! [`crate::shapes`], [`crate::inertia`]).

use std::path::{Path, PathBuf};

use flexarm_files::read_file;
use flexarm_kinematics::{Link, Mechanism};
use flexarm_settings::Finding;

use crate::error::UrdfError;
use crate::geometry::Visual;
use crate::mesh::UpAxis;
use crate::raw::{RawRobot, read_robot};
use crate::report::{Report, position};
use crate::resolve::Resolver;
use crate::tcp::tcp_candidates;
use crate::transmission::Transmission;
use crate::{inertia, joints, shapes, tree, xacro, xml};

/// Options for reading. `ReadOptions::default()` reads files unchanged and inspects meshes.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Package folders by name, for `package://name/...`.
    pub packages: Vec<(String, PathBuf)>,
    /// Folders in which packages are searched, after the parent folders of the URDF; see
    /// [`crate::search_paths_from_environment`].
    pub search_paths: Vec<PathBuf>,
    /// Estimate of mass and inertia for moving bodies that have none in the file.
    pub inertia_from_mesh: Option<InertiaEstimate>,
    /// Links whose inertia may be rank deficient or break the triangle inequality, as the
    /// rotor-only first link of the Manutec r3 does. Negative moments are never waived.
    pub waive: Vec<String>,
    /// Links whose `<inertial>` is ignored, such as placeholder masses.
    pub discard: Vec<String>,
    /// Whether mesh files are read, to check them and to compare inertias with them; otherwise they
    /// are only located.
    pub inspect_meshes: bool,
    /// Treatment of the up axis of COLLADA meshes.
    pub up_axis: UpAxis,
    /// Values of `$(arg name)` in xacro files, by name.
    pub arguments: Vec<(String, String)>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            packages: Vec::new(),
            search_paths: Vec::new(),
            inertia_from_mesh: None,
            waive: Vec::new(),
            discard: Vec::new(),
            inspect_meshes: true,
            up_axis: UpAxis::Declared,
            arguments: Vec::new(),
        }
    }
}

/// Estimate of masses for bodies without `<inertial>`, from the volume of their visuals as
/// homogeneous solids. If no link has a visual, a total mass is distributed by the lengths of the
/// links, each as a rod.
///
/// Bodies are treated as a whole: if one of several links fixed to each other has an `<inertial>`,
/// nothing is added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InertiaEstimate {
    /// The same density everywhere (kg/m³).
    Density(f64),
    /// The mass of all estimated links together, the base included, in kg; distributed by volume.
    TotalMass(f64),
}

/// A robot description, read and checked.
#[derive(Clone, Debug)]
pub struct UrdfRobot {
    /// Links, joints and masses, including massless frames.
    pub mechanism: Mechanism,
    /// Text of the URDF; after the expansion of xacro, without comments.
    pub text: String,
    /// Visual shapes of the links, in the order of the file.
    pub visuals: Vec<Visual>,
    /// Shapes for collisions that can be read, in the order of the file. Nothing is checked of
    /// them.
    pub collisions: Vec<Visual>,
    /// Mesh references as they stand in the file, those of collision shapes too, with the files
    /// that were found.
    pub mesh_files: Vec<(String, PathBuf)>,
    /// Links that may be the tool centre point, the default first.
    pub tcp_candidates: Vec<String>,
    /// Warnings and notes; there are no errors.
    pub warnings: Vec<Finding>,
    /// Damping and friction of every moving joint; not used in prescribed motion.
    pub dynamics: Vec<JointDynamics>,
    /// The `<transmission>` elements.
    pub transmissions: Vec<Transmission>,
}

/// `<dynamics>` of one moving joint; zero if not given.
#[derive(Clone, Debug, PartialEq)]
pub struct JointDynamics {
    /// Name of the joint.
    pub joint: String,
    /// Viscous damping (N m s/rad or N s/m).
    pub damping: f64,
    /// Static friction (N m or N).
    pub friction: f64,
}

/// Reads a `.urdf` or `.xacro` file; a URDF that contains xacro is treated as xacro.
///
/// # Errors
/// [`UrdfError`] if the file is unreadable, its xacro cannot be expanded, or it has faults (all of
/// them, with their lines).
pub fn read_urdf(path: impl AsRef<Path>, options: &ReadOptions) -> Result<UrdfRobot, UrdfError> {
    let path = path.as_ref();
    parse(&load_text(path)?, path, options).0
}

/// Reads URDF or xacro text; `origin_path` is used in messages, and its folder for relative paths.
///
/// # Errors
/// As [`read_urdf`], except for reading the file.
pub fn parse_urdf(text: &str, origin_path: impl AsRef<Path>, options: &ReadOptions) -> Result<UrdfRobot, UrdfError> {
    parse(text, origin_path.as_ref(), options).0
}

/// Expands a xacro file to URDF text; comments are omitted.
///
/// # Errors
/// [`UrdfError`] if it cannot be read or expanded. The result is not checked to be a robot.
pub fn expand_xacro(path: impl AsRef<Path>, options: &ReadOptions) -> Result<String, UrdfError> {
    let path = path.as_ref();
    let text = load_text(path)?;
    let expanded = xacro::expand(&text, path, &resolver(path, options), &options.arguments)?;
    Ok(expanded.text)
}

/// Returns all findings about a file: errors, warnings and notes, in the order of the file; a file
/// that cannot be read gives one error.
pub fn check_urdf(path: impl AsRef<Path>, options: &ReadOptions) -> Vec<Finding> {
    let path = path.as_ref();
    match load_text(path) {
        Ok(text) => all_findings(parse(&text, path, options)),
        Err(error) => error.into_findings(),
    }
}

/// [`check_urdf`] for text; `origin_path` as in [`parse_urdf`].
pub fn check_urdf_text(text: &str, origin_path: impl AsRef<Path>, options: &ReadOptions) -> Vec<Finding> {
    all_findings(parse(text, origin_path.as_ref(), options))
}

fn all_findings((result, report): (Result<UrdfRobot, UrdfError>, Report)) -> Vec<Finding> {
    let mut findings = result.err().map_or_else(Vec::new, UrdfError::into_findings);
    findings.extend(report.remarks());
    // Stable sort: within a line, errors precede remarks.
    findings.sort_by_key(|finding| position(finding).0);
    findings
}

/// Maximum size of a description (bytes); real robots have up to one megabyte.
const MAX_BYTES: u64 = 64 << 20;

fn resolver<'a>(path: &Path, options: &'a ReadOptions) -> Resolver<'a> {
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    Resolver { folder, packages: &options.packages, search_paths: &options.search_paths }
}

fn load_text(path: &Path) -> Result<String, UrdfError> {
    let io_error = |source| UrdfError::Io { path: path.to_owned(), source };
    if path.is_dir() {
        return Err(io_error(std::io::Error::other("this is a folder; name the URDF file in it")));
    }
    Ok(xml::decode(read_file(path, MAX_BYTES).map_err(io_error)?, path)?)
}

fn parse(text: &str, path: &Path, options: &ReadOptions) -> (Result<UrdfRobot, UrdfError>, Report) {
    let mut report = Report::default();
    // Undeclared prefixes would stop the XML parser.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let (declared, prefixes) = xml::declared(text, &xml::Lines::new(path, text));
    for (prefix, place) in prefixes {
        let message = format!("the prefix {prefix:?} is not declared: its elements and attributes are ignored");
        let help = format!("xmlns:{prefix}=\"...\" at the root element");
        report.warning(&place, "undeclared-prefix", message, help);
    }
    let text = &*declared;
    let resolver = resolver(path, options);
    // Plain URDF.
    if !(xacro::is_xacro(path) || xacro::has_xacro(text)) {
        if let Some((name, _)) = options.arguments.first() {
            let message = format!("the argument {name:?} has no effect: the file is not a xacro file");
            report.warning(&xml::Lines::new(path, text).place(0), "unused-argument", message, "remove it");
        }
        let result = parse_expanded(text, xml::Lines::new(path, text), &[], &resolver, options, &mut report);
        return (result, report);
    }
    // Xacro: places of later findings are those in the files that were expanded.
    let expanded = match xacro::expand(text, path, &resolver, &options.arguments) {
        Ok(expanded) => expanded,
        Err(error) => return (Err(error), report),
    };
    report.take(expanded.remarks);
    let lines = xml::Lines::new(path, &expanded.text).with_origins(&expanded.origins);
    let result = parse_expanded(&expanded.text, lines, &expanded.idle_macros, &resolver, options, &mut report);
    (result, report)
}

fn parse_expanded(
    text: &str,
    lines: xml::Lines<'_>,
    idle_macros: &[String],
    resolver: &Resolver<'_>,
    options: &ReadOptions,
    report: &mut Report,
) -> Result<UrdfRobot, UrdfError> {
    let document = xml::parse(text, &lines).map_err(|issue| report.issues.push(*issue)).ok();
    let raw = document.as_ref().and_then(|document| read_robot(document.root_element(), &lines, report));
    let robot = raw.map(|mut raw| {
        raw.idle_macros = idle_macros.to_vec();
        joints::fix_still_followers(&mut raw, report);
        for link in raw.links.iter_mut().filter(|link| options.discard.contains(&link.name)) {
            link.inertial = None;
        }
        assemble(&raw, text, resolver, options, report)
    });
    match robot {
        Some(mut robot) if report.issues.is_empty() => {
            robot.warnings = report.remarks();
            Ok(robot)
        }
        _ => Err(UrdfError::Invalid { issues: report.sorted_issues(), waivable: report.waivable.clone() }),
    }
}

/// Runs all checks, each as far as the previous ones allow, and builds the robot, which is valid
/// only without errors.
fn assemble(
    raw: &RawRobot,
    text: &str,
    resolver: &Resolver<'_>,
    options: &ReadOptions,
    report: &mut Report,
) -> UrdfRobot {
    let faults = report.issues.len();
    tree::check_names(raw, report);
    tree::check_tree(raw, report);
    let sound_tree = report.issues.len() == faults && raw.joints.iter().all(|j| !j.faulty);

    let mut mechanism = Mechanism::new(&raw.name);
    mechanism.joints = joints::convert_joints(raw, report);

    let visuals = shapes::find_shapes(raw, |link| &link.visuals, resolver, options.up_axis, report);
    let shapes = if options.inspect_meshes || options.inertia_from_mesh.is_some() {
        shapes::inspect(raw, &visuals, report)
    } else {
        shapes::unknown(raw)
    };
    // Bodies are determined only if the tree is sound; otherwise missing masses would be false
    // alarms.
    let bodies = if sound_tree { tree::moving_bodies(raw) } else { Vec::new() };
    let inertias = inertia::link_inertias(raw, &bodies, &shapes, options, report);
    mechanism.links =
        raw.links.iter().zip(inertias).map(|(link, inertia)| Link { name: link.name.clone(), inertia }).collect();

    let mut unused = Report::default();
    let collisions = shapes::find_shapes(raw, |link| &link.collisions, resolver, options.up_axis, &mut unused);
    let tcp_candidates = tcp_candidates(&mechanism).into_iter().map(str::to_owned).collect();
    let moving = raw.joints.iter().filter(|j| !j.is_fixed());
    UrdfRobot {
        text: text.to_owned(),
        mesh_files: resolver.mesh_files(text),
        collisions,
        visuals,
        tcp_candidates,
        warnings: Vec::new(),
        dynamics: moving
            .map(|j| {
                let (damping, friction) = j.urdf.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
                JointDynamics { joint: j.urdf.name.clone(), damping, friction }
            })
            .collect(),
        transmissions: raw.transmissions.clone(),
        mechanism,
    }
}

impl UrdfRobot {
    /// The warnings without the notes.
    pub fn warnings_only(&self) -> impl Iterator<Item = &Finding> {
        self.warnings.iter().filter(|finding| finding.warns())
    }
}
