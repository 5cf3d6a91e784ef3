//! What can be wrong in a file, in samples and in a plan; each says what was found, what was
//! expected, how to mend it.
//!
//! The place of a problem is in [`crate::FileError`].

use flexarm_settings::Setting;

use crate::polynomial::FARTHEST;
use crate::trajectory::LONGEST;

/// What is wrong in a file, and how to mend it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// Not text.
    #[error("the file is not UTF-8 text; save it as UTF-8")]
    NotUtf8,
    /// Nothing but blank lines and comments.
    #[error("the file is empty; expected a header `time,<joint>,...` and at least two rows")]
    Empty,
    /// The header has no time column.
    #[error("no column `time` in the header {}; the first line must name the columns: `time,<joint>,...`", list(found))]
    NoTimeColumn {
        /// Columns of the header.
        found: Vec<String>,
    },
    /// Columns are not separated by commas.
    #[error(
        "the columns are separated by {separator:?}, expected commas (and points in decimal numbers); export the file again or replace them"
    )]
    WrongSeparator {
        /// What separates them.
        separator: char,
    },
    /// A column without a name.
    #[error("a column has no name; name each column of the header or remove the comma too much")]
    UnnamedColumn,
    /// The same column twice.
    #[error("the column is called {name:?}, as column {first} is; remove or rename one of them")]
    RepeatedColumn {
        /// Its name.
        name: String,
        /// Number of the first column of that name, from 1.
        first: usize,
    },
    /// A `.vel` or `.acc` column without its position.
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
    /// A row of another length than the header, as in a truncated file.
    #[error("the row has {found} fields, the header {expected}; was the file cut off? complete or remove the row")]
    Ragged {
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// More numbers than are kept in memory.
    #[error(
        "more than {most} numbers, which is more than is read (an hour of six joints at 1 kHz has 25 million); leave out rows: splines pass between them"
    )]
    TooManyNumbers {
        /// How many are read.
        most: usize,
    },
    /// A field that is not a number.
    #[error("{column}: {found:?} is not a number; expected one such as 0.25 or -1e-3")]
    NotANumber {
        /// Column name.
        column: String,
        /// The field.
        found: String,
    },
    /// A unit that is not known.
    #[error("unit {found:?} of `{key}` is not known; accepted: {accepted}")]
    UnknownUnit {
        /// `unit` or `time`.
        key: &'static str,
        /// What was given.
        found: String,
        /// What may be given.
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
    /// Numbers of a joint were read as what it has not.
    #[error("joint {joint:?} {}", contradicted(joint, *is_length))]
    UnitOfJoint {
        /// The joint.
        joint: String,
        /// They were read as metres, otherwise as degrees.
        is_length: bool,
    },
    /// A name that is no joint of the file.
    #[error("{name:?} in `{key}` is not a joint of this file; it has {}", list(joints))]
    UnknownJoint {
        /// The key that holds the name.
        key: &'static str,
        /// The name.
        name: String,
        /// Joints of the file.
        joints: Vec<String>,
    },
    /// The text is not the TOML that is expected: syntax, unknown or missing key, wrong type.
    #[error("{message}")]
    Toml {
        /// What the parser says, in one line.
        message: String,
    },
    /// A version of the format that is not known.
    #[error("format {found} is not known; this program reads `format = 1`")]
    Format {
        /// What was given.
        found: i64,
    },
    /// A value outside its range.
    #[error("`{key}` is {found}; expected {expected}")]
    Value {
        /// The key.
        key: String,
        /// What was given.
        found: String,
        /// What may be given.
        expected: &'static str,
    },
    /// A list that does not have one entry per joint.
    #[error("`{key}` has {found} entries; expected {expected}, one for each of `joints`")]
    ListLength {
        /// The key.
        key: String,
        /// Entries found.
        found: usize,
        /// Number of joints.
        expected: usize,
    },
    /// Commas between columns and in numbers.
    #[error(
        "the row has {found} fields, the header {expected}: twice as many, as if numbers had decimal commas between commas, \
         which nobody can tell apart; export the table with semicolons, or with points in numbers"
    )]
    DecimalCommas {
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
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
    /// Numbers without names of columns.
    #[error(
        "the table has {fields} columns of numbers and no header; put one above (`time,<joint>,...`), or tell the columns by \
         number: {} t=#1[s],<joint>=#2[rad]",
        Setting::Columns
    )]
    NoHeader {
        /// Columns.
        fields: usize,
    },
    /// No column looks like a time.
    #[error(
        "no column of the header {} is a time (`time`, `t`, `Time[s]`, `timestamp`); rename one, or tell which it is: {} \
         t=<column>",
        list(found),
        Setting::Columns
    )]
    NoTimeColumnFound {
        /// Columns of the header.
        found: Vec<String>,
    },
    /// Several columns look like times.
    #[error(
        "the columns {} are all times; tell which one counts: {} t=<column>,<joint>=<column>",
        list(columns),
        Setting::Columns
    )]
    SeveralTimes {
        /// They.
        columns: Vec<String>,
    },
    /// No column is one of the joints.
    #[error(
        "no column of the header {} is a joint: the joints are {}; rename the columns, or tell which they are: {} \
         <joint>=<column>",
        list(found),
        list(joints),
        Setting::Columns
    )]
    NoJointColumn {
        /// Columns of the header.
        found: Vec<String>,
        /// Joints of the robot.
        joints: Vec<String>,
    },
    /// A column that was asked for and is not there.
    #[error("there is no column {asked:?}; the header has {}", list(found))]
    NoSuchColumn {
        /// The column.
        asked: String,
        /// Columns of the header.
        found: Vec<String>,
    },
    /// A name that several columns have.
    #[error("{asked:?} could be each of the columns {}; give the whole name, or its number as in #2", list(columns))]
    AmbiguousColumn {
        /// The name.
        asked: String,
        /// The columns.
        columns: Vec<String>,
    },
    /// A unit of something else.
    #[error("the column {column:?} has the unit of {found}; expected {expected}")]
    WrongMeasure {
        /// The column.
        column: String,
        /// What its unit measures.
        found: &'static str,
        /// What is expected.
        expected: &'static str,
    },
    /// Angles too large for radians, without a unit.
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
        /// Largest position as it is written.
        largest: f64,
    },
    /// Sampled values are wrong.
    #[error(transparent)]
    Samples(SampleError),
    /// The plan is wrong.
    #[error(transparent)]
    Plan(PlanError),
    /// Values or times are beyond any motion, or too extreme for polynomials in f64.
    #[error(
        "joint {joint:?}: values or times are too extreme (a motion has {FARTHEST:e} rad or m and {LONGEST:e} s at most); check the \
         units of the file"
    )]
    OutOfRange {
        /// Joint name.
        joint: String,
    },
}

