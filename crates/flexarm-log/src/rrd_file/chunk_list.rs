//! The list of a recording's chunks, which ends an .rrd file, in little memory.
//!
//! As a table it has a column for each component and timeline, and nearly all of a chunk's places in it are empty: 1.7 kB for
//! a chunk of an arm. [`ChunkList`] keeps what is not empty, and makes the table when it is written.

use std::sync::Arc;

use re_log_encoding::{CodecError, RawRrdManifest, RrdManifestBuilder};

use crate::rerun::StoreId;
use crate::rerun::arrow::array::{
    Array, ArrayRef, AsArray, BooleanArray, DurationNanosecondArray, FixedSizeBinaryArray, Int64Array, RecordBatch,
    RecordBatchOptions, StringArray, UInt64Array,
};
use crate::rerun::arrow::datatypes::{
    DataType, DurationNanosecondType, Field, Int64Type, Schema, TimeUnit, UInt64Type,
};
use crate::rerun::arrow::error::ArrowError;

/// Columns that each chunk has: entity, identifier, whether it holds always, rows, place, size in the file and unpacked.
const ALWAYS: usize = 7;

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct ChunkList {
    /// Columns that each chunk has, once there is one, and all others, in the order of their appearance.
    always: Vec<Arc<Field>>,
    columns: Vec<Arc<Field>>,
    /// Chunks with the same columns of the same entity, in the order of their appearance.
    kinds: Vec<Kind>,
    chunks: Vec<Listed>,
    /// Values of one chunk after the other, each as [`number`] has them.
    values: Vec<i64>,
}

#[derive(Clone, Debug, PartialEq)]
struct Kind {
    entity: String,
    /// Columns of which its chunks have values, by their numbers.
    columns: Vec<usize>,
    /// What the recording holds of it.
    holds: Schema,
}

/// A chunk in the list.
#[derive(Clone, Copy, Debug)]
struct Listed {
    kind: u32,
    is_static: bool,
    id: [u8; 16],
    rows: u64,
    start: u64,
    size: u64,
    unpacked: u64,
}

/// A length to which a list can be cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    columns: usize,
    kinds: usize,
    chunks: usize,
    values: usize,
}

impl ChunkList {
    /// Adds a chunk, as the list of it alone.
    pub(super) fn append(&mut self, one: RrdManifestBuilder, store: &StoreId) -> Result<(), CodecError> {
        let RawRrdManifest { sorbet_schema: holds, data: table, .. } = one.build(store.clone())?;
        let schema = table.schema();
        let (always, columns) = schema.fields().split_at(ALWAYS);
        if self.always.is_empty() {
            self.always = always.to_vec();
        }
        let number_of = |column: &Arc<Field>| {
            let known = self.columns.iter().position(|known| known == column);
            known.unwrap_or_else(|| {
                self.columns.push(column.clone());
                self.columns.len() - 1
            })
        };
        let columns = columns.iter().map(number_of).collect();
        let entity = table.column(0).as_string::<i32>().value(0).to_owned();
        let kind = Kind { entity, columns, holds };
        let known = self.kinds.iter().position(|known| *known == kind);
        let kind = known.unwrap_or_else(|| {
            self.kinds.push(kind);
            self.kinds.len() - 1
        });
        let mut id = [0; 16];
        id.copy_from_slice(table.column(1).as_fixed_size_binary().value(0));
        let is_static = table.column(2).as_boolean().value(0);
        let [rows, start, size, unpacked] = [3, 4, 5, 6].map(|k| table.column(k).as_primitive::<UInt64Type>().value(0));
        self.chunks.push(Listed { kind: kind as u32, is_static, id, rows, start, size, unpacked });
        for column in &table.columns()[ALWAYS..] {
            self.values.push(number(column)?);
        }
        Ok(())
    }

    pub(super) fn len(&self) -> usize {
        self.chunks.len()
    }

