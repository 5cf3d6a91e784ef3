//! Motions: joint positions over time.
//!
//! A `Motion` is bound to a robot, or made of arrays of time (s) and joint positions (rad or m) and
//! bound when it is used. Not here: loads and payloads (`scenario.rs`).

use std::path::PathBuf;

use flexarm::motions::{MotionOptions, Trajectory};
use flexarm::{Motion, Robot};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{array, table};
use crate::caveat;
use crate::failure::OrRaise;
use crate::robot::PyRobot;
use crate::values::path;

/// Joint positions as a function of time.
///
/// ``Motion(t, q)`` interpolates samples by a spline; :meth:`Robot.motion` reads files. A motion of
/// samples is not bound to a robot: its limits are checked by the robot that runs it.
///
/// Parameters
/// ----------
/// t : array_like, shape (n,)
///     Times (s), increasing; the first becomes 0.
/// q : array_like, shape (n, joints)
///     Positions of all actuated joints, in the order of :attr:`Robot.joints` (rad or m).
/// name : str, default "samples"
///     Name for logs and messages.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> t = np.linspace(0.0, 1.0, 51)
/// >>> q = np.outer(0.1 * (1 - np.cos(np.pi * t)), np.ones(6))
/// >>> motion = flexarm.Motion(t, q)
/// >>> motion.duration
/// 1.0
#[pyclass(frozen, name = "Motion", module = "flexarm")]
pub(crate) struct PyMotion {
    kind: Kind,
}

enum Kind {
    /// Samples not bound to a robot: times, rows of positions, numbers per row.
    Samples { name: String, t: Vec<f64>, q: Vec<f64>, width: usize },
    /// A motion bound to a robot, and its source for pickling: what was read, or else its curves.
    Bound { motion: Box<Motion>, robot: Py<PyRobot>, again: Option<Py<PyAny>> },
}

/// Options for reading.
pub(crate) struct MotionOptionsArgs {
    pub(crate) topic: Option<String>,
    pub(crate) columns: Option<String>,
    pub(crate) round_corners: Option<f64>,
}

/// Reads a motion for a robot.
pub(crate) fn load_motion(
    robot: &Bound<'_, PyRobot>,
    given: Option<&Bound<'_, PyAny>>,
    args: MotionOptionsArgs,
) -> PyResult<PyMotion> {
    let py = robot.py();
    let own = robot.get().robot.default_trajectory.clone();
    let file = match (given, own) {
        (Some(given), _) => flexarm_cli::shipped_motion(&path("motion", given)?),
        (None, Some(own)) => own,
        (None, None) => return Err(PyValueError::new_err("the robot has no motion of its own: give one")),
    };
    let columns = args.columns.as_deref().map(str::parse).transpose();
    let columns = columns.map_err(|error| PyValueError::new_err(format!("columns: {error}")))?;
    let options = MotionOptions { topic: args.topic.clone(), columns };
    let loaded = robot.get().robot.clone();
    let corners = args.round_corners;
    let motion = py.detach(|| -> Result<Motion, flexarm::Error> {
        let motion = Motion::load_with(&file, &loaded, &options)?;
        match corners {
            Some(seconds) => motion.with_rounded_corners(seconds, &*loaded.rigid_model()?),
            None => Ok(motion),
        }
    });
    let file = std::path::absolute(&file).unwrap_or(file);
    let again = (robot, file, args.topic, args.columns, corners).into_pyobject(py)?.into_any().unbind();
    let motion = Box::new(motion.or_raise()?);
    Ok(PyMotion { kind: Kind::Bound { motion, robot: robot.clone().unbind(), again: Some(again) } })
}

impl PyMotion {
    /// Wraps a motion made for a robot.
    pub(crate) fn made(motion: Motion, robot: &Bound<'_, PyRobot>) -> Self {
        Self { kind: Kind::Bound { motion: Box::new(motion), robot: robot.clone().unbind(), again: None } }
    }

    /// Returns the motion for a robot.
    pub(crate) fn on(&self, robot: &Robot) -> PyResult<Motion> {
        match &self.kind {
            Kind::Samples { name, t, q, width } => {
                let n = robot.rigid_model().or_raise()?.n_actuated();
                if *width != n {
                    let found = format!("the motion {name:?} has {width} joints, the robot {n}");
                    return Err(PyValueError::new_err(format!("{found}: expected q of shape ({}, {n})", t.len())));
                }
                let motion = Motion::from_samples(t, q, robot).or_raise()?;
                Ok(Motion { name: name.clone(), ..motion })
            }
            Kind::Bound { motion, .. } => {
                let model = robot.rigid_model().or_raise()?;
                let actuated = &model.coordinates()[..model.n_actuated()];
                let same = actuated.iter().map(|c| &c.joint).eq(motion.trajectory.joints());
                match same {
                    true => Ok((**motion).clone()),
                    false => Motion::along((*motion.trajectory).clone(), &motion.name, robot).or_raise(),
                }
            }
        }
    }

