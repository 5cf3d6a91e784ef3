//! Messages of an MCAP file, record by record from its beginning: the index at its end is not needed, so a file that is cut
//! off is read up to there.
//!
//! Three of the records matter here (schema, channel, message) and the chunk around them. Lengths are held against what is
//! there before anything is taken for them.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::collect::Collector;
use crate::error::{MotionError, Problem, Trouble};
use crate::unpack::{MOST_BYTES, Packing, unpacked};
use crate::{MessageMotion, Request};

/// First bytes of an MCAP file.
pub const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Kinds of records.
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0F;

/// Reads an MCAP file.
///
/// # Errors
/// [`MotionError::Read`], or [`MotionError::Content`] for what is no MCAP file, a topic that is not there, messages that
/// cannot be read, and bags without a motion of the joints that are wanted.
pub fn read_mcap(path: &Path, request: &Request<'_>) -> Result<MessageMotion, MotionError> {
    crate::folder::read_files(&[path.to_owned()], path, request)
}

pub(crate) fn collect_file(path: &Path, into: &mut Collector<'_>) -> Result<Option<String>, MotionError> {
    let failed = |source| MotionError::Read { path: path.to_owned(), source };
    collect(BufReader::new(File::open(path).map_err(failed)?), into)
        .map_err(|trouble| trouble.of(&path.display().to_string()))
}

/// Collects the messages of a file; why it ends before its end, if it does.
pub(crate) fn collect(mut file: impl Read, into: &mut Collector<'_>) -> Result<Option<String>, Trouble> {
    let container = |what: String| Trouble::new(Problem::Container { container: "MCAP file", what });
    let mut magic = [0; 8];
    if file.read_exact(&mut magic).is_err() || magic != MCAP_MAGIC {
        return Err(container("it does not begin as one".to_owned()));
    }
    let mut known = Known::default();
    loop {
        let mut head = [0; 9];
        if let Err(error) = file.read_exact(&mut head) {
            return Ok(Some(cut(&error)));
        }
        let (kind, length) = (head[0], u64::from_le_bytes(head[1..].try_into().unwrap_or_default()));
        match kind {
            DATA_END | FOOTER => return Ok(None),
            SCHEMA | CHANNEL | MESSAGE | CHUNK => {}
            _ => {
                // What says nothing here, such as an index or an attachment.
                match std::io::copy(&mut (&mut file).take(length), &mut std::io::sink()) {
                    Ok(skipped) if skipped == length => continue,
                    Ok(_) => return Ok(Some("its end is missing".to_owned())),
                    Err(error) => return Ok(Some(cut(&error))),
                }
            }
        }
        let mut body = Vec::new();
        let read = (&mut file).take(length.min(MOST_BYTES)).read_to_end(&mut body);
        let is_whole = body.len() as u64 == length;
        if let Err(error) = read {
            return Ok(Some(cut(&error)));
        }
        if length > MOST_BYTES && body.len() as u64 == MOST_BYTES {
            return Err(container(format!("a record of {length} bytes, at most {MOST_BYTES} are read at once")));
        }
        // A chunk that is cut off still has the messages before the cut.
        let broken = match kind {
            CHUNK => known.chunk(&body, into)?,
            _ if is_whole => known.record(kind, &body, into)?,
            _ => None,
        };
        if broken.is_some() || !is_whole {
            return Ok(broken.or_else(|| Some("its end is missing".to_owned())));
        }
    }
}

fn cut(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::UnexpectedEof => "its end is missing".to_owned(),
        _ => format!("it cannot be read on ({error})"),
    }
}

/// What records are about.
#[derive(Default)]
struct Known {
    /// Name, encoding and text of each schema.
    schemas: HashMap<u16, (String, String, String)>,
    /// Number of the topic of each channel.
    channels: HashMap<u16, usize>,
}

