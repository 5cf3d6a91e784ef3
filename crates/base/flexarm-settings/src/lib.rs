//! Building blocks of errors and caveats: settings named in messages, which each front end names in
//! its own way ([`Setting`]); the [`Caveat`], which compares a value with a reference; the party
//! responsible for an error ([`Fault`]); ranges of physical quantities ([`Quantity`]); choices by a
//! word ([`Words`]); TOML messages without type names ([`without_types`]); escaping of foreign text
//! for each kind of output ([`written`]).
//!
//! "Try a smaller step" refers to a struct field in Rust, to a keyword argument in Python and to a
//! flag on the command line. Errors and caveats therefore carry a [`Setting`], whose name is looked
//! up when the message is formatted. The default names are those of the library ([`Setting::key`]);
//! a front end with other names sets them once at start with [`name_settings`]. The names are
//! global to the process: all its messages, and the files it writes for people, use the same.
//!
//! ```
//! use flexarm_settings::Setting;
//!
//! assert_eq!(format!("try a smaller {}", Setting::Step), "try a smaller step_s");
//! ```
//!
//! Not here: values, defaults and meaning of the settings, which are fields of the crate they
//! belong to; the kinds of caveats and their references, which are in the crates that find them.

pub mod caveat;
mod fault;
mod gathered;
mod quantity;
mod spelling;
mod toml_message;
mod words;
pub mod written;

use std::fmt;
use std::sync::OnceLock;

pub use caveat::Caveat;
pub use fault::Fault;
pub use gathered::gathered;
pub use quantity::{OutOfRange, Quantity};
pub use spelling::{closest, known_names};
pub use toml_message::without_types;
pub use words::Words;

/// Setting named in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Setting {
    // Runs.
    /// Time step of a run (s).
    Step,
    /// Samples per second that a run records.
    LogRate,
    /// Time stepper.
    Stepper,
    /// Relative tolerance of the reference stepper.
    Tolerance,
    /// Method of the reference stepper.
    ReferenceMethod,
    /// Initial state of a run: equilibrium or undeformed.
    Start,
    /// Model of flexible links.
    Links,
    /// Factor by which drawn deflections are magnified.
    Magnification,
    /// Band around the static error within which the tool counts as settled (m).
    SettlingBand,
    /// Whether to run although joint limits are exceeded.
    IgnoreLimits,
    /// Time within which corners of a motion are rounded (s).
    RoundCorners,
    /// One run of a study.
    Variant,

    // Results.
    /// Folder or file for the results.
    Output,
    /// Whether to replace existing files.
    Overwrite,
    /// Format of a recording to read.
    ReadFormat,
    /// Format of a recording to write.
    WrittenFormat,

    // Motions.
    /// Topic of a bag that holds the motion.
    Topic,
    /// Columns of a table used for time and joints.
    Columns,
    /// Rows per second of a written motion.
    Rate,

    // Robots.
    /// Frame whose motion is evaluated.
    Tcp,
    /// Folder of a ROS package.
    Package,
    /// Value of a xacro argument.
    Argument,
    /// Density for the estimation of missing inertias.
    InertiaFromDensity,
    /// Total mass for the estimation of missing inertias.
    InertiaFromTotalMass,
    /// Links whose inertia is not checked.
    WaiveInertia,

    // Robot files made from a description.
    /// First link of an arm.
    Base,
    /// Tool link of an arm.
    Tool,
    /// Joints of an arm.
    Joints,
    /// Mass of the payload (kg).
    Payload,

    // Modes and frequency responses.
    /// Duration of the oscillation of each mode in a recording (s).
    Seconds,
    /// Amplitude of the tool in a recording of modes (m).
    ToolMotion,
    /// Minimum frequency of a response (Hz).
    LowestFrequency,
    /// Maximum frequency of a response (Hz).
    HighestFrequency,
    /// Number of frequencies of a response.
    Points,
    /// Spacing of the frequencies of a response.
    Spacing,

    // Maps.
    /// Box of positions (m).
    Bounds,
    /// Spacing of positions (m).
    GridSpacing,
    /// Direction of the tool.
    ToolAxis,
    /// Joints covered by a map.
    MapJoints,

    // Links from meshes and matrices.
    /// Units of a mesh or of matrices.
    Units,
    /// Name of a link.
    Name,
    /// Nodes of an interface.
    Interface,
    /// Frame of an interface.
    At,
    /// Material of a mesh or of a region of it.
    Material,
    /// Whether to list the contents of a mesh.
    List,
    /// Robot to which a link belongs.
    Urdf,
    /// Link of that robot.
    Link,
    /// Joint at the distal end of that link.
    Joint,
    /// Number of modes to keep.
    Modes,
    /// Frequency up to which modes are kept (Hz).
    ModesUpTo,
    /// Numbers of parts of the chains to make.
    Chains,
    /// Whether to compute the geometric stiffness.
    Geometric,
    /// Rows or nodes of the interfaces in matrices.
    Map,
    /// File of the mass matrix.
    MassFile,
    /// Expected format of matrices.
    MatrixFormat,
    /// Node numbers to write.
    Nodes,
    /// Rigid part at the proximal end.
    PartA,
    /// Rigid part at the distal end.
    PartB,
}

