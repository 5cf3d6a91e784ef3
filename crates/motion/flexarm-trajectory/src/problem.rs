//! Problems of files, samples and plans: value found, value expected and remedy.
//!
//! [`crate::FileError`] adds the place of a problem.

use flexarm_settings::Setting;

use crate::curve::LONGEST;
use crate::joint_names::NameError;
use crate::polynomial::FARTHEST;

/// A problem in a file; the message includes the remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// Not text.
    #[error("the file is not UTF-8 text; save it as UTF-8")]
    NotUtf8,
    /// Nothing but blank lines and comments.
    #[error("the file is empty; expected a header `time,<joint>,...` and at least two rows")]
    Empty,
    /// Repeated column name.
    #[error("the column is called {name:?}, as column {first} is; remove or rename one of them")]
    RepeatedColumn {
        /// The name.
        name: String,
        /// Number of the first column of that name, from 1.
        first: usize,
    },
    /// `.vel` or `.acc` column without a position column.
    #[error(
        "column {column:?} has no position column {joint:?} beside it; the header has {}; add it or correct the name",
        list(found)
    )]
    NoPositionColumn {
        /// The column.
        column: String,
        /// The joint that it belongs to.
        joint: String,
        /// Columns of the header.
        found: Vec<String>,
    },
    /// Row whose length differs from the header's, as in a truncated file.
    #[error("the row has {found} fields, the header {expected}; was the file cut off? complete or remove the row")]
    Ragged {
        /// Number of fields in the row.
        found: usize,
        /// Number of fields in the header.
        expected: usize,
    },
    /// Too many values for memory.
    #[error(
        "more than {most} numbers, the limit (an hour of six joints at 1 kHz has 25 million); leave out rows: splines pass between them"
    )]
    TooManyNumbers {
        /// Maximum number of values.
        most: usize,
    },
    /// Field that is not a number.
    #[error("{column}: {found:?} is not a number; expected one such as 0.25 or -1e-3")]
    NotANumber {
        /// Column name.
        column: String,
        /// The field.
        found: String,
    },
    /// Unknown unit.
    #[error("unit {found:?} of `{key}` is not known; accepted: {accepted}")]
    UnknownUnit {
        /// `unit` or `time`.
        key: &'static str,
        /// Value given.
        found: String,
        /// Accepted values.
        accepted: &'static str,
    },
    /// Two comments that state different units.
    #[error("`{key}` is stated twice, as {first:?} and as {second:?}; keep one line")]
    ContradictingUnits {
        /// The key of the comment.
        key: &'static str,
        /// First value.
        first: String,
        /// Second value.
        second: String,
    },
    /// The file's unit of a joint contradicts the robot's joint type.
    #[error("joint {joint:?} {}", contradicted(joint, *is_length))]
    UnitOfJoint {
        /// The joint.
        joint: String,
        /// Whether the values were read as metres, otherwise as degrees.
        is_length: bool,
    },
    /// Name that is not a joint of the file.
    #[error("{name:?} in `{key}` is not a joint of this file; it has {}", list(joints))]
    UnknownJoint {
        /// The key that holds the name.
        key: &'static str,
        /// The name.
        name: String,
        /// Joints of the file.
        joints: Vec<String>,
    },
    /// TOML text with a syntax error, an unknown or missing key or a wrong type.
    #[error("{message}")]
    Toml {
        /// Parser message, in one line.
        message: String,
    },
    /// Unknown version of the format.
    #[error("format {found} is not known; this program reads `format = 1`")]
    Format {
        /// Version given.
        found: i64,
    },
    /// Value outside its range.
    #[error("`{key}` is {found}; expected {expected}")]
    Value {
        /// The key.
        key: String,
        /// Value given.
        found: String,
        /// Accepted values.
        expected: &'static str,
    },
    /// List that does not have one entry per joint.
    #[error("`{key}` has {found} entries; expected {expected}, one for each of `joints`")]
    ListLength {
        /// The key.
        key: String,
        /// Number of entries found.
        found: usize,
        /// Number of joints.
        expected: usize,
    },
    /// Commas both as column separators and as decimal separators.
    #[error(
        "the row has {found} fields, the header {expected}: twice as many, as if numbers had decimal commas between commas, which is ambiguous; export the table with semicolons, or with points in numbers"
    )]
    DecimalCommas {
        /// Number of fields in the row.
        found: usize,
        /// Number of fields in the header.
        expected: usize,
    },
    /// Decimal points and decimal commas in one table.
    #[error(
        "numbers have decimal points (line {point}) and decimal commas (line {comma}); write all in one way, without \
         separators of thousands"
    )]
    MixedDecimals {
        /// First line with a point.
        point: usize,
        /// First line with a comma.
        comma: usize,
    },
    /// Numbers without a header.
    #[error(
        "the table has {fields} columns of numbers and no header; put one above (`time,<joint>,...`), or tell the columns by \
         number: {} t=#1[s],<joint>=#2[rad]",
        Setting::Columns
    )]
    NoHeader {
        /// Number of columns.
        fields: usize,
    },
    /// No time column recognised.
    #[error(
        "no column of the header {} is a time (`time`, `t`, `Time[s]`, `timestamp`); rename one, or tell which it is: {} \
         t=<column>",
        list(found),
        Setting::Columns
    )]
    NoTimeColumn {
        /// Columns of the header.
        found: Vec<String>,
    },
    /// Several time columns recognised.
    #[error(
        "the columns {} are all times; name the one that counts: {} t=<column>,<joint>=<column>",
        list(columns),
        Setting::Columns
    )]
    SeveralTimes {
        /// Time columns.
        columns: Vec<String>,
    },
    /// Names that do not fit the robot.
    #[error(transparent)]
    Names(NameError),
    /// Requested column that does not exist.
    #[error("there is no column {asked:?}; the header has {}", list(found))]
    NoSuchColumn {
        /// The column.
        asked: String,
        /// Columns of the header.
        found: Vec<String>,
    },
    /// Name that matches several columns.
    #[error("{asked:?} could be each of the columns {}; give the whole name, or its number as in #2", list(columns))]
    AmbiguousColumn {
        /// The name.
        asked: String,
        /// The columns.
        columns: Vec<String>,
    },
    /// Column whose unit belongs to another quantity.
    #[error("the column {column:?} has the unit of {found}; expected {expected}")]
    WrongMeasure {
        /// The column.
        column: String,
        /// Quantity of its unit.
        found: &'static str,
        /// Quantity expected.
        expected: &'static str,
    },
    /// Angles without a unit that are too large for radians.
    #[error(
        "joint {joint:?} reaches {largest:.4} in a table that does not state its unit, too much for radians to be assumed; \
         name the unit in the header (`{column}[deg]`), in a line `# unit: deg` above it, or with {} {joint}={column}[deg]",
        Setting::Columns
    )]
    UnitNeeded {
        /// The joint.
        joint: String,
        /// Its column.
        column: String,
        /// Maximum position as written.
        largest: f64,
    },
    /// Sampled values are invalid.
    #[error(transparent)]
    Samples(SampleError),
    /// The plan is invalid.
    #[error(transparent)]
    Plan(PlanError),
    /// Values or times are beyond any real motion, or too extreme for polynomials in f64.
    #[error(
        "joint {joint:?}: values or times are too extreme (a motion has {FARTHEST:e} rad or m and {LONGEST:e} s at most); check the \
         units of the file"
    )]
    OutOfRange {
        /// Joint name.
        joint: String,
    },
}

