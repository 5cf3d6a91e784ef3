//! Messages on their way into a chunk, with the index that follows it.

use super::messages::Stamp;
use super::records::{Body, CHUNK, HEAD, MESSAGE, MESSAGE_INDEX, push_head, record};

/// Bytes of a message before its data: channel, number, log time, publish time.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;
/// Bytes of a message in its index: time, place.
const ENTRY: usize = 8 + 8;

/// The chunk that is being filled. Its memory is used again for the next one.
#[derive(Debug, Default)]
pub(super) struct OpenChunk {
    /// Records as they are in it.
    records: Vec<u8>,
    /// Bytes of those that are no messages.
    others: usize,
    /// First and last time.
    times: Option<(u64, u64)>,
    /// Entries of the index of each channel, by its number.
    entries: Vec<Vec<u8>>,
}

/// What is to be known of a chunk that was written.
pub(super) struct Written {
    pub(super) times: (u64, u64),
    pub(super) start: u64,
    pub(super) length: u64,
    pub(super) compression: &'static str,
    pub(super) compressed: u64,
    pub(super) uncompressed: u64,
    /// Places of the message indexes by channel, and their length in all.
    pub(super) indexes: Vec<(u16, u64)>,
    pub(super) indexes_length: u64,
    /// Messages by channel.
    pub(super) counts: Vec<(u16, u64)>,
}

impl OpenChunk {
    /// Without anything in it, with the memory that it has, up to so many bytes.
    pub(super) fn clear(&mut self, kept: usize) {
        self.records.clear();
        self.records.shrink_to(kept);
        self.others = 0;
        self.times = None;
        self.entries.iter_mut().for_each(Vec::clear);
    }

    pub(super) fn records(&self) -> &[u8] {
        &self.records
    }

    /// Bytes of messages.
    pub(super) fn messages(&self) -> usize {
        self.records.len() - self.others
    }

    /// Bytes that a message with so much data takes.
    pub(super) fn size_of_message(data: usize) -> usize {
        HEAD + MESSAGE_HEADER + data
    }

    /// Adds a schema or a channel.
    pub(super) fn describe(&mut self, opcode: u8, body: &Body) {
        let before = self.records.len();
        body.push(&mut self.records, opcode);
        self.others += self.records.len() - before;
    }

    /// Adds a message.
    pub(super) fn message(&mut self, channel: u16, sequence: u32, stamp: Stamp, data: &[u8]) {
        let (time, place) = (stamp.0.to_le_bytes(), self.records.len() as u64);
        self.enter(channel, stamp.0, place);
        self.records.reserve(Self::size_of_message(data.len()));
        push_head(&mut self.records, MESSAGE, (MESSAGE_HEADER + data.len()) as u64);
        self.records.extend_from_slice(&channel.to_le_bytes());
        self.records.extend_from_slice(&sequence.to_le_bytes());
        self.records.extend_from_slice(&time);
        self.records.extend_from_slice(&time);
        self.records.extend_from_slice(data);
    }

    fn enter(&mut self, channel: u16, time: u64, place: u64) {
        self.times = Some(self.times.map_or((time, time), |(first, last)| (first.min(time), last.max(time))));
        let number = usize::from(channel);
        if self.entries.len() <= number {
            self.entries.resize_with(number + 1, Vec::new);
        }
        let entries = &mut self.entries[number];
        entries.extend_from_slice(&time.to_le_bytes());
        entries.extend_from_slice(&place.to_le_bytes());
    }

    /// The whole records among the first `length` bytes, as a chunk of their own.
    pub(super) fn beginning(&self, length: usize) -> Self {
        let mut part = Self::default();
        let bytes = &self.records[..length];
        let mut at = 0;
        while let Some((opcode, body)) = record(bytes, at) {
            let size = HEAD + body.len();
            match (opcode, body) {
                (MESSAGE, [a, b, _, _, _, _, time @ ..]) if time.len() >= 8 => {
                    let time = time[..8].try_into().map_or(0, u64::from_le_bytes);
                    part.enter(u16::from_le_bytes([*a, *b]), time, at as u64);
                }
                _ => part.others += size,
            }
            at += size;
        }
        part.records.extend_from_slice(&bytes[..at]);
        part
    }

    /// Adds the chunk and its indexes to the bytes of a file that begin at place `start`.
    ///
    /// * `data`: name of a compression, and what adds the records so compressed; `checksum` of them as they are, 0 for none.
    pub(super) fn write<E>(
        &self,
        file: &mut Vec<u8>,
        start: u64,
        (compression, data): (&'static str, impl FnOnce(&mut Vec<u8>) -> Result<(), E>),
        checksum: u32,
    ) -> Result<Written, E> {
        let place = start + file.len() as u64;
        let times = self.times.unwrap_or_default();
        let mut head = Body::default();
        head.u64(times.0).u64(times.1).u64(self.records.len() as u64).u32(checksum);
        head.string(compression);
        let (before, size) = (file.len(), size_of::<u64>());
        // Lengths are put in when they are known.
        push_head(file, CHUNK, 0);
        file.extend_from_slice(head.bytes());
        file.extend_from_slice(&[0; size_of::<u64>()]);
        let from = file.len();
        data(file)?;
        let compressed = (file.len() - from) as u64;
        file[from - size..from].copy_from_slice(&compressed.to_le_bytes());
        let length = (file.len() - before - HEAD) as u64;
        file[before + HEAD - size..before + HEAD].copy_from_slice(&length.to_le_bytes());
        let end = start + file.len() as u64;

        let (mut indexes, mut counts) = (Vec::new(), Vec::new());
        for (channel, entries) in (0..).zip(&self.entries).filter(|(_, entries)| !entries.is_empty()) {
            indexes.push((channel, start + file.len() as u64));
            counts.push((channel, (entries.len() / ENTRY) as u64));
            let mut body = Body::default();
            body.u16(channel).block(entries);
            body.push(file, MESSAGE_INDEX);
        }
        Ok(Written {
            times,
            start: place,
            length: end - place,
            compression,
            compressed,
            uncompressed: self.records.len() as u64,
            indexes,
            indexes_length: start + file.len() as u64 - end,
            counts,
        })
    }
}
