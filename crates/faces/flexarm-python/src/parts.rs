//! Results as named parts that can be pickled: numbers as arrays, the rest as plain values.
//!
//! Arrays are flat; [`Parts::shaped`] checks their size. Not here: which results can be restored
//! (`restore.rs`).

use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;
use pyo3::types::PyDict;

use crate::arrays::{any_numbers, array};

/// The parts of a result.
pub(crate) struct Parts<'py>(Bound<'py, PyDict>);

/// A class whose instances are pickled as parts.
pub(crate) trait Pickled: pyo3::PyClass<Frozen = True> + Sync {
    /// Stores the parts.
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()>;
    /// Creates an instance from the parts.
    fn of_parts(parts: &Parts<'_>) -> PyResult<Self>;

    /// Return value of `__reduce__`.
    fn reduced<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let parts = Parts(PyDict::new(py));
        slf.get().parts(&parts)?;
        let class = slf.as_any().get_type();
        let again = py.import("flexarm._pickle")?.getattr("result")?;
        Ok((again, (class, parts.0)).into_pyobject(py)?.into_any())
    }
}

impl<'py> Parts<'py> {
    /// Returns the parts in a dictionary.
    pub(crate) fn of(parts: &Bound<'py, PyDict>) -> Self {
        Self(parts.clone())
    }

    /// Stores a value.
    pub(crate) fn put(&self, name: &str, value: impl IntoPyObject<'py>) -> PyResult<()> {
        self.0.set_item(name, value)
    }

    /// Stores numbers.
    pub(crate) fn put_numbers(&self, name: &str, values: &[f64]) -> PyResult<()> {
        self.0.set_item(name, array(self.0.py(), [values.len()], values.to_vec())?)
    }

    fn item(&self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let missing = || PyValueError::new_err(format!("the pickle has no {name:?}: another version made it"));
        self.0.get_item(name)?.ok_or_else(missing)
    }

    /// Returns a value.
    pub(crate) fn get<T: FromPyObjectOwned<'py>>(&self, name: &str) -> PyResult<T> {
        self.item(name)?.extract().map_err(Into::into)
    }

    /// Returns numbers.
    pub(crate) fn numbers(&self, name: &str) -> PyResult<Vec<f64>> {
        any_numbers(name, &self.item(name)?)
    }

    /// Returns numbers, checking their count against a shape.
    pub(crate) fn shaped(&self, name: &str, shape: &[usize]) -> PyResult<Vec<f64>> {
        let (values, wanted) = (self.numbers(name)?, shape.iter().product::<usize>());
        match values.len() == wanted {
            true => Ok(values),
            false => {
                Err(PyValueError::new_err(format!("the pickle has {} numbers as {name:?}, not {wanted}", values.len())))
            }
        }
    }
}
