//! Methods of robots: arms, motions and figures made of them.
//!
//! Joints are in the order of `Robot.joints`; positions in rad or m. Not here: loading
//! (`robot.rs`).

use std::path::Path;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arm::PyArm;
use crate::arrays::{array, numbers};
use crate::caveat;
use crate::failure::OrRaise;
use crate::model::PyModel;
use crate::motion::{MotionOptionsArgs, PyMotion, load_motion};
use crate::robot::PyRobot;
use crate::values::{maybe_whole, modelling, plain};

impl PyRobot {
    /// Returns a limit of the actuated joints.
    fn limits_of<'py, const N: usize>(
        &self,
        py: Python<'py>,
        of: impl Fn(&flexarm::robots::Coordinate) -> [f64; N],
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = self.robot.rigid_model().or_raise()?;
        let actuated = &model.coordinates()[..model.n_actuated()];
        let values: Vec<f64> = actuated.iter().flat_map(of).collect();
        match N {
            1 => array(py, [actuated.len()], values),
            _ => array(py, [actuated.len(), N], values),
        }
    }
}

#[pymethods]
impl PyRobot {
    /// Name of the robot.
    #[getter]
    fn name(&self) -> &str {
        &self.robot.name
    }

    /// File that was loaded.
    #[getter]
    fn path(&self) -> &Path {
        &self.robot.path
    }

