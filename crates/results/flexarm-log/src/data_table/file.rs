//! Result tables as Parquet files.
//!
//! Missing numbers and texts are null in the file; NaN counts as missing. The same table gives the
//! same bytes on any machine: rows are written in groups of [`GROUP`], and nothing depends on the
//! clock. Start at [`DataTable::write`] and [`DataTable::read`].
//! Not here: recordings of a run ([`crate::parquet_file`]).

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use flexarm_files::most_unpacked;
use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as PhysicalType, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use crate::parquet_file::parquet_error;
use crate::read::{not_a_recording, parquet_table};
use crate::whole_file::WholeFile;
use crate::{CreateOptions, LogError};

use super::{DataColumn, DataTable, DataValues};

/// Number of rows per row group.
const GROUP: usize = 65_536;

impl DataValues {
    fn kind(&self, name: &str) -> Result<Type, ParquetError> {
        match self {
            Self::Whole(_) => {
                Type::primitive_type_builder(name, PhysicalType::INT64).with_repetition(Repetition::REQUIRED).build()
            }
            Self::Number(_) => {
                Type::primitive_type_builder(name, PhysicalType::DOUBLE).with_repetition(Repetition::OPTIONAL).build()
            }
            Self::Text(_) => Type::primitive_type_builder(name, PhysicalType::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String))
                .with_repetition(Repetition::OPTIONAL)
                .build(),
        }
    }

    /// Writes a range of rows as the next column of a row group.
    fn write(
        &self,
        group: &mut SerializedRowGroupWriter<'_, File>,
        rows: std::ops::Range<usize>,
    ) -> Result<(), ParquetError> {
        let Some(mut writer) = group.next_column()? else { return Ok(()) };
        let levels = |present: &mut dyn Iterator<Item = bool>| present.map(i16::from).collect::<Vec<i16>>();
        match self {
            Self::Whole(values) => {
                writer.typed::<Int64Type>().write_batch(&values[rows], None, None)?;
            }
            Self::Number(values) => {
                let values = &values[rows];
                let levels = levels(&mut values.iter().map(|x| !x.is_nan()));
                let there: Vec<f64> = values.iter().copied().filter(|x| !x.is_nan()).collect();
                writer.typed::<DoubleType>().write_batch(&there, Some(&levels), None)?;
            }
            Self::Text(values) => {
                let values = &values[rows];
                let levels = levels(&mut values.iter().map(Option::is_some));
                let there: Vec<ByteArray> = values.iter().flatten().map(|text| text.as_str().into()).collect();
                writer.typed::<ByteArrayType>().write_batch(&there, Some(&levels), None)?;
            }
        }
        writer.close()
    }
}

impl DataTable {
    /// Writes the table as a Parquet file, atomically: either the whole file is on the disk or
    /// none.
    ///
    /// # Errors
    /// [`LogError`] if the file exists and may not be replaced, or on an I/O error.
    pub fn write(&self, path: &Path, options: CreateOptions) -> Result<(), LogError> {
        const ACTION: &str = "write the table";
        let (file, mut whole) = WholeFile::create(path, options)?;
        let file = self.to_file(file).map_err(parquet_error(path, ACTION))?;
        whole.finish(file, path, ACTION)
    }

    fn to_file(&self, file: File) -> Result<File, ParquetError> {
        let column = |column: &DataColumn| Ok(Arc::new(column.values.kind(&column.name)?));
        let columns = self.columns.iter().map(column).collect::<Result<Vec<_>, ParquetError>>()?;
        let schema = Type::group_type_builder("table").with_fields(columns).build()?;
        let mut properties = WriterProperties::builder()
            .set_created_by(concat!("flexarm ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_dictionary_enabled(true)
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_max_row_group_row_count(None);
        for column in self.columns.iter().filter(|column| matches!(column.values, DataValues::Number(_))) {
            let place = parquet::schema::types::ColumnPath::from(column.name.as_str());
            // Numbers rarely repeat, so a dictionary does not help; grouping bytes by significance
            // compresses better.
            properties = properties
                .set_column_dictionary_enabled(place.clone(), false)
                .set_column_encoding(place, Encoding::BYTE_STREAM_SPLIT);
        }
        let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))?;
        let rows = self.rows();
        for start in (0..rows).step_by(GROUP) {
            let mut group = writer.next_row_group()?;
            for column in &self.columns {
                column.values.write(&mut group, start..(start + GROUP).min(rows))?;
            }
            group.close()?;
        }
        for (key, value) in &self.texts {
            writer.append_key_value_metadata(KeyValue::new(key.clone(), value.clone()));
        }
        writer.into_inner()
    }

    /// Reads a table written by [`DataTable::write`].
    ///
    /// # Errors
    /// [`LogError::Io`] if the file cannot be read, [`LogError::NotARecording`] if it is not such a
    /// table.
    pub fn read(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(LogError::io(path, "open the table"))?;
        parquet_table::read(path, || {
            let most = most_unpacked(file.metadata()?.len());
            let reader = parquet_table::open(file)?;
            let texts = parquet_table::texts(&reader);
            let schema = reader.metadata().file_metadata().schema_descr();
            let mut letters = 0;
            let columns = schema.columns().iter().enumerate().map(|(place, column)| {
                let values = match column.physical_type() {
                    PhysicalType::INT64 => {
                        DataValues::Whole(values::<Int64Type>(&reader, place)?.into_iter().flatten().collect())
                    }
                    PhysicalType::DOUBLE => {
                        let numbers = values::<DoubleType>(&reader, place)?;
                        DataValues::Number(numbers.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
                    }
                    PhysicalType::BYTE_ARRAY => {
                        let text = |bytes: ByteArray| bytes.as_utf8().map(str::to_owned);
                        let texts = values::<ByteArrayType>(&reader, place)?;
                        // One entry of a dictionary may be the text of all rows.
                        letters += texts.iter().flatten().map(|text| text.len() as u64).sum::<u64>();
                        if letters > most {
                            let what = format!("its texts have more than {most} bytes, the limit for its size");
                            return Err(ParquetError::General(what));
                        }
                        DataValues::Text(texts.into_iter().map(|x| x.map(text).transpose()).collect::<Result<_, _>>()?)
                    }
                    other => return Err(ParquetError::General(format!("column {} of type {other}", column.name()))),
                };
                Ok(DataColumn::new(column.name(), values))
            });
            Ok(Self { columns: columns.collect::<Result<_, ParquetError>>()?, texts })
        })
        .and_then(|table| {
            let rows = table.rows();
            match table.columns.iter().find(|column| column.values.len() != rows) {
                None => Ok(table),
                Some(column) => {
                    let found = format!("{} values in column {}", column.values.len(), column.name);
                    Err(not_a_recording(path, found, format!("as many values in each column, {rows}")))
                }
            }
        })
    }
}

/// Reads the values of a column from all row groups.
fn values<T: DataType>(reader: &SerializedFileReader<File>, place: usize) -> Result<Vec<Option<T::T>>, ParquetError> {
    let groups = (0..reader.num_row_groups()).map(|group| parquet_table::column::<T>(reader, group, place));
    Ok(groups.collect::<Result<Vec<_>, _>>()?.concat())
}
