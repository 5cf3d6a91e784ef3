//! Links from meshes and matrices, and their export.
//!
//! Lengths in m unless a unit system is named. Not here: the jobs (`flexarm::links`).

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use flexarm::links::export::{ExportJob, export};
use flexarm::links::import::{ImportFormat, ImportJob, ImportOutputs, import};
use flexarm::links::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, ReduceProgress, reduce as reduce_job};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::caveat;
use crate::failure::OrRaise;
use crate::values::{choice, maybe_whole, path, texts};
use crate::watch::{stoppable, stoppable_telling};

/// Reduces a mesh to a flexible link and writes its files.
///
/// Parameters
/// ----------
/// job : str, os.PathLike or dict
///     A job file, a mesh, or the keys of a job file as a dict: ``mesh``, ``units``, ``material``,
///     ``modes``, ``interface``, ...
/// output : str or os.PathLike, optional
///     Folder for the link file, the complete job, the figures and a report. Default: nothing is
///     written.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     Mass, stiffness, frequencies and checks, as ``flexarm reduce --json``.
#[pyfunction]
#[pyo3(signature = (job, *, output=None, overwrite=false))]
pub(crate) fn reduce<'py>(
    py: Python<'py>,
    job: &Bound<'py, PyAny>,
    output: Option<&Bound<'py, PyAny>>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    crate::command::name_keywords();
    let job = match job.cast::<PyDict>() {
        Ok(keys) => {
            let text: String = py.import("json")?.call_method1("dumps", (keys,))?.extract()?;
            serde_json::from_str::<ReduceJob>(&text).map_err(|error| {
                let what = error.to_string();
                let what = what.split(" at line").next().unwrap_or_default();
                PyValueError::new_err(format!("job: {what}"))
            })?
        }
        Err(_) => ReduceJob::load(&path("job", job)?).or_raise()?,
    };
    let folder = output.map(|output| path("output", output)).transpose()?;
    let outputs = folder.map(|folder| ReduceOutputs { folder: Some(folder), flex: None, overwrite });
    // Steps that have begun, logged by the thread that may call Python.
    let begun: Arc<Mutex<Vec<ReduceProgress>>> = Arc::default();
    let steps = begun.clone();
    let lock =
        |begun: &Mutex<Vec<ReduceProgress>>| std::mem::take(&mut *begun.lock().unwrap_or_else(PoisonError::into_inner));
    let mut tell = |py: Python<'_>| {
        let steps_done = lock(&begun).into_iter();
        steps_done.map(|s| (s.step, s.number, s.of)).try_for_each(|step| caveat::say(py, "step", step))
    };
    let work = move |_: &(dyn Fn() -> bool + Sync)| {
        let mut begin = |step| steps.lock().unwrap_or_else(PoisonError::into_inner).push(step);
        reduce_job(&job, &ReduceOptions::default(), outputs.as_ref(), &mut begin)
    };
    let summary = stoppable_telling(py, work, &mut tell)?.or_raise()?;
    caveat::answer(py, &summary, &summary.caveats)
}

/// Reads one path or several.
fn paths(argument: &str, files: &Bound<'_, PyAny>) -> PyResult<Vec<PathBuf>> {
    match path(argument, files) {
        Ok(one) => Ok(vec![one]),
        Err(wrong) => files.try_iter().map_err(|_| wrong)?.map(|file| path(argument, &file?)).collect(),
    }
}

/// Parses a value in the form used on the command line.
fn parsed<T: std::str::FromStr<Err: std::fmt::Display>>(argument: &str, text: Option<&str>) -> PyResult<Option<T>> {
    let wrong = |error: T::Err| PyValueError::new_err(format!("{argument}: {error}"));
    text.map(|text| text.parse().map_err(wrong)).transpose()
}

/// Creates a flexible link from matrices of another finite element program.
///
/// Parameters
/// ----------
/// files : path or sequence of paths
///     Files of one structure; companion files in the same folder are found.
/// format : str, optional
///     Required format of the files. Default: detected by content.
/// units : str, optional
///     ``"m-kg-s"``, ``"mm-t-s"``, ...
/// map : str, optional
///     Rows or nodes of each interface: ``"A=1001,B=1002"``.
/// at : sequence of str, optional
///     Frames of interfaces: ``"B=0,0,1.1"``.
/// modes : int, optional
///     Number of modes to keep of a full model.
/// mass_file : path, optional
/// name : str, optional
///     Name of the link.
/// output : path, optional
///     Folder of the link file and its report. Default: nothing is written.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     As ``flexarm import --json``.
#[pyfunction]
#[pyo3(signature = (files, *, format=None, units=None, map=None, at=None, modes=None, mass_file=None, name=None, output=None,
                    overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn import_link<'py>(
    py: Python<'py>,
    files: &Bound<'py, PyAny>,
    format: Option<&str>,
    units: Option<&str>,
    map: Option<&str>,
    #[pyo3(from_py_with = texts)] at: Option<Vec<String>>,
    #[pyo3(from_py_with = maybe_whole)] modes: Option<usize>,
    mass_file: Option<PathBuf>,
    name: Option<String>,
    output: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    // Messages name the keywords of Python.
    crate::command::name_keywords();
    let mut frames = Vec::new();
    for text in at.iter().flatten() {
        frames.extend(parsed("at", Some(text))?);
    }
    let job = ImportJob {
        files: paths("files", files)?,
        format: format.map_or(Ok(ImportFormat::Auto), |found| choice("format", found))?,
        units: parsed("units", units)?,
        map: parsed("map", map)?,
        at: frames,
        modes,
        mass_file,
        name,
        ..ImportJob::default()
    };
    let outputs = output.map(|folder| ImportOutputs { folder: Some(folder), flex: None, overwrite });
    let summary = stoppable(py, move |_| import(&job, outputs.as_ref()))?.or_raise()?;
    caveat::answer(py, &summary, &summary.caveats)
}

/// Writes the matrices of a link for another program.
///
/// Parameters
/// ----------
/// link : path
///     A ``.flex`` file.
/// format : str
///     ``"matrix-market"``, ``"user-element"`` or ``"simscape"``.
/// output : path
///     Output folder.
/// units : str, default "m-kg-s"
/// nodes : sequence of int, optional
///     Node numbers of the interfaces.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     As ``flexarm export --json``.
#[pyfunction]
#[pyo3(signature = (link, format, output, *, units="m-kg-s", nodes=None, overwrite=false))]
pub(crate) fn export_link<'py>(
    py: Python<'py>,
    link: PathBuf,
    format: &str,
    output: PathBuf,
    units: &str,
    nodes: Option<Vec<i64>>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    crate::command::name_keywords();
    let format = choice("format", format)?;
    let units = units.parse().map_err(|error| PyValueError::new_err(format!("units: {error}")))?;
    let job = ExportJob { link, format, units, nodes: nodes.unwrap_or_default(), folder: output, overwrite };
    let summary = stoppable(py, move |_| export(&job))?.or_raise()?;
    caveat::say(py, "warnings", (caveat::sentences(&summary.warnings),))?;
    caveat::answer(py, &summary, &[])
}