    /// Names of the actuated joints, in the order of all poses (tuple of str).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let model = self.robot.rigid_model().or_raise()?;
        PyTuple::new(py, model.coordinates()[..model.n_actuated()].iter().map(|c| c.joint.clone()))
    }

    /// Lower and upper limit of each joint, (n, 2) (rad or m); infinite if there is no limit.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.limits_of(py, |c| [c.limits.lower, c.limits.upper])
    }

    /// Pose at which the robot is analysed by default, (n,) (rad or m): the start of its own motion,
    /// or zero.
    #[getter]
    fn start_pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pose = self.robot.start_pose().or_raise()?;
        array(py, [pose.len()], pose)
    }

    /// Maximum speed of each joint, (n,) (rad/s or m/s).
    #[getter]
    fn velocity_limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.limits_of(py, |c| [c.limits.velocity])
    }

    /// Link that carries the tool centre point.
    #[getter]
    fn tcp_link(&self) -> &str {
        self.robot.tcp().0
    }

    /// File of the robot's default motion, or None.
    #[getter]
    fn default_motion(&self) -> Option<&Path> {
        self.robot.default_trajectory.as_deref()
    }

    /// Probable mistakes in the robot, and notes (list of flexarm.Caveat).
    #[getter]
    fn caveats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyList>> {
        caveat::list(py, &self.robot.caveats())
    }

    /// The rigid tree with the payload, for rigid-body algorithms (Model).
    #[getter]
    fn model(&self) -> PyResult<PyModel> {
        Ok(PyModel::new(self.robot.recursions().or_raise()?))
    }

    /// Adds flexible links and drives, which takes milliseconds; the arm can then be reused.
    ///
    /// Parameters
    /// ----------
    /// links : {"rigid", "lumped", "modal"}, optional
    ///     Model of the flexible links. Default: that of the robot file.
    /// drives : {"rigid", "elastic", "servo"}, optional
    ///     Model of the drives: exactly on the motion, with elastic gearboxes, or by torque under
    ///     servos.
    /// segments : int, optional
    ///     Number of rigid parts of lumped links.
    /// modes : int, optional
    ///     Number of modes of modal links.
    ///
    /// Returns
    /// -------
    /// Arm
    #[pyo3(signature = (*, links=None, drives=None, segments=None, modes=None))]
    fn flexible(
        slf: &Bound<'_, Self>,
        links: Option<&str>,
        drives: Option<&str>,
        #[pyo3(from_py_with = maybe_whole)] segments: Option<usize>,
        #[pyo3(from_py_with = maybe_whole)] modes: Option<usize>,
    ) -> PyResult<PyArm> {
        let modelling = modelling(links, drives, segments, modes)?;
        let robot = slf.get().robot.clone();
        let arm = slf.py().detach(|| robot.model(&modelling)).or_raise()?;
        Ok(PyArm::new(slf.clone().unbind(), arm))
    }

    /// Reads a motion for the robot: waypoints, tables, ROS messages and bags, tool paths, robot programs.
    ///
    /// Parameters
    /// ----------
    /// motion : str or os.PathLike, optional
    ///     A file or the name of a shipped motion. Default: the robot's own.
    /// topic : str, optional
    ///     Topic of a bag.
    /// columns : str, optional
    ///     Columns of time and joints in a table: ``"t=Time[ms],joint_1=A1[deg]"``.
    /// round_corners : float, optional
    ///     Duration (s) of blends that round corners, where the velocity jumps.
    ///
    /// Returns
    /// -------
    /// Motion
    #[pyo3(signature = (motion=None, *, topic=None, columns=None, round_corners=None))]
    fn motion(
        slf: &Bound<'_, Self>,
        motion: Option<&Bound<'_, PyAny>>,
        topic: Option<String>,
        columns: Option<String>,
        round_corners: Option<f64>,
    ) -> PyResult<PyMotion> {
        let args = MotionOptionsArgs { topic, columns, round_corners };
        load_motion(slf, motion, args)
    }

    /// Returns what was loaded, with kinematics and dynamics at a pose.
    ///
    /// A dict as ``flexarm inspect --json``.
    ///
    /// Parameters
    /// ----------
    /// q, velocity : array_like, shape (n,), optional
    ///     Joints (rad or m) and their velocities. Default: :attr:`start_pose` and zero.
    #[pyo3(signature = (q=None, velocity=None))]
    fn inspect<'py>(
        &self,
        py: Python<'py>,
        q: Option<&Bound<'py, PyAny>>,
        velocity: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let n = self.robot.rigid_model().or_raise()?.nv();
        let one = |name: &str, value: Option<&Bound<'py, PyAny>>| -> PyResult<Option<Vec<f64>>> {
            value.map(|value| Ok(numbers(name, value, &[(n, "joints")], false)?.values().to_vec())).transpose()
        };
        let (q, velocity) = (one("q", q)?, one("velocity", velocity)?);
        let found = flexarm::inspect(&self.robot, q.as_deref(), velocity.as_deref()).or_raise()?;
        caveat::answer(py, &found, &found.caveats)
    }

    /// Keys, folder, text of the URDF and options of loading, for `flexarm.RobotBuilder`.
    fn _made_of<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (function, arguments) = &self.again;
        let arguments = arguments.bind(py);
        if *function == "robot" {
            let part = |k: usize| arguments.get_item(k);
            return Ok((part(0)?, part(1)?, part(2)?, PyDict::new(py)).into_pyobject(py)?.into_any());
        }
        let (path, folder) = (&self.robot.path, self.robot.path.parent().unwrap_or(Path::new(".")));
        let keys = match path.extension().is_some_and(|ending| ending == "toml") {
            true => {
                let text = std::fs::read_to_string(path)?;
                let keys: toml::Table =
                    toml::from_str(&text).map_err(|error| PyValueError::new_err(error.to_string()))?;
                plain(py, &keys)?
            }
            false => plain(py, &serde_json::json!({ "urdf": path }))?,
        };
        Ok((keys, folder, py.None(), arguments.get_item(1)?).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> PyResult<String> {
        let n = self.robot.rigid_model().or_raise()?.n_actuated();
        let (links, drives) = (self.robot.flexible_links.len(), self.robot.drives.len());
        Ok(format!("<Robot {:?}: {n} joints, {links} flexible links, {drives} drives>", self.robot.name))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("flexarm._show")?.call_method1("robot_html", (slf,))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (function, arguments) = &self.again;
        Ok((py.import("flexarm._pickle")?.getattr(*function)?, arguments).into_pyobject(py)?.into_any())
    }
}
