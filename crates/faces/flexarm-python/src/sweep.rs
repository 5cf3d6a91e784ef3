//! Studies of many runs, defined by a file.
//!
//! Start at [`sweep`]. Not here: the study (`flexarm-sweep`).

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use flexarm::Finding;
use flexarm::sweep::{Finders, Shard, Sweep, SweepRequest};
use pyo3::prelude::*;

use crate::caveat;
use crate::failure::OrRaise;
use crate::run_arguments::progress_function;
use crate::values::maybe_whole;
use crate::watch::stoppable_telling;

/// Look-up of robots and motions by path or shipped name.
const FINDERS: Finders = Finders { robot: flexarm_cli::shipped_robot_file, motion: flexarm_cli::shipped_motion };

/// Runs a study: many runs with varied payloads, stiffness, speeds or options, on all cores.
///
/// Existing results of the same study in the folder are not run again, so repeating the call
/// continues a stopped study.
///
/// Parameters
/// ----------
/// study : path
///     The file of the study (``flexarm format study`` describes it).
/// output : path
///     Folder of the results: ``runs.parquet``, a page, the best run.
/// threads : int, optional
///     Default: the number of cores.
/// overwrite : bool, default False
///     Replace results of another study.
/// progress : callable or bool, optional
///     Called with the numbers of finished and of all runs; True shows a bar.
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
    #[pyo3(from_py_with = maybe_whole)] threads: Option<usize>,
    overwrite: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut sweep = Sweep::load(&study, &FINDERS).or_raise()?;
    let request = SweepRequest { output, overwrite, shard: Shard::ALL, threads, command: None };
    let bar = progress_function(py, progress)?;
    // Progress, reported by the thread that may call Python.
    let at: Arc<Mutex<Option<(usize, usize)>>> = Arc::default();
    let reported = at.clone();
    let work = move |stop: &(dyn Fn() -> bool + Sync)| {
        let mut report = |done: usize, all: usize| {
            *at.lock().unwrap_or_else(PoisonError::into_inner) = Some((done, all));
            if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        sweep.run(&request, &mut report)
    };
    let mut tell = |_: Python<'_>| match (reported.lock().unwrap_or_else(PoisonError::into_inner).take(), &bar) {
        (Some((done, all)), Some(bar)) => bar.call1((done as f64, all as f64)).map(drop),
        _ => Ok(()),
    };
    let result = stoppable_telling(py, work, &mut tell);
    if let Some(bar) = &bar
        && let Ok(close) = bar.getattr("close")
    {
        close.call0()?;
    }
    let found = result?.or_raise()?;
    let caveats: Vec<Finding> = found.caveats.iter().map(|figures| figures.caveat.clone()).collect();
    caveat::answer(py, &found, &caveats)
}
