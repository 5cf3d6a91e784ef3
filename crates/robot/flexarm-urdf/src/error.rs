//! Errors of robot descriptions: one variant of [`Problem`] for each kind of fault.

use std::fmt;
use std::path::PathBuf;

use flexarm_settings::Setting;

use crate::finding::{Finding, Severity, TextPosition};

/// Error of reading a robot description.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("{}: cannot be read", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// A xacro file that cannot be expanded.
    #[error("{0}")]
    Xacro(#[source] Box<XacroError>),
    /// The file has faults. All of them are listed, in the order of the file.
    #[error("{}", listed(issues))]
    Invalid {
        /// At least one.
        issues: Vec<Issue>,
    },
}

impl UrdfError {
    /// The faults in the file; empty if it could not be read or expanded.
    pub fn issues(&self) -> &[Issue] {
        match self {
            Self::Invalid { issues } => issues,
            Self::Io { .. } | Self::Xacro(_) => &[],
        }
    }

    /// The errors as findings, for a report.
    pub fn findings(&self) -> Vec<Finding> {
        match self {
            Self::Invalid { issues } => issues.iter().map(Finding::from).collect(),
            Self::Io { path, source } => vec![Finding {
                severity: Severity::Error,
                code: "unreadable",
                location: path.display().to_string(),
                message: format!("the file cannot be read: {source}"),
                help: "check the path and the permissions".to_owned(),
            }],
            Self::Xacro(error) => vec![Finding {
                severity: Severity::Error,
                code: "xacro",
                location: format!("{}:{}", error.place.file.display(), error.place.line),
                message: error.whole_message(),
                help: error.help.clone(),
            }],
        }
    }
}

fn listed(issues: &[Issue]) -> String {
    issues.iter().map(Issue::to_string).collect::<Vec<_>>().join("\n")
}

/// First error in the expansion of a xacro file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct XacroError {
    /// Place of the element.
    pub place: TextPosition,
    /// Description of the problem.
    pub message: String,
    /// Remedy; may be empty.
    pub help: String,
    /// Enclosing macro calls and files, the innermost first.
    pub trail: Vec<String>,
}

impl XacroError {
    /// Description of the problem with the enclosing calls.
    fn whole_message(&self) -> String {
        let steps = self.trail.iter().map(|step| format!("\n  {step}"));
        self.message.clone() + &steps.collect::<String>()
    }
}

impl fmt::Display for XacroError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.whole_message())?;
        if self.help.is_empty() { Ok(()) } else { write!(f, "\n  help: {}", self.help) }
    }
}

impl std::error::Error for XacroError {}

/// A fault and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Issue {
    /// Place of the fault.
    pub place: TextPosition,
    /// The fault.
    pub problem: Problem,
}

impl fmt::Display for Issue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}\n  help: {}", self.place, self.problem, self.problem.help())
    }
}

impl std::error::Error for Issue {}

impl From<&Issue> for Finding {
    fn from(issue: &Issue) -> Self {
        Finding {
            severity: Severity::Error,
            code: issue.problem.code(),
            location: format!("{}:{}", issue.place.file.display(), issue.place.line),
            message: issue.problem.to_string(),
            help: issue.problem.help(),
        }
    }
}

