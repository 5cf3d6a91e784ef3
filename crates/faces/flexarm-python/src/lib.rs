//! The Python package `flexarm`: the facade one to one, numpy in and out, and the command line.
//!
//! A module per thing that can be held (`robot`, `motion`, `arm`, `run`, ...); what all share is how arrays come in and go out
//! (`arrays`), how errors become exceptions (`failure`) and caveats warnings (`caveat`), and how long calls give back the
//! interpreter's lock and are ended by Ctrl-C (`watch`). What needs no speed is Python, in `python/flexarm`.
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
mod robot;
mod run;
mod scenario;
mod sensitivity;
mod sweep;
mod table;
mod values;
mod watch;

/// The extension module; `flexarm/__init__.py` gives its names on.
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
    use crate::live::PyLive;
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
    use crate::parts::restore;
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

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
