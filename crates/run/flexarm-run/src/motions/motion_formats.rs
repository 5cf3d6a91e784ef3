//! Table of the motion formats that can be read, one row each, recognised by content. A new format
//! needs only a new row.
//!
//! Start at `read`. Not here: parsers of the formats (`flexarm_trajectory`, `flexarm_motion_io`,
//! `flexarm_programs`), fitting to a robot (`motion`).

use std::io::Read;
use std::path::Path;

use flexarm_motion_io::{
    MCAP_MAGIC, MessageMotion, MotionError, Request, SQLITE_MAGIC, ZSTD_MAGIC, is_message_text, read_bag, read_text,
};
use flexarm_settings::{Finding, Setting};
use flexarm_trajectory::{ColumnMap, JointLimits, KnownJoint, TableRequest, Trajectory, text_of_file};

use crate::error::Error;
use crate::motions::tool_path::{Cell, ToolPath, is_path_file, read_path_file, read_robot_program};
use flexarm_programs::recognise;

/// Number of bytes used to recognise a file.
const HEAD_BYTES: u64 = 64 << 10;

/// Options for reading a motion file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionOptions {
    /// Topic of a bag; by default one is chosen and reported.
    pub topic: Option<String>,
    /// Columns of a table that hold time and joints; by default their names decide.
    pub columns: Option<ColumnMap>,
}

/// Motion as read from its file.
pub(crate) struct ReadMotion {
    pub(crate) trajectory: Trajectory,
    /// Description of the format.
    pub(crate) format: String,
    pub(crate) topic: Option<String>,
    /// Number of rows, messages or points; None for waypoints.
    pub(crate) samples: Option<usize>,
    /// Joints of the file that the robot does not have, if that is not an error.
    pub(crate) dropped: Vec<String>,
    pub(crate) caveats: Vec<Finding>,
    /// Planned TCP path, if the motion is given as one.
    pub(crate) tool_path: Option<ToolPath>,
}

impl ReadMotion {
    /// Returns a motion without topic, rows and messages about it.
    fn plain(trajectory: Trajectory, format: String) -> Self {
        let (dropped, caveats) = (Vec::new(), Vec::new());
        Self { trajectory, format, topic: None, samples: None, dropped, caveats, tool_path: None }
    }
}

/// Beginning of a file.
pub(crate) struct Head<'a> {
    /// File extension in lower case.
    pub(crate) ending: &'a str,
    pub(crate) bytes: &'a [u8],
    /// The bytes as text, as far as they are UTF-8; empty for binary data.
    pub(crate) text: &'a str,
    pub(crate) is_folder: bool,
}

/// File to be read, with the robot and the options.
pub(crate) struct MotionFile<'a> {
    pub(crate) path: &'a Path,
    /// Joints of the robot; None if it is not known.
    pub(crate) joints: Option<&'a [KnownJoint<'a>]>,
    pub(crate) limits: &'a [(&'a str, JointLimits)],
    pub(crate) options: &'a MotionOptions,
    /// Robot that follows a TCP path; None if it is not known.
    pub(crate) cell: Option<&'a Cell<'a>>,
    /// Text to use instead of the file's own.
    pub(crate) text: Option<&'a str>,
}

impl MotionFile<'_> {
    /// Returns the text of a text file.
    fn text(&self) -> Result<String, Error> {
        self.text.map_or_else(|| Ok(text_of_file(self.path)?), |text| Ok(text.to_owned()))
    }
}

