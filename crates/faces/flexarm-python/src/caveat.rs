//! Caveats (probable mistakes in inputs, limits of results) as warnings of their own class.
//!
//! Start at [`answer`]: a result as a dict, with its caveats issued. Not here: the catalogue
//! (`flexarm-run`).

use flexarm::Finding;
use flexarm::settings::{gathered, written};
use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::values::plain;

/// Converts caveats to instances of `flexarm.Caveat`, which can be passed to `warnings.warn`.
pub(crate) fn list<'py>(py: Python<'py>, caveats: &[Finding]) -> PyResult<Bound<'py, PyList>> {
    let class = py.import("flexarm.errors")?.getattr("Caveat")?;
    let instance = |caveat: &Finding| -> PyResult<Bound<'py, PyAny>> {
        let fields = PyDict::new(py);
        fields.set_item("severity", caveat.severity.word())?;
        fields.set_item("code", &caveat.code)?;
        fields.set_item("where", &caveat.location)?;
        fields.set_item("value", caveat.value)?;
        fields.set_item("yardstick", caveat.yardstick)?;
        fields.set_item("unit", &caveat.unit)?;
        fields.set_item("likely", &caveat.likely)?;
        fields.set_item("help", &caveat.help)?;
        class.call((written::message(&caveat.message),), Some(&fields))
    };
    PyList::new(py, caveats.iter().map(instance).collect::<PyResult<Vec<_>>>()?)
}

/// Issues caveats of severity warning as Python warnings at the caller's line; logs the others.
pub(crate) fn issue(py: Python<'_>, caveats: &[Finding]) -> PyResult<()> {
    let (warnings, notes): (Vec<Finding>, Vec<Finding>) = caveats.iter().cloned().partition(Finding::warns);
    if !notes.is_empty() {
        say(py, "notes", (list(py, &notes)?,))?;
    }
    if warnings.is_empty() {
        return Ok(());
    }
    let warn = py.import("warnings")?.getattr("warn")?;
    let level = PyDict::new(py);
    level.set_item("stacklevel", 1)?;
    // Caveats of one kind become one warning, with the fields of the first.
    let texts: Vec<String> = warnings.iter().map(|caveat| caveat.message.clone()).collect();
    let finding = |text: String| {
        let first = warnings.iter().find(|caveat| text.starts_with(&caveat.message));
        Finding { message: text, ..first.cloned().unwrap_or_default() }
    };
    let warnings: Vec<Finding> = gathered(&texts).into_iter().map(finding).collect();
    for caveat in list(py, &warnings)? {
        warn.call((caveat,), Some(&level))?;
    }
    Ok(())
}

/// Merges sentences of one kind and escapes control characters, for logging.
pub(crate) fn sentences(texts: &[String]) -> Vec<String> {
    gathered(texts).iter().map(|text| written::message(text)).collect()
}

/// Logs something by calling a function of `flexarm._say`.
pub(crate) fn say<'py>(py: Python<'py>, what: &str, arguments: impl PyCallArgs<'py>) -> PyResult<()> {
    py.import("flexarm._say")?.call_method1(what, arguments).map(drop)
}

/// Converts a result to a dict, issues its caveats, and logs the files that it names.
pub(crate) fn answer<'py>(
    py: Python<'py>,
    found: &impl serde::Serialize,
    caveats: &[Finding],
) -> PyResult<Bound<'py, PyAny>> {
    let figures = plain(py, found)?;
    say(py, "wrote", (&figures,))?;
    issue(py, caveats)?;
    Ok(figures)
}
