//! Runs: figures, and every logged sample as columns.
//!
//! `Run` has a column for each signal: n samples, row-major, SI units, world axes unless the name
//! says path. `Sample` is one of them, for an observer. Not here: tables for other programs
//! (`table.rs`).

use flexarm::Run;
use flexarm::recordings::{Column, Columns, Sample};
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::arrays::{array, view};
use crate::figures::Figures;
use crate::parts::{Parts, Pickled};

/// Result of a run: figures, and every logged sample as columns.
///
/// Columns are read-only arrays that view the run's data without copying. ``run[name]`` returns any
/// of :attr:`columns`.
///
/// Examples
/// --------
/// >>> run = flexarm.load("reference_arm").flexible().simulate(step=2e-3)
/// >>> run.time.shape == (len(run),)
/// True
/// >>> run.error.shape == (len(run), 3)
/// True
/// >>> peak = run.summary["tcp"]["peak_m"]
#[pyclass(frozen, name = "Run", module = "flexarm")]
pub(crate) struct PyRun {
    columns: Columns,
    figures: Figures,
    /// Summary in one line.
    headline: String,
    /// The figures, converted on first access.
    summary: PyOnceLock<Py<PyAny>>,
}

impl PyRun {
    pub(crate) fn new(run: Run) -> Self {
        let Run { summary, columns, .. } = run;
        let peak =
            summary.tcp.as_ref().map_or_else(String::new, |tcp| format!(", TCP error {:.4} mm", 1e3 * tcp.peak_m));
        let (robot, trajectory, duration) = (&summary.robot, &summary.trajectory, summary.duration_s);
        let headline = format!("{robot} {trajectory}: {duration} s, {} samples{peak}", columns.rows());
        let caveats = summary.caveats.clone();
        Self { columns, figures: Figures::of(summary, &caveats), headline, summary: PyOnceLock::new() }
    }

    /// Summary in one line.
    pub(crate) fn headline(&self) -> &str {
        &self.headline
    }

    /// Returns the shape of a column.
    fn shape(&self, column: &Column) -> Vec<usize> {
        let columns = &self.columns;
        let n = columns.rows();
        match column.name.as_str() {
            "time" => vec![n],
            "deflection" | "load" => vec![n, columns.elements.len(), 6],
            "contribution" => vec![n, columns.contributors.len(), 3],
            _ => vec![n, column.width],
        }
    }

    /// Returns a view of a column; `missing` is the error if there is none.
    fn array<'py>(
        slf: &Bound<'py, Self>,
        name: &str,
        missing: impl FnOnce(&Self) -> PyErr,
    ) -> PyResult<Bound<'py, PyAny>> {
        view(slf, |own| {
            let column = own.columns.column(name).ok_or_else(|| missing(own))?;
            Ok((own.shape(column), &column.values))
        })
    }

    fn signal<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, name, |_| {
            PyAttributeError::new_err(format!(
                "the run has no column {name:?}: it ran without the rigid twin (twin=False)"
            ))
        })
    }
}

