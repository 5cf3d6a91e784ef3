//! Iterates over the records of an MCAP file, up to its end or the point of damage.
//!
//! Start at [`walk`]. The `mcap` crate reads the records; sizes that the file states are checked
//! before, and its panics on damaged files are caught ([`crate::read::wall`]).
//! Not here: the meaning of records ([`super::found`], [`super::assembly`]).

use std::fs::File;
use std::io::Read;
use std::path::Path;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::LogError;
use crate::read::wall::caught;

/// Whether to go on reading.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    On,
    Stop,
}

/// Calls `take` with every record, including those in chunks. If the file is truncated or damaged,
/// returns the cause.
pub(super) fn walk(
    path: &Path,
    take: &mut dyn FnMut(Record<'_>) -> Result<Flow, LogError>,
) -> Result<Option<String>, LogError> {
    /// Maximum record size accepted even in small files (bytes): a chunk expands when decompressed.
    const LARGE: u64 = 32 << 20;
    const READ_BYTES: usize = 64 << 10;

    let mut file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
    let length = file.metadata().map_err(LogError::io(path, "read the recording"))?.len();
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true) // a damaged chunk gives an error at once, rather than some numbers first
        .with_record_length_limit(usize::try_from(length.max(LARGE)).unwrap_or(usize::MAX));
    let mut reader = LinearReader::new_with_options(options);
    let (most, mut unpacked) = (flexarm_files::most_unpacked(length), 0);
    loop {
        let from = &mut reader;
        let event = match caught(move || from.next_event()) {
            Ok(Some(event)) => event,
            Ok(None) => break,
            Err(panic) => return Ok(Some(panic.to_string())),
        };
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let size = usize::try_from(length.max(LARGE)).unwrap_or(usize::MAX).min(wanted).max(READ_BYTES);
                let read = file.read(reader.insert(size)).map_err(LogError::io(path, "read the recording"))?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { opcode, data }) => {
                unpacked += 9 + data.len() as u64; // with kind and length
                if unpacked > most {
                    return Ok(Some(format!("it unpacks to more than {most} bytes, the limit for its size")));
                }
                match texts_fit(opcode, data) {
                    Some(true) => {}
                    Some(false) => return Ok(Some("damaged: a text is longer than its record".into())),
                    None => continue,
                }
                let record = match caught(move || mcap::parse_record(opcode, data)) {
                    Ok(Ok(record)) => record,
                    Ok(Err(error)) => return Ok(Some(in_words(&error))),
                    Err(panic) => return Ok(Some(panic.to_string())),
                };
                if take(record)? == Flow::Stop {
                    return Ok(None);
                }
            }
            Err(error) => return Ok(Some(in_words(&error))),
        }
    }
    Ok(None)
}

/// Whether the texts of a record are within it: the library allocates memory for them before it
/// checks. `None` for records without data of a run, such as the index.
fn texts_fit(kind: u8, record: &[u8]) -> Option<bool> {
    // Number of bytes before the first text; number of texts (or other length-prefixed fields);
    // whether pairs of texts follow.
    let (before, texts, pairs) = match kind {
        op::HEADER => (0, 2, false),
        op::FOOTER | op::MESSAGE => return Some(true),
        op::SCHEMA => (2, 3, false),
        op::CHANNEL => (4, 2, true),
        op::ATTACHMENT => (16, 2, false),
        op::METADATA => (0, 1, true),
        _ => return None,
    };
    fn text<'r>(rest: &mut &'r [u8]) -> Option<&'r [u8]> {
        let (length, behind) = rest.split_first_chunk()?;
        let (text, behind) = behind.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
        *rest = behind;
        Some(text)
    }
    let walk = || {
        let mut rest = record.get(before..)?;
        for _ in 0..texts {
            text(&mut rest)?;
        }
        let mut list = if pairs { text(&mut rest)? } else { &[] };
        while !list.is_empty() {
            text(&mut list)?;
        }
        Some(())
    };
    Some(walk().is_some())
}

fn in_words(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => "its end is missing".into(),
        McapError::BadChunkCrc { .. } => "a checksum does not fit".into(),
        other => format!("damaged: {other}"),
    }
}