    /// Where the list ends now.
    pub(super) fn mark(&self) -> Mark {
        let Self { columns, kinds, chunks, values, .. } = self;
        Mark { columns: columns.len(), kinds: kinds.len(), chunks: chunks.len(), values: values.len() }
    }

    /// Forgets what was added since.
    pub(super) fn cut(&mut self, mark: Mark) {
        self.columns.truncate(mark.columns);
        self.kinds.truncate(mark.kinds);
        self.chunks.truncate(mark.chunks);
        self.values.truncate(mark.values);
    }

    /// The list as the file has it, once there is a chunk.
    pub(super) fn table(&self, store: StoreId) -> Result<RawRrdManifest, CodecError> {
        // By name: any order that is the same every time.
        let mut order: Vec<usize> = (0..self.columns.len()).collect();
        order.sort_by_key(|number| self.columns[*number].name());
        let mut columns = self.always();
        for number in &order {
            let place = |kind: &Kind| kind.columns.iter().position(|column| column == number);
            let places: Vec<Option<usize>> = self.kinds.iter().map(place).collect();
            let mut from = 0;
            let values = self.chunks.iter().map(|chunk| {
                let kind = chunk.kind as usize;
                let value = places[kind].map(|place| self.values[from + place]);
                from += self.kinds[kind].columns.len();
                value
            });
            columns.push(column(self.columns[*number].data_type(), values)?);
        }
        let fields = self.always.iter().chain(order.iter().map(|number| &self.columns[*number]));
        let fields: Vec<Arc<Field>> = fields.cloned().collect();
        let rows = RecordBatchOptions::new().with_row_count(Some(self.chunks.len()));
        let data = RecordBatch::try_new_with_options(Arc::new(Schema::new(fields)), columns, &rows)
            .map_err(CodecError::ArrowSerialization)?;
        let sorbet_schema = Schema::try_merge(self.kinds.iter().map(|kind| kind.holds.clone()))
            .map_err(CodecError::ArrowSerialization)?;
        let sorbet_schema_sha256 =
            RawRrdManifest::compute_sorbet_schema_sha256(&sorbet_schema).map_err(CodecError::ArrowSerialization)?;
        Ok(RawRrdManifest { store_id: store, sorbet_schema, sorbet_schema_sha256, data })
    }

    /// The columns that each chunk has.
    fn always(&self) -> Vec<ArrayRef> {
        let chunks = || self.chunks.iter();
        let counts = |of: fn(&Listed) -> u64| Arc::new(UInt64Array::from_iter_values(chunks().map(of))) as ArrayRef;
        let ids = FixedSizeBinaryArray::try_from_iter(chunks().map(|chunk| chunk.id));
        vec![
            Arc::new(StringArray::from_iter_values(chunks().map(|chunk| &self.kinds[chunk.kind as usize].entity))),
            Arc::new(ids.expect("identifiers are equally long")),
            Arc::new(BooleanArray::from_iter(chunks().map(|chunk| Some(chunk.is_static)))),
            counts(|chunk| chunk.rows),
            counts(|chunk| chunk.start),
            counts(|chunk| chunk.size),
            counts(|chunk| chunk.unpacked),
        ]
    }
}

/// Stands for an empty place in a column of times.
const NONE: i64 = i64::MIN;

/// The only value of a column.
fn number(column: &ArrayRef) -> Result<i64, CodecError> {
    if column.is_null(0) {
        return Ok(NONE);
    }
    match column.data_type() {
        DataType::Boolean => Ok(column.as_boolean().value(0).into()),
        DataType::UInt64 => Ok(column.as_primitive::<UInt64Type>().value(0) as i64),
        DataType::Int64 => Ok(column.as_primitive::<Int64Type>().value(0)),
        DataType::Duration(TimeUnit::Nanosecond) => Ok(column.as_primitive::<DurationNanosecondType>().value(0)),
        other => Err(unknown(other)),
    }
}

