//! A Parquet file of a run, row group by row group.

use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::basic::{Repetition, Type as PhysicalType};
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::wall::caught;
use super::{not_a_recording, stem};
use crate::parquet_file::{RESULT_KEY, RUN_FILE, RUN_KEY};
use crate::table::{self, TableLayout};
use crate::{Attachment, LogError, RunHeader, RunResult, RunSource, Sample, run_json};

/// See the module.
pub(crate) struct ParquetRun {
    path: PathBuf,
    file: SerializedFileReader<File>,
    layout: TableLayout,
    result: RunResult,
    /// Whether the file says which run it is.
    described: bool,
}

impl ParquetRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
        let file = read(path, || SerializedFileReader::new(file))?;
        let names: Vec<String> = {
            let schema = file.metadata().file_metadata().schema_descr();
            schema.columns().iter().map(|column| column.path().string()).collect()
        };
        let pairs = file.metadata().file_metadata().key_value_metadata();
        let pairs: Vec<(String, String)> =
            pairs.into_iter().flatten().filter_map(|pair| Some((pair.key.clone(), pair.value.clone()?))).collect();
        let value = |key: &str| pairs.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str());
        let attached = |(key, text): &(String, String)| {
            let name = key.strip_prefix(RUN_FILE)?.to_owned();
            let media_type = media_type(&name).to_owned();
            Some(Attachment { name, media_type, bytes: text.clone().into_bytes() })
        };

        let refuse = |(found, expected)| not_a_recording(path, found, expected);
        let described = value(RUN_KEY).map(|text| run_json::read(text.as_bytes()));
        let mut layout = match described {
            Some(Ok((header, _))) => TableLayout::of_header(header, &names),
            Some(Err(what)) => Err((what, "the description of a run".to_owned())),
            None => TableLayout::of_names(&names),
        }
        .map_err(refuse)?;
        let described = value(RUN_KEY).is_some();
        if !described {
            (layout.header.robot, layout.header.trajectory) = (stem(path), "unknown".into());
        }
        layout.header.attachments = pairs.iter().filter_map(attached).collect();

        let result = value(RESULT_KEY).map(run_json::read_result).unwrap_or_default();

        let mut run = Self { path: path.to_owned(), file, layout, result, described };
        run.check_columns()?;
        if !described {
            let mut times = Vec::new();
            if run.file.num_row_groups() > 0 {
                run.column(0, 0, &mut times)?;
            }
            if let [first, second, ..] = times[..] {
                run.layout.header.log_rate_hz = table::rate_hz(first, second);
            }
        }
        Ok(run)
    }

    /// All columns of the run must be numbers without gaps.
    fn check_columns(&self) -> Result<(), LogError> {
        let schema = self.file.metadata().file_metadata().schema_descr();
        for &place in &self.layout.places {
            let column = schema.column(place);
            let required = column.self_type().get_basic_info().repetition() == Repetition::REQUIRED
                || column.max_def_level() <= 1 && column.max_rep_level() == 0;
            if column.physical_type() != PhysicalType::DOUBLE || !required {
                let found = format!("column {} of type {}", column.name(), column.physical_type());
                return Err(not_a_recording(&self.path, found, "double, one number per row"));
            }
        }
        Ok(())
    }

    /// Numbers of the column `index` of the table in a row group; missing ones are NaN.
    fn column(&self, group: usize, index: usize, values: &mut Vec<f64>) -> Result<(), LogError> {
        let place = self.layout.places[index];
        let (mut present, mut levels) = (Vec::new(), Vec::new());
        let rows = read(&self.path, || {
            let group = self.file.get_row_group(group)?;
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let mut reader = get_typed_column_reader::<DoubleType>(group.get_column_reader(place)?);
            while levels.len().max(present.len()) < rows {
                let (records, ..) = reader.read_records(rows, Some(&mut levels), None, &mut present)?;
                if records == 0 {
                    break;
                }
            }
            Ok(rows)
        })?;
        values.clear();
        match levels.is_empty() {
            true => values.append(&mut present),
            false => {
                let mut present = present.into_iter();
                let value = |level: &i16| if *level > 0 { present.next().unwrap_or(f64::NAN) } else { f64::NAN };
                values.extend(levels.iter().map(value));
            }
        }
        if values.len() != rows {
            let found = format!("{} numbers in a group of {rows} rows", values.len());
            return Err(not_a_recording(&self.path, found, "as many numbers as rows"));
        }
        Ok(())
    }
}

impl RunSource for ParquetRun {
    fn header(&self) -> &RunHeader {
        &self.layout.header
    }

    fn missing(&self) -> Vec<String> {
        let undescribed = "the file does not say which robot and trajectory it is of: another program wrote it";
        if self.described { Vec::new() } else { vec![undescribed.into()] }
    }

    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError> {
        let mut columns = vec![Vec::new(); self.layout.places.len()];
        let (mut sample, mut row) = (Sample::default(), Vec::new());
        for group in 0..self.file.num_row_groups() {
            for (index, column) in columns.iter_mut().enumerate() {
                self.column(group, index, column)?;
            }
            for k in 0..columns[0].len() {
                row.clear();
                row.extend(columns.iter().map(|column| column[k]));
                self.layout.sample(&row, &mut sample);
                take(&sample)?;
            }
        }
        Ok(self.result.clone())
    }
}

fn media_type(name: &str) -> &'static str {
    match Path::new(name).extension().and_then(std::ffi::OsStr::to_str) {
        Some("json") => "application/json",
        Some("toml") => "application/toml",
        _ => "text/plain",
    }
}

/// Calls the library, which may panic on a damaged file.
fn read<T>(path: &Path, read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, LogError> {
    match caught(read) {
        Ok(result) => result.map_err(|error| broken(path, error)),
        Err(cause) => Err(not_a_recording(path, format!("a damaged file ({cause})"), "a whole Parquet file")),
    }
}

fn broken(path: &Path, error: ParquetError) -> LogError {
    match error {
        ParquetError::External(cause) if cause.is::<std::io::Error>() => match cause.downcast() {
            Ok(source) => LogError::Io { path: path.to_owned(), action: "read the recording", source: *source },
            Err(cause) => not_a_recording(path, cause.to_string(), "a whole Parquet file"),
        },
        other => not_a_recording(path, format!("a damaged file ({other})"), "a whole Parquet file"),
    }
}
