//! The end of a file that is still being written: the open chunk, and an index of all that is in the file by then.
//!
//! What a killed run leaves is a file that readers which want an index (Foxglove, Rerun) open as any other. The records
//! are written by hand, because the format's library keeps its own to itself until the end. [MCAP specification]

use std::collections::BTreeMap;

use mcap::records::MessageHeader;

const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const MESSAGE_INDEX: u8 = 0x07;
const CHUNK_INDEX: u8 = 0x08;
const ATTACHMENT: u8 = 0x09;
const ATTACHMENT_INDEX: u8 = 0x0a;
const STATISTICS: u8 = 0x0b;
const METADATA: u8 = 0x0c;
const METADATA_INDEX: u8 = 0x0d;
const DATA_END: u8 = 0x0f;

/// Bytes of a message record besides its data.
pub(crate) const MESSAGE_OVERHEAD: usize = 1 + 8 + MESSAGE_HEADER;
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

/// What the file holds so far, as records of its index.
#[derive(Clone, Debug)]
pub(crate) struct Index {
    /// Length of the file up to which it has been looked at.
    seen: u64,
    /// Records of schemas and channels by their number.
    schemas: BTreeMap<u16, Vec<u8>>,
    channels: BTreeMap<u16, Vec<u8>>,
    /// Index records, and how many.
    chunks: (Vec<u8>, u32),
    attachments: (Vec<u8>, u32),
    metadata: (Vec<u8>, u32),
    /// Messages per channel, and the first and last time of any.
    counts: BTreeMap<u16, u64>,
    times: (u64, u64),
    /// The chunk whose message indexes are being read.
    open: Option<OpenChunk>,
}

#[derive(Clone, Debug)]
struct OpenChunk {
    times: (u64, u64),
    start: u64,
    length: u64,
    compression: String,
    compressed: u64,
    uncompressed: u64,
    /// Place of the message index per channel.
    indexes: BTreeMap<u16, u64>,
    indexes_length: u64,
}

impl Index {
    pub(crate) fn new() -> Self {
        Self {
            seen: 0,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunks: Default::default(),
            attachments: Default::default(),
            metadata: Default::default(),
            counts: BTreeMap::new(),
            times: (u64::MAX, 0),
            open: None,
        }
    }

    pub(crate) fn schema(&mut self, id: u16, name: &str, encoding: &str, data: &[u8]) {
        let mut body = Bytes::default();
        body.u16(id).string(name).string(encoding).block(data);
        self.schemas.insert(id, body.record(SCHEMA));
    }

    pub(crate) fn channel(&mut self, id: u16, schema: u16, topic: &str, metadata: &BTreeMap<String, String>) {
        let mut pairs = Bytes::default();
        for (key, value) in metadata {
            pairs.string(key).string(value);
        }
        let mut body = Bytes::default();
        body.u16(id).u16(schema).string(topic).string("cdr").block(&pairs.0);
        self.channels.insert(id, body.record(CHANNEL));
    }

    /// Looks at bytes of the file, whole records from place `start` on. What was looked at before is passed over.
    pub(crate) fn read(&mut self, start: u64, bytes: &[u8]) {
        let known = self.seen.saturating_sub(start) as usize;
        let mut at = if self.seen == 0 { mcap::MAGIC.len() } else { known };
        while let Some((opcode, body)) = record(bytes, at) {
            let (place, length) = (start + at as u64, 9 + body.len() as u64);
            at += length as usize;
            self.record(opcode, &mut Parts(body), place, length);
        }
        self.seen = start + bytes.len() as u64;
    }

    fn record(&mut self, opcode: u8, body: &mut Parts<'_>, place: u64, length: u64) {
        if opcode != MESSAGE_INDEX {
            self.close_chunk();
        }
        match opcode {
            CHUNK => {
                let times = (body.u64(), body.u64());
                let uncompressed = body.u64();
                body.take(4); // checksum
                let compression = body.string();
                let compressed = body.u64();
                self.open = Some(OpenChunk {
                    times,
                    start: place,
                    length,
                    compression,
                    compressed,
                    uncompressed,
                    indexes: BTreeMap::new(),
                    indexes_length: 0,
                });
                self.times = (self.times.0.min(times.0), self.times.1.max(times.1));
            }
            MESSAGE_INDEX => {
                let (channel, entries) = (body.u16(), u64::from(body.u32()) / 16);
                *self.counts.entry(channel).or_default() += entries;
                if let Some(open) = &mut self.open {
                    open.indexes.insert(channel, place);
                    open.indexes_length += length;
                }
            }
            ATTACHMENT => {
                let (log_time, create_time, name, media_type) = (body.u64(), body.u64(), body.string(), body.string());
                let mut index = Bytes::default();
                index.u64(place).u64(length).u64(log_time).u64(create_time).u64(body.u64());
                index.string(&name).string(&media_type);
                self.attachments.0.extend(index.record(ATTACHMENT_INDEX));
                self.attachments.1 += 1;
            }
            METADATA => {
                let mut index = Bytes::default();
                index.u64(place).u64(length).string(&body.string());
                self.metadata.0.extend(index.record(METADATA_INDEX));
                self.metadata.1 += 1;
            }
            _ => {}
        }
    }

    fn close_chunk(&mut self) {
        let Some(chunk) = self.open.take() else { return };
        let mut places = Bytes::default();
        for (channel, place) in &chunk.indexes {
            places.u16(*channel).u64(*place);
        }
        let mut index = Bytes::default();
        index.u64(chunk.times.0).u64(chunk.times.1).u64(chunk.start).u64(chunk.length).block(&places.0);
        index.u64(chunk.indexes_length).string(&chunk.compression).u64(chunk.compressed).u64(chunk.uncompressed);
        self.chunks.0.extend(index.record(CHUNK_INDEX));
        self.chunks.1 += 1;
    }

