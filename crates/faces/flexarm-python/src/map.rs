//! Maps of the workspace.
//!
//! `map` takes poses or a region and returns arrays with a row for each pose: m, rad, N/m, Hz;
//! world axes. Not here: poses and quantities (`flexarm::map`).

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use flexarm::map::{JointRange, Map, MapRegion, MapRequest, ToolDirections, WorkspaceGrid, map as take};
use flexarm::{Motion, Robot};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{array, numbers};
use crate::caveat;
use crate::failure::OrRaise;
use crate::figures::Figures;
use crate::lobes::cutting_tool;
use crate::parts::{Parts, Pickled};
use crate::robot::PyRobot;
use crate::run_arguments::progress_function;
use crate::scenario::scenario;
use crate::values::{choice, maybe_whole, modelling, whole, wrench};
use crate::watch::stoppable_telling;

/// Sag, compliance, frequencies and error under load at many poses. Created by :func:`flexarm.map`.
#[pyclass(frozen, name = "Map", module = "flexarm")]
pub(crate) struct PyMap {
    /// Names and descriptions of the columns.
    columns: Vec<(String, String)>,
    /// Row after row.
    values: Vec<f64>,
    /// Summary in one line.
    headline: String,
    figures: Figures,
}

impl PyMap {
    fn new(mut map: Map) -> Self {
        let Map { robot, poses, points, reachable, .. } = &map;
        let headline = format!("{robot:?}: {poses} poses, {reachable} of {points} places within reach");
        let table = std::mem::take(&mut map.table);
        let columns = table.columns.into_iter().map(|column| (column.name, column.meaning)).collect();
        let caveats = map.caveats.clone();
        Self { columns, values: table.values, headline, figures: Figures::of(map, &caveats) }
    }

    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let k = self.columns.iter().position(|(column, _)| column == name).ok_or_else(|| {
            let known: Vec<&str> = self.columns.iter().map(|(column, _)| column.as_str()).collect();
            PyKeyError::new_err(format!("the map has no column {name:?}; its columns are {}", known.join(", ")))
        })?;
        let values: Vec<f64> = self.values.iter().skip(k).step_by(self.columns.len()).copied().collect();
        array(py, [values.len()], values)
    }
}

#[pymethods]
impl PyMap {
    /// Every pose as a row: names and values of the columns (dict of str to ndarray).
    #[getter]
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        for (name, _) in &self.columns {
            table.set_item(name, self.column(py, name)?)?;
        }
        Ok(table)
    }

    /// Description of each column (dict of str to str).
    #[getter]
    fn meanings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let meanings = PyDict::new(py);
        for (name, meaning) in &self.columns {
            meanings.set_item(name, meaning)?;
        }
        Ok(meanings)
    }

    /// Pose with the worst value of the compared quantity (dict).
    #[getter]
    fn worst<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)?.get_item("worst")
    }

    /// Pose with the best value of the compared quantity (dict).
    #[getter]
    fn best<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)?.get_item("best")
    }

    /// Limits of the validity of the result (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.figures.caveats(py)
    }

    /// All figures (dict as ``flexarm map --json``).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.figures.plain(py)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.column(py, name)
    }

    fn __len__(&self) -> usize {
        self.values.len() / self.columns.len().max(1)
    }

    fn __repr__(&self) -> String {
        format!("<Map {}>", flexarm::settings::written::one_line(&self.headline))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::reduced(slf)
    }
}

impl Pickled for PyMap {
    fn parts(&self, parts: &Parts<'_>) -> PyResult<()> {
        parts.put("columns", self.columns.clone())?;
        parts.put_numbers("values", &self.values)?;
        parts.put("headline", &self.headline)?;
        self.figures.put_into(parts)
    }

    fn of_parts(parts: &Parts<'_>) -> PyResult<Self> {
        Ok(Self {
            columns: parts.get("columns")?,
            values: parts.numbers("values")?,
            headline: parts.get("headline")?,
            figures: Figures::of_parts(parts)?,
        })
    }
}

/// Reads three numbers.
fn three(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let found = numbers(name, value, &[(3, "numbers")], false)?;
    let values = found.values();
    Ok([values[0], values[1], values[2]])
}

/// Region of a map over joints: ``{"joint_2": (from, to, points)}``.
fn over_joints(joints: &Bound<'_, PyDict>) -> PyResult<MapRegion> {
    let range = |(joint, range): (Bound<'_, PyAny>, Bound<'_, PyAny>)| -> PyResult<JointRange> {
        let joint: String = joint.extract()?;
        let (from, to, points): (f64, f64, usize) = range.extract().map_err(|_| {
            PyValueError::new_err(format!(
                "joints[{joint:?}]: expected (from, to, points), rad or m, such as (-2.0, 0.0, 50)"
            ))
        })?;
        Ok(JointRange { joint, range: [from, to], points })
    };
    Ok(MapRegion::Joints(joints.iter().map(range).collect::<PyResult<_>>()?))
}

