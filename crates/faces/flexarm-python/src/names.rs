//! Names of the library's settings in Python: keyword arguments.

use flexarm::settings::{Names, Setting};

/// The names, used in all messages of this process.
pub(crate) const NAMES: Names = Names { setting: keyword, caller: "the keyword arguments" };

fn keyword(setting: Setting) -> &'static str {
    match setting {
        Setting::Step => "step",
        Setting::LogRate => "log_rate",
        Setting::Stepper => "stepper",
        Setting::Tolerance => "stepper_options={\"rtol\": ...}",
        Setting::ReferenceMethod => "stepper_options={\"method\": ...}",
        Setting::SettlingBand => "settling_band",
        Setting::RoundCorners => "round_corners",
        Setting::Magnification => "magnify",
        Setting::Variant => "runs",
        Setting::ReadFormat => "from_format",
        Setting::WrittenFormat => "to_format",
        Setting::Rate => "rate",
        Setting::WaiveInertia => "waive_inertia",
        Setting::Payload => "payload",
        Setting::LowestFrequency => "from_hz",
        Setting::HighestFrequency => "to_hz",
        Setting::ModesUpTo => "modes_up_to_hz",
        Setting::GridSpacing => "spacing",
        Setting::ToolAxis => "tool_axis",
        Setting::MapJoints => "joints",
        // The other names are the same as in the library.
        other => other.key(),
    }
}
