//! Names of the library's settings on the command line.
//!
//! Messages of the library name a setting; each interface has such a table. Not here: parsing
//! (`args.rs`).

use flexarm::settings::{Names, Setting};

/// The flags, used in all messages of this process.
pub(crate) const NAMES: Names = Names { setting: flag, caller: "the command line" };

/// Returns the flag of a setting.
pub fn flag(setting: Setting) -> &'static str {
    match setting {
        Setting::Step => "--step",
        Setting::LogRate => "--log-rate",
        Setting::Stepper => "--stepper",
        Setting::Tolerance => "--rtol",
        Setting::ReferenceMethod => "--reference-method",
        Setting::Start => "--from-rest",
        Setting::Links => "--links",
        Setting::Magnification => "--magnify",
        Setting::IgnoreLimits => "--ignore-limits",
        Setting::RoundCorners => "--round-corners",
        Setting::SettlingBand => "--settling-band",
        Setting::Variant => "--with",
        Setting::Output => "-o",
        Setting::Overwrite => "--force",
        Setting::Topic => "--topic",
        Setting::Columns => "--columns",
        Setting::Rate => "--rate",
        Setting::Tcp => "--tcp",
        Setting::Package => "--package",
        Setting::Argument => "--arg",
        Setting::InertiaFromDensity => "--inertia-from-density",
        Setting::InertiaFromTotalMass => "--inertia-from-total-mass",
        Setting::WaiveInertia => "--waive-inertia",
        Setting::Base => "--base",
        Setting::Tool => "--tool",
        Setting::Joints => "--joints",
        Setting::Payload => "--payload",
        Setting::Seconds => "--seconds",
        Setting::ToolMotion => "--tool-motion",
        Setting::ReadFormat | Setting::LowestFrequency => "--from",
        Setting::WrittenFormat | Setting::HighestFrequency => "--to",
        Setting::Points => "--points",
        Setting::Spacing => "--spacing",
        Setting::Bounds => "--box",
        Setting::GridSpacing => "--grid",
        Setting::ToolAxis => "--tool-axis",
        Setting::MapJoints => "--over",
        Setting::Units => "--units",
        Setting::Name => "--name",
        Setting::Interface => "--interface",
        Setting::At => "--at",
        Setting::Material => "--material",
        Setting::List => "--list",
        Setting::Urdf => "--urdf",
        Setting::Link => "--link",
        Setting::Joint => "--joint",
        Setting::Modes => "--modes",
        Setting::ModesUpTo => "--modes-up-to",
        Setting::Chains => "--chains",
        Setting::Geometric => "--geometric",
        Setting::Map => "--map",
        Setting::MassFile => "--mass-file",
        Setting::MatrixFormat => "--format",
        Setting::Nodes => "--nodes",
        Setting::PartA => "--part-a",
        Setting::PartB => "--part-b",
    }
}
