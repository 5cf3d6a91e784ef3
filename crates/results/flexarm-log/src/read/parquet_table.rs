//! Reader of the Parquet file of a run, row group by row group.

use std::fs::File;
use std::path::Path;

use parquet::basic::{Repetition, Type as PhysicalType};
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::not_a_recording;
use super::wall::caught;
use crate::LogError;
use crate::described_table::{Blocks, DescribedTable, TableRun};

/// A run read from a Parquet file.
pub(crate) type ParquetRun = TableRun<RowGroups>;

impl ParquetRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
        let groups = RowGroups(read(path, || SerializedFileReader::new(file))?);
        let names: Vec<String> = {
            let schema = groups.0.metadata().file_metadata().schema_descr();
            schema.columns().iter().map(|column| column.path().string()).collect()
        };
        let pairs = groups.0.metadata().file_metadata().key_value_metadata();
        let texts: Vec<(String, String)> =
            pairs.into_iter().flatten().filter_map(|pair| Some((pair.key.clone(), pair.value.clone()?))).collect();
        let table = DescribedTable::of(path, &names, &texts)?;
        groups.check_columns(path, &table.layout.places)?;
        Self::new(path, table, groups)
    }
}

/// Row groups of a file.
pub(crate) struct RowGroups(SerializedFileReader<File>);

impl RowGroups {
    /// Checks that the columns of the run are plain numbers.
    fn check_columns(&self, path: &Path, places: &[usize]) -> Result<(), LogError> {
        let schema = self.0.metadata().file_metadata().schema_descr();
        for &place in places {
            let column = schema.column(place);
            let required = column.self_type().get_basic_info().repetition() == Repetition::REQUIRED
                || column.max_def_level() <= 1 && column.max_rep_level() == 0;
            if column.physical_type() != PhysicalType::DOUBLE || !required {
                let found = format!("column {} of type {}", column.name(), column.physical_type());
                return Err(not_a_recording(path, found, "double, one number per row"));
            }
        }
        Ok(())
    }

    /// Reads the numbers of a column in a row group.
    fn column(&self, path: &Path, group: usize, place: usize, values: &mut Vec<f64>) -> Result<(), LogError> {
        let (mut present, mut levels) = (Vec::new(), Vec::new());
        let rows = read(path, || {
            let group = self.0.get_row_group(group)?;
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
            return Err(not_a_recording(path, found, "as many numbers as rows"));
        }
        Ok(())
    }
}

impl Blocks for RowGroups {
    fn count(&self) -> usize {
        self.0.num_row_groups()
    }

    fn read(&self, path: &Path, block: usize, places: &[usize], columns: &mut [Vec<f64>]) -> Result<(), LogError> {
        let mut both = places.iter().zip(columns);
        both.try_for_each(|(&place, column)| self.column(path, block, place, column))
    }
}

/// Calls the Parquet library, which may panic on a damaged file.
pub(crate) fn read<T>(path: &Path, read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, LogError> {
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
