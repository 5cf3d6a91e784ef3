//! Joint commands with which a flexible arm's TCP follows the rigid one's.
//!
//! Errors in m, world axes. Not here: the inverse model and input shapers (`flexarm::compensate`).

use std::path::PathBuf;

use flexarm::compensate::{CompensateRequest, Compensation, ShaperKind, Shaping, compensate_motion_until};
use flexarm::{Motion, RunOptions};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::arrays::{numbers, view};
use crate::caveat;
use crate::failure::OrRaise;
use crate::figures::Figures;
use crate::motion::PyMotion;
use crate::parts::{Parts, Pickled};
use crate::robot::PyRobot;
use crate::scenario::scenario;
use crate::values::{choice, modelling, texts, whole, word};
use crate::watch::stoppable;

const COMPONENTS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// A motion whose flexible TCP follows the rigid one's path. Created by :func:`flexarm.compensate`.
#[pyclass(frozen, name = "Compensated", module = "flexarm")]
pub(crate) struct PyCompensated {
    motion: Py<PyMotion>,
    curves: Vec<f64>,
    /// Summary in one line.
    headline: String,
    figures: Figures,
}

impl PyCompensated {
    fn new(motion: Py<PyMotion>, found: Compensation) -> Self {
        let (before, after) = (1e3 * found.before.peak_m, 1e3 * found.after.peak_m);
        let caveats = found.caveats.clone();
        Self {
            motion,
            curves: found.curves.iter().flatten().copied().collect(),
            headline: format!("{}: peak error {before:.4} mm before, {after:.4} mm after", found.motion),
            figures: Figures::of(found, &caveats),
        }
    }
}

#[pymethods]
impl PyCompensated {
    /// The new motion.
    #[getter]
    fn motion(&self, py: Python<'_>) -> Py<PyMotion> {
        self.motion.clone_ref(py)
    }

    /// TCP error with the original motion (dict): ``peak_m``, ``rms_m``, ``peak_rad``, ``end_m``.
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)?.get_item("before")
    }

    /// TCP error with the new motion (dict), same keys.
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)?.get_item("after")
    }

    /// Time (s), and TCP error before and after (m), (n, 3).
    #[getter]
    fn curves<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.curves.len() / 3, 3], &own.curves)))
    }

    /// All figures (dict as ``flexarm compensate --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)
    }

    /// Limits of the validity of the result (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.figures.caveats(py)
    }

    fn __repr__(&self) -> String {
        format!("<Compensated {}>", flexarm::settings::written::one_line(&self.headline))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyCompensated {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        parts.put("motion", &self.motion)?;
        parts.put_numbers("curves", &self.curves)?;
        parts.put("headline", &self.headline)?;
        self.figures.put_into(parts)
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        Ok(Self {
            motion: parts.get("motion")?,
            curves: parts.numbers("curves")?,
            headline: parts.get("headline")?,
            figures: Figures::of_parts(parts)?,
        })
    }
}

