//! The messages of an .rrd file, one after the other, with every size checked before memory is taken for it.
//!
//! ```text
//! file      "RRF2", version, options;  messages;  a footer, which is not needed here
//! message   kind, length (8 bytes each);  protobuf
//! chunk     size unpacked, LZ4 block;  in it a stream of Arrow: schema, record batch
//! Arrow     0xffffffff, length of the description;  the description (flatbuffer) with the length of what follows;  that
//! ```
//! The `rerun` crate believes all of these sizes. Start at [`Messages::open`].

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::rerun::arrow::ipc;
use crate::rerun::lz4_flex;
use crate::rerun::{Chunk, LogMsg};
use re_log_encoding::{
    CachingApplicationIdInjector, CrateVersion, Decodable, DecoderEntrypoint, MessageHeader, MessageKind, StreamHeader,
    ToApplication, ToTransport,
};
use re_log_types::ArrowMsg;

use super::wall::caught;
use crate::LogError;

/// A message as it is in the file.
type Packed = <LogMsg as ToTransport>::Output;
/// A chunk as it is in the file.
type PackedChunk = <ArrowMsg as ToTransport>::Output;

/// The number of LZ4 in the file.
const LZ4: i32 = 2;
const NOT_PACKED: i32 = 1;

/// A file being read.
pub(super) struct Messages {
    file: BufReader<File>,
    /// Bytes that are still to come.
    left: u64,
    version: Option<CrateVersion>,
    names: CachingApplicationIdInjector,
    over: bool,
}

/// What a message says.
pub(super) enum Message {
    /// A recording begins, of the program with this name.
    Recording(String),
    /// Rows of a recording.
    Rows(Box<Chunk>),
    /// Nothing that matters here.
    Other,
}

impl Messages {
    pub(super) fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
        let left = file.metadata().map_err(LogError::io(path, "read the recording"))?.len();
        let names = CachingApplicationIdInjector::default();
        Ok(Self { file: BufReader::new(file), left, version: None, names, over: false })
    }

    /// The next message, `None` behind the last one.
    ///
    /// # Errors
    /// In words, why the file ends before its end; there is nothing behind an error.
    pub(super) fn next(&mut self) -> Result<Option<Message>, String> {
        if self.over {
            return Ok(None);
        }
        let message = self.read();
        self.over = !matches!(message, Ok(Some(_)));
        message
    }

    fn read(&mut self) -> Result<Option<Message>, String> {
        if self.version.is_none() {
            let bytes = self.take(StreamHeader::ENCODED_SIZE_BYTES as u64)?.ok_or("its beginning is missing")?;
            let header = caught(|| StreamHeader::from_rrd_bytes(&bytes)?.to_version_and_options())?;
            self.version = Some(header.map_err(damaged)?.0);
        }
        let Some(header) = self.take(MessageHeader::ENCODED_SIZE_BYTES as u64)? else { return Ok(None) };
        let MessageHeader { kind, len } = MessageHeader::from_rrd_bytes(&header).map_err(damaged)?;
        if kind == MessageKind::End {
            return Ok(None);
        }
        let bytes = self.take(len)?.ok_or("its end is missing")?;
        let (names, version) = (&mut self.names, self.version);
        caught(move || match kind {
            MessageKind::ArrowMsg => rows(&bytes, names, version),
            MessageKind::SetStoreInfo => {
                let message = LogMsg::decode(bytes.into(), Default::default(), kind, names, version);
                Ok(match message.map_err(damaged)? {
                    Some(LogMsg::SetStoreInfo(store)) if store.info.store_id.is_recording() => {
                        Message::Recording(store.info.store_id.application_id().to_string())
                    }
                    _ => Message::Other,
                })
            }
            _ => Ok(Message::Other),
        })?
        .map(Some)
    }

    /// So many bytes, all of which must be there; `None` at the very end.
    fn take(&mut self, length: u64) -> Result<Option<Vec<u8>>, String> {
        if self.left == 0 && length > 0 {
            return Ok(None);
        }
        if length > self.left {
            return Err("its end is missing".into());
        }
        let mut bytes = vec![0; length as usize];
        self.file.read_exact(&mut bytes).map_err(|error| format!("cannot be read on: {error}"))?;
        self.left -= length;
        Ok(Some(bytes))
    }
}

/// What the library says, on one short line.
fn damaged(error: impl std::fmt::Display) -> String {
    let text: String = error.to_string().chars().take_while(|c| !c.is_control()).take(120).collect();
    format!("damaged: {text}")
}

