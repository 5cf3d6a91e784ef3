//! Parameters from measurements, and plans of poses to measure.
//!
//! Answers are dictionaries with the keys of `--json`. Not here: least squares
//! (`flexarm::identify`).

use std::path::PathBuf;

use flexarm::identify::{IdentifyRequest, PlanRequest, identify_robot, plan_measurements as plan};
use pyo3::prelude::*;

use crate::arrays::table;
use crate::caveat;
use crate::failure::OrRaise;
use crate::robot::PyRobot;
use crate::values::{modelling, texts, whole};
use crate::watch::stoppable;

/// Identifies parameters of a robot file from measurements: tracker, dial gauge, hammer, encoders.
///
/// Parameters
/// ----------
/// robot : Robot
/// measurements : path
///     A file of measurements (``flexarm format measurements`` describes it).
/// fit : sequence of str, optional
///     Names of the parameters to identify, ``*`` as a wildcard, instead of those in the file.
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// output : path, optional
///     Folder of the new robot file and a page. Default: nothing is written.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     Parameters with uncertainties and residuals, as ``flexarm identify --json``.
#[pyfunction]
#[pyo3(signature = (robot, measurements, *, fit=None, links=None, drives=None, output=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn identify<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    measurements: PathBuf,
    #[pyo3(from_py_with = texts)] fit: Option<Vec<String>>,
    links: Option<&str>,
    drives: Option<&str>,
    output: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let modelling = modelling(links, drives, None, None)?;
    let request = IdentifyRequest { modelling, fit: fit.unwrap_or_default(), output, overwrite };
    let robot = robot.get().robot.clone();
    let found = stoppable(py, move |_| identify_robot(&robot, &measurements, &request))?.or_raise()?;
    caveat::answer(py, &found, &found.caveats)
}

/// Chooses the most informative poses and forces for the unknown parameters.
///
/// Parameters
/// ----------
/// robot : Robot
/// count : int
///     Number of readings.
/// fit : sequence of str, optional
///     Names of the parameters to identify. Default: all stiffnesses.
/// forces : array_like, shape (m, 3), optional
///     Candidate forces on the tool, world axes (N).
/// levers : array_like, optional
///     Candidate points of application of the forces, tool axes (m), one per row. Default: the TCP.
/// points : array_like, optional
///     Candidate points on the tool to observe, tool axes (m), one per row. Default: the TCP.
/// gauges : array_like, optional
///     Candidate directions of a dial gauge, world axes, one per row. Default: all three components
///     are measured.
/// std : float, default 3e-5
///     Standard deviation of a measured displacement (m).
/// poses, work : path, optional
///     Tables of poses: the candidates, and those of the later work.
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// output : path, optional
///     Folder of the files to fill in. Default: nothing is written.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     As ``flexarm identify --plan --json``.
#[pyfunction]
#[pyo3(signature = (robot, count, *, fit=None, forces=None, levers=None, points=None, gauges=None, std=None, poses=None, work=None,
                    links=None, drives=None, output=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn plan_measurements<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    #[pyo3(from_py_with = whole)] count: usize,
    #[pyo3(from_py_with = texts)] fit: Option<Vec<String>>,
    forces: Option<&Bound<'py, PyAny>>,
    levers: Option<&Bound<'py, PyAny>>,
    points: Option<&Bound<'py, PyAny>>,
    gauges: Option<&Bound<'py, PyAny>>,
    std: Option<f64>,
    poses: Option<PathBuf>,
    work: Option<PathBuf>,
    links: Option<&str>,
    drives: Option<&str>,
    output: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let usual = PlanRequest::new(count);
    let threes = |name: &str, rows: Option<&Bound<'py, PyAny>>, what: &str| -> PyResult<Option<Vec<[f64; 3]>>> {
        let Some(rows) = rows else { return Ok(None) };
        let rows = table(name, rows, 3, what)?;
        Ok(Some(rows.values().chunks_exact(3).map(|row| [row[0], row[1], row[2]]).collect()))
    };
    // Forces, levers, watched points and gauge directions: rows of three numbers.
    let forces = threes("forces", forces, "numbers (N)")?.unwrap_or_else(|| usual.forces.clone());
    let request = PlanRequest {
        modelling: modelling(links, drives, None, None)?,
        fit: fit.unwrap_or_default(),
        forces,
        levers: threes("levers", levers, "numbers (m)")?.unwrap_or_default(),
        points: threes("points", points, "numbers (m)")?.unwrap_or_default(),
        directions: threes("gauges", gauges, "numbers")?.unwrap_or_default(),
        std_m: std.unwrap_or(usual.std_m),
        poses,
        work,
        output,
        overwrite,
        ..usual
    };
    let robot = robot.get().robot.clone();
    let found = stoppable(py, move |_| plan(&robot, &request))?.or_raise()?;
    caveat::answer(py, &found, &found.caveats)
}
