//! TCP deflections of many runs, given as lists of runs or as arrays of parameters.
//!
//! A parameter has one value for all runs or one for each; all lengths must agree. Results are in m
//! and s, world axes. Not here: the runs (`flexarm::runs`).

use flexarm::runs::{ToolDeflection, Variation};
use flexarm::{PayloadChange, Scenario};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{Numbers, numbers, view};
use crate::failure::{OrRaise, exception};
use crate::parts::{Parts, Pickled};
use crate::robot::PyRobot;
use crate::scenario::inertia_matrix;

/// Parameters of many runs as given: one value for all, or one per run.
pub(crate) struct Parameters<'a, 'py> {
    pub(crate) stiffness: Option<&'a Bound<'py, PyAny>>,
    pub(crate) damping: Option<&'a Bound<'py, PyAny>>,
    pub(crate) time_scale: Option<&'a Bound<'py, PyAny>>,
    pub(crate) mass: Option<&'a Bound<'py, PyAny>>,
    pub(crate) com: Option<&'a Bound<'py, PyAny>>,
    pub(crate) inertia: Option<&'a Bound<'py, PyAny>>,
}

/// One parameter of m runs.
struct Parameter<'py> {
    name: &'static str,
    values: Option<Numbers<'py>>,
}

impl<'py> Parameter<'py> {
    fn new(name: &'static str, value: Option<&Bound<'py, PyAny>>, row: &[(usize, &str)]) -> PyResult<Self> {
        let Some(value) = value.filter(|value| !value.is_none()) else { return Ok(Self { name, values: None }) };
        // A single number, to which numpy's contiguous arrays add an axis.
        let axes: usize = value.getattr("ndim").and_then(|n| n.extract()).unwrap_or(0);
        let is_one = row.is_empty() && axes == 0 && value.extract::<f64>().is_ok();
        let mut found = numbers(name, value, row, true)?;
        if is_one {
            found.rows = None;
        }
        Ok(Self { name, values: Some(found) })
    }

    /// Number of runs, if there is one value per run.
    fn rows(&self) -> Option<(&'static str, usize)> {
        Some((self.name, self.values.as_ref()?.rows?))
    }

    /// Returns the numbers of a run.
    fn row(&self, k: usize) -> Option<&[f64]> {
        let found = self.values.as_ref()?;
        let width = found.values().len() / found.len().max(1);
        let k = if found.rows.is_some() { k } else { 0 };
        Some(&found.values()[k * width..][..width])
    }

    /// Returns the factor of a run.
    fn factor(&self, k: usize) -> f64 {
        self.row(k).and_then(|row| row.first().copied()).unwrap_or(1.0)
    }
}

/// Returns the requested runs: scenarios, or one for all, with their parameters.
pub(crate) fn variations(
    robot: &Bound<'_, PyRobot>,
    scenarios: Scenarios,
    given: &Parameters<'_, '_>,
) -> PyResult<Vec<Variation>> {
    let plain = |name, value| Parameter::new(name, value, &[]);
    let stiffness = plain("stiffness", given.stiffness)?;
    let damping = plain("damping", given.damping)?;
    let time_scale = plain("time_scale", given.time_scale)?;
    let mass = plain("payload_mass", given.mass)?;
    let com = Parameter::new("payload_com", given.com, &[(3, "numbers (m)")])?;
    let inertia = Parameter::new("payload_inertia", given.inertia, &[(3, "rows"), (3, "columns (kg m²)")])?;
    // A payload is given as a whole; an inertia may be left out.
    if mass.values.is_some() != com.values.is_some() || (inertia.values.is_some() && mass.values.is_none()) {
        return Err(PyValueError::new_err(
            "a payload needs payload_mass (kg) and payload_com (m, axes of the link that carries it)",
        ));
    }
    // All that have a value for each run have equally many.
    let all = [&stiffness, &damping, &time_scale, &mass, &com, &inertia];
    let mut counts: Vec<(&str, usize)> = all.iter().filter_map(|parameter| parameter.rows()).collect();
    if let Scenarios::Each(each) = &scenarios {
        counts.insert(0, ("runs", each.len()));
    }
    let m = counts.first().map_or(1, |(_, m)| *m);
    if let Some((name, found)) = counts.iter().find(|(_, found)| *found != m) {
        let first = counts[0].0;
        return Err(PyValueError::new_err(format!(
            "{name} has {found} values, {first} has {m}: expected one, or one for each run"
        )));
    }
    // One scenario for each run: slowed down, with its payload.
    let own = &robot.get().robot;
    let model = own.rigid_model().or_raise()?;
    let mut runs = Vec::with_capacity(m);
    for k in 0..m {
        if k % 64 == 0 {
            robot.py().check_signals()?;
        }
        let mut scenario = match &scenarios {
            Scenarios::Each(each) => each[k].clone(),
            Scenarios::One(one) => (**one).clone(),
        };
        if time_scale.values.is_some() {
            scenario.motion = scenario.motion.scaled(time_scale.factor(k), &model).or_raise()?;
        }
        if let (Some(mass), Some(com)) = (mass.row(k), com.row(k)) {
            let mut payload = PayloadChange::attach(0.0, mass[0], [com[0], com[1], com[2]].into());
            if let Some(inertia) = inertia.row(k) {
                payload = payload.with_inertia(inertia_matrix("payload_inertia", inertia)?.into());
            }
            scenario = scenario.with_payload(payload);
        }
        runs.push(Variation { scenario, stiffness: stiffness.factor(k), damping: damping.factor(k) });
    }
    Ok(runs)
}