/// A fault of a URDF. Names are those of the file, values in SI units.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the fields are explained by the message above them")]
pub enum Problem {
    /// The bytes are not UTF-8 text.
    #[error("the byte 0x{byte:02x} is not UTF-8 text")]
    NotUtf8 { byte: u8 },
    /// The text is truncated or not well-formed XML.
    #[error("found {found}, expected {expected}")]
    Malformed { found: String, expected: String },
    /// XML with another root element.
    #[error("the root element is <{root}>, expected <robot>")]
    NotUrdf { root: String },
    /// Too many links or joints.
    #[error("the robot has {found} links and joints, at most {most} are read")]
    TooManyElements { found: usize, most: usize },
    /// A robot that `urdf_rs` rejects although no fault was found.
    #[error("urdf-rs does not read this robot: {reason}")]
    NotRead { reason: String },
    /// A robot without any link.
    #[error("the robot {robot:?} has no <link>{}", macros_text(idle_macros))]
    NoLink { robot: String, idle_macros: Vec<String> },
    /// A missing child element that URDF requires.
    #[error("{owner} has no <{element}>")]
    MissingElement { owner: String, element: &'static str },
    /// A missing attribute that URDF requires.
    #[error("{owner} has no attribute {attribute:?}")]
    MissingAttribute { owner: String, attribute: &'static str },
    /// An attribute that is not a number, or NaN or infinite.
    #[error("{owner}: {attribute}={found:?}, expected {expected}")]
    NotANumber { owner: String, attribute: &'static str, found: String, expected: &'static str },
    /// Two links with the same name.
    #[error("link {link:?} is defined twice, first in line {first_line}")]
    DuplicateLink { link: String, first_line: u32 },
    /// Two joints with the same name.
    #[error("joint {joint:?} is defined twice, first in line {first_line}")]
    DuplicateJoint { joint: String, first_line: u32 },
    /// A joint whose parent or child link does not exist.
    #[error("joint {joint:?}: its {role} link {link:?} does not exist")]
    UnknownLink { joint: String, role: &'static str, link: String, closest: Option<String> },
    /// A link that is the child of two joints: a closed loop.
    #[error("link {link:?} is the child of two joints, {first:?} (line {first_line}) and {second:?}")]
    TwoParents { link: String, first: String, first_line: u32, second: String },
    /// Links in a cycle.
    #[error("the joints {} form a cycle without a base link", quoted(joints))]
    Cycle { joints: Vec<String> },
    /// More than one link without a parent.
    #[error("the links are not connected: {} have no parent joint, expected one base link", quoted(roots))]
    Disconnected { roots: Vec<String> },
    /// Unknown joint type.
    #[error("joint {joint:?}: unknown type {found:?}")]
    UnknownJointType { joint: String, found: String, closest: Option<String> },
    /// A URDF joint type that flexarm does not support.
    #[error("joint {joint:?} is of type {kind:?}, which is not supported")]
    UnsupportedJoint { joint: String, kind: String },
    /// A revolute or prismatic joint without limits.
    #[error("{kind} joint {joint:?} has no <limit>")]
    MissingLimit { joint: String, kind: &'static str },
    /// The lower limit is above the upper limit.
    #[error("joint {joint:?}: the lower limit {lower} is above the upper limit {upper}")]
    LimitsReversed { joint: String, lower: f64, upper: f64 },
    /// A negative velocity, effort, acceleration, deceleration or jerk limit.
    #[error("joint {joint:?}: the {attribute} limit {value} is negative")]
    NegativeLimit { joint: String, attribute: &'static str, value: f64 },
    /// The axis is the zero vector.
    #[error("joint {joint:?}: the axis is the zero vector")]
    ZeroAxis { joint: String },
    /// A mimic joint whose leader does not exist.
    #[error("joint {joint:?} mimics {leader:?}, which does not exist")]
    UnknownMimic { joint: String, leader: String, closest: Option<String> },
    /// A joint with several `<mimic>`, of which a URDF allows one.
    #[error("joint {joint:?} has {count} <mimic>; a joint follows one other joint")]
    SeveralMimics { joint: String, count: usize },
    /// Joints that mimic each other.
    #[error("the joints {} mimic each other in a circle", quoted(joints))]
    MimicCycle { joints: Vec<String> },
    /// Negative mass.
    #[error("link {link:?} has the mass {mass} kg, expected a positive one")]
    NegativeMass { link: String, mass: f64 },
    /// A moving body whose masses are all zero.
    #[error("link {link:?} is moved by joint {joint:?} and has no mass{}", lumped_text(lumped))]
    ZeroMass { link: String, joint: String, lumped: Vec<String> },
    /// A moving body without any `<inertial>`.
    #[error("link {link:?} is moved by joint {joint:?} and has no <inertial>{}", lumped_text(lumped))]
    MissingInertial { link: String, joint: String, lumped: Vec<String>, no_estimate: Option<String> },
    /// An inertia matrix that is not positive definite.
    #[error(
        "the inertia of link {link:?} is not positive definite: principal moments {} kg m^2",
        moments_text(moments)
    )]
    InertiaNotPositiveDefinite { link: String, moments: [f64; 3] },
    /// A principal moment above the sum of the other two.
    #[error(
        "the inertia of link {link:?} breaks the triangle inequality: principal moments {} kg m^2, the \
         largest is above the sum of the two others by {excess:.2e}",
        moments_text(moments)
    )]
    TriangleInequality { link: String, moments: [f64; 3], excess: f64 },
    /// A density or total mass for the estimate of inertias that is not positive.
    #[error("inertia from meshes was requested with {what} {value}, expected a positive number")]
    BadEstimate { what: &'static str, value: f64 },
}

impl Problem {
    /// Stable short name, used as the `code` of a [`Finding`].
    pub fn code(&self) -> &'static str {
        match self {
            Self::NotUtf8 { .. } => "not-utf8",
            Self::Malformed { .. } => "malformed-xml",
            Self::NotUrdf { .. } => "not-urdf",
            Self::NotRead { .. } => "not-read",
            Self::NoLink { .. } => "no-link",
            Self::TooManyElements { .. } => "too-many-elements",
            Self::MissingElement { .. } => "missing-element",
            Self::MissingAttribute { .. } => "missing-attribute",
            Self::NotANumber { .. } => "not-a-number",
            Self::DuplicateLink { .. } => "duplicate-link",
            Self::DuplicateJoint { .. } => "duplicate-joint",
            Self::UnknownLink { .. } => "unknown-link",
            Self::TwoParents { .. } => "two-parents",
            Self::Cycle { .. } => "cycle",
            Self::Disconnected { .. } => "disconnected",
            Self::UnknownJointType { .. } => "unknown-joint-type",
            Self::UnsupportedJoint { .. } => "unsupported-joint",
            Self::MissingLimit { .. } => "missing-limit",
            Self::LimitsReversed { .. } => "limits-reversed",
            Self::NegativeLimit { .. } => "negative-limit",
            Self::ZeroAxis { .. } => "zero-axis",
            Self::UnknownMimic { .. } => "unknown-mimic",
            Self::SeveralMimics { .. } => "several-mimics",
            Self::MimicCycle { .. } => "mimic-cycle",
            Self::NegativeMass { .. } => "negative-mass",
            Self::ZeroMass { .. } => "zero-mass",
            Self::MissingInertial { .. } => "missing-inertial",
            Self::InertiaNotPositiveDefinite { .. } => "inertia-not-positive-definite",
            Self::TriangleInequality { .. } => "triangle-inequality",
            Self::BadEstimate { .. } => "bad-estimate",
        }
    }

    /// Remedy for the problem.
    pub fn help(&self) -> String {
        match self {
            Self::NotUtf8 { .. } => "save the file as UTF-8; is it a URDF at all?".into(),
            Self::Malformed { .. } => "is the file complete? Export or copy it again, or mend it here".into(),
            Self::NotUrdf { root } => instead_of_document(root).into(),
            Self::NotRead { .. } => "please report it with the file; do names hold unusual characters?".into(),
            Self::NoLink { idle_macros, .. } => add_links(idle_macros),
            Self::TooManyElements { .. } => {
                "is this one robot? Arms have some dozens of links: leave out what does not move with it".into()
            }
            Self::MissingElement { element, .. } => format!("add <{element} .../>"),
            Self::MissingAttribute { attribute, .. } => format!("add {attribute}=\"...\""),
            Self::NotANumber { .. } => "write plain decimal numbers such as 0.1 or -1.5e-3, separated by spaces".into(),
            Self::DuplicateLink { .. } | Self::DuplicateJoint { .. } => "rename or remove one of them".into(),
            Self::UnknownLink { closest, .. } | Self::UnknownMimic { closest, .. } => {
                did_you_mean(closest, "correct the name or define it")
            }
            Self::TwoParents { .. } => {
                "URDF describes trees: remove one of the joints; a closed loop is described with <mimic>".into()
            }
            Self::Cycle { .. } => "remove one of these joints or correct its parent".into(),
            Self::Disconnected { .. } => "add a (fixed) joint between the parts or remove the part not needed".into(),
            Self::UnknownJointType { closest, .. } => {
                did_you_mean(closest, "types are fixed, revolute, continuous and prismatic")
            }
            Self::UnsupportedJoint { kind, .. } => instead_of_joint(kind).into(),
            Self::MissingLimit { kind: "revolute", .. } => {
                "add <limit lower=\"..\" upper=\"..\" effort=\"..\" velocity=\"..\"/> or make the joint continuous"
                    .into()
            }
            Self::MissingLimit { .. } => "add <limit lower=\"..\" upper=\"..\" effort=\"..\" velocity=\"..\"/>".into(),
            Self::LimitsReversed { .. } => "exchange lower and upper; angles are in radians".into(),
            Self::NegativeLimit { .. } => "limits of speed and effort are magnitudes; 0 means unknown".into(),
            Self::ZeroAxis { .. } => "write the axis as a unit vector, such as xyz=\"0 0 1\"".into(),
            Self::SeveralMimics { .. } => {
                "keep one; a joint that depends on several is driven by a motion of its own or belongs to a [[loop]]"
                    .into()
            }
            Self::MimicCycle { .. } => "let one of them go without <mimic>".into(),
            Self::NegativeMass { .. } => "correct the sign; a counterweight has positive mass too".into(),
            Self::ZeroMass { .. } => {
                "give the link its mass and inertia: without them it needs no force to move, and nothing bends under it"
                    .into()
            }
            Self::MissingInertial { no_estimate, .. } => add_inertial(no_estimate.as_deref()),
            Self::InertiaNotPositiveDefinite { .. } => {
                "check signs, units (kg m^2) and that the values are about the centre of mass".into()
            }
            Self::TriangleInequality { .. } => {
                format!(
                    "check the order ixx ixy ixz iyy iyz izz and that the values are about the centre of mass; if the \
                     model means it, waive the check by {} LINK, or waive_inertia = [\"link\"] in the robot file",
                    Setting::WaiveInertia
                )
            }
            Self::BadEstimate { .. } => "give a density in kg/m^3 (steel 7850, aluminium 2700) or a mass in kg".into(),
        }
    }
}

fn did_you_mean(closest: &Option<String>, otherwise: &str) -> String {
    closest.as_ref().map_or_else(|| otherwise.into(), |name| format!("did you mean {name:?}?"))
}

fn instead_of_document(root: &str) -> &'static str {
    match root {
        "sdf" => "this is an SDF file; export the robot as URDF",
        "mujoco" => "this is an MJCF file; export the robot as URDF",
        "COLLADA" => "this is a mesh; give the URDF that refers to it",
        _ => "give a URDF file",
    }
}

