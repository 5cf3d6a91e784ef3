//! numpy arrays: inputs are checked, with named errors; outputs are C-contiguous and not copied.
//!
//! A batch has a leading axis. Start at [`numbers`] for inputs and at [`array`] for outputs.
#![allow(unsafe_code, reason = "an array of numpy that borrows from its owner has no lifetime; see `view`")]

use numpy::ndarray::{Array, ArrayView, Dim, Dimension, IntoDimension, ShapeError};
use numpy::{
    Element, IntoPyArray, PyArray, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::PyClass;
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;

/// Input numbers, C-contiguous and finite: one row, or m rows.
pub(crate) struct Numbers<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    /// Number of rows, if there is an axis for them.
    pub(crate) rows: Option<usize>,
}

impl Numbers<'_> {
    /// Returns all numbers, row after row.
    pub(crate) fn values(&self) -> &[f64] {
        self.array.as_slice().unwrap_or(&[])
    }

    /// Number of rows; 1 if there is no axis for them.
    pub(crate) fn len(&self) -> usize {
        self.rows.unwrap_or(1)
    }
}

/// Describes the expected shape for messages.
fn expected(row: &[(usize, &str)], batch: bool) -> String {
    if row.is_empty() {
        return "expected one number, or (m,) with one for each of m runs".into();
    }
    let inner = row.iter().map(|(n, what)| format!("{n} {what}")).collect::<Vec<_>>().join(" x ");
    let shape = row.iter().map(|(n, _)| n.to_string()).collect::<Vec<_>>().join(", ");
    let one = if row.len() == 1 { format!("({shape},)") } else { format!("({shape})") };
    match batch {
        true => format!("expected {one} or (m, {shape}) for m of them: {inner}"),
        false => format!("expected {one}: {inner}"),
    }
}

fn shape_of(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Returns a `float64` array as it is, or converts lists, integers and other memory orders.
fn floats<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
        && array.is_aligned()
    {
        return Ok(array.clone());
    }
    let py = value.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    let wrong = |found: String| {
        PyValueError::new_err(format!(
            "{name} is {found}: expected real numbers that fit float64 (an array or nested lists)"
        ))
    };
    let any = numpy.call_method1(intern!(py, "asarray"), (value,));
    let any = any.map_err(|error| wrong(format!("no array ({})", error.value(py))))?;
    let array = any.cast::<PyUntypedArray>()?;
    let dtype = array.dtype();
    let kind = char::from(dtype.kind());
    if !matches!(kind, 'f' | 'i' | 'u') || (kind == 'f' && dtype.itemsize() > 8) {
        return Err(wrong(format!("of dtype {}", dtype.str()?)));
    }
    let float = f64::get_dtype(py);
    let array = numpy.call_method1(intern!(py, "ascontiguousarray"), (array, float))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

/// Reads the numbers of an array of any shape, including NaN and infinities.
pub(crate) fn any_numbers(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = floats(name, value)?;
    let array = array.try_readonly().map_err(|error| PyValueError::new_err(format!("{name}: {error}")))?;
    Ok(array.as_slice().unwrap_or(&[]).to_vec())
}

/// Reads the numbers of an argument: a row of the shape `row`, or with `batch` also m rows.
///
/// # Errors
/// `ValueError` with the argument, the found and the expected shape.
pub(crate) fn numbers<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    row: &[(usize, &str)],
    batch: bool,
) -> PyResult<Numbers<'py>> {
    let array = floats(name, value)?;
    let shape = array.shape();
    let fits = |shape: &[usize]| shape.len() == row.len() && shape.iter().zip(row).all(|(n, (want, _))| n == want);
    // numpy's dimension 0 would also accept shapes of a single number.
    let rows = match shape.split_first() {
        _ if fits(shape) => None,
        Some((m, rest)) if batch && fits(rest) => Some(*m),
        _ => {
            let (found, expected) = (shape_of(shape), expected(row, batch));
            return Err(PyValueError::new_err(format!("{name} has the shape {found}, {expected}")));
        }
    };
    let array = array.try_readonly().map_err(|error| PyValueError::new_err(format!("{name}: {error}")))?;
    let numbers = Numbers { array, rows };
    finite(name, numbers.values(), numbers.array.shape())?;
    Ok(numbers)
}

