//! An .rrd file written message by message.
//!
//! The `rerun` crate's own file writer runs in a thread of its own, reports a full disk only to its log, and
//! draws row identifiers from clock and chance. Here messages are encoded with the same building blocks, but
//! identifiers count up, errors come back, and the end may be provisional ([`TailFile`]).

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Write};

use crate::rerun::Span;
use crate::rerun::arrow::array::RecordBatch;
use crate::rerun::arrow::datatypes::Schema;
use crate::rerun::{AsComponents, EntityPath, SerializationError, SerializedComponentColumn, StoreId, TimePoint};
use crate::rerun::{Chunk, ChunkComponents, ChunkError, ChunkId, LogMsg, RowId, TimeColumn};
use re_log_encoding::{
    CodecError, CrateVersion, Encodable, EncodingOptions, MessageHeader, MessageKind, RRD_FOURCC, RrdFooter,
    StreamFooter, StreamHeader, ToTransport,
};
use re_log_types::{ArrowMsg, BlueprintActivationCommand, SetStoreInfo, StoreInfo, StoreSource};
use re_tuid::Tuid;

use super::chunk_list::ChunkList;
use crate::tail_file::TailFile;

/// Why a message could not be written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StreamError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error(transparent)]
    Codec(#[from] CodecError),
    #[error(transparent)]
    Chunk(#[from] ChunkError),
    #[error(transparent)]
    Component(#[from] SerializationError),
}

type Result<T> = std::result::Result<T, StreamError>;

/// Takes chunks one after another, so that they need not all be in memory.
pub(crate) type Put<'a> = dyn FnMut(Chunk) -> Result<()> + 'a;

/// Identifiers for chunks and rows, in the order of writing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ids(u64);

impl Ids {
    /// The next chunk's identifier; those of its rows follow it.
    fn chunk(&mut self) -> ChunkId {
        self.0 += 1;
        ChunkId::from_tuid(Tuid::from_nanos_and_inc(self.0, 0))
    }

    /// A chunk with one row. A `when` without times makes it static: valid always, the last one written wins.
    pub(crate) fn single(&mut self, path: &EntityPath, when: &TimePoint, what: &dyn AsComponents) -> Result<Chunk> {
        let id = self.chunk();
        let row = RowId::from_tuid(id.as_tuid().next());
        Ok(Chunk::builder_with_id(id, path.clone()).with_archetype(row, when.clone(), what).build()?)
    }

    /// A chunk that holds at all times.
    pub(crate) fn constant(&mut self, path: &EntityPath, what: &dyn AsComponents) -> Result<Chunk> {
        self.single(path, &TimePoint::default(), what)
    }

    /// A chunk with a row for each time.
    pub(crate) fn columns(
        &mut self,
        path: &EntityPath,
        times: &[TimeColumn],
        columns: impl Iterator<Item = SerializedComponentColumn>,
    ) -> Result<Chunk> {
        let times = times.iter().map(|column| (*column.timeline().name(), column.clone())).collect();
        Ok(Chunk::from_auto_row_ids(self.chunk(), path.clone(), times, ChunkComponents::from_iter(columns))?)
    }
}

/// An .rrd file being written, with the list of its chunks for the footer.
pub(crate) struct RrdStream {
    file: TailFile,
    ids: Ids,
    /// Per recording or blueprint, in the order of their appearance.
    lists: Vec<(StoreId, ChunkList)>,
}

/// Chunks beyond which provisional ends have no list of them: it would be copied for each, and a file without one is read
/// from its beginning to its end. Finished files have theirs however long it is: `rerun rrd verify` refuses one without.
const MOST_LISTED: usize = 2048;

impl RrdStream {
    /// Starts the file.
    pub(crate) fn new(file: File) -> Result<Self> {
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let version = CrateVersion::LOCAL.to_bytes();
        let mut bytes = Vec::new();
        StreamHeader { fourcc: RRD_FOURCC, version, options }.to_rrd_bytes(&mut bytes)?;
        let mut file = TailFile::new(file);
        file.write_all(&bytes)?;
        Ok(Self { file, ids: Ids::default(), lists: Vec::new() })
    }

    /// Writes out what is committed if that is much. The end of the file is missing then until the next tail is set: that can
    /// be long, and it comes soon.
    pub(crate) fn relieve(&mut self) -> Result<()> {
        if self.file.is_full() {
            self.file.flush()?;
        }
        Ok(())
    }

    /// Identifiers for the next chunks. Chunks of a provisional end take a copy, so that they leave no gap.
    pub(crate) fn ids(&mut self) -> &mut Ids {
        &mut self.ids
    }

    /// Starts a recording or a blueprint in the file.
    pub(crate) fn open_store(&mut self, store: &StoreId) -> Result<()> {
        let source = StoreSource::Other(concat!("flexarm ", env!("CARGO_PKG_VERSION")).to_owned());
        let info = StoreInfo::new(store.clone(), source);
        let row_id = self.ids.chunk().as_tuid();
        self.lists.push((store.clone(), ChunkList::default()));
        let bytes = encode(&LogMsg::SetStoreInfo(SetStoreInfo { row_id, info }))?.0;
        Ok(self.file.write_all(&bytes)?)
    }

    /// Shows a finished blueprint in the viewer, now and by default.
    pub(crate) fn activate(&mut self, blueprint: &StoreId) -> Result<()> {
        let blueprint_id = blueprint.clone();
        let command = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        let bytes = encode(&LogMsg::BlueprintActivationCommand(command))?.0;
        Ok(self.file.write_all(&bytes)?)
    }

    /// Adds a chunk for good.
    pub(crate) fn append(&mut self, store: &StoreId, chunk: &Chunk) -> Result<()> {
        let start = self.file.position() + MessageHeader::ENCODED_SIZE_BYTES as u64;
        // Made once, for the message and for the list.
        let batch = chunk.to_chunk_batch()?;
        let (bytes, uncompressed) = encode(&arrow_message(store, chunk, (&batch).into()))?;
        self.file.write_all(&bytes)?;

        let span = Span::from_start_end(start, self.file.position());
        let list = self.lists.iter_mut().find(|(known, _)| known == store);
        let (_, list) = list.expect("a store is opened before chunks are added to it");
        list.append(chunk, &batch, span, uncompressed);
        Ok(())
    }

    /// Writes out everything, with what `chunks` puts as the provisional end, and a footer: what a killed run leaves is a whole
    /// file. Beyond [`MOST_LISTED`] chunks the footer is left out, which the format allows.
    pub(crate) fn set_tail(&mut self, store: &StoreId, chunks: impl FnOnce(&mut Put<'_>) -> Result<()>) -> Result<()> {
        let position = self.file.position();
        let mut tail = Vec::new();
        let is_listed = self.lists.iter().all(|(_, list)| list.len() <= MOST_LISTED);
        let own = self.lists.iter().position(|(known, _)| known == store);
        let own = own.expect("a store is opened before chunks are added to it");
        let list = &mut self.lists[own].1;
        let mark = is_listed.then(|| list.mark());
        let written = chunks(&mut |chunk| {
            let start = position + (tail.len() + MessageHeader::ENCODED_SIZE_BYTES) as u64;
            let batch = chunk.to_chunk_batch()?;
            let (bytes, uncompressed) = encode(&arrow_message(store, &chunk, (&batch).into()))?;
            tail.extend(bytes);
            if is_listed {
                list.append(&chunk, &batch, Span::from_start_end(start, position + tail.len() as u64), uncompressed);
            }
            Ok(())
        });
        let end = written.and_then(|()| match is_listed {
            true => end(&self.lists, position + tail.len() as u64),
            false => Ok(Vec::new()),
        });
        if let Some(mark) = mark {
            // They are not there for good.
            self.lists[own].1.cut(mark);
        }
        tail.extend(end?);
        Ok(self.file.set_tail(tail)?)
    }

    /// Ends the file with the list of its chunks.
    pub(crate) fn finish(&mut self) -> Result<()> {
        if self.lists.iter().any(|(_, list)| list.len() > MOST_LISTED) {
            // The long list is made once there is room: what is held is written, and a provisional end would have none anyway.
            self.file.flush()?;
        }
        let end = end(&std::mem::take(&mut self.lists), self.file.position())?;
        self.file.write_all(&end)?;
        Ok(self.file.flush()?)
    }
}

/// The end of a file, to be put at `position`: the last message, with lists of all chunks, and where it is.
fn end(lists: &[(StoreId, ChunkList)], position: u64) -> Result<Vec<u8>> {
    let mut footer = RrdFooter { manifests: HashMap::new() }.to_transport(())?;
    for (store, list) in lists.iter().filter(|(_, list)| list.len() > 0) {
        let mut manifest = list.table(store.clone())?;
        // The library has the fields of their schemas in random order.
        let mut fields = manifest.sorbet_schema.fields().to_vec();
        fields.sort();
        manifest.sorbet_schema = Schema::new(fields);
        footer.manifests.push(manifest.to_transport(())?);
    }
    let mut payload = Vec::new();
    footer.to_rrd_bytes(&mut payload)?;

    let mut end = Vec::new();
    MessageHeader { kind: MessageKind::End, len: payload.len() as u64 }.to_rrd_bytes(&mut end)?;
    let payload_start = position + end.len() as u64;
    end.extend(&payload);
    StreamFooter::from_rrd_footer_bytes(payload_start, &payload).to_rrd_bytes(&mut end)?;
    Ok(end)
}

/// The message that brings a chunk.
fn arrow_message(store: &StoreId, chunk: &Chunk, batch: RecordBatch) -> LogMsg {
    LogMsg::ArrowMsg(store.clone(), ArrowMsg { chunk_id: chunk.id().as_tuid(), batch, on_release: None })
}

/// A message with its header, and its size without compression.
fn encode(message: &LogMsg) -> Result<(Vec<u8>, u64)> {
    let transport = message.to_transport(EncodingOptions::PROTOBUF_COMPRESSED.compression)?;
    let mut bytes = Vec::new();
    transport.to_rrd_bytes(&mut bytes)?;
    Ok((bytes, transport.byte_size_uncompressed()))
}
