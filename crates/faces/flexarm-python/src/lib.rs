//! The Python package `flexarm`: the facade one to one, with numpy arrays, and the command line.
//!
//! One module per class (`robot`, `motion`, `arm`, `run`, ...). Shared modules: array conversion
//! (`arrays`), errors as exceptions (`failure`), caveats as warnings (`caveat`), and long calls
//! that release the GIL and can be stopped by Ctrl-C (`watch`). Parts that need no speed are
//! written in Python, in `python/flexarm`.
#![allow(non_snake_case, reason = "the letters of the matrices")]

mod answers;
mod arm;
mod arrays;
mod caveat;
mod command;
mod compensate;
mod deflections;
mod failure;
mod figures;
mod identify;
mod linear;
mod links;
mod live;
mod lobes;
mod map;
mod model;
mod motion;
mod names;
mod new;
mod operating_point;
mod parts;
mod restore;
mod robot;
mod robot_methods;
mod run;
mod run_arguments;
mod scenario;
mod sensitivity;
mod sweep;
mod table;
mod values;
mod watch;

/// The extension module; `flexarm/__init__.py` re-exports its names.
#[pyo3::pymodule]
mod _flexarm {
    #[pymodule_export]
    use crate::answers::{PyModes, PyResponse, PyStatics};
    #[pymodule_export]
    use crate::arm::PyArm;
    #[pymodule_export]
    use crate::command::{run_command, ship_from};
    #[pymodule_export]
    use crate::compensate::{PyCompensated, compensate};
    #[pymodule_export]
    use crate::deflections::PyDeflections;
    #[pymodule_export]
    use crate::identify::{identify, plan_measurements};
    #[pymodule_export]
    use crate::linear::PyLinear;
    #[pymodule_export]
    use crate::links::{export_link, import_link, reduce};
    #[pymodule_export]
    use crate::live::{PyLive, PyLiveState};
    #[pymodule_export]
    use crate::lobes::lobes;
    #[pymodule_export]
    use crate::map::{PyMap, map};
    #[pymodule_export]
    use crate::model::PyModel;
    #[pymodule_export]
    use crate::motion::{PyMotion, motion_of_pieces};
    #[pymodule_export]
    use crate::new::new_robot;
    #[pymodule_export]
    use crate::operating_point::PyOperatingPoint;
    #[pymodule_export]
    use crate::restore::restore;
    #[pymodule_export]
    use crate::robot::{PyRobot, check, load, robot};
    #[pymodule_export]
    use crate::run::{PyRun, PySample};
    #[pymodule_export]
    use crate::scenario::{PyLoad, PyPayload, PyScenario};
    #[pymodule_export]
    use crate::sensitivity::sensitivity;
    #[pymodule_export]
    use crate::sweep::sweep;

    /// Bounds the number of threads, and makes the recordings for the viewer available.
    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyAnyMethods as _;
        // Threads that are started here would be missing in a process that forks.
        if let Some(processors) = flexarm_cli::fewer_threads() {
            let environment = module.py().import("os")?.getattr("environ")?;
            environment.set_item(flexarm_cli::THREADS, processors.to_string())?;
        }
        #[cfg(feature = "rerun")]
        flexarm_rerun::install();
        Ok(())
    }

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