/// Motion format.
pub(crate) struct MotionFormat {
    /// Name in the list of readable formats.
    pub(crate) name: &'static str,
    pub(crate) recognises: fn(&Head<'_>) -> bool,
    pub(crate) read: fn(&MotionFile<'_>) -> Result<ReadMotion, Error>,
}

/// Tried in order: formats with an unambiguous signature first, tables last.
const FORMATS: [MotionFormat; 11] = [
    MotionFormat { name: "folders of rosbag2", recognises: |head| head.is_folder, read: bag },
    MotionFormat { name: "bags as MCAP", recognises: |head| head.bytes.starts_with(MCAP_MAGIC), read: bag },
    MotionFormat { name: "bags as SQLite (.db3)", recognises: |head| head.bytes.starts_with(SQLITE_MAGIC), read: bag },
    // Bags of ROS 1 are not read: an error of their own.
    MotionFormat { name: "", recognises: |head| head.bytes.starts_with(b"#ROSBAG V"), read: bag_of_ros_1 },
    MotionFormat {
        name: "MCAP and SQLite bags packed by zstd",
        recognises: |head| head.bytes.starts_with(ZSTD_MAGIC),
        read: bag,
    },
    MotionFormat {
        name: "paths of the tool (TOML with [path])",
        recognises: |head| is_toml(head) && is_path_file(head.text),
        read: tool_path,
    },
    MotionFormat { name: "waypoints (TOML)", recognises: is_toml, read: waypoints },
    MotionFormat {
        name: "robot programs (KUKA KRL, ABB RAPID, URScript, G-code)",
        recognises: is_program,
        read: robot_program,
    },
    MotionFormat {
        name: "messages of ROS as YAML or JSON (JointTrajectory, JointState)",
        recognises: is_message,
        read: messages,
    },
    MotionFormat { name: "samples (CSV) and other tables", recognises: is_table, read: table },
    // A file with the extension .csv gets the error messages of tables even if its content is not
    // recognised.
    MotionFormat { name: "", recognises: |head| head.ending == "csv", read: table },
];

/// Reads a motion file of any format.
pub(crate) fn read(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    let path = file.path;
    if !path.exists() {
        let what = "there is no such trajectory file; give a .csv or .toml file".into();
        return Err(Error::File { path: path.to_owned(), what });
    }
    let mut bytes = Vec::new();
    let is_folder = path.is_dir();
    if !is_folder {
        if !path.is_file() {
            return Err(unreadable(path, std::io::Error::other("this is not a file")));
        }
        let opened = std::fs::File::open(path).and_then(|open| open.take(HEAD_BYTES).read_to_end(&mut bytes));
        opened.map_err(|source| unreadable(path, source))?;
    }
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let decoded = start_as_text(&bytes);
    let head = Head { ending: &ending, bytes: &bytes, text: &decoded, is_folder };
    match FORMATS.iter().find(|format| (format.recognises)(&head)) {
        Some(format) => (format.read)(file),
        None => Err(Error::motion(path, unknown(&head))),
    }
}

fn unreadable(path: &Path, source: std::io::Error) -> Error {
    flexarm_trajectory::TrajectoryError::Read { path: path.to_owned(), source }.into()
}

/// Returns the text at the beginning of a file, up to the first byte that is not text.
fn start_as_text(bytes: &[u8]) -> String {
    let is_utf16 = bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]);
    let whole = &bytes[..bytes.len() - usize::from(is_utf16) * (bytes.len() % 2)];
    let text = flexarm_trajectory::text_of_bytes(whole.to_vec(), "").unwrap_or_else(|_| {
        let end = std::str::from_utf8(bytes).map_or_else(|error| error.valid_up_to(), str::len);
        String::from_utf8_lossy(&bytes[..if is_utf16 { 0 } else { end }]).into_owned()
    });
    text.trim_start_matches('\u{feff}').to_owned()
}

/// Message for a file of unknown format.
fn unknown(head: &Head<'_>) -> String {
    let names: Vec<&str> = FORMATS.iter().map(|format| format.name).filter(|name| !name.is_empty()).collect();
    let found = match (head.bytes, head.text.lines().find(|line| !line.trim().is_empty())) {
        ([], _) => "the file is empty".to_owned(),
        (bytes, _) if bytes.contains(&0) && !bytes.starts_with(&[0xFF, 0xFE]) && !bytes.starts_with(&[0xFE, 0xFF]) => {
            "it is not text and has no mark that is known".to_owned()
        }
        (_, Some(line)) => format!("it begins with {:?}", line.chars().take(40).collect::<String>()),
        (_, None) => "it has no text".to_owned(),
    };
    format!("this is not a readable motion: {found}; readable are {}; rename or convert the file", names.join(", "))
}

// -------------------------------------------------------------------------------------------------------------
// recognition

fn is_toml(head: &Head<'_>) -> bool {
    // Programs also assign to names; in TOML the list of joints contains strings and the format is
    // a number.
    let is_key = |line: &str| match line.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
        Some(("format", value)) => value.starts_with(|c: char| c.is_ascii_digit()),
        Some(("joints", value)) => value.trim_start_matches('[').trim_start().starts_with(['"', '\'']),
        _ => line.trim_start().starts_with("[[move]]"),
    };
    head.ending == "toml" || head.text.lines().any(is_key)
}

/// Whether the content is a robot program; tables and message texts are excluded whatever their
/// lines look like.
fn is_program(head: &Head<'_>) -> bool {
    let other = ["yaml", "yml", "json", "csv"].contains(&head.ending) || is_message_text(head.text);
    !other && recognise(head.bytes, &format!("x.{}", head.ending)).is_some()
}

fn is_message(head: &Head<'_>) -> bool {
    ["yaml", "yml", "json"].contains(&head.ending) || is_message_text(head.text)
}

/// Whether some line consists mostly of numbers, at least two.
fn is_table(head: &Head<'_>) -> bool {
    let of_numbers = |line: &str| {
        let fields = |separators: &[char]| -> (usize, usize) {
            let fields =
                line.split(|c| separators.contains(&c)).map(|f| f.trim().trim_matches('"')).filter(|f| !f.is_empty());
            let is_number = |field: &str| field.replace(',', ".").parse::<f64>().is_ok();
            fields.fold((0, 0), |(all, numbers), field| (all + 1, numbers + usize::from(is_number(field))))
        };
        [&[';'][..], &['\t'], &[','], &[' ', '\t']].iter().any(|separators| {
            let (all, numbers) = fields(separators);
            all >= 2 && 2 * numbers > all
        })
    };
    head.text.lines().take(1000).any(of_numbers)
}

