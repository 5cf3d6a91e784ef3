//! What errors and caveats are made of: the settings that they speak of, as values that each face
//! names in its own words ([`Setting`]); the [`Caveat`], which compares a value with a yardstick;
//! whom an error is to blame on ([`Fault`]); ranges of physical quantities ([`Quantity`]); messages
//! of the reader of TOML without names of types ([`without_types`]); foreign text as each kind of
//! output may hold it ([`written`]).
//!
//! An error that says "try a smaller step" means a field of a struct to a Rust program, a keyword
//! argument to a Python one and a flag to somebody at a terminal. Errors and caveats therefore
//! carry a [`Setting`], and its name is asked for when the sentence is made. Without further words
//! the names are the library's own ([`Setting::key`]); a face that calls them otherwise says so
//! once, before anything else, with [`name_settings`]. Names are to a process what a language is:
//! all its messages, and the files that it writes for people, use the same.
//!
//! ```
//! use flexarm_settings::Setting;
//!
//! assert_eq!(format!("try a smaller {}", Setting::Step), "try a smaller step_s");
//! ```
//!
//! Not here: values, defaults and meaning of the settings, which are fields of the crate that each
//! belongs to; the kinds of caveats and their yardsticks, which are in the crates that find them.
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

pub mod caveat;
mod fault;
mod gathered;
mod quantity;
mod toml_message;
pub mod written;

use std::fmt;
use std::sync::OnceLock;

pub use caveat::Caveat;
pub use fault::Fault;
pub use gathered::gathered;
pub use quantity::{OutOfRange, Quantity};
pub use toml_message::without_types;

/// A setting that a message speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Setting {
    // Runs.
    /// Time step of a run (s).
    Step,
    /// Samples per second that a run records.
    LogRate,
    /// Which stepper integrates.
    Stepper,
    /// Relative tolerance of the reference stepper.
    Tolerance,
    /// Method of the reference stepper.
    ReferenceMethod,
    /// How a run starts: in equilibrium or undeformed.
    Start,
    /// How flexible links are modelled.
    Links,
    /// Factor by which deflections are drawn.
    Magnification,
    /// Band around the error at rest in which the tool counts as settled (m).
    SettlingBand,
    /// Run although joint limits are passed.
    IgnoreLimits,
    /// Time within which corners of a motion are rounded (s).
    RoundCorners,
    /// One run of a study.
    Variant,

    // Results.
    /// Folder or file of the results.
    Output,
    /// Replace files that are there.
    Overwrite,
    /// Format of a recording that is read.
    ReadFormat,
    /// Format of a recording that is written.
    WrittenFormat,

    // Motions.
    /// The topic of a bag that holds the motion.
    Topic,
    /// Which columns of a table are time and joints.
    Columns,
    /// Rows per second of a motion that is written.
    Rate,

    // Robots.
    /// The frame whose motion is looked at.
    Tcp,
    /// Folder of a ROS package.
    Package,
    /// Value of a xacro argument.
    Argument,
    /// Density from which missing inertias are estimated.
    InertiaFromDensity,
    /// Total mass from which missing inertias are estimated.
    InertiaFromTotalMass,
    /// Links whose inertia is not checked.
    WaiveInertia,

    // Robot files that are made of a description.
    /// The link at which an arm begins.
    Base,
    /// The link that is an arm's tool.
    Tool,
    /// The joints of an arm.
    Joints,
    /// Mass of the payload (kg).
    Payload,

    // Modes and frequency responses.
    /// How long each mode swings in a recording (s).
    Seconds,
    /// How far the tool swings in a recording of modes (m).
    ToolMotion,
    /// Lowest frequency of a response (Hz).
    LowestFrequency,
    /// Highest frequency of a response (Hz).
    HighestFrequency,
    /// Frequencies of a response.
    Points,
    /// How the frequencies of a response are spread.
    Spacing,

    // Maps.
    /// Box of places (m).
    Bounds,
    /// Distance of places (m).
    GridSpacing,
    /// Where the tool points.
    ToolAxis,
    /// Joints that a map goes through.
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
    /// List what is in a mesh.
    List,
    /// Robot that a link belongs to.
    Urdf,
    /// Link of that robot.
    Link,
    /// Joint at the distal end of that link.
    Joint,
    /// How many modes are kept.
    Modes,
    /// Frequency up to which modes are kept (Hz).
    ModesUpTo,
    /// Numbers of parts of the chains that are made.
    Chains,
    /// Stiffness by load is computed.
    Geometric,
    /// Rows or nodes of the interfaces in matrices.
    Map,
    /// File of the mass matrix.
    MassFile,
    /// Format of matrices that is expected.
    MatrixFormat,
    /// Numbers of the nodes that are written.
    Nodes,
    /// Rigid part at the proximal end.
    PartA,
    /// Rigid part at the distal end.
    PartB,

    // Case studies.
    /// Folder with the data of the case studies.
    Data,
}

impl Setting {
    /// Every setting.
    pub const ALL: [Self; 59] = [
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
        Self::Data,
    ];

    /// Its name in the library: a field, a function or a key of a file.
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
            Self::Data => "root",
        }
    }
}

impl fmt::Display for Setting {
    /// Its name in the words of the face, else [`Setting::key`].
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES.get().map_or_else(|| self.key(), |names| (names.setting)(*self)))
    }
}

/// Where the settings of a call come from: "the call" in the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Caller;

impl fmt::Display for Caller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES.get().map_or("the call", |names| names.caller))
    }
}

/// What a face calls the settings, and itself.
#[derive(Clone, Copy, Debug)]
pub struct Names {
    /// The name of each setting.
    pub setting: fn(Setting) -> &'static str,
    /// Where settings come from, such as "the keyword arguments".
    pub caller: &'static str,
}

static NAMES: OnceLock<Names> = OnceLock::new();

/// Names the settings in all messages of this process from now on. The first call counts; whether
/// this is it.
pub fn name_settings(names: Names) -> bool {
    NAMES.set(names).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_has_a_name_in_the_library_and_is_listed_once() {
        for (k, setting) in Setting::ALL.into_iter().enumerate() {
            let key = setting.key();
            assert!(!key.is_empty() && key.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{setting:?}: {key}");
            assert_eq!(Setting::ALL.iter().position(|other| *other == setting), Some(k), "{setting:?}");
        }
    }
}
