//! Conversion of words, paths, whole numbers and wrenches to the library's types.
//!
//! A wrong value is a `ValueError` or `TypeError` that names the argument, what was found and what
//! is expected. Not here: arrays (`arrays.rs`).

use std::path::PathBuf;

use flexarm::robots::closest;
use flexarm::settings::Words;
use flexarm::steppers::{
    AlphaSettings, ReferenceSettings, STEPPERS, SpookSettings, Start, StepperEntry, StepperOptions,
};
use flexarm::{DriveModel, LinkModel, Modelling, StepperKind, Wrench};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::numbers;

/// Returns the value of one of several words.
///
/// # Errors
/// `ValueError` with the argument, the word, a similar word, and all allowed ones.
pub(crate) fn word<T: Copy>(argument: &str, found: &str, words: &[(&str, T)]) -> PyResult<T> {
    if let Some((_, value)) = words.iter().find(|(word, _)| *word == found) {
        return Ok(*value);
    }
    let known = words.iter().map(|(word, _)| format!("{word:?}")).collect::<Vec<_>>().join(", ");
    let meant = closest(found, words.iter().map(|(word, _)| *word));
    let meant = meant.map_or_else(String::new, |near| format!("; did you mean {near:?}?"));
    Err(PyValueError::new_err(format!("{argument}={found:?}: expected one of {known}{meant}")))
}

/// Returns the value of a word, as [`word`].
pub(crate) fn choice<T: Words>(argument: &str, found: &str) -> PyResult<T> {
    let words: Vec<_> = T::WORDS.iter().map(|(word, value, _)| (*word, *value)).collect();
    word(argument, found, &words)
}

/// Returns the modelling of links and drives.
pub(crate) fn modelling(
    links: Option<&str>,
    drives: Option<&str>,
    segments: Option<usize>,
    modes: Option<usize>,
) -> PyResult<Modelling> {
    let links = links.map_or(Ok(LinkModel::AsFiled), |found| choice("links", found))?;
    let drives = drives.map_or(Ok(DriveModel::AsFiled), |found| choice("drives", found))?;
    Ok(Modelling { links, drives, segments, modes })
}

/// Returns a stepper by its name, with its options by theirs.
pub(crate) fn stepper(name: Option<&str>, options: Option<&Bound<'_, PyDict>>) -> PyResult<StepperKind> {
    let mut known: Vec<(&str, &StepperEntry)> = Vec::new();
    for entry in STEPPERS {
        known.push((entry.name, entry));
        known.extend(entry.aliases.iter().map(|alias| (*alias, entry)));
    }
    let entry = name.map_or(Ok(STEPPERS[0]), |found| word("stepper", found, &known))?;
    let mut chosen = StepperOptions::default();
    let Some(options) = options else { return Ok((entry.with)(&chosen)) };
    let takes: &[&str] = match (entry.with)(&chosen) {
        StepperKind::GeneralizedAlpha(_) => &["rho", "dispersion_correction"],
        StepperKind::Spook(_) => &["form", "preset"],
        StepperKind::Reference(_) => &["rtol", "atol", "method"],
        _ => &[],
    };
    for (key, value) in options {
        let key: String = key.extract()?;
        if !takes.contains(&key.as_str()) {
            let text = format!("stepper_options has the key {key:?}: {} takes {takes:?}", entry.name);
            return Err(PyValueError::new_err(text));
        }
        set(&mut chosen, &key, &value)?;
    }
    Ok((entry.with)(&chosen))
}

/// Sets one option of a stepper.
fn set(chosen: &mut StepperOptions, key: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let text = || value.extract::<String>();
    match key {
        "rho" => chosen.alpha = AlphaSettings { rho: value.extract()?, ..chosen.alpha },
        "dispersion_correction" => {
            chosen.alpha = AlphaSettings { dispersion_correction: value.extract()?, ..chosen.alpha };
        }
        "form" => {
            chosen.spook = SpookSettings { form: choice("form", &text()?)?, ..chosen.spook };
        }
        "preset" => {
            chosen.spook = SpookSettings { preset: choice("preset", &text()?)?, ..chosen.spook };
        }
        "rtol" => {
            chosen.reference =
                ReferenceSettings { method: chosen.reference.method, ..ReferenceSettings::new(value.extract()?) };
        }
        "atol" => chosen.reference.atol = value.extract()?,
        "method" => chosen.reference.method = choice("method", &text()?)?,
        _ => {}
    }
    Ok(())
}

/// Returns the initial state of a run.
pub(crate) fn start(found: Option<&str>) -> PyResult<Start> {
    found.map_or(Ok(Start::Equilibrium), |found| choice("start", found))
}

/// Reads force and moment: six numbers, or three for a force. Default: zero.
pub(crate) fn wrench(value: Option<&Bound<'_, PyAny>>) -> PyResult<[f64; 6]> {
    let Some(value) = value else { return Ok([0.0; 6]) };
    let is_force = value.len().is_ok_and(|n| n == 3);
    let n = if is_force { 3 } else { 6 };
    let what = "numbers, force (N) then moment (N m), world axes; or (3,) for a force alone";
    let numbers = numbers("wrench", value, &[(n, what)], false)?;
    let mut wrench = [0.0; 6];
    wrench[..n].copy_from_slice(numbers.values());
    Ok(wrench)
}

/// Converts six numbers to a wrench.
pub(crate) fn as_wrench([x, y, z, rx, ry, rz]: [f64; 6]) -> Wrench {
    Wrench::new([x, y, z].into(), [rx, ry, rz].into())
}

/// Reads a path: a string or an object with `__fspath__`.
pub(crate) fn path(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    value.extract::<PathBuf>().map_err(|_| {
        let found = value.get_type();
        PyTypeError::new_err(format!("{argument} is {found}: expected a path (str or os.PathLike)"))
    })
}

/// Reads one or several strings, for arguments.
///
/// # Errors
/// `TypeError` with the value found.
pub(crate) fn texts(value: &Bound<'_, PyAny>) -> PyResult<Option<Vec<String>>> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(one) = value.extract::<String>() {
        return Ok(Some(vec![one]));
    }
    let wrong = |_| PyTypeError::new_err(format!("expected str or a list of str, found {}", found(value)));
    value.try_iter().and_then(|each| each.map(|one| one?.extract()).collect()).map(Some).map_err(wrong)
}

/// Reads a count, for arguments.
///
/// # Errors
/// `ValueError` if it is negative, `TypeError` if it is not a whole number.
pub(crate) fn whole(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    let negative = value.lt(0).unwrap_or(false);
    value.extract::<usize>().map_err(|_| {
        let message = format!("expected a whole number of at least 0, found {}", found(value));
        if negative { PyValueError::new_err(message) } else { PyTypeError::new_err(message) }
    })
}

/// Reads a count or None, for arguments.
///
/// # Errors
/// Those of [`whole`].
pub(crate) fn maybe_whole(value: &Bound<'_, PyAny>) -> PyResult<Option<usize>> {
    if value.is_none() { Ok(None) } else { whole(value).map(Some) }
}

/// Formats a value for messages.
fn found(value: &Bound<'_, PyAny>) -> String {
    value.repr().map_or_else(|_| value.get_type().to_string(), |text| text.to_string())
}

/// Converts to dicts, lists and numbers, in the order and with the keys of `--json`.
pub(crate) fn plain<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|error| PyValueError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}
