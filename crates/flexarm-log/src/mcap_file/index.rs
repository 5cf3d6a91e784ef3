//! What an MCAP file holds so far, and the end of a file that says so.
//!
//! The same end closes a finished file and, provisionally, one that is still being written: what a killed run leaves is a
//! file that readers which want an index (Foxglove, Rerun) open as any other. [MCAP specification]

use std::collections::BTreeMap;
use std::convert::Infallible;

use super::chunk::{OpenChunk, Written};
use super::records::{
    ATTACHMENT_INDEX, Body, CHANNEL, CHUNK_INDEX, DATA_END, FOOTER, METADATA_INDEX, SCHEMA, STATISTICS, SUMMARY_OFFSET,
    push_head,
};

/// Records of one kind, and how many.
#[derive(Clone, Debug, Default)]
struct Group {
    records: Vec<u8>,
    count: u32,
}

impl Group {
    fn push(&mut self, body: &Body, opcode: u8) {
        body.push(&mut self.records, opcode);
        self.count += 1;
    }
}

/// What the file holds so far, as records of its index.
#[derive(Clone, Debug, Default)]
pub(super) struct Index {
    schemas: Group,
    channels: Group,
    chunks: Group,
    attachments: Group,
    metadata: Group,
    /// Messages per channel, and the first and last time of any.
    counts: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
}

impl Index {
    pub(super) fn schema(&mut self, body: &Body) {
        self.schemas.push(body, SCHEMA);
    }

    pub(super) fn channel(&mut self, body: &Body) {
        self.channels.push(body, CHANNEL);
    }

    pub(super) fn chunk(&mut self, chunk: &Written) {
        self.chunks.push(&chunk_index(chunk), CHUNK_INDEX);
        add_counts(&mut self.counts, chunk);
        self.times = joined(self.times, chunk);
    }

    /// A file of its own at place `start`, of `length` bytes as a record and `size` by itself.
    pub(super) fn attachment(&mut self, start: u64, length: u64, stamp: u64, size: u64, [name, media_type]: [&str; 2]) {
        let mut body = Body::default();
        body.u64(start).u64(length).u64(stamp).u64(0).u64(size).string(name).string(media_type);
        self.attachments.push(&body, ATTACHMENT_INDEX);
    }

    pub(super) fn metadata(&mut self, start: u64, length: u64, name: &str) {
        let mut body = Body::default();
        body.u64(start).u64(length).string(name);
        self.metadata.push(&body, METADATA_INDEX);
    }

    /// Bytes of the end that it makes, about.
    pub(super) fn size(&self) -> usize {
        self.groups().into_iter().map(|(_, group)| group.records.len()).sum()
    }

    fn groups(&self) -> [(u8, &Group); 5] {
        [
            (SCHEMA, &self.schemas),
            (CHANNEL, &self.channels),
            (CHUNK_INDEX, &self.chunks),
            (ATTACHMENT_INDEX, &self.attachments),
            (METADATA_INDEX, &self.metadata),
        ]
    }

    /// The end of a file from place `start` on, with the messages of the open chunk, not compressed.
    pub(super) fn provisional_end(&self, start: u64, open: &OpenChunk) -> Vec<u8> {
        let mut file = Vec::with_capacity(open.records().len() + self.size() + (64 << 10));
        let plain = |file: &mut Vec<u8>| {
            file.extend_from_slice(open.records());
            Ok::<(), Infallible>(())
        };
        let written = (!open.records().is_empty()).then(|| {
            let Ok(written) = open.write(&mut file, start, ("", plain), 0);
            written
        });
        self.close(&mut file, start, written.as_ref(), 0);
        file
    }

    /// The end of a finished file, from place `start` on; `checksum` of all before.
    pub(super) fn end(&self, start: u64, checksum: u32) -> Vec<u8> {
        let mut file = Vec::with_capacity(self.size() + (64 << 10));
        self.close(&mut file, start, None, checksum);
        file
    }

    /// Adds the end of the data, and the list of what there is with one chunk more.
    fn close(&self, file: &mut Vec<u8>, start: u64, last: Option<&Written>, checksum: u32) {
        Body::default().u32(checksum).push(file, DATA_END);
        let summary = file.len();
        let place = |file: &Vec<u8>| start + file.len() as u64;
        let (chunks, mut offsets) = (self.chunks.count + u32::from(last.is_some()), Vec::new());
        for (opcode, group) in self.groups() {
            let from = place(file);
            // Statistics stand before what is there in places.
            if opcode == CHUNK_INDEX {
                self.statistics(last, chunks).push(file, STATISTICS);
                offsets.push((STATISTICS, from, place(file)));
            }
            let from = place(file);
            file.extend_from_slice(&group.records);
            if let Some(last) = last.filter(|_| opcode == CHUNK_INDEX) {
                chunk_index(last).push(file, CHUNK_INDEX);
            }
            if place(file) > from {
                offsets.push((opcode, from, place(file)));
            }
        }
        let summary_offsets = place(file);
        for (opcode, from, to) in offsets {
            Body::default().u8(opcode).u64(from).u64(to - from).push(file, SUMMARY_OFFSET);
        }
        push_head(file, FOOTER, 8 + 8 + 4);
        file.extend_from_slice(Body::default().u64(start + summary as u64).u64(summary_offsets).bytes());
        let checksum = crc32fast::hash(&file[summary..]);
        file.extend_from_slice(&checksum.to_le_bytes());
        file.extend_from_slice(mcap::MAGIC);
    }

    fn statistics(&self, last: Option<&Written>, chunks: u32) -> Body {
        let (mut counts, mut times) = (self.counts.clone(), self.times);
        if let Some(last) = last {
            add_counts(&mut counts, last);
            times = joined(times, last);
        }
        let mut list = Body::default();
        for (channel, count) in &counts {
            list.u16(*channel).u64(*count);
        }
        let (first, last) = times.unwrap_or_default();
        let mut body = Body::default();
        body.u64(counts.values().sum()).u16(self.schemas.count as u16).u32(self.channels.count);
        body.u32(self.attachments.count).u32(self.metadata.count).u32(chunks);
        body.u64(first).u64(last).block(list.bytes());
        body
    }
}

fn chunk_index(chunk: &Written) -> Body {
    let mut places = Body::default();
    for (channel, place) in &chunk.indexes {
        places.u16(*channel).u64(*place);
    }
    let mut body = Body::default();
    body.u64(chunk.times.0).u64(chunk.times.1).u64(chunk.start).u64(chunk.length).block(places.bytes());
    body.u64(chunk.indexes_length).string(chunk.compression).u64(chunk.compressed).u64(chunk.uncompressed);
    body
}

fn add_counts(counts: &mut BTreeMap<u16, u64>, chunk: &Written) {
    for (channel, count) in &chunk.counts {
        *counts.entry(*channel).or_default() += count;
    }
}

/// First and last time of both; of a chunk without messages those of the others.
fn joined(times: Option<(u64, u64)>, chunk: &Written) -> Option<(u64, u64)> {
    if chunk.counts.is_empty() {
        return times;
    }
    let (first, last) = chunk.times;
    Some(times.map_or(chunk.times, |(a, b)| (a.min(first), b.max(last))))
}
