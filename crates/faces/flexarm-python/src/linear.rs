//! The linear system about an equilibrium.
//!
//! `Linear` has the matrices of its equation of motion, row-major; the equation stands at the
//! class. Not here: linearisation (`flexarm::poses`).

use flexarm::poses::Linear;
use pyo3::prelude::*;

use crate::arrays::view;
use crate::failure::raised;
use crate::parts::{Parts, Pickled};

/// Linear system about an equilibrium, with k free coordinates and n joints.
///
/// ``M ẍ + D ẋ + K x = Jᵀ F - M_a q̈ - D_a q̇ - K_a q`` with the free coordinates x, the commands q of
/// the joints, and the wrench F on the TCP. Free coordinates are joints driven by torque, then elastic
/// coordinates. World axes at the TCP, linear first. Created by :meth:`Arm.linearise`.
///
/// Examples
/// --------
/// >>> at = flexarm.load("kr210").flexible().linearise([0.0, -1.2, 1.5, 0.0, 0.4, 0.0])
/// >>> at.M.shape == at.K.shape == at.D.shape
/// True
/// >>> at.J.shape[0]
/// 6
#[pyclass(frozen, name = "Linear", module = "flexarm")]
pub(crate) struct PyLinear {
    M: Matrix,
    D: Matrix,
    K: Matrix,
    J: Matrix,
    M_a: Matrix,
    D_a: Matrix,
    K_a: Matrix,
    J_a: Matrix,
    equilibrium: Vec<f64>,
    holding: Vec<f64>,
    driven: usize,
    elements: Vec<(String, usize, usize)>,
    /// Reason if there is none, when a direction has no stiffness.
    compliance: Result<Matrix, String>,
}

/// A matrix, row-major.
struct Matrix {
    shape: [usize; 2],
    values: Vec<f64>,
}

impl Matrix {
    /// Converts from column-major numbers.
    fn of((rows, columns): (usize, usize), by_columns: &[f64]) -> Self {
        let values = (0..rows * columns).map(|k| by_columns[(k % columns) * rows + k / columns]).collect();
        Self { shape: [rows, columns], values }
    }

    fn put(&self, name: &str, parts: &Parts<'_>) -> PyResult<()> {
        parts.put(&format!("{name}_shape"), self.shape.to_vec())?;
        parts.put_numbers(name, &self.values)
    }

    fn out_of(parts: &Parts<'_>, name: &str) -> PyResult<Self> {
        let shape: [usize; 2] = parts.get(&format!("{name}_shape"))?;
        Ok(Self { shape, values: parts.shaped(name, &shape)? })
    }
}

pub(crate) fn linear(linear: &Linear) -> PyLinear {
    let compliance =
        linear.compliance().map(|C| Matrix::of(C.shape(), C.as_slice())).map_err(|error| error.to_string());
    PyLinear {
        M: Matrix::of(linear.M.shape(), linear.M.as_slice()),
        D: Matrix::of(linear.D.shape(), linear.D.as_slice()),
        K: Matrix::of(linear.K.shape(), linear.K.as_slice()),
        J: Matrix::of(linear.J.shape(), linear.J.as_slice()),
        M_a: Matrix::of(linear.M_a.shape(), linear.M_a.as_slice()),
        D_a: Matrix::of(linear.D_a.shape(), linear.D_a.as_slice()),
        K_a: Matrix::of(linear.K_a.shape(), linear.K_a.as_slice()),
        J_a: Matrix::of(linear.J_a.shape(), linear.J_a.as_slice()),
        equilibrium: linear.equilibrium.as_slice().to_vec(),
        holding: linear.holding.as_slice().to_vec(),
        driven: linear.driven,
        elements: linear.elements.iter().map(|(name, range)| (name.clone(), range.start, range.end)).collect(),
        compliance,
    }
}

impl PyLinear {
    fn matrix<'py>(slf: &Bound<'py, Self>, matrix: fn(&Self) -> &Matrix) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((matrix(own).shape.to_vec(), &matrix(own).values)))
    }
}