fn instead_of_joint(kind: &str) -> &'static str {
    match kind {
        "floating" => {
            "the base is fixed here: make the joint fixed, or replace it by three prismatic and three revolute joints \
             in series"
        }
        "planar" => "replace it by two prismatic and one continuous joint in series",
        _ => "replace it by three revolute joints in series with links of small mass between",
    }
}

fn add_links(idle_macros: &[String]) -> String {
    if idle_macros.is_empty() {
        return "is the file complete? A robot needs at least one <link>".into();
    }
    let calls: Vec<_> = idle_macros.iter().take(3).map(|name| format!("<xacro:{name} .../>")).collect();
    format!("give the file that calls them, or one that includes this one and calls {}", calls.join(", "))
}

fn add_inertial(no_estimate: Option<&str>) -> String {
    match no_estimate {
        None => format!(
            "add <inertial> with mass and inertia, or have it estimated from the meshes ({} or {}, or such keys in the \
             robot file): without them the link needs no force to move, and nothing bends under it",
            Setting::InertiaFromDensity,
            Setting::InertiaFromTotalMass
        ),
        Some(why) => format!("add <inertial> with mass and inertia; it could not be estimated: {why}"),
    }
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|n| format!("{n:?}")).collect::<Vec<_>>().join(", ")
}

fn macros_text(idle: &[String]) -> &'static str {
    if idle.is_empty() { "" } else { ": the file defines macros and calls none" }
}

fn lumped_text(lumped: &[String]) -> String {
    if lumped.is_empty() {
        return String::new();
    }
    format!(", nor have the links fixed to it ({})", quoted(lumped))
}

fn moments_text(moments: &[f64; 3]) -> String {
    moments.map(|m| format!("{m:.6e}")).join(", ")
}
