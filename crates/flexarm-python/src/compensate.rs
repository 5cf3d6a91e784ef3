//! Joint commands with which a flexible arm's tool follows the rigid one.

use std::path::PathBuf;

use flexarm::compensate::{CompensateRequest, Compensation, Method, ShaperKind, compensate_motion};
use flexarm::{Motion, RunOptions};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::view;
use crate::caveat;
use crate::failure::OrRaise;
use crate::motion::PyMotion;
use crate::robot::PyRobot;
use crate::scenario::scenario;
use crate::values::{modelling, plain, word};
use crate::watch::stoppable;

const COMPONENTS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// A motion whose flexible tool follows the rigid one's path. Made by :func:`flexarm.compensate`.
#[pyclass(frozen, name = "Compensated", module = "flexarm")]
pub(crate) struct PyCompensated {
    found: Compensation,
    motion: Motion,
    curves: Vec<f64>,
}

#[pymethods]
impl PyCompensated {
    /// The new motion.
    #[getter]
    fn motion(&self) -> PyMotion {
        PyMotion::made(self.motion.clone())
    }

    /// Error of the tool with the motion as it was (dict): ``peak_m``, ``rms_m``, ``peak_rad``, ``end_m``.
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.found.before)
    }

    /// The same with the new motion (dict).
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.found.after)
    }

    /// Time (s), and distance of the tool before and after (m), (n, 3).
    #[getter]
    fn curves<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let curves = &slf.get().curves;
        view(slf.clone().into_any(), [curves.len() / 3, 3], curves)
    }

    /// All figures (dict as ``flexarm compensate --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.found)
    }

    fn __repr__(&self) -> String {
        let (before, after) = (1e3 * self.found.before.peak_m, 1e3 * self.found.after.peak_m);
        format!("<Compensated {}: largest error {before:.4} mm before, {after:.4} mm after>", self.found.motion)
    }
}

/// Finds joint commands with which the tool of a flexible arm follows the path of the rigid one.
///
/// Parameters
/// ----------
/// robot : Robot
/// motion : Motion or path, optional
///     The robot's own motion without it.
/// method : {"dynamic", "static"}, default "dynamic"
///     With inertia and damping, iterated on the simulation; or weight alone, point by point.
/// components : sequence of str, optional
///     Which of x, y, z, rx, ry, rz of the tool count; all without it.
/// iterations : int, default 5
/// cutoff_hz : float, optional
///     Highest frequency that is corrected.
/// shaper : {"zv", "zvd"}, optional
///     Run the motion through a shaper of the first mode before.
/// plant : Robot, optional
///     Another robot that judges.
/// sweep : bool, default True
///     Judge with stiffness, damping and drives that are off as well.
/// step : float, default 1e-3
///     Time step (s).
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// output : path, optional
///     Folder of the new motion and a page; nothing is written without it.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// Compensated
#[pyfunction]
#[pyo3(signature = (robot, motion=None, *, method="dynamic", components=None, iterations=5, cutoff_hz=None, shaper=None,
                    plant=None, sweep=true, step=1e-3, links=None, drives=None, output=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn compensate<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    motion: Option<&Bound<'py, PyAny>>,
    method: &str,
    components: Option<Vec<String>>,
    iterations: usize,
    cutoff_hz: Option<f64>,
    shaper: Option<&str>,
    plant: Option<&Bound<'py, PyRobot>>,
    sweep: bool,
    step: f64,
    links: Option<&str>,
    drives: Option<&str>,
    output: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<PyCompensated> {
    let mut chosen = [components.is_none(); 6];
    for found in components.iter().flatten() {
        let known: Vec<(&str, usize)> = COMPONENTS.into_iter().zip(0..).collect();
        chosen[word("components", found, &known)?] = true;
    }
    let shapers = [("zv", ShaperKind::Zv), ("zvd", ShaperKind::Zvd)];
    let request = CompensateRequest {
        run: RunOptions { step_s: step, modelling: modelling(links, drives, None, None)?, ..RunOptions::default() },
        method: word("method", method, &[("dynamic", Method::Dynamic), ("static", Method::Static)])?,
        components: chosen,
        iterations,
        cutoff_hz,
        shaper: shaper.map(|found| word("shaper", found, &shapers)).transpose()?,
        plant: plant.map(|plant| (plant.get().robot.name.clone(), (*plant.get().robot).clone())),
        sweep,
        output,
        overwrite,
        ..CompensateRequest::default()
    };
    let scenario = scenario(robot, motion, None, None, None)?;
    if !scenario.loads.is_empty() || !scenario.payloads.is_empty() {
        return Err(PyValueError::new_err("motion: loads and payloads are not compensated: give the motion alone"));
    }
    let (of, motion) = (robot.get().robot.clone(), scenario.motion);
    let name = format!("{}_compensated", motion.name);
    let found = stoppable(py, move |_| compensate_motion(&of, &motion, &request))?.or_raise()?;
    caveat::warn(py, &found.caveats)?;
    let motion = Motion::along((*found.trajectory).clone(), &name, &robot.get().robot).or_raise()?;
    let curves = found.curves.iter().flatten().copied().collect();
    Ok(PyCompensated { found, motion, curves })
}