#[pymethods]
#[expect(non_snake_case, reason = "the names of the matrices")]
impl PyLinear {
    /// Returns the matrices (A, B, C, D) of the state space, for ``scipy.signal`` and ``control``.
    ///
    /// State: x, q, ẋ, q̇. Inputs: accelerations q̈ of the commands (n), wrench on the TCP (6). Outputs:
    /// displacement of the TCP (6).
    fn state_space<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._linear")?.call_method1("state_space", (slf,))
    }

    /// Mass matrix, (k, k).
    #[getter]
    fn M<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.M)
    }

    /// Damping matrix, (k, k).
    #[getter]
    fn D<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.D)
    }

    /// Tangent stiffness: springs, and changes of gravity forces and of the wrench, (k, k).
    #[getter]
    fn K<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.K)
    }

    /// TCP twist per rate of the free coordinates (Jacobian), (6, k).
    #[getter]
    fn J<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.J)
    }

    /// Forces against the free coordinates per command acceleration, (k, n).
    #[getter]
    fn M_a<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.M_a)
    }

    /// Forces on the free coordinates per command velocity, (k, n).
    #[getter]
    fn D_a<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.D_a)
    }

    /// Forces on the free coordinates per command, (k, n).
    #[getter]
    fn K_a<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.K_a)
    }

    /// TCP twist per command velocity with the structure rigid, (6, n).
    #[getter]
    fn J_a<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(slf, |own| &own.J_a)
    }

    /// Free coordinates at the equilibrium, (k,).
    #[getter]
    fn equilibrium<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.equilibrium.len()], &own.equilibrium)))
    }

    /// Drive forces that hold the pose (N m or N), (n,).
    #[getter]
    fn holding<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.holding.len()], &own.holding)))
    }

    /// Number of free coordinates that are joints driven by torque; they come first.
    #[getter]
    fn driven(&self) -> usize {
        self.driven
    }

    /// Name, first and one-past-last free coordinate of each element (list of (str, int, int)).
    #[getter]
    fn elements(&self) -> Vec<(String, usize, usize)> {
        self.elements.clone()
    }

    /// Compliance of the TCP with the motors held, (6, 6).
    #[getter]
    fn compliance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| {
            let compliance = own.compliance.as_ref();
            let compliance = compliance.map_err(|why| raised(slf.py(), "StepError", why.clone()))?;
            Ok((compliance.shape.to_vec(), &compliance.values))
        })
    }

    fn __repr__(&self) -> String {
        format!("<Linear: {} free coordinates, {} commands>", self.M.shape[0], self.M_a.shape[1])
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyLinear {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        self.M.put("M", parts)?;
        self.D.put("D", parts)?;
        self.K.put("K", parts)?;
        self.J.put("J", parts)?;
        self.M_a.put("M_a", parts)?;
        self.D_a.put("D_a", parts)?;
        self.K_a.put("K_a", parts)?;
        self.J_a.put("J_a", parts)?;
        parts.put_numbers("equilibrium", &self.equilibrium)?;
        parts.put_numbers("holding", &self.holding)?;
        parts.put("driven", self.driven)?;
        parts.put("elements", self.elements.clone())?;
        parts.put("no_compliance", self.compliance.as_ref().err().cloned())?;
        self.compliance.as_ref().map_or(Ok(()), |compliance| compliance.put("compliance", parts))
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let compliance = match parts.get::<Option<String>>("no_compliance")? {
            Some(why) => Err(why),
            None => Ok(Matrix::out_of(parts, "compliance")?),
        };
        Ok(Self {
            M: Matrix::out_of(parts, "M")?,
            D: Matrix::out_of(parts, "D")?,
            K: Matrix::out_of(parts, "K")?,
            J: Matrix::out_of(parts, "J")?,
            M_a: Matrix::out_of(parts, "M_a")?,
            D_a: Matrix::out_of(parts, "D_a")?,
            K_a: Matrix::out_of(parts, "K_a")?,
            J_a: Matrix::out_of(parts, "J_a")?,
            equilibrium: parts.numbers("equilibrium")?,
            holding: parts.numbers("holding")?,
            driven: parts.get("driven")?,
            elements: parts.get("elements")?,
            compliance,
        })
    }
}
