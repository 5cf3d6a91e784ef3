//! Runs: figures, and every logged sample as columns.

use flexarm::{Column, Run, Sample};
use pyo3::exceptions::{PyAttributeError, PyKeyError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::arrays::{array, view};
use crate::caveat;
use crate::values::plain;

/// What a run gives: figures, and every logged sample as columns.
///
/// Columns are read-only arrays on the run's own numbers: nothing is copied. ``run[name]`` is any of :attr:`columns`.
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
    pub(crate) run: Run,
    summary: PyOnceLock<Py<PyAny>>,
}

impl PyRun {
    pub(crate) fn new(run: Run) -> Self {
        Self { run, summary: PyOnceLock::new() }
    }

    /// Shape of a column.
    fn shape(&self, column: &Column) -> Vec<usize> {
        let columns = &self.run.columns;
        let n = columns.rows();
        match column.name.as_str() {
            "time" => vec![n],
            "deflection" | "load" => vec![n, columns.elements.len(), 6],
            "contribution" => vec![n, columns.contributors.len(), 3],
            _ => vec![n, column.width],
        }
    }

    fn array<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let own = slf.get();
        let Some(column) = own.run.columns.column(name) else { return Ok(None) };
        let owner = slf.clone().into_any();
        let values = &column.values;
        Ok(Some(match *own.shape(column) {
            [n] => view(owner, [n], values)?,
            [n, m] => view(owner, [n, m], values)?,
            [n, m, k] => view(owner, [n, m, k], values)?,
            _ => return Ok(None),
        }))
    }

    fn signal<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, name)?.ok_or_else(|| {
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
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let made = self.summary.get_or_try_init(py, || plain(py, &self.run.summary).map(Bound::unbind))?;
        Ok(made.bind(py).clone())
    }

    /// What limits the worth of the result (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        caveat::list(py, &self.run.summary.caveats)
    }

    /// Names of the columns and their units (dict of str to str).
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let names = PyDict::new(py);
        for column in self.run.columns.columns() {
            names.set_item(&column.name, column.unit)?;
        }
        Ok(names)
    }

    /// Names of the joints, in the order of ``position``, ``velocity`` and ``effort`` (tuple of str).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.run.columns.joints)
    }

    /// Names of the elastic elements, in the order of ``deflection`` and ``load`` (tuple of str).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.run.columns.elements)
    }

    /// Who moves the tool, in the order of ``contribution`` (tuple of str).
    #[getter]
    fn contributors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.run.columns.contributors)
    }

    /// Paths of the files that were written (dict of str to str).
    #[getter]
    fn files<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.run.summary.files)
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

    /// The same as a rotation vector (rad), (n, 3).
    #[getter]
    fn error_rotation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "error_rotation")
    }

    /// Along, normal and binormal to the path (m), (n, 3).
    #[getter]
    fn error_path<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "error_path")
    }

    /// What of the error the arm would have standing still (m), (n, 3).
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

    /// Forces of the drives (N m or N), (n, joints).
    #[getter]
    fn effort<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "effort")
    }

    /// Place of the flexible tool, world (m), (n, 3).
    #[getter]
    fn tcp<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::signal(slf, "tcp_position")
    }

    /// Place of the rigid tool, world (m), (n, 3).
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

    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        Self::array(slf, name)?.ok_or_else(|| {
            let known: Vec<&str> = slf.get().run.columns.columns().iter().map(|c| c.name.as_str()).collect();
            PyKeyError::new_err(format!("the run has no column {name:?}; its columns are {}", known.join(", ")))
        })
    }

    fn __contains__(&self, name: &str) -> bool {
        self.run.columns.column(name).is_some()
    }

    fn __len__(&self) -> usize {
        self.run.columns.rows()
    }

    /// Columns one number wide, with names as in ``run.csv`` (dict of str to ndarray); this copies.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        for (name, values) in crate::table::flat(&self.run) {
            table.set_item(name, array(py, [values.len()], values)?)?;
        }
        Ok(table)
    }

    /// The stream of Arrow's C interface, by which pyarrow, pandas, polars and DuckDB take the table without a copy.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        drop(requested_schema); // the protocol lets us ignore it
        crate::table::stream(py, &self.run)
    }

    /// The table as a ``pyarrow.Table``.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._tables")?.call_method1("to_arrow", (slf,))
    }

    /// The table as a ``pandas.DataFrame``, indexed by time.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._tables")?.call_method1("to_pandas", (slf,))
    }

    /// The table as a ``polars.DataFrame``.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._tables")?.call_method1("to_polars", (slf,))
    }

    /// Draws the TCP error over time with matplotlib.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Where to draw; a new figure without it.
    /// parts : bool, default True
    ///     Draw what standing still and motion are of it.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    #[pyo3(signature = (ax=None, *, parts=true))]
    fn plot<'py>(slf: &Bound<'py, Self>, ax: Option<Bound<'py, PyAny>>, parts: bool) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._plot")?.call_method1("run", (slf, ax, parts))
    }

    /// Opens the recording: in the notebook with ``rerun.notebook``, else in the Rerun viewer. The run needs ``output=``.
    fn show<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._show")?.call_method1("run", (slf,))
    }

    fn __repr__(&self) -> String {
        let summary = &self.run.summary;
        let peak =
            summary.tcp.as_ref().map_or_else(String::new, |tcp| format!(", TCP error {:.4} mm", 1e3 * tcp.peak_m));
        format!(
            "<Run {} {}: {} s, {} samples{peak}>",
            summary.robot,
            summary.trajectory,
            summary.duration_s,
            self.__len__()
        )
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._show")?.call_method1("run_html", (slf,))
    }
}

/// An instant of a run, as observers see it.
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

    /// Forces of the drives (N m or N), (joints,).
    #[getter]
    fn effort<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.effort)
    }

    /// Place of the flexible tool, world (m), (3,).
    #[getter]
    fn tcp<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.tcp)
    }

    /// TCP error, flexible minus rigid, world axes (m), (3,).
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.error)
    }

    /// What of it the arm would have standing still (m), (3,).
    #[getter]
    fn error_static<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        vector(py, &self.error_static)
    }

    fn __repr__(&self) -> String {
        format!("<Sample at {} s>", self.time)
    }
}
