//! Messages of a ROS 1 bag (`.bag`, format 2.0), record by record from the beginning: the index at
//! the end is not needed, so a file that is truncated or was never closed (`.bag.active`) is read
//! as far as possible.
//!
//! A record consists of a header with fields `name=value` and data. Four kinds are relevant: the
//! bag header, chunks, connections (topic, type and definition of the messages) and messages.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::collect::Collector;
use crate::error::{MotionError, PlacedProblem, Problem};
use crate::unpack::{MOST_BYTES, Packing, unpacked};

/// First bytes of a ROS 1 bag of any version.
pub const ROSBAG_MAGIC: &[u8] = b"#ROSBAG V";

/// First line of the supported version.
const VERSION: &[u8] = b"#ROSBAG V2.0\n";
/// Kinds of records, the field `op`.
const MESSAGE: u8 = 0x02;
const CHUNK: u8 = 0x05;
const CONNECTION: u8 = 0x07;
/// Maximum length of a record header (bytes).
const MOST_HEAD: u64 = 1 << 20;

pub(crate) fn collect_file(path: &Path, into: &mut Collector<'_>) -> Result<Option<String>, MotionError> {
    let failed = |source| MotionError::Read { path: path.to_owned(), source };
    collect(BufReader::new(File::open(path).map_err(failed)?), into)
        .map_err(|trouble| trouble.of(&path.display().to_string()))
}

fn container(what: String) -> PlacedProblem {
    PlacedProblem::new(Problem::Container { container: "bag of ROS 1", what })
}

/// Collects the messages of a bag; returns the reason if it ends prematurely.
fn collect(mut file: impl Read, into: &mut Collector<'_>) -> Result<Option<String>, PlacedProblem> {
    let mut version = [0; VERSION.len()];
    if file.read_exact(&mut version).is_err() || version != VERSION {
        let found = String::from_utf8_lossy(&version).trim_end().to_owned();
        return Err(container(format!(
            "it begins with {found:?}; read is version 2.0 (rosbag migrate makes one of older bags)"
        )));
    }
    let mut known = Connections::default();
    loop {
        let head = match part(&mut file, MOST_HEAD)? {
            Part::Whole(head) => head,
            Part::End => return Ok(None),
            Part::Cut(_) => return Ok(cut()),
        };
        let (data, is_whole) = match part(&mut file, MOST_BYTES)? {
            Part::Whole(data) => (data, true),
            Part::Cut(data) => (data, false),
            Part::End => return Ok(cut()),
        };
        // A truncated chunk still has the messages before the end.
        let broken = match Head::of(&head) {
            None => Some("damaged: a record has no head".to_owned()),
            Some(head) if head.op == CHUNK => known.chunk(&head, &data, into)?,
            Some(head) if is_whole => known.record(&head, &data, into)?,
            Some(_) => None,
        };
        if broken.is_some() || !is_whole {
            return Ok(broken.or_else(cut));
        }
    }
}

fn cut() -> Option<String> {
    Some("its end is missing".to_owned())
}

/// A block of bytes preceded by its length.
enum Part {
    Whole(Vec<u8>),
    /// The bytes present.
    Cut(Vec<u8>),
    /// No bytes are present.
    End,
}

fn part(file: &mut impl Read, most: u64) -> Result<Part, PlacedProblem> {
    let mut length = Vec::new();
    let failed = |error: std::io::Error| container(format!("it cannot be read on ({error})"));
    file.take(4).read_to_end(&mut length).map_err(failed)?;
    let length: [u8; 4] = match length.len() {
        0 => return Ok(Part::End),
        4 => [length[0], length[1], length[2], length[3]],
        _ => return Ok(Part::Cut(Vec::new())),
    };
    let length = u64::from(u32::from_le_bytes(length));
    if length > most {
        return Err(container(format!("a record of {length} bytes, at most {most} are read at once")));
    }
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes).map_err(failed)?;
    Ok(if bytes.len() as u64 == length { Part::Whole(bytes) } else { Part::Cut(bytes) })
}

/// Header of a record.
struct Head<'a> {
    op: u8,
    fields: HashMap<&'a [u8], &'a [u8]>,
}

