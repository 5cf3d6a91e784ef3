//! Rigid-body algorithms on arrays, for users with their own dynamics.
//!
//! Coordinates are actuated joints, then elastic ones; a leading axis is a batch. Wrenches, twists
//! and Jacobians: world axes at the origin of the frame, linear first. Not here: the algorithms
//! (`flexarm-kinematics`).

use std::sync::Arc;

use flexarm::Error;
use flexarm::poses::Recursions;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Numbers, answer, numbers};
use crate::failure::OrRaise;
use crate::values::word;

/// Number of rows from which on the GIL is released.
const MANY: usize = 64;

/// A tree of rigid bodies with its algorithms. Springs, dampers and friction are not included.
///
/// Six-vectors are linear first, world axes at the origin of the frame. Every argument takes a row
/// of n numbers, or m rows, which are distributed over all cores. Names as in Pinocchio: ``rnea``,
/// ``crba``, ``aba``, ``computeFrameJacobian`` with LOCAL_WORLD_ALIGNED.
///
/// Examples
/// --------
/// >>> model = flexarm.load("kr210").model
/// >>> model.nv
/// 6
/// >>> M = model.crba([0.0, -1.2, 1.5, 0.0, 0.4, 0.0])
/// >>> M.shape
/// (6, 6)
#[pyclass(frozen, name = "Model", module = "flexarm")]
pub(crate) struct PyModel {
    recursions: Arc<Recursions>,
}

impl PyModel {
    pub(crate) fn new(recursions: Recursions) -> Self {
        Self { recursions: Arc::new(recursions) }
    }

    /// Names of the available frames.
    fn frame_names(&self) -> Vec<&str> {
        let named = self.recursions.model().frames().iter().map(|frame| frame.name.as_str());
        named.filter(|name| !name.starts_with("__")).chain(["tcp"]).collect()
    }

    /// Checks that a frame exists.
    fn check_frame(&self, name: &str) -> PyResult<()> {
        let known: Vec<(&str, ())> = self.frame_names().into_iter().map(|name| (name, ())).collect();
        word("frame", name, &known)
    }

    fn input<'py>(&self, name: &str, value: &Bound<'py, PyAny>) -> PyResult<Numbers<'py>> {
        numbers(name, value, &[(self.recursions.model().nv(), "coordinates")], true)
    }

    /// Computes a result of the shape `row` for each row of inputs with equally many rows.
    fn each<'py, const K: usize>(
        &self,
        py: Python<'py>,
        names: [&str; K],
        inputs: [&Bound<'py, PyAny>; K],
        row: &[usize],
        compute: impl Fn(&Recursions, [&[f64]; K], &mut [f64]) -> Result<(), Error> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut found: [Option<Numbers<'py>>; K] = [const { None }; K];
        for k in 0..K {
            found[k] = Some(self.input(names[k], inputs[k])?);
        }
        let Some(first) = found[0].as_ref() else { return Ok(py.None().into_bound(py)) };
        let (rows, m) = (first.rows, first.len());
        for (name, other) in names.iter().zip(found.iter().flatten()) {
            if other.rows != rows {
                let text = |rows: Option<usize>| rows.map_or("one row".to_owned(), |m| format!("{m} rows"));
                let (own, first) = (text(other.rows), text(rows));
                let message = format!("{name} has {own}, {} has {first}: expected the same", names[0]);
                return Err(pyo3::exceptions::PyValueError::new_err(message));
            }
        }
        let mut out = vec![0.0; m * row.iter().product::<usize>()];
        let values: [&[f64]; K] = std::array::from_fn(|k| found[k].as_ref().map_or(&[][..], Numbers::values));
        if m < MANY {
            compute(&self.recursions, values, &mut out).or_raise()?;
        } else {
            // Other threads may write into the arrays while the GIL is released.
            let copies = values.map(<[f64]>::to_vec);
            let copies: [&[f64]; K] = std::array::from_fn(|k| copies[k].as_slice());
            py.detach(|| compute(&self.recursions, copies, &mut out)).or_raise()?;
        }
        answer(py, rows, row, out)
    }
}

