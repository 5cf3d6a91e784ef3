//! Everything that can be wrong with messages and bags: where, what was found, what was expected,
//! how to mend it.

use std::fmt;
use std::path::PathBuf;

use flexarm_settings::Setting;
use flexarm_trajectory::TrajectoryError;

/// Why there is no motion.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be opened or read.
    #[error("cannot read motion {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The content of a file is wrong.
    #[error("{origin}{place}: {problem}")]
    Content {
        /// File name, or what the caller called the text.
        origin: String,
        /// Where in it.
        place: Place,
        /// What is wrong.
        problem: Box<Problem>,
    },
}

/// Where in a file something is wrong.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum Place {
    /// In all of it.
    #[default]
    Whole,
    /// In a line of text, from 1.
    Line(usize),
    /// In a message of a bag.
    Message {
        /// Its topic.
        topic: String,
        /// Its number on this topic, from 1.
        number: usize,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Message { topic, number } => write!(f, ", message {number} on {topic}"),
        }
    }
}

/// What is wrong, and how to mend it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The text is not YAML, and hence not JSON.
    #[error("the text is neither YAML nor JSON: {message}")]
    NotYaml {
        /// What the parser says.
        message: String,
    },
    /// More numbers than are kept in memory.
    #[error("more than {most} numbers, which is more than is read; cut the recording, or leave out samples")]
    TooManyNumbers {
        /// How many are read.
        most: usize,
    },
    /// A file larger than is read.
    #[error("more than {most} bytes, which is more than is read of such a file; {mend}")]
    TooLarge {
        /// How many are read.
        most: u64,
        /// How to mend it.
        mend: &'static str,
    },
    /// There is no message in the text.
    #[error(
        "there is no motion in the text: expected a JointTrajectory (`joint_names` and `points`), a JointState (`name` and \
         `position`) or the state of a controller (`joint_names` and `reference` or `desired`), at any depth; its keys are \
         {found}"
    )]
    NoMessage {
        /// Keys at the top.
        found: String,
    },
    /// An array that the printing program has shortened.
    #[error(
        "an array ends with \"...\": it was shortened when it was printed; print it whole (ros2 topic echo --full-length)"
    )]
    ShortenedArray,
    /// A key that must be there.
    #[error("{of} has no `{key}`; {expected}")]
    MissingKey {
        /// What lacks it.
        of: String,
        /// The key.
        key: &'static str,
        /// What is expected.
        expected: &'static str,
    },
    /// A value of another kind.
    #[error("`{key}` is {found}; expected {expected}")]
    Value {
        /// The key.
        key: String,
        /// What was found.
        found: String,
        /// What is expected.
        expected: &'static str,
    },
    /// Values that are not one per joint.
    #[error(
        "`{key}` has {found} values for {expected} joints; expected one for each name{hint}{}",
        point.map_or_else(String::new, |point| format!(" (point {point})"))
    )]
    Lengths {
        /// Number of the point of a trajectory, from 1.
        point: Option<usize>,
        /// The key.
        key: String,
        /// Values found.
        found: usize,
        /// Names of joints.
        expected: usize,
        /// What may be the matter, beginning with `: `; or nothing.
        hint: &'static str,
    },
    /// A joint that is named twice in a message.
    #[error("joint {joint:?} is named twice in one message; each may be there once")]
    RepeatedJoint {
        /// Its name.
        joint: String,
    },
    /// Points of a trajectory whose times do not increase.
    #[error(
        "point {point} is at {this} s, the one before it at {previous} s: `time_from_start` must increase from point to point"
    )]
    PointTimes {
        /// Number of the point, from 1.
        point: usize,
        /// Its time, s.
        this: f64,
        /// Time of the one before, s.
        previous: f64,
    },
    /// A position that is no number.
    #[error("joint {joint:?}, point {point}: the position is {value}; expected a finite number")]
    NotFinite {
        /// The joint.
        joint: String,
        /// Number of the point, from 1.
        point: usize,
        /// What was found.
        value: f64,
    },
    /// Trajectories of one file that do not follow each other.
    #[error(
        "trajectory {number} has joint {joint:?} at {this} where the one before ends with it at {previous}: trajectories of \
         one message run one after another; split the file"
    )]
    SegmentGap {
        /// Number of the trajectory, from 1.
        number: usize,
        /// The joint.
        joint: String,
        /// Where it starts, rad or m.
        this: f64,
        /// Where the one before ends, rad or m.
        previous: f64,
    },
    /// Stamps that jump back where nothing else tells the time.
    #[error(
        "the time stamps jump back by {seconds} s at sample {number} of joint {joint:?}: the text holds two recordings, or a \
         clock was set; keep one of them"
    )]
    StampsJumpBack {
        /// By how much, s.
        seconds: f64,
        /// Number of the sample, from 1.
        number: usize,
        /// The joint.
        joint: String,
    },
    /// Messages without a time.
    #[error(
        "the messages have no time stamps (`header`, `stamp`), so nothing says when they were; record with stamps, or record \
         a bag, which has the times of reception"
    )]
    NoStamps,
    /// A message that is not as its definition says.
    #[error("a message of the type {message} cannot be read: {what}")]
    Message {
        /// Its type.
        message: String,
        /// What is wrong.
        what: String,
    },
    /// A container that cannot be read.
    #[error("the {container} cannot be read: {what}")]
    Container {
        /// MCAP or SQLite file.
        container: &'static str,
        /// What is wrong.
        what: String,
    },
    /// A bag without motions.
    #[error(
        "no topic holds a motion: read are JointState, JointTrajectory and JointTrajectoryControllerState with at least one \
         message; the topics are {found}"
    )]
    NoTopic {
        /// The topics with their types.
        found: String,
    },
    /// A topic that is not there, or holds no motion.
    #[error("the topic {asked:?} ({}) {what}; topics with motions are {readable}", Setting::Topic)]
    Topic {
        /// The topic that was asked for.
        asked: String,
        /// What is wrong with it.
        what: String,
        /// Topics that could be asked for.
        readable: String,
    },
    /// A topic of a text, which has none.
    #[error("a topic was asked for ({} {asked:?}), and a text of messages has none; leave it out", Setting::Topic)]
    TopicOfText {
        /// The topic that was asked for.
        asked: String,
    },
    /// None of the joints is wanted.
    #[error("none of the joints {} is a joint of the robot", list(names))]
    NoJoint {
        /// Joints of the messages.
        names: Vec<String>,
    },
    /// No sample that could be used.
    #[error("there is no position that is a number; was the robot connected when this was recorded?")]
    NoPositions,
    /// A folder that is no bag.
    #[error("the folder is no bag of rosbag2: {what}; expected metadata.yaml and files *.mcap or *.db3 in it")]
    NotABag {
        /// What is missing.
        what: String,
    },
    /// A kind of file that is not read.
    #[error("{what}")]
    NotRead {
        /// What it is, and how to convert it.
        what: String,
    },
    /// The samples make no trajectory.
    #[error(transparent)]
    Trajectory(TrajectoryError),
}