impl Setting {
    /// All settings.
    pub const ALL: [Self; 58] = [
        Self::Step,
        Self::LogRate,
        Self::Stepper,
        Self::Tolerance,
        Self::ReferenceMethod,
        Self::Start,
        Self::Links,
        Self::Magnification,
        Self::SettlingBand,
        Self::IgnoreLimits,
        Self::RoundCorners,
        Self::Variant,
        Self::Output,
        Self::Overwrite,
        Self::ReadFormat,
        Self::WrittenFormat,
        Self::Topic,
        Self::Columns,
        Self::Rate,
        Self::Tcp,
        Self::Package,
        Self::Argument,
        Self::InertiaFromDensity,
        Self::InertiaFromTotalMass,
        Self::WaiveInertia,
        Self::Base,
        Self::Tool,
        Self::Joints,
        Self::Payload,
        Self::Seconds,
        Self::ToolMotion,
        Self::LowestFrequency,
        Self::HighestFrequency,
        Self::Points,
        Self::Spacing,
        Self::Bounds,
        Self::GridSpacing,
        Self::ToolAxis,
        Self::MapJoints,
        Self::Units,
        Self::Name,
        Self::Interface,
        Self::At,
        Self::Material,
        Self::List,
        Self::Urdf,
        Self::Link,
        Self::Joint,
        Self::Modes,
        Self::ModesUpTo,
        Self::Chains,
        Self::Geometric,
        Self::Map,
        Self::MassFile,
        Self::MatrixFormat,
        Self::Nodes,
        Self::PartA,
        Self::PartB,
    ];

    /// Name in the library: a field, a function or a key of a file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Step => "step_s",
            Self::LogRate => "log_rate_hz",
            Self::Stepper => "stepper",
            Self::Tolerance => "rtol",
            Self::ReferenceMethod => "method",
            Self::Start => "start",
            Self::Links => "links",
            Self::Magnification => "magnification",
            Self::SettlingBand => "settling_band_m",
            Self::IgnoreLimits => "ignore_limits",
            Self::RoundCorners => "with_rounded_corners",
            Self::Variant => "variants",
            Self::Output => "output",
            Self::Overwrite => "overwrite",
            Self::ReadFormat => "from",
            Self::WrittenFormat => "to",
            Self::Topic => "topic",
            Self::Columns => "columns",
            Self::Rate => "rate_hz",
            Self::Tcp => "tcp",
            Self::Package => "packages",
            Self::Argument => "arguments",
            Self::InertiaFromDensity => "inertia_from_density",
            Self::InertiaFromTotalMass => "inertia_from_total_mass",
            Self::WaiveInertia => "waive",
            Self::Base => "base",
            Self::Tool => "tool",
            Self::Joints => "joints",
            Self::Payload => "payload_kg",
            Self::Seconds => "seconds",
            Self::ToolMotion => "tool_motion_m",
            Self::LowestFrequency => "from_hz",
            Self::HighestFrequency => "to_hz",
            Self::Points => "points",
            Self::Spacing => "spacing",
            Self::Bounds => "bounds",
            Self::GridSpacing => "spacing_m",
            Self::ToolAxis => "axis",
            Self::MapJoints => "joints_region",
            Self::Units => "units",
            Self::Name => "name",
            Self::Interface => "interface",
            Self::At => "at",
            Self::Material => "material",
            Self::List => "list_mesh",
            Self::Urdf => "urdf",
            Self::Link => "link",
            Self::Joint => "joint",
            Self::Modes => "modes",
            Self::ModesUpTo => "modes_up_to_hz",
            Self::Chains => "chains",
            Self::Geometric => "geometric",
            Self::Map => "map",
            Self::MassFile => "mass_file",
            Self::MatrixFormat => "format",
            Self::Nodes => "nodes",
            Self::PartA => "part_a",
            Self::PartB => "part_b",
        }
    }
}

impl fmt::Display for Setting {
    /// Writes the name set by the front end, otherwise [`Setting::key`].
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES.get().map_or_else(|| self.key(), |names| (names.setting)(*self)))
    }
}

/// Source of the settings of a call: "the call" in the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Caller;

impl fmt::Display for Caller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES.get().map_or("the call", |names| names.caller))
    }
}

/// Names that a front end uses for the settings and for their source.
#[derive(Clone, Copy, Debug)]
pub struct Names {
    /// Name of each setting.
    pub setting: fn(Setting) -> &'static str,
    /// Source of settings, such as "the keyword arguments".
    pub caller: &'static str,
}

static NAMES: OnceLock<Names> = OnceLock::new();

/// Sets the names of settings for all further messages of this process. Only the first call has an
/// effect; returns whether this was the first.
pub fn name_settings(names: Names) -> bool {
    NAMES.set(names).is_ok()
}

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::written::{LONGEST_LINE, is_hidden};
}