/// A column of such values; chunks that have none of it have no data, no rows and no times.
fn column(kind: &DataType, values: impl Iterator<Item = Option<i64>>) -> Result<ArrayRef, CodecError> {
    let counts = |value: Option<i64>| value.filter(|value| *value != NONE).unwrap_or(0);
    let times = |value: Option<i64>| value.filter(|value| *value != NONE);
    Ok(match kind {
        DataType::Boolean => Arc::new(BooleanArray::from_iter(values.map(|value| Some(counts(value) != 0)))),
        DataType::UInt64 => Arc::new(UInt64Array::from_iter_values(values.map(|value| counts(value) as u64))),
        DataType::Int64 => Arc::new(Int64Array::from_iter(values.map(times))),
        DataType::Duration(TimeUnit::Nanosecond) => Arc::new(DurationNanosecondArray::from_iter(values.map(times))),
        other => return Err(unknown(other)),
    })
}

fn unknown(kind: &DataType) -> CodecError {
    CodecError::ArrowSerialization(ArrowError::NotYetImplemented(format!("a list of chunks with {kind}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rerun::components::Position3D;
    use crate::rerun::{Chunk, EntityPath, Points3D, RowId, Scalars, Span, TimePoint, Timeline};
    use re_chunk::ChunkId;
    use re_log_types::StoreKind;
    use re_tuid::Tuid;

    fn chunk(k: u64) -> Chunk {
        let id = ChunkId::from_tuid(Tuid::from_nanos_and_inc(k + 1, 0));
        let path = EntityPath::from_single_string(format!("entity {}", k % 3));
        let step = Timeline::new_sequence("step");
        let when = TimePoint::default().with(Timeline::new_duration("sim_time"), 7 * k as i64).with(step, k as i64);
        let when = if k.is_multiple_of(5) { TimePoint::default() } else { when };
        let builder = Chunk::builder_with_id(id, path);
        let row = RowId::from_tuid(id.as_tuid().next());
        let builder = match k % 3 {
            0 => builder.with_archetype(row, when, &Scalars::single(k as f64)),
            1 => builder.with_archetype(row, TimePoint::default().with(step, k as i64), &Scalars::single(0.0)),
            _ => builder.with_archetype(row, when, &Points3D::new([Position3D::new(1.0, 2.0, 3.0)]).with_labels(["a"])),
        };
        builder.build().unwrap()
    }

    /// Truth: the library's list of all chunks at once.
    #[test]
    fn the_table_has_what_the_librarys_list_has() {
        let store = StoreId::new(StoreKind::Recording, "test", "list");
        let (mut list, mut truth) = (ChunkList::default(), RrdManifestBuilder::default());
        for k in 0..40 {
            let batch = chunk(k).to_chunk_batch().unwrap();
            let span = Span { start: 100 * k, len: 90 + k };
            let mut one = RrdManifestBuilder::default();
            one.append(&batch, span, 200 + k).unwrap();
            list.append(one, &store).unwrap();
            truth.append(&batch, span, 200 + k).unwrap();
            // What is cut leaves nothing.
            let mark = list.mark();
            let mut one = RrdManifestBuilder::default();
            one.append(&chunk(1000 + k).to_chunk_batch().unwrap(), span, 1).unwrap();
            list.append(one, &store).unwrap();
            list.cut(mark);
        }
        let (table, truth) = (list.table(store.clone()).unwrap(), truth.build(store).unwrap());
        assert_eq!((list.len(), table.data.num_columns()), (40, truth.data.num_columns()));
        assert_eq!(table.sorbet_schema_sha256, truth.sorbet_schema_sha256);
        for (field, column) in truth.data.schema().fields().iter().zip(truth.data.columns()) {
            assert_eq!(table.data.schema().field_with_name(field.name()).unwrap(), &**field);
            assert_eq!(table.data.column_by_name(field.name()).unwrap(), column, "{}", field.name());
        }
        table.sanity_check_cheap().unwrap();
    }
}