/// Maps sag, compliance, natural frequencies and error under load over the workspace.
///
/// Parameters
/// ----------
/// robot : Robot
/// bounds : array_like, shape (2, 3), optional
///     Lowest and highest corner of a box of TCP positions (m, world). Default: the whole
///     workspace.
/// spacing : float, optional
///     Spacing of the positions (m).
/// keep_out : float, optional
///     Exclude positions nearer than this to the vertical line through the first joint (m). Default:
///     0 with ``bounds``, else the radius of base and first moving link.
/// tool_axis : array_like, shape (3,), default (0, 0, -1)
///     Direction of the tool's z axis in the world.
/// roll, cone : float, default 0
///     Rotation about that axis, half angle of a cone within which the tool may tilt (rad).
/// tilts, rolls : int, optional
///     Numbers of directions in the cone, and of rotations of the tool.
/// joints : dict of str to (float, float, int), optional
///     Scan joint values instead: from, to, number of points (rad or m).
/// poses : array_like, shape (m, n), optional
///     Evaluate these joint values instead, in coordinate order (rad or m); the table then has the
///     6x6 compliance of each.
/// along : Motion or path, optional
///     Evaluate along a motion instead, at ``points`` instants.
/// points : int, default 1000
/// at : array_like, shape (n,), optional
///     Values of the joints that the map does not move; also selects the inverse kinematics
///     branches.
/// wrench : array_like, shape (3,) or (6,), optional
///     On the tool in addition to gravity, world axes (N, N m).
/// by : str, optional
///     Quantity by which poses are compared.
/// keep : {"best", "worst", "all"}, default "best"
///     Poses to keep at each position.
/// frequencies : int, default 3
/// workpiece : array_like, shape (3,), optional
///     Edges of a box whose best position is searched (m).
/// tool : path or str, optional
///     A cutting tool as for :func:`lobes`; its chatter-free depth of cut becomes the quantity
///     ``depth_m``.
/// rpm : sequence of float, optional
///     Its spindle speeds (1/min); their lowest limit is used. Default: those of its file.
/// links, drives : str, optional
///     As for :meth:`Robot.flexible`.
/// output : path, optional
///     Folder of table, page and recording. Default: nothing is written.
/// overwrite : bool, default False
/// progress : bool or callable, default False
///
/// Returns
/// -------
/// Map
///
/// Examples
/// --------
/// >>> robot = flexarm.load("kr210")
/// >>> found = flexarm.map(robot, joints={"joint_2": (-1.8, 0.0, 5), "joint_3": (0.0, 2.0, 5)})
/// >>> len(found)
/// 25
#[pyfunction]
#[pyo3(signature = (robot, *, bounds=None, spacing=None, keep_out=None, tool_axis=None, roll=0.0, cone=0.0, tilts=None, rolls=1,
                    joints=None, poses=None, along=None, points=1000, at=None, wrench=None, by=None, keep="best", frequencies=3,
                    workpiece=None, tool=None, rpm=None, links=None, drives=None, output=None, overwrite=false,
                    progress=None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn map<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    bounds: Option<&Bound<'py, PyAny>>,
    spacing: Option<f64>,
    keep_out: Option<f64>,
    tool_axis: Option<&Bound<'py, PyAny>>,
    roll: f64,
    cone: f64,
    #[pyo3(from_py_with = maybe_whole)] tilts: Option<usize>,
    #[pyo3(from_py_with = whole)] rolls: usize,
    joints: Option<&Bound<'py, PyDict>>,
    poses: Option<&Bound<'py, PyAny>>,
    along: Option<&Bound<'py, PyAny>>,
    #[pyo3(from_py_with = whole)] points: usize,
    at: Option<&Bound<'py, PyAny>>,
    wrench: Option<&Bound<'py, PyAny>>,
    by: Option<String>,
    keep: &str,
    #[pyo3(from_py_with = whole)] frequencies: usize,
    workpiece: Option<&Bound<'py, PyAny>>,
    tool: Option<PathBuf>,
    rpm: Option<Vec<f64>>,
    links: Option<&str>,
    drives: Option<&str>,
    output: Option<PathBuf>,
    overwrite: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<PyMap> {
    let n = robot.get().robot.rigid_model().or_raise()?.n_actuated();
    let grid = GridArguments { bounds, spacing, keep_out, tool_axis, roll, cone, tilts, rolls };
    // Places: joint values, poses, instants of a motion, or a grid in space.
    let region = region(robot, n, Places { joints, poses, along, points }, &grid)?;
    let at = at.map(|at| numbers("at", at, &[(n, "joints")], false)).transpose()?;
    let request = MapRequest {
        modelling: modelling(links, drives, None, None)?,
        region,
        at: at.map(|at| at.values().to_vec()),
        wrench: self::wrench(wrench)?,
        frequencies: Some(frequencies),
        keep: choice("keep", keep)?,
        by,
        tool: tool.map(|tool| cutting_tool(py, &tool, rpm)).transpose()?,
        workpiece_m: workpiece.map(|edges| three("workpiece", edges)).transpose()?,
        output,
        overwrite,
    };
    let map = with_bar(py, &robot.get().robot, &request, progress_function(py, progress)?)?;
    caveat::answer(py, &map, &map.caveats)?;
    Ok(PyMap::new(map))
}

