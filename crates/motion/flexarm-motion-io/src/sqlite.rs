//! Messages of a SQLite file of rosbag2 (`.db3`): tables `topics` and `messages`, and since ROS 2
//! Iron `message_definitions`.
//!
//! Only this module uses `rusqlite`. The file is opened read-only and no other file is created.

use std::collections::HashMap;
use std::path::Path;

use rusqlite::{Connection, OpenFlags};

use crate::collect::Collector;
use crate::error::{MotionError, PlacedProblem};
use crate::unpack::{MAX_BYTES, ZSTD_MAGIC, unpacked};

/// Collects from a file.
///
/// * `most`: maximum size of all messages after decompression, bytes.
pub(crate) fn collect_file(path: &Path, most: u64, into: &mut Collector<'_>) -> Result<Option<String>, MotionError> {
    let origin = path.display().to_string();
    let file = || {
        let mut log = path.as_os_str().to_owned();
        log.push("-wal");
        // Content that a killed recorder left in its log is read along with the file; without a log
        // no file must be created.
        let has_log = std::fs::metadata(&log).is_ok_and(|log| log.len() > 0);
        let name: String = path.to_str()?.chars().map(escaped).collect();
        Some(format!("file:{name}?mode=ro{}", if has_log { "" } else { "&immutable=1" }))
    };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let opened = match file() {
        Some(name) => Connection::open_with_flags(name, flags),
        None => Connection::open_with_flags(path, flags),
    };
    let database = opened.map_err(|error| failed(&error).of(&origin))?;
    collect(&database, most, into).map_err(|trouble| trouble.of(&origin))
}

/// Collects from a database that was decompressed into memory.
pub(crate) fn collect_bytes(
    mut bytes: Vec<u8>,
    most: u64,
    into: &mut Collector<'_>,
) -> Result<Option<String>, PlacedProblem> {
    // There is no log file in memory: format version 2 (with a log) is read as version 1.
    for at in [18, 19] {
        if let Some(version) = bytes.get_mut(at) {
            *version = 1;
        }
    }
    let mut database = Connection::open_in_memory().map_err(|error| failed(&error))?;
    let size = bytes.len();
    database.deserialize_read_exact("main", &bytes[..], size, true).map_err(|error| failed(&error))?;
    drop(bytes);
    collect(&database, most, into)
}

/// Escapes a character of a path in a file URI.
fn escaped(letter: char) -> String {
    match letter {
        '%' | '?' | '#' => format!("%{:02X}", u32::from(letter)),
        '\\' => "/".to_owned(),
        other => other.to_string(),
    }
}

fn failed(error: &rusqlite::Error) -> PlacedProblem {
    PlacedProblem::new(format!("the SQLite file cannot be read: {error}"))
}

/// Collects the messages of a database in the order of reception; returns why it ends early, if so.
fn collect(database: &Connection, most: u64, into: &mut Collector<'_>) -> Result<Option<String>, PlacedProblem> {
    let tables = names_of_tables(database).map_err(|error| failed(&error))?;
    let has = |table: &str| tables.iter().any(|name| name == table);
    if !has("topics") || !has("messages") {
        let what = format!(
            "it has no tables `topics` and `messages`, so it is not a rosbag2 bag; its tables are {}",
            if tables.is_empty() { "none".to_owned() } else { tables.join(", ") }
        );
        return Err(PlacedProblem::new(format!("the SQLite file cannot be read: {what}")));
    }
    let definitions = match has("message_definitions") {
        true => definitions(database).unwrap_or_default(),
        false => HashMap::new(),
    };
    let topics = topics(database).map_err(|error| failed(&error))?;
    let mut places = HashMap::new();
    for (id, name, message, encoding) in topics {
        let place = into.topic(&name, &message, &encoding, definitions.get(&message).map(String::as_str));
        places.insert(id, place);
    }
    messages(database, &places, most, into)
}

fn names_of_tables(database: &Connection) -> rusqlite::Result<Vec<String>> {
    // A truncated file has fewer pages than its header states. Only this setting makes the others
    // readable; nothing is written.
    database.pragma_update(None, "writable_schema", true)?;
    database.pragma_update(None, "trusted_schema", false)?;
    // Views are excluded, since they could compute endlessly.
    let mut query =
        database.prepare("SELECT name FROM sqlite_schema WHERE type = 'table' AND sql LIKE 'CREATE TABLE%'")?;
    query.query_map([], |row| row.get(0))?.collect()
}

fn topics(database: &Connection) -> rusqlite::Result<Vec<(i64, String, String, String)>> {
    let mut query = database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
    query.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)))?.collect()
}

fn definitions(database: &Connection) -> rusqlite::Result<HashMap<String, String>> {
    let mut query = database
        .prepare("SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'")?;
    query.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}

/// Collects the messages in the order of reception; returns the reason if the file ends
/// prematurely.
fn messages(
    database: &Connection,
    places: &HashMap<i64, usize>,
    most: u64,
    into: &mut Collector<'_>,
) -> Result<Option<String>, PlacedProblem> {
    let query = database.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY id");
    let mut query = query.map_err(|error| failed(&error))?;
    let mut rows = query.query([]).map_err(|error| failed(&error))?;
    let (mut read, mut left) = (0_usize, most);
    loop {
        let row = match rows.next() {
            Ok(Some(row)) => row,
            Ok(None) => return Ok(None),
            // A truncated file still has its first pages.
            Err(error) if read > 0 => return Ok(Some(format!("it cannot be read on ({error})"))),
            Err(error) => return Err(failed(&error)),
        };
        read += 1;
        let (Ok(topic), Ok(log_ns), Ok(data)) = (row.get::<_, i64>(0), row.get::<_, i64>(1), row.get_ref(2)) else {
            return Ok(Some("a row of it has values of another kind".to_owned()));
        };
        let (Some(&place), Ok(data)) = (places.get(&topic), data.as_blob()) else { continue };
        if data.starts_with(ZSTD_MAGIC) && into.wants(place) {
            let (message, broken) = unpacked(data, left.min(MAX_BYTES));
            if let Some(what) = broken {
                return Ok(Some(what));
            }
            left -= message.len() as u64;
            into.bytes(place, log_ns, &message)?;
        } else {
            into.bytes(place, log_ns, data)?;
        }
    }
}