#[pymethods]
impl PyModel {
    /// Number of coordinates.
    #[getter]
    fn nv(&self) -> usize {
        self.recursions.model().nv()
    }

    /// Number of actuated coordinates; elastic ones come after them.
    #[getter]
    fn n_actuated(&self) -> usize {
        self.recursions.model().n_actuated()
    }

    /// Name of the joint of each coordinate (tuple of str).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.recursions.model().coordinates().iter().map(|c| c.joint.clone()))
    }

    /// Names of frames: links, and ``"tcp"`` (tuple of str).
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.frame_names())
    }

    /// Mass of all moving bodies (kg).
    #[getter]
    fn moving_mass(&self) -> f64 {
        self.recursions.model().moving_mass()
    }

    /// Inverse dynamics: forces τ = M(q) a + bias(q, v), (n,) or (m, n) (N m or N).
    fn rnea<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let row = [self.nv()];
        self.each(q.py(), ["q", "v", "a"], [q, v, a], &row, |r, [q, v, a], tau| r.inverse_dynamics(q, v, a, tau))
    }

    /// Forces at zero acceleration: gravity, balancers, centrifugal and Coriolis forces, (n,) or (m, n).
    fn nonlinear_effects<'py>(&self, q: &Bound<'py, PyAny>, v: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let row = [self.nv()];
        self.each(q.py(), ["q", "v"], [q, v], &row, |r, [q, v], tau| r.nonlinear_effects(q, v, tau))
    }

    /// Forces that hold the pose against gravity and balancers, (n,) or (m, n).
    fn gravity<'py>(&self, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let row = [self.nv()];
        self.each(q.py(), ["q"], [q], &row, |r, [q], tau| r.gravity_forces(q, tau))
    }

    /// Mass matrix M(q), (n, n) or (m, n, n).
    fn crba<'py>(&self, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let row = [self.nv(), self.nv()];
        self.each(q.py(), ["q"], [q], &row, |r, [q], M| r.mass_matrix(q, M))
    }

    /// Forward dynamics: accelerations for the forces tau, all coordinates free, (n,) or (m, n).
    fn aba<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let row = [self.nv()];
        let names = ["q", "v", "tau"];
        self.each(q.py(), names, [q, v, tau], &row, |r, [q, v, tau], a| r.forward_dynamics(q, v, tau, a))
    }

    /// Frame Jacobian, world axes at its origin, linear rows first, (6, n) or (m, 6, n).
    #[pyo3(signature = (q, frame="tcp"))]
    fn jacobian<'py>(&self, q: &Bound<'py, PyAny>, frame: &str) -> PyResult<Bound<'py, PyAny>> {
        self.check_frame(frame)?;
        let frame = self.recursions.frame(frame).or_raise()?;
        let row = [6, self.nv()];
        self.each(q.py(), ["q"], [q], &row, |r, [q], J| r.jacobian(q, &frame, J))
    }

    /// Forward kinematics: frame pose in the world as homogeneous matrix, (4, 4) or (m, 4, 4).
    #[pyo3(signature = (q, frame="tcp"))]
    fn fk<'py>(&self, q: &Bound<'py, PyAny>, frame: &str) -> PyResult<Bound<'py, PyAny>> {
        self.check_frame(frame)?;
        let frame = self.recursions.frame(frame).or_raise()?;
        self.each(q.py(), ["q"], [q], &[4, 4], |r, [q], X| r.pose(q, &frame, X))
    }

    /// Centre of mass in the world, (3,) or (m, 3) (m).
    fn center_of_mass<'py>(&self, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.each(q.py(), ["q"], [q], &[3], |r, [q], com| r.center_of_mass(q, com))
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(pyo3::exceptions::PyTypeError::new_err(
            "a Model cannot be pickled: pickle the robot or the arm, and take .model there",
        ))
    }

    fn __repr__(&self) -> String {
        let model = self.recursions.model();
        format!("<Model: {} coordinates, {} of them with a motor>", model.nv(), model.n_actuated())
    }
}
