//! The file itself: chunks closed where the data says so, and a provisional end behind them while the run goes on.
//!
//! Chunks are put together in memory and compressed as a whole. The library of the format takes a message in eight pieces,
//! each through the compressor and two checksums by itself, which costs as much as the compression, and a compressor that
//! sees a chunk piece by piece copies it and looks in two places for what it has seen.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Cursor, Write};

use zstd::bulk::Compressor;
use zstd::zstd_safe::compress_bound;

use super::cdr::Cdr;
use super::chunk::OpenChunk;
use super::index::Index;
use super::messages::Stamp;
use super::records::{ATTACHMENT, Body, CHANNEL, HEADER, METADATA, SCHEMA, push_head};
use crate::tail_file::TailFile;

/// Uncompressed size at which a chunk is closed, and the same for chunks behind so many bytes: the list of chunks is in memory
/// until the file ends, and is part of each provisional end.
const CHUNK_BYTES: usize = 1 << 20;
const LONG_CHUNK_BYTES: usize = 2 * CHUNK_BYTES;
const LONG_FILE_BYTES: u64 = 64 << 20;

/// Memory that is used again: of a chunk with its indexes, and of a message.
const KEPT_BYTES: usize = LONG_CHUNK_BYTES + LONG_CHUNK_BYTES / 8;
const LEAST_KEPT_BYTES: usize = 64 << 10;

/// Level of zstd. On chunks of runs level 1 takes half the time of level 3, which is zstd's own choice, and 2 % more room;
/// level -1, the first of its fast ones, 0.7 of that time and 3 % more.
const COMPRESSION: i32 = -1;

/// An MCAP file in the making. Keeps the open chunk in memory and writes it whole.
pub(crate) struct Output {
    file: TailFile,
    /// Of all committed bytes.
    checksum: crc32fast::Hasher,
    chunk: OpenChunk,
    /// Bytes of the open chunk that are in the file already, provisionally.
    shown: usize,
    index: Index,
    /// Numbers of schemas by their name, and of the last channel.
    schemas: BTreeMap<String, u16>,
    channels: u16,
    compressor: Compressor<'static>,
    /// The last chunk, compressed and with its indexes; the memory is used again.
    bytes: Vec<u8>,
    cdr: Cdr,
    /// The last message and the end are in the file.
    finished: bool,
}

impl Output {
    pub(crate) fn new(file: File) -> io::Result<Self> {
        let mut output = Self {
            file: TailFile::new(file),
            checksum: crc32fast::Hasher::new(),
            chunk: OpenChunk::default(),
            shown: 0,
            index: Index::default(),
            schemas: BTreeMap::new(),
            channels: 0,
            compressor: Compressor::new(COMPRESSION)?,
            bytes: Vec::new(),
            cdr: Cdr::default(),
            finished: false,
        };
        let mut head = mcap::MAGIC.to_vec();
        Body::default().string("ros2").string(concat!("flexarm ", env!("CARGO_PKG_VERSION"))).push(&mut head, HEADER);
        output.commit(&head)?;
        Ok(output)
    }

    fn commit(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.checksum.update(bytes);
        self.file.write_all(bytes)
    }

    /// Adds a topic of ROS 2 messages; returns its number.
    pub(crate) fn add_channel(
        &mut self,
        topic: &str,
        kind: &str,
        definition: &str,
        metadata: &BTreeMap<String, String>,
    ) -> u16 {
        let schema = match self.schemas.get(kind) {
            Some(known) => *known,
            None => {
                let number = self.schemas.len() as u16 + 1;
                let mut body = Body::default();
                body.u16(number).string(kind).string("ros2msg").string(definition);
                self.chunk.describe(SCHEMA, &body);
                self.index.schema(&body);
                self.schemas.insert(kind.to_owned(), number);
                number
            }
        };
        self.channels += 1;
        let mut body = Body::default();
        body.u16(self.channels).u16(schema).string(topic).string("cdr").pairs(metadata);
        self.chunk.describe(CHANNEL, &body);
        self.index.channel(&body);
        self.channels
    }

    /// Adds a message to the open chunk, or to a new one if it would grow too large. The `sequence` of a topic counts up.
    pub(crate) fn send(
        &mut self,
        channel: u16,
        sequence: u32,
        stamp: Stamp,
        write: impl FnOnce(&mut Cdr),
    ) -> io::Result<()> {
        write(&mut self.cdr);
        let size = OpenChunk::size_of_message(self.cdr.bytes().len());
        let most = if self.file.position() > LONG_FILE_BYTES { LONG_CHUNK_BYTES } else { CHUNK_BYTES };
        if self.chunk.messages() > 0 && self.chunk.messages() + size > most {
            self.close_chunk()?;
        }
        self.chunk.message(channel, sequence, stamp, self.cdr.bytes());
        Ok(())
    }

