//! The table of a run as an Arrow stream.

use flexarm::recordings::Columns;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// Returns Arrow's C stream in its capsule.
pub(crate) fn stream<'py>(py: Python<'py>, columns: &Columns) -> PyResult<Bound<'py, PyAny>> {
    let stream =
        flexarm::recordings::arrow_stream(columns).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(PyCapsule::new_with_value(py, stream, c"arrow_array_stream")?.into_any())
}
