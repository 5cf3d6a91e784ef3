//! Scenarios of a run: motion, loads, payloads, initial state.
//!
//! A `Load` is a wrench over time at a frame (N, N m, world axes, force first); a `Payload` is a
//! mass that is attached or released at a time. Not here: runs (`arm.rs`).

use flexarm::motions::AppliedLoad;
use flexarm::{Motion, PayloadChange, Scenario, Wrench};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{numbers, table};
use crate::failure::OrRaise;
use crate::motion::{PyMotion, motion_file};
use crate::robot::PyRobot;
use crate::values::{as_wrench, path, start, wrench};

/// A load on a frame, in world axes.
///
/// Examples
/// --------
/// >>> push = flexarm.Load.during([0.0, 0.0, -200.0], 1.0, 1.5)
#[pyclass(frozen, name = "Load", module = "flexarm")]
pub(crate) struct PyLoad {
    pub(crate) load: AppliedLoad,
    text: String,
    /// For pickling: function and arguments.
    again: (&'static str, Py<PyAny>),
}

#[pymethods]
impl PyLoad {
    /// A constant wrench from start to end (s), zero before and after.
    ///
    /// Parameters
    /// ----------
    /// wrench : array_like, shape (3,) or (6,)
    ///     Force (N), and moment (N m), at the origin of the frame.
    /// start, end : float
    ///     Times (s).
    /// frame : str, default "tcp"
    ///     ``"tcp"`` or a link.
    #[staticmethod]
    #[pyo3(signature = (wrench, start, end, frame="tcp"))]
    fn during(py: Python<'_>, wrench: &Bound<'_, PyAny>, start: f64, end: f64, frame: &str) -> PyResult<Self> {
        let F = self::wrench(Some(wrench))?;
        if !(start.is_finite() && end > start) {
            return Err(PyValueError::new_err(format!("start={start}, end={end}: expected start before end")));
        }
        let load = AppliedLoad::during(frame, as_wrench(F), start, end);
        let again = ("during", (F, start, end, frame).into_pyobject(py)?.into_any().unbind());
        Ok(Self { load, text: format!("{F:?} on {frame:?} from {start} s to {end} s"), again })
    }

    /// A wrench interpolated linearly between samples, zero before and after them.
    ///
    /// Parameters
    /// ----------
    /// t : array_like, shape (n,)
    ///     Times (s), increasing.
    /// wrench : array_like, shape (n, 6)
    ///     Force (N) and moment (N m) at each time.
    /// frame : str, default "tcp"
    ///     ``"tcp"`` or a link.
    #[staticmethod]
    #[pyo3(signature = (t, wrench, frame="tcp"))]
    fn sampled(t: &Bound<'_, PyAny>, wrench: &Bound<'_, PyAny>, frame: &str) -> PyResult<Self> {
        let times = table("t", t, 0, "times")?;
        let F = table("wrench", wrench, 6, "numbers, force then moment")?;
        let rows: Vec<Wrench> =
            F.values().chunks_exact(6).map(|row| as_wrench(std::array::from_fn(|k| row[k]))).collect();
        let load = AppliedLoad::sampled(frame, times.values(), &rows).or_raise()?;
        let text = format!("{} samples on {frame:?}", times.len());
        let again = ("sampled", (t, wrench, frame).into_pyobject(t.py())?.into_any().unbind());
        Ok(Self { load, text, again })
    }

