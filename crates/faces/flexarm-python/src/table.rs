//! The table of a run as an Arrow stream.

use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, RecordBatchIterator};
use flexarm::recordings::{Columns, flat_columns};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// Returns Arrow's C stream of a single record batch in its capsule.
pub(crate) fn stream<'py>(py: Python<'py>, columns: &Columns) -> PyResult<Bound<'py, PyAny>> {
    let named = flat_columns(columns)
        .into_iter()
        .map(|(name, numbers)| (name, Arc::new(Float64Array::from(numbers)) as ArrayRef, false));
    let batch =
        RecordBatch::try_from_iter_with_nullable(named).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let schema = batch.schema();
    let stream = FFI_ArrowArrayStream::new(Box::new(RecordBatchIterator::new([Ok(batch)], schema)));
    Ok(PyCapsule::new_with_value(py, stream, c"arrow_array_stream")?.into_any())
}
