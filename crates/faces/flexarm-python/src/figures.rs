//! Figures of a result with the keys of `--json`, and its caveats; computed, or from a pickle.
//!
//! Start at [`Figures::of`]. Not here: arrays (`parts.rs`).

use std::sync::Arc;

use flexarm::Finding;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::caveat;
use crate::parts::Parts;

/// A result that is serialised to JSON on demand.
trait Json: Send + Sync {
    fn json(&self) -> serde_json::Result<String>;
}

impl<T: serde::Serialize + Send + Sync> Json for T {
    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}

enum Source {
    Found(Arc<dyn Json>),
    Told(String),
}

/// Figures and caveats of a result.
pub(crate) struct Figures {
    source: Source,
    caveats: Vec<Finding>,
}

impl Figures {
    /// Wraps the figures of a computed result.
    pub(crate) fn of(found: impl serde::Serialize + Send + Sync + 'static, caveats: &[Finding]) -> Self {
        Self { source: Source::Found(Arc::new(found)), caveats: caveats.to_vec() }
    }

    fn json(&self) -> PyResult<String> {
        match &self.source {
            Source::Found(found) => found.json().map_err(|error| PyValueError::new_err(error.to_string())),
            Source::Told(text) => Ok(text.clone()),
        }
    }

    /// Converts to dicts, lists and numbers, in the order and with the keys of `--json`.
    pub(crate) fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.json()?,))
    }

    /// Returns the caveats as instances of `flexarm.Caveat`.
    pub(crate) fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        caveat::list(py, &self.caveats)
    }

    /// Stores figures and caveats in a pickle.
    pub(crate) fn put_into(&self, parts: &Parts<'_>) -> PyResult<()> {
        let caveats = serde_json::to_string(&self.caveats).map_err(|error| PyValueError::new_err(error.to_string()))?;
        parts.put("figures", self.json()?)?;
        parts.put("caveats", caveats)
    }

    /// Restores figures and caveats from a pickle.
    pub(crate) fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let caveats: String = parts.get("caveats")?;
        let caveats = serde_json::from_str(&caveats).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Self { source: Source::Told(parts.get("figures")?), caveats })
    }
}