    fn __repr__(&self) -> String {
        format!("<Load {}>", flexarm::settings::written::one_line(&self.text))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (name, arguments) = &slf.get().again;
        Ok((slf.get_type().getattr(*name)?, arguments).into_pyobject(slf.py())?.into_any())
    }
}

/// Payload of a link from an instant on.
///
/// Examples
/// --------
/// >>> taken = flexarm.Payload.attach(2.0, 80.0, [0.0, 0.0, 0.2])
/// >>> put_down = flexarm.Payload.release(6.0)
#[pyclass(frozen, name = "Payload", module = "flexarm")]
pub(crate) struct PyPayload {
    pub(crate) change: PayloadChange,
    again: (&'static str, Py<PyAny>),
}

#[pymethods]
impl PyPayload {
    /// Attaches a payload.
    ///
    /// Parameters
    /// ----------
    /// at : float
    ///     Time (s).
    /// mass : float
    ///     kg.
    /// com : array_like, shape (3,)
    ///     Centre of mass in the carrying link (m).
    /// inertia : array_like, shape (3, 3), optional
    ///     About the centre of mass, link axes (kg m²). Default: a point mass.
    /// link : str, optional
    ///     The carrying link. Default: that of the robot's own payload, else that of the tool.
    #[staticmethod]
    #[pyo3(signature = (at, mass, com, inertia=None, link=None))]
    fn attach(
        at: f64,
        mass: f64,
        com: &Bound<'_, PyAny>,
        inertia: Option<&Bound<'_, PyAny>>,
        link: Option<&str>,
    ) -> PyResult<Self> {
        if !(at.is_finite() && at >= 0.0 && mass.is_finite() && mass >= 0.0) {
            return Err(PyValueError::new_err(format!(
                "at={at}, mass={mass}: expected a time (s) and a mass (kg) of at least 0"
            )));
        }
        let p = numbers("com", com, &[(3, "numbers (m)")], false)?;
        let p = p.values();
        let mut change = PayloadChange::attach(at, mass, [p[0], p[1], p[2]].into());
        if let Some(inertia) = inertia {
            let I = numbers("inertia", inertia, &[(3, "rows"), (3, "columns (kg m²)")], false)?;
            change = change.with_inertia(inertia_matrix("inertia", I.values())?.into());
        }
        if let Some(link) = link {
            change = change.on_link(link);
        }
        let again = (at, mass, com, inertia, link).into_pyobject(com.py())?.into_any().unbind();
        Ok(Self { change, again: ("attach", again) })
    }

    /// Releases the carried payload at this time (s).
    #[staticmethod]
    fn release(py: Python<'_>, at: f64) -> PyResult<Self> {
        let again = (at,).into_pyobject(py)?.into_any().unbind();
        Ok(Self { change: PayloadChange::release(at), again: ("release", again) })
    }

