//! Arms: robots with their flexible links and drives, evaluated with numpy arrays.
//!
//! Start at `Arm.simulate` and `Arm.statics`. Arrays are SI, row-major, with the joints in the
//! order of `Arm.joints`; poses, errors and wrenches in world axes at the TCP, linear first. Not
//! here: classes of results (`run.rs`, `answers.rs`, `linear.rs`), conversion of arguments
//! (`run_arguments.rs`, `values.rs`, `arrays.rs`).

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use flexarm::live::{LiveOptions, Servos};
use flexarm::poses::OperatingPoint;
use flexarm::settings::Words;
use flexarm::{Arm, Error, Outputs, RunOptions, RunRequest, Scenario};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::answers::{PyModes, PyResponse, PyStatics, ResponseArgs, modes, response};
use crate::arrays::numbers;
use crate::caveat;
use crate::deflections::{Parameters, PyDeflections, Scenarios, variations};
use crate::failure::{OrRaise, exception};
use crate::linear::{PyLinear, linear};
use crate::live::PyLive;
use crate::model::PyModel;
use crate::operating_point::PyOperatingPoint;
use crate::robot::PyRobot;
use crate::run::{PyRun, PySample};
use crate::run_arguments::{is_one, outputs, progress_function, run_options, scenarios};
use crate::scenario::scenario;
use crate::values::{as_wrench, texts, whole, word, wrench};
use crate::watch::{Watch, stoppable};

/// A robot with its flexible links and drives. Created by :meth:`Robot.flexible`.
///
/// Immutable, shareable between threads, and picklable.
///
/// Examples
/// --------
/// >>> arm = flexarm.load("reference_arm").flexible()
/// >>> run = arm.simulate(step=2e-3)
/// >>> run.error.shape[1]
/// 3
/// >>> arm.statics([0.0, -0.5, 0.8]).compliance.shape  # doctest: +SKIP
/// (6, 6)
#[pyclass(frozen, name = "Arm", module = "flexarm")]
pub(crate) struct PyArm {
    robot: Py<PyRobot>,
    pub(crate) arm: Arc<Arm>,
    /// Workspace for single poses, created on first use.
    point: OnceLock<Mutex<OperatingPoint>>,
}

impl PyArm {
    pub(crate) fn new(robot: Py<PyRobot>, arm: Arc<Arm>) -> Self {
        Self { robot, arm, point: OnceLock::new() }
    }

    fn n(&self) -> usize {
        self.arm.model.n_actuated()
    }

    /// Parses one pose, if one is given.
    pub(crate) fn pose(&self, q: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Vec<f64>>> {
        self.of_joints("q", q)
    }

    /// Returns one number per joint, if any are given; `name`: that of the argument.
    fn of_joints(&self, name: &str, values: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Vec<f64>>> {
        let given = values.filter(|values| !values.is_none());
        given.map(|values| Ok(numbers(name, values, &[(self.n(), "joints")], false)?.values().to_vec())).transpose()
    }

    /// Returns the workspace for single poses.
    fn point(&self) -> PyResult<&Mutex<OperatingPoint>> {
        if let Some(point) = self.point.get() {
            return Ok(point);
        }
        let made = self.arm.operating_point().or_raise()?;
        Ok(self.point.get_or_init(|| Mutex::new(made)))
    }
}

#[pymethods]
impl PyArm {
    /// Robot from which the arm was created.
    #[getter]
    fn robot(&self, py: Python<'_>) -> Py<PyRobot> {
        self.robot.clone_ref(py)
    }

    /// Names of the actuated joints, in the order of all poses (tuple of str).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.arm.joints().collect::<Vec<_>>())
    }

    /// Names of the elastic elements (tuple of str).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.arm.springs.iter().map(|spring| spring.name.as_str()))
    }

    /// Number of elastic coordinates.
    #[getter]
    fn n_elastic(&self) -> usize {
        self.arm.model.n_elastic()
    }

    /// Tree with elastic coordinates after the actuated ones, for rigid-body algorithms (Model).
    #[getter]
    fn model(&self) -> PyModel {
        PyModel::new(self.arm.recursions())
    }

