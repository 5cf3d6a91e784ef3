//! The list of a recording's chunks, which ends an .rrd file, in little memory.
//!
//! As a table it has a column for each component and timeline, and nearly all of a chunk's places in it are empty: 1.7 kB for
//! a chunk of an arm. [`ChunkList`] keeps what is not empty, and makes the table when it is written.

use std::collections::HashMap;
use std::sync::Arc;

use re_log_encoding::{CodecError, RawRrdManifest};
use re_log_types::{AbsoluteTimeRange, TimeInt};
use re_sdk_types::ComponentDescriptor;
use re_sorbet::{ChunkBatch, SchemaBuilder};

use crate::rerun::arrow::array::{
    Array, ArrayRef, BooleanArray, DurationNanosecondArray, FixedSizeBinaryArray, Int64Array, RecordBatch,
    RecordBatchOptions, StringArray, UInt64Array,
};
use crate::rerun::arrow::datatypes::{DataType, Field, Fields, Schema, TimeUnit};
use crate::rerun::arrow::error::ArrowError;
use crate::rerun::{Chunk, EntityPath, Span, StoreId, Timeline};

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct ChunkList {
    /// Columns besides those that each chunk has, in the order of their appearance.
    columns: Vec<Field>,
    /// Chunks with the same columns of the same entity, in the order of their appearance.
    kinds: Vec<Kind>,
    /// Their numbers, by entity: few each, while studies have thousands of entities.
    of_entity: HashMap<EntityPath, Vec<usize>>,
    chunks: Vec<Listed>,
    /// Values of one chunk after the other, in the order of its kind's columns; [`NONE`] where there is none.
    values: Vec<i64>,
    /// What the recording holds.
    holds: SchemaBuilder,
}

#[derive(Clone, Debug)]
struct Kind {
    entity: EntityPath,
    /// What its chunks have.
    fields: Fields,
    /// Columns of which its chunks have values, by their numbers.
    columns: Vec<usize>,
}

/// A chunk in the list.
#[derive(Clone, Copy, Debug)]
struct Listed {
    kind: u32,
    is_static: bool,
    id: [u8; 16],
    rows: u64,
    place: Span<u64>,
    unpacked: u64,
}

/// A state to which a list can be brought back.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    columns: usize,
    kinds: usize,
    chunks: usize,
    values: usize,
    holds: SchemaBuilder,
}

impl ChunkList {
    /// Adds a chunk, which is also there as a table.
    ///
    /// * `place`: its bytes in the file, without the header of their message; `unpacked`: their number without compression.
    pub(super) fn append(&mut self, chunk: &Chunk, batch: &ChunkBatch, place: Span<u64>, unpacked: u64) {
        let of_entity = self.of_entity.get(chunk.entity_path()).map_or(&[][..], Vec::as_slice);
        let kind = match of_entity.iter().find(|kind| self.kinds[**kind].fields == *batch.fields()) {
            Some(known) => *known,
            None => self.add_kind(chunk, batch),
        };
        self.holds.add_chunk(batch);
        let id = chunk.id().as_tuid().as_bytes();
        let (is_static, rows) = (chunk.is_static(), chunk.num_rows() as u64);
        self.chunks.push(Listed { kind: kind as u32, is_static, id, rows, place, unpacked });
        each_column(chunk, |_, value| self.values.push(value));
    }

    /// Adds what chunks like this one have; returns its number.
    fn add_kind(&mut self, chunk: &Chunk, batch: &ChunkBatch) -> usize {
        let mut columns = Vec::new();
        each_column(chunk, |column, _| {
            let field = column.field();
            let known = self.columns.iter().position(|known| *known == field);
            columns.push(known.unwrap_or_else(|| {
                self.columns.push(field);
                self.columns.len() - 1
            }));
        });
        let (number, entity) = (self.kinds.len(), chunk.entity_path());
        self.kinds.push(Kind { entity: entity.clone(), fields: batch.fields().clone(), columns });
        self.of_entity.entry(entity.clone()).or_default().push(number);
        number
    }

