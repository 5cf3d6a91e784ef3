//! Answers at a pose: statics, modes, frequency response, the linear structure.

use flexarm::{Linear, ModeTable, OperatingPoint, OperatingPoints, Quantity, Response, ResponseRequest, Spacing};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::arm::{PyArm, only_for_one};
use crate::arrays::{answer, array, view};
use crate::caveat;
use crate::failure::OrRaise;
use crate::values::{plain, word};

/// Static equilibrium at a pose, or at m of them: arrays then have an axis of m in front.
///
/// World axes at the tool, linear first. Poses without an equilibrium have NaN everywhere and stand in :attr:`failures`.
#[pyclass(frozen, name = "Statics", module = "flexarm")]
pub(crate) struct PyStatics {
    rows: Option<usize>,
    tcp: Vec<f64>,
    deflection: Vec<f64>,
    compliance: Vec<f64>,
    frequencies: Vec<f64>,
    elastic: usize,
    failures: Vec<(usize, String)>,
    /// Of a single pose: how it was asked for.
    asked: Option<(Py<PyArm>, Vec<f64>, [f64; 6])>,
}

impl PyStatics {
    pub(crate) fn of_one(
        arm: &Bound<'_, PyArm>,
        at: &mut OperatingPoint,
        q: &[f64],
        wrench: [f64; 6],
    ) -> PyResult<Self> {
        let tool = at.tcp_pose().translation.vector;
        let moved = tool - at.rigid_tcp_pose().translation.vector;
        // Rows first.
        let C = at.compliance().transpose();
        let frequencies = at.frequencies_hz().to_vec();
        Ok(Self {
            rows: None,
            tcp: tool.as_slice().to_vec(),
            deflection: moved.as_slice().to_vec(),
            compliance: C.as_slice().to_vec(),
            elastic: frequencies.len(),
            frequencies,
            failures: Vec::new(),
            asked: Some((arm.clone().unbind(), q.to_vec(), wrench)),
        })
    }

    pub(crate) fn of_many(_py: Python<'_>, found: OperatingPoints, m: usize) -> PyResult<Self> {
        let elastic = found.frequencies();
        let failures = found.failures.iter().map(|(k, error)| (*k, error.to_string())).collect();
        Ok(Self {
            rows: Some(m),
            tcp: found.tcp_m,
            deflection: found.deflection_m,
            compliance: found.compliance,
            frequencies: found.frequencies_hz,
            elastic,
            failures,
            asked: None,
        })
    }

    /// An array on the answer's own numbers.
    fn array<'py>(slf: &Bound<'py, Self>, row: &[usize], values: &[f64]) -> PyResult<Bound<'py, PyAny>> {
        let owner = slf.clone().into_any();
        match (slf.get().rows, row) {
            (None, &[a]) => view(owner, [a], values),
            (None, &[a, b]) => view(owner, [a, b], values),
            (Some(m), &[a]) => view(owner, [m, a], values),
            (Some(m), &[a, b]) => view(owner, [m, a, b], values),
            _ => view(owner, [values.len()], values),
        }
    }
}

#[pymethods]
impl PyStatics {
    /// Place of the tool (m), (3,) or (m, 3).
    #[getter]
    fn tcp<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, &[3], &slf.get().tcp)
    }

    /// The same minus that of the rigid arm (m), (3,) or (m, 3).
    #[getter]
    fn deflection<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, &[3], &slf.get().deflection)
    }

    /// Displacement of the tool per wrench on it (m/N, rad/N; m/(N m), rad/(N m)), (6, 6) or (m, 6, 6).
    #[getter]
    fn compliance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, &[6, 6], &slf.get().compliance)
    }

    /// Natural frequencies, ascending (Hz), (elastic,) or (m, elastic).
    #[getter]
    fn frequencies<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, &[slf.get().elastic], &slf.get().frequencies)
    }

    /// Poses without an answer, and why (list of (int, str)).
    #[getter]
    fn failures(&self) -> Vec<(usize, String)> {
        self.failures.clone()
    }

    /// All that is known of a single pose, found when it is first asked for (dict as ``flexarm statics --json``): sag,
    /// holding torques, what each element carries.
    #[getter]
    fn details<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (arm, q, wrench) = self.asked.as_ref().ok_or_else(|| only_for_one("details"))?;
        let found = py.detach(|| arm.get().arm.statics(Some(q), *wrench)).or_raise()?;
        caveat::warn(py, &found.caveats)?;
        plain(py, &found)
    }

    fn __len__(&self) -> PyResult<usize> {
        self.rows
            .ok_or_else(|| pyo3::exceptions::PyTypeError::new_err("the answer is for a single pose: it has no len()"))
    }

    fn __repr__(&self) -> String {
        match self.rows {
            Some(m) => format!("<Statics of {m} poses, {} without an equilibrium>", self.failures.len()),
            None => {
                let sag = self.deflection.iter().map(|x| x * x).sum::<f64>().sqrt();
                let first =
                    self.frequencies.first().map_or_else(String::new, |hz| format!(", first frequency {hz:.2} Hz"));
                format!("<Statics: tool {:.4} mm away{first}>", 1e3 * sag)
            }
        }
    }
}