impl Known {
    /// The records of a chunk, as far as it goes.
    fn chunk(&mut self, body: &[u8], into: &mut Collector<'_>) -> Result<Option<String>, Trouble> {
        let head = || {
            let mut rest = body.get(24..)?;
            let _crc: [u8; 4] = take(&mut rest)?;
            let packing = text(&mut rest)?;
            let _length: [u8; 8] = take(&mut rest)?;
            Some((packing, rest))
        };
        let Some((packing, packed)) = head() else { return Ok(Some("its end is missing".to_owned())) };
        let crc = body.get(24..28).and_then(|bytes| bytes.try_into().ok()).map_or(0, u32::from_le_bytes);
        let (records, broken) = match packing.as_str() {
            "" => (packed.to_vec(), None),
            "zstd" => unpacked(Packing::Zstd, packed),
            "lz4" => unpacked(Packing::Lz4, packed),
            other => {
                let what = format!("a chunk is packed by {other:?}; read are zstd, lz4 and none");
                return Err(Trouble::new(Problem::Container { container: "MCAP file", what }));
            }
        };
        let size = body.get(16..24).and_then(|bytes| bytes.try_into().ok()).map_or(0, u64::from_le_bytes);
        if broken.is_none() && records.len() as u64 == size && crc != 0 && crc32(&records) != crc {
            return Ok(Some("a checksum does not fit".to_owned()));
        }
        let mut rest = &records[..];
        while !rest.is_empty() {
            let record = || {
                let (kind, behind) = rest.split_first()?;
                let (length, behind) = behind.split_first_chunk::<8>()?;
                let (record, behind) = behind.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
                Some((*kind, record, behind))
            };
            let Some((kind, record, behind)) = record() else {
                return Ok(broken.or_else(|| Some("its end is missing".to_owned())));
            };
            if let Some(broken) = self.record(kind, record, into)? {
                return Ok(Some(broken));
            }
            rest = behind;
        }
        Ok(broken)
    }

    /// A record outside of or in a chunk; what is wrong with it, if anything.
    fn record(&mut self, kind: u8, body: &[u8], into: &mut Collector<'_>) -> Result<Option<String>, Trouble> {
        let mut rest = body;
        let done = match kind {
            SCHEMA => self.schema(&mut rest),
            CHANNEL => self.channel(&mut rest, into),
            MESSAGE => {
                let head = || {
                    let channel = u16::from_le_bytes(take(&mut rest)?);
                    let _sequence: [u8; 4] = take(&mut rest)?;
                    let log = u64::from_le_bytes(take(&mut rest)?);
                    let _published: [u8; 8] = take(&mut rest)?;
                    Some((channel, log))
                };
                let mut head = head;
                match head() {
                    None => None,
                    Some((channel, log)) => {
                        if let Some(&topic) = self.channels.get(&channel) {
                            into.bytes(topic, i64::try_from(log).unwrap_or(i64::MAX), rest)?;
                        }
                        Some(())
                    }
                }
            }
            _ => Some(()),
        };
        Ok(done.is_none().then(|| "damaged: a record ends within a value".to_owned()))
    }

    fn schema(&mut self, rest: &mut &[u8]) -> Option<()> {
        let id = u16::from_le_bytes(take(rest)?);
        let (name, encoding, definition) = (text(rest)?, text(rest)?, text(rest)?);
        self.schemas.insert(id, (name, encoding, definition));
        Some(())
    }

    fn channel(&mut self, rest: &mut &[u8], into: &mut Collector<'_>) -> Option<()> {
        let id = u16::from_le_bytes(take(rest)?);
        let schema = u16::from_le_bytes(take(rest)?);
        let (topic, encoding) = (text(rest)?, text(rest)?);
        let (message, how, definition) =
            self.schemas.get(&schema).map_or(("", "", ""), |(name, how, text)| (name, how, text));
        let definition = Some(definition).filter(|_| how == "ros2msg" || how == "ros1msg");
        self.channels.insert(id, into.topic(&topic, message, &encoding, definition));
        Some(())
    }
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, behind) = rest.split_first_chunk::<N>()?;
    *rest = behind;
    Some(*bytes)
}

fn text(rest: &mut &[u8]) -> Option<String> {
    let length = u32::from_le_bytes(take(rest)?) as usize;
    let (bytes, behind) = rest.split_at_checked(length)?;
    *rest = behind;
    Some(String::from_utf8_lossy(bytes).into_owned())
}

/// The checksum of chunks (CRC-32 of IEEE 802.3), eight bits at a time.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut i = 0;
        while i < 256 {
            let (mut value, mut bit) = (i as u32, 0);
            while bit < 8 {
                value = if value & 1 == 1 { 0xEDB8_8320 ^ (value >> 1) } else { value >> 1 };
                bit += 1;
            }
            table[i] = value;
            i += 1;
        }
        table
    };
    !bytes.iter().fold(!0, |crc, &byte| TABLE[((crc ^ u32::from(byte)) & 0xFF) as usize] ^ (crc >> 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_of_the_nine_digits_is_the_one_of_the_standard() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }
}