/// `"a", "b"`, at most twelve.
pub(crate) fn list(names: &[String]) -> String {
    const MOST: usize = 12;
    if names.is_empty() {
        return "none".to_owned();
    }
    let mut shown: Vec<String> = names.iter().take(MOST).map(|name| format!("{name:?}")).collect();
    if names.len() > MOST {
        shown.push(format!("... ({} in all)", names.len()));
    }
    shown.join(", ")
}

/// A problem with its place, before the file is known.
#[derive(Debug)]
pub(crate) struct Trouble {
    pub(crate) place: Place,
    pub(crate) problem: Box<Problem>,
}

impl Trouble {
    pub(crate) fn new(problem: Problem) -> Self {
        Self { place: Place::Whole, problem: Box::new(problem) }
    }

    /// At a line of text; 0 stands for none.
    pub(crate) fn at(line: u32, problem: Problem) -> Self {
        let place = if line > 0 { Place::Line(line as usize) } else { Place::Whole };
        Self { place, problem: Box::new(problem) }
    }

    /// In a message, unless the place is known better.
    pub(crate) fn in_message(mut self, topic: &str, number: usize) -> Self {
        if self.place == Place::Whole {
            self.place = Place::Message { topic: topic.to_owned(), number };
        }
        self
    }

    pub(crate) fn of(self, origin: &str) -> MotionError {
        MotionError::Content { origin: origin.to_owned(), place: self.place, problem: self.problem }
    }
}

impl From<TrajectoryError> for Trouble {
    fn from(error: TrajectoryError) -> Self {
        Self::new(Problem::Trajectory(error))
    }
}
