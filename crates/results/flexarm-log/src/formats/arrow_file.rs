//! The table of a run as an Arrow IPC file (Feather, version 2), written and read: the columns of
//! the CSV as `double`, with the header and the result as metadata.
//!
//! Numbers are stored uncompressed with the layout they have in memory, so pyarrow, polars and
//! DuckDB can map the file instead of reading it. Start at [`ArrowRecorder`].

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch};
use arrow_ipc::convert::{IpcSchemaEncoder, fb_to_schema};
use arrow_ipc::reader::{FileDecoder, read_footer_length};
use arrow_ipc::writer::{DictionaryTracker, EncodedData, IpcDataGenerator, IpcWriteOptions, write_message};
use arrow_ipc::{FooterBuilder, MetadataVersion, root_as_footer, root_as_message};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};

use crate::described_table::{Block, Blocks, DescribedTable, TableRun, texts_at_end, texts_at_start};
use crate::file_recorder::{FileRecorder, OpenFile};
use crate::read::not_a_recording;
use crate::read::wall::{ReaderPanic, caught};
use crate::whole_file::WholeFile;
use crate::{CreateOptions, LogError, RunHeader, RunResult, Sample, table};

/// Magic bytes at the start and the end of a file.
const MAGIC: &[u8; 6] = b"ARROW1";
/// Offset of the first message (bytes); numbers are aligned to multiples of it.
const START: usize = 64;
/// Start of a message; followed by a length of zero it marks the end of the stream.
const CONTINUATION: [u8; 4] = [0xff; 4];

/// Writes a run as an Arrow IPC file, also called Feather, version 2.
///
/// Columns are those of [`crate::CsvRecorder`], all `double` without missing values, in record
/// batches of at most 16,384 rows, uncompressed. Everything without a column is in the metadata of
/// the schema, under the keys of `ParquetRecorder`. The footer has all of it; the copy of the
/// schema at the start of the file, which streaming readers use, lacks what is known only at the
/// end of the run.
///
/// Like a Parquet file it is written under a provisional name and renamed by `finish`.
pub type ArrowRecorder = FileRecorder<ArrowFile>;

/// An Arrow file that is being written.
#[derive(Debug)]
pub struct ArrowFile {
    /// None once closed.
    file: Option<File>,
    whole: WholeFile,
    schema: SchemaRef,
    /// Samples of the open record batch.
    block: Block,
    /// Record batches in the file.
    batches: Vec<arrow_ipc::Block>,
    /// Length of the file (bytes).
    length: usize,
}

impl OpenFile for ArrowFile {
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> Result<Self, LogError> {
        const ACTION: &str = "write the names of columns";
        let (mut file, whole) = WholeFile::create(path, options)?;
        let mut start = [0; START];
        start[..MAGIC.len()].copy_from_slice(MAGIC);
        file.write_all(&start).map_err(LogError::io(path, ACTION))?;

        let fields = table::columns(header).into_iter().map(|name| Field::new(name, DataType::Float64, false));
        let texts = texts_at_start(header).into_iter().collect();
        let schema = Arc::new(Schema::new_with_metadata(fields.collect::<Vec<_>>(), texts));
        let (block, batches) = (Block::new(header), Vec::new());
        let mut new = Self { file: Some(file), whole, schema, block, batches, length: START };
        let message = IpcDataGenerator::default().schema_to_bytes_with_dictionary_tracker(
            &new.schema,
            &mut DictionaryTracker::new(true),
            &IpcWriteOptions::default(),
        );
        new.message(message).map_err(arrow_error(path, ACTION))?;
        Ok(new)
    }

    fn record(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError> {
        self.block.push(path, sample)?;
        match self.block.rows() < Block::ROWS {
            true => Ok(()),
            false => self.close_batch().map_err(arrow_error(path, "write samples")),
        }
    }

    fn finish(&mut self, path: &Path, result: &RunResult) -> Result<(), LogError> {
        const ACTION: &str = "write the result and the index";
        if self.block.rows() > 0 {
            self.close_batch().map_err(arrow_error(path, ACTION))?;
        }
        let end = self.end(result);
        let Some(mut file) = self.file.take() else { return Err(LogError::not_open(path, "finish")) };
        file.write_all(&end).map_err(LogError::io(path, ACTION))?;
        self.whole.finish(file, path, ACTION)
    }
}

impl ArrowFile {
    /// Appends a message; returns its offset and the lengths of its metadata and body.
    fn message(&mut self, message: EncodedData) -> Result<arrow_ipc::Block, ArrowError> {
        let Some(file) = &mut self.file else { return Ok(arrow_ipc::Block::default()) };
        let (description, numbers) = write_message(file, message, &IpcWriteOptions::default())?;
        let place = arrow_ipc::Block::new(self.length as i64, description as i32, numbers as i64);
        self.length += description + numbers;
        Ok(place)
    }