/// Places that replace the box: values of joints, listed poses, or a motion.
struct Places<'a, 'py> {
    joints: Option<&'a Bound<'py, PyDict>>,
    poses: Option<&'a Bound<'py, PyAny>>,
    along: Option<&'a Bound<'py, PyAny>>,
    points: usize,
}

/// Grid of TCP positions in a box, and directions of the tool at each.
struct GridArguments<'a, 'py> {
    bounds: Option<&'a Bound<'py, PyAny>>,
    spacing: Option<f64>,
    keep_out: Option<f64>,
    tool_axis: Option<&'a Bound<'py, PyAny>>,
    roll: f64,
    cone: f64,
    tilts: Option<usize>,
    rolls: usize,
}

impl GridArguments<'_, '_> {
    fn grid(&self) -> PyResult<WorkspaceGrid> {
        let usual = ToolDirections::default();
        let tool = ToolDirections {
            axis: self.tool_axis.map_or(Ok(usual.axis), |axis| three("tool_axis", axis))?,
            roll_rad: self.roll,
            cone_rad: self.cone,
            tilts: self.tilts.unwrap_or(if self.cone > 0.0 { 9 } else { 1 }),
            rolls: self.rolls,
        };
        let corners = |bounds| -> PyResult<[[f64; 3]; 2]> {
            let found = numbers("bounds", bounds, &[(2, "corners"), (3, "numbers (m)")], false)?;
            let b = found.values();
            Ok([[b[0], b[1], b[2]], [b[3], b[4], b[5]]])
        };
        let bounds = self.bounds.map(corners).transpose()?;
        Ok(WorkspaceGrid { bounds, spacing_m: self.spacing, keep_out_m: self.keep_out, tool })
    }
}

/// Returns the region of the only arguments that give one; `n` is the number of joints.
fn region<'py>(
    robot: &Bound<'py, PyRobot>,
    n: usize,
    Places { joints, poses, along, points }: Places<'_, 'py>,
    grid: &GridArguments<'_, 'py>,
) -> PyResult<MapRegion> {
    let boxed = grid.bounds.is_some() || grid.spacing.is_some();
    if [boxed, joints.is_some(), poses.is_some(), along.is_some()].into_iter().filter(|given| *given).count() > 1 {
        return Err(PyValueError::new_err(
            "bounds and spacing, joints, poses, and along exclude each other: give one of them",
        ));
    }
    match (joints, poses, along) {
        (Some(joints), ..) => over_joints(joints),
        (None, Some(poses), _) => {
            let poses = numbers("poses", poses, &[(n, "joints")], true)?;
            Ok(MapRegion::Poses(poses.values().chunks_exact(n.max(1)).map(<[f64]>::to_vec).collect()))
        }
        (None, None, Some(along)) => {
            let motion: Motion = scenario(robot, Some(along), None, None, None)?.motion;
            Ok(MapRegion::Along { motion: Box::new(motion), points })
        }
        (None, None, None) => Ok(MapRegion::Workspace(grid.grid()?)),
    }
}

/// Computes a map with a progress bar, which is closed at the end.
fn with_bar<'py>(
    py: Python<'py>,
    robot: &Robot,
    request: &MapRequest,
    bar: Option<Bound<'py, PyAny>>,
) -> PyResult<Map> {
    let found = watched(py, robot, request, bar.clone().map(Bound::unbind));
    if let Some(bar) = bar
        && let Ok(close) = bar.getattr("close")
    {
        close.call0()?;
    }
    found
}

/// Computes a map that signals and a progress function can stop.
fn watched(py: Python<'_>, robot: &Robot, request: &MapRequest, progress: Option<Py<PyAny>>) -> PyResult<Map> {
    // Progress, reported by the thread that may call Python.
    let at: Arc<Mutex<Option<(f64, f64)>>> = Arc::default();
    let reported = at.clone();
    let (robot, request) = (robot.clone(), request.clone());
    let work = move |stop: &(dyn Fn() -> bool + Sync)| {
        take(&robot, &request, &mut |done, all| {
            *at.lock().unwrap_or_else(PoisonError::into_inner) = Some((done, all));
            if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    };
    let mut tell = |py: Python<'_>| match (reported.lock().unwrap_or_else(PoisonError::into_inner).take(), &progress) {
        (Some((done, all)), Some(progress)) => progress.call1(py, (done, all)).map(drop),
        _ => Ok(()),
    };
    let map = stoppable_telling(py, work, &mut tell)?.or_raise()?;
    if let Some(progress) = &progress {
        progress.call1(py, (map.points as f64, map.points as f64))?;
    }
    Ok(map)
}