#[pymethods]
impl PyRun {
    /// Figures with the keys of ``summary.json`` and ``flexarm compare --json`` (dict).
    #[getter]
    pub(crate) fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let made = self.summary.get_or_try_init(py, || self.figures.plain(py).map(Bound::unbind))?;
        Ok(made.bind(py).clone())
    }

    /// Limits of the validity of the result (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.figures.caveats(py)
    }

    /// Names of the columns and their units (dict of str to str).
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let names = PyDict::new(py);
        for column in self.columns.columns() {
            names.set_item(&column.name, column.unit)?;
        }
        Ok(names)
    }

    /// Names of the joints, in the order of ``position``, ``velocity`` and ``effort`` (tuple of str).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.columns.joints)
    }

    /// Names of the elastic elements, in the order of ``deflection`` and ``load`` (tuple of str).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.columns.elements)
    }

    /// Names of the contributors to the TCP error, in the order of ``contribution`` (tuple of str).
    #[getter]
    fn contributors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.columns.contributors)
    }

    /// Names of the channels of ``gauge`` (tuple of str).
    #[getter]
    fn gauges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.columns.gauges)
    }

    /// Paths of the written files (dict of str to str).
    #[getter]
    fn files<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.summary(py)?.get_item("files")
    }

    /// Times of the samples (s), (n,).
    #[getter]
    fn time<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "time")
    }

    /// TCP error, flexible minus rigid, world axes (m), (n, 3).
    #[getter]
    fn error<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "error_world")
    }

    /// Orientation error of the TCP as a rotation vector (rad), (n, 3).
    #[getter]
    fn error_rotation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "error_rotation")
    }

    /// TCP error along, normal and binormal to the path (m), (n, 3).
    #[getter]
    fn error_path<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "error_path")
    }

    /// Static share of the TCP error (m), (n, 3).
    #[getter]
    fn error_static<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "error_static")
    }

    /// Joint positions (rad or m), (n, joints).
    #[getter]
    fn position<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "position")
    }

    /// Joint velocities, (n, joints).
    #[getter]
    fn velocity<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "velocity")
    }

    /// Drive forces (N m or N), (n, joints).
    #[getter]
    fn effort<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "effort")
    }

    /// Position of the flexible TCP, world (m), (n, 3).
    #[getter]
    fn tcp<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "tcp_position")
    }

    /// Position of the rigid TCP, world (m), (n, 3).
    #[getter]
    fn rigid_tcp<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "rigid_tcp_position")
    }

    /// Elastic coordinates (m, rad), (n, elements, 6).
    #[getter]
    fn deflection<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "deflection")
    }

    /// Share of each contributor in the TCP error (m), (n, contributors, 3).
    #[getter]
    fn contribution<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "contribution")
    }

    /// Strain gauges (m/m) and stress points (Pa), (n, gauges).
    #[getter]
    fn gauge<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "gauge")
    }

    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, name, |own| {
            let known: Vec<&str> = own.columns.columns().iter().map(|c| c.name.as_str()).collect();
            PyKeyError::new_err(format!("the run has no column {name:?}; its columns are {}", known.join(", ")))
        })
    }

    fn __contains__(&self, name: &str) -> bool {
        self.columns.column(name).is_some()
    }

    fn __len__(&self) -> usize {
        self.columns.rows()
    }

    /// Returns scalar columns, with names as in ``run.csv`` (dict of str to ndarray); this copies.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        for (name, values) in flexarm::recordings::flat_columns(&self.columns) {
            table.set_item(name, array(py, [values.len()], values)?)?;
        }
        Ok(table)
    }

    /// Exports Arrow's C stream: pyarrow, pandas, polars and DuckDB read the table without a copy.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        drop(requested_schema); // may be ignored according to the protocol
        crate::table::stream(py, &self.columns)
    }

    /// Returns the table as a ``pyarrow.Table``.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._tables")?.call_method1("to_arrow", (slf,))
    }

    /// Returns the table as a ``pandas.DataFrame``, indexed by time.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._tables")?.call_method1("to_pandas", (slf,))
    }

    /// Returns the table as a ``polars.DataFrame``.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._tables")?.call_method1("to_polars", (slf,))
    }

    /// Plots the TCP error over time with matplotlib.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes to draw on. Default: a new figure.
    /// parts : bool, default True
    ///     Draw its static and dynamic shares.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    #[pyo3(signature = (ax=None, *, parts=true))]
    fn plot<'py>(slf: &Bound<'py, Self>, ax: Option<Bound<'py, PyAny>>, parts: bool) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._plot")?.call_method1("run", (slf, ax, parts))
    }

    /// Shows the recording in the notebook (``rerun.notebook``) or in the Rerun viewer.
    ///
    /// The run needs ``output=``.
    fn show<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._show")?.call_method1("run", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("<Run {}>", flexarm::settings::written::one_line(&self.headline))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._show")?.call_method1("run_html", (slf,))
    }
}

