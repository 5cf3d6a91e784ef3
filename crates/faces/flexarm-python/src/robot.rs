//! Robots as loaded: from a folder, a file, a description, or keys of a robot file.
//!
//! Not here: methods of a robot (`robot_methods.rs`), arms (`arm.rs`).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::robots::{Description, InertiaEstimate, ReadOptions};
use flexarm::{LoadOptions, Robot, RobotSource};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::failure::{OrRaise, exception};
use crate::values::{path, plain, texts};

/// A loaded robot: links, joints, drives, tool. Created by :func:`flexarm.load`.
///
/// Immutable, shareable between threads, and picklable: unpickling reads the files again.
///
/// Examples
/// --------
/// >>> import flexarm
/// >>> robot = flexarm.load("kr210")
/// >>> robot.joints[:2]
/// ('joint_1', 'joint_2')
/// >>> arm = robot.flexible(links="modal", drives="elastic")
#[pyclass(frozen, name = "Robot", module = "flexarm")]
pub(crate) struct PyRobot {
    pub(crate) robot: Arc<Robot>,
    /// For pickling: a function of `flexarm._pickle` and its arguments.
    pub(crate) again: (&'static str, Py<PyAny>),
}

/// Estimation of missing inertias.
pub(crate) fn estimate(density: Option<f64>, total_mass: Option<f64>) -> PyResult<Option<InertiaEstimate>> {
    Ok(match (density, total_mass) {
        (Some(density), _) => Some(InertiaEstimate::Density(positive("inertia_from_density", density)?)),
        (None, Some(mass)) => Some(InertiaEstimate::TotalMass(positive("inertia_from_total_mass", mass)?)),
        (None, None) => None,
    })
}

/// Loads a robot.
///
/// Parameters
/// ----------
/// robot : str or os.PathLike, default "fanuc_r2000_210f"
///     A ``robot.toml``, a folder with one, a bare ``.urdf`` or ``.xacro``, or the name of a shipped robot.
/// tcp : str, optional
///     Link to use as tool centre point instead of the file's.
/// packages : dict of str to path, optional
///     Folders of ROS packages by name, for ``package://name/...``.
/// arguments : dict of str to str, optional
///     Values of ``$(arg name)`` in xacro files.
/// inertia_from_density : float, optional
///     Density (kg/m³) for estimating missing inertias from the meshes.
/// inertia_from_total_mass : float, optional
///     Mass of the whole arm (kg) for estimating missing inertias.
/// waive_inertia : sequence of str, optional
///     Links whose inertia may be rank deficient.
///
/// Returns
/// -------
/// Robot
///
/// Raises
/// ------
/// flexarm.InputError
///     With file, line, what was found and how to fix it.
///
/// Examples
/// --------
/// >>> flexarm.load("three_beams").name
/// 'three_beams'
#[pyfunction]
#[pyo3(signature = (robot=None, *, tcp=None, packages=None, arguments=None, inertia_from_density=None,
                    inertia_from_total_mass=None, waive_inertia=None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn load(
    py: Python<'_>,
    robot: Option<&Bound<'_, PyAny>>,
    tcp: Option<String>,
    packages: Option<Bound<'_, PyDict>>,
    arguments: Option<Bound<'_, PyDict>>,
    inertia_from_density: Option<f64>,
    inertia_from_total_mass: Option<f64>,
    #[pyo3(from_py_with = texts)] waive_inertia: Option<Vec<String>>,
) -> PyResult<PyRobot> {
    crate::command::name_keywords();
    let given = robot.map_or(Ok(PathBuf::from("fanuc_r2000_210f")), |given| path("robot", given))?;
    let found = shipped(&given)?;
    let choices = PyDict::new(py);
    let estimate = estimate(inertia_from_density, inertia_from_total_mass)?;
    let mut urdf = ReadOptions {
        search_paths: flexarm::robots::search_paths_from_environment(),
        inertia_from_mesh: estimate,
        waive: waive_inertia.clone().unwrap_or_default(),
        ..ReadOptions::default()
    };
    for (name, folder) in packages.iter().flat_map(|packages| packages.iter()) {
        urdf.packages.push((name.extract()?, path("packages", &folder)?));
    }
    for (name, value) in arguments.iter().flat_map(|arguments| arguments.iter()) {
        urdf.arguments.push((name.extract()?, value.str()?.extract()?));
    }
    // A pickle of the robot loads it again with the same arguments.
    choices.set_item("tcp", &tcp)?;
    choices.set_item("packages", packages)?;
    choices.set_item("arguments", arguments)?;
    choices.set_item("inertia_from_density", inertia_from_density)?;
    choices.set_item("inertia_from_total_mass", inertia_from_total_mass)?;
    choices.set_item("waive_inertia", waive_inertia)?;
    let options = LoadOptions { tcp, urdf };
    let arm = py.detach(|| RobotSource::new(&found, &options).load()).or_raise()?;
    let path = std::path::absolute(&found).unwrap_or(found);
    let again = ("load", (path, choices).into_pyobject(py)?.into_any().unbind());
    Ok(PyRobot { robot: Arc::new(arm.robot().clone()), again })
}

/// Returns a path, or a shipped robot by its name or by its path in the checkout, `robots/NAME`.
fn shipped(given: &Path) -> PyResult<PathBuf> {
    let name = given.strip_prefix("robots").ok().filter(|_| !given.exists());
    flexarm_cli::shipped_robot(name.unwrap_or(given)).or_raise()
}

/// Creates a robot from values: the keys of a robot file as a dict, possibly modified.
///
/// :class:`RobotBuilder` writes the keys by calls, and also links and joints if there is no URDF.
///
/// Parameters
/// ----------
/// keys : dict
///     Contents of ``robot.toml``: ``urdf``, ``tcp``, ``payload``, ``flexible_link``, ``drive``,
///     ... (``flexarm format robot`` prints all). Arrays are converted to lists; ``format = 1`` is
///     optional.
/// folder : path, default "."
///     Folder to which paths in the keys are relative.
/// urdf : str, optional
///     Text of a URDF or xacro, instead of the file that the keys name.
///
/// Returns
/// -------
/// Robot
///
/// Examples
/// --------
/// >>> base = flexarm.load("one_beam").path.parent
/// >>> robot = flexarm.robot({"urdf": "one_beam.urdf"}, folder=base)
/// >>> robot.flexible().n_elastic
/// 0
#[pyfunction]
#[pyo3(signature = (keys, folder=None, *, urdf=None))]
pub(crate) fn robot(
    py: Python<'_>,
    keys: &Bound<'_, PyDict>,
    folder: Option<PathBuf>,
    urdf: Option<String>,
) -> PyResult<PyRobot> {
    crate::command::name_keywords();
    let wrong = |what: String| PyValueError::new_err(format!("keys: {what}"));
    let json: String = py.import("flexarm._build")?.call_method1("json_of", (keys,))?.extract()?;
    let mut values: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&json).map_err(|error| wrong(error.to_string()))?;
    values.entry("format").or_insert(1.into());
    if urdf.is_some() {
        values.entry("urdf").or_insert("robot.urdf".into());
    }
    let text = toml::to_string(&values).map_err(|error| wrong(error.to_string()))?;
    let folder = folder.unwrap_or_else(|| PathBuf::from("."));
    let folder = std::path::absolute(&folder).unwrap_or(folder);
    let path = folder.join(VALUES);
    let read = ReadOptions { search_paths: flexarm::robots::search_paths_from_environment(), ..ReadOptions::default() };
    let options = LoadOptions { tcp: None, urdf: read };
    let description = urdf.as_deref().map(Description::Text);
    let source = RobotSource { text: Some(&text), description, ..RobotSource::new(&path, &options) };
    let made = py.detach(|| source.load());
    let arm = made.map_err(|error| of_keys(exception(error), py, &path))?;
    let again = ("robot", (keys.copy()?, folder, urdf).into_pyobject(py)?.into_any().unbind());
    Ok(PyRobot { robot: Arc::new(arm.robot().clone()), again })
}

