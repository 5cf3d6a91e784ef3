//! Errors of messages and bags: place, value found, value expected and remedy.

use std::fmt;
use std::path::PathBuf;

use flexarm_settings::Setting;
use flexarm_trajectory::{NameError, TrajectoryError};

/// Content expected of a point without positions.
pub(crate) const NO_POSITIONS: &str =
    "expected a position for each joint; ros2 topic echo prints them all with --full-length";

/// Error of reading a motion.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be opened or read.
    #[error("cannot read motion {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content of a file is invalid.
    #[error("{origin}{place}: {problem}")]
    Content {
        /// File name, or the caller's name for the text.
        origin: String,
        /// Place in the file.
        place: FilePosition,
        /// The problem.
        problem: Box<Problem>,
    },
}

/// Place of a problem in a file.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum FilePosition {
    /// The file as a whole.
    #[default]
    Whole,
    /// A line of text, from 1.
    Line(usize),
    /// A message of a bag.
    Message {
        /// Topic of the message.
        topic: String,
        /// Number of the message on its topic, from 1.
        number: usize,
    },
}

impl fmt::Display for FilePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Message { topic, number } => write!(f, ", message {number} on {topic}"),
        }
    }
}

/// A problem; the message includes the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The text is neither YAML nor JSON.
    #[error("the text is neither YAML nor JSON: {message}")]
    NotYaml {
        /// Parser message.
        message: String,
    },
    /// Too many values for memory.
    #[error("more than {most} numbers, the limit; cut the recording, or leave out samples")]
    TooManyNumbers {
        /// Maximum number of values.
        most: usize,
    },
    /// The file is too large.
    #[error("more than {most} bytes, the limit for such a file; {mend}")]
    TooLarge {
        /// Maximum number of bytes.
        most: u64,
        /// Remedy.
        mend: &'static str,
    },
    /// The text holds no motion.
    #[error(
        "there is no motion in the text: expected a JointTrajectory (`joint_names` and `points`), a JointState (`name` and \
         `position`) or the state of a controller (`joint_names` and `reference` or `desired`), at any depth; its keys are \
         {found}"
    )]
    NoMessage {
        /// Top-level keys.
        found: String,
    },
    /// Array that the program which printed it shortened (`...`) or left out (`<sequence type: ...>`).
    #[error(
        "an array was shortened when it was printed; print it whole (ros2 topic echo --full-length, without --no-arr)"
    )]
    ShortenedArray,
    /// Missing key.
    #[error("{of} has no `{key}`; {expected}")]
    MissingKey {
        /// Object without the key.
        of: String,
        /// The key.
        key: &'static str,
        /// Content expected.
        expected: &'static str,
    },
    /// Value of the wrong kind.
    #[error("`{key}` is {found}; expected {expected}")]
    Value {
        /// The key.
        key: String,
        /// Value found.
        found: String,
        /// Value expected.
        expected: &'static str,
    },
    /// Number of values differs from the number of joints.
    #[error(
        "`{key}` has {found} values for {expected} joints; expected one for each name{hint}{}",
        point.map_or_else(String::new, |point| format!(" (point {point})"))
    )]
    Lengths {
        /// Number of the point of a trajectory, from 1.
        point: Option<usize>,
        /// The key.
        key: String,
        /// Number of values found.
        found: usize,
        /// Number of joints.
        expected: usize,
        /// Possible reason, beginning with `: `, or empty.
        hint: &'static str,
    },
    /// Joint that occurs twice in a message.
    #[error("joint {joint:?} is named twice in one message; each may be there once")]
    RepeatedJoint {
        /// Its name.
        joint: String,
    },
    /// Trajectory points whose times do not increase.
    #[error(
        "point {point} is at {this} s, the one before it at {previous} s: `time_from_start` must increase from point to point"
    )]
    PointTimes {
        /// Number of the point, from 1.
        point: usize,
        /// Time of the point, s.
        this: f64,
        /// Time of the previous point, s.
        previous: f64,
    },
    /// Position that is not finite.
    #[error("joint {joint:?}, point {point}: the position is {value}; expected a finite number")]
    NotFinite {
        /// The joint.
        joint: String,
        /// Number of the point, from 1.
        point: usize,
        /// Value found.
        value: f64,
    },
    /// Consecutive trajectories of one message that do not join.
    #[error(
        "trajectory {number} has joint {joint:?} at {this} where the one before ends with it at {previous}: trajectories of \
         one message run one after another; split the file"
    )]
    SegmentGap {
        /// Number of the trajectory, from 1.
        number: usize,
        /// The joint.
        joint: String,
        /// Position at its start, rad or m.
        this: f64,
        /// Position at the end of the previous one, rad or m.
        previous: f64,
    },
    /// Time stamps that jump back, without other times.
    #[error(
        "the time stamps jump back by {seconds} s at sample {number} of joint {joint:?}: the text holds two recordings, or a \
         clock was set; keep one of them"
    )]
    StampsJumpBack {
        /// Size of the jump, s.
        seconds: f64,
        /// Number of the sample, from 1.
        number: usize,
        /// The joint.
        joint: String,
    },
    /// Messages without time stamps.
    #[error(
        "the messages have no time stamps (`header`, `stamp`), so nothing says when they were; record with stamps, or record \
         a bag, which has the times of reception"
    )]
    NoStamps,
    /// Message that does not match its definition.
    #[error("a message of the type {message} cannot be read: {what}")]
    Message {
        /// Message type.
        message: String,
        /// Description of the problem.
        what: String,
    },
    /// Unreadable container.
    #[error("the {container} cannot be read: {what}")]
    Container {
        /// MCAP or SQLite file.
        container: &'static str,
        /// Description of the problem.
        what: String,
    },
    /// Bag without motions.
    #[error(
        "no topic holds a motion: read are JointState, JointTrajectory and JointTrajectoryControllerState with at least one \
         message; the topics are {found}"
    )]
    NoTopic {
        /// The topics with their types.
        found: String,
    },
    /// Topic that does not exist or holds no motion.
    #[error("the topic {asked:?} ({}) {what}; topics with motions are {readable}", Setting::Topic)]
    Topic {
        /// Topic requested.
        asked: String,
        /// Description of the problem.
        what: String,
        /// Topics that can be requested.
        readable: String,
    },
    /// Topic requested from a text, which has no topics.
    #[error("a topic was requested ({} {asked:?}), but a text of messages has none; leave it out", Setting::Topic)]
    TopicOfText {
        /// Topic requested.
        asked: String,
    },
    /// Names that do not fit the robot.
    #[error(transparent)]
    Names(#[from] NameError),
    /// No usable sample.
    #[error("no position is a number; was the robot connected when this was recorded?")]
    NoPositions,
    /// Folder that is not a bag.
    #[error("the folder is not a rosbag2 bag: {what}; expected metadata.yaml and files *.mcap or *.db3 in it")]
    NotABag {
        /// Missing item.
        what: String,
    },
    /// Unsupported kind of file.
    #[error("{what}")]
    NotRead {
        /// Kind of file, and its conversion.
        what: String,
    },
    /// The samples do not form a valid trajectory.
    #[error(transparent)]
    Trajectory(TrajectoryError),
}

