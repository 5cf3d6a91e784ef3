//! How far the tool is off in many runs.

use flexarm::{Scenario, ToolDeflection, Variation};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{array, table, view};
use crate::failure::exception;

/// A factor for each of m runs.
fn factors(name: &str, value: Option<&Bound<'_, PyAny>>, m: usize) -> PyResult<Vec<f64>> {
    let Some(value) = value else { return Ok(vec![1.0; m]) };
    if let Ok(one) = value.extract::<f64>() {
        return Ok(vec![one; m]);
    }
    let many = table(name, value, 0, "factors")?;
    match many.len() == m {
        true => Ok(many.values().to_vec()),
        false => {
            let found = many.len();
            Err(PyValueError::new_err(format!("{name} has {found} factors for {m} runs: expected one, or {m}")))
        }
    }
}

/// Scenarios with their factors.
pub(crate) fn variations(
    scenarios: Vec<Scenario>,
    stiffness: Option<&Bound<'_, PyAny>>,
    damping: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<Variation>> {
    let m = scenarios.len();
    let (stiffness, damping) = (factors("stiffness", stiffness, m)?, factors("damping", damping, m)?);
    let each = scenarios.into_iter().zip(stiffness).zip(damping);
    Ok(each.map(|((scenario, stiffness), damping)| Variation { scenario, stiffness, damping }).collect())
}

/// How far the tool was off in each of m runs. Made by :meth:`Arm.deflections`.
#[pyclass(frozen, name = "Deflections", module = "flexarm")]
pub(crate) struct PyDeflections {
    peak: Vec<f64>,
    time_of_peak: Vec<f64>,
    rms: Vec<f64>,
    end: Vec<f64>,
    samples: Vec<Vec<f64>>,
    failures: Vec<(usize, String)>,
    step: f64,
}

impl PyDeflections {
    pub(crate) fn of(found: Vec<Result<ToolDeflection, flexarm::Error>>, raises: bool, step: f64) -> PyResult<Self> {
        let (peak, time_of_peak, rms, end, samples, failures) = Default::default();
        let mut own = Self { peak, time_of_peak, rms, end, samples, failures, step };
        for (k, result) in found.into_iter().enumerate() {
            let one = match result {
                Ok(one) => one,
                Err(error) if raises => return Err(exception(error)),
                Err(error) => {
                    own.failures.push((k, error.to_string()));
                    let nan = f64::NAN;
                    ToolDeflection {
                        peak_m: nan,
                        t_peak_s: nan,
                        rms_m: nan,
                        end_m: [nan; 3],
                        steps: 0,
                        samples_m: Vec::new(),
                    }
                }
            };
            own.peak.push(one.peak_m);
            own.time_of_peak.push(one.t_peak_s);
            own.rms.push(one.rms_m);
            own.end.extend(one.end_m);
            own.samples.push(one.samples_m.into_iter().flatten().collect());
        }
        Ok(own)
    }
}

#[pymethods]
impl PyDeflections {
    /// Largest distance of the tool from the rigid one (m), (m,).
    #[getter]
    fn peak<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf.clone().into_any(), [slf.get().peak.len()], &slf.get().peak)
    }

    /// When (s), (m,).
    #[getter]
    fn time_of_peak<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf.clone().into_any(), [slf.get().peak.len()], &slf.get().time_of_peak)
    }

    /// Root of the mean square distance (m), (m,).
    #[getter]
    fn rms<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf.clone().into_any(), [slf.get().peak.len()], &slf.get().rms)
    }

    /// Flexible minus rigid at the end, world axes (m), (m, 3).
    #[getter]
    fn end<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf.clone().into_any(), [slf.get().peak.len(), 3], &slf.get().end)
    }

    /// The same at the start and after every step, of run ``k``, (steps + 1, 3); with ``samples=True``.
    fn samples<'py>(&self, py: Python<'py>, k: usize) -> PyResult<Bound<'py, PyAny>> {
        let values = self.samples.get(k).cloned().ok_or_else(|| {
            pyo3::exceptions::PyIndexError::new_err(format!("there is no run {k} of {}", self.samples.len()))
        })?;
        array(py, [values.len() / 3, 3], values)
    }

    /// Time step of the samples (s).
    #[getter]
    fn step(&self) -> f64 {
        self.step
    }

    /// Runs that failed, and why (list of (int, str)).
    #[getter]
    fn failures(&self) -> Vec<(usize, String)> {
        self.failures.clone()
    }

    fn __len__(&self) -> usize {
        self.peak.len()
    }

    fn __repr__(&self) -> String {
        let largest = self.peak.iter().copied().fold(0.0, f64::max);
        format!("<Deflections of {} runs, at most {:.4} mm>", self.peak.len(), 1e3 * largest)
    }
}