    fn __repr__(&self) -> String {
        let PayloadChange { at_s, carried, .. } = &self.change;
        format!("<Payload: {} kg from {at_s} s on>", carried.mass)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (name, arguments) = &slf.get().again;
        Ok((slf.get_type().getattr(*name)?, arguments).into_pyobject(slf.py())?.into_any())
    }
}

/// Columns of an inertia matrix given by nine numbers.
pub(crate) fn inertia_matrix(name: &str, I: &[f64]) -> PyResult<[[f64; 3]; 3]> {
    let size = I.iter().fold(1e-12, |size: f64, x| size.max(x.abs()));
    if (0..3).any(|i| (0..i).any(|j| (I[3 * i + j] - I[3 * j + i]).abs() > 1e-9 * size)) {
        return Err(PyValueError::new_err(format!("{name} is not symmetric")));
    }
    let column = |k: usize| [I[k], I[3 + k], I[6 + k]];
    Ok([column(0), column(1), column(2)])
}

/// A motion with loads, payloads and start, for batches that differ in more than the motion.
///
/// Parameters
/// ----------
/// motion : Motion or str or os.PathLike, optional
///     Default: the robot's own motion.
/// loads : sequence of Load, or path of a file of loads, optional
/// payloads : sequence of Payload, optional
/// start : {"equilibrium", "undeformed"}, default "equilibrium"
#[pyclass(frozen, name = "Scenario", module = "flexarm")]
pub(crate) struct PyScenario {
    /// Motion of the joints.
    #[pyo3(get)]
    motion: Option<Py<PyAny>>,
    /// Applied loads.
    #[pyo3(get)]
    loads: Option<Py<PyAny>>,
    /// Payload changes.
    #[pyo3(get)]
    payloads: Option<Py<PyAny>>,
    /// Initial state: springs in equilibrium, or undeformed.
    #[pyo3(get)]
    start: Option<String>,
}

#[pymethods]
impl PyScenario {
    #[new]
    #[pyo3(signature = (motion=None, *, loads=None, payloads=None, start=None))]
    fn new(
        motion: Option<Py<PyAny>>,
        loads: Option<Py<PyAny>>,
        payloads: Option<Py<PyAny>>,
        start: Option<String>,
    ) -> PyResult<Self> {
        self::start(start.as_deref())?;
        Ok(Self { motion, loads, payloads, start })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let motion = self.motion.as_ref().map(|motion| motion.bind(py).repr()).transpose()?;
        Ok(format!(
            "<Scenario {}>",
            motion.map_or_else(|| "of the robot's own motion".to_owned(), |text| text.to_string())
        ))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let make = py.import("flexarm._pickle")?.getattr("scenario")?;
        let own = slf.get();
        Ok((make, (&own.motion, &own.loads, &own.payloads, &own.start)).into_pyobject(py)?.into_any())
    }
}

/// Returns the requested motion: one, a file, a pair of times and positions, or the robot's own.
fn motion_of(robot: &Bound<'_, PyRobot>, given: Option<&Bound<'_, PyAny>>) -> PyResult<Motion> {
    let own = &robot.get().robot;
    let read = |file: &std::path::Path| Motion::load(file, own).or_raise();
    let Some(given) = given.filter(|given| !given.is_none()) else {
        let file = own.default_trajectory.as_deref();
        return file.map_or_else(
            || Err(PyValueError::new_err("the robot has no motion of its own: give one")),
            |file| robot.py().detach(|| Motion::load(file, own)).or_raise(),
        );
    };
    if let Ok(motion) = given.cast::<PyMotion>() {
        return motion.get().on(own);
    }
    match motion_file(given) {
        Ok(file) => read(&file),
        Err(_) => {
            let found = given.get_type();
            Err(PyTypeError::new_err(format!(
                "motion is {found}: expected a flexarm.Motion, such as flexarm.Motion(t, q), a path, or None"
            )))
        }
    }
}

/// Creates a scenario from its parts; `given` is a motion of any kind, or a complete Scenario.
pub(crate) fn scenario(
    robot: &Bound<'_, PyRobot>,
    given: Option<&Bound<'_, PyAny>>,
    loads: Option<&Bound<'_, PyAny>>,
    payloads: Option<&Bound<'_, PyAny>>,
    start_word: Option<&str>,
) -> PyResult<Scenario> {
    let py = robot.py();
    // A Scenario has all parts: its own are used.
    if let Some(whole) = given.and_then(|given| given.cast::<PyScenario>().ok()) {
        if loads.is_some() || payloads.is_some() || start_word.is_some() {
            return Err(PyValueError::new_err("loads, payloads and start are parts of the Scenario: give them there"));
        }
        let whole = whole.get();
        let bound = |part: &Option<Py<PyAny>>| part.as_ref().map(|part| part.bind(py).clone());
        let (motion, loads, payloads) = (bound(&whole.motion), bound(&whole.loads), bound(&whole.payloads));
        return scenario(robot, motion.as_ref(), loads.as_ref(), payloads.as_ref(), whole.start.as_deref());
    }
    // Parts given one by one: motion and start, then loads, then payloads.
    let mut made = Scenario::new(motion_of(robot, given)?).with_start(start(start_word)?);
    if let Some(loads) = loads.filter(|loads| !loads.is_none()) {
        if let Ok(file) = path("loads", loads) {
            made = made.with_loads_file(file).or_raise()?;
        } else {
            for load in each(loads, "loads", "a list of flexarm.Load, or a path")? {
                let load = load.cast::<PyLoad>().map_err(|_| {
                    PyTypeError::new_err(format!("loads has a {}: expected flexarm.Load", load.get_type()))
                })?;
                made = made.with_load(load.get().load.clone());
            }
        }
    }
    if let Some(payloads) = payloads.filter(|payloads| !payloads.is_none()) {
        for payload in each(payloads, "payloads", "a list of flexarm.Payload")? {
            let payload = payload.cast::<PyPayload>().map_err(|_| {
                PyTypeError::new_err(format!("payloads has a {}: expected flexarm.Payload", payload.get_type()))
            })?;
            made = made.with_payload(payload.get().change.clone());
        }
    }
    Ok(made)
}

/// Returns the elements of a sequence.
fn each<'py>(sequence: &Bound<'py, PyAny>, argument: &str, expected: &str) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let wrong = || PyTypeError::new_err(format!("{argument} is {}: expected {expected}", sequence.get_type()));
    sequence.try_iter().map_err(|_| wrong())?.collect()
}