/// Placeholder for the file of a robot made from values.
const VALUES: &str = "robot of values";

/// Removes line and column from an exception, since they refer to a text that the user has not
/// seen.
fn of_keys(error: PyErr, py: Python<'_>, path: &Path) -> PyErr {
    let value = error.value(py);
    let (message, place) = (value.to_string(), format!("{}:", path.display()));
    let mut parts = message.split(&place);
    let first = parts.next().unwrap_or_default().to_owned();
    let text = parts.fold(first, |text, part| {
        let rest = part.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':').trim_start();
        format!("{text}keys: {rest}")
    });
    match text == message {
        true => error,
        false => PyErr::from_type(error.get_type(py), text),
    }
}

fn positive(what: &str, x: f64) -> PyResult<f64> {
    match x.is_finite() && x > 0.0 {
        true => Ok(x),
        false => Err(pyo3::exceptions::PyValueError::new_err(format!("{what} must be positive, found {x}"))),
    }
}

/// Lists errors and warnings about a robot and a motion, with the reference values.
///
/// Parameters
/// ----------
/// robot : str or os.PathLike
///     As for :func:`load`.
/// motion : str or os.PathLike, optional
///     A file or the name of a shipped motion.
///
/// Returns
/// -------
/// list of dict
///     With the keys severity, code, where, message and help, as ``flexarm check --json``.
#[pyfunction]
#[pyo3(signature = (robot, motion=None))]
pub(crate) fn check<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyAny>,
    motion: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    crate::command::name_keywords();
    let robot = shipped(&path("robot", robot)?)?;
    let motion = motion.map(|motion| path("motion", motion)).transpose()?;
    let motion = motion.map(|motion| flexarm_cli::shipped_motion(&motion));
    let urdf = ReadOptions { search_paths: flexarm::robots::search_paths_from_environment(), ..ReadOptions::default() };
    let options = LoadOptions { tcp: None, urdf };
    let findings = py.detach(|| {
        let input = flexarm::motions::MotionOptions::default();
        flexarm::robots::check_with_motion(&robot, motion.as_deref(), &input, None, &options)
    });
    plain(py, &findings)
}