    fn robot<'a, 'py>(&'a self, py: Python<'py>) -> PyResult<&'a Bound<'py, PyRobot>> {
        match &self.kind {
            Kind::Bound { robot, .. } => Ok(robot.bind(py)),
            Kind::Samples { .. } => {
                Err(PyValueError::new_err("a motion of samples knows no robot yet: use motion.on(robot)"))
            }
        }
    }

    fn bound(&self, what: &str) -> PyResult<&Motion> {
        match &self.kind {
            Kind::Bound { motion, .. } => Ok(motion),
            Kind::Samples { .. } => {
                let message = format!("{what}: a motion of samples knows no robot yet: use motion.on(robot)");
                Err(PyValueError::new_err(message))
            }
        }
    }
}

#[pymethods]
impl PyMotion {
    #[new]
    #[pyo3(signature = (t, q, *, name="samples"))]
    fn new(t: &Bound<'_, PyAny>, q: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let t = table("t", t, 0, "times")?;
        let width = q.getattr("shape").and_then(|shape| shape.get_item(1)).and_then(|n| n.extract::<usize>());
        let width = width.or_else(|_| q.get_item(0).and_then(|row| row.len())).map_err(|_| {
            PyValueError::new_err("q has no rows: expected shape (n, joints), a row of joint positions for each time")
        })?;
        let q = table("q", q, width.max(1), "joints")?;
        if q.len() != t.len() {
            let (rows, times) = (q.len(), t.len());
            return Err(PyValueError::new_err(format!("q has {rows} rows, t has {times} times: expected the same")));
        }
        if let Some(k) = t.values().windows(2).position(|pair| pair[1] <= pair[0]) {
            let (first, second) = (t.values()[k], t.values()[k + 1]);
            let message = format!("t[{}] is {second} after {first}: expected times that increase", k + 1);
            return Err(PyValueError::new_err(message));
        }
        if t.len() < 2 {
            return Err(PyValueError::new_err(format!("t has {} times: expected two at least", t.len())));
        }
        let (t, q) = (t.values().to_vec(), q.values().to_vec());
        Ok(Self { kind: Kind::Samples { name: name.to_owned(), t, q, width } })
    }

    /// Returns the motion checked against a robot (Motion).
    #[pyo3(name = "on")]
    fn on_robot(slf: &Bound<'_, Self>, robot: &Bound<'_, PyRobot>) -> PyResult<Self> {
        let motion = slf.get().on(&robot.get().robot)?;
        let again = (robot, slf).into_pyobject(slf.py())?.into_any().unbind();
        Ok(Self { kind: Kind::Bound { motion: Box::new(motion), robot: robot.clone().unbind(), again: Some(again) } })
    }

    /// Returns the motion with its duration, including rests, multiplied; needs a robot.
    ///
    /// Parameters
    /// ----------
    /// factor : float
    ///     1.25 is slower, 0.8 faster.
    ///
    /// Returns
    /// -------
    /// Motion
    ///
    /// Examples
    /// --------
    /// >>> motion = flexarm.load("kr210").motion("point_to_point")
    /// >>> motion.scaled(2.0).duration == 2 * motion.duration
    /// True
    fn scaled(&self, py: Python<'_>, factor: f64) -> PyResult<Self> {
        let (motion, robot) = (self.bound("scaled")?.clone(), self.robot(py)?);
        let model = robot.get().robot.rigid_model().or_raise()?;
        Ok(Self::made(motion.scaled(factor, &model).or_raise()?, robot))
    }

    /// Name for logs.
    #[getter]
    fn name(&self) -> &str {
        match &self.kind {
            Kind::Samples { name, .. } => name,
            Kind::Bound { motion, .. } => &motion.name,
        }
    }

    /// Duration (s).
    #[getter]
    fn duration(&self) -> f64 {
        match &self.kind {
            Kind::Samples { t, .. } => t.last().unwrap_or(&0.0) - t.first().unwrap_or(&0.0),
            Kind::Bound { motion, .. } => motion.trajectory.duration(),
        }
    }

