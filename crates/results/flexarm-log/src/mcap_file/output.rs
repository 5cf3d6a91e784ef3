//! The output file: the writer of the `mcap` crate, chunks closed by size or simulated time, and a
//! sink that only receives whole records.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};
use serde::Serialize;

use super::bag::Bag;
use super::channels::QUALITY_OF_SERVICE;
use super::messages::{Stamp, encode};
use crate::written_behind::WrittenBehind;

/// Limits at which a chunk is closed: size of its messages (bytes) and span of simulated time (ns).
/// A killed run loses at most one chunk.
const CHUNK_BYTES: usize = 1 << 20;
const CHUNK_NS: u64 = 500_000_000;

/// Level of zstd. On chunks of runs, level 1 takes half the time of level 3, zstd's default, and 2
/// % more space.
#[cfg(not(target_family = "wasm"))]
const COMPRESSION: u32 = 1;

/// Capacity of the buffers kept for the next message and the next chunk (bytes).
const KEPT_MESSAGE: usize = 64 << 10;
const KEPT_BYTES: usize = 2 * CHUNK_BYTES;

/// An MCAP file that is being written.
pub(crate) struct Output {
    writer: Writer<NoSeek<WholeRecords>>,
    /// Size of the messages in the open chunk (bytes), and time of the first.
    chunk_bytes: usize,
    begun: Option<Stamp>,
    /// Bytes of the last message; buffer reused.
    message: Vec<u8>,
    bag: Bag,
    /// Whether the writer is finished and must not be called any more.
    finished: bool,
}

impl Output {
    pub(crate) fn new(file: File) -> io::Result<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("flexarm ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None) // see `is_full`
            .disable_seeking(true);
        #[cfg(not(target_family = "wasm"))] // WebAssembly is built without zstd, which is C
        let options = options.compression_level(COMPRESSION).compression_threads(0);
        let writer = options.create(NoSeek::new(WholeRecords::new(file))).map_err(io_error)?;
        Ok(Self { writer, chunk_bytes: 0, begun: None, message: Vec::new(), bag: Bag::default(), finished: false })
    }

    /// Adds a topic of ROS 2 messages; returns its channel number.
    pub(crate) fn add_channel(
        &mut self,
        topic: &str,
        kind: &str,
        definition: &str,
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<u16> {
        self.bag.add(topic, kind, metadata.get(QUALITY_OF_SERVICE).map_or("", String::as_str));
        let schema = self.writer.add_schema(kind, "ros2msg", definition.as_bytes()).map_err(io_error)?;
        self.writer.add_channel(schema, topic, "cdr", metadata).map_err(io_error)
    }

    /// Adds a message to the open chunk. `sequence` counts the messages of a topic.
    pub(crate) fn send(
        &mut self,
        channel: u16,
        sequence: u32,
        stamp: Stamp,
        message: impl Serialize,
    ) -> io::Result<()> {
        encode(message, &mut self.message)?;
        self.chunk_bytes += self.message.len();
        self.begun.get_or_insert(stamp);
        self.bag.count(channel, stamp.0);
        let header = MessageHeader { channel_id: channel, sequence, log_time: stamp.0, publish_time: stamp.0 };
        self.writer.write_to_known_channel(&header, &self.message).map_err(io_error)
    }

    /// Whether the chunk is to be closed. This depends only on the messages, never on the clock.
    pub(crate) fn is_full(&self, now: Stamp) -> bool {
        let begun = self.begun.unwrap_or(now);
        self.chunk_bytes >= CHUNK_BYTES || now.0.saturating_sub(begun.0) >= CHUNK_NS
    }

    /// Closes the chunk and writes everything so far to the file. After an error the file is
    /// unchanged.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io_error)?;
        (self.chunk_bytes, self.begun) = (0, None);
        self.message.clear();
        self.message.shrink_to(KEPT_MESSAGE);
        Ok(())
    }

    pub(crate) fn metadata(&mut self, name: &str, pairs: impl IntoIterator<Item = (String, String)>) -> io::Result<()> {
        let metadata = pairs.into_iter().collect();
        self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata }).map_err(io_error)
    }

    pub(crate) fn attach(&mut self, stamp: Stamp, file: &crate::Attachment) -> io::Result<()> {
        let attachment = mcap::Attachment {
            log_time: stamp.0,
            create_time: 0, // unknown, and the file must not depend on the date
            name: file.name.clone(),
            media_type: file.media_type.clone(),
            data: file.bytes.as_slice().into(),
        };
        self.writer.attach(&attachment).map_err(io_error)
    }

    /// Writes the record that ROS 2 expects in a bag.
    pub(crate) fn describe_bag(&mut self) -> io::Result<()> {
        self.writer.write_metadata(&self.bag.record()).map_err(io_error)
    }

    /// Closes the chunk and writes the index; does nothing when called again.
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.finished, true) {
            return Ok(());
        }
        // Flush first, so that the chunk is kept if there is no room for the index.
        self.writer.flush().and_then(|()| self.writer.finish()).map(drop).map_err(io_error)
    }
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// Buffers the library's output until it asks for a flush, which it does only after whole records.
pub struct WholeRecords {
    /// The file.
    pub file: File,
    waiting: Vec<u8>,
    written: u64,
    behind: WrittenBehind,
}

impl WholeRecords {
    /// Writes to the start of an empty file.
    pub fn new(file: File) -> Self {
        Self { file, waiting: Vec::new(), written: 0, behind: WrittenBehind::default() }
    }
}

impl Write for WholeRecords {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.waiting.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    /// Writes the buffer. On failure (full disk) the buffer is kept and the file is restored.
    fn flush(&mut self) -> io::Result<()> {
        if let Err(error) = self.file.write_all(&self.waiting) {
            // An error while restoring is ignored: the first error is returned.
            let _ = self.file.set_len(self.written).and_then(|()| self.file.seek(SeekFrom::Start(self.written)));
            return Err(error);
        }
        self.written += self.waiting.len() as u64;
        self.waiting.clear();
        self.waiting.shrink_to(KEPT_BYTES);
        self.behind.advance(&self.file, self.written);
        Ok(())
    }
}