/// What is wrong with sampled values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// Not enough rows.
    #[error("{found} rows of samples; expected at least 2, a start and an end")]
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// No joint at all.
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
        /// Index of the offending row, from 0.
        row: usize,
        /// Time of the row before, s.
        previous: f64,
        /// Time of the row, s.
        this: f64,
    },
    /// NaN or infinite.
    #[error("{what} is {value}; expected a finite number: remove or repair the row")]
    NotFinite {
        /// Column name.
        what: String,
        /// Index of the row, from 0.
        row: usize,
        /// The value.
        value: f64,
    },
    /// A column of another length than the times.
    #[error("{what} has {found} values; expected {expected}, one for each time")]
    Length {
        /// Column name.
        what: String,
        /// Values found.
        found: usize,
        /// Number of times.
        expected: usize,
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

/// What is wrong with a plan. Moves are counted from 1; 0 stands for the start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// No joint at all.
    #[error("the plan has no joints; name at least one")]
    NoJoint,
    /// The plan lasts 0 s.
    #[error("nothing moves and nothing is held, so the trajectory lasts 0 s; add a move or a hold")]
    NothingHappens,
    /// A list that does not have one entry per joint.
    #[error("{}`{what}` has {found} entries; expected {expected}, one per joint", of_move(*number))]
    Length {
        /// Which list.
        what: &'static str,
        /// Number of the move.
        number: usize,
        /// Entries found.
        found: usize,
        /// Number of joints.
        expected: usize,
    },
    /// A number outside its range.
    #[error("{}`{what}` is {value}; expected {allowed}", of_move(*number))]
    BadNumber {
        /// Which number.
        what: &'static str,
        /// Number of the move.
        number: usize,
        /// What was given.
        value: f64,
        /// What may be given.
        allowed: &'static str,
    },
    /// A limit that the profile needs is not known.
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
    /// Points on the way with another profile than the quintic.
    #[error(
        "move {number} passes points on the way, which only the quintic and the optimal law can; set `profile = \"quintic\"` in this \
         move or drop `via`"
    )]
    ViaNeedsQuintic {
        /// Number of the move.
        number: usize,
    },
    /// A point on the way that cannot be told from the one before it.
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
    /// Number of the move that is wrong, from 1.
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

/// What a robot says against the unit of a joint, and how to mend it.
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