    /// The end of the file from `start` on, with the messages of the open chunk.
    pub(crate) fn end(&self, start: u64, messages: &[u8]) -> Vec<u8> {
        let mut file = Vec::with_capacity(messages.len() + 4096);
        if !messages.is_empty() {
            push_chunk(&mut file, messages);
        }
        let mut whole = self.clone();
        whole.seen = start.max(1); // in any case not the beginning of a file
        whole.read(start, &file);
        whole.close_chunk();

        let mut data_end = Bytes::default();
        data_end.u32(0); // no checksum
        file.extend(data_end.record(DATA_END));
        let summary = start + file.len() as u64;
        whole.schemas.values().chain(whole.channels.values()).for_each(|record| file.extend(record));
        file.extend(whole.statistics());
        [&whole.chunks, &whole.attachments, &whole.metadata].into_iter().for_each(|(records, _)| file.extend(records));
        let mut footer = Bytes::default();
        footer.u64(summary).u64(0).u32(0); // no offsets of groups, no checksum
        file.extend(footer.record(FOOTER));
        file.extend(mcap::MAGIC);
        file
    }

    fn statistics(&self) -> Vec<u8> {
        let mut counts = Bytes::default();
        for (channel, count) in &self.counts {
            counts.u16(*channel).u64(*count);
        }
        let times = if self.times.0 > self.times.1 { (0, 0) } else { self.times };
        let mut body = Bytes::default();
        body.u64(self.counts.values().sum()).u16(self.schemas.len() as u16).u32(self.channels.len() as u32);
        body.u32(self.attachments.1).u32(self.metadata.1).u32(self.chunks.1).u64(times.0).u64(times.1).block(&counts.0);
        body.record(STATISTICS)
    }
}

/// Opcode and body of the record at a place.
fn record(bytes: &[u8], at: usize) -> Option<(u8, &[u8])> {
    let (head, rest) = bytes.get(at..)?.split_at_checked(9)?;
    let length = Parts(&head[1..]).u64() as usize;
    Some((head[0], rest.get(..length)?))
}

/// Adds a chunk without compression and checksum, with its message indexes.
fn push_chunk(file: &mut Vec<u8>, messages: &[u8]) {
    let (mut times, mut at) = ((u64::MAX, 0), 0);
    let mut indexes: BTreeMap<u16, Bytes> = BTreeMap::new();
    while let Some((_, body)) = record(messages, at) {
        let mut parts = Parts(body);
        let channel = parts.u16();
        parts.take(4); // number in its channel
        let time = parts.u64();
        times = (times.0.min(time), times.1.max(time));
        indexes.entry(channel).or_default().u64(time).u64(at as u64);
        at += 9 + body.len();
    }
    let mut chunk = Bytes::default();
    chunk.u64(times.0).u64(times.1).u64(messages.len() as u64).u32(0).string("").u64(messages.len() as u64);
    chunk.0.extend_from_slice(messages);
    file.extend(chunk.record(CHUNK));
    for (channel, entries) in indexes {
        let mut index = Bytes::default();
        index.u16(channel).block(&entries.0);
        file.extend(index.record(MESSAGE_INDEX));
    }
}

/// Length of the whole messages among the first `length` bytes of a chunk.
pub(crate) fn messages_within(messages: &[u8], length: usize) -> usize {
    let mut at = 0;
    while let Some((_, body)) = record(&messages[..length], at) {
        at += 9 + body.len();
    }
    at
}

/// Adds a message as it is inside a chunk.
pub(crate) fn push_message(chunk: &mut Vec<u8>, header: &MessageHeader, data: &[u8]) {
    chunk.push(MESSAGE);
    chunk.extend(((MESSAGE_HEADER + data.len()) as u64).to_le_bytes());
    chunk.extend(header.channel_id.to_le_bytes());
    chunk.extend(header.sequence.to_le_bytes());
    chunk.extend(header.log_time.to_le_bytes());
    chunk.extend(header.publish_time.to_le_bytes());
    chunk.extend_from_slice(data);
}

/// Body of a record in the making.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn u16(&mut self, value: u16) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Bytes with their number before them.
    fn block(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(u32::try_from(bytes.len()).expect("part of an index below 4 GiB"));
        self.0.extend_from_slice(bytes);
        self
    }

    fn string(&mut self, text: &str) -> &mut Self {
        self.block(text.as_bytes())
    }

    fn record(&self, opcode: u8) -> Vec<u8> {
        let mut record = vec![opcode];
        record.extend((self.0.len() as u64).to_le_bytes());
        record.extend_from_slice(&self.0);
        record
    }
}

/// Body of a record being read. It was written by the format's library: what is missing reads as zero.
struct Parts<'b>(&'b [u8]);

impl<'b> Parts<'b> {
    fn take(&mut self, count: usize) -> &'b [u8] {
        let (part, rest) = self.0.split_at_checked(count).unwrap_or((self.0, &[]));
        self.0 = rest;
        part
    }

    fn u16(&mut self) -> u16 {
        self.take(2).try_into().map_or(0, u16::from_le_bytes)
    }

    fn u32(&mut self) -> u32 {
        self.take(4).try_into().map_or(0, u32::from_le_bytes)
    }

    fn u64(&mut self) -> u64 {
        self.take(8).try_into().map_or(0, u64::from_le_bytes)
    }

    fn string(&mut self) -> String {
        let length = self.u32() as usize;
        String::from_utf8_lossy(self.take(length)).into_owned()
    }
}
