//! Numbers of options that make no sense, each with the number and what is expected.

use flexarm_settings::Setting;

/// A number of a run, a response, a reduction or an export that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// The step, which must be positive.
    #[error("the step must be positive, found {0} s")]
    Step(f64),
    /// The log rate, which must be positive.
    #[error("the log rate must be positive, found {0} Hz")]
    LogRate(f64),
    /// The settling band, which must be positive.
    #[error("the settling band must be positive, found {0} m")]
    SettlingBand(f64),
    /// The factor of deflections, which must be positive.
    #[error("the factor of deflections ({setting}) must be positive, found {0} times", setting = Setting::Magnification)]
    Magnification(f64),
    /// A factor of deflections that no picture can have.
    #[error(
        "the factor of deflections ({}) is {found:e}: expected one from {least} to {most}, 1 shows them as they are",
        Setting::Magnification
    )]
    MagnificationRange {
        /// The factor.
        found: f64,
        /// Smallest one.
        least: f64,
        /// Largest one.
        most: f64,
    },
    /// A motion that ends within the first step.
    #[error("the step ({} {step_s} s) is longer than the motion ({duration_s} s)", Setting::Step)]
    StepBeyondMotion {
        /// Step (s).
        step_s: f64,
        /// Duration of the motion (s).
        duration_s: f64,
    },
    /// A run that would not come to an end.
    #[error(
        "{duration_s} s in steps of {step_s:e} s make {:.1e} steps, at most {most:.0e} are taken: raise {} or cut the \
         trajectory",
        duration_s / step_s,
        Setting::Step
    )]
    TooManySteps {
        /// Step (s).
        step_s: f64,
        /// Duration of the motion (s).
        duration_s: f64,
        /// Most steps of a run.
        most: f64,
    },
    /// The time within which corners are rounded, which must be positive.
    #[error("corners are rounded within a positive time, found {0} s: try 0.02")]
    CornerTime(f64),
    /// How long a mode swings in a recording, which must be positive and below 1000 s.
    #[error("{setting} must be positive and below 1000, found {0} s", setting = Setting::Seconds)]
    Seconds(f64),
    /// How far the tool swings in a recording of modes, which must be positive and below 1000 m.
    #[error("{setting} must be positive and below 1000, found {0} m", setting = Setting::ToolMotion)]
    ToolMotion(f64),
    /// Points of a response.
    #[error("{} must lie between {least} and {most}, found {found}", Setting::Points)]
    Points {
        /// Points asked for.
        found: usize,
        /// Fewest.
        least: usize,
        /// Most.
        most: usize,
    },
    /// The lowest frequency of a response, which must not be negative, and not zero on a logarithmic axis.
    #[error("{} must be {}, found {found} Hz", Setting::LowestFrequency, lowest(*logarithmic))]
    LowestFrequency {
        /// The frequency (Hz).
        found: f64,
        /// Whether the axis is logarithmic.
        logarithmic: bool,
    },
    /// The highest frequency of a response.
    #[error(
        "{} must lie above {} ({lowest} Hz) and below 1e6 Hz, found {found} Hz",
        Setting::HighestFrequency,
        Setting::LowestFrequency
    )]
    HighestFrequency {
        /// The frequency (Hz).
        found: f64,
        /// The lowest frequency (Hz).
        lowest: f64,
    },
    /// Modes of a reduction by number and by frequency.
    #[error("modes and modes_up_to_hz exclude each other: give one of them")]
    ModesTwice,
    /// More modes than a reduction keeps.
    #[error("{} {found}: at most {most} can be kept", Setting::Modes)]
    TooManyModes {
        /// Modes asked for.
        found: usize,
        /// Most.
        most: usize,
    },
    /// The frequency up to which modes are kept, which must be positive.
    #[error("{setting} {0}: a positive frequency in Hz is expected", setting = Setting::ModesUpTo)]
    ModesUpTo(f64),
    /// Parts of a chain.
    #[error("{setting} {0}: a chain has 2 to 100 parts", setting = Setting::Chains)]
    ChainParts(usize),
    /// Threads of a factorisation.
    #[error("{setting} {0}: 1 to 1024 are possible", setting = Setting::Threads)]
    Threads(usize),
    /// Distance within which nodes are merged, in the unit of the mesh.
    #[error("merge = {0}: a distance of zero or more, in the unit of the mesh")]
    MergeDistance(f64),
    /// A name that cannot be part of a file name.
    #[error("{0:?} is no name for a link: give one that can be part of a file name ({setting})", setting = Setting::Name)]
    LinkName(String),
    /// Numbers of the nodes of an export.
    #[error(
        "{} has {found:?}; {interfaces} different numbers between 1 and 99999999 are needed, one per interface, proximal \
         first",
        Setting::Nodes
    )]
    NodeNumbers {
        /// The numbers.
        found: Vec<i64>,
        /// How many interfaces there are.
        interfaces: usize,
    },
}

fn lowest(logarithmic: bool) -> String {
    if logarithmic { format!("positive (0 needs {} linear)", Setting::Spacing) } else { "positive or zero".into() }
}
