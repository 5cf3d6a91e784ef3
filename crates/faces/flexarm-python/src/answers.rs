//! Results at a pose: statics, modes, frequency response.
//!
//! Each class has the numbers of a result of the library and gives them as read-only views. World
//! axes at the TCP, linear first; m, rad, N, N m, Hz. Not here: how they are computed
//! (`flexarm::poses`).

use flexarm::poses::{ModeTable, OperatingPoint, OperatingPoints, Quantity, Response, ResponseRequest, Spacing};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::arm::PyArm;
use crate::arrays::{array, view};
use crate::caveat;
use crate::failure::{OrRaise, only_for_one};
use crate::figures::Figures;
use crate::parts::{Parts, Pickled};
use crate::values::{plain, word};

/// Static equilibrium at a pose, or at m poses: arrays then have a leading axis of length m.
///
/// World axes at the TCP, linear first. Poses without an equilibrium have NaN everywhere and are
/// listed in :attr:`failures`.
#[pyclass(frozen, name = "Statics", module = "flexarm")]
pub(crate) struct PyStatics {
    rows: Option<usize>,
    tcp: Vec<f64>,
    deflection: Vec<f64>,
    compliance: Vec<f64>,
    frequencies: Vec<f64>,
    elastic: usize,
    failures: Vec<(usize, String)>,
    /// For a single pose: its inputs.
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
        // numpy arrays are row-major.
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

    pub(crate) fn of_many(found: OperatingPoints, m: usize) -> Self {
        let elastic = found.frequencies();
        let failures = found.failures.iter().map(|(k, error)| (*k, error.to_string())).collect();
        Self {
            rows: Some(m),
            tcp: found.tcp_m,
            deflection: found.deflection_m,
            compliance: found.compliance,
            frequencies: found.frequencies_hz,
            elastic,
            failures,
            asked: None,
        }
    }

    /// Returns a view of numbers with `row` of them at each pose.
    fn array<'py>(
        slf: &Bound<'py, Self>,
        row: impl Fn(&Self) -> Vec<usize>,
        values: fn(&Self) -> &[f64],
    ) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((own.rows.into_iter().chain(row(own)).collect(), values(own))))
    }
}

#[pymethods]
impl PyStatics {
    /// Position of the TCP (m), (3,) or (m, 3).
    #[getter]
    fn tcp<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, |_| vec![3], |own| &own.tcp)
    }

    /// TCP position minus that of the rigid arm (m), (3,) or (m, 3).
    #[getter]
    fn deflection<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, |_| vec![3], |own| &own.deflection)
    }

    /// Compliance of the TCP (m/N, rad/N; m/(N m), rad/(N m)), (6, 6) or (m, 6, 6).
    #[getter]
    fn compliance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, |_| vec![6, 6], |own| &own.compliance)
    }

    /// Natural frequencies, ascending (Hz), (elastic,) or (m, elastic).
    #[getter]
    fn frequencies<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, |own| vec![own.elastic], |own| &own.frequencies)
    }

    /// Poses without a solution, and the reasons (list of (int, str)).
    #[getter]
    fn failures(&self) -> Vec<(usize, String)> {
        self.failures.clone()
    }

    /// All results at a single pose, computed on first access (dict as ``flexarm statics --json``).
    ///
    /// These include sag, holding torques and the load of each element.
    #[getter]
    fn details<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (arm, q, wrench) = self.asked.as_ref().ok_or_else(|| only_for_one("details"))?;
        let found = py.detach(|| arm.get().arm.statics(Some(q), *wrench)).or_raise()?;
        caveat::issue(py, &found.caveats)?;
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

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyStatics {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        parts.put("rows", self.rows)?;
        parts.put("elastic", self.elastic)?;
        parts.put("failures", self.failures.clone())?;
        parts.put_numbers("tcp", &self.tcp)?;
        parts.put_numbers("deflection", &self.deflection)?;
        parts.put_numbers("compliance", &self.compliance)?;
        parts.put_numbers("frequencies", &self.frequencies)?;
        parts.put("asked", self.asked.as_ref().map(|(arm, q, wrench)| (arm, q.clone(), wrench.to_vec())))
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let (rows, elastic): (Option<usize>, usize) = (parts.get("rows")?, parts.get("elastic")?);
        let m = rows.unwrap_or(1);
        Ok(Self {
            rows,
            tcp: parts.shaped("tcp", &[m, 3])?,
            deflection: parts.shaped("deflection", &[m, 3])?,
            compliance: parts.shaped("compliance", &[m, 6, 6])?,
            frequencies: parts.shaped("frequencies", &[m, elastic])?,
            elastic,
            failures: parts.get("failures")?,
            asked: parts.get("asked")?,
        })
    }
}