/// The rows of a chunk of a recording; those of layouts are passed over.
fn rows(
    bytes: &[u8],
    names: &mut CachingApplicationIdInjector,
    version: Option<CrateVersion>,
) -> Result<Message, String> {
    let mut chunk = PackedChunk::from_rrd_bytes(bytes).map_err(damaged)?;
    unpack(&mut chunk)?;
    check_arrow(&chunk.payload)?;
    match Packed::ArrowMsg(chunk).to_application((names, version)).map_err(damaged)? {
        LogMsg::ArrowMsg(store, message) if store.is_recording() => {
            Chunk::from_arrow_msg(&message).map(|chunk| Message::Rows(Box::new(chunk))).map_err(damaged)
        }
        _ => Ok(Message::Other),
    }
}

/// Unpacks a chunk in place.
fn unpack(chunk: &mut PackedChunk) -> Result<(), String> {
    if chunk.compression != LZ4 {
        return Ok(());
    }
    let (claimed, size) = (chunk.uncompressed_size, unpacked_size(&chunk.payload));
    if size != Some(claimed) {
        let packed = chunk.payload.len();
        return Err(format!("damaged: a chunk of {packed} bytes claims to unpack to {claimed}, which it does not"));
    }
    let mut unpacked = vec![0; claimed as usize];
    lz4_flex::block::decompress_into(&chunk.payload, &mut unpacked).map_err(damaged)?;
    (chunk.payload, chunk.compression) = (unpacked.into(), NOT_PACKED);
    Ok(())
}

/// Number of bytes that an LZ4 block unpacks to, `None` if it breaks off: the sum of the lengths in it. A length of 15 goes on
/// in the next bytes, up to one that is not 255.
fn unpacked_size(block: &[u8]) -> Option<u64> {
    let mut bytes = block.iter().copied();
    let whole = |start: u8, bytes: &mut dyn Iterator<Item = u8>| {
        let mut length = u64::from(start);
        let mut last = if start == 15 { 255 } else { 0 };
        while last == 255 {
            last = bytes.next()?;
            length += u64::from(last);
        }
        Some(length)
    };
    let mut size = 0;
    loop {
        let token = bytes.next()?;
        let literals = whole(token >> 4, &mut bytes)?;
        size += literals;
        if literals > 0 {
            bytes.nth(usize::try_from(literals).ok()? - 1)?;
        }
        if bytes.len() == 0 {
            return Some(size);
        }
        bytes.nth(1)?; // from how far back the next ones are copied
        size += 4 + whole(token & 15, &mut bytes)?;
    }
}

/// Checks the lengths in a stream of Arrow: of descriptions, of what they describe, and of each buffer and column in that.
fn check_arrow(stream: &[u8]) -> Result<(), String> {
    const MARK: u32 = u32::MAX;
    let word = |at: usize| stream.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes);
    let mut at = 0;
    while let Some(mut length) = word(at) {
        at += 4;
        if length == MARK {
            length = word(at).ok_or("damaged: a chunk breaks off")?;
            at += 4;
        }
        if length == 0 {
            return Ok(()); // the end of the stream
        }
        let description = stream.get(at..at.saturating_add(length as usize)).ok_or("damaged: a chunk breaks off")?;
        at += description.len();
        let message = ipc::root_as_message(description).map_err(damaged)?;
        let body = usize::try_from(message.bodyLength()).ok().and_then(|body| stream.get(at..at.checked_add(body)?));
        let body = body
            .ok_or_else(|| format!("damaged: rows of {} bytes in a chunk of {}", message.bodyLength(), stream.len()))?;
        at += body.len();
        let batch = message.header_as_record_batch();
        if let Some(batch) = batch.or_else(|| message.header_as_dictionary_batch()?.data()) {
            check_batch(&batch, body.len(), stream.len()).ok_or("damaged: a column is larger than its chunk")?;
        }
    }
    Ok(())
}

/// Whether all columns are within `body` bytes, and no column has more rows than its chunk has bytes.
fn check_batch(batch: &ipc::RecordBatch<'_>, body: usize, stream: usize) -> Option<()> {
    let within = |length: i64, most: usize| usize::try_from(length).ok().filter(|length| *length <= most);
    if batch.compression().is_some() {
        return None; // nobody packs twice
    }
    within(batch.length(), stream)?;
    for node in batch.nodes()? {
        within(node.length(), stream)?;
        within(node.null_count(), stream)?;
    }
    for buffer in batch.buffers()? {
        within(buffer.offset().checked_add(within(buffer.length(), body)? as i64)?, body)?;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the library packs what is then measured; blocks that break off have no size.
    #[test]
    fn a_block_tells_its_size_before_it_is_unpacked() {
        let noise = (0..40_000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8);
        for bytes in [vec![], vec![7; 14], vec![0; 1_000_000], (0..=255).collect(), noise.collect()] {
            let block = lz4_flex::block::compress(&bytes);
            assert_eq!(unpacked_size(&block), Some(bytes.len() as u64));
            assert_eq!(unpacked_size(&block[..block.len() - 1]).filter(|size| *size >= bytes.len() as u64), None);
        }
    }
}
