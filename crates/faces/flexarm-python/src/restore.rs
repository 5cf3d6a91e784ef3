//! Restoring of pickled results: the class of each name.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

use crate::answers::{PyModes, PyResponse, PyStatics};
use crate::compensate::PyCompensated;
use crate::deflections::PyDeflections;
use crate::linear::PyLinear;
use crate::map::PyMap;
use crate::parts::{Parts, Pickled};
use crate::run::{PyRun, PySample};

/// Restores a result; for `flexarm._pickle`.
#[pyfunction]
#[pyo3(name = "_restore")]
pub(crate) fn restore<'py>(kind: &Bound<'py, PyType>, parts: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    let (py, parts) = (kind.py(), Parts::of(parts));
    let name = kind.name()?;
    Ok(match name.to_str()? {
        "Run" => Bound::new(py, PyRun::of_parts(&parts)?)?.into_any(),
        "Sample" => Bound::new(py, PySample::of_parts(&parts)?)?.into_any(),
        "Statics" => Bound::new(py, PyStatics::of_parts(&parts)?)?.into_any(),
        "Modes" => Bound::new(py, PyModes::of_parts(&parts)?)?.into_any(),
        "Response" => Bound::new(py, PyResponse::of_parts(&parts)?)?.into_any(),
        "Linear" => Bound::new(py, PyLinear::of_parts(&parts)?)?.into_any(),
        "Deflections" => Bound::new(py, PyDeflections::of_parts(&parts)?)?.into_any(),
        "Map" => Bound::new(py, PyMap::of_parts(&parts)?)?.into_any(),
        "Compensated" => Bound::new(py, PyCompensated::of_parts(&parts)?)?.into_any(),
        other => return Err(PyTypeError::new_err(format!("{other} is not pickled by its parts"))),
    })
}