    /// Writes the waiting samples as a record batch.
    fn close_batch(&mut self) -> Result<(), ArrowError> {
        let numbers = |column: &mut Vec<f64>| Arc::new(Float64Array::from(std::mem::take(column))) as ArrayRef;
        let columns = self.block.columns.iter_mut().map(numbers).collect();
        let batch = RecordBatch::try_new(self.schema.clone(), columns)?;
        let (_, message) = IpcDataGenerator::default().encode(
            &batch,
            &mut DictionaryTracker::new(true),
            &IpcWriteOptions::default(),
            &mut Default::default(),
        )?;
        let place = self.message(message)?;
        self.batches.push(place);
        Ok(())
    }

    /// Returns the bytes that follow the last record batch: the footer with the schema, all texts,
    /// and the places of the batches.
    fn end(&self, result: &RunResult) -> Vec<u8> {
        let mut texts = self.schema.metadata().clone();
        texts.extend(texts_at_end(result));
        let schema = self.schema.as_ref().clone().with_metadata(texts);

        // The encoder returns its builder finished; reset it to build the footer.
        let mut footer = IpcSchemaEncoder::new().schema_to_fb(&Schema::empty());
        footer.reset();
        let dictionaries = footer.create_vector::<arrow_ipc::Block>(&[]);
        let batches = footer.create_vector(&self.batches);
        let schema = IpcSchemaEncoder::new().schema_to_fb_offset(&mut footer, &schema);
        let mut parts = FooterBuilder::new(&mut footer);
        parts.add_version(MetadataVersion::V5);
        parts.add_schema(schema);
        parts.add_dictionaries(dictionaries);
        parts.add_recordBatches(batches);
        let root = parts.finish();
        footer.finish(root, None);

        let footer = footer.finished_data();
        let length = (footer.len() as i32).to_le_bytes();
        [&CONTINUATION, &[0; 4], footer, &length, MAGIC].concat()
    }
}

fn arrow_error(path: &Path, action: &'static str) -> impl FnOnce(ArrowError) -> LogError {
    move |error| match error {
        ArrowError::IoError(_, source) => LogError::io(path, action)(source),
        other => LogError::Format { path: path.to_owned(), action, cause: other.to_string() },
    }
}

/// A run read from an Arrow file.
pub(crate) type ArrowRun = TableRun<Batches>;

impl ArrowRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let mut file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
        let footer = footer(&mut file).map_err(LogError::io(path, "read the recording"))?;
        let footer = footer.ok_or_else(|| damaged(path, &Damage::NoFooter))?;
        let (batches, texts) = decoded(path, || Batches::of(file, &footer))?;
        let names: Vec<String> = batches.schema.fields().iter().map(|field| field.name().clone()).collect();
        let table = DescribedTable::of(path, &names, &texts)?;
        for &place in &table.layout.places {
            let field = batches.schema.field(place);
            if *field.data_type() != DataType::Float64 {
                let found = format!("column {} of type {}", field.name(), field.data_type());
                return Err(not_a_recording(path, found, "double, one number per row"));
            }
        }
        Self::new(path, table, batches)
    }
}

/// Reads the bytes of a file's footer; `None` if the file is incomplete.
fn footer(file: &mut File) -> io::Result<Option<Vec<u8>>> {
    let mut end = [0; 10];
    let length = file.metadata()?.len();
    let Some(at) = length.checked_sub(end.len() as u64) else { return Ok(None) };
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut end)?;
    let Some(start) = read_footer_length(end).ok().and_then(|footer| at.checked_sub(footer as u64)) else {
        return Ok(None);
    };
    let mut footer = vec![0; (at - start) as usize];
    file.seek(SeekFrom::Start(start))?;
    file.read_exact(&mut footer)?;
    Ok(Some(footer))
}

/// Record batches of a file.
#[derive(Debug)]
pub(crate) struct Batches {
    file: File,
    length: u64,
    schema: SchemaRef,
    version: MetadataVersion,
    places: Vec<arrow_ipc::Block>,
}

