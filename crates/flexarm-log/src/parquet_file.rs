//! The table of a run as a Parquet file: the columns of the CSV as `double`, and the header and the result beside them.
//!
//! Written through the columns of the format itself: with one kind of number and no missing values Arrow would add
//! nothing but its compile time. Start at [`ParquetRecorder`].

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, Repetition, Type as PhysicalType, ZstdLevel};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::shape::Shape;
use crate::{Attachment, CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample, run_json, table};

/// Rows after which a row group is closed: what is held in memory.
const GROUP_ROWS: usize = 16_384;

/// Key under which the header is stored, as `run.json` of MCAP files.
pub(crate) const RUN_KEY: &str = "flexarm.run";
/// Key of figures, events and attached texts of the result (JSON).
pub(crate) const RESULT_KEY: &str = "flexarm.result";
/// Before the name of an attached text of the set-up.
pub(crate) const RUN_FILE: &str = "flexarm.run_file.";

/// Writes a run as a Parquet file.
///
/// Columns are those of [`crate::CsvRecorder`], all `double` without missing values, compressed with zstd after their
/// bytes were sorted by significance. The file's key-value metadata say what a table has no column for: `robot`,
/// `trajectory`, `units`, `version`; each result figure under its label with `figure.` before it; for readers of flexarm
/// `flexarm.run` and `flexarm.result` (JSON), and the attached texts.
///
/// A Parquet file cannot be read before its end is written. So this one comes into being under the name `<file>.partial`
/// and is renamed by `finish`; a run that is killed, or a disk that is full, leaves nothing under the file's own name.
#[derive(Debug)]
pub struct ParquetRecorder {
    path: PathBuf,
    options: CreateOptions,
    state: State,
}

#[derive(Debug)]
enum State {
    New,
    Open(Box<Open>),
    Finished,
}

impl ParquetRecorder {
    /// A recorder that will write `path`; the file is there after `finish`.
    pub fn create(path: impl Into<PathBuf>, options: CreateOptions) -> Self {
        Self { path: path.into(), options, state: State::New }
    }
}

impl Recorder for ParquetRecorder {
    fn check(&self) -> Result<(), LogError> {
        self.options.check(&self.path)
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if !matches!(self.state, State::New) {
            return Err(LogError::begun_twice(&self.path));
        }
        self.check()?;
        let partial = partial_path(&self.path);
        let file = File::create(&partial).map_err(LogError::io(&self.path, "create the file"))?;
        let remove = RemoveOnDrop(Some(partial));
        let open = Open::new(file, remove, header).map_err(parquet_error(&self.path, "write the names of columns"))?;
        self.state = State::Open(Box::new(open));
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "record")) };
        open.shape.check(&self.path, sample)?;
        open.sample(sample).map_err(parquet_error(&self.path, "write samples"))
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        let State::Open(open) = std::mem::replace(&mut self.state, State::Finished) else {
            return Err(LogError::not_open(&self.path, "finish"));
        };
        let mut remove = open.finish(result).map_err(parquet_error(&self.path, "write the result and the index"))?;
        self.check()?; // not there at the start, but perhaps now
        if let Some(partial) = &remove.0 {
            std::fs::rename(partial, &self.path).map_err(LogError::io(&self.path, "give the file its name"))?;
        }
        remove.0 = None;
        Ok(())
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

/// `<file>.partial`
fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

/// A file that goes away unless it is taken out.
#[derive(Debug)]
struct RemoveOnDrop(Option<PathBuf>);

impl Drop for RemoveOnDrop {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            let _ = std::fs::remove_file(path); // what cannot be removed stays
        }
    }
}

struct Open {
    // Fields are dropped in this order: the file is closed before it is removed.
    writer: SerializedFileWriter<File>,
    remove: RemoveOnDrop,
    shape: Shape,
    row: Vec<f64>,
    /// Numbers of the open row group, column by column.
    columns: Vec<Vec<f64>>,
}

