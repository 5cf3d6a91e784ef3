//! The file itself: chunks closed where the data says so, and a provisional end behind them while the run goes on.

use std::collections::BTreeMap;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapResult, WriteOptions, Writer};

use super::cdr::Cdr;
use super::messages::Stamp;
use super::provisional::{Index, MESSAGE_OVERHEAD, messages_within, push_message};
use crate::tail_file::SharedTail;

/// Uncompressed size at which a chunk is closed.
const CHUNK_BYTES: usize = 1 << 20;

/// Level of zstd. On chunks of runs level 1 takes half the time of level 3, which is zstd's own choice, and 2 % more room.
const COMPRESSION: u32 = 1;

/// An MCAP file in the making. Keeps the open chunk in memory and writes it whole.
pub(crate) struct Output {
    writer: Writer<SharedTail>,
    file: SharedTail,
    /// Message records of the open chunk, as they are in it.
    chunk: Vec<u8>,
    /// Bytes of the open chunk that are in the file already, provisionally.
    shown: usize,
    /// What a provisional end says about the rest of the file.
    index: Index,
    cdr: Cdr,
}

impl Output {
    pub(crate) fn new(file: SharedTail) -> McapResult<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("flexarm ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None) // closed by `send`, which knows what is in it
            .disable_seeking(true)
            .compression_level(COMPRESSION)
            .compression_threads(0); // same bytes on every machine
        let writer = options.create(file.clone())?;
        Ok(Self { writer, file, chunk: Vec::new(), shown: 0, index: Index::new(), cdr: Cdr::default() })
    }

    /// Adds a topic of ROS 2 messages; returns its number.
    pub(crate) fn add_channel(
        &mut self,
        topic: &str,
        kind: &str,
        definition: &str,
        metadata: &BTreeMap<String, String>,
    ) -> McapResult<u16> {
        const ENCODING: &str = "ros2msg";
        let schema = self.writer.add_schema(kind, ENCODING, definition.as_bytes())?;
        self.index.schema(schema, kind, ENCODING, definition.as_bytes());
        let channel = self.writer.add_channel(schema, topic, "cdr", metadata)?;
        self.index.channel(channel, schema, topic, metadata);
        Ok(channel)
    }

    /// Adds a message to the open chunk, or to a new one if it would grow too large. The `sequence` of a topic counts up.
    pub(crate) fn send(
        &mut self,
        channel_id: u16,
        sequence: u32,
        stamp: Stamp,
        write: impl FnOnce(&mut Cdr),
    ) -> McapResult<()> {
        write(&mut self.cdr);
        let header = MessageHeader { channel_id, sequence, log_time: stamp.0, publish_time: stamp.0 };
        let size = MESSAGE_OVERHEAD + self.cdr.bytes().len();
        if !self.chunk.is_empty() && self.chunk.len() + size > CHUNK_BYTES {
            self.close_chunk()?;
        }
        push_message(&mut self.chunk, &header, self.cdr.bytes());
        self.writer.write_to_known_channel(&header, self.cdr.bytes())
    }

    pub(crate) fn close_chunk(&mut self) -> McapResult<()> {
        self.chunk.clear();
        self.shown = 0;
        self.writer.flush()
    }

    /// Whether so much is held back that [`Output::flush`] should be called even before its time.
    pub(crate) fn is_full(&self) -> bool {
        self.file.is_full()
    }

    /// Brings everything so far into the file: closed chunks for good, the open one and an index provisionally.
    pub(crate) fn flush(&mut self) -> std::io::Result<()> {
        let index = &mut self.index;
        self.file.look(|start, pending| index.read(start, pending));
        let end = self.file.position();
        let written = self.file.set_tail(&self.index.end(end, &self.chunk));
        match written {
            Ok(()) => self.shown = self.chunk.len(),
            Err(_) => self.show_what_fits(end),
        }
        written
    }

    /// On a full disk: the closed chunks, and as much of the open one as there is room for.
    fn show_what_fits(&mut self, end: u64) {
        // Without a closed chunk that waits, the file must not be left with less than it shows.
        let least = if self.file.pending() > 0 { None } else { Some(self.shown) };
        let mut part = self.chunk.len();
        while part > 0 {
            part = messages_within(&self.chunk, part / 2);
            if least.is_some_and(|least| part <= least) {
                return;
            }
            if self.file.set_tail(&self.index.end(end, &self.chunk[..part])).is_ok() {
                self.shown = part;
                return;
            }
        }
    }

    pub(crate) fn metadata(&mut self, name: &str, pairs: impl IntoIterator<Item = (String, String)>) -> McapResult<()> {
        let metadata = BTreeMap::from_iter(pairs);
        self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata })
    }

    pub(crate) fn attach(&mut self, stamp: Stamp, file: &crate::Attachment) -> McapResult<()> {
        self.writer.attach(&mcap::Attachment {
            log_time: stamp.0,
            create_time: 0, // unknown, and a run's file must not depend on the day
            name: file.name.clone(),
            media_type: file.media_type.clone(),
            data: file.bytes.as_slice().into(),
        })
    }

    /// Closes the open chunk and writes the index.
    pub(crate) fn finish(&mut self) -> McapResult<()> {
        self.writer.finish()?;
        Ok(self.file.flush()?)
    }
}