    pub(super) fn len(&self) -> usize {
        self.chunks.len()
    }

    /// The state of now.
    pub(super) fn mark(&self) -> Mark {
        let Self { columns, kinds, chunks, values, holds, .. } = self;
        let [columns, kinds, chunks, values] = [columns.len(), kinds.len(), chunks.len(), values.len()];
        Mark { columns, kinds, chunks, values, holds: holds.clone() }
    }

    /// Forgets what was added since.
    pub(super) fn cut(&mut self, mark: Mark) {
        self.columns.truncate(mark.columns);
        for kind in self.kinds.drain(mark.kinds..).rev() {
            // They came in this order, so each is the last of its entity.
            self.of_entity.get_mut(&kind.entity).and_then(Vec::pop);
        }
        self.chunks.truncate(mark.chunks);
        self.values.truncate(mark.values);
        self.holds = mark.holds;
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
        let mut fields = vec![
            RawRrdManifest::field_chunk_entity_path(),
            RawRrdManifest::field_chunk_id(),
            RawRrdManifest::field_chunk_is_static(),
            RawRrdManifest::field_chunk_num_rows(),
            RawRrdManifest::field_chunk_byte_offset(),
            RawRrdManifest::field_chunk_byte_size(),
            RawRrdManifest::field_chunk_byte_size_uncompressed(),
        ];
        fields.extend(order.iter().map(|number| self.columns[*number].clone()));
        let rows = RecordBatchOptions::new().with_row_count(Some(self.chunks.len()));
        let data = RecordBatch::try_new_with_options(Arc::new(Schema::new(fields)), columns, &rows)
            .map_err(CodecError::ArrowSerialization)?;
        let sorbet_schema = Schema::new(self.holds.clone().build());
        let sorbet_schema_sha256 =
            RawRrdManifest::compute_sorbet_schema_sha256(&sorbet_schema).map_err(CodecError::ArrowSerialization)?;
        Ok(RawRrdManifest { store_id: store, sorbet_schema, sorbet_schema_sha256, data })
    }

    /// The columns that each chunk has.
    fn always(&self) -> Vec<ArrayRef> {
        let chunks = || self.chunks.iter();
        let counts = |of: fn(&Listed) -> u64| Arc::new(UInt64Array::from_iter_values(chunks().map(of))) as ArrayRef;
        let entity = |chunk: &Listed| self.kinds[chunk.kind as usize].entity.to_string();
        let ids = FixedSizeBinaryArray::try_from_iter(chunks().map(|chunk| chunk.id));
        vec![
            Arc::new(StringArray::from_iter_values(chunks().map(entity))),
            Arc::new(ids.expect("identifiers are equally long")),
            Arc::new(BooleanArray::from_iter(chunks().map(|chunk| Some(chunk.is_static)))),
            counts(|chunk| chunk.rows),
            counts(|chunk| chunk.place.start),
            counts(|chunk| chunk.place.len),
            counts(|chunk| chunk.unpacked),
        ]
    }
}

/// Stands for an empty place in a column of times.
const NONE: i64 = i64::MIN;

/// What a column of the list tells of a chunk.
enum Column<'a> {
    /// Whether a component holds always.
    IsStatic(&'a ComponentDescriptor),
    /// First and last time of the chunk, or of one of its components.
    Start(&'a Timeline, Option<&'a ComponentDescriptor>),
    End(&'a Timeline, Option<&'a ComponentDescriptor>),
    /// Rows that have the component.
    Rows(&'a Timeline, &'a ComponentDescriptor),
}

