//! Building blocks of errors and caveats: settings named in messages, which each front end names in
//! its own way ([`Setting`]); what is found in an input or a result ([`Finding`]) and where in a
//! file ([`Place`]); the party responsible for an error ([`Fault`]); ranges of physical quantities
//! ([`Quantity`]); choices by a word ([`Words`]); lists that are not longer than their types
//! ([`exact`]); TOML messages without type names ([`without_types`]); escaping of foreign text for
//! each kind of output ([`written`]).
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
//! belong to; the kinds of findings and their references, which are in the crates that find them.

mod exact;
mod fault;
pub mod finding;
mod gathered;
mod place;
mod quantity;
mod spelling;
mod toml_message;
mod words;
pub mod written;

use std::fmt;
use std::sync::OnceLock;

pub use exact::exact;
pub use fault::Fault;
pub use finding::{Finding, Severity};
pub use gathered::gathered;
pub use place::Place;
pub use quantity::{OutOfRange, Quantity};
pub use spelling::{closest, known_names, listed};
pub use toml_message::without_types;
pub use words::Words;

/// Makes the enum, the list of its values and their keys of one table.
macro_rules! settings {
    ($($(#[$doc:meta])* $setting:ident = $key:literal,)*) => {
        /// Setting named in a message.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Setting {
            $($(#[$doc])* $setting,)*
        }

        impl Setting {
            /// All settings.
            pub const ALL: &[Self] = &[$(Self::$setting),*];

            /// Name in the library: a field, a function or a key of a file.
            pub fn key(self) -> &'static str {
                match self {
                    $(Self::$setting => $key,)*
                }
            }
        }
    };
}

settings! {
    // Runs.
    /// Time step of a run (s).
    Step = "step_s",
    /// Samples per second that a run records.
    LogRate = "log_rate_hz",
    /// Time stepper.
    Stepper = "stepper",
    /// Relative tolerance of the reference stepper.
    Tolerance = "rtol",
    /// Method of the reference stepper.
    ReferenceMethod = "method",
    /// Initial state of a run: equilibrium or undeformed.
    Start = "start",
    /// Model of flexible links.
    Links = "links",
    /// Factor by which drawn deflections are magnified.
    Magnification = "magnification",
    /// Band around the static error within which the tool counts as settled (m).
    SettlingBand = "settling_band_m",
    /// Whether to run although joint limits are exceeded.
    IgnoreLimits = "ignore_limits",
    /// Time within which corners of a motion are rounded (s).
    RoundCorners = "with_rounded_corners",
    /// One run of a study.
    Variant = "variants",

    // Results.
    /// Folder or file for the results.
    Output = "output",
    /// Whether to replace existing files.
    Overwrite = "overwrite",
    /// Format of a recording to read.
    ReadFormat = "from",
    /// Format of a recording to write.
    WrittenFormat = "to",

    // Motions.
    /// Topic of a bag that holds the motion.
    Topic = "topic",
    /// Columns of a table used for time and joints.
    Columns = "columns",
    /// Rows per second of a written motion.
    Rate = "rate_hz",

    // Robots.
    /// Frame whose motion is evaluated.
    Tcp = "tcp",
    /// Folder of a ROS package.
    Package = "packages",
    /// Value of a xacro argument.
    Argument = "arguments",
    /// Density for the estimation of missing inertias.
    InertiaFromDensity = "inertia_from_density",
    /// Total mass for the estimation of missing inertias.
    InertiaFromTotalMass = "inertia_from_total_mass",
    /// Links whose inertia is not checked.
    WaiveInertia = "waive",

    // Robot files made from a description.
    /// First link of an arm.
    Base = "base",
    /// Tool link of an arm.
    Tool = "tool",
    /// Joints of an arm.
    Joints = "joints",
    /// Mass of the payload (kg).
    Payload = "payload_kg",

    // Modes and frequency responses.
    /// Duration of the oscillation of each mode in a recording (s).
    Seconds = "seconds",
    /// Amplitude of the tool in a recording of modes (m).
    ToolMotion = "tool_motion_m",
    /// Minimum frequency of a response (Hz).
    LowestFrequency = "from_hz",
    /// Maximum frequency of a response (Hz).
    HighestFrequency = "to_hz",
    /// Number of frequencies of a response.
    Points = "points",
    /// Spacing of the frequencies of a response.
    Spacing = "spacing",

    // Maps.
    /// Box of positions (m).
    Bounds = "bounds",
    /// Spacing of positions (m).
    GridSpacing = "spacing_m",
    /// Direction of the tool.
    ToolAxis = "axis",
    /// Joints covered by a map.
    MapJoints = "joints_region",

    // Links from meshes and matrices.
    /// Units of a mesh or of matrices.
    Units = "units",
    /// Name of a link.
    Name = "name",
    /// Nodes of an interface.
    Interface = "interface",
    /// Frame of an interface.
    At = "at",
    /// Material of a mesh or of a region of it.
    Material = "material",
    /// Whether to list the contents of a mesh.
    List = "list_mesh",
    /// Robot to which a link belongs.
    Urdf = "urdf",
    /// Link of that robot.
    Link = "link",
    /// Joint at the distal end of that link.
    Joint = "joint",
    /// Number of modes to keep.
    Modes = "modes",
    /// Frequency up to which modes are kept (Hz).
    ModesUpTo = "modes_up_to_hz",
    /// Numbers of parts of the chains to make.
    Chains = "chains",
    /// Whether to compute the geometric stiffness.
    Geometric = "geometric",
    /// Rows or nodes of the interfaces in matrices.
    Map = "map",
    /// File of the mass matrix.
    MassFile = "mass_file",
    /// Expected format of matrices.
    MatrixFormat = "format",
    /// Node numbers to write.
    Nodes = "nodes",
    /// Rigid part at the proximal end.
    PartA = "part_a",
    /// Rigid part at the distal end.
    PartB = "part_b",
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