impl std::fmt::Debug for Open {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Open").field("shape", &self.shape).finish_non_exhaustive()
    }
}

impl Open {
    fn new(file: File, remove: RemoveOnDrop, header: &RunHeader) -> Result<Self, ParquetError> {
        let names = table::columns(header);
        let column = |name: &String| {
            let kind = Type::primitive_type_builder(name, PhysicalType::DOUBLE);
            Ok(Arc::new(kind.with_repetition(Repetition::REQUIRED).build()?))
        };
        let columns = names.iter().map(column).collect::<Result<Vec<_>, ParquetError>>()?;
        let schema = Type::group_type_builder("run").with_fields(columns).build()?;
        let properties = WriterProperties::builder()
            .set_created_by(concat!("flexarm ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_dictionary_enabled(false) // hardly a number comes twice
            .set_encoding(Encoding::BYTE_STREAM_SPLIT)
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_max_row_group_row_count(None)
            .build();
        let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
        for (key, value) in description(header) {
            writer.append_key_value_metadata(KeyValue::new(key, value));
        }
        let columns = vec![Vec::new(); names.len()];
        Ok(Self { writer, remove, shape: Shape::of(header), row: Vec::new(), columns })
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), ParquetError> {
        table::fill_row(sample, &self.shape, &mut self.row);
        for (column, value) in self.columns.iter_mut().zip(&self.row) {
            column.push(*value);
        }
        if self.columns[0].len() >= GROUP_ROWS {
            self.close_group()?;
        }
        Ok(())
    }

    fn close_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            let Some(mut writer) = group.next_column()? else { break };
            writer.typed::<DoubleType>().write_batch(column, None, None)?;
            writer.close()?;
            column.clear();
        }
        group.close()?;
        Ok(())
    }

    /// Returns the file's provisional name, still to be removed on error.
    fn finish(mut self, result: &RunResult) -> Result<RemoveOnDrop, ParquetError> {
        if !self.columns[0].is_empty() {
            self.close_group()?;
        }
        for (key, value) in results(result) {
            self.writer.append_key_value_metadata(KeyValue::new(key, value));
        }
        let mut file = self.writer.into_inner()?;
        file.flush()?;
        file.sync_all()?; // the name must not be there before the bytes are
        Ok(self.remove)
    }
}

/// Key-value pairs that are known at the start.
fn description(header: &RunHeader) -> Vec<(String, String)> {
    let mut pairs = vec![
        ("robot".to_owned(), header.robot.clone()),
        ("trajectory".into(), header.trajectory.clone()),
        ("units".into(), "SI: m, rad, s, N, N m, J; as in the names of the columns".into()),
        ("version".into(), env!("CARGO_PKG_VERSION").into()),
        (RUN_KEY.into(), run_json::write(header, false)),
    ];
    pairs.extend(texts(&header.attachments));
    pairs
}

/// Key-value pairs that are known at the end.
fn results(result: &RunResult) -> Vec<(String, String)> {
    let label = |(label, value): &(String, String)| (format!("figure.{label}"), value.clone());
    let mut pairs: Vec<_> = result.figures.iter().map(label).collect();
    pairs.push((RESULT_KEY.into(), run_json::write_result(result)));
    pairs
}

/// Attached files as far as they are text.
fn texts(files: &[Attachment]) -> Vec<(String, String)> {
    let text = |file: &Attachment| {
        let text = String::from_utf8(file.bytes.clone()).ok()?;
        Some((format!("{RUN_FILE}{}", file.name), text))
    };
    files.iter().filter_map(text).collect()
}

fn parquet_error(path: &Path, action: &'static str) -> impl FnOnce(ParquetError) -> LogError {
    move |error| match error {
        ParquetError::External(cause) => match cause.downcast::<io::Error>() {
            Ok(source) => LogError::io(path, action)(*source),
            Err(cause) => LogError::Format { path: path.to_owned(), action, cause: cause.to_string() },
        },
        other => LogError::Format { path: path.to_owned(), action, cause: other.to_string() },
    }
}
