//! Reader of the Parquet file of a run, row group by row group.
//!
//! Start at [`ParquetRun`]; [`open`], [`column`] and [`read`] serve other tables too. Sizes that a
//! file states are checked before memory is allocated for them.
//! Not here: meaning of columns ([`crate::table`]) and texts ([`crate::described_table`]).

use std::fs::File;
use std::path::{Path, PathBuf};

use flexarm_files::most_unpacked;
use parquet::basic::{Repetition, Type as PhysicalType};
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::column::reader::{get_column_reader, get_typed_column_reader};
use parquet::data_type::{DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::not_a_recording;
use super::wall::caught;
use crate::described_table::DescribedTable;
use crate::{LogError, RunHeader, RunResult, RunSource, Sample, table};

/// A run read from a Parquet file.
pub(crate) struct ParquetRun {
    path: PathBuf,
    table: DescribedTable,
    groups: RowGroups,
}

impl ParquetRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
        let groups = RowGroups(read(path, || open(file))?);
        let names: Vec<String> = {
            let schema = groups.0.metadata().file_metadata().schema_descr();
            schema.columns().iter().map(|column| column.path().string()).collect()
        };
        let mut table = DescribedTable::of(path, &names, &texts(&groups.0))?;
        groups.check_columns(path, &table.layout.places)?;
        if !table.described && groups.0.num_row_groups() > 0 {
            let mut times = Vec::new();
            groups.numbers(path, 0, table.layout.places[0], &mut times)?;
            if let [first, second, ..] = times[..] {
                table.layout.header.log_rate_hz = table::rate_hz(first, second);
            }
        }
        Ok(Self { path: path.to_owned(), table, groups })
    }
}

impl RunSource for ParquetRun {
    fn header(&self) -> &RunHeader {
        &self.table.layout.header
    }

    fn missing(&self) -> Vec<String> {
        let undescribed = "the file does not say which robot and trajectory it is of: another program wrote it";
        if self.table.described { Vec::new() } else { vec![undescribed.into()] }
    }

    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError> {
        let layout = &self.table.layout;
        let mut columns = vec![Vec::new(); layout.places.len()];
        let (mut sample, mut row) = (Sample::default(), Vec::new());
        for group in 0..self.groups.0.num_row_groups() {
            for (&place, column) in layout.places.iter().zip(&mut columns) {
                self.groups.numbers(&self.path, group, place, column)?;
            }
            for k in 0..columns[0].len() {
                row.clear();
                row.extend(columns.iter().map(|column| column[k]));
                layout.sample(&row, &mut sample);
                take(&sample)?;
            }
        }
        Ok(self.table.result.clone())
    }
}

/// Row groups of a file.
struct RowGroups(SerializedFileReader<File>);

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
    fn numbers(&self, path: &Path, group: usize, place: usize, values: &mut Vec<f64>) -> Result<(), LogError> {
        let numbers = read(path, || column::<DoubleType>(&self.0, group, place))?;
        values.clear();
        values.extend(numbers.into_iter().map(|number| number.unwrap_or(f64::NAN)));
        let rows = self.0.metadata().row_group(group).num_rows();
        if values.len() as i64 != rows {
            let found = format!("{} numbers in a group of {rows} rows", values.len());
            return Err(not_a_recording(path, found, "as many numbers as rows"));
        }
        Ok(())
    }
}

/// Opens a file, and checks the uncompressed size that it states.
///
/// # Errors
/// [`ParquetError`] if the file is not Parquet, or is too large for its length.
pub(crate) fn open(file: File) -> Result<SerializedFileReader<File>, ParquetError> {
    let most = most_unpacked(file.metadata()?.len());
    let reader = SerializedFileReader::new(file)?;
    let groups = reader.metadata().row_groups();
    let number = |count: i64| u64::try_from(count).unwrap_or(0);
    let rows = |group: &RowGroupMetaData| number(group.num_rows()).saturating_mul(size_of::<f64>() as u64);
    let columns = groups.iter().flat_map(|group| group.columns().iter().map(move |column| (group, column)));
    let sizes = columns.map(|(group, column)| number(column.uncompressed_size()).max(rows(group)));
    let size = sizes.fold(0, u64::saturating_add);
    if size > most {
        let what = format!("it unpacks to {size} bytes, more than {most}, the limit for its size");
        return Err(ParquetError::General(what));
    }
    Ok(reader)
}

/// Returns the texts of a file, as pairs of key and value.
pub(crate) fn texts(reader: &SerializedFileReader<File>) -> Vec<(String, String)> {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    pairs.into_iter().flatten().filter_map(|pair| Some((pair.key.clone(), pair.value.clone()?))).collect()
}

/// Reads a column of a row group; `None` for a missing value.
pub(crate) fn column<T: DataType>(
    reader: &SerializedFileReader<File>,
    group: usize,
    place: usize,
) -> Result<Vec<Option<T::T>>, ParquetError> {
    let group = reader.get_row_group(group)?;
    let described = group.metadata().column(place);
    if described.column_descr().max_rep_level() > 0 {
        return Err(ParquetError::General(format!("column {} has lists", described.column_path())));
    }
    let pages = Pages { pages: group.get_column_page_reader(place)?, left: described.uncompressed_size() };
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    let mut column = get_typed_column_reader::<T>(get_column_reader(described.column_descr_ptr(), Box::new(pages)));
    let (mut present, mut levels) = (Vec::new(), Vec::new());
    while levels.len().max(present.len()) < rows {
        let (records, ..) = column.read_records(rows, Some(&mut levels), None, &mut present)?;
        if records == 0 {
            break;
        }
    }
    let mut present = present.into_iter();
    Ok(match levels.is_empty() {
        true => present.map(Some).collect(),
        false => levels.iter().map(|level| if *level > 0 { present.next() } else { None }).collect(),
    })
}

/// Pages of a column of a row group, up to the size that the file states for it.
struct Pages {
    pages: Box<dyn PageReader>,
    left: i64,
}

impl Iterator for Pages {
    type Item = Result<Page, ParquetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>, ParquetError> {
        let page = self.pages.get_next_page()?;
        self.left -= page.as_ref().map_or(0, |page| page.buffer().len() as i64);
        match self.left < 0 {
            true => Err(ParquetError::General("a column is larger than the file states".into())),
            false => Ok(page),
        }
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>, ParquetError> {
        self.pages.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<(), ParquetError> {
        self.pages.skip_next_page()
    }

    fn at_record_boundary(&mut self) -> Result<bool, ParquetError> {
        self.pages.at_record_boundary()
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
