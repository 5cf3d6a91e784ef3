//! Arguments of runs: motions and scenarios, options, outputs, and the progress function.
//!
//! Not here: words and numbers of settings (`values.rs`), one motion or scenario (`scenario.rs`),
//! results (`run.rs`).

use std::collections::HashMap;

use flexarm::recordings::RecordingFormat;
use flexarm::{Outputs, RunOptions, Scenario};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::motion::PyMotion;
use crate::robot::PyRobot;
use crate::scenario::{PyScenario, scenario};
use crate::values::{path, stepper, word};

/// Returns whether the argument is one motion or scenario, not a sequence.
pub(crate) fn is_one(runs: &Bound<'_, PyAny>) -> bool {
    runs.is_none()
        || runs.cast::<PyMotion>().is_ok()
        || runs.cast::<PyScenario>().is_ok()
        || runs.extract::<std::path::PathBuf>().is_ok()
}

/// Options shared by single and multiple runs.
pub(crate) fn run_options(
    step: Option<f64>,
    stepper_word: Option<&str>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<RunOptions> {
    let stepper = stepper(stepper_word, options)?;
    let step_s = step.unwrap_or(stepper.entry().default_step_s);
    Ok(RunOptions { step_s, stepper, ..RunOptions::default() })
}

/// Returns the output folder and the requested recordings.
pub(crate) fn outputs(
    folder: Option<&Bound<'_, PyAny>>,
    overwrite: bool,
    formats: Option<Vec<String>>,
    figures: bool,
) -> PyResult<Option<Outputs>> {
    let Some(folder) = folder else {
        let unused = overwrite || figures || formats.is_some();
        return match unused {
            true => Err(PyValueError::new_err("overwrite, formats and figures need an output folder")),
            false => Ok(None),
        };
    };
    let mut outputs = Outputs { overwrite, figures, ..Outputs::everything(path("output", folder)?) };
    if let Some(formats) = formats {
        let known: Vec<(&str, RecordingFormat)> =
            RecordingFormat::ALL.into_iter().map(|format| (format.info().extension, format)).collect();
        outputs.recordings = formats.iter().map(|found| word("formats", found, &known)).collect::<PyResult<_>>()?;
    }
    Ok(Some(outputs))
}

/// Returns the progress function: the caller's, or a bar if True was given.
pub(crate) fn progress_function<'py>(
    py: Python<'py>,
    given: Option<Bound<'py, PyAny>>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let Some(given) = given.filter(|given| !given.is_none()) else { return Ok(None) };
    match given.extract::<bool>() {
        Ok(false) => Ok(None),
        Ok(true) => {
            let bar = py.import("flexarm._show")?.call_method0("progress_bar")?;
            Ok(Some(bar).filter(|bar| !bar.is_none()))
        }
        Err(_) => Ok(Some(given)),
    }
}

/// Returns one scenario per run.
pub(crate) fn scenarios(robot: &Bound<'_, PyRobot>, runs: &Bound<'_, PyAny>) -> PyResult<Vec<Scenario>> {
    let wrong =
        || PyTypeError::new_err(format!("runs is {}: expected a list of motions or Scenarios", runs.get_type()));
    if is_one(runs) {
        return Err(wrong());
    }
    // The same object again, as in [None] * 1000, gives the same scenario.
    let mut known: HashMap<*mut pyo3::ffi::PyObject, (Bound<'_, PyAny>, Scenario)> = HashMap::new();
    let mut all = Vec::new();
    for run in runs.try_iter().map_err(|_| wrong())? {
        let run = run?;
        if let Some((_, scenario)) = known.get(&run.as_ptr()) {
            all.push(scenario.clone());
            continue;
        }
        runs.py().check_signals()?;
        let made = scenario(robot, Some(&run), None, None, None)?;
        all.push(made.clone());
        known.insert(run.as_ptr(), (run, made));
    }
    Ok(all)
}
