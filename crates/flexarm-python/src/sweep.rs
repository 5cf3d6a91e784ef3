//! Studies of many runs by a file.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use flexarm::sweep::{Finders, Shard, Sweep, SweepRequest};
use pyo3::prelude::*;

use crate::arm::progress_function;
use crate::failure::OrRaise;
use crate::values::plain;
use crate::watch::Watch;

/// Robots and motions by path or shipped name.
const FINDERS: Finders = Finders { robot: flexarm_cli::shipped_robot_file, motion: flexarm_cli::shipped_motion };

/// Runs a study: many runs with other payloads, stiffness, speeds or options, on all cores.
///
/// What is in the folder of the same study already is not run again, so a study that was stopped goes on with the same call.
///
/// Parameters
/// ----------
/// study : path
///     The file of the study (``flexarm format study`` describes it).
/// output : path
///     Folder of the results: ``runs.parquet``, a page, the best run.
/// threads : int, optional
///     As many as there are cores without it.
/// overwrite : bool, default False
///     Replace results of another study.
/// progress : callable or bool, optional
///     Called with the runs that are over and all of them; True shows a bar.
///
/// Returns
/// -------
/// dict
///     ``runs``, ``done``, ``failed``, ``file`` and more, as ``flexarm sweep --json``.
#[pyfunction]
#[pyo3(signature = (study, output, *, threads=None, overwrite=false, progress=None))]
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    study: PathBuf,
    output: PathBuf,
    threads: Option<usize>,
    overwrite: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut sweep = Sweep::load(&study, &FINDERS).or_raise()?;
    let request = SweepRequest { output, overwrite, shard: Shard::ALL, threads, command: None };
    let bar = progress_function(py, progress)?;
    let watch = Mutex::new(Watch::new(bar.clone().map(Bound::unbind)));
    let locked = || watch.lock().unwrap_or_else(PoisonError::into_inner);
    let mut look = |done: usize, all: usize| locked().look(done as f64, all as f64);
    let result = py.detach(|| sweep.run(&request, &mut look));
    if let Some(bar) = bar
        && let Ok(close) = bar.getattr("close")
    {
        close.call0()?;
    }
    let mut watch = watch.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(raised) = watch.raised.take() {
        return Err(raised);
    }
    plain(py, &result.or_raise()?)
}