    pub(crate) fn close_chunk(&mut self) -> io::Result<()> {
        self.shown = 0;
        if self.chunk.records().is_empty() {
            return Ok(());
        }
        let records = self.chunk.records();
        let mut bytes = std::mem::take(&mut self.bytes);
        let compress = |file: &mut Vec<u8>| {
            file.reserve(compress_bound(records.len()));
            let mut behind = Cursor::new(std::mem::take(file));
            behind.set_position(behind.get_ref().len() as u64);
            let compressed = self.compressor.compress_to_buffer(records, &mut behind);
            *file = behind.into_inner();
            compressed.map(drop)
        };
        let checksum = crc32fast::hash(records);
        let written = self.chunk.write(&mut bytes, self.file.position(), ("zstd", compress), checksum)?;
        self.chunk.clear(KEPT_BYTES);
        self.index.chunk(&written);
        let committed = self.commit(&bytes);
        bytes.clear();
        self.bytes = bytes;
        // What the surfaces took is not needed again.
        self.bytes.shrink_to(KEPT_BYTES);
        committed
    }

    /// Whether so much is held back that [`Output::flush`] should be called even before its time. An index that has grown
    /// long is not written for little.
    pub(crate) fn is_full(&self) -> bool {
        self.file.is_full() && self.file.pending() > self.index.size()
    }