/// Natural modes at a pose.
#[pyclass(frozen, name = "Modes", module = "flexarm")]
pub(crate) struct PyModes {
    frequencies: Vec<f64>,
    damping_ratio: Vec<f64>,
    /// Real and imaginary parts, six numbers for each mode.
    tcp: [Vec<f64>; 2],
    strain_energy: Vec<f64>,
    elements: Vec<String>,
    /// Total number of modes; fewer may be listed.
    total: usize,
    figures: Figures,
}

pub(crate) fn modes(table: ModeTable) -> PyModes {
    let ModeTable { frequencies_hz, damping_ratio, modes, elements, total, caveats, .. } = table.clone();
    PyModes {
        frequencies: frequencies_hz,
        damping_ratio,
        tcp: [
            modes.iter().flat_map(|mode| mode.tcp).collect(),
            modes.iter().flat_map(|mode| mode.tcp_imaginary).collect(),
        ],
        strain_energy: modes.into_iter().flat_map(|mode| mode.strain_energy).collect(),
        elements,
        total,
        figures: Figures::of(table, &caveats),
    }
}

#[pymethods]
impl PyModes {
    /// Natural frequencies, ascending (Hz), (modes,).
    #[getter]
    fn frequencies<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.frequencies.len()], &own.frequencies)))
    }

    /// Damping ratios, (modes,).
    #[getter]
    fn damping_ratio<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.damping_ratio.len()], &own.damping_ratio)))
    }

    /// Motion of the TCP in each mode, scaled to unit modal mass, (modes, 6), complex.
    #[getter]
    fn tcp<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let part = |values: &[f64]| array(py, [values.len() / 6, 6], values.to_vec());
        complex(&part(&self.tcp[0])?, &part(&self.tcp[1])?)
    }

    /// Share of each element in the strain energy of each mode, (modes, elements).
    #[getter]
    fn strain_energy<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.tcp[0].len() / 6, own.elements.len()], &own.strain_energy)))
    }

    /// Names of the elements, in the order of :attr:`strain_energy` (tuple of str).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.elements)
    }

    /// Limits of the validity of the result (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.figures.caveats(py)
    }

    /// All figures (dict as ``flexarm modes --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)
    }

    fn __len__(&self) -> usize {
        self.tcp[0].len() / 6
    }

    fn __repr__(&self) -> String {
        let hz = self.frequencies.iter().take(3).map(|hz| format!("{hz:.2}")).collect::<Vec<_>>().join(", ");
        format!("<Modes: {} of {}, {hz} ... Hz>", self.__len__(), self.total)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyModes {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        parts.put_numbers("frequencies", &self.frequencies)?;
        parts.put_numbers("damping_ratio", &self.damping_ratio)?;
        parts.put_numbers("tcp", &self.tcp[0])?;
        parts.put_numbers("tcp_imaginary", &self.tcp[1])?;
        parts.put_numbers("strain_energy", &self.strain_energy)?;
        parts.put("elements", self.elements.clone())?;
        parts.put("total", self.total)?;
        self.figures.put_into(parts)
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let tcp = parts.numbers("tcp")?;
        let (n, elements): (usize, Vec<String>) = (tcp.len() / 6, parts.get("elements")?);
        Ok(Self {
            frequencies: parts.numbers("frequencies")?,
            damping_ratio: parts.numbers("damping_ratio")?,
            tcp: [tcp, parts.shaped("tcp_imaginary", &[n, 6])?],
            strain_energy: parts.shaped("strain_energy", &[n, elements.len()])?,
            elements,
            total: parts.get("total")?,
            figures: Figures::of_parts(parts)?,
        })
    }
}

