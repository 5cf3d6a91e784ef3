//! Definitions of ROS messages: as text (`ros2msg`, `ros1msg`), and built-in ones.
//!
//! A definition lists the fields of a type in the order of their bytes; MCAP files hold the
//! definitions, SQLite files of older bags do not. Not here: decoding of bytes (`cdr`).

use std::collections::HashMap;
use std::rc::Rc;

/// Type of a field's values.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "named after the words of a definition")]
pub enum Kind {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
    Text,
    /// `time` of ROS 1.
    Time,
    /// `duration` of ROS 1.
    Duration,
    Struct(String),
    /// A type that does not occur in motions, such as `wstring`.
    Other(String),
}

/// Number of values of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "named after the words of a definition")]
pub enum Many {
    One,
    Fixed(usize),
    Sequence,
}

#[derive(Clone, Debug)]
pub struct Field {
    pub name: Rc<str>,
    pub kind: Kind,
    pub many: Many,
}

/// A message and its parts, by their names without `msg`: `std_msgs/Header`.
#[derive(Clone, Debug, Default)]
pub struct Definitions {
    pub(crate) root: String,
    structs: HashMap<String, Vec<Field>>,
}

/// Built-in types for files without definitions. The state of a controller has only the fields up
/// to the first point, which is the set point in all versions of the message (`desired`, later
/// `reference`).
const KNOWN: [(&str, &str); 7] = [
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    ),
    (
        "trajectory_msgs/JointTrajectory",
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points",
    ),
    (
        "trajectory_msgs/JointTrajectoryPoint",
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n\
         builtin_interfaces/Duration time_from_start",
    ),
    (
        "control_msgs/JointTrajectoryControllerState",
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference",
    ),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id"),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"),
];

/// Returns the name of a type without `msg`: `sensor_msgs/msg/JointState` becomes
/// `sensor_msgs/JointState`.
pub(crate) fn plain_name(name: &str) -> String {
    name.replace("::", "/").replace("/msg/", "/").replace("/dds_/", "/").trim_end_matches('_').to_owned()
}

impl Definitions {
    /// Built-in definition of a type.
    pub(crate) fn known(message: &str) -> Option<Self> {
        let root = plain_name(message);
        if !KNOWN[..4].iter().any(|(name, _)| *name == root) {
            return None;
        }
        let structs = KNOWN.iter().map(|(name, text)| ((*name).to_owned(), fields(text, package(name)))).collect();
        Some(Self { root, structs })
    }

    /// Parses the definition in a file: that of the message, followed by those of its parts, each
    /// after a line of `=` and `MSG: name`.
    pub fn parse(message: &str, text: &str) -> Self {
        let root = plain_name(message);
        let mut structs = HashMap::new();
        let (mut name, mut body) = (root.clone(), String::new());
        let mut close = |name: &str, body: &mut String| {
            let found = fields(body, package(name));
            body.clear();
            // The first definition of a name applies, for files that list the root as its own part.
            structs.entry(name.to_owned()).or_insert(found);
        };
        for line in text.lines() {
            let trimmed = line.trim();
            if trimmed.len() >= 10 && trimmed.bytes().all(|byte| byte == b'=') {
                close(&name, &mut body);
                name.clear();
            } else if let Some(next) = trimmed.strip_prefix("MSG:") {
                name = plain_name(next.trim());
            } else {
                body += line;
                body.push('\n');
            }
        }
        close(&name, &mut body);
        Self { root, structs }
    }

    /// Fields of a part. A name without a package refers to `std_msgs` if there is no such part.
    pub fn fields(&self, name: &str) -> Option<&[Field]> {
        let found = self.structs.get(name).or_else(|| {
            let (_, last) = name.rsplit_once('/')?;
            self.structs.get(&format!("std_msgs/{last}"))
        });
        found.map(Vec::as_slice)
    }

    /// Whether any field of the message or of its parts has one of these names.
    pub(crate) fn has_field(&self, names: &[&str]) -> bool {
        self.structs.values().flatten().any(|field| names.contains(&&*field.name))
    }
}

fn package(name: &str) -> &str {
    name.split_once('/').map_or("", |(package, _)| package)
}

/// Fields of one message, without constants and comments.
fn fields(text: &str, package: &str) -> Vec<Field> {
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let Some((kind, rest)) = line.split_once(char::is_whitespace) else { continue };
        let rest = rest.trim_start();
        let end = rest.find(|c: char| c.is_whitespace() || c == '=').unwrap_or(rest.len());
        let (name, behind) = rest.split_at(end);
        if behind.trim_start().starts_with('=') || name.is_empty() {
            continue;
        }
        let (kind, many) = match kind.strip_suffix(']').and_then(|kind| kind.rsplit_once('[')) {
            None => (kind, Many::One),
            Some((kind, count)) => (kind, count.parse().map_or(Many::Sequence, Many::Fixed)),
        };
        fields.push(Field { name: name.into(), kind: kind_of(kind, package), many });
    }
    fields
}

/// Kind of a type name in a message definition; types without a package are of `package`.
fn kind_of(word: &str, package: &str) -> Kind {
    // `string<=10` is a string.
    let word = word.split_once("<=").map_or(word, |(word, _)| word);
    match word {
        "bool" => Kind::Bool,
        "byte" | "char" | "uint8" => Kind::U8,
        "int8" => Kind::I8,
        "uint16" => Kind::U16,
        "int16" => Kind::I16,
        "uint32" => Kind::U32,
        "int32" => Kind::I32,
        "uint64" => Kind::U64,
        "int64" => Kind::I64,
        "float32" => Kind::F32,
        "float64" => Kind::F64,
        "string" => Kind::Text,
        "time" => Kind::Time,
        "duration" => Kind::Duration,
        "wstring" => Kind::Other(word.to_owned()),
        "Header" => Kind::Struct("std_msgs/Header".to_owned()),
        name if name.contains('/') => Kind::Struct(plain_name(name)),
        name => Kind::Struct(format!("{package}/{name}")),
    }
}
