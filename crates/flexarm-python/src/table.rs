//! The table of a run as columns one number wide, with the names that its CSV has.

use flexarm::Run;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// Names and numbers.
pub(crate) fn flat(run: &Run) -> Vec<(String, Vec<f64>)> {
    flexarm::flat_columns(&run.columns)
}

/// The stream of Arrow's C interface in its capsule.
pub(crate) fn stream<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyAny>> {
    let stream = flexarm::arrow_stream(&run.columns).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(PyCapsule::new_with_value(py, stream, c"arrow_array_stream")?.into_any())
}
