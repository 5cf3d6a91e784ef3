//! Errors about invalid option values, each with the value and what is expected.

use flexarm_settings::{OutOfRange, Setting};

/// An invalid value of an option.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// The step size is not positive.
    #[error("{setting}: the step must be positive, found {0} s", setting = Setting::Step)]
    Step(f64),
    /// A value is not finite.
    #[error("{what} has the entry {found}, expected finite numbers")]
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
        /// Invalid value.
        found: f64,
    },
    /// A value is outside the range of plausible robots.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A part of the arm has no counterpart in formats of other simulators.
    #[error("{name:?} is {what}, which cannot be exported")]
    NotExportable {
        /// Name of the part.
        name: String,
        /// Kind of the part.
        what: &'static str,
    },
    /// There is no payload that can be put down.
    #[error("this arm has no payload that can be put down: give its robot file a [payload] on a rigid link")]
    NoPayload,
    /// The log rate is not positive.
    #[error("{setting}: the log rate must be positive, found {0} Hz", setting = Setting::LogRate)]
    LogRate(f64),
    /// The settling band is not positive.
    #[error("{setting}: the settling band must be positive, found {0} m", setting = Setting::SettlingBand)]
    SettlingBand(f64),
    /// The magnification of deflections is not positive.
    #[error("the factor of deflections ({setting}) must be positive, found {0} times", setting = Setting::Magnification)]
    Magnification(f64),
    /// The factor of a parameter is not positive.
    #[error("the factor of the {what} must be positive, found {found}")]
    Factor {
        /// Name of the parameter.
        what: &'static str,
        /// Given factor.
        found: f64,
    },
    /// The magnification of deflections is outside the displayable range.
    #[error(
        "the factor of deflections ({}) is {found:e}: expected one from {least} to {most}, 1 shows them as they are",
        Setting::Magnification
    )]
    MagnificationRange {
        /// Given factor.
        found: f64,
        /// Minimum.
        least: f64,
        /// Maximum.
        most: f64,
    },
    /// The motion ends within the first step.
    #[error("the step ({} {step_s} s) is longer than the motion ({duration_s} s)", Setting::Step)]
    StepBeyondMotion {
        /// Step size (s).
        step_s: f64,
        /// Duration of the motion (s).
        duration_s: f64,
    },
    /// The control period is not a whole number of steps.
    #[error("a control period of {period_s} s is not a whole number of steps ({} {step_s} s)", Setting::Step)]
    Period {
        /// Period (s).
        period_s: f64,
        /// Step size (s).
        step_s: f64,
    },
    /// Open servos are asked of an arm without servos.
    #[error("open servos need joints that are driven by torque: model the drives as servos")]
    NoServo,
    /// A stepper with step size control is asked of an arm that is commanded while it moves.
    #[error("the stepper {0} runs ahead of the commands; use one with a fixed step size")]
    RunsAhead(&'static str),
    /// A state belongs to another arm.
    #[error("the state belongs to another arm; a state returns only to the arm from which it was taken")]
    OtherState,
    /// The run would take too many steps.
    #[error(
        "{duration_s} s in steps of {step_s:e} s make {:.1e} steps, at most {most:.0e} are taken: raise {} or cut the \
         trajectory",
        duration_s / step_s,
        Setting::Step
    )]
    TooManySteps {
        /// Step size (s).
        step_s: f64,
        /// Duration of the motion (s).
        duration_s: f64,
        /// Maximum number of steps.
        most: f64,
    },
    /// The blend time of rounded corners is not positive.
    #[error("corners are rounded within a positive time, found {0} s: try 0.02")]
    CornerTime(f64),
    /// The duration of each mode in a recording is not positive and below 1000 s.
    #[error("{setting} must be positive and below 1000, found {0} s", setting = Setting::Seconds)]
    Seconds(f64),
    /// The TCP amplitude in a recording of modes is not positive and below 1000 m.
    #[error("{setting} must be positive and below 1000, found {0} m", setting = Setting::ToolMotion)]
    ToolMotion(f64),
    /// The number of points of a response is out of range.
    #[error("{} must lie between {least} and {most}, found {found}", Setting::Points)]
    Points {
        /// Given number of points.
        found: usize,
        /// Minimum.
        least: usize,
        /// Maximum.
        most: usize,
    },
    /// The lowest frequency of a response is negative, or zero on a logarithmic axis.
    #[error("{} must be {}, found {found} Hz", Setting::LowestFrequency, lowest(*logarithmic))]
    LowestFrequency {
        /// Given frequency (Hz).
        found: f64,
        /// Whether the axis is logarithmic.
        logarithmic: bool,
    },
    /// The highest frequency of a response is out of range.
    #[error(
        "{} must lie above {} ({lowest} Hz) and below 1e6 Hz, found {found} Hz",
        Setting::HighestFrequency,
        Setting::LowestFrequency
    )]
    HighestFrequency {
        /// Given frequency (Hz).
        found: f64,
        /// Lowest frequency (Hz).
        lowest: f64,
    },
    /// The robot is rigid, so its TCP has no error that could depend on a parameter.
    #[error(
        "the robot has no flexible link and no elastic drive: its tool is where the rigid arm has it, and nothing changes that; add \
         [[flexible_link]] or [[drive]] entries"
    )]
    NothingYields,
    /// No parameter of the robot has this name.
    #[error(
        "no parameter is called {pattern:?}: expected some of {}, * for anything; an entry of a lumped link's 6x6 is \
         link.LINK.stiffness[i][j], i and j from 0 to 5",
        names.join(", ")
    )]
    NoParameter {
        /// Given name or pattern.
        pattern: String,
        /// Available names.
        names: Vec<String>,
    },
}

fn lowest(logarithmic: bool) -> String {
    if logarithmic { format!("positive (0 needs {} linear)", Setting::Spacing) } else { "positive or zero".into() }
}