impl Column<'_> {
    fn field(&self) -> Field {
        match self {
            Self::IsStatic(component) => RawRrdManifest::field_has_static_data(component),
            Self::Start(timeline, component) => RawRrdManifest::field_index_start(timeline, *component),
            Self::End(timeline, component) => RawRrdManifest::field_index_end(timeline, *component),
            Self::Rows(timeline, component) => RawRrdManifest::field_index_num_rows(timeline, Some(component)),
        }
    }
}

/// Calls with each column that a chunk has a value in, and the value; always in the same order.
fn each_column<'a>(chunk: &'a Chunk, mut call: impl FnMut(Column<'a>, i64)) {
    let mut components: Vec<_> = chunk.components().values().collect();
    components.sort_by_key(|component| &component.descriptor);
    for component in &components {
        call(Column::IsStatic(&component.descriptor), chunk.is_static().into());
    }
    let mut timelines: Vec<_> = chunk.timelines().values().collect();
    timelines.sort_by_key(|times| times.timeline().name());
    let of_time = |time: TimeInt| if time.is_static() { NONE } else { time.as_i64() };
    for times in timelines {
        let timeline = times.timeline();
        let mut put = |range: AbsoluteTimeRange, component| {
            let range = Some(range).filter(|range| *range != AbsoluteTimeRange::EMPTY);
            call(Column::Start(timeline, component), range.map_or(NONE, |range| of_time(range.min())));
            call(Column::End(timeline, component), range.map_or(NONE, |range| of_time(range.max())));
        };
        put(times.time_range(), None);
        let ranges = times.time_range_per_component(chunk.components());
        for component in &components {
            let descriptor = &component.descriptor;
            put(ranges.get(&descriptor.component).copied().unwrap_or(AbsoluteTimeRange::EMPTY), Some(descriptor));
        }
        for component in &components {
            let list = &component.list_array;
            call(Column::Rows(timeline, &component.descriptor), (list.len() - list.null_count()) as i64);
        }
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
    use crate::rerun::{Points3D, RowId, Scalars, TimePoint};
    use re_chunk::ChunkId;
    use re_log_encoding::RrdManifestBuilder;
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
            _ => {
                // Labels that are there, and a list without any.
                let labels = if k.is_multiple_of(2) { vec!["a"] } else { vec![] };
                builder.with_archetype(row, when, &Points3D::new([Position3D::new(1.0, 2.0, 3.0)]).with_labels(labels))
            }
        };
        builder.build().unwrap()
    }

    /// Truth: the library's list of all chunks at once.
    #[test]
    fn the_table_has_what_the_librarys_list_has() {
        let store = StoreId::new(StoreKind::Recording, "test", "list");
        let (mut list, mut truth) = (ChunkList::default(), RrdManifestBuilder::default());
        for k in 0..40 {
            let this = chunk(k);
            let batch = this.to_chunk_batch().unwrap();
            let span = Span { start: 100 * k, len: 90 + k };
            list.append(&this, &batch, span, 200 + k);
            truth.append(&batch, span, 200 + k).unwrap();
            // What is cut leaves nothing.
            let mark = list.mark();
            let other = chunk(1000 + k);
            list.append(&other, &other.to_chunk_batch().unwrap(), span, 1);
            list.cut(mark);
        }
        let (table, truth) = (list.table(store.clone()).unwrap(), truth.build(store).unwrap());
        assert_eq!((list.len(), table.data.num_columns()), (40, truth.data.num_columns()));
        // Three entities, each always or over time, one of them with and without labels.
        assert!(list.kinds.len() <= 7, "{} kinds", list.kinds.len());
        assert_eq!(table.sorbet_schema_sha256, truth.sorbet_schema_sha256);
        for (field, column) in truth.data.schema().fields().iter().zip(truth.data.columns()) {
            assert_eq!(table.data.schema().field_with_name(field.name()).unwrap(), &**field);
            assert_eq!(table.data.column_by_name(field.name()).unwrap(), column, "{}", field.name());
        }
        table.sanity_check_cheap().unwrap();
    }
}