impl<'a> Head<'a> {
    /// Parses a header; `None` if it is damaged.
    fn of(bytes: &'a [u8]) -> Option<Self> {
        let fields = fields(bytes)?;
        let op = *fields.get(&b"op"[..])?.first()?;
        Some(Self { op, fields })
    }

    fn number(&self, name: &str) -> Option<u32> {
        let bytes: [u8; 4] = (*self.fields.get(name.as_bytes())?).try_into().ok()?;
        Some(u32::from_le_bytes(bytes))
    }

    fn text(&self, name: &str) -> Option<String> {
        Some(String::from_utf8_lossy(self.fields.get(name.as_bytes())?).into_owned())
    }
}

/// Parses fields `name=value`, each preceded by its length.
fn fields(mut rest: &[u8]) -> Option<HashMap<&[u8], &[u8]>> {
    let mut fields = HashMap::new();
    while !rest.is_empty() {
        let field = with_length(&mut rest)?;
        let equals = field.iter().position(|&byte| byte == b'=')?;
        fields.insert(&field[..equals], &field[equals + 1..]);
    }
    Some(fields)
}

/// Reads bytes preceded by their length.
fn with_length<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, behind) = rest.split_first_chunk::<4>()?;
    let (bytes, behind) = behind.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *rest = behind;
    Some(bytes)
}

/// Topic index of each connection.
#[derive(Default)]
struct Connections(HashMap<u32, usize>);

impl Connections {
    /// Reads the records of a chunk, as far as possible.
    fn chunk(
        &mut self,
        head: &Head<'_>,
        packed: &[u8],
        into: &mut Collector<'_>,
    ) -> Result<Option<String>, PlacedProblem> {
        let (records, broken) = match head.text("compression").as_deref() {
            None | Some("none") => (packed.to_vec(), None),
            Some("bz2") => unpacked(Packing::Bzip2, packed),
            Some("lz4") => unpacked(Packing::Lz4, packed),
            Some(other) => {
                return Err(container(format!("a chunk is packed by {other:?}; read are bz2, lz4 and none")));
            }
        };
        let mut rest = &records[..];
        while !rest.is_empty() {
            let (Some(head), Some(data)) = (with_length(&mut rest), with_length(&mut rest)) else {
                return Ok(broken.or_else(cut));
            };
            let Some(head) = Head::of(head) else {
                return Ok(Some("damaged: a record in a chunk has no head".to_owned()));
            };
            if let Some(broken) = self.record(&head, data, into)? {
                return Ok(Some(broken));
            }
        }
        Ok(broken)
    }

    /// Processes a record outside or inside a chunk; returns a description of the problem, if any.
    fn record(
        &mut self,
        head: &Head<'_>,
        data: &[u8],
        into: &mut Collector<'_>,
    ) -> Result<Option<String>, PlacedProblem> {
        let done = match head.op {
            CONNECTION => self.connection(head, data, into),
            MESSAGE => return self.message(head, data, into),
            // Records that are not needed here, such as an index.
            _ => Some(()),
        };
        Ok(done.is_none().then(|| "damaged: a connection does not say what it is of".to_owned()))
    }

    fn connection(&mut self, head: &Head<'_>, data: &[u8], into: &mut Collector<'_>) -> Option<()> {
        let about = Head { op: CONNECTION, fields: fields(data)? };
        let message = about.text("type")?;
        let definition = about.text("message_definition").filter(|text| !text.trim().is_empty());
        let topic = head.text("topic").or_else(|| about.text("topic"))?;
        self.0.insert(head.number("conn")?, into.topic(&topic, &message, "ros1", definition.as_deref()));
        Some(())
    }

    fn message(&self, head: &Head<'_>, data: &[u8], into: &mut Collector<'_>) -> Result<Option<String>, PlacedProblem> {
        let time = head.fields.get(&b"time"[..]).and_then(|bytes| <[u8; 8]>::try_from(*bytes).ok());
        let (Some(connection), Some([a, b, c, d, e, f, g, h])) = (head.number("conn"), time) else {
            return Ok(Some("damaged: a message does not say where it belongs".to_owned()));
        };
        let (secs, nsecs) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        if let Some(&topic) = self.0.get(&connection) {
            into.bytes(topic, i64::from(secs) * 1_000_000_000 + i64::from(nsecs), data)?;
        }
        Ok(None)
    }
}