/// Scenarios of many runs.
pub(crate) enum Scenarios {
    /// The same for all runs.
    One(Box<Scenario>),
    /// One per run.
    Each(Vec<Scenario>),
}

/// TCP deflections of m runs. Created by :meth:`Arm.deflections`.
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
    /// Maximum distance of the TCP from the rigid one (m), (m,).
    #[getter]
    fn peak<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.peak.len()], &own.peak)))
    }

    /// Time of the maximum (s), (m,).
    #[getter]
    fn time_of_peak<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.peak.len()], &own.time_of_peak)))
    }

    /// Root mean square distance (m), (m,).
    #[getter]
    fn rms<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.peak.len()], &own.rms)))
    }

    /// Flexible minus rigid TCP at the end, world axes (m), (m, 3).
    #[getter]
    fn end<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.peak.len(), 3], &own.end)))
    }

    /// Deflection at the start and at every step of run ``k``, (steps + 1, 3); with
    /// ``samples=True``.
    fn samples<'py>(slf: &Bound<'py, Self>, k: usize) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| {
            let all = &own.samples;
            let missing = || PyIndexError::new_err(format!("there is no run {k} of {}", all.len()));
            let values = all.get(k).ok_or_else(missing)?;
            Ok((vec![values.len() / 3, 3], values))
        })
    }

    /// Time step of the samples (s).
    #[getter]
    fn step(&self) -> f64 {
        self.step
    }

    /// Runs that failed, and the reasons (list of (int, str)).
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

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyDeflections {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        for (name, values) in
            [("peak", &self.peak), ("time_of_peak", &self.time_of_peak), ("rms", &self.rms), ("end", &self.end)]
        {
            parts.put_numbers(name, values)?;
        }
        parts.put_numbers("samples", &self.samples.concat())?;
        parts.put("lengths", self.samples.iter().map(Vec::len).collect::<Vec<_>>())?;
        parts.put("failures", self.failures.clone())?;
        parts.put("step", self.step)
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let (peak, lengths): (Vec<f64>, Vec<usize>) = (parts.numbers("peak")?, parts.get("lengths")?);
        let m = peak.len();
        let all = parts.shaped("samples", &[lengths.iter().sum()])?;
        let mut rest = all.as_slice();
        let mut next = |length: usize| {
            let (own, after) = rest.split_at(length);
            rest = after;
            own.to_vec()
        };
        Ok(Self {
            time_of_peak: parts.shaped("time_of_peak", &[m])?,
            rms: parts.shaped("rms", &[m])?,
            end: parts.shaped("end", &[m, 3])?,
            samples: lengths.into_iter().map(&mut next).collect(),
            failures: parts.get("failures")?,
            step: parts.get("step")?,
            peak,
        })
    }
}