/// Reads an argument with any number of rows of `width` numbers; `width` 0 for plain numbers.
pub(crate) fn table<'py>(name: &str, value: &Bound<'py, PyAny>, width: usize, what: &str) -> PyResult<Numbers<'py>> {
    let array = floats(name, value)?;
    let rows = match *array.shape() {
        [m] if width == 0 => m,
        [m, n] if width > 0 && n == width => m,
        ref other => {
            let expected = if width == 0 { "(m,)".into() } else { format!("(m, {width}): {width} {what} in each row") };
            let message = format!("{name} has the shape {}, expected {expected}", shape_of(other));
            return Err(PyValueError::new_err(message));
        }
    };
    let array = array.try_readonly().map_err(|error| PyValueError::new_err(format!("{name}: {error}")))?;
    let numbers = Numbers { array, rows: Some(rows) };
    finite(name, numbers.values(), numbers.array.shape())?;
    Ok(numbers)
}

fn finite(name: &str, values: &[f64], shape: &[usize]) -> PyResult<()> {
    let Some(first) = values.iter().position(|x| !x.is_finite()) else { return Ok(()) };
    let mut place = Vec::with_capacity(shape.len());
    let mut rest = first;
    for n in shape.iter().rev() {
        place.push(rest % n);
        rest /= n;
    }
    place.reverse();
    let place = place.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let found = values[first];
    Err(PyValueError::new_err(format!("{name}[{place}] is {found}: expected finite numbers")))
}

/// Creates an array that takes ownership of these numbers.
pub(crate) fn array<'py, const N: usize>(
    py: Python<'py>,
    shape: [usize; N],
    values: Vec<f64>,
) -> PyResult<Bound<'py, PyAny>>
where
    [usize; N]: IntoDimension<Dim = Dim<[usize; N]>>,
    Dim<[usize; N]>: Dimension,
{
    let wrong = |error: ShapeError| PyValueError::new_err(format!("a result has no shape {shape:?}: {error}"));
    let array = Array::from_shape_vec(shape.into_dimension(), values).map_err(wrong)?;
    Ok(array.into_pyarray(py).into_any())
}

/// Creates the result array for one row, or for m rows: shape `row`, or (m, row).
pub(crate) fn answer<'py>(
    py: Python<'py>,
    rows: Option<usize>,
    row: &[usize],
    values: Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    match (rows, row) {
        (None, &[a]) => array(py, [a], values),
        (None, &[a, b]) => array(py, [a, b], values),
        (Some(m), &[a]) => array(py, [m, a], values),
        (Some(m), &[a, b]) => array(py, [m, a, b], values),
        _ => array(py, [values.len()], values),
    }
}

/// Returns a read-only array that views numbers of `owner`, with their shape. Nothing is copied;
/// the array keeps its owner alive.
///
/// # Errors
/// Those of `numbers`; `ValueError` if the shape does not fit the numbers.
pub(crate) fn view<'py, T>(
    owner: &Bound<'py, T>,
    numbers: impl for<'a> FnOnce(&'a T) -> PyResult<(Vec<usize>, &'a [f64])>,
) -> PyResult<Bound<'py, PyAny>>
where
    T: PyClass<Frozen = True> + Sync,
{
    let (shape, values) = numbers(owner.get())?;
    let wrong = |error: ShapeError| PyValueError::new_err(format!("a result has no shape {shape:?}: {error}"));
    let view = ArrayView::from_shape(shape.as_slice(), values).map_err(wrong)?;
    // SAFETY: the numbers are borrowed from the owner for any lifetime, so they stay valid and
    // unchanged as long as it lives: a frozen class gives out no `&mut`. The array holds a reference
    // to the owner.
    let array = unsafe { PyArray::borrow_from_array(&view, owner.clone().into_any()) };
    array.readwrite().make_nonwriteable();
    Ok(array.into_any())
}
