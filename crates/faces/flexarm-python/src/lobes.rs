//! Chatter-free depth of cut.
//!
//! Speeds in rpm, depths in m. Not here: the stability of milling (`flexarm::lobes`).

use std::path::{Path, PathBuf};

use flexarm::lobes::{CuttingPlace, CuttingTool, LobesRequest, lobes as limits};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::numbers;
use crate::caveat;
use crate::failure::{OrRaise, raised};
use crate::robot::PyRobot;
use crate::scenario::scenario;
use crate::values::{modelling, whole};
use crate::watch::stoppable;

/// Finds the limit depth of cut for chatter over the spindle speed.
///
/// Parameters
/// ----------
/// robot : Robot
/// tool : path or str
///     A file of a cutting tool (``flexarm format tool`` describes it), or the name of a shipped
///     one, such as ``"endmill_20mm"``.
/// q : array_like, shape (n,), optional
///     The pose (rad or m). Default: all zero.
/// along : Motion or path, optional
///     A motion, instead of a pose.
/// places : int, default 12
///     Number of positions along it.
/// rpm : array_like, optional
///     Spindle speeds (1/min), instead of those in the file.
/// deepest : float, optional
///     Maximum depth of cut to examine (m).
/// ranges : bool, default False
///     Return all unstable ranges of depth at each speed.
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// output : path, optional
///     Folder of table, picture and page. Default: nothing is written.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     ``points`` with ``spindle_rpm``, ``depth_m``, ``chatter_hz`` and ``kind``, and more, as
///     ``flexarm lobes --json``.
#[pyfunction]
#[pyo3(signature = (robot, tool, *, q=None, along=None, places=12, rpm=None, deepest=None, ranges=false,
                    links=None, drives=None, output=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn lobes<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    tool: PathBuf,
    q: Option<&Bound<'py, PyAny>>,
    along: Option<&Bound<'py, PyAny>>,
    #[pyo3(from_py_with = whole)] places: usize,
    rpm: Option<Vec<f64>>,
    deepest: Option<f64>,
    ranges: bool,
    links: Option<&str>,
    drives: Option<&str>,
    output: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    if q.is_some() && along.is_some() {
        return Err(PyValueError::new_err("q and along exclude each other: give one of them"));
    }
    let tool = cutting_tool(py, &tool, rpm)?;
    let n = robot.get().robot.rigid_model().or_raise()?.n_actuated();
    let q = q.map(|q| numbers("q", q, &[(n, "joints")], false)).transpose()?.map(|q| q.values().to_vec());
    let motion = along.map(|along| scenario(robot, Some(along), None, None, None)).transpose()?.map(|s| s.motion);
    let modelling = modelling(links, drives, None, None)?;
    let request = LobesRequest { modelling, deepest_m: deepest, ranges, output, overwrite };
    let robot = robot.get().robot.clone();
    // Ctrl-C ends the computation between two limits.
    let found = stoppable(py, move |stop| {
        let place = match &motion {
            Some(motion) => CuttingPlace::Along(motion, places),
            None => CuttingPlace::At(q.as_deref()),
        };
        limits(&robot, &tool, &place, &request, &|_, _| !stop())
    })?
    .or_raise()?;
    caveat::answer(py, &found, &found.caveats)
}

/// Creates the exception for an unknown tool, listing the shipped ones.
fn no_tool(py: Python<'_>, tool: &Path) -> PyResult<PyErr> {
    let shipped: Vec<String> = py.import("flexarm._show")?.call_method0("shipped_tools")?.extract()?;
    let name = tool.to_string_lossy();
    let near = flexarm::robots::closest(&name, shipped.iter().map(String::as_str));
    let near = near.map_or_else(String::new, |near| format!(" (did you mean {near:?}?)"));
    let shipped = shipped.join(", ");
    let what = format!("there is no such file and no shipped tool of this name{near}; shipped are {shipped}");
    let message = format!("tool: {name}: {what}");
    Ok(raised(py, "FileError", message))
}

/// Loads a tool from a file or a shipped one; `rpm` replaces its speeds.
pub(crate) fn cutting_tool(py: Python<'_>, tool: &Path, rpm: Option<Vec<f64>>) -> PyResult<CuttingTool> {
    let file = flexarm_cli::shipped_tool(tool);
    if !file.exists() {
        return Err(no_tool(py, tool)?);
    }
    let tool = CuttingTool::load(file).or_raise()?;
    Ok(match rpm {
        Some(rpm) => tool.at_speeds(rpm),
        None => tool,
    })
}
