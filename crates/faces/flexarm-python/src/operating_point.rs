//! Successive poses in a workspace.
//!
//! One workspace is solved at pose after pose without allocation. World axes at the TCP, linear
//! first; m, rad, N, N m, Hz.

use std::sync::{Mutex, MutexGuard, PoisonError};

use flexarm::Error;
use flexarm::poses::OperatingPoint;
use pyo3::prelude::*;

use crate::arrays::{array, numbers};
use crate::failure::OrRaise;
use crate::values::{as_wrench, wrench};

/// A workspace for successive poses; created by :meth:`Arm.operating_point`.
///
/// A pose near the last one is cheapest. For many poses at once, call :meth:`Arm.statics` with an
/// array, which uses all cores.
///
/// Examples
/// --------
/// >>> at = flexarm.load("kr210").flexible().operating_point()
/// >>> at.solve([0.0, -1.2, 1.5, 0.0, 0.4, 0.0])
/// >>> hz = at.frequencies()[0]
#[pyclass(frozen, name = "OperatingPoint", module = "flexarm")]
pub(crate) struct PyOperatingPoint {
    point: Mutex<OperatingPoint>,
    n: usize,
}

impl PyOperatingPoint {
    pub(crate) fn new(point: OperatingPoint, n: usize) -> Self {
        Self { point: Mutex::new(point), n }
    }

    fn lock(&self) -> MutexGuard<'_, OperatingPoint> {
        self.point.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Converts a pose to a homogeneous matrix, row-major.
pub(crate) fn homogeneous<'py>(py: Python<'py>, pose: &flexarm::Pose) -> PyResult<Bound<'py, PyAny>> {
    array(py, [4, 4], pose.to_homogeneous().transpose().as_slice().to_vec())
}

#[pymethods]
impl PyOperatingPoint {
    /// Solves for the equilibrium with the joints at ``q``, under gravity and a wrench at the TCP.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joints (rad or m).
    /// wrench : array_like, shape (3,) or (6,), optional
    ///     Wrench on the tool at the TCP, world axes (N, N m).
    #[pyo3(signature = (q, wrench=None))]
    fn solve(&self, q: &Bound<'_, PyAny>, wrench: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let q = numbers("q", q, &[(self.n, "joints")], false)?;
        let F = as_wrench(self::wrench(wrench)?);
        let failed = |source| Error::Step { source, partial: false };
        self.lock().solve(q.values(), &F).map_err(failed).or_raise()
    }

    /// TCP pose in the world, (4, 4).
    fn tcp_pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        homogeneous(py, &self.lock().tcp_pose())
    }

    /// TCP pose of the rigid arm in the world, (4, 4).
    fn rigid_tcp_pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        homogeneous(py, &self.lock().rigid_tcp_pose())
    }

    /// Elastic coordinates (m, rad).
    fn deflections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let values = self.lock().deflections().to_vec();
        array(py, [values.len()], values)
    }

    /// Drive forces that hold the pose (N m or N), (n,).
    fn holding_efforts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let values = self.lock().holding_efforts().to_vec();
        array(py, [values.len()], values)
    }

    /// Compliance of the TCP (m/N, rad/N; m/(N m), rad/(N m)), (6, 6).
    fn compliance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let C = self.lock().compliance().transpose();
        array(py, [6, 6], C.as_slice().to_vec())
    }

    /// Natural frequencies, ascending (Hz), (elastic,).
    fn frequencies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let values = self.lock().frequencies_hz().to_vec();
        array(py, [values.len()], values)
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(pyo3::exceptions::PyTypeError::new_err(
            "an OperatingPoint is a workspace and cannot be pickled: pickle its arm, and call arm.operating_point() there",
        ))
    }

    fn __repr__(&self) -> String {
        let point = self.lock();
        match point.residual().is_nan() {
            true => "<OperatingPoint: nothing is solved yet>".into(),
            false => format!("<OperatingPoint: unbalanced force {:.1e} of the largest>", point.residual()),
        }
    }
}