/// Finds joint commands with which the TCP of a flexible arm follows the path of the rigid one.
///
/// Parameters
/// ----------
/// robot : Robot
/// motion : Motion, Scenario or path, optional
///     Default: the robot's own motion.
/// method : {"dynamic", "static"}, default "dynamic"
///     With inertia and damping, iterated on the simulation; or only gravity, point by point.
/// components : sequence of str, optional
///     Components of the TCP error to correct, of x, y, z, rx, ry, rz. Default: all.
/// iterations : int, default 5
/// cutoff_hz : float, optional
///     Highest frequency to correct.
/// shaper : {"zv", "zvd", "optimal"}, optional
///     Input shaper applied first: for the first mode at the end of the motion, or minimising the
///     residual vibration of all modes there within ``delay``.
/// delay : float, optional
///     Maximum delay of the optimal shaper (s). Default: a period of the first mode.
/// band : float, default 0.1
///     Relative frequency error that the optimal shaper tolerates.
/// plant : Robot, optional
///     Another robot for the evaluation.
/// sweep : bool, default True
///     Also evaluate with perturbed stiffness, damping and drives.
/// step : float, default 1e-3
///     Time step (s).
/// loads : sequence of Load, or path of a file of loads, optional
/// payloads : sequence of Payload, optional
///     Loads on the arm in addition to gravity, corrected as well.
/// limits : {"slow", "refuse", "tell"}, default "slow"
///     Response to commands that exceed a joint limit which the motion itself respects.
/// accelerations : array_like, optional
///     Maximum acceleration of each joint (rad/s² or m/s²). Default: not checked.
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// output : path, optional
///     Folder of the new motion, a page and a recording. Default: nothing is written.
/// write : sequence of path, optional
///     Further files of the new motion: .csv, .toml, .yaml or .json by extension.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// Compensated
#[pyfunction]
#[pyo3(signature = (robot, motion=None, *, method="dynamic", components=None, iterations=5, cutoff_hz=None, shaper=None,
                    delay=None, band=Shaping::BAND, plant=None, sweep=true, step=1e-3, loads=None, payloads=None, limits="slow", accelerations=None,
                    links=None, drives=None, output=None, write=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn compensate<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    motion: Option<&Bound<'py, PyAny>>,
    method: &str,
    #[pyo3(from_py_with = texts)] components: Option<Vec<String>>,
    #[pyo3(from_py_with = whole)] iterations: usize,
    cutoff_hz: Option<f64>,
    shaper: Option<&str>,
    delay: Option<f64>,
    band: f64,
    plant: Option<&Bound<'py, PyRobot>>,
    sweep: bool,
    step: f64,
    loads: Option<&Bound<'py, PyAny>>,
    payloads: Option<&Bound<'py, PyAny>>,
    limits: &str,
    accelerations: Option<&Bound<'py, PyAny>>,
    links: Option<&str>,
    drives: Option<&str>,
    output: Option<PathBuf>,
    write: Option<Vec<PathBuf>>,
    overwrite: bool,
) -> PyResult<PyCompensated> {
    let chosen = chosen_components(components.as_deref())?;
    let n = robot.get().robot.rigid_model().or_raise()?.n_actuated();
    let accelerations = accelerations.map(|a| numbers("accelerations", a, &[(n, "joints")], false)).transpose()?;
    let optimal = Shaping::Optimal { delay_s: delay, band };
    let shapers = [("zv", ShaperKind::Zv.into()), ("zvd", ShaperKind::Zvd.into()), ("optimal", optimal)];
    // Words, arrays and other robots become a request; None is the library's default.
    let request = CompensateRequest {
        modelling: modelling(links, drives, None, None)?,
        run: RunOptions { step_s: step, ..RunOptions::default() },
        method: choice("method", method)?,
        components: chosen,
        iterations,
        cutoff_hz,
        shaper: shaper.map(|found| word("shaper", found, &shapers)).transpose()?,
        plant: plant.map(|plant| (plant.get().robot.name.clone(), (*plant.get().robot).clone())),
        sweep,
        accelerations: accelerations.map_or_else(Vec::new, |a| a.values().to_vec()),
        limits: choice("limits", limits)?,
        output,
        motions: write.unwrap_or_default(),
        overwrite,
        ..CompensateRequest::default()
    };
    let scenario = scenario(robot, motion, loads, payloads, None)?;
    let loaded = robot.get().robot.clone();
    let name = format!("{}_compensated", scenario.motion.name);
    let found = stoppable(py, move |stop| compensate_motion_until(&loaded, scenario, &request, stop))?.or_raise()?;
    caveat::answer(py, &found, &found.caveats)?;
    // The commands as a motion that other calls take.
    let motion = Motion::along((*found.trajectory).clone(), &name, &robot.get().robot).or_raise()?;
    Ok(PyCompensated::new(Py::new(py, PyMotion::made(motion, robot))?, found))
}

/// Returns which components are named; all if there are no names.
fn chosen_components(names: Option<&[String]>) -> PyResult<[bool; 6]> {
    let known: Vec<(&str, usize)> = COMPONENTS.into_iter().zip(0..).collect();
    let mut chosen = [names.is_none(); 6];
    for found in names.into_iter().flatten() {
        chosen[word("components", found, &known)?] = true;
    }
    Ok(chosen)
}