    /// Simulates a motion of the arm and of its rigid twin.
    ///
    /// Releases the GIL; Ctrl-C stops the run and leaves readable files.
    ///
    /// Parameters
    /// ----------
    /// motion : Motion, Scenario, str or os.PathLike, optional
    ///     A file, the name of a shipped motion, or a motion. Default: the robot's own motion.
    /// step : float, optional
    ///     Time step (s). Default: that of the stepper: 1e-3, for spook and rk4 1e-4.
    /// stepper : str, default "generalized-alpha"
    ///     Or ``"spook"``, ``"rk4"``, ``"reference"``, ``"sdirk3"``, ``"extrapolated-alpha"``.
    /// stepper_options : dict, optional
    ///     Settings of the stepper, such as ``{"rho": 0.9}``.
    /// loads : sequence of Load, or path of a file of loads, optional
    /// payloads : sequence of Payload, optional
    /// start : {"equilibrium", "undeformed"}, default "equilibrium"
    /// log_rate : float, default 500
    ///     Samples per second, rounded to a whole number of steps per sample.
    /// twin : bool, default True
    ///     Compare with the rigid robot.
    /// ignore_limits : bool, default False
    ///     Run even if the motion exceeds joint limits.
    /// settling_band : float, default 1e-4
    ///     Band of the settling time (m).
    /// output : str or os.PathLike, optional
    ///     Folder for recordings and a report. Default: nothing is written.
    /// overwrite : bool, default False
    /// formats : sequence of str, optional
    ///     Recordings to write, of ``"csv"``, ``"mcap"``, ``"rrd"``, ``"parquet"``.
    ///     Default: the usual ones.
    /// figures : bool, default False
    ///     Also write plots and pictures for papers.
    /// magnify : float, optional
    ///     Magnification of deflections in recordings.
    /// observer : callable, optional
    ///     Called with each logged :class:`Sample`; if it returns False, the run stops with
    ///     :class:`flexarm.Stopped`.
    /// progress : bool or callable, default False
    ///     True for a tqdm bar if tqdm is installed; or a function of simulated and total time.
    ///
    /// Returns
    /// -------
    /// Run
    #[pyo3(signature = (motion=None, *, step=None, stepper=None, stepper_options=None, loads=None, payloads=None, start=None,
                        log_rate=None, twin=true, ignore_limits=false, settling_band=1e-4, output=None, overwrite=false,
                        formats=None, figures=false, magnify=None, observer=None, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn simulate(
        &self,
        py: Python<'_>,
        motion: Option<&Bound<'_, PyAny>>,
        step: Option<f64>,
        stepper: Option<&str>,
        stepper_options: Option<&Bound<'_, PyDict>>,
        loads: Option<&Bound<'_, PyAny>>,
        payloads: Option<&Bound<'_, PyAny>>,
        start: Option<&str>,
        log_rate: Option<f64>,
        twin: bool,
        ignore_limits: bool,
        settling_band: f64,
        output: Option<&Bound<'_, PyAny>>,
        overwrite: bool,
        #[pyo3(from_py_with = texts)] formats: Option<Vec<String>>,
        figures: bool,
        magnify: Option<f64>,
        observer: Option<Py<PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<PyRun> {
        let scenario = scenario(self.robot.bind(py), motion, loads, payloads, start)?;
        let options = run_options(step, stepper, stepper_options)?;
        let options = RunOptions {
            log_rate_hz: log_rate.unwrap_or(options.log_rate_hz),
            with_twin: twin,
            ignore_limits,
            settling_band_m: settling_band,
            magnification: magnify,
            ..options
        };
        let outputs = outputs(output, overwrite, formats, figures)?;
        // The bar is closed whether the run succeeds or not.
        let bar = progress_function(py, progress)?;
        let run = self.watched(py, &scenario, &options, outputs.as_ref(), observer, bar.clone().map(Bound::unbind));
        if let Some(bar) = bar
            && let Ok(close) = bar.getattr("close")
        {
            close.call0()?;
        }
        let run = run?;
        // Messages for the user: headline, files, caveats.
        let (caveats, run) = (run.summary.caveats.clone(), PyRun::new(run));
        caveat::say(py, "ran", (run.headline(),))?;
        if outputs.is_some() {
            caveat::say(py, "wrote", (run.summary(py)?,))?;
        }
        caveat::issue(py, &caveats)?;
        Ok(run)
    }

    /// Runs many motions or Scenarios on all cores; results are bitwise equal to single runs.
    ///
    /// Parameters
    /// ----------
    /// runs : sequence of Motion, Scenario, str or os.PathLike
    /// step, stepper, stepper_options, log_rate, twin, ignore_limits, settling_band
    ///     As for :meth:`simulate`.
    /// errors : {"raise", "return"}, default "raise"
    ///     For runs that fail: raise the first exception, or return the exceptions in the list.
    ///
    /// Returns
    /// -------
    /// list of Run
    #[pyo3(signature = (runs, *, step=None, stepper=None, stepper_options=None, log_rate=None, twin=true,
                        ignore_limits=false, settling_band=1e-4, errors="raise"))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn simulate_batch<'py>(
        &self,
        py: Python<'py>,
        runs: &Bound<'py, PyAny>,
        step: Option<f64>,
        stepper: Option<&str>,
        stepper_options: Option<&Bound<'_, PyDict>>,
        log_rate: Option<f64>,
        twin: bool,
        ignore_limits: bool,
        settling_band: f64,
        errors: &str,
    ) -> PyResult<Bound<'py, PyList>> {
        let raises = word("errors", errors, &[("raise", true), ("return", false)])?;
        let scenarios = scenarios(self.robot.bind(py), runs)?;
        let options = run_options(step, stepper, stepper_options)?;
        let options = RunOptions {
            log_rate_hz: log_rate.unwrap_or(options.log_rate_hz),
            with_twin: twin,
            ignore_limits,
            settling_band_m: settling_band,
            ..options
        };
        // All cores without the GIL; then a failed run is raised or stands in the list.
        let arm = self.arm.clone();
        let found = stoppable(py, move |stop| arm.simulate_batch(&scenarios, &options, stop))?;
        let list = PyList::empty(py);
        for result in found {
            match result {
                Ok(run) => list.append(PyRun::new(run))?,
                Err(error) if raises => return Err(exception(error)),
                Err(error) => list.append(exception(error).into_value(py))?,
            }
        }
        Ok(list)
    }

    /// Computes TCP deflections of many runs: only figures, vectorised over runs, on all cores.
    ///
    /// Runs are a list, or one motion or Scenario with arrays of parameters; each parameter has one
    /// value for all runs, or an array with one per run. The result of a run is bitwise independent
    /// of the other runs; :meth:`simulate` gives the same within rounding.
    ///
    /// Parameters
    /// ----------
    /// runs : sequence of Motion, Scenario, str or os.PathLike, or one of them, optional
    ///     Default: the robot's own motion.
    /// stiffness, damping : float or array_like, shape (m,), default 1
    ///     Factors on all stiffnesses and on all damping.
    /// time_scale : float or array_like, shape (m,), default 1
    ///     Factor on the duration of each motion: 1.25 is slower, 0.8 faster.
    /// payload_mass : float or array_like, shape (m,), optional
    ///     Mass at the tool from the start, replacing the robot's own payload (kg); 0 for none.
    /// payload_com : array_like, shape (3,) or (m, 3), optional
    ///     Its centre of mass in the frame of the carrying link (m).
    /// payload_inertia : array_like, shape (3, 3) or (m, 3, 3), optional
    ///     About the centre of mass, link axes (kg m²). Default: a point mass.
    /// step, stepper, stepper_options, ignore_limits
    ///     As for :meth:`simulate`.
    /// samples : bool, default False
    ///     Keep the deflection at every step.
    /// errors : {"raise", "nan"}, default "raise"
    ///     For runs that fail: raise, or return NaN and list them in ``failures``.
    ///
    /// Returns
    /// -------
    /// Deflections
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> arm = flexarm.load("reference_arm").flexible()
    /// >>> found = arm.deflections(stiffness=np.linspace(0.8, 1.2, 5), step=5e-3)
    /// >>> found.peak.shape, bool(np.all(np.diff(found.peak) < 0))
    /// ((5,), True)
    #[pyo3(signature = (runs=None, *, stiffness=None, damping=None, time_scale=None, payload_mass=None, payload_com=None,
                        payload_inertia=None, step=None, stepper=None, stepper_options=None, ignore_limits=false,
                        samples=false, errors="raise"))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn deflections(
        &self,
        py: Python<'_>,
        runs: Option<&Bound<'_, PyAny>>,
        stiffness: Option<&Bound<'_, PyAny>>,
        damping: Option<&Bound<'_, PyAny>>,
        time_scale: Option<&Bound<'_, PyAny>>,
        payload_mass: Option<&Bound<'_, PyAny>>,
        payload_com: Option<&Bound<'_, PyAny>>,
        payload_inertia: Option<&Bound<'_, PyAny>>,
        step: Option<f64>,
        stepper: Option<&str>,
        stepper_options: Option<&Bound<'_, PyDict>>,
        ignore_limits: bool,
        samples: bool,
        errors: &str,
    ) -> PyResult<PyDeflections> {
        let raises = word("errors", errors, &[("raise", true), ("nan", false)])?;
        let robot = self.robot.bind(py);
        // Scenarios, one or one per run, and the parameters that vary over them.
        let scenarios = match runs.filter(|runs| !is_one(runs)) {
            Some(runs) => Scenarios::Each(scenarios(robot, runs)?),
            None => Scenarios::One(Box::new(scenario(robot, runs, None, None, None)?)),
        };
        let (mass, com, inertia) = (payload_mass, payload_com, payload_inertia);
        let given = Parameters { stiffness, damping, time_scale, mass, com, inertia };
        let variations = variations(robot, scenarios, &given)?;
        // All runs without the interpreter's lock.
        let options = RunOptions { ignore_limits, ..run_options(step, stepper, stepper_options)? };
        let step_s = options.step_s;
        let arm = self.arm.clone();
        let found = stoppable(py, move |stop| arm.deflections(&variations, &options, samples, stop))?;
        PyDeflections::of(found, raises, step_s)
    }

    /// Static equilibrium under gravity and a wrench at the TCP, drives locked.
    ///
    /// Includes compliance and natural frequencies.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,) or (m, n), optional
    ///     Joints (rad or m), one pose or m poses, which run on all cores. Default:
    ///     :attr:`Robot.start_pose`.
    /// wrench : array_like, shape (3,) or (6,), optional
    ///     Force (N), and moment (N m), on the tool at the TCP, world axes.
    ///
    /// Returns
    /// -------
    /// Statics
    ///     For m poses its arrays have a leading axis of length m.
    #[pyo3(signature = (q=None, wrench=None))]
    fn statics(
        slf: &Bound<'_, Self>,
        q: Option<&Bound<'_, PyAny>>,
        wrench: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyStatics> {
        let (py, own) = (slf.py(), slf.get());
        let F = self::wrench(wrench)?;
        let start = own.arm.robot().start_pose().or_raise()?;
        let given = q.filter(|q| !q.is_none()).map(|q| numbers("q", q, &[(own.n(), "joints")], true)).transpose()?;
        let poses = given.as_ref().map_or(start.as_slice(), |given| given.values());
        if let Some(m) = given.as_ref().and_then(|given| given.rows) {
            let (poses, arm) = (poses.to_vec(), own.arm.clone());
            let found = stoppable(py, move |stop| arm.operating_points_until(&poses, &as_wrench(F), stop))?;
            return Ok(PyStatics::of_many(found.or_raise()?, m));
        }
        let mut at = own.point()?.lock().unwrap_or_else(PoisonError::into_inner);
        let failed = |error| Error::Step { source: error, partial: false };
        at.solve(poses, &as_wrench(F)).map_err(failed).or_raise()?;
        PyStatics::of_one(slf, &mut at, poses, F)
    }

    /// Creates a workspace for successive poses, for loops with low overhead per call
    /// (OperatingPoint).
    fn operating_point(slf: &Bound<'_, Self>) -> PyResult<PyOperatingPoint> {
        Ok(PyOperatingPoint::new(slf.get().arm.operating_point().or_raise()?, slf.get().n()))
    }

    /// Computes the lowest natural modes at a pose under gravity, drives locked or
    /// servo-controlled.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,), optional
    ///     Joints (rad or m). Default: :attr:`Robot.start_pose`.
    /// count : int, default 10
    /// speeds : array_like, shape (n,), optional
    ///     Constant speeds of the joints (rad/s or m/s): modes about the equilibrium of the turning
    ///     arm, stiffened by centrifugal loads, with Coriolis forces.
    ///
    /// Returns
    /// -------
    /// Modes
    #[pyo3(signature = (q=None, count=10, *, speeds=None))]
    fn modes(
        &self,
        py: Python<'_>,
        q: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole)] count: usize,
        speeds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyModes> {
        let (q, speeds) = (self.pose(q)?, self.of_joints("speeds", speeds)?);
        let table = py.detach(|| self.arm.modes(q.as_deref(), speeds.as_deref(), count)).or_raise()?;
        caveat::issue(py, &table.caveats)?;
        Ok(modes(table))
    }

    /// Computes the frequency response of the TCP at a pose, other drives locked.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,), optional
    ///     Joints (rad or m). Default: :attr:`Robot.start_pose`.
    /// inputs : sequence of str, default ("force-x", "force-y", "force-z")
    ///     ``"force-x"`` to ``"torque-z"`` on the tool, and names of joints.
    /// outputs : sequence of str, default ("x", "y", "z")
    ///     x, y, z, rx, ry, rz of the TCP, world axes.
    /// quantity : {"displacement", "velocity", "acceleration"}, default "displacement"
    /// from_hz, to_hz : float, optional
    ///     Lowest and highest frequency (Hz). Default: derived from the modes.
    /// points : int, default 500
    /// spacing : {"log", "linear"}, default "log"
    ///
    /// Returns
    /// -------
    /// Response
    #[pyo3(signature = (q=None, *, inputs=None, outputs=None, quantity="displacement", from_hz=None, to_hz=None, points=500,
                        spacing="log"))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn response(
        &self,
        py: Python<'_>,
        q: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = texts)] inputs: Option<Vec<String>>,
        #[pyo3(from_py_with = texts)] outputs: Option<Vec<String>>,
        quantity: &str,
        from_hz: Option<f64>,
        to_hz: Option<f64>,
        #[pyo3(from_py_with = whole)] points: usize,
        spacing: &str,
    ) -> PyResult<PyResponse> {
        let request = ResponseArgs { inputs, outputs, quantity, from_hz, to_hz, points, spacing }.request()?;
        let q = self.pose(q)?;
        let found = py.detach(|| self.arm.response(q.as_deref(), &request)).or_raise()?;
        caveat::issue(py, &found.caveats)?;
        Ok(response(found, &request))
    }

    /// Linearises about the equilibrium at a pose: mass, damping, stiffness matrices.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,), optional
    ///     Joints (rad or m). Default: :attr:`Robot.start_pose`.
    /// wrench : array_like, shape (3,) or (6,), optional
    ///     Wrench on the tool, world axes (N, N m).
    ///
    /// Returns
    /// -------
    /// Linear
    #[pyo3(signature = (q=None, wrench=None))]
    fn linearise(
        &self,
        py: Python<'_>,
        q: Option<&Bound<'_, PyAny>>,
        wrench: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyLinear> {
        let (q, F) = (self.pose(q)?, self::wrench(wrench)?);
        Ok(linear(&py.detach(|| self.arm.linearise(q.as_deref(), F)).or_raise()?))
    }

    /// Creates a live arm at rest at a pose, which is commanded while it moves.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,), optional
    ///     Joints (rad or m). Default: :attr:`Robot.start_pose`.
    /// period : float, default 1e-3
    ///     Control period (s), a whole number of steps.
    /// step : float, optional
    ///     Time step (s). Default: that of the stepper: 1e-3, for spook and rk4 1e-4.
    /// stepper, stepper_options
    ///     As for :meth:`simulate`.
    /// servos : {"closed", "open"}
    ///     Whether the servos act; open ones leave the motors to the torques of :meth:`Live.step`.
    /// stiffness, damping : float, default 1
    ///     Factors on the stiffness and damping of all links and gearboxes.
    ///
    /// Returns
    /// -------
    /// Live
    #[pyo3(signature = (q=None, *, period=1e-3, step=None, stepper=None, stepper_options=None, servos="closed",
        stiffness=1.0, damping=1.0))]
    #[allow(clippy::too_many_arguments, reason = "keywords in Python")]
    fn live(
        &self,
        q: Option<&Bound<'_, PyAny>>,
        period: f64,
        step: Option<f64>,
        stepper: Option<&str>,
        stepper_options: Option<&Bound<'_, PyDict>>,
        servos: &str,
        stiffness: f64,
        damping: f64,
    ) -> PyResult<PyLive> {
        let options = run_options(step, stepper, stepper_options)?;
        let servos = match servos {
            "closed" => Servos::Closed,
            "open" => Servos::Open,
            other => return Err(PyValueError::new_err(format!("servos = {other:?}: expected \"closed\" or \"open\""))),
        };
        let own = LiveOptions { servos, stiffness, damping, ..LiveOptions::default() };
        let live = self.arm.live_with(self.pose(q)?.as_deref(), period, &options, &own).or_raise()?;
        Ok(PyLive::new(live, self.n()))
    }

    fn __repr__(&self) -> String {
        let modelling = self.arm.modelling();
        let links = modelling.links.word().unwrap_or("as filed");
        let drives = modelling.drives.word().unwrap_or("as filed");
        let (name, n) = (&self.arm.robot().name, self.n_elastic());
        format!("<Arm {name:?}: links {links}, drives {drives}, {n} elastic coordinates>")
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._show")?.call_method1("arm_html", (slf,))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, own) = (slf.py(), slf.get());
        let modelling = own.arm.modelling();
        let choices = (modelling.links.word(), modelling.drives.word(), modelling.segments, modelling.modes);
        let make = py.import("flexarm._pickle")?.getattr("arm")?;
        Ok((make, (&own.robot, choices)).into_pyobject(py)?.into_any())
    }
}