/// `real + 1j * imaginary`.
fn complex<'py>(real: &Bound<'py, PyAny>, imaginary: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let j = pyo3::types::PyComplex::from_doubles(real.py(), 0.0, 1.0);
    real.add(imaginary.mul(j)?)
}

/// Arguments of a frequency response.
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

/// Frequency response of the TCP at a pose.
#[pyclass(frozen, name = "Response", module = "flexarm")]
pub(crate) struct PyResponse {
    frequency: Vec<f64>,
    natural_frequencies: Vec<f64>,
    /// One curve after the other, outputs fastest.
    magnitude: Vec<f64>,
    phase: Vec<f64>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    figures: Figures,
}

pub(crate) fn response(response: Response, request: &ResponseRequest) -> PyResponse {
    let all = |of: fn(&flexarm::poses::ResponseCurve) -> &[f64]| response.curves.iter().flat_map(of).copied().collect();
    PyResponse {
        frequency: response.frequency_hz.clone(),
        natural_frequencies: response.frequencies_hz.clone(),
        magnitude: all(|curve| &curve.magnitude),
        phase: all(|curve| &curve.phase_rad),
        inputs: request.inputs.clone(),
        outputs: request.outputs.clone(),
        figures: {
            let caveats = response.caveats.clone();
            Figures::of(response, &caveats)
        },
    }
}

impl PyResponse {
    /// An array with a value per point of each curve, (inputs, outputs, f).
    fn field<'py>(slf: &Bound<'py, Self>, values: fn(&Self) -> &[f64]) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.inputs.len(), own.outputs.len(), own.frequency.len()], values(own))))
    }
}

#[pymethods]
impl PyResponse {
    /// Frequencies of the curves (Hz), (f,).
    #[getter]
    fn frequency<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.frequency.len()], &own.frequency)))
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

    /// Output amplitude over input amplitude, (inputs, outputs, f).
    #[getter]
    fn magnitude<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::field(slf, |own| &own.magnitude)
    }

    /// Phase lead of the output with respect to the input (rad), (inputs, outputs, f).
    #[getter]
    fn phase<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::field(slf, |own| &own.phase)
    }

    /// Natural frequencies of all modes (Hz), (modes,).
    #[getter]
    fn natural_frequencies<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| Ok((vec![own.natural_frequencies.len()], &own.natural_frequencies)))
    }

    /// Limits of the validity of the result (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.figures.caveats(py)
    }

    /// All figures, with peaks and units (dict as ``flexarm response --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)
    }

    /// Plots the magnitudes with matplotlib.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes to draw on. Default: a new figure.
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
        format!("<Response of {outputs} to {inputs}: {} frequencies>", self.frequency.len())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyResponse {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        parts.put_numbers("frequency", &self.frequency)?;
        parts.put_numbers("natural_frequencies", &self.natural_frequencies)?;
        parts.put_numbers("magnitude", &self.magnitude)?;
        parts.put_numbers("phase", &self.phase)?;
        parts.put("inputs", self.inputs.clone())?;
        parts.put("outputs", self.outputs.clone())?;
        self.figures.put_into(parts)
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let (inputs, outputs): (Vec<String>, Vec<String>) = (parts.get("inputs")?, parts.get("outputs")?);
        let frequency = parts.numbers("frequency")?;
        let shape = [inputs.len(), outputs.len(), frequency.len()];
        Ok(Self {
            magnitude: parts.shaped("magnitude", &shape)?,
            phase: parts.shaped("phase", &shape)?,
            natural_frequencies: parts.numbers("natural_frequencies")?,
            frequency,
            inputs,
            outputs,
            figures: Figures::of_parts(parts)?,
        })
    }
}