    /// Joints that it moves, in column order; needs a robot.
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.bound("joints")?.trajectory.joints())
    }

    /// Start and end of each move (s), (m, 2); needs a robot.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let moves = self.bound("moves")?.trajectory.moves();
        array(py, [moves.len(), 2], moves.iter().flat_map(|m| [m.start, m.end]).collect())
    }

    /// Violated limits of the robot, as sentences; needs a robot.
    #[getter]
    fn violations(&self) -> PyResult<Vec<String>> {
        Ok(self.bound("violations")?.violations.iter().map(|v| v.warning().message).collect())
    }

    /// Doubts about the motion (list of flexarm.Caveat); needs a robot.
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyList>> {
        caveat::list(py, &self.bound("caveats")?.caveats())
    }

    /// Positions, velocities and accelerations at times, each (m, joints); needs a robot.
    ///
    /// Parameters
    /// ----------
    /// t : array_like, shape (m,)
    ///     Times (s).
    ///
    /// Returns
    /// -------
    /// q, v, a : ndarray, shape (m, joints)
    fn sample<'py>(
        &self,
        t: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let trajectory = &self.bound("sample")?.trajectory;
        let times = table("t", t, 0, "times")?;
        let (m, n) = (times.len(), trajectory.joints().len());
        let [mut q, mut v, mut a] = [(); 3].map(|()| vec![0.0; m * n]);
        for (k, t) in times.values().iter().enumerate() {
            let row = k * n..(k + 1) * n;
            trajectory.sample(*t, &mut q[row.clone()], &mut v[row.clone()], &mut a[row]);
        }
        let py = t.py();
        Ok((array(py, [m, n], q)?, array(py, [m, n], v)?, array(py, [m, n], a)?))
    }

    fn __repr__(&self) -> String {
        format!("<Motion {:?}: {} s>", self.name(), self.duration())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let module = py.import("flexarm._pickle")?;
        match &slf.get().kind {
            Kind::Samples { name, t, q, width } => {
                let t_array = array(py, [t.len()], t.clone())?;
                let q_array = array(py, [t.len(), *width], q.clone())?;
                let make = module.getattr("motion_of_samples")?;
                Ok((make, (t_array, q_array, name)).into_pyobject(py)?.into_any())
            }
            Kind::Bound { again: Some(again), .. } => {
                Ok((module.getattr("motion_again")?, again.bind(py)).into_pyobject(py)?.into_any())
            }
            Kind::Bound { motion, robot, again: None } => {
                let make = module.getattr("motion_of_pieces")?;
                let curves = pieces(py, &motion.trajectory)?;
                let duration = motion.trajectory.duration();
                Ok((make, (robot, &motion.name, duration, curves)).into_pyobject(py)?.into_any())
            }
        }
    }
}

/// A joint with its knots and polynomial pieces, as arrays.
type Curve<'py> = (String, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// Curves of a trajectory: name, knots, and a row of seven numbers per piece, for each joint.
fn pieces<'py>(py: Python<'py>, trajectory: &Trajectory) -> PyResult<Vec<Curve<'py>>> {
    let mut curves = Vec::new();
    for (k, joint) in trajectory.joints().iter().enumerate() {
        let Some((knots, rows)) = trajectory.pieces(k) else { continue };
        let values = array(py, [rows.len(), 7], rows.concat())?;
        curves.push((joint.clone(), array(py, [knots.len()], knots.to_vec())?, values));
    }
    Ok(curves)
}

/// Creates a motion from such curves; for `flexarm._pickle`.
#[pyfunction]
#[pyo3(name = "_motion_of_pieces")]
pub(crate) fn motion_of_pieces(
    robot: &Bound<'_, PyRobot>,
    name: &str,
    duration: f64,
    curves: Vec<Curve<'_>>,
) -> PyResult<PyMotion> {
    let curve = |(joint, knots, rows): Curve<'_>| {
        let rows = table("pieces", &rows, 7, "numbers")?;
        let rows = rows.values().chunks_exact(7).map(|row| std::array::from_fn(|k| row[k])).collect();
        Ok((joint, table("knots", &knots, 0, "times")?.values().to_vec(), rows))
    };
    let curves = curves.into_iter().map(curve).collect::<PyResult<Vec<_>>>()?;
    let trajectory = Trajectory::of_pieces(curves, duration).map_err(flexarm::Error::from).or_raise()?;
    let motion = Motion::along(trajectory, name, &robot.get().robot).or_raise()?;
    Ok(PyMotion::made(Motion { name: name.to_owned(), ..motion }, robot))
}

/// Returns the path of a motion: a shipped name, or a file.
pub(crate) fn motion_file(given: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    Ok(flexarm_cli::shipped_motion(&path("motion", given)?))
}