/// Natural modes at a pose.
#[pyclass(frozen, name = "Modes", module = "flexarm")]
pub(crate) struct PyModes {
    table: ModeTable,
}

pub(crate) fn modes(table: ModeTable) -> PyResult<PyModes> {
    Ok(PyModes { table })
}

#[pymethods]
impl PyModes {
    /// Natural frequencies, ascending (Hz), (modes,).
    #[getter]
    fn frequencies<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let values = &slf.get().table.frequencies_hz;
        view(slf.clone().into_any(), [values.len()], values)
    }

    /// Damping ratios, (modes,).
    #[getter]
    fn damping_ratio<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let values = &slf.get().table.damping_ratio;
        view(slf.clone().into_any(), [values.len()], values)
    }

    /// Motion of the tool in each mode scaled to unit modal mass, (modes, 6), complex.
    #[getter]
    fn tcp<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.table.modes.len();
        let part = |of: fn(&flexarm::ModeFigures) -> &[f64; 6]| -> PyResult<Bound<'py, PyAny>> {
            array(py, [n, 6], self.table.modes.iter().flat_map(|mode| *of(mode)).collect())
        };
        complex(&part(|mode| &mode.tcp)?, &part(|mode| &mode.tcp_imaginary)?)
    }

    /// Share of each element in the strain energy of each mode, (modes, elements).
    #[getter]
    fn strain_energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let values = self.table.modes.iter().flat_map(|mode| mode.strain_energy.iter().copied()).collect();
        array(py, [self.table.modes.len(), self.table.elements.len()], values)
    }

    /// Names of the elements, in the order of :attr:`strain_energy` (tuple of str).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.table.elements)
    }

    /// What limits the worth of the answer (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        caveat::list(py, &self.table.caveats)
    }

    /// All figures (dict as ``flexarm modes --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.table)
    }

    fn __len__(&self) -> usize {
        self.table.modes.len()
    }

    fn __repr__(&self) -> String {
        let hz = self.table.frequencies_hz.iter().take(3).map(|hz| format!("{hz:.2}")).collect::<Vec<_>>().join(", ");
        format!("<Modes: {} of {}, {hz} ... Hz>", self.table.modes.len(), self.table.total)
    }
}

/// `real + 1j * imaginary`.
fn complex<'py>(real: &Bound<'py, PyAny>, imaginary: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let j = pyo3::types::PyComplex::from_doubles(real.py(), 0.0, 1.0);
    real.add(imaginary.mul(j)?)
}

/// Words of a frequency response.
pub(crate) struct ResponseArgs<'a> {
    pub(crate) inputs: Option<Vec<String>>,
    pub(crate) outputs: Option<Vec<String>>,
    pub(crate) quantity: &'a str,
    pub(crate) from_hz: Option<f64>,
    pub(crate) to_hz: Option<f64>,
    pub(crate) points: usize,
    pub(crate) spacing: &'a str,
}

impl ResponseArgs<'_> {
    pub(crate) fn request(self) -> PyResult<ResponseRequest> {
        let usual = ResponseRequest::default();
        let quantities = [
            ("displacement", Quantity::Displacement),
            ("velocity", Quantity::Velocity),
            ("acceleration", Quantity::Acceleration),
        ];
        let spacings = [("log", Spacing::Logarithmic), ("linear", Spacing::Linear)];
        Ok(ResponseRequest {
            inputs: self.inputs.unwrap_or(usual.inputs),
            outputs: self.outputs.unwrap_or(usual.outputs),
            quantity: word("quantity", self.quantity, &quantities)?,
            from_hz: self.from_hz,
            to_hz: self.to_hz,
            points: self.points,
            spacing: word("spacing", self.spacing, &spacings)?,
        })
    }
}

/// Frequency response of the tool at a pose.
#[pyclass(frozen, name = "Response", module = "flexarm")]
pub(crate) struct PyResponse {
    response: Response,
    inputs: Vec<String>,
    outputs: Vec<String>,
}

pub(crate) fn response(response: Response, request: &ResponseRequest) -> PyResult<PyResponse> {
    Ok(PyResponse { response, inputs: request.inputs.clone(), outputs: request.outputs.clone() })
}

impl PyResponse {
    /// A field of all curves, (inputs, outputs, f).
    fn field<'py>(&self, py: Python<'py>, of: fn(&flexarm::ResponseCurve) -> &[f64]) -> PyResult<Bound<'py, PyAny>> {
        let n = self.response.frequency_hz.len();
        let values = self.response.curves.iter().flat_map(|curve| of(curve).iter().copied()).collect();
        array(py, [self.inputs.len(), self.outputs.len(), n], values)
    }
}