impl Pickled for PyRun {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        let columns = &self.columns;
        parts.put("headline", &self.headline)?;
        parts.put("joints", columns.joints.clone())?;
        parts.put("prismatic", columns.prismatic.clone())?;
        parts.put("elements", columns.elements.clone())?;
        parts.put("contributors", columns.contributors.clone())?;
        parts.put("gauges", columns.gauges.clone())?;
        parts.put("columns", columns.columns().iter().map(|column| column.name.clone()).collect::<Vec<_>>())?;
        for column in columns.columns() {
            parts.put_numbers(&column.name, &column.values)?;
        }
        self.figures.put_into(parts)
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let names: Vec<String> = parts.get("columns")?;
        let values = names.into_iter().map(|name| Ok((parts.numbers(&name)?, name))).collect::<PyResult<Vec<_>>>()?;
        let mut empty = Columns::default();
        empty.joints = parts.get("joints")?;
        empty.prismatic = parts.get("prismatic")?;
        empty.elements = parts.get("elements")?;
        empty.contributors = parts.get("contributors")?;
        empty.gauges = parts.get("gauges")?;
        let wrong = || PyValueError::new_err("the pickle has columns of another version");
        let columns = empty.filled(values.into_iter().map(|(values, name)| (name, values))).ok_or_else(wrong)?;
        Ok(Self {
            columns,
            figures: Figures::of_parts(parts)?,
            headline: parts.get("headline")?,
            summary: PyOnceLock::new(),
        })
    }
}

/// An instant of a run, as passed to observers.
#[pyclass(frozen, name = "Sample", module = "flexarm")]
pub(crate) struct PySample {
    time: f64,
    step: u64,
    q: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
    tcp: [f64; 3],
    error: [f64; 3],
    error_static: [f64; 3],
}

impl PySample {
    pub(crate) fn new(sample: &Sample) -> Self {
        let [x, y, z, ..] = sample.error_world;
        Self {
            time: sample.time_s,
            step: sample.step,
            q: sample.flexible.q.clone(),
            velocity: sample.flexible.qdot.clone(),
            effort: sample.flexible.effort.clone(),
            tcp: sample.flexible.X_WT.translation.vector.into(),
            error: [x, y, z],
            error_static: sample.static_m,
        }
    }
}

fn vector<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyAny>> {
    array(py, [values.len()], values.to_vec())
}

#[pymethods]
impl PySample {
    /// Time (s).
    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    /// Number of steps so far.
    #[getter]
    fn step(&self) -> u64 {
        self.step
    }

    /// Joint positions (rad or m), (joints,).
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.q)
    }

    /// Joint velocities, (joints,).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.velocity)
    }

    /// Drive forces (N m or N), (joints,).
    #[getter]
    fn effort<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.effort)
    }

    /// Position of the flexible TCP, world (m), (3,).
    #[getter]
    fn tcp<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.tcp)
    }

    /// TCP error, flexible minus rigid, world axes (m), (3,).
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.error)
    }

    /// Static share of the TCP error (m), (3,).
    #[getter]
    fn error_static<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.error_static)
    }

    fn __repr__(&self) -> String {
        format!("<Sample at {} s>", self.time)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PySample {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        parts.put("time", self.time)?;
        parts.put("step", self.step)?;
        for (name, values) in [("position", &self.q), ("velocity", &self.velocity), ("effort", &self.effort)] {
            parts.put_numbers(name, values)?;
        }
        let vectors = [("tcp", &self.tcp), ("error", &self.error), ("error_static", &self.error_static)];
        vectors.into_iter().try_for_each(|(name, vector)| parts.put_numbers(name, vector))
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        let three = |name: &str| parts.shaped(name, &[3]).map(|v| [v[0], v[1], v[2]]);
        Ok(Self {
            time: parts.get("time")?,
            step: parts.get("step")?,
            q: parts.numbers("position")?,
            velocity: parts.numbers("velocity")?,
            effort: parts.numbers("effort")?,
            tcp: three("tcp")?,
            error: three("error")?,
            error_static: three("error_static")?,
        })
    }
}