/// A problem with sampled values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// Too few rows.
    #[error("{found} rows of samples; expected at least 2, a start and an end")]
    TooFew {
        /// Number of rows.
        found: usize,
    },
    /// No joint.
    #[error("no joint columns; expected at least one joint beside the time")]
    NoJoint,
    /// A joint name appears twice.
    #[error("joint {joint:?} appears twice; rename or remove one of them")]
    RepeatedJoint {
        /// Joint name.
        joint: String,
    },
    /// Times that do not increase.
    #[error(
        "time {this} s does not follow {previous} s; times must increase from row to row: sort the rows and remove repeated ones"
    )]
    TimeNotIncreasing {
        /// Index of the row concerned, from 0.
        row: usize,
        /// Time of the previous row, s.
        previous: f64,
        /// Time of the row, s.
        this: f64,
    },
    /// NaN or infinite value.
    #[error("{what} is {value}; expected a finite number: remove or repair the row")]
    NotFinite {
        /// Column name.
        what: String,
        /// Index of the row, from 0.
        row: usize,
        /// The value.
        value: f64,
    },
    /// Column whose length differs from that of the times.
    #[error("{what} has {found} values; expected {expected}, one for each time")]
    Length {
        /// Column name.
        what: String,
        /// Values found.
        found: usize,
        /// Number of times.
        expected: usize,
    },
    /// Cut-off of a smoothing that the samples do not resolve.
    #[error(
        "a smoothing with a cut-off of {found} Hz; expected more than 0 and less than half the sampling rate, {most_hz:.4} Hz"
    )]
    Cutoff {
        /// Cut-off given (Hz).
        found: f64,
        /// Half the sampling rate (Hz).
        most_hz: f64,
    },
    /// Accelerations without velocities.
    #[error(
        "joint {joint:?} has accelerations but no velocities; add the column \"{joint}.vel\" or drop \"{joint}.acc\""
    )]
    AccelerationWithoutVelocity {
        /// Joint name.
        joint: String,
    },
}

