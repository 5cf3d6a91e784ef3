//! Messages of an MCAP file, record by record from the beginning: the index at the end is not
//! needed, so a truncated file is read up to its last complete chunk.
//!
//! The `mcap` crate iterates over the records and decompresses chunks; three kinds of records are
//! used here (schema, channel, message).

use std::collections::HashMap;
use std::io::{Cursor, ErrorKind, Read};

use lz4_flex::frame::FrameDecoder;
use mcap::records::{Record, op};
use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};

use crate::collect::Collector;
use crate::error::PlacedProblem;

/// First bytes of an MCAP file.
pub const MCAP_MAGIC: &[u8] = mcap::MAGIC;

/// Maximum size of a record, or of a decompressed chunk, in bytes: the library allocates a chunk
/// before decompressing it.
const MAX_BYTES: usize = 256 << 20;
/// Number of bytes read at once, regardless of the stated length of a record.
const READ_BYTES: usize = 64 << 10;

/// Collects the messages of a file. Returns the reason if it ends prematurely.
///
/// * `most`: maximum size of all records, bytes.
pub(crate) fn collect(
    mut file: impl Read,
    most: u64,
    into: &mut Collector<'_>,
) -> Result<Option<String>, PlacedProblem> {
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true) // a damaged chunk is dropped as a whole
        .with_record_length_limit(MAX_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    reader.add_decompressor(Lz4::default()).expect("it has a name");
    let mut known = SchemasAndChannels::default();
    let mut unpacked = 0;
    while let Some(event) = reader.next_event() {
        let cut = match event {
            Ok(LinearReadEvent::ReadRequest(_)) => match file.read(reader.insert(READ_BYTES)) {
                Ok(read) => {
                    reader.notify_read(read);
                    None
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => None,
                Err(error) => Some(format!("it cannot be read on ({error})")),
            },
            Ok(LinearReadEvent::Record { opcode: op::DATA_END, .. }) => return Ok(None),
            Ok(LinearReadEvent::Record { opcode, data }) => {
                unpacked += 9 + data.len() as u64; // with kind and length
                match unpacked > most {
                    true => Some(format!("it unpacks to more than {most} bytes, the limit for its size")),
                    false => known.record(opcode, data, into)?,
                }
            }
            Err(error) => Some(in_words(error)),
        };
        if cut.is_some() {
            return Ok(cut);
        }
    }
    Ok(Some("its end is missing".to_owned()))
}

/// Describes the reason why reading stops.
fn in_words(error: McapError) -> String {
    match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => "its end is missing".to_owned(),
        McapError::BadChunkCrc { .. } => "a checksum does not fit".to_owned(),
        McapError::RecordTooLarge { len: length, .. } | McapError::ChunkTooLarge(length) => {
            format!("a record or chunk has a length of {length} bytes; the limit is {MAX_BYTES}")
        }
        McapError::UnsupportedCompression(other) => {
            let zstd = if cfg!(target_family = "wasm") { "" } else { "zstd, " };
            format!("a chunk is packed by {other:?}; read are {zstd}lz4 and none")
        }
        McapError::DecompressionError(what) => format!("its compressed content is damaged or incomplete ({what})"),
        other => format!("damaged: {other}"),
    }
}

/// Decompressor of lz4 chunks.
struct Lz4(FrameDecoder<Cursor<Vec<u8>>>);

impl Default for Lz4 {
    fn default() -> Self {
        Self(FrameDecoder::new(Cursor::default()))
    }
}

impl Decompressor for Lz4 {
    fn name(&self) -> &'static str {
        "lz4"
    }

    /// Requests the whole chunk: the decoder cannot resume in the middle of its input.
    fn next_read_size(&self) -> usize {
        usize::MAX
    }

    fn decompress(&mut self, packed: &[u8], records: &mut [u8]) -> McapResult<DecompressResult> {
        if !packed.is_empty() {
            self.0 = FrameDecoder::new(Cursor::new(packed.to_vec()));
        }
        let wrote = self.0.read(records).map_err(|error| McapError::DecompressionError(error.to_string()))?;
        Ok(DecompressResult { consumed: packed.len(), wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        *self = Self::default();
        Ok(())
    }
}

/// Schemas and channels read so far.
#[derive(Default)]
struct SchemasAndChannels {
    /// Name, encoding and text of each schema.
    schemas: HashMap<u16, [String; 3]>,
    /// Topic index of each channel.
    channels: HashMap<u16, usize>,
}

impl SchemasAndChannels {
    /// Processes a record. Returns a description of the problem, if any.
    fn record(&mut self, kind: u8, body: &[u8], into: &mut Collector<'_>) -> Result<Option<String>, PlacedProblem> {
        let done = match kind {
            op::SCHEMA => self.schema(body),
            op::CHANNEL => self.channel(body, into),
            op::MESSAGE => {
                let Ok(Record::Message { header, data }) = mcap::parse_record(kind, body) else { return Ok(damaged()) };
                if let Some(&topic) = self.channels.get(&header.channel_id) {
                    into.bytes(topic, i64::try_from(header.log_time).unwrap_or(i64::MAX), &data)?;
                }
                Some(())
            }
            _ => Some(()),
        };
        Ok(if done.is_none() { damaged() } else { None })
    }

    fn schema(&mut self, mut rest: &[u8]) -> Option<()> {
        let id = number(&mut rest)?;
        self.schemas.insert(id, [text(&mut rest)?, text(&mut rest)?, text(&mut rest)?]);
        Some(())
    }

    fn channel(&mut self, mut rest: &[u8], into: &mut Collector<'_>) -> Option<()> {
        let (id, schema) = (number(&mut rest)?, number(&mut rest)?);
        let (topic, encoding) = (text(&mut rest)?, text(&mut rest)?);
        let [message, how, definition] =
            self.schemas.get(&schema).map_or([""; 3], |s| s.each_ref().map(String::as_str));
        let definition = Some(definition).filter(|_| how == "ros2msg" || how == "ros1msg");
        self.channels.insert(id, into.topic(&topic, message, &encoding, definition));
        Some(())
    }
}

fn damaged() -> Option<String> {
    Some("damaged: a record ends within a value".to_owned())
}

fn number(rest: &mut &[u8]) -> Option<u16> {
    let (bytes, behind) = rest.split_first_chunk()?;
    *rest = behind;
    Some(u16::from_le_bytes(*bytes))
}

/// Reads a string from a record. The library's own parser allocates the stated length before
/// checking that the bytes exist.
fn text(rest: &mut &[u8]) -> Option<String> {
    let (length, behind) = rest.split_first_chunk()?;
    let (bytes, behind) = behind.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *rest = behind;
    Some(String::from_utf8_lossy(bytes).into_owned())
}
