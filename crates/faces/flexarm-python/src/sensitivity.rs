//! Derivatives of the TCP error along a motion with respect to the parameters of the robot.
//!
//! Start at [`sensitivity`]. Not here: the derivatives (`flexarm-sensitivity`).

use std::path::PathBuf;

use flexarm::RunOptions;
use flexarm::sensitivity::{SensitivityRequest, sensitivity as slopes};
use pyo3::prelude::*;

use crate::caveat;
use crate::failure::OrRaise;
use crate::robot::PyRobot;
use crate::scenario::scenario;
use crate::values::{modelling, texts};

/// Derivatives of the TCP error along a motion with respect to all parameters, by differences.
///
/// Parameters of the robot, of its tool and of its motion are included.
///
/// Parameters
/// ----------
/// robot : Robot
/// motion : Motion, Scenario or path, optional
///     Default: the robot's own motion.
/// by : sequence of str, optional
///     Names of parameters, ``*`` as a wildcard: ``"drive.*"``, ``"motion.joint_1"``. Default: all.
/// step : float, default 1e-3
///     Time step (s).
/// loads : sequence of Load, or path of a file of loads, optional
/// payloads : sequence of Payload, optional
///     Loads on the arm in addition to gravity.
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// table : path, optional
///     Write a table of error and derivatives at every step (CSV).
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     ``peak_m``, ``rms_m``, ``parameters`` and more, as ``flexarm sensitivity --json``.
#[pyfunction]
#[pyo3(signature = (robot, motion=None, *, by=None, step=1e-3, loads=None, payloads=None, links=None, drives=None,
                    table=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn sensitivity<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    motion: Option<&Bound<'py, PyAny>>,
    #[pyo3(from_py_with = texts)] by: Option<Vec<String>>,
    step: f64,
    loads: Option<&Bound<'py, PyAny>>,
    payloads: Option<&Bound<'py, PyAny>>,
    links: Option<&str>,
    drives: Option<&str>,
    table: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let request = SensitivityRequest {
        modelling: modelling(links, drives, None, None)?,
        run: RunOptions { step_s: step, ..RunOptions::default() },
        parameters: by.unwrap_or_default(),
        table,
        overwrite,
    };
    let scenario = scenario(robot, motion, loads, payloads, None)?;
    let loaded = robot.get().robot.clone();
    let found = py.detach(move || slopes(&loaded, scenario, &request)).or_raise()?;
    caveat::answer(py, &found, &found.caveats)
}
