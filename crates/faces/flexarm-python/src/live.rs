//! An arm that is commanded while it moves.
//!
//! `Live.step` holds a command for one period; the properties are those at its end: rad or m, N m
//! or N; poses 4 x 4 in the world. Not here: whole runs (`arm.rs`).

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use flexarm::live::{Command, Live, LiveState};
use pyo3::prelude::*;

use crate::arrays::{array, numbers};
use crate::failure::OrRaise;
use crate::operating_point::homogeneous;
use crate::values::{as_wrench, wrench};

/// An arm that is commanded while it moves, control period by control period. Made by :meth:`Arm.live`.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> live = flexarm.load("reference_arm").flexible(drives="servo").live()
/// >>> for k in range(3):
/// ...     live.step(np.zeros(6))
/// >>> round(live.time, 6)
/// 0.003
#[pyclass(frozen, name = "Live", module = "flexarm")]
pub(crate) struct PyLive {
    live: Mutex<Live>,
    n: usize,
}

impl PyLive {
    pub(crate) fn new(live: Live, n: usize) -> Self {
        Self { live: Mutex::new(live), n }
    }

    fn lock(&self) -> MutexGuard<'_, Live> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn vector<'py>(py: Python<'py>, values: Vec<f64>) -> PyResult<Bound<'py, PyAny>> {
        array(py, [values.len()], values)
    }
}

/// State of a :class:`Live`. Created by :meth:`Live.state`.
#[pyclass(frozen, name = "LiveState", module = "flexarm")]
pub(crate) struct PyLiveState(Mutex<LiveState>);

#[pymethods]
impl PyLiveState {
    fn __reduce__(&self) -> PyResult<()> {
        Err(pyo3::exceptions::PyTypeError::new_err("a LiveState belongs to its Live and cannot be pickled"))
    }
}

#[pymethods]
impl PyLive {
    /// Advances one control period, at whose end the joint targets are ``q``.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Targets (rad or m).
    /// velocity : array_like, shape (n,), optional
    ///     Target velocities. Default: those of the parabola through the last three targets; the
    ///     feed-forward of servos is then one period late.
    /// wrench : array_like, shape (3,) or (6,), optional
    ///     Wrench on the TCP during the period, world axes (N, N m).
    /// torque : array_like, shape (n,), optional
    ///     Torques or forces of the motors during the period, at the joints (N m or N), added to those
    ///     of the servos; alone with ``servos="open"``. Default: zero.
    /// period : float, optional
    ///     Length of this period (s), a whole number of steps. Default: :attr:`period`.
    #[pyo3(signature = (q, velocity=None, wrench=None, torque=None, period=None))]
    fn step(
        &self,
        q: &Bound<'_, PyAny>,
        velocity: Option<&Bound<'_, PyAny>>,
        wrench: Option<&Bound<'_, PyAny>>,
        torque: Option<&Bound<'_, PyAny>>,
        period: Option<f64>,
    ) -> PyResult<()> {
        let q = numbers("q", q, &[(self.n, "joints")], false)?;
        let of_joints = |name, values: Option<_>| {
            values.map(|values| numbers(name, values, &[(self.n, "joints")], false)).transpose()
        };
        let (velocity, torque) = (of_joints("velocity", velocity)?, of_joints("torque", torque)?);
        let wrench = as_wrench(self::wrench(wrench)?);
        let (qdot, torque) = (velocity.as_ref().map(|v| v.values()), torque.as_ref().map(|v| v.values()));
        let mut live = self.lock();
        let period = period.unwrap_or(live.period_s());
        live.advance(period, &Command { q: q.values(), qdot, torque, wrench }).or_raise()
    }

    /// Picks up or puts down the payload of the robot file; positions and velocities stay.
    ///
    /// Parameters
    /// ----------
    /// carried : bool
    ///     Whether the arm carries it from now on.
    fn set_payload(&self, carried: bool) -> PyResult<()> {
        self.lock().set_payload(carried).or_raise()
    }

    /// Returns a copy of the state, for :meth:`restore`.
    fn state(&self) -> PyResult<PyLiveState> {
        Ok(PyLiveState(Mutex::new(self.lock().state().or_raise()?)))
    }

    /// Returns to a state of this arm; what follows has the same bits as then.
    fn restore(&self, state: &PyLiveState) -> PyResult<()> {
        self.lock().restore(&state.0.lock().unwrap_or_else(PoisonError::into_inner)).or_raise()
    }

    /// Resets to rest at a pose at time 0, with or without its payload as it is.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,), optional
    ///     Joints (rad or m). Default: :attr:`Robot.start_pose`.
    #[pyo3(signature = (q=None))]
    fn reset(&self, q: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let q = q.map(|q| numbers("q", q, &[(self.n, "joints")], false)).transpose()?;
        self.lock().reset(q.as_ref().map(|q| q.values())).or_raise()
    }

    /// Time (s).
    #[getter]
    fn time(&self) -> f64 {
        self.lock().time_s()
    }

    /// Length of a control period (s).
    #[getter]
    fn period(&self) -> f64 {
        self.lock().period_s()
    }

    /// Actual joint positions (rad or m), (n,); with servos they lag behind their targets.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().position().to_vec())
    }

    /// Actual joint velocities, (n,).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().velocity().to_vec())
    }

    /// Joint positions behind the gearboxes (rad or m), (n,), as encoders on the links read them.
    #[getter]
    fn link_position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().link_position())
    }

    /// Joint velocities behind the gearboxes, (n,).
    #[getter]
    fn link_velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().link_velocity())
    }

    /// Drive forces (N m or N), (n,).
    #[getter]
    fn effort<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().effort().to_vec())
    }

    /// Elastic coordinates (m, rad).
    #[getter]
    fn deflection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().deflection().to_vec())
    }

    /// TCP pose in the world, (4, 4).
    #[getter]
    fn tcp_pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        homogeneous(py, &self.lock().tcp_pose())
    }

    /// Acceleration of the TCP, world axes (m/s²), (3,); NaN with spook.
    #[getter]
    fn tcp_acceleration<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::vector(py, self.lock().tcp_acceleration().as_slice().to_vec())
    }

    /// Strain (m/m) or stress (Pa) of the gauges and stress points of the robot file, by the names of
    /// their channels; NaN with spook.
    #[getter]
    fn gauges(&self) -> BTreeMap<String, f64> {
        let mut live = self.lock();
        live.gauge_channels().into_iter().zip(live.gauges()).collect()
    }

    /// TCP pose of a rigid arm with its joints at the last targets, (4, 4).
    #[getter]
    fn target_pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        homogeneous(py, &self.lock().target_pose())
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(pyo3::exceptions::PyTypeError::new_err(
            "a Live is a simulation that is going on and cannot be pickled: pickle its arm, and call arm.live(...) there",
        ))
    }

    fn __repr__(&self) -> String {
        format!("<Live at {} s>", self.lock().time_s())
    }
}