impl PyArm {
    /// Runs a simulation that signals, an observer and a progress function can stop.
    fn watched(
        &self,
        py: Python<'_>,
        scenario: &Scenario,
        options: &RunOptions,
        outputs: Option<&Outputs>,
        observer: Option<Py<PyAny>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<flexarm::Run> {
        // Progress and observer call Python from the run; what they raise is kept and stops it.
        let watch = Mutex::new(Watch::new(progress));
        let locked = || watch.lock().unwrap_or_else(PoisonError::into_inner);
        let mut report = |done: f64, total: f64| locked().poll(done, total);
        let mut show = observer.map(|observer| {
            let locked = &locked;
            move |sample: &flexarm::recordings::Sample| {
                let shown =
                    Python::attach(|py| observer.call1(py, (PySample::new(sample),))?.extract::<Option<bool>>(py));
                match shown {
                    Ok(Some(false)) => std::ops::ControlFlow::Break(()),
                    Ok(_) => std::ops::ControlFlow::Continue(()),
                    Err(error) => locked().keep(Err(error)),
                }
            }
        });
        let result = py.detach(|| {
            let show = show
                .as_mut()
                .map(|show| show as &mut dyn FnMut(&flexarm::recordings::Sample) -> std::ops::ControlFlow<()>);
            let request = RunRequest { outputs, observer: show, progress: Some(&mut report), ..RunRequest::default() };
            self.arm.simulate_with(scenario, options, request)
        });
        drop(show);
        // An exception of a callback comes before the error of the run that it stopped.
        let mut watch = watch.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(raised) = watch.raised.take() {
            return Err(raised);
        }
        let run = result.or_raise()?;
        watch.done(run.summary.duration_s)?;
        Ok(run)
    }
}