impl Batches {
    /// Reads the list of batches from a footer; also returns the texts of the schema, sorted by
    /// key.
    fn of(file: File, footer: &[u8]) -> Result<(Self, Vec<(String, String)>), Damage> {
        let footer = root_as_footer(footer).map_err(Damage::library)?;
        let schema = fb_to_schema(footer.schema().ok_or(Damage::NoSchema)?);
        let mut texts: Vec<(String, String)> = schema.metadata().clone().into_iter().collect();
        texts.sort();
        let places = footer.recordBatches().map(|places| places.iter().copied().collect()).unwrap_or_default();
        let length = file.metadata().map_err(Damage::library)?.len();
        Ok((Self { file, length, schema: Arc::new(schema), version: footer.version(), places }, texts))
    }

    /// Reads the bytes of a record batch; `None` if they are not within the file.
    fn bytes(&self, place: &arrow_ipc::Block) -> io::Result<Option<Vec<u8>>> {
        let size = |length: i64| u64::try_from(length).ok();
        let start_and_length = || {
            let length = size(place.metaDataLength().into())?.checked_add(size(place.bodyLength())?)?;
            let start = size(place.offset())?;
            // Check against the file length before allocating.
            (start.checked_add(length)? <= self.length).then_some((start, length))
        };
        let Some((start, length)) = start_and_length() else { return Ok(None) };
        let mut bytes = vec![0; length as usize];
        let mut file = &self.file;
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut bytes)?;
        Ok(Some(bytes))
    }

    /// Decodes the given columns of a record batch.
    fn batch(&self, place: &arrow_ipc::Block, bytes: Vec<u8>, columns: &[usize]) -> Result<RecordBatch, Damage> {
        let message = root_as_message(bytes.get(8..).ok_or(Damage::BatchCutOff)?).map_err(Damage::library)?;
        if message.header_as_record_batch().is_some_and(|batch| batch.compression().is_some()) {
            return Err(Damage::Compressed);
        }
        let decoder = FileDecoder::new(self.schema.clone(), self.version).with_projection(columns.to_vec());
        decoder.read_record_batch(place, &bytes.into()).map_err(Damage::library)?.ok_or(Damage::BatchMissing)
    }
}

impl Blocks for Batches {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn read(&self, path: &Path, block: usize, places: &[usize], columns: &mut [Vec<f64>]) -> Result<(), LogError> {
        let place = &self.places[block];
        let bytes = self.bytes(place).map_err(LogError::io(path, "read the recording"))?;
        let bytes = bytes.ok_or_else(|| damaged(path, &Damage::BatchOutside))?;
        let batch = decoded(path, || self.batch(place, bytes, places))?;
        for (array, values) in batch.columns().iter().zip(columns) {
            values.clear();
            match array.as_primitive_opt::<Float64Type>() {
                Some(array) if array.null_count() == 0 => values.extend_from_slice(array.values()),
                Some(array) => values.extend(array.iter().map(|value| value.unwrap_or(f64::NAN))),
                None => return Err(damaged(path, &Damage::NotDouble)),
            }
        }
        Ok(())
    }
}

/// Calls the Arrow library, which may panic on a damaged file.
fn decoded<T>(path: &Path, decode: impl FnOnce() -> Result<T, Damage>) -> Result<T, LogError> {
    caught(decode).map_err(Damage::Panic).and_then(|result| result).map_err(|damage| damaged(path, &damage))
}

fn damaged(path: &Path, damage: &Damage) -> LogError {
    not_a_recording(path, format!("a damaged file ({damage})"), "a whole Arrow file")
}

/// Damage of a file.
#[derive(Debug, thiserror::Error)]
enum Damage {
    #[error("it has no end")]
    NoFooter,
    #[error("its footer has no schema")]
    NoSchema,
    #[error("a record batch lies outside of it")]
    BatchOutside,
    #[error("a record batch is cut off")]
    BatchCutOff,
    #[error("a record batch is missing")]
    BatchMissing,
    #[error("its columns are compressed, which is not read here: write them uncompressed")]
    Compressed,
    #[error("a column is not double")]
    NotDouble,
    /// Error of the Arrow library.
    #[error("{0}")]
    Library(String),
    #[error(transparent)]
    Panic(ReaderPanic),
}

impl Damage {
    fn library(error: impl ToString) -> Self {
        Self::Library(error.to_string())
    }
}
