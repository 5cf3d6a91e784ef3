//! The command line inside the module.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Once;

use pyo3::prelude::*;

/// Makes messages name keyword arguments, from the first call on, unless the process is a command
/// line, which has set flag names before.
pub(crate) fn name_keywords() {
    static NAMED: Once = Once::new();
    NAMED.call_once(|| {
        flexarm::settings::name_settings(crate::names::NAMES);
    });
}

/// Registers a folder of robots and trajectories.
#[pyfunction]
pub(crate) fn ship_from(folder: PathBuf) {
    flexarm_cli::ship_from(folder);
}

/// Runs a command line, program name first, and returns the exit code of the process.
///
/// Assumes that it owns the process: signals stop the command, messages name flags.
#[pyfunction]
pub(crate) fn run_command(py: Python<'_>, line: Vec<OsString>) -> u8 {
    py.detach(|| flexarm_cli::run(line))
}