    /// Brings everything so far into the file: closed chunks for good, the open one and an index provisionally.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        let end = self.file.position();
        let written = self.file.set_tail(self.index.provisional_end(end, &self.chunk));
        match written {
            Ok(()) => self.shown = self.chunk.records().len(),
            Err(_) => self.show_what_fits(end),
        }
        written
    }

    /// On a full disk: the closed chunks, and as much of the open one as there is room for.
    fn show_what_fits(&mut self, end: u64) {
        // Without a closed chunk that waits, the file must not be left with less than it shows.
        let least = if self.file.pending() > 0 { None } else { Some(self.shown) };
        let mut part = self.chunk.records().len();
        while part > 0 {
            let beginning = self.chunk.beginning(part / 2);
            part = beginning.records().len();
            if least.is_some_and(|least| part <= least) {
                return;
            }
            if self.file.set_tail(self.index.provisional_end(end, &beginning)).is_ok() {
                self.shown = part;
                return;
            }
        }
    }

    pub(crate) fn metadata(&mut self, name: &str, pairs: impl IntoIterator<Item = (String, String)>) -> io::Result<()> {
        self.close_chunk()?;
        self.cdr.shrink_to(LEAST_KEPT_BYTES);
        let (mut bytes, mut body) = (Vec::new(), Body::default());
        body.string(name).pairs(&BTreeMap::from_iter(pairs)).push(&mut bytes, METADATA);
        self.index.metadata(self.file.position(), bytes.len() as u64, name);
        self.commit(&bytes)
    }

    pub(crate) fn attach(&mut self, stamp: Stamp, file: &crate::Attachment) -> io::Result<()> {
        self.close_chunk()?;
        let (start, size) = (self.file.position(), file.bytes.len() as u64);
        let mut body = Body::default();
        // When it was made is unknown, and a run's file must not depend on the day.
        body.u64(stamp.0).u64(0).string(&file.name).string(&file.media_type).u64(size);
        let mut head = Vec::new();
        push_head(&mut head, ATTACHMENT, body.bytes().len() as u64 + size + 4);
        head.extend_from_slice(body.bytes());
        let mut checksum = crc32fast::Hasher::new();
        [body.bytes(), &file.bytes].into_iter().for_each(|bytes| checksum.update(bytes));
        let checksum = checksum.finalize().to_le_bytes();
        [&head, file.bytes.as_slice(), &checksum].into_iter().try_for_each(|bytes| self.commit(bytes))?;
        let length = self.file.position() - start;
        self.index.attachment(start, length, stamp.0, size, [&file.name, &file.media_type]);
        Ok(())
    }

    /// Closes the open chunk and writes the index, once.
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        if !self.finished {
            self.close_chunk()?;
            self.finished = true;
            let end = self.index.end(self.file.position(), self.checksum.clone().finalize());
            self.file.write_all(&end)?;
        }
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Attachment;

    const TOPICS: [(&str, &str, &str); 3] = [
        ("/a", "pkg/msg/Number", "float64 x"),
        ("/b", "pkg/msg/Text", "string text"),
        ("/c", "pkg/msg/Number", "float64 x"),
    ];

    /// Topic, number in it, time, data: numbers that compress somewhat, several chunks of them.
    fn messages() -> Vec<(usize, u32, u64, Vec<u8>)> {
        let data = |k: u64| (0..200 + k % 7).flat_map(|i| ((k * i) as f64).sqrt().to_le_bytes()).collect();
        (0..2000).map(|k| ((k % 5 % 3) as usize, k as u32, 1000 + 10 * (k ^ 1), data(k))).collect()
    }

    fn metadata() -> BTreeMap<String, String> {
        [("key", "value"), ("another", "")].map(|(k, v)| (k.to_owned(), v.to_owned())).into()
    }

    fn attachment() -> Attachment {
        Attachment { name: "file.txt".into(), media_type: "text/plain".into(), bytes: b"what is in it".to_vec() }
    }

    /// Truth: the same through the library of the format, message by message.
    fn by_the_library() -> Vec<u8> {
        let options = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("flexarm ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None)
            .disable_seeking(true)
            .compression_level(COMPRESSION as u32) // of which it makes the signed number again
            .compression_threads(0);
        let mut bytes = io::Cursor::new(Vec::new());
        let mut writer = options.create(&mut bytes).unwrap();
        let mut channels = Vec::new();
        for (topic, kind, definition) in TOPICS {
            let schema = writer.add_schema(kind, "ros2msg", definition.as_bytes()).unwrap();
            channels.push(writer.add_channel(schema, topic, "cdr", &metadata()).unwrap());
        }
        writer.write_metadata(&mcap::records::Metadata { name: "about".into(), metadata: metadata() }).unwrap();
        let file = attachment();
        let (name, media_type, data) = (file.name, file.media_type, file.bytes.into());
        writer.attach(&mcap::Attachment { log_time: 7, create_time: 0, name, media_type, data }).unwrap();
        let mut size = 0;
        for (topic, sequence, time, data) in messages() {
            let message = 9 + 22 + data.len();
            if size + message > CHUNK_BYTES {
                writer.flush().unwrap();
                size = 0;
            }
            size += message;
            let (channel_id, log_time, publish_time) = (channels[topic], time, time);
            let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, &data).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        bytes.into_inner()
    }

    fn by_us(flush_every: usize) -> Vec<u8> {
        let path = std::env::temp_dir().join(format!("flexarm-mcap-{}-{flush_every}", std::process::id()));
        let mut output = Output::new(File::create(&path).unwrap()).unwrap();
        let channels = TOPICS.map(|(topic, kind, text)| output.add_channel(topic, kind, text, &metadata()));
        output.metadata("about", metadata()).unwrap();
        output.attach(Stamp(7), &attachment()).unwrap();
        for (k, (topic, sequence, time, data)) in messages().into_iter().enumerate() {
            output.send(channels[topic], sequence, Stamp(time), |cdr| cdr.raw(&data)).unwrap();
            if k % flush_every == 0 {
                output.flush().unwrap();
                // What a kill would leave is a whole file with all messages so far.
                let left = std::fs::read(&path).unwrap();
                let counted = mcap::Summary::read(&left).unwrap().unwrap().stats.unwrap().message_count;
                assert_eq!((counted, mcap::MessageStream::new(&left).unwrap().count()), (k as u64 + 1, k + 1));
            }
        }
        output.finish().unwrap();
        output.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        bytes
    }

    /// Every record of a file, those of chunks in their place; of a chunk what does not depend on its compression. Places in
    /// the file are left out, and checked by reading through the index.
    fn records(file: &[u8]) -> Vec<String> {
        let summary = mcap::Summary::read(file).unwrap().unwrap();
        let mut messages = 0;
        for index in &summary.chunk_indexes {
            messages += summary.stream_chunk(file, index).unwrap().map(Result::unwrap).count();
            if index.message_index_offsets.is_empty() {
                continue; // topics alone
            }
            for (_, entries) in summary.read_message_indexes(file, index).unwrap() {
                for entry in entries.iter().step_by(20) {
                    assert_eq!(summary.seek_message(file, index, entry).unwrap().log_time, entry.log_time);
                }
            }
        }
        assert_eq!(messages as u64, summary.stats.as_ref().unwrap().message_count);
        assert!(summary.attachment_indexes.iter().all(|index| mcap::read::attachment(file, index).is_ok()));
        assert!(summary.metadata_indexes.iter().all(|index| mcap::read::metadata(file, index).is_ok()));
        let chunks = summary.chunk_indexes.iter().map(|index| {
            let channels: Vec<_> = index.message_index_offsets.keys().collect();
            let times = (index.message_start_time, index.message_end_time);
            format!("{times:?} {} {} {channels:?}", index.message_index_length, index.uncompressed_size)
        });
        let plain = mcap::read::ChunkFlattener::new(file).unwrap().map(Result::unwrap);
        let plain = plain.filter_map(|record| match record {
            mcap::records::Record::ChunkIndex(_) | mcap::records::Record::AttachmentIndex(_) => None,
            mcap::records::Record::MetadataIndex(_) | mcap::records::Record::SummaryOffset(_) => None,
            mcap::records::Record::DataEnd(end) => Some(format!("end {}", end.data_section_crc != 0)),
            mcap::records::Record::Footer(end) => Some(format!("end {}", end.summary_crc != 0)),
            other => Some(format!("{other:?}")),
        });
        chunks.chain(plain).collect()
    }

    #[test]
    fn a_file_has_the_records_that_the_library_of_the_format_writes() {
        let truth = by_the_library();
        assert!(mcap::Summary::read(&truth).unwrap().unwrap().chunk_indexes.len() > 3);
        let once = by_us(usize::MAX);
        assert_eq!(records(&once), records(&truth));
        assert!(by_us(400) == once, "a file does not depend on when it was flushed");
        // The same compression but for the sizes of chunks, which are known to it: nearly the same size.
        assert!((once.len() as f64 / truth.len() as f64 - 1.0).abs() < 0.03, "{} {}", once.len(), truth.len());
    }
}