#[pymethods]
impl PyResponse {
    /// Frequencies of the curves (Hz), (f,).
    #[getter]
    fn frequency<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let values = &slf.get().response.frequency_hz;
        view(slf.clone().into_any(), [values.len()], values)
    }

    /// Inputs, in their order (tuple of str).
    #[getter]
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.inputs)
    }

    /// Outputs, in their order (tuple of str).
    #[getter]
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.outputs)
    }

    /// Amplitude of the output per amplitude of the input, (inputs, outputs, f).
    #[getter]
    fn magnitude<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |curve| &curve.magnitude)
    }

    /// How far the output is ahead of the input (rad), (inputs, outputs, f).
    #[getter]
    fn phase<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |curve| &curve.phase_rad)
    }

    /// Natural frequencies of all modes (Hz), (modes,).
    #[getter]
    fn natural_frequencies<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let values = &slf.get().response.frequencies_hz;
        view(slf.clone().into_any(), [values.len()], values)
    }

    /// What limits the worth of the answer (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        caveat::list(py, &self.response.caveats)
    }

    /// All figures, with peaks and units (dict as ``flexarm response --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.response)
    }

    /// Draws the magnitudes with matplotlib.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Where to draw; a new figure without it.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    #[pyo3(signature = (ax=None))]
    fn plot<'py>(slf: &Bound<'py, Self>, ax: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._plot")?.call_method1("response", (slf, ax))
    }

    fn __repr__(&self) -> String {
        let (inputs, outputs) = (self.inputs.join(","), self.outputs.join(","));
        format!("<Response of {outputs} to {inputs}: {} frequencies>", self.response.frequency_hz.len())
    }
}

/// Linear structure about an equilibrium; k free coordinates (joints driven by torque, then elastic ones), n joints.
///
/// World axes at the tool, linear first.
#[pyclass(frozen, name = "Linear", module = "flexarm")]
pub(crate) struct PyLinear {
    linear: Linear,
}

pub(crate) fn linear(linear: Linear) -> PyLinear {
    PyLinear { linear }
}

impl PyLinear {
    /// A matrix whose numbers lie column after column.
    fn matrix<'py>(
        py: Python<'py>,
        (rows, columns): (usize, usize),
        by_columns: &[f64],
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = (0..rows * columns).map(|k| by_columns[(k % columns) * rows + k / columns]).collect();
        answer(py, None, &[rows, columns], values)
    }
}

#[pymethods]
#[expect(non_snake_case, reason = "the names of the matrices")]
impl PyLinear {
    /// Mass matrix, (k, k).
    #[getter]
    fn M<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.M.shape(), self.linear.M.as_slice())
    }

    /// Damping matrix, (k, k).
    #[getter]
    fn D<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.D.shape(), self.linear.D.as_slice())
    }

    /// Tangent stiffness: springs, change of weight and of the wrench, (k, k).
    #[getter]
    fn K<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.K.shape(), self.linear.K.as_slice())
    }

    /// Twist of the tool per rate of the free coordinates, (6, k).
    #[getter]
    fn J<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.J.shape(), self.linear.J.as_slice())
    }

    /// Forces on the free coordinates per acceleration of the commands, (k, n).
    #[getter]
    fn M_a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.M_a.shape(), self.linear.M_a.as_slice())
    }

    /// Forces on the free coordinates per rate of the commands, (k, n).
    #[getter]
    fn D_a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.D_a.shape(), self.linear.D_a.as_slice())
    }

    /// Forces on the free coordinates per command, (k, n).
    #[getter]
    fn K_a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.K_a.shape(), self.linear.K_a.as_slice())
    }

    /// Twist of the tool per rate of the commands, the structure not yielding, (6, n).
    #[getter]
    fn J_a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::matrix(py, self.linear.J_a.shape(), self.linear.J_a.as_slice())
    }

    /// Free coordinates at the equilibrium, (k,).
    #[getter]
    fn equilibrium<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, [self.linear.equilibrium.len()], self.linear.equilibrium.as_slice().to_vec())
    }

    /// Forces with which the drives hold the pose (N m or N), (n,).
    #[getter]
    fn holding<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, [self.linear.holding.len()], self.linear.holding.as_slice().to_vec())
    }

    /// How many of the free coordinates are joints driven by torque; they come first.
    #[getter]
    fn driven(&self) -> usize {
        self.linear.driven
    }

    /// Name, and first and last but one free coordinate, of each elastic element (list of (str, int, int)).
    #[getter]
    fn elements(&self) -> Vec<(String, usize, usize)> {
        self.linear.elements.iter().map(|(name, range)| (name.clone(), range.start, range.end)).collect()
    }

    /// Displacement of the tool per wrench on it, motors held, (6, 6).
    #[getter]
    fn compliance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let failed = |source| flexarm::Error::Step { source, partial: false };
        let C = self.linear.compliance().map_err(failed).or_raise()?;
        Self::matrix(py, C.shape(), C.as_slice())
    }

    fn __repr__(&self) -> String {
        format!("<Linear: {} free coordinates, {} commands>", self.linear.M.nrows(), self.linear.M_a.ncols())
    }
}
