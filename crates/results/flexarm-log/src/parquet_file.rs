//! The table of a run as a Parquet file: the columns of the CSV as `double`, with the header and
//! the result as metadata.
//!
//! Written with the column writer of the `parquet` crate: with a single number type and no missing
//! values, Arrow would only add compile time. Start at [`ParquetRecorder`].

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, Repetition, Type as PhysicalType, ZstdLevel};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::described_table::{Block, texts_at_end, texts_at_start};
use crate::file_recorder::{FileRecorder, OpenFile};
use crate::whole_file::WholeFile;
use crate::{CreateOptions, LogError, RunHeader, RunResult, Sample, table};

/// Writes a run as a Parquet file.
///
/// Columns are those of [`crate::CsvRecorder`], all `double` without missing values, encoded as
/// `BYTE_STREAM_SPLIT` and compressed with zstd. Everything without a column is in the key-value
/// metadata: `robot`, `trajectory`, `units`, `version`; each result figure under its label with the
/// prefix `figure.`; for readers of flexarm `flexarm.run` and `flexarm.result` (JSON), and the
/// attached texts.
///
/// A Parquet file cannot be read before its footer is written. It is therefore written under a
/// provisional name and renamed by `finish`; a killed run or a full disk leaves nothing under the
/// file's own name.
pub type ParquetRecorder = FileRecorder<ParquetFile>;

/// A Parquet file that is being written.
pub struct ParquetFile {
    /// None once closed.
    writer: Option<SerializedFileWriter<File>>,
    whole: WholeFile,
    /// Samples of the open row group.
    block: Block,
}

impl std::fmt::Debug for ParquetFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ParquetFile").field("whole", &self.whole).finish_non_exhaustive()
    }
}

impl OpenFile for ParquetFile {
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> Result<Self, LogError> {
        let (file, whole) = WholeFile::create(path, options)?;
        let writer = writer(file, header).map_err(parquet_error(path, "write the names of columns"))?;
        Ok(Self { writer: Some(writer), whole, block: Block::new(header) })
    }

    fn record(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError> {
        self.block.push(path, sample)?;
        match self.block.rows() < Block::ROWS {
            true => Ok(()),
            false => self.close_group().map_err(parquet_error(path, "write samples")),
        }
    }

    fn finish(&mut self, path: &Path, result: &RunResult) -> Result<(), LogError> {
        const ACTION: &str = "write the result and the index";
        if self.block.rows() > 0 {
            self.close_group().map_err(parquet_error(path, ACTION))?;
        }
        let Some(mut writer) = self.writer.take() else { return Err(LogError::not_open(path, "finish")) };
        for (key, value) in texts_at_end(result) {
            writer.append_key_value_metadata(KeyValue::new(key, value));
        }
        let file = writer.into_inner().map_err(parquet_error(path, ACTION))?;
        self.whole.finish(file, path, ACTION)
    }
}

impl ParquetFile {
    fn close_group(&mut self) -> Result<(), ParquetError> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let mut group = writer.next_row_group()?;
        for column in &mut self.block.columns {
            let Some(mut writer) = group.next_column()? else { break };
            writer.typed::<DoubleType>().write_batch(column, None, None)?;
            writer.close()?;
            column.clear();
        }
        group.close()?;
        Ok(())
    }
}

/// Creates a writer of the columns of a run, with the texts known at the start.
fn writer(file: File, header: &RunHeader) -> Result<SerializedFileWriter<File>, ParquetError> {
    let column = |name: &String| {
        let kind = Type::primitive_type_builder(name, PhysicalType::DOUBLE);
        Ok(Arc::new(kind.with_repetition(Repetition::REQUIRED).build()?))
    };
    let columns = table::columns(header).iter().map(column).collect::<Result<Vec<_>, ParquetError>>()?;
    let schema = Type::group_type_builder("run").with_fields(columns).build()?;
    let properties = WriterProperties::builder()
        .set_created_by(concat!("flexarm ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_dictionary_enabled(false) // numbers rarely repeat
        .set_encoding(Encoding::BYTE_STREAM_SPLIT)
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_max_row_group_row_count(None)
        .build();
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
    for (key, value) in texts_at_start(header) {
        writer.append_key_value_metadata(KeyValue::new(key, value));
    }
    Ok(writer)
}

pub(crate) fn parquet_error(path: &Path, action: &'static str) -> impl FnOnce(ParquetError) -> LogError {
    move |error| match error {
        ParquetError::External(cause) => match cause.downcast::<io::Error>() {
            Ok(source) => LogError::io(path, action)(*source),
            Err(cause) => LogError::Format { path: path.to_owned(), action, cause: cause.to_string() },
        },
        other => LogError::Format { path: path.to_owned(), action, cause: other.to_string() },
    }
}
