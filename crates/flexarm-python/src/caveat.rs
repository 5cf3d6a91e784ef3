//! Caveats: what is probably wrong with an input, or limits the worth of a result, as warnings of their own class.

use flexarm::Caveat;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Caveats as instances of `flexarm.Caveat`, which can be warned with as they are.
pub(crate) fn list<'py>(py: Python<'py>, caveats: &[Caveat]) -> PyResult<Bound<'py, PyList>> {
    let class = py.import("flexarm.errors")?.getattr("Caveat")?;
    let instance = |caveat: &Caveat| -> PyResult<Bound<'py, PyAny>> {
        let fields = PyDict::new(py);
        fields.set_item("severity", caveat.severity.word())?;
        fields.set_item("code", &caveat.code)?;
        fields.set_item("where", &caveat.location)?;
        fields.set_item("value", caveat.value)?;
        fields.set_item("yardstick", caveat.yardstick)?;
        fields.set_item("unit", &caveat.unit)?;
        fields.set_item("likely", &caveat.likely)?;
        fields.set_item("help", &caveat.help)?;
        class.call((&caveat.message,), Some(&fields))
    };
    PyList::new(py, caveats.iter().map(instance).collect::<PyResult<Vec<_>>>()?)
}

/// Warns of those that warn, as if the caller's line did.
pub(crate) fn warn(py: Python<'_>, caveats: &[Caveat]) -> PyResult<()> {
    if !caveats.iter().any(Caveat::warns) {
        return Ok(());
    }
    let warn = py.import("warnings")?.getattr("warn")?;
    let level = PyDict::new(py);
    level.set_item("stacklevel", 1)?;
    let told: Vec<Caveat> = caveats.iter().filter(|caveat| caveat.warns()).cloned().collect();
    for caveat in list(py, &told)? {
        warn.call((caveat,), Some(&level))?;
    }
    Ok(())
}