// ------------------------------------------------------------------------------------------------------------------
// readers

fn waypoints(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    no_topic(file, "waypoints")?;
    no_columns(file, "waypoints")?;
    let trajectory = Trajectory::parse_toml(&file.text()?, &file.path.display().to_string(), file.limits)?;
    Ok(ReadMotion::plain(trajectory, "waypoints".to_owned()))
}

fn tool_path(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    no_topic(file, "a path of the tool")?;
    no_columns(file, "a path of the tool")?;
    let (text, cell) = (file.text()?, robot_of(file)?);
    Ok(along(read_path_file(file.path, &text, cell)?, "path of the tool".to_owned()))
}

fn robot_program(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    no_topic(file, "a robot program")?;
    no_columns(file, "a robot program")?;
    let cell = robot_of(file)?;
    let (planned, language) = read_robot_program(file.path, cell)?;
    Ok(along(planned, format!("robot program, {language}")))
}

fn along((trajectory, tool_path): (Trajectory, ToolPath), format: String) -> ReadMotion {
    let caveats = tool_path.caveats.clone();
    ReadMotion { caveats, tool_path: Some(tool_path), ..ReadMotion::plain(trajectory, format) }
}

/// Returns the robot; a TCP path without one does not determine a joint motion.
fn robot_of<'a>(file: &MotionFile<'a>) -> Result<&'a Cell<'a>, Error> {
    file.cell.ok_or_else(|| {
        Error::motion(file.path, "this file gives a TCP path: give the robot as well, whose joints follow it")
    })
}

fn table(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    no_topic(file, "a table")?;
    let request = TableRequest { columns: file.options.columns.as_ref(), joints: file.joints };
    let (text, origin) = (text_of_file(file.path)?, file.path.display().to_string());
    let (trajectory, info) = Trajectory::parse_table(&text, &origin, &request)?;
    Ok(ReadMotion { samples: Some(info.rows), ..ReadMotion::plain(trajectory, info.format) })
}

fn messages(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    no_columns(file, "a text of messages")?;
    let (text, origin) = (text_of_file(file.path)?, file.path.display().to_string());
    with_request(file, |request| read_text(&text, &origin, request))
}

fn bag_of_ros_1(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    let what = "this is a bag of ROS 1; readable are bags of ROS 2 as MCAP or SQLite. rosbags-convert (pip install \
                rosbags) makes one of it: rosbags-convert --src FILE.bag --dst FOLDER --dst-storage mcap; then give \
                the folder";
    Err(Error::motion(file.path, what))
}

fn bag(file: &MotionFile<'_>) -> Result<ReadMotion, Error> {
    no_columns(file, "a bag")?;
    with_request(file, |request| read_bag(file.path, request))
}

fn with_request(
    file: &MotionFile<'_>,
    read: impl FnOnce(&Request<'_>) -> Result<MessageMotion, MotionError>,
) -> Result<ReadMotion, Error> {
    let names: Option<Vec<&str>> = file.joints.map(|joints| joints.iter().map(|joint| joint.name).collect());
    let request = Request { joints: names.as_deref(), topic: file.options.topic.as_deref() };
    let MessageMotion { trajectory, format, topic, message, samples, dropped, caveats } = read(&request)?;
    let format = format!("{format}, {message}");
    Ok(ReadMotion { trajectory, format, topic, samples: Some(samples), dropped, caveats, tool_path: None })
}

fn no_topic(file: &MotionFile<'_>, what: &str) -> Result<(), Error> {
    match &file.options.topic {
        None => Ok(()),
        Some(topic) => {
            let what = format!(
                "{} {topic:?} was requested, but the file is {what}, which has no topics; leave it out",
                Setting::Topic
            );
            Err(Error::motion(file.path, what))
        }
    }
}

fn no_columns(file: &MotionFile<'_>, what: &str) -> Result<(), Error> {
    if file.options.columns.is_none() {
        return Ok(());
    }
    let what = format!("{} names the columns of a table, but the file is {what}; leave it out", Setting::Columns);
    Err(Error::motion(file.path, what))
}

/// Rejects a motion of joints that follow from closed loops.
pub(crate) fn refuse_dependent(
    path: &Path,
    moved: &[String],
    joints: &[&str],
    dependent: &[&str],
) -> Result<(), Error> {
    let follows: Vec<&String> = moved.iter().filter(|name| dependent.contains(&name.as_str())).collect();
    if follows.is_empty() {
        return Ok(());
    }
    let what = format!(
        "the motion moves {follows:?}, which follow from closed loops of the robot: a motion names the joints that drive, {joints:?}; leave \
         the others out"
    );
    Err(Error::motion(path, what))
}
