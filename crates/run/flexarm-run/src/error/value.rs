//! Numbers of options that make no sense, each with the number and what is expected.

use flexarm_settings::{OutOfRange, Setting};

/// A number of a run or a response that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// The step, which must be positive.
    #[error("{setting}: the step must be positive, found {0} s", setting = Setting::Step)]
    Step(f64),
    /// A number that is none.
    #[error("{what} has the entry {found}, expected finite numbers")]
    NotFinite {
        /// Quantity.
        what: &'static str,
        /// The entry.
        found: f64,
    },
    /// A number of a size that no robot has.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The log rate, which must be positive.
    #[error("{setting}: the log rate must be positive, found {0} Hz", setting = Setting::LogRate)]
    LogRate(f64),
    /// The settling band, which must be positive.
    #[error("{setting}: the settling band must be positive, found {0} m", setting = Setting::SettlingBand)]
    SettlingBand(f64),
    /// The factor of deflections, which must be positive.
    #[error("the factor of deflections ({setting}) must be positive, found {0} times", setting = Setting::Magnification)]
    Magnification(f64),
    /// The factor of a parameter, which must be positive.
    #[error("the factor of the {what} must be positive, found {found}")]
    Factor {
        /// Parameter.
        what: &'static str,
        /// The factor.
        found: f64,
    },
    /// A factor of deflections that no picture can have.
    #[error(
        "the factor of deflections ({}) is {found:e}: expected one from {least} to {most}, 1 shows them as they are",
        Setting::Magnification
    )]
    MagnificationRange {
        /// The factor.
        found: f64,
        /// Minimum.
        least: f64,
        /// Maximum.
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
    /// A control period that is no whole number of steps.
    #[error("a control period of {period_s} s is not a whole number of steps ({} {step_s} s)", Setting::Step)]
    Period {
        /// Period (s).
        period_s: f64,
        /// Step (s).
        step_s: f64,
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
        /// Maximum number of steps of a run.
        most: f64,
    },
    /// The time within which corners are rounded, which must be positive.
    #[error("corners are rounded within a positive time, found {0} s: try 0.02")]
    CornerTime(f64),
    /// Duration of a mode in a recording; must be positive and below 1000 s.
    #[error("{setting} must be positive and below 1000, found {0} s", setting = Setting::Seconds)]
    Seconds(f64),
    /// Amplitude of the TCP in a recording of modes; must be positive and below 1000 m.
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
    /// The lowest frequency of a response, which must not be negative, and not zero on a
    /// logarithmic axis.
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
    /// A rigid robot, whose tool has no error that could depend on anything.
    #[error(
        "the robot has no flexible link and no elastic drive: its tool is where the rigid arm has it, and nothing changes that; add \
         [[flexible_link]] or [[drive]] entries"
    )]
    NothingYields,
    /// A name of which no number of the robot is called.
    #[error(
        "no parameter is called {pattern:?}: expected some of {}, * for anything; an entry of a lumped link's 6x6 is \
         link.LINK.stiffness[i][j], i and j from 0 to 5",
        names.join(", ")
    )]
    NoParameter {
        /// The name or pattern.
        pattern: String,
        /// Available names.
        names: Vec<String>,
    },
}

fn lowest(logarithmic: bool) -> String {
    if logarithmic { format!("positive (0 needs {} linear)", Setting::Spacing) } else { "positive or zero".into() }
}