/// A problem with a plan. Moves are counted from 1; 0 is the start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// No joint.
    #[error("the plan has no joints; name at least one")]
    NoJoint,
    /// The plan lasts 0 s.
    #[error("nothing moves and nothing is held, so the trajectory lasts 0 s; add a move or a hold")]
    NothingHappens,
    /// List that does not have one entry per joint.
    #[error("{}`{what}` has {found} entries; expected {expected}, one per joint", of_move(*number))]
    Length {
        /// The list.
        what: &'static str,
        /// Number of the move.
        number: usize,
        /// Number of entries found.
        found: usize,
        /// Number of joints.
        expected: usize,
    },
    /// Number outside its range.
    #[error("{}`{what}` is {value}; expected {allowed}", of_move(*number))]
    BadNumber {
        /// The quantity.
        what: &'static str,
        /// Number of the move.
        number: usize,
        /// Value given.
        value: f64,
        /// Accepted values.
        allowed: &'static str,
    },
    /// A limit that the profile needs is missing.
    #[error(
        "move {number} has no duration, and the {quantity} limit of joint {joint:?} is not known; \
         give `duration`, or the limit (for example `[limits]` `{joint} = {{ {quantity} = 2.0 }}`)"
    )]
    MissingLimit {
        /// Number of the move.
        number: usize,
        /// Joint name.
        joint: String,
        /// `"velocity"`, `"acceleration"` or `"jerk"`.
        quantity: &'static str,
    },
    /// Via points with a profile other than quintic or optimal.
    #[error(
        "move {number} passes points on the way, which only the quintic and the optimal law can; set `profile = \"quintic\"` in this \
         move or drop `via`"
    )]
    ViaNeedsQuintic {
        /// Number of the move.
        number: usize,
    },
    /// Via point that coincides with the previous point.
    #[error(
        "move {number}: point {via} on the way (the goal counts as the last) lies where the one before it is; remove it, or make two moves with a hold"
    )]
    RepeatedPoint {
        /// Number of the move.
        number: usize,
        /// Number of the point within the move, from 1; the goal is the last.
        via: usize,
    },
}

impl PlanError {
    /// Number of the move concerned, from 1.
    pub fn move_number(&self) -> Option<usize> {
        match *self {
            Self::NoJoint | Self::NothingHappens => None,
            Self::Length { number, .. } | Self::BadNumber { number, .. } => Some(number).filter(|&n| n > 0),
            Self::MissingLimit { number, .. }
            | Self::ViaNeedsQuintic { number }
            | Self::RepeatedPoint { number, .. } => Some(number),
        }
    }
}

/// `"a", "b"`, or `none`.
pub(crate) fn list(names: &[String]) -> String {
    match names.is_empty() {
        true => "none".to_owned(),
        false => names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "),
    }
}

/// Contradiction between the robot and the unit of a joint, with the remedy.
fn contradicted(joint: &str, is_length: bool) -> String {
    match is_length {
        true => {
            "turns, and `metres` names it as one that slides; take it out of `metres`, and give its numbers in `unit`"
                .into()
        }
        false => format!("slides, and its numbers are read as degrees; add {joint:?} to `metres` and give them in m"),
    }
}

fn of_move(number: usize) -> String {
    if number == 0 { String::new() } else { format!("move {number}: ") }
}