/// Formats names as `"a", "b"`, at most twelve.
pub(crate) fn list(names: &[String]) -> String {
    const MAX: usize = 12;
    if names.is_empty() {
        return "none".to_owned();
    }
    let mut shown: Vec<String> = names.iter().take(MAX).map(|name| format!("{name:?}")).collect();
    if names.len() > MAX {
        shown.push(format!("... ({} in all)", names.len()));
    }
    shown.join(", ")
}

/// A problem with its place, before the file name is known.
#[derive(Debug)]
pub(crate) struct PlacedProblem {
    pub(crate) place: FilePosition,
    pub(crate) problem: Box<Problem>,
}

impl PlacedProblem {
    pub(crate) fn new(problem: Problem) -> Self {
        Self { place: FilePosition::Whole, problem: Box::new(problem) }
    }

    /// A problem at a line of text; 0 means no line.
    pub(crate) fn at(line: u32, problem: Problem) -> Self {
        let place = if line > 0 { FilePosition::Line(line as usize) } else { FilePosition::Whole };
        Self { place, problem: Box::new(problem) }
    }

    /// Sets the place to a message unless a place is set already.
    pub(crate) fn in_message(mut self, topic: &str, number: usize) -> Self {
        if self.place == FilePosition::Whole {
            self.place = FilePosition::Message { topic: topic.to_owned(), number };
        }
        self
    }

    pub(crate) fn of(self, origin: &str) -> MotionError {
        MotionError::Content { origin: origin.to_owned(), place: self.place, problem: self.problem }
    }
}

impl From<TrajectoryError> for PlacedProblem {
    fn from(error: TrajectoryError) -> Self {
        Self::new(Problem::Trajectory(error))
    }
}
